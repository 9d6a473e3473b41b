"""What a branch says of itself, and how its files are read back.

A file holds numbers and names only: reading one runs no code.  A law of the user's own is
therefore known by its name and by samples afterwards, which is enough to draw the branch; to
take it up again the law is given, and must be the one that was sampled.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from ..base.records import Column, Table, array, entries
from ..model.law_samples import samples
from ..model.rod import Units, rod_from
from .branch_parts import COLUMNS, OPTIONAL, Solutions, SpecialPoint, Trivial
from .storage import scene_from, scene_head

if TYPE_CHECKING:
    from .branch import Branch

#: Columns that are counted, not measured.
_WHOLE = ("iterations",)

#: Columns that a branch has where its stability has been computed.
_COUNTS = ("index", "flutter")

#: Numbers and texts beside the arrays.
_TEXTS = ("law", "hold", "ended")

#: CSV columns that have no unit, by the name of the attribute.
_PLAIN = ("pressure_ratio", "length_ratio", "lam", "alpha1", "alpha", "beta0", "beta1", "ratio")
_CHECKS = ("error", "certificate", "iterations")


def branch_arrays(branch: Branch) -> dict[str, np.ndarray]:
    """Return all arrays of a branch, its solutions among them."""
    arrays: dict[str, Any] = {name: getattr(branch, name) for name in (*COLUMNS, "state")}
    for name in OPTIONAL:
        if getattr(branch, name) is not None:
            arrays[name] = getattr(branch, name)
    if branch.trivial is not None:
        arrays["trivial.lam"] = branch.trivial.lam
    if branch.solutions is not None:
        arrays["phases"] = np.array(branch.solutions.phases, dtype=str)
        law = branch.solutions.law
        arrays["law_samples"] = np.array(branch.solutions.law_samples if law is None else samples(law))
        for name in ("unknowns", "tangents"):
            arrays |= _packed(name, getattr(branch.solutions, name))
    return arrays


def branch_table(branch: Branch, head: Mapping[str, Any]) -> Table:
    """Return the points: with a rod pressures, lengths and heights in its units first, then the groups."""
    notes = {key: value for key, value in head.items() if key != "special_points"}
    points = (("special point", point.numbers | point.in_units) for point in branch.special_points)
    return Table([*notes.items(), *points], _columns(branch))


def special_rows(branch: Branch) -> list[dict[str, Any]]:
    """Return the special points for people, with a rod in its units."""
    rows = []
    for point in branch.special_points:
        row: dict[str, Any] = {"special point": point.kind} | point.in_units
        names = ("pressure_ratio", "length_ratio", "lam", "alpha1", "error")
        rows.append(row | {name: getattr(point, name) for name in names} | {"status": point.status})
    return rows


def _columns(branch: Branch) -> dict[str, Column]:
    columns: dict[str, Column] = {}
    if branch.rod is not None:
        units = Units.of(branch.rod)
        named = {"pressure": units.pressure, "length": units.length, "tip_height": units.length}
        columns = {name: Column(getattr(branch, name), unit) for name, unit in named.items()}
    columns |= {name: Column(getattr(branch, name)) for name in _PLAIN}
    columns |= {"tip_angle": Column(branch.tip_angle, "rad"), "tip_height_over_y0": Column(branch.tip_u)}
    others = ["arclength", *_CHECKS, "state", *(n for n in _COUNTS if getattr(branch, n) is not None)]
    return columns | {name: Column(getattr(branch, name)) for name in others}


def branch_head(branch: Branch) -> dict[str, Any]:
    """Return all that is no array, ready for JSON."""
    head: dict[str, Any] = {"points": len(branch)}
    head |= {name: getattr(branch, name) for name in _TEXTS}
    head |= {"held": branch.held, "options": branch.options, **Units.of(branch.rod).rod(branch.rod)}
    if branch.solutions is not None:
        head["transcription"] = branch.solutions.transcription
    if branch.cuts:
        head["cuts"] = list(branch.cuts)
    head["special_points"] = [point.numbers for point in branch.special_points]
    if branch.scene is not None:
        head |= scene_head(branch.scene)
    if branch.trivial is not None:
        head["trivial.special_points"] = [point.numbers for point in branch.trivial.special_points]
    return head


def _packed(name: str, parts: Sequence[np.ndarray]) -> dict[str, np.ndarray]:
    """Return arrays of different lengths as one, with the places where each begins and ends."""
    offsets = np.cumsum([0, *(len(part) for part in parts)])
    return {name: np.concatenate([np.zeros(0), *parts]), f"{name}.offsets": offsets}


def _unpacked(name: str, arrays: dict[str, np.ndarray], count: int) -> tuple[np.ndarray, ...]:
    flat, offsets = array(arrays, name), array(arrays, f"{name}.offsets", "i", (count + 1,))
    if offsets[0] != 0 or offsets[-1] != len(flat) or (np.diff(offsets) < 0).any():
        raise ValueError(f"{name} is not cut into {count} parts")
    return tuple(flat[a:b].copy() for a, b in pairwise(offsets))


def branch_parts(head: dict[str, Any], arrays: dict[str, np.ndarray]) -> dict[str, Any]:
    """Return what a branch is made of."""
    entries(head, float | int, "held")
    entries(head, dict, "options")
    shape = (head["points"],)
    trivial = None
    if "trivial.lam" in arrays:
        lam = array(arrays, "trivial.lam")
        trivial = Trivial(lam, tuple(_specials(head["trivial.special_points"], len(lam))))
    rod = rod_from(head)
    return {
        **entries(head, str, *_TEXTS),
        "held": head["held"],
        "options": head["options"],
        "rod": rod,
        "scene": scene_from(head, rod),
        "angle": array(arrays, "angle", "f", shape) if "angle" in arrays else None,
        **{name: array(arrays, name, "i" if name in _WHOLE else "f", shape) for name in COLUMNS},
        "state": array(arrays, "state", "U", shape),
        "special_points": tuple(_specials(head["special_points"], *shape)),
        "trivial": trivial,
        "solutions": _solutions(head, arrays, *shape) if "phases" in arrays else None,
        "cuts": _cuts(head, *shape),
        **_stability(arrays, *shape, head["schema_version"]),
    }


def _cuts(head: dict[str, Any], count: int) -> tuple[int, ...]:
    """Return where a selection of rows begins anew; most branches are in one piece, and say nothing."""
    cuts = head.get("cuts", [])
    if not isinstance(cuts, list) or not all(isinstance(cut, int) and 0 < cut < count for cut in cuts):
        raise ValueError("cuts are no rows of the branch")
    return tuple(cuts)


def _stability(arrays: dict[str, np.ndarray], count: int, version: int) -> dict[str, Any]:
    """Return index and flutter.

    In version 1 a pair that flutters counted as two in the index.  Where that cannot be told from
    two negative eigenvalues, both are left to be computed again.
    """
    if "index" not in arrays:
        return {"index": None, "flutter": None}
    index = array(arrays, "index", "i", (count,))
    if version > 1:
        flutter = array(arrays, "flutter", "i", (count,)) if "flutter" in arrays else None
        return {"index": index, "flutter": flutter}
    if (index > 1).any():
        return {"index": None, "flutter": None}
    return {"index": index, "flutter": np.zeros_like(index)}


def _solutions(head: dict[str, Any], arrays: dict[str, np.ndarray], count: int) -> Solutions:
    return Solutions(
        **entries(head, str, "transcription"),
        phases=tuple(array(arrays, "phases", "U", (count,)).tolist()),
        unknowns=_unpacked("unknowns", arrays, count),
        tangents=_unpacked("tangents", arrays, count),
        # Earlier releases wrote none.
        law_samples=tuple(array(arrays, "law_samples").tolist()) if "law_samples" in arrays else (),
    )


#: Fields of a special point that are numbers.
_NUMBERS = ("beta0", "lam", "alpha1", "pressure_ratio", "length_ratio", "error")


def _specials(stored: Any, count: int) -> Iterator[SpecialPoint]:
    for point in stored:
        entry = {"error": math.inf} | point  # which version 1 did not have
        low, high = entry["bracket"]
        numbers = [low, high, *(entry[name] for name in _NUMBERS)]
        texts = [entry["kind"], entry["status"]]
        if not all(isinstance(v, float | int) for v in numbers) or not all(isinstance(t, str) for t in texts):
            raise ValueError("a special point lacks numbers")
        if not isinstance(entry["index"], int) or not 0 <= entry["index"] < count:
            raise ValueError("a special point is no point of the branch")
        yield SpecialPoint(**(entry | {"bracket": (low, high)}))
