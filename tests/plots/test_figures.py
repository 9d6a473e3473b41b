"""The paper's figures: made from traced branches, with the numbers they show."""

import io
import re

import numpy as np
import pytest

import peel_opt as po
from peel_opt.app.cli.curves import NAMES
from peel_opt.app.cli.main import main
from peel_opt.plots import figures
from peel_opt.plots.figures import rod_shapes, three_kinds, work_precision
from peel_opt.plots.figures.minimum_pressure import least_pressure, slender
from peel_opt.plots.figures.pressure_profiles import linear_profile

#: Fewer than look good, as many as the numbers in the figures need.
POINTS = 16


def texts(figure):
    """All words in a figure."""
    figure.canvas.draw()
    return "\n".join(artist.get_text() for artist in figure.findobj(lambda a: hasattr(a, "get_text")))


def numbers(text):
    return [float(number) for number in re.findall(r"-?\d+\.\d+", text.replace("\N{MINUS SIGN}", "-"))]


def test_figure_3_has_one_solution_of_each_kind():
    acceptable, too_high, below = (three_kinds.solved(kind) for kind in three_kinds.KINDS)
    assert acceptable.valid
    assert not too_high.valid
    assert "y > y0" in too_high.flags
    assert (below.y <= 0.0).all()
    for eq in (acceptable, too_high, below):
        # y_tip = 2 y0 (1 - p/T0) on every branch of the linear law.
        tip = eq.y[0] * eq.beta1 / eq.beta0
        assert tip == pytest.approx(2.0 * (1.0 - eq.pressure_ratio), abs=1e-10)
    found = numbers(texts(figures.figure_3()))
    for value in (0.925709, 1.666176, -0.272464, 0.477468):
        assert value in found
    # What law (8) says of (c): by collocation, another method than the figure's.
    rod = po.Rod.from_ratio(too_high.ratio)
    other = po.pressure_given_length(rod, too_high.length_ratio, method="collocation")
    assert other.pressure_ratio == pytest.approx(0.477468, abs=1e-6)


def test_figure_7_has_the_papers_numbers_beside_the_exact_ones():
    left, right = figures.figure_7().axes
    printed, exact = (numbers("\n".join(t.get_text() for t in ax.get_legend().texts)) for ax in (left, right))
    assert {-0.2658, -0.2363} < set(printed)
    assert {-0.2682, -0.2384} < set(exact)


def test_figure_9_shows_that_the_length_is_not_proportional_to_eta():
    left, right = figures.figure_9(points=40).axes
    (ratio, over_y0), (_, over_eta) = (ax.lines[1].get_data() for ax in (left, right))
    known = np.isfinite(over_y0)
    assert ratio[known][0] == pytest.approx(0.5, abs=0.06)
    np.testing.assert_allclose(over_eta[known] * ratio[known], over_y0[known], rtol=1e-12)
    assert over_y0[-1] == pytest.approx(5.215062, abs=1e-5)
    assert over_eta[known][0] / over_eta[-1] == pytest.approx(1.28, abs=0.02)


def test_the_fold_curve_is_one_curve_in_two_parts():
    ax = figures.figure_fold_curve(points=60).axes[0]
    paper, first, second = (ax.lines[i].get_xydata() for i in range(3))
    assert first[-1] == pytest.approx(second[0])
    assert first[-1] == pytest.approx([36.1149, -59.0833], abs=1e-3)
    assert first[:, 0].max() == pytest.approx(37.5458, abs=1e-3)
    assert np.interp(4.0, *paper.T) == pytest.approx(-0.2658, abs=2e-2)


def test_the_chart_of_held_lengths_ends_at_the_minimum_pressure():
    figure = figures.figure_held_lengths(points=POINTS)
    length, pressure = figure.axes[0].lines[0].get_data()
    critical = np.pi * (2.3e-5 * 0.73e-3 / 140e3) ** 0.25  # (20), in metres
    assert (length[0], pressure[0]) == (pytest.approx(1e3 * critical), pytest.approx(140.0))
    assert pressure[-1] == pytest.approx(25.942, abs=1e-3)
    assert "which nothing holds there" in texts(figure)


def test_work_precision_shows_every_method_on_both_questions(monkeypatch):
    monkeypatch.setattr(work_precision, "TOLS", (1e-3,))
    left, right = figures.figure_work_precision(repeats=1).axes
    names = [{text.get_text() for text in ax.get_legend().texts} for ax in (left, right)]
    assert names[0] == {"series", "spectral", "collocation", "shooting", "solve_bvp"}
    assert names[1] == names[0] - {"series"}  # it does not reach below T0/2


