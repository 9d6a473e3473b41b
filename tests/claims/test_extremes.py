"""The ends of the range: an answer with its certificate, or an error that has a name."""

from __future__ import annotations

import math
import subprocess
import sys
from collections.abc import Callable
from functools import partial
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

import benchmarks.extremes as bench
import peel_opt as po
from peel_opt.app.cards import load_card, read_card
from peel_opt.plots.figures import method_map
from peel_opt.studies.tradeoff.compare import METHODS, Attempt, Compared, compare

from .. import oracle

ROOT = Path(__file__).parents[2]

#: How a question under ``throw=False`` may end without an answer.
TYPED = {"no-equilibrium", "ambiguous", "not-converged", "not-certified", "out-of-range"}

#: dlambda/dalpha1 over beta0 at T: exact, from the linear hierarchy.
SLOPE = 0.09619170467

#: Whatever is computed in two processes: every method, both laws, a branch.
BITS = """
import peel_opt as po
rod = po.Rod.from_ratio(0.7)
eqs = [po.equilibrium(beta0=4, lam=1, method=m) for m in ("series", "spectral", "collocation", "shooting")]
eqs += [po.length_given_pressure(rod, 0.21), po.pressure_given_length(po.Rod.from_ratio(2000.0), 0.9)]
branch = po.trace(beta0=4, lam=(-1, 1), points=32)
values = [eq.answer for eq in eqs] + [eq.error for eq in eqs] + eqs[0].theta.tolist() + branch.alpha1.tolist()
print(*(float(value).hex() for value in values))
"""


def check(scan: list[Compared]) -> None:
    for place in scan:
        assert not place.contradictions, (place.x, place.y)
        for attempt in place.attempts:
            assert attempt.certified or attempt.status in TYPED, attempt
        if any(attempt.certified for attempt in place.attempts):
            assert place.by("auto").certified, place


# --- the two planes ---------------------------------------------------------------------


def test_methods_agree_or_refuse_over_pressures() -> None:
    scan = method_map.scan_rods(25, seed=5)
    check(scan)
    assert sum(place.by("auto").certified for place in scan) >= 20


@pytest.mark.parametrize("law", ["cohesive", "linear"])
def test_methods_agree_or_refuse_over_groups(law: str) -> None:
    scan = method_map.scan_groups(16, seed=5, law=law)
    check(scan)
    assert sum(place.by("auto").certified for place in scan) >= 4


def test_methods_agree_or_refuse_about_the_transition() -> None:
    scan = method_map.scan_transition(36, seed=5)
    check(scan)
    assert sum(place.by("auto").certified for place in scan) >= 18
    assert sum(place.by("series").certified for place in scan) >= 12


@pytest.mark.slow
@pytest.mark.parametrize("seed", [2, 3])
def test_methods_agree_or_refuse_over_the_whole_range(seed: int) -> None:
    rods = method_map.scan_rods(400, seed)
    check(rods)
    for (ratio, _, share), place in zip(method_map.rods(400, seed), rods, strict=True):
        # Refused is only what has no digits left: slender rods beside their minimum pressure.
        assert place.by("auto").certified or (ratio > 20.0 and 1.0 - share < 2e-5)
    for law in ("cohesive", "linear"):
        check(method_map.scan_groups(400, seed, law=law))
    check(method_map.scan_transition(400, seed))


@pytest.mark.slow
def test_answers_are_those_of_the_oracle() -> None:
    for ratio, P, share in method_map.rods(36, seed=8):
        if not 1e-6 < share < 1.0 - 1e-6 or not 0.02 < ratio < 500.0:
            continue  # where double precision shooting from the tip loses its digits
        eq = po.length_given_pressure(po.Rod.from_ratio(ratio), P)
        found = oracle.solve_tip(ratio, P=P)
        assert eq.length_ratio == pytest.approx(found.sigma, abs=eq.error + 1e-9 * (1.0 + eq.stats.condition))


def test_contradictions_are_seen() -> None:
    right = Attempt("a", "certified", answer=1.0, error=1e-9)
    wrong = Attempt("b", "certified", answer=1.1, error=1e-9)
    place = Compared(0.0, 0.0, (right, wrong, Attempt("c", "not-converged")))
    assert place.contradictions == [(right, wrong)]
    assert bench.wrong([place])[0].startswith("WRONG at (0.0, 0.0): a 1.0")
    assert place.by("c").status == "not-converged"


