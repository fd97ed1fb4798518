"""PostgreSQL connections with a time limit on waiting. Loaded only with psycopg."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Generator
from typing import Any

import psycopg

WARNED_S = 60.0
"""Time [s] without an answer after which the server is asked by another connection."""

ENDED_S = 100.0
"""Time [s] after which the wait ends, if that one is not answered either."""

PROBE_S = 5
"""How long the other connection may take [s]."""

# what it says of a pipeline that broke tells nobody more than the error that follows
logging.getLogger("psycopg").addHandler(logging.NullHandler())


class SilentServerError(psycopg.OperationalError):
    """The server does not respond."""


class PatientConnection(psycopg.Connection[Any]):
    """Connection that stops waiting for a silent server.

    A statement may take its time: a server that takes another connection is at work. One that takes
    none is gone, though its host, or what stands before it, keeps the connections open, which
    neither a timeout of the server nor one of TCP notices.
    """

    def wait(self, gen: Any, *args: Any, **kwargs: Any) -> Any:
        """Wait like psycopg, with a time limit."""
        waiting = _patient(gen, self._is_alive, self.pgconn.finish, self.info.host)
        return super().wait(waiting, *args, **kwargs)

    def _is_alive(self) -> bool:
        try:
            psycopg.connect(
                self.info.dsn, password=self.info.password, connect_timeout=PROBE_S
            ).close()
        except psycopg.OperationalError:
            return False
        return True


def _patient(
    gen: Generator[Any, Any, Any],
    is_alive: Callable[[], bool],
    close: Callable[[], None],
    host: str,
) -> Generator[Any, Any, Any]:
    """Pass the states of a wait through, and end it after a period of silence.

    Args:
        gen: yields what it waits for, and is sent what is ready, 0 several times a second.
        is_alive: whether the server answers elsewhere.
        close: closes the connection: what it waits for is not asked to end, as nobody answers.
        host: of the server, for messages.
    """
    silent_since, warned = time.monotonic(), False
    try:
        waits_for = next(gen)
        while True:
            ready = yield waits_for
            silent_s = time.monotonic() - silent_since
            if ready:
                silent_since, warned = time.monotonic(), False
            elif silent_s > (ENDED_S if warned else WARNED_S):
                if is_alive():
                    silent_since, warned = time.monotonic(), False
                elif warned:
                    close()
                    raise SilentServerError(f"no answer for {silent_s:.0f} s")
                else:
                    warned = True
                    logging.getLogger(__name__).warning(
                        "%s has not answered for %.0f s and takes no other connection; waiting "
                        "until %.0f s", host, silent_s, ENDED_S,
                    )  # fmt: skip
            waits_for = gen.send(ready)
    except StopIteration as end:
        return end.value