def test_figure_4_shows_three_traced_folds():
    figure = figures.figure_4(points=POINTS)
    found = numbers(texts(figure))
    for value in (-0.067107065, -0.697144261, -0.269001088, -1.394282025):
        assert value in found
    assert "its text speaks of" in texts(figure)


def test_figure_5_has_every_part_of_the_branch_and_the_shapes():
    figure = figures.figure_5(points=POINTS)
    top, bottom = figure.axes[0], figure.axes[2]
    words = texts(figure)
    for value in (-0.26900109, -1.39428203, -0.2658, -1.3920, 1.3477, -1.3477, 0.5449, -3.3324):
        assert value in numbers(words)
    assert [len(ax.child_axes) for ax in (top, bottom)] == [2, 2]
    parts = {line.get_label(): line for line in bottom.lines}
    middle = parts["middle, traced"].get_xdata()
    assert np.nanmin(middle) == pytest.approx(-0.26900108827, abs=1e-10)
    assert np.nanmax(middle) == pytest.approx(0.0, abs=1e-9)
    assert "middle, traced" in [text.get_text() for text in top.get_legend().get_texts()]


def test_figure_6_shows_how_far_the_normal_form_is_off():
    figure = figures.figure_6(points=POINTS)
    beside = figure.axes[1]
    paper, exact = (line.get_xdata() for line in beside.lines[:2])
    assert np.nanmax(paper) == pytest.approx(0.046, abs=1e-3)
    assert np.nanmax(exact) == pytest.approx(0.031, abs=1e-3)


def test_figure_8_says_where_38_is_no_solution():
    figure = figures.figure_8(points=POINTS)
    words = {ax.get_title(loc="left"): "\n".join(t.get_text() for t in ax.texts) for ax in figure.axes}
    for ratio in (0.1, 0.2):
        assert "No solution of (12)" in words[rf"$\eta/y_0 = {ratio}$"]
    for ratio in (0.5, 1, 2):
        assert "No solution" not in words[rf"$\eta/y_0 = {ratio}$"]
    titles = [ax.get_title(loc="right") for ax in figure.axes]
    assert titles[3] == r"$P_F = 0.651466$,  $P_\mathrm{min} = 0.121837$"
    law8, linear = (line.get_xydata() for line in figure.axes[3].lines[:2])
    # The two laws part at p = T0/2 and not before.
    shared = linear[linear[:, 1] > 0.5]
    on_way = law8[: int(np.argmin(law8[:, 1])) + 1]
    np.testing.assert_allclose(np.interp(-shared[:, 1], -on_way[:, 1], on_way[:, 0]), shared[:, 0], atol=2e-2)
    assert linear[-1, 1] < 0.0


def test_the_linear_law_goes_on_below_zero_pressure():
    sigma, pressure = linear_profile(1.0, 4.0, 0.5)
    assert (sigma[0], pressure[0]) == (pytest.approx(np.pi), 1.0)
    assert pressure[-1] < 0.0


def test_figure_10_prints_what_the_paper_prints_and_what_is_true():
    words = numbers(texts(figures.figure_10(points=100)))
    for value in (13.29, 14.86, 14.8646046, 250.4, 297.6, 298.4321647):
        assert value in words


@pytest.mark.parametrize("panel", rod_shapes.PANELS, ids=lambda panel: panel.letter)
def test_figure_10_agrees_between_methods(panel):
    spectral = rod_shapes.recomputed(panel)
    near = spectral.alpha1
    shooting = po.equilibrium(beta0=panel.beta0, beta1=panel.beta1, near=near, method="shooting")
    assert shooting.alpha == pytest.approx(spectral.alpha, abs=1e-7)
    assert "y > y0" in spectral.flags
    assert (rod_shapes.under_law_8(panel) is None) == (panel.letter == "b")


def test_minimum_pressure_and_its_asymptotes():
    assert least_pressure(1.0) == pytest.approx(0.121837041296, abs=1e-10)
    assert (1.0 - least_pressure(0.005)) / 0.005 == pytest.approx(1.022, abs=3e-3)
    assert least_pressure(100.0) == pytest.approx(float(slender(np.array(100.0))), rel=1e-4)
    ratio, least = figures.figure_p_min(points=POINTS).axes[0].lines[0].get_data()
    assert ratio[[0, -1]] == pytest.approx([0.005, 3000.0])
    assert (np.diff(least) < 0.0).all()


# --- files and the command line -------------------------------------------------------------


