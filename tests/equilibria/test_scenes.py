"""Scenes: known states of each family, both ways round, and what is refused.

Modules: `scenes`, `scene_trace`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, ClassVar

import casadi
import numpy as np
import pytest

import peel_opt as po
from peel_opt.equilibria.scenes import scene_method, states_of_scene
from peel_opt.model.dimension import TRACTION
from peel_opt.model.loads import Force, Load

from ..rods import FLAP
from ..scene_states import REFERENCE, pressure_of, rods, scene_of, title

#: What was solved for, by the name of the reference, and the public name.
FREE = {"sbar": "length", "p": "pressure", "F": "force", "M": "moment"}

#: One state of each family; all of them are slow.
QUICK = (
    "lin c=-0.1 p0=.8",
    "cos2 p0=0.5",
    "exp l=5 sbar=1.2",
    "mu=0.2 P=.8",
    "w=0.05 P=.3",
    "P=.8 F=.05 phi=90",
    "moment sbar=1",
    "P=.8 front sf=2.5",
    "op zeta=1 P=0.3 r=1",
    "springback p=0 kw=-.5 minus branch",
    "P=.3 kw=kn=0.05",
    "all loads at once (flat)",
    "circle kw=-.1 kn=-.05 M=-.02 P=.7",
    "G0=0.005 P=.8",
    "tip contact flat kn=-.2 P=0",
)

ROD = po.Rod.from_ratio(1.0)


def _solved(state: dict[str, Any]) -> po.Equilibrium:
    name = state["free"][0]
    given = {} if name == "p" else {"pressure": pressure_of(state)}
    given |= {} if name == "sbar" else {"length": state["values"]["sbar"]}
    return po.solve(scene_of(state), free=FREE[name], near=state["values"][name], **given)


@pytest.mark.parametrize(
    "state",
    [pytest.param(s, marks=() if s["tag"] in QUICK else pytest.mark.slow, id=title(s)) for s in rods()],
)
def test_a_known_state_is_met_within_its_error(state: dict[str, Any]) -> None:
    eq, v = _solved(state), state["values"]
    digits = 10.0 ** (1 - state["digits"])
    assert eq.certified
    assert abs(eq.answer - v[state["free"][0]]) <= eq.error + digits
    near_a_fold = "limit point" in state.get("note", "")
    within = 1e-6 if near_a_fold else 300.0 * digits
    assert eq.tip_angle == pytest.approx(v["theta_tip"], abs=within)
    assert eq.tip_height == pytest.approx(v["y_tip"], abs=within)
    assert eq.x[0] == pytest.approx(v["x_tip"], abs=within)
    assert eq.y.max() == pytest.approx(v["ymax"], abs=1e-4)


def test_the_papers_scene_is_the_papers_rod() -> None:
    eq = po.solve(po.Scene(ROD), free="length", pressure=0.3)
    plain = po.length_given_pressure(ROD, 0.3)
    assert abs(eq.length - plain.length) <= eq.error + plain.error
    assert eq.state == plain.state
    assert eq.Ny[-1] == pytest.approx(plain.Ny[-1], abs=1e-9)


@pytest.mark.parametrize(("ratio", "pressure"), [(0.566, 0.6), (0.566, 0.25), (0.2, 0.9)])
def test_on_its_branch_too_the_papers_scene_has_the_states_of_its_rod(ratio: float, pressure: float) -> None:
    """Beyond the folded states a walk finds rods whose tip touches the plate; the rod knows them as such."""
    rod = po.Rod.from_ratio(ratio)
    walked = states_of_scene(po.Scene(rod), "pressure", pressure, 1e-8, scene_method("auto"))
    known = {round(eq.length, 6): eq for eq in po.equilibria(rod, pressure=pressure)}
    assert walked
    for eq in walked:
        own = known[round(eq.length, 6)]
        assert (eq.state, eq.flags) == (own.state, own.flags)
    if any(eq.state == "folded" for eq in walked):
        folded = po.solve(po.Scene(rod), free="length", pressure=pressure, state="folded")
        assert folded.length == pytest.approx(
            po.length_given_pressure(rod, pressure, state="folded").length, abs=1e-8
        )


def test_numbers_are_in_the_units_of_the_rod() -> None:
    """An aortic flap under its own friction: the same state in SI and over T0 and eta."""
    rod = FLAP
    T0, eta = rod.adhesion_strength, rod.eta
    tip = po.TipLoad(force=0.02 * T0 * eta, angle=1.0, moment=-0.01 * T0 * eta**2)
    loads = [po.SkinFriction(traction=0.03 * T0), po.Pressure(po.profiles.exponential(10.0 * eta))]
    scene = po.Scene(rod, loads, po.Circle(0.05 / eta), tip, natural_curvature=0.02 / eta)
    over = po.Scene(
        po.Rod.from_ratio(rod.ratio),
        [po.SkinFriction(traction=0.03), po.Pressure(po.profiles.exponential(10.0))],
        po.Circle(0.05),
        po.TipLoad(0.02, 1.0, -0.01),
        natural_curvature=0.02,
    )
    one = po.solve(scene, free="length", pressure=0.6 * T0)
    other = po.solve(over, free="length", pressure=0.6)
    assert one.length == pytest.approx(other.length * eta, rel=1e-9)
    assert one.numbers["force"] == pytest.approx(0.02 * T0 * eta)
    assert one.tip_angle == pytest.approx(other.tip_angle, abs=1e-9)


@pytest.mark.slow
def test_each_number_of_a_scene_may_be_the_free_one() -> None:
    """Solve for the length, then for every other number at that length: each comes back."""
    loads = [po.Pressure(po.profiles.linear(-0.1)), po.Weight(0.02), po.SkinFriction(traction=-0.05)]
    scene = po.Scene(ROD, loads, tip=po.TipLoad(0.02, 1.0, -0.01), natural_curvature=0.02)
    eq = po.solve(scene, free="length", pressure=0.7)
    for name in ("pressure", "weight", "friction", "gradient", "force", "moment", "natural_curvature"):
        value = 0.7 if name == "pressure" else scene.numbers[name]
        given = {"length": eq.length} | ({} if name == "pressure" else {"pressure": 0.7})
        back = po.solve(scene, free=name, near=value, **given)
        assert back.answer == pytest.approx(value, abs=1e-8), name


def test_weight_is_a_stronger_bond_of_the_same_slope_while_the_rod_stays_within_it() -> None:
    """T0 -> T0 + w, y0 -> y0 (1 + w/T0), same k and p: exact under the linear law."""
    eq = po.solve(po.Scene(ROD, [po.Weight(0.2)]), free="length", pressure=0.8)
    mapped = po.length_given_pressure(po.Rod(1.0, 1.2, 1.2), 0.8)
    assert eq.length == pytest.approx(mapped.length, abs=1e-12)


def test_natural_curvature_is_a_moment_on_a_flat_wall() -> None:
    curved = po.solve(po.Scene(ROD, natural_curvature=-0.05), free="length", pressure=0.8)
    turned = po.solve(po.Scene(ROD, tip=po.TipLoad(moment=0.05)), free="length", pressure=0.8)
    assert curved.length == pytest.approx(turned.length, abs=1e-12)


def test_a_long_strip_peels_at_the_kendall_force() -> None:
    """F -> G / (1 - cos phi), here G = T0 y0 / 2 at 90 degrees."""
    scene = po.Scene(ROD, tip=po.TipLoad(angle=0.5 * math.pi))
    long = po.solve(scene, free="force", length=14.0)
    assert long.numbers["force"] == pytest.approx(0.5, abs=1e-6)
    assert long.state == "other"
    assert po.solve(scene, free="force", length=1.0).state == "lifted"  # before the peak of the force


def test_the_lifted_state_is_the_default_where_there_is_one() -> None:
    scene = po.Scene(ROD, natural_curvature=0.05)
    lifted = po.solve(scene, free="length", pressure=0.8)
    assert lifted.state == "lifted"
    assert lifted.length == pytest.approx(0.711864, abs=1e-6)
    assert po.solve(scene, free="length", pressure=0.8, state="unfolded").length > 2.0


@pytest.mark.parametrize("case", REFERENCE["no_solution"][::2], ids=lambda c: c["reason"])
def test_where_no_state_exists_none_is_returned(case: dict[str, Any]) -> None:
    p = case["params"]
    scene = po.Scene(ROD, wall=po.Circle(p["kw"]), natural_curvature=p["kn"])
    with pytest.raises((po.NoEquilibrium, po.NotConverged)):
        po.solve(scene, free="length", pressure=p["p"])
    nothing = po.solve(scene, free="length", pressure=p["p"], throw=False)
    assert not nothing.certified
    assert math.isnan(nothing.length)


def test_a_load_of_the_readers_own() -> None:
    """A pressure that decays over the plate, not over the rod: a function of the place."""
    import casadi as ca

    profile = po.Pressure(lambda place: ca.exp(place.x / 5.0))
    eq = po.solve(po.Scene(ROD, [profile]), free="length", pressure=0.8, near=3.0)
    assert eq.certified
    assert eq.certificate < 1e-12


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: po.solve(po.Scene(ROD), free="force", length=3.0), "no number of this scene"),
        (lambda: po.solve(po.Scene(ROD), free="length", pressure=0.5, length=3.0), "cannot be given"),
        (lambda: po.solve(po.Scene(ROD), free="pressure"), "must be given"),
        (lambda: po.solve(ROD, free="pressure", length=3.0), "must be a Scene"),
    ],
)
def test_what_cannot_be_asked_of_a_scene_is_refused_by_name(make: Any, words: str) -> None:
    with pytest.raises(po.InvalidInput, match=words):
        make()


def test_a_reading_that_does_not_cover_scenes_says_so() -> None:
    eq = po.solve(po.Scene(ROD, [po.Weight(0.02)]), free="length", pressure=0.8)
    with pytest.raises(po.InvalidInput, match="paper's scene"):
        po.Walk(eq, hold="ratio")


def test_what_is_read_along_a_branch_of_a_rod_says_what_a_scene_has_instead() -> None:
    branch = po.trace(po.Scene(ROD, [po.Weight(0.02)]), points=8)
    with pytest.raises(po.InvalidInput, match=r"state by state, as energies\(branch\[i\]\)"):
        po.energies(branch)
    with pytest.raises(po.InvalidInput, match=r"with_stability\(\) of the branch"):
        po.stability_changes(branch)


@pytest.mark.slow
def test_the_branch_of_a_scene_has_its_folds() -> None:
    """The least pressure under a weight of 0.02 T0, by shooting; the loading of an edge has its snap."""
    heavy = po.trace(po.Scene(ROD, [po.Weight(0.02)]), points=48)
    (least,) = heavy.special("LP-pressure")
    assert least.pressure_ratio == pytest.approx(0.151810745283, abs=1e-11)
    assert least.length_ratio == pytest.approx(5.0057689, abs=1e-6)
    assert heavy.certificate.max() < 1e-9
    assert heavy[len(heavy) // 3].certified
    assert heavy.pressure_ratio[0] == pytest.approx(1.02, abs=1e-4)  # T, where p = T0 + w
    snap = po.trace(po.Scene(ROD, unbonded=1.0), points=48).special("LP-pressure")[0]
    assert snap.pressure_ratio == pytest.approx(0.3535512998, abs=1e-9)
    with pytest.raises(po.InvalidInput, match="points= and tol="):
        po.trace(po.Scene(ROD, unbonded=1.0), law="linear")


def test_rounding_beside_a_rest_makes_no_state_folded() -> None:
    """Here p falls from T0/(1 - 0.1/3) at rest on, so that its first extremum is the least pressure."""
    loads = [po.Pressure(po.profiles.linear(-0.1), dead=0.3), po.SkinFriction(share=0.1)]
    assert po.solve(po.Scene(ROD, loads), free="length", pressure=0.75).state == "middle"
    loads = [po.Weight(0.05), po.SkinFriction(share=0.1), po.Pressure(po.profiles.exponential(9.0))]
    assert po.solve(po.Scene(ROD, loads), free="length", pressure=0.8).state == "middle"


def test_the_front_may_stand_on_what_was_never_glued() -> None:
    """A high pressure closes a folded rod onto its loose edge: its identity has no work of separation."""
    scene = po.Scene(ROD, [po.SkinFriction(traction=0.1)], unbonded=0.6)
    eq = po.solve(scene, free="pressure", length=0.55, state="folded", near=670.0, tol=1e-6)
    assert eq.length < scene.unbonded
    assert eq.certified
    assert po.energies(eq).separation == 0.0


def test_beside_a_transition_a_scene_denies_nothing() -> None:
    scene = po.Scene(ROD, [po.Weight(0.05)])
    assert po.solve(scene, free="length", pressure=1.0499).state == "middle"
    with pytest.raises(po.NotConverged, match="transition"):
        po.solve(scene, free="length", pressure=1.049999)
    with pytest.raises(po.NoEquilibrium, match="folded"):  # which is never the default
        po.solve(scene, free="length", pressure=1.06)


@pytest.mark.parametrize("call", [po.readhesion_pressure, po.held_length])
def test_a_call_that_takes_a_rod_says_that_it_does_not_take_a_scene(call: Any) -> None:
    scene = po.Scene(ROD, [po.Weight(0.02)])
    with pytest.raises(po.InvalidInput, match="paper's scene"):
        call(scene, 0.5) if call is po.held_length else call(scene)


def test_a_study_of_the_paper_alone_refuses_a_scene_by_name() -> None:
    scene = po.Scene(FLAP, [po.Weight(50.0)])
    target = po.Target("maxwell_length", equal="2 mm")
    with pytest.raises(po.InvalidInput, match="paper's scene only"):
        po.design(scene, free="bending_stiffness", targets=target)


def test_a_state_of_a_scene_travels_with_its_numbers(tmp_path: Any) -> None:
    import pickle

    eq = po.solve(po.Scene(ROD, [po.Weight(0.02)]), free="length", pressure=0.8)
    copy = pickle.loads(pickle.dumps(eq))
    assert copy.numbers == eq.numbers
    assert np.array_equal(copy.theta, eq.theta)
    eq.save(tmp_path / "state.npz")
    read = po.Equilibrium.load(tmp_path / "state.npz")
    assert read.numbers == eq.numbers
    assert read.length == eq.length
    with pytest.raises(po.InvalidInput, match="Compute it again"):
        po.stability(read)


@pytest.mark.parametrize(
    "scene",
    [
        po.Scene(ROD, unbonded=1e-6),
        po.Scene(ROD, unbonded=1e-3),
        po.Scene(ROD, tip=po.TipLoad(moment=-1e-8)),
        po.Scene(ROD, natural_curvature=1e-8),
    ],
    ids=["edge", "longer edge", "moment", "curvature"],
)
def test_a_lifted_state_too_small_to_follow_is_not_replaced_by_one_beyond_the_snap(scene: po.Scene) -> None:
    with pytest.raises(po.NotConverged, match="smaller than those"):
        po.solve(scene, free="length", pressure=0.3)
    with pytest.raises(po.NotConverged, match="smaller than those"):
        po.solve(scene, free="length", pressure=0.3, state="lifted")
    assert po.solve(scene, free="length", pressure=0.3, state="unfolded").length > 3.0


@pytest.mark.slow
def test_with_another_number_free_no_state_is_preferred() -> None:
    scene = po.Scene(ROD, wall=po.Circle(0.1), tip=po.Contact())
    with pytest.raises(po.AmbiguousState, match="2 states fit"):
        po.solve(scene, free="curvature", pressure=0.3, length=0.757)
    near = po.solve(scene, free="curvature", pressure=0.3, length=0.757, near=0.15)
    assert near.numbers["curvature"] == pytest.approx(0.10033, abs=1e-5)


@pytest.mark.parametrize("profile", [lambda p: 1.0 if p.s < 1 else 0.5, lambda _: "a", lambda _: 1 / 0])
def test_a_profile_that_casadi_cannot_take_is_refused_at_once(profile: Any) -> None:
    with pytest.raises(po.InvalidInput, match="profile"):
        po.Pressure(profile)


def test_the_picture_of_a_scene_has_its_wall_and_names_what_acts() -> None:
    rod = po.Rod(2.3e-5, 140e3, 0.73e-3)
    on_a_cylinder = po.Scene(rod, wall=po.Circle(-300.0), natural_curvature=-300.0)
    ax = po.solve(on_a_cylinder, free="length", pressure=60e3).plot()
    lowest = min(np.min(line.get_ydata()) for line in ax.lines if len(line.get_ydata()))
    assert lowest < -0.1  # the wall falls off; the rod does not pass through it
    peeled = po.solve(po.Scene(rod, tip=po.TipLoad(angle=1.57)), free="force", length=12e-3)
    assert "force" in peeled.plot().get_title(loc="left")


@dataclass(frozen=True)
class Ballast(Load):
    """A weight of a reader's own, which takes its size from itself and not by name."""

    w: float
    keeps_flat = True

    def numbers(self) -> dict[str, float]:
        return {}

    def force(self, at: po.Place, q: Any) -> Force:
        return Force(y=-self.w)

    def work(self, at: po.Place, q: Any) -> Any:
        return self.w * casadi.sin(at.theta)


