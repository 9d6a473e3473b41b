"""What docs/cluster.md says of a cluster of Dask: what is sent, what comes back, and what resumes."""

from __future__ import annotations

import pickle
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import peel_opt as po
from peel_opt.studies.sweep import plan, workers

pytestmark = pytest.mark.slow

distributed = pytest.importorskip("distributed")

#: A grid of 12 chunks.
AXES = {"ratio": np.geomspace(0.5, 50.0, 12), "pressure_ratio": np.linspace(0.6, 0.95, 100)}


@pytest.fixture
def cluster(tmp_path: Path) -> Iterator[Any]:
    """Two workers, processes of this machine."""
    with distributed.LocalCluster(
        n_workers=2,
        threads_per_worker=1,
        dashboard_address=None,
        local_directory=str(tmp_path),
        silence_logs=50,
    ) as two:
        yield two


class Watched(Executor):
    """Passes everything on, and keeps how much it was."""

    def __init__(self, executor: Executor) -> None:
        self._executor = executor
        self.sent: list[int] = []
        self.futures: list[Future[Any]] = []

    def submit(self, function: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        self.sent.append(len(pickle.dumps((function, args, kwargs))))
        self.futures.append(self._executor.submit(function, *args, **kwargs))
        return self.futures[-1]


def rows(journal: Path) -> int:
    """Return how many chunks a journal has."""
    return journal.read_bytes().count(b"\n") - 1 if journal.exists() else 0


def test_two_workers_are_sent_numbers_and_give_the_bits_of_one_core(cluster: Any) -> None:
    with distributed.Client(cluster) as client:
        watched = Watched(client.get_executor())
        there = po.sweep(AXES, executor=watched)
        done = client.run(lambda dask_worker: dask_worker.state.executed_count)
    here = po.sweep(AXES, workers=1)
    for name in ("length_ratio", "error", "certificate", "alpha1"):
        assert np.array_equal(there[name], here[name], equal_nan=True), name
    assert all(done.values())
    assert sum(done.values()) == 12
    assert len(watched.sent) == 12
    assert max(watched.sent) < 6_000
    back = [len(pickle.dumps(future.result())) for future in watched.futures]
    assert max(back) < 60_000


def test_what_a_lost_cluster_has_finished_is_not_computed_again(
    cluster: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    journal = tmp_path / "chart.journal"
    slow = {"friction": [20.0 * n for n in range(1, 13)], "pressure": 60e3}
    scene = po.Scene(po.Rod(2.3e-5, 140e3, 0.73e-3), [po.SkinFriction(traction=20.0)])

    def lose() -> None:
        while rows(journal) < 3:
            time.sleep(0.01)
        cluster.close()

    loss = threading.Thread(target=lose)
    loss.start()
    with distributed.Client(cluster) as client, pytest.raises(po.WorkersLost, match="stands in the journal"):
        po.sweep(slow, rod=scene, executor=client.get_executor(), journal=journal)
    loss.join()
    kept = rows(journal)
    assert 3 <= kept < 12

    computed = []
    answer = workers.answer_chunk
    monkeypatch.setattr(workers, "answer_chunk", lambda task: computed.append(task.number) or answer(task))
    whole = po.sweep(slow, rod=scene, journal=journal, workers=1)
    assert len(computed) == 12 - kept
    assert whole["status"].tolist() == ["certified"] * 12


def test_a_law_of_the_callers_own_travels_with_the_chunks(cluster: Any) -> None:
    own = po.CohesiveLaw(lambda u: 1.0 - u * u, name="of this test")
    axes = {"ratio": [0.8, 1.0], "pressure_ratio": 0.9}
    with distributed.Client(cluster) as client:
        there = po.sweep(axes, law=own, executor=client.get_executor())
    here = po.sweep(axes, law=own, workers=1)
    assert there["status"].tolist() == ["certified"] * 2
    assert np.array_equal(there["length_ratio"], here["length_ratio"])


def test_the_plan_has_as_many_chunks_as_the_page_says() -> None:
    assert plan.CHUNK == 100
