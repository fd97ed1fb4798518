"""`rbfrag serve`: the answers over HTTP."""

from __future__ import annotations

import importlib.util
import json
import os
from dataclasses import asdict, dataclass
from runpy import run_module

from rbfrag.cli.parameters import options
from rbfrag.cli.parameters.stack import option, stacked
from rbfrag.errors import MissingExtraError

EXAMPLE = "Example:  rbfrag serve --db rbfrag.db --port 8000"


@dataclass(frozen=True, kw_only=True)
class RequestLimits:
    """What a request may take."""

    body_limit_mb: float = option("Longest body of a request [MB].", 16.0)
    body_time: float = option("Longest time that a body may take to come [s].", 30.0)
    row_limit: int = option("Most blocks or realisations of one request.", 100_000)
    time_limit: float = option("Longest time that an answer may take [s].", 60.0)
    jobs: int = option("Number of processes that do long work beside each that answers.", 2)


@stacked
def serve(
    *,
    limits: RequestLimits,
    db: options.Db = None,
    host: str = option("Address to listen at; any but loopback needs a token.", "127.0.0.1"),
    port: int = option("Port to listen at; 0 for any that is free.", 8000),
    workers: int = option("Number of processes that answer.", 1),
    token_file: str | None = option(
        "File with the bearer token that requests must bring. Default: RBFRAG_TOKEN.",
        metavar="FILE",
    ),
    allow_origin: list[str] | None = option(
        "Web page elsewhere whose scripts may read answers, such as "
        "https://maps.example.org; may be repeated.",
        metavar="ORIGIN",
    ),
    allow_host: list[str] | None = option(
        "Name, beside localhost, that a service without a token may be asked by; may be repeated.",
        metavar="NAME",
    ),
) -> None:
    """Answer over HTTP, and serve the page.

    The answers are those of the command line."""
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
            **asdict(limits),
        }
    )
    run_module("rbfrag.service", run_name="__main__")
