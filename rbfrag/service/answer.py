"""A document as the answer to a request."""

from __future__ import annotations

from fastapi import Response

from rbfrag.service.json_body import json_text


def json_answer(document: object) -> Response:
    """Return a document as the answer to a request."""
    return answer(json_text(document))


def answer(text: bytes) -> Response:
    """Return JSON that is written already as the answer to a request."""
    return Response(text, media_type="application/json")
