"""Who does the work of a campaign: processes of this machine, or a cluster."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TypeVar

from rbfrag.campaign.executors.dask import connected, run_on_cluster
from rbfrag.campaign.executors.local import run_locally
from rbfrag.errors import InputError

Work = TypeVar("Work")
Results = TypeVar("Results")

CLUSTER = "a cluster"
"""Stands for the processor where workers are elsewhere: nobody's bits are promised then."""


def check_workers(jobs: int | None, scheduler: str | None) -> None:
    """Refuse an impossible number of workers, or two answers to who does the work."""
    if jobs is not None and jobs < 1:
        raise InputError(f"--jobs must be at least 1, not {jobs}")
    if jobs is not None and scheduler is not None:
        raise InputError("--jobs counts local workers, --scheduler names others: give one of them")


@contextmanager
def executor(
    run_work: Callable[[Work], Results], jobs: int | None, scheduler: str | None
) -> Iterator[Callable[[Iterator[Work], int], Iterator[Results]]]:
    """Offer, for a ``with`` block, a function that does work and yields answers in any order.

    The function takes the work and the number of its pieces.

    Args:
        run_work: does one piece of work; a function of a module, which workers can find.
        jobs: worker processes; None for one per processor.
        scheduler: address of a Dask scheduler whose workers take their place.
    """
    if scheduler is None:
        yield lambda work, pieces: run_locally(
            run_work,
            work,
            min(jobs or os.cpu_count() or 1, pieces),
            after_a_death="what was finished is stored: run the same command again to go on",
        )
        return
    with connected(scheduler) as client:
        yield lambda work, _: run_on_cluster(client, run_work, work)
