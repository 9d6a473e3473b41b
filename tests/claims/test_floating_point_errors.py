"""Nothing divides by zero, overflows or underflows unawares: NumPy may raise at all of it."""

from __future__ import annotations

from collections.abc import Callable

import matplotlib.pyplot as plt
import numpy as np
import pytest

import peel_opt as po

UNIT = po.Rod.from_ratio(1.0)

CALLS: dict[str, Callable[[], object]] = {
    "stability": lambda: po.stability(po.length_given_pressure(UNIT, 0.6)),
    "control table": lambda: po.control_table(po.length_given_pressure(UNIT, 0.6)),
    "near T": lambda: po.length_given_pressure(UNIT, 1 - 1e-12),
    "nearer T": lambda: po.length_given_pressure(UNIT, 1 - 1e-15),
    "series": lambda: po.equilibrium(beta0=4, lam=1e-13),
    "folded": lambda: po.length_given_pressure(UNIT, 0.6, state="folded"),
    "at length": lambda: po.pressure_given_length(UNIT, length=3.1),
    "other law": lambda: po.length_given_pressure(UNIT, 0.6, law=po.exponential()),
    "normal form": lambda: po.NormalForm.exact().potential(-1.0, 4.0, 0.1),
}


@pytest.mark.parametrize("call", CALLS.values(), ids=CALLS)
def test_public_calls_hold_where_numpy_raises(call: Callable[[], object]) -> None:
    with np.errstate(all="raise"):
        assert call() is not None


def test_branches_hold_where_numpy_raises() -> None:
    with np.errstate(all="raise"):
        branch = po.trace(po.Rod.from_ratio(0.2), points=8, tol=1e-4)
        branch.with_stability().plot()
        po.energies(branch)
        plt.close("all")
