"""Access control, response headers, metrics and logging for every request."""

from __future__ import annotations

import hmac
from collections.abc import Awaitable, Callable, MutableMapping
from time import perf_counter
from typing import Any

from rbfrag.service.problem import problem
from rbfrag.service.protocol import HEADERS_BYTES
from rbfrag.service.request_records import Metrics, log_request
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
