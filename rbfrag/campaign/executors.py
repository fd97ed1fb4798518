"""Executors of a campaign: processes of this machine or a Dask cluster, and their end by Ctrl-C.

The first press of Ctrl-C ends long work after the current step, the second immediately.
"""

from __future__ import annotations

import importlib.util
import multiprocessing
import os
import signal
import socket
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from functools import partial
from multiprocessing.connection import wait as wait_for_end
from multiprocessing.util import _run_finalizers  # type: ignore[attr-defined]
from typing import Any, TypeVar

from rbfrag.errors import InputError, MissingExtraError, RbfragError, WorkFailedError
from rbfrag.solver.integrator.compiled import callbacks, on_compilation
from rbfrag.version import __version__

W = TypeVar("W")
R = TypeVar("R")

CLUSTER = "a cluster"
"""Stands for the processor where workers are elsewhere: bit-identical results are not promised."""

QUEUED_PER_WORKER = 2
"""Chunks handed out ahead of each worker process or thread of a cluster: enough to keep it busy,
little enough for memory."""

CHUNKS_PER_WORKER = 4
"""Chunks per worker from which the first ones are done without workers, to see how long they take;
with fewer, a long chunk would hold up the rest."""

TRIAL_S = 1.0
"""How long to measure before workers are started [s]."""

WORTH_WORKERS_S = 3.0
"""Time of the rest in this process from which workers are started [s]: the start of each takes a
second of its processor."""

CONNECT_TIMEOUT_S = 10.0
"""How long to wait for the scheduler to answer [s]."""

WORKER_TIMEOUT_S = 60.0
"""How long to wait for the first worker of a scheduler that has none [s]."""

GO_ON = "what was finished is stored: run the same command again to go on"
"""What to do after workers have died, of work whose results are stored."""

STOPPING = "stopping after the motion in hand; press again to stop now"

INTERRUPTED = 130
"""Exit status of a program that SIGINT ended: 128 and the signal's number."""

Stopped = Callable[[], bool]
"""Whether a stop was asked for."""


def never() -> bool:
    """Return False: no stop is requested."""
    return False


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

        def locally(work: Iterator[W], chunks: int) -> Iterator[R]:
            run = partial(
                run_locally, run_work, iter(work), after_a_death=after_a_death, stopped=stopped,
                shared=shared,
            )  # fmt: skip
            workers = min(jobs or os.cpu_count() or 1, chunks)
            times: list[float] = []
            if jobs is None and 1 < workers <= chunks // CHUNKS_PER_WORKER:
                begin = time.perf_counter()
                for result in run(workers=1):
                    times.append(time.perf_counter() - begin)
                    yield result
                    # the first chunk loads or compiles kernels and does not count
                    spent = sum(times[1:])
                    rest = spent / max(len(times) - 1, 1) * (chunks - len(times))
                    if spent > TRIAL_S and rest > WORTH_WORKERS_S:
                        break
                    begin = time.perf_counter()  # what the caller does with a result is no work
            if not stopped():
                yield from run(workers=min(workers, chunks - len(times)))

        yield locally
        return
    with connected(scheduler) as client:

        def run(work: Iterator[W], _chunks: int) -> Iterator[R]:
            # what the cluster has in hand is cancelled when this ends
            for result in run_on_cluster(client, run_work, work, after_a_death, shared):
                yield result
                if stopped():
                    return

        yield run


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
        # running tasks are abandoned: their results are not stored, and computed again
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


def _call_once(callback: Callable[[], None], first: Any) -> None:
    if first is None or first.acquire(block=False):  # and never gives back
        callback()


def _end_with(sentinel: int) -> None:
    wait_for_end([sentinel])
    os._exit(1)


@contextmanager
def connected(address: str) -> Iterator[Any]:
    """Connect to a scheduler for a ``with`` block.

    Args:
        address: such as ``tcp://host:8786``.

    Returns:
        The client, for :func:`run_on_cluster`.
    """
    if importlib.util.find_spec("distributed") is None:
        raise MissingExtraError("Dask clusters require distributed", "dask")
    import distributed

    try:
        client = distributed.Client(address, timeout=CONNECT_TIMEOUT_S, set_as_default=False)
    except (OSError, TimeoutError, ValueError, TypeError) as error:
        raise InputError(
            f"no Dask scheduler answers at {address}: {_first_line(error)}; start one with  dask "
            "scheduler  and give the address that it prints (tcp://host:8786)",
        ) from None
    try:
        try:
            client.wait_for_workers(1, timeout=WORKER_TIMEOUT_S)
        except TimeoutError:
            raise WorkFailedError(
                f"the scheduler at {address} has no workers: start some with  dask worker "
                f"{address}  and run the same command again"
            ) from None
        yield client
    finally:
        client.close(timeout=CONNECT_TIMEOUT_S)


