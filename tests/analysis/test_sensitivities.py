"""Derivatives against differences: of the independent oracle in 30 digits, and of the calls themselves.

Modules: `sensitivities`, `surface`, `limits`, `maxwell_derivative`.
"""

from __future__ import annotations

import math
import pickle
from collections.abc import Callable
from dataclasses import replace

import mpmath
import pytest

import peel_opt as po
from peel_opt.analysis import flaws
from peel_opt.analysis.limits import LIMITS
from peel_opt.analysis.maxwell_derivative import maxwell_gradient
from peel_opt.continuation.primary import PrimaryBranch
from peel_opt.equilibria.branch_points import equilibrium_at
from peel_opt.residual.meshes import AT_FOLDS

from .. import oracle
from ..rods import FLAP

NAMES = ("bending_stiffness", "adhesion_strength", "adhesion_range")


def richardson(function: Callable[[float], float], h: float) -> float:
    """Derivative at 0 from central differences with steps h, h/2, h/4."""
    first, second, third = ((function(s) - function(-s)) / (2.0 * s) for s in (h, h / 2.0, h / 4.0))
    return (64.0 * third - 20.0 * second + first) / 45.0


def oracle_gradient(
    ratio: float, sigma: float, P: float, angle: float, tip: float, given: int
) -> list[float]:
    """Central differences of 30-digit solutions by r and by the given number."""
    law = oracle.as_law("cohesive")
    free, answer = {
        oracle.LENGTH: (oracle.GIVEN_LENGTH, oracle.LOAD),
        oracle.LOAD: (oracle.GIVEN_PRESSURE, oracle.LENGTH),
    }[given]
    numbers = oracle.solve(law, (angle, tip, P, sigma, ratio), free).numbers
    found = []
    for which in (oracle.RATE, given):
        with mpmath.workdps(35):
            h, values = mpmath.mpf(10) ** -9, []
            for sign in (1, -1):
                moved = list(map(mpmath.mpf, numbers))
                moved[which] += sign * h
                values.append(oracle.refine(law, moved, free)[0][answer])
            found.append(float((values[0] - values[1]) / (2 * h)))
    return found


#: r, P, state: one and two phases, folded, beside a fold, a stiff rod.
STATES = (
    pytest.param(1.0, 0.2493, None, "length", marks=pytest.mark.slow),
    (1.0, 0.1243, None, "pressure"),
    (0.75, 0.2, "folded", "length"),
    (10.0, 0.04488, None, "pressure"),
)


@pytest.mark.parametrize(("ratio", "P", "state", "given"), STATES)
def test_gradients_are_those_of_the_oracle(ratio: float, P: float, state: str | None, given: str) -> None:
    rod = po.Rod.from_ratio(ratio)
    eq = po.length_given_pressure(rod, P, state=state)
    numbers = (ratio, eq.length_ratio, P, eq.tip_angle, eq.tip_height / rod.eta)
    if given == "length":
        eq = po.pressure_given_length(rod, eq.length, near=eq.pressure)
    found = po.sensitivities(eq)
    expected = oracle_gradient(*numbers, oracle.LOAD if given == "pressure" else oracle.LENGTH)
    assert list(found.dimensionless) == ["ratio", f"{given}_ratio"]
    assert list(found.dimensionless.values()) == pytest.approx(expected, rel=2e-9)
    # In units of T0 and eta the error belongs to the same number.
    assert abs(found[given] - expected[1]) <= found.errors[given]


