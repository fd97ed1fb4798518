"""Rock masses, accelerograms and hazard curves that are sent: the command line's answers."""

from pathlib import Path

import numpy as np
import pytest
from fastapi.testclient import TestClient

from rbfrag.db.location import REFERENCE
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.readers import export_motions
from rbfrag.service.app import make_app
from rbfrag.service.operations import CURVE
from rbfrag.service.operations import ROCK_MASS as TABLES
from rbfrag.service.operations import ROCK_MASS_TOML as EXAMPLE_TOML
from rbfrag.service.settings import ServiceSettings
from rbfrag.service.work import EXAMPLE as RECORD
from rbfrag.solver.block.geometry import Block
from tests.cli.conftest import Shell

TOML = {"content-type": "application/toml"}


def document(answer):
    """Return a document without its diagnostics, as `Shell.json` does."""
    reply = answer.json()
    del reply["diagnostics"]
    return reply


@pytest.fixture(scope="module")
def client():
    """One service for all: its processes take a while to start."""
    # its process may have to compile the kernels first, on a busy machine
    settings = ServiceSettings(db=str(REFERENCE), row_limit=6000, jobs=1, time_limit=300.0)
    with TestClient(make_app(settings)) as result:
        yield result


@pytest.fixture
def written(shell: Shell, tmp_path: Path):
    """A file in the folder that commands run in."""

    def write(name: str, text: str) -> Path:
        path = tmp_path / name
        path.write_text(text)
        return path

    return write


def rejection(answer, status=422):
    assert answer.status_code == status, answer.text
    assert answer.headers["content-type"] == "application/problem+json"
    detail = answer.json()["detail"]
    assert "--" not in detail
    assert "/dev/null" not in detail
    return detail


def test_a_rock_mass_is_answered_as_by_the_command_line(client, written, shell: Shell):
    file = written("rockmass.toml", EXAMPLE_TOML)
    printed = shell.json("rockmass", file, "--pgv", "0.6", "--n", "300", "--db", REFERENCE)
    query = "/v1/rockmass?pgv=0.6&n=300"
    assert document(client.post(query, content=EXAMPLE_TOML, headers=TOML)) == printed
    assert document(client.post(query, json=TABLES)) == printed


@pytest.mark.parametrize(
    ("query", "body", "words"),
    [
        ("n=6001", EXAMPLE_TOML, "6001 realisations exceed the maximum of 6000 per request"),
        ("n=0", EXAMPLE_TOML, "n = 0"),
        ("model=wls-pgv", EXAMPLE_TOML, "model requires an intensity measure"),
        ("", "[base]\n", "base.dip_deg is missing"),
        ("", "[base\n", "not valid TOML"),
        ("", "base = 3\n", "base = 3 is not a table"),
    ],
)
def test_a_rock_mass_that_is_none_is_rejected(client, query, body, words):
    assert words in rejection(client.post(f"/v1/rockmass?{query}", content=body, headers=TOML))


def test_a_rock_mass_says_how_it_is_written(client):
    answer = client.post(
        "/v1/rockmass", content=EXAMPLE_TOML, headers={"content-type": "text/html"}
    )
    assert "application/toml" in rejection(answer, 415)


@pytest.mark.parametrize("polarity", ["forward", "both"])
def test_a_spectrum_is_answered_as_by_the_command_line(client, written, shell: Shell, polarity):
    file = written("record.csv", RECORD)
    options = ["--p2", "3,1", "--polarity", polarity]
    printed = shell.json("spectrum", file, *options)
    query = f"/v1/spectrum?p2=3,1&polarity={polarity}"
    for answer in (
        client.post(query, content=RECORD),
        client.post(query, files={"file": ("../../etc/passwd", RECORD)}),
    ):
        document = answer.json()
        for item, other in zip(
            *(
                [element] if isinstance(element, dict) else element
                for element in (document, printed)
            ),
            strict=True,
        ):
            del item["diagnostics"]
            # the command line names the file that was given; here there is none
            assert {**other, "motion": "upload", "name": "upload"} == item


def test_the_critical_block_is_answered_as_by_the_command_line(client, written, shell: Shell):
    file = written("record.csv", RECORD)
    printed = shell.json("critical", file, "--p2", "3", "--reverse", "--map")
    assert document(client.post("/v1/critical?p2=3&reverse=true&map=1", content=RECORD)) == printed


def test_a_rectangle_is_searched_and_rated_by_its_numbers(client):
    sides, block = "height=2&width=0.5", Block.rectangle(2.0, 0.5)
    result = client.post(f"/v1/critical?{sides}", content=RECORD).json()
    assert result == client.post(f"/v1/critical?p2={block.p2!r}", content=RECORD).json()
    result = client.post(f"/v1/hazard?{sides}", content=CURVE).json()
    same = client.post(f"/v1/hazard?p2={block.p2!r}&kr=0.25", content=CURVE).json()
    assert "assumed to topple" in result["warnings"][0]
    assert result["annual_rate"] == pytest.approx(same["annual_rate"], rel=1e-9)


