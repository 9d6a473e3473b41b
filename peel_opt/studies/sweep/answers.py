"""What a worker does: answer the points of one chunk, always in the same way.

Every chunk starts without remembered branches, and a process works at one chunk at a time
(CasADi and MUMPS are not thread-safe), with BLAS on one thread however many it started with.
What is left to make one process differ from another in the last bit is its arithmetic: the
libraries and the processor.  `arithmetic` names it, and every chunk says under which it was
computed.
"""

from __future__ import annotations

import hashlib
import math
import threading
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import Any

import numpy as np

from ... import __version__
from ...base.errors import PeelOptError
from ...base.threads import one_thread
from ...continuation.primary import forget_branches
from ...continuation.scene_family import forget_scenes
from ...equilibria.answers import found_together
from ...equilibria.ask import ask_about, equilibrium
from ...equilibria.question import ASKS, RATIO, known_law
from ...equilibria.result import Equilibrium
from ...equilibria.unfolded import Many
from ...model.groups import PI4
from ...model.renumbered import renumbered
from ...model.rod import MATERIAL, Rod
from ...model.scene import Scene
from .plan import GIVEN, Task, given_among

#: Numbers kept of every point; all are attributes of an equilibrium but the last two.
NUMBERS = (
    *("pressure", "length", "pressure_ratio", "length_ratio", "ratio", "beta0", "beta1", "lam", "alpha1"),
    *("error", "certificate", "condition", "nearest"),
)
TEXTS = ("status", "state", "law", "flags", "message")

#: Numbers and texts of an answer by the names that a sweep has for them, where they are others.
NAMES = {
    **{"error": "errors", "certificate": "certificates", "condition": "conditions"},
    **{"status": "statuses", "state": "states", "law": "laws", "message": "reasons"},
}

#: Status of a point at which the programme itself failed, not the question.
CRASHED = "crashed"

#: Numbers and texts of a point.
Row = tuple[list[float], tuple[str, ...]]

_ONE_AT_A_TIME = threading.Lock()


@dataclass(frozen=True, eq=False)
class ChunkAnswers:
    """What came of a chunk.

    Parameters
    ----------
    number : int
        Of the chunk.
    arithmetic : str
        Of the process that computed it.
    numbers : ndarray, shape (points, len(NUMBERS))
        NaN where there is no answer.
    texts : list of tuple of str
        `TEXTS` of each point.
    """

    number: int
    arithmetic: str
    numbers: np.ndarray
    texts: list[tuple[str, ...]]


def answer_chunk(task: Task) -> ChunkAnswers:
    """Answer all points of a chunk, together as far as that goes; failures are rows too."""
    with _ONE_AT_A_TIME, one_thread:
        forget_branches()
        forget_scenes()
        try:
            together = _together(task)
        except MemoryError:
            raise  # the machine's, at this moment: nothing to keep in a journal
        except Exception:
            together = [None] * len(task.values)  # each may yet be answered for itself
        rows = [
            done or _answered(task, row) for done, row in zip(together, task.values.tolist(), strict=True)
        ]
        computed_by = arithmetic()
    numbers = np.array([row[0] for row in rows], dtype=np.float64)
    # One NaN for all: the sign of the one a processor makes would not survive the journal.
    numbers[np.isnan(numbers)] = math.nan
    return ChunkAnswers(task.number, computed_by, numbers, [row[1] for row in rows])


def _together(task: Task) -> list[Row | None]:
    """Return the rows of the points that are answered together, None for the others."""
    if task.options.method != "auto" or not len(task.values) or isinstance(task.subject, Scene):
        return [None] * len(task.values)
    found = answered_together(task)
    numbers = np.stack([found[name] for name in NUMBERS], axis=1).tolist()
    texts = zip(*(found[name].tolist() for name in TEXTS), strict=True)
    return [(row, words) if words[0] else None for row, words in zip(numbers, texts, strict=True)]


def answered_together(task: Task) -> dict[str, np.ndarray]:
    """Return the numbers and texts of all points; the status is empty where there is no answer yet."""
    points = dict(zip(task.names, task.values.T, strict=True))
    options = task.options
    name = given_among(points)
    asks = GIVEN.get(name) or ASKS[name]
    is_rod = asks.held is RATIO
    if is_rod:
        ratio, units = _rods(points, task)
        held, number = ratio, points[name] / units[name] if name == asks.given.name else points[name]
    else:
        held, number = np.cbrt(points["beta0"]), points[name] - PI4 if name == "beta1" else points[name]
    law = known_law(options.law or ("auto" if is_rod else "linear"))
    question = Many(asks, held, number, law, options.state)
    found = found_together(question, float(options.tol), {asks.given.attribute: question.number})
    columns = {own: found[theirs] for own in (*NUMBERS, *TEXTS) if (theirs := NAMES.get(own, own)) in found}
    columns["beta1"] = PI4 + found["lam"]
    if is_rod:
        for measure in asks:
            columns[measure.name] = units[measure.name] * columns[measure.attribute]
    else:  # without a rod p is measured in k/sbar^3, where it is alpha, and sbar is 1
        columns["pressure"], columns["length"] = found["beta0"] + found["alpha1"], np.ones(len(task.values))
    # What was given stays as it is: on the way through the groups it may lose its last digit.
    return columns | {own: column for own, column in points.items() if own in NUMBERS and own != "ratio"}


