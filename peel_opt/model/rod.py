"""The rod, and the only place where SI units meet dimensionless numbers."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from ..base.checks import finite, positive
from ..base.drawing import Shown
from ..base.errors import InvalidInput, OutOfRange

#: The material numbers of a rod and their units.
UNITS = {"bending_stiffness": "N m", "adhesion_strength": "Pa", "adhesion_range": "m"}

#: Their names, in the order of the arguments of `Rod`.
MATERIAL = tuple(UNITS)

#: eta/y0 between which answers are tested, and between which a branch is followed at all.
RATIOS, FOLLOWED = (0.005, 3000.0), (1e-6, 1e4)


@dataclass(frozen=True)
class Sheet:
    """What a rod was cut from, where that is known: its numbers may be uncertain.

    Parameters
    ----------
    youngs_modulus : float
        E [Pa].
    thickness : float
        h [m].
    poisson_ratio : float
        nu, above -1 and up to 0.5.

    Raises
    ------
    InvalidInput
    """

    youngs_modulus: float
    thickness: float
    poisson_ratio: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "youngs_modulus", positive("youngs_modulus", self.youngs_modulus, "Pa"))
        object.__setattr__(self, "thickness", positive("thickness", self.thickness, "m"))
        nu = finite("poisson_ratio", self.poisson_ratio)
        if not -1.0 < nu <= 0.5:
            raise InvalidInput(f"poisson_ratio must lie above -1 and up to 0.5, got {nu:g}.")
        object.__setattr__(self, "poisson_ratio", nu)

    @property
    def bending_stiffness(self) -> float:
        """Bent to a cylinder, per unit width, k = E h^3 / (12 (1 - nu^2)) [N m]."""
        h, nu = self.thickness, self.poisson_ratio
        # Multiplied out, a slip like 1e200 m becomes infinite, which the rod refuses.
        return self.youngs_modulus * h * h * h / (12.0 * (1.0 - nu**2))


@dataclass(frozen=True)
class Rod(Shown):
    """An inextensible rod stuck to a plate, per unit width.

    Parameters
    ----------
    bending_stiffness : float
        k [N m], for a strip of thickness h: E h^3 / (12 (1 - nu^2)).
    adhesion_strength : float
        T0 [Pa], the traction at which the bond starts to open.
    adhesion_range : float
        y0 [m], the separation at which the traction has vanished, law (8).
    sheet : Sheet, optional
        What it was cut from, as `from_sheet` knows; it says nothing that k does not, but for `uncertainty`.

    Raises
    ------
    InvalidInput
        If a number is not finite and positive.

    Examples
    --------
    >>> rod = Rod(bending_stiffness=2.3e-5, adhesion_strength=140e3, adhesion_range=0.73e-3)
    >>> round(rod.ratio, 2)
    0.75
    """

    bending_stiffness: float
    adhesion_strength: float
    adhesion_range: float
    sheet: Sheet | None = field(default=None, repr=False, compare=False, kw_only=True)

    def __post_init__(self) -> None:
        for name, unit in UNITS.items():
            object.__setattr__(self, name, positive(name, getattr(self, name), unit))
        if not isinstance(self.sheet, Sheet | None):
            raise InvalidInput(
                f"sheet must be a Sheet, got {self.sheet!r:.60}.", remedy="See Rod.from_sheet."
            )
        if self.sheet is not None and self.sheet.bending_stiffness != self.bending_stiffness:
            object.__setattr__(self, "sheet", None)  # one of another stiffness, whose copy this is

    @classmethod
    def from_ratio(cls, ratio: float) -> Rod:
        """Rod with eta/y0 = ``ratio`` in units where T0 = 1 and eta = 1."""
        return cls(1.0, 1.0, 1.0 / positive("ratio", ratio))

    @classmethod
    def from_sheet(
        cls,
        youngs_modulus: float,
        thickness: float,
        poisson_ratio: float,
        strength: float,
        work_of_separation: float,
    ) -> Rod:
        """Rod cut from a sheet, of what data sheets and peel tests say.

        Parameters
        ----------
        youngs_modulus : float
            E [Pa].
        thickness : float
            h [m].
        poisson_ratio : float
            nu, above -1 and up to 0.5.
        strength : float
            T0 [Pa], the traction at which the bond starts to open.
        work_of_separation : float
            G [J/m^2], for instance F (1 - cos phi) of a peel test, see `peel_opt.energy_release_rate`.

        Returns
        -------
        Rod
            Its k is that of the `Sheet`, its y0 is 2 G / T0, law (8).

        Raises
        ------
        InvalidInput

        Examples
        --------
        >>> tape = Rod.from_sheet("1.5 GPa", "40 um", 0.4, "0.5 MPa", "100 J/m^2")
        >>> round(tape.bending_stiffness * 1e6, 6), round(tape.adhesion_range * 1e3, 6)
        (9.52381, 0.4)
        """
        T0 = positive("strength", strength, "Pa")
        G = positive("work_of_separation", work_of_separation, "J/m^2")
        sheet = Sheet(youngs_modulus, thickness, poisson_ratio)
        return cls(sheet.bending_stiffness, T0, 2.0 * G / T0, sheet=sheet)

    @property
    def eta(self) -> float:
        """Elasto-adhesion length (k/T0)^(1/3) [m]."""
        return math.cbrt(self.bending_stiffness / self.adhesion_strength)

    @property
    def ratio(self) -> float:
        """r = eta/y0, the only number of the rod that matters without units."""
        return self.eta / self.adhesion_range

    @property
    def dimensionless(self) -> bool:
        """Whether T0 = 1 and k = 1, so that lengths are in eta and pressures in T0."""
        return self.bending_stiffness == 1.0 and self.adhesion_strength == 1.0

    @property
    def critical_length(self) -> float:
        """Detached length at T [m], equation (20)."""
        return math.pi * self.eta * math.pow(self.ratio, -0.25)

    @property
    def work_of_separation(self) -> float:
        """Work to open a unit area fully [J/m^2], T0 y0 / 2 under law (8)."""
        return 0.5 * self.adhesion_strength * self.adhesion_range

    def length_ratio(self, length: float) -> float:
        """Return sigma = sbar/eta of a detached length [m]."""
        return positive("length", length, "" if self.dimensionless else "m") / self.eta

    def pressure_ratio(self, pressure: float) -> float:
        """Return P = p/T0 of a pressure [Pa]."""
        return finite("pressure", pressure, "" if self.dimensionless else "Pa") / self.adhesion_strength

    def length(self, sigma: float) -> float:
        """Detached length [m] of sigma = sbar/eta."""
        return sigma * self.eta

    def pressure(self, pressure_ratio: float) -> float:
        """Pressure [Pa] of P = p/T0."""
        return pressure_ratio * self.adhesion_strength

    def groups(self, length: float) -> tuple[float, float]:
        """Return (beta0, beta1) of equation (11) at a detached length [m]."""
        sigma = self.length_ratio(length)
        return sigma**3, self.ratio * sigma**4

    def force(self, n_hat: float, length: float) -> float:
        """Force per width [N/m] of a scaled force N_hat at a detached length [m], (9)."""
        return n_hat * self.bending_stiffness / length**2

    def __repr__(self) -> str:
        if self.dimensionless:
            return f"Rod(eta/y0={self.ratio:.6g}; in units of T0 and eta)"
        return (
            f"Rod(k={self.bending_stiffness:.6g} N m, T0={self.adhesion_strength:.6g} Pa, "
            f"y0={self.adhesion_range:.6g} m; eta={self.eta:.4g} m, eta/y0={self.ratio:.4g})"
        )


def require_ratio(ratio: float, limits: tuple[float, float] = RATIOS) -> float:
    """Return eta/y0 if it is within limits, or say that it is not."""
    low, high = limits
    if not low <= ratio <= high:
        raise OutOfRange(
            f"eta/y0 = {ratio:.4g} is outside [{low:g}, {high:g}].",
            remedy="Check that no two material numbers are swapped or in the wrong unit.",
        )
    return ratio


def refuse_scene(subject: object) -> None:
    """Raise where a call that knows the paper's scene only is given another."""
    if isinstance(getattr(subject, "rod", None), Rod):
        raise InvalidInput(
            "this call takes a rod, and not a scene: what it reads is known for the paper's scene only.",
            remedy="Ask for states of a scene with solve, for many with answers or sweep; what its rod alone"
            " does, with scene.rod. What is read off a scene stands in docs/scenes.md.",
        )


