"""What a sweep asks: axes into points, points into chunks, all of it in one fixed order.

The order in which points are computed and the chunks they are computed in depend on the axes
alone, never on who computes them: that is what makes a sweep the same bits everywhere.
Points of one rod stand together, so that the branch walked for one serves the next; of a scene, whose
branch takes a second or so, every set of numbers has chunks of its own.
"""

from __future__ import annotations

import hashlib
import json
import math
import reprlib
from collections.abc import Container, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from ... import __version__
from ...base.checks import positive
from ...base.errors import InvalidInput
from ...base.units import in_si
from ...equilibria.methods import Method, as_method
from ...equilibria.question import ASKS, known_law, rod_questions
from ...equilibria.scenes import SCENE_STATES, plain_law, refuse_options, scene_method
from ...model.bond import CohesiveLaw
from ...model.labels import STATES, known_state
from ...model.law_samples import texts
from ...model.rod import MATERIAL, SI, Rod, Units
from ...model.scene import Scene
from ...model.scene_record import identity_of
from ...residual.discretisation import Transcription

#: Points of a chunk: at 0.2 to 25 ms each, what an interruption may cost, against a submission
#: and one walk along the branch.
CHUNK = 100

#: More would not fit into memory as results: a point takes up to 1.5 kB, most of it its message.
MOST_POINTS = 5_000_000

#: What is given of a rod, in its units or without one.
GIVEN = {name: asks for asks in rod_questions().values() for name in (asks.given.name, asks.given.attribute)}
GROUPS = ("beta0", "beta1", "lam")
NAMES = (*MATERIAL, "ratio", *GIVEN, *GROUPS)


#: What the points start from: where the numbers come from that neither vary nor are fixed.
Subject = Rod | Scene | None


@dataclass(frozen=True, eq=False)
class Options:
    """How every point of a sweep is answered; keywords of the single calls."""

    law: str | CohesiveLaw | None = None
    state: str | None = None
    tol: float = 1e-8
    method: str | Method | Transcription = "auto"

    def __post_init__(self) -> None:
        positive("tol", self.tol)
        as_method(self.method)
        if self.law is not None:
            known_law(self.law)

    def keywords(self) -> dict[str, Any]:
        """Return what to pass to a single call."""
        given = {"law": self.law} if self.law is not None else {}
        return given | {"state": self.state, "tol": self.tol, "method": self.method}

    def record(self) -> dict[str, str]:
        """Return the options as texts that are the same in every process."""
        law = self.law.name if isinstance(self.law, CohesiveLaw) else self.law or "default"
        method = self.method if isinstance(self.method, str) else repr(self.method)
        return {"law": law, "state": self.state or "default", "tol": repr(self.tol), "method": method}

    def identity(self) -> list[Any]:
        """Return what tells one set of options from another; a law by its values."""
        return [self.record(), texts(self.law) if isinstance(self.law, CohesiveLaw) else []]