def _rods(points: dict[str, np.ndarray], task: Task) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Return eta/y0 of the rod of each point, and what its pressures and lengths are measured in."""
    count = len(task.values)
    if "ratio" in points:
        return points["ratio"], {"pressure": np.ones(count), "length": np.ones(count)}
    named = [points.get(name, np.full(count, getattr(task.subject, name, math.nan))) for name in MATERIAL]
    # A rod that is none is left to the single call, which says why.
    stiffness, strength, reach = np.where(np.all(np.array(named) > 0.0, axis=0), named, math.nan)
    eta = np.cbrt(stiffness / strength)
    return eta / reach, {"pressure": strength, "length": eta}


def ask(point: dict[str, float], base: Rod | Scene | None, options: dict[str, Any]) -> Equilibrium:
    """Answer one point by the single call it stands for.

    Raises
    ------
    PeelOptError
        As that call does; ``nearest`` is in the terms of the point, not in those of the call.
    """
    if "beta0" in point:
        shift = PI4 if "beta1" in point else 0.0
        named: dict[str, Any] = {**point, **options}
        return _renamed(partial(equilibrium, **named), lambda lam: lam + shift)
    name = given_among(point)
    value, given = point[name], GIVEN[name].given
    subject: Rod | Scene
    if isinstance(base, Scene):
        rod = _rod(point, base.rod)
        subject = renumbered(base, {own: at for own, at in point.items() if own in base.numbers}, rod)
    else:
        subject = rod = _rod(point, base)
    call = partial(ask_about, subject, given.name)
    if name == given.name:
        return call(value, **options)
    absolute = given.from_ratio(rod, value)
    return _renamed(partial(call, absolute, **options), partial(given.to_ratio, rod))


def _renamed(call: Callable[[], Equilibrium], back: Callable[[float], float]) -> Equilibrium:
    try:
        return call()
    except PeelOptError as error:
        if error.nearest is not None:
            error.nearest = back(error.nearest)
        raise


def _rod(point: dict[str, float], base: Rod | None) -> Rod:
    if "ratio" in point:
        return Rod.from_ratio(point["ratio"])
    return Rod(*(point[name] if name in point else getattr(base, name) for name in MATERIAL))


def _answered(task: Task, row: list[float]) -> Row:
    try:
        eq = ask(dict(zip(task.names, row, strict=True)), task.subject, task.options.keywords())
    except PeelOptError as error:
        return _failure(error.status, str(error), math.nan if error.nearest is None else error.nearest)
    except MemoryError:
        raise  # the machine's, at this moment: nothing to keep in a journal
    except Exception as error:
        # One point that trips the programme must not cost the others, and is no answer either.
        return _failure(CRASHED, f"{type(error).__name__}: {error}")
    numbers = [float(getattr(eq, name)) for name in NUMBERS[:-2]]
    texts = (eq.status, eq.state, eq.law, ", ".join(eq.flags), eq.message)
    return [*numbers, float(eq.stats.condition), math.nan], texts


def _failure(status: str, message: str, nearest: float = math.nan) -> Row:
    return [*[math.nan] * (len(NUMBERS) - 1), nearest], (status, "", "", "", " ".join(message.split()))


@lru_cache(maxsize=1)
def arithmetic() -> str:
    """Return a name of this process's rounding on one thread: equal names, equal bits.

    Made of the versions of the libraries and of what dense and elementary operations give.
    """
    import casadi
    import scipy
    from scipy.linalg.lapack import dgetrf

    n = 240  # large enough for BLAS to work in blocks, whose size depends on the processor
    matrix = np.sin(np.outer(np.arange(1, n + 1), np.arange(1, n + 1)) ** 0.5)
    vector = np.cos(np.arange(n))
    results = (
        matrix @ matrix,
        np.linalg.solve(matrix + n * np.eye(n), vector),
        dgetrf(matrix)[0],
        casadi.sin(casadi.DM(vector)).full(),
        np.array([math.cbrt(v) * math.exp(v) for v in vector]),
        np.linalg.inv(matrix[:21, :21] + np.eye(21)),
        np.cbrt(np.exp(vector)) * np.log(2.0 + vector),
    )
    digest = hashlib.sha256()
    for name in (__version__, np.__version__, scipy.__version__, casadi.__version__):
        digest.update(name.encode())
    for result in results:
        digest.update(np.ascontiguousarray(result).tobytes())
    return digest.hexdigest()[:16]
