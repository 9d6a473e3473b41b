"""The bits of an answer do not depend on the threads that BLAS may use."""

from __future__ import annotations

import os
import subprocess
import sys
import threading

import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

import peel_opt as po
from peel_opt.base.threads import one_thread

from ..rods import FLAP

#: Prints one line of hexadecimal digits for each answer of a rod.
SCRIPT = """
import hashlib, sys
import numpy as np
import peel_opt as po

def shown(*arrays):
    print(hashlib.sha256(b"".join(np.ascontiguousarray(a).tobytes() for a in arrays)).hexdigest())

rod = po.Rod(*map(float, sys.argv[1:]))
branch = po.trace(rod)
shown(branch.lam, branch.alpha1, branch.error)
for state, method in (("unfolded", "auto"), ("folded", "collocation"), ("unfolded", "shooting")):
    eq = po.length_given_pressure(rod, 0.6 * rod.adhesion_strength, state=state, method=method)
    shown(eq.x, eq.y, [eq.length, eq.error])
    found = po.stability(eq)
    shown(found.eigenvalues, [found.error])
gradient = po.sensitivities(eq)
shown(list(gradient.derivatives.values()), list(gradient.errors.values()))
"""

THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


def _hashes(rod: po.Rod, threads: int | None) -> list[str]:
    environment = {name: value for name, value in os.environ.items() if name not in THREADS}
    if threads is not None:
        environment |= dict.fromkeys(THREADS, str(threads))
    numbers = [repr(v) for v in (rod.bending_stiffness, rod.adhesion_strength, rod.adhesion_range)]
    command = [sys.executable, "-c", SCRIPT, *numbers]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    return done.stdout.split()


RODS = [
    pytest.param(FLAP, id="aortic flap"),
    pytest.param(po.Rod(2e6 * 1e-9 / 9.0, 1e5, 1e-6), id="silicone sheet"),
]


@pytest.mark.slow
@pytest.mark.parametrize("rod", RODS)
def test_one_blas_thread_and_all_of_them_give_the_same_bits(rod: po.Rod) -> None:
    one = _hashes(rod, 1)
    assert len(one) == 8
    assert _hashes(rod, None) == one


def _threads() -> list[int]:
    return [library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas"]


@pytest.mark.skipif((os.cpu_count() or 1) < 2, reason="a single processor has one thread")
def test_blas_has_its_threads_back_after_calls_from_several_threads() -> None:
    with one_thread:
        pass  # all that brings a BLAS is loaded now
    with threadpool_limits(2, user_api="blas"):
        outer = _threads()
        entered, leave = threading.Event(), threading.Event()

        def other() -> None:
            with one_thread:
                entered.set()
                leave.wait()

        thread = threading.Thread(target=other)
        with one_thread:
            thread.start()
            entered.wait()
        assert set(_threads()) == {1}  # the other still computes
        leave.set()
        thread.join()
        with pytest.raises(po.NoEquilibrium):
            po.length_given_pressure(po.Rod.from_ratio(1.0), 2.0)
        assert _threads() == outer


def test_a_decorated_call_computes_on_one_thread() -> None:
    @one_thread
    def inside(x: float) -> tuple[float, list[int]]:
        return x, _threads()

    value, threads = inside(np.pi)
    assert value == np.pi
    assert set(threads) == {1}
