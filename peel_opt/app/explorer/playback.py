"""Pictures recorded one by one, and the script that shows any of them without a server.

What a picture sets, on all models that take part, becomes a row of numbers: each the place of a value
in a table that all pictures share.  Most values are the same from one picture to the next.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable
from typing import Any

import numpy as np
from bokeh.models import (
    Axis,
    ColumnDataSource,
    CustomJS,
    Div,
    Label,
    LegendItem,
    Model,
    Range1d,
    Span,
    Title,
)

#: What may change from one picture to the next, by kind of model.
CHANGING: tuple[tuple[type[Model], tuple[str, ...]], ...] = (
    (ColumnDataSource, ("data",)),
    (Range1d, ("start", "end", "reset_start", "reset_end")),
    (LegendItem, ("label", "visible")),
    (Label, ("text", "visible", "x", "y")),
    (Span, ("location", "visible")),
    (Title, ("text",)),
    (Axis, ("axis_label",)),
    (Div, ("text",)),
)

#: Shows the picture whose number the player holds: sets what differs from what is shown.
_SHOW = """
const {columns, rows, values, arrays, state} =
    (globalThis.peel_opt_playback ??= {...JSON.parse(text), state: {shown: -1}})
const numbers = (at, size) => Array.from(new Float32Array(pool.buffer, pool.byteOffset + 4*at, size))
const column = (entry) => entry.length == 2 ? numbers(...entry) : entry[0]
const found = ({table, plain}) => table === undefined
    ? plain
    : Object.fromEntries(Object.entries(table).map(([name, i]) => [name, column(arrays[i])]))
const n = player.data.number[0], before = state.shown < 0 ? [] : rows[state.shown]
const changes = new Map()
rows[n].forEach((value, k) => {
    if (value === before[k]) return
    const [model, name] = columns[k]
    changes.set(model, {...changes.get(model), [name]: found(values[value])})
})
state.shown = n
for (const [model, attrs] of changes) models[model].setv(attrs)
"""


class Recorder:
    """Takes down the pictures that models show, in the order in which they were made.

    Parameters
    ----------
    roots : iterable of Model
        They and all that they refer to are watched.
    """

    def __init__(self, roots: Iterable[Model]) -> None:
        watched = {model for root in roots for model in root.references()}
        # By age, so that the same page is written the same way.
        ordered = sorted(watched, key=lambda model: (len(model.id), model.id))
        self._slots = [
            (model, name) for model in ordered for kind, names in CHANGING if isinstance(model, kind)
            for name in names
        ]  # fmt: skip
        self._values: dict[str, int] = {}
        self._arrays: dict[bytes, int] = {}
        self._entries: list[list[Any]] = []
        self._pool: list[np.ndarray] = []
        self._filled = 0
        self._rows: list[list[int]] = []

    def __len__(self) -> int:
        return len(self._rows)

    def take(self) -> int:
        """Take down what is shown now, and return the number of the picture."""
        row = []
        for model, name in self._slots:
            value = getattr(model, name)
            if name == "data":
                entry: dict[str, Any] = {"table": {key: self._array(value[key]) for key in sorted(value)}}
            else:
                entry = {"plain": _plain(value)}
            row.append(self._values.setdefault(json.dumps(entry, allow_nan=False), len(self._values)))
        self._rows.append(row)
        return len(self._rows) - 1

    def _array(self, column: Any) -> int:
        """Return the number of a column, remembered once for all pictures that have it."""
        values = np.asarray(column)
        words = len(values) > 0 and values.dtype.kind not in "fiu"
        single = np.zeros(0, "<f4") if words else values.astype("<f4")
        key = repr(list(column)).encode() if words else b"f" + single.tobytes()
        if key not in self._arrays:
            self._arrays[key] = len(self._entries)
            self._entries.append([list(column)] if words else [self._filled, len(single)])
            self._pool.append(single)
            self._filled += len(single)
        return self._arrays[key]

    def player(self) -> ColumnDataSource:
        """Return a source that shows the picture whose number is put into its column "number".

        To be called once, when all pictures are taken.
        """
        rows = np.array(self._rows)
        # What no picture changes is as it is.
        changing = np.flatnonzero((rows != rows[:1]).any(axis=0))
        models: list[Model] = list(dict.fromkeys(self._slots[k][0] for k in changing))
        store = {
            "columns": [[models.index(self._slots[k][0]), self._slots[k][1]] for k in changing],
            "rows": rows[:, changing].tolist(),
            "values": [json.loads(text) for text in self._values],
            "arrays": self._entries,
        }
        # As one text: Bokeh would wrap every dictionary in it.
        text = json.dumps(store, separators=(",", ":"), ensure_ascii=False)
        pool = np.concatenate(self._pool) if self._pool else np.zeros(0, "<f4")
        source = ColumnDataSource({"number": [0]}, name="player")
        script = CustomJS(args={"models": models, "text": text, "pool": pool, "player": source}, code=_SHOW)
        source.js_on_change("data", script)
        return source


def _plain(value: Any) -> Any:
    """A value as JSON; labels are Value objects or such dictionaries, what is not set is NaN."""
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not math.isfinite(value):
        return None
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if hasattr(value, "value") and not isinstance(value, str | int | float | bool):
        return {"value": value.value}
    return value
