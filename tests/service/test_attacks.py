"""While somebody makes the service wait or work, it goes on answering others."""

import http.client
import json
import os
import select
import socket
import sqlite3
import threading
import time
from contextlib import ExitStack, closing, contextmanager, suppress

import pytest

from benchmarks.running_service import running_service
from rbfrag.service.work import EXAMPLE as RECORD

SINGLE = "/v1/predict?p2=3&kr=0.1&pgv=0.6"
BODY = b'{"p2": 3, "kr": 0.1, "pgv": 0.6}'
TIME_LIMIT_S = 6.0
CLIENT_WAITS_S = 2.0
"""How long a client waits for word of the service's health; the attacks last longer."""


@pytest.fixture(scope="module")
def service(tmp_path_factory):
    folder = tmp_path_factory.mktemp("service")
    with running_service(folder, time_limit=TIME_LIMIT_S) as running:
        assert ask(running, "GET", SINGLE)[0] == 200
        # the processes for long work load their kernels first, on a busy machine beyond the limit
        end = time.monotonic() + 300.0
        while ask(running, "POST", "/v1/spectrum?p2=3", RECORD.encode())[0] != 200:
            assert time.monotonic() < end
        yield running


def ask(running, method, path, body=None, headers=None, timeout=60.0):
    """Status, headers and text of an answer."""
    with closing(http.client.HTTPConnection("127.0.0.1", running.port, timeout=timeout)) as wire:
        wire.request(method, path, body, headers or {})
        answer = wire.getresponse()
        return answer.status, dict(answer.getheaders()), answer.read().decode()


@contextmanager
def going_on(attack, *inputs):
    """Run an attack in a thread beside the block; yields a list for its result."""
    result = []
    thread = threading.Thread(target=lambda: result.append(attack(*inputs)))
    thread.start()
    try:
        yield result
    finally:
        thread.join(120)
        assert not thread.is_alive()


def healthy(running):
    assert ask(running, "GET", "/v1/healthz", timeout=CLIENT_WAITS_S)[0] == 200


def test_a_locked_file_holds_nobody_else(service):
    place = next(service.log.parent.glob("*.db"))
    with closing(sqlite3.connect(place, isolation_level=None)) as other:
        other.execute("PRAGMA journal_mode = DELETE")
        other.execute("BEGIN EXCLUSIVE")
        os.utime(place)  # the models are to be read again
        with going_on(ask, service, "GET", SINGLE) as result:
            for _ in range(10):
                healthy(service)
                time.sleep(0.1)
            assert not result  # it still waits for the lock
        other.execute("ROLLBACK")
    status, _, text = result[0]
    assert (status, json.loads(text)["status"]) == (503, 503)
    assert ask(service, "GET", SINGLE)[0] == 200


@pytest.mark.parametrize(
    "body",
    [
        b"[" * 15_000_000,
        b'{"p2": [' + b"[]," * 4_900_000 + b"[]]}",
        b'{"p2": [' + b"0," * 7_400_000 + b"0]}",
        b"{" + b",".join(b'"%d":1' % i for i in range(1_000_000)) + b',"999999":1}',
    ],
    ids=["deep", "many", "long", "names"],
)
def test_a_large_body_is_rejected_before_it_is_parsed(service, body):
    with going_on(ask, service, "POST", "/v1/predict", body) as result:
        for _ in range(10):
            healthy(service)
    assert result[0][0] in (400, 422)


def test_a_million_elements_are_parsed_beside_others(service):
    body = b'{"kr": 0.1, "pgv": 0.6, "p2": [' + b"3.0," * 3_000_000 + b"3.0]}"
    with going_on(ask, service, "POST", "/v1/predict", body) as result:
        for _ in range(20):
            healthy(service)
    assert result[0][0] == 422  # too many for a list, or for the time of one request


