"""`/v1/healthz`: whether the service answers."""

from __future__ import annotations

from fastapi import APIRouter, Request, Response

from rbfrag.service.answer import json_answer
from rbfrag.service.documents import Health
from rbfrag.service.operation import operation
from rbfrag.service.plain_route import plain_router
from rbfrag.version import __version__


def router() -> APIRouter:
    """Return the operation on `/v1/healthz`, which asks for no token."""
    routes = plain_router()

    @routes.get("/v1/healthz", **operation("Whether the service answers", Health, problems=()))
    async def health(request: Request) -> Response:  # noqa: ARG001
        return json_answer({"status": "ok", "version": __version__})

    return routes
