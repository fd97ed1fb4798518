"""Worker processes on this machine."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from multiprocessing.connection import wait as wait_for_end

from rbfrag.campaign.worker import MotionResults, MotionWork, run_work
from rbfrag.errors import WorkFailedError

QUEUED_PER_WORKER = 2
"""Motions handed out ahead of each worker: enough to keep it busy, little enough for memory."""


def run_locally(work: Iterator[MotionWork], workers: int) -> Iterator[MotionResults]:
    """Yield the answers as they come, from worker processes or, for one worker, from here.

    Work is fetched as it is handed out, and no more than three motions a worker are under way:
    a writer that is slower than the workers holds them up instead of filling the memory.

    Args:
        work: what to do.
        workers: number of processes.

    Raises:
        WorkFailedError: a process died.
    """
    if workers <= 1:
        yield from map(run_work, work)
        return
    # spawn: the same on every system, and no lock or connection is inherited half-way
    context = multiprocessing.get_context("spawn")
    pool = ProcessPoolExecutor(workers, mp_context=context, initializer=prepare)
    running: set[Future[MotionResults]] = set()
    try:
        for item in work:
            running.add(pool.submit(run_work, item))
            if len(running) >= workers * (1 + QUEUED_PER_WORKER):
                finished, running = wait(running, return_when=FIRST_COMPLETED)
                yield from _results(finished)
        while running:
            finished, running = wait(running, return_when=FIRST_COMPLETED)
            yield from _results(finished)
    except BrokenProcessPool:
        raise WorkFailedError(
            "a worker process died (killed, or out of memory); what was finished is stored: "
            "run the same command again to go on, with fewer --jobs if memory is short"
        ) from None
    finally:
        for future in running:
            future.cancel()
        pool.shutdown(wait=True, cancel_futures=True)


def _results(finished: set[Future[MotionResults]]) -> Iterator[MotionResults]:
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
