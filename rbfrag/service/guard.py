"""What every request passes first and last: who asks, what is said about it afterwards."""

from __future__ import annotations

import hmac
from collections.abc import Awaitable, Callable, MutableMapping
from time import perf_counter
from typing import Any

from rbfrag.service.problem import problem
from rbfrag.service.request_records import Metrics, log_request
from rbfrag.service.settings import Settings

Message = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Message]]
Send = Callable[[Message], Awaitable[None]]
Application = Callable[[Message, Receive, Send], Awaitable[None]]

OPEN_TO_ALL = "/v1/healthz"

_HEADERS = [
    (b"cache-control", b"no-store"),
    (b"x-content-type-options", b"nosniff"),
    (b"referrer-policy", b"no-referrer"),
]
"""What is said with every answer; the page has headers of its own."""


class Guard:
    """An ASGI application around another that asks for the token, measures and logs."""

    def __init__(self, app: Application, settings: Settings, metrics: Metrics) -> None:
        self._app = app
        self._bearer = None if settings.token is None else f"Bearer {settings.token}".encode()
        self._hosts = {name.lower().encode() for name in settings.allow_host}
        self._metrics = metrics

    async def __call__(self, scope: Message, receive: Receive, send: Send) -> None:
        """Answer a request."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        start = perf_counter()
        status, size = 500, 0
        own = scope["path"].startswith("/v1/")

        async def watched(message: Message) -> None:
            nonlocal status, size
            if message["type"] == "http.response.start":
                status = message["status"]
                if own:
                    message["headers"] = [*message.get("headers", ()), *_HEADERS]
            else:
                size += len(message.get("body", b""))
            await send(message)

        refusal = self._refusal(scope)
        try:
            if refusal is None:
                await self._app(scope, receive, watched)
            else:
                await refusal(scope, receive, watched)
        finally:
            elapsed_s = perf_counter() - start
            self._metrics.count(scope, status, elapsed_s)
            log_request(scope, status, size, elapsed_s)

    def _refusal(self, scope: Message) -> Any:
        if self._bearer is None and not self._hosts:
            return None
        given = dict(scope["headers"])
        if self._hosts and _name(given.get(b"host", b"")) not in self._hosts:
            return problem(
                421,
                "host",
                "this service is not asked by that name: start it with --allow-host NAME",
            )
        if self._bearer is None or not scope["path"].startswith("/v1/"):
            return None
        if scope["path"] == OPEN_TO_ALL:
            return None
        if hmac.compare_digest(given.get(b"authorization", b""), self._bearer):
            return None
        return problem(
            401,
            "token",
            "this service asks for its token: send the header  Authorization: Bearer TOKEN",
            {"www-authenticate": 'Bearer realm="rbfrag"'},
        )


def _name(host: bytes) -> bytes:
    """Return a Host header without its port."""
    name, colon, port = host.lower().rpartition(b":")
    return name if colon and port.isdigit() else host.lower()
