"""The equations of every scene, by an independent integration of states that others have found.

Modules: `defect`, `scene_phases`.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from peel_opt.model.place import Place
from peel_opt.residual.defect import March, Tip, march

from ..scene_states import pressure_of, rods, scene_of, title


def _marched(state: dict[str, Any], **moved: float) -> March:
    scene, v = scene_of(state), state["values"]
    q = {**scene.numbers, "ratio": scene.rod.ratio, "pressure": pressure_of(state)}
    q |= {"reaction": v.get("F_contact", 0.0)}
    at = Place(0.0, v["sbar"], v["theta_tip"], v["x_tip"], v["y_tip"], v["x_tip"] + v["sbar"])
    Nx, Ny = (float(n) for n in scene.tip_force(at, q))
    tip = Tip(at.theta, at.x, at.y, Nx, Ny, float(scene.tip_curvature(q)))
    return march(scene, q, v["sbar"], replace(tip, **moved))


@pytest.mark.parametrize("state", rods(), ids=title)
def test_the_edge_of_a_known_state_is_met_and_its_identity_holds(state: dict[str, Any]) -> None:
    marched, v = _marched(state), state["values"]
    digits = 10.0 ** (1 - state["digits"])
    assert marched.missed < 300.0 * digits
    assert abs(marched.identity) < 30.0 * digits
    if v.get("switch") is not None and state["params"].get("p") != 0.5:  # at T0/2 the tip is at the kink
        assert marched.switches == pytest.approx(v["switch"], abs=300.0 * digits)
    if "op" not in state["params"].values():  # whose direction is 0/0 at the edge itself
        assert [marched.Nx, marched.Ny] == pytest.approx([v["Nx_sbar"], v["Ny_sbar"]], abs=300.0 * digits)


@pytest.mark.parametrize("state", rods()[::5], ids=title)
def test_a_state_that_is_a_little_wrong_misses_its_edge(state: dict[str, Any]) -> None:
    wrong = _marched(state, theta=state["values"]["theta_tip"] + 1e-6)
    assert wrong.missed > 1e-7


def test_the_identity_sees_a_load_of_the_wrong_sign() -> None:
    state = next(s for s in rods() if s["tag"] == "tau=0.3 P=.8")
    wrong = {**state, "params": {**state["params"], "tau": -0.3}}
    assert abs(_marched(wrong).identity) > 1e-2
