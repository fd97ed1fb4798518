"""Whatever is sent is answered within the limits, and the service stays up."""

import http.client
import json
import socket
import threading
import time
import urllib.error
import urllib.parse
import urllib.request
from concurrent.futures import ThreadPoolExecutor

import pytest

from benchmarks.running_service import running_service
from rbfrag.service.work import EXAMPLE as RECORD

LIMIT = 200_000
BODY_TIME_S = 2.0


@pytest.fixture(scope="module")
def service(tmp_path_factory):
    folder = tmp_path_factory.mktemp("service")
    values = {"body_limit_mb": LIMIT / 1e6, "body_time": BODY_TIME_S, "time_limit": 120.0}
    with running_service(folder, **values) as running:
        # the first answer waits until the kernels are there
        assert ask(running, "POST", "/v1/spectrum?p2=3", RECORD.encode())[0] == 200
        yield running
        assert not [line for line in running.lines() if line["level"] == "error"]


def ask(running, method, path, body=None, headers=None):
    """Status and text of an answer."""
    connection = http.client.HTTPConnection("127.0.0.1", running.port, timeout=150)
    try:
        connection.request(method, path, body, headers or {})
        answer = connection.getresponse()
        return answer.status, answer.read().decode()
    finally:
        connection.close()


@pytest.fixture(autouse=True)
def stays_up(service):
    yield
    status, text = ask(service, "GET", "/v1/predict?p2=3&kr=0.1&pgv=0.6")
    assert status == 200, text


def rejected(result, status):
    assert result[0] == status, result
    problem = json.loads(result[1])
    assert problem["status"] == status
    assert "Traceback" not in result[1]
    return problem["detail"]


def test_a_body_that_says_it_is_too_long_is_not_read(service):
    with socket.create_connection(("127.0.0.1", service.port), 20) as wire:
        wire.sendall(
            b"POST /v1/spectrum HTTP/1.1\r\nhost: localhost\r\ncontent-length: 1000000000\r\n\r\n"
        )
        answer = wire.makefile("rb").read()
    assert answer.startswith(b"HTTP/1.1 413 ")
    assert b"application/problem+json" in answer


def test_a_body_that_does_not_say_how_long_it_is_ends_at_the_limit(service):
    with socket.create_connection(("127.0.0.1", service.port), 20) as wire:
        wire.sendall(
            b"POST /v1/predict HTTP/1.1\r\nhost: localhost\r\ntransfer-encoding: chunked\r\n\r\n"
        )
        sent = 0
        chunk = b"2710\r\n" + b" " * 10_000 + b"\r\n"
        try:
            while sent < 50 * LIMIT:
                wire.sendall(chunk)
                sent += 10_000
        except OSError:  # the service has hung up
            pass
        assert sent < 50 * LIMIT


def test_a_body_that_trickles_in_is_given_up(service):
    with socket.create_connection(("127.0.0.1", service.port), 60) as wire:
        wire.sendall(
            b"POST /v1/predict HTTP/1.1\r\nhost: localhost\r\ncontent-length: 5000\r\n\r\n"
        )
        answer = b""

        def listen():
            nonlocal answer
            answer = wire.makefile("rb").read()

        listener = threading.Thread(target=listen)
        listener.start()
        for _ in range(600):
            try:
                wire.sendall(b" ")
            except OSError:
                break
            listener.join(0.1)
            if not listener.is_alive():
                break
        listener.join(60)
    assert answer.startswith(b"HTTP/1.1 408 ")


def test_trickling_bodies_do_not_keep_others_waiting_for_long(service):
    wires = [socket.create_connection(("127.0.0.1", service.port), 60) for _ in range(40)]
    for wire in wires:
        wire.sendall(b"POST /v1/predict HTTP/1.1\r\nhost: localhost\r\ncontent-length: 50\r\n\r\n")
    body = b'{"p2": 3, "kr": 0.1, "pgv": 0.6}'
    assert ask(service, "GET", "/v1/predict?p2=3&kr=0.1&pgv=0.6")[0] == 200
    assert ask(service, "POST", "/v1/predict", body)[0] == 200
    for wire in wires:
        wire.close()


@pytest.mark.parametrize(
    "sent",
    [
        b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03",
        b"GET\r\n\r\n",
        b"POST /v1/predict HTTP/1.1\r\nhost: x\r\ncontent-length: -1\r\n\r\n",
        b"POST /v1/predict HTTP/1.1\r\nhost: localhost\r\ntransfer-encoding: chunked\r\n\r\nzz\r\n",
    ],
)
def test_what_is_not_http_is_rejected(service, sent):
    with socket.create_connection(("127.0.0.1", service.port), 20) as wire:
        wire.sendall(sent)
        wire.shutdown(socket.SHUT_WR)
        answer = wire.makefile("rb").read()
    assert answer.startswith(b"HTTP/1.1 4")
    assert b"Traceback" not in answer


@pytest.mark.parametrize(
    ("body", "words"),
    [
        (b"", "not JSON"),
        (b'{"p2": "\xff"}', "not UTF-8"),
        (b'{"p2": 3, "kr": 0.1, "pgv": 0.6', "not JSON: line 1"),
        (b"[" * 100_000, "nested too deeply"),
        (b'{"p2":' * 20_000, "nested too deeply"),
        (b'{"p2": 3, "kr": NaN, "pgv": 0.6}', "NaN is not a JSON number"),
        (b'{"p2": 3, "kr": [0.1, -Infinity], "pgv": 0.6}', "-Infinity is not a JSON number"),
        (b'{"p2": ' + b"9" * 10_000 + b"}", "not JSON"),
    ],
    ids=["empty", "bytes", "cut", "lists", "objects", "nan", "infinity", "digits"],
)
def test_what_is_not_json_is_rejected(service, body, words):
    assert words in rejected(ask(service, "POST", "/v1/predict", body), 400)