def test_the_summary_counts_refusals_by_kind() -> None:
    ask = partial(po.length_given_pressure, po.Rod.from_ratio(0.05), 0.97)
    lines = bench.summary("one", [compare(ask, 0.05, 0.97)]).splitlines()
    assert lines[0] == "one: 1 questions"
    assert [line.split()[0] for line in lines[2:7]] == list(METHODS)
    assert lines[2].split()[1] == "0"
    assert lines[2].endswith("1 not-converged")
    assert lines[3].split()[1] == "1"


def test_the_map_shows_every_method() -> None:
    rods, groups = method_map.scan_rods(4), method_map.scan_groups(4)
    figure = method_map.draw(rods, groups)
    titles = [ax.get_title(loc="left") for ax in figure.axes[:8]]
    assert titles[0].startswith("series: ")
    assert titles[1] == "spectral: 4 of 4"
    assert figure.axes[8].get_ylabel().endswith("[ms]")


# --- beta1, beta0, lambda ---------------------------------------------------------------


@pytest.mark.parametrize("method", ["spectral", "collocation", "shooting"])
def test_unknowns_grow_no_faster_than_the_layers(method: str) -> None:
    """A layer is beta1^(-1/4) wide."""
    found = []
    for beta1 in (1e3, 1e5, 1e7, 1e9):
        beta0 = (beta1 / 1000.0) ** 0.75
        eq = po.equilibrium(beta0=beta0, beta1=beta1, law="cohesive", method=method, tol=1e-6)
        assert eq.certified
        assert eq.beta1 == pytest.approx(beta1, rel=1e-14)
        found.append(eq.stats.unknowns)
    for before, after in pairwise(found):
        assert after <= 100**0.25 * before


def test_unknowns_grow_no_faster_than_the_layers_under_the_linear_law() -> None:
    found = []
    for beta1 in (1e3, 1e4, 1e5):
        beta0 = 4.0 * (beta1 / 1e3) ** 0.75
        eq = po.equilibrium(beta0=beta0, beta1=beta1, method="spectral", tol=1e-9 * 0.25 * beta1)
        found.append(eq.stats.unknowns)
    assert found[0] < found[2] <= 100**0.25 * found[0]
    assert found[1] <= 10**0.25 * found[0]


def test_shooting_does_not_slip_to_another_solution() -> None:
    """Two solutions of the same groups, one of them not on the walk."""
    groups = {"beta0": 15.780766037236104, "beta1": 254238.97889255665}
    own = po.equilibrium(**groups, method="spectral", tol=1e-6)
    eq = po.equilibrium(**groups, method="shooting", tol=1e-6, throw=False)
    assert eq.status == "not-converged" or abs(eq.alpha1 - own.alpha1) <= eq.error + own.error


@pytest.mark.parametrize(("beta0", "beta1"), [(1e4, 1e7), (14000.0, 1e9), (31623.0, 1e9), (1e4, 80.0)])
def test_large_groups_are_answered(beta0: float, beta1: float) -> None:
    law = "cohesive" if beta1 > 100.0 else "linear"
    eq = po.equilibrium(beta0=beta0, beta1=beta1, law=law)
    other = po.equilibrium(beta0=beta0, beta1=beta1, law=law, method="collocation")
    assert eq.certified
    assert eq.certificate < 1e-10
    assert abs(eq.alpha1 - other.alpha1) <= eq.error + other.error


@pytest.mark.parametrize("lam", [1e-8, -1e-8, 1e-12])
@pytest.mark.parametrize("beta0", [0.001, 1.0, 4.0, 37.0])
def test_lambda_close_to_its_value_at_the_transition(beta0: float, lam: float) -> None:
    eq = po.equilibrium(beta0=beta0, lam=lam)
    spectral = po.equilibrium(beta0=beta0, lam=lam, method="spectral")
    assert eq.lam == spectral.lam == lam
    assert abs(eq.alpha1 - spectral.alpha1) <= eq.error + spectral.error


@pytest.mark.parametrize("method", ["series", "spectral", "collocation", "shooting"])
@pytest.mark.parametrize("beta0", [0.5, 4.0, 20.0])
def test_the_middle_state_keeps_its_digits_down_to_the_transition(beta0: float, method: str) -> None:
    lam = -1e-8
    eq = po.equilibrium(beta0=beta0, lam=lam, state="middle", method=method)
    assert eq.state == "middle"
    expected = lam / (SLOPE * beta0)
    assert eq.alpha1 == pytest.approx(expected, rel=1e-6, abs=eq.error)
    # On a mesh alpha1 is what rounding leaves of pi^4 + lambda; the closed form knows lambda alone.
    assert eq.error < {"series": 1e-9, "spectral": 1e-3}.get(method, 1.0) * abs(expected)


