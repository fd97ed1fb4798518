"""Parameters in the query of a URL: read, refused in words, and described for OpenAPI."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal
from urllib.parse import parse_qsl

from rbfrag.errors import InputError

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

    Args:
        query: what follows the question mark of a URL.
        known: parameters by name.

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
    """Return names and values.

    Raises:
        ValueError: not UTF-8, or too many.
    """
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
