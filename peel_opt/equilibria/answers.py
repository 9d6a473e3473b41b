"""Many questions of one kind in one call: arrays in, arrays out, every answer certified for itself."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from decimal import Decimal
from functools import partial
from numbers import Real
from typing import Any

import numpy as np

from ..base.arrays import brief, unmasked
from ..base.checks import positive
from ..base.errors import InvalidInput, PeelOptError
from ..base.records import Column, Schema, Stored, Table, array, entries
from ..base.units import in_si
from ..model.bond import COHESIVE, LINEAR, CohesiveLaw
from ..model.groups import PI4
from ..model.labels import CERTIFIED, counted, known_state
from ..model.renumbered import renumbered
from ..model.rod import Rod
from ..model.scene import Scene
from ..residual.accuracy import HEIGHT_NOISE
from .ask import ask_about, equilibrium
from .batches import find
from .question import ASKS, known_law
from .result import Equilibrium
from .scenes import refuse_options, solve
from .unfolded import Many

#: The kinds of question, by the names of what is given.
KINDS = {(asks.beside, asks.given.attribute): asks for asks in ASKS.values()}

#: Arrays of numbers and of texts that every answer has.
NUMBERS = (
    *("ratio", "pressure_ratio", "length_ratio", "beta0", "lam", "alpha1", "tip_angle", "tip_height"),
    *("errors", "certificates", "conditions", "nearest"),
)
TEXTS = ("states", "statuses", "laws", "flags", "reasons")

#: How arrays of the numbers of a scene are called in files.
OF_SCENE = "scene "


@dataclass(frozen=True, eq=False)
class Answers(Stored):
    """Answers to many questions of one kind; every array has the shape of the question.

    Where there is no answer numbers are NaN, and ``statuses`` and ``reasons`` say why.

    Parameters
    ----------
    given : (str, str)
        Names of the numbers given.
    options : dict
        Law, state and tol.
    ratio, pressure_ratio, length_ratio, beta0, lam, alpha1 : ndarray
        eta/y0, p/T0, sbar/eta and the paper's groups; what was given, unchanged.
    tip_angle : ndarray
        theta at the free end [rad], negative.
    tip_height : ndarray
        y/y0 there.
    errors : ndarray
        Absolute error of each of ``values``, as `Equilibrium.error`.
    certificates : ndarray
        As `Equilibrium.certificate`.
    conditions : ndarray
        |d answer / d given|, as `Stats.condition`, to two per cent or 1e-4.
    nearest : ndarray
        Where there is no equilibrium, the nearest given number that has one, if it is known.
    states, statuses, laws, flags, reasons : ndarray of str
        As `Equilibrium` has them; flags joined by ", ", the reason is the message of the error.
    numbers : dict of str to ndarray
        Of a scene, those that were given beside the pressure or the length, in the units of its rod.
    """

    schema = Schema("peel_opt answers", 1, largest=8_000_000_000)

    given: tuple[str, str]
    options: dict[str, Any]
    ratio: np.ndarray
    pressure_ratio: np.ndarray
    length_ratio: np.ndarray
    beta0: np.ndarray
    lam: np.ndarray
    alpha1: np.ndarray
    tip_angle: np.ndarray
    tip_height: np.ndarray
    errors: np.ndarray
    certificates: np.ndarray
    conditions: np.ndarray
    nearest: np.ndarray
    states: np.ndarray
    statuses: np.ndarray
    laws: np.ndarray
    flags: np.ndarray
    reasons: np.ndarray
    numbers: dict[str, np.ndarray] = field(default_factory=dict)

    @property
    def asked(self) -> str:
        """Name of the number that answers."""
        return KINDS[self.given].asked.attribute

    @property
    def values(self) -> np.ndarray:
        """The number that was asked for."""
        values: np.ndarray = getattr(self, self.asked)
        return values

    @property
    def certified(self) -> np.ndarray:
        """Where error and certificate are within ``tol``."""
        certified: np.ndarray = self.statuses == CERTIFIED
        return certified

    @property
    def shape(self) -> tuple[int, ...]:
        """Of every array."""
        return self.statuses.shape

    def __len__(self) -> int:
        return self.statuses.size

    def summary(self) -> str:
        """Return how many questions have an answer, and why the others have none."""
        return counted(self.statuses)

    def __repr__(self) -> str:
        lines = [f"Answers: {self.asked} of {' and '.join(self.given)}, {self.summary()}"]
        lines += [f"├─ {name}: {brief(getattr(self, name))}" for name in (*self.given, self.asked, "errors")]
        lines.append("└─ " + ", ".join(f"{name} {value}" for name, value in self.options.items()))
        return "\n".join(lines)

    # --- out --------------------------------------------------------------------------------------

    def _head(self) -> dict[str, Any]:
        return {"given": list(self.given), "options": self.options}

    def _arrays(self) -> dict[str, np.ndarray]:
        own = {f"{OF_SCENE}{name}": values for name, values in self.numbers.items()}
        return {name: getattr(self, name) for name in (*NUMBERS, *TEXTS)} | own

    def _table(self) -> Table:
        units = {"tip_angle": "rad"}
        columns = {name: Column(values, units.get(name, "")) for name, values in self._arrays().items()}
        return Table([("asked", self.asked), *self.options.items()], columns)

    @classmethod
    def _restored(cls, head: dict[str, Any], arrays: dict[str, np.ndarray]) -> Answers:
        given = tuple(str(name) for name in head["given"])
        if given not in KINDS:
            raise ValueError(f"{given} are no question")
        shape = arrays["statuses"].shape
        kept: dict[str, Any] = {name: array(arrays, name, "f", shape) for name in NUMBERS}
        kept |= {name: array(arrays, name, "U", shape) for name in TEXTS}
        named = [name for name in arrays if name.startswith(OF_SCENE)]
        kept["numbers"] = {name[len(OF_SCENE) :]: array(arrays, name, "f", shape) for name in named}
        return cls(given=given, **entries(head, dict, "options"), **kept)


def answers(
    scene: Scene | None = None,
    *,
    ratio: Any = None,
    pressure_ratio: Any = None,
    length_ratio: Any = None,
    beta0: Any = None,
    lam: Any = None,
    law: str | CohesiveLaw | None = None,
    state: str | None = None,
    tol: float = 1e-8,
    **numbers: Any,
) -> Answers:
    """Answer many questions of one kind at once: arrays in, arrays out.

    Each answer is what the single call gives, within the errors of both, with an error and a certificate of
    its own; its bits do not depend on what else is asked.  Unfolded states under law (8) and under the linear
    law up to y0 go through together, thousands a second; all others are answered one by one.

    Parameters
    ----------
    scene : Scene, optional
        Ask about it, with ``pressure_ratio`` or ``length_ratio`` and any of its numbers, one by one: its
        branch is walked anew for every other set of numbers, and serves all that is asked on it.
    ratio : array_like
        eta/y0 of the rods, with ``pressure_ratio`` or ``length_ratio``.
    pressure_ratio : array_like
        p/T0: the length that each pressure holds is asked for.
    length_ratio : array_like
        sbar/eta: the pressure that holds each length is asked for.
    beta0, lam : array_like
        The paper's groups: alpha1 is asked for, as by `equilibrium`.
    law : {"auto", "linear", "cohesive"} or CohesiveLaw, optional
        By default "auto" for rods and "linear" for groups.
    state : str, optional
        As in `length_given_pressure`, `pressure_given_length` and `equilibrium`.
    tol : float
        Largest error of an answer, and largest certificate, to be certified.
    **numbers : array_like
        Numbers of the scene by the names that `solve` frees them by, in the units of its rod.

    Returns
    -------
    Answers
        Arrays of the common shape of what was given.

    Raises
    ------
    InvalidInput
        If the arrays are no question, no numbers or of no common shape, or an option cannot be meant.
        A number that is out of range costs its own answer only.

    Examples
    --------
    >>> found = answers(ratio=[1.0, 2.0, 1.0], pressure_ratio=[0.8, 0.3, 0.1])
    >>> found.length_ratio.round(6).tolist()
    [3.036804, 2.874863, nan]
    >>> found.statuses.tolist()
    ['certified', 'certified', 'no-equilibrium']
    """
    offered = {
        "ratio": ratio,
        "pressure_ratio": pressure_ratio,
        "length_ratio": length_ratio,
        "beta0": beta0,
        "lam": lam,
    }
    given = tuple(name for name, value in offered.items() if value is not None)
    if isinstance(scene, Rod):
        raise InvalidInput(
            "answers takes many rods by their eta/y0, and not one with units.",
            remedy="Give ratio=rod.ratio with pressure_ratio= or length_ratio=; po.sweep takes units.",
        )
    if scene is not None:
        refuse_options(law="auto" if law is None else law)
        return _of_scene(scene, {name: offered[name] for name in given}, numbers, state, positive("tol", tol))
    if numbers:
        raise InvalidInput(
            f"{', '.join(numbers)} is no number of a question without units.",
            remedy="Rods and lengths with units go through po.sweep; of a scene, give the scene that has it.",
        )
    if given not in KINDS:
        raise InvalidInput(
            f"{', '.join(given) or 'nothing'} given is no question.",
            remedy="Give ratio and pressure_ratio, ratio and length_ratio, or beta0 and lam.",
        )
    columns = _broadcast({name: _numbers(name, offered[name]) for name in given})
    named = law if law is not None else "linear" if "beta0" in given else "auto"
    first, second = given
    sides = [np.cbrt(columns[first]) if first == "beta0" else columns[first], columns[second]]
    question = Many(
        asks=KINDS[given],
        held=sides[0].ravel(),
        number=sides[1].ravel(),
        law=known_law(named),
        state=known_state(state),
    )
    options: dict[str, Any] = {"law": named, "state": question.state, "tol": positive("tol", tol)}
    arrays = found_together(question, options["tol"], columns)
    rest = np.flatnonzero(arrays["statuses"] == "")
    flat = {name: values.ravel() for name, values in columns.items()}
    for row in rest.tolist():
        point = {name: float(values[row]) for name, values in flat.items()}
        _alone(partial(_single, point, options), point, arrays, row)
    shape = next(iter(columns.values())).shape
    options["law"] = named.name if isinstance(named, CohesiveLaw) else named
    arrays |= {name: arrays[name].astype(str) for name in TEXTS}
    shaped: dict[str, Any] = {name: values.reshape(shape) for name, values in arrays.items()}
    return Answers(given, options, **shaped)


def _numbers(name: str, value: Any, unit: str = "") -> np.ndarray:
    """Return what was given as an array of numbers, or say what it is instead."""
    bare = unmasked(in_si(name, value, unit))
    try:
        plain = np.asarray(bare)
        if plain.dtype.kind == "O" and all(isinstance(number, Real | Decimal) for number in plain.flat):
            plain = plain.astype(float)
        if plain.dtype.kind not in "fiu":
            raise TypeError(f"{plain.dtype} are no numbers")
        return plain.astype(float)
    except (TypeError, ValueError) as error:
        raise InvalidInput(f"{name} must be an array of numbers, got {value!r:.60}.") from error


def _broadcast(columns: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return arrays of one shape."""
    try:
        broadcast = np.broadcast_arrays(*columns.values())
    except ValueError as error:
        shapes = ", ".join(f"{name} {values.shape}" for name, values in columns.items())
        raise InvalidInput(
            f"arrays of the shapes {shapes} have no common one.", remedy="Give arrays that broadcast."
        ) from error
    return dict(zip(columns, (np.array(values) for values in broadcast), strict=True))


