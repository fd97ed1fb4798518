"""Access control, response headers, counts for Prometheus and a line of JSON for every request."""

from __future__ import annotations

import hmac
import json
import logging
import os
import sys
from collections.abc import Awaitable, Callable, Iterable, Mapping, MutableMapping
from datetime import UTC, datetime
from json.encoder import encode_basestring_ascii as _quoted
from logging.config import dictConfig
from time import perf_counter
from typing import Any

from prometheus_client import (
    CONTENT_TYPE_LATEST,
    CollectorRegistry,
    Counter,
    Histogram,
    generate_latest,
)
from prometheus_client.multiprocess import MultiProcessCollector

from rbfrag.service.problem import problem
from rbfrag.service.protocol import HEADERS_BYTES
from rbfrag.service.settings import ServiceSettings

Message = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Message]]
Send = Callable[[Message], Awaitable[None]]
Application = Callable[[Message, Receive, Send], Awaitable[None]]

OPEN_TO_ALL = ("/v1/healthz", "/v1/vocabulary")
"""Operations without a token; the page, which is open to all, needs the names of its fields."""

_HEADERS = [
    (b"cache-control", b"no-store"),
    (b"x-content-type-options", b"nosniff"),
    (b"referrer-policy", b"no-referrer"),
]
"""What is said with every answer; the page has headers of its own."""


