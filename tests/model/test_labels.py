"""Labels of states, special points and flags, and their words."""

from __future__ import annotations

from argparse import ArgumentParser

import pytest

from peel_opt import InvalidInput
from peel_opt.app.cli.common import answer_options
from peel_opt.app.explorer.state import CHOICES
from peel_opt.model.labels import FLAGS, OBSERVABLE, SPECIAL_KINDS, STATES, fits, known_state, special_kind
from peel_opt.plots.words import plain, typeset, warnings_of


def test_unfolded_is_either_of_two_and_nothing_is_meant_by_none() -> None:
    labels = ("middle", "lower", "folded", "spurious", "other")
    assert [label for label in labels if fits(label, "unfolded")] == ["middle", "lower"]
    assert [label for label in labels if fits(label, "folded")] == ["folded"]
    assert not any(fits(label, None) for label in labels)


def test_who_names_no_state_is_told_which_there_are() -> None:
    with pytest.raises(InvalidInput, match=r"row 3: unknown state 'upper'\. Choose one of unfolded, middle"):
        known_state("upper", place="row 3: ")
    with pytest.raises(InvalidInput, match="folded"):
        known_state("spurious", among=OBSERVABLE)  # nobody observes a rod inside the plate
    assert known_state("spurious") == "spurious"
    assert known_state(None) is None


def test_the_explorer_and_the_command_line_offer_the_states_there_are() -> None:
    assert set(CHOICES["label"]) == {*STATES, "adhered", "lifted", "other"}
    parser = ArgumentParser()
    answer_options(parser, "state")
    assert ", ".join(OBSERVABLE[:-1]) + f" or {OBSERVABLE[-1]}" in parser.format_help()


def test_a_kind_that_is_not_listed_speaks_for_itself() -> None:
    assert special_kind("tip upright") == ("S", "tip upright")
    assert special_kind("LP-ratio") == ("R", "fold in eta/y0")


@pytest.mark.parametrize(
    ("words", "shown", "typed"),
    [
        ("fold in eta/y0", r"fold in $\eta/y_0$", "fold in η/y₀"),
        ("fold in lambda", r"fold in $\lambda$", "fold in λ"),
        (SPECIAL_KINDS["y=y0"].words, "rod reaches or leaves $y = y_0$", "rod reaches or leaves y = y₀"),
        (FLAGS["alpha1 > 0"], r"$\alpha_1 > 0$: spurious branch", "α₁ > 0: spurious branch"),
        ("fold in length", "fold in length", "fold in length"),
    ],
)
def test_words_are_set_as_mathematics_and_as_characters(words: str, shown: str, typed: str) -> None:
    assert typeset(words) == shown
    assert plain(typeset(words)) == typed


def test_a_picture_says_what_disqualifies_a_state_and_no_more() -> None:
    said = warnings_of(["y > y0", "overhang", "tip on plate"])
    assert said == ["$y > y_0$: outside the range of the law", "the tip is held down to the plate"]
