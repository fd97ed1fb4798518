"""Long work in processes beside the one that answers, each piece with a limit of time."""

from __future__ import annotations

import asyncio
import multiprocessing
import signal
from collections.abc import Callable
from typing import Any

from pebble import ProcessExpired, ProcessPool

from rbfrag.service.refusal import busy, too_much_work

PIECES = 500
"""So many pieces of work does a process do before a fresh one takes its place."""


class Workshop:
    """Processes that work, started when they are first needed.

    Args:
        jobs: how many.
        time_limit_s: longest time [s] that a piece of work may take, its waiting included.
    """

    def __init__(self, jobs: int, time_limit_s: float) -> None:
        self._jobs = jobs
        self._limit_s = time_limit_s
        self._pool: ProcessPool | None = None

    async def do(self, work: Callable[..., bytes], *given: Any) -> bytes:
        """Return what a function answers.

        Args:
            work: a function of a module.
            given: its arguments.

        Raises:
            RequestRefusedError: it took too long, or waited too long.
            RbfragError: as the function raises.
        """
        if self._pool is None:
            # a forked copy of a process with threads and sockets would be none to rely on
            context = multiprocessing.get_context("spawn")
            self._pool = ProcessPool(
                max_workers=self._jobs, max_tasks=PIECES, initializer=_begin, context=context
            )
        future = self._pool.schedule(work, args=given)
        answer = asyncio.wrap_future(future)
        try:
            await asyncio.wait({answer}, timeout=self._limit_s)
            if answer.done():
                return answer.result()
            raise too_much_work(self._limit_s) if future.running() else busy()
        except ProcessExpired:
            raise busy() from None
        finally:
            # ends the process, if it still works on it
            answer.cancel()

    def close(self) -> None:
        """End the processes once their work is done."""
        if self._pool is not None:
            self._pool.close()  # type: ignore[no-untyped-call]
            self._pool.join(self._limit_s)
            self._pool.stop()  # type: ignore[no-untyped-call]
            self._pool.join()


def _begin() -> None:
    # Ctrl-C reaches every process of a terminal; only the one that answers decides what it ends
    signal.signal(signal.SIGINT, signal.SIG_IGN)
