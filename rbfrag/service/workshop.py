"""Long work in processes beside the one that answers, each piece with a limit of time."""

from __future__ import annotations

import asyncio
import multiprocessing
import signal
from collections.abc import Callable
from typing import Any

from fastapi import Request
from pebble import ProcessExpired, ProcessPool

from rbfrag.service import work
from rbfrag.service.refusal import busy, gone, too_much_work

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

    def open(self) -> ProcessPool:
        """Return the processes, started."""
        if self._pool is None or not self._pool.active:
            # a forked copy of a process with threads and sockets would be none to rely on
            context = multiprocessing.get_context("spawn")
            self._pool = ProcessPool(
                max_workers=self._jobs, max_tasks=PIECES, initializer=_begin, context=context
            )
        return self._pool

    async def do(self, request: Request, function: Callable[..., bytes], *given: Any) -> bytes:
        """Return what a function answers.

        Args:
            request: who wants to know, its body read; the work ends when the client goes.
            function: a function of a module.
            given: its arguments.

        Raises:
            RequestRefusedError: it took too long, or waited too long, or the client has gone.
            RbfragError: as the function raises.
        """
        future = self.open().schedule(function, args=given)
        answer = asyncio.wrap_future(future)
        left = asyncio.ensure_future(_disconnected(request))
        either: list[asyncio.Future[Any]] = [answer, left]
        try:
            await asyncio.wait(either, timeout=self._limit_s, return_when=asyncio.FIRST_COMPLETED)
            if answer.done():
                return answer.result()
            if left.done():
                raise gone()
            raise too_much_work(self._limit_s) if future.running() else busy()
        except ProcessExpired:
            raise busy() from None
        finally:
            left.cancel()
            # ends the process, if it still works on it
            answer.cancel()

    def close(self) -> None:
        """End the processes, whatever they do; nobody waits for an answer any more."""
        if self._pool is not None:
            self._pool.stop()  # type: ignore[no-untyped-call]
            self._pool.join()


async def _disconnected(request: Request) -> None:
    while (await request.receive())["type"] != "http.disconnect":
        pass


def _begin() -> None:
    # Ctrl-C reaches every process of a terminal; only the one that answers decides what it ends
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    work.warm_up()
