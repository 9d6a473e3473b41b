"""The journal of a sweep: every finished chunk, a line each, on disk before the next begins.

::

    <checksum> {"schema": "peel_opt sweep journal", "schema_version": 1, "fingerprint": ..., ...}
    <checksum> {"chunk": 0, "arithmetic": ..., "numbers": ["0x1.8p+1 nan ...", ...], "texts": [[...], ...]}

Numbers are stored exactly, in hexadecimal.  Lines are only ever added, so that whatever ends
the process leaves all of them but perhaps the last whole; the torn end of one is cut off before
the next is added.  A journal that is refused stays as it is.
"""

from __future__ import annotations

import json
import os
import stat
import zlib
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np

from ... import __version__
from ...base.errors import InvalidInput
from ...base.files import as_path, require_schema
from .answers import NUMBERS, TEXTS, ChunkAnswers
from .plan import Plan

SCHEMA = "peel_opt sweep journal"
SCHEMA_VERSION = 1

#: Windows would otherwise change the ends of lines.
_FLAGS = os.O_RDWR | os.O_CREAT | os.O_APPEND | getattr(os, "O_BINARY", 0)


class Journal:
    """The journal of one sweep, open for reading what is done and adding to it.

    Parameters
    ----------
    path : str or Path
        A file; made if it does not exist, in a folder that does.
    plan : Plan
        The sweep it must belong to.

    Raises
    ------
    InvalidInput
        If the file belongs to another sweep or was begun by another release, is none of ours,
        is damaged, is being written by another process, or cannot be written.
    """

    def __init__(self, path: str | Path, plan: Plan) -> None:
        if not isinstance(path, str | Path):
            raise InvalidInput(f"journal must be the path of a file, got {path!r}.")
        self.path = as_path(path)
        self.done: dict[int, ChunkAnswers] = {}
        self._plan = plan
        self._torn_at: int | None = None
        try:
            self._file = os.open(self.path, _FLAGS, 0o644)
        except (OSError, ValueError) as error:  # ValueError: a NUL in the path
            reason = getattr(error, "strerror", None) or error
            raise InvalidInput(f"cannot open the journal {str(self.path)!r}: {reason}.") from error
        try:
            self._require_file()
            self._lock()
            self._read()
        except BaseException:
            os.close(self._file)
            raise

    def add(self, answers: ChunkAnswers) -> None:
        """Write a finished chunk through to the disk."""
        numbers = [" ".join(map(float.hex, row)) for row in answers.numbers.tolist()]
        self._append(
            {
                "chunk": answers.number,
                "arithmetic": answers.arithmetic,
                "numbers": numbers,
                "texts": answers.texts,
            }
        )
        self.done[answers.number] = answers

    def __enter__(self) -> Journal:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        os.close(self._file)  # and with it the lock

    def _head(self) -> dict[str, Any]:
        plan = self._plan
        head = {"schema": SCHEMA, "schema_version": SCHEMA_VERSION, "fingerprint": plan.fingerprint()}
        about = {
            "points": len(plan),
            "chunks": len(plan.chunks),
            "axes": list(plan.axes),
            "asked": plan.asked,
            "release": __version__,
        }
        return head | about | plan.record()

    def _append(self, record: dict[str, Any]) -> None:
        line = _line(record)
        try:
            if self._torn_at is not None:
                os.ftruncate(self._file, self._torn_at)
                self._torn_at = None
            while line:
                line = line[os.write(self._file, line) :]
            os.fsync(self._file)
        except OSError as error:
            raise InvalidInput(
                f"cannot write the journal {str(self.path)!r}: {error.strerror}.",
                remedy="Make room and start the sweep again: what it holds is kept.",
            ) from error

    def _require_file(self) -> None:
        if not stat.S_ISREG(os.fstat(self._file).st_mode):
            raise InvalidInput(
                f"the journal {str(self.path)!r} is not a regular file.", remedy="Name another file."
            )

    def _lock(self) -> None:
        try:
            import fcntl
        except ImportError:  # not on Windows
            return
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            raise InvalidInput(
                f"the journal {str(self.path)!r} is being written by another process.",
                remedy="Wait for it, or name another file.",
            ) from error

    def _read(self) -> None:
        """Take up what is there, find a torn end, or begin."""
        head = _line(self._head())
        with open(self.path, "rb") as file:
            first = file.readline()
            if head.startswith(first) and first != head:
                # Empty, or torn while it was begun.
                self._torn_at = 0
                self._append(self._head())
                return
            self._check_head(first)
            good = len(first)
            for line in file:
                record = _record(line)
                if record is None:
                    if file.read(1):
                        raise self._damaged(f"the line at byte {good} does not have its checksum")
                    self._torn_at = good
                    return
                self._take(record)
                good += len(line)

    def _check_head(self, line: bytes) -> None:
        head = _record(line)
        try:
            if head is None:
                raise ValueError("its first line is none of a journal")
            require_schema(head, SCHEMA, SCHEMA_VERSION)
        except (ValueError, LookupError) as error:
            raise self._damaged(str(error)) from error
        if head.get("fingerprint") != self._plan.fingerprint():
            kept = ", ".join(f"{name} {head.get(name)}" for name in ("points", "axes", "asked", "release"))
            raise InvalidInput(
                f"the journal {str(self.path)!r} belongs to another sweep ({kept}).",
                remedy="Resume with the same axes, rod, options and release, or name another file.",
            )

    def _take(self, record: dict[str, Any]) -> None:
        try:
            number, rows, texts = record["chunk"], record["numbers"], record["texts"]
            numbers = np.array([[float.fromhex(v) for v in row.split()] for row in rows], dtype=np.float64)
            size = len(self._plan.chunks[number])
            texts, computed_by = [tuple(row) for row in texts], record["arithmetic"]
            right = all(len(row) == len(TEXTS) and all(isinstance(t, str) for t in row) for row in texts)
            if number < 0 or numbers.shape != (size, len(NUMBERS)) or len(texts) != size or not right:
                raise ValueError(f"chunk {number} does not have its rows")
            if not isinstance(computed_by, str):
                raise ValueError(f"chunk {number} does not say who computed it")
            if number in self.done:
                raise ValueError(f"chunk {number} stands there twice")
            self.done[number] = ChunkAnswers(number, computed_by, numbers, texts)
        except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
            raise self._damaged(str(error)) from error

    def _damaged(self, reason: str) -> InvalidInput:
        return InvalidInput(
            f"{str(self.path)!r} is not the journal of a sweep, or it is damaged: {reason}.",
            remedy="Name another file; this one is left as it is.",
        )


def _line(record: dict[str, Any]) -> bytes:
    text = json.dumps(record, separators=(",", ":")).encode("ascii")
    return b"%08x %s\n" % (zlib.crc32(text), text)


def _record(line: bytes) -> dict[str, Any] | None:
    """Return what a line says; None if it is torn or damaged."""
    checksum, _, text = line.rstrip(b"\n").partition(b" ")
    if not line.endswith(b"\n") or checksum != b"%08x" % zlib.crc32(text):
        return None
    try:
        record = json.loads(text)
    except (RecursionError, ValueError):  # with the right checksum: not by accident
        return None
    return record if isinstance(record, dict) else None
