"""The application: every operation, the page, and what becomes of errors."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from http import HTTPStatus
from typing import Any

from fastapi import FastAPI, HTTPException, Request, Response
from fastapi.concurrency import run_in_threadpool
from fastapi.middleware.cors import CORSMiddleware
from fastapi.openapi.utils import get_openapi

from rbfrag.errors import RbfragError
from rbfrag.service import work
from rbfrag.service.body import Bodies
from rbfrag.service.documents import Problem
from rbfrag.service.guard import Guard
from rbfrag.service.metrics import Metrics
from rbfrag.service.page_files import PageFiles
from rbfrag.service.problem import problem, refused
from rbfrag.service.request_log import RequestLog
from rbfrag.service.routes import (
    block,
    drawing,
    hazard,
    health,
    metrics,
    models,
    motion,
    predict,
    rockmass,
)
from rbfrag.service.settings import Settings
from rbfrag.service.workshop import Workshop
from rbfrag.version import __version__


def make_app(settings: Settings) -> FastAPI:
    """Return the application.

    Args:
        settings: what it reads, whom it answers and how much it takes on.
    """
    bodies = Bodies(settings)
    workshop = Workshop(settings.jobs, settings.time_limit_s)

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:  # noqa: ARG001
        if settings.early:
            workshop.open().schedule(work.warm_up)
        yield
        await run_in_threadpool(workshop.close)

    app = FastAPI(
        title="rbfrag",
        version=__version__,
        summary="Seismic fragility of rock blocks",
        description="Accelerations in g, velocities in m/s, displacements in m, times in s, p2 in "
        "1/s², angles in degrees. Names, answers and messages are those of the command line.",
        openapi_url="/v1/openapi.json",
        docs_url=None,  # its scripts come from another host
        redoc_url=None,
        redirect_slashes=False,
        lifespan=lifespan,
    )
    for each in (
        predict.router(settings, bodies, workshop),
        block.router(),
        drawing.router(),
        rockmass.router(settings, bodies, workshop),
        motion.router(bodies, workshop),
        hazard.router(settings, bodies, workshop),
        models.router(settings),
        health.router(),
    ):
        # one flat list: looking through routers in routers takes longer than an answer
        app.router.routes.extend(each.routes)
    document = _document(app)
    app.openapi = lambda: document  # type: ignore[method-assign]
    counts = Metrics([*document["paths"], "/v1/metrics", "/v1/openapi.json"])
    app.router.routes.extend(metrics.router(counts).routes)
    app.mount("/", PageFiles(), name="page")
    app.add_middleware(Guard, settings=settings, metrics=counts, log=RequestLog())
    if settings.allowed_origins:
        app.add_middleware(
            CORSMiddleware,
            allow_origins=settings.allowed_origins,
            allow_methods=["GET", "POST"],
            allow_headers=["Authorization", "Content-Type"],
        )

    @app.exception_handler(RbfragError)
    async def on_purpose(request: Request, error: RbfragError) -> Response:  # noqa: ARG001
        return refused(error, settings)

    @app.exception_handler(400)
    async def unreadable(request: Request, error: HTTPException) -> Response:  # noqa: ARG001
        return problem(400, "malformed", f"the form cannot be read: {error.detail}")

    @app.exception_handler(404)
    @app.exception_handler(405)
    async def by_the_framework(request: Request, error: HTTPException) -> Response:
        return not_served(request, error)

    @app.exception_handler(Exception)
    async def by_mistake(request: Request, error: Exception) -> Response:  # noqa: ARG001
        return problem(
            500,
            "mistake",
            "a mistake in rbfrag itself; what happened is in the log of the service",
        )

    return app


def not_served(request: Request, error: HTTPException) -> Response:
    """Return the answer to a path or a method that is not served."""
    status = error.status_code
    words = HTTPStatus(status).phrase.lower()
    return problem(
        status,
        words.replace(" ", "-"),
        f"{request.method[:20]} {request.url.path[:200]}: {words}; see /v1/openapi.json",
        error.headers,
    )


def _document(app: FastAPI) -> dict[str, Any]:
    document = get_openapi(
        title=app.title,
        version=app.version,
        summary=app.summary,
        description=app.description,
        routes=app.routes,
    )
    schemas = document["components"]["schemas"]
    schemas[Problem.__name__] = Problem.model_json_schema()
    return document
