"""Inputs that depend on each other: a matrix of correlations, and samples that have it.

The inputs keep their distributions; what is correlated are normal scores behind them (a Gaussian copula, the
Nataf model).  The correlation of two scores is chosen such that the inputs themselves have the one that was
given, Pearson's: for two normal inputs it is that, for others an integral over both scores says.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np
from scipy import special

from ...base.checks import finite
from ...base.errors import InvalidInput
from .inputs import Spread

#: Nodes of the integral over a score, and largest correlation of two scores that is looked at.
NODES, LARGEST = 48, 1.0 - 1e-9

#: What normal distributions are called, of texts and of SciPy.
NORMAL = {"normal", "norm"}

#: Below zero by this much an eigenvalue is more than rounding.
ROUNDING = 1e-10


def correlations_of(given: Any, names: Sequence[str], order: Sequence[str]) -> np.ndarray | None:
    """Return the correlation matrix of some inputs.

    Parameters
    ----------
    given : array_like, mapping or None
        The matrix in the order of ``names``, or a correlation by pair of names; of the pairs not named none.
    names : sequence of str
        The inputs as the caller has them.
    order : sequence of str
        The inputs in the order of the result.

    Returns
    -------
    ndarray, shape (inputs, inputs), or None
        None where nothing is correlated.

    Raises
    ------
    InvalidInput
        If it is no correlation matrix of these inputs.
    """
    if given is None:
        return None
    count = len(names)
    if isinstance(given, Mapping):
        matrix = np.eye(count)
        for both, value in given.items():
            if not isinstance(both, tuple) or len(both) != 2 or both[0] == both[1]:
                raise InvalidInput(
                    f"a correlation is that of a pair of inputs, got {both!r:.60}.",
                    remedy='Such as {("youngs_modulus", "thickness"): 0.5}.',
                )
            if strange := [name for name in both if name not in names]:
                raise InvalidInput(
                    f"{strange[0]!r} is not uncertain, and correlates with nothing.",
                    remedy=f"Uncertain are {', '.join(names)}.",
                )
            i, j = (list(names).index(name) for name in both)
            rho = finite(f"the correlation of {both[0]} and {both[1]}", value)
            if (both[1], both[0]) in given and given[both[1], both[0]] != value:
                raise InvalidInput(f"the correlation of {both[0]} and {both[1]} is given twice.")
            matrix[i, j] = matrix[j, i] = rho
    else:
        matrix = _matrix(given, count)
    if not (np.abs(matrix) <= 1.0).all() or np.linalg.eigvalsh(matrix)[0] < -ROUNDING:
        raise InvalidInput(
            "the correlations contradict each other, or exceed 1: no random numbers have them.",
            remedy="Their matrix must have no negative eigenvalue.",
        )
    place = [list(names).index(name) for name in order]
    ordered: np.ndarray = matrix[np.ix_(place, place)]
    return None if np.array_equal(ordered, np.eye(count)) else ordered


def _matrix(given: Any, count: int) -> np.ndarray:
    try:
        matrix = np.asarray(given, dtype=float)
    except (TypeError, ValueError) as error:
        raise InvalidInput(f"correlations must be a matrix or a mapping, got {given!r:.60}.") from error
    if matrix.shape != (count, count) or not np.isfinite(matrix).all():
        raise InvalidInput(
            f"correlations of {count} inputs are a matrix of {count} x {count} numbers,"
            f" got one of {' x '.join(map(str, matrix.shape))}.",
            remedy="In the order in which the spreads are named.",
        )
    if not (np.array_equal(matrix, matrix.T) and (np.diag(matrix) == 1.0).all()):
        raise InvalidInput("a correlation matrix is symmetric, with 1 on its diagonal.")
    return matrix


class Scores:
    """Normal scores behind correlated inputs.

    Parameters
    ----------
    spreads : sequence of Spread
    correlations : ndarray, shape (inputs, inputs)
        Of the inputs.

    Raises
    ------
    InvalidInput
        If inputs of these distributions cannot be correlated so much.
    """

    def __init__(self, spreads: Sequence[Spread], correlations: np.ndarray) -> None:
        self.matrix = np.eye(len(spreads))
        for i in range(len(spreads)):
            for j in range(i):
                rho = float(correlations[i, j])
                self.matrix[i, j] = self.matrix[j, i] = _of_scores(spreads[i], spreads[j], rho)
        values, vectors = np.linalg.eigh(self.matrix)
        if values[0] < -ROUNDING:
            raise InvalidInput(
                "inputs of these distributions cannot have these correlations together.",
                remedy="Take smaller ones, or normal distributions.",
            )
        self._root = vectors * np.sqrt(np.maximum(values, 0.0))

    def correlated(self, shares: np.ndarray) -> np.ndarray:
        """Return shares of distributions that depend on each other, of independent ones, (points, inputs)."""
        return _shares(special.ndtri(shares) @ np.linalg.qr(self._root.T)[1])


def _of_scores(a: Spread, b: Spread, rho: float) -> float:
    """Return the correlation of two scores behind inputs with this correlation."""
    if rho == 0.0 or {a.words, b.words} <= NORMAL:
        return rho
    from scipy.optimize import brentq  # which takes long to import

    miss = partial(_of_inputs, _standard(a), _standard(b), rho)
    end = LARGEST if rho > 0.0 else -LARGEST
    if miss(end) * np.sign(rho) < 0.0:
        raise InvalidInput(
            f"{a.name} and {b.name} of these distributions have a correlation of at most"
            f" {miss(end) + rho:.4g}, got {rho:g}.",
            remedy="Take a smaller one, or normal distributions.",
        )
    return float(brentq(miss, 0.0, end, xtol=1e-10))


def _standard(spread: Spread) -> Any:
    """Return the input over its standard deviation as a function of its score."""
    return lambda score: (spread.quantiles(_shares(score)) - spread.mean) / spread.sd


def _shares(scores: np.ndarray) -> np.ndarray:
    """Return the shares of a distribution below some scores, 0 and 1 left out."""
    shares: np.ndarray = np.clip(special.ndtr(scores), 2.0**-52, 1.0 - 2.0**-52)
    return shares


def _of_inputs(a: Any, b: Any, rho: float, score: float) -> float:
    """Return by how much inputs with these correlated scores miss a correlation."""
    nodes, weights = np.polynomial.hermite_e.hermegauss(NODES)
    weights = weights / weights.sum()
    u, v = nodes[:, None], score * nodes[:, None] + np.sqrt(1.0 - score**2) * nodes
    return float(weights @ (a(u) * b(v)) @ weights - rho)
