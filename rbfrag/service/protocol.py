"""HTTP connections of uvicorn that are closed only after the response has been read.

How long headers may take and how many connections may be open is the business of the web server
before a service that other computers reach (docs/howto/service.md).
"""

from __future__ import annotations

from typing import Any

from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol

HEADERS_BYTES = 64 * 1024
"""Longest headers of a request, its URL included."""

LAST_WORDS_S = 0.5
"""How long [s] an idle connection is still read when the service ends."""

LINGER_S = 5.0
"""How long [s] a client whose body was rejected may go on sending before the connection ends."""

LINGER_BYTES = 1 << 26
"""How much it may send; a 64th of it where it does not say how much it will."""

_TOO_LARGE = (
    b"HTTP/1.1 431 Request Header Fields Too Large\r\n"
    b"connection: close\r\ncontent-length: 0\r\n\r\n"
)


class LingeringProtocol(HttpToolsProtocol):
    """A connection with headers of bounded length, closed only after the response."""

    _header_bytes: int | None = 0
    """Bytes of the headers that are being received; None while a body or an answer is under way."""
    _ending = False
    _unread: int | None = None

    def data_received(self, data: bytes) -> None:
        """Process data, unless the headers are too long."""
        if self._unread is not None:
            self._unread -= len(data)
            if self._unread < 0:
                self.transport.close()
            return
        super().data_received(data)
        if self._header_bytes is not None:
            self._header_bytes += len(data)
            if self._header_bytes > HEADERS_BYTES and not self.transport.is_closing():
                self.transport.write(_TOO_LARGE)
                self.transport.close()

    def on_message_begin(self) -> None:
        """Count the headers of a request from here."""
        super().on_message_begin()
        self._header_bytes = 0

    def on_headers_complete(self) -> None:
        """Start the response."""
        self._header_bytes = None
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
        if self._is_idle():
            self._unset_keepalive_if_required()
            self.loop.call_later(LAST_WORDS_S, self._close_if_idle)
        else:
            super().shutdown()

    def _is_idle(self) -> bool:
        return self.cycle is None or self.cycle.response_complete

    def _close_if_idle(self) -> None:
        if self._is_idle() and not self.transport.is_closing():
            self.transport.close()


class _Lingering:
    """Transport of a response that stays open while part of a request body is unread."""

    def __init__(self, protocol: LingeringProtocol, cycle: Any) -> None:
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
