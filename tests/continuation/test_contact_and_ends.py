"""Where branches begin and end: at T, at the contact, at a window; and what a walk does there.

Modules: `primary`, `ends`, `special`, `landing`, `family`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path

import numpy as np
import pytest

import peel_opt as po
from peel_opt.continuation.family import Family
from peel_opt.continuation.primary import PrimaryBranch
from peel_opt.model.bond import COHESIVE, LINEAR
from peel_opt.model.named_laws import exponential, trapezoidal
from peel_opt.residual.closures import Closure, Plane
from peel_opt.residual.discretisation import Transcription
from peel_opt.residual.linear import Linearised
from peel_opt.residual.spectral import Spectral

from .. import oracle

#: A rod whose walk used to stray where the tip comes down.
STRAYED = 188.53652066850867


# --- the contact --------------------------------------------------------------------------------


@pytest.mark.parametrize("ratio", [0.05, 1.0, 30.0])
def test_the_contact_is_an_ordinary_point(ratio: float) -> None:
    branch = PrimaryBranch(Family(COHESIVE, Spectral(16), Closure("ratio", ratio)))
    branch.extend(lambda _: False)
    assert branch.ended == "contact"
    conditions = []
    for point in (branch.points[-1], branch.points[-6]):
        at = Linearised.at(point.problem, point.x, Closure("ratio", ratio), Plane.facing(point.direction))
        full = np.vstack([at.jacobian, np.pad(at.border, ((0, 0), (point.problem.tail.start, 0)))])
        full = full / np.abs(full).max(axis=1, keepdims=True)
        conditions.append(np.linalg.cond(full / np.abs(full).max(axis=0)))
        assert np.linalg.slogdet(full)[0] == at.sign()
        assert at.sign() == point.orientation or point.orientation == 0
    assert conditions[0] < 10.0 * conditions[1] < 1e5


@pytest.mark.parametrize(("ratio", "P"), [(100.0, 0.95), (STRAYED, 0.95), (500.0, 0.9), (2000.0, 0.9)])
def test_folded_states_of_slender_rods_near_the_contact(ratio: float, P: float) -> None:
    eq = po.length_given_pressure(po.Rod.from_ratio(ratio), P, state="folded", tol=1e-11)
    assert eq.certified
    numbers = (eq.tip_angle + 1e-7, float(eq.y[0]), P, eq.length_ratio * (1.0 + 1e-8), ratio)
    found = oracle.solve(oracle.COHESIVE, numbers, oracle.GIVEN_PRESSURE)
    assert abs(found.numbers[oracle.LENGTH] - eq.length_ratio) < 1e-11


@pytest.mark.parametrize("ratio", [0.3, 1.0, 20.0])
def test_folded_states_lead_smoothly_up_to_the_contact(ratio: float) -> None:
    rod = po.Rod.from_ratio(ratio)
    gaps = np.array([1e-3, 5e-4, 1e-5, 1e-9])
    states = [po.length_given_pressure(rod, 1.0 - gap, state="folded") for gap in gaps]
    assert all(eq.certified for eq in states)
    sigma = np.array([eq.length_ratio for eq in states])
    contact = 2.0 * sigma[1] - sigma[0]  # sigma is a smooth function of P there
    assert np.abs(sigma[2:] - contact).max() < 5e-2 * abs(sigma[0] - sigma[1])


def test_the_walk_of_a_slender_rod_does_not_stray_at_the_contact() -> None:
    rod = po.Rod.from_ratio(STRAYED)
    assert po.length_given_pressure(rod, 0.3, state="folded").valid
    states = po.equilibria(rod, length=1.0)
    assert [eq.state for eq in states if eq.valid] == ["lower"]
    assert all(eq.state == "spurious" for eq in states if "y < 0" in eq.flags)


@pytest.mark.parametrize("ratio", [1502.0, 2249.0])
def test_slender_rods_are_traced_at_the_default_tolerance(ratio: float) -> None:
    branch = po.trace(po.Rod.from_ratio(ratio), points=30)
    assert branch.ended == "contact"
    assert branch.certificate.max() < 1e-10
    least = branch.special("LP-pressure")[0].pressure_ratio
    assert least * (4.0 * ratio) ** 1.5 == pytest.approx(1.0, abs=2e-3)


# --- the certificate ----------------------------------------------------------------------------


def test_the_certificate_is_the_equation_left_out() -> None:
    coarse = po.length_given_pressure(po.Rod.from_ratio(1.0), 0.8, method=Spectral(5), tol=1.0, throw=False)
    # p y_tip = Phi(y_tip) is among the equations; the angle at the plate is not.
    assert abs(coarse.y[0] - 2.0 * (1.0 - 0.8)) < 1e-13
    assert coarse.certificate == pytest.approx(abs(coarse.theta[-1]), rel=1e-9)
    assert 1e-12 < coarse.certificate < 1e-2
    finer = po.length_given_pressure(po.Rod.from_ratio(1.0), 0.8, method=Spectral(10), tol=1.0)
    assert finer.certificate < 1e-3 * coarse.certificate


@pytest.mark.parametrize("mode", [2, 4])
def test_a_tip_held_to_the_plate_keeps_the_angle(mode: int) -> None:
    lam = (mode**4 - 1) * math.pi**4
    branch = po.trace(beta0=4, lam=(lam - 20, lam + 20), mode=mode, points=12)
    assert np.abs(branch.tip_u).max() < 1e-9
    assert np.ptp(branch.pressure_ratio) > 0.1  # at any pressure
    assert max(abs(branch[i].theta[-1]) for i in (1, 5)) < 1e-12


# --- laws ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "law",
    [exponential(), po.CohesiveLaw(lambda u: 1.0 / (1.0 + u), drop=lambda u: u / (1.0 + u))],
    ids=["exp", "1/(1+u)"],
)
def test_a_smooth_law_begins_at_t_itself(law: po.CohesiveLaw) -> None:
    branch = po.trace(po.Rod.from_ratio(1.0), law=law, points=12, tol=1e-8)
    assert (branch.A[0], branch.pressure_ratio[0]) == (0.0, 1.0)
    assert branch.length_ratio[0] == pytest.approx(math.pi, abs=1e-9)
    assert branch.special_points[0].kind == "BP"


@pytest.mark.parametrize(
    ("ratio", "P"), [(100.0, 0.9998), (100.0, 0.9985), (10.0, 0.9999), (1.0, 1.0 - 1e-9)]
)
def test_there_are_unfolded_states_up_to_t_under_a_smooth_law(ratio: float, P: float) -> None:
    eq = po.length_given_pressure(po.Rod.from_ratio(ratio), P, law=exponential())
    assert eq.certified
    assert eq.state == "middle"
    if P == 0.9998:
        assert eq.length_ratio == pytest.approx(0.993503861, abs=5e-10)
    critical = math.pi * ratio**-0.25
    assert abs(eq.length_ratio / critical - 1.0) < 1.0 - P + 1e-3 * (ratio > 1.0)


@pytest.mark.parametrize("P", [0.9996, 0.99999, 1.0 - 1e-8])
def test_a_law_without_a_slope_is_followed_towards_t0_as_far_as_asked(P: float) -> None:
    law = trapezoidal(0.4)
    eq = po.length_given_pressure(po.Rod.from_ratio(1.0), P, law=law)
    assert eq.certified
    assert eq.y[0] == pytest.approx(law.tip_height(P), rel=1e-9)
    again = po.pressure_given_length(po.Rod.from_ratio(1.0), eq.length_ratio, law=law)
    assert again.pressure_ratio == pytest.approx(P, abs=1e-12)


# --- following ----------------------------------------------------------------------------------


def test_a_followed_rod_ends_at_the_contact_with_the_labels_of_its_branch() -> None:
    rod = po.Rod.from_ratio(1.0)
    traced = po.trace(rod, points=20)
    branch = po.follow(po.length_given_pressure(rod, 0.8), hold="ratio")
    assert branch.ended == "contact"
    assert list(dict.fromkeys(branch.state.tolist())) == ["middle", "lower", "folded"]
    ours, theirs = (b.special("contact")[0] for b in (branch, traced))
    assert ours.length_ratio == pytest.approx(theirs.length_ratio, abs=1e-8)
    assert abs(branch.tip_u[-1]) < 1e-9
    with pytest.raises(po.NoEquilibrium, match="the branch ended at the contact"):
        po.follow(branch, hold="ratio")
    with pytest.raises(po.NoEquilibrium, match="the branch ended at the contact"):
        po.follow(traced[-3:], hold="ratio")


def test_a_followed_rod_passes_t_and_says_where() -> None:
    start = po.length_given_pressure(po.Rod.from_ratio(1.0), 0.8)
    branch = po.follow(start, hold="ratio", steps=15, direction=-1)
    (point,) = branch.special("BP")
    assert point.length_ratio == pytest.approx(math.pi, abs=1e-9)
    assert point.pressure_ratio == pytest.approx(1.0, abs=1e-9)
    assert list(dict.fromkeys(branch.state.tolist())) == ["middle", "spurious"]


# --- windows and asked-for values ---------------------------------------------------------------


@pytest.mark.parametrize("window", [(1.0, 3.0), (-0.26, -0.1), (-1.0, 0.0), (-0.269, 3.0), (0.0, 2.0)])
def test_no_point_lies_outside_the_window(window: tuple[float, float]) -> None:
    branch = po.trace(beta0=4, lam=window, points=40)
    assert window[0] <= branch.lam.min()
    assert branch.lam.max() <= window[1]
    fold = -0.26900108827
    for piece in branch.pieces:
        for end in branch.lam[piece][[0, -1]]:
            assert end in window or abs(end - fold) < 1e-9
    assert len(branch.pieces) == (1 if window == (-1.0, 0.0) else 2)
    assert np.all(np.diff(branch.arclength) > 0.0)


def test_a_picture_and_a_potential_know_of_the_gap() -> None:
    branch = po.trace(beta0=4, lam=(1.0, 3.0), points=20)
    ax = branch.plot()
    for line in ax.get_lines():
        steps = np.abs(np.diff(np.asarray(line.get_ydata(), dtype=float)))
        assert not len(steps) or steps.max() < 1.0  # the gap is 6 wide
    with pytest.raises(po.InvalidInput, match="gap"):
        po.branch_potential(branch)


def test_values_that_are_not_met_are_named() -> None:
    with pytest.raises(po.NoEquilibrium, match=r"pressure_ratio = 1\.5"):
        po.trace(po.Rod.from_ratio(1.0), points=12, at={"pressure_ratio": [0.5, 1.5]})
    start = po.length_given_pressure(po.Rod.from_ratio(1.0), 0.8)
    with pytest.raises(po.NotConverged, match=r"length_ratio = 99, .*not met .* as far as it was walked"):
        po.follow(start, hold="ratio", steps=4, at={"length_ratio": [99.0]})


def test_each_value_is_landed_on_once() -> None:
    branch = po.trace(po.Rod.from_ratio(1.0), points=12, at={"pressure_ratio": [0.5, 0.5]})
    at_half = np.flatnonzero(np.abs(branch.pressure_ratio - 0.5) < 1e-9)
    assert len(at_half) == 2  # on the way down, and folded
    assert np.abs(branch.pressure_ratio[at_half] - 0.5).max() < 1e-15
    assert {p.index for p in branch.special("y=y0")} >= set(at_half.tolist())


# --- what a branch carries ----------------------------------------------------------------------


@dataclass(frozen=True)
class Mine(Spectral):
    """A transcription of a reader's own."""


