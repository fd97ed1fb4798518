"""`/v1/predict` gives the answers of the command line and of Python."""

import json

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from typer.testing import CliRunner

import rbfrag
from rbfrag.cli.main import app
from rbfrag.cli.output import print_result
from rbfrag.question.document import answer_block

KEYWORD = {"pgv": "pgv_m_s", "pga": "pga_g", "tm": "tm_s", "pgd": "pgd_m"}


def printed(capsys, database, values, **more):
    """Return the output of `rbfrag predict --json`."""
    inputs = {KEYWORD.get(name, name): value for name, value in values.items()}
    capsys.readouterr()
    print_result(answer_block(inputs, **more, db=str(database)), json=True)
    return json.loads(capsys.readouterr().out)


POSITIVE = st.floats(1e-3, 1e3)
SCENARIOS = st.fixed_dictionaries(
    {"p2": POSITIVE, "kr": st.floats(1e-3, 3.0), "pgv": st.floats(0.0, 10.0)},
    optional={"pga": st.floats(1e-3, 3.0), "tm": st.floats(0.02, 5.0)},
)


@settings(max_examples=80, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(values=SCENARIOS, level=st.sampled_from([0.5, 0.95, 0.999]))
def test_one_block_is_answered_as_by_the_command_line(client, database, capsys, values, level):
    answer = client.get("/v1/predict", params={**values, "level": level})
    assert answer.status_code == 200
    assert answer.json() == printed(capsys, database, values, level=level)
    measures = {KEYWORD[name]: value for name, value in values.items() if name in KEYWORD}
    expected = rbfrag.predict(values["p2"], values["kr"], **measures, level=level, db=database)
    assert answer.json()["probability"] == expected.probability
    assert answer.json()["ci_low"] == expected.ci_low
    assert answer.json()["ci_high"] == expected.ci_high


def test_planes_in_space_are_answered_as_by_the_command_line(client, database):
    planes = {"base": "4/150", "back": "78/095", "face": "80/090"}
    shape = {"s1": 2.0, "s2": 0.4, "phi": 40.0, "pgv": 2.0}
    options = [part for name, value in {**planes, **shape}.items() for part in (f"--{name}", value)]
    shell = CliRunner().invoke(
        app, ["predict", *map(str, options), "--db", str(database), "--json"]
    )
    target = json.loads(shell.stdout)
    assert 0.0 < target["probability"] < 1.0
    assert client.get("/v1/predict", params={**planes, **shape}).json() == target
    posted = client.post("/v1/predict", json={**planes, **shape, "base": ["4/150", "35/140"]})
    assert posted.status_code == 200
    for name in ("probability", "ci_low", "ci_high"):
        assert posted.json()[name][0] == pytest.approx(target[name], rel=1e-11)
        assert posted.json()[name][1] is None
    assert "base and back make a wedge" in posted.json()["reason"][1]
    alone = client.post("/v1/predict", json={**planes, **shape}).json()
    assert alone == target


@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(rows=st.lists(SCENARIOS.map(lambda s: {**s, "pga": 0.5}), min_size=1, max_size=20))
def test_lists_are_answered_within_rounding_of_single_blocks(client, rows):
    names = ("p2", "kr", "pgv")
    body = {name: [row[name] for row in rows] for name in names} | {"pga": 0.5}
    answer = client.post("/v1/predict", json=body)
    assert answer.status_code == 200
    document = answer.json()
    for i, row in enumerate(rows):
        query = {name: row[name] for name in names} | {"pga": 0.5, "model": document["model"]}
        single = client.get("/v1/predict", params=query).json()
        for name in ("probability", "ci_low", "ci_high"):
            rel = 1e-12 if name == "probability" else 1e-11  # as docs/howto/use-from-python.md says
            assert document[name][i] == pytest.approx(single[name], rel=rel, abs=1e-250)
        assert document["in_domain"][i] == single["in_domain"]


def test_every_kind_is_answered_and_lists_of_it(client):
    for block, kind in (
        ({"ky": 0.1, "displacement": 0.05, "beta": 10}, "sliding"),
        ({"ks": 0.1, "ps2": 3.0, "rotation": 2}, "slumping"),
        ({"kct": 0.2, "pct2": 8.0}, "confined_toppling"),
    ):
        single = client.get("/v1/predict", params={**block, "pgv": 0.4, "pga": 0.5}).json()
        assert single["kind"] == kind
        many = client.post("/v1/predict", json={**block, "pgv": [0.4, -1.0], "pga": 0.5}).json()
        assert many["probability"][0] == pytest.approx(single["probability"], rel=1e-12)
        assert many["probability"][1] is None
        assert many["kind"] == kind


def test_a_list_says_which_element_cannot_be_used(client):
    result = client.post(
        "/v1/predict", json={"p2": 3, "kr": [0.1, -0.1, None], "pgv": [0.6, 0.6, 0.6]}
    ).json()
    assert result["probability"][1:] == [1.0, None]
    assert result["reason"][:2] == ["", "unstable"]
    assert result["reason"][2].startswith("kr is not a number")
    (message,) = (text for text in result["warnings"] if "could not be used" in text)
    assert message.startswith(
        "1 of 3 blocks could not be used; the reasons stand in the column reason"
    )
    assert f"it is element 2: {result['reason'][2]}" in message


@pytest.mark.parametrize(
    ("query", "words"),
    [
        ("p2=3&kr=0.1", "no intensity measure is given"),
        ("p2=3&pgv=0.6", "kr is missing"),
        ("ky=0.1&pgv=0.6", "displacement is missing"),
        ("p2=3&kr=0.1&ky=0.1&pgv=0.6", "ky cannot be combined with kind toppling"),
        ("p2=3&kr=0.1&kind=falls&pgv=0.6", "no falls model"),
        ("p2=3&kr=nan&pgv=0.6", "kr = nan"),
        ("p2=3&kr=0.1&pgv=inf", "pgv = inf"),
        ("p2=3&kr=0.1&pgv=0.6&pgv=0.7", "pgv is given twice"),
        ("p2=3&kr=0.1&pgv=0.6&pvg=0.7", "unknown parameter 'pvg'"),
        ("p2=3&kr=a tenth&pgv=0.6", "kr = 'a tenth' is not a number"),
        ("p2=3&kr=0.1&pgv=1,000", "pgv = '1,000' is not a number: use a decimal point"),
        ("p2=3&kr=0.1&pgv=0.6&level=95", "level = 95"),
        ("p2=3&kr=0.1&pgv=0.6&model=", "model is empty"),
        ("p2=3&kr=%ff&pgv=0.6", "kr = '\N{REPLACEMENT CHARACTER}' is not a number"),
    ],
)
def test_what_cannot_be_answered_is_rejected_in_words(client, query, words):
    answer = client.get(f"/v1/predict?{query}")
    assert answer.status_code == 422
    assert answer.headers["content-type"] == "application/problem+json"
    problem = answer.json()
    assert problem["status"] == 422
    assert words in problem["detail"]
    assert "--" not in problem["detail"]


def test_an_unknown_model_is_named_without_the_place_of_the_database(client, database):
    problem = client.get("/v1/predict?p2=3&kr=0.1&pgv=0.6&model=nobody").json()
    assert problem["type"] == "urn:rbfrag:problem:unknown-model"
    assert "'nobody' in the database" in problem["detail"]
    assert str(database.parent) not in problem["detail"]


def test_uncertain_blocks_are_answered_as_from_python(client, database):
    inputs = {"p2": 3.0, "kr": 0.1, "pgv": 0.6, "kr_sigma": 0.2}
    expected = rbfrag.predict(3.0, 0.1, pgv_m_s=0.6, kr_sigma=0.2, db=database)
    result = client.get("/v1/predict", params=inputs).json()
    assert {name: result[name] for name in ("probability", "ci_low", "block_sd")} == {
        "probability": expected.probability, "ci_low": expected.ci_low,
        "block_sd": expected.block_sd,
    }  # fmt: skip
    many = client.post("/v1/predict", json={**inputs, "kr_sigma": [0.2, 0.2]}).json()
    assert many["block_sd"] == pytest.approx([expected.block_sd] * 2, rel=1e-12)
    certain = client.post("/v1/predict", json={"p2": 3.0, "kr": [0.1], "pgv": 0.6}).json()
    assert certain["block_sd"] is None
    assert client.get("/v1/predict", params={**inputs, "kr_sigma": -1}).status_code == 422


def test_free_standing_blocks_are_answered_as_by_the_command_line(client, database):
    motion = {"pgv": 0.6, "pga": 0.5}
    expected = rbfrag.predict(
        7.0, 0.2, kind="rocking", restitution=0.9, pgv_m_s=0.6, pga_g=0.5, db=database
    )
    inputs = {"p2": 7, "kr": 0.2, "restitution": 0.9, "kind": "rocking", **motion}
    result = client.get("/v1/predict", params=inputs).json()
    assert (result["kind"], result["failure"]) == ("rocking", "overturning")
    assert result["probability"] == expected.probability
    many = client.post("/v1/predict", json={**inputs, "kr": [0.2, 0.3]}).json()
    assert many["probability"][0] == pytest.approx(expected.probability, rel=1e-12)
    shape = {"height": 2.0, "width": 0.5, "dip": 3.0, **motion}
    single = client.get("/v1/predict", params={**shape, "kind": "rocking"}).json()
    assert any("weaker sense" in text for text in single["warnings"])
    free_standing = client.get("/v1/predict", params={**shape, "no_back": True}).json()
    assert free_standing["probability"] == single["probability"]
    rows = {**shape, "dip": [3.0, -3.0], "kind": "rocking"}
    both = client.post("/v1/predict", json=rows).json()
    assert both["probability"] == pytest.approx([single["probability"]] * 2, rel=1e-12)
    wrong = client.get("/v1/predict", params={**inputs, "restitution": 1.2})
    assert wrong.status_code == 422
    assert "restitution = 1.2" in wrong.json()["detail"]
