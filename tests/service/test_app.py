"""The other operations, the page, and what is not served."""

import json

import pytest

from rbfrag.fragility.measures import TERMS
from rbfrag.version import __version__
from rbfrag.vocabulary.quantities import QUANTITIES
from tests.cli.conftest import Shell


def test_a_block_is_answered_as_by_the_command_line(client, shell: Shell):
    options = {"s1": 1, "s2": 0.6, "gamma": 25, "beta": 20, "phi": 40}
    words = [word for name, value in options.items() for word in (f"--{name}", str(value))]
    assert client.get("/v1/block", params=options).json() == json.loads(
        shell("block", *words, "--json").stdout
    )


@pytest.mark.parametrize(
    "query", ["s1=1&s2=0.6&beta=20&phi=40", "beta=20&phi=40", "s1=1&s2=0.6&gamma=25&phi=40"]
)
def test_a_block_that_is_not_described_is_rejected(client, query):
    answer = client.get(f"/v1/block?{query}")
    assert answer.status_code == 422
    assert "--" not in answer.json()["detail"]


def test_models_are_listed_as_by_the_command_line(client, database, shell: Shell):
    listed = shell("models", "list", "--db", str(database), "--json").stdout
    assert client.get("/v1/models").json() == json.loads(listed)


def test_health(client):
    assert client.get("/v1/healthz").json() == {"status": "ok", "version": __version__}


def test_the_vocabulary_is_served(client):
    document = client.get("/v1/vocabulary").json()
    quantities = {quantity["name"]: quantity for quantity in document["quantities"]}
    assert {*quantities} == {*QUANTITIES}
    pgv = quantities["pgv_m_s"]
    about = QUANTITIES["pgv_m_s"]
    for key in ("label", "unit", "symbol"):
        assert pgv[key] == getattr(about, key)
    assert (pgv["parameters"], pgv["imt"], pgv["group"]) == (["pgv"], "PGV", "measures")
    assert pgv["range"] == {"above": None, "least": 0.0, "below": None, "most": None}
    assert quantities["beta_deg"]["parameters"] == ["beta", "dip"]
    assert quantities["intensity_m_s"]["parameters"] == []
    labels = {term["name"]: term["label"] for term in document["terms"]}
    assert {*labels} == {*TERMS}
    assert labels["pgv_pga_m"] == "PGV, PGA and magnitude"


def test_the_page_is_there(client):
    answer = client.get("/")
    assert answer.status_code == 200
    assert answer.headers["content-type"].startswith("text/html")


@pytest.mark.parametrize(
    ("method", "path", "status"),
    [
        ("GET", "/v1/none", 404),
        ("GET", "/../../etc/passwd", 404),
        ("GET", "/%2e%2e/app.py", 404),
        ("DELETE", "/v1/predict", 405),
    ],
)
def test_what_is_not_served_is_a_problem(client, method, path, status):
    answer = client.request(method, path)
    assert answer.status_code == status
    assert answer.headers["content-type"] == "application/problem+json"
    assert answer.json()["status"] == status


def test_the_reference_answers_where_there_is_no_database(tmp_path, monkeypatch, shell: Shell):
    from fastapi.testclient import TestClient

    from rbfrag.service.app import make_app
    from rbfrag.service.settings import ServiceSettings

    monkeypatch.delenv("RBFRAG_DB", raising=False)
    monkeypatch.chdir(tmp_path)
    client = TestClient(make_app(ServiceSettings()))
    answer = client.get("/v1/predict?p2=3&kr=0.1&pgv=0.6").json()
    assert answer == json.loads(
        shell("predict", "--p2", "3", "--kr", "0.1", "--pgv", "0.6", "--json").stdout
    )
    assert answer["data"] == "the built-in data set"