def test_an_annual_rate_is_answered_as_by_the_command_line(client, written, shell: Shell):
    file = written("curve.csv", CURVE)
    options = ["--p2", "3", "--kr", "0.1", "--years", "100", "--component", "rotd50"]
    printed = shell.json("hazard", file, *options, "--db", REFERENCE)
    query = "/v1/hazard?p2=3&kr=0.1&years=100&component=rotd50"
    assert document(client.post(query, content=CURVE)) == printed
    assert document(client.post(query, files={"file": ("curve.csv", CURVE)})) == printed


def test_one_trace_of_several_is_asked_for_by_its_number(client, tmp_path):
    rng = np.random.default_rng(1)
    motions = [GroundMotion(rng.normal(0.0, 0.1, 400), 0.01, component=c) for c in ("N", "E")]
    export_motions(motions, tmp_path / "two.csv")
    body = (tmp_path / "two.csv").read_bytes()
    rejected = client.post("/v1/spectrum", content=body)
    assert "holds 2 traces: give one of  0 (N), 1 (E)" in rejection(rejected)
    assert rejected.json()["traces"] == ["N", "E"]
    for i, motion in enumerate(motions):
        result = client.post(f"/v1/spectrum?trace={i}", content=body).json()
        assert result["pgv_m_s"] == motion.pgv_m_s


@pytest.mark.parametrize(
    ("query", "body", "words"),
    [
        ("p2=3", "no record at all", "unknown format"),
        ("p2=3", "time_s,acceleration_g\n0,0\n0.1,x\n", "the file, line 3"),
        ("p2=3", "0.1\n0.2\n0.3\n", "unit"),
        ("p2=3&units=g", "0.1\n0.2\n0.3\n", "no sampling interval"),
        ("p2=3&units=gal", RECORD, "units = 'gal': it must be g or m/s2 or cm/s2 or mm/s2"),
        ("p2=3&trace=1", RECORD, "has no trace 1: give one of  0"),
        ("p2=0", RECORD, "p2"),
        ("p2=", RECORD, "p2 = '' is not"),
        ("p2=3&dt=-1&units=g", "0.1\n0.2\n", "dt = -1 is not above 0"),
    ],
)
def test_an_accelerogram_that_is_none_is_rejected(client, query, body, words):
    for path in ("spectrum", "critical"):
        assert words in rejection(client.post(f"/v1/{path}?{query}", content=body))


@pytest.mark.parametrize(
    ("query", "body", "words"),
    [
        ("p2=3&kr=0.1", "no curve at all", "the file"),
        ("p2=3&kr=0.1&imt=SA(9)", CURVE, "there is no curve of SA(9)"),
        ("p2=3&kr=0.1&convert=none", CURVE, "none"),
        ("p2=3&kr=0.1&years=-1", CURVE, "years = -1"),
        ("p2=3&kr=-0.1", CURVE, "kr"),
        ("p2=nan&kr=0.1", CURVE, "p2"),
    ],
)
def test_a_curve_that_is_none_is_rejected(client, query, body, words):
    assert words in rejection(client.post(f"/v1/hazard?{query}", content=body))


def test_rows_are_answered_alike_however_many_there_are(client):
    kr = np.random.default_rng(2).uniform(0.02, 0.3, 6000).tolist()
    few, more, most = (
        client.post("/v1/predict", json={"p2": 3.0, "kr": kr[:n], "pgv": 0.6}).json()
        for n in (60, 600, 6000)
    )
    assert len(most["probability"]) == 6000
    assert most["probability"][:600] == more["probability"]
    assert more["probability"][:60] == few["probability"]
    assert few["warnings"] == more["warnings"] == most["warnings"]


def test_more_rows_than_the_limit_are_rejected(client):
    answer = client.post("/v1/predict", json={"p2": 3.0, "kr": [0.1] * 6001, "pgv": 0.6})
    assert "the maximum per request is 6000" in rejection(answer)


def test_hazard_answers_for_free_standing_blocks(client):
    free_standing = "component=single&kind=rocking"
    backed = client.post("/v1/hazard?p2=7&kr=0.2&component=single", content=CURVE).json()
    expected = client.post(f"/v1/hazard?p2=7&kr=0.2&{free_standing}", content=CURVE).json()
    loses = client.post(
        f"/v1/hazard?p2=7&kr=0.2&restitution=0.8&{free_standing}", content=CURVE
    ).json()
    assert expected["model"].startswith("rocking")
    assert backed["annual_rate"] < loses["annual_rate"] < expected["annual_rate"]
    sides = client.post(f"/v1/hazard?height=2&width=0.5&{free_standing}", content=CURVE).json()
    assert sides["annual_rate"] > 0.0
    wrong = client.post(f"/v1/hazard?p2=7&kr=0.2&restitution=1.5&{free_standing}", content=CURVE)
    assert wrong.status_code == 422
