"""The chart of held lengths: its words, units, logarithmic where lengths span decades, refusals."""

from __future__ import annotations

import pytest

import peel_opt as po
from peel_opt.plots import plot_held_lengths, plot_safe_pressures

from ..rods import FLAP


@pytest.mark.parametrize(
    ("rod", "scale", "units"),
    [
        (FLAP, "linear", ("[mm]", "[kPa]")),
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


@pytest.mark.slow
def test_a_chart_of_flaws_has_units_and_says_what_is_above_the_line() -> None:
    rod = FLAP
    limits = [po.safe_pressure(rod, a) for a in (0.5e-3, 0.1e-3)]
    ax = plot_safe_pressures(rod, limits)
    assert "[µm]" in ax.get_xlabel()
    assert "[kPa]" in ax.get_ylabel()
    assert "snaps" in ax.get_title(loc="left")
    x, y = ax.lines[0].get_data()
    assert list(x) == pytest.approx([100.0, 500.0])
    assert list(y) == pytest.approx([limits[1].pressure / 1e3, limits[0].pressure / 1e3])
    with pytest.raises(po.InvalidInput, match="two or more"):
        plot_safe_pressures(rod, limits[:1])


def test_a_loading_curve_draws_itself_in_its_units() -> None:
    curve = po.loading_curve(FLAP, 0.5e-3, points=6)
    ax = curve.plot()
    assert "[mm]" in ax.get_xlabel()
    assert "[kPa]" in ax.get_ylabel()
    assert "it snaps" in ax.get_title(loc="left")
    assert list(ax.lines[0].get_ydata()) == pytest.approx(list(curve.pressure / 1e3))
