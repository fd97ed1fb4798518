"""How requests are read: bodies in bounds of size, time and number, each parameter once."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator, Callable, Coroutine
from contextlib import asynccontextmanager
from typing import Any
from urllib.parse import parse_qsl

from fastapi import Request, Response
from fastapi.exceptions import RequestValidationError
from fastapi.routing import APIRoute
from pydantic import BaseModel, ValidationError

from rbfrag.errors import InputError
from rbfrag.files import unique_keys
from rbfrag.service.problem import BUSY, GONE, MalformedError, RequestRefusedError
from rbfrag.service.settings import Settings

MULTIPART = "multipart/form-data"

FILE_FORM = {
    "schema": {
        "type": "object",
        "properties": {"file": {"type": "string", "format": "binary"}},
        "required": ["file"],
        "additionalProperties": False,
    }
}
"""A form of one file, as OpenAPI describes it."""

SMALL_BYTES = 1 << 16
"""Bodies that state at most this size are read at once, however many others are being read."""

MOST_BRACKETS = 1000
"""Lists and objects of a request: one list a name, and one object around them."""

MOST_NAMES = 40
"""Names with a list each that a request can hold."""

_CLOSE = {"connection": "close"}
"""What still comes is not read."""

Handler = Callable[[Request], Coroutine[Any, Any, Response]]


class Bodies:
    """Reads bodies, a bounded number at a time.

    The framework can bound the size of a body, but neither the time that one takes to come nor
    the memory of many at once.
    """

    def __init__(self, settings: Settings) -> None:
        self._settings = settings
        self._places = asyncio.Semaphore(settings.bodies_at_once)

    @asynccontextmanager
    async def read(self, request: Request) -> AsyncIterator[Request]:
        """Yield a request whose body is there; its place is kept until the answer is made."""
        limits = self._settings
        stated = request.headers.get("content-length", "")
        if stated.isdigit() and int(stated) > limits.body_limit_bytes:
            raise self._too_long()
        if stated.isdigit() and int(stated) <= SMALL_BYTES:
            # it takes no memory to speak of, and so no place: nobody waits behind idle ones
            yield _with_body(request, await self._in_time(request))
            return
        try:
            await asyncio.wait_for(self._places.acquire(), limits.time_limit)
        except TimeoutError:
            raise RequestRefusedError(*BUSY) from None
        try:
            yield _with_body(request, await self._in_time(request))
        finally:
            self._places.release()

    async def _in_time(self, request: Request) -> bytes:
        limit_s = self._settings.body_time
        try:
            return await asyncio.wait_for(self._whole(request), limit_s)
        except TimeoutError:
            words = f"the body took longer than {limit_s:g} s to come"
            raise RequestRefusedError(408, "too-slow", words, _CLOSE) from None

    def check_json(self, body: bytes) -> None:
        """Refuse JSON whose parsing would take long, before it is parsed.

        Raises:
            InputError: more brackets or elements than any request needs.
        """
        if body.count(b"[") + body.count(b"{") > MOST_BRACKETS:
            raise MalformedError(
                "the body is nested too deeply, or holds more than "
                f"{MOST_BRACKETS} lists and objects"
            )
        most = MOST_NAMES * self._settings.row_limit
        if body.count(b",") > most:
            raise InputError(f"the body holds more than {most} elements: split the request")

    async def _whole(self, request: Request) -> bytes:
        parts, size, more = [], 0, True
        while more:
            message = await request.receive()
            if message["type"] == "http.disconnect":
                raise RequestRefusedError(*GONE)
            part = message.get("body", b"")
            size += len(part)
            if size > self._settings.body_limit_bytes:
                raise self._too_long()
            parts.append(part)
            more = message.get("more_body", False)
        return b"".join(parts)

    def _too_long(self) -> RequestRefusedError:
        limit = self._settings.body_limit_bytes
        words = f"the body is longer than the {limit} bytes that this service takes"
        return RequestRefusedError(413, "too-long", words, _CLOSE)


def _with_body(request: Request, body: bytes) -> Request:
    unread = [{"type": "http.request", "body": body, "more_body": False}]

    async def receive() -> Any:
        return unread.pop() if unread else await request.receive()

    return _StrictRequest(request.scope, receive)


class _StrictRequest(Request):
    """A request in whose JSON each key is there once."""

    async def json(self) -> Any:
        return json.loads(await self.body(), object_pairs_hook=unique_keys)


class BoundedRoute(APIRoute):
    """A route whose body is read in bounds, and whose parameters are given once."""

    def get_route_handler(self) -> Handler:
        """Return what answers a request."""
        handler = super().get_route_handler()

        async def bounded(request: Request) -> Response:
            query_of(request)
            if request.method != "POST":
                return await handler(request)
            if self.body_field is not None:
                # JSON is all that these routes take, and what curl sends says that it is a form
                headers = [each for each in request.scope["headers"] if each[0] != b"content-type"]
                request.scope["headers"] = [*headers, (b"content-type", b"application/json")]
            bodies: Bodies = request.app.state.bodies
            async with bodies.read(request) as read:
                if self.body_field is not None:
                    bodies.check_json(await read.body())
                return await handler(read)

        return bounded


class QueryRoute(APIRoute):
    """A route that is asked by the model of a query alone, which pydantic reads at once.

    FastAPI inspects every field of such a model anew for each request: with the names of
    `/v1/predict` that takes longer than all the rest of the answer (docs/evidence/performance.md).
    """

    def get_route_handler(self) -> Handler:
        """Return what answers a request."""
        (parameter,) = self.dependant.query_params
        model: type[BaseModel] = parameter.field_info.annotation  # type: ignore[assignment]

        async def answer(request: Request) -> Response:
            try:
                query = model.model_validate(query_of(request))
            except ValidationError as error:
                errors = [{**each, "loc": ("query", *each["loc"])} for each in error.errors()]
                raise RequestValidationError(errors) from None
            document: BaseModel = await self.endpoint(query)
            return Response(document.model_dump_json(), media_type="application/json")

        return answer


def query_of(request: Request) -> dict[str, str]:
    """Return the parameters of a request; the framework takes the last of equal names, unasked."""
    query = request.scope["query_string"].decode("latin-1")
    pairs = parse_qsl(query, keep_blank_values=True)
    values = dict(pairs)
    if len(values) < len(pairs):
        seen: set[str] = set()
        for name, _ in pairs:
            if name in seen:
                raise InputError(f"{name[:60]} is given twice: give it once")
            seen.add(name)
    return values


def media_type(request: Request) -> str:
    """Return the type of a body without its parameters."""
    return request.headers.get("content-type", "").partition(";")[0].strip().lower()


async def sent_file(request: Request) -> bytes:
    """Return the file that a request sends: its body, or the one file of a form."""
    if media_type(request) != MULTIPART:
        return await request.body()
    async with request.form(max_files=1, max_fields=1) as form:
        files = [each for _, each in form.multi_items() if not isinstance(each, str)]
        if len(files) != 1 or len(form.multi_items()) != 1:
            raise MalformedError("the form does not hold one file and nothing else")
        return await files[0].read()
