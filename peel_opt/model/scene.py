"""A scene: the rod with its loads, wall, tip and bond, and nothing that was not named.

All numbers of a scene are kept over their units of T0 and eta (`Dimension`), so that lengths are in
eta, forces per width in T0 eta, energies per area in T0 eta; the equations below are written in them.
With theta' = kappa_n + m, m' = N_y cos(theta) - N_x sin(theta) and N' = q,

    q = (p e + tau t + q_x e_1 + q_y e_2) - tau_n nu - tau_t e_1.

The front is where (theta' - kw)^2 / 2 = G0: neither natural curvature nor any load enters it.

A rod that stretches has L = 1 + eps with eps = -N.t/EA before its lengths, and loads on what it has
become.  Glued with a strain eps_a it cannot slide, so that its front has EA (eps - eps_a)^2 / 2 more; both
squares would have to vanish under a bond without a line energy, and there is no such state.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import casadi as ca

from ..base.checks import finite, listed, non_negative, positive
from ..base.errors import InvalidInput
from .bond import COHESIVE, LINEAR, CohesiveLaw, Piece
from .dimension import CURVATURE, ENERGY, FORCE, LENGTH, NUMBER, Dimension
from .layer import ElasticLayer
from .loads import Force, Load, Pressure
from .mixed_bonds import LINE, Bond, EffectiveOpening, Opening
from .place import Numbers, Place
from .rod import Rod, require_rod
from .stretch import past_of, shared_kink
from .tips import FREE, Contact, Free, Middle, Tip, TipLoad, across
from .walls import PLATE, Flat, Wall

#: Names that every scene has.
RESERVED = ("pressure", "length", "ratio", "entered")

#: Numbers of the scene itself, and what they measure.
OWN = {
    "natural_curvature": CURVATURE,
    "unbonded": LENGTH,
    "line_energy": ENERGY,
    "stretch": FORCE,
    "glued_strain": NUMBER,
}


@dataclass(frozen=True)
class Scene:
    """A rod and what acts on it.  What is not named is not modelled; ``Scene(rod)`` is the paper's.

    Parameters
    ----------
    rod : Rod
        Its units are those of every number of the scene.
    loads : sequence of Load, optional
        `Pressure`, `Weight`, `SkinFriction`, `Drag`, at most one of a kind; `Pressure()` is always there.
    wall : Wall
        `Flat` or `Circle`.
    tip : TipLoad or Contact
        What is done to the tip; `Contact` where the rod curls into its wall.  `Blister` is half of a strip.
    law : CohesiveLaw, Bond or str
        Any `CohesiveLaw`, `EffectiveOpening`, `ShearSprings` or `ElasticLayer`.  "auto" is law (8);
        "none" leaves the line energy alone to hold the rod.
    natural_curvature : float
        Curvature [1/m] of the rod without loads; on a flat wall, one that lifts the tip is positive.
    unbonded : float
        Length [m] from the tip that was never glued.
    line_energy : float
        Energy [J/m^2] of the front itself, as of a capillary strip.
    stretch : float, optional
        EA [N/m], axial force per strain, of a rod that stretches.  Its bond does not let it slide, and so
        needs a line energy.  Arc lengths are those before it stretched.
    glued_strain : float
        Strain at which a rod that stretches was glued, and stays where it is attached.

    Raises
    ------
    InvalidInput
        If a number is not finite, two loads are of one kind, or the parts contradict each other.
    """

    rod: Rod
    loads: Sequence[Load] = ()
    wall: Wall = PLATE
    tip: Tip = FREE
    law: CohesiveLaw | Bond | str = "auto"
    natural_curvature: float = 0.0
    unbonded: float = 0.0
    line_energy: float = 0.0
    stretch: float | None = None
    glued_strain: float = 0.0
    bond: Bond = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        require_rod(self.rod)
        object.__setattr__(self, "loads", _checked_loads(self.loads))
        for name, part, kind in (("wall", self.wall, Wall), ("tip", self.tip, Tip)):
            if not isinstance(part, kind):
                raise InvalidInput(f"{name} of a scene cannot be {part!r:.60}.")
        object.__setattr__(self, "bond", _as_bond(self.law))
        object.__setattr__(
            self, "natural_curvature", finite("natural_curvature", self.natural_curvature, "1/m")
        )
        object.__setattr__(self, "unbonded", non_negative("unbonded", self.unbonded, "m"))
        object.__setattr__(self, "line_energy", non_negative("line_energy", self.line_energy, "J/m^2"))
        if self.stretch is not None:
            object.__setattr__(self, "stretch", positive("stretch", self.stretch, "N/m"))
        object.__setattr__(self, "glued_strain", finite("glued_strain", self.glued_strain))
        self._require_names()
        self._require_formulas()
        self._require_front()
        self._require_layer()
        if isinstance(self.tip, Middle) and not self.is_flat:
            raise InvalidInput("half of a symmetric strip is modelled on a flat wall.")
        if isinstance(self.tip, Contact) and isinstance(self.bond, EffectiveOpening):
            raise InvalidInput(
                "a tip that rests on its wall slides without a gap, where a traction that follows the"
                " displacement turns abruptly: this bond is modelled under a tip that is free.",
                remedy="Leave out tip=, or give another bond.",
            )
        if self.bond.slips and not self.is_flat:
            raise InvalidInput(
                "a bond that resists sliding is modelled on a flat wall.", remedy="Leave out one of them."
            )

    def _require_formulas(self) -> None:
        """Raise where a load or a wall of the reader's own is nothing that CasADi can take."""
        at = Place(*(ca.SX.sym(name) for name in ("s", "sbar", "theta", "x", "y", "slip")))
        q = {name: ca.SX.sym(name) for name in (*self.numbers, "pressure", "ratio")}
        for part, ask in (*((load, load.force) for load in self.loads), (self.wall, self.wall.gap)):
            if type(part).__module__.startswith(f"{__package__}."):
                continue
            try:
                for number in map(ca.SX, ask(at, q)):
                    if number.is_constant() and not math.isfinite(float(number)):
                        raise ValueError("it is not a number")
            except Exception as error:
                raise InvalidInput(
                    f"{type(part).__name__} cannot be evaluated at a place: {error!r:.120}.",
                    remedy="It is called with CasADi expressions: write casadi.exp, casadi.if_else and the"
                    " like, and return a Force, or what a wall has.",
                ) from error

    def _require_layer(self) -> None:
        """Raise where an elastic layer is not modelled."""
        if self.layer is None:
            return
        rod = self.rod
        if self.layer.stiffness <= (least := rod.adhesion_strength / rod.adhesion_range):
            raise InvalidInput(
                f"a layer of {self.layer.stiffness:.6g} is as soft as its bond: T0/y0 = {least:.6g}.",
                remedy="Give a stiffness well above T0/y0.",
            )
        others = self.unbonded or self.line_energy or self.stretch is not None
        if others or not self.is_flat or isinstance(self.tip, Contact):
            raise InvalidInput(
                "an elastic layer is modelled on a flat wall, under a rod that does not stretch, glued up to"
                " a tip that is free or the middle of a strip, without a line energy.",
                remedy="Leave out one of them.",
            )

    def _require_front(self) -> None:
        """Raise where nothing holds the front, or more than can be met there."""
        if self.stretch is None:
            if self.glued_strain:
                raise InvalidInput(
                    "a rod that does not stretch has no glued_strain.",
                    remedy="Give stretch=, or leave it out.",
                )
            if self.bond is LINE and not self.line_energy:
                raise InvalidInput(
                    "a rod that no cohesive law holds is held by its line_energy, and has none.",
                    remedy="Give line_energy=, or a law.",
                )
            return
        if not self.line_energy:
            raise InvalidInput(
                "a rod that stretches has no equilibrium on a bond that neither lets it slide nor has a line"
                " energy: theta' and the jump of its strain would both have to vanish at the front.",
                remedy="Give line_energy=, or leave out stretch=.",
            )
        if self.glued_strain <= -1.0:
            raise InvalidInput(f"glued_strain must be above -1, got {self.glued_strain:g}.")
        if self.bond.slips or not self.is_flat or isinstance(self.tip, Contact):
            raise InvalidInput(
                "a rod that stretches is modelled on a flat wall, with a bond that does not slide, and with a"
                " tip that is free or the middle of a strip.",
                remedy="Leave out stretch=, or the other.",
            )

    def _require_names(self) -> None:
        """Raise where two parts call a number by one name, or a part cannot be told from another."""
        parts = (*self.loads, self.wall, self.tip, self.bond)
        names = [*RESERVED, *OWN, *(name for part in parts for name in part.parameters)]
        if twice := {name for name in names if names.count(name) > 1}:
            raise InvalidInput(
                f"the name {', '.join(sorted(twice))} is used for two numbers of a scene.",
                remedy="Give the parameters of a class of your own other names.",
            )
        try:
            hash(parts)
        except TypeError as error:
            raise InvalidInput(
                f"a part of the scene cannot be hashed: {error}.", remedy="Make its class a frozen dataclass."
            ) from error

    @property
    def layer(self) -> ElasticLayer | None:
        """The layer on which the attached rod moves, if there is one."""
        return self.bond if isinstance(self.bond, ElasticLayer) else None

    @property
    def is_flat(self) -> bool:
        """Whether the wall is flat."""
        return isinstance(self.wall, Flat)

    def _has(self, name: str) -> bool:
        """Whether one of its own numbers is in its equations."""
        return self.stretch is not None if name == "glued_strain" else bool(getattr(self, name))

    @cached_property
    def dimensions(self) -> dict[str, Dimension]:
        """What its numbers measure, by name."""
        own = {name: kind for name, kind in OWN.items() if self._has(name)}
        for part in (*self.loads, self.wall, self.tip, self.bond):
            own |= part.parameters
        return own

    @cached_property
    def numbers(self) -> dict[str, float]:
        """Its numbers over their units of T0 and eta, by name."""
        given = {name: getattr(self, name) for name in OWN if self._has(name)}
        for part in (*self.loads, self.wall, self.tip, self.bond):
            given |= part.numbers()
        return {name: value / self.dimensions[name].size(self.rod) for name, value in given.items()}

    @cached_property
    def form(self) -> tuple[Any, ...]:
        """What two scenes share that differ in their numbers alone."""
        parts = (*self.loads, self.wall, self.tip, self.bond)
        return (*(part.form for part in parts), tuple(self.dimensions))

    @property
    def is_plain(self) -> bool:
        """Whether it is the paper's scene, under a vertical law."""
        plain = isinstance(self.bond, Opening) and isinstance(self.tip, Free) and self.is_flat
        return plain and not self.numbers and self.loads == (Pressure(),)

    @property
    def breaks(self) -> tuple[str, ...]:
        """Names of the numbers that are material points, at which something ends or begins."""
        ends = [name for load in self.loads for name in load.breaks()]
        return (*(("unbonded",) if self.unbonded else ()), *ends)

    @property
    def keeps_flat(self) -> bool:
        """Whether the attached rod is an equilibrium at some pressure at every length: T exists."""
        loads = all(load.keeps_flat for load in self.loads) and not self.unbonded and not self.line_energy
        loads = loads and self.layer is None
        if isinstance(self.tip, Middle):
            return loads and self.tip.slack is None
        if not self.is_flat:  # what is not normal to a curved wall bends the rod that lies on it
            loads = loads and self.loads == (Pressure(),) and not self.numbers.get("force")
        tip = isinstance(self.tip, TipLoad) and self.tip.keeps_flat
        return loads and tip and self.imposed_curvature == 0.0

    @property
    def lifts(self) -> bool:
        """Whether something lifts the tip without any pressure, so that a lifted branch begins at p = 0."""
        q = self.numbers
        pulled = q.get("force", 0.0) * across(q.get("angle", 0.0)) > 0.0
        curled = self.imposed_curvature
        lifted = bool(self.unbonded) or curled > 0.0 or (pulled and curled == 0.0)
        return lifted and not self.line_energy and self.layer is None  # which no small load overcomes

    @property
    def wall_curvature(self) -> float:
        """Curvature of the wall, times eta."""
        return float(self.wall.curvature_of(self.numbers))

    @property
    def imposed_curvature(self) -> float:
        """Curvature of the tip of a rod that lies on the wall, less that of the wall, times eta."""
        q = self.numbers
        return float(self.tip_curvature(q)) - self.wall_curvature

    def entered(self, share: float) -> dict[str, float]:
        """Return its numbers on the way from the paper's scene (0) to this one (1).

        What bends the wall or the rod grows with the share, and what the bond has, by equal factors where it
        is large; the loads of this scene take over from a uniform pressure (`load`), and a force or a moment
        on the tip grows.
        """
        growing = {*OWN, *self.wall.parameters, "force", "moment", "roller"}
        own = {name: value * (share if name in growing else 1.0) for name, value in self.numbers.items()}
        own |= {name: grown(own[name], share) for name in self.bond.parameters}
        if "stretch" in own:  # it is 1/EA that grows
            own["stretch"] = self.numbers["stretch"] / share if share else math.inf
        return own | {"entered": share}

    # -- the equations, in units of T0 and eta

    def load(self, at: Place, q: Numbers) -> Force:
        """Return the sum of all loads; on the way into the scene, mixed with a uniform pressure."""
        forces = [self._spread(load, at, q) for load in self.loads]
        whole = [sum(parts) for parts in zip(*forces, strict=True)]
        plain = Force(normal=q["pressure"] * (1.0 + at.strain))
        h = q.get("entered", 1.0)
        return Force(*(a + h * (b - a) for a, b in zip(plain, whole, strict=True)))

    @staticmethod
    def _spread(load: Load, at: Place, q: Numbers) -> Force:
        """Return a load per length of the rod before it stretched."""
        force, L = load.force(at, q), 1.0 + at.strain if load.on_stretched else 1.0
        return Force(*(part * L for part in force))

    def strain(self, thrust: Any, q: Numbers) -> Any:
        """Return the elongation of the rod under an axial force N.t, positive in compression."""
        return thrust * 0.0 if self.stretch is None else -thrust / q["stretch"]

    def per_length(self, at: Place, piece: Piece, q: Numbers) -> tuple[Any, Any]:
        """Return (N_x', N_y'): all loads, less what the bond holds on a piece of its law."""
        f = self.load(at, q)
        sine, cosine = ca.sin(at.theta), ca.cos(at.theta)
        x = -f.normal * sine + f.tangential * cosine + f.x
        y = f.normal * cosine + f.tangential * sine + f.y
        if self.unbonded and "unbonded" not in at.past:
            return x, y
        gap, nx, ny = self.wall.gap(at, q)
        r = q["ratio"]
        lost, shear = self.bond.tractions(piece, gap * r, at.slip * r, q)
        return x + (lost - 1.0) * nx - shear, y + (lost - 1.0) * ny

    def attached(self, at: Place, q: Numbers) -> tuple[Any, Any]:
        """Return (N_x', N_y') of the attached rod on its layer."""
        return 0.0, -q["layer_stiffness"] * self.wall.gap(at, q)[0]

    def yielding(self, at: Place, q: Numbers) -> Any:
        """Return what vanishes at the front on a layer."""
        assert self.layer is not None
        return self.opening(at, q) - self.layer.yields_at(q)

    def opening(self, at: Place, q: Numbers) -> Any:
        """Return what decides on the piece of the law: the gap over y0, for most bonds."""
        r = q["ratio"]
        return self.bond.opening(self.wall.gap(at, q)[0] * r, at.slip * r, q)

    def tip_curvature(self, q: Numbers) -> Any:
        """Return theta'(0) of a free tip: natural curvature less the moment."""
        return q.get("natural_curvature", 0.0) - q.get("moment", 0.0)

    def tip_start(self, A: Any, sbar: Any, q: Numbers) -> tuple[Any, Any]:
        """Return theta' and theta at the tip over the amplitude A, both less those of the wall, along xi.

        One of them is the scale of the amplitude: the inclination of a tip, the curvature of a middle.
        """
        if isinstance(self.tip, Middle):
            return -1.0, 0.0
        scale = 1.0 if isinstance(self.tip, Contact) else -1.0  # pressed on the wall, it points down
        return (self.tip_curvature(q) - self.wall.curvature_of(q)) * sbar / A, scale

    def tip_force(self, at: Place, q: Numbers) -> tuple[Any, Any]:
        """Return (N_x, N_y) at the tip."""
        if isinstance(self.tip, Free):
            return 0.0, 0.0
        if isinstance(self.tip, TipLoad):
            return self.tip.pull(q)
        if isinstance(self.tip, Middle):
            return q["roller" if self.tip.slack is None else "thrust"], 0.0
        _, nx, ny = self.wall.gap(at, q)
        return q["reaction"] * nx, q["reaction"] * ny

    @property
    def reactions(self) -> tuple[str, ...]:
        """Names of the forces that are not given but follow from `tip_equations`."""
        return self.tip.reactions

    @property
    def readings(self) -> dict[str, Dimension]:
        """What its states have beside its numbers, and what that measures."""
        return dict.fromkeys(self.reactions, FORCE) | ({} if self.layer is None else self.layer.readings)

    def tip_equations(self, at: Place, q: Numbers) -> list[Any]:
        """Return what vanishes at the tip beside the balances: a gap, or what the slack does not explain."""
        if isinstance(self.tip, Contact):
            return [self.wall.gap(at, q)[0] / at.sbar]
        if isinstance(self.tip, Middle) and self.tip.slack is not None:
            return [(at.slip - q["slack"]) / at.sbar]
        return []

    def switch(self, at: Place, q: Numbers, before: Piece, after: Piece) -> Any:
        """Return what vanishes where one stretch of the rod ends and the next begins."""
        if names := past_of(after) - past_of(before):
            (name,) = names
            return (at.s - q[name]) / at.sbar
        return self.opening(at, q) - shared_kink(before, after)

    def front_curvature(self, Nx: Any, q: Numbers) -> Any:
        """Return theta'(sbar), from (theta' - kw)^2 / 2 + EA (eps - eps_a)^2 / 2 = G0."""
        kw = self.wall.curvature_of(q)
        if not self.line_energy:
            return kw
        held = 2.0 * q["line_energy"]
        if self.stretch is not None:
            held -= (Nx + q["stretch"] * q.get("glued_strain", 0.0)) ** 2 / q["stretch"]
        return kw + ca.sqrt(held)

    # -- what must hold beside the equations

    @property
    def has_identity(self) -> bool:
        """Whether the first integrals say something about every state: on a flat wall always."""
        return self.is_flat or (self.loads == (Pressure(),) and not self.numbers.get("force"))

    def work(self, at: Place, q: Numbers) -> Any:
        """Return the density of what the loads put into the identity of a flat wall.

        It is (1 + eps_a) f_x - L f.t for a force f per length before the rod stretched.
        """
        works = [load.work(at, q) for load in self.loads]
        if self.stretch is None:
            return sum(works)
        forces = [self._spread(load, at, q) for load in self.loads]
        scales = [1.0 + at.strain if load.on_stretched else 1.0 for load in self.loads]
        normal, tangential, x, y = (sum(parts) for parts in zip(*forces, strict=True))
        sine, cosine = ca.sin(at.theta), ca.cos(at.theta)
        along = tangential + x * cosine + y * sine
        level = -normal * sine + tangential * cosine + x
        unstretched = sum(scale * work for scale, work in zip(scales, works, strict=True))
        return unstretched + q.get("glued_strain", 0.0) * level - at.strain * along

    def identity(self, tip: Place, first: Place, work: float, curvature: float, q: Numbers) -> float:
        """Return by how much the identity is missed, over T0 eta.

        Parameters
        ----------
        tip, first : Place
            The tip, and the place nearest to it that is bonded.
        work : float
            The integral of `work` along the detached length.
        curvature : float
            theta'(0), times eta.
        q : mapping
            All numbers.
        """
        r, G0 = q["ratio"], q.get("line_energy", 0.0)
        gap = self.wall.gap(first, q)[0]
        separated = self.bond.potential(float(gap) * r, float(first.slip) * r, q) / r
        kw = self.wall.curvature_of(q)
        stored = 0.5 * (curvature - kw) ** 2
        at_tip, *normal = self.wall.gap(tip, q)
        if isinstance(self.tip, Contact):
            stored += self.tip.work(tip, (normal[0], normal[1]), q)
        if not self.is_flat:
            return float(q["pressure"] * (at_tip - 0.5 * kw * at_tip**2) + stored - separated - G0)
        if self.stretch is not None:
            Nx, Ny = self.tip_force(tip, q)
            EA, glued = q["stretch"], q.get("glued_strain", 0.0)
            thrust = Nx * math.cos(tip.theta) + Ny * math.sin(tip.theta)
            stored += 0.5 * EA * (self.strain(thrust, q) ** 2 + glued**2) + glued * Nx
        if isinstance(self.tip, TipLoad) and not isinstance(self.tip, Free):
            work += self.tip.work(tip.theta, q)
        return float(work + stored - separated - G0)


