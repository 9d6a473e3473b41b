"""Results draw themselves: nothing is imported for it before, and what has no picture is refused."""

from __future__ import annotations

import subprocess
import sys

import pytest
from matplotlib.figure import Figure

import peel_opt as po
from peel_opt.base.drawing import draw


def test_nothing_that_draws_is_imported_before_a_picture_is_asked_for() -> None:
    code = """
import sys, peel_opt as po
eq = po.equilibrium(beta0=2.0, lam=0.5)
assert not any(name.split(".")[0] == "matplotlib" or name == "peel_opt.plots" for name in sys.modules)
eq.plot()
assert "matplotlib" in sys.modules and "peel_opt.plots" in sys.modules
"""
    done = subprocess.run([sys.executable, "-c", code], check=False, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")


def test_a_result_is_drawn_on_the_axes_that_are_given() -> None:
    ax = Figure().subplots()
    assert draw(po.equilibrium(beta0=2.0, lam=0.5), ax, legend=False) is ax
    assert ax.lines
    assert ax.get_legend() is None


@pytest.mark.parametrize("thing", [None, 3.0, "a rod", po.Rod.from_ratio(1.0)])
def test_what_has_no_picture_is_refused(thing: object) -> None:
    with pytest.raises(po.InvalidInput, match="no picture"):
        draw(thing)
