"""Local workers, and a Dask cluster in their place: the same database."""

from __future__ import annotations

import math
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from rbfrag.campaign import executors as dask_executor
from rbfrag.campaign.simulate import CampaignProgress, simulate
from rbfrag.db.engine import opened_database
from rbfrag.db.queries import database_info
from rbfrag.errors import InputError, MissingExtraError, WorkFailedError

distributed = pytest.importorskip("distributed")

P2 = (10.0, 1.0)
Digest = Callable[[Path], str]
Copy = Callable[[Path, str], Path]

# distributed's own clean-up at the end of a process is not what is looked at here
pytestmark = pytest.mark.filterwarnings("default::ResourceWarning", "default::DeprecationWarning")


@pytest.fixture(scope="module")
def cluster() -> Iterator[Any]:
    """Two worker processes of one thread each."""
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=":0"
    ) as result:
        yield result


def process_of(_: int) -> int:
    return os.getpid()


@pytest.mark.parametrize(("chunks", "jobs", "limit_s"), [(8, None, 3.0), (8, None, -1.0),
                                                         (7, None, 3.0), (8, 2, 3.0)])  # fmt: skip
def test_workers_are_started_for_long_work_only(
    monkeypatch: pytest.MonkeyPatch, chunks: int, jobs: int | None, limit_s: float
) -> None:
    monkeypatch.setattr("os.cpu_count", lambda: 2)
    monkeypatch.setattr(dask_executor, "TRIAL_S", min(limit_s, 1.0))
    monkeypatch.setattr(dask_executor, "WORTH_WORKERS_S", limit_s)
    with dask_executor.executor(process_of, jobs, None) as execute:
        in_main = [number == os.getpid() for number in execute(iter(range(chunks)), chunks)]
    # few chunks, or a number of jobs, start workers at once
    expected = 8 if (chunks, jobs, limit_s) == (8, None, 3.0) else int(limit_s < 0.0)
    assert (len(in_main), sum(in_main)) == (chunks, expected)


def test_the_database_is_that_of_local_workers(
    cluster: Any, three_component_database: Path, copy_of: Copy, digest_of: Digest
) -> None:
    local = three_component_database
    remote = copy_of(local, "remote.db")
    inputs: dict[str, Any] = {"p2": P2, "vertical": "both", "grid": 5, "store_responses": [0.4]}
    single = simulate(local, jobs=1, **inputs)
    seen: list[CampaignProgress] = []
    two = simulate(remote, scheduler=cluster.scheduler_address, on_progress=seen.append, **inputs)
    assert (single.runs, single.found, single.responses) == (two.runs, two.found, two.responses)
    assert [seen[0].completed, seen[-1].completed] == [0, single.combinations]
    assert digest_of(local) == digest_of(remote)
    again = simulate(remote, scheduler=cluster.scheduler_address, **inputs)
    assert again.resumed == again.combinations


def test_a_lost_worker_changes_nothing(
    cluster: Any, three_component_database: Path, copy_of: Copy, digest_of: Digest
) -> None:
    undisturbed = copy_of(three_component_database, "undisturbed.db")
    simulate(undisturbed, p2=P2, jobs=1)
    with distributed.Client(cluster.scheduler_address, set_as_default=False) as client:
        victims = list(client.run(os.getpid).values())
    killed = threading.Event()

    def kill(progress: CampaignProgress) -> None:
        if progress.completed and not killed.is_set():
            os.kill(victims[0], signal.SIGKILL)
            killed.set()

    document = simulate(
        three_component_database, p2=P2, scheduler=cluster.scheduler_address, on_progress=kill
    )
    assert killed.is_set()
    assert document.combinations == 20
    assert digest_of(three_component_database) == digest_of(undisturbed)


def test_results_that_died_with_their_workers_are_computed_again(cluster: Any) -> None:
    with dask_executor.connected(cluster.scheduler_address) as client:
        client.wait_for_workers(2, timeout=60)
        results = dask_executor.run_on_cluster(client, math.sqrt, iter(range(8)))
        seen = [next(results)]
        wait_until(lambda: len(client.has_what()) == 2 and held(client) >= 5)
        for pid in client.run(os.getpid).values():
            os.kill(pid, signal.SIGKILL)
        wait_until(lambda: held(client) == 0)
        seen.extend(results)
    assert sorted(seen) == [math.sqrt(number) for number in range(8)]


def held(client: Any) -> int:
    """Count the results that the workers hold."""
    return sum(len(keys) for keys in client.has_what().values())


def wait_until(reached: Callable[[], bool]) -> None:
    deadline = time.monotonic() + 60
    while not reached():
        assert time.monotonic() < deadline
        time.sleep(0.02)


def test_nobody_at_the_address(
    three_component_database: Path, digest_of: Digest, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(dask_executor, "CONNECT_TIMEOUT_S", 0.5)
    before = digest_of(three_component_database)
    with socket.socket() as free_standing:
        free_standing.bind(("127.0.0.1", 0))
        port = free_standing.getsockname()[1]
    for address in (f"tcp://127.0.0.1:{port}", "carrier-pigeon://x:1", "nonsense"):
        with pytest.raises(InputError, match="no Dask scheduler answers at"):
            simulate(three_component_database, p2=P2, scheduler=address)
    assert digest_of(three_component_database) == before
    with (
        opened_database(three_component_database, read_only=True) as engine,
        engine.connect() as connection,
    ):
        assert database_info(connection).rows["campaign"] == 0


def test_no_workers(three_component_database: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(dask_executor, "WORKER_TIMEOUT_S", 0.3)
    with (
        distributed.LocalCluster(n_workers=0, dashboard_address=":0") as empty,
        pytest.raises(WorkFailedError, match="has no workers"),
    ):
        simulate(three_component_database, p2=P2, scheduler=empty.scheduler_address)


def test_the_extra_is_missing(
    three_component_database: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(dask_executor.importlib.util, "find_spec", lambda _: None)
    with pytest.raises(MissingExtraError, match=r"rbfrag\[dask\]"):
        simulate(three_component_database, p2=P2, scheduler="tcp://127.0.0.1:8786")


def test_jobs_are_not_for_a_cluster(three_component_database: Path) -> None:
    with pytest.raises(InputError, match="give one of them"):
        simulate(three_component_database, p2=P2, jobs=2, scheduler="tcp://127.0.0.1:8786")


def test_only_a_campaign_with_a_cluster_loads_dask() -> None:
    program = "import sys, rbfrag.campaign.simulate; sys.exit('distributed' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", program], check=False).returncode == 0
