"""Loops: states are solved for, jumps are where they should be, areas are those of the forms.

Modules: `loops`, `hysteresis`, `lambda_loop`, `pressure_loop`.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import peel_opt as po
from peel_opt.plots.potential import plot_potential

SERIES = po.NormalForm.uniform(24)


@pytest.fixture(scope="module")
def loop():
    return po.hysteresis(beta0=4.0)


def test_delay_jumps_at_zero_and_at_the_fold(loop) -> None:
    up, down = loop.jumps
    assert (up.direction, up.lam, up.alpha1_before) == ("up", 0.0, 0.0)
    assert up.alpha1_after == pytest.approx(SERIES.delay(4.0)[1], abs=1e-9)
    assert (down.direction, down.alpha1_after) == ("down", 0.0)
    assert down.lam == pytest.approx(-0.26900108827, abs=1e-10)
    assert down.alpha1_before == pytest.approx(-1.3942820254, abs=1e-9)
    assert up.size > down.size
    assert loop.visited == ("adhered", "lower")
    assert "area 0.62488" in repr(loop)
    assert "not computed" in loop.not_computed


def test_every_swept_state_is_solved_for_and_certified(loop) -> None:
    for sweep in (loop.up, loop.down):
        detached = sweep.state == "lower"
        assert (sweep.row[detached] >= 0).all()
        assert (sweep.row[~detached] == -1).all()
        assert (sweep.alpha1[~detached] == 0.0).all()
        assert sweep.error.max() < 1e-10
        for lam, alpha1, row in zip(sweep.lam, sweep.alpha1, sweep.row, strict=True):
            if row >= 0:
                eq = loop.branch[int(row)]
                assert eq.certified
                assert eq.lam == pytest.approx(lam, abs=1e-10)
                assert eq.alpha1 == alpha1
                assert eq.alpha1 == pytest.approx(
                    SERIES.alpha1(4.0, lam)[0] if lam > down_at(loop) else alpha1, abs=1e-9
                )
    asked = po.equilibrium(beta0=4.0, lam=float(loop.down.lam[0]))
    assert loop.down.alpha1[0] == pytest.approx(asked.alpha1, abs=1e-8)


def down_at(loop) -> float:
    return loop.jumps[1].lam + 1e-9


def test_sweeps_are_monotone_and_meet_at_their_ends(loop) -> None:
    assert (np.diff(loop.up.lam) >= 0.0).all()
    assert (np.diff(loop.down.lam) <= 0.0).all()
    for end in (0, -1):
        assert loop.up.lam[end] == loop.down.lam[-1 - end]
        assert loop.up.alpha1[end] == loop.down.alpha1[-1 - end]
    with pytest.raises(ValueError, match="read-only"):
        loop.up.lam[0] = 1.0


def test_maxwell_jumps_twice_at_one_place_and_encloses_nothing() -> None:
    loop = po.hysteresis(beta0=4.0, convention="maxwell")
    up, down = loop.jumps
    assert up.lam == down.lam == pytest.approx(-0.23905383612, abs=1e-10)
    assert up.alpha1_after == down.alpha1_before == pytest.approx(-1.85881779096, abs=1e-9)
    assert loop.area == 0.0


@pytest.mark.parametrize("convention", ["delay", "maxwell"])
@pytest.mark.parametrize("beta0", [1e-3, 1.0, 20.0, 37.3, 37.545])
def test_loops_over_the_whole_range(beta0: float, convention: str) -> None:
    loop = po.hysteresis(beta0=beta0, convention=convention, points=7)
    fold = po.hysteresis(beta0=beta0, points=4).jumps[1].lam
    up, down = loop.jumps
    assert fold <= down.lam <= up.lam <= 0.0
    assert up.alpha1_after < 0.0 == down.alpha1_after
    assert loop.up.lam[-1] == loop.down.lam[0]
    assert loop.up.alpha1[-1] == loop.down.alpha1[0]
    # alpha1 is 0.6971 beta0 at the landing, but for what the series adds.
    if convention == "delay":
        assert up.alpha1_after == pytest.approx(-0.69 * beta0, rel=0.02)
        assert loop.area == pytest.approx(beta0**3 * 0.0097, rel=0.8)


@given(beta0=st.floats(0.01, 12.0))
@settings(max_examples=6, deadline=None)
def test_area_is_positive_and_that_of_the_series(beta0: float) -> None:
    solved = po.hysteresis(beta0=beta0, points=5)
    series = po.hysteresis(beta0=beta0, points=5, form=SERIES)
    assert solved.area > 0.0
    assert solved.area == pytest.approx(series.area, rel=1e-6)
    assert solved.jumps[0].alpha1_after == pytest.approx(series.jumps[0].alpha1_after, rel=1e-6)


@given(beta0=st.floats(1e-4, 100.0))
@settings(max_examples=25, deadline=None)
def test_area_of_the_normal_form_in_closed_form(beta0: float) -> None:
    form = po.NormalForm.paper()
    loop = po.hysteresis(beta0=beta0, form=form, points=5)
    # lambda = -(a2 beta0 x + x^2)/a1 from x = -a2 beta0 to -a2 beta0/2
    assert loop.area == pytest.approx(5.0 * (form.a2 * beta0) ** 3 / (24.0 * -form.a1), rel=1e-9)
    assert loop.source == "paper"
    assert np.isnan(loop.up.error[-1])
    assert loop.branch is None


def test_area_goes_to_zero_with_beta0() -> None:
    areas = [po.hysteresis(beta0=b, points=4).area for b in (2.0, 0.2, 0.02)]
    assert areas[0] > 900 * areas[1] > 900 * 900 * areas[2] > 0.0


@pytest.mark.parametrize("form", [None, po.NormalForm.exact(), SERIES])
@pytest.mark.parametrize("convention", ["delay", "maxwell"])
def test_loops_say_what_they_are_and_how_well_their_area_is_known(
    form: po.NormalForm | None, convention: str
) -> None:
    loop = po.hysteresis(beta0=4.0, convention=convention, form=form, points=5)
    assert "quasi-static, reversible bond" in repr(loop)
    assert f"area {loop.area:.{loop.area_digits}g}" in repr(loop)
    if form is None:
        # By parts and adaptive quadrature of the series of order 30.
        true = 0.6248806700405 if convention == "delay" else 0.0
        assert abs(loop.area - true) <= loop.area_error + 1e-13
        assert loop.area_error < 1e-9


@pytest.mark.parametrize("form", [None, po.NormalForm.exact(), SERIES])
@pytest.mark.parametrize("convention", ["delay", "maxwell"])
def test_beta0_zero_has_no_jumps(form: po.NormalForm | None, convention: str) -> None:
    loop = po.hysteresis(beta0=0.0, convention=convention, form=form, lam=(-0.5, 1.0))
    assert loop.jumps == ()
    assert loop.area == 0.0
    assert loop.up.alpha1[-1] == pytest.approx(-2.7052337656, abs=2e-2 if form is not SERIES else 1e-7)
    np.testing.assert_array_equal(loop.up.alpha1, loop.down.alpha1[::-1])
    assert "no jumps" in repr(loop)


def test_window_may_be_chosen() -> None:
    loop = po.hysteresis(beta0=4.0, lam=(-1.0, 3.0), points=9)
    assert (loop.up.lam[0], loop.up.lam[-1]) == (-1.0, 3.0)
    assert loop.up.alpha1[-1] == pytest.approx(-6.3212369673, abs=1e-9)


def test_no_loop_above_the_last_fold() -> None:
    with pytest.raises(po.NoEquilibrium, match="no fold in lambda"):
        po.hysteresis(beta0=38.0)
    assert len(po.hysteresis(beta0=38.0, form=po.NormalForm.exact()).jumps) == 2
    with pytest.raises(po.NoEquilibrium, match="no fold"):
        po.hysteresis(beta0=38.0, form=SERIES)


def test_a_form_that_ends_before_the_window_says_so() -> None:
    with pytest.raises(po.NoEquilibrium, match="narrower window"):
        po.hysteresis(beta0=4.0, form=SERIES, lam=(-1.0, 90.0))


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({}, "either a rod or beta0"),
        ({"rod": po.Rod.from_ratio(1.0), "beta0": 4.0}, "either a rod or beta0"),
        ({"beta0": -1.0}, "beta0"),
        ({"beta0": math.nan}, "beta0"),
        ({"beta0": 4.0, "convention": "late"}, "convention"),
        ({"beta0": 4.0, "points": 2}, "points"),
        ({"beta0": 4.0, "points": 9.0}, "points"),
        ({"beta0": 4.0, "tol": 0.0}, "tol"),
        ({"beta0": 4.0, "lam": (-0.1, 1.0)}, "does not hold the loop"),
        ({"beta0": 4.0, "lam": (-1.0, -0.1)}, "does not hold the loop"),
        ({"beta0": 4.0, "lam": (-200.0, 1.0)}, "does not hold the loop"),
        ({"beta0": 4.0, "lam": 1.0}, "two numbers"),
        ({"rod": po.Rod.from_ratio(1.0), "convention": "maxwell"}, "delay convention"),
        ({"rod": po.Rod.from_ratio(1.0), "form": SERIES}, "no normal form"),
    ],
)
def test_bad_input(arguments: dict, words: str) -> None:
    with pytest.raises(po.InvalidInput, match=words):
        po.hysteresis(**arguments)


# A rod under a pressure


@pytest.fixture(scope="module")
def rod_loop():
    flap = po.Rod(bending_stiffness=2.3e-5, adhesion_strength=140.1e3, adhesion_range=0.73e-3)
    return po.hysteresis(flap, points=21)


def test_a_rod_peels_at_its_strength_and_closes_at_the_least_pressure() -> None:
    up, down = po.hysteresis(po.Rod.from_ratio(1.0), points=9).jumps
    assert (up.direction, up.pressure, up.length_before) == ("up", 1.0, 0.0)
    assert (down.direction, down.length_after) == ("down", 0.0)
    assert down.pressure == pytest.approx(0.121837041296, abs=1e-9)
    assert down.length_before == pytest.approx(5.400884982, abs=1e-6)
    assert up.size == up.length_after > 0.0


def test_states_of_a_rod_are_solved_for_in_its_units(rod_loop) -> None:
    rod = rod_loop.rod
    assert rod_loop.visited == ("adhered", "folded")
    assert rod_loop.minimum_pressure == rod_loop.jumps[1].pressure
    for sweep in (rod_loop.up, rod_loop.down, rod_loop.between):
        for pressure, length, row in zip(sweep.pressure, sweep.length, sweep.row, strict=True):
            if row < 0:
                assert length == 0.0
                continue
            eq = rod_loop.branch[int(row)]
            assert eq.certified
            assert eq.pressure == pytest.approx(pressure, rel=1e-9)
            assert eq.length == pytest.approx(length, rel=1e-12)
    middle = len(rod_loop.between) // 2
    p, length = rod_loop.between.pressure[middle], rod_loop.between.length[middle]
    assert po.length_given_pressure(rod, float(p)).length == pytest.approx(float(length), rel=1e-7)
    assert set(rod_loop.between.state) <= {"middle", "lower"}


def test_the_loop_of_a_rod_closes(rod_loop) -> None:
    assert (np.diff(rod_loop.up.pressure) >= 0.0).all()
    assert (np.diff(rod_loop.down.pressure) <= 0.0).all()
    assert rod_loop.up.pressure[0] == rod_loop.down.pressure[-1]
    assert rod_loop.up.length[-1] == rod_loop.down.length[0]
    assert rod_loop.up.pressure[-1] == rod_loop.rod.adhesion_strength
    held = rod_loop.down.row >= 0
    area = -np.trapezoid(rod_loop.down.length[held], rod_loop.down.pressure[held])
    assert rod_loop.area == pytest.approx(area, rel=5e-3)
    assert "Not computed" in repr(rod_loop)


@pytest.mark.parametrize("ratio", [0.05, 0.4, 20.0])
def test_loops_of_other_rods(ratio: float) -> None:
    loop = po.hysteresis(po.Rod.from_ratio(ratio), points=5)
    assert loop.area > 0.0
    assert 0.0 < loop.minimum_pressure < 1.0
    assert loop.visited == ("adhered", "folded")


#: Areas over T0 eta, integrated at states solved for at Gauss's nodes between those of the branch.
AREAS = {1.0: 3.82306659, 50.0: 6.342401, 1000.0: 6.84798099}


@pytest.mark.parametrize("points", [4, 41, pytest.param(200, marks=pytest.mark.slow)])
@pytest.mark.parametrize(
    ("ratio", "area"), [pytest.param(*of, marks=[pytest.mark.slow] * (of[0] > 100.0)) for of in AREAS.items()]
)
def test_the_area_of_a_rod_is_known_to_its_error(ratio: float, area: float, points: int) -> None:
    loop = po.hysteresis(po.Rod.from_ratio(ratio), points=points)
    assert abs(loop.area - area) <= loop.area_error + 1.5e-6  # and what the value above is known to
    assert loop.area_error < 2e-4 * loop.area
    assert f"area {loop.area:.{loop.area_digits}g} " in repr(loop)


# Pictures


def test_loops_are_drawn_with_their_jumps(loop, rod_loop) -> None:
    ax = Figure().subplots()
    assert loop.plot(ax) is ax
    heads = [line for line in ax.lines if str(line.get_gid()).startswith("mark:")]
    assert [line.get_xdata()[0] for line in heads] == [jump.lam for jump in loop.jumps]
    for line, jump in zip(heads, loop.jumps, strict=True):
        assert min(jump.before, jump.after) < line.get_ydata()[0] < max(jump.before, jump.after)
    for picture in (loop.plot(), rod_loop.plot(), po.hysteresis(beta0=0.0).plot()):
        assert isinstance(picture, Axes)
        picture.figure.canvas.draw()


def test_fig_7_marks_its_critical_points() -> None:
    ax = plot_potential(po.NormalForm.paper().at(4.0))
    ax.figure.canvas.draw()
    labels = [text.get_text() for text in ax.get_legend().get_texts()]
    assert any("-0.2658" in label for label in labels)
    assert any("-0.2363" in label for label in labels)
    marks = [line for line in ax.lines if line.get_marker() in "os" and len(line.get_xdata()) == 1]
    assert len(marks) == 1 + 2 + 3 + 3
    plot_potential(
        po.branch_potential(po.trace(beta0=4.0, lam=(-1.0, 1.0))), [-0.2, 0.1]
    ).figure.canvas.draw()
    plot_potential(SERIES.at(0.0)).figure.canvas.draw()