@pytest.mark.parametrize(
    "law",
    [
        "auto",
        po.exponential(),
        pytest.param("linear", marks=pytest.mark.slow),
        pytest.param(po.trapezoidal(0.3), marks=pytest.mark.slow),
    ],
    ids=lambda law: getattr(law, "name", law),
)
def test_material_derivatives_by_differences(law: str | po.CohesiveLaw) -> None:
    length = 1.92e-3
    eq = po.pressure_given_length(FLAP, length, law=law)
    found = po.sensitivities(eq)

    def pressure(h: float) -> float:  # the others follow from k and the length by dimensions
        rod = replace(FLAP, bending_stiffness=FLAP.bending_stiffness * (1.0 + h))
        return po.pressure_given_length(rod, length, law=law, near=eq).pressure

    by_stiffness = richardson(pressure, 4e-3)
    by_length = richardson(lambda h: po.pressure_given_length(FLAP, length * (1 + h), law=law).pressure, 2e-3)
    assert found["bending_stiffness"] * FLAP.bending_stiffness == pytest.approx(by_stiffness, rel=1e-7)
    assert found["length"] * length == pytest.approx(by_length, rel=1e-7)


@pytest.mark.parametrize(
    "method", ["series", "spectral", "collocation", "shooting", po.Spectral(nodes=8)], ids=str
)
def test_every_method_has_the_same_derivatives(method: object) -> None:
    rod = po.Rod.from_ratio(1.0)
    expected = po.sensitivities(po.length_given_pressure(rod, 0.8)).derivatives
    eq = po.length_given_pressure(rod, 0.8, method=method, tol=1e-6)  # type: ignore[arg-type]
    assert po.sensitivities(eq).derivatives == pytest.approx(expected, rel=1e-9)


def test_units_alone_scale_the_answer() -> None:
    """p/T0 and sbar/eta have no units: the elasticities add up to what dimensions say."""
    e = po.sensitivities(po.pressure_given_length(FLAP, 1.9e-3)).elasticities
    force, length = e["bending_stiffness"], e["adhesion_range"] + e["length"]
    assert e["adhesion_strength"] + force == pytest.approx(1.0, abs=1e-10)  # [Pa] = N^1 ...
    assert force + length - 2.0 * e["adhesion_strength"] == pytest.approx(-2.0, abs=1e-10)  # ... m^-2


def test_groups_by_differences() -> None:
    found = po.sensitivities(po.equilibrium(beta0=4.0, lam=1.0))
    by_beta0 = richardson(lambda h: po.equilibrium(beta0=4.0 + h, lam=1.0).alpha1, 0.05)
    by_lam = richardson(lambda h: po.equilibrium(beta0=4.0, lam=1.0 + h).alpha1, 0.02)
    assert found.derivatives == pytest.approx({"beta0": by_beta0, "lam": by_lam}, rel=1e-8)


def test_groups_without_strength() -> None:
    """alpha1 is smooth in beta0 at 0, sigma = beta0^(1/3) is not."""
    found = po.sensitivities(po.equilibrium(beta0=0.0, lam=1.0))
    # lambda = beta0 c1 alpha1 + c2 alpha1^2 + ... with the exact coefficients to leading order.
    steps = (1e-4, 2e-4)
    a, b = (po.equilibrium(beta0=h, lam=1.0).alpha1 for h in steps)
    forward = (4.0 * a - b - 3.0 * po.equilibrium(beta0=0.0, lam=1.0).alpha1) / (2.0 * steps[0])
    assert found["beta0"] == pytest.approx(forward, abs=1e-7)
    assert po.sensitivities(po.equilibrium(beta0=1e-6, lam=1.0))["beta0"] == pytest.approx(
        found["beta0"], abs=1e-6
    )


@pytest.fixture(scope="module")
def branch() -> po.Branch:
    return po.trace(FLAP, points=30)


def test_at_a_fold_there_is_no_derivative(branch: po.Branch) -> None:
    for fold in branch.special("LP-length"):
        with pytest.raises(po.AtFold, match="turns round"):
            po.sensitivities(equilibrium_at(branch, fold.index))


