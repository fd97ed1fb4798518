"""How soon a service says that it lives while it is attacked:  python -m benchmarks.service_attacks

While each attack goes on, one client asks `GET /v1/healthz` over and over, each time anew.
With `--server URL` (PostgreSQL) a locked table of a server is among the attacks.
"""

from __future__ import annotations

import http.client
import os
import socket
import sqlite3
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, closing, contextmanager
from pathlib import Path

import numpy as np

from benchmarks.page import ROOT, markdown, parser, report
from benchmarks.running_service import Running, running_service
from rbfrag.service.work import EXAMPLE as RECORD

PAGE = ROOT / "docs" / "howto" / "service.md"
QUESTION = "/v1/predict?p2=3&kr=0.1&pgv=0.6"
TIME_LIMIT_S = 60.0


def ask(running: Running, method: str, path: str, body: bytes | None = None, **headers: str) -> int:
    """Return the status of an answer; 0 where the connection ended without one."""
    with closing(http.client.HTTPConnection("127.0.0.1", running.port, timeout=120)) as wire:
        try:
            wire.request(method, path, body, headers)
            answer = wire.getresponse()
            answer.read()
        except OSError:
            return 0
        return answer.status


@contextmanager
def repeated(
    running: Running, method: str, path: str, body: bytes | None = None, **headers: str
) -> Iterator[None]:
    """Send one request again and again meanwhile."""
    end = threading.Event()

    def send() -> None:
        while not end.is_set():
            ask(running, method, path, body, **headers)

    thread = threading.Thread(target=send)
    thread.start()
    try:
        yield
    finally:
        end.set()
        thread.join(180)


@contextmanager
def nothing(running: Running) -> Iterator[None]:
    """Leave the service alone."""
    assert ask(running, "GET", QUESTION) == 200
    yield


@contextmanager
def locked_file(running: Running) -> Iterator[None]:
    """Hold the SQLite file of the models, which are asked for."""
    place = next(running.log.parent.glob("*.db"))
    with closing(sqlite3.connect(place, isolation_level=None)) as other:
        other.execute("PRAGMA journal_mode = DELETE")
        other.execute("BEGIN EXCLUSIVE")
        os.utime(place)  # the models are to be read again
        with repeated(running, "GET", QUESTION):
            yield
            other.execute("ROLLBACK")


BODY = b'{"p2": 3, "kr": 0.1, "pgv": 0.6}'


@contextmanager
def unfinished(running: Running, count: int, declared: int, sent: int) -> Iterator[None]:
    """Promise bodies [bytes] and send a part of them."""
    head = b"POST /v1/predict HTTP/1.1\r\nhost: localhost\r\ncontent-length: %d\r\n\r\n"
    with ExitStack() as wires:
        for _ in range(count):
            wire = wires.enter_context(socket.create_connection(("127.0.0.1", running.port), 60))
            wire.sendall(head % declared + b" " * sent)
        yield


@contextmanager
def idle_bodies(running: Running) -> Iterator[None]:
    """Promise 40 bodies of 1000 bytes and send none, while somebody asks honestly."""
    with (
        unfinished(running, 40, 1000, 0),
        repeated(running, "POST", "/v1/predict", BODY),
    ):
        yield


def beside_half_sent(running: Running, rounds: int = 20) -> np.ndarray:
    """Return how long a POST of 240 kB took [s], each beside 32 bodies of which 64 kB came."""
    took = []
    for _ in range(rounds):
        with unfinished(running, 32, 128_000, 66_000):
            time.sleep(0.2)
            began = time.perf_counter()
            assert ask(running, "POST", "/v1/predict", b" " * 240_000 + BODY) == 200
            took.append(time.perf_counter() - began)
    return np.array(took)


