"""HTTP connections with limits on headers and idle time; requests in progress are completed."""

from __future__ import annotations

import asyncio
from itertools import islice
from typing import Any, ClassVar

from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol

HEADERS_S = 15.0
"""Longest time [s] that the headers of a request may take to come."""

HEADERS_BYTES = 64 * 1024
"""Longest headers of a request, its URL included."""

LAST_WORDS_S = 0.5
"""How long [s] an idle connection is still read when the service ends."""

LINGER_S = 5.0
"""How long [s] a client whose body was rejected may go on sending before the connection ends."""

LINGER_BYTES = 1 << 26
"""How much it may send; a 64th of it where it does not say how much it will."""

CONNECTIONS = 500
"""With more open connections than these, those that have been idle longest are closed."""

_END = b"connection: close\r\ncontent-length: 0\r\n\r\n"
_TOO_LARGE = b"HTTP/1.1 431 Request Header Fields Too Large\r\n" + _END
_TOO_SLOW = b"HTTP/1.1 408 Request Timeout\r\n" + _END


class BoundedProtocol(HttpToolsProtocol):
    """A connection with limits on its headers, closed only after the response."""

    _open: ClassVar[dict[BoundedProtocol, None]] = {}
    """The connections of this process, the one that was last used last."""
    _late: asyncio.TimerHandle | None = None
    _read = 0
    _ending = False
    _unread: int | None = None

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Start the timeout of the first headers."""
        super().connection_made(transport)
        self._close_longest_idle()
        self._used()
        self._wait_for_headers()

    def connection_lost(self, exc: Exception | None) -> None:
        """Stop all timeouts."""
        self._stop_waiting()
        self._open.pop(self, None)
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        """Process data, unless the headers are too long."""
        if self._unread is not None:
            self._unread -= len(data)
            if self._unread < 0:
                self.transport.close()
            return
        super().data_received(data)
        if self._late is not None:
            self._read += len(data)
            if self._read > HEADERS_BYTES:
                self._reject(_TOO_LARGE)

    def on_message_begin(self) -> None:
        """Start the timeout of the headers of a request."""
        super().on_message_begin()
        if self._late is None:
            self._wait_for_headers()

    def on_headers_complete(self) -> None:
        """Start the response."""
        self._stop_waiting()
        self._used()
        super().on_headers_complete()
        self.cycle.transport = _Lingering(self, self.cycle)  # type: ignore[assignment]
        if self._ending:
            self.cycle.keep_alive = False

    def linger(self) -> None:
        """End the response, and discard what the client still sends for a while.

        A connection that is closed upon unread bytes is reset, and the client may never read why
        it was rejected (RFC 9112, section 9.6).
        """
        has_length = any(name == b"content-length" for name, _ in self.scope["headers"])
        self._unread = LINGER_BYTES if has_length else LINGER_BYTES // 64
        self.transport.write_eof()
        self.flow.resume_reading()
        self.loop.call_later(LINGER_S, self.transport.close)

    def shutdown(self) -> None:
        """Close after a pending response; the client may just have sent a request."""
        self._ending = True
        if self._idle():
            self._unset_keepalive_if_required()
            self.loop.call_later(LAST_WORDS_S, self._end_if_idle)
        else:
            super().shutdown()

    def _used(self) -> None:
        self._open.pop(self, None)
        self._open[self] = None

    def _close_longest_idle(self) -> None:
        """Close the longest idle connections when there are too many."""
        too_many = 1 + len(self._open) - CONNECTIONS
        if too_many > 0:
            idle = (connection for connection in self._open if connection._idle())
            for connection in list(islice(idle, too_many)):
                connection._reject(_TOO_SLOW)
                self._open.pop(connection, None)

    def _idle(self) -> bool:
        return self.cycle is None or self.cycle.response_complete

    def _end_if_idle(self) -> None:
        if self._idle() and not self.transport.is_closing():
            self.transport.close()

    def _wait_for_headers(self) -> None:
        self._read = 0
        self._late = self.loop.call_later(HEADERS_S, self._reject, _TOO_SLOW)

    def _stop_waiting(self) -> None:
        if self._late is not None:
            self._late.cancel()
            self._late = None

    def _reject(self, answer: bytes) -> Any:
        self._stop_waiting()
        if not self.transport.is_closing():
            self.transport.write(answer)
            self.transport.close()


class _Lingering:
    """Transport of a response that stays open while part of a request body is unread."""

    def __init__(self, protocol: BoundedProtocol, cycle: Any) -> None:
        self._protocol = protocol
        self._cycle = cycle

    def __getattr__(self, name: str) -> Any:
        return getattr(self._protocol.transport, name)

    def close(self) -> None:
        """Close the connection, immediately if nothing remains to be received."""
        if self._cycle.more_body and not self._protocol.transport.is_closing():
            self._protocol.linger()
        else:
            self._protocol.transport.close()
