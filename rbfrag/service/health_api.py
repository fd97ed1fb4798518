"""`/v1/healthz`: whether the service answers."""

from __future__ import annotations

from fastapi import APIRouter, Response

from rbfrag.service.documents import Health
from rbfrag.service.json_body import json_answer
from rbfrag.service.operation import operation
from rbfrag.version import __version__


def router() -> APIRouter:
    """Return the operation on `/v1/healthz`, which asks for no token."""
    routes = APIRouter()

    @routes.get("/v1/healthz", **operation("Whether the service answers", Health, problems=()))
    async def health() -> Response:
        return json_answer({"status": "ok", "version": __version__})

    return routes
