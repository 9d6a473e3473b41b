"""A worker process of a sweep, from both ends: the handle on it, and what runs in it.

It is an interpreter of its own that imports this package and nothing of the program that
started it.  `multiprocessing` would run that program's main module in every worker once more,
with all it does, and cannot begin where there is no such file: standard input, a notebook.

Pickles go in on its standard input and come back on its standard output.  The end of its input
is its end, in the middle of a chunk too, so that no worker outlives what started it.
"""

from __future__ import annotations

import os
import pickle
import re
import subprocess
import sys
import threading
from collections.abc import Callable
from contextlib import suppress
from multiprocessing import spawn
from pathlib import Path
from queue import SimpleQueue
from typing import IO, Any

from ...base.errors import InvalidInput, WorkersLost
from .answers import ChunkAnswers, answer_chunk
from .plan import Task

#: Run by the new interpreter, whose arguments are the places where modules are looked for.
_MAIN = f"import sys; sys.path[:] = sys.argv[1:]; import {__name__} as worker; worker.serve()"

#: What a Python is called.  One inside another program is known by that program's name.
_PYTHON = re.compile(r"(python|pypy|graalpy)w?[\d.]*(?!\w\w)", re.IGNORECASE)


class Worker:
    """A process that answers chunks, one at a time.

    Parameters
    ----------
    words : file
        Where it may say why it ends.

    Raises
    ------
    WorkersLost
        If it cannot be started.
    """

    def __init__(self, words: IO[bytes]) -> None:
        command = [_interpreter(), "-c", _MAIN, *(place for place in sys.path if isinstance(place, str))]
        try:
            self._process = subprocess.Popen(
                command,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=words,
                # Interrupts from the keyboard are for the process that started it.
                start_new_session=True,
                creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),
            )
        except OSError as error:
            raise WorkersLost(f"no process can be started here: {error.strerror}.") from error

    def take_up(self, shared: bytes) -> None:
        """Wait until it is ready.

        Parameters
        ----------
        shared : bytes
            What all tasks have, pickled, which it must be able to read.

        Raises
        ------
        InvalidInput
            If it cannot read them.
        WorkersLost
            If it has ended instead.
        """
        if reason := self._reply(shared):
            raise cannot_be_sent(reason)

    def answer(self, task: Task) -> ChunkAnswers:
        """Return the answers of a chunk.

        Raises
        ------
        WorkersLost
            If the process has ended before.
        """
        found: ChunkAnswers = self._reply(pickle.dumps(task))
        return found

    def end(self) -> None:
        """End it at once, whatever it does."""
        self._process.kill()
        self._process.wait()
        for pipe in (self._process.stdin, self._process.stdout):
            assert pipe is not None
            with suppress(OSError):  # what was still on its way to it
                pipe.close()

    def _reply(self, given: bytes) -> Any:
        pipes = self._process
        assert pipes.stdin is not None
        assert pipes.stdout is not None
        try:
            pickle.dump(given, pipes.stdin)
            pipes.stdin.flush()
            return pickle.load(pipes.stdout)
        except (EOFError, OSError, ValueError, pickle.UnpicklingError) as error:
            raise WorkersLost("a worker process has ended.") from error


def cannot_be_sent(reason: object) -> InvalidInput:
    """Return the error that the law, the method or the scene is known to this process alone."""
    return InvalidInput(
        f"the law, the method or the scene cannot be sent to another process: {reason}.",
        remedy="Define it at the top of a module of its own, which the script imports, or pass workers=1.",
    )


def _interpreter() -> str:
    """Return the Python to start, that of `multiprocessing`, which a program can set."""
    executable = os.fsdecode(spawn.get_executable() or "")
    frozen = getattr(sys, "frozen", False) and executable == sys.executable
    if frozen or not _PYTHON.match(Path(executable).name):
        raise WorkersLost(
            "this program is no plain Python, so that it has none to start workers with.",
            remedy="Pass workers=1, or name one by multiprocessing.set_executable.",
        )
    return executable


def serve() -> None:
    """Answer what comes in until nothing does: the whole life of a worker process."""
    came: SimpleQueue[bytes] = SimpleQueue()
    replies = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what libraries print is no reply

    def listen() -> None:
        with os.fdopen(0, "rb", closefd=False) as pipe:
            try:
                while True:
                    came.put(pickle.load(pipe))
            finally:
                os._exit(0)

    threading.Thread(target=listen, daemon=True).start()
    reply: Callable[[bytes], Any] = _taken_up
    while True:
        pickle.dump(reply(came.get()), replies)
        replies.flush()
        reply = _answered


def _taken_up(shared: bytes) -> str:
    """Return why this cannot be read; nothing if it can."""
    try:
        pickle.loads(shared)
    except Exception as error:
        return f"{type(error).__name__}: {error}".rstrip(".")
    return ""


def _answered(task: bytes) -> ChunkAnswers:
    return answer_chunk(pickle.loads(task))
