"""Requests that are refused for what they are, whatever they ask."""

from __future__ import annotations

from collections.abc import Mapping

from rbfrag.errors import RbfragError


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
