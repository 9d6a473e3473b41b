"""Reference states of scenes, read from `scene_states.json`, and the scenes they belong to."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import peel_opt as po
from peel_opt.model import profiles
from peel_opt.model.loads import Drag, Load, Pressure, SkinFriction, Weight
from peel_opt.model.mixed_bonds import Bond, EffectiveOpening, ShearSprings
from peel_opt.model.scene import Scene
from peel_opt.model.tips import FREE, Tip, TipLoad
from peel_opt.model.walls import Circle, Flat

REFERENCE: dict[str, Any] = json.loads(Path(__file__).with_name("scene_states.json").read_text())

PROFILES: dict[str, Callable[..., profiles.Distribution]] = {
    "lin": profiles.linear,
    "exp": profiles.exponential,
    "cos2": profiles.jet,
    "sin2": profiles.stream,
    "mixsin": profiles.mixed,
    "y2": profiles.height,
}

BONDS: dict[str, Callable[[float], Bond]] = {
    "op": EffectiveOpening,
    "deg": ShearSprings,
    "spr": lambda stiffness: ShearSprings(stiffness, softening=False),
}


def rods() -> list[dict[str, Any]]:
    """Return the states of rods with a tip, on a wall without an elastic layer."""
    return [s for s in REFERENCE["states"] if s["scene"] not in ("S7", "S8")]


def blisters() -> list[dict[str, Any]]:
    """Return the states of strips that do not stretch."""
    return [s for s in REFERENCE["states"] if s["params"].get("mode") in ("roller", "slack")]


def title(state: dict[str, Any]) -> str:
    """Return a name for a test."""
    return f"{state['scene']}: {state['tag']}"


def scene_of(state: dict[str, Any]) -> Scene:
    """Return the scene of a state, with the numbers that were solved for."""
    if "mode" in state["params"]:
        given = {"roller": state["params"]["Nx0"], "slack": state["params"].get("d")}
        mode = state["params"]["mode"]
        return po.Blister(po.Rod.from_ratio(1.0 / state["params"]["y0"]), **{mode: given[mode]})
    p = {**state["params"], **{k: v for k, v in state["values"].items() if k in ("F", "M")}}
    profile = PROFILES[p["prof"][0]](*p["prof"][1:]) if "prof" in p else None
    loads: list[Load] = [Pressure(profile, p.get("dead", 0.0), p.get("sf"))]
    if "w" in p or "wx" in p:
        down, along = p.get("w", 0.0), p.get("wx", 0.0)
        sign = math.copysign(1.0, down)
        loads.append(Weight(sign * math.hypot(down, along), math.atan2(sign * along, sign * down)))
    if "tau" in p:
        loads.append(SkinFriction(traction=p["tau"]))
    if "mu" in p:
        loads.append(SkinFriction(share=p["mu"]))
    if "drag" in p:
        loads.append(Drag(p["drag"]))
    tip: Tip = po.Contact() if "tip" in p else FREE
    loaded = any(name in p for name in ("F", "M"))
    return Scene(
        po.Rod.from_ratio(1.0 / p["y0"]),
        loads=loads,
        wall=Circle(p["kw"]) if p.get("kw") else Flat(),
        tip=TipLoad(p.get("F", 0.0), p.get("phi", 0.0), p.get("M", 0.0)) if loaded else tip,
        law=BONDS[p["law"]](p["par"]) if "law" in p else "auto",
        natural_curvature=p.get("kn", 0.0),
        line_energy=p.get("G0", 0.0),
    )


def pressure_of(state: dict[str, Any]) -> float:
    """Return p/T0 of a state, given or found."""
    return float(state["params"].get("p", state["values"].get("p")))