def test_points_of_a_transcription_of_ones_own_can_be_read(tmp_path: Path) -> None:
    mine: Transcription = Mine(nodes=20)
    branch = po.trace(beta0=4, lam=(-1, 3), points=12, transcription=mine, tol=1e-7)
    i = int(np.argmax(branch.lam == branch.lam.max()))
    assert branch[i].alpha1 == branch.alpha1[i]
    assert branch[2:][0].alpha1 == branch.alpha1[2]
    loaded = po.Branch.load(branch.save(tmp_path / "mine.npz"))
    with pytest.raises(po.InvalidInput, match="none of the package's"):
        loaded[0]


def test_the_index_is_that_of_stability_and_flutter_stands_beside_it() -> None:
    branch = po.trace(po.Rod.from_ratio(0.5), points=12, tol=1e-8).with_stability()
    for i in range(1, len(branch) - 1, 5):
        found = po.stability(branch, i)
        assert (branch.index[i], branch.flutter[i]) == (found.index, found.flutter)
    assert branch.flutter.max() > 0
    assert np.array_equal(branch.unstable, (branch.index > 0) | (branch.flutter > 0))


@pytest.mark.parametrize(("ratio", "nodes"), [(1.0, 8), (0.1, 8), (10.0, 12)])
def test_special_points_are_no_further_off_than_they_say(ratio: float, nodes: int) -> None:
    coarse, fine = (
        po.trace(po.Rod.from_ratio(ratio), points=12, transcription=Spectral(n), tol=1e-2)
        for n in (nodes, 40)
    )

    def places(branch: po.Branch) -> list[tuple[po.SpecialPoint, np.ndarray]]:
        beta0 = np.array([p.beta0 for p in branch.special_points])
        A = branch.A[[p.index for p in branch.special_points]]
        lam = np.array([p.lam for p in branch.special_points]) / math.pi**4
        extra = np.array([p.alpha1 for p in branch.special_points]) / (1.0 + beta0)
        columns = (A, extra, np.arcsinh(lam), np.arcsinh(np.cbrt(beta0)))
        return list(zip(branch.special_points, np.stack(columns, axis=-1), strict=True))

    assert [p.kind for p in coarse.special_points] == [p.kind for p in fine.special_points]
    for (special, place), (_, exact) in zip(places(coarse), places(fine), strict=True):
        if special.status == "bracketed":
            continue  # the highest place grazes y0, and the coarse mesh does not tell where
        true = float(np.linalg.norm(place - exact))
        assert true <= special.error + 2e-11
        assert special.error <= 1e3 * true + 1e-7


