"""Length along a branch, measured in the scalars only.

    d(length)^2 = |d(A, alpha1/(1+beta0), asinh(lambda/pi^4), asinh(sigma))|^2,

so that it depends neither on the mesh nor on the method nor on the phases.
"""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

from ..model.equations import Scalars, symbolic
from ..model.groups import PI4
from .compiled import Compiled


def coordinates(s: Scalars) -> Any:
    """Coordinates in which the length of a branch is Euclidean, as a CasADi expression."""
    return ca.vertcat(s.A, s.alpha1 / (1.0 + s.beta0), ca.asinh(s.lam / PI4), ca.asinh(s.sigma))


def _chart_function() -> ca.Function:
    s, scalars = symbolic()
    values = coordinates(scalars)
    return ca.Function("chart", [s], [values, ca.densify(ca.jacobian(values, s))])


_CHART = Compiled(_chart_function())


def chart(scalars: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Coordinates in which the length of a branch is measured, and their gradient."""
    value, gradient = _CHART(scalars)
    return value, gradient
