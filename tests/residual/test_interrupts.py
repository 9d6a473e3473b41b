"""Ctrl-C comes out of every call as KeyboardInterrupt, also while IPOPT runs, and leaves nothing behind."""

from __future__ import annotations

import random
import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import Any

import casadi as ca
import pytest

import peel_opt as po
from peel_opt.residual import programme
from peel_opt.residual.shooting import Shooting

ROD = po.Rod.from_ratio(1.0)


class _Press(ca.Callback):
    """Ctrl-C in an iteration of IPOPT: the signal arrives where CasADi looks for it."""

    def __init__(self, unknowns: int, equations: int, parameters: int) -> None:
        ca.Callback.__init__(self)
        self.sizes = {"x": unknowns, "f": 1, "g": equations, "lam_x": unknowns, "lam_g": equations}
        self.sizes["lam_p"] = parameters
        self.pressed = 0
        self.construct("press", {})

    def get_n_in(self) -> int:
        return ca.nlpsol_n_out()

    def get_n_out(self) -> int:
        return 1

    def get_sparsity_in(self, i: int) -> ca.Sparsity:
        return ca.Sparsity.dense(self.sizes[ca.nlpsol_out(i)], 1)

    def eval(self, _: Any) -> list[int]:
        self.pressed += 1
        signal.raise_signal(signal.SIGINT)
        return [0]


@contextmanager
def _pressing() -> Iterator[list[_Press]]:
    """Press Ctrl-C in every iteration of every programme that is built meanwhile."""
    presses: list[_Press] = []
    make = ca.nlpsol

    def nlpsol(name: str, solver: str, programme: dict[str, Any], settings: dict[str, Any]) -> ca.Function:
        presses.append(_Press(*(programme[part].numel() for part in "xgp")))
        return make(name, solver, programme, {**settings, "iteration_callback": presses[-1]})

    programme.build.cache_clear()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(ca, "nlpsol", nlpsol)
        yield presses
    programme.build.cache_clear()


CALLS: dict[str, Callable[[], object]] = {
    "answer": lambda: po.length_given_pressure(ROD, 0.5, method="shooting"),
    "answer, throw=False": lambda: po.length_given_pressure(ROD, 0.5, method="shooting", throw=False),
    "least_lambda": lambda: po.least_lambda(4.0),
    "sweep": lambda: po.sweep({"ratio": [1.0], "pressure_ratio": [0.5]}, method="shooting", workers=1),
    "tradeoff": lambda: po.tradeoff(
        lambda method, tol: po.length_given_pressure(ROD, 0.5, method=method, tol=tol),
        methods=["shooting"],
        tols=[1e-6],
    ),
}


@pytest.mark.parametrize("call", CALLS)
def test_ctrl_c_inside_ipopt_is_a_keyboard_interrupt(call: str) -> None:
    before = signal.getsignal(signal.SIGINT)
    with _pressing() as presses, pytest.raises(KeyboardInterrupt):
        CALLS[call]()
    assert sum(press.pressed for press in presses) > 0
    assert signal.getsignal(signal.SIGINT) is before


def test_a_handler_of_the_caller_decides_what_an_interrupt_does() -> None:
    """One that only takes note lets the answer through."""
    noted: list[int] = []
    before = signal.signal(signal.SIGINT, lambda number, _: noted.append(number))
    try:
        with _pressing():
            eq = po.length_given_pressure(ROD, 0.5, method="shooting")
    finally:
        signal.signal(signal.SIGINT, before)
    assert eq.status == "certified"
    assert noted == [signal.SIGINT]


def test_threads_solve_without_a_word_about_signals() -> None:
    found: list[po.Equilibrium] = []
    thread = threading.Thread(
        target=lambda: found.append(po.length_given_pressure(ROD, 0.5, method="shooting"))
    )
    thread.start()
    thread.join()
    assert found[0].status == "certified"


def test_an_interrupted_sweep_leaves_no_failure_in_its_journal(tmp_path: Path) -> None:
    axes = {"ratio": [0.8, 1.0], "pressure_ratio": [0.4, 0.6, 0.8]}
    for _ in range(3):
        with _pressing(), pytest.raises(KeyboardInterrupt):
            po.sweep(axes, method="shooting", workers=1, journal=tmp_path / "journal")
    resumed = po.sweep(axes, method="shooting", workers=1, journal=tmp_path / "journal")
    assert resumed.summary() == "6 of 6 points certified"


def _after(seconds: float, call: Callable[[], object]) -> object:
    """Call, with Ctrl-C some time after; its KeyboardInterrupt may come as late as here."""

    def press(_: int, __: FrameType | None) -> None:
        signal.raise_signal(signal.SIGINT)

    before = signal.signal(signal.SIGALRM, press)
    result: object = None
    try:
        signal.setitimer(signal.ITIMER_REAL, seconds)
        result = call()
        time.sleep(max(0.0, signal.getitimer(signal.ITIMER_REAL)[0]) + 0.05)
        raise AssertionError(f"Ctrl-C was lost: {result!r}")
    except KeyboardInterrupt:
        return result
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


def _some_answers() -> list[str]:
    pressures = (0.35, 0.45, 0.55, 0.65, 0.75)
    mesh = po.Method(Shooting(), po.Ipopt(), adaptive=False)
    asked = [po.length_given_pressure(ROD, p, method=mesh, tol=1e-4, throw=False) for p in pressures]
    return [eq.status for eq in asked]


def _some_folds() -> list[bool]:
    return [po.least_lambda(beta0).iterations > 0 for beta0 in (3.9, 4.0, 4.1)]


def _interrupted(call: Callable[[], list[Any]], seed: int, times: int) -> None:
    """At seeded times: every one is a KeyboardInterrupt, and no answer is spoilt by it."""
    undisturbed = call()
    start = time.perf_counter()
    assert call() == undisturbed
    duration = time.perf_counter() - start
    moments = random.Random(seed)
    for _ in range(times):
        assert _after(moments.uniform(1e-3, duration), call) in (None, undisturbed)
    assert call() == undisturbed


@pytest.mark.slow
@pytest.mark.parametrize("call", [_some_answers, _some_folds])
def test_ctrl_c_at_any_time_is_a_keyboard_interrupt(call: Callable[[], list[Any]]) -> None:
    _interrupted(call, seed=1, times=6)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("call", [_some_answers, _some_folds])
def test_ctrl_c_at_very_many_times(call: Callable[[], list[Any]], seed: int) -> None:
    _interrupted(call, seed=2 + seed, times=40)


@pytest.mark.slow
def test_a_sweep_interrupted_again_and_again_is_that_of_nobody_interrupting(tmp_path: Path) -> None:
    axes = {"ratio": [0.8, 1.0], "pressure_ratio": [0.3 + 0.03 * i for i in range(20)]}

    def asked() -> po.Sweep:
        return po.sweep(axes, method="shooting", workers=1, journal=tmp_path / "journal")

    undisturbed = po.sweep(axes, method="shooting", workers=1)
    moments = random.Random(7)
    for _ in range(25):
        _after(moments.uniform(0.02, 1.0), asked)
    resumed = asked()
    assert resumed.summary() == undisturbed.summary() == "40 of 40 points certified"
    assert (resumed["length"] == undisturbed["length"]).all()
