"""The oracle agrees with the registry, and with what can be known without integrating."""

from __future__ import annotations

import math
from collections.abc import Callable

import mpmath
import numpy as np
import pytest

from .. import oracle
from ..oracle import (
    COHESIVE,
    GIVEN_LENGTH,
    GIVEN_PRESSURE,
    GIVEN_TIP,
    LENGTH,
    LINEAR,
    LOAD,
    RATE,
    THETA_TIP,
    Y_TIP,
)
from ..registry import DISCONNECTED, REFERENCES, Reference, tagged

EXPONENTIAL = oracle.Law((lambda u: np.exp(-u),))
LAWS = {"linear": LINEAR, "cohesive": COHESIVE, "exponential": EXPONENTIAL}
PRESSURE_GIVEN = tuple(r for r in REFERENCES if "pressure_ratio" in r.question)
LENGTH_GIVEN = tagged("length-given")
GROUPS = (*(r for r in REFERENCES if "beta0" in r.question and "kind" not in r.question), *DISCONNECTED)
ROD_FOLDS = tuple(r for r in REFERENCES if r.question.get("kind") in ("LP-pressure", "LP-length"))
LAM_FOLDS = tagged("LP-lambda")

DOUBLE = 3e-12  # what double precision gives up to sensitivity along the rod, relative


def every(*references: Reference) -> pytest.MarkDecorator:
    return pytest.mark.parametrize("ref", references, ids=str)


def five_numbers(ref: Reference) -> tuple[float, ...]:
    known = ref.question | ref.expected
    r = known["ratio"]
    return known["tip_angle"], known["tip_height"] / r, known["pressure_ratio"], known["length_ratio"], r


def disturbed(numbers: tuple[float, ...], free: tuple[int, ...]) -> np.ndarray:
    """Off by a tenth of a per cent in the numbers to be found."""
    guess = np.array(numbers)
    guess[list(free)] *= 1.0 + 1e-3 * np.array([1.0, -1.0, 1.0])
    return guess


def check_rod(ref: Reference, found: oracle.TipSolution) -> None:
    answers = {
        "pressure_ratio": found.P,
        "length_ratio": found.sigma,
        "tip_angle": found.theta_tip,
        "tip_height": found.u_tip,
    }
    for name, value in ref.expected.items():
        assert answers[name] == pytest.approx(value, rel=DOUBLE, abs=2 * ref.tolerance), name


def first_integrals(found: oracle.TipSolution) -> tuple[np.ndarray, np.ndarray]:
    """Drift along the rod of Nx + P y and of theta'^2/2 - Nx cos - Ny sin - Phi."""
    s, theta, curvature, nx, ny, y = found.nodes.T
    assert np.all(np.diff(s) > 0.0)
    work = np.array([found.law.work(u) if u > 0.0 else u for u in found.r * y]) / found.r
    H = 0.5 * curvature**2 - nx * np.cos(theta) - ny * np.sin(theta) - work
    momentum = nx + found.P * y
    return np.ptp(momentum), np.ptp(H)


class TestRegistry:
    def test_names_are_unique(self) -> None:
        assert len({ref.name for ref in REFERENCES}) == len(REFERENCES)

    @every(*(r for r in REFERENCES if "ratio" in r.question))
    def test_values_satisfy_the_exact_identity(self, ref: Reference) -> None:
        _, y_tip, P, _, r = five_numbers(ref)
        law = LAWS[str(ref.question["law"])]
        assert P * r * y_tip == pytest.approx(law.work(r * y_tip), rel=1e-12)

    @every(*GROUPS, *LAM_FOLDS)
    def test_groups_are_consistent(self, ref: Reference) -> None:
        known = ref.question | ref.expected
        if "alpha" in known:
            assert known["alpha"] - known["beta0"] == pytest.approx(known["alpha1"], abs=ref.tolerance)
        assert math.copysign(1.0, known["tip_angle"]) == math.copysign(1.0, known["alpha1"])


# ------------------------------------------------------------------- from a disturbed answer: seconds

