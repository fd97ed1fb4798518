"""`rbfrag serve`: the answers over HTTP."""

from __future__ import annotations

import importlib.util
from typing import Annotated

import typer

from rbfrag.cli import options
from rbfrag.errors import InputError, MissingExtraError

EXAMPLE = "Example:  rbfrag serve --db rbfrag.db --port 8000"


def serve(
    db: options.Db = None,
    host: Annotated[str, typer.Option("--host", help="Address to listen at.")] = "127.0.0.1",
    port: Annotated[int, typer.Option("--port", help="Port to listen at.")] = 8000,
    workers: Annotated[int, typer.Option("--workers", help="Number of processes that answer.")] = 1,
) -> None:
    """Answer over HTTP what the command line answers, and serve the page."""
    for library in ("fastapi", "uvicorn"):
        if importlib.util.find_spec(library) is None:
            raise MissingExtraError(f"The service needs {library}", "service")
    if workers < 1:
        raise InputError(f"--workers {workers}: at least one process answers")
    if not 0 <= port <= 65535:
        raise InputError(f"--port {port}: a port is a number from 0 to 65535")
    from rbfrag.service.run import serve as run
    from rbfrag.service.settings import Settings

    run(Settings(db=db), host=host, port=port, workers=workers)
