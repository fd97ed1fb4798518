"""Worker processes on this machine."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from multiprocessing.connection import wait as wait_for_end
from typing import TypeVar

from rbfrag.errors import WorkFailedError

W = TypeVar("W")
R = TypeVar("R")

QUEUED_PER_WORKER = 2
"""Pieces handed out ahead of each worker: enough to keep it busy, little enough for memory."""


def run_locally(
    do: Callable[[W], R], work: Iterator[W], workers: int, *, after_a_death: str
) -> Iterator[R]:
    """Yield the answers as they come, from worker processes or, for one worker, from here.

    Work is fetched as it is handed out, and no more than three pieces a worker are under way:
    a writer that is slower than the workers holds them up instead of filling the memory.

    Args:
        do: what is done to each piece of work; a function of a module.
        work: the pieces.
        workers: number of processes.
        after_a_death: what to do next when a worker process has died.
    """
    if workers <= 1:
        yield from map(do, work)
        return
    # spawn: the same on every system, and no lock or connection is inherited half-way
    context = multiprocessing.get_context("spawn")
    pool = ProcessPoolExecutor(workers, mp_context=context, initializer=prepare)
    running: set[Future[R]] = set()
    try:
        for item in work:
            running.add(pool.submit(do, item))
            if len(running) >= workers * (1 + QUEUED_PER_WORKER):
                finished, running = wait(running, return_when=FIRST_COMPLETED)
                yield from _results(finished)
        while running:
            finished, running = wait(running, return_when=FIRST_COMPLETED)
            yield from _results(finished)
    except BrokenProcessPool:
        raise WorkFailedError(
            f"a worker process died (killed, or out of memory); {after_a_death}, with fewer "
            "--jobs if memory is short"
        ) from None
    finally:
        for future in running:
            future.cancel()
        pool.shutdown(wait=True, cancel_futures=True)


def _results(finished: set[Future[R]]) -> Iterator[R]:
    # Each is let go before the next is waited for.
    while finished:
        yield finished.pop().result()


def prepare() -> None:
    """Leave Ctrl-C to the main process, and end with it however it ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()
    if parent is not None:
        # A killed main process cannot tell its workers: without this they would wait for ever.
        threading.Thread(target=_end_with, args=(parent.sentinel,), daemon=True).start()


def _end_with(sentinel: int) -> None:
    wait_for_end([sentinel])
    os._exit(1)
