"""Who may ask: the token, names and pages elsewhere."""

import json

import pytest
from fastapi.testclient import TestClient

from rbfrag.errors import InputError
from rbfrag.service.app import make_app
from rbfrag.service.run import listener
from rbfrag.service.settings import VARIABLE, ServiceSettings, read_token
from tests.cli.conftest import Shell

TOKEN = "a-token-of-the-tests-0123456789"
PATH = "/v1/predict?p2=3&kr=0.1&pgv=0.6"


@pytest.fixture(autouse=True)
def _no_token(monkeypatch):
    monkeypatch.delenv(VARIABLE, raising=False)


@pytest.fixture
def guarded(database):
    return TestClient(make_app(ServiceSettings(db=str(database), token=TOKEN)))


@pytest.mark.parametrize(
    "inputs",
    [{}, {"authorization": "Bearer"}, {"authorization": f"Bearer {TOKEN}x"},
     {"authorization": TOKEN}, {"authorization": f"Basic {TOKEN}"},
     {"authorization": "Bearer é".encode("latin-1")}],
)  # fmt: skip
def test_without_the_token_nothing_is_answered(guarded, inputs):
    for path in (PATH, "/v1/models", "/v1/metrics", "/v1/openapi.json", "/v1/none"):
        answer = guarded.get(path, headers=inputs)
        assert answer.status_code == 401
        assert answer.headers["content-type"] == "application/problem+json"
        assert answer.headers["www-authenticate"].startswith("Bearer")
        assert TOKEN not in answer.text


def test_with_the_token_everything_is(guarded):
    headers = {"authorization": f"Bearer {TOKEN}"}
    for path in (PATH, "/v1/models", "/v1/metrics", "/v1/openapi.json"):
        assert guarded.get(path, headers=headers).status_code == 200


def test_the_page_and_the_health_check_need_none(guarded):
    assert guarded.get("/").status_code == 200
    assert guarded.get("/v1/healthz").status_code == 200
    assert guarded.get("/v1/vocabulary").status_code == 200


@pytest.mark.parametrize("host", ["0.0.0.0", "::", "192.0.2.1", "example.org"])
def test_other_computers_need_a_token(host, monkeypatch):
    with pytest.raises(InputError, match="a token is required"):
        ServiceSettings(host=host).checked()
    monkeypatch.setenv(VARIABLE, TOKEN)
    assert ServiceSettings(host=host).checked().token == TOKEN


@pytest.mark.parametrize("host", ["127.0.0.1", "127.0.0.2", "::1", "localhost"])
def test_this_computer_needs_none(host):
    settings = ServiceSettings(host=host).checked()
    assert settings.token is None
    assert {"localhost", "127.0.0.1", "[::1]"} <= set(settings.allow_host)


def test_the_command_rejects_to_start_without_a_token(shell: Shell):
    message = shell("serve", "--host", "0.0.0.0", expect=2).stderr
    assert "RBFRAG_TOKEN" in message
    assert "--token-file" in message


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--workers", "0"], "--workers 0"),
        (["--port", "65536"], "--port 65536"),
        (["--time-limit", "0"], "--time-limit 0"),
        (["--body-limit-mb", "nan"], "--body-limit-mb nan"),
        (["--token-file", "none.txt"], "none.txt: cannot be read"),
        (["--host", "192.0.2.1"], "a token is required"),
    ],
)
def test_the_command_rejects_what_cannot_be(shell: Shell, options, words):
    assert words in shell("serve", *options, expect=2).stderr


def test_a_token_comes_from_a_file(tmp_path):
    file = tmp_path / "token"
    file.write_text(f"{TOKEN}\n")
    assert read_token(str(file)) == TOKEN
    assert TOKEN not in repr(ServiceSettings(token_file=str(file)).checked())
    for bad in ("", "short", "with a blank in between", "é" * 20):
        file.write_text(bad)
        with pytest.raises(InputError):
            read_token(str(file))


def test_a_service_without_a_token_is_asked_by_its_own_names_only(database):
    settings = ServiceSettings(db=str(database), allow_host=("localhost", "127.0.0.1", "[::1]"))
    client = TestClient(make_app(settings))
    for host in ("localhost", "localhost:8000", "127.0.0.1:8000", "[::1]:8000", "LOCALHOST"):
        assert client.get(PATH, headers={"host": host}).status_code == 200
    for host in ("example.org", "localhost.example.org:8000", "", "127.0.0.1.example.org"):
        assert client.get(PATH, headers={"host": host}).status_code == 421


def test_pages_elsewhere_may_not_read_answers_unless_they_are_named(database):
    asking = {"origin": "https://maps.example.org"}
    closed = TestClient(make_app(ServiceSettings(db=str(database))))
    assert "access-control-allow-origin" not in closed.get(PATH, headers=asking).headers
    named = ServiceSettings(
        db=str(database), token=TOKEN, allow_origin=("https://maps.example.org",)
    )
    client = TestClient(make_app(named))
    before = {**asking, "access-control-request-method": "POST",
              "access-control-request-headers": "authorization"}  # fmt: skip
    assert client.options(PATH, headers=before).status_code == 200
    answer = client.get(PATH, headers={**asking, "authorization": f"Bearer {TOKEN}"})
    assert answer.headers["access-control-allow-origin"] == asking["origin"]
    other = {"origin": "https://example.com", "authorization": f"Bearer {TOKEN}"}
    assert "access-control-allow-origin" not in client.get(PATH, headers=other).headers


def test_requests_are_written_down_without_what_was_asked(guarded, capsys):
    guarded.get(f"{PATH}&model=wls-pgv", headers={"authorization": f"Bearer {TOKEN}"})
    line = json.loads(capsys.readouterr().err.splitlines()[-1])
    assert (line["method"], line["path"], line["status"]) == ("GET", "/v1/predict", 200)
    assert line["time"].endswith("+00:00")
    assert TOKEN not in json.dumps(line)
    assert "wls" not in json.dumps(line)


def test_requests_are_counted_by_operation_and_not_by_what_is_asked_for(guarded):
    headers = {"authorization": f"Bearer {TOKEN}"}
    for path in (PATH, PATH, "/v1/none-1", "/v1/none-2", "/nothing"):
        guarded.get(path, headers=headers)
    guarded.request("BREW", "/v1/predict", headers=headers)
    text = guarded.get("/v1/metrics", headers=headers).text
    requests = 'rbfrag_requests_total{method="GET",operation='
    assert f'{requests}"/v1/predict",status="200"}} 2.0' in text
    assert f'{requests}"other",status="404"}} 3.0' in text
    assert 'method="other",operation="/v1/predict",status="405"' in text
    assert 'rbfrag_request_seconds_count{operation="/v1/predict"} 3.0' in text
    assert "none-1" not in text


def test_an_address_that_somebody_listens_at_is_rejected():
    with listener("127.0.0.1", 0) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(InputError, match=f"port {port}: .* choose another"):
            listener("127.0.0.1", port)
    with pytest.raises(InputError, match=r"host no\.such\.host\.invalid"):
        listener("no.such.host.invalid", 0)
