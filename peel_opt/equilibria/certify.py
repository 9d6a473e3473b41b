"""What is reported of a solution: its certificate, its flags, and under which law it holds."""

from __future__ import annotations

import math

import numpy as np

from ..model.bond import LINEAR, CohesiveLaw
from ..model.equations import Scalars
from ..residual.shape import Solution
from .methods import Answer
from .posed import Posed
from .result import Equilibrium

#: Height above y0 (in u = y/y0) and below the plate (share of the largest) put down to rounding.
HEIGHT_NOISE = 1e-9


def report(posed: Posed, state: str, solved: Answer, tol: float) -> Equilibrium:
    """Turn a solution into an `Equilibrium` with its certificate and flags."""
    problem, x = solved.problem, solved.x
    effective = posed.effective_law
    s = problem.scalars(x)
    profile = problem.profile(x)
    theta, heights = (profile.values[:, :, i] * s.A for i in (0, 4))
    opened = s.beta1 / s.beta0 * heights if s.beta0 else np.zeros(1)  # u = y/y0
    within = bool(opened.max() <= 1.0 + HEIGHT_NOISE)
    source = Solution(problem, x, effective)
    present = {
        "y > y0": bool(opened.max() > effective.holds_to + HEIGHT_NOISE),
        "p < 0": s.alpha < 0.0,
        "y < 0": heights.min() < -HEIGHT_NOISE * np.abs(heights).max(),
        "alpha1 > 0": s.alpha1 > 0.0,
        "overhang": np.abs(theta).max() > 0.5 * math.pi,
        "tip on plate": abs(heights[0, 0]) <= HEIGHT_NOISE * np.abs(heights).max(),
        "self-contact": np.ptp(theta) > math.pi and source.shape().crosses_itself(),
    }
    held = state in ("other", "spurious") and present["tip on plate"]
    certificate = (held_tip_defect if held else first_integral_defect)(effective, s, float(heights[0, 0]))
    certified = solved.error <= tol and certificate <= tol
    return Equilibrium(
        rod=posed.rod,
        law=effective.name if posed.law is not None or not within else LINEAR.name,
        beta0=s.beta0,
        lam=s.lam,
        alpha1=s.alpha1,
        answered=posed.asked,
        error=solved.error,
        certificate=certificate,
        tol=tol,
        state=state,
        status="certified" if certified else "not-certified",
        flags=tuple(name for name, is_so in present.items() if is_so),
        stats=solved.stats,
        source=source,
    )


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
