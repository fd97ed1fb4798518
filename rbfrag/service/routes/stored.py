"""`/v1/models`, `/v1/healthz` and `/v1/metrics`: what the service has and how it does."""

from __future__ import annotations

from fastapi import APIRouter, Request, Response
from fastapi.concurrency import run_in_threadpool

from rbfrag.fragility.lookup import stored_rows
from rbfrag.fragility.model_list import model_list
from rbfrag.service.documents import Health, ModelListed
from rbfrag.service.json_body import json_answer
from rbfrag.service.operation import operation, own_router
from rbfrag.service.request_records import CONTENT_TYPE, Metrics
from rbfrag.service.settings import Settings
from rbfrag.version import __version__


def router(settings: Settings) -> APIRouter:
    """Return the operations on `/v1/models`, and on `/v1/healthz`, which asks for no token."""
    routes = own_router()

    @routes.get(
        "/v1/models",
        **operation(
            "The fitted models",
            list[ModelListed],
            description="What `rbfrag models list --json` prints; where the service was given no "
            "database and there is none, the models that are shipped with rbfrag.",
            problems=(401, 503),
        ),
    )
    async def models(request: Request) -> Response:  # noqa: ARG001
        # read anew each time, and from a server if there is one
        return json_answer(model_list(await run_in_threadpool(stored_rows, settings.db)))

    @routes.get("/v1/healthz", **operation("Whether the service answers", Health, problems=()))
    async def health(request: Request) -> Response:  # noqa: ARG001
        return json_answer({"status": "ok", "version": __version__})

    return routes


def metrics_router(metrics: Metrics) -> APIRouter:
    """Return the operation on `/v1/metrics`, which the OpenAPI document leaves out."""
    routes = own_router()

    @routes.get("/v1/metrics", include_in_schema=False)
    async def counts(request: Request) -> Response:  # noqa: ARG001
        return Response(metrics.text(), headers={"content-type": CONTENT_TYPE})

    return routes
