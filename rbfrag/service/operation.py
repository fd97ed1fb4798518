"""Operations: parameters in the query of a URL, and what all have in common in OpenAPI."""

from __future__ import annotations

from collections.abc import Callable, Coroutine, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal
from urllib.parse import parse_qsl

from fastapi import APIRouter, Request, Response
from fastapi.routing import APIRoute

from rbfrag.errors import InputError
from rbfrag.service.documents import Problem
from rbfrag.service.problem import MEDIA_TYPE

Kind = Literal["number", "integer", "string", "boolean", "numbers"]

MOST_PARAMETERS = 50

_NUMBERS = r"^[0-9.]+([eE][+-]?[0-9]+)?(,[0-9.]+([eE][+-]?[0-9]+)?)*$"

_FLAGS = {"true": True, "1": True, "false": False, "0": False}


@dataclass(frozen=True)
class Parameter:
    """A named value; its name is that of the command-line option without the dashes.

    Args:
        name: its name.
        kind: what it is, as JSON schema says it; ``numbers`` are numbers between commas.
        words: what it means, with its unit.
        example: a value for the documentation.
        limits: further JSON schema, such as ``{"exclusiveMinimum": 0}``.
        required: whether it must be given.
    """

    name: str
    kind: Kind
    words: str
    example: Any = None
    limits: Mapping[str, Any] | None = None
    required: bool = False

    def schema(self) -> dict[str, Any]:
        """Return the JSON schema of a value."""
        if self.kind == "numbers":
            return {"type": "string", "pattern": _NUMBERS, **(self.limits or {})}
        return {"type": self.kind, **(self.limits or {})}

    def openapi(self) -> dict[str, Any]:
        """Return the parameter as OpenAPI describes it."""
        described: dict[str, Any] = {
            "name": self.name,
            "in": "query",
            "required": self.required,
            "description": self.words,
            "schema": self.schema(),
        }
        if self.example is not None:
            described["example"] = self.example
        return described


def by_name(parameters: Sequence[Parameter]) -> dict[str, Parameter]:
    """Return parameters by name, for :func:`read_query`."""
    return {each.name: each for each in parameters}


def read_query(query: bytes, known: Mapping[str, Parameter]) -> dict[str, Any]:
    """Return the values of a query by name.

    Raises:
        InputError: a parameter that is not known, given twice or missing, or whose value is not
            of its kind.
    """
    try:
        pairs = _pairs(query.decode("utf-8"))
    except ValueError:  # UnicodeDecodeError is one
        raise InputError(
            f"the query is not UTF-8 text of at most {MOST_PARAMETERS} parameters: "
            f"write ?{'&'.join(f'{name}=…' for name in list(known)[:3])}"
        ) from None
    found: dict[str, Any] = {}
    for name, text in pairs:
        parameter = known.get(name)
        if parameter is None:
            raise InputError(f"there is no parameter {name[:60]!r}; known are {', '.join(known)}")
        if name in found:
            raise InputError(f"{name} is given twice: give it once")
        found[name] = _value(parameter, text)
    for name, parameter in known.items():
        if parameter.required and name not in found:
            raise InputError(f"{name} is missing: {parameter.words}")
    return found


def _pairs(query: str) -> list[tuple[str, str]]:
    """Return names and values."""
    if query.count("&") >= MOST_PARAMETERS:
        raise ValueError
    if "%" in query or "+" in query:
        return parse_qsl(query, keep_blank_values=True, errors="strict")
    parts = (each.partition("=") for each in query.split("&") if each)
    return [(name, value) for name, _, value in parts]


def _value(parameter: Parameter, text: str) -> float | int | str | bool | list[float]:
    kind, value = parameter.kind, text[:60]
    try:
        if kind == "numbers":
            return [float(part) for part in text.split(",")]
        if kind == "number":
            return float(text)
        if kind == "integer":
            return int(text)
    except ValueError:
        raise InputError(f"{parameter.name} = {value!r} is not {_NAMED[kind]}") from None
    if kind == "boolean":
        flag = _FLAGS.get(text.lower())
        if flag is None:
            raise InputError(f"{parameter.name} = {value!r}: write true or false")
        return flag
    if not text:
        raise InputError(f"{parameter.name} is empty: {parameter.words}")
    choices = (parameter.limits or {}).get("enum")
    if choices and text not in choices:
        raise InputError(f"{parameter.name} is {value!r}: write {' or '.join(choices)}")
    return text


_NAMED = {
    "number": "a number",
    "integer": "a whole number",
    "numbers": "a list of numbers such as 30,10,3,1",
}


