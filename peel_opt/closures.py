"""Questions as equations on the scalars: what is given closes the residual of (12).

(12) with (14) leaves two of its scalars open.  "Pressure at given length" fixes the rod's
ratio and sbar, "length at given pressure" the ratio and p, the paper's dual problem beta0
and lambda; with the length open, theta'(1) = 0 in (14) is the Weierstrass-Erdmann
condition (49).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np

from .elastica import PI4, Scalars
from .transcription.compiled import Compiled

#: Each closure as an expression that vanishes, of the scalars and the given value.
EQUATIONS: dict[str, Callable[[Scalars, Any], Any]] = {
    "ratio": lambda s, r: s.lam + PI4 - r * s.sigma**4,  # r = eta/y0
    "length": lambda s, sigma: s.sigma - sigma,  # sbar/eta
    "pressure": lambda s, P: s.alpha1 - (P - 1.0) * s.beta0,  # p/T0
    "lam": lambda s, lam: s.lam - lam,
    "alpha1": lambda s, alpha1: s.alpha1 - alpha1,
    "amplitude": lambda s, A: s.A - A,  # minus the tip angle
}


@dataclass(frozen=True)
class Closure:
    """One given number: a key of `EQUATIONS` and its value."""

    kind: str
    value: float


@lru_cache(maxsize=64)
def _compiled(kinds: tuple[str, ...]) -> Compiled:
    s, given = ca.SX.sym("s", 4), ca.SX.sym("given", len(kinds))
    scalars = Scalars(*ca.vertsplit(s))
    equations = ca.vertcat(*(EQUATIONS[k](scalars, given[i]) for i, k in enumerate(kinds)))
    gradients = (ca.densify(ca.jacobian(equations, v)) for v in (s, given))
    return Compiled(ca.Function("closures", [s, given], [equations, *gradients]))


def rows(*closures: Closure) -> Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]:
    """Return the closures as extra rows for `newton.correct`."""
    function = _compiled(tuple(c.kind for c in closures))
    given = np.array([c.value for c in closures])

    def evaluate(scalars: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        values, gradient, _ = function(scalars, given)
        return values, gradient.reshape(len(given), 4, order="F")

    return evaluate


def sensitivity_to_given(closures: tuple[Closure, ...], scalars: np.ndarray) -> np.ndarray:
    """d(equations)/d(given values), shape (k, k)."""
    function = _compiled(tuple(c.kind for c in closures))
    given = np.array([c.value for c in closures])
    return function(scalars, given)[2].reshape(len(given), len(given), order="F")
