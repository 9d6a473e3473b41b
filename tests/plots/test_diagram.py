"""Diagrams of branches, read back from what Matplotlib was told to draw."""

import sys
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure

import peel_opt as po
from peel_opt.plots import plot_branch, save_figure
from peel_opt.plots.diagram import AT_LENGTH, LABELS, diagram_panel
from peel_opt.plots.style import DASHED, SPURIOUS

from ..rods import FLAP


@pytest.fixture(scope="module")
def fixed():
    return po.trace(beta0=4, lam=(-1, 3), points=24)


@pytest.fixture(scope="module")
def rod_branch():
    rod = FLAP
    return po.trace(rod, points=24, tol=1e-6)


def lines(ax, gid):
    """Lines of a look; "branch" is all of the detached ones, "spurious" all that are."""
    looks = {"branch": ("branch", "stable", "unstable", "unknown")}.get(gid, (gid,))
    return [line for line in ax.lines if str(line.get_gid()).removesuffix("-unstable") in looks]


def letters(ax):
    return {text.get_text(): text for text in ax.texts if str(text.get_gid()).startswith("letter:")}


def legend(ax):
    return [text.get_text() for text in ax.get_legend().get_texts()]


def drawn(ax, gid):
    """Points of all lines of a kind, in order of the first coordinate."""
    xy = np.concatenate([np.column_stack(line.get_data()) for line in lines(ax, gid)])
    return np.unique(xy, axis=0)


def test_at_fixed_beta0_lambda_and_alpha1_with_the_straight_rod(fixed):
    ax = plot_branch(fixed)
    assert (ax.get_xlabel(), ax.get_ylabel()) == (r"$\lambda$", r"extra pressure $\alpha_1$")
    (straight,) = lines(ax, "straight")
    np.testing.assert_array_equal(straight.get_ydata(), 0.0)
    assert straight.get_xdata()[[0, -1]].tolist() == [-1.0, 3.0]
    points = np.concatenate([drawn(ax, "branch"), drawn(ax, "spurious")])
    expected = np.column_stack([fixed.lam, fixed.alpha1])
    assert {tuple(p) for p in points} == {tuple(p) for p in expected}


def test_spurious_parts_are_grey_and_end_at_t(fixed):
    ax = plot_branch(fixed)
    (grey,) = lines(ax, "spurious")
    assert grey.get_color() == SPURIOUS
    assert grey.get_ydata().min() == 0.0
    assert drawn(ax, "branch")[:, 1].max() == 0.0
    assert any("spurious" in text for text in legend(ax))


def test_special_points_have_a_marker_a_letter_and_a_line_in_the_legend(fixed, rod_branch):
    ax = plot_branch(fixed)
    assert set(letters(ax)) == {"T", "F", "Y"}
    fold = fixed.special("LP-lambda")[0]
    assert letters(ax)["F"].xy == (fold.lam, fold.alpha1)
    assert sum("fold in" in text for text in legend(ax)) == 1
    both = plot_branch(rod_branch)
    assert {"T", "F$_1$", "F$_2$", "P", "C"} < set(letters(both))
    folds = rod_branch.special("LP-length")
    assert letters(both)["F$_1$"].xy == pytest.approx(
        (folds[0].length_ratio * rod_branch.rod.eta * 1e3, 91.19), rel=1e-3
    )
    assert sum("fold in length" in text for text in legend(both)) == 1


def test_a_rod_is_drawn_in_its_units(rod_branch):
    ax = plot_branch(rod_branch)
    assert (ax.get_xlabel(), ax.get_ylabel()) == (r"detached length $\bar s$ [mm]", "pressure $p$ [kPa]")
    np.testing.assert_allclose(
        np.concatenate([line.get_ydata() for line in lines(ax, "branch")]), rod_branch.pressure / 1e3
    )
    by_ratio = plot_branch(replace(rod_branch, rod=po.Rod.from_ratio(rod_branch.rod.ratio)))
    assert (by_ratio.get_xlabel(), by_ratio.get_ylabel()) == (
        r"detached length $\bar s/\eta$",
        "pressure $p/T_0$",
    )


