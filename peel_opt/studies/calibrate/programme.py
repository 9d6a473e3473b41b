"""All observations and the material numbers as one sparse programme for IPOPT.

    minimise    1/2 sum rho(|r_i(u_i, q)|^2) + 1/2 ridge |q|^2
    subject to  g_i(u_i, q) = 0,   one block of equations (12), (14) for every observation.

The Hessian is Gauss-Newton's: the curvature of the constraints is weighted by residuals, and
computing it costs more than the iterations it saves (docs/calibration.md has the figures).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np

from ...base.checks import positive, whole
from ...base.errors import InvalidInput
from ...residual.programme import SOLVED, silent, unknown_scale
from .blocks import Block, Signature, block

#: Signatures in the order of the blocks, each with how many blocks of it follow each other.
Structure = tuple[tuple[Signature, int], ...]

#: Largest |q|: no material number is looked for further than a factor 1e8 from the reference rod.
FURTHEST = 18.4

#: Size of a step in q, for the scale of the constraints.
STEP = 0.1


@dataclass(frozen=True)
class Solver:
    """Options of the programme.

    Parameters
    ----------
    tol : float
        Of IPOPT, for the scaled problem.
    max_iterations : int
        A fit that converges takes ten to thirty.
    exact_hessian : bool
        Add the curvature of the constraints to the Hessian.

    Raises
    ------
    InvalidInput
        If one of them cannot be meant.
    """

    tol: float = 1e-10
    max_iterations: int = 60
    exact_hessian: bool = False

    def __post_init__(self) -> None:
        # IPOPT would say it only when the programme is built, and in its own words.
        object.__setattr__(self, "tol", positive("tol", self.tol))
        object.__setattr__(self, "max_iterations", whole("max_iterations", self.max_iterations, 1))
        if not isinstance(self.exact_hessian, bool):
            raise InvalidInput(f"exact_hessian must be True or False, got {self.exact_hessian!r:.60}.")


@dataclass(frozen=True, eq=False)
class State:
    """Unknowns of all blocks and their data, in the order of a structure.

    Parameters
    ----------
    q : ndarray, shape (3,)
    unknowns, data : list of ndarray
        u and d of each block.
    """

    q: np.ndarray
    unknowns: list[np.ndarray]
    data: list[np.ndarray]


@dataclass(frozen=True, eq=False)
class Outcome:
    """What IPOPT returned; ``solved`` only if its own status says so."""

    state: State
    solved: bool
    status: str
    iterations: int
    objective: float

    @property
    def tired(self) -> bool:
        """Whether it ran out of iterations somewhere."""
        return self.status == "Maximum_Iterations_Exceeded" and bool(np.all(np.isfinite(self.state.q)))


def solve(
    signatures: Sequence[Signature],
    start: State,
    bounds: tuple[np.ndarray, np.ndarray],
    delta: float | None,
    ridge: float,
    options: Solver,
) -> Outcome:
    """Solve the programme from a start.

    Parameters
    ----------
    signatures : sequence of Signature
        Of the blocks, in any order.
    start : State
    bounds : tuple of ndarray, shapes (3,)
        Of q; equal ones fix an entry.
    delta : float or None
        Scale of the pseudo-Huber loss; None for least squares.
    ridge : float
        Holds q near 0, the reference rod, where the data do not say where to go.
    """
    order = sorted(range(len(signatures)), key=lambda i: repr(signatures[i]))
    structure: list[tuple[Signature, int]] = []
    for i in order:
        if structure and structure[-1][0] == signatures[i]:
            structure[-1] = (signatures[i], structure[-1][1] + 1)
        else:
            structure.append((signatures[i], 1))
    programme = _build(tuple(structure), delta is not None, options)
    blocks = [block(signatures[i]) for i in order]
    u0, data = [start.unknowns[i] for i in order], [start.data[i] for i in order]
    scales = [_scale(b, u) for b, u in zip(blocks, u0, strict=True)]
    parts = [b.evaluate(u, start.q, d) for b, u, d in zip(blocks, u0, data, strict=True)]
    rows = [
        1.0 / np.maximum(np.abs(g_u) @ scale + STEP * np.abs(g_q).sum(axis=1), 1e-12)
        for (_, g_u, g_q, *_), scale in zip(parts, scales, strict=True)
    ]
    weights = np.concatenate([np.abs(part[4]) @ scale for part, scale in zip(parts, scales, strict=True)])
    size = 1.0 / max(float(np.median(weights[weights > 0.0], overwrite_input=False)), 1e-12) ** 2
    scale = np.concatenate([np.ones(3), *scales])
    low, high = np.full(scale.size, -np.inf), np.full(scale.size, np.inf)
    low[:3], high[:3] = bounds
    low[3 + programme.amplitudes] = 0.0
    result = programme.solver(
        x0=np.concatenate([start.q, *u0]) / scale,
        p=np.concatenate([scale, *rows, *data, [size, delta or 1.0, ridge]]),
        lbx=low,
        ubx=high,
        lbg=0.0,
        ubg=0.0,
    )
    stats = programme.solver.stats()
    z = result["x"].full().ravel() * scale
    status = str(stats["return_status"])
    found: list[np.ndarray] = list(start.unknowns)
    edges = np.cumsum([0, *(b.unknowns for b in blocks)])
    for place, i in enumerate(order):
        found[i] = z[3 + edges[place] : 3 + edges[place + 1]]
    return Outcome(
        state=State(z[:3], found, start.data),
        solved=status in SOLVED and bool(np.all(np.isfinite(z))),
        status=status,
        iterations=int(stats["iter_count"]),
        objective=float(result["f"]) / size - 0.5 * ridge * float(z[:3] @ z[:3]),
    )


def _scale(part: Block, u: np.ndarray) -> np.ndarray:
    """Size of each unknown; feet are shares of a phase, the origin is a length."""
    n = part.problem.size
    others = np.ones(part.unknowns - n)
    if part.signature.free_origin:
        others[-1] = max(abs(u[n - 2]), 1e-3)
    return np.concatenate([unknown_scale(part.problem, u[:n]), others])


@dataclass(frozen=True, eq=False)
class _Programme:
    solver: ca.Function
    amplitudes: np.ndarray  # places of A among the unknowns of all blocks


@lru_cache(maxsize=32)
def _build(structure: Structure, robust: bool, options: Solver) -> _Programme:
    """Compile the programme; all numbers of blocks are parameters, so that it serves many data."""
    parts = [block(signature) for signature, _ in structure]
    counts = [count for _, count in structure]
    sizes = [b.unknowns * n for b, n in zip(parts, counts, strict=True)]
    rows = [b.constraints * n for b, n in zip(parts, counts, strict=True)]
    lengths = [b.data * n for b, n in zip(parts, counts, strict=True)]
    z = ca.MX.sym("z", 3 + sum(sizes))
    p = ca.MX.sym("p", 3 + sum(sizes) + sum(rows) + sum(lengths) + 3)
    scale, row_scale, data, size, delta, ridge = ca.vertsplit(
        p, np.cumsum([0, 3 + sum(sizes), sum(rows), sum(lengths), 1, 1, 1]).tolist()
    )
    q, *u = ca.vertsplit(z * scale, np.cumsum([0, 3, *sizes]).tolist())
    d = ca.vertsplit(data, np.cumsum([0, *lengths]).tolist())
    groups = [_Group.of(b, n, u_g, q, d_g) for b, n, u_g, d_g in zip(parts, counts, u, d, strict=True)]
    g = ca.vertcat(*(group.g for group in groups)) * row_scale
    unscale = ca.diag(scale)
    jacobian = _joined([(group.g_q, group.g_u) for group in groups])
    jacobian = ca.mtimes([ca.diag(row_scale), jacobian, unscale])
    r = ca.vertcat(*(group.r for group in groups))
    slopes = ca.mtimes(_joined([(group.r_q, group.r_u) for group in groups]), unscale)
    items = ca.diagcat(*(_membership(b, n) for b, n in zip(parts, counts, strict=True)))
    squares = ca.mtimes(items, r * r)
    if robust:
        root = ca.sqrt(1 + squares / delta**2)
        # 2 delta^2 (root - 1), without cancellation
        loss, weight = 2 * squares / (1 + root), 1 / root
        inward = ca.mtimes(items, ca.mtimes(ca.diag(r), slopes))
        bend = ca.mtimes([inward.T, ca.diag(weight**3 / delta**2), inward])
    else:
        loss, weight, bend = squares, ca.MX.ones(squares.numel()), 0
    weights = ca.mtimes(items.T, weight)
    objective = 0.5 * size * (ca.sum1(loss) + ridge * ca.sumsqr(q))
    held = ridge * ca.vertcat(q, ca.MX(sum(sizes), 1))
    gradient = ca.densify(size * (ca.mtimes(slopes.T, weights * r) + held))  # which IPOPT takes it to be
    lam_f, lam_g = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", sum(rows))
    hold = ridge * ca.diagcat(ca.MX.eye(3), ca.MX(sum(sizes), sum(sizes)))
    hessian = lam_f * size * (ca.mtimes([slopes.T, ca.diag(weights), slopes]) - bend + hold)
    if options.exact_hessian:
        curvature = _curvature(parts, counts, u, q, d, lam_g * row_scale)
        hessian = hessian + ca.mtimes([unscale, curvature, unscale])
    derivatives = {
        "grad_f": ca.Function("grad_f", [z, p], [objective, gradient], ["x", "p"], ["f", "grad"]),
        "jac_g": ca.Function("jac_g", [z, p], [g, jacobian], ["x", "p"], ["g", "jac"]),
        "hess_lag": ca.Function(
            "hess_lag", [z, p, lam_f, lam_g], [ca.triu(hessian)], ["x", "p", "lam_f", "lam_g"], ["hess"]
        ),
    }
    settings = silent(
        options.tol,
        options.max_iterations,
        acceptable_tol=1e2 * options.tol,
        # Few unknowns have bounds, and a start is close to its answer.
        mu_init=1e-6,
        bound_push=1e-8,
        bound_frac=1e-8,
    )
    solver = ca.nlpsol(
        "calibration", "ipopt", {"x": z, "p": p, "f": objective, "g": g}, settings | derivatives
    )
    starts = np.cumsum([0, *(b.unknowns for b, n in zip(parts, counts, strict=True) for _ in range(n))])
    places = [b.problem.size - 4 for b, n in zip(parts, counts, strict=True) for _ in range(n)]
    return _Programme(solver, starts[:-1] + np.array(places))


@dataclass(frozen=True, eq=False)
class _Group:
    """The equations of all blocks with one signature, and their gradients."""

    g: ca.MX
    g_u: list[ca.MX]
    g_q: ca.MX
    r: ca.MX
    r_u: list[ca.MX]
    r_q: ca.MX

    @classmethod
    def of(cls, part: Block, count: int, u: ca.MX, q: ca.MX, d: ca.MX) -> _Group:
        mapped = part.linearised.map(count)
        g, g_u, g_q, r, r_u, r_q = mapped(
            ca.reshape(u, part.unknowns, count), ca.repmat(q, 1, count), ca.reshape(d, part.data, count)
        )
        return cls(
            ca.vec(g),
            ca.horzsplit(g_u, part.unknowns),
            ca.vertcat(*ca.horzsplit(g_q, 3)),
            ca.vec(r),
            ca.horzsplit(r_u, part.unknowns),
            ca.vertcat(*ca.horzsplit(r_q, 3)),
        )


def _joined(blocks: list[tuple[ca.MX, list[ca.MX]]]) -> ca.MX:
    """Columns of q in front of a block-diagonal matrix."""
    return ca.horzcat(
        ca.vertcat(*(by_q for by_q, _ in blocks)), ca.diagcat(*(m for _, by_u in blocks for m in by_u))
    )


def _membership(part: Block, count: int) -> ca.DM:
    """Matrix that sums rows of residuals into items, for all blocks of a group."""
    one = (np.unique(part.items)[:, None] == part.items).astype(float)
    return ca.kron(ca.DM.eye(count), ca.sparsify(ca.DM(one)))


def _curvature(
    parts: list[Block], counts: list[int], u: list[ca.MX], q: ca.MX, d: list[ca.MX], multipliers: ca.MX
) -> Any:
    """Hessian of multipliers g with respect to (q, u)."""
    edges = np.cumsum([0, *(b.constraints * n for b, n in zip(parts, counts, strict=True))]).tolist()
    of_q, mixed, of_u = ca.MX(3, 3), [], []
    for b, n, u_g, d_g, m_g in zip(parts, counts, u, d, ca.vertsplit(multipliers, edges), strict=True):
        hessians = b.curvature.map(n)(
            ca.reshape(u_g, b.unknowns, n),
            ca.repmat(q, 1, n),
            ca.reshape(d_g, b.data, n),
            ca.reshape(m_g, b.constraints, n),
        )
        for h in ca.horzsplit(hessians, 3 + b.unknowns):
            of_q = of_q + h[:3, :3]
            mixed.append(h[:3, 3:])
            of_u.append(h[3:, 3:])
    across = ca.horzcat(*mixed)
    return ca.vertcat(ca.horzcat(of_q, across), ca.horzcat(across.T, ca.diagcat(*of_u)))