@pytest.mark.parametrize("ratio", [0.005, 0.4, 100.0, 2500.0])
@pytest.mark.parametrize("gap", [1e-6, 2.0**-30, 2.0**-50])
def test_pressures_close_to_the_strength(ratio: float, gap: float) -> None:
    eq = po.length_given_pressure(po.Rod.from_ratio(ratio), 1.0 - gap)
    assert eq.certified
    gap = 1.0 - (1.0 - gap)
    # To first order in 1 - P: however small lambda is beside beta1, it has its digits.
    assert eq.lam == pytest.approx(-SLOPE * gap * eq.beta0**2, rel=1e-8 + gap * (4.0 + 2.0 * eq.beta0))


def test_lambda_is_not_the_difference_of_two_large_numbers() -> None:
    eq = po.length_given_pressure(po.Rod.from_ratio(2500.0), 0.6)
    found = oracle.solve_tip(2500.0, P=0.6)
    assert abs(eq.lam / eq.beta1) < 2e-6
    assert eq.length_ratio == pytest.approx(found.sigma, abs=1e-12)
    assert eq.certificate < 1e-9


# --- absolute scales --------------------------------------------------------------------


@pytest.mark.parametrize(
    ("k", "T0", "y0"),
    [(1e-18, 1e9, 1e-9), (1e-18, 1e6, 1e-9), (1e-18, 1e12, 1e-12), (1e15, 1e9, 10.0), (1e-30, 1e-3, 1e-9)],
)
def test_absolute_scales_do_not_matter(k: float, T0: float, y0: float) -> None:
    rod = po.Rod(k, T0, y0)
    pure = po.Rod.from_ratio(rod.ratio)
    for P in (0.7, 0.3):
        eq, other = po.length_given_pressure(rod, P * T0), po.length_given_pressure(pure, P)
        assert eq.valid
        assert abs(eq.length_ratio - other.length_ratio) <= eq.error + other.error
        assert eq.length == pytest.approx(other.length_ratio * rod.eta, rel=1e-14)
        back = po.pressure_given_length(rod, eq.length, state=eq.state)
        allowed = back.error + back.stats.condition * (eq.error + 1e-15 * eq.length_ratio)
        assert abs(back.pressure_ratio - P) <= allowed


PROBLEMS = sorted((ROOT / "problems").glob("*.toml"))
CARDS = [path for path in PROBLEMS if not {"calibration", "scene"} & read_card(path).keys()]


@pytest.mark.parametrize("card", CARDS, ids=lambda path: path.stem)
def test_every_card_is_answered_by_collocation_too(card: Path) -> None:
    own, other = load_card(card).ask(), load_card(card).ask(method="collocation")
    for (label, a), (_, b) in zip(own, other, strict=True):
        assert isinstance(a, po.Equilibrium), (label, a)
        assert isinstance(b, po.Equilibrium), (label, b)
        assert a.certified
        assert abs(a.answer - b.answer) <= a.error + b.error


# --- beyond -----------------------------------------------------------------------------


def rod(ratio: float) -> po.Rod:
    return po.Rod.from_ratio(ratio)


BEYOND = {
    "ratio too small": (lambda: po.length_given_pressure(rod(0.0049), 0.999), po.OutOfRange),
    "ratio too large": (lambda: po.length_given_pressure(rod(3001.0), 0.5), po.OutOfRange),
    "p = T0": (lambda: po.length_given_pressure(rod(1.0), 1.0), po.NoEquilibrium),
    "p > T0": (lambda: po.length_given_pressure(rod(1.0), 1.0 + 1e-12), po.NoEquilibrium),
    "p below its minimum": (lambda: po.length_given_pressure(rod(3000.0), 1e-7), po.NoEquilibrium),
    "p = 0": (lambda: po.length_given_pressure(rod(1.0), 0.0), po.NoEquilibrium),
    "p < 0": (lambda: po.length_given_pressure(rod(1.0), -1.0), po.PeelOptError),
    "p not a number": (lambda: po.length_given_pressure(rod(1.0), math.nan), po.InvalidInput),
    "length too large": (lambda: po.pressure_given_length(rod(1.0), 1e9), po.NoEquilibrium),
    "length too small": (lambda: po.pressure_given_length(rod(1.0), 1e-9), po.NoEquilibrium),
    "negative beta0": (lambda: po.equilibrium(beta0=-1.0, lam=1.0), po.InvalidInput),
    "infinite beta0": (lambda: po.equilibrium(beta0=math.inf, lam=1.0), po.InvalidInput),
    "negative beta1": (lambda: po.equilibrium(beta0=4.0, beta1=-1.0), po.PeelOptError),
    "tol = 0": (lambda: po.equilibrium(beta0=4.0, lam=1.0, tol=0.0), po.InvalidInput),
    "tol beyond double precision": (lambda: po.equilibrium(beta0=4.0, lam=1.0, tol=1e-18), po.NotCertified),
}