def test_stability_is_solid_or_dashed_where_it_is_known(fixed):
    assert {line.get_linestyle() for line in lines(plot_branch(fixed), "branch")} == {"-"}
    fold = fixed.special("LP-lambda")[0].index
    count = len(fixed)
    known = replace(fixed, index=(np.arange(count) < fold).astype(int), flutter=np.zeros(count, int))
    ax = plot_branch(known)
    unstable, stable = lines(ax, "branch")
    assert unstable.is_dashed()
    assert not stable.is_dashed()
    # Both reach the fold, where stability changes.
    assert unstable.get_xdata()[-1] == stable.get_xdata()[0] == fixed.lam[fold]
    assert {"detached, stable at fixed $p$", "detached, unstable at fixed $p$"} < set(legend(ax))
    assert DASHED[0] > DASHED[1]


def test_a_page_may_read_stability_at_fixed_length(fixed):
    known = [{"lower": True, "middle": False}.get(label) for label in fixed.state.tolist()]
    panel = diagram_panel(fixed, stable=known, reading=AT_LENGTH)
    by_look = {
        look: [line for line in panel.lines if line.look == look] for look in {k.look for k in panel.lines}
    }
    assert by_look.keys() == {"straight", "straight-unstable", "spurious", "unstable", "stable"}
    (stable,) = by_look["stable"]
    fold = fixed.special("LP-lambda")[0]
    assert stable.y.max() == fold.alpha1
    assert by_look["straight"][0].x.max() == by_look["straight-unstable"][0].x.min() == 0.0
    assert by_look["straight"][0].label == "straight rod"


def test_the_picture_does_not_depend_on_the_direction(fixed, rod_branch):
    for branch in (fixed, rod_branch):
        count = len(branch)
        indexed = replace(branch, index=(np.arange(count) % 7 == 0).astype(int), flutter=np.zeros(count, int))
        there, back = plot_branch(indexed), plot_branch(indexed[::-1])
        assert len(there.lines) == len(back.lines)
        for a, b in zip(there.lines, back.lines, strict=True):
            np.testing.assert_array_equal(a.get_data(), b.get_data())
            assert (a.get_color(), a.get_linestyle()) == (b.get_color(), b.get_linestyle())
        mine, theirs = letters(there), letters(back)
        assert mine.keys() == theirs.keys()
        for name, text in mine.items():
            assert text.xy == theirs[name].xy
            assert text.xyann == pytest.approx(theirs[name].xyann, rel=1e-12)
        assert legend(there) == legend(back)


def test_letters_stand_outside_the_bend(fixed):
    text = letters(plot_branch(fixed))["F"]
    assert text.xyann[0] < -5.0
    assert abs(text.xyann[1]) < 3.0


def test_any_two_columns(fixed, rod_branch):
    known = replace(rod_branch, index=np.zeros(len(rod_branch), int))
    for name in LABELS:
        ax = plot_branch(known, x="arclength", y=name)
        assert ax.get_ylabel()
    assert plot_branch(rod_branch, y="tip_height").get_ylabel() == r"$y_\mathrm{tip}$ [mm]"
    assert plot_branch(fixed, x="length", y="pressure").get_ylabel() == r"$\alpha$"
    assert not lines(plot_branch(fixed, y="tip_angle"), "straight")


def test_what_cannot_be_drawn_is_said(fixed):
    with pytest.raises(po.InvalidInput, match="no column 'colour'"):
        plot_branch(fixed, x="colour")
    with pytest.raises(po.InvalidInput, match="index has not been computed"):
        plot_branch(fixed, y="index")
    with pytest.raises(po.InvalidInput, match="no points"):
        plot_branch(fixed[:0])
    with pytest.raises(po.InvalidInput, match="no finite value"):
        plot_branch(po.trace(beta0=0, lam=(-1, 1), points=8), y="pressure_ratio")


def test_branches_of_other_modes_keep_their_own_t():
    second = po.trace(beta0=4, lam=(1300, 1500), mode=2, points=8)
    ax = plot_branch(second)
    assert "T" in letters(ax)
    assert len([line for line in ax.lines if line.get_gid() == "mark:T"]) == 1


def test_axes_are_taken_and_given_back_and_pyplot_is_not_touched(fixed, monkeypatch):
    monkeypatch.delitem(sys.modules, "matplotlib.pyplot", raising=False)  # a window may have been opened here
    figure = Figure()
    ax = figure.add_subplot()
    assert plot_branch(fixed, ax) is ax
    assert plot_branch(fixed[5:6], ax, legend=False) is ax
    assert "matplotlib.pyplot" not in sys.modules


def test_it_can_be_saved(fixed, tmp_path):
    path = save_figure(fixed.plot().figure, tmp_path / "branch.png", dpi=50)
    assert path.stat().st_size > 5000
