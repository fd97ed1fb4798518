"""The application: every operation, the page, and what becomes of errors."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from http import HTTPStatus
from pathlib import Path
from typing import Any

from fastapi import FastAPI, HTTPException, Request, Response
from fastapi.concurrency import run_in_threadpool
from fastapi.middleware.cors import CORSMiddleware
from fastapi.openapi.utils import get_openapi
from fastapi.staticfiles import StaticFiles

from rbfrag.errors import RbfragError
from rbfrag.service import work
from rbfrag.service.body import Bodies
from rbfrag.service.documents import Problem
from rbfrag.service.guard import Guard
from rbfrag.service.problem import problem, refused
from rbfrag.service.request_records import Metrics, RequestLog
from rbfrag.service.routes import block, hazard, motion, predict, rockmass, stored
from rbfrag.service.settings import Settings
from rbfrag.service.work import WorkerPool
from rbfrag.version import __version__

FOLDER = Path(__file__).parent / "page"

HEADERS = {
    # Scripts, styles and answers come from this service alone, and none stands in the document.
    "Content-Security-Policy": "; ".join(
        (
            "default-src 'none'",
            "script-src 'self'",
            "style-src 'self'",
            "img-src 'self'",
            "connect-src 'self'",
            "base-uri 'none'",
            "form-action 'none'",
            "frame-ancestors 'none'",
        )
    ),
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    # After an update no old module meets a new one; unchanged files are answered in a word.
    "Cache-Control": "no-cache",
}


class PageFiles(StaticFiles):
    """What the browser loads; `/` is the page itself."""

    def __init__(self) -> None:
        super().__init__(directory=FOLDER, html=True)

    async def get_response(self, path: str, scope: Any) -> Response:
        """Return a file with the headers of the page."""
        response = await super().get_response(path, scope)
        response.headers.update(HEADERS)
        return response


def make_app(settings: Settings) -> FastAPI:
    """Return the application."""
    bodies = Bodies(settings)
    pool = WorkerPool(settings.jobs, settings.time_limit_s)

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:  # noqa: ARG001
        if settings.early:
            pool.open().schedule(work.warm_up)
        yield
        await run_in_threadpool(pool.close)

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
        predict.router(settings, bodies, pool),
        block.router(),
        rockmass.router(settings, bodies, pool),
        motion.router(bodies, pool),
        hazard.router(settings, bodies, pool),
        stored.router(settings),
    ):
        # one flat list: looking through routers in routers takes longer than an answer
        app.router.routes.extend(each.routes)
    document = _document(app)
    app.openapi = lambda: document  # type: ignore[method-assign]
    counts = Metrics([*document["paths"], "/v1/metrics", "/v1/openapi.json"])
    app.router.routes.extend(stored.metrics_router(counts).routes)
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
