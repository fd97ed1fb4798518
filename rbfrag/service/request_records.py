"""Records of requests: counts for Prometheus, and log lines of JSON."""

from __future__ import annotations

import json
import logging
import os
import sys
from collections.abc import Iterable, Mapping
from datetime import UTC, datetime
from json.encoder import encode_basestring_ascii as _quoted
from logging.config import dictConfig
from typing import Any

from prometheus_client import (
    CONTENT_TYPE_LATEST,
    CollectorRegistry,
    Counter,
    Histogram,
    generate_latest,
)
from prometheus_client.multiprocess import MultiProcessCollector

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
