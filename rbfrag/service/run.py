"""Running the service in one process or several."""

from __future__ import annotations

import json
import os
from typing import Any

from fastapi import FastAPI

from rbfrag.errors import InputError
from rbfrag.service.settings import Settings

VARIABLE = "RBFRAG_SERVICE"
"""Environment variable in which the service, and each of its processes, finds what it is told."""


def serve_as_told() -> None:
    """Answer requests until the process is told to stop, as the environment says.

    Raises:
        InputError: the environment does not say how.
    """
    told = _told()
    serve(
        host=told.get("host", "127.0.0.1"),
        port=told.get("port", 8000),
        workers=told.get("workers", 1),
    )


def serve(*, host: str, port: int, workers: int) -> None:
    """Answer requests until the process is told to stop.

    Args:
        host: address to listen at.
        port: port to listen at; 0 for any that is free.
        workers: number of processes that answer.

    Raises:
        InputError: no port, or no worker.
    """
    if workers < 1:
        raise InputError(f"--workers {workers}: at least one process answers")
    if not 0 <= port <= 65535:
        raise InputError(f"--port {port}: a port is a number from 0 to 65535")
    import uvicorn

    uvicorn.run(
        f"{__name__}:app",
        factory=True,
        interface="asgi3",
        host=host,
        port=port,
        workers=workers,
        ws="none",
        access_log=False,
        server_header=False,
        proxy_headers=False,
    )


def app() -> FastAPI:
    """Return the application that the environment describes."""
    from rbfrag.service.app import make_app

    return make_app(Settings(db=_told().get("db")))


def _told() -> dict[str, Any]:
    try:
        told = json.loads(os.environ.get(VARIABLE, "{}"))
    except ValueError as error:
        raise InputError(f"{VARIABLE} is not JSON ({error}): start with  rbfrag serve") from None
    if not isinstance(told, dict):
        raise InputError(f"{VARIABLE} is not a JSON object: start with  rbfrag serve")
    return told
