"""What went wrong, as problem details (RFC 9457), and requests refused for what they are."""

from __future__ import annotations

import json
import logging
import os
import re
from collections.abc import Mapping
from http import HTTPStatus

from fastapi import Response

from rbfrag.db.location import locate, reference_file
from rbfrag.errors import DatabaseError, RbfragError, UnknownModelError
from rbfrag.service.json_body import MalformedError
from rbfrag.service.settings import Settings


class RequestRefusedError(RbfragError):
    """A request that the service does not take.

    Args:
        status: HTTP status of the answer.
        kind: what kind of trouble, for programs.
        detail: one paragraph for a person.
        headers: further headers of the answer.
    """

    def __init__(
        self, status: int, kind: str, detail: str, headers: Mapping[str, str] | None = None
    ) -> None:
        super().__init__(detail)
        self.status = status
        self.kind = kind
        self.headers = dict(headers or {})


def too_long(limit_bytes: int) -> RequestRefusedError:
    """Return the refusal of a body beyond the limit."""
    return RequestRefusedError(
        413,
        "too-long",
        f"the body is longer than the {limit_bytes} bytes that this service takes",
        # what still comes is not read
        {"connection": "close"},
    )


def too_slow(limit_s: float) -> RequestRefusedError:
    """Return the refusal of a body that does not come."""
    return RequestRefusedError(
        408, "too-slow", f"the body took longer than {limit_s:g} s to come", {"connection": "close"}
    )


def busy() -> RequestRefusedError:
    """Return the refusal of a request for which there is no time."""
    return RequestRefusedError(
        503, "busy", "other requests are being worked on: ask again", {"retry-after": "5"}
    )


def too_much_work(limit_s: float) -> RequestRefusedError:
    """Return the refusal of work beyond the limit."""
    return RequestRefusedError(
        422,
        "time-limit",
        f"the answer takes longer than the {limit_s:g} s that this service works on one request: "
        "ask for less, ask the command line, or let the service be started with a longer "
        "--time-limit",
    )


def gone() -> RequestRefusedError:
    """Return the end of a request whose client has gone; nobody reads it."""
    return RequestRefusedError(400, "gone", "the connection was closed within the body")


MEDIA_TYPE = "application/problem+json"

_URL = re.compile(r"\b(sqlite|postgres(ql)?)(\+\w+)?://[^\s;,]*")
_OPTION = re.compile(r"(?<![\w-])--([a-z][a-z0-9]*(?:-[a-z0-9]+)*)")


def problem(
    status: int, kind: str, detail: str, headers: Mapping[str, str] | None = None
) -> Response:
    """Return an answer that says what was wrong.

    Args:
        status: HTTP status.
        kind: what kind of trouble, for programs: ``input``, ``unknown-model``.
        detail: one paragraph for a person.
        headers: further headers.
    """
    document = {
        "type": f"urn:rbfrag:problem:{kind}",
        "title": HTTPStatus(status).phrase,
        "status": status,
        "detail": detail,
    }
    body = json.dumps(document, ensure_ascii=False).encode("utf-8", "replace")
    return Response(body, status, dict(headers or {}), MEDIA_TYPE)


def refused(error: RbfragError, settings: Settings) -> Response:
    """Return the answer to a request that raised an error on purpose.

    Args:
        error: what was raised.
        settings: those of the service; the place of its database is left out of the words.
    """
    if isinstance(error, RequestRefusedError):
        return problem(error.status, error.kind, str(error), error.headers)
    if isinstance(error, DatabaseError):
        # its words may name files, hosts and users
        logging.getLogger(__name__).warning("%s", error)
        return problem(
            503, "database", "the database cannot be read; the log of the service says why"
        )
    detail = in_parameters(str(error), settings)
    if isinstance(error, MalformedError):
        return problem(400, "malformed", detail)
    if isinstance(error, UnknownModelError):
        return problem(422, "unknown-model", detail)
    return problem(422, "input", detail)


def in_parameters(words: str, settings: Settings) -> str:
    """Return a message of the command line in the words of a request.

    Options lose their dashes, and the database is not named by its place.
    """
    for place in _places(settings):
        words = words.replace(place, "the database")
    words = _URL.sub("the database", words)
    return _OPTION.sub(lambda found: found[1].replace("-", "_"), words)


def _places(settings: Settings) -> list[str]:
    place = os.fspath(locate(settings.db))
    places = [place, settings.db or place]
    if "://" not in place:
        places.append(os.path.abspath(place))  # noqa: PTH100
    shipped = reference_file()
    if shipped is not None:
        places.append(str(shipped))
    return sorted(places, key=len, reverse=True)
