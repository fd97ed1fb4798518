"""The web application: operations, web page and error handling."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

from fastapi import FastAPI, Request, Response
from fastapi.concurrency import run_in_threadpool
from fastapi.middleware.cors import CORSMiddleware
from fastapi.staticfiles import StaticFiles
from starlette.exceptions import HTTPException

from rbfrag.errors import RbfragError
from rbfrag.fragility.model_selection import ModelList, stored_rows
from rbfrag.service import operations, predict, work
from rbfrag.service.documents import Health, ModelListed
from rbfrag.service.guard import CONTENT_TYPE, Guard, Metrics
from rbfrag.service.problem import answer_error, documented
from rbfrag.service.reading import Bodies, QueryRoute
from rbfrag.service.settings import ServiceSettings
from rbfrag.service.work import WorkerPool
from rbfrag.solver.kinds import KINDS
from rbfrag.solver.models import model_of_kind
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
    """Static files of the web page; `/` is the page itself."""

    def __init__(self) -> None:
        super().__init__(directory=FOLDER, html=True)

    async def get_response(self, path: str, scope: Any) -> Response:
        """Return a file with the headers of the page."""
        response = await super().get_response(path, scope)
        response.headers.update(HEADERS)
        return response


def make_app(settings: ServiceSettings) -> FastAPI:
    """Return the web application."""
    pool = WorkerPool(settings.jobs, settings.time_limit)

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:  # noqa: ARG001
        if settings.early:
            pool.open().schedule(work.warm_up)
            # so that the first block of a page does not wait for its libraries
            loading = asyncio.ensure_future(asyncio.to_thread(lambda: [*map(model_of_kind, KINDS)]))
        yield
        if settings.early:
            await loading
        await run_in_threadpool(pool.close)

    async def on_error(request: Request, error: Exception) -> Response:
        return answer_error(request, error, settings)

    errors = (RbfragError, HTTPException, Exception)
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
        exception_handlers=dict.fromkeys(errors, on_error),
    )
    app.state.bodies = Bodies(settings)
    # straight to the application: a router that is included takes 10 µs more to find its route
    app.router.route_class = QueryRoute
    predict.add_routes(app.router, settings, pool)
    operations.add_routes(app.router, settings, pool)

    @app.get(
        "/v1/models",
        summary="Fitted models",
        response_model=list[ModelListed],
        responses=documented(401, 503),
    )
    async def models() -> Any:
        """Return what `rbfrag models list` prints as JSON.

        Where the service was given no database and there is none, these are the models that are
        shipped with rbfrag.
        """
        # read again each time, and from a server if there is one
        rows = await work.in_thread(settings.time_limit, stored_rows, settings.db)
        return ModelList(rows).as_dict()

    @app.get("/v1/healthz", summary="State of the service", response_model=Health)
    async def healthz() -> Any:
        """Return the version; this operation asks for no token."""
        return {"status": "ok", "version": __version__}

    counts = Metrics([*app.openapi()["paths"], "/v1/metrics", "/v1/openapi.json"])

    @app.get("/v1/metrics", include_in_schema=False)
    async def metrics() -> Response:
        """Return counts for Prometheus."""
        return Response(counts.text(), headers={"content-type": CONTENT_TYPE})

    app.mount("/", PageFiles(), name="page")
    app.add_middleware(Guard, settings=settings, metrics=counts)
    if settings.allow_origin:
        app.add_middleware(
            CORSMiddleware,
            allow_origins=settings.allow_origin,
            allow_methods=["GET", "POST"],
            allow_headers=["Authorization", "Content-Type"],
        )
    return app
