"""Headers that are too long, and counts of several processes together."""

import socket
import threading
import urllib.request
from contextlib import contextmanager

import pytest
import uvicorn

from benchmarks.running_service import running_service
from rbfrag.service import protocol


async def hello(scope, receive, send):
    await send({"type": "http.response.start", "status": 200, "headers": []})
    await send({"type": "http.response.body", "body": b"hello"})


@contextmanager
def serving():
    """Port of a server in a thread."""
    with socket.create_server(("127.0.0.1", 0)) as listener:
        config = uvicorn.Config(
            hello, http=protocol.LingeringProtocol, lifespan="off", log_config=None
        )
        server = uvicorn.Server(config)
        thread = threading.Thread(target=server.run, args=([listener],))
        thread.start()
        try:
            yield listener.getsockname()[1]
        finally:
            server.should_exit = True
            thread.join(30)


def test_headers_that_are_too_long_are_rejected():
    with serving() as port, socket.create_connection(("127.0.0.1", port), 20) as wire:
        wire.sendall(b"GET / HTTP/1.1\r\nx: " + b"y" * (protocol.HEADERS_BYTES + 1))
        answer = wire.makefile("rb").read()
    assert answer.startswith(b"HTTP/1.1 431 ")


def test_headers_that_come_in_time_are_answered():
    with serving() as port:
        for _ in range(3):
            with urllib.request.urlopen(f"http://127.0.0.1:{port}/") as answer:
                assert answer.read() == b"hello"


def test_processes_are_counted_together(tmp_path):
    with running_service(tmp_path, workers=2, jobs=1) as running:
        for _ in range(30):
            with urllib.request.urlopen(f"{running.address}/v1/models") as answer:
                answer.read()
        with urllib.request.urlopen(f"{running.address}/v1/metrics") as answer:
            text = answer.read().decode()
    assert 'rbfrag_requests_total{method="GET",operation="/v1/models",status="200"} 30.0' in text


@pytest.mark.parametrize(
    ("headers", "status"),
    [
        (b"x: " + b"y" * 70_000 + b"\r\n", b"431"),
        (b"host: other\r\n", b"400"),
        (b"x: y\r\n", b"200"),
    ],
)
def test_headers_in_one_piece(tmp_path, headers, status):
    with running_service(tmp_path) as running:
        port = int(running.address.rpartition(":")[2])
        with socket.create_connection(("127.0.0.1", port), 20) as wire:
            ask = b"GET /v1/healthz HTTP/1.1\r\nhost: 127.0.0.1\r\nconnection: close\r\n"
            wire.sendall(ask + headers + b"\r\n")
            answer = wire.makefile("rb").read()
    assert answer.startswith(b"HTTP/1.1 " + status)
