"""Damaged, foreign and hostile files: read right, or refused in one line, and never run.

The tests of the rooms have the damage one would think of; here it is drawn at random, inside
the archives too, where no checksum stands in the way.
"""

from __future__ import annotations

import io
import json
import os
import zipfile
import zlib
from dataclasses import replace
from pathlib import Path
from tokenize import TokenError

import numpy as np
import pytest
from hypothesis import strategies as st

import peel_opt as po
from peel_opt import Branch, Equilibrium, Sweep

from ..fuzzing import examples, hammer, typed
from ..rods import FLAP

LOADERS = {
    "equilibrium": Equilibrium.load,
    "csv": Equilibrium.load,
    "branch": Branch.load,
    "sweep": Sweep.load,
}
GRID = {"ratio": [0.5, 1.0], "pressure_ratio": [0.7, 0.8, 2.0]}


@pytest.fixture(scope="module")
def originals(tmp_path_factory) -> dict[str, bytes]:
    folder = tmp_path_factory.mktemp("originals")
    eq = po.length_given_pressure(FLAP, 60e3)
    return {
        "equilibrium": eq.save(folder / "eq.npz").read_bytes(),
        "csv": eq.to_csv(folder / "eq.csv").read_bytes(),
        "branch": po.trace(beta0=4, lam=(-1, 1), points=8).save(folder / "b.npz").read_bytes(),
        "sweep": po.sweep(GRID, workers=1).save(folder / "s.npz").read_bytes(),
    }


@st.composite
def flipped(draw: st.DrawFn, data: bytes) -> bytes:
    """Return bytes with some changed, some lost at the end, and some that were not there."""
    hurt = bytearray(data)
    for place in draw(st.lists(st.integers(0, max(len(hurt) - 1, 0)), max_size=4 if hurt else 0)):
        hurt[place] = draw(st.integers(0, 255))
    if draw(st.booleans()):
        del hurt[draw(st.integers(0, len(hurt))) :]
    return bytes(hurt) + draw(st.binary(max_size=8))


def unpacked(data: bytes) -> dict[str, bytes]:
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def packed(entries: dict[str, bytes]) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in entries.items():
            archive.writestr(name, content)
    return buffer.getvalue()


def npy(array: np.ndarray) -> bytes:
    buffer = io.BytesIO()
    np.lib.format.write_array(buffer, np.asarray(array), allow_pickle=True)
    return buffer.getvalue()


class Bomb:
    """Leaves a file behind when it is unpickled."""

    def __reduce__(self):
        return os.mkdir, ("exploded",)


#: Arrays no file of ours holds.
ARRAYS = st.sampled_from(
    [
        np.zeros(0),
        np.zeros(7),
        np.full(3, np.nan),
        np.zeros((2, 2)),
        np.array(1.0),
        np.array(["a", "b"]),
        np.array(b"bytes"),
        np.array([Bomb()], dtype=object),
        np.zeros(3, dtype=[("a", "f8"), ("b", "U3")]),
        np.zeros(2, "M8[s]"),
        np.zeros(2, complex),
        np.zeros(2, "f2"),
        np.zeros(3, ">f8"),
    ]
).map(npy)

#: JSON in the place of a number, a text, a list or a table.
VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5) | st.just(10**400),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=3), inner, max_size=3),
    max_leaves=4,
)


@st.composite
def rewritten(draw: st.DrawFn, data: bytes) -> bytes:
    """Return an archive whose checksums are right and whose content is not."""
    entries = unpacked(data)
    for name in draw(st.lists(st.sampled_from(sorted(entries)), min_size=1, max_size=2)):
        how = draw(st.sampled_from(["flip", "array", "lose", "rename", "head", "head"]))
        if name not in entries:
            continue
        if how == "flip":
            entries[name] = draw(flipped(entries[name]))
        elif how == "array":
            entries[name] = draw(ARRAYS)
        elif how == "lose":
            del entries[name]
        elif how == "rename":
            other = draw(st.sampled_from(["../x.npy", "x", "metadata.npy", "file.npy", " "]))
            entries[other] = entries.pop(name)
        elif "metadata.npy" in entries:
            entries["metadata.npy"] = draw(changed_head(entries["metadata.npy"]))
    return packed(entries)


@st.composite
def changed_head(draw: st.DrawFn, content: bytes) -> bytes:
    """Return the JSON text of an archive with a value of another kind in it, or no JSON at all."""
    try:
        head = json.loads(str(np.load(io.BytesIO(content))))
    except (ValueError, OSError, EOFError, SyntaxError, RecursionError, TokenError):  # hurt already
        return content
    if not isinstance(head, dict) or draw(st.integers(0, 9)) == 0:
        return npy(np.array(draw(st.text(max_size=20) | st.just("[" * 100_000) | VALUES.map(json.dumps))))
    table = head
    while True:
        inner = [v for v in table.values() if isinstance(v, dict) and v]
        if not inner or draw(st.booleans()):
            break
        table = draw(st.sampled_from(inner))
    if table:
        key = draw(st.sampled_from(sorted(table)))
        if draw(st.booleans()):
            table[key] = draw(VALUES)
        else:
            del table[key]
    return npy(np.array(json.dumps(head)))


