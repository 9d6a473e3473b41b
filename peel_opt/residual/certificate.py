"""p y_tip = Phi(y_tip), which the two first integrals of (12) demand of every solution."""

from __future__ import annotations

import numpy as np

from ..model.bond import CohesiveLaw
from ..model.equations import Scalars
from .discretisation import Profile

#: Height below which a tip lies on the plate, as a share of the largest.
HEIGHT_NOISE = 1e-9


def on_plate(profile: Profile) -> bool:
    """Whether the tip of a shape lies on the plate."""
    heights = profile.values[:, :, 4]
    return bool(abs(heights[0, 0]) <= HEIGHT_NOISE * np.abs(heights).max())


def certificate(law: CohesiveLaw, profile: Profile, held: bool) -> float:
    """What a solution misses the identity by.

    Parameters
    ----------
    law : CohesiveLaw
    profile : Profile
    held : bool
        Whether a tip on the plate counts as held down to it.
    """
    defect = held_tip_defect if held and on_plate(profile) else first_integral_defect
    return defect(law, profile.scalars, float(profile.scalars.A * profile.values[0, 0, 4]))


def held_tip_defect(law: CohesiveLaw, scalars: Scalars, tip_height: float) -> float:
    """|p y_tip - Phi(y_tip)| / (T0 y0), for a rod whose tip is held to the plate.

    The identity holds there for any p and cannot be divided by y_tip.
    """
    defect = first_integral_defect(law, scalars, tip_height)
    return defect * abs(tip_height * scalars.beta1 / scalars.beta0) if scalars.beta0 else defect


def first_integral_defect(law: CohesiveLaw, scalars: Scalars, tip_height: float) -> float:
    """|p - Phi(y_tip)/y_tip| / T0, which the two first integrals of (12) make zero.

    ``tip_height`` is y/sbar.  At beta0 = 0, where there is no T0, the identity of the linear
    law alpha1 = -beta1 y_tip / 2 is divided by beta1 instead.
    """
    if scalars.beta0 == 0.0:
        return float(abs(scalars.alpha1 / scalars.beta1 + 0.5 * tip_height))
    u = tip_height * scalars.beta1 / scalars.beta0
    return float(abs(scalars.alpha1 / scalars.beta0 + law.mean_drop(u)))
