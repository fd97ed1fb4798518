"""Error responses as problem details (RFC 9457), with one handler for every error."""

from __future__ import annotations

import json
import logging
import os
import re
from collections.abc import Mapping, Sequence
from http import HTTPStatus
from reprlib import Repr
from typing import Any

from fastapi import Request, Response
from pydantic.fields import FieldInfo
from starlette.exceptions import HTTPException
from starlette.routing import Match

from rbfrag.db.location import locate, reference_file
from rbfrag.errors import DatabaseError, InputError, RbfragError, UnknownModelError
from rbfrag.service.documents import Problem
from rbfrag.service.settings import ServiceSettings
from rbfrag.vocabulary.quantities import MEASURED, ONLY_PREDICT, name_of, parameter_of

MEDIA_TYPE = "application/problem+json"


class MalformedError(InputError):
    """A body that is not of its declared type."""


class SeveralTracesError(InputError):
    """A file of several traces without a selected one.

    Args:
        words: what is wrong and what to do.
        traces: names of the traces, in the order of the file.
    """

    def __init__(self, words: str, traces: Sequence[str]) -> None:
        super().__init__(words)
        self.traces = list(traces)

    def __reduce__(self) -> tuple[object, ...]:
        # it comes from another process
        return type(self), (str(self), self.traces)


class RequestRefusedError(HTTPException):
    """A request that the service rejects; see :func:`problem`."""

    def __init__(
        self, status: int, kind: str, detail: str, headers: Mapping[str, str] | None = None
    ) -> None:
        super().__init__(status, detail, headers)
        self.kind = kind


BUSY = 503, "busy", "the service is busy: try again", {"retry-after": "5"}
GONE = 400, "gone", "the connection was closed before the end of the body"
"""Nobody reads this: the client has gone."""

_MEANING = {
    400: "Malformed request.",
    401: "The bearer token is missing or wrong.",
    408: "Timeout of the request body.",
    413: "The body exceeds the size limit.",
    415: "Unsupported type of body.",
    422: "Invalid value; the detail names it and the remedy.",
    503: "The database is not available, or the service is busy.",
}


def documented(*statuses: int) -> dict[int | str, dict[str, Any]]:
    """Return the problems of an operation as additional responses for FastAPI."""
    content = {MEDIA_TYPE: {"schema": Problem.model_json_schema()}}
    return {status: {"description": _MEANING[status], "content": content} for status in statuses}


READ = documented(401, 422, 503)
"""Problems of an operation that is asked in its URL alone."""

SENT = documented(400, 401, 408, 413, 415, 422, 503)
"""Problems of an operation that is sent a body."""


def problem(
    status: int,
    kind: str,
    detail: str,
    headers: Mapping[str, str] | None = None,
    **more: object,
) -> Response:
    """Return a response that describes an error.

    Args:
        status: HTTP status.
        kind: what kind of trouble, for programs: ``input``, ``unknown-model``.
        detail: one paragraph for a person.
        headers: further headers.
        more: further members of the document.
    """
    document = {
        "type": f"urn:rbfrag:problem:{kind}",
        "title": HTTPStatus(status).phrase,
        "status": status,
        "detail": detail,
        **more,
    }
    body = json.dumps(document, ensure_ascii=False).encode("utf-8", "replace")
    return Response(body, status, dict(headers or {}), MEDIA_TYPE)


def answer_error(request: Request, error: Exception, settings: ServiceSettings) -> Response:
    """Return the answer to a request that raised an error: the one handler of the service.

    Args:
        request: what was asked.
        error: what was raised.
        settings: those of the service; the place of its database is left out of the words.
    """
    if isinstance(error, RequestRefusedError):
        return problem(error.status_code, error.kind, error.detail, error.headers)
    if isinstance(error, HTTPException):
        return _by_the_framework(request, error)
    if isinstance(error, DatabaseError):
        # its words may name files, hosts and users
        logging.getLogger(__name__).warning("%s", error)
        words = "the database is not available: see the log of the service"
        return problem(503, "database", words)
    if isinstance(error, RbfragError):
        text = error.spelled(parameter_of) if isinstance(error, InputError) else str(error)
        detail = in_parameters(text, settings)
        if isinstance(error, MalformedError):
            return problem(400, "malformed", detail)
        if isinstance(error, SeveralTracesError):
            return problem(422, "several-traces", detail, traces=error.traces)
        kind = "unknown-model" if isinstance(error, UnknownModelError) else "input"
        return problem(422, kind, detail)
    words = "internal error of rbfrag: see the log of the service"
    return problem(500, "mistake", words)


def _by_the_framework(request: Request, error: HTTPException) -> Response:
    status = error.status_code
    if status == 400:
        return problem(400, "malformed", f"invalid form: {error.detail}")
    words = HTTPStatus(status).phrase.lower()
    headers = {**(error.headers or {}), **({"allow": _allowed(request)} if status == 405 else {})}
    return problem(
        status,
        words.replace(" ", "-"),
        f"{request.method[:20]} {request.url.path[:200]}: {words}; see /v1/openapi.json",
        headers,
    )