@pytest.mark.parametrize("case", BEYOND)
def test_beyond_the_range_an_error_says_so(case: str) -> None:
    call, kind = BEYOND[case]
    with pytest.raises(kind):
        call()


@pytest.mark.parametrize(
    "groups",
    [
        {"beta0": 0.0, "lam": 500.0},
        {"beta0": 0.0, "beta1": 1e9},
        {"beta0": 4.0, "beta1": 1e7, "law": "cohesive"},
        {"beta0": 4.0, "beta1": 1e5},
        {"beta0": 0.1451210208669356, "beta1": 15432714.426119275, "law": "cohesive"},
        {"beta0": 223.223361907672, "lam": 213607.67},
    ],
    ids=str,
)
def test_where_the_walk_ends_nothing_is_said_not_to_exist(groups: dict) -> None:
    eq = po.equilibrium(**groups, throw=False)
    assert eq.status in ("certified", "out-of-range", "not-converged", "not-certified"), eq


# --- the same bits ----------------------------------------------------------------------


def test_two_processes_give_the_same_bits() -> None:
    outputs = [
        subprocess.run([sys.executable, "-c", BITS], cwd=ROOT, capture_output=True, check=True).stdout
        for _ in range(2)
    ]
    assert outputs[0] == outputs[1]
    values = np.array([float.fromhex(word) for word in outputs[0].decode().split()])
    assert len(values) > 100
    assert values[0] == pytest.approx(-4.4354069891, abs=1e-10)


def test_a_certificate_is_judged_by_the_size_of_the_pressure() -> None:
    # p/T0 comes to 7e4 there, and its certificate to 3e-7.
    branch = po.trace(beta0=4.0, lam=(-1.0, 1e6))
    assert np.abs(branch.pressure_ratio).max() > 7e4
    assert (branch.certificate / np.maximum(1.0, np.abs(branch.pressure_ratio))).max() < 1e-11
    assert branch.error.max() < 2e-9


@pytest.mark.slow
def test_a_window_out_of_reach_ends_with_an_error() -> None:
    # So far out that doubles do not tell points a landing's width apart.
    with pytest.raises(po.NotConverged, match="nearer to the transition"):
        po.trace(beta0=4.0, lam=(-1.0, 1e10))
    with pytest.raises(po.OutOfRange, match="beyond 1e"):
        po.trace(beta0=4.0, lam=(-1.0, 1e30))


@pytest.mark.parametrize("ratio", [1e-300, 1e-7, 1.1e4, 1e300])
@pytest.mark.parametrize(
    "ask",
    [
        po.trace,
        po.hysteresis,
        po.readhesion_pressure,
        lambda rod: po.holding_pressure(rod, 3.0),
        lambda rod: po.length_given_pressure(rod, 0.9),
        lambda rod: po.trace(rod, law=po.trapezoidal(0.4)),
    ],
)
def test_rods_that_no_branch_is_followed_of(ratio: float, ask: Callable[[po.Rod], object]) -> None:
    with pytest.raises(po.OutOfRange, match="eta/y0"):
        ask(po.Rod.from_ratio(ratio))


def test_a_stiff_rod_under_a_law_without_a_transition() -> None:
    # No state of it has a pressure below 0.93 T0.
    branch = po.trace(po.Rod.from_ratio(0.1), law=po.trapezoidal(0.05), points=20)
    assert branch.ended == "contact"
    assert 0.9 < branch.pressure_ratio.min() < 0.94
    assert branch.pressure_ratio.max() > 0.999
    with pytest.raises(po.NotConverged, match="homotopy"):
        po.trace(po.Rod.from_ratio(0.01), law=po.trapezoidal(0.4), points=20)