def test_close_to_a_fold_the_error_grows_and_says_so() -> None:
    least = po.sensitivities(FLAP, "least_length").value
    near, far = (
        po.sensitivities(po.pressure_given_length(FLAP, least * (1 + h), tol=1e-4)) for h in (1e-8, 1e-2)
    )
    # p - p_F ~ sqrt(sbar - sbar_F): the derivative grows with the inverse root.
    assert near["length"] / far["length"] == pytest.approx(1e3, rel=0.3)
    assert near.error / abs(near.elasticities["length"]) > 1e3 * far.error / abs(far.elasticities["length"])
    assert near.error / abs(near.elasticities["length"]) < 1e-3


def test_at_the_minimum_pressure_length_does_not_matter(branch: po.Branch) -> None:
    (fold,) = branch.special("LP-pressure")
    found = po.sensitivities(equilibrium_at(branch, fold.index))
    assert abs(found.elasticities["length"]) < 1e-9
    limit = po.sensitivities(FLAP, "readhesion_pressure")
    assert [found[name] for name in NAMES] == pytest.approx([limit[name] for name in NAMES], rel=1e-8)


@pytest.mark.parametrize(
    "of",
    [of if of == "readhesion_pressure" else pytest.param(of, marks=pytest.mark.slow) for of in LIMITS],
)
def test_limits_by_differences(of: str) -> None:
    found = po.sensitivities(FLAP, of)
    for name in NAMES:
        assert found.errors[name] < 1e-8 * abs(found[name])

    def value(h: float) -> float:
        return po.sensitivities(replace(FLAP, adhesion_range=FLAP.adhesion_range * (1.0 + h)), of).value

    central = (value(2e-4) - value(-2e-4)) / 4e-4
    assert found["adhesion_range"] * FLAP.adhesion_range == pytest.approx(central, rel=2e-6)


def test_a_limit_is_walked_to_on_one_mesh_only(monkeypatch: pytest.MonkeyPatch) -> None:
    """On the finer one, which tells the error, it is found beside: the answer is that of a walk there."""
    rod, walked = po.Rod.from_ratio(0.777), []
    extend = PrimaryBranch.extend

    def counted(self: PrimaryBranch, enough: Callable) -> None:
        walked.append(self.family.transcription)
        extend(self, enough)

    monkeypatch.setattr(PrimaryBranch, "extend", counted)
    beside = po.readhesion_pressure(rod)
    po.sensitivities(rod, "readhesion_pressure")
    assert set(walked) == {AT_FOLDS[0]}
    flaws.on_both_meshes.cache_clear()
    monkeypatch.setattr(flaws, "found_again", lambda *_: None)
    along = po.readhesion_pressure(rod)
    assert set(walked) == set(AT_FOLDS)
    assert beside.pressure == pytest.approx(along.pressure, rel=1e-13)
    assert max(beside.error, along.error) < 1e-12


def test_limits_are_those_of_their_own_functions() -> None:
    assert po.sensitivities(FLAP, "readhesion_pressure").value == pytest.approx(
        po.readhesion_pressure(FLAP).pressure, rel=1e-12
    )
    assert po.sensitivities(po.Rod.from_ratio(1.0), "least_length").value == pytest.approx(
        3.013827495, abs=1e-9
    )
    assert po.sensitivities(po.Rod.from_ratio(1.0), "longest_length").value == pytest.approx(
        5.618032225, abs=1e-9
    )


@pytest.mark.parametrize("ratio", [pytest.param(0.52, marks=pytest.mark.slow), 1.0, 3000.0])
def test_maxwell_point_is_that_of_the_traced_branches(ratio: float) -> None:
    found = maxwell_gradient(ratio)
    assert found.value * ratio == pytest.approx(po.maxwell_length(ratio, "branch"), rel=1e-8)
    central = (maxwell_gradient(ratio * 1.0001).value - maxwell_gradient(ratio * 0.9999).value) / (
        2e-4 * ratio
    )
    assert found.derivatives[0] == pytest.approx(central, rel=1e-5)
    assert found.errors[0] < 1e-5 * abs(found.derivatives[0])
    assert abs(found.derivatives[0] - central) < found.errors[0] + 1e-6 * abs(central)


