"""The flaw chart: regions, units, logarithmic where lengths span decades, refusals."""

from __future__ import annotations

import pytest

import peel_opt as po
from peel_opt.plots import plot_flaw_chart


@pytest.mark.parametrize(
    ("rod", "scale", "units"),
    [
        (po.Rod(2.3e-5, 140e3, 0.73e-3), "linear", ("[mm]", "[kPa]")),
        (po.Rod.from_ratio(200.0), "log", (r"/\eta", "/T_0")),
    ],
)
def test_a_chart_has_units_and_four_regions(rod: po.Rod, scale: str, units: tuple[str, str]) -> None:
    ax = plot_flaw_chart(po.trace(rod, points=24, tol=1e-7))
    assert ax.get_xscale() == ax.get_yscale() == scale
    assert units[0] in ax.get_xlabel()
    assert units[1] in ax.get_ylabel()
    texts = " ".join(t.get_text() for t in ax.texts)
    for word in ("grows", "closes", "bond itself fails", "re-adheres"):
        assert word in texts


def test_a_chart_needs_a_rod() -> None:
    with pytest.raises(po.InvalidInput, match="flaw chart"):
        plot_flaw_chart(po.trace(beta0=4, lam=(-1, 1), points=8))
