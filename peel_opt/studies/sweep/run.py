"""`sweep`: the same question over many rods and many given numbers."""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import Executor
from contextlib import closing, nullcontext
from pathlib import Path
from typing import Any

import numpy as np

from ...base.checks import flag, whole
from ...base.errors import InvalidInput, WorkersLost
from ...base.progress import Progress
from ...base.progress import progress as progressing
from ...equilibria.methods import Method
from ...model.bond import CohesiveLaw
from ...model.rod import Rod
from ...model.scene import Scene
from ...residual.discretisation import Transcription
from .answers import NUMBERS, TEXTS, ChunkAnswers, answer_chunk
from .journal import Journal
from .plan import Options, Plan, Task
from .table import Sweep
from .workers import MOST_WORKERS, computed


def sweep(
    axes: Mapping[str, Any],
    *,
    rod: Rod | Scene | None = None,
    zipped: bool = False,
    law: str | CohesiveLaw | None = None,
    state: str | None = None,
    method: str | Method | Transcription = "auto",
    tol: float = 1e-8,
    journal: str | Path | None = None,
    executor: Executor | None = None,
    workers: int | None = None,
    same_bits: bool = True,
    progress: Progress = None,
) -> Sweep:
    """Answer one question at every point of a grid, or of a list.

    Parameters
    ----------
    axes : mapping of str to array_like or float
        What varies, by name, and single numbers for what does not.  The rod:
        ``bending_stiffness`` [N m], ``adhesion_strength`` [Pa] and ``adhesion_range`` [m], or
        ``ratio`` = eta/y0 alone.  The question, one of ``pressure`` [Pa], ``length`` [m],
        ``pressure_ratio`` = p/T0 and ``length_ratio`` = sbar/eta.  Or ``beta0`` with ``lam`` or
        ``beta1``.  Of a scene any of its numbers besides, by the names that `solve` frees them by, in
        the units of its rod.
    rod : Rod or Scene, optional
        Has the numbers that ``axes`` does not name.  The branch of a scene is walked anew for every set of
        its numbers; its ``ratio`` may vary where its rod is ``Rod.from_ratio``.
    zipped : bool
        Take the axes as the columns of a list of points, instead of all combinations.
    law, state, method, tol
        As for the single call, `pressure_given_length` and its fellows; for all points.  A scene has
        its own law.
    journal : str or Path, optional
        A file that keeps every finished chunk of some hundred points.  If it exists, what it
        holds is not computed again: after an interruption of any kind, the same call goes on.
    executor : concurrent.futures.Executor, optional
        Who computes; it stays open.  A dask cluster is ``client.get_executor()``.
    workers : int, optional
        Processes to start instead; 1 for none.  By default the work begins in this process,
        and one process a core is started once a second has passed and more than some are left,
        unless the law or the method cannot travel or this process may not start others.
    same_bits : bool
        Insist that all workers and the journal round alike.  If not, as on machines of
        different makes, results may differ in the last bit depending on who computed them.
    progress : None, bool or callable
        By default a bar on stderr after a second, if that is a terminal; False for none; or a
        function that is called with the number of points done and of all.

    Returns
    -------
    Sweep
        Arrays of the shape of the grid, or of the list.  The same bits whoever computes them,
        in whatever order, and however often it was interrupted.

    Raises
    ------
    InvalidInput
        If the axes do not make a question, the journal is of another sweep or release or
        damaged, or the workers asked for cannot be started here.
    WorkersLost
        If workers keep dying or do not round alike.  What is finished is in the journal.

    Examples
    --------
    >>> found = sweep({"ratio": [0.5, 1.0], "pressure_ratio": [0.1, 0.8]})
    >>> found["length_ratio"].round(6).tolist()
    [[nan, 3.393955], [nan, 3.036804]]
    >>> found["status"][1].tolist()
    ['no-equilibrium', 'certified']
    """
    zipped, same_bits = flag("zipped", zipped), flag("same_bits", same_bits)
    plan = Plan.of(axes, rod, zipped, Options(law, state, tol, method))
    workers = None if workers is None else whole("workers", workers, 1, MOST_WORKERS)
    if not isinstance(executor, Executor | None):
        raise InvalidInput(
            f"executor must be a concurrent.futures.Executor, got a {type(executor).__name__}.",
            remedy="That of a dask client is client.get_executor().",
        )
    if executor is not None and workers is not None:
        raise InvalidInput("give either an executor or a number of workers, and not both.")
    with nullcontext() if journal is None else Journal(journal, plan) as kept:
        done: dict[int, ChunkAnswers] = {} if kept is None else dict(kept.done)
        alike = {answers.arithmetic for answers in done.values()}
        _require_alike(alike, same_bits, journal)
        left = [task for task in plan.tasks() if task.number not in done]
        if done and same_bits and (executor is None or not left):
            # Else a finished journal would be handed back without anybody having looked.
            alike.add(_arithmetic_here(plan.options))
            _require_alike(alike, same_bits, journal)
        with (
            progressing("point", len(plan), progress) as step,
            closing(computed(left, executor, workers)) as found,
        ):
            step(sum(len(answers.texts) for answers in done.values()))
            for answers in found:
                alike.add(answers.arithmetic)
                _require_alike(alike, same_bits, journal)
                if kept is not None:
                    kept.add(answers)
                done[answers.number] = answers
                step(len(answers.texts))
    return _assembled(plan, done, ", ".join(sorted(alike)))


def _arithmetic_here(options: Options) -> str:
    """Return the arithmetic of this process, found as any worker's is: with a chunk, an empty one."""
    return answer_chunk(Task(-1, (), np.empty((0, 0)), None, options)).arithmetic


def _require_alike(alike: set[str], same_bits: bool, journal: str | Path | None) -> None:
    if same_bits and len(alike) > 1:
        where = "the workers" if journal is None else f"the workers, now and of the journal {str(journal)!r},"
        other = "" if journal is None else " name another journal,"
        raise WorkersLost(
            f"{where} do not round alike: their libraries or processors differ.",
            remedy=f"Use the same versions on machines of one make,{other} or pass same_bits=False and"
            " accept differences in the last bit.",
        )


def _assembled(plan: Plan, done: Mapping[int, ChunkAnswers], arithmetic: str) -> Sweep:
    """Put the answers of all chunks in their places."""
    values = {name: np.empty(len(plan)) for name in NUMBERS}
    for i, name in enumerate(TEXTS):
        longest = max(len(row[i]) for answers in done.values() for row in answers.texts)
        values[name] = np.empty(len(plan), dtype=f"<U{max(longest, 1)}")
    # Chunk by chunk: in between, no column of a large sweep is in memory twice.
    for number, points in enumerate(plan.chunks):
        answers = done[number]
        for name, numbers in zip(NUMBERS, answers.numbers.T, strict=True):
            values[name][points] = numbers
        for name, texts in zip(TEXTS, zip(*answers.texts, strict=True), strict=True):
            values[name][points] = texts
    return Sweep(
        axes=plan.axes,
        fixed=plan.fixed,
        rod=None if "ratio" in plan.columns else plan.rod,
        scene_units=plan.scene_units,
        zipped=plan.zipped,
        asked=plan.asked,
        units=plan.units,
        options=plan.record(),
        arithmetic=arithmetic,
        values={name: column.reshape(plan.shape) for name, column in values.items()},
    )
