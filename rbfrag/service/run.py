"""Running the service in one process or several."""

from __future__ import annotations

import json
import logging
import os
import socket
from dataclasses import dataclass
from tempfile import TemporaryDirectory

from fastapi import FastAPI
from uvicorn.supervisors import Multiprocess

from rbfrag.errors import InputError
from rbfrag.service.settings import Settings, check_reach, is_loopback, read_token


class Workers(Multiprocess):
    """Processes of uvicorn that end together."""

    def terminate_all(self) -> None:
        """Tell every process to end.

        Nobody may connect any more: this process holds the address too, and what it let in
        nobody would answer.
        """
        for listener in self.sockets:
            listener.close()
        super().terminate_all()


VARIABLE = "RBFRAG_SERVICE"
"""Environment variable in which the service, and each of its processes, finds its options."""


@dataclass(frozen=True)
class ServeOptions:
    """What `rbfrag serve` passes on to the service; its options say what each means."""

    db: str | None = None
    host: str = "127.0.0.1"
    port: int = 8000
    workers: int = 1
    token_file: str | None = None
    allow_origin: tuple[str, ...] = ()
    allow_host: tuple[str, ...] = ()
    body_limit_mb: float = 16.0
    body_time: float = 30.0
    row_limit: int = 100_000
    time_limit: float = 60.0
    jobs: int = 2

    def settings(self) -> Settings:
        """Return the settings of the application."""
        token = read_token(self.token_file)
        check_reach(self.host, token)
        if self.workers < 1:
            raise InputError(f"--workers {self.workers}: at least one process answers")
        if not 0 <= self.port <= 65535:
            raise InputError(f"--port {self.port}: a port is a number from 0 to 65535")
        for name, value in (
            ("--body-limit-mb", self.body_limit_mb),
            ("--body-time", self.body_time),
            ("--row-limit", self.row_limit),
            ("--time-limit", self.time_limit),
            ("--jobs", self.jobs),
        ):
            if not 0.0 < value < float("inf"):
                raise InputError(f"{name} {value:g}: give a number above zero")
        hosts = self.allow_host
        if token is None and is_loopback(self.host):
            # else a web page could ask by a name of its own that leads to this computer
            hosts = ("localhost", "127.0.0.1", "[::1]", self.host, *hosts)
        return Settings(
            db=self.db,
            token=token,
            allowed_origins=self.allow_origin,
            allowed_hosts=hosts,
            body_limit_bytes=int(1e6 * self.body_limit_mb),
            body_time_s=self.body_time,
            row_limit=self.row_limit,
            time_limit_s=self.time_limit,
            jobs=self.jobs,
            early=True,
        )


def serve() -> None:
    """Answer requests until the process is stopped, as the environment says."""
    chosen = _options()
    settings = chosen.settings()
    import uvicorn

    from rbfrag.service.protocol import BoundedProtocol
    from rbfrag.service.request_records import CONFIGURATION, SHARED_FOLDER

    with TemporaryDirectory(prefix="rbfrag-metrics-") as folder:
        if chosen.workers > 1:
            os.environ[SHARED_FOLDER] = folder
        config = uvicorn.Config(
            f"{__name__}:app",
            factory=True,
            interface="asgi3",
            http=BoundedProtocol,
            ws="none",
            host=chosen.host,
            port=chosen.port,
            workers=chosen.workers,
            log_config=CONFIGURATION,
            access_log=False,
            server_header=False,
            proxy_headers=False,
            limit_concurrency=2000,
            timeout_graceful_shutdown=int(settings.body_time_s + settings.time_limit_s) + 1,
        )
        with listener(chosen.host, chosen.port) as found:
            name, port = found.getsockname()[:2]
            shown = f"[{name}]" if ":" in name else name
            logging.getLogger(__name__).info("answering at http://%s:%d", shown, port)
            if chosen.workers == 1:
                uvicorn.Server(config).run(sockets=[found])
            else:
                Workers(config, sockets=[found]).run()


def listener(host: str, port: int) -> socket.socket:
    """Return a socket that listens.

    Args:
        host: address to listen at.
        port: port to listen at; 0 for any that is free.
    """
    try:
        family = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0][0]
        found = socket.create_server((host, port), family=family, backlog=2048)
    except OSError as error:
        reason = (error.strerror or str(error)).partition(" (")[0]
        raise InputError(
            f"--host {host} --port {port}: {reason}: choose another port or address"
        ) from None
    found.set_inheritable(True)
    # Head and body of an answer leave in two packets, and the connections inherit this: without it
    # the second waits for word of the first, which a client may keep back for 40 ms.
    found.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    return found


def app() -> FastAPI:
    """Return the application that the environment describes."""
    from rbfrag.service.app import make_app

    return make_app(_options().settings())


def _options() -> ServeOptions:
    try:
        chosen = ServeOptions(**json.loads(os.environ.get(VARIABLE, "{}")))
    except (ValueError, TypeError) as error:
        raise InputError(f"{VARIABLE} cannot be read ({error}): start with  rbfrag serve") from None
    return chosen
