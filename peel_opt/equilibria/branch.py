"""`Branch`: a traced curve of equilibria as immutable arrays, with its special points."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from ..base.arrays import read_only
from ..base.checks import positive
from ..base.drawing import Pictured, draw
from ..base.errors import InvalidInput
from ..base.records import Schema, Stored, Table
from ..base.threads import one_thread
from ..model.groups import AmplitudeGroups
from ..model.labels import SPECIAL_KINDS
from ..model.rod import Rod
from ..residual.motions import Spectrum
from .branch_crossings import states_at
from .branch_files import branch_arrays, branch_head, branch_parts, branch_table, special_rows
from .branch_parts import COLUMNS, OPTIONAL, Solutions, SpecialPoint, Trivial
from .branch_points import discretised, equilibrium_at, under_law

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ..model.bond import CohesiveLaw
    from ..model.scene import Scene
    from ..residual.discretisation import Discretisation
    from .result import Equilibrium


@dataclass(frozen=True, eq=False)
class Branch(AmplitudeGroups[np.ndarray], Pictured, Stored):
    """A curve of equilibria.

    Arrays have shape (n,) and cannot be written to.  ``len``, iteration and indexing go over
    points, as NumPy's does: ``branch[i]`` is the `Equilibrium` there, ``branch[a:b]``,
    ``branch[branch.pressure > 5e4]`` and ``branch[[0, 4, 8]]`` are branches.

    Parameters
    ----------
    law : str
    hold : str
        What is the same along it: "ratio", "beta0", "pressure_ratio", "lam", "alpha1", "tip_angle".
    held : float
        Its value.
    rod : Rod or None
    arclength : ndarray
        Length along the branch in the metric of the continuation.
    A : ndarray
        Minus the tip angle [rad].
    m : ndarray
        alpha1/A, finite also at T.
    sigma : ndarray
        sbar/eta.
    lam : ndarray
    tip_u : ndarray
        Height of the tip over y0; nan at beta0 = 0.
    error : ndarray
        Estimated distance of each point from the exact branch, in the metric of the arclength.
    certificate : ndarray
        The larger of |p - Phi(y_tip)/y_tip| / T0 and |theta| at the plate [rad].
    iterations : ndarray
        Newton iterations of each point; 0 of points that were found together.
    state : ndarray of str
    special_points : tuple of SpecialPoint
    trivial : Trivial or None
    ended : str
        Why the walk stopped: "contact", "window", "p < 0", "limit", "stalled", "slice"; of a scene also the
        words of its `SceneTrace`.
    options : dict
        What the trace was asked for.
    index : ndarray or None
        Number of negative real eigenvalues at fixed pressure, as ``stability(branch[i]).index``,
        where it has been computed: see `with_stability`.
    flutter : ndarray or None
        Number of fluttering pairs of eigenvalues, as ``stability(branch[i]).flutter``.
    scene : Scene or str or None
        The scene whose branch it is, if that is not the paper's; in words where it was read from a file and
        has parts or functions of the reader's own.
    angle : ndarray or None
        theta at the tip [rad] of a scene, whose amplitude counts from the wall or is that of a middle.
    cuts : tuple of int
        Rows that do not go on from the row before, of a selection that leaves out what is between.
    """

    #: Some 40 000 points of three phases each.
    schema = Schema("peel_opt branch", 2, largest=512_000_000)

    law: str
    hold: str
    held: float
    rod: Rod | None
    arclength: np.ndarray
    A: np.ndarray
    m: np.ndarray
    sigma: np.ndarray
    lam: np.ndarray
    tip_u: np.ndarray
    error: np.ndarray
    certificate: np.ndarray
    iterations: np.ndarray
    state: np.ndarray
    special_points: tuple[SpecialPoint, ...] = ()
    trivial: Trivial | None = None
    ended: str = ""
    options: dict[str, Any] = field(default_factory=dict)
    solutions: Solutions | None = field(default=None, repr=False)
    index: np.ndarray | None = None
    flutter: np.ndarray | None = None
    scene: Scene | str | None = field(default=None, repr=False)
    angle: np.ndarray | None = field(default=None, repr=False)
    cuts: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        for name in (*COLUMNS, "state"):
            object.__setattr__(self, name, read_only(getattr(self, name)))
        for name in OPTIONAL:
            if getattr(self, name) is not None:
                object.__setattr__(self, name, read_only(getattr(self, name)))
        special = tuple(p if p.rod is self.rod else replace(p, rod=self.rod) for p in self.special_points)
        object.__setattr__(self, "special_points", special)

    # --- numbers along the branch -------------------------------------------------------

    @property
    def tip_angle(self) -> np.ndarray:
        """theta at the tip [rad]."""
        return -self.A if self.angle is None else self.angle

    @property
    def tip_height(self) -> np.ndarray:
        """y at the tip [m]; without a rod over y0."""
        return self.tip_u if self.rod is None else self.tip_u * self.rod.adhesion_range

    @property
    def pressure(self) -> np.ndarray:
        """Pressure [Pa]; without a rod alpha."""
        return self.alpha if self.rod is None else self.pressure_ratio * self.rod.adhesion_strength

    @property
    def length(self) -> np.ndarray:
        """Detached length [m]; without a rod over eta."""
        return self.sigma if self.rod is None else self.sigma * self.rod.eta

    @property
    def spurious(self) -> np.ndarray:
        """Where the state is not one of a rod on a plate: y < 0, alpha1 > 0."""
        return self.state == "spurious"

    @property
    def unstable(self) -> np.ndarray | None:
        """Where a small motion grows at fixed pressure; None where that has not been computed."""
        if self.index is None or self.flutter is None:
            return None
        unstable: np.ndarray = (self.index > 0) | (self.flutter > 0)
        return unstable

    @property
    def pieces(self) -> tuple[slice, ...]:
        """Stretches without a gap: several where a branch leaves its window of lambda and comes back.

        Of a selection also where it leaves out what is between.
        """
        borders = self.options.get("lam", ())
        at_border = np.isin(self.lam, borders)
        again = np.flatnonzero((self.lam[:-1] == self.lam[1:]) & at_border[:-1]) + 1
        edges = [0, *sorted({*again.tolist(), *self.cuts}), len(self)]
        return tuple(slice(a, b) for a, b in pairwise(edges))

    # --- points -------------------------------------------------------------------------

    def __len__(self) -> int:
        return len(self.lam)

    def __getitem__(self, which: Any) -> Any:
        rows = self._rows(which)
        return self._selected(rows, self._cuts(which, rows)) if rows.ndim else equilibrium_at(self, int(rows))

    def _rows(self, which: Any) -> np.ndarray:
        """Return the row, or the rows, that an index means to NumPy."""
        rows = np.asarray(np.arange(len(self))[which])
        if rows.ndim > 1:
            raise IndexError("a branch has one axis")
        return rows

    def _cuts(self, which: Any, rows: np.ndarray) -> tuple[int, ...]:
        """Return where some rows do not go on from those before."""
        owner = np.zeros(len(self), dtype=int)
        for number, piece in enumerate(self.pieces):
            owner[piece] = number
        parted = np.diff(owner[rows]) != 0
        if np.asarray(which).dtype == bool:
            parted |= np.diff(rows) > 1
        return tuple((np.flatnonzero(parted) + 1).tolist())

    def __iter__(self) -> Iterator[Any]:
        return (self[i] for i in range(len(self)))

    @property
    def carries_solutions(self) -> bool:
        """Whether it has what was solved at its points, beside the numbers of its columns."""
        return self.solutions is not None

    def solution_at(self, i: int) -> tuple[Discretisation, np.ndarray]:
        """Return the discrete problem of a point and its solution.

        Raises
        ------
        InvalidInput
            If the branch carries none.
        """
        return discretised(self, i)

    def at(
        self,
        *,
        pressure: Any = None,
        length: Any = None,
        pressure_ratio: float | None = None,
        length_ratio: float | None = None,
        lam: float | None = None,
        alpha1: float | None = None,
        tip_angle: float | None = None,
        state: str | None = None,
        near: Any = None,
        tol: float = 1e-8,
    ) -> list[Equilibrium]:
        """Return every state of the branch at a given number, in order along it, each solved for.

        Parameters
        ----------
        pressure, length : float or str, optional
            In the rod's units [Pa, m], or with one, as "60 kPa".
        pressure_ratio, length_ratio, lam, alpha1, tip_angle : float, optional
            One of these in their place; `tip_angle` in rad.
        state : str, optional
            Of these only the "middle", "lower", "unfolded", "folded" ... ones.
        near : float, str or Equilibrium, optional
            Of these only the one whose answer is nearest: a length at a given pressure; at a given length, or
            tip angle, a pressure; alpha1 where the branch has no rod.
        tol : float
            For error and certificate of each.

        Returns
        -------
        list of Equilibrium
            One with ``near``, else one for each crossing.

        Raises
        ------
        InvalidInput
            If not one number is given, it has no such unit, or the branch carries no solutions.
        NoEquilibrium
            If the branch does not take the value, or not in this state; ``nearest`` is one that it takes.
        NotConverged, NotCertified
            If a state cannot be solved for to ``tol``; right at a fold it is ill-conditioned.

        Examples
        --------
        >>> from peel_opt import Rod, trace
        >>> [eq.state for eq in trace(Rod.from_ratio(1.0)).at(pressure=0.2)]
        ['lower', 'folded']
        """
        numbers = {
            "pressure": pressure,
            "length": length,
            "pressure_ratio": pressure_ratio,
            "length_ratio": length_ratio,
            "lam": lam,
            "alpha1": alpha1,
            "tip_angle": tip_angle,
        }
        tol = positive("tol", tol)
        with one_thread:
            return states_at(self, numbers, state, near, tol)

    def _selected(self, rows: np.ndarray, cuts: tuple[int, ...]) -> Branch:
        place = {row: i for i, row in reversed(list(enumerate(rows.tolist())))}
        kept = tuple(replace(p, index=place[p.index]) for p in self.special_points if p.index in place)
        columns = {name: getattr(self, name)[rows] for name in (*COLUMNS, "state")}
        solutions = self.solutions
        if solutions is not None:
            solutions = replace(
                solutions,
                phases=tuple(solutions.phases[i] for i in rows),
                unknowns=tuple(solutions.unknowns[i] for i in rows),
                tangents=tuple(solutions.tangents[i] for i in rows),
            )
        for name in OPTIONAL:
            column = getattr(self, name)
            columns[name] = None if column is None else column[rows]
        return replace(self, **columns, special_points=kept, solutions=solutions, cuts=cuts, ended="slice")

    def special(self, kind: str) -> tuple[SpecialPoint, ...]:
        """Special points of one kind, in order along the branch; none where the branch has none of them.

        Raises
        ------
        InvalidInput
            If there is no such kind.
        """
        known = dict.fromkeys([*SPECIAL_KINDS, *(p.kind for p in self.special_points)])
        if kind not in known:
            raise InvalidInput(
                f"there is no kind of special point {kind!r}.", remedy=f"Kinds are {', '.join(known)}."
            )
        return tuple(p for p in self.special_points if p.kind == kind)

    # --- out ----------------------------------------------------------------------------

    def plot(
        self,
        ax: Axes | None = None,
        x: str | None = None,
        y: str | None = None,
        *,
        legend: bool = True,
        title: str | None = None,
        log: bool | None = None,
    ) -> Axes:
        """Draw the branch: (lambda, alpha1) at fixed beta0, (sbar, p) for a rod: see `plot_branch`.

        Parameters
        ----------
        ax : Axes, optional
        x, y : str, optional
            Names of columns.
        legend : bool, optional
        title : str, optional
        log : bool, optional
            Whether axes are logarithmic; default: those along which the branch spans decades.

        Returns
        -------
        Axes
        """
        return draw(self, ax, x=x, y=y, log=log, legend=legend, title=title)

    @one_thread
    def with_stability(self) -> Branch:
        """Return the branch with ``index`` and ``flutter`` computed, where it carries its solutions."""
        if self.index is not None or not self.carries_solutions:
            return self
        found = [Spectrum(*self.solution_at(i)) for i in range(len(self))]
        index, flutter = np.array([(s.index, s.flutter) for s in found], dtype=int).reshape(-1, 2).T
        return replace(self, index=index, flutter=flutter)

    def _head(self) -> dict[str, Any]:
        return branch_head(self)

    def _arrays(self) -> dict[str, np.ndarray]:
        return branch_arrays(self)

    def _rows_shown(self) -> list[dict[str, Any]]:
        return special_rows(self)

    def _table(self) -> Table:
        return branch_table(self, self.schema.stamped(self._head()))

    @classmethod
    def _restored(cls, head: dict[str, Any], arrays: dict[str, np.ndarray]) -> Self:
        return cls(**branch_parts(head, arrays))

    @classmethod
    def load(cls, path: str | Path, law: CohesiveLaw | None = None) -> Self:
        """Read what `save` wrote; a branch under a law of your own is taken up again with that ``law``.

        Parameters
        ----------
        path : str or Path
        law : CohesiveLaw, optional

        Returns
        -------
        Branch

        Raises
        ------
        InvalidInput
            If the file cannot be read, is damaged, of a later version, or is not such a file; or if
            ``law`` is not the one the branch was traced with.
        """
        branch = super().load(path)
        return branch if law is None else under_law(branch, law)

    def __repr__(self) -> str:
        return "\n".join(self._tree())

    def _tree(self) -> list[str]:
        held = f"{self.hold} = {self.held:.6g}" if self.rod is None else repr(self.rod)
        lines = [f"Branch of {len(self)} points, {self.law} law, {held}"]
        if len(self):
            ranges = {"lambda": self.lam, "alpha1": self.alpha1}
            if np.all(self.beta0 > 0.0):
                ranges |= {"p/T0": self.pressure_ratio, "sbar/eta": self.sigma}
            lines += [f"├─ {name} {v.min() + 0.0:.6g} to {v.max() + 0.0:.6g}" for name, v in ranges.items()]
            lines.append(
                f"├─ error up to {self.error.max():.1e}, certificate up to {self.certificate.max():.1e}"
            )
        with_units = self.rod is not None and not self.rod.dimensionless
        lines += [
            f"├─ {p.kind:<11} "
            + (f"p = {p.pressure:.8g} Pa, sbar = {p.length:.8g} m, " if with_units else "")
            + f"p/T0 = {p.pressure_ratio:.9g}, sbar/eta = {p.length_ratio:.9g},"
            f" lambda = {p.lam:.9g}, alpha1 = {p.alpha1:.9g} ({p.status})"
            for p in self.special_points
        ]
        return [*lines, f"└─ ended: {self.ended}"]


def require_branch(branch: object) -> Branch:
    """Return ``branch`` if it is one, or say what it is instead."""
    if not isinstance(branch, Branch):
        raise InvalidInput(f"branch must be a Branch, got {branch!r:.60}.", remedy="Make one with trace.")
    return branch
