"""Scenes to choose from: what acts on the rod beside the pressure, each with a few numbers."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ...base.units import ANGLE as DEGREES
from ...base.units import KINDS, NUMBER, Kind, display
from ...model.dimension import ANGLE, CURVATURE, FORCE, LENGTH, TRACTION, Dimension
from ...model.loads import Drag, Pressure, Weight
from ...model.rod import Rod
from ...model.scene import Scene
from ...model.tips import TipLoad
from ...model.walls import Circle
from ...plots.words import AxisUnit, prefixed

if TYPE_CHECKING:
    from .state import State


@dataclass(frozen=True)
class SceneNumber:
    """A number of a scene that has a slider.

    Parameters
    ----------
    name : str
        As `Scene.numbers` and cards have it.
    words, symbol : str
    dimension : Dimension
    start, low, high : float
        What a scene begins with, and the ends of the slider, over T0 and eta.
    least, most : float
        Beyond which it cannot be meant, over T0 and eta.
    """

    name: str
    words: str
    symbol: str
    dimension: Dimension
    start: float
    low: float
    high: float
    least: float = -1e3
    most: float = 1e3

    def kind(self, in_si: bool) -> Kind:
        """What a text with it must measure; a rod without units has numbers, and angles."""
        if self.dimension is ANGLE:
            return DEGREES
        return KINDS[self.dimension.unit] if in_si else NUMBER

    def unit(self, rod: Rod) -> AxisUnit:
        """Return the unit of its slider and of a bare number in its field."""
        if self.dimension is ANGLE:
            return AxisUnit(math.pi / 180.0, "°")
        if rod.dimensionless:
            return AxisUnit(1.0, self.dimension.unit_of(rod))
        if self.dimension is CURVATURE:
            return AxisUnit(1.0, "1/m")
        return prefixed(self.start * self.dimension.size(rod), self.dimension.unit)

    def title(self, rod: Rod) -> str:
        """Return what stands above its slider."""
        return f"{self.words} {self.symbol} [{_in_letters(self.unit(rod).name)}]"

    def text(self, rod: Rod, value: float) -> str:
        """Return what stands in its field."""
        if rod.dimensionless or self.dimension is ANGLE:
            return f"{value / self.unit(rod).size:.7g}"
        return display(value, self.dimension.unit)

    def worded(self, rod: Rod, value: float) -> str:
        """Return it with its symbol and unit, for a sentence."""
        if self.dimension is ANGLE:
            return f"{self.symbol} = {value * 180.0 / math.pi:.4g}°"
        if not rod.dimensionless:
            return f"{self.symbol} = {display(value, self.dimension.unit, 4)}"
        return f"{self.symbol} = {value:.4g} {_in_letters(self.dimension.unit_of(rod))}"


def _in_letters(unit: str) -> str:
    return unit.replace("T0", "T₀").replace("eta", "η").replace("^-1", "⁻¹")


@dataclass(frozen=True)
class Setup:
    """A scene to choose: what it is called, its numbers, and how they make it."""

    words: str
    numbers: tuple[SceneNumber, ...]
    make: Callable[..., dict[str, object]]


#: Scenes by name; the plate is the paper's.
SETUPS: dict[str, Setup] = {
    "plate": Setup("the paper's: pressure, flat plate", (), dict),
    "flaw": Setup(
        "a flaw: an edge never glued",
        (SceneNumber("unbonded", "unglued edge", "a", LENGTH, 0.5, 0.0, 2.0, least=0.0),),
        lambda unbonded: {"unbonded": unbonded},
    ),
    "wall": Setup(
        "a curved wall",
        (SceneNumber("curvature", "curvature", "κ", CURVATURE, -0.1, -0.25, 0.25, least=-1.0, most=1.0),),
        lambda curvature: {"wall": Circle(curvature)},
    ),
    "force": Setup(
        "a force on the tip",
        (
            SceneNumber("force", "force", "F", FORCE, 0.1, 0.0, 0.5),
            SceneNumber(
                "angle", "its angle", "φ", ANGLE, 0.5 * math.pi, 0.0, math.pi, least=-math.pi, most=math.pi
            ),
        ),
        lambda force, angle: {"tip": TipLoad(force=force, angle=angle)},
    ),
    "weight": Setup(
        "weight of the rod",
        (SceneNumber("weight", "weight per area", "w", TRACTION, 0.02, -0.05, 0.1),),
        lambda weight: {"loads": (Pressure(), Weight(weight))},
    ),
    "drag": Setup(
        "drag along the plate",
        (SceneNumber("drag", "drag per area", "q", TRACTION, 0.05, -0.1, 0.2),),
        lambda drag: {"loads": (Pressure(), Drag(drag))},
    ),
}

#: All numbers of scenes, by name.
SCENE_NUMBERS = {each.name: each for setup in SETUPS.values() for each in setup.numbers}


def setup_of(scene: Scene) -> tuple[str, dict[str, float]] | None:
    """Return which of the scenes one is, with its numbers in the units of its rod; None if it is another."""
    for name, setup in SETUPS.items():
        sizes = {each.name: each.dimension.size(scene.rod) for each in setup.numbers}
        if not sizes.keys() <= scene.numbers.keys():
            continue
        values = {each: scene.numbers[each] * size for each, size in sizes.items()}
        same = Scene(scene.rod, law=scene.law, **setup.make(**values))  # type: ignore[arg-type]
        if same.form == scene.form and all(
            math.isclose(same.numbers[each], value, rel_tol=1e-12) for each, value in scene.numbers.items()
        ):
            return name, values
    return None


def scene_of(state: State) -> Scene | None:
    """Return the scene of a state; None where it is the paper's, as with numbers that are all zero."""
    rod = state.rod
    if rod is None or state.scene == "plate":
        return None
    setup = SETUPS[state.scene]
    numbers = {each.name: getattr(state, each.name) for each in setup.numbers}
    first = setup.numbers[0].name
    if not numbers[first]:
        return None
    return Scene(rod, law=state.named_law, **setup.make(**numbers))  # type: ignore[arg-type]
