"""The explorer's model: states, links, cards, screens; nothing here knows Bokeh or a browser."""

from __future__ import annotations

import csv
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import CubicHermiteSpline

import peel_opt as po
from peel_opt.analysis.maxwell import TURN
from peel_opt.analysis.pressure_loop import PressureLoop
from peel_opt.app import explorer
from peel_opt.app.cards import load_card
from peel_opt.app.explorer import moves
from peel_opt.app.explorer.answers import full_answer
from peel_opt.app.explorer.curves import window
from peel_opt.app.explorer.potential import landscape
from peel_opt.app.explorer.quick_walks import quick_branch, quick_groups, quick_rod
from peel_opt.app.explorer.screens import full_screen, live_screen
from peel_opt.app.explorer.state import CHOICES, State
from peel_opt.app.explorer.state_cards import from_card, to_card
from peel_opt.app.explorer.tables import COLUMNS, screen_csv
from peel_opt.base.units import told_apart
from peel_opt.continuation.primary import PrimaryBranch
from peel_opt.model.bond import COHESIVE, LINEAR
from peel_opt.residual.closures import Closure, Plane, chart

#: Cards that ask for an equilibrium of the paper's scene.
PROBLEMS = [
    path
    for path in sorted((Path(__file__).parents[2] / "problems").glob("*.toml"))
    if "[[questions]]" in (text := path.read_text(encoding="utf-8")) and "[scene]" not in text
]

ROD = State(given="length", law="cohesive")
PRESSED = State(given="pressure", law="cohesive", pressure=0.3)
SI = State(units="SI", given="length", law="cohesive", length=1.9e-3, pressure=6e4)


@pytest.mark.parametrize("name", explorer.__all__)
def test_what_the_explorer_offers_is_there(name: str) -> None:
    assert getattr(explorer, name).__name__ == name


# --- states, links, cards ---------------------------------------------------------------------


@pytest.mark.parametrize("state", [State(), ROD, PRESSED, SI, State(beta0=0.1 + 0.2, lam=1 / 3, near=-2.0)])
def test_a_link_restores_the_state_exactly(state: State) -> None:
    assert State.from_query(state.to_query()) == (state, ())


@given(
    beta0=st.floats(1e-3, 1e4),
    lam=st.floats(-90.0, 1e5),
    accuracy=st.sampled_from(CHOICES["accuracy"]),
    label=st.sampled_from(State().labels),
)
@settings(max_examples=40, deadline=None)
def test_links_of_any_numbers(beta0: float, lam: float, accuracy: Any, label: Any) -> None:
    state = State(beta0=beta0, lam=lam, accuracy=accuracy, label=label)
    assert State.from_query("?" + state.to_query()) == (state, ())


@pytest.mark.parametrize(
    ("query", "said"),
    [
        ("beta0=nan", "beta0 must be a finite number"),
        ("beta0=-4", "beta0 = -4 is outside"),
        ("lam=1e999", "lambda must be a finite number"),
        ("lam=-1000", "lambda = -1000 is outside"),
        ("k=0&units=SI&given=length", "k [N m] must be positive"),
        ("law=<script>alert(1)</script>", "law cannot be '<script>"),
        ("<script>=1", "names '<script>', which is not known"),
        ("beta0=" + "9" * 4000, "finite"),
        ("beta0=4&beta0=5", "gives beta0 2 times"),
        ("units=SI&given=groups", "its groups follow"),
        ("ratio=0", "must be positive"),
        ("units=SI&given=length&T0=1e-9", "outside [0.005, 3000]"),
        ("beta0=0&law=cohesive", "no cohesive law"),
        ("length=%00", "length must be a finite number"),
        ("beta0=%ff%fe", "beta0 must be a finite number"),
    ],
)
def test_what_a_link_cannot_mean_is_said_in_a_line(query: str, said: str) -> None:
    state, messages = State.from_query(query)
    assert isinstance(state, State)
    assert any(said in message for message in messages)
    assert all(len(message) < 300 and "\n" not in message for message in messages)


