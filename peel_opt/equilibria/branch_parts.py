"""What a branch is made of beside its columns: special points, the straight rod, solutions."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np

from ..base.arrays import Columns, read_only
from ..base.records import titled
from ..model.bond import CohesiveLaw
from ..model.equations import SCALARS
from ..model.rod import Rod, Units
from ..residual.discretisation import Transcription

#: Columns of a branch: what is stored, in CSV and NPZ as well.
COLUMNS = ("arclength", "A", "m", "sigma", "lam", "tip_u", "error", "certificate", "iterations")

#: Columns that a branch may have: counts of its stability, and the angles of tips in a scene.
OPTIONAL = ("index", "flutter", "angle")

#: How pieces of a law are counted in texts: from "0" on, through ASCII.
FIRST = ord("0")


@dataclass(frozen=True)
class SpecialPoint:
    """A special point of a branch.

    Parameters
    ----------
    kind : str
        "BP" (branch point of the straight rod), "LP-lambda", "LP-length", "LP-pressure" and
        "LP-ratio" (folds), "y=y0" (the rod reaches the end of the bond), "contact" (the tip touches
        the plate), "self-contact" (the rod meets itself).
    status : {"located", "bracketed", "exact"}
    bracket : tuple of float
        Arclengths between which it lies on the branch as it is discretised.
    index : int
        Position in the arrays of the branch.
    beta0, lam, alpha1, pressure_ratio, length_ratio : float
    error : float
        How far it may be from its place on the exact branch, in the metric of the arclength: what a
        finer mesh moves it by, along the branch and across, with the bracket and rounding.  At a fold
        the number that folds is better than that by far, the others are not.  Infinite if it is not known.
    rod : Rod, optional
        That of its branch, in whose units are `pressure` and `length`.
    """

    kind: str
    status: str
    bracket: tuple[float, float]
    index: int
    beta0: float
    lam: float
    alpha1: float
    pressure_ratio: float
    length_ratio: float
    error: float = math.inf
    rod: Rod | None = field(default=None, repr=False, compare=False)

    @property
    def pressure(self) -> float:
        """Pressure [Pa]; without a rod alpha, as along its branch."""
        return self.beta0 + self.alpha1 if self.rod is None else self.rod.pressure(self.pressure_ratio)

    @property
    def length(self) -> float:
        """Detached length [m]; without a rod over eta."""
        return self.length_ratio if self.rod is None else self.rod.length(self.length_ratio)

    @property
    def numbers(self) -> dict[str, Any]:
        """All that is said of it but the rod, as files have it."""
        return {f.name: getattr(self, f.name) for f in fields(self) if f.name != "rod"}

    @property
    def in_units(self) -> dict[str, float]:
        """Pressure and length in the units of the rod, which the names have; nothing without one."""
        if self.rod is None:
            return {}
        units = Units.of(self.rod)
        return {
            titled("pressure", units.pressure): self.pressure,
            titled("length", units.length): self.length,
        }


@dataclass(frozen=True, eq=False, repr=False)
class Trivial(Columns):
    """The straight rod at p = T0, for every lambda: alpha1 = 0."""

    lam: np.ndarray
    special_points: tuple[SpecialPoint, ...]

    def __post_init__(self) -> None:
        object.__setattr__(self, "lam", read_only(self.lam))

    @property
    def alpha1(self) -> np.ndarray:
        """Zero, shape (n,)."""
        return np.zeros_like(self.lam)


@dataclass(frozen=True, eq=False)
class Solutions:
    """The discrete solutions behind the arrays, for restarts and shapes.

    Parameters
    ----------
    transcription : str
        As its ``repr``.
    phases : tuple of str
        Pieces of the law from tip to plate at each point, "10" for free then cohesive; the
        characters after "9" in ASCII go on counting.
    unknowns : tuple of ndarray
    tangents : tuple of ndarray
    law : CohesiveLaw, optional
        Missing where the branch was read from a file.
    law_samples : tuple of float
        What a law must give to be that of a file; empty in files that do not say.
    mesh : Transcription, optional
        The transcription itself; missing where the branch was read from a file.
    """

    transcription: str
    phases: tuple[str, ...]
    unknowns: tuple[np.ndarray, ...]
    tangents: tuple[np.ndarray, ...]
    law: CohesiveLaw | None = None
    law_samples: tuple[float, ...] = ()
    mesh: Transcription | None = None

    def __post_init__(self) -> None:
        for name in ("unknowns", "tangents"):
            object.__setattr__(self, name, tuple(map(read_only, getattr(self, name))))

    @property
    def scalars(self) -> np.ndarray:
        """The scalars at each point, in which all unknowns end, shape (n, scalars)."""
        return np.array([x[-len(SCALARS) :] for x in self.unknowns])

    @property
    def rates(self) -> np.ndarray:
        """Their derivatives along the branch, shape (n, scalars)."""
        return np.array([tangent[-len(SCALARS) :] for tangent in self.tangents])
