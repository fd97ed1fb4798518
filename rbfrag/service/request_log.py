"""One line of JSON for each request."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from json.encoder import encode_basestring_ascii as _quoted
from time import gmtime, strftime, time
from typing import Any, TextIO


class RequestLog:
    """Writes down what was asked and how it ended; not the query, which is the asker's.

    Args:
        stream: where to; None for standard error.
    """

    def __init__(self, stream: TextIO | None = None) -> None:
        self._stream = stream
        self._second, self._clock = 0, ""

    def write(self, scope: Mapping[str, Any], status: int, size: int, elapsed_s: float) -> None:
        """Write one line.

        Args:
            scope: the request.
            status: HTTP status of the answer.
            size: length of the answer [bytes].
            elapsed_s: how long it took [s].
        """
        now = time()
        second = int(now)
        if second != self._second:
            self._second = second
            self._clock = strftime("%Y-%m-%dT%H:%M:%S", gmtime(second))
        client = scope.get("client")
        (self._stream or sys.stderr).write(
            f'{{"time": "{self._clock}.{int(1e3 * (now - second)):03d}+00:00", "level": "info", '
            f'"event": "request", "method": {_quoted(scope["method"])}, '
            f'"path": {_quoted(scope["path"])}, "status": {status}, "bytes": {size}, '
            f'"ms": {1e3 * elapsed_s:.3f}, "client": {_quoted(client[0] if client else "")}}}\n'
        )
