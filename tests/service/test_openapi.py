"""The OpenAPI document says what the service does."""

import pytest

from benchmarks import service_fuzz


def document(client):
    return client.get("/v1/openapi.json").json()


def test_every_operation_has_words_and_problems(client):
    reply = document(client)
    assert set(reply["paths"]) >= {
        "/v1/predict",
        "/v1/block",
        "/v1/rockmass",
        "/v1/spectrum",
        "/v1/critical",
        "/v1/hazard",
        "/v1/models",
        "/v1/vocabulary",
        "/v1/healthz",
    }
    for path, operations in reply["paths"].items():
        for operation in operations.values():
            assert operation["summary"]
            for parameter in operation.get("parameters", ()):
                assert parameter["description"]
            for status, answer in operation["responses"].items():
                kind = "application/json" if status == "200" else "application/problem+json"
                assert kind in answer["content"], (path, status)


SENT = {"400", "401", "408", "413", "415", "422", "503"}


def test_every_operation_documents_its_errors(client):
    answer = document(client)
    assert not [name for name in answer["components"]["schemas"] if "ValidationError" in name]
    for path, operations in answer["paths"].items():
        for method, operation in operations.items():
            problems = {response for response in operation["responses"] if response != "200"}
            if path in ("/v1/healthz", "/v1/vocabulary"):
                assert not problems
            elif path == "/v1/models":
                assert problems == {"401", "503"}
            else:
                assert problems == (SENT if method == "post" else {"401", "422", "503"}), path
            for status in problems:
                schema = operation["responses"][status]["content"]["application/problem+json"]
                assert schema["schema"]["required"] == ["type", "title", "status", "detail"]


NO_UNIT = {"form", "sheet", "ignore_columns", "drainage", "name",
    "amplification", "amplification_sigma", "back", "base", "face", "mechanism", "pga_sigma",
    "pgv_sigma", "pgv_tau",
    "sa_sigma",
    "component", "convert", "convert_sigma", "imt", "jrc", "kct", "kct_sigma", "kind", "kr",
    "kr_sigma", "ks", "ks_sigma", "ky", "ky_sigma", "level", "magnitude", "map", "model", "n",
    "no_back", "p2_sigma", "pct2_sigma", "polarity", "ps2_sigma", "restitution",
    "restitution_sigma", "reverse", "seed", "sensitivity", "site", "sites", "solve_for",
    "target_probability", "text", "trace", "units",
}  # fmt: skip


def test_every_quantity_has_its_unit(client):
    for operations in document(client)["paths"].values():
        for operation in operations.values():
            for parameter in operation.get("parameters", ()):
                if parameter["name"] not in NO_UNIT:
                    assert "[" in parameter["description"], parameter["name"]


def test_a_null_in_a_body_is_as_if_left_out(client):
    body = {"p2": 3, "kr": 0.1, "pgv": 0.6}
    answer = client.post("/v1/predict", json={**body, "tm": None, "model": None})
    assert answer.json() == client.post("/v1/predict", json=body).json()


@pytest.mark.parametrize("kind", [None, "application/json", "application/x-www-form-urlencoded"])
def test_a_body_of_rows_is_json_whatever_it_is_called(client, kind):
    headers = {} if kind is None else {"content-type": kind}
    body = '{"p2": 3, "kr": 0.1, "pgv": 0.6}'
    assert client.post("/v1/predict", content=body, headers=headers).status_code == 200


def test_a_rejection_is_short_whatever_was_asked(client):
    for query in (
        "x" * 3000,
        "kr=" + "9" * 3000,
        "kr=" + "x" * 3000,
        "model=" + "x" * 3000,
        "&".join(f"x{i}=1" for i in range(2000)),
        "x" * 3000 + "=1&" + "x" * 3000 + "=2",
    ):
        answer = client.get(f"/v1/predict?p2=3&pgv=1&{query}")
        assert answer.status_code == 422
        assert len(answer.json()["detail"]) < 500


def test_its_examples_are_answered(client):
    for path, operations in document(client)["paths"].items():
        operation = operations.get("get")
        if operation is not None:
            query = {p["name"]: p["schema"]["examples"][0] for p in operation.get("parameters", ())
                     if "examples" in p["schema"]}  # fmt: skip
            assert client.get(path, params=query).status_code == 200, path


@pytest.mark.parametrize("seed", [1])
def test_made_up_requests_are_answered_as_it_says(seed, capsys):
    status = service_fuzz.main(["--cases", "15", "--seed", str(seed), "--phases", "fuzzing"])
    assert status == 0, capsys.readouterr().out