def test_a_wrong_number_does_not_take_the_right_ones_with_it() -> None:
    state, messages = State.from_query({"beta0": [b"7"], "lam": [b"x"]})
    assert (state.beta0, state.lam, len(messages)) == (7.0, State().lam, 1)


@pytest.mark.parametrize("path", PROBLEMS, ids=lambda p: p.stem)
def test_cards_open_in_the_explorer_and_come_back(path: Path, tmp_path: Path) -> None:
    card = load_card(path)
    state = from_card(card)
    copy = tmp_path / "copy.toml"
    copy.write_text(to_card(state), encoding="utf-8")
    ((_, mine),) = load_card(copy).ask(tol=1e-7)
    _, theirs = card.ask(tol=1e-7)[0]
    assert isinstance(mine, po.Equilibrium)
    assert isinstance(theirs, po.Equilibrium)
    assert (mine.answered, mine.state) == (theirs.answered, theirs.state)
    assert mine.answer == pytest.approx(theirs.answer, rel=1e-9)


@pytest.mark.parametrize(
    "state",
    [
        State(),
        State(accuracy="sketch"),
        State(accuracy="draft", lam=2.0, label="spurious"),
        PRESSED.changed(label="folded"),
        SI,
        SI.changed(given="pressure", law="cohesive", accuracy="reference"),
    ],
)
def test_the_card_of_a_state_is_answered_as_the_page_shows_it(state: State, tmp_path: Path) -> None:
    path = tmp_path / "state.toml"
    path.write_text(to_card(state), encoding="utf-8")
    ((_, asked),) = load_card(path).ask()
    shown = full_answer(state).equilibrium
    assert isinstance(asked, po.Equilibrium)
    assert shown is not None
    assert abs(asked.answer - shown.answer) <= asked.error + shown.error
    assert (asked.state, asked.law, asked.certified) == (shown.state, shown.law, shown.certified)


def test_the_adhered_rod_has_no_card() -> None:
    with pytest.raises(po.InvalidInput, match="no question"):
        to_card(State(label="adhered"))


def test_numbers_are_typed_with_the_units_of_the_rod() -> None:
    assert SI.typed("length", "1.8 mm").length == pytest.approx(1.8e-3)
    assert SI.typed("pressure", "0.4 T0").pressure == pytest.approx(0.4 * SI.T0)
    assert SI.typed("k", "23 uN m").k == pytest.approx(2.3e-5)
    for name, text in [("k", "23"), ("beta0", "nan"), ("lam", "<b>"), ("length", "-1 mm"), ("T0", "1e99 Pa")]:
        with pytest.raises(po.PeelOptError, match=name.replace("lam", "lambda")):
            (SI if name in ("k", "length", "T0") else State()).typed(name, text)


def test_switching_units_keeps_the_state_without_units() -> None:
    there = SI.switched("groups")
    assert there.rod is not None
    assert there.ratio == pytest.approx(po.Rod(SI.k, SI.T0, SI.y0).ratio)
    assert full_answer(there).equilibrium.pressure_ratio == pytest.approx(  # type: ignore[union-attr]
        full_answer(SI).equilibrium.pressure_ratio,
        rel=1e-9,  # type: ignore[union-attr]
    )
    assert State().switched("SI").given == "length"


# --- curves -----------------------------------------------------------------------------------


def test_quick_walks_know_how_far_they_are_from_the_trace() -> None:
    rod = po.Rod.from_ratio(1.0)
    quick = quick_rod(COHESIVE, rod, math.inf)
    exact = po.trace(rod, points=40, tol=1e-8)
    assert quick.ended == "contact"
    specials = quick.branch.special_points
    assert [s.kind for s in specials] == ["BP", "LP-length", "LP-pressure", "LP-length", "contact"]
    for special in specials:
        theirs = exact.special(special.kind)
        nearest = min(abs(p.pressure_ratio - special.pressure_ratio) for p in theirs)
        assert nearest < 2e-3


