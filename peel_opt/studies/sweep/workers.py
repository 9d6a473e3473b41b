"""Who computes the chunks of a sweep: this process, a pool of its own, or any executor.

CasADi and MUMPS are not thread-safe, so the pool is one of processes (`process`), each
served by a thread that waits for it.
"""

from __future__ import annotations

import os
import pickle
import time
from collections.abc import Generator, Iterator, Sequence
from concurrent.futures import Executor, Future, ThreadPoolExecutor, as_completed
from multiprocessing import parent_process
from tempfile import TemporaryFile

from ...base.errors import InvalidInput, WorkersLost
from .answers import ChunkAnswers, answer_chunk
from .plan import Task
from .process import Worker, cannot_be_sent

#: Seconds a sweep may take here before what is left is looked at, and how many seconds must
#: then be left for processes, which take a second or two to start, to be worth it.
ALONE, WORTHWHILE = 1.0, 4.0

#: More processes than this are a slip of the pen.
MOST_WORKERS = 1000

#: How often in a row workers may die without finishing a single chunk.
MOST_LOSSES = 3

REMEDY = "Pass workers=1; if the machine ran out of memory, fewer workers."


def computed(
    tasks: Sequence[Task], executor: Executor | None, workers: int | None
) -> Generator[ChunkAnswers, None, None]:
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
        If a number of workers is asked for, and the law or the method cannot be sent to them.
    WorkersLost
        If workers that are asked for cannot be started, if workers keep dying, or if the
        executor is broken.
    """
    if executor is not None:
        yield from _by_executor(tasks, executor)
    elif workers is None:
        yield from _adaptively(tasks, cores())
    elif workers == 1:
        yield from map(answer_chunk, tasks)
    elif tasks:
        yield from _by_crew(tasks, Crew(min(workers, len(tasks)), tasks[0]))


def cores() -> int:
    """Return how many processors this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _adaptively(tasks: Sequence[Task], workers: int) -> Iterator[ChunkAnswers]:
    if parent_process() is not None:
        workers = 1  # one of several processes: its fellows have the other cores
    began = time.perf_counter()
    for done, task in enumerate(tasks):
        spent = time.perf_counter() - began
        left = tasks[done:]
        if done and workers > 1 and spent > ALONE and spent / done * len(left) > WORTHWHILE:
            try:
                crew = Crew(min(workers, len(left)), task)
            except (InvalidInput, WorkersLost):
                workers = 1  # nobody asked for processes: here it takes longer, but it is answered
            else:
                yield from _by_crew(left, crew)
                return
        yield answer_chunk(task)


def _by_executor(tasks: Sequence[Task], executor: Executor) -> Iterator[ChunkAnswers]:
    """Submit all to an executor of the caller's, which stays open."""
    futures: list[Future[ChunkAnswers]] = []
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


class Crew:
    """Processes that are ready for chunks; all of them are given up when one is lost.

    Parameters
    ----------
    size : int
        How many.
    task : Task
        One of the chunks, for what all have: the subject and the options.

    Raises
    ------
    InvalidInput
        If the scene or the options cannot be sent to another process.
    WorkersLost
        If no process can be started.
    """

    def __init__(self, size: int, task: Task) -> None:
        try:
            sent = pickle.dumps((task.subject, task.options))
        except (pickle.PicklingError, AttributeError, TypeError) as error:
            raise cannot_be_sent(f"{error}".rstrip(".")) from error
        try:
            self._words = TemporaryFile()  # noqa: SIM115 - closed by `end`
        except OSError as error:
            raise WorkersLost(f"workers need a temporary file: {error.strerror}.") from error
        self.size = size
        self._workers: list[Worker] = []
        self._idle: list[Worker] = []
        self._lost = False
        try:
            for _ in range(size):
                self._workers.append(Worker(self._words))
            for worker in self._workers:
                self._begin(worker, sent)
        except BaseException:
            self.end()
            raise

    def answer(self, task: Task) -> ChunkAnswers:
        """Have a chunk answered by an idle process; call it from no more threads than there are processes.

        Raises
        ------
        WorkersLost
            If that process ends, or another one has ended before.
        """
        if self._lost:
            raise WorkersLost("a fellow of this worker process has ended.")
        worker = self._idle.pop()
        try:
            answers = worker.answer(task)
        except WorkersLost:
            self._lost = True
            raise
        self._idle.append(worker)
        return answers

    def last_words(self) -> str:
        """Return the last line that one of them wrote, such as the error that ended it."""
        self._words.seek(0)
        lines = self._words.read().decode(errors="replace").split("\n")
        return next((line.strip().rstrip(".") for line in reversed(lines) if line.strip()), "nothing said")

    def end(self) -> None:
        """End all of them at once."""
        self._lost = True
        for worker in self._workers:
            worker.end()
        self._words.close()

    def _begin(self, worker: Worker, sent: bytes) -> None:
        try:
            worker.take_up(sent)
        except WorkersLost as error:
            raise WorkersLost(
                f"a worker process ended before it began: {self.last_words()}.", remedy=REMEDY
            ) from error
        self._idle.append(worker)


def _by_crew(tasks: Sequence[Task], crew: Crew) -> Iterator[ChunkAnswers]:
    """Have all answered; where a process is lost, a new crew does what is left."""
    left, losses = {task.number: task for task in tasks}, 0
    while True:
        lost: WorkersLost | None = None
        with ThreadPoolExecutor(crew.size) as threads:
            try:
                for future in as_completed([threads.submit(crew.answer, task) for task in left.values()]):
                    try:
                        answers = future.result()
                    except WorkersLost as error:
                        lost = error  # its fellows may have finished
                        continue
                    losses = 0
                    del left[answers.number]
                    yield answers
                words = crew.last_words()
            finally:
                crew.end()  # for which the threads wait
        if lost is None:
            return
        losses += 1
        if losses > MOST_LOSSES:
            raise WorkersLost(
                f"worker processes died {losses} times without finishing anything ({words});"
                f" {len(left)} of {len(tasks)} chunks are left.",
                remedy=REMEDY,
            ) from lost
        crew = Crew(min(crew.size, len(left)), tasks[0])