@dataclass(frozen=True, eq=False)
class Plan:
    """The points of a sweep.

    Parameters
    ----------
    axes : dict of str to ndarray, shape (n_i,)
        What varies, in order.
    fixed : dict of str to float
        What is the same for all points.
    subject : Rod, Scene or None
        Where the numbers come from that neither vary nor are fixed.
    zipped : bool
        Whether the axes are columns of a list of points instead of the sides of a grid.
    options : Options
    """

    axes: dict[str, np.ndarray]
    fixed: dict[str, float]
    subject: Subject
    zipped: bool
    options: Options

    @classmethod
    def of(cls, axes: Mapping[str, Any], subject: Subject, zipped: bool, options: Options) -> Plan:
        """Check what a caller gave; the paper's scene is its rod.

        Raises
        ------
        InvalidInput
            If the axes do not make one question about one rod or scene at every point.
        """
        if not isinstance(axes, Mapping) or not axes:
            raise InvalidInput(
                f"axes must be a table of names and values, got {reprlib.repr(axes)}.",
                remedy="For instance {'ratio': [0.5, 1.0], 'pressure_ratio': [0.4, 0.6, 0.8]}.",
            )
        if not isinstance(subject, Rod | Scene | None):
            raise InvalidInput(f"rod must be a Rod or a Scene, got {reprlib.repr(subject)}.")
        subject, options = settled(subject, options)
        scene = subject if isinstance(subject, Scene) else None
        known_state(options.state, among=SCENE_STATES if scene else STATES)
        units = _units({str(name) for name in axes}, rod_of(subject))
        arrays = {str(name): _values(str(name), values, units, scene) for name, values in axes.items()}
        varied = {name: values for name, values in arrays.items() if values.ndim}
        fixed = {name: float(values) for name, values in arrays.items() if not values.ndim}
        if not varied:
            raise InvalidInput("a sweep needs at least one axis of several values, all are single numbers.")
        lengths = {name: len(values) for name, values in varied.items()}
        if zipped and len(set(lengths.values())) > 1:
            raise InvalidInput(f"the columns of a list of points must be equally long, got {lengths}.")
        _check_question(set(arrays), subject)
        plan = cls(varied, fixed, subject, zipped, options)
        if (count := math.prod(plan.shape)) > MOST_POINTS:
            raise InvalidInput(
                f"a sweep of {count} points is too large; the limit is {MOST_POINTS}.",
                remedy="Cut it into several.",
            )
        return plan

    def __len__(self) -> int:
        return math.prod(self.shape)

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the result arrays: one side an axis, or the length of the list."""
        sizes = tuple(len(values) for values in self.axes.values())
        return sizes[:1] if self.zipped else sizes

    @property
    def given(self) -> str:
        """The given number of the question: one of pressure, length, ..., lam, beta1."""
        return given_among({*self.axes, *self.fixed})

    @property
    def asked(self) -> str:
        """The answered number: "pressure", "length", or their ratios, or "alpha1"."""
        given, asked = GIVEN.get(self.given) or ASKS[self.given]
        return asked.attribute if self.units is None or self.given == given.attribute else asked.name

    @property
    def units(self) -> Units | None:
        """Units of what has any, those of the rod the points start from; None with ratios or groups only."""
        return _units({*self.axes, *self.fixed}, self.rod)

    @property
    def rod(self) -> Rod | None:
        """The rod that the points start from, also that of a scene."""
        return rod_of(self.subject)

    @property
    def scene_units(self) -> dict[str, str]:
        """Units of the numbers of a scene that vary or are fixed, by name."""
        if not isinstance(self.subject, Scene):
            return {}
        return {
            name: _unit_in_scene(name, self.units, self.subject)
            for name in self.subject.numbers
            if name in self.axes or name in self.fixed
        }

    @cached_property
    def columns(self) -> dict[str, np.ndarray]:
        """Every varied and fixed number at every point, each of shape (points,)."""
        arrays = list(self.axes.values())
        if not self.zipped:
            arrays = [side.ravel() for side in np.meshgrid(*arrays, indexing="ij")]
        varied = dict(zip(self.axes, arrays, strict=True))
        return varied | {name: np.full(len(self), value) for name, value in self.fixed.items()}

    @cached_property
    def chunks(self) -> list[np.ndarray]:
        """Indices of the points of each chunk: whole rods where they fit, cut where they do not."""
        scene = self.subject if isinstance(self.subject, Scene) else None
        telling = (*MATERIAL, "ratio", *GROUPS, *(scene.numbers if scene else ()))
        identity = [self.columns[name] for name in telling if name in self.columns]
        if identity:
            _, rods = np.unique(np.stack(identity, axis=1), axis=0, return_inverse=True)
        else:
            rods = np.zeros(len(self), dtype=int)
        order = np.argsort(rods.ravel(), kind="stable")
        starts = np.flatnonzero(np.diff(rods.ravel()[order])) + 1
        chunks: list[np.ndarray] = []
        waiting: list[np.ndarray] = []
        for group in np.split(order, starts):
            if waiting and (scene or sum(map(len, waiting)) + len(group) > CHUNK):
                chunks.append(np.concatenate(waiting))
                waiting = []
            if len(group) > CHUNK:
                chunks += np.array_split(group, -(-len(group) // CHUNK))
            else:
                waiting.append(group)
        return [*chunks, np.concatenate(waiting)] if waiting else chunks

    def fingerprint(self) -> str:
        """Return what tells this sweep from every other: a digest of its axes, subject, options and chunks.

        And of the release: what another one answered is not what this one would.
        """
        material = None if self.rod is None else [getattr(self.rod, name).hex() for name in MATERIAL]
        scene = identity_of(self.subject) if isinstance(self.subject, Scene) else []
        identity = [
            [[name, [v.hex() for v in values.tolist()]] for name, values in self.axes.items()],
            [[name, value.hex()] for name, value in self.fixed.items()],
            [material, scene, self.zipped, self.options.identity(), CHUNK, __version__],
        ]
        return hashlib.sha256(json.dumps(identity).encode()).hexdigest()

    def record(self) -> dict[str, str]:
        """Return the options as texts, and the scene in words."""
        scene = {"scene": repr(self.subject)} if isinstance(self.subject, Scene) else {}
        return self.options.record() | scene

    def tasks(self) -> Iterator[Task]:
        """Yield what is to be computed, chunk by chunk."""
        names = tuple(self.columns)
        for number, indices in enumerate(self.chunks):
            values = np.stack([self.columns[name][indices] for name in names], axis=1)
            yield Task(number, names, values, self.subject, self.options)


@dataclass(frozen=True, eq=False)
class Task:
    """One chunk: the numbers of its points, shape (points, names), as they travel to a worker."""

    number: int
    names: tuple[str, ...]
    values: np.ndarray
    subject: Subject
    options: Options


def settled(subject: Subject, options: Options) -> tuple[Subject, Options]:
    """Return what is asked about, and how: the paper's scene is its rod under its law.

    Raises
    ------
    InvalidInput
        If the options say what a scene has, or what is for rods only.
    """
    if not isinstance(subject, Scene):
        return subject, options
    refuse_options(law=options.law or "auto")
    scene_method(options.method)
    return (subject.rod, replace(options, law=plain_law(subject))) if subject.is_plain else (subject, options)


def rod_of(subject: Subject) -> Rod | None:
    """Return a rod, or that of a scene."""
    return subject.rod if isinstance(subject, Scene) else subject


def _unit_in_scene(name: str, units: Units | None, scene: Scene) -> str:
    """Return the unit of a number of a scene, where pressures and lengths have these units."""
    dimension = scene.dimensions[name]
    return dimension.unit if units == SI else dimension.unit_of(scene.rod)


def _units(names: set[str], rod: Rod | None) -> Units | None:
    """Return the units of numbers of these names; None if none of them has any."""
    if names & {"ratio", "beta0"}:
        return None
    own = rod is not None and not names >= set(MATERIAL)
    return Units.of(rod) if own else SI


def given_among(names: Container[str]) -> str:
    """Return which of the names is that of the given number of the question."""
    return next(name for name in (*GIVEN, *ASKS) if name in names)


def si_of(name: str, units: Units | None) -> str:
    """Return the SI unit of a number by its name, empty where it is a ratio."""
    return SI.of_number(name) if units == SI else ""


def _values(name: str, values: Any, units: Units | None, scene: Scene | None) -> np.ndarray:
    of_scene = scene is not None and name in scene.numbers
    if name not in NAMES and not of_scene:
        import difflib

        known = (*NAMES, *(scene.numbers if scene else ()))
        near = difflib.get_close_matches(name, known, n=1, cutoff=0.5)
        meant = f"Did you mean {near[0]!r}?" if near else f"Known are {', '.join(known)}."
        if scene is not None:
            meant += " To vary a number that is zero in the scene, name its part there, with any size."
        raise InvalidInput(f"a sweep has no axis {name!r}.", remedy=meant)
    if scene is not None and of_scene:
        si = scene.dimensions[name].unit if units == SI else ""
    else:
        si = si_of(name, units)
    values = in_si(f"the axis {name!r}", values, si)
    try:
        # A masked number is one that is not there.
        given = values.filled(np.nan) if isinstance(values, np.ma.MaskedArray) else np.array(values)
    except (OverflowError, TypeError, ValueError) as error:
        raise InvalidInput(f"the axis {name!r} must be a number or a row of them: {error}.") from error
    if given.dtype.kind not in "iuf" and given.size:
        raise InvalidInput(
            f"the axis {name!r} must hold numbers, got {reprlib.repr(values)}.",
            remedy="Give numbers in SI units, texts with units or quantities of pint; a ratio has none.",
        )
    array = given.astype(np.float64)
    if array.ndim > 1 or not array.size:
        raise InvalidInput(f"the axis {name!r} must be a number or a row of them, got shape {array.shape}.")
    if not np.isfinite(array).all():
        raise InvalidInput(f"the axis {name!r} must be finite.")
    array.flags.writeable = False
    return array


def _check_question(names: set[str], subject: Subject) -> None:
    """Raise unless the names make one question about a rod or a scene, or one pair of the paper's groups."""
    kind = "" if subject is None else " and a scene" if isinstance(subject, Scene) else " and a rod"
    got, rod = ", ".join(sorted(names)) + kind, rod_of(subject)
    if names & set(GROUPS):
        if rod is not None or not names <= set(GROUPS) or "beta0" not in names or len(names) != 2:
            raise InvalidInput(
                f"the paper's groups are beta0 with lam or beta1, and nothing else; got {got}."
            )
        return
    given = sorted(names & set(GIVEN))
    if len(given) != 1:
        raise InvalidInput(f"give one of {', '.join(GIVEN)}; got {' and '.join(given) or 'none'}.")
    if "ratio" in names:
        if isinstance(subject, Scene) and not subject.rod.dimensionless:
            raise InvalidInput(
                "ratio = eta/y0 varies in a scene whose rod is known by its ratio alone.",
                remedy="Vary bending_stiffness, adhesion_strength or adhesion_range; or make the scene, its"
                " numbers over T0 and eta, of Rod.from_ratio.",
            )
        if isinstance(subject, Rod) or names & set(MATERIAL) or not given[0].endswith("_ratio"):
            raise InvalidInput(
                "a sweep over ratio = eta/y0 takes no other numbers of the rod, and pressure_ratio = p/T0 or"
                f" length_ratio = sbar/eta; got {got}."
            )
    elif rod is None and (missing := [name for name in MATERIAL if name not in names]):
        raise InvalidInput(
            f"the rod lacks {' and '.join(missing)}.", remedy="Give them, or a rod, or ratio alone."
        )
