"""Records: what is declared once comes back from every file, and what is no such file is refused."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

import numpy as np
import pytest

from peel_opt.base.errors import InvalidInput
from peel_opt.base.records import Column, Schema, Stored, Table, array, entries, read_csv


@dataclass(frozen=True, eq=False)
class Track(Stored):
    """A result as any other: a name, times and places."""

    schema = Schema("peel_opt track", 3, oldest=2, largest=100_000)

    name: str
    times: np.ndarray
    places: np.ndarray

    def _head(self) -> dict[str, Any]:
        return {"name": self.name}

    def _arrays(self) -> dict[str, np.ndarray]:
        return {"times": self.times, "places": self.places}

    def _table(self) -> Table:
        columns = {"time": Column(self.times, "s"), "place": Column(self.places)}
        return Table(self.schema.stamped(self._head()).items(), columns)

    @classmethod
    def _restored(cls, head: dict[str, Any], arrays: dict[str, np.ndarray]) -> Self:
        times = array(arrays, "times")
        return cls(
            **entries(head, str, "name"), times=times, places=array(arrays, "places", "f", times.shape)
        )


TRACK = Track("a", np.array([0.1, 1 / 3]), np.array([np.nan, -0.0]))


def saved(path: Path, **changes: Any) -> Path:
    """Write the track, with entries of its head or its arrays replaced."""
    head = Track.schema.stamped({"name": "a"}) | {
        k: v for k, v in changes.items() if k in ("name", "schema_version")
    }
    arrays = {"times": TRACK.times, "places": TRACK.places} | {
        k: v for k, v in changes.items() if k not in head
    }
    np.savez(path, metadata=np.array(json.dumps(head)), **arrays)
    return path


def test_every_bit_comes_back(tmp_path: Path) -> None:
    back = Track.load(TRACK.save(tmp_path / "track.npz"))
    assert back.name == "a"
    assert back.times.tobytes() == TRACK.times.tobytes()
    assert back.places.tobytes() == TRACK.places.tobytes()


def test_a_table_has_units_in_its_titles_and_is_read_by_those_who_know_its_schema(tmp_path: Path) -> None:
    path = TRACK.to_csv(tmp_path / "track.csv")
    assert path.read_text() == TRACK.csv_text()
    assert "\ntime [s],place\n0.1,nan\n" in TRACK.csv_text()
    head, columns = read_csv(path.read_bytes())
    assert head == {"schema": "peel_opt track", "schema_version": 3, "name": "a"}
    assert columns["time [s]"].tobytes() == TRACK.times.tobytes()
    assert columns["place"].tobytes() == TRACK.places.tobytes()
    assert [row["time [s]"] for row in TRACK._table().rows] == [0.1, 1 / 3]


def test_files_since_the_oldest_version_are_read(tmp_path: Path) -> None:
    for version, read in ((1, False), (2, True), (3, True), (4, False), ("3", False), (None, False)):
        path = saved(tmp_path / "track.npz", schema_version=version)
        if read:
            assert Track.load(path).name == "a"
        else:
            with pytest.raises(InvalidInput, match=f"version is {version}, this peel_opt reads version 3"):
                Track.load(path)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"name": 3}, "name is no text"),
        ({"times": np.zeros(2, np.float32)}, "times does not hold its numbers"),
        ({"times": np.zeros((2, 2))}, "times does not hold its numbers"),
        ({"places": np.zeros(3)}, "places does not hold 2 numbers"),
        ({"places": np.array(["a", "b"])}, "places does not hold 2 numbers"),
        ({"places": np.zeros(20_000)}, "too large"),
    ],
)
def test_what_does_not_hold_together_is_refused_in_a_line(tmp_path: Path, changes: Any, words: str) -> None:
    with pytest.raises(InvalidInput, match=f"not a track file, or it is damaged: .*{words}") as caught:
        Track.load(saved(tmp_path / "track.npz", **changes))
    assert "\n" not in str(caught.value)