P2 = Parameter(
    "p2",
    "number",
    "Frequency parameter p² of the block [1/s²].",
    3.0,
    {"exclusiveMinimum": 0},
    required=True,
)
KR = Parameter(
    "kr",
    "number",
    "Rocking acceleration coefficient k_r = tan(critical angle) [g].",
    0.1,
    {"exclusiveMinimum": 0},
    required=True,
)
OTHER_BLOCKS = (
    Parameter(
        "kind",
        "string",
        "How the block fails. Default: what it is given by.",
        None,
        {"minLength": 1},
    ),
    Parameter(
        "ky",
        "number",
        "Sliding: yield acceleration coefficient tan(phi - beta).",
        None,
        {"exclusiveMinimum": 0},
    ),
    Parameter(
        "displacement",
        "number",
        "Sliding: the displacement that is too far [m].",
        None,
        {"exclusiveMinimum": 0},
    ),
    Parameter("beta", "number", "Sliding: dip of the base, out of the slope positive [deg].", None),
    Parameter(
        "ks",
        "number",
        "Slumping: yield acceleration coefficient k_s.",
        None,
        {"exclusiveMinimum": 0},
    ),
    Parameter(
        "ps2",
        "number",
        "Slumping: frequency parameter p_s² at rest [1/s²].",
        None,
        {"exclusiveMinimum": 0},
    ),
    Parameter(
        "rotation",
        "number",
        "Slumping: rotation that counts as failure [deg]. Default: failure past recovery.",
        None,
    ),
)
MEASURES = (
    Parameter("pgv", "number", "Peak ground velocity [m/s].", 0.6, {"minimum": 0}),
    Parameter("pga", "number", "Peak ground acceleration [g].", None, {"minimum": 0}),
    Parameter("tm", "number", "Mean period [s].", None, {"exclusiveMinimum": 0}),
    Parameter("pgd", "number", "Peak ground displacement [m].", None, {"minimum": 0}),
)
MODEL = Parameter(
    "model",
    "string",
    "Name of a stored model. Default: the database's default if the given measures suffice for "
    "it, else the best that they suffice for.",
    None,
    {"minLength": 1},
)
LEVEL = Parameter(
    "level",
    "number",
    "Confidence level of the interval.",
    None,
    {"exclusiveMinimum": 0, "exclusiveMaximum": 1, "default": 0.95},
)

KEYWORD = {"pgv": "pgv_m_s", "pga": "pga_g", "tm": "tm_s", "pgd": "pgd_m"}
"""Keywords of :func:`rbfrag.predict` by the names of the parameters."""


def measures_in(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the measures among some values, by the keywords of :func:`rbfrag.predict`."""
    return {keyword: values[name] for name, keyword in KEYWORD.items() if name in values}


class _OwnRoute(APIRoute):
    def get_route_handler(self) -> Callable[[Request], Coroutine[Any, Any, Response]]:
        """Return the endpoint itself: there are no dependencies that would have to be solved."""
        return self.endpoint


def own_router() -> APIRouter:
    """Return a router for functions from a request to a response."""
    return APIRouter(route_class=_OwnRoute)


PROBLEMS = {
    400: "The request cannot be read.",
    401: "The bearer token is missing or wrong.",
    408: "The body came too slowly.",
    413: "The body is longer than this service takes.",
    415: "The body is of another type.",
    422: "A value cannot be used; the detail says which and what to do.",
    503: "The database cannot be read, or the service is busy.",
}


def operation(
    summary: str,
    answer: Any,
    *,
    parameters: Mapping[str, Parameter] | None = None,
    body: Mapping[str, Any] | None = None,
    description: str = "",
    problems: tuple[int, ...] = (400, 401, 408, 413, 415, 422, 503),
) -> dict[str, Any]:
    """Return the keywords of a FastAPI operation that reads its request itself."""
    extra: dict[str, Any] = {}
    if parameters:
        extra["parameters"] = [each.openapi() for each in parameters.values()]
    if body is not None:
        extra["requestBody"] = {"required": True, "content": dict(body)}
    else:
        problems = tuple(status for status in problems if status not in (408, 413, 415))
    described: dict[int | str, dict[str, Any]] = {200: {"model": answer}}
    reference = {"$ref": f"#/components/schemas/{Problem.__name__}"}
    for status in problems:
        described[status] = {
            "description": PROBLEMS[status],
            "content": {MEDIA_TYPE: {"schema": reference}},
        }
    return {
        "summary": summary,
        "description": description or summary,
        "responses": described,
        "openapi_extra": extra,
    }
