"""Local execution of a campaign by worker processes."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from functools import partial
from multiprocessing.connection import wait as wait_for_end
from typing import Any, TypeVar

from rbfrag.campaign.executors.dask import GO_ON, connected, run_on_cluster
from rbfrag.campaign.interrupt import Stopped, held_back, never
from rbfrag.errors import InputError, WorkFailedError
from rbfrag.solver.integrator.compiled import callbacks, on_compilation

W = TypeVar("W")
R = TypeVar("R")

QUEUED_PER_WORKER = 2
"""Chunks handed out ahead of each worker: enough to keep it busy, little enough for memory."""


CLUSTER = "a cluster"
"""Stands for the processor where workers are elsewhere: nobody's bits are promised then."""


def check_workers(jobs: int | None, scheduler: str | None) -> None:
    """Reject an invalid number of workers, or workers together with a cluster."""
    if jobs is not None and jobs < 1:
        raise InputError(f"jobs must be at least 1, not {jobs}", fields=("jobs",))
    if jobs is not None and scheduler is not None:
        raise InputError(
            "jobs is for local workers, scheduler for a cluster: give one of them",
            fields=("jobs", "scheduler"),
        )


@contextmanager
def executor(
    run_work: Callable[..., R],
    jobs: int | None,
    scheduler: str | None,
    stopped: Stopped = never,
    *,
    after_a_death: str = GO_ON,
    shared: Any = None,
) -> Iterator[Callable[[Iterator[W], int], Iterator[R]]]:
    """Provide, in a ``with`` block, a function that runs work and yields results in any order.

    The function takes the work and the number of its chunks.

    Args:
        run_work: does one chunk of work; a function of a module, which workers can find.
            It takes what is shared, if anything is, and the chunk.
        jobs: worker processes; None for one per processor.
        scheduler: address of a Dask scheduler whose workers take their place.
        stopped: says whether to end after the chunks in hand.
        after_a_death: what to do next when workers have died.
        shared: what all chunks have in common: each worker is sent it once.
    """
    if scheduler is None:
        yield lambda work, chunks: run_locally(
            run_work,
            work,
            min(jobs or os.cpu_count() or 1, chunks),
            after_a_death=after_a_death,
            stopped=stopped,
            shared=shared,
        )
        return
    with connected(scheduler) as client:
        yield lambda work, _: _until(
            stopped, run_on_cluster(client, run_work, work, after_a_death, shared)
        )


def _until(stopped: Stopped, results: Iterator[R]) -> Iterator[R]:
    # what the cluster has in hand is cancelled when this ends
    for result in results:
        yield result
        if stopped():
            return


def run_locally(
    do: Callable[..., R],
    work: Iterator[W],
    workers: int,
    *,
    after_a_death: str,
    stopped: Stopped = never,
    shared: Any = None,
) -> Iterator[R]:
    """Yield results as they arrive, from worker processes or, for one worker, from this process.

    Work is fetched as it is handed out, and no more than three chunks a worker are under way:
    a writer that is slower than the workers holds them up instead of filling the memory.

    Args:
        do: what is done to each chunk of work; a function of a module.
        work: the chunks.
        after_a_death: what to do next when a worker process has died.
        stopped: says whether to end after the chunks in hand.
        shared: what `do` takes before each chunk; each worker is sent it once, when it starts.
    """
    if workers <= 1:
        for item in work:
            if stopped():
                return
            yield do(item) if shared is None else do(shared, item)
        return
    # spawn: the same on every system, and no lock or connection is inherited half-way
    context = multiprocessing.get_context("spawn")
    pool = ProcessPoolExecutor(
        workers, mp_context=context, initializer=prepare,
        initargs=(callbacks, context.Lock(), shared),
    )  # fmt: skip
    task: Callable[[W], R] = do if shared is None else partial(_with_shared, do)
    running: set[Future[R]] = set()
    try:
        for item in work:
            if stopped():
                break
            with held_back():  # the first of these starts the workers
                running.add(pool.submit(task, item))
            if len(running) >= workers * (1 + QUEUED_PER_WORKER):
                finished, running = wait(running, return_when=FIRST_COMPLETED)
                yield from _results(finished)
        while running:
            if stopped():
                running = {future for future in running if not future.cancel()}
            finished, running = wait(running, return_when=FIRST_COMPLETED)
            yield from _results(finished)
    except KeyboardInterrupt:
        # nobody waits for what is in hand: it is not stored, and computed again
        for worker in multiprocessing.active_children():
            worker.kill()
        raise
    except BrokenProcessPool:
        raise WorkFailedError(
            f"a worker process died (killed, or out of memory); {after_a_death}, with fewer "
            "jobs if memory is short",
            fields=("jobs",),
        ) from None
    finally:
        for future in running:
            future.cancel()
        pool.shutdown(wait=True, cancel_futures=True)


def _call_once(callback: Callable[[], None], first: Any) -> None:
    if first is None or first.acquire(block=False):  # and never gives back
        callback()


def _results(finished: set[Future[R]]) -> Iterator[R]:
    # Each is let go before the next is waited for.
    while finished:
        yield finished.pop().result()


_shared: Any = None
"""In a worker process what all its work has in common."""


def _with_shared(do: Callable[..., R], item: Any) -> R:
    return do(_shared, item)


def prepare(tell: Sequence[Callable[[], None]] = (), first: Any = None, shared: Any = None) -> None:
    """Leave Ctrl-C to the main process, and end when it ends.

    Args:
        tell: functions of a module that the first worker to compile a kernel calls.
        first: the lock that only this one gets.
        shared: what all its work has in common.
    """
    global _shared
    _shared = shared
    for callback in tell:
        on_compilation(partial(_call_once, callback, first))
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()
    if parent is not None:
        # A killed main process cannot tell its workers: without this they would wait for ever.
        threading.Thread(target=_end_with, args=(parent.sentinel,), daemon=True).start()


def _end_with(sentinel: int) -> None:
    wait_for_end([sentinel])
    os._exit(1)
