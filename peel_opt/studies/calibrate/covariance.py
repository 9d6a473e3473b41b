"""Residuals, the loss they cost, their reduced Jacobian, and the covariance that follows from it.

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
    """One observation at a state of its own.

    Its rows come in twos: length and pressure, then x and y of every measured point.  Each two are one
    item, which a robust loss weighs as a whole.

    Parameters
    ----------
    r : ndarray, shape (2 items,)
        Residuals in standard deviations.
    by_q : ndarray, shape (2 items, 3)
        Derivatives by (log k, log T0, log y0).
    by_own : ndarray, shape (2 items, own)
        By the unknowns of its own.
    measured : ndarray of bool, shape (2 items,)
        False for what was given exactly, or not at all.
    at_T : bool
        Whether the state is held at T, where it has no place of its own.
    """

    r: np.ndarray
    by_q: np.ndarray
    by_own: np.ndarray
    measured: np.ndarray
    at_T: bool = False

    def projected(self, delta: float | None) -> np.ndarray:
        """Derivatives by q where the own unknowns follow, weighed as the loss weighs the items."""
        root = np.sqrt(np.repeat(loss(squared(self.r), delta)[1], 2))[:, None]
        return self.by_q - self.by_own @ given_back(root * self.by_own, root * self.by_q)


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
        jacobians, weights, scores = zip(*(_projected(one, free, delta) for one in seen), strict=True)
        residuals = [one.r[one.measured] for one in seen]
        return cls(np.vstack(jacobians), np.vstack(scores), residuals, list(weights))

    def left(self, directions: np.ndarray) -> float:
        """Length of the Gauss-Newton step that is left, in standard deviations of the fit.

        ``directions``, shape (free, m), are those in which the fit was free to move.
        """
        s, vt, seen = singular(self.jacobian @ directions)
        return float(np.linalg.norm(vt[seen] @ directions.T @ self.scores.sum(axis=0) / s[seen]))

    def covariance(self, *, sandwich: bool) -> np.ndarray:
        """Covariance of the free logarithms; infinite where the data say nothing at all.

        Parameters
        ----------
        sandwich : bool
            From the scatter of the scores rather than from the standard deviations of the data,
            as a robust loss needs.
        """
        sizes, vt, seen = singular(self.jacobian)
        inverse = (vt[seen].T / sizes[seen] ** 2) @ vt[seen]
        if sandwich:
            count, free = self.scores.shape
            meat = self.scores.T @ self.scores * (count / max(count - free, 1))
            inverse = inverse @ meat @ inverse
        touched = np.abs(vt[~seen]).max(axis=0, initial=0.0) > 1e-6
        inverse[touched] = inverse[:, touched] = np.nan
        inverse[touched, touched] = np.inf
        return inverse


def singular(jacobian: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Singular values of all directions, the directions as rows, and which of them the residuals see."""
    _, s, vt = np.linalg.svd(jacobian, full_matrices=len(jacobian) < jacobian.shape[1])
    sizes = np.concatenate([s, np.zeros(len(vt) - len(s))])
    return sizes, vt, sizes > UNSEEN * sizes.max(initial=0.0)


def given_back(own: np.ndarray, columns: np.ndarray) -> np.ndarray:
    """By how much own unknowns make up for rows that move along some columns, shape (own, columns)."""
    sizes = np.linalg.norm(own, axis=0)
    sizes[sizes == 0.0] = 1.0
    return np.linalg.lstsq(own / sizes, columns, rcond=UNSEEN)[0] / sizes[:, None]


def chance(chi2: float, degrees: int) -> float:
    """Chance of a larger chi-square."""
    from scipy.special import chdtrc  # scipy.stats takes half a second to import

    return float(chdtrc(degrees, chi2))


def squared(r: np.ndarray) -> np.ndarray:
    """Sum of squares of every item, shape (items,)."""
    return (r.reshape(-1, 2) ** 2).sum(axis=1)


def loss(squares: np.ndarray, delta: float | None) -> tuple[np.ndarray, np.ndarray]:
    """What items cost by their sums of squares, and the derivative of that, the weight.

    The sums themselves, or with a scale ``delta`` the pseudo-Huber loss
    2 delta^2 (sqrt(1 + s/delta^2) - 1) of them.
    """
    if delta is None:
        return squares, np.ones_like(squares)
    root = np.sqrt(1.0 + squares / delta**2)
    return 2.0 * squares / (1.0 + root), 1.0 / root  # without cancellation


def cost(r: np.ndarray, delta: float | None) -> float:
    """Sum of the losses of all items; chi-square with least squares."""
    return float(loss(squared(r), delta)[0].sum())


def robust_rows(squares: np.ndarray, delta: float) -> np.ndarray:
    """Loss of each row and its derivatives, where what counts is the sum over the two rows of an item.

    As `scipy.optimize.least_squares` takes it, of the squares of all residuals.
    """
    cost, weight = np.repeat(loss(squares.reshape(-1, 2).sum(axis=1), delta), 2, axis=1)
    return np.stack([0.5 * cost, weight, -0.5 * weight**3 / delta**2])


def _projected(one: Seen, free: np.ndarray, delta: float | None) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Weigh by the curvature of the loss, project the own unknowns out; also weights and scores."""
    r, by_q, squares = one.r.reshape(-1, 2), one.by_q[:, free], squared(one.r)
    weight = loss(squares, delta)[1]
    # The square root of w I - w^3 r r^T / delta^2 has the eigenvalues sqrt(w), and sqrt(w^3) along r.
    along = (weight**1.5 - weight**0.5) / np.where(squares > 0.0, squares, 1.0)

    def weighed(columns: np.ndarray) -> np.ndarray:
        items = columns.reshape(len(r), 2, -1)
        bent = along[:, None, None] * r[:, :, None] * np.einsum("ij,ijk->ik", r, items)[:, None]
        return (weight[:, None, None] ** 0.5 * items + bent).reshape(columns.shape)

    seen_q, seen_own = weighed(by_q), weighed(one.by_own)
    own = given_back(seen_own, seen_q)
    pull = (weight[:, None] * r).ravel()[:, None] * (by_q - one.by_own @ own)
    # What was given exactly is no item that scatters.
    counts = one.measured.reshape(-1, 2).any(axis=1)
    return seen_q - seen_own @ own, weight[counts], pull.reshape(len(r), 2, -1).sum(axis=1)[counts]
