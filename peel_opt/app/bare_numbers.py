"""Numbers of a card that stand without a unit: they are in SI, and the report of the card says so."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any, get_args

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from ..base.units import Kind
from .scene_table import MEASURES

#: SI units of what is given in questions and of shapes.
GIVEN = {"pressure": "Pa", "length": "m", "flaw": "m", "pressure_sd": "Pa", "length_sd": "m"}


def bare_numbers(content: Mapping[str, Any], tables: Mapping[str, type[BaseModel]]) -> tuple[str, ...]:
    """Return the numbers without a unit that have one in SI, each with its name and that unit.

    Parameters
    ----------
    content : mapping
        The tables of a card as they were read.
    tables : mapping
        What its tables are, by their headers.

    Returns
    -------
    tuple of str
        None without a rod, or with one by its ratio alone: such numbers are in units of its own.
    """
    rod = content.get("rod")
    if not isinstance(rod, Mapping) or "ratio" in rod:
        return ()
    found = dict.fromkeys(
        f"{key} = {value:g} {unit}"
        for header, model in tables.items()
        for table in _several(content.get(header))
        for key, value in table.items()
        if isinstance(value, int | float) and not isinstance(value, bool) and (unit := _unit(model, key))
    )
    return tuple(found)


def _several(table: object) -> Iterator[Mapping[str, Any]]:
    """Yield a table, or each of several."""
    tables: Iterable[object] = table if isinstance(table, list) else (table,)
    return (each for each in tables if isinstance(each, Mapping))


def noted_kind(field: FieldInfo) -> Kind | None:
    """Return what a key of a table measures, as its annotation notes it; None where it does not."""
    inner = (one for arg in get_args(field.annotation) for one in getattr(arg, "__metadata__", ()))
    return next((one for one in (*field.metadata, *inner) if isinstance(one, Kind)), None)


def _unit(model: type[BaseModel], key: str) -> str:
    """Return the SI unit of a key; empty for a plain number, and where it is not known."""
    field = model.model_fields.get(key)
    kind = None if field is None else noted_kind(field)
    if kind is not None:
        return kind.si
    return MEASURES[key].unit if key in MEASURES else GIVEN.get(key, "")
