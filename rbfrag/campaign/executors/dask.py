"""Workers of a Dask cluster."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, TypeVar

from rbfrag.errors import InputError, MissingExtraError, RbfragError, WorkFailedError
from rbfrag.version import __version__

Work = TypeVar("Work")
Results = TypeVar("Results")

CONNECT_TIMEOUT_S = 10.0
"""How long to wait for the scheduler to answer [s]."""

WORKER_TIMEOUT_S = 60.0
"""How long to wait for the first worker of a scheduler that has none [s]."""

GO_ON = "what was finished is stored: run the same command again to go on"
"""What to do after workers have died, of work whose results are stored."""

QUEUED_PER_THREAD = 2
"""Motions handed out ahead of each thread of the cluster."""


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
    run_work: Callable[..., Results],
    work: Iterator[Work],
    after_a_death: str = GO_ON,
    shared: Any = None,
) -> Iterator[Results]:
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
            while waiting.count() >= _most_under_way(client):
                yield from _next_result(waiting, address, after_a_death)
        while waiting.count():
            yield from _next_result(waiting, address, after_a_death)
    finally:
        if not waiting.is_empty():
            client.cancel(list(waiting.futures))


def _most_under_way(client: Any) -> int:
    threads = int(sum(client.nthreads().values()))  # workers come and go
    return max(threads, 1) * (1 + QUEUED_PER_THREAD)


def _next_result(waiting: Any, address: str, after_a_death: str) -> Iterator[Any]:
    """Yield the next result, or nothing if its worker died after finishing.

    A result stays on its worker until it is fetched. The scheduler has it computed again, and
    its future, which was reported as done, waits once more.
    """
    future = next(waiting)
    if future.status in ("pending", "lost"):
        waiting.add(future)
    else:
        yield _result(future, address, after_a_death)


def _result(future: Any, address: str, after_a_death: str) -> Any:
    if future.status == "finished":
        return future.result()
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
