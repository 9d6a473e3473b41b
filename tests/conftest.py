"""What many files of tests share: branches, walked once, figures closed, and a Ctrl-C that is heard."""

from __future__ import annotations

import signal
import sys
from collections.abc import Callable, Iterator

import pytest

import peel_opt as po


@pytest.fixture(scope="session", autouse=True)
def ctrl_c() -> Iterator[None]:
    """Hear Ctrl-C where a shell started the tests with ``&``: it is ignored there, and by their children."""
    before = signal.getsignal(signal.SIGINT)
    if before == signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.fixture(autouse=True)
def no_figures_left() -> Iterator[None]:
    """Close what a test has drawn: a picture is pyplot's, and stays open, where a test imports pyplot."""
    yield
    if pyplot := sys.modules.get("matplotlib.pyplot"):
        pyplot.close("all")


@pytest.fixture(scope="session")
def branch_of() -> Callable[..., po.Branch]:
    """Return a call that traces the branch of a rod of a ratio eta/y0, with options of `trace`, once each."""
    walked: dict[object, po.Branch] = {}

    def branch(ratio: float, **options: object) -> po.Branch:
        key = (ratio, *sorted(options.items()))
        if key not in walked:
            walked[key] = po.trace(po.Rod.from_ratio(ratio), **options)  # type: ignore[arg-type]
        return walked[key]

    return branch


@pytest.fixture(scope="session")
def folds() -> po.FoldCurve:
    """Return the curve of folds at fixed beta0, through its turn and its cusp."""
    return po.fold_curve((0.1, 100.0))
