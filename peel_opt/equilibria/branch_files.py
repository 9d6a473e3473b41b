"""Branches on disk: NPZ for `peel_opt`, bit for bit, and CSV for everybody else.

A file holds numbers and names only: reading one runs no code.  A law of the user's own is
therefore known by its name and by samples afterwards, which is enough to draw the branch; to
take it up again the law is given, and must be the one that was sampled.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import asdict, fields
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from ..base.files import read_file, require_schema, save_arrays, unpack, write_csv
from ..model.bond import CohesiveLaw
from ..model.law_samples import samples
from ..model.rod import Units, rod_from
from .branch import COLUMNS, Branch
from .branch_parts import Solutions, SpecialPoint, Trivial
from .branch_points import under_law

SCHEMA = "peel_opt branch"
SCHEMA_VERSION = 2

#: Some 40 000 points of three phases each, in bytes.
LARGEST = 512_000_000

#: Columns that are counted, not measured.
_WHOLE = ("iterations",)

#: Numbers and texts beside the arrays.
_TEXTS = ("law", "hold", "ended")

#: CSV columns that have no unit, by the name of the attribute.
_PLAIN = ("pressure_ratio", "length_ratio", "lam", "alpha1", "alpha", "beta0", "beta1", "ratio")
_CHECKS = ("error", "certificate", "iterations")


def save_branch(branch: Branch, path: str | Path) -> Path:
    """Write a branch as NPZ: arrays, solutions, special points, and what the trace was asked for.

    Parameters
    ----------
    branch : Branch
    path : str or Path
        In a folder that exists; a regular file there is replaced at the end.

    Returns
    -------
    Path

    Raises
    ------
    InvalidInput
        If the path cannot be written.
    """
    arrays: dict[str, Any] = {name: getattr(branch, name) for name in (*COLUMNS, "state")}
    for name in ("index", "flutter"):
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
    return save_arrays(path, _head(branch), arrays)


def load_branch(path: str | Path, law: CohesiveLaw | None = None) -> Branch:
    """Read what `save_branch` wrote.

    Raises
    ------
    InvalidInput
        If the file cannot be read, is damaged, of a later version, or is not such a file; or if
        ``law`` is not the one the branch was traced with.
    """
    remedy = "Read files that Branch.save wrote."
    branch = read_file(path, lambda data: _restore(*unpack(data, LARGEST)), "branch", remedy, LARGEST)
    return branch if law is None else under_law(branch, law)


def write_branch_csv(branch: Branch, path: str | Path) -> Path:
    """Write a branch as CSV: what it is in lines that start with "#", then one point a line.

    With a rod, pressures, lengths and heights come first in its units; the paper's groups are
    in every file.

    Returns
    -------
    Path

    Raises
    ------
    InvalidInput
        If the path cannot be written.
    """
    head = _head(branch)
    points = head.pop("special_points")
    lines = [*head.items(), *(("special point", point) for point in points)]
    return write_csv(path, lines, _csv_columns(branch))


def _csv_columns(branch: Branch) -> dict[str, np.ndarray]:
    """Return the columns by title, with the unit in it."""
    columns: dict[str, np.ndarray] = {}
    if branch.rod is not None:
        units = Units.of(branch.rod)
        columns = {f"pressure [{units.pressure}]": branch.pressure, f"length [{units.length}]": branch.length}
        columns[f"tip_height [{units.length}]"] = branch.tip_height
    columns |= {name: getattr(branch, name) for name in _PLAIN}
    columns |= {"tip_angle [rad]": branch.tip_angle, "tip_height_over_y0": branch.tip_u}
    columns |= {name: getattr(branch, name) for name in ("arclength", *_CHECKS, "state")}
    for name in ("index", "flutter"):
        if getattr(branch, name) is not None:
            columns[name] = getattr(branch, name)
    return columns


def _head(branch: Branch) -> dict[str, Any]:
    """Return all that is no array, ready for JSON."""
    head: dict[str, Any] = {"schema": SCHEMA, "schema_version": SCHEMA_VERSION, "points": len(branch)}
    head |= {name: getattr(branch, name) for name in _TEXTS}
    head |= {"held": branch.held, "options": branch.options, **Units.of(branch.rod).rod(branch.rod)}
    if branch.solutions is not None:
        head["transcription"] = branch.solutions.transcription
    head["special_points"] = [asdict(point) for point in branch.special_points]
    if branch.trivial is not None:
        head["trivial.special_points"] = [asdict(point) for point in branch.trivial.special_points]
    return head


def _packed(name: str, parts: Sequence[np.ndarray]) -> dict[str, np.ndarray]:
    """Return arrays of different lengths as one, with the places where each begins and ends."""
    offsets = np.cumsum([0, *(len(part) for part in parts)])
    return {name: np.concatenate([np.zeros(0), *parts]), f"{name}.offsets": offsets}


def _unpacked(name: str, arrays: dict[str, np.ndarray], count: int) -> tuple[np.ndarray, ...]:
    flat, offsets = _array(arrays, name, "f"), _array(arrays, f"{name}.offsets", "i", count + 1)
    if offsets[0] != 0 or offsets[-1] != len(flat) or (np.diff(offsets) < 0).any():
        raise ValueError(f"{name} is not cut into {count} parts")
    return tuple(flat[a:b].copy() for a, b in pairwise(offsets))


def _array(arrays: dict[str, np.ndarray], name: str, kind: str, count: int | None = None) -> np.ndarray:
    """Return a one-dimensional array of float, int or text, or raise."""
    array = arrays[name]
    right = array.ndim == 1 and array.dtype.kind == kind and (kind != "f" or array.dtype == np.float64)
    if not right or count not in (None, len(array)):
        raise ValueError(f"{name} does not hold {'its' if count is None else count} values")
    return array


def _restore(head: dict[str, Any], arrays: dict[str, np.ndarray]) -> Branch:
    require_schema(head, SCHEMA, 1 if head["schema_version"] == 1 else SCHEMA_VERSION)
    for name in _TEXTS:
        if not isinstance(head[name], str):
            raise ValueError(f"{name} is no text")
    if not isinstance(head["held"], float | int) or not isinstance(head["options"], dict):
        raise ValueError("held is no number, or options is no table")
    count = len(_array(arrays, "lam", "f", head["points"]))
    columns: dict[str, Any] = {
        name: _array(arrays, name, "i" if name in _WHOLE else "f", count) for name in COLUMNS
    }
    trivial = None
    if "trivial.lam" in arrays:
        lam = _array(arrays, "trivial.lam", "f")
        trivial = Trivial(lam, tuple(_specials(head["trivial.special_points"], len(lam))))
    return Branch(
        **{name: head[name] for name in _TEXTS},
        held=head["held"],
        options=head["options"],
        rod=rod_from(head),
        **columns,
        state=_array(arrays, "state", "U", count),
        special_points=tuple(_specials(head["special_points"], count)),
        trivial=trivial,
        solutions=_solutions(head, arrays, count) if "phases" in arrays else None,
        **_stability(arrays, count, head["schema_version"]),
    )


def _stability(arrays: dict[str, np.ndarray], count: int, version: int) -> dict[str, Any]:
    """Return index and flutter.

    In version 1 a pair that flutters counted as two in the index.  Where that cannot be told from
    two negative eigenvalues, both are left to be computed again.
    """
    if "index" not in arrays:
        return {"index": None, "flutter": None}
    index = _array(arrays, "index", "i", count)
    if version > 1:
        flutter = _array(arrays, "flutter", "i", count) if "flutter" in arrays else None
        return {"index": index, "flutter": flutter}
    if (index > 1).any():
        return {"index": None, "flutter": None}
    return {"index": index, "flutter": np.zeros_like(index)}


def _solutions(head: dict[str, Any], arrays: dict[str, np.ndarray], count: int) -> Solutions:
    if not isinstance(head["transcription"], str):
        raise ValueError("transcription is no text")
    return Solutions(
        transcription=head["transcription"],
        phases=tuple(_array(arrays, "phases", "U", count).tolist()),
        unknowns=_unpacked("unknowns", arrays, count),
        tangents=_unpacked("tangents", arrays, count),
        # Earlier releases wrote none.
        law_samples=tuple(_array(arrays, "law_samples", "f").tolist()) if "law_samples" in arrays else (),
    )


#: Fields of a special point that are numbers.
_NUMBERS = tuple(f.name for f in fields(SpecialPoint) if f.name not in ("kind", "status", "bracket", "index"))


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
