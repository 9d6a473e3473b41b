"""Pictures where they are looked at: in notebooks, beside pyplot, on dark paper, with a reader's keywords.

Modules: plots/legible.py, plots/axes.py, plots/dispatch.py, base/drawing.py.
"""

from __future__ import annotations

import io
import subprocess
import sys
from collections.abc import Callable

import matplotlib.style
import numpy as np
import pytest
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.image import imread

import peel_opt as po
from peel_opt.plots import plot_branch
from peel_opt.plots.legible import CONTRAST, contrast, ink, paper

from ..rods import FLAP


@pytest.fixture(scope="module")
def eq() -> po.Equilibrium:
    return po.equilibrium(beta0=2.0, lam=0.5)


def test_contrast_is_that_of_the_standard() -> None:
    assert contrast("black", "white") == pytest.approx(21.0)
    assert contrast("#767676", "white") == pytest.approx(4.54, abs=0.01)  # the grey that WCAG's texts name


def test_nothing_is_lost_on_dark_paper(eq: po.Equilibrium) -> None:
    with matplotlib.style.context("dark_background"):
        ax = eq.plot(Figure(layout="constrained").add_subplot())
        for line in ax.lines:
            assert contrast(line.get_color(), "black") >= CONTRAST - 1e-9, line.get_gid()
        for text in ax.texts:
            assert contrast(text.get_color(), "black") >= CONTRAST - 1e-9, text.get_text()
        tip = next(line for line in ax.lines if line.get_gid() == "mark:tip")
        assert to_rgba(tip.get_markerfacecolor()) == (
            0.0,
            0.0,
            0.0,
            1.0,
        )  # hollow: the paper is seen through it


def test_on_light_paper_colours_are_those_of_the_styles(eq: po.Equilibrium) -> None:
    rod = next(line for line in eq.plot().lines if line.get_gid() == "rod")
    assert rod.get_color() == "#000000"
    assert ink("#000000", (0.0, 0.0, 0.0)) == (1.0, 1.0, 1.0)


def test_paper_under_clear_axes_is_that_of_the_figure() -> None:
    ax = Figure(facecolor="black").add_subplot(facecolor="none")
    assert paper(ax) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize("shape", [(1, 1), (1, 2), (2, 2)])
def test_a_legend_covers_nothing_where_no_engine_makes_room(
    eq: po.Equilibrium, shape: tuple[int, int]
) -> None:
    figure = Figure(figsize=(11.0, 8.0))
    axes = np.atleast_1d(figure.subplots(*shape)).ravel()
    for ax in axes:
        eq.plot(ax)
    figure.canvas.draw()
    for ax in axes:
        legend = ax.get_legend()
        assert legend is not None
        box = legend.get_window_extent()
        assert not any(box.overlaps(other.get_window_extent()) for other in axes)
        assert box.x1 <= figure.bbox.x1 + 1.0
        assert box.y0 >= -1.0


def test_legend_and_title_are_as_wished(eq: po.Equilibrium) -> None:
    ax = eq.plot(legend=False, title="Tape at rest")
    assert ax.get_legend() is None
    assert ax.get_title(loc="left") == "Tape at rest"
    assert eq.plot().get_legend() is not None


@pytest.mark.slow
def test_axes_are_logarithmic_where_a_branch_spans_decades(branch_of: Callable[..., po.Branch]) -> None:
    slender = branch_of(500.0)  # over two decades of lengths, and five of pressures
    ax = slender.plot()
    assert (ax.get_xscale(), ax.get_yscale()) == ("log", "log")
    assert slender.plot(log=False).get_yscale() == "linear"
    short = branch_of(1.0)
    assert short.pressure.max() < 100.0 * short.pressure.min()
    assert short.plot().get_yscale() == "linear"
    assert short.plot(log=True).get_xscale() == "log"
    with pytest.raises(po.InvalidInput, match="no logarithm"):
        plot_branch(short, x="lam", y="alpha1", log=True)


def test_a_result_shows_its_words_its_numbers_and_its_picture(eq: po.Equilibrium) -> None:
    shown = eq._repr_mimebundle_()
    assert imread(io.BytesIO(shown["image/png"])).shape[0] > 100
    assert "<table>" in shown["text/html"]
    assert 'src="data:image/png;base64,' in shown["text/html"]
    assert shown["text/plain"] == repr(eq)
    assert "<pre" in po.Rod.from_ratio(1.0)._repr_html_()


def test_what_was_not_found_shows_why() -> None:
    none = po.Equilibrium.nothing(None, "alpha1", 1e-10, "no equilibrium", "nothing <there>")
    shown = none._repr_mimebundle_()
    assert "image/png" not in shown
    assert "nothing &lt;there&gt;" in shown["text/html"]


def test_figures_are_pyplots_where_it_is_in_use_but_not_what_a_page_shows() -> None:
    code = """
import matplotlib.pyplot as plt
import peel_opt as po
eq = po.equilibrium(beta0=2.0, lam=0.5)
eq._repr_png_()
assert plt.get_fignums() == []
ax = eq.plot()
assert plt.get_fignums() == [ax.figure.number]
fig, own = plt.subplots()
eq.plot(own)
assert len(plt.get_fignums()) == 2
"""
    subprocess.run([sys.executable, "-W", "error", "-c", code], check=True)


def test_a_notebook_shows_results_and_pictures(tmp_path) -> None:
    nbformat, nbclient = pytest.importorskip("nbformat"), pytest.importorskip("nbclient")
    pytest.importorskip("ipykernel")
    cells = [
        "%matplotlib inline\nimport matplotlib.pyplot as plt, peel_opt as po",
        "eq = po.equilibrium(beta0=2.0, lam=0.5)",
        "eq",
        "eq.plot(title='mine');",
        "po.Rod.from_ratio(1.0)",
    ]
    book = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(cell) for cell in cells])
    nbclient.NotebookClient(book, timeout=120, resources={"metadata": {"path": str(tmp_path)}}).execute()
    told = [[output for output in cell.outputs if output.output_type != "stream"] for cell in book.cells]
    (result,) = told[2]  # once, and no second picture below the cell
    assert {"text/plain", "text/html", "image/png"} <= set(result.data)
    (figure,) = told[3]
    assert "image/png" in figure.data
    assert "eta/y0=1" in told[4][0].data["text/html"]


@pytest.mark.slow
def test_histograms_and_holes_of_charts_are_dark_on_dark_paper() -> None:
    lengths = po.uncertainty(FLAP, {"pressure": "5 kPa"}, pressure=80e3, samples=16, workers=1)
    chart = po.sweep(
        {"ratio": np.linspace(0.6, 2.0, 8), "pressure_ratio": np.linspace(0.2, 0.9, 8)}, workers=1
    )
    with matplotlib.style.context("dark_background"):
        bars, hole = lengths.plot(), chart.plot()
    for patch in bars.patches:
        *colour, alpha = patch.get_facecolor()
        assert alpha * colour[0] < 0.3
    assert contrast(hole.get_facecolor(), "white") > 10.0
    assert max(chart.plot().get_facecolor()[:3]) == pytest.approx(0.93)


@pytest.mark.parametrize("name", ["critical_length", "critical_flaw", "safe_pressure"])
def test_every_uncertain_quantity_has_a_symbol(name: str) -> None:
    from peel_opt.plots.spread import SYMBOLS

    assert name in SYMBOLS
