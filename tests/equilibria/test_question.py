"""What a given number asks for, and questions that are added."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

import peel_opt as po
from peel_opt.equilibria.ask import ask_about
from peel_opt.equilibria.question import ASKS, LENGTH, PRESSURE, Asks, Measure, Question, answering
from peel_opt.model.dimension import FORCE
from peel_opt.residual.closures import EQUATIONS, READINGS

from ..rods import FLAP


@pytest.fixture
def force() -> Iterator[Measure]:
    """The total force p sbar, given of a rod for its length."""
    measure = Measure(
        "force",
        "force_ratio",
        "force",
        symbol="p sbar/(T0 eta)",
        dimension=FORCE,
        to_ratio=lambda rod, value: value / FORCE.size(rod),
    )
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(EQUATIONS, "force", lambda s, F: s.sigma * s.alpha1 - (F - s.sigma) * s.beta0)
        patch.setitem(READINGS, "force", lambda s: s.pressure_ratio * s.sigma)
        patch.setitem(ASKS, "force", Asks(measure, LENGTH))
        yield measure


def test_each_given_number_asks_for_the_other() -> None:
    assert (ASKS["length"].asked, ASKS["pressure"].asked) == (PRESSURE, LENGTH)
    assert answering("pressure_ratio") is ASKS["length"]
    assert ASKS["beta1"] == ASKS["lam"] == answering("alpha1")


def test_a_question_names_what_is_given_in_the_units_of_the_rod() -> None:
    question = Question.of_rod(FLAP, "length", 1.9e-3)
    assert question.words == "length 0.0019 m (sbar/eta = 3.46913)"
    assert question.named(question.in_units(question.given[1].value)) == "0.0019 m"
    assert Question.of_rod(po.Rod.from_ratio(1.0), "pressure", 0.8).words == "p/T0 = 0.8"
    assert Question.of_groups(4.0, 1.0).words == "beta0 = 4, lambda = 1"


def test_what_is_no_question_about_a_rod_is_said() -> None:
    with pytest.raises(
        po.InvalidInput, match=r"'lam' given of a rod is no question\. Give pressure or length"
    ):
        ask_about(FLAP, "lam", 1.0)


def test_near_an_equilibrium_is_near_what_it_has_of_the_number_asked_for() -> None:
    eq = po.length_given_pressure(FLAP, 60e3)
    assert Question.of_rod(FLAP, "pressure", 61e3, near=eq).near == eq.length_ratio
    assert Question.of_rod(FLAP, "length", 2e-3, near=eq).near == eq.pressure_ratio
    assert Question.of_rod(FLAP, "length", 2e-3, near=60e3).near == pytest.approx(60e3 / 140e3, rel=1e-15)


def test_a_question_that_is_added_is_answered_like_the_others(force: Measure) -> None:
    eq = ask_about(FLAP, "force", 100.0)
    assert eq.certified
    assert eq.state == "lower"
    assert eq.pressure * eq.length == pytest.approx(100.0, rel=1e-12)
    # The same state the other way round.
    assert po.length_given_pressure(FLAP, eq.pressure).length == pytest.approx(eq.length, rel=1e-9)
    with pytest.raises(po.NoEquilibrium, match=r"force = .* N/m") as caught:
        ask_about(FLAP, "force", 500.0)
    # T holds the largest force of the unfolded states.
    assert caught.value.nearest == pytest.approx(FLAP.adhesion_strength * FLAP.critical_length, rel=1e-9)


def test_its_sensitivities_are_those_of_differences(force: Measure) -> None:
    def length(F: float = 100.0, T0: float = 140e3) -> float:
        return ask_about(po.Rod(FLAP.bending_stiffness, T0, FLAP.adhesion_range), "force", F).length

    found = po.sensitivities(ask_about(FLAP, "force", 100.0))
    h = 1e-4
    by_force = (length(100.0 * (1 + h)) - length(100.0 * (1 - h))) / (200.0 * h)
    by_strength = (length(T0=140e3 * (1 + h)) - length(T0=140e3 * (1 - h))) / (280e3 * h)
    assert found["force"] == pytest.approx(by_force, rel=1e-6)
    assert found["adhesion_strength"] == pytest.approx(by_strength, rel=1e-4)
    assert found.units["force"] == "N/m"


def test_its_answer_is_read_back_from_a_file_without_the_question(force: Measure, tmp_path: Path) -> None:
    eq = ask_about(FLAP, "force", 100.0)
    eq.to_csv(tmp_path / "held.csv")
    again = po.Equilibrium.load(tmp_path / "held.csv")
    assert again.given["force"] == 100.0
    assert again.length == eq.length