@pytest.mark.parametrize(
    ("value", "sent", "honest"),
    [
        (1000, 0, BODY),
        (100_000, 0, b" " * 80_000 + BODY),
        (128_000, 66_000, BODY),
        (128_000, 66_000, b" " * 240_000 + BODY),
    ],
)
def test_idle_bodies_keep_nobody_out(service, value, sent, honest):
    wires = [socket.create_connection(("127.0.0.1", service.port), 60) for _ in range(40)]
    try:
        for wire in wires:
            wire.sendall(
                b"POST /v1/predict HTTP/1.1\r\nhost: localhost\r\n"
                b"content-length: %d\r\n\r\n" % value + b" " * sent
            )
        time.sleep(0.5)  # until what was sent is read
        healthy(service)
        assert ask(service, "POST", "/v1/predict", honest, timeout=CLIENT_WAITS_S)[0] == 200
    finally:
        for wire in wires:
            wire.close()


@pytest.mark.parametrize("first", [b"", b" " * 200_000], ids=["at once", "after a fast start"])
def test_bodies_slower_than_the_least_rate_are_given_up(service, first):
    with socket.create_connection(("127.0.0.1", service.port), 60) as wire:
        wire.sendall(
            b"POST /v1/predict HTTP/1.1\r\nhost: localhost\r\ncontent-length: 500000\r\n\r\n"
            + first
        )
        wire.settimeout(0.1)
        answer, sent = b"", 0
        while not answer and sent < 200:  # 20 s; without a least rate it is given 30
            wire.sendall(b" ")
            sent += 1
            with suppress(TimeoutError):
                answer = wire.recv(10_000)
        assert answer.startswith(b"HTTP/1.1 408 ")
        assert b"connection: close" in answer
        wire.settimeout(20)
        while answer:  # the rest of the answer, and then the end
            answer = wire.recv(10_000)


def test_bodies_that_come_slowly_but_steadily_are_answered(service):
    body = b" " * 12_000 + BODY
    with socket.create_connection(("127.0.0.1", service.port), 60) as wire:
        wire.sendall(
            b"POST /v1/predict HTTP/1.1\r\nhost: localhost\r\ncontent-length: %d\r\n\r\n"
            % len(body)
        )
        for start in range(0, len(body), 1000):  # longer than a pause, faster than the least rate
            wire.sendall(body[start : start + 1000])
            time.sleep(0.5)
        assert wire.recv(10_000).startswith(b"HTTP/1.1 200 ")


def test_bodies_that_are_being_read_hold_bounded_memory(tmp_path):
    bound = {"body_limit_mb": 0.2, "bodies_at_once": 2}
    with running_service(tmp_path, **bound) as running, ExitStack() as wires:
        half_sent = [
            wires.enter_context(socket.create_connection(("127.0.0.1", running.port), 60))
            for _ in range(3)
        ]
        for wire in half_sent:
            wire.sendall(
                b"POST /v1/predict HTTP/1.1\r\nhost: localhost\r\ncontent-length: 190000\r\n\r\n"
                + b" " * 150_000
            )
        (rejected,), _, _ = select.select(half_sent, [], [], 60.0)
        assert rejected.recv(10_000).startswith(b"HTTP/1.1 503 ")
        wires.close()  # and what they held is free again
        end = time.monotonic() + 30.0
        while ask(running, "POST", "/v1/predict", b" " * 150_000 + BODY)[0] != 200:
            assert time.monotonic() < end


def test_dotted_keys_burn_no_worker(service):
    body = b".".join([b"a"] * 100_000) + b" = 1\n"
    headers = {"content-type": "application/toml"}
    status, _, text = ask(service, "POST", "/v1/rockmass", body, headers)
    assert status == 422
    assert "more than 20 parts" in json.loads(text)["detail"]


@pytest.mark.parametrize("path", ["/v1/healthz", "/v1/models", SINGLE])
def test_head_is_answered_as_get(service, path):
    got, head = ask(service, "GET", path), ask(service, "HEAD", path)
    assert head[0] == got[0] == 200
    assert head[2] == ""
    for name in ("content-type", "content-length", "cache-control"):
        assert head[1][name] == got[1][name]


