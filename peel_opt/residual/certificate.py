"""What a solution must satisfy beside the equations it was solved with: its certificate."""

from __future__ import annotations

import numpy as np

from ..model.bond import CohesiveLaw
from ..model.equations import Scalars
from .discretisation import Profile

#: Height below which a tip lies on the plate, as a share of the largest.
HEIGHT_NOISE = 1e-9


def on_plate(profile: Profile, noise: float) -> bool:
    """Whether the tip of a shape lies on the plate, within a share of the largest height."""
    heights = profile.values[:, :, 4]
    return bool(abs(heights[0, 0]) <= noise * np.abs(heights).max())


def certificate(law: CohesiveLaw, profile: Profile, *, tip_free: bool = True) -> float:
    """How far a solution misses the equation that follows from those it was solved with.

    The larger of |p - Phi(y_tip)/y_tip| / T0, which the two first integrals of (12) make zero, and
    of |theta| at the plate [rad], of (14).  One of them is among the equations, the other is not.

    A rod whose tip is held to the plate satisfies p y_tip = Phi(y_tip) for any p, and it cannot be
    divided by y_tip: without ``tip_free`` the first is |p y_tip - Phi(y_tip)| / (T0 y0).
    """
    s = profile.scalars
    tip, edge = s.A * profile.values[0, 0, 4], s.A * profile.values[-1, -1, 0]
    defect = first_integral_defect(law, s, float(tip))
    if not tip_free and s.beta0:
        defect *= abs(float(tip)) * s.beta1 / s.beta0
    return max(defect, abs(float(edge)))


def first_integral_defect(law: CohesiveLaw, scalars: Scalars, tip_height: float) -> float:
    """|p - Phi(y_tip)/y_tip| / T0, which the two first integrals of (12) make zero.

    ``tip_height`` is y/sbar.  At beta0 = 0, where there is no T0, the identity of the linear
    law alpha1 = -beta1 y_tip / 2 is divided by beta1 instead.
    """
    if scalars.beta0 == 0.0:
        return float(abs(scalars.alpha1 / scalars.beta1 + 0.5 * tip_height))
    u = tip_height * scalars.beta1 / scalars.beta0
    return float(abs(scalars.alpha1 / scalars.beta0 + law.mean_drop(u)))