def found_together(question: Many, tol: float, columns: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return the flat arrays of `Answers` as far as questions are answered together, by name.

    Where there is no answer yet texts are empty and numbers are not; ``columns`` are kept as they are.
    """
    found = find(question, tol)
    count = len(found.certified)
    A, m, sigma, lam, height, error, certificate, condition = (found.numbers[name] for name in found.numbers)
    beta0 = sigma**3
    alpha1 = m * A
    numbers = {
        "ratio": (lam + PI4) / sigma**4,
        "pressure_ratio": 1.0 + alpha1 / beta0,
        "length_ratio": sigma,
        "beta0": beta0,
        "lam": lam,
        "alpha1": alpha1,
    }
    numbers |= {name: values.ravel().copy() for name, values in columns.items()}
    numbers |= {"tip_angle": -A, "tip_height": height, "errors": error, "certificates": certificate}
    numbers |= {"conditions": condition, "nearest": np.full(count, math.nan)}
    names = (LINEAR.name, COHESIVE.name) if question.law is None else (question.law.name,) * 2
    laws = np.where(height > 1.0 + HEIGHT_NOISE, *names[::-1])
    return numbers | {
        "states": found.states.astype(object),
        "statuses": np.where(found.certified, CERTIFIED, "").astype(object),
        "laws": np.where(found.certified, laws, "").astype(object),
        "flags": np.where(np.abs(A) > 0.5 * math.pi, "overhang", "").astype(object),
        "reasons": np.full(count, "", object),
    }


def _of_scene(
    scene: Scene, given: dict[str, Any], numbers: dict[str, Any], state: str | None, tol: float
) -> Answers:
    """Answer about a scene with many pressures or lengths, and many of its numbers."""
    kind = ("ratio", *given)
    if not isinstance(scene, Scene):
        raise InvalidInput(f"scene must be a Scene, got {scene!r:.60}.")
    if kind not in KINDS or len(given) != 1:
        with_units = [name for name in ("pressure", "length") if name in numbers]
        raise InvalidInput(
            f"{', '.join([*given, *with_units]) or 'nothing'} given of a scene is no question.",
            remedy="Give pressure_ratio or length_ratio, p/T0 or sbar/eta, and numbers of the scene by name.",
        )
    asks = KINDS[kind]
    if strange := [name for name in numbers if name not in scene.numbers]:
        raise InvalidInput(
            f"{strange[0]!r} is no number of this scene.",
            remedy=f"It has {', '.join(scene.numbers) or 'none'}; name a load in the scene, with any size.",
        )
    rod = scene.rod
    units = {name: "" if rod.dimensionless else scene.dimensions[name].unit for name in numbers}
    columns = _broadcast(
        {name: _numbers(name, value, units.get(name, "")) for name, value in (given | numbers).items()}
    )
    shape = columns[kind[1]].shape
    flat = {name: values.ravel() for name, values in columns.items()}
    count = len(flat[kind[1]])
    arrays = {name: np.full(count, math.nan) for name in NUMBERS} | {
        name: np.full(count, "", object) for name in TEXTS
    }
    for row in range(count):
        own = {name: float(flat[name][row]) for name in numbers}
        value = float(flat[kind[1]][row])

        def ask(own: dict[str, float] = own, value: float = value) -> Equilibrium:
            absolute = asks.given.from_ratio(rod, value)
            named: dict[str, Any] = {asks.given.name: absolute}
            return solve(renumbered(scene, own), free=asks.asked.name, state=state, tol=tol, **named)

        _alone(ask, {kind[1]: value}, arrays, row)
        arrays["ratio"][row], arrays[kind[1]][row] = rod.ratio, value
        arrays["nearest"][row] /= asks.given.from_ratio(rod, 1.0)
    shaped = {name: values.astype(str) if name in TEXTS else values for name, values in arrays.items()}
    options = {"law": scene.bond.law.name, "state": state, "tol": tol, "scene": repr(scene)}
    return Answers(
        kind,
        options,
        **{name: values.reshape(shape) for name, values in shaped.items()},
        numbers={name: columns[name] for name in numbers},
    )


def _alone(
    ask: Callable[[], Equilibrium], point: dict[str, float], arrays: dict[str, np.ndarray], row: int
) -> None:
    """Answer one question by the single call it stands for, and write down what comes of it."""
    try:
        eq = ask()
    except PeelOptError as error:
        arrays["statuses"][row], arrays["reasons"][row] = error.status, str(error)
        arrays["nearest"][row] = math.nan if error.nearest is None else error.nearest
        return
    shape = eq.shape
    texts = (eq.state, eq.status, eq.law, ", ".join(eq.flags), eq.message)
    for name, text in zip(TEXTS, texts, strict=True):
        arrays[name][row] = text
    numbers = {name: getattr(eq, name) for name in NUMBERS[:6]} | point
    numbers |= {"errors": eq.error, "certificates": eq.certificate, "conditions": eq.stats.condition}
    height = eq.beta1 / eq.beta0 * shape.y[0] if eq.beta0 else math.nan
    numbers |= {"tip_angle": shape.theta[0], "tip_height": height}
    for name, number in numbers.items():
        arrays[name][row] = number


def _single(point: dict[str, float], options: dict[str, Any]) -> Equilibrium:
    if "beta0" in point:
        return equilibrium(beta0=point["beta0"], lam=point["lam"], **options)
    ratio, given = point  # of a rod known by its ratio, units are those of ratios
    return ask_about(Rod.from_ratio(point[ratio]), KINDS[ratio, given].given.name, point[given], **options)