@pytest.mark.parametrize(
    ("body", "words"),
    [
        ({"p2": 1e308, "kr": 1e308, "pgv": 1e308}, "beyond any block"),
        ({"p2": 3, "kr": [[0.1]], "pgv": 0.6}, "kr[0]"),
        ({"p2": 3, "kr": "0.1", "pgv": 0.6}, "kr = '0.1' is not a number"),
        ({"p2": 3, "kr": True, "pgv": 0.6}, "kr = True is not a number"),
        ({"p2": 3, "kr": 0.1, "pgv": 10**400}, "pgv is too large"),
        ({"p2": [1, 2], "kr": [1, 2, 3], "pgv": 1}, "the lists differ in length"),
        ({"p2": 3, "kr": 0.1, "pgv": 0.6, "__class__": 1}, "unknown parameter '__class__'"),
    ],
    ids=["largest", "nested", "text", "truth", "huge", "lengths", "name"],
)
def test_values_of_any_kind_are_answered(service, body, words):
    result = ask(service, "POST", "/v1/predict", json.dumps(body).encode())
    assert words in rejected(result, 422)


@pytest.mark.parametrize("value", ["nan", "inf", "-inf", "1e999", "1e-999", "-0", "0x10", "١"])
def test_numbers_of_any_kind_are_answered(service, value):
    for name in ("p2", "kr", "pgv", "level"):
        values = {"p2": "3", "kr": "0.1", "pgv": "0.6", name: value}
        status, text = ask(service, "GET", f"/v1/predict?{urllib.parse.urlencode(values)}")
        assert status in (200, 422)
        assert "NaN" not in text
        assert "Infinity" not in text


NAMES = [
    "../../../../etc/passwd",
    "/etc/passwd",
    "file:///etc/passwd",
    "C:\\Windows\\win.ini",
    "name\0.db",
    "%2e%2e%2f",
    "'; DROP TABLE fragility_model; --",
    "' OR '1'='1",
    "wls-pgv' UNION SELECT name FROM sqlite_master --",
]


@pytest.mark.parametrize("name", NAMES)
def test_names_are_only_names(service, name):
    listed = ask(service, "GET", "/v1/models")[1]
    query = urllib.parse.urlencode({"p2": 3, "kr": 0.1, "pgv": 0.6, "model": name})
    detail = rejected(ask(service, "GET", f"/v1/predict?{query}"), 422)
    assert "there is no model" in detail
    assert "root:" not in detail
    sent = ask(
        service, "POST", f"/v1/hazard?{query.replace('model', 'site')}".replace("pgv=0.6&", ""),
        b"pgv_m_s,annual_rate\n0.1,0.01\n1,0.0001\n",
    )  # fmt: skip
    assert "there is no site" in rejected(sent, 422)
    assert ask(service, "GET", "/v1/models")[1] == listed


@pytest.mark.parametrize("name", NAMES)
def test_the_name_of_a_file_that_is_sent_means_nothing(service, name):
    shown = urllib.parse.quote(name, safe="/'; ")
    body = (
        f'--mark\r\ncontent-disposition: form-data; name="file"; filename="{shown}"\r\n\r\n'
        f"{RECORD}\r\n--mark--\r\n"
    )
    headers = {"content-type": "multipart/form-data; boundary=mark"}
    status, text = ask(service, "POST", "/v1/spectrum?p2=3", body.encode(), headers)
    assert status == 200
    assert json.loads(text)["name"] == "upload"


@pytest.mark.parametrize(
    "body",
    [
        "--mark--\r\n",
        '--mark\r\ncontent-disposition: form-data; name="file"\r\n\r\nno file\r\n--mark--\r\n',
        2 * '--mark\r\ncontent-disposition: form-data; name="f"; filename="f"\r\n\r\n1\r\n'
        + "--mark--\r\n",
        "no form",
        "--mark\r\n" + "x: y\r\n" * 5000,
    ],
    ids=["empty", "field", "two", "none", "headers"],
)
def test_a_form_that_holds_no_single_file_is_rejected(service, body):
    headers = {"content-type": "multipart/form-data; boundary=mark"}
    assert rejected(ask(service, "POST", "/v1/spectrum?p2=3", body.encode(), headers), 400)


def test_headers_without_end_are_rejected(service):
    with socket.create_connection(("127.0.0.1", service.port), 20) as wire:
        wire.sendall(b"GET /v1/healthz HTTP/1.1\r\n")
        sent = 0
        try:
            while sent < 20_000_000:
                wire.sendall(b"x-header: " + b"y" * 990 + b"\r\n")
                sent += 1000
        except OSError:
            pass
    assert sent < 20_000_000


def test_two_hundred_uploads_at_once_are_answered(service):
    address = f"{service.address}/v1/spectrum?p2=3"

    def send(_):
        try:
            with urllib.request.urlopen(address, RECORD.encode(), timeout=150) as answer:
                return answer.status
        except urllib.error.HTTPError as error:
            return json.loads(error.read())["status"]

    start = time.monotonic()
    with ThreadPoolExecutor(200) as pool:
        values = list(pool.map(send, range(200)))
    assert set(values) <= {200, 503}
    assert values.count(200) > 50
    assert time.monotonic() - start < 150