@pytest.mark.parametrize(
    ("method", "path", "allowed"),
    [
        ("PUT", "/v1/predict", "GET, HEAD, POST"),
        ("DELETE", "/v1/spectrum", "POST"),
        ("POST", "/v1/healthz", "GET, HEAD"),
        ("POST", "/", "GET, HEAD"),
    ],
)
def test_allow_names_every_method_of_the_path(service, method, path, allowed):
    status, headers, _ = ask(service, method, path)
    assert (status, headers["allow"]) == (405, allowed)


@pytest.mark.parametrize(
    ("path", "body", "headers"),
    [
        ("/v1/predict", b'{"p2": 3, "p2": 4, "kr": 0.1, "pgv": 0.6}', {}),
        ("/v1/rockmass", b'{"seed": 1, "seed": 2}', {"content-type": "application/json"}),
        (
            "/v1/hazard?p2=3&kr=0.1",
            b'{"Peak Ground Velocity": 1, "Peak Ground Velocity": 2}',
            {"content-type": "application/json"},
        ),
    ],
)
def test_a_key_is_there_once(service, path, body, headers):
    status, _, text = ask(service, "POST", path, body, headers)
    assert status in (400, 422)
    assert "occurs twice" in json.loads(text)["detail"]


def test_a_rejected_upload_is_told_why(service):
    # http.client sends all of it before it reads; the connection must still be there
    status, _, text = ask(service, "POST", "/v1/spectrum?p2=3", b"1" * 17_000_000)
    assert status == 413
    assert "16000000 bytes" in json.loads(text)["detail"]


@pytest.mark.parametrize(
    ("origin", "status"),
    [
        (None, 200),
        ("http://evil.example", 403),
        ("null", 403),
        ("http://127.0.0.1:1", 403),
        ("http://127.0.0.1:{port}", 200),
    ],
)
def test_a_foreign_page_may_not_send(service, origin, status):
    headers = {} if origin is None else {"origin": origin.format(port=service.port)}
    assert ask(service, "POST", "/v1/predict", BODY, headers)[0] == status
    assert ask(service, "GET", SINGLE, None, headers)[0] == 200


def test_a_page_that_is_allowed_may_send(tmp_path):
    origin = "http://lab.example"
    with running_service(tmp_path, allow_origin=[origin]) as running:
        assert ask(running, "POST", "/v1/predict", BODY, {"origin": origin})[0] == 200
        assert ask(running, "POST", "/v1/predict", BODY, {"origin": f"{origin}.org"})[0] == 403


def test_the_scheme_of_the_token_is_written_in_any_case(tmp_path):
    token = "t" * 20
    with running_service(tmp_path, environment={"RBFRAG_TOKEN": token}) as running:
        for scheme in ("Bearer", "bearer", "BEARER"):
            assert (
                ask(running, "GET", SINGLE, None, {"authorization": f"{scheme} {token}"})[0] == 200
            )
        for wrong in (f"Basic {token}", f"Bearer {token}x", token, "Bearer"):
            assert ask(running, "GET", SINGLE, None, {"authorization": wrong})[0] == 401


def test_a_locked_table_of_a_server_ends_with_the_time_limit(place, tmp_path):
    if "://" not in place:
        pytest.skip("of a server")
    import psycopg

    from rbfrag.db.engine import opened_database
    from rbfrag.db.location import reference_file
    from rbfrag.db.model_file import read_models
    from rbfrag.db.models import save_model

    with opened_database(place, create=True) as engine, engine.begin() as connection:
        for row in read_models(reference_file()):
            if row.kind == "toppling":
                save_model(connection, row)
    with (
        running_service(tmp_path, db=place, time_limit=TIME_LIMIT_S) as running,
        psycopg.connect(place) as other,
    ):
        end = time.monotonic() + 300.0  # the first answer loads the libraries of a server
        while ask(running, "GET", SINGLE)[0] != 200:
            assert time.monotonic() < end
        other.execute("LOCK TABLE fragility_model IN ACCESS EXCLUSIVE MODE")
        with going_on(ask, running, "GET", SINGLE) as result:
            for _ in range(10):
                healthy(running)
                time.sleep(0.1)
        # the lock is still held: the answer came by the limit of time
        assert result[0][0] == 503
        other.rollback()
        assert ask(running, "GET", SINGLE)[0] == 200
