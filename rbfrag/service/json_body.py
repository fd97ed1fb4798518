"""JSON in and out: the bodies of requests, and documents as answers."""

from __future__ import annotations

import json
from typing import Any, NoReturn

from fastapi import Response

from rbfrag.errors import InputError

_ENCODER = json.JSONEncoder(ensure_ascii=False, allow_nan=False, separators=(",", ":"))


class MalformedError(InputError):
    """A body that is not what its type says."""


def json_text(document: object) -> bytes:
    """Return a document as JSON."""
    return _ENCODER.encode(document).encode("utf-8")


def read_json(body: bytes) -> Any:
    """Return what a body says."""
    try:
        return json.loads(body.decode("utf-8-sig"), parse_constant=_refuse)
    except UnicodeDecodeError as error:
        raise MalformedError(f"byte {error.start} of the body is not UTF-8 text") from None
    except json.JSONDecodeError as error:
        raise MalformedError(
            f"the body is not JSON: line {error.lineno}, column {error.colno}: {error.msg}"
        ) from None
    except RecursionError:
        raise MalformedError("the body is nested too deeply") from None
    except ValueError as error:  # a number of thousands of digits
        raise MalformedError(f"the body is not JSON: {error}") from None


def _refuse(word: str) -> NoReturn:
    raise MalformedError(f"{word} is no JSON number: give a finite one, or null for a missing one")


def json_answer(document: object) -> Response:
    """Return a document as the answer to a request."""
    return answer(json_text(document))


def answer(text: bytes) -> Response:
    """Return JSON that is written already as the answer to a request."""
    return Response(text, media_type="application/json")