def test_two_loads_of_a_class_of_the_readers_own_are_two_loads() -> None:
    """What the first has of its own must not stay compiled in for the second."""
    for w in (0.05, 0.1):
        own = po.solve(po.Scene(ROD, [Ballast(w)]), free="length", pressure=0.8)
        assert own.length == pytest.approx(
            po.solve(po.Scene(ROD, [po.Weight(w)]), free="length", pressure=0.8).length, abs=1e-12
        )


def test_names_and_parts_of_the_readers_own_are_checked() -> None:
    class Clash(Ballast):
        parameters: ClassVar[dict[str, Any]] = {"weight": TRACTION}

    with pytest.raises(po.InvalidInput, match="weight is used for two numbers"):
        po.Scene(ROD, [Clash(0.1), po.Weight(0.1)])

    class Changing(Ballast):
        __hash__ = None  # type: ignore[assignment]

    with pytest.raises(po.InvalidInput, match="frozen dataclass"):
        po.Scene(ROD, [Changing(0.1)])


def test_an_answer_far_from_what_was_sought_says_so() -> None:
    scene = po.Scene(ROD, unbonded=1e-3)
    assert "far from near=0.0022" in po.solve(scene, free="length", pressure=0.3, near=0.0022).flags
    assert po.solve(scene, free="length", pressure=0.3, near=3.4).flags == ()


