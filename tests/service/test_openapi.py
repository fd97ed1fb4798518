"""The OpenAPI document says what the service does."""

import pytest

from benchmarks import service_fuzz


def document(client):
    return client.get("/v1/openapi.json").json()


def test_every_operation_has_words_and_problems(client):
    found = document(client)
    assert set(found["paths"]) >= {
        "/v1/predict",
        "/v1/block",
        "/v1/rockmass",
        "/v1/spectrum",
        "/v1/critical",
        "/v1/hazard",
        "/v1/models",
        "/v1/healthz",
    }
    for path, operations in found["paths"].items():
        for operation in operations.values():
            assert operation["summary"]
            for parameter in operation.get("parameters", ()):
                assert parameter["description"]
            for status, answer in operation["responses"].items():
                kind = "application/json" if status == "200" else "application/problem+json"
                assert kind in answer["content"], (path, status)


def test_its_examples_are_answered(client):
    for path, operations in document(client)["paths"].items():
        operation = operations.get("get")
        if operation is not None:
            query = {p["name"]: p["example"] for p in operation.get("parameters", ())
                     if "example" in p}  # fmt: skip
            assert client.get(path, params=query).status_code == 200, path


@pytest.mark.parametrize("seed", [1])
def test_made_up_requests_are_answered_as_it_says(seed, capsys):
    status = service_fuzz.main(["--cases", "15", "--seed", str(seed), "--phases", "fuzzing"])
    assert status == 0, capsys.readouterr().out
