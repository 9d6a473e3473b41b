"""What is reported of a solution: its certificate, its flags, and under which law it holds."""

from __future__ import annotations

import math

import numpy as np

from ..model.bond import LINEAR
from ..residual.accuracy import HEIGHT_NOISE, certificate, on_plate
from ..residual.shape import Solution
from .methods import Answer
from .question import Question
from .result import Equilibrium


def certify(posed: Question, state: str, solved: Answer, tol: float) -> Equilibrium:
    """Turn a solution into an `Equilibrium` with its certificate and flags."""
    problem, x = solved.problem, solved.x
    effective = posed.effective_law
    s = problem.scalars(x)
    profile = solved.profile
    theta, heights = (profile.values[:, :, i] * s.A for i in (0, 4))
    opened = s.beta1 / s.beta0 * heights if s.beta0 else np.zeros(1)  # u = y/y0
    tip_free = problem.phases[0].lost is not None
    noise = HEIGHT_NOISE
    if not tip_free:
        # A tip that is held to the plate has no height: what it has is the error of all heights.
        noise = max(noise, min(abs(float(heights[0, 0])) / float(np.abs(heights).max()), tol))
    within = bool(opened.max() <= 1.0 + HEIGHT_NOISE)  # in u = y/y0
    source = Solution(problem, x, effective)
    present = {
        "y > y0": bool(opened.max() > effective.holds_to + HEIGHT_NOISE),
        "p < 0": s.alpha < 0.0,
        "y < 0": heights.min() < -noise * np.abs(heights).max(),
        "alpha1 > 0": s.alpha1 > 0.0,
        "overhang": np.abs(theta).max() > 0.5 * math.pi,
        "tip on plate": on_plate(profile, noise),
        "self-contact": np.ptp(theta) > math.pi and source.shape().crosses_itself(),
    }
    missed = certificate(effective, profile, tip_free=tip_free)
    certified = solved.error <= tol and missed <= tol
    return Equilibrium(
        rod=posed.rod,
        law=effective.name if posed.law is not None or not within else LINEAR.name,
        beta0=s.beta0,
        lam=s.lam,
        alpha1=s.alpha1,
        answered=posed.asked,
        error=solved.error,
        certificate=missed,
        tol=tol,
        state=state,
        status="certified" if certified else "not-certified",
        flags=tuple(name for name, is_so in present.items() if is_so),
        stats=solved.stats,
        source=source,
    )