def require_rod(rod: object, limits: tuple[float, float] = FOLLOWED) -> Rod:
    """Return ``rod`` if it is one whose branch can be followed, or say what it is instead.

    Single answers, which are tested in a narrower range, pass that as ``limits``.
    """
    refuse_scene(rod)
    if not isinstance(rod, Rod):
        raise InvalidInput(
            f"rod must be a Rod, got {rod!r:.60}.",
            remedy="Make one with Rod(k, T0, y0) or Rod.from_ratio(r).",
        )
    require_ratio(rod.ratio, limits)
    return rod


@dataclass(frozen=True)
class Units:
    """Names of the units that the numbers of a rod and of its states are in."""

    length: str
    pressure: str
    force: str
    stiffness: str

    @classmethod
    def of(cls, rod: Rod | None) -> Units:
        """Return the units that go with a rod: SI, its own eta and T0, or without one sbar and k."""
        if rod is None:
            return cls("sbar", "k/sbar^3", "k/sbar^2", "k")
        if rod.dimensionless:
            return cls("eta", "T0", "T0 eta", "T0 eta^3")
        return SI

    def of_number(self, name: str) -> str:
        """Return the unit of a number by its name, empty if it has none."""
        named = {"pressure": self.pressure, "length": self.length, "flaw": self.length}
        named |= {"youngs_modulus": self.pressure, "thickness": self.length}
        named |= {"work_of_separation": "J/m^2" if self.pressure == "Pa" else self.force}
        named |= zip(MATERIAL, (self.stiffness, self.pressure, self.length), strict=True)
        return named.get(name, "")

    def rod(self, rod: Rod | None) -> dict[str, float]:
        """Return the numbers of a rod with the unit in the key, none without one."""
        return {} if rod is None else {f"{k} [{self.of_number(k)}]": getattr(rod, k) for k in MATERIAL}


#: Units of a rod whose numbers are in SI.
SI = Units("m", "Pa", "N/m", "N m")


def rod_from(head: Mapping[str, Any]) -> Rod | None:
    """Return the rod whose numbers, with their units in the keys, are among those of a record."""
    named = {key.split(" [")[0]: value for key, value in head.items()}
    numbers = {name: named[name] for name in MATERIAL if name in named}
    return Rod(**numbers) if numbers else None
