"""Reading of requests: bodies with limits of size, time and number, and unique parameters."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator, Callable, Collection, Coroutine
from contextlib import asynccontextmanager
from typing import Any, NoReturn, TypeVar
from urllib.parse import parse_qsl

from fastapi import Request, Response
from fastapi.routing import APIRoute
from pydantic import BaseModel, TypeAdapter, ValidationError
from python_multipart.exceptions import FormParserError

from rbfrag.errors import InputError
from rbfrag.files import unique_keys
from rbfrag.question.table import field_of
from rbfrag.results.diagnostic import with_diagnostics
from rbfrag.service.problem import BUSY, GONE, MalformedError, RequestRefusedError, rejection
from rbfrag.service.settings import ServiceSettings
from rbfrag.solver.kinds import FREE_STANDING
from rbfrag.vocabulary.quantities import name_of, parameter_of
from rbfrag.vocabulary.spectral import BY_PERIOD

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
"""A body of so much takes no place, however many others are being worked on."""

LEAST_RATE = 1000.0
"""Slowest [bytes/s] that a body may come."""

PAUSE_S = 5.0
"""Longest time [s] in which nothing of a body comes."""

MOST_BRACKETS = 1000
"""Lists and objects of a request: one list a name, and one object around them."""

MOST_NAMES = 40
"""Names with a list each that a request can hold."""

_CLOSE = {"connection": "close"}
"""What still comes is not read."""

T = TypeVar("T", bound=BaseModel)
Handler = Callable[[Request], Coroutine[Any, Any, Response]]


class Bodies:
    """Reader of request bodies that limits their number and total memory.

    The framework can bound the size of a body, but neither the time that one takes to receive nor
    the memory of many at once.
    """

    def __init__(self, settings: ServiceSettings) -> None:
        self._settings = settings
        self._slots = asyncio.Semaphore(settings.bodies_at_once)
        self._free_bytes = settings.bodies_at_once * settings.body_limit_bytes

    @asynccontextmanager
    async def read(self, request: Request) -> AsyncIterator[Request]:
        """Yield a request whose body is there; its place is kept until the answer is made."""
        limits = self._settings
        content_length = request.headers.get("content-length", "")
        if content_length.isdigit() and int(content_length) > limits.body_limit_bytes:
            raise self._too_long()
        parts: list[bytes] = []
        try:
            await self._read_into(parts, request)
            parts[:] = [b"".join(parts)]
            complete_request = _with_body(request, parts[0])
            if len(parts[0]) <= SMALL_BYTES:
                yield complete_request
                return
            # taken only now: nobody waits behind bodies that do not come
            try:
                await asyncio.wait_for(self._slots.acquire(), limits.time_limit)
            except TimeoutError:
                raise RequestRefusedError(*BUSY) from None
            try:
                yield complete_request
            finally:
                self._slots.release()
        finally:
            self._free_bytes += sum(map(len, parts))

    async def _read_into(self, parts: list[bytes], request: Request) -> None:
        size = 0
        now = asyncio.get_running_loop().time
        end, late = now() + self._settings.body_time, now() + PAUSE_S
        try:
            async with asyncio.timeout_at(min(late, end)) as patience:
                more = True
                while more:
                    message = await request.receive()
                    if message["type"] == "http.disconnect":
                        raise RequestRefusedError(*GONE)
                    parts.append(message.get("body", b""))
                    came, more = len(parts[-1]), message.get("more_body", False)
                    size += came
                    self._free_bytes -= came
                    if size > self._settings.body_limit_bytes:
                        raise self._too_long()
                    if self._free_bytes < 0:
                        raise RequestRefusedError(*BUSY[:3], {**BUSY[3], **_CLOSE})
                    # what came fast is no credit for more than one pause
                    late = min(late + came / LEAST_RATE, now() + PAUSE_S)
                    patience.reschedule(min(late, end))
        except TimeoutError:
            words = f"the body took longer than {self._settings.body_time:g} s to receive"
            if late < end:
                words = f"the body is slower than {LEAST_RATE:g} bytes/s for {PAUSE_S:g} s"
            raise RequestRefusedError(408, "too-slow", words, _CLOSE) from None

    def _too_long(self) -> RequestRefusedError:
        limit = self._settings.body_limit_bytes
        words = f"the body is longer than the {limit} bytes allowed by this service"
        return RequestRefusedError(413, "too-long", words, _CLOSE)


def _with_body(request: Request, body: bytes) -> Request:
    unread = [{"type": "http.request", "body": body, "more_body": False}]

    async def receive() -> Any:
        return unread.pop() if unread else await request.receive()

    return Request(request.scope, receive)


def check_json(body: bytes, row_limit: int) -> None:
    """Reject JSON that would take long to parse, before it is parsed.

    Raises:
        InputError: more brackets, names or elements than any request needs.
    """
    if body.count(b"[") + body.count(b"{") > MOST_BRACKETS or body.count(b":") > MOST_BRACKETS:
        raise MalformedError(
            f"the body is nested too deeply, or has more than {MOST_BRACKETS} lists, objects or "
            "names"
        )
    most = MOST_NAMES * row_limit
    if body.count(b",") > most:
        raise InputError(f"the body has more than {most} elements: split the request")


def json_of(body: bytes) -> Any:
    """Return the content of a JSON body, in which each key must be unique.

    Raises:
        MalformedError: it is not JSON.
    """
    if not body:
        raise MalformedError("the body is empty, not JSON")
    try:
        return json.loads(body, object_pairs_hook=unique_keys, parse_constant=_no_number)
    except json.JSONDecodeError as error:
        where = f"line {error.lineno}, column {error.colno}"
        raise MalformedError(f"the body is not JSON: {where}: {error.msg}") from None
    except UnicodeDecodeError as error:
        raise MalformedError(f"byte {error.start} of the body is not UTF-8 text") from None
    except RecursionError:
        raise MalformedError("the body is nested too deeply") from None
    except InputError as error:  # a key that is there twice, or NaN
        raise MalformedError(str(error)) from None
    except ValueError as error:  # a number of thousands of digits
        raise MalformedError(f"the body is not JSON: {error}") from None


def _no_number(word: str) -> NoReturn:
    raise InputError(
        f"{word} is not a JSON number: give a finite number, or null for a missing value"
    )


def by_parameter(values: dict[str, Any], parameters: Collection[str]) -> dict[str, Any]:
    """Return values by parameter, for any name of their fields.

    Args:
        values: values by parameter, keyword or name of a column.
        parameters: the parameters of the operation; other names stay as they are.

    Raises:
        InputError: one field by two names.
    """
    result: dict[str, Any] = {}
    for name, value in values.items():
        match = None if name in parameters else field_of(name)
        word = name if match is None else parameter_of(match.field)
        if match is not None and word in parameters and match.unit is None:
            if match.column == "free_standing":
                value = FREE_STANDING if _is_true(value) else None
            elif match.column == "back_fracture":  # its parameter is no_back
                value = not _is_true(value)
        else:
            word = name
        if word in result:
            raise InputError(f"{name} and {word} are the same field: give one", fields=(word,))
        result[word] = value
    return result


def _is_true(value: Any) -> bool:
    return value is True or str(value).lower() in ("true", "1", "yes")


def read_as(model: type[T], values: Any) -> T:
    """Return the values of a request as a model, or reject invalid ones.

    Args:
        model: what may be stated.
        values: the parameters of a query, or the JSON of a body.
    """
    fields = model.model_fields
    if isinstance(values, dict) and not values.keys() <= fields.keys():
        values = by_parameter(values, fields)
    try:
        return model.model_validate(values)
    except ValidationError as error:
        raise rejection(model.model_fields, error.errors()) from None


class QueryRoute(APIRoute):
    """Route with one query model, unique parameters, and a limited body.

    FastAPI inspects every field of such a model again for each request: with the names of
    `/v1/predict` that takes longer than all the rest of the answer (docs/evidence/performance.md).
    """

    def get_route_handler(self) -> Handler:
        """Return the request handler."""
        models: list[Any] = [
            parameter.field_info.annotation for parameter in self.dependant.query_params
        ]
        model: type[BaseModel] | None = models[0] if models else None

        async def answer(request: Request) -> Response:
            values = query_of(request)
            arguments: dict[str, Any] = {}
            if model is not None:
                arguments["query"] = read_as(model, values)
            if request.method != "POST":
                document = await self.endpoint(**arguments)
                return document if isinstance(document, Response) else json_answer(document)
            bodies: Bodies = request.app.state.bodies
            async with bodies.read(request) as read:
                return json_answer(await self.endpoint(read, **arguments))

        return answer


def json_answer(answer: object) -> Response:
    """Return a document, or finished JSON, as the response to a request."""
    text = answer if isinstance(answer, bytes) else json_text(answer)
    return Response(text, media_type="application/json")


_WRITER: TypeAdapter[Any] = TypeAdapter(Any)


def json_text(document: object) -> bytes:
    """Return a document as JSON, with the codes of its warnings; NaN is null."""
    return _WRITER.dump_json(with_diagnostics(document))


def query_of(request: Request) -> dict[str, Any]:
    """Return the parameters of a request; duplicate names are rejected, except of values by
    oscillator period.
    """
    query = request.scope["query_string"].decode("latin-1")
    pairs = parse_qsl(query, keep_blank_values=True)
    values: dict[str, Any] = {}
    for name, value in pairs:
        values[name] = [*values.get(name, ()), value] if name_of(name) in BY_PERIOD else value
    pairs = [pair for pair in pairs if name_of(pair[0]) not in BY_PERIOD]
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


def sent_as(content: dict[str, Any]) -> dict[str, Any]:
    """Return the OpenAPI description of a body that is a plain file, unknown to FastAPI."""
    return {"requestBody": {"required": True, "content": content}}


async def sent_file(request: Request) -> bytes:
    """Return the file that a request sends: its body, or the one file of a form."""
    if media_type(request) != MULTIPART:
        return await request.body()
    try:
        async with request.form(max_files=1, max_fields=1) as form:
            files = [part for _, part in form.multi_items() if not isinstance(part, str)]
            if len(files) != 1 or len(form.multi_items()) != 1:
                raise MalformedError("the form must have exactly one file")
            return await files[0].read()
    # which starlette passed on before 1.8
    except FormParserError as error:
        raise MalformedError(f"invalid form: {error}") from None
