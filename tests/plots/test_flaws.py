"""The chart of held lengths: its words, units, logarithmic where lengths span decades, refusals."""

from __future__ import annotations

import pytest

import peel_opt as po
from peel_opt.plots import plot_held_lengths


@pytest.mark.parametrize(
    ("rod", "scale", "units"),
    [
        (po.Rod(2.3e-5, 140e3, 0.73e-3), "linear", ("[mm]", "[kPa]")),
        (po.Rod.from_ratio(200.0), "log", (r"/\eta", "/T_0")),
    ],
)
def test_a_chart_has_units_and_promises_nothing_about_flaws(
    rod: po.Rod, scale: str, units: tuple[str, str]
) -> None:
    ax = plot_held_lengths(po.trace(rod, points=24, tol=1e-7))
    assert ax.get_xscale() == ax.get_yscale() == scale
    assert units[0] in ax.get_xlabel()
    assert units[1] in ax.get_ylabel()
    texts = " ".join(t.get_text() for t in ax.texts)
    for words in ("bond itself fails", "no such equilibrium"):
        assert words in texts
    assert "which nothing holds there" in ax.get_title(loc="left")
    for promise in ("grow", "close", "flaw", "safe"):
        assert promise not in texts + ax.get_title(loc="left")


def test_a_chart_needs_a_rod() -> None:
    with pytest.raises(po.InvalidInput, match="held lengths"):
        plot_held_lengths(po.trace(beta0=4, lam=(-1, 1), points=8))
