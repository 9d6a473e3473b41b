"""Sampled inputs, and what their answers say about which input matters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...base.checks import whole
from ...base.errors import InvalidInput
from ..sweep.plan import MOST_POINTS
from .correlation import Scores
from .inputs import Spread
from .result import SobolIndices

#: Resamples behind an interval of a Sobol index.
RESAMPLES = 400


@dataclass(frozen=True, eq=False)
class Sample:
    """Sampled inputs: two independent sets A and B, and for each input A with that column of B.

    Parameters
    ----------
    names : tuple of str
    inputs : ndarray, shape (points, names)
        A, B, then the mixed sets if there are indices [SI, or the units of the rod].
    size : int
        Points of A.
    """

    names: tuple[str, ...]
    inputs: np.ndarray
    size: int

    @classmethod
    def drawn(
        cls, spreads: Sequence[Spread], size: int, seed: int, mixed: bool, scores: Scores | None = None
    ) -> Sample:
        """Draw from a scrambled Sobol sequence of twice the dimension, as Saltelli does.

        Raises
        ------
        InvalidInput
            If the sample is too large, the seed is none, or a distribution has infinite values.
        """
        from scipy.stats import qmc

        count = len(spreads)
        size, seed = whole("samples", size, 2, MOST_POINTS), whole("seed", seed, 0, 2**128 - 1)
        if size & (size - 1):
            raise InvalidInput(f"samples must be a power of 2, got {size}.")
        if (points := size * (2 + (count if mixed else 0))) > MOST_POINTS:
            raise InvalidInput(
                f"{size} samples take {points} answers; the limit is {MOST_POINTS}.", remedy="Take fewer."
            )
        shares = qmc.Sobol(d=2 * count, scramble=True, seed=np.random.default_rng(seed), bits=32).random(size)
        # The sequence may hit 0, where a normal distribution has no quantile.
        shares = np.clip(shares, 2.0**-33, 1.0 - 2.0**-33)
        if scores is not None:
            halves = (shares[:, :count], shares[:, count:])
            shares = np.concatenate([scores.correlated(half) for half in halves], axis=1)
        columns = [spreads[i % count].quantiles(shares[:, i]) for i in range(2 * count)]
        for i, column in enumerate(columns):
            if not np.isfinite(column).all():
                raise InvalidInput(f"the distribution of {spreads[i % count].name} has infinite values.")
        first, second = np.stack(columns[:count], axis=1), np.stack(columns[count:], axis=1)
        sets = [first, second]
        for i in range(count if mixed else 0):
            both = first.copy()
            both[:, i] = second[:, i]
            sets.append(both)
        return cls(tuple(s.name for s in spreads), np.concatenate(sets), size)

    @property
    def main(self) -> int:
        """Points of A and B together, the ones whose distribution is reported."""
        return 2 * self.size

    def points(self, nominal: Mapping[str, float]) -> dict[str, np.ndarray]:
        """Return every number at every point."""
        columns = {name: np.full(len(self.inputs), value) for name, value in nominal.items()}
        return columns | {name: self.inputs[:, i] for i, name in enumerate(self.names)}

    def indices(self, values: np.ndarray) -> SobolIndices | None:
        """Return Sobol indices by `scipy.stats.sobol_indices`, with intervals by resampling.

        Parameters
        ----------
        values : ndarray, shape (points,)
            The answer at every point.

        Returns
        -------
        SobolIndices or None
            None without mixed sets, where a point has no answer, or where all answers are equal.
        """
        sound = len(values) > self.main and np.isfinite(values).all() and np.ptp(values[: self.main]) > 0.0
        if not sound:
            return None
        count = len(self.names)
        sets = values.reshape(count + 2, self.size)

        def indices_of(chosen: np.ndarray) -> np.ndarray:
            from scipy.stats import sobol_indices

            functions = {"f_A": sets[:1, chosen], "f_B": sets[1:2, chosen], "f_AB": sets[2:, None, chosen]}
            found = sobol_indices(func=functions, n=self.size)
            return np.array([np.reshape(found.first_order, count), np.reshape(found.total_order, count)])

        rng = np.random.default_rng(self.size)
        resampled = np.array(
            [indices_of(rng.integers(0, self.size, self.size)) for _ in range(RESAMPLES)],
        )
        first, total = indices_of(np.arange(self.size))
        low, high = np.quantile(resampled, (0.025, 0.975), axis=0)
        intervals = np.stack([low, high], axis=-1)
        return SobolIndices(self.names, first, total, intervals[0], intervals[1], self.size)
