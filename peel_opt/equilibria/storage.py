"""Equilibria on disk: NPZ and CSV, written whole or not at all, read back bit for bit.

Both formats hold the shape in the paper's scaled variables, from which `Equilibrium` derives
everything else, so that what is read is what was written to the last bit.  Neither runs code
when it is read.
"""

from __future__ import annotations

import json
import math
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

import numpy as np

from ..base.files import atomic_write, read_file, require_schema, unpack
from ..model.rod import Units, rod_from
from ..residual.shape import Shape
from .result import Equilibrium, Stats

SCHEMA = "peel_opt equilibrium"
SCHEMA_VERSION = 1

#: How far a number may lie from what follows from others: powers and roots round as the machine does.
SAME = 1e-12
#: The same of eta/y0, which is held only as well as the solver holds what it is given.
SAME_RATIO = 1e-9

#: Numbers of an equilibrium that are stored; all others follow from them.
_FLOATS = ("beta0", "lam", "alpha1", "error", "certificate", "tol")
_TEXTS = ("law", "answered", "state", "status", "message")

#: CSV columns of the scaled shape; theta is the same in both units.
_SCALED = {
    "xi": "s/sbar",
    "x": "x/sbar",
    "y": "y/sbar",
    "theta": "theta [rad]",
    "curvature": "curvature*sbar",
    "Nx": "Nx*sbar^2/k",
    "Ny": "Ny*sbar^2/k",
}


def equilibrium_record(eq: Equilibrium) -> dict[str, Any]:
    """Return all numbers of an equilibrium, named as its attributes, with the unit in the key.

    Without a rod, lengths are in units of sbar and pressures in k/sbar^3; for a rod known by
    its ratio alone, in its eta and T0.
    """
    units = Units.of(eq.rod)
    has_shape = eq.shape.xi.size > 0
    record: dict[str, Any] = {
        f"pressure [{units.pressure}]": float(eq.pressure),
        f"length [{units.length}]": float(eq.length),
        "pressure_ratio": float(eq.pressure_ratio),
        "length_ratio": float(eq.length_ratio),
        "ratio": float(eq.ratio),
        "beta0": float(eq.beta0),
        "beta1": float(eq.beta1),
        "lam": float(eq.lam),
        "alpha": float(eq.alpha),
        "alpha1": float(eq.alpha1),
        "tip_angle [rad]": eq.tip_angle if has_shape else float("nan"),
        f"tip_height [{units.length}]": eq.tip_height if has_shape else float("nan"),
        "answered": eq.answered,
        "error": float(eq.error),
        "certificate": float(eq.certificate),
        "tol": float(eq.tol),
        "law": eq.law,
        "state": eq.state,
        "status": eq.status,
        "valid": bool(eq.valid),
        "flags": list(eq.flags),
        "message": eq.message,
    }
    return record | units.rod(eq.rod) | _stats_record(eq.stats)


def _in_units(eq: Equilibrium) -> dict[str, np.ndarray]:
    """Return the shape in the units of its rod, without theta."""
    units = Units.of(eq.rod)
    return {
        f"s [{units.length}]": eq.s,
        f"x [{units.length}]": eq.x,
        f"y [{units.length}]": eq.y,
        f"curvature [1/{units.length}]": eq.curvature,
        f"Nx [{units.force}]": eq.Nx,
        f"Ny [{units.force}]": eq.Ny,
    }


def save_equilibrium(eq: Equilibrium, path: str | Path) -> Path:
    """Write an equilibrium as NPZ: the scaled shape and one JSON text with all numbers."""
    arrays: dict[str, Any] = {f.name: np.asarray(getattr(eq.shape, f.name), float) for f in fields(Shape)}
    text = json.dumps(_head(eq))
    return atomic_write(path, lambda file: np.savez_compressed(file, metadata=np.array(text), **arrays))


def write_equilibrium_csv(eq: Equilibrium, path: str | Path) -> Path:
    """Write an equilibrium as CSV: its numbers as comments, then the shape, one point a line.

    With a rod the columns are in its units first and scaled next.
    """
    # A custom law or message may hold any character: JSON keeps each on its line, in ASCII.
    lines = [f"# {key} = {json.dumps(value)}" for key, value in _head(eq).items()]
    known = {line.split(" = ")[0] for line in lines}
    derived = {key: value for key, value in equilibrium_record(eq).items() if f"# {key}" not in known}
    lines += [f"# {key} = {json.dumps(value)}" for key, value in derived.items()]
    columns = {} if eq.rod is None else _in_units(eq)
    columns |= {title: getattr(eq.shape, name) for name, title in _SCALED.items()}
    lines.append(",".join(columns))
    lines += [",".join(repr(float(value)) for value in row) for row in zip(*columns.values(), strict=True)]
    text = "\n".join(lines) + "\n"
    return atomic_write(path, lambda file: file.write(text.encode("ascii")))


def load_equilibrium(path: str | Path) -> Equilibrium:
    """Read what `save_equilibrium` or `write_equilibrium_csv` wrote.

    Raises
    ------
    InvalidInput
        If the file cannot be read, is damaged, or is not such a file.
    """

    def parse(data: bytes) -> Equilibrium:
        return _restore(*_from_npz(data)) if data[:2] == b"PK" else _from_csv(data)

    return read_file(
        path, parse, "equilibrium", "Read files that Equilibrium.save or Equilibrium.to_csv wrote."
    )