_QUICK = (
    "r=0.4, P=0.4826, unfolded",
    "r=1, P=0.4999, unfolded",
    "r=1, P=0.5001, unfolded",
    "r=1, P=0.999, unfolded",
    "r=2, P=0.04465, unfolded",
    "r=100, P=0.6, unfolded",
    "r=0.05, P=0.96, folded",
    "r=1, P=0.5, folded",
    "r=1, P=0.8, exponential",
)


@every(*(r for r in PRESSURE_GIVEN if r.name in _QUICK))
def test_length_and_identities_at_given_pressure(ref: Reference) -> None:
    numbers = five_numbers(ref)
    law = LAWS[str(ref.question["law"])]
    found = oracle.solve(law, disturbed(numbers, GIVEN_PRESSURE), GIVEN_PRESSURE)
    check_rod(ref, found)
    assert found.residual < 1e-12
    assert abs(found.identity) < 1e-13
    assert max(first_integrals(found)) < 1e-13


@every(*LENGTH_GIVEN)
def test_pressure_at_given_length(ref: Reference) -> None:
    law = LAWS[str(ref.question["law"])]
    found = oracle.solve(law, disturbed(five_numbers(ref), GIVEN_LENGTH), GIVEN_LENGTH)
    check_rod(ref, found)
    assert abs(found.identity) < 1e-13


@every(*GROUPS)
def test_pressure_in_the_groups_of_the_paper(ref: Reference) -> None:
    known = ref.question | ref.expected
    lam = known.get("lam", known.get("beta1", 0.0) - math.pi**4)
    off = 1e-5 if "several-solutions" in ref.tags else 1e-3
    guess = ((1 + off) * known["alpha1"], (1 - off) * known["tip_angle"])
    found = oracle.given_groups(known["beta0"], lam, guess)
    assert found.alpha1 == pytest.approx(known["alpha1"], rel=1e-12, abs=1e-11)
    assert found.theta_tip == pytest.approx(known["tip_angle"], rel=1e-12, abs=1e-11)
    assert abs(found.identity) < 1e-11 * abs(found.alpha1)


@every(*(r for r in ROD_FOLDS if r.question["ratio"] in (0.4, 1.0)))
def test_branch_turns_at_a_fold(ref: Reference) -> None:
    which = LOAD if ref.question["kind"] == "LP-pressure" else LENGTH
    found = oracle.solve(COHESIVE, disturbed(five_numbers(ref), GIVEN_TIP), GIVEN_TIP)
    check_rod(ref, found)
    assert abs(found.tangent[which]) < 1e-11


@every(*LAM_FOLDS)
def test_branch_turns_at_a_fold_in_lambda(ref: Reference) -> None:
    known = ref.question | ref.expected
    found = oracle.given_groups(
        known["beta0"], known["lam"], (known["alpha1"], known["tip_angle"]), free_lam=True
    )
    assert found.lam == pytest.approx(known["lam"], abs=1e-11)
    assert found.alpha1 == pytest.approx(known["alpha1"], abs=1e-11)
    assert abs(found.tangent_lam) < 1e-9


# --------------------------------------------------------------------------------- the oracle's own parts


@pytest.mark.parametrize("law", [COHESIVE, EXPONENTIAL], ids=["kink", "curved"])
def test_sensitivities_are_derivatives_of_the_end_state(law: oracle.Law) -> None:
    numbers = np.array([-0.9, 2.3, 0.3, 3.4, 0.8])
    _, jacobian, _ = oracle.shoot(law, numbers)
    for i in (THETA_TIP, Y_TIP, LOAD, LENGTH, RATE):
        step = 1e-4 * np.eye(5)[i]
        ends = [oracle.shoot(law, numbers + k * step)[0] for k in (-2, -1, 1, 2)]
        slope = (ends[0] - 8 * ends[1] + 8 * ends[2] - ends[3]) / (12 * 1e-4)
        np.testing.assert_allclose(jacobian[:, i], slope, rtol=2e-5, atol=2e-6)


def test_integration_stops_at_the_kink() -> None:
    found = oracle.solve_tip(1.0, 0.4, guess=(-0.7, 1.25, 3.15))
    assert np.abs(found.r * found.column("y") - 1.0).min() < 1e-15


