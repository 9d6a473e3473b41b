"""One question, four methods, one answer; and what "auto" does."""

from __future__ import annotations

import dataclasses
import math
from itertools import combinations

import numpy as np
import pytest

import peel_opt as po

from ..asking import ask
from ..registry import REFERENCES, Reference

EQUILIBRIA = [ref for ref in REFERENCES if "fold" not in ref.tags]
MESHES = ("shooting", "spectral", "collocation")


def reached_by_series(reference: Reference) -> bool:
    """Whether the series may be expected to answer: beta0 < 28, and the tip within y0."""
    P = reference.expected.get("pressure_ratio", reference.question.get("pressure_ratio", math.nan))
    ratio = reference.question.get("ratio", math.nan)
    return reference.question.get("state") is None and 0.5 <= P < 1.0 and ratio >= 1.0


@pytest.mark.parametrize("reference", EQUILIBRIA, ids=str)
def test_reference_by_collocation(reference: Reference) -> None:
    eq = ask(reference, method="collocation")
    assert eq.certified
    assert eq.stats.method.startswith("Collocation")
    assert abs(eq.answer - reference.expected[eq.answered]) <= eq.error + reference.tolerance


@pytest.mark.parametrize("reference", EQUILIBRIA, ids=str)
def test_reference_by_series_or_a_refusal(reference: Reference) -> None:
    eq = ask(reference, method="series", throw=False)
    if eq.status == "not-converged":
        assert not reached_by_series(reference)
        assert "series" in eq.message
        return
    assert eq.certified
    assert eq.stats.method.startswith("series")
    assert abs(eq.answer - reference.expected[eq.answered]) <= eq.error + reference.tolerance
    assert eq.tip_angle == pytest.approx(reference.expected["tip_angle"], abs=1e-6 * (1 + eq.stats.condition))


@pytest.mark.parametrize("reference", EQUILIBRIA, ids=str)
def test_auto_is_the_state_and_the_number_of_the_spectral_method(reference: Reference) -> None:
    auto, spectral = ask(reference), ask(reference, method="spectral")
    assert (auto.state, auto.law, auto.flags) == (spectral.state, spectral.law, spectral.flags)
    assert abs(auto.answer - spectral.answer) <= auto.error + spectral.error


@pytest.mark.parametrize("beta0", [0.0, 0.5, 4.0, 15.0])
@pytest.mark.parametrize("state", ["middle", "lower", "spurious"])
def test_methods_agree_in_the_paper_s_groups(beta0: float, state: str) -> None:
    if beta0 == 0.0 and state == "middle":
        pytest.skip("no middle state without strength")
    lam = -0.01 * beta0**2 if state == "middle" else 0.3
    found = [po.equilibrium(beta0=beta0, lam=lam, state=state, method=m) for m in ("series", *MESHES)]
    assert {eq.state for eq in found} == {state}
    assert len({eq.flags for eq in found}) == 1
    for a, b in combinations(found, 2):
        assert abs(a.alpha1 - b.alpha1) <= a.error + b.error
        np.testing.assert_allclose(a.theta, b.theta, atol=1e-7)
        np.testing.assert_allclose(a.x, b.x, atol=1e-7)
        assert {f.name for f in dataclasses.fields(a)} == {f.name for f in dataclasses.fields(b)}


def test_auto_takes_the_series_without_a_walk_and_says_so() -> None:
    eq = po.length_given_pressure(po.Rod.from_ratio(2.0), 0.8)
    assert eq.stats.method == "series(order=12)"
    assert eq.stats.path_points == 0


def test_auto_raises_the_order_before_it_leaves_the_series() -> None:
    rod = po.Rod.from_ratio(1.0)
    used = [po.length_given_pressure(rod, 0.8, tol=tol).stats.method for tol in (1e-4, 1e-8)]
    assert used == ["series(order=12)", "series(order=24)"]


def test_auto_leaves_the_series_where_the_tip_leaves_the_bond() -> None:
    eq = po.length_given_pressure(po.Rod.from_ratio(2.0), 0.3)
    assert eq.stats.method.startswith("Spectral")
    assert eq.law == "cohesive"


def test_auto_falls_back_on_collocation_where_a_layer_is_too_thin_for_one_polynomial() -> None:
    coarse = po.Method(po.Spectral(4), adaptive=False, fallback=po.Method(po.Collocation()))
    eq = po.length_given_pressure(po.Rod.from_ratio(5.0), 0.05, method=coarse)
    assert eq.stats.method.startswith("Collocation")
    assert eq.certified


@pytest.mark.parametrize(
    "question",
    [
        {"pressure": 0.3},  # the tip beyond y0
        {"pressure": 0.6, "law": po.exponential()},
        {"pressure": 0.3, "state": "folded"},
    ],
)
def test_series_alone_refuses_with_the_reason(question: dict) -> None:
    with pytest.raises(po.NotConverged, match="series"):
        po.length_given_pressure(po.Rod.from_ratio(1.0), method="series", **question)


def test_series_alone_refuses_where_it_does_not_converge() -> None:
    with pytest.raises(po.NotConverged, match="converge"):
        po.length_given_pressure(po.Rod.from_ratio(0.2), 0.8, method="series")


def test_series_alone_still_says_what_does_not_exist() -> None:
    with pytest.raises(po.NoEquilibrium, match="nearest"):
        po.length_given_pressure(po.Rod.from_ratio(1.0), 1.3, method="series")


def test_close_to_the_fold_the_series_gives_way() -> None:
    fold = po.length_given_pressure(po.Rod.from_ratio(1.0), 0.651466320)
    eq = po.pressure_given_length(po.Rod.from_ratio(1.0), fold.length * (1.0 + 1e-9), tol=1e-4)
    assert eq.certified
    assert eq.state == "lower"


@pytest.mark.parametrize("method", ["series", "spectral"])
def test_near_the_transition_lambda_keeps_its_digits(method: str) -> None:
    eq = po.length_given_pressure(po.Rod.from_ratio(2500.0), 1.0 - 1e-9, method=method)
    assert eq.lam == pytest.approx(-0.09619170467 * eq.beta0**2 * 1e-9, rel=1e-6)


def test_near_picks_the_same_number_as_the_label() -> None:
    rod = po.Rod.from_ratio(1.0)
    middle = po.pressure_given_length(rod, 3.05, state="middle")
    assert po.pressure_given_length(rod, 3.05, near=0.84).pressure == middle.pressure
