"""The files of a command under ``--out``: whose they are, and which of them it wrote.

A folder keeps in ``written.json`` which command each of its files is from, and a fingerprint of
the rod and the question behind it.  The same question replaces its own files; those of another,
or of nobody known, stay unless ``--force`` is given.
"""

from __future__ import annotations

import argparse
import hashlib
import json
from pathlib import Path
from typing import Any

from ...base.errors import InvalidInput

#: Where a folder keeps what its files are.
RECORD = "written.json"

#: As many files are listed by name.
LISTED = 8


def out_files(arguments: argparse.Namespace) -> Files:
    """Make the folder of --out, if there is one, before any work is done."""
    from ...base.files import make_folder

    folder = None if arguments.out is None else make_folder(arguments.out)
    pictures = not getattr(arguments, "no_plot", False)
    return Files(folder, arguments.line, force=arguments.force, pictures=pictures)


def named(stem: str, arguments: argparse.Namespace) -> str:
    """Return the name of a file, with that of the card whose rod it is about."""
    if arguments.card is None:
        return stem
    from ..report import slug

    return f"{stem}-{slug(Path(arguments.card).stem)}"


class Files:
    """Files that one command is about to write; false, and without any effect, where it writes none.

    Parameters
    ----------
    folder : Path or None
        It exists; None where nothing is to be written.
    line : str
        The command as it was typed.
    force : bool
        Whether files of other questions may be replaced.
    pictures : bool
        Whether results are drawn.
    """

    def __init__(self, folder: Path | None, line: str, *, force: bool, pictures: bool) -> None:
        self._folder = folder
        self.pictures = pictures
        self._line = line
        self._force = force
        self._before: dict[str, tuple[int, int] | None] = {}

    def __bool__(self) -> bool:
        return self._folder is not None

    @property
    def claimed(self) -> bool:
        """Whether names were taken: those of a fit that `peel-opt run` comes to are its own."""
        return bool(self._before)

    @property
    def folder(self) -> Path:
        """The folder, where there is one."""
        assert self._folder is not None
        return self._folder

    def add(self, result: Any, stem: str, title: str = "") -> None:
        """Write NPZ, CSV and a picture of a result that is `Stored`, under a name that is claimed."""
        if self:
            from ..report import write_result

            write_result(result, self.folder, stem, picture=self.pictures, title=title)

    def claim(self, asked: object, *names: str) -> None:
        """Take names for what is asked, before any work is done.

        Parameters
        ----------
        asked : object
            What makes the question: plain data, arrays, rods, tables of cards.
        *names : str

        Raises
        ------
        InvalidInput
            If one of the files is there and is that of another rod or question.
        """
        if not self:
            return
        record = self._record()
        mark = fingerprint(asked)
        for name in names:
            owner = record.get(name, {})
            if self._stamp(name) is not None and owner.get("asked") != mark and not self._force:
                whose = (
                    f"is of another rod or question ({owner['command']})"
                    if owner
                    else "is not of this command"
                )
                raise InvalidInput(
                    f"{str(self.folder / name)!r} {whose}.",
                    remedy="Name another folder, or replace it by --force.",
                )
        self._before |= {name: self._stamp(name) for name in names}
        record |= {name: {"command": self._line, "asked": mark} for name in names}
        from ...base.files import write_bytes

        text = json.dumps(dict(sorted(record.items())), indent=1) + "\n"
        write_bytes(self.folder / RECORD, text.encode())

    def claim_kinds(self, asked: object, stem: str, kinds: str = "npz csv") -> str:
        """Claim the files of one name that end in each of ``kinds``, and its picture; return the name."""
        ends = [*kinds.split(), *(["png"] if self.pictures else [])]
        self.claim(asked, *(f"{stem}.{end}" for end in ends))
        return stem

    def said(self) -> str:
        """Return in one line which of the files were written; of many, how many."""
        names = [name for name, before in self._before.items() if self._stamp(name) not in (None, before)]
        if len(names) > LISTED:
            return f"wrote to {self.folder}: {len(names)} files, {names[0]} to {names[-1]}"
        return f"wrote to {self.folder}: {', '.join(names) or 'nothing'}"

    def _stamp(self, name: str) -> tuple[int, int] | None:
        """Return what changes when a file is replaced; None where there is none."""
        path = self.folder / name
        if not path.exists():
            return None
        status = path.stat()
        return status.st_ino, status.st_mtime_ns

    def _record(self) -> dict[str, dict[str, str]]:
        try:
            record = json.loads((self.folder / RECORD).read_bytes())
            return {
                name: {key: str(entry[key]) for key in ("command", "asked")} for name, entry in record.items()
            }
        except FileNotFoundError:
            return {}
        except (OSError, ValueError, TypeError, KeyError, AttributeError, RecursionError) as error:
            raise InvalidInput(
                f"{str(self.folder / RECORD)!r} is not the record of what was written here.",
                remedy="Name another folder.",
            ) from error


def fingerprint(asked: object) -> str:
    """Return a short text that is the same for the same plain data, arrays, rods and tables."""
    from dataclasses import asdict, is_dataclass

    from ...model.scene import Scene
    from ..scene_report import describe_scene

    def plain(item: Any) -> Any:
        if isinstance(item, Scene):  # whose laws are functions
            return [item.rod, describe_scene(item), item.numbers]
        if is_dataclass(item) and not isinstance(item, type):
            return asdict(item)
        if hasattr(item, "model_dump"):
            return item.model_dump()
        return item.tolist() if hasattr(item, "tolist") else repr(item)

    text = json.dumps(asked, default=plain, sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:16]
