"""A service in processes of its own, for those who ask it."""

from __future__ import annotations

import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import time
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rbfrag.db.location import REFERENCE

ROOT = Path(__file__).resolve().parent.parent

PATIENCE_S = 60.0


@dataclass(frozen=True)
class Running:
    """A service that answers.

    Args:
        process: its first process.
        port: where it listens.
        log: what it writes down.
    """

    process: subprocess.Popen[bytes]
    port: int
    log: Path

    @property
    def address(self) -> str:
        """The address that paths are appended to."""
        return f"http://127.0.0.1:{self.port}"

    def terminate(self) -> int:
        """End it as a service manager does; return its exit status."""
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGTERM)
        return self.process.wait(PATIENCE_S)

    def lines(self) -> list[dict[str, Any]]:
        """Return the lines of its log.

        Raises:
            ValueError: a line is no JSON object; with the line and what follows.
        """
        written, read = self.log.read_text().splitlines(), []
        for number, line in enumerate(written):
            if not line.startswith("{"):
                raise ValueError("\n".join(["not JSON:", *written[number : number + 40]]))
            read.append(json.loads(line))
        return read


def free_port() -> int:
    """Return a port that nobody listens at."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
        return port


@contextmanager
def running_service(
    folder: Path, *, environment: dict[str, str] | None = None, **options: Any
) -> Iterator[Running]:
    """Start a service on the models that are shipped, and end it.

    Args:
        folder: where its log and its database go.
        environment: further environment variables.
        options: options of `rbfrag serve`, underlines for dashes.
    """
    port = free_port()
    # a copy: the shipped one may be made anew meanwhile
    database = shutil.copyfile(REFERENCE, folder / "models.db")
    settings = {"db": str(database), "port": port, **options}
    with running_program(
        ["-m", "rbfrag.service"],
        folder / "service.log",
        f"http://127.0.0.1:{port}/v1/healthz",
        {"RBFRAG_SERVICE": json.dumps(settings), **(environment or {})},
    ) as process:
        yield Running(process, port, folder / "service.log")


@contextmanager
def running_program(
    words: list[str], log: Path, url: str, environment: dict[str, str]
) -> Iterator[subprocess.Popen[bytes]]:
    """Start a Python program that answers at an address, and end it.

    Args:
        words: what Python is called with.
        log: file for what it prints.
        url: address that answers once it is ready.
        environment: further environment variables.
    """
    everything = {**os.environ, "PYTHONPATH": str(ROOT), **environment}
    with log.open("wb") as stream:
        process = subprocess.Popen(
            [sys.executable, *words], cwd=ROOT, env=everything, stdout=stream, stderr=stream
        )
        try:
            _wait(process, url, log)
            yield process
        finally:
            if process.poll() is None:
                process.terminate()
            process.wait(PATIENCE_S)


def _wait(process: subprocess.Popen[bytes], url: str, log: Path) -> None:
    end = time.monotonic() + PATIENCE_S
    while time.monotonic() < end:
        if process.poll() is not None:
            raise RuntimeError(f"the program ended at its start: {log.read_text()}")
        try:
            with urllib.request.urlopen(url, timeout=5.0):
                return
        except OSError:
            time.sleep(0.1)
    raise RuntimeError(f"nothing answers at {url}: {log.read_text()}")
