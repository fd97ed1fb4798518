"""Spectral accelerations by oscillator period in requests, repeated in a query, and in bodies."""

import csv
import io

import pytest

import rbfrag
from rbfrag.db.location import REFERENCE

BLOCK = {"p2": 3.0, "kr": 0.1, "pga": 0.4}
SPECTRUM = {0.3: 0.9, 1: 0.5, 3: 0.15}


@pytest.fixture(scope="module")
def expected():
    return rbfrag.predict(
        3.0, 0.1, pga_g=0.4, sa_g=SPECTRUM, sa_sigma={1: 0.3}, db=REFERENCE
    ).probability


def test_a_query_repeats_them(client, expected):
    query = {**BLOCK, "sa": ["0.3:0.9", "1:0.5", "3:0.15"], "sa_sigma": "1:0.3"}
    reply = client.get("/v1/predict", params=query).json()
    assert reply["probability"] == expected
    assert "sa(1)" in reply["shaking"]
    typed = {**BLOCK, "sa": "0.3=0.9 1=0.5 3=0.15", "sa_sigma": "1=0.3"}
    assert client.get("/v1/predict", params=typed).json() == reply


@pytest.mark.parametrize("name", ["sa_g", "sa"])
def test_a_body_has_them_by_period(client, expected, name):
    body = {**BLOCK, name: {"0.3": 0.9, "1": 0.5, "3": 0.15}, "sa_sigma": {"1": 0.3}}
    assert client.post("/v1/predict", json=body).json()["probability"] == expected
    body[name]["1"] = [0.5, 0.5, None]
    reply = client.post("/v1/predict", json=body).json()
    assert reply["probability"][:2] == pytest.approx([expected, expected], rel=1e-6)
    assert reply["probability"][2] is None
    assert "sa(1) is not a number" in reply["reason"][2]


@pytest.mark.parametrize(
    ("query", "words"),
    [
        ("sa=20:0.4", "sa 20:0.4: the period must be from 0.01 to 10 s"),
        ("sa=1:0.4&sa=1.0:0.4", "sa 1.0:0.4: the period 1 s is given twice"),
        ("sa=1", "sa 1: give the period in s and the value"),
        ("sa=1:-1", "sa(1) = -1 g is negative"),
        ("sa10_g=0.4", "unknown parameter 'sa10_g'; the parameters are"),
        ("pgv=1&pgv=2", "pgv is given twice"),
    ],
)
def test_what_a_query_is_rejected_for(client, query, words):
    reply = client.get(f"/v1/predict?p2=3&kr=0.1&{query}")
    assert reply.status_code == 422
    assert words in reply.json()["detail"]


@pytest.mark.parametrize(
    ("spectrum", "words"),
    [
        ({"20": 0.4}, "the period must be from 0.01 to 10 s"),
        ({"1": 0.4, "1.0": 0.4}, "the period 1 s is given twice"),
        ({"1": "x"}, "not a number"),
        ({"1": [0.4, 0.5], "3": [0.1, 0.1, 0.1]}, "the lists differ in length: sa 1 2, sa 3 3"),
    ],
)
def test_what_a_body_is_rejected_for(client, spectrum, words):
    reply = client.post("/v1/predict", json={**BLOCK, "sa_g": spectrum})
    assert reply.status_code == 422
    assert words in reply.json()["detail"]


def test_a_table_without_shaking_takes_them_for_all_rows(client, expected):
    table = "p2,kr\n3,0.1\n"
    query = {"pga": 0.4, "sa": ["0.3:0.9", "1:0.5", "3:0.15"], "sa_sigma": "1:0.3"}
    reply = client.post("/v1/table", params=query, content=table).json()
    (row,) = list(csv.DictReader(io.StringIO(reply["table"].partition("\n\n")[0])))[:1]
    assert float(row["probability"]) == pytest.approx(expected, rel=1e-6)