def test_a_free_number_stays_where_it_means_something() -> None:
    scene = po.Scene(ROD, [po.Pressure(dead=0.5)])
    with pytest.raises((po.NoEquilibrium, po.NotConverged)):
        po.solve(scene, free="dead", pressure=0.5, length=3.3, near=1.4)


def test_a_pull_back_along_the_plate_is_a_push_in_line() -> None:
    """The sine of pi is 1e-16 in floats, and no lift."""
    rod = po.Rod.from_ratio(0.566)
    back = po.Scene(rod, tip=po.TipLoad(force=0.1, angle=math.pi))
    push = po.Scene(rod, tip=po.TipLoad(force=-0.1))
    found, known = (po.solve(scene, free="length", pressure=0.5) for scene in (back, push))
    assert found.state == known.state == "lower"
    assert found.length == pytest.approx(known.length, rel=1e-12)
    assert po.critical_length(back).length == pytest.approx(po.critical_length(push).length, rel=1e-9)


@pytest.mark.parametrize(
    ("scene", "pressure", "nearest"),
    [
        (po.Scene(ROD, wall=po.Circle(-0.2)), 0.8, 1.004 - math.sqrt(1.004**2 - 0.96)),
        (po.Scene(ROD, natural_curvature=1.1), 0.0, 0.0),  # k kappa^2/2 > T0 y0/2: it springs off
        (po.Scene(ROD, tip=po.TipLoad(moment=-0.1)), 0.95, 0.9),
        (po.Scene(ROD, [po.Weight(0.1)], line_energy=0.1), 0.05, 0.1),
        (po.Scene(ROD, wall=po.Circle(0.3), law="none", line_energy=0.5), 0.1, 0.6 * 0.455),
    ],
    ids=["cylinder", "spring-back", "moment", "held down", "in a vessel"],
)
def test_where_the_identity_leaves_the_tip_no_gap_there_is_no_state(
    scene: po.Scene, pressure: float, nearest: float
) -> None:
    """(T0 - p)^2 < 2 E (T0/y0 - kw p), and what it is with a line energy: known before any solve."""
    with pytest.raises(po.NoEquilibrium, match="every gap of the tip") as denied:
        po.solve(scene, free="length", pressure=pressure)
    assert denied.value.nearest == pytest.approx(nearest, abs=1e-9)
    assert po.equilibria(scene, pressure=pressure) == []