def distance(walk: PrimaryBranch) -> float:
    """Largest distance found between the cubics through a walk and the branch itself."""
    s = np.array([p.arclength for p in walk.points])
    cubics = CubicHermiteSpline(s, [p.x[-4:] for p in walk.points], [p.tangent[-4:] for p in walk.points])
    found = []
    for i, point in enumerate(walk.points[:-1]):
        for share in (0.3, 0.5, 0.7):
            a = s[i] + share * (s[i + 1] - s[i])
            place, rates = chart(cubics(a))
            across = rates @ cubics(a, 1)
            start = point if share < 0.5 else walk.points[i + 1]
            landed = walk.family.solve(start.profile, Plane.across(place, across / np.linalg.norm(across)))
            if landed is not None:
                found.append(float(np.linalg.norm(chart(landed[1].x[-4:])[0] - place)))
    assert len(found) > 2 * len(walk.points)
    return max(found)


@pytest.mark.parametrize("law", [LINEAR, COHESIVE])
@pytest.mark.parametrize(
    "given", [{"ratio": 1.0}, {"ratio": 10.0}, {"ratio": 100.0}, {"beta0": 1.0}, {"beta0": 4.0}]
)
def test_the_error_of_a_quick_walk_bounds_its_distance_from_the_branch(law: Any, given: Any) -> None:
    if "ratio" in given:
        curve = quick_rod(law, po.Rod.from_ratio(given["ratio"]), math.inf)
        walks = [quick_branch(law, Closure("ratio", given["ratio"]))]
    else:
        curve = quick_groups(law, given["beta0"], window(given["beta0"]), math.inf)
        walks = [quick_branch(law, Closure("length", math.cbrt(given["beta0"])), side) for side in (-1, 1)]
    far = max(distance(walk) for walk in walks)
    assert far <= curve.error
    # Nor is it so large that it says nothing.
    assert curve.error < 50.0 * far


@pytest.mark.parametrize(
    "state",
    [
        State(beta0=20.0, lam=40.0),
        State(beta0=60.0, lam=20.0),
        State(given="pressure", law="cohesive", ratio=0.7, pressure=0.3, label="folded"),
    ],
)
def test_a_walk_cut_by_its_deadline_does_not_say_that_a_state_does_not_exist(state: State) -> None:
    exists = full_answer(state).equilibrium
    assert exists is not None
    cut = live_screen(state, budget=0.0)
    assert "so far" in cut.message
    assert "nearest" not in cut.message
    assert cut.nearest is None
    # Nor does it keep the picture before from being followed.
    before = full_answer(state.at(0.99 * state.value)).equilibrium
    followed = live_screen(state, before=before, budget=0.0).equilibrium
    assert followed is not None
    assert followed.alpha1 == pytest.approx(exists.alpha1, abs=1e-3)


@pytest.mark.parametrize(
    "state",
    [
        State(beta0=31.0, lam=81.0, law="cohesive"),
        State(given="pressure", law="cohesive", ratio=0.71, pressure=0.31),
        State(given="length", law="cohesive", ratio=70.0, length=2.4),
    ],
)
def test_an_unfolded_state_under_law_8_is_shown_before_its_branch_is_walked(state: State) -> None:
    quick, exact = live_screen(state, budget=0.0), full_answer(state).equilibrium
    assert not quick.curve.ended
    assert quick.equilibrium is not None
    assert exact is not None
    assert abs(quick.equilibrium.answer - exact.answer) <= quick.equilibrium.error + exact.error


def test_a_quick_walk_stops_in_time_and_goes_on_later() -> None:
    rod = po.Rod.from_ratio(0.8125)
    first = quick_rod(COHESIVE, rod, 0.0)
    assert first.ended == ""
    second = quick_rod(COHESIVE, rod, math.inf)
    assert second.ended == "contact"
    assert len(second.branch) > len(first.branch)