def test_branches_saved_by_the_first_version_are_read(tmp_path: Path) -> None:
    branch = po.trace(po.Rod.from_ratio(0.5), points=12, tol=1e-8).with_stability()
    from peel_opt.equilibria.branch_files import _stability

    before = {"index": branch.index + 2 * branch.flutter}
    assert _stability(before, len(branch), 1) == {"index": None, "flutter": None}
    few = {"index": np.array([1, 0, 1])}
    assert _stability(few, 3, 1)["flutter"].tolist() == [0, 0, 0]
    again = po.Branch.load(branch.save(tmp_path / "now.npz"))
    assert np.array_equal(again.flutter, branch.flutter)
    assert [replace(p, error=0.0) for p in again.special_points] == [
        replace(p, error=0.0) for p in branch.special_points
    ]


def test_a_walk_starts_from_a_tip_that_is_held() -> None:
    lam = 15.0 * math.pi**4
    branch = po.trace(beta0=4, lam=(lam - 10, lam + 10), mode=2, points=12)
    walk = po.Walk(branch[3], hold="beta0", law=LINEAR)
    assert len(list(islice(walk, 3))) == 3


@pytest.mark.parametrize("ratio", [0.3, 1.0, 20.0, 101.04308759923538, 126.6664368738798, 134.68880193926915])
def test_beside_the_least_pressure_each_state_is_on_its_side_of_it(ratio: float) -> None:
    rod = po.Rod.from_ratio(ratio)
    limit = po.readhesion_pressure(rod)
    for above in (1e-8, 1e-6, 1e-5, 1e-4):
        P = limit.pressure_ratio + above * min(limit.pressure_ratio, 1.0 - limit.pressure_ratio)
        turned = [
            -po.length_given_pressure(rod, P, state=state, method=method, tol=1e-6).tip_angle
            for state in ("unfolded", "folded")
            for method in ("auto", po.Spectral(36))
        ]
        assert max(turned[:2]) < min(turned[2:])
        assert turned[0] == pytest.approx(turned[1], abs=1e-6)
        assert turned[2] == pytest.approx(turned[3], abs=1e-6)
