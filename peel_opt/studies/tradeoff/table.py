"""`WorkPrecision`: what methods take and give on one question, as a table."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, fields
from typing import Any

import numpy as np

from ...base.drawing import Pictured
from ...base.records import Column, Schema, Stored, Table, array, entries


@dataclass(frozen=True)
class Work:
    """One method at one tolerance; NaN where there is no such number.

    Parameters
    ----------
    method : str
    tol : float
        As asked; for solve_bvp its own, a relative residual.
    seconds : float
        Median of the repeats, after a warm-up.
    iterations : float
        Of Newton's method and of IPOPT, on all meshes.
    unknowns : float
        Of the finest mesh.
    evaluations : float
        Of the equations, with or without their Jacobian: see `Stats`.
    error : float
        As reported with the answer; solve_bvp has none.
    true_error : float
        Against the reference.
    status : str
        "certified", "solved" for a peer, or why there is no answer.
    """

    method: str
    tol: float
    seconds: float = math.nan
    iterations: float = math.nan
    unknowns: float = math.nan
    evaluations: float = math.nan
    error: float = math.nan
    true_error: float = math.nan
    status: str = ""


#: Columns of the rows, numbers or words; errors are of the answered number, which has no unit.
_COLUMNS = {f.name: "U" if f.name in ("method", "status") else "f" for f in fields(Work)}

_REFERENCE = ("reference", "reference_error")


@dataclass(frozen=True)
class WorkPrecision(Pictured, Stored):
    """What `tradeoff` returns: the rows, and the reference they are held against.

    Parameters
    ----------
    rows : tuple of Work
    answered : str
    reference, reference_error : float
    """

    schema = Schema("peel_opt work-precision", 1)

    rows: tuple[Work, ...]
    answered: str
    reference: float
    reference_error: float

    def of(self, method: str) -> tuple[Work, ...]:
        """Rows of one method."""
        return tuple(row for row in self.rows if row.method == method)

    @property
    def methods(self) -> tuple[str, ...]:
        """Methods in the order they were given."""
        return tuple(dict.fromkeys(row.method for row in self.rows))

    def fastest(self, accuracy: float) -> Work | None:
        """Return the row that takes least time among those truly within ``accuracy``; None if none is."""
        good = [row for row in self.rows if row.true_error <= max(accuracy, self.reference_error)]
        return min(good, key=lambda row: row.seconds, default=None)

    # --- out ------------------------------------------------------------------------------

    def record(self) -> dict[str, Any]:
        """Return rows and reference as plain data."""
        return {**self._head(), "rows": [asdict(row) for row in self.rows]}

    def _head(self) -> dict[str, Any]:
        return {name: getattr(self, name) for name in ("answered", *_REFERENCE)}

    def _arrays(self) -> dict[str, np.ndarray]:
        return {
            name: np.array([getattr(row, name) for row in self.rows], str if kind == "U" else float)
            for name, kind in _COLUMNS.items()
        }

    def _table(self) -> Table:
        columns = {n: Column(c, "s" if n == "seconds" else "") for n, c in self._arrays().items()}
        return Table(self._head().items(), columns)

    @classmethod
    def _restored(cls, head: dict[str, Any], arrays: dict[str, np.ndarray]) -> WorkPrecision:
        columns = [array(arrays, name, kind).tolist() for name, kind in _COLUMNS.items()]
        reference = entries(head, str, "answered") | entries(head, float, *_REFERENCE)
        return cls(tuple(Work(*row) for row in zip(*columns, strict=True)), **reference)

    def __repr__(self) -> str:
        width = max(6, *(len(method) for method in self.methods))
        head = f"{'method':<{width}}  {'tol':>7}  {'ms':>8}  {'iter':>5}  {'size':>5}  {'evals':>5}"
        lines = [f"{head}  {'reported':>8}  {'true':>8}  status"]
        for row in self.rows:
            counts = (row.iterations, row.unknowns, row.evaluations)
            numbers = "  ".join("    -" if math.isnan(n) else f"{n:>5.0f}" for n in counts)
            errors = "  ".join(
                "       -" if math.isnan(e) else f"{e:>8.1e}" for e in (row.error, row.true_error)
            )
            ms = "       -" if math.isnan(row.seconds) else f"{1e3 * row.seconds:>8.3f}"
            lines.append(
                f"{row.method:<{width}}  {row.tol:>7.0e}  {ms}  {numbers}  {errors}  {_short(row.status)}"
            )
        lines.append(f"reference {self.answered} = {self.reference:.14g} +- {self.reference_error:.0e}")
        return "\n".join(lines)


def _short(status: str, most: int = 60) -> str:
    """One column's worth of a reason; the row itself keeps all of it."""
    return status if len(status) <= most else f"{status[: most - 3]}..."