def _allowed(request: Request) -> str:
    """Return the methods of a path over all its routes; each route has only its own."""
    methods: set[str] = set()
    for route in request.app.routes:
        if route.matches(request.scope)[0] != Match.NONE:
            methods |= getattr(route, "methods", None) or set()
    if "GET" in methods or not methods:  # what is no route is a file of the page
        methods |= {"GET", "HEAD"}
    return ", ".join(sorted(methods))


_short = Repr()
_short.maxstring = _short.maxother = 60


def rejection(fields: Mapping[str, FieldInfo], errors: Sequence[Mapping[str, Any]]) -> InputError:
    """Return the error for values that do not match a model.

    Args:
        fields: the fields of the model, by name.
        errors: what pydantic says, each with its place in the values.
    """
    # a name that is unknown explains one that is missing
    first = next((error for error in errors if error["type"] == "extra_forbidden"), errors[0])
    if not first["loc"]:
        return InputError('the body must be a JSON object such as {"p2": 3, "kr": [0.1, 0.2]}')
    # where a field may be a number or a list, the deepest of its errors is that of what was meant
    worst = max(
        (error for error in errors if error["loc"][0] == first["loc"][0]),
        key=lambda error: (len(error["loc"]), error["type"] not in ("float_type", "list_type")),
    )
    name = str(first["loc"][0])
    if worst["type"] == "extra_forbidden":
        if name_of(name) in MEASURED:
            return InputError(ONLY_PREDICT.format(name))
        names = ", ".join(fields)
        return InputError(f"unknown parameter {name[:60]!r}; the parameters are {names}")
    indices = "".join(f"[{index}]" for index in worst["loc"][1:] if isinstance(index, int))
    return InputError(_sentence(name + indices, worst, fields[name].description or ""))


_NO_NUMBER = "{name} = {shown} is not a number: {words}"
_SENTENCES = {
    "missing": "{name} is missing: {words}",
    "string_too_short": "{name} is empty: {words}",
    "string_too_long": "{name} is longer than {max_length} characters: {words}",
    "too_short": "{name} is an empty list: give a number or a list of numbers",
    "literal_error": "{name} = {shown}: it must be {expected}",
    "bool_parsing": "{name} = {shown}: it must be true or false",
    "float_parsing": _NO_NUMBER,
    "float_type": _NO_NUMBER,
    "int_parsing": "{name} = {shown} is not a whole number: {words}",
    "string_type": "{name} = {shown} is not a text: {words}",
    "string_pattern_mismatch": "{name} = {shown} is not a list of numbers such as 30,10,3,1",
    "greater_than": "{name} = {plain} is not above {gt:g}: {words}",
    "greater_than_equal": "{name} = {plain} is below {ge:g}: {words}",
    "finite_number": "{name} = {plain} is not a finite number: {words}",
    "too_large": "{name} is too large for a number",
}
"""What is wrong with a value and what to do, by the type of pydantic's error."""

_SEPARATED = re.compile(r"[+-]?\d[\d.,'\u2019\s]*")
_ONE_POINT = "use a decimal point and no thousands separator, such as 1234.5"


def _sentence(name: str, error: Mapping[str, Any], words: str) -> str:
    kind, value, limits = error["type"], error["input"], error.get("ctx", {})
    if kind == "float_type" and type(value) is int:
        kind = "too_large"
    if kind == "literal_error":
        limits = {"expected": limits["expected"].replace("'", "").replace(", ", " or ")}
    if kind == "float_parsing" and _SEPARATED.fullmatch(value):
        words = _ONE_POINT
    form = _SENTENCES.get(kind, "{name} = {shown}: {msg}: {words}")
    about = {"name": name, "shown": _short.repr(value), "plain": str(value)[:60], "words": words}
    return form.format(**about, msg=error["msg"], **limits)


_URL = re.compile(r"\b(sqlite|postgres(ql)?)(\+\w+)?://[^\s;,]*")
_OPTION = re.compile(r"(?<![\w-])--([a-z][a-z0-9]*(?:-[a-z0-9]+)*)")


def in_parameters(words: str, settings: ServiceSettings) -> str:
    """Return a message of the command line with the names of request parameters.

    Options lose their dashes, and the database is not named by its place.
    """
    for place in _database_locations(settings):
        words = words.replace(place, "the database")
    words = _URL.sub("the database", words)
    return _OPTION.sub(lambda option: option[1].replace("-", "_"), words)


def _database_locations(settings: ServiceSettings) -> Sequence[str]:
    location = os.fspath(locate(settings.db))
    locations = [location, settings.db or location]
    if "://" not in location:
        locations.append(os.path.abspath(location))  # noqa: PTH100
    shipped = reference_file()
    if shipped is not None:
        locations.append(str(shipped))
    return sorted(locations, key=len, reverse=True)