def test_limits_that_do_not_exist() -> None:
    for ratio, of in ((0.2, "least_length"), (0.3, "longest_length"), (0.4, "maxwell_length")):
        with pytest.raises(po.NoEquilibrium) as caught:
            po.sensitivities(po.Rod.from_ratio(ratio), of)
        assert caught.value.nearest is not None
        assert caught.value.nearest > ratio


def test_folds_that_the_walk_cannot_tell_apart() -> None:
    with pytest.raises(po.NotConverged, match="above the cusp"):
        po.sensitivities(po.Rod.from_ratio(0.3210501), "least_length")


@pytest.mark.parametrize("of", ["least_length", "longest_length"])
def test_folds_close_to_the_cusp(of: str) -> None:
    # sbar/eta is a function of the ratio alone: y0 moves only that.
    rod, h = po.Rod.from_ratio(0.322), 1e-5
    up, down = (po.sensitivities(po.Rod.from_ratio(0.322 * (1.0 + d)), of).value for d in (h, -h))
    found = po.sensitivities(rod, of)
    by_ratio = (up - down) / (2.0 * h)
    assert found["adhesion_range"] * rod.adhesion_range == pytest.approx(-by_ratio, rel=1e-4)


def test_beside_the_end_of_the_maxwell_curve() -> None:
    with pytest.raises(po.NotConverged, match="too close to the end"):
        po.sensitivities(po.Rod.from_ratio(0.4992), "maxwell_length")


def test_what_is_refused() -> None:
    nothing = po.length_given_pressure(FLAP, 2e4, throw=False)
    with pytest.raises(po.InvalidInput, match="no equilibrium to differentiate"):
        po.sensitivities(nothing)
    eq = po.pressure_given_length(FLAP, 1.9e-3)
    with pytest.raises(po.InvalidInput, match="no discrete solution"):
        po.sensitivities(pickle.loads(pickle.dumps(eq)))
    with pytest.raises(po.InvalidInput, match="readhesion_pressure"):
        po.sensitivities(FLAP)
    with pytest.raises(po.InvalidInput, match="one answer"):
        po.sensitivities(eq, "maxwell_length")
    with pytest.raises(po.InvalidInput, match="got float"):
        po.sensitivities(3.0)  # type: ignore[arg-type]
    with pytest.raises(po.InvalidInput, match="bending_stiffness"):
        po.sensitivities(eq)["stiffness"]


def test_it_reads_well_and_travels() -> None:
    found = po.sensitivities(po.pressure_given_length(FLAP, 1.9e-3))
    assert repr(found).startswith(
        "Sensitivities(pressure = 48.673 kPa; elasticities: bending_stiffness +0.8272"
    )
    lines = str(found).splitlines()
    assert lines[0] == "pressure = 48.673 kPa"
    assert [line.split()[0] for line in lines[2:]] == [*NAMES, "length"]
    assert lines[2].endswith("Pa/(N m)")
    assert pickle.loads(pickle.dumps(found)) == found


def test_elasticities_of_zero_are_not_numbers() -> None:
    eq = po.pressure_given_length(po.Rod.from_ratio(1.0), 3.2)
    found = replace(po.sensitivities(eq), value=0.0)
    assert math.isnan(found.elasticities["length"])
    assert math.isnan(found.error)


def test_the_greatest_length_is_not_denied_on_a_branch_that_cannot_be_followed() -> None:
    law = po.CohesiveLaw(  # it hardens: the angle of the tip vanishes, and the walk ends
        [lambda u: 1 - u, lambda u: 0.4 + 0.8 * (u - 0.6), lambda u: 0.8 - 0.8 * (u - 1.1), lambda u: 0 * u],
        kinks=(0.6, 1.1, 2.1),
    )
    with pytest.raises(po.NotConverged, match="not met for certain"):
        po.sensitivities(po.Rod.from_ratio(3.0), "longest_length", law=law)
