"""`Equilibrium`: one answer, its shape, and how far to trust it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields
from functools import cached_property
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from ..base.drawing import Pictured
from ..base.errors import InvalidInput, NotCertified
from ..base.records import Schema, Stored, Table, read_csv
from ..model.groups import Groups
from ..model.labels import CERTIFIED, DISQUALIFYING
from ..model.rod import Rod
from ..residual.closures import Closure
from ..residual.shape import Shape, Solution
from .dense import DenseShape
from .storage import (
    equilibrium_head,
    equilibrium_parts,
    equilibrium_record,
    equilibrium_table,
    own_samples,
    require_agreement,
    scaled_arrays,
    shape_arrays,
    stats_from,
)

if TYPE_CHECKING:
    from ..model.scene import Scene


def verdict(error: float, certificate: float, tol: float) -> str:
    """Return the status of an answer with this error and certificate."""
    return CERTIFIED if error <= tol and certificate <= tol else NotCertified.status


@dataclass(frozen=True)
class Stats:
    """How an answer was computed.

    Parameters
    ----------
    method : str
        The transcription and its settings, as last used.
    seconds : float
    iterations : int
        Of IPOPT and of Newton together, the walk along the branch excluded.
    evaluations : int
        Of the discretised equations, with or without their Jacobian, on all meshes; inside IPOPT
        those of the constraints.
    unknowns : int
        Of the finest problem solved.
    refinements : int
        How often the mesh was refined after the first solve.
    path_points : int
        Points of the branch on the way to the answer, shared by all questions of a rod.
    condition : float
        |d answer / d given|, both dimensionless, to some 1e-4 of it; infinite at a fold.
    """

    method: str = ""
    seconds: float = 0.0
    iterations: int = 0
    evaluations: int = 0
    unknowns: int = 0
    refinements: int = 0
    path_points: int = 0
    condition: float = math.nan


@dataclass(frozen=True, eq=False)
class Equilibrium(Groups[float], Pictured, Stored):
    """A detached equilibrium of the rod.

    Numbers of the paper's groups are floats; ``nan`` where a group does not exist (P and
    sigma at beta0 = 0) or nothing was found (``status`` tells).

    Parameters
    ----------
    answered : {"pressure_ratio", "length_ratio", "alpha1"}
        The number that was asked for, to which ``error`` belongs.
    error : float
        Estimate of its absolute error, dimensionless; not smaller than the true one.
    certificate : float
        The larger of |p - Phi(y_tip)/y_tip| / T0 and |theta| at the plate [rad], which vanish for every
        exact solution; one of them was solved for, the other was not.
    law : str
        Name of the cohesive law; "linear" where it is exact.
    state : str
        "middle", "lower", "folded", "spurious" or "other".
    status : str
        "certified" if error and certificate are within ``tol``; else what went wrong.
    flags : tuple of str
        What a reader must know about the shape: "y > y0" (under the linear law), "p < 0",
        "y < 0", "alpha1 > 0", "overhang" (|theta| > pi/2), "tip on plate", "self-contact"; and
        that the nearest state is "far from near=" the value asked for, in the groups' units.
    given : dict
        The numbers that were given, by their names; attributes of the same name have them unchanged.
    law_samples : tuple of float
        What tells a law of the user's own from another of its name, where only the shape is kept.
    scene : Scene or str or None
        The scene it is a state of, if that is not the paper's; in words where it was read from a file and has
        parts or functions of the reader's own, which no file holds.
    numbers : dict
        The numbers of the scene in the units of the rod, the one that was left free as it was found.
    unit : float
        What one of ``answer`` is in the units of the rod, where that is a number of the scene.
    """

    schema = Schema("peel_opt equilibrium", 1)

    rod: Rod | None
    law: str
    beta0: float
    lam: float
    alpha1: float
    answered: str
    error: float
    certificate: float
    tol: float
    state: str
    status: str
    flags: tuple[str, ...] = ()
    message: str = ""
    stats: Stats = field(default_factory=Stats)
    source: Shape | Solution | None = field(default=None, repr=False)
    given: dict[str, float] = field(default_factory=dict, repr=False)
    law_samples: tuple[float, ...] = field(default=(), repr=False)
    scene: Scene | str | None = field(default=None, repr=False)
    numbers: dict[str, float] = field(default_factory=dict, repr=False)
    unit: float = field(default=1.0, repr=False)

    # --- the paper's groups -----------------------------------------------------------

    @property
    def beta1(self) -> float:
        """(sbar/eta)^3 sbar/y0, equation (11)."""
        return self._as_given("beta1", super().beta1)

    @property
    def pressure_ratio(self) -> float:
        """P = p/T0; nan at beta0 = 0."""
        return self._as_given("pressure_ratio", super().pressure_ratio)

    @property
    def length_ratio(self) -> float:
        """sigma = sbar/eta; nan at beta0 = 0."""
        return self._as_given("length_ratio", super().length_ratio)

    # --- in the rod's units -----------------------------------------------------------

    @property
    def pressure(self) -> float:
        """Pressure [Pa]; without a rod in k/sbar^3, that is alpha."""
        computed = self.alpha if self.rod is None else self.rod.pressure(self.pressure_ratio)
        return self._as_given("pressure", computed)

    @property
    def length(self) -> float:
        """Detached length [m]; without a rod the unit of length, 1."""
        return self._as_given("length", 1.0 if self.rod is None else self.rod.length(self.length_ratio))

    def _as_given(self, name: str, computed: float) -> float:
        """Return a number as it was given; on the way through the groups it may lose its last digit."""
        return self.given.get(name, computed)

    @property
    def answer(self) -> float:
        """The number that was asked for, over its unit of T0 and eta."""
        if self.answered in self.numbers:
            return self.numbers[self.answered] / self.unit
        return float(getattr(self, self.answered))

    @property
    def asked_at(self) -> tuple[Closure, ...]:
        """The numbers it was asked at, beside the rod or beta0 and the numbers of a scene."""
        if self.answered == "alpha1":
            return (Closure("lam", self.lam),)
        pressure, length = Closure("pressure", self.pressure_ratio), Closure("length", self.length_ratio)
        alone = {"length_ratio": (pressure,), "pressure_ratio": (length,)}
        return alone.get(self.answered, (pressure, length))

    @property
    def certified(self) -> bool:
        """Whether error and certificate are within ``tol``."""
        return self.status == CERTIFIED

    @property
    def valid(self) -> bool:
        """Whether the state is certified and physical under its law."""
        return self.certified and not any(flag in DISQUALIFYING for flag in self.flags)

    def require_papers_scene(self, reading: str) -> None:
        """Raise where it is a state of a scene that a reading does not cover.

        Raises
        ------
        InvalidInput
        """
        if self.scene is not None:
            raise InvalidInput(
                f"{reading} covers the paper's scene only: a uniform pressure under a rod on a flat plate.",
                remedy="Its loads, wall or tip are not in the equations of that reading.",
            )

    # --- shape, computed when first read ----------------------------------------------

    @cached_property
    def shape(self) -> Shape:
        """The fields in the paper's scaled variables."""
        if self.source is None:
            empty = np.empty(0)
            return Shape(*(empty,) * len(fields(Shape)))
        return self.source if isinstance(self.source, Shape) else self.source.shape()

    @property
    def _force_unit(self) -> float:
        return 1.0 if self.rod is None else self.rod.force(1.0, self.length)

    @property
    def s(self) -> np.ndarray:
        """Arc length from the free tip [m]."""
        return self.shape.xi * self.length

    @property
    def x(self) -> np.ndarray:
        """Along the plate from the detachment point [m]; the attached part has x > 0."""
        return self.shape.x * self.length

    @property
    def y(self) -> np.ndarray:
        """Height above the plate [m]."""
        return self.shape.y * self.length

    @property
    def theta(self) -> np.ndarray:
        """Angle of the tangent to the plate, anticlockwise [rad]."""
        return self.shape.theta

    @property
    def curvature(self) -> np.ndarray:
        """theta' [1/m]."""
        return self.shape.curvature / self.length

    @property
    def Nx(self) -> np.ndarray:
        """Reaction force along the plate [N/m]."""
        return self.shape.Nx * self._force_unit

    @property
    def Ny(self) -> np.ndarray:
        """Reaction force normal to the plate [N/m]."""
        return self.shape.Ny * self._force_unit

    @cached_property
    def sol(self) -> DenseShape:
        """The shape as a function of the place, ``eq.sol(s).y`` and so on: see `DenseShape`."""
        return DenseShape(self)

    @property
    def tip_angle(self) -> float:
        """theta at the free tip [rad]."""
        return float(self.theta[0])

    @property
    def tip_height(self) -> float:
        """y at the free tip [m]."""
        return float(self.y[0])

    # --- out --------------------------------------------------------------------------

    def summary(self) -> dict[str, Any]:
        """All numbers of the answer as a flat dictionary, lengths and pressures with units."""
        return equilibrium_record(self)

    def _head(self) -> dict[str, Any]:
        return equilibrium_head(self)

    def _arrays(self) -> dict[str, np.ndarray]:
        return shape_arrays(self.shape)

    def _rows_shown(self) -> list[dict[str, Any]]:
        return [{"number": name, "value": value} for name, value in self.summary().items()]

    def _table(self) -> Table:
        return equilibrium_table(self, self.schema.stamped(self._head()))

    @classmethod
    def _restored(cls, head: dict[str, Any], arrays: dict[str, np.ndarray]) -> Self:
        stats = Stats(**stats_from(head, (f.name for f in fields(Stats))))
        return cls(**equilibrium_parts(head, arrays), stats=stats)

    @classmethod
    def _read(cls, data: bytes) -> Self:
        """Read a CSV too, which holds everything, and much of it twice."""
        if data[:2] == b"PK":
            return super()._read(data)
        head, columns = read_csv(data)
        cls.schema.require(head)
        eq = cls._restored(head, scaled_arrays(columns))
        require_agreement(eq, head, columns)
        return eq

    def __getstate__(self) -> dict[str, Any]:
        state = {f.name: getattr(self, f.name) for f in fields(self)}
        state |= {"source": self.shape, "law_samples": own_samples(self)}  # compiled functions do not travel
        return state

    def __repr__(self) -> str:
        if not math.isfinite(self.alpha1):
            return f"Equilibrium(none: {self.status}; {self.message})"
        if self.rod is None:
            head = f"beta0={self.beta0:.6g}, lam={self.lam:.6g}, alpha1={self.alpha1:.10g}"
        elif self.rod.dimensionless:
            head = f"p/T0={self.pressure_ratio:.10g}, sbar/eta={self.length_ratio:.10g}"
        else:
            head = (
                f"p={self.pressure:.8g} Pa, sbar={self.length:.8g} m, "
                f"p/T0={self.pressure_ratio:.8g}, sbar/eta={self.length_ratio:.8g}"
            )
        flags = f", flags: {', '.join(self.flags)}" if self.flags else ""
        return (
            f"Equilibrium({head}; {self.state}, {self.law} law, {self.status}: "
            f"error {self.error:.1e}, certificate {self.certificate:.1e}{flags})"
        )

    @classmethod
    def nothing(cls, rod: Rod | None, answered: str, tol: float, status: str, message: str) -> Equilibrium:
        """Return the result of a question without an answer, under ``throw=False``."""
        nan = math.nan
        return cls(rod, "", nan, nan, nan, answered, nan, nan, tol, "", status, message=message)