def test_a_pressure_that_depends_on_the_inclination_alone_has_a_transition() -> None:
    """A flat rod feels (1 - c) p0 everywhere: T is where that is T0, at the length of the plain rod."""
    mixed = po.Scene(ROD, [po.Pressure(po.profiles.mixed(0.3))])
    begins = po.critical_length(mixed)
    assert begins.pressure == pytest.approx(1.0 / 0.7, abs=1e-12)
    assert begins.length == pytest.approx(math.pi, abs=1e-12)
    assert not po.Scene(ROD, [po.Pressure(po.profiles.stream())]).keeps_flat
    tilting = po.Pressure(lambda place: 1.0 + 0.2 * casadi.sin(place.theta))
    assert po.Scene(ROD, [tilting]).keeps_flat
    assert not po.Scene(ROD, [po.Pressure(lambda place: 1.0 + 0.2 * place.x)]).keeps_flat


@pytest.mark.slow
def test_a_flap_in_its_vessel_is_traced_up_to_where_its_tip_comes_back() -> None:
    """There rods whose tip touches cross the branch, and no finer mesh goes on."""
    flap = po.trace(
        po.Scene(po.Rod.from_ratio(0.75), wall=po.Circle(0.05), natural_curvature=0.05), points=32
    )
    assert flap.ended == "contact"
    assert flap.pressure_ratio[-1] == pytest.approx(1.0, abs=1e-3)
    assert flap.error.max() < 2e-9


@pytest.mark.slow
def test_a_rod_that_its_tip_load_tears_off_is_said_to_be() -> None:
    """0.9 T0 eta is more than the peak of a peel at 90 degrees: without suction nothing holds it."""
    torn = po.Scene(ROD, tip=po.TipLoad(force=0.9, angle=0.5 * math.pi))
    with pytest.raises(po.NoEquilibrium, match="need suction: what is done to the tip tears the rod off"):
        po.solve(torn, free="length", pressure=0.0)
    sucked = po.solve(torn, free="pressure", length=1.0)
    assert sucked.pressure < 0.0
    assert "p < 0" in sucked.flags
    back = po.solve(torn, free="length", pressure=sucked.pressure)
    assert back.length == pytest.approx(1.0, abs=1e-9)
