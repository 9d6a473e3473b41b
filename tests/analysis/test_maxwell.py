"""Maxwell points of traced branches, and the lengths of Fig 9."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import peel_opt as po
from peel_opt.analysis import design_relations as design
from peel_opt.analysis.maxwell import TURN, maxwell_point

UNIFORM = po.NormalForm.uniform(40)


def test_curve_agrees_with_the_series_where_that_converges() -> None:
    curve = po.maxwell_curve((0.5, 28.0), points=8)
    lam, alpha1 = UNIFORM.maxwell(curve.beta0)
    np.testing.assert_allclose(curve.lam, lam, atol=1e-8)
    np.testing.assert_allclose(curve.alpha1, alpha1, atol=1e-7)
    assert (curve.beta0[0], curve.beta0[-1]) == (0.5, 28.0)
    assert "MaxwellCurve of 8 points" in repr(curve)
    assert po.maxwell_curve((0.5, 28.0), points=8) is curve


def test_default_curve_ends_where_the_fold_does() -> None:
    curve = po.maxwell_curve()
    assert (np.diff(curve.ratio) < 0.0).all()
    assert curve.ratio[-1] == pytest.approx(0.49959, abs=1e-5)
    assert curve.ratio[0] > 5000.0
    assert (curve.lam < 0.0).all()
    assert curve.pressure_ratio[0] == pytest.approx(1.0 - 2.0 / 3.0 * 0.697145349376, abs=1e-6)
    np.testing.assert_allclose(curve.length_ratio**3, curve.beta0)
    with pytest.raises(ValueError, match="read-only"):
        curve.lam[0] = 0.0


def test_the_last_maxwell_point() -> None:
    lam, _, _ = maxwell_point(37.5457, 128)
    assert (math.pi**4 + lam) / 37.5457 ** (4 / 3) == pytest.approx(design.LEAST_RATIO, abs=1e-4)


@pytest.mark.parametrize("beta0", [0.02, 1.0, 10.0, 30.0, 37.0, 37.5, 37.54])
def test_the_error_of_a_point_is_honest(beta0: float) -> None:
    lam, _, error = maxwell_point(beta0)
    finer, _, _ = maxwell_point(beta0, 256)
    assert abs(lam - finer) <= error + 1e-13 * (1.0 + abs(lam))
    assert error < 1e-4


@given(beta0=st.floats(0.06, 37.53))
@settings(max_examples=8, deadline=None)
def test_length_from_branches_is_that_of_the_branch(beta0: float) -> None:
    lam, _, _ = maxwell_point(beta0, 128)
    ratio = (math.pi**4 + lam) / beta0 ** (4 / 3)
    assert po.maxwell_length(ratio, "branch") == pytest.approx(ratio * beta0 ** (1 / 3), rel=1e-8)


@pytest.mark.parametrize("ratio", [0.502, 0.6, 1.0, 30.0, 1000.0])
def test_exponent_is_the_slope_of_the_length(ratio: float) -> None:
    lengths = po.maxwell_length([ratio / 1.0002, ratio * 1.0002], "branch")
    slope = math.log(lengths[1] / lengths[0]) / (2.0 * math.log(1.0002))
    assert design.maxwell_exponent(ratio, "branch") == pytest.approx(slope, abs=1e-5)


@pytest.mark.parametrize(
    ("ratio", "length", "exponent"),
    [
        (0.5, 1.674117, 0.95502),
        (1.0, 3.027131, 0.80628),
        (2.0, 5.215062, 0.76962),
        (10.0, 17.645939, 0.75175),
    ],
)
def test_lengths_of_fig_9(ratio: float, length: float, exponent: float) -> None:
    assert po.maxwell_length(ratio, "branch") == pytest.approx(length, abs=2e-6)
    assert design.maxwell_exponent(ratio, "branch") == pytest.approx(exponent, abs=2e-5)


def test_sources_agree_for_stiff_rods_and_spread_near_the_end() -> None:
    for source in ("paper", "exact", "fit", "branch"):
        assert po.maxwell_length(100.0, source) == pytest.approx(99.3422, abs=1e-3)
    assert po.maxwell_length(0.51, "exact") / po.maxwell_length(0.51, "branch") == pytest.approx(
        1.0317, abs=1e-3
    )


def test_below_the_last_ratio_there_is_none_and_the_note_says_why() -> None:
    lengths = po.maxwell_length([0.05, 0.4, 0.6, 1000.0], "branch")
    assert np.isnan(lengths).tolist() == [True, True, False, False]
    assert math.isnan(design.maxwell_exponent(0.4, "branch"))
    assert design.maxwell_note(0.4, "branch").endswith("below 0.4989")
    assert "still has a root" in design.maxwell_note(0.4, "paper")
    assert design.maxwell_note(0.6, "branch") == design.maxwell_note(0.6) == ""
    short = po.maxwell_curve((0.5, 28.0), points=8)
    assert "does not reach" in design.maxwell_note(0.6, "branch", curve=short)


def test_another_fit_may_be_given() -> None:
    form = po.NormalForm.fit(po.trace(beta0=10.0, lam=(-3.0, 1.0)), window=2.0)
    assert po.maxwell_length(1.0, "fit", form=form) != po.maxwell_length(1.0, "fit")


@pytest.mark.parametrize("beta0", [(4.0, 2.0), (0.0, 2.0), (1.0, math.nan), 4.0, (3.0, 3.0)])
def test_bad_range(beta0: object) -> None:
    with pytest.raises(po.InvalidInput, match="beta0"):
        po.maxwell_curve(beta0)  # type: ignore[arg-type]


def test_bad_points() -> None:
    with pytest.raises(po.InvalidInput, match="points"):
        po.maxwell_curve((1.0, 2.0), points=3)


@pytest.mark.parametrize("high", [TURN, 38.0, 100.0])
def test_no_maxwell_point_beyond_the_turn(high: float) -> None:
    with pytest.raises(po.NoEquilibrium, match="no fold in lambda") as caught:
        po.maxwell_curve((1.0, high))
    assert caught.value.nearest == TURN
