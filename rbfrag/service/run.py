"""Running the service in one or several processes."""

from __future__ import annotations

import json
import logging
import os
import socket
from tempfile import TemporaryDirectory

from fastapi import FastAPI
from uvicorn.supervisors import Multiprocess

from rbfrag.errors import InputError
from rbfrag.service.settings import ServiceSettings


class Workers(Multiprocess):
    """Processes of uvicorn that terminate together."""

    def terminate_all(self) -> None:
        """Terminate every process.

        Nobody may connect any more: this process holds the address too, and what it let in
        nobody would answer.
        """
        for listener in self.sockets:
            listener.close()
        super().terminate_all()


VARIABLE = "RBFRAG_SERVICE"
"""Environment variable in which the service, and each of its processes, finds its options."""


def serve() -> None:
    """Answer requests until the process is stopped, with settings from the environment."""
    import uvicorn

    from rbfrag.service.guard import CONFIGURATION, SHARED_FOLDER
    from rbfrag.service.protocol import LingeringProtocol

    chosen = _settings()
    with TemporaryDirectory(prefix="rbfrag-metrics-") as folder:
        if chosen.workers > 1:
            os.environ[SHARED_FOLDER] = folder
        config = uvicorn.Config(
            f"{__name__}:app",
            factory=True,
            interface="asgi3",
            http=LingeringProtocol,
            ws="none",
            host=chosen.host,
            port=chosen.port,
            workers=chosen.workers,
            log_config=CONFIGURATION,
            access_log=False,
            server_header=False,
            proxy_headers=False,
            limit_concurrency=2000,
            timeout_graceful_shutdown=int(chosen.body_time + chosen.time_limit) + 1,
        )
        with listener(chosen.host, chosen.port) as listening:
            name, port = listening.getsockname()[:2]
            shown = f"[{name}]" if ":" in name else name
            logging.getLogger(__name__).info("answering at http://%s:%d", shown, port)
            if chosen.workers == 1:
                uvicorn.Server(config).run(sockets=[listening])
            else:
                Workers(config, sockets=[listening]).run()


def listener(host: str, port: int) -> socket.socket:
    """Return a listening socket.

    Args:
        host: address to listen at.
        port: port to listen at; 0 for any that is free.
    """
    try:
        family = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0][0]
        listening = socket.create_server((host, port), family=family, backlog=2048)
    except OSError as error:
        reason = (error.strerror or str(error)).partition(" (")[0]
        raise InputError(
            f"host {host} port {port}: {reason}: choose another address",
            fields=("host", "port"),
        ) from None
    listening.set_inheritable(True)
    # Head and body of an answer leave in two packets, and the connections inherit this: without it
    # the second waits for word of the first, which a client may keep back for 40 ms.
    listening.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    return listening


def app() -> FastAPI:
    """Return the web application with settings from the environment."""
    from rbfrag.service.app import make_app
    from rbfrag.service.guard import log_as_json

    log_as_json()
    return make_app(_settings())


def _settings() -> ServiceSettings:
    try:
        chosen = ServiceSettings(**json.loads(os.environ.get(VARIABLE, "{}")))
    except (ValueError, TypeError) as error:
        raise InputError(
            f"invalid {VARIABLE} ({error}): start the service with  rbfrag serve"
        ) from None
    return chosen.checked()
