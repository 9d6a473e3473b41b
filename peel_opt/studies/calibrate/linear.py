"""What the residuals of a fit do when the material numbers move: the reduced Jacobian.

What an observation leaves open of itself, its place on the branch or where a picture has its origin, is
an unknown of its own and is projected out.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

#: Share of the largest singular value below which a direction is not seen by the residuals.
UNSEEN = 1e-10


@dataclass(frozen=True, eq=False)
class Seen:
    """One observation at its fitted state.

    Parameters
    ----------
    r : ndarray, shape (rows,)
        Residuals in standard deviations.
    by_q : ndarray, shape (rows, 3)
        Derivatives by (log k, log T0, log y0).
    by_own : ndarray, shape (rows, own)
        By the unknowns of its own.
    items : ndarray of int, shape (rows,)
        Rows of one item, a pair or a measured point, are weighed together by a robust loss.
    measured : ndarray of bool, shape (rows,)
        False for what was given exactly.
    """

    r: np.ndarray
    by_q: np.ndarray
    by_own: np.ndarray
    items: np.ndarray
    measured: np.ndarray


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

    @classmethod
    def of(cls, seen: Sequence[Seen], free: np.ndarray, delta: float | None) -> LinearModel:
        """Return the reduced model of a solved fit; ``delta`` is the scale of the pseudo-Huber loss."""
        parts = [_projected(one, one.by_q[:, free], delta) for one in seen]
        return cls(
            np.vstack([jacobian for jacobian, _, _ in parts]),
            np.vstack([score for _, _, score in parts]),
            [one.r[one.measured] for one in seen],
            [weight for _, weight, _ in parts],
        )

    def left(self, directions: np.ndarray) -> float:
        """Length of the Gauss-Newton step that is left, in standard deviations of the fit.

        ``directions``, shape (free, m), are those in which the fit was free to move.
        """
        _, s, vt = np.linalg.svd(self.jacobian @ directions, full_matrices=False)
        seen = s > UNSEEN * s.max(initial=0.0)
        return float(np.linalg.norm(vt[seen] @ directions.T @ self.scores.sum(axis=0) / s[seen]))

    def covariance(self, *, sandwich: bool) -> np.ndarray:
        """Covariance of the free logarithms; infinite where the data say nothing at all.

        Parameters
        ----------
        sandwich : bool
            From the scatter of the scores rather than from the standard deviations of the data,
            as a robust loss needs.
        """
        rows, free = self.jacobian.shape
        _, s, vt = np.linalg.svd(self.jacobian, full_matrices=rows < free)
        sizes = np.concatenate([s, np.zeros(len(vt) - len(s))])
        seen = sizes > UNSEEN * sizes.max(initial=0.0)
        inverse = (vt[seen].T / sizes[seen] ** 2) @ vt[seen]
        if sandwich:
            count = len(self.scores)
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


def pseudo_huber(squares: np.ndarray, delta: float) -> tuple[np.ndarray, np.ndarray]:
    """Loss 2 delta^2 (sqrt(1 + s/delta^2) - 1) of squared residuals, and its derivative, the weight."""
    root = np.sqrt(1.0 + squares / delta**2)
    return 2.0 * squares / (1.0 + root), 1.0 / root  # without cancellation


def _projected(one: Seen, by_q: np.ndarray, delta: float | None) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Weigh by the curvature of the loss, project the own unknowns out; also weights and scores."""
    numbers = np.unique(one.items)
    member = (numbers[:, None] == one.items).astype(float)
    squares = member @ one.r**2
    weight = np.ones(len(numbers)) if delta is None else pseudo_huber(squares, delta)[1]
    root = np.diag(np.sqrt(member.T @ weight))
    if delta is not None:
        # The square root of w I - w^3 r r^T / delta^2 has the eigenvalue sqrt(w^3) along r.
        for k, (size, w) in enumerate(zip(squares, weight, strict=True)):
            mine = np.where(member[k] > 0.0, one.r, 0.0)
            if size > 0.0:
                root += (w**1.5 - w**0.5) * np.outer(mine, mine) / size
    seen_q, seen_own = root @ by_q, root @ one.by_own
    sizes = np.linalg.norm(seen_own, axis=0)
    if np.any(sizes > 0.0):
        inverse = np.linalg.pinv(seen_own / np.where(sizes > 0.0, sizes, 1.0), rcond=UNSEEN)
        along = inverse @ seen_q / np.where(sizes > 0.0, sizes, np.inf)[:, None]
        seen_q = seen_q - seen_own @ along
        by_q = by_q - one.by_own @ along
    pull = (member.T @ weight * one.r)[:, None] * by_q
    # What was given exactly is no item that scatters.
    counts = member @ one.measured > 0.0
    return seen_q, weight[counts], (member @ pull)[counts]
