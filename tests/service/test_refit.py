"""A model that is fitted anew while the service runs answers from then on."""

from dataclasses import replace

import pytest
from fastapi import Request

from rbfrag.db.engine import opened_database
from rbfrag.db.models import load_model, save_model
from rbfrag.errors import DatabaseFailedError
from rbfrag.service.problem import answer_error, in_parameters
from rbfrag.service.settings import ServiceSettings


def fitted_anew(database):
    with opened_database(database) as engine, engine.begin() as connection:
        row = load_model(connection, "wls-pgv")
        raised = {**row.coefficients, "c1": 1.1 * row.coefficients["c1"]}
        save_model(connection, replace(row, coefficients=raised), replace=True)


def test_the_new_model_answers(client, database):
    query = "/v1/predict?p2=3&kr=0.1&pgv=0.6&model=wls-pgv"
    before = client.get(query).json()
    assert client.get(query).json() == before
    fitted_anew(database)
    after = client.get(query).json()
    assert after["probability"] > before["probability"]
    many = client.post(
        "/v1/predict", json={"p2": 3, "kr": [0.1] * 100, "pgv": 0.6, "model": "wls-pgv"}
    ).json()
    assert many["probability"] == pytest.approx([after["probability"]] * 100, rel=1e-12)


def test_the_database_is_only_read(client, database):
    before = database.read_bytes()
    for path in ("/v1/models", "/v1/predict?p2=3&kr=0.1&pgv=0.6"):
        assert client.get(path).status_code == 200
    database.chmod(0o400)
    assert client.get("/v1/models").status_code == 200
    assert database.read_bytes() == before
    assert [item.name for item in database.parent.iterdir()] == [database.name]


def test_a_database_that_is_gone_is_said_without_its_place(client, database):
    database.unlink()
    answer = client.get("/v1/predict?p2=3&kr=0.1&pgv=0.6")
    assert answer.status_code == 503
    assert answer.json()["type"] == "urn:rbfrag:problem:database"
    assert str(database) not in answer.text
    assert str(database.parent) not in answer.text


def test_a_server_is_not_named_in_an_answer():
    document = ServiceSettings(db="postgresql://somebody:secret@db.example.org/rock")
    words = "there is no model 'x' in postgresql+psycopg://somebody:***@db.example.org/rock; it"
    assert in_parameters(words, document) == "there is no model 'x' in the database; it"
    failed = DatabaseFailedError("connection to db.example.org failed")
    answer = answer_error(Request({"type": "http"}), failed, document)
    assert answer.status_code == 503
    assert b"example.org" not in answer.body
