"""The body of a request, in bounds: so long, so slow, so many at once."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

from fastapi import Request

from rbfrag.service.json_body import MalformedError
from rbfrag.service.problem import busy, gone, too_long, too_slow
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


class Bodies:
    """Reads bodies, a bounded number at a time.

    Args:
        settings: the bounds.
    """

    def __init__(self, settings: Settings) -> None:
        self._settings = settings
        self._places = asyncio.Semaphore(settings.bodies_at_once)

    @asynccontextmanager
    async def read(self, request: Request) -> AsyncIterator[bytes]:
        """Yield the body of a request; its place is kept until the answer is made.

        The body is the request's own, or the one file of a form.
        """
        limits = self._settings
        stated = request.headers.get("content-length", "")
        if stated.isdigit() and int(stated) > limits.body_limit_bytes:
            raise too_long(limits.body_limit_bytes)
        try:
            await asyncio.wait_for(self._places.acquire(), limits.time_limit_s)
        except TimeoutError:
            raise busy() from None
        try:
            try:
                body = await asyncio.wait_for(self._whole(request), limits.body_time_s)
            except TimeoutError:
                raise too_slow(limits.body_time_s) from None
            if media_type(request) == MULTIPART:
                body = await _file_of_form(request, body)
            yield body
        finally:
            self._places.release()

    async def _whole(self, request: Request) -> bytes:
        limit = self._settings.body_limit_bytes
        parts, size, more = [], 0, True
        while more:
            message = await request.receive()
            if message["type"] == "http.disconnect":
                raise gone()
            part = message.get("body", b"")
            size += len(part)
            if size > limit:
                raise too_long(limit)
            parts.append(part)
            more = message.get("more_body", False)
        return b"".join(parts)


def media_type(request: Request) -> str:
    """Return the type of a body without its parameters."""
    return request.headers.get("content-type", "").partition(";")[0].strip().lower()


async def _file_of_form(request: Request, body: bytes) -> bytes:
    async def receive() -> dict[str, Any]:
        return {"type": "http.request", "body": body, "more_body": False}

    async with Request(request.scope, receive).form(max_files=1, max_fields=1) as form:
        files = [each for _, each in form.multi_items() if not isinstance(each, str)]
        if len(files) != 1 or len(form.multi_items()) != 1:
            raise MalformedError("the form does not hold one file and nothing else")
        return await files[0].read()
