"""What the residuals of a fit do when the material numbers move: the reduced Jacobian.

Every observation follows q along its constraints g(u, q) = 0.  What they leave of u, the place
on the branch of a pair with errors in both variables or the foot of a measured point, is an
unknown of the observation's own and is projected out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...residual.programme import unknown_scale
from .blocks import Block, block
from .problem import Blocks

#: Share of the largest singular value below which a direction of u is not seen by the residuals.
UNSEEN = 1e-10


@dataclass(frozen=True, eq=False)
class LinearModel:
    """The fit to first order at its solution.

    Parameters
    ----------
    jacobian : ndarray, shape (rows, free)
        Weighted residuals by the free logarithms, own unknowns projected out.
    scores : ndarray, shape (items, free)
        Gradient of the loss of every pair or measured point.
    residuals : list of ndarray
        Weighted residuals of each observation, in standard deviations.
    weights : list of ndarray
        What the loss leaves of the weight of each item of an observation, 1 for least squares.
    """

    jacobian: np.ndarray
    scores: np.ndarray
    residuals: list[np.ndarray]
    weights: list[np.ndarray]

    def left(self, q: np.ndarray, ridge: float) -> float:
        """Length of the Gauss-Newton step that is left, in standard deviations of the fit.

        ``q`` are the free logarithms, which a ridge holds near 0.
        """
        information = self.jacobian.T @ self.jacobian + ridge * np.eye(len(q))
        step = np.linalg.lstsq(information, self.scores.sum(axis=0) + ridge * q, rcond=1e-14)[0]
        return float(np.linalg.norm(self.jacobian @ step))

    def covariance(self, *, sandwich: bool) -> np.ndarray:
        """Covariance of the free logarithms; infinite where the data say nothing at all.

        Parameters
        ----------
        sandwich : bool
            From the scatter of the scores rather than from the standard deviations of the data,
            as a robust loss needs.
        """
        _, s, vt = np.linalg.svd(self.jacobian, full_matrices=True)
        sizes = np.concatenate([s, np.zeros(len(vt) - len(s))])
        seen = sizes > UNSEEN * sizes.max(initial=0.0)
        inverse = (vt[seen].T / sizes[seen] ** 2) @ vt[seen]
        if sandwich:
            count, free = self.scores.shape
            meat = self.scores.T @ self.scores * (count / max(count - free, 1))
            inverse = inverse @ meat @ inverse
        touched = np.abs(vt[~seen]).max(axis=0, initial=0.0) > 1e-6
        inverse[touched] = inverse[:, touched] = np.nan
        inverse[touched, touched] = np.inf
        return inverse


def chance(chi2: float, degrees: int) -> float:
    """Chance of a larger chi-square."""
    from scipy.special import chdtrc  # scipy.stats takes half a second to import

    return float(chdtrc(degrees, chi2))


def linear_model(blocks: Blocks, free: np.ndarray, delta: float | None) -> LinearModel:
    """Return the reduced model of a solved fit."""
    jacobians, scores, residuals, weights = [], [], [], []
    for signature, u, d, order in zip(
        blocks.signatures, blocks.state.unknowns, blocks.state.data, blocks.orders, strict=True
    ):
        part = block(signature)
        r, by_q, by_own = reduced(part, u, blocks.state.q, d)
        own, weight, score = _projected(part, r, by_q[:, free], by_own, delta)
        jacobians.append(own)
        scores.append(score)
        # Points are sorted by the part of the rod they belong to; results follow the data.
        given = np.argsort(order, kind="stable")
        numbers = len(r) - 2 * len(order)
        residuals.append(np.concatenate([r[:numbers], r[numbers:].reshape(-1, 2)[given].ravel()]))
        weights.append(
            np.concatenate([weight[: len(weight) - len(order)], weight[len(weight) - len(order) :][given]])
        )
    return LinearModel(np.vstack(jacobians), np.vstack(scores), residuals, weights)


def reduced(
    part: Block, u: np.ndarray, q: np.ndarray, d: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Residuals of a block, their derivatives by q, and by what the constraints leave of u."""
    _, g_u, g_q, r, r_u, r_q = part.evaluate(u, q, d)
    along, own = follow(part, u, g_u, g_q)
    return r, r_q + r_u @ along, r_u @ own


def follow(part: Block, u: np.ndarray, g_u: np.ndarray, g_q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """du/dq of least length along g(u, q) = 0, and a basis of what it leaves of u."""
    n = part.problem.size
    scale = np.concatenate([unknown_scale(part.problem, u[:n]), np.ones(part.unknowns - n)])
    basis, triangle = np.linalg.qr((g_u * scale).T, mode="complete")
    m = part.constraints
    along = -scale[:, None] * (basis[:, :m] @ np.linalg.solve(triangle[:m].T, g_q))
    return along, scale[:, None] * basis[:, m:]


def _projected(
    part: Block, r: np.ndarray, by_q: np.ndarray, by_own: np.ndarray, delta: float | None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Weigh by the curvature of the loss, project the own unknowns out; also weights and scores."""
    numbers = np.unique(part.items)
    member = (numbers[:, None] == part.items).astype(float)
    squares = member @ r**2
    weight = np.ones(len(numbers)) if delta is None else 1.0 / np.sqrt(1.0 + squares / delta**2)
    root = np.diag(np.sqrt(member.T @ weight))
    if delta is not None:
        # The square root of w I - w^3 r r^T / delta^2 has the eigenvalue sqrt(w^3) along r.
        for k, (size, w) in enumerate(zip(squares, weight, strict=True)):
            mine = np.where(member[k] > 0.0, r, 0.0)
            if size > 0.0:
                root += (w**1.5 - w**0.5) * np.outer(mine, mine) / size
    seen_q, seen_own = root @ by_q, root @ by_own
    if seen_own.shape[1]:
        inverse = np.linalg.pinv(seen_own, rcond=UNSEEN)
        along = inverse @ seen_q
        seen_q = seen_q - seen_own @ along
        by_q = by_q - by_own @ along
    pull = (member.T @ weight * r)[:, None] * by_q
    return seen_q, weight, member @ pull