def test_taylor_integrator_repeats_dop853() -> None:
    numbers = (-3.0, 2.5, 0.2, 5.4, 1.0)
    end, _, _ = oracle.shoot(COHESIVE, numbers)
    fine = [float(v) for v in oracle.taylor_shoot(COHESIVE, numbers, digits=20)]
    np.testing.assert_allclose(end, fine, rtol=0.0, atol=1e-12)


def test_digits_asked_are_digits_got() -> None:
    numbers = (-0.226103219759, 0.4, 0.8, 3.03680400592, 1.0)
    coarse, _ = oracle.refine(COHESIVE, numbers, GIVEN_PRESSURE, digits=20)
    fine, _ = oracle.refine(COHESIVE, numbers, GIVEN_PRESSURE, digits=30)
    assert abs(coarse[LENGTH] - fine[LENGTH]) < 1e-17
    assert abs(fine[Y_TIP] - 2 * (1 - fine[LOAD])) < 1e-27


@pytest.mark.parametrize("r", [0.3, 1.0, 10.0])
def test_branch_leaves_the_transition_along_the_kernel(r: float) -> None:
    drop = 1e-4
    guess = oracle.near_transition(r, drop)
    found = oracle.solve(COHESIVE, guess, GIVEN_PRESSURE)
    assert found.theta_tip == pytest.approx(guess[THETA_TIP], rel=3 * drop)
    assert found.sigma == pytest.approx(guess[LENGTH], rel=3 * drop)


def test_walk_needs_no_guess() -> None:
    found = oracle.walk(1.0, [0.4999, 0.95])
    for ref in (r for r in PRESSURE_GIVEN if r.name in ("r=1, P=0.4999, unfolded", "r=1, P=0.95, unfolded")):
        check_rod(ref, found[float(ref.question["pressure_ratio"])])


def test_walk_refuses_what_cannot_be_held() -> None:
    with pytest.raises(ValueError, match="below the minimum"):
        oracle.walk(1.0, [0.1])


# --------------------------------------------------------------------- everything, from nothing: a minute


@pytest.mark.slow
@pytest.mark.parametrize("r", sorted({float(ref.question["ratio"]) for ref in tagged("unfolded")}))
def test_regenerates_the_unfolded_states(r: float) -> None:
    for name, law in (("cohesive", COHESIVE), ("exponential", EXPONENTIAL)):
        asked = {
            float(ref.question["pressure_ratio"]): ref
            for ref in tagged("unfolded")
            if ref.question["ratio"] == r and ref.question["law"] == name
        }
        found = oracle.walk(r, asked, law) if asked else {}
        for P, ref in asked.items():
            check_rod(ref, found[P])
            assert abs(found[P].identity) < 1e-13
            assert max(first_integrals(found[P])) < 1e-13
            if name == "cohesive":
                check_digits(ref, found[P], GIVEN_PRESSURE)


def check_digits(ref: Reference, found: oracle.TipSolution, free: tuple[int, ...]) -> None:
    """All digits of the registry, by the Taylor integrator."""
    numbers, worst = oracle.refine(found.law, found.numbers, free)
    assert worst < 1e-24
    exact = {
        "pressure_ratio": numbers[LOAD],
        "length_ratio": numbers[LENGTH],
        "tip_angle": numbers[THETA_TIP],
        "tip_height": numbers[Y_TIP] * numbers[RATE],
    }
    for name, value in ref.expected.items():
        assert abs(float(exact[name] - mpmath.mpf(value))) <= ref.tolerance * max(1.0, abs(value)), name


def on_the_branch(
    ref: Reference, which: int, passes: Callable[[oracle.TipSolution, oracle.TipSolution], bool]
) -> np.ndarray:
    previous = None
    value = float((ref.question | ref.expected)[("", "", "pressure_ratio", "length_ratio")[which]])
    for state in oracle.march(float(ref.question["ratio"]), LAWS[str(ref.question["law"])]):
        if previous is not None and passes(previous, state):
            return oracle._between(previous, state, which, value)
        previous = state
    raise AssertionError("the branch does not pass there")