def grown(value: float, share: float) -> float:
    """Return what a number has become on the way from zero: sign(v) ((1 + |v|)^share - 1)."""
    if share == 1.0:
        return value
    return math.copysign(math.expm1(share * math.log1p(abs(value))), value)


def _as_bond(law: object) -> Bond:
    if isinstance(law, str) and law in ("auto", "cohesive"):
        return Opening(COHESIVE)
    if isinstance(law, str) and law == "linear":
        return Opening(LINEAR)
    if isinstance(law, str) and law == "none":
        return LINE
    if isinstance(law, CohesiveLaw):
        return Opening(law)
    if isinstance(law, Bond):
        return law
    raise InvalidInput(
        f"law of a scene must be a CohesiveLaw or a bond, got {law!r:.60}.",
        remedy='Leave it out for law (8), or give "linear", "none", a CohesiveLaw, EffectiveOpening,'
        " ShearSprings or ElasticLayer.",
    )


def _checked_loads(loads: object) -> tuple[Load, ...]:
    given = listed("loads", loads)
    for load in given:
        if not isinstance(load, Load):
            raise InvalidInput(
                f"a load cannot be {load!r:.60}.",
                remedy="Give Pressure, Weight, SkinFriction, Drag, or a Load of your own.",
            )
    kinds = [type(load) for load in given]
    if twice := {kind.__name__ for kind in kinds if kinds.count(kind) > 1}:
        raise InvalidInput(
            f"a scene has one load of a kind, got several {', '.join(sorted(twice))}.",
            remedy="Add them up, or give the sum as a profile.",
        )
    if Pressure not in kinds:
        given.insert(0, Pressure())
    return tuple(given)
