"""``[scene]`` of a problem card: what acts on the rod, by the names under which `solve` frees its numbers.

Every key that is a number has the name it has in `Scene.numbers`, a text with its unit as its value,
and a source or an estimate; words pick the kind of profile, tip and bond.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, Field, model_validator

from ..base.checks import parse
from ..base.errors import InvalidInput
from ..base.units import ANGLE, KINDS, NUMBER, Kind
from ..model import profiles
from ..model.blister import Blister
from ..model.bond import COHESIVE, CohesiveLaw
from ..model.dimension import DOMAINS, Dimension, ScenePart
from ..model.layer import ElasticLayer
from ..model.loads import Drag, Load, Pressure, SkinFriction, Weight
from ..model.mixed_bonds import Bond, EffectiveOpening, ShearSprings
from ..model.named_laws import law_named
from ..model.rod import Rod
from ..model.scene import OWN, Scene
from ..model.tips import FREE, Contact, Middle, Tip, TipLoad
from ..model.walls import PLATE, Circle
from .card_tables import CardTable, own_units

#: The numbers that a kind of profile or bond is made of.
PROFILES = {
    "linear": "gradient",
    "exponential": "decay",
    "mixed": "mix",
    "height": "layer",
    "stream": "",
    "jet": "",
}
BONDS = {"opening": "", "effective opening": "zeta", "shear springs": "shear_stiffness"}
BONDS |= {"elastic layer": "layer_stiffness"}

#: One of each part, whose numbers are the keys of the table.
_PARTS: tuple[ScenePart, ...] = (
    Pressure(dead=0.5, until=1.0),
    *(Pressure(p) for p in (profiles.Linear(0.0), profiles.Exponential(1.0), profiles.Mixed(0.0))),
    Pressure(profiles.Height(1.0)),
    Weight(0.0),
    SkinFriction(traction=0.0),
    SkinFriction(share=0.0),
    Drag(0.0),
    Circle(0.0),
    TipLoad(),
    EffectiveOpening(0.0),
    ShearSprings(1.0),
    ElasticLayer(1.0),
    Middle(roller=0.0),
    Middle(slack=1.0),
)

#: What the numbers of the table measure.
MEASURES: dict[str, Dimension] = dict(OWN)
for _part in _PARTS:
    MEASURES |= _part.parameters

#: Numbers that somebody sets, as the pressure of a question; all others are read or estimated somewhere.
SET = ("force", "angle", "moment", "roller")

#: Numbers that are no longer one at zero.
_POSITIVE = ("decay", "layer", "until", "shear_stiffness", "layer_stiffness", "stretch")


def _known_law(value: object) -> object:
    """Accept the name of a law of the package."""
    if not isinstance(value, str) or (value not in ("auto", "none") and law_named(value) is None):
        raise InvalidInput(
            f"law of a scene cannot be {value!r:.60}.",
            remedy='Name "cohesive", "linear", "exponential", "trapezoidal(0.3)" or "none".',
        )
    return value


class SceneTable(CardTable):
    """``[scene]``: loads, wall, tip, bond, and whether the rod is half of a strip between two edges."""

    profile: Literal["linear", "exponential", "stream", "mixed", "jet", "height"] | None = Field(
        None, description="how the pressure is distributed; uniform if not given"
    )
    gradient: Any = Field(None, description="c of the linear profile p0 (1 + c s/sbar)")
    decay: Any = Field(None, description="l of the exponential profile p0 exp(-s/l), from the tip")
    mix: Any = Field(None, description="c of the mixed profile p0 (1 - c + c sin^2 theta), 0 to 1")
    layer: Any = Field(None, description="h of the profile p0 (y/h)^2 of a shear layer")
    dead: Any = Field(
        None, description="share of the pressure, 0 to 1, that keeps pointing up as the rod turns"
    )
    until: Any = Field(None, description="arc length from the tip up to which the fluid has come")
    weight: Any = Field(None, description="per area; negative where the rod hangs under its plate")
    tilt: Any = Field(None, description="of the plate, with a weight")
    friction: Any = Field(None, description="skin friction per area, from tip to root where positive")
    share: Any = Field(None, description="the same, over the pressure at the tip; one of the two")
    drag: Any = Field(None, description="per area, along +x whatever the rod does")
    curvature: Any = Field(
        None, description="of the wall: negative outside a cylinder, positive inside a tube"
    )
    tip: Literal["free", "contact"] = Field(
        "free", description="whether the tip rests on the wall, as that of a strip that curls into it"
    )
    force: Any = Field(None, description="of a pull at the tip, over the width")
    angle: Any = Field(None, description="of the pull, from the plate: 90 deg is straight up")
    moment: Any = Field(None, description="at the tip, over the width; one that lifts is negative")
    law: Annotated[str, BeforeValidator(_known_law)] = Field(
        "auto",
        description="of the bond in the gap: auto, cohesive, linear, exponential, trapezoidal(0.3);"
        " or none, where a line energy alone holds",
    )
    bond: Literal["opening", "effective opening", "shear springs", "elastic layer"] = Field(
        "opening", description="how the bond resists sliding, or the layer it is"
    )
    zeta: Any = Field(
        None,
        description="of an effective opening: zeta^2 is shear over normal traction at equal slip and gap",
    )
    shear_stiffness: Any = Field(None, description="Kt of shear springs")
    layer_stiffness: Any = Field(None, description="K of an elastic layer, above T0/y0")
    softening: bool = Field(True, description="whether shear springs soften with the gap")
    natural_curvature: Any = Field(
        None, description="of the rod without loads; on a flat plate, one that lifts the tip is positive"
    )
    unbonded: Any = Field(None, description="length from the tip that was never glued")
    line_energy: Any = Field(None, description="of the front itself")
    stretch: Any = Field(
        None, description="EA, axial force over the width per strain, of a rod that stretches"
    )
    glued_strain: Any = Field(None, description="strain at which it was glued")
    blister: bool = Field(False, description="half of a symmetric strip between two edges")
    roller: Any = Field(None, description="axial force of a strip whose ends slide in, compression positive")
    slack: Any = Field(None, description="length that half of a strip has more than the plate under it")

    @property
    def given(self) -> set[str]:
        """Names of the numbers that are given."""
        return {name for name in MEASURES if getattr(self, name) is not None}

    @model_validator(mode="after")
    def _has_the_numbers_of_its_words(self) -> Self:
        given = self.given
        for word, kinds in (("profile", PROFILES), ("bond", BONDS)):
            chosen = getattr(self, word)
            needs = kinds[chosen] if chosen else ""
            if needs and needs not in given:
                raise InvalidInput(f"{word} = {chosen!r} needs {needs}.")
            for kind, name in kinds.items():
                if name in given and name != needs:
                    raise InvalidInput(f"{name} goes with {word} = {kind!r}.")
        wants = {"tilt": "weight"} | dict.fromkeys(("roller", "slack"), "blister")
        for name, other in wants.items():
            if name in given and not (other in given or (other == "blister" and self.blister)):
                raise InvalidInput(f"{name} goes with {other}{' = true' * (other == 'blister')}.")
        if {"friction", "share"} <= given:
            raise InvalidInput("give one of friction and share, not both.")
        return self

    @model_validator(mode="after")
    def _goes_together(self) -> Self:
        if pulled := sorted(self.given & set(TipLoad.parameters)):
            held = "tip = 'contact'" if self.tip == "contact" else "blister = true" if self.blister else ""
            if held:
                raise InvalidInput(f"{pulled[0]} loads a free tip, and not one with {held}.")
        if self.tip == "contact" and self.blister:
            raise InvalidInput("the tip of a blister is its middle: leave out tip.")
        if self.bond == "effective opening" and self.law == "none":
            raise InvalidInput("bond = 'effective opening' needs a law, and not law = 'none'.")
        if self.bond in ("shear springs", "elastic layer") and self.law != "auto":
            raise InvalidInput(f"bond = {self.bond!r} has law (8) in the gap: leave out law.")
        if not self.softening and self.bond != "shear springs":
            raise InvalidInput("softening goes with bond = 'shear springs'.")
        return self

    def scene(self, rod: Rod) -> Scene:
        """Return the scene of a rod.

        Raises
        ------
        InvalidInput
            If a number has the wrong unit or size, naming it, or the parts contradict each other.
        """
        q = {name: read_number(rod, name, getattr(self, name), MEASURES[name]) for name in self.given}
        for name, value in q.items():
            low, high = DOMAINS.get(name, (-math.inf, math.inf))
            if not low <= value <= high:
                bounds = f"at least {low:g}" if math.isinf(high) else f"between {low:.5g} and {high:.5g}"
                raise InvalidInput(f"{name} must be {bounds}, got {value:g}.")
        own: dict[str, Any] = {name: q[name] for name in OWN if name in q}
        wall = Circle(q["curvature"]) if "curvature" in q else PLATE
        loads, law = self._loads(q), self._bond(q)
        if self.blister:
            if "natural_curvature" in own:
                raise InvalidInput("natural_curvature does nothing to a blister: leave it out.")
            return Blister(rod, loads, wall, law=law, roller=q.get("roller"), slack=q.get("slack"), **own)
        tip: Tip = Contact() if self.tip == "contact" else FREE
        if load := {name: q[name] for name in TipLoad.parameters if name in q}:
            tip = TipLoad(**load)
        return Scene(rod, loads, wall, tip, law, **own)

    def _loads(self, q: dict[str, float]) -> list[Load]:
        makers: dict[str, Callable[..., profiles.Distribution]] = {
            "linear": profiles.linear,
            "exponential": profiles.exponential,
            "mixed": profiles.mixed,
            "height": profiles.height,
            "stream": profiles.stream,
            "jet": profiles.jet,
        }
        profile = None
        if self.profile is not None:
            number = PROFILES[self.profile]
            try:
                profile = makers[self.profile](*([q[number]] if number else []))
            except InvalidInput as error:
                raise InvalidInput(f"{number}: {error}") from error
        loads: list[Load] = []
        if profile is not None or "dead" in q or "until" in q:
            loads.append(Pressure(profile, dead=q.get("dead", 0.0), until=q.get("until")))
        if "weight" in q:
            loads.append(Weight(q["weight"], q.get("tilt", 0.0)))
        if "friction" in q or "share" in q:
            loads.append(SkinFriction(traction=q.get("friction"), share=q.get("share")))
        if "drag" in q:
            loads.append(Drag(q["drag"]))
        return loads

    def _bond(self, q: dict[str, float]) -> CohesiveLaw | Bond | str:
        law = law_named(self.law) or COHESIVE
        if self.bond == "effective opening":
            return EffectiveOpening(q["zeta"], law)
        if self.bond == "shear springs":
            return ShearSprings(q["shear_stiffness"], self.softening)
        if self.bond == "elastic layer":
            return ElasticLayer(q["layer_stiffness"])
        return self.law if self.law in ("auto", "none") else law


def read_number(rod: Rod, name: str, value: object, dimension: Dimension) -> float:
    """Return a number of a scene in the units of its rod, whose T0, eta and y0 are units too.

    Raises
    ------
    InvalidInput
        If it measures something else, or is not finite.
    """
    own = own_units(rod, dimension.unit)
    return parse(name, value, kind_of(rod, dimension), own=own, signed=name not in _POSITIVE)


def kind_of(rod: Rod, dimension: Dimension) -> Kind:
    """Return the units that a number of a scene may be written in: none where its rod has none."""
    return NUMBER if rod.dimensionless and dimension.unit != ANGLE.si else KINDS[dimension.unit]