def run_on_cluster(
    client: Any,
    run_work: Callable[..., R],
    work: Iterator[W],
    after_a_death: str = GO_ON,
    shared: Any = None,
) -> Iterator[R]:
    """Yield results as they arrive from a cluster.

    A motion travels inside its task, so that the scheduler can give the task to another worker
    when one is lost. Work is fetched as it is handed out, and no more than three motions a
    thread are under way.

    Args:
        client: from :func:`connected`.
        run_work: does one chunk of work; a function of a module, which workers can find.
        after_a_death: what to do next when workers have died.
        shared: what `run_work` takes before each chunk. Every worker is sent it once, so that the
            loss of one loses nothing while another lives.

    Raises:
        WorkFailedError: workers died again and again, the scheduler was lost, or the workers
            hold no rbfrag that can do it.
    """
    import distributed

    waiting = distributed.as_completed(loop=client.loop)
    address = client.scheduler.address
    # in a list, which scatter would else take apart: one future for whatever is shared
    common = [] if shared is None else client.scatter([shared], broadcast=True, hash=False)
    try:
        for item in work:
            waiting.add(client.submit(run_work, *common, item, pure=False))
            threads = int(sum(client.nthreads().values()))  # workers come and go
            while waiting.count() >= max(threads, 1) * (1 + QUEUED_PER_WORKER):
                yield from _next_result(waiting, address, after_a_death)
        while waiting.count():
            yield from _next_result(waiting, address, after_a_death)
    finally:
        if not waiting.is_empty():
            client.cancel(list(waiting.futures))


def _next_result(waiting: Any, address: str, after_a_death: str) -> Iterator[Any]:
    """Yield the next result, or nothing if its worker died after finishing.

    A result stays on its worker until it is fetched. The scheduler has it computed again, and
    its future, which was reported as done, waits once more.
    """
    future = next(waiting)
    if future.status in ("pending", "lost"):
        waiting.add(future)
        return
    if future.status == "finished":
        yield future.result()
        return
    if future.status == "error":
        error = future.exception()
        if isinstance(error, RbfragError):
            raise error
        if isinstance(error, ImportError | AttributeError):
            raise WorkFailedError(
                f"the workers of {address} cannot run rbfrag {__version__}: {_first_line(error)}; "
                "install the same version there"
            ) from None
        if type(error).__name__ != "KilledWorker":
            raise error
    raise WorkFailedError(
        f"the cluster at {address} was lost, or its workers died again and again; {after_a_death}"
    )


def _first_line(error: BaseException) -> str:
    text = str(error).strip()
    return text.splitlines()[0] if text else type(error).__name__


@contextmanager
def stopped_by_interrupts() -> Iterator[Stopped]:
    """Yield a function that returns whether Ctrl-C was pressed in a ``with`` block.

    The first press says so on standard error at once. The second kills the worker processes and
    ends the program with status 130: a transaction that is open is rolled back by its database.
    """
    if threading.current_thread() is not threading.main_thread():
        yield never  # only the main thread may handle signals
        return
    pressed = threading.Event()
    # A handler in Python would wait until the kernel that the main thread is in returns; the byte
    # that Python writes for each signal is there at once, and a thread reads it meanwhile.
    heard, tells = socket.socketpair()
    tells.setblocking(False)
    listener = threading.Thread(target=_listen, args=(heard, pressed), daemon=True)
    before = signal.signal(signal.SIGINT, lambda *_: None)
    earlier_fd = signal.set_wakeup_fd(tells.fileno(), warn_on_full_buffer=False)
    listener.start()
    try:
        yield pressed.is_set
    finally:
        signal.set_wakeup_fd(earlier_fd)
        tells.close()
        listener.join()
        # a press while the program ends must not change its status
        signal.signal(signal.SIGINT, signal.SIG_IGN if pressed.is_set() else before)


def _listen(heard: socket.socket, pressed: threading.Event) -> None:
    """Handle each press of Ctrl-C until the other end is closed."""
    with heard:
        while signals := heard.recv(64):
            for number in signals:
                if number == signal.SIGINT:
                    _answer(pressed)


def _answer(pressed: threading.Event) -> None:
    if not pressed.is_set():
        pressed.set()
        # not print: the main thread may be in the midst of one
        os.write(2, f"\n{STOPPING}\n".encode())
        return
    try:
        for worker in multiprocessing.active_children():
            worker.kill()
        _run_finalizers(0)  # else the tracker of resources says that their semaphores leaked
    finally:
        os._exit(INTERRUPTED)


@contextmanager
def held_back() -> Iterator[None]:
    """Block SIGINT in a ``with`` block; processes started in it never receive it."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
