"""`/v1/models`: the fitted models that can answer."""

from __future__ import annotations

from fastapi import APIRouter, Request, Response
from fastapi.concurrency import run_in_threadpool

from rbfrag.fragility.lookup import stored_rows
from rbfrag.fragility.model_list import model_list
from rbfrag.service.answer import json_answer
from rbfrag.service.documents import ModelListed
from rbfrag.service.operation import operation
from rbfrag.service.plain_route import plain_router
from rbfrag.service.settings import Settings


def router(settings: Settings) -> APIRouter:
    """Return the operation on `/v1/models`."""
    routes = plain_router()

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

    return routes
