"""What makes a rod, as people know it: k or a sheet, and two of T0, y0 and the work of separation.

A rod is k, T0 and y0.  With a sheet k = E h^3 / (12 (1 - nu^2)), and the work of separation
G = T0 y0 / 2 takes the place of one of the other two: which, is seen from what is uncertain and what is held.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np

from ...base.errors import InvalidInput
from ...model.rod import MATERIAL, Rod, Sheet

#: Inputs of a sheet, in the order of `Sheet`, and of the bond.
SHEET = ("youngs_modulus", "thickness", "poisson_ratio")
BOND = ("adhesion_strength", "adhesion_range", "work_of_separation")


@dataclass(frozen=True)
class Ingredients:
    """The inputs that make a rod.

    Parameters
    ----------
    rod : Rod
        The nominal one.
    of_sheet : bool
        Whether k is that of a sheet.
    derived : str
        The one of `BOND` that follows from the others.
    """

    rod: Rod
    of_sheet: bool
    derived: str

    @classmethod
    def of(cls, rod: Rod, uncertain: Collection[str], hold: str | None = None) -> Ingredients:
        """Return the inputs that make a rod of which some are uncertain.

        Parameters
        ----------
        rod : Rod
        uncertain : collection of str
        hold : str, optional
            One of `BOND` that is certain and stays where another one varies.

        Raises
        ------
        InvalidInput
            If the inputs say one thing twice, or the rod does not know its sheet.
        """
        named = [name for name in SHEET if name in uncertain]
        if named and rod.sheet is None:
            raise InvalidInput(
                f"the rod does not say what it was cut from, so that {named[0]} cannot be uncertain.",
                remedy="Make it with Rod.from_sheet, or give the spread of bending_stiffness.",
            )
        if named and "bending_stiffness" in uncertain:
            raise InvalidInput(
                f"bending_stiffness follows from {named[0]}: the spread of one is that of both."
            )
        bond = [name for name in BOND if name in uncertain]
        if hold is not None and hold not in BOND:
            raise InvalidInput(f"cannot hold {hold!r}.", remedy=f"Choose one of {', '.join(BOND)}.")
        if hold in bond:
            raise InvalidInput(f"{hold} is held and uncertain at once.")
        if len(bond) > 2 or (len(bond) == 2 and hold is not None):
            raise InvalidInput(
                "two of adhesion_strength, adhesion_range and work_of_separation say the third:"
                f" {', '.join([*bond, *([f'{hold} held'] if hold else [])])} are too many."
            )
        kept = {*bond, *([hold] if hold else [])}
        # G follows if it may; else y0, which nobody measures.
        order = ("work_of_separation", "adhesion_range", "adhesion_strength")
        return cls(rod, bool(named), next(name for name in order if name not in kept))

    @property
    def nominal(self) -> dict[str, float]:
        """The nominal value of every input, in the rod's units."""
        stiffness = ("bending_stiffness",)
        values = {name: getattr(self.rod, name) for name in (() if self.of_sheet else stiffness)}
        values |= {name: getattr(self.rod.sheet, name) for name in (SHEET if self.of_sheet else ())}
        return values | {name: getattr(self.rod, name) for name in BOND if name != self.derived}

    def moved_by(self, inputs: Collection[str]) -> set[str]:
        """Return which of k, T0 and y0 vary with some inputs."""
        moved = {"bending_stiffness"} if {"bending_stiffness", *SHEET} & set(inputs) else set()
        bond = set(inputs) & set(BOND)
        if not bond:
            return moved
        return moved | ({*bond, self.derived} & set(MATERIAL))

    def numbers(self, points: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
        """Return k, T0 and y0 at every point; negative where the inputs make no rod.

        Parameters
        ----------
        points : mapping of str to ndarray, shape (points,)
            Every input of `nominal`.
        """
        sound = np.ones(len(next(iter(points.values()))), dtype=bool)
        if self.of_sheet:
            E, h, nu = (points[name] for name in SHEET)
            sound &= (E > 0.0) & (h > 0.0) & (nu > -1.0) & (nu <= 0.5)
            k = E * h**3 / (12.0 * (1.0 - np.where(sound, nu, 0.0) ** 2))
        else:
            k = points["bending_stiffness"]
        known = {name: points[name] for name in BOND if name != self.derived}
        sound &= np.all([value > 0.0 for value in known.values()], axis=0)
        safe = {name: np.where(sound, value, 1.0) for name, value in known.items()}
        if "work_of_separation" in known:
            other = next(name for name in known if name != "work_of_separation")
            safe[self.derived] = 2.0 * safe["work_of_separation"] / safe[other]
        found = {"bending_stiffness": k} | {name: safe[name] for name in MATERIAL[1:]}
        return {name: np.where(sound, value, -1.0) for name, value in found.items()}

    def slopes(self, derivatives: Mapping[str, float]) -> dict[str, float]:
        """Return derivatives by the inputs from those by k, T0 and y0; what else there is stays."""
        d = dict(derivatives)
        rod, G = self.rod, self.rod.work_of_separation
        by_k, by_T0, by_y0 = (d.pop(name, 0.0) for name in MATERIAL)
        T0, y0 = rod.adhesion_strength, rod.adhesion_range
        bond = {
            "work_of_separation": {"adhesion_strength": by_T0, "adhesion_range": by_y0},
            "adhesion_range": {
                "adhesion_strength": by_T0 - by_y0 * y0 / T0,
                "work_of_separation": by_y0 * y0 / G,
            },
            "adhesion_strength": {
                "adhesion_range": by_y0 - by_T0 * T0 / y0,
                "work_of_separation": by_T0 * T0 / G,
            },
        }[self.derived]
        return {**self._of_stiffness(by_k), **bond, **d}

    def _of_stiffness(self, by_k: float) -> dict[str, float]:
        """Return derivatives by what makes the stiffness."""
        sheet, k = self.rod.sheet, self.rod.bending_stiffness
        if not self.of_sheet:
            return {"bending_stiffness": by_k}
        assert isinstance(sheet, Sheet)
        nu = sheet.poisson_ratio
        return {
            "youngs_modulus": by_k * k / sheet.youngs_modulus,
            "thickness": by_k * 3.0 * k / sheet.thickness,
            "poisson_ratio": by_k * 2.0 * nu * k / (1.0 - nu**2),
        }
