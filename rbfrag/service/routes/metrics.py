"""`/v1/metrics`: counts of requests for Prometheus."""

from __future__ import annotations

from fastapi import APIRouter, Request, Response

from rbfrag.service.metrics import CONTENT_TYPE, Metrics
from rbfrag.service.plain_route import plain_router


def router(metrics: Metrics) -> APIRouter:
    """Return the operation on `/v1/metrics`."""
    routes = plain_router()

    @routes.get("/v1/metrics", include_in_schema=False)
    async def counts(request: Request) -> Response:  # noqa: ARG001
        return Response(metrics.text(), headers={"content-type": CONTENT_TYPE})

    return routes
