"""Checks of single values: what is taken as a number, and that a refusal names its field."""

from __future__ import annotations

import math
from collections.abc import Callable
from decimal import Decimal
from fractions import Fraction

import numpy as np
import pytest

from peel_opt.base import checks
from peel_opt.base.errors import InvalidInput, OutOfRange


@pytest.mark.parametrize("value", [2, 2.0, Fraction(4, 2), Decimal("2"), np.float32(2), np.array(2.0)])
def test_any_real_number_is_taken_as_a_float(value: object) -> None:
    found = checks.positive("k", value, "N m")
    assert found == 2.0
    assert type(found) is float


@pytest.mark.parametrize(
    ("value", "words"),
    [
        (True, "must be a number"),
        (b"2 kPa", "must be a number"),
        (None, "must be a number"),
        (1j, "must be a number"),
        ([1.0, 2.0], "must be a number"),
        (math.nan, "must be finite"),
        (-math.inf, "must be finite"),
        (10**400, "must be finite"),
        (Decimal("sNaN"), "must be finite"),
        (0.0, "must be positive, got 0"),
        (-1.0, "must be positive, got -1"),
    ],
)
def test_what_is_no_positive_number_is_refused_under_its_name_and_unit(value: object, words: str) -> None:
    with pytest.raises(InvalidInput, match=r"^pressure \[Pa\] " + words):
        checks.positive("pressure", value, "Pa")


def test_zero_and_negative_numbers_are_taken_where_they_mean_something() -> None:
    assert checks.non_negative("flaw", 0) == 0.0
    assert checks.finite("lam", -3) == -3.0
    with pytest.raises(InvalidInput, match="flaw must be zero or positive, got -1e-09"):
        checks.non_negative("flaw", -1e-9)


@pytest.mark.parametrize("beta0", [0.0, 1e-12, 1e12])
def test_beta0_may_be_zero_or_that_of_a_rod(beta0: float) -> None:
    assert checks.known_beta0(beta0) == beta0


@pytest.mark.parametrize("beta0", [1e-13, 1e13])
def test_a_beta0_of_no_rod_is_out_of_range(beta0: float) -> None:
    with pytest.raises(OutOfRange, match="neither 0 nor within"):
        checks.known_beta0(beta0)


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: checks.whole("points", 2.0, 2), "points must be a whole number of at least 2, got 2.0"),
        (lambda: checks.whole("points", True, 0), "points must be a whole number"),
        (lambda: checks.whole("points", 1, 2), "at least 2, got 1"),
        (lambda: checks.whole("points", 7, 2, 6), "at most 6, got 7"),
        (lambda: checks.whole("points", 10**5000, 2), "a number of more than 20 digits"),
        (lambda: checks.pair("window", 1.0), "window must be two numbers, from and to, got 1.0"),
        (lambda: checks.pair("window", (1.0, 2.0, 3.0)), "window must be two numbers"),
        (lambda: checks.pair("window", (0.0, math.nan)), "window must be finite"),
        (lambda: checks.flag("tip", 1), "tip must be True or False, got 1"),
        (lambda: checks.listed("names", "ab"), "names must be a list, got 'ab'"),
        (lambda: checks.listed("names", 3), "names must be a list, got 3"),
    ],
)
def test_other_kinds_are_refused_under_their_name(call: Callable[[], object], words: str) -> None:
    with pytest.raises(InvalidInput, match=words):
        call()


def test_counts_pairs_flags_and_lists() -> None:
    assert checks.whole("points", np.int64(6), 2, 6) == 6
    assert checks.pair("window", (n for n in (-1, 3))) == (-1.0, 3.0)
    assert checks.flag("tip", np.True_) is True
    assert checks.listed("names", ("a", "b")) == ["a", "b"]