@pytest.mark.slow
@every(*tagged("folded"))
def test_regenerates_the_folded_states(ref: Reference) -> None:
    P = float(ref.question["pressure_ratio"])
    guess = on_the_branch(ref, LOAD, lambda a, b: a.P < P <= b.P)
    found = oracle.solve(COHESIVE, guess, GIVEN_PRESSURE)
    check_rod(ref, found)
    check_digits(ref, found, GIVEN_PRESSURE)
    assert found.column("y")[:-1].min() > 0.0
    assert max(first_integrals(found)) < 1e-13


@pytest.mark.slow
@every(*LENGTH_GIVEN)
def test_regenerates_the_states_of_given_length(ref: Reference) -> None:
    sigma = float(ref.question["length_ratio"])
    guess = on_the_branch(ref, LENGTH, lambda a, b: a.sigma < sigma <= b.sigma)
    found = oracle.solve(LAWS[str(ref.question["law"])], guess, GIVEN_LENGTH)
    check_rod(ref, found)
    check_digits(ref, found, GIVEN_LENGTH)


@pytest.mark.slow
@every(*ROD_FOLDS)
def test_regenerates_the_folds_of_a_rod(ref: Reference) -> None:
    r = float(ref.question["ratio"])
    which = LOAD if ref.question["kind"] == "LP-pressure" else LENGTH
    found = oracle.fold(r, which, COHESIVE, 1 if "second" in ref.tags else 0)
    # at a fold the number that turns is known to rounding, the others follow it less closely
    answers = {"pressure_ratio": found.P, "length_ratio": found.sigma}
    turning = "pressure_ratio" if which == LOAD else "length_ratio"
    assert answers[turning] == pytest.approx(ref.expected[turning], rel=1e-11)
    fine = oracle.refine_fold(COHESIVE, found.numbers, which, digits=36)
    exact = dict(zip(("tip_angle", "", "pressure_ratio", "length_ratio"), fine, strict=False))
    for name in ("tip_angle", "pressure_ratio", "length_ratio"):
        assert abs(float(exact[name] - mpmath.mpf(ref.expected[name]))) <= ref.tolerance, name


@pytest.mark.slow
@every(*LAM_FOLDS)
def test_regenerates_the_folds_in_lambda(ref: Reference) -> None:
    known = ref.question | ref.expected
    found = oracle.lam_fold(known["beta0"], (0.5 * known["tip_angle"], 2.0 * known["tip_angle"]))
    assert found.lam == pytest.approx(known["lam"], abs=1e-11)
    assert found.alpha1 == pytest.approx(known["alpha1"], abs=1e-11)


@pytest.mark.slow
@every(*GROUPS)
def test_regenerates_the_groups(ref: Reference) -> None:
    """All digits of the groups by the Taylor integrator."""
    known = ref.question | ref.expected
    unit = math.pi**4
    with mpmath.workdps(40):
        beta0 = mpmath.mpf(str(known["beta0"]))
        beta1 = (
            mpmath.mpf(str(known["beta1"])) if "beta1" in known else mpmath.pi**4 + mpmath.mpf(known["lam"])
        )
        law = oracle.Law((oracle.Line(beta0, -unit),))
        numbers = (
            known["tip_angle"],
            -2 * known["alpha1"] / beta1,
            beta0 + known["alpha1"],
            1.0,
            beta1 / unit,
        )
        fine, worst = oracle.refine(law, numbers, GIVEN_LENGTH)
        assert worst < 1e-20
        assert abs(fine[LOAD] - beta0 - known["alpha1"]) <= ref.tolerance
        assert abs(fine[THETA_TIP] - known["tip_angle"]) <= ref.tolerance


@pytest.mark.slow
def test_fig_10a_lies_on_the_branch_of_its_rod() -> None:
    (ref,) = (r for r in GROUPS if r.name == "Fig 10a")
    known = ref.question | ref.expected
    P = known["alpha"] / known["beta0"]
    found = oracle.walk(known["beta1"] / known["beta0"] ** (4 / 3), [P], LINEAR)[P]
    assert found.beta0 == pytest.approx(known["beta0"], rel=1e-11)
    assert found.theta_tip == pytest.approx(known["tip_angle"], rel=1e-11)