class Guard:
    """ASGI middleware that checks token, host and origin, and records metrics and logs."""

    def __init__(self, app: Application, settings: ServiceSettings, metrics: Metrics) -> None:
        self._app = app
        self._token = None if settings.token is None else settings.token.encode()
        self._origins = {origin.lower().encode() for origin in settings.allow_origin}
        self._hosts = {name.lower().encode() for name in settings.allow_host}
        self._metrics = metrics

    async def __call__(self, scope: Message, receive: Receive, send: Send) -> None:
        """Answer a request."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        start = perf_counter()
        status, size = 500, 0
        is_api = scope["path"].startswith("/v1/")
        # HEAD is answered as GET, and its body is left out
        head_alone = is_api and scope["method"] == "HEAD"
        as_get = {**scope, "method": "GET"} if head_alone else scope

        async def watched(message: Message) -> None:
            nonlocal status, size
            if head_alone and message["type"] == "http.response.body":
                message = {**message, "body": b""}
            if message["type"] == "http.response.start":
                status = message["status"]
                if is_api:
                    message["headers"] = [*message.get("headers", ()), *_HEADERS]
            else:
                size += len(message.get("body", b""))
            await send(message)

        rejection = self._rejection(scope)
        try:
            if rejection is None:
                await self._app(as_get, receive, watched)
            else:
                await rejection(scope, receive, watched)
        finally:
            elapsed_s = perf_counter() - start
            self._metrics.count(scope, status, elapsed_s)
            log_request(scope, status, size, elapsed_s)

    def _rejection(self, scope: Message) -> Any:
        headers = dict(scope["headers"])
        # those that came in one piece, which the connection has read before it could count them
        if sum(len(name) + len(value) + 4 for name, value in scope["headers"]) > HEADERS_BYTES:
            return problem(431, "headers", f"the headers are longer than {HEADERS_BYTES} bytes")
        if sum(name == b"host" for name, _ in scope["headers"]) > 1:
            return problem(400, "host", "the header Host occurs twice: send one")
        if not self._is_same_origin(scope["method"], headers):
            return problem(
                403,
                "origin",
                "requests from pages of other origins are not allowed: start it with "
                "--allow-origin ORIGIN",
            )
        if self._hosts and _name(headers.get(b"host", b"")) not in self._hosts:
            return problem(
                421,
                "host",
                "this host name is not allowed: start the service with --allow-host NAME",
            )
        if self._token is None or not scope["path"].startswith("/v1/"):
            return None
        if scope["path"] in OPEN_TO_ALL:
            return None
        scheme, _, token = headers.get(b"authorization", b"").partition(b" ")
        if hmac.compare_digest(token.strip(), self._token) and scheme.lower() == b"bearer":
            return None
        return problem(
            401,
            "token",
            "a token is required: send the header  Authorization: Bearer TOKEN",
            {"www-authenticate": 'Bearer realm="rbfrag"'},
        )

    def _is_same_origin(self, method: str, headers: dict[bytes, bytes]) -> bool:
        """Return whether a state-changing request comes from an allowed origin."""
        origin = headers.get(b"origin")
        if origin is None or method in ("GET", "HEAD", "OPTIONS"):
            return True
        same_host = origin.partition(b"://")[2].lower() == headers.get(b"host", b"").lower()
        return same_host or bool({origin.lower(), b"*"} & self._origins)


def _name(host: bytes) -> bytes:
    """Return a Host header without its port."""
    name, colon, port = host.lower().rpartition(b":")
    return name if colon and port.isdigit() else host.lower()


SHARED_FOLDER = "PROMETHEUS_MULTIPROC_DIR"
"""Environment variable of the folder in which several processes keep their counts."""

CONTENT_TYPE = CONTENT_TYPE_LATEST

_SECONDS = (0.0001, 0.0003, 0.001, 0.003, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0)
_METHODS = frozenset({"GET", "POST", "HEAD", "OPTIONS", "PUT", "DELETE", "PATCH"})


class Metrics:
    """Counts of requests by operation, method and status, and their durations.

    Args:
        paths: the operations; any other path counts as ``page`` or ``other``, so that what is
            asked cannot make the list grow.
    """

    def __init__(self, paths: Iterable[str]) -> None:
        self._paths = frozenset(paths)
        self._registry = CollectorRegistry()
        self._requests = Counter(
            "rbfrag_requests",
            "Requests that were answered.",
            ("operation", "method", "status"),
            registry=self._registry,
        )
        self._seconds = Histogram(
            "rbfrag_request_seconds",
            "Time from the headers of a request to the end of its answer [s].",
            ("operation",),
            buckets=_SECONDS,
            registry=self._registry,
        )
        self._counters: dict[tuple[str, str, int], tuple[Counter, Histogram]] = {}

    def count(self, scope: Mapping[str, Any], status: int, elapsed_s: float) -> None:
        """Count one request, with its HTTP status and duration [s]."""
        path, method = scope["path"], scope["method"]
        if path not in self._paths:
            path = "other" if status >= 400 or path.startswith("/v1/") else "page"
        if method not in _METHODS:
            method = "other"
        counters = self._counters.get((path, method, status))
        if counters is None:  # labels() takes 2 µs each time
            counters = self._requests.labels(path, method, str(status)), self._seconds.labels(path)
            self._counters[path, method, status] = counters
        requests, seconds = counters
        requests.inc()
        seconds.observe(elapsed_s)

    def text(self) -> bytes:
        """Return the counts of all processes in the format of Prometheus."""
        registry = self._registry
        if os.environ.get(SHARED_FOLDER):
            registry = CollectorRegistry()
            MultiProcessCollector(registry)  # type: ignore[no-untyped-call]
        return generate_latest(registry)


def log_request(scope: Mapping[str, Any], status: int, size: int, elapsed_s: float) -> None:
    """Log a request and its outcome, without the query, which is private."""
    time = datetime.now(UTC).isoformat(timespec="milliseconds")
    client = scope.get("client")
    # written out: json.dumps takes 6 µs more, a twentieth of a request
    sys.stderr.write(
        f'{{"time": "{time}", "level": "info", "event": "request", '
        f'"method": {_quoted(scope["method"])}, "path": {_quoted(scope["path"])}, '
        f'"status": {status}, "bytes": {size}, "ms": {1e3 * elapsed_s:.3f}, '
        f'"client": {_quoted(client[0] if client else "")}}}\n'
    )


class JsonFormatter(logging.Formatter):
    """Formatter of log messages as single lines of JSON."""

    def format(self, record: logging.LogRecord) -> str:
        """Return the line of a message."""
        line = {
            "time": datetime.fromtimestamp(record.created, UTC).isoformat(timespec="milliseconds"),
            "level": record.levelname.lower(),
            "event": "message",
            "message": record.getMessage(),
        }
        if record.exc_info:
            line["exception"] = self.formatException(record.exc_info)
        return json.dumps(line)


CONFIGURATION: dict[str, Any] = {
    "version": 1,
    "disable_existing_loggers": False,
    "formatters": {"json": {"()": f"{__name__}.{JsonFormatter.__name__}"}},
    "handlers": {"stderr": {"class": "logging.StreamHandler", "formatter": "json"}},
    "root": {"handlers": ["stderr"], "level": "INFO"},
}
"""Configuration of the logging library."""


def log_as_json() -> None:
    """Log messages, and warnings of libraries, as lines of JSON in this process."""
    dictConfig(CONFIGURATION)
    logging.captureWarnings(True)
