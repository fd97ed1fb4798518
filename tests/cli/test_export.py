"""`rbfrag export`: what other tools get is what `predict` answers."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import rbfrag
from rbfrag.db.engine import opened_database
from rbfrag.db.models import save_model
from rbfrag.errors import InputError
from rbfrag.exchange.nrml import read_nrml
from rbfrag.exchange.pelicun_table import read_pelicun
from tests.cli.conftest import Shell
from tests.fragility.conftest import model_row
from tests.hazards.conftest import measure_row

BLOCKS = "block_id,p2_1_s2,kr\nA7,3,0.1\nB2,10,0.3\n"


@pytest.fixture
def database(shell: Shell) -> None:
    with opened_database("rbfrag.db", create=True) as engine, engine.begin() as connection:
        save_model(connection, model_row())
        save_model(connection, measure_row("pga"))
        save_model(connection, measure_row("sa"))


@pytest.mark.usefixtures("database")
def test_nrml_of_several_blocks(shell: Shell) -> None:
    Path("blocks.csv").write_text(BLOCKS)
    document = shell.json("export", "nrml", "--blocks", "blocks.csv", "--out", "a.xml")
    assert (document["functions"], document["model"]) == (2, "wls-pgv")
    parsed = read_nrml("a.xml")
    assert [f.name for f in parsed] == ["A7", "B2"]
    x = np.linspace(0.3, 1.4, 50)
    expected = rbfrag.predict(3.0, 0.1, pgv_m_s=x).probability
    assert (
        np.abs(parsed[0].at(x) - expected).max() < 1.2 * document["largest_relative_error"] + 1e-6
    )


@pytest.mark.usefixtures("database")
def test_pelicun_of_one_block_in_pga(shell: Shell) -> None:
    document = shell.json(
        "export", "pelicun", "--p2", "3", "--kr", "0.1", "--imt", "PGA",
        "--levels", "300", "--name", "boulder", "--out", "a.csv",
    )  # fmt: skip
    (parsed,) = read_pelicun("a.csv")
    assert (parsed.name, parsed.kind.measure) == ("boulder", "pga_g")
    x = np.linspace(0.4, 1.8, 50)
    expected = rbfrag.predict(3.0, 0.1, pga_g=x).probability
    assert np.abs(parsed.at(x) - expected).max() < 1.2 * document["largest_relative_error"] + 1e-5


def test_functions_of_free_standing_blocks(shell: Shell, rejects: Callable[..., str]) -> None:
    Path("blocks.csv").write_text("p2_1_s2,kr,restitution\n3,0.1,0.8\n10,0.3,\n")
    rocking = ("--kind", "rocking", "--levels", "300")
    document = shell.json("export", "nrml", "--blocks", "blocks.csv", *rocking, "--out", "a.xml")
    shell.json(
        "export", "pelicun", "--p2", "3", "--kr", "0.1", "--restitution", "0.8", *rocking,
        "--out", "a.csv",
    )  # fmt: skip
    bouncing, reference = read_nrml("a.xml")
    (alone,) = read_pelicun("a.csv")
    x = np.geomspace(0.1, 3.0, 50)
    for result, block in (
        (bouncing, (3.0, 0.1, 0.8)),
        (alone, (3.0, 0.1, 0.8)),
        (reference, (10, 0.3)),
    ):
        p2, kr, *restitution = block
        expected = rbfrag.predict(
            p2, kr, kind="rocking", restitution=restitution[0] if restitution else None, pgv_m_s=x
        ).probability
        assert (
            np.abs(result.at(x) - expected).max() < 1.2 * document["largest_relative_error"] + 1e-5
        )
    assert "Overturning of free-standing rock blocks" in Path("a.xml").read_text()
    assert "that is free-standing" in json.loads(Path("a.json").read_text())["block"]["Description"]
    backed = ("export", "nrml", "--p2", "3", "--kr", "0.1", "--out", "b.xml")
    message = rejects(*backed, "--restitution", "0.8", "--kind", "toppling")
    assert "--restitution cannot be combined with kind toppling" in message
    with pytest.raises(InputError, match="shares require a rock mass"):
        rbfrag.export.nrml("b.xml", 3.0, 0.1, kind="rocking", shares=[50.0])


@pytest.mark.usefixtures("database")
def test_nrml_of_a_spectral_acceleration(shell: Shell) -> None:
    for imt in ("SA(1.0)", "SA(1)"):
        document = shell.json(
            "export", "nrml", "--p2", "3", "--kr", "0.1", "--imt", imt, "--out", "a.xml"
        )
        assert document["term"] == "sa"
    (parsed,) = read_nrml("a.xml")
    assert (parsed.kind.measure, parsed.kind.period_s) == ("sa_g", 1.0)
    x = np.linspace(0.2, 2.0, 50)
    expected = rbfrag.predict(3.0, 0.1, sa_g={1.0: x}).probability
    assert np.abs(parsed.at(x) - expected).max() < 1.2 * document["largest_relative_error"] + 1e-5


@pytest.mark.usefixtures("database")
def test_an_exported_curve_is_drawn_beside_its_origin(
    shell: Shell, rejects: Callable[..., str]
) -> None:
    block = ("--p2", "3", "--kr", "0.1")
    shell("export", "nrml", *block, "--name", "boulder", "--out", "a.xml")
    shell("plot", "curve", *block, "--compare", "a.xml", "--out", "a.svg")
    assert "boulder, toppled" in Path("a.svg").read_text()
    shell("export", "pelicun", *block, "--imt", "PGA", "--out", "a.csv")
    message = rejects("plot", "curve", *block, "--compare", "a.csv", "--out", "b.svg")
    assert "no fragility over pgv_m_s; there are PGA" in message


def test_a_lognormal_model_is_written_as_such(shell: Shell) -> None:
    of_line = model_row(
        "pgv", name="lognormal-pgv", method="lognormal",
        coefficients={"ln_median": -0.41, "slope": 0.95, "ln_sigma": -1.25},
        covariance=tuple(tuple(1e-3 * (i == j) for j in range(3)) for i in range(3)),
    )  # fmt: skip
    with opened_database("line.db", create=True) as engine, engine.begin() as connection:
        save_model(connection, of_line)
    options = ("--p2", "3", "--kr", "0.1", "--db", "line.db")
    for kind, file in (("nrml", "a.xml"), ("pelicun", "a.csv")):
        document = shell.json("export", kind, *options, "--out", file)
        assert (document["lognormal"], document["largest_relative_error"]) == (1, 0.0)
    (nrml,), (pelicun,) = read_nrml("a.xml"), read_pelicun("a.csv")
    x = np.geomspace(0.1, 5.0, 200)
    expected = rbfrag.predict(3.0, 0.1, pgv_m_s=x, db="line.db").probability
    for result in (nrml, pelicun):
        assert result.is_lognormal
        assert np.abs(result.at(x) - expected).max() < 2e-9


@pytest.mark.usefixtures("database")
def test_a_rock_mass_is_the_mean_of_its_toppling_blocks(shell: Shell) -> None:
    Path("mass.toml").write_text(
        "realisations = 300\nseed = 2\n[base]\ndip_deg = 5.0\n"
        'spacing_m = { distribution = "uniform", low = 1.0, high = 2.0 }\n'
        "[back]\ndip_deg = 85.0\nspacing_m = 0.4\n[friction]\nphi_deg = 40.0\n"
    )
    document = shell.json(
        "export", "nrml", "--rockmass", "mass.toml", "--name", "m", "--out", "a.xml"
    )
    (parsed,) = read_nrml("a.xml")
    shell("rockmass", "mass.toml", "--out", "blocks.csv")
    rows = np.genfromtxt("blocks.csv", delimiter=",", names=True, dtype=None, encoding="utf-8")
    rows = rows[(rows["mode"] == "topple") & (rows["kr"] > 0)]
    assert f"{rows.size} stable toppling blocks" in document["warnings"][0]
    x = np.linspace(0.2, 1.4, 30)
    separate = rbfrag.predict(rows["p2_1_s2"][:, None], rows["kr"][:, None], pgv_m_s=x[None, :])
    mean = separate.probability.mean(axis=0)
    assert np.abs(parsed.at(x) - mean).max() < 1.2 * document["largest_relative_error"] + 1e-6


@pytest.mark.usefixtures("database")
def test_a_rock_mass_with_several_limit_states(shell: Shell, rejects: Callable[..., str]) -> None:
    Path("mass.toml").write_text(
        "realisations = 100\nseed = 2\n[base]\ndip_deg = 5.0\n"
        'spacing_m = { distribution = "uniform", low = 1.0, high = 2.0 }\n'
        "[back]\ndip_deg = 85.0\nspacing_m = 0.4\n[friction]\nphi_deg = 40.0\n"
    )
    mass = ("export", "nrml", "--rockmass", "mass.toml", "--name", "face", "--out", "a.xml")
    document = shell.json(*mass, "--shares", "1,10,50")
    assert document["functions"] == 3
    assert [(f.name, f.limit_state) for f in read_nrml("a.xml")] == [
        ("face", f"failed_{share}_percent") for share in (1, 10, 50)
    ]
    assert "'x' is not a number" in rejects(*mass, "--shares", "1,x")
    other = ("export", "nrml", "--p2", "3", "--kr", "0.1", "--out", "b.xml", "--shares", "50")
    assert "--shares" in rejects(*other)


@pytest.mark.usefixtures("database")
def test_pelicun_has_a_description_beside_the_table(shell: Shell) -> None:
    Path("blocks.csv").write_text("block_id,p2_1_s2,kr\nA-7,3,0.1\nB2,10,0.3\n")
    document = shell.json("export", "pelicun", "--blocks", "blocks.csv", "--out", "fragility.csv")
    assert document["description"] == "fragility.json"
    entries = json.loads(Path("fragility.json").read_text())
    assert {"A.7", "B2"} == set(entries) - {"_GeneralInformation", "References"}
    assert "p² = 3 1/s²" in entries["A.7"]["Description"]
    assert [f.name for f in read_pelicun("fragility.csv")] == ["A.7", "B2"]
    assert any("'A-7' is written as 'A.7'" in text for text in document["warnings"])


@pytest.mark.usefixtures("database")
@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--p2", "3", "--kr", "0.1", "--imt", "SA(30)"), "SA(30)"),
        (("--p2", "3", "--kr", "0.1", "--imt", "PGD"), "intensity measure 'PGD' is unknown"),
        (("--p2", "3", "--kr", "0.1", "--levels", "2"), "at least 10"),
        (
            ("--p2", "3", "--kr", "0.1", "--blocks", "b.csv"),
            "--blocks cannot be combined with --p2: give one description of the block",
        ),
        (("--p2", "3"), "--kr is missing"),
        (("--blocks", "none.csv"), "no such file"),
        (("--blocks", "bad.csv"), "line 2 (block A7): kr = -1 is not above zero"),
        (("--blocks", "twice.csv"), "'A7' occurs twice"),
    ],
)
def test_rejections(rejects: Callable[..., str], options: tuple[str, ...], words: str) -> None:
    Path("bad.csv").write_text("block_id,p2_1_s2,kr\nA7,3,-1\n")
    Path("twice.csv").write_text("block_id,p2_1_s2,kr\nA7,3,0.1\nB,3,0.1\nA7,3,0.1\n")
    assert words in rejects("export", "nrml", *options, "--out", "a.xml")
    assert not Path("a.xml").exists()


@pytest.mark.usefixtures("database")
def test_the_suffix_is_checked_first(rejects: Callable[..., str]) -> None:
    assert "unsupported suffix '.csv'; use .xml" in rejects(
        "export", "nrml", "--p2", "3", "--kr", "1", "--out", "a.csv"
    )


def test_spectral_accelerations_of_any_period_are_exported(shell: Shell) -> None:
    for imt, period_s in (("SA(0.3)", 0.3), ("SA(2.0)", 2.0), ("SA(3)", 3.0)):
        shell("export", "nrml", "--p2", "3", "--kr", "0.1", "--imt", imt, "--out", "a.xml")
        (parsed,) = read_nrml("a.xml")
        assert (parsed.kind.measure, parsed.kind.period_s) == ("sa_g", period_s)
        x = np.geomspace(0.05, 3.0, 30)
        expected = rbfrag.predict(3.0, 0.1, sa_g={period_s: x}).probability
        assert np.abs(parsed.at(x) - expected).max() < 1e-4