@pytest.mark.parametrize("beta0", [0.0, 4.0, 60.0])
def test_quick_diagrams_cover_their_window(beta0: float) -> None:
    span = window(beta0)
    curve = quick_groups(LINEAR, beta0, span, math.inf)
    assert curve.ended == "window"
    assert curve.branch.lam.max() >= span[1]
    assert (curve.special("LP-lambda") is None) == (beta0 in (0.0, 60.0))


# --- screens -----------------------------------------------------------------------------------


def test_the_four_panels_show_one_state() -> None:
    screen = full_screen(State())
    eq = po.equilibrium(beta0=4.0, lam=State().lam)
    assert screen.diagram.here == pytest.approx((eq.lam, eq.alpha1), rel=1e-7)
    assert screen.potential is not None
    assert screen.potential.here is not None
    assert screen.potential.here[0] == pytest.approx(eq.alpha1, rel=1e-7)
    assert screen.loop is not None
    assert screen.loop.here == screen.diagram.here
    assert screen.rod is not None
    (line,) = [line for line in screen.rod.lines if line.look == "rod"]
    assert line.y[0] == pytest.approx(eq.tip_height, rel=1e-9)
    assert {m.letter for m in screen.diagram.marks} >= {"T", "F"}
    assert {mark.look for mark in screen.potential.marks} == {"fold", "maxwell", "delay"}
    assert {line.look for line in screen.diagram.lines} >= {"stable", "unstable", "spurious", "straight"}
    assert not screen.message
    assert screen.full


@pytest.mark.parametrize("convention", ["delay", "maxwell"])
def test_the_loop_is_that_of_the_library(convention: Any) -> None:
    screen = full_screen(State(convention=convention))
    loop = po.hysteresis(beta0=4.0, convention=convention)
    assert screen.loop is not None
    jumps = {mark.look: mark.x for mark in screen.loop.marks}
    assert sorted(jumps.values()) == pytest.approx(sorted(j.lam for j in loop.jumps), abs=1e-6)
    area = float(screen.headings["loop"].split()[-1])
    assert area == pytest.approx(loop.area, rel=2e-4, abs=1e-9)


