"""The table of docs/scenes.md that says which call covers what of a scene: every "no" is a refusal in words.

Every "yes" is called in the slow run.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import pytest

import peel_opt as po

PAGE = Path(__file__).parents[2] / "docs" / "scenes.md"
ROD = po.Rod.from_ratio(1.0)

#: A scene with each ingredient, the pressure its state is asked at, and one of its numbers.
SCENES: dict[str, tuple[po.Scene, float, str]] = {
    "loads": (
        po.Scene(
            ROD, [po.Pressure(dead=0.2), po.Weight(0.02, 0.1), po.SkinFriction(share=0.1), po.Drag(0.01)]
        ),
        0.5,
        "weight",
    ),
    "a profile of your own": (
        po.Scene(ROD, [po.Pressure(lambda at: 1.0 - 0.1 * at.xi)]),
        0.5,
        "adhesion_range",
    ),
    "wall": (po.Scene(ROD, wall=po.Circle(-0.1), natural_curvature=-0.1), 0.5, "curvature"),
    "tip load": (po.Scene(ROD, unbonded=0.5, tip=po.TipLoad(0.05, 1.0)), 0.3, "force"),
    "tip on its wall": (po.Scene(ROD, wall=po.Circle(0.1), tip=po.Contact()), 0.5, "curvature"),
    "strip": (po.Blister(ROD, slack=0.1), 0.3, "slack"),
    "shear": (po.Scene(ROD, law=po.EffectiveOpening(0.5)), 0.5, "adhesion_range"),
    "layer": (po.Scene(ROD, law=po.ElasticLayer(300.0)), 0.5, "layer_stiffness"),
    "line energy": (po.Scene(ROD, line_energy=0.05), 0.5, "line_energy"),
    "stretch": (po.Scene(ROD, stretch=50.0, line_energy=0.05), 0.5, "line_energy"),
    "edge without glue": (po.Scene(ROD, unbonded=0.5), 0.4, "unbonded"),
}

#: Scenes with a transition, where these have none.
INSTEAD = {
    "tip load": po.Scene(ROD, tip=po.TipLoad(0.1)),
    "strip": po.Blister(ROD, roller=0.0),
}

#: What has no loop by its physics, and says so.
WITHOUT_A_LOOP = {"line energy", "stretch", "layer", "wall"}


@cache
def state(name: str) -> po.Equilibrium:
    scene, pressure, _ = SCENES[name]
    return po.solve(scene, free="length", pressure=pressure)


@cache
def branch(name: str) -> Any:
    return po.trace(SCENES[name][0], points=8)


def fitted(name: str) -> object:
    scene, pressure, number = SCENES[name]
    length = state(name).length
    pair = po.Measurements([0.99 * length, 1.01 * length], [pressure] * 2, length_sd=0.02 * length)
    return po.calibrate(pair, rod=scene, free=[number])


READINGS: dict[str, Callable[[str], Any]] = {
    "solve": lambda name: po.solve(
        SCENES[name][0], free="pressure", length=state(name).length, near=SCENES[name][1]
    ),
    "trace": branch,
    "stability": lambda name: po.stability(state(name)),
    "growth_rate": lambda name: po.growth_rate(state(name), drag=1.0),
    "energies": lambda name: po.energies(state(name)),
    "sensitivities": lambda name: po.sensitivities(state(name)),
    "answers": lambda name: po.answers(SCENES[name][0], pressure_ratio=[SCENES[name][1]]),
    "sweep": lambda name: po.sweep({"pressure": [SCENES[name][1]]}, rod=SCENES[name][0], workers=1),
    "uncertainty": lambda name: po.uncertainty(
        SCENES[name][0], {"pressure": "1 %"}, pressure=SCENES[name][1], samples=2, workers=1
    ),
    "calibrate": fitted,
    "hysteresis": lambda name: po.hysteresis(SCENES[name][0], points=8),
    "critical_length": lambda name: po.critical_length(INSTEAD.get(name, SCENES[name][0])),
    "unfolding": lambda name: po.unfolding(SCENES[name][0]),
    "snap": lambda name: po.snap(SCENES[name][0], pressure=SCENES[name][1]),
    "history": lambda name: po.history(
        SCENES[name][0], pressure=([0.0, 1.0], [SCENES[name][1], 1.01 * SCENES[name][1]])
    ),
    "design": lambda name: po.design(
        SCENES[name][0], free="bending_stiffness", targets=po.Target("maxwell_length", equal=2.0)
    ),
}


def cells() -> dict[tuple[str, str], str]:
    """The table of the page, by reading and ingredient."""
    lines = PAGE.read_text(encoding="utf-8").split("\n")
    begin = next(i for i, line in enumerate(lines) if line.startswith("| | loads |"))
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines[begin:]]
    names, found = rows[0][1:], {}
    for row in rows[2:]:
        if len(row) < 2:
            break
        found |= {(row[0].strip("`"), name): cell for name, cell in zip(names, row[1:], strict=True)}
    return found


TABLE = cells()


def test_the_table_is_whole() -> None:
    assert {name for _, name in TABLE} == set(SCENES)
    assert {reading for reading, _ in TABLE} == {*READINGS, "save", "stability_changes"}
    assert set(TABLE.values()) == {"yes", "no", "words"}
    assert not [reading for reading, _ in TABLE if reading != "save" and not hasattr(po, reading)]


@pytest.mark.parametrize("name", SCENES)
def test_what_is_not_covered_says_so(name: str) -> None:
    for reading, call in READINGS.items():
        if TABLE[reading, name] == "no":
            with pytest.raises(po.InvalidInput):
                call(name)


@pytest.mark.slow
@pytest.mark.parametrize("name", SCENES)
def test_what_is_covered_is_answered(name: str, tmp_path: Path) -> None:
    for reading in (r for (r, n), cell in TABLE.items() if n == name and cell == "yes" and r != "save"):
        if reading == "hysteresis" and name in WITHOUT_A_LOOP:
            with pytest.raises(po.NoEquilibrium, match="no loop"):
                READINGS[reading](name)
        else:
            assert READINGS[reading](name) is not None, reading
    back = po.Equilibrium.load(state(name).save(tmp_path / "state.npz"))
    assert isinstance(back.scene, str) if TABLE["save", name] == "words" else back.scene == SCENES[name][0]
    with pytest.raises(po.InvalidInput, match="that of a scene"):
        po.stability_changes(branch(name))
