"""Running the service in one process or several."""

from __future__ import annotations

import json
import os
from dataclasses import asdict

from fastapi import FastAPI

from rbfrag.service.settings import Settings

VARIABLE = "RBFRAG_SERVICE"
"""Environment variable in which the processes that answer find their settings."""


def serve(settings: Settings, *, host: str, port: int, workers: int) -> None:
    """Answer requests until the process is told to stop.

    Args:
        settings: those of the application.
        host: address to listen at.
        port: port to listen at; 0 for any that is free.
        workers: number of processes that answer.
    """
    import uvicorn

    os.environ[VARIABLE] = json.dumps(asdict(settings))
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
    """Return the application of a process that `serve` started."""
    from rbfrag.service.app import make_app

    stated = json.loads(os.environ[VARIABLE])
    return make_app(Settings(**{**stated, "allowed_origins": tuple(stated["allowed_origins"])}))
