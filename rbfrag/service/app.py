"""The application: every operation, the page, and what becomes of errors."""

from __future__ import annotations

from http import HTTPStatus
from typing import Any

from fastapi import FastAPI, HTTPException, Request, Response
from fastapi.openapi.utils import get_openapi

from rbfrag.errors import RbfragError
from rbfrag.service import block_api, drawing_api, health_api, models_api, predict_api
from rbfrag.service.documents import Problem
from rbfrag.service.page_files import PageFiles
from rbfrag.service.problem import problem, refused
from rbfrag.service.settings import Settings
from rbfrag.version import __version__


def make_app(settings: Settings) -> FastAPI:
    """Return the application.

    Args:
        settings: what it reads, whom it answers and how much it takes on.
    """
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
    )
    app.include_router(predict_api.router(settings))
    app.include_router(block_api.router())
    app.include_router(drawing_api.router())
    app.include_router(models_api.router(settings))
    app.include_router(health_api.router())
    app.mount("/", PageFiles(), name="page")

    @app.exception_handler(RbfragError)
    async def on_purpose(request: Request, error: RbfragError) -> Response:  # noqa: ARG001
        return refused(error, settings)

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

    def openapi() -> dict[str, Any]:
        if app.openapi_schema is None:
            app.openapi_schema = _document(app)
        return app.openapi_schema

    app.openapi = openapi  # type: ignore[method-assign]
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
