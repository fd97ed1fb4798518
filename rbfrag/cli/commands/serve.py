"""`rbfrag serve`: the answers over HTTP."""

from __future__ import annotations

import importlib.util
import json
import os
from runpy import run_module
from typing import Annotated

import typer

from rbfrag.cli.parameters import options
from rbfrag.errors import MissingExtraError

EXAMPLE = "Example:  rbfrag serve --db rbfrag.db --port 8000"


def serve(
    db: options.Db = None,
    host: Annotated[
        str, typer.Option("--host", help="Address to listen at; any but loopback needs a token.")
    ] = "127.0.0.1",
    port: Annotated[
        int, typer.Option("--port", help="Port to listen at; 0 for any that is free.")
    ] = 8000,
    workers: Annotated[int, typer.Option("--workers", help="Number of processes that answer.")] = 1,
    token_file: Annotated[
        str | None,
        typer.Option(
            "--token-file",
            metavar="FILE",
            help="File with the bearer token that requests must bring. Default: RBFRAG_TOKEN.",
        ),
    ] = None,
    allow_origin: Annotated[
        list[str] | None,
        typer.Option(
            "--allow-origin",
            metavar="ORIGIN",
            help="Web page elsewhere whose scripts may read answers, such as "
            "https://maps.example.org; may be repeated.",
        ),
    ] = None,
    allow_host: Annotated[
        list[str] | None,
        typer.Option(
            "--allow-host",
            metavar="NAME",
            help="Name, beside localhost, that a service without a token may be asked by; may be "
            "repeated.",
        ),
    ] = None,
    body_limit_mb: Annotated[
        float, typer.Option("--body-limit-mb", help="Longest body of a request [MB].")
    ] = 16.0,
    body_time: Annotated[
        float, typer.Option("--body-time", help="Longest time that a body may take to come [s].")
    ] = 30.0,
    row_limit: Annotated[
        int, typer.Option("--row-limit", help="Most blocks or realisations of one request.")
    ] = 100_000,
    time_limit: Annotated[
        float, typer.Option("--time-limit", help="Longest time that an answer may take [s].")
    ] = 60.0,
    jobs: Annotated[
        int,
        typer.Option(
            "--jobs", help="Number of processes that do long work beside each that answers."
        ),
    ] = 2,
) -> None:
    """Answer over HTTP what the command line answers, and serve the page."""
    for library in ("fastapi", "uvicorn", "httptools", "pebble", "prometheus_client"):
        if importlib.util.find_spec(library) is None:
            raise MissingExtraError(f"The service needs {library}", "service")
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