def test_a_frame_of_the_sweep_is_a_state_of_the_loop() -> None:
    loop = live_screen(State()).sweep
    assert loop is not None
    detached = [f for f in loop.frames if f.label == "lower"]
    assert len(detached) > 20
    frame = detached[len(detached) // 2]
    eq = po.equilibrium(beta0=4.0, lam=frame.value)
    assert frame.y == pytest.approx(eq.alpha1, abs=5e-3)
    assert [f.label for f in loop.frames[:3]] == ["adhered"] * 3


def test_a_rod_under_pressure_has_its_own_loop() -> None:
    screen = live_screen(PRESSED, budget=10.0)
    assert screen.loop is not None
    p_min = next(m.x for m in screen.loop.marks if m.look == "readheres-down")
    assert p_min == pytest.approx(0.121837041, abs=1e-4)
    assert screen.sweep is not None
    assert isinstance(screen.sweep.loop, PressureLoop)
    assert all(f.label in ("adhered", "folded") for f in screen.sweep.frames)
    other = live_screen(PRESSED.changed(convention="maxwell"), budget=10.0).sweep
    assert other is not None
    assert "delay convention only" in other.note


@pytest.mark.parametrize("picture", [live_screen, full_screen])
@pytest.mark.parametrize(
    "state",
    [
        State(lam=-1.0, accuracy="draft"),
        State(given="length", law="cohesive", length=2.0, accuracy="sketch"),
        State(given="pressure", law="cohesive", pressure=0.01, accuracy="sketch"),
    ],
)
def test_what_does_not_exist_is_said_with_the_nearest_that_does(picture: Any, state: State) -> None:
    screen = picture(state, budget=10.0) if picture is live_screen else picture(state)
    assert screen.rod is None
    assert "nearest that does exist" in screen.message
    assert screen.nearest is not None
    again = full_answer(screen.nearest)
    assert again.equilibrium is not None
    assert not again.message


@pytest.mark.parametrize(
    ("state", "said"),
    [
        (State(lam=1.0), "y > y₀"),
        (State(lam=1.0), "p < 0"),
        (State(lam=2.0, label="spurious"), "α₁ > 0: spurious"),
        (State(beta0=53.16, lam=15.69), "above 37.55"),
        (PRESSED.changed(label="folded"), "folded back"),
    ],
)
def test_pictures_say_where_they_leave_their_range(state: State, said: str) -> None:
    screen = live_screen(state, budget=10.0)
    assert any(said in words for words in (*screen.warnings, screen.no_potential))


def test_quick_and_full_answers_agree_within_their_errors() -> None:
    for state in (State(), State(accuracy="sketch"), ROD, PRESSED, SI, State(beta0=53.16, lam=15.69)):
        quick, full = live_screen(state, budget=10.0).equilibrium, full_answer(state).equilibrium
        assert quick is not None
        assert full is not None
        assert abs(quick.answer - full.answer) <= quick.error + full.error
        assert quick.state == full.state


def test_lower_accuracies_have_larger_errors_and_say_so() -> None:
    errors = {name: full_answer(ROD.changed(accuracy=name)).equilibrium.error for name in CHOICES["accuracy"]}  # type: ignore[union-attr]
    assert errors["sketch"] > 10.0 * errors["draft"] > 100.0 * errors["standard"]
    exact = po.pressure_given_length(po.Rod.from_ratio(1.0), 3.2, method="spectral", tol=1e-11).answer
    for name, bound in errors.items():
        found = full_answer(ROD.changed(accuracy=name)).equilibrium
        assert abs(found.answer - exact) <= bound + 1e-13  # type: ignore[union-attr]


def test_a_click_finds_the_place_on_the_branch() -> None:
    screen = live_screen(ROD, budget=10.0)
    state = moves.picked(screen, 5.0, 0.7)
    assert state is not None
    assert state.label == "folded"
    eq = full_answer(state).equilibrium
    assert eq is not None
    assert eq.pressure_ratio == pytest.approx(state.near, abs=0.02)
    assert moves.picked(screen, math.nan, 0.0) is None


def test_csv_holds_what_is_drawn_with_units() -> None:
    state = SI.changed(length=1.78e-3)  # beta0 = 34, where there is a fold
    screen = live_screen(state, budget=10.0)
    text = screen_csv(screen)
    rows = list(csv.reader(line for line in text.splitlines() if not line.startswith("#")))
    assert tuple(rows[0]) == COLUMNS
    table = [dict(zip(COLUMNS, row, strict=True)) for row in rows[1:]]
    assert {row["panel"] for row in table} == {"rod", "diagram", "potential", "loop"}
    (here,) = [row for row in table if (row["panel"], row["series"]) == ("diagram", "state")]
    assert float(here["x"]) == pytest.approx(1.78, rel=1e-9)
    assert here["x_quantity"] == "detached length s̄ [mm]"
    assert here["y_quantity"] == "pressure p [kPa]"
    rod = [row for row in table if (row["panel"], row["series"]) == ("rod", "rod")]
    assert rod[0]["y_quantity"] == "y [mm]"
    (link,) = [line for line in text.splitlines() if line.startswith("# link: ")]
    assert State.from_query(link.removeprefix("# link: ")) == (state, ())


# --- potentials, branches and questions -------------------------------------------------------


@pytest.mark.parametrize("accuracy", ["sketch", "standard"])
def test_the_potential_under_law_8_has_the_true_maxwell_point(accuracy: Any) -> None:
    state = State(law="cohesive", accuracy=accuracy)
    screen = full_screen(state)
    found = landscape(state.beta0, screen.curve)
    assert found.source.startswith("quadrature")
    maxwell, fold = found.named["maxwell"], found.named["fold"]
    assert abs(maxwell.lam - -0.2390538361) <= maxwell.error + 1e-10
    assert abs(fold.alpha1 - -1.3942820254) <= fold.alpha1_error + 1e-10
    assert screen.potential is not None
    # As many digits as the error leaves: a kink lies somewhere in a long step of a quick walk.
    (label,) = [line.label for line in screen.potential.lines if line.look == "maxwell"]
    shown = label.removeprefix("Maxwell ")
    assert shown == ("-0.2391" if accuracy == "standard" else f"{maxwell.lam:.{len(shown) - 3}g}")
    assert maxwell.error < 10.0 ** -(len(shown) - 3)


def test_a_potential_that_misses_the_state_is_not_shown_and_the_state_is_on_a_branch_that_is() -> None:
    screen = full_screen(State(beta0=42.0, lam=-20.0))
    assert screen.potential is None
    assert "misses the state by 0.95" in screen.no_potential
    assert "42 is above 37.55" in screen.no_potential
    assert screen.diagram.here is not None
    assert screen.diagram.distance(screen.diagram.here) < 0.025 < screen.off_branch
    assert "own branch" in [line.label for line in screen.diagram.lines]
    assert any("not on the branch that leaves T. Its own is dotted" in said for said in screen.warnings)
    quick = live_screen(State(beta0=42.0, lam=-20.0), budget=10.0)
    assert any("drawn when the slider rests" in warning for warning in quick.warnings)
    shown = full_screen(State())
    assert shown.potential is not None
    assert shown.off_branch < 1e-3
    assert not shown.warnings


@pytest.mark.parametrize(
    ("state", "given"),
    [
        (SI.changed(given="pressure", pressure=4e4), "length"),
        (SI.changed(length=1.95e-3), "pressure"),
        (PRESSED.changed(label="folded"), "length"),
        (PRESSED, "groups"),
        (State(), "length"),
        (State(beta0=10.0, lam=30.0), "pressure"),  # beyond y0 under the linear law
    ],
)
def test_another_question_is_asked_about_the_same_state(state: State, given: str) -> None:
    before = full_answer(state).equilibrium
    assert before is not None
    other = moves.chosen(state, "given", given, before)
    assert other.given == given
    after = full_answer(other).equilibrium
    assert after is not None
    assert [after.beta0, after.lam, after.alpha1] == pytest.approx(
        [before.beta0, before.lam, before.alpha1], rel=1e-6
    )


def test_a_bare_number_is_in_the_unit_of_its_label() -> None:
    rod = SI.changed(given="pressure")
    assert moves.units(po.Rod(SI.k, SI.T0, SI.y0))["pressure"].axis("p") == "$p$ [kPa]"
    assert moves.typed(rod, "pressure", "30").pressure == pytest.approx(30e3)
    assert moves.typed(rod, "pressure", "30 Pa").pressure == 30.0
    assert moves.typed(SI, "length", "1.9").length == pytest.approx(1.9e-3)
    assert moves.typed(SI, "y0", "1e-3").y0 == 1e-3
    assert moves.typed(State(), "lam", "0.5").lam == 0.5


def test_two_numbers_that_differ_are_told_apart() -> None:
    assert told_apart(37.55, TURN) == ("37.55", "37.546")
    mine, last = told_apart(TURN + 1e-7, TURN)
    assert float(mine) > float(last)
    with pytest.raises(po.OutOfRange, match=r"100000\.1 .* above 100000"):
        State(beta0=100000.1)
    with pytest.raises(po.NoEquilibrium, match=r"above beta0 = 37\.5458 .* beta0 = 37\.55,"):
        po.maxwell_curve((1.0, 37.55))