ATTACKS: dict[str, Callable[[Running], AbstractContextManager[None]]] = {
    "none": nothing,
    "the SQLite file is locked": locked_file,
    "15 MB of nested arrays": lambda running: repeated(
        running, "POST", "/v1/predict", b"[" * 15_000_000
    ),
    "15 MB of empty arrays": lambda running: repeated(
        running, "POST", "/v1/predict", b'{"p2": [' + b"[]," * 4_900_000 + b"[]]}"
    ),
    "40 idle bodies": idle_bodies,
    "200 kB of dotted TOML keys": lambda running: repeated(
        running,
        "POST",
        "/v1/rockmass",
        b".".join([b"a"] * 100_000) + b" = 1\n",
        **{"content-type": "application/toml"},
    ),
    "uploads of records": lambda running: repeated(
        running, "POST", "/v1/spectrum?p2=3", RECORD.encode()
    ),
}


@contextmanager
def locked_table(running: Running, server: str) -> Iterator[None]:
    """Hold the models' table of a server, which is asked for."""
    import psycopg

    with psycopg.connect(server) as other:
        other.execute("LOCK TABLE fragility_model IN ACCESS EXCLUSIVE MODE")
        with repeated(running, "GET", QUESTION):
            yield
            other.rollback()


def measured(running: Running, seconds: float) -> np.ndarray:
    """Return how long each answer of the service's health took [s]."""
    took, end = [], time.monotonic() + seconds
    while time.monotonic() < end:
        began = time.perf_counter()
        assert ask(running, "GET", "/v1/healthz") == 200
        took.append(time.perf_counter() - began)
        time.sleep(0.01)
    return np.array(took)


def row(name: str, took: np.ndarray) -> list[str]:
    """Return a line of the table."""
    p50, p99 = np.quantile(took, (0.5, 0.99))
    return [name, str(took.size), *(f"{1e3 * value:.1f} ms" for value in (p50, p99, took.max()))]


def on_server(server: str, folder: Path, seconds: float) -> list[str]:
    """Measure while a table of a server is locked, in a schema that is dropped afterwards."""
    import psycopg

    from rbfrag.db.engine import opened_database
    from rbfrag.db.location import reference_file
    from rbfrag.db.model_file import read_models
    from rbfrag.db.models import save_model

    with psycopg.connect(server, autocommit=True) as admin:
        admin.execute("DROP SCHEMA IF EXISTS rbfrag_attacked CASCADE")
        admin.execute("CREATE SCHEMA rbfrag_attacked")
        place = f"{server}?options=-csearch_path%3Drbfrag_attacked"
        try:
            with opened_database(place, create=True) as engine, engine.begin() as connection:
                for model in read_models(reference_file()):
                    if model.kind == "toppling":
                        save_model(connection, model)
            with running_service(folder, db=place, time_limit=TIME_LIMIT_S) as running:
                assert ask(running, "GET", QUESTION) == 200
                with locked_table(running, place):
                    return row("a table of PostgreSQL is locked", measured(running, seconds))
        finally:
            admin.execute("DROP SCHEMA rbfrag_attacked CASCADE")


def main() -> int:
    """Measure each attack; the exit status is 1 if one keeps the service silent for 0.5 s."""
    options = parser(__doc__)
    options.add_argument("--seconds", type=float, default=20.0, help="length of each attack")
    options.add_argument("--server", help="PostgreSQL URL")
    chosen = options.parse_args()
    rows, slow = [], 0
    with tempfile.TemporaryDirectory() as folder:
        with running_service(Path(folder), time_limit=TIME_LIMIT_S) as running:
            while ask(running, "POST", "/v1/spectrum?p2=3", RECORD.encode()) != 200:
                time.sleep(1.0)
            for name, attack in ATTACKS.items():
                with attack(running):
                    time.sleep(0.5)
                    took = measured(running, chosen.seconds)
                rows.append(row(name, took))
                slow += bool(np.quantile(took, 0.99) > 0.5)
                print(*rows[-1], sep="  ", flush=True)
            rows.append(
                row("32 half-sent bodies of 64 kB: a POST of 240 kB", beside_half_sent(running))
            )
            print(*rows[-1], sep="  ", flush=True)
        if chosen.server:
            rows.append(on_server(chosen.server, Path(folder), chosen.seconds))
    head = ["meanwhile", "answers", "p50", "p99", "longest"]
    report("attacks", markdown((head, rows)), write=chosen.write, page=PAGE)
    return int(slow > 0)


if __name__ == "__main__":
    raise SystemExit(main())
