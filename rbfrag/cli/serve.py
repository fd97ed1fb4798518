"""`rbfrag serve`: the answers over HTTP."""

from __future__ import annotations

import importlib.util
import json
import os
from runpy import run_module
from typing import Annotated

import typer

from rbfrag.cli import options
from rbfrag.errors import MissingExtraError

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
    # The service is no part of the command line: it is a program of its own.
    os.environ["RBFRAG_SERVICE"] = json.dumps(
        {"db": db, "host": host, "port": port, "workers": workers}
    )
    run_module("rbfrag.service", run_name="__main__")
