"""`rbfrag serve`: HTTP API and web interface."""

from __future__ import annotations

import importlib.util
import json
import os
from runpy import run_module

from rbfrag.cli import options
from rbfrag.cli.command import option
from rbfrag.errors import MissingExtraError

EXAMPLE = "Example:  rbfrag serve --db rbfrag.db --port 8000"


def serve(
    *,
    db: options.Db = None,
    host: str = option("Listening address; a token is required except for loopback", "127.0.0.1"),
    port: int = option("Listening port, 0 for any free port", 8000),
    workers: int = option("Number of answering processes", 1),
    token_file: str | None = option(
        "File with the bearer token required in requests [default: RBFRAG_TOKEN]",
        metavar="FILE",
    ),
    allow_origin: list[str] | None = option(
        "Origin of another web page allowed to use the service (CORS), such as "
        "https://maps.example.org; repeatable",
        metavar="ORIGIN",
    ),
    allow_host: list[str] | None = option(
        "Host name accepted in addition to localhost by a service without a token; repeatable",
        metavar="NAME",
    ),
    body_limit_mb: float = option("Maximum size of a request body [MB]", 16.0),
    body_time: float = option("Maximum time to receive a request body [s]", 30.0),
    row_limit: int = option("Maximum number of blocks or realisations per request", 100_000),
    time_limit: float = option("Maximum time of an answer [s]", 60.0),
    jobs: int = option("Number of processes for long computations per answering process", 2),
) -> None:
    """Start the HTTP API and the web interface.

    The answers are those of the command line.
    """
    for library in ("fastapi", "uvicorn", "httptools", "pebble", "prometheus_client"):
        if importlib.util.find_spec(library) is None:
            raise MissingExtraError(f"The service requires {library}", "service")
    # The service is no part of the command line: it is a program of its own.
    os.environ["RBFRAG_SERVICE"] = json.dumps(
        {
            "db": db,
            "host": host,
            "port": port,
            "workers": workers,
            "token_file": token_file,
            "allow_origin": allow_origin or [],
            "allow_host": allow_host or [],
            "body_limit_mb": body_limit_mb,
            "body_time": body_time,
            "row_limit": row_limit,
            "time_limit": time_limit,
            "jobs": jobs,
        }
    )
    run_module("rbfrag.service", run_name="__main__")
