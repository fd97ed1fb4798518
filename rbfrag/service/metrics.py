"""Counts of requests for Prometheus, from one process or several."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
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
    """Requests by operation, method and status, and how long they took.

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

        self._found: dict[tuple[str, str, int], tuple[Counter, Histogram]] = {}

    def count(self, scope: Mapping[str, Any], status: int, elapsed_s: float) -> None:
        """Count one request.

        Args:
            scope: the request.
            status: HTTP status of the answer.
            elapsed_s: how long it took [s].
        """
        path, method = scope["path"], scope["method"]
        if path not in self._paths:
            path = "other" if status >= 400 or path.startswith("/v1/") else "page"
        if method not in _METHODS:
            method = "other"
        found = self._found.get((path, method, status))
        if found is None:
            found = self._requests.labels(path, method, str(status)), self._seconds.labels(path)
            self._found[path, method, status] = found
        requests, seconds = found
        requests.inc()
        seconds.observe(elapsed_s)

    def text(self) -> bytes:
        """Return the counts of all processes as Prometheus reads them."""
        registry = self._registry
        if os.environ.get(SHARED_FOLDER):
            registry = CollectorRegistry()
            MultiProcessCollector(registry)  # type: ignore[no-untyped-call]
        return generate_latest(registry)
