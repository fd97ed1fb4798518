"""Workers of a cluster that die midway change no loss."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from rbfrag.cli.options import runner
from rbfrag.exchange.event_losses import losses
from rbfrag.hazards.event_counts import count_years

distributed = pytest.importorskip("distributed")

# distributed's own clean-up at the end of a process is not what is looked at here
pytestmark = pytest.mark.filterwarnings("default::ResourceWarning", "default::DeprecationWarning")

Deadly = Callable[[Callable[..., Any]], Callable[..., Iterator[Any]]]


@pytest.fixture
def deadly() -> Iterator[Deadly]:
    """Return what runs work on two worker processes, of which one dies after the first result."""
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=":0"
    ) as cluster:
        with distributed.Client(cluster.scheduler_address, set_as_default=False) as client:
            victim = next(iter(client.run(os.getpid).values()))

        def of(work: Callable[..., Any]) -> Callable[..., Iterator[Any]]:
            run = runner(work, None, cluster.scheduler_address)

            def killing(parts: Iterator[Any], number: int, *shared: Any) -> Iterator[Any]:
                assert number > 10
                results = run(parts, number, *shared)
                yield next(results)
                os.kill(victim, signal.SIGKILL)
                yield from results

            return killing

        yield of


def test_losses_are_those_of_one_process(
    deadly: Deadly, formats_dir: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("rbfrag.hazards.losses.PAIRS_AT_ONCE", 7)
    folder = formats_dir / "openquake_event_based" / "three_realizations"
    blocks = {
        "block_id": ["a", "b", "c"], "site_id": ["0012", "Z9", "SLIDE-A"],
        "p2_1_s2": [4.0] * 3, "kr": [0.1, 0.2, 0.3], "kind": ["toppling"] * 3,
    }  # fmt: skip
    alone = losses(folder, blocks, samples=20, component="rotd50")
    other = losses(folder, blocks, samples=20, component="rotd50", run=deadly(count_years))
    assert other.as_dict() == alone.as_dict()
