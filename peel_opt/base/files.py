"""Files of any kind: written whole or not at all, and read without believing them."""

from __future__ import annotations

import csv
import io
import json
import os
import secrets
import tokenize
import zipfile
import zlib
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any, BinaryIO, TypeVar

import numpy as np

from .errors import InvalidInput

Read = TypeVar("Read")

#: No file of ours is larger; one that is, or unpacks to more, is not one.
MOST_BYTES = 64_000_000

#: What damage shows as, from the depths of zip, JSON and NumPy.
_DAMAGE = (
    ArithmeticError,
    AttributeError,
    EOFError,
    LookupError,
    MemoryError,
    RuntimeError,
    TypeError,
    ValueError,
    tokenize.TokenError,  # NumPy's reader of headers
    zipfile.BadZipFile,
    zlib.error,
)


def as_path(path: object) -> Path:
    """Return a path, or say what was given in the place of one."""
    if not isinstance(path, str | os.PathLike) or isinstance(os.fspath(path), bytes):
        raise InvalidInput(f"a path must be a text or a Path, got {path!r:.60}.")
    return Path(path)


def make_folder(path: str | Path) -> Path:
    """Return a folder that exists now, or raise `InvalidInput`."""
    folder = as_path(path)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InvalidInput(f"cannot make the folder {str(path)!r}: {reason}.") from error
    return folder


def atomic_write(path: str | Path, writer: Callable[[BinaryIO], object]) -> Path:
    """Let ``writer`` fill a file that appears at ``path`` only when it is complete.

    Parameters
    ----------
    path : str or Path
        In a folder that exists; a regular file there is replaced.
    writer : callable
        Receives a binary file open for writing.

    Returns
    -------
    Path

    Raises
    ------
    InvalidInput
        If the path cannot be written.
    """
    target = as_path(path)
    if "\0" in str(target):
        raise InvalidInput(f"cannot write {str(target)!r}: a name has no NUL.", remedy="Give another name.")
    try:
        if target.is_dir():
            raise InvalidInput(f"cannot write {target}: it is a folder.", remedy="Give the name of a file.")
        if not target.parent.is_dir():
            raise InvalidInput(f"cannot write {target}: there is no folder {target.parent}.")
        if target.exists() and not target.is_file():
            raise InvalidInput(f"cannot write {target}: it is not a regular file.")
        # Beside the target, so that the final rename stays inside one file system.
        draft = target.with_name(f".{target.name[:100]}.{secrets.token_hex(6)}.tmp")
        try:
            with open(draft, "xb") as file:
                writer(file)
                file.flush()
                os.fsync(file.fileno())
            os.replace(draft, target)
        finally:
            draft.unlink(missing_ok=True)
    except OSError as error:
        raise InvalidInput(
            f"cannot write {str(target)!r}: {error.strerror or error}.",
            remedy="Choose a folder you may write to.",
        ) from error
    return target


def write_bytes(path: str | Path, content: bytes) -> Path:
    """Write a file that appears at ``path`` only when it is complete; see `atomic_write`."""
    return atomic_write(path, lambda file: file.write(content))


def json_line(value: Any) -> str:
    """Return a value as one line of ASCII JSON that gives the same bits when it is read.

    Raises
    ------
    InvalidInput
        If something in it is no number, text, list or table of such.
    """

    def plain(item: Any) -> Any:
        if isinstance(item, np.generic | np.ndarray):
            return item.tolist()
        raise InvalidInput(
            f"cannot store {item!r}, which is no number, text, list or table of such.",
            remedy="Keep only plain values among the options.",
        )

    return json.dumps(value, default=plain)


def csv_text(head: Iterable[tuple[str, Any]], columns: Mapping[str, np.ndarray]) -> str:
    """Return a table as CSV: what it is in lines ``# key = JSON``, then titles, then one row a line.

    Parameters
    ----------
    head : iterable of (str, value)
        A key may come more than once.
    columns : mapping of str to ndarray
        By title, all of one length; numbers are written with all their digits.

    Raises
    ------
    InvalidInput
        If a value of the head is not plain.
    """
    text = io.StringIO()
    text.writelines(f"# {key} = {json_line(value)}\n" for key, value in head)
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(zip(*(column.tolist() for column in columns.values()), strict=True))
    return text.getvalue()


def save_arrays(path: str | Path, head: Mapping[str, Any], arrays: Mapping[str, np.ndarray]) -> Path:
    """Write arrays, and all else as the JSON text "metadata", to a compressed NPZ; see `unpack`.

    Raises
    ------
    InvalidInput
        If the path cannot be written, or a value of the head is not plain.
    """
    text = np.array(json_line(head))
    named: dict[str, Any] = {"metadata": text, **arrays}
    return atomic_write(path, lambda file: np.savez_compressed(file, **named))


def read_file(
    path: str | Path, parse: Callable[[bytes], Read], kind: str, remedy: str, most: int = MOST_BYTES
) -> Read:
    """Let ``parse`` make something of a file's bytes; what it stumbles over becomes one line.

    Raises
    ------
    InvalidInput
        If the file cannot be read, is larger than ``most``, or ``parse`` fails.
    """
    source = as_path(path)
    try:
        if source.stat().st_size > most:
            raise ValueError("it is too large")
        return parse(source.read_bytes())
    except OSError as error:
        raise InvalidInput(f"cannot read {str(source)!r}: {error.strerror or error}.") from error
    except _DAMAGE as error:
        reason = f"{error.args[0]!r} is missing" if isinstance(error, KeyError) else str(error)
        article = "an" if kind[0] in "aeiou" else "a"
        raise InvalidInput(
            f"{str(source)!r} is not {article} {kind} file, or it is damaged:"
            f" {' '.join(reason.split()).rstrip('.') or type(error).__name__}.",
            remedy=remedy,
        ) from error


def unpack(data: bytes, most: int = MOST_BYTES) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """Return the JSON object "metadata" of an NPZ and its other arrays, or raise what is wrong."""
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        if sum(entry.file_size for entry in archive.infolist()) > most:
            raise ValueError("it is too large")
        if (damaged := archive.testzip()) is not None:
            raise ValueError(f"{damaged} does not have its checksum")
    with np.load(io.BytesIO(data), allow_pickle=False) as stored:
        arrays = {name: stored[name] for name in stored.files}
    text = arrays.pop("metadata")
    if text.dtype.kind != "U" or text.ndim:
        raise ValueError("its metadata is no text")
    return _object(str(text)), arrays


def require_schema(head: dict[str, Any], schema: str, version: int) -> None:
    """Raise unless a file says that it has this schema and version."""
    if head["schema"] != schema:
        raise ValueError(f"it holds {head['schema']!r}, not {schema!r}")
    if head["schema_version"] != version:
        raise ValueError(
            f"its schema version is {head['schema_version']}, this peel_opt reads version {version}"
        )


def _object(text: str) -> dict[str, Any]:
    value = json.loads(text)
    if not isinstance(value, dict):
        raise ValueError("its metadata is no JSON object")
    return value
