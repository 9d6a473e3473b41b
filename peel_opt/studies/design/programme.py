"""The nonlinear programme of a design, solved by IPOPT.

    minimise    the logarithm of one free number, or its negative
    subject to  the blocks of all requirements,  log(quantity / wanted) = 0, >= 0 or <= 0,
                bounds of the free numbers, and eta/y0 where the branch can be walked.

With ``elastic`` the requirements may be missed, at a price per logarithm.  They are met where they
can be if no multiplier is larger than the price; without an objective any price finds what comes
closest to a design that does not exist.  A programme is compiled once for its structure; all
numbers of a question are parameters.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import Any

import casadi as ca
import numpy as np

from ...model.rod import RATIOS
from ...residual.programme import SOLVED, silent
from .blocks import Block, Structure
from .material import Material

#: Largest scaled violation, and iterations.
TOL, MOST_ITERATIONS = 1e-9, 80

#: Distance of log(eta/y0) from the ends of the range, so that rounding does not leave it.
MARGIN = 1e-6

#: Price of missing a requirement by 1 in its logarithm, while the objective changes by 1 in its own:
#: the first, which is above most multipliers and so low that the programme is well scaled, the factor
#: by which it is raised where it is not, and the last.
PRICE, PRICE_FACTOR, LAST_PRICE = 100.0, 10.0, 1e8

#: Part of the price from which on a multiplier is at it, which the barrier keeps a little below.
AT_PRICE = 0.99


@dataclass(frozen=True, eq=False)
class Outcome:
    """What IPOPT found.

    Parameters
    ----------
    z : ndarray
        Logarithms of the free numbers.
    solved : bool
    status : str
    iterations : int
    multipliers : ndarray
        d(objective)/d(log wanted) of each requirement.
    price : float
        Of missing a requirement.
    """

    z: np.ndarray
    solved: bool
    status: str
    iterations: int
    multipliers: np.ndarray
    price: float

    @property
    def pays(self) -> bool:
        """Whether a requirement is missed for the objective: its multiplier is then the price."""
        return bool(np.abs(self.multipliers).max() >= AT_PRICE * self.price)


def solve(
    material: Material,
    blocks: Sequence[Block],
    start: np.ndarray,
    objective: np.ndarray,
    *,
    elastic: bool,
    reach: float = math.inf,
    price: float = PRICE,
) -> Outcome:
    """Solve from a rod whose blocks are solved.

    A Hessian by updates is enough where the constraints determine the solution, as they mostly
    do, and ten times cheaper than that of a fold.

    Parameters
    ----------
    material : Material
    blocks : sequence of Block
    start : ndarray, shape (m,)
        Logarithms of the free numbers at which the blocks were made.
    objective : ndarray, shape (m,)
        Weights of the logarithms in what is minimised.
    elastic : bool
    reach : float
        How far the logarithms may move from the start.
    price : float
        Of missing a requirement by 1 in its logarithm, if ``elastic``.

    Returns
    -------
    Outcome
    """
    m, count = len(start), len(blocks)
    programme = _programme(tuple(b.structure for b in blocks), m, elastic)
    slack = _slack(blocks) if elastic else np.empty(0)
    at = np.concatenate([start, slack, *(b.start / b.scale for b in blocks)])
    numbers: list[Any] = [
        material.offset,
        material.matrix.ravel(order="F"),
        objective,
        [math.log(b.requirement.value) for b in blocks],
        [math.log(b.requirement.given) if b.requirement.given > 0.0 else 0.0 for b in blocks],
        *(b.scale for b in blocks),
        [price],
    ]
    own: np.ndarray = np.concatenate(numbers)
    residuals, rows = programme.residuals, programme.row_scale(at, own)
    senses = [b.requirement.sense for b in blocks]
    low, high = math.log(RATIOS[0]) + MARGIN, math.log(RATIOS[1]) - MARGIN
    lower = [*np.zeros(residuals), *(-math.inf if v == "at_most" else 0.0 for v in senses), low]
    upper = [*np.zeros(residuals), *(math.inf if v == "at_least" else 0.0 for v in senses), high]
    unbounded = np.full(programme.size - m, math.inf)
    least = [np.zeros(len(slack)), *(b.least / b.scale for b in blocks)]
    result = programme.solver(
        x0=at,
        p=np.concatenate([own, rows]),
        lbg=np.array(lower),
        ubg=np.array(upper),
        lbx=np.concatenate([np.maximum(material.lower, start - reach), *least]),
        ubx=np.concatenate([np.minimum(material.upper, start + reach), unbounded]),
    )
    stats = programme.solver.stats()
    status = str(stats["return_status"])
    found = result["x"].full().ravel()
    return Outcome(
        z=np.clip(found[:m], material.lower, material.upper),
        solved=status in SOLVED and bool(np.all(np.isfinite(found))),
        status=status,
        iterations=int(stats["iter_count"]),
        multipliers=-result["lam_g"].full().ravel()[residuals : residuals + count],
        price=price,
    )


class _Programme:
    """A programme for blocks of some structure, m free numbers, and parameters.

    The parameters are offset, matrix and objective, the logarithms of what is wanted and given,
    the scales of the unknowns of all blocks, the price, and the scales of the equations that vanish.
    """

    def __init__(self, structures: tuple[Structure, ...], m: int, elastic: bool) -> None:
        count, sizes = len(structures), [s.size for s in structures]
        slacks = 2 * count if elastic else 0
        self.size = m + slacks + sum(sizes)
        u = ca.MX.sym("u", self.size)
        z, s, *unknowns = _split(u, [m, slacks, *sizes])
        own = ca.MX.sym("own", 4 + 4 * m + 2 * count + sum(sizes))
        parts = [3, 3 * m, m, count, count, *sizes, 1]
        offset, matrix, weights, wanted, given, *scales, price = _split(own, parts)
        logs = offset + ca.mtimes(ca.reshape(matrix, 3, m), z)
        zeros, gaps = [], []
        for i, (structure, w, scale) in enumerate(zip(structures, unknowns, scales, strict=True)):
            constraints, log_value = structure.expressions(w * scale, logs, given[i])
            zeros.append(constraints)
            missed = s[2 * i] - s[2 * i + 1] if elastic else 0.0
            gaps.append(log_value - wanted[i] + missed)
        equations = ca.vertcat(*zeros)
        self.residuals = int(equations.numel())
        rows = ca.MX.sym("rows", self.residuals)
        log_ratio = (logs[0] - logs[1]) / 3.0 - logs[2]
        g = ca.vertcat(equations * rows, *gaps, log_ratio)
        f = ca.dot(weights, z) + (price * ca.sum1(s) if elastic else 0.0)
        problem = {"x": u, "p": ca.vertcat(own, rows), "f": f, "g": g}
        jacobian = ca.jacobian(equations, u)
        self._sizes = ca.Function("sizes", [u, own], [ca.sum2(ca.fabs(jacobian))])
        settings = silent(
            TOL,
            MOST_ITERATIONS,
            hessian_approximation="limited-memory",
            bound_relax_factor=0.0,
            mu_init=1e-3,  # the start is a solution of the blocks: stay near it
        )
        self.solver = ca.nlpsol("design", "ipopt", problem, settings)

    def row_scale(self, at: np.ndarray, own: np.ndarray) -> np.ndarray:
        """One over the size of each equation's gradient at the start."""
        sizes = np.asarray(self._sizes(at, own).full()).ravel()
        return 1.0 / np.maximum(sizes, 1e-12)


@lru_cache(maxsize=32)
def _programme(structures: tuple[Structure, ...], m: int, elastic: bool) -> _Programme:
    return _Programme(structures, m, elastic)


def _split(v: ca.MX, sizes: Sequence[int]) -> list[ca.MX]:
    """Cut a column into parts, of which some may be empty."""
    edges = np.concatenate([[0], np.cumsum(sizes)]).tolist()
    return [v[a:b] if b > a else ca.MX(0, 1) for a, b in pairwise(edges)]


def _slack(blocks: Sequence[Block]) -> np.ndarray:
    """What each requirement misses at the start: below, above."""
    gaps = np.array([math.log(b.value / b.requirement.value) for b in blocks])
    return np.stack([np.maximum(-gaps, 0.0), np.maximum(gaps, 0.0)], axis=-1).ravel()