def read_or_refused(kind: str, path: Path) -> None:
    found = typed(lambda: LOADERS[kind](path))
    if isinstance(found, po.PeelOptError):
        assert isinstance(found, po.InvalidInput), repr(found)
        assert path.name in str(found) or "must be" in str(found), found
    else:
        repr(found)  # what was accepted can be looked at


@pytest.mark.parametrize("kind", LOADERS)
@examples(few=40, many=500)
def test_bytes_changed_at_random(kind, count, originals, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "hurt"

    def check(data: bytes) -> None:
        path.write_bytes(data)
        read_or_refused(kind, path)

    hammer(check, flipped(originals[kind]) | st.binary(max_size=100), count)
    assert os.listdir(tmp_path) == ["hurt"]


@pytest.mark.parametrize("kind", ["equilibrium", "branch", "sweep"])
@examples(few=60, many=800)
def test_archives_that_are_whole_and_wrong(kind, count, originals, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "wrong"

    def check(data: bytes) -> None:
        path.write_bytes(data)
        read_or_refused(kind, path)

    hammer(check, rewritten(originals[kind]), count)
    assert os.listdir(tmp_path) == ["wrong"]  # nothing was unpickled, nothing unpacked beside it


@pytest.mark.parametrize("kind", ["equilibrium", "branch", "sweep"])
def test_pickled_arrays_are_refused_unread(kind, originals, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    entries = unpacked(originals[kind])
    for name in entries:
        (tmp_path / "pickled").write_bytes(packed(entries | {name: npy(np.array([Bomb()], dtype=object))}))
        read_or_refused(kind, tmp_path / "pickled")
    assert os.listdir(tmp_path) == ["pickled"]


@pytest.mark.parametrize("kind", ["equilibrium", "branch", "sweep"])
def test_archives_that_unpack_to_too_much_are_refused_unread(kind, tmp_path, monkeypatch):
    # A bomb of 8 GB takes a while to make.
    for kind_of in (Branch, Sweep):
        monkeypatch.setattr(kind_of, "schema", replace(kind_of.schema, largest=64_000_000))
    path = tmp_path / "bomb"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive, archive.open("x.npy", "w") as entry:
        for _ in range(65):
            entry.write(bytes(1_000_000))
    assert path.stat().st_size < 100_000
    with pytest.raises(po.InvalidInput, match="too large"):
        LOADERS[kind](path)
    # The archive may also say that there is less in it than there is, or an array that it is larger.
    size = (65_000_000).to_bytes(4, "little")
    path.write_bytes(path.read_bytes().replace(size, (1000).to_bytes(4, "little")))
    huge = npy(np.zeros(3)).replace(b"(3,), ", b"(10**15,), ").replace(b"10**15", b"999999999999999")
    for data in (path.read_bytes(), packed({"metadata.npy": huge, "lam.npy": huge})):
        path.write_bytes(data)
        assert isinstance(typed(lambda: LOADERS[kind](path)), po.InvalidInput)


@pytest.mark.parametrize("kind", LOADERS)
def test_the_file_of_another_kind_is_refused_by_name(kind, originals, tmp_path):
    for other, data in originals.items():
        path = tmp_path / "file"
        path.write_bytes(data)
        found = typed(lambda path=path: LOADERS[kind](path))
        assert isinstance(found, po.InvalidInput) == ({kind, other} not in ({kind}, {"equilibrium", "csv"}))


@examples(few=60, many=600)
def test_journals_of_any_content_are_taken_up_or_refused(count, tmp_path):
    path = tmp_path / "sweep.journal"
    whole = po.sweep(GRID, workers=1, journal=path)
    lines = path.read_bytes().splitlines(keepends=True)
    assert len(lines) == 2

    def line(text: bytes) -> bytes:
        return b"%08x %s\n" % (zlib.crc32(text), text)

    @st.composite
    def forged(draw: st.DrawFn) -> bytes:
        """Return lines whose checksums are right and whose content is not."""
        kept = []
        for original in lines:
            record = json.loads(original[9:])
            if draw(st.booleans()):
                record[draw(st.sampled_from(sorted(record)))] = draw(VALUES)
            kept.append(line(json.dumps(record).encode()))
        extra = draw(st.sampled_from([b"{", b"[]", b"null", b"[" * 100_000, b'{"chunk": 0}', b"\xff"]))
        return b"".join(kept) + draw(st.sampled_from([b"", line(extra), lines[1]]))

    def check(data: bytes) -> None:
        path.write_bytes(data)
        found = typed(lambda: po.sweep(GRID, workers=1, journal=path))
        if isinstance(found, po.PeelOptError):
            assert isinstance(found, po.InvalidInput | po.WorkersLost), repr(found)
            assert path.read_bytes() == data  # left as it is
        else:
            assert found.shape == whole.shape

    hammer(check, flipped(b"".join(lines)) | forged(), count)
