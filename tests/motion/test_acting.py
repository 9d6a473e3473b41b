import casadi as ca
import numpy as np
import pytest

import peel_opt as po
from peel_opt.motion.acting import PRESSURE_ALONE, loads_on

ROD = po.Rod.from_ratio(1.0)
SCENE = po.Scene(
    ROD,
    loads=[
        po.Pressure(
            profile=lambda place: 1.0 + 0.1 * place.x * place.s - 0.2 * place.xi, dead=0.2, until=2.0
        ),
        po.Weight(0.1, 0.3),
        po.SkinFriction(share=0.1),
        po.Drag(0.05),
    ],
    unbonded=0.5,
    natural_curvature=0.1,
    tip=po.TipLoad(force=0.1, angle=1.0, moment=-0.2),
)


def _places() -> list[np.ndarray]:
    theta = np.linspace(-3.0, 0.0, 6).reshape(2, 3)
    return [theta, theta + 3.5, theta**2, theta + 3.1, np.full_like(theta, 3.2)]


@pytest.mark.parametrize("loads", [PRESSURE_ALONE, loads_on(SCENE)])
def test_derivatives_are_those_of_the_forces(loads):
    found = loads.at(0.7, *_places())
    for i in range(5):
        beside = []
        for h in (1e-6, -1e-6):
            moved = _places()
            moved[i] = moved[i] + h
            beside.append(loads.at(0.7, *moved).force)
        wanted = (beside[0] - beside[1]) / 2e-6
        if i and found.by_place is None:
            assert not wanted.any()
        else:
            np.testing.assert_allclose(found.by_theta if i == 0 else found.by_place[i - 1], wanted, atol=1e-9)


def test_loads_are_summed_as_the_scene_sums_them():
    theta, x, y, s, sbar = _places()
    found = loads_on(SCENE).at(0.7, theta, x, y, s, sbar).force
    p = 0.7 * (1.0 + 0.1 * (x - sbar) * s - 0.2 * s / sbar)
    along = 0.1 * 0.7  # friction by the pressure, without its profile
    wanted_x = -0.8 * p * np.sin(theta) + along * np.cos(theta) + 0.1 * np.sin(0.3) + 0.05
    wanted_y = 0.8 * p * np.cos(theta) + 0.2 * p + along * np.sin(theta) - 0.1 * np.cos(0.3)
    np.testing.assert_allclose(found, [wanted_x, wanted_y], rtol=1e-13)


def test_what_lies_past_the_end_of_the_fluid_feels_no_pressure():
    loads = loads_on(SCENE)
    assert loads.breaks == (("unbonded", 0.5), ("until", 2.0))
    assert loads.at(0.7, *_places(), frozenset({"unbonded", "until"})).force[1, 0, 0] == pytest.approx(
        0.07 * np.sin(-3.0) - 0.1 * np.cos(0.3)
    )
    assert loads.lift(0.7, 3.0) == pytest.approx(-0.1 * np.cos(0.3))


def test_a_natural_curvature_and_a_moment_bend_the_tip_alike():
    loads = loads_on(SCENE)
    assert loads.tip_curvature == pytest.approx(0.3)
    assert loads.tip_force == pytest.approx((-0.1 * np.cos(1.0), 0.1 * np.sin(1.0)))


@pytest.mark.parametrize(
    ("part", "named"),
    [
        ({"wall": po.Circle(0.1), "loads": [po.Weight(0.1)]}, "curved wall"),
        ({"line_energy": 0.1}, "line energy"),
        ({"line_energy": 0.1, "stretch": 10.0}, "stretches"),
        ({"law": po.ShearSprings(1.0)}, "sliding"),
        ({"tip": po.Blister(ROD, slack=0.1).tip}, "middle of a strip"),
    ],
)
def test_scenes_whose_motion_is_not_computed_are_refused(part, named):
    with pytest.raises(po.InvalidInput, match=named):
        loads_on(po.Scene(ROD, **part))


def test_the_paper_s_scene_is_the_rod():
    assert loads_on(po.Scene(ROD)) is loads_on(ROD) is PRESSURE_ALONE


def test_loads_say_what_they_feel_and_where_they_change():
    assert loads_on(SCENE).feels == {"x", "s", "sbar"}
    assert loads_on(SCENE).ends == (("until", 2.0),)
    edge = loads_on(po.Scene(ROD, loads=[po.Weight(0.1)], unbonded=1.0))
    assert (edge.feels, edge.ends) == (frozenset(), ())
    assert edge.at(0.7, *_places()).by_place is None
    switched = po.Pressure(lambda at: ca.if_else(at.y > 1.0, ca.fmax(at.theta, -2.0), 3.0 * at.y))
    found = loads_on(po.Scene(ROD, [switched])).at(1.0, *_places()).force
    theta, _, y, _, _ = _places()
    wanted = np.where(y > 1.0, np.maximum(theta, -2.0), 3.0 * y)
    np.testing.assert_allclose(found, wanted * [-np.sin(theta), np.cos(theta)], atol=1e-14)