def _stats_record(stats: Stats) -> dict[str, Any]:
    return {
        # NumPy's scalars are no numbers to JSON.
        f"stats.{key}{' [s]' * (key == 'seconds')}": value.item() if isinstance(value, np.generic) else value
        for key, value in asdict(stats).items()
    }


def _head(eq: Equilibrium) -> dict[str, Any]:
    """Return everything that `_restore` needs beside the shape, ready for JSON."""
    head: dict[str, Any] = {"schema": SCHEMA, "schema_version": SCHEMA_VERSION, "points": len(eq.shape.xi)}
    head |= {name: float(getattr(eq, name)) for name in _FLOATS}
    head |= {name: getattr(eq, name) for name in _TEXTS}
    head |= {"flags": list(eq.flags), "given": eq.given}
    return head | Units.of(eq.rod).rod(eq.rod) | _stats_record(eq.stats)


def _from_npz(data: bytes) -> tuple[dict[str, Any], Shape]:
    head, arrays = unpack(data)
    require_schema(head, SCHEMA, SCHEMA_VERSION)
    return head, Shape(**{f.name: arrays[f.name] for f in fields(Shape)})


def _from_csv(data: bytes) -> Equilibrium:
    """Read a CSV, also one that an editor gave other line ends, a mark before it or blank lines after."""
    text = data.decode("utf-8-sig").replace("\r\n", "\n")
    lines = text.rstrip().split("\n")
    if not text.startswith("# schema = ") or not text.endswith("\n"):
        raise ValueError("it has no header, or ends in the middle of a line")
    comments = [line for line in lines if line.startswith("# ")]
    head = {}
    for line in comments:
        key, _, value = line[2:].partition(" = ")
        head[key] = json.loads(value)
    require_schema(head, SCHEMA, SCHEMA_VERSION)
    titles = lines[len(comments)].split(",") if len(lines) > len(comments) else []
    rows = [[float(cell) for cell in line.split(",")] for line in lines[len(comments) + 1 :]]
    if any(len(row) != len(titles) for row in rows):
        raise ValueError("its rows do not have one length")
    table = dict(zip(titles, np.array(rows, float).reshape(len(rows), len(titles)).T, strict=True))
    missing = [title for title in _SCALED.values() if title not in table]
    if missing:
        raise ValueError(f"it has no column {missing[0]!r}")
    eq = _restore(head, Shape(**{name: table[title].copy() for name, title in _SCALED.items()}))
    _require_agreement(eq, head, table)
    return eq


def _require_agreement(eq: Equilibrium, head: dict[str, Any], table: dict[str, np.ndarray]) -> None:
    """Raise if what a file says twice is not the same, as in a CSV that was edited in part."""
    derived: dict[str, Any] = equilibrium_record(eq)
    if eq.rod is not None:
        derived |= _in_units(eq)
        if math.isfinite(eq.ratio) and not _agree(eq.rod.ratio, eq.ratio, SAME_RATIO):
            raise ValueError(f"its rod has eta/y0 = {eq.rod.ratio!r}, its equilibrium {eq.ratio!r}")
    for key, stored in (head | table).items():
        if key in derived and not _agree(stored, derived[key]):
            raise ValueError(f"its {key!r} is not what follows from its other numbers")
    if eq.certified and not max(eq.error, eq.certificate) <= eq.tol:
        raise ValueError("it calls itself certified, with an error or a certificate above its tol")


def _agree(stored: Any, derived: Any, within: float = SAME) -> bool:
    """Whether two numbers, or all of two arrays, are one but for rounding; other values if they are equal."""
    if isinstance(derived, bool | str | list) or not isinstance(stored, int | float | np.ndarray):
        return bool(stored == derived)
    if np.shape(stored) != np.shape(derived):
        return False
    known = np.asarray(derived, float)
    size = np.max(np.abs(known), where=np.isfinite(known), initial=0.0)
    return bool(np.allclose(stored, known, rtol=0.0, atol=within * size, equal_nan=True))


def _restore(head: dict[str, Any], shape: Shape) -> Equilibrium:
    points = head["points"]
    for f in fields(Shape):
        array = getattr(shape, f.name)
        if array.dtype != np.float64 or array.shape != (points,):
            raise ValueError(f"{f.name} does not hold {points} numbers")
    for name in _FLOATS:
        if not isinstance(head[name], float):
            raise ValueError(f"{name} is no number")
    for name in (*_TEXTS, "flags"):
        parts = head[name] if name == "flags" else [head[name]]
        if not isinstance(parts, list) or not all(isinstance(part, str) for part in parts):
            raise ValueError(f"{name} is no text")
    given = head.get("given", {})  # which files of earlier versions do not have
    if not isinstance(given, dict) or not all(isinstance(value, float) for value in given.values()):
        raise ValueError("given holds no numbers")
    named = {key.split(" [")[0]: value for key, value in head.items()}
    return Equilibrium(
        rod=rod_from(head),
        **{name: head[name] for name in (*_FLOATS, *_TEXTS)},
        flags=tuple(head["flags"]),
        stats=Stats(**{f.name: named[f"stats.{f.name}"] for f in fields(Stats)}),
        source=shape,
        given=given,
    )
