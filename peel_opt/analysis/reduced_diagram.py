"""The zero set of the reduced function (32) in a window: the bifurcation diagram of Fig 4."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..base.checks import listed, pair, whole
from ..base.errors import InvalidInput, NotConverged

if TYPE_CHECKING:
    from .reduction import Reduction


@dataclass(frozen=True, eq=False)
class ReducedCurve:
    """One curve of the zero set of g off the trivial branch, every point solved to the tolerance."""

    beta0: float
    lam: np.ndarray
    A: np.ndarray
    alpha1: np.ndarray


def zero_set(
    reduction: Reduction,
    lam_range: tuple[float, float],
    A_range: tuple[float, float],
    samples: tuple[int, int],
) -> list[ReducedCurve]:
    """Return the curves on which h = g/A vanishes; see `Reduction.diagram`."""
    for name, span in (("lam_range", lam_range), ("A_range", A_range)):
        low, high = pair(name, span)
        if not low < high:
            raise InvalidInput(f"{name} must ascend, got ({low:g}, {high:g}).")
    counts = [whole("samples", count, 2) for count in listed("samples", samples)]
    if len(counts) != 2:
        raise InvalidInput(f"samples must be two numbers, of lambda and of A, got {samples!r:.60}.")
    lam, A = np.linspace(*lam_range, counts[0]), np.linspace(*A_range, counts[1])
    h = reduction.solve(A[:, None], lam).h
    column, left = np.nonzero((h[:, :-1] != 0.0) & (h[:, :-1] * h[:, 1:] <= 0.0))
    if not column.size:
        return []
    ends = (lam[left], lam[left + 1], h[column, left], h[column, left + 1])
    roots = _refined(reduction, A[column], *ends)
    alpha1 = reduction.alpha1(A[column], roots)
    # The k-th root of each amplitude belongs to the k-th curve, as long as it exists.
    rank = np.arange(column.size) - np.searchsorted(column, column)
    curves = []
    for k in range(int(rank.max()) + 1):
        members = np.flatnonzero(rank == k)
        parts = np.split(members, np.flatnonzero(np.diff(column[members]) > 1) + 1)
        curves += [
            ReducedCurve(reduction.beta0, roots[part], A[column[part]], alpha1[part]) for part in parts
        ]
    return curves


def _refined(
    reduction: Reduction, A: np.ndarray, x0: np.ndarray, x1: np.ndarray, f0: np.ndarray, f1: np.ndarray
) -> np.ndarray:
    """Zero of h in lambda inside each bracket, by the Illinois variant of false position."""
    for _ in range(40):
        with np.errstate(invalid="ignore", divide="ignore"):
            x = np.where(f1 == f0, x1, x1 - f1 * (x1 - x0) / (f1 - f0))
        f = reduction.solve(A, x).h
        if not np.isfinite(f).all():
            break
        crossed = f * f1 < 0.0
        x0, f0 = np.where(crossed, x1, x0), np.where(crossed, f1, 0.5 * f0)
        done = np.abs(x - x1) <= 1e-13 * np.maximum(1.0, np.abs(x))
        x1, f1 = x, f
        if (done | (f == 0.0)).all():
            return x1
    raise NotConverged(
        f"the zero set at beta0 = {reduction.beta0:g} could not be refined.",
        remedy="Narrow the window or raise the number of samples.",
    )