def test_make_writes_pdf_and_png(tmp_path, capsys):
    files = figures.make(["4", 10], tmp_path / "new" / "folder", points=POINTS, dpi=40)
    assert [f.name for f in files] == ["figure_4.pdf", "figure_4.png", "figure_10.pdf", "figure_10.png"]
    assert files[0].read_bytes().startswith(b"%PDF")
    assert files[1].read_bytes().startswith(b"\x89PNG")
    assert capsys.readouterr() == ("", "")


def test_progress_is_shown_to_people_only(tmp_path, monkeypatch):
    class Terminal(io.StringIO):
        def isatty(self):
            return True

    monkeypatch.setattr("peel_opt.base.progress.PATIENCE", 0.0)
    monkeypatch.setattr("sys.stderr", terminal := Terminal())
    figures.make(["4"], tmp_path, points=POINTS, formats=("svg",))
    assert "1/1" in terminal.getvalue()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((["2"],), "no figure '2'"),
        ((["4"], "{tmp}/file/under"), "cannot make the folder"),
    ],
)
def test_what_cannot_be_made_is_said(arguments, words, tmp_path):
    (tmp_path / "file").write_text("")
    names, *out = arguments
    with pytest.raises(po.InvalidInput, match=words):
        figures.make(names, *(o.format(tmp=tmp_path) for o in out))
    with pytest.raises(po.InvalidInput, match="at least 8"):
        figures.make(["4"], tmp_path, points=3)


def test_the_help_names_every_figure():
    assert all(name.isdigit() or name in NAMES for name in figures.FIGURES)
    assert [name for name in figures.FIGURES if name.isdigit()] == [str(n) for n in range(3, 11)]
    assert NAMES.startswith("3 to 10")


def test_figures_command(tmp_path, capsys):
    assert main(["figures", "6", "--points", "16", "--out", str(tmp_path)]) == 0
    out, err = capsys.readouterr()
    assert out.splitlines() == [str(tmp_path / "figure_6.pdf"), str(tmp_path / "figure_6.png")]
    assert err == ""
    assert main(["figures", "99"]) == 2
    assert capsys.readouterr().err.startswith("peel-opt: there is no figure '99'.")


def test_trace_command_prints_special_points_and_writes_files(tmp_path, capsys):
    code = main(["trace", "--beta0", "4", "--lam", "-1", "3", "--points", "24", "--out", str(tmp_path)])
    out, err = capsys.readouterr()
    assert (code, err) == (0, "")
    assert "linear law, beta0 = 4" in out
    assert re.search(
        r"LP-lambda  fold in lambda +0\.651429\d* +1\.587401\d* +-0\.2690010883 +-1\.394282025", out
    )
    written = [f"branch-beta0-4.{end}" for end in ("csv", "npz", "png")]
    assert sorted(p.name for p in tmp_path.iterdir()) == [*written, "written.json"]
    back = po.Branch.load(tmp_path / "branch-beta0-4.npz")
    assert back.index is not None
    assert back.special("LP-lambda")[0].lam == pytest.approx(-0.26900108827, abs=1e-10)


def test_trace_command_for_a_rod(capsys):
    import json

    rod = ["--k", "23 uN m", "--T0", "140 kPa", "--y0", "0.73 mm", "--points", "24", "--tol", "1e-6"]
    assert main(["trace", *rod]) == 0
    out = capsys.readouterr().out
    for words in ("kPa", "mm", "fold in pressure", "ended: contact"):
        assert words in out
    assert main(["trace", *rod, "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    least = next(p for p in document["special_points"] if p["kind"] == "LP-pressure")
    assert least["pressure [Pa]"] == pytest.approx(25942.4, abs=0.1)
    assert main(["trace", "--beta0", "0", "--lam", "-1", "1", "--points", "8", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["special_points"][0]["pressure_ratio"] is None


@pytest.mark.parametrize(
    "arguments",
    [
        (),
        ("--beta0", "4", "--ratio", "1"),
        ("--beta0", "-1"),
        ("--beta0", "nan"),
        ("--beta0", "4", "--lam", "3", "-1"),
        ("--ratio", "1", "--lam", "0", "1"),
        ("--ratio", "1", "--law", "glue"),
        ("--ratio", "1", "--points", "1"),
        ("--beta0", "4", "--mode", "0"),
    ],
)
def test_a_trace_that_cannot_be_meant_is_wrong_input(arguments, capsys):
    assert main(["trace", *arguments]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.count("\n") == 1


@pytest.mark.slow
def test_all_figures_at_full_resolution(tmp_path):
    files = figures.make(out=tmp_path)
    assert len(files) == 2 * len(figures.FIGURES)
    assert all(f.stat().st_size > 10_000 for f in files)
