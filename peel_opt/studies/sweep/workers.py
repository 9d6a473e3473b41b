"""Who computes the chunks of a sweep: this process, a pool of its own, or any executor.

CasADi and MUMPS are not thread-safe, so the pool is one of processes, started afresh (spawn)
and each with a watch on its parent: however that one ends, no worker outlives it.
"""

from __future__ import annotations

import os
import pickle
import signal
import threading
import time
from collections.abc import Generator, Iterator, Sequence
from concurrent.futures import BrokenExecutor, Executor, Future, ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from multiprocessing import current_process, get_context
from multiprocessing.connection import Connection

from ...base.errors import InvalidInput, WorkersLost
from .answers import Answers, answer_chunk
from .plan import Task

#: Seconds a sweep may take here before what is left is looked at, and how many seconds must
#: then be left for processes, which take a second or two to start, to be worth it.
ALONE, WORTHWHILE = 1.0, 4.0

#: More processes than this are a slip of the pen.
MOST_WORKERS = 1000

#: How often in a row workers may die without finishing a single chunk.
MOST_LOSSES = 3

REMEDY = (
    'Call the sweep below `if __name__ == "__main__":` in a file, or pass workers=1; if the'
    " machine ran out of memory, fewer workers."
)


def computed(
    tasks: Sequence[Task], executor: Executor | None, workers: int | None
) -> Generator[Answers, None, None]:
    """Yield the answers of all tasks, in the order in which they are finished.

    Parameters
    ----------
    tasks : sequence of Task
    executor : Executor or None
        None for this process and, where it pays and can be had, a pool of its own.
    workers : int or None
        Processes of that pool; 1 for none, None for one a core, once a second has passed and
        more than a few are left.

    Raises
    ------
    InvalidInput
        If a number of workers is asked for where this process may start none, or for a law or
        method that cannot be sent to them.
    WorkersLost
        If workers keep dying, or the executor is broken.
    """
    if executor is not None:
        yield from _by_executor(tasks, executor)
    elif workers is None:
        yield from _adaptively(tasks, cores())
    elif workers == 1:
        yield from map(answer_chunk, tasks)
    else:
        yield from _by_pool(tasks, workers)


def cores() -> int:
    """Return how many processors this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _adaptively(tasks: Sequence[Task], workers: int) -> Iterator[Answers]:
    began = time.perf_counter()
    for done, task in enumerate(tasks):
        spent = time.perf_counter() - began
        if done and workers > 1 and spent > ALONE and spent / done * (len(tasks) - done) > WORTHWHILE:
            try:
                _require_pool(tasks)
            except InvalidInput:
                workers = 1  # nobody asked for processes: here it takes longer, but it is answered
            else:
                yield from _by_pool(tasks[done:], workers)
                return
        yield answer_chunk(task)


def _by_executor(tasks: Sequence[Task], executor: Executor) -> Iterator[Answers]:
    """Submit all to an executor of the caller's, which stays open."""
    futures: list[Future[Answers]] = []
    lost: Exception | None = None
    try:
        try:
            futures.extend(executor.submit(answer_chunk, task) for task in tasks)
        except Exception as error:
            lost = error  # what it did take may yet be finished
        for future in as_completed(futures):
            try:
                answers = future.result()
            except Exception as error:
                lost = error  # its fellows may have finished
                continue
            yield answers
    finally:
        for future in futures:
            future.cancel()
    if lost is not None:
        reason = " ".join(str(lost).split()).rstrip(".")
        raise WorkersLost(
            f"the executor failed: {type(lost).__name__}{reason and ': '}{reason}.",
            remedy="What is finished stands in the journal, if there is one: the same call goes on.",
        ) from lost


def _by_pool(tasks: Sequence[Task], workers: int) -> Iterator[Answers]:
    """Run a pool of processes; where it breaks, a new one does what is left."""
    left, losses = {task.number: task for task in tasks}, 0
    _require_pool(tasks)
    while left:
        lost = None
        with _pool(min(workers, len(left))) as pool:
            for future in as_completed(_submitted(pool, list(left.values()))):
                try:
                    answers = future.result()
                except BrokenExecutor as error:
                    lost = error  # its fellows may have finished
                    continue
                losses = 0
                del left[answers.number]
                yield answers
        if lost is not None:
            losses += 1
            if losses > MOST_LOSSES:
                raise WorkersLost(
                    f"worker processes died {losses} times without finishing anything;"
                    f" {len(left)} of {len(tasks)} chunks are left.",
                    remedy=REMEDY,
                ) from lost


@contextmanager
def _pool(workers: int) -> Iterator[ProcessPoolExecutor]:
    """Return processes that end with this block, at once if it is left by an exception."""
    context = get_context("spawn")
    watched, lifeline = context.Pipe(duplex=False)
    pool = ProcessPoolExecutor(workers, context, initializer=_watch, initargs=(watched,))
    try:
        yield pool
    except BaseException:
        lifeline.close()  # which workers take as their end, in the middle of a chunk too
        raise
    finally:
        pool.shutdown(wait=True, cancel_futures=True)
        lifeline.close()
        watched.close()


def _watch(lifeline: Connection) -> None:
    """In a worker: leave interrupts to the parent, and end when it does."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)

    def wait() -> None:
        lifeline.poll(None)  # true at the end of the pipe: nothing is ever sent
        os._exit(0)

    threading.Thread(target=wait, daemon=True).start()


def _submitted(pool: ProcessPoolExecutor, tasks: list[Task]) -> list[Future[Answers]]:
    """Submit tasks; the processes that start meanwhile inherit that they do not hear Ctrl-C."""
    if not hasattr(signal, "pthread_sigmask"):
        return [pool.submit(answer_chunk, task) for task in tasks]
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        return [pool.submit(answer_chunk, task) for task in tasks]
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _require_pool(tasks: Sequence[Task]) -> None:
    """Raise where a pool could not even begin."""
    if current_process().daemon:
        raise InvalidInput(
            "this process is itself a daemonic worker, which may not start others.",
            remedy="Pass workers=1, or call the sweep in the process that started this one.",
        )
    _require_pickle(tasks)


def _require_pickle(tasks: Sequence[Task]) -> None:
    try:
        pickle.dumps(tasks[:1])
    except (pickle.PicklingError, AttributeError, TypeError) as error:
        raise InvalidInput(
            f"the law or the method cannot be sent to another process: {error}.",
            remedy="Define it at the top of a module instead of inside a function, or pass workers=1.",
        ) from error
