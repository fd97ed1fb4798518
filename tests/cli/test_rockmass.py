"""`rbfrag rockmass` and `rbfrag plot modes`: the shell says what the library says."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from rbfrag.db.engine import opened_database
from rbfrag.db.model_file import ModelRow
from rbfrag.db.models import save_model
from rbfrag.rockmasses.counts import crossings, mode_counts
from rbfrag.rockmasses.file import read_rock_mass
from rbfrag.rockmasses.scenario import scenario
from tests.block_tables import read_columns
from tests.cli.conftest import Rejects, Shell

EXAMPLE = Path(__file__).resolve().parent.parent.parent / "docs" / "examples" / "rockmass.toml"

STEEP = """
realisations = 400
[base]
dip_deg = { distribution = "normal", mean = 5, sd = 3 }
spacing_m = 1.0
[back]
dip_deg = { distribution = "normal", mean = 85, sd = 4 }
spacing_m = { distribution = "lognormal", median = 0.5, sd_ln = 0.4 }
[friction]
phi_deg = 35
"""


@pytest.fixture
def mass(tmp_path: Path) -> Path:
    shutil.copy(EXAMPLE, tmp_path / "mass.toml")
    return tmp_path / "mass.toml"


@pytest.fixture
def steep(tmp_path: Path) -> Path:
    (tmp_path / "steep.toml").write_text(STEEP)
    return tmp_path / "steep.toml"


@pytest.fixture
def stored_model(tmp_path: Path) -> None:
    row = ModelRow(
        name="line",
        term="pgv",
        method="wls",
        coefficients={"c0": 0.002, "c1": 0.72, "v0": 4e-5, "v1": 3e-3},
        covariance=tuple(map(tuple, np.diag([1e-6, 4e-4, 1e-10, 1e-7]).tolist())),
        domain={"p2": (0.1, 30.0), "intensity_m_s": (0.02, 1.5)},
        data_fingerprint="0" * 64,
    )
    with (
        opened_database(tmp_path / "rbfrag.db", create=True) as engine,
        engine.begin() as connection,
    ):
        save_model(connection, row)


def test_json_is_the_python_answer(shell: Shell, mass: Path) -> None:
    answer = shell.json("rockmass", mass, "--n", "3000", "--seed", "5")
    result = read_rock_mass(mass).realise(3000, 5)
    counts = mode_counts(result)
    assert (answer["realisations"], answer["seed"]) == (3000, 5)
    assert answer["blocks"] == result.n_blocks
    assert {m: a["count"] for m, a in answer["modes"].items()} == {
        m: c.count for m, c in counts.items()
    }
    assert answer["modes"]["topple"]["yield_g"] is None
    assert [c["pga_g"] for c in answer["crossings"]] == [c.pga_g for c in crossings(result)]
    assert answer["scenario"] is None
    assert answer["variables"]["base.dip_deg"] == "normal, mean 20, sd 5, not truncated"
    assert answer == shell.json("rockmass", mass, "--n", "3000", "--seed", "5")


def test_text_names_shares_crossing_and_impossible(shell: Shell, mass: Path) -> None:
    text = shell("rockmass", mass).stdout
    assert "slide 61 %, slump 39 %" in text
    assert "Counts    equal at a PGA of 0.417 ± 0.0029 g" in text
    assert "more slumps below, more slides above" in text
    assert "Rejected  5 realisations are no block: gamma" in text


@pytest.mark.usefixtures("stored_model")
def test_scenario_covers_what_it_says(shell: Shell, steep: Path) -> None:
    answer = shell.json("rockmass", steep, "--pgv", "1.0", "--level", "0.9")
    expected = scenario(read_rock_mass(steep).realise(), {"pgv_m_s": 1.0}, level=0.9)
    document = answer["scenario"]
    assert (document["model"], document["term"], document["level"]) == ("line", "pgv", 0.9)
    assert document["pgv_m_s"] == 1.0
    total = document["covered_only"]
    assert total["probability"] == expected.covered.probability
    assert total["standard_error"] == expected.covered.standard_error
    assert 0.0 < total["probability"] < 1.0
    assert document["modes"]["topple"]["has_model"]
    assert not document["modes"]["slide"]["has_model"]
    assert document["modes"]["slide"]["probability"] is None
    assert document["uncovered_share"].keys() >= {"slide"}
    result = shell("rockmass", steep, "--pgv", "1.0")
    assert "covered blocks only" in result.stdout
    assert "slide: " in result.stdout
    assert "--displacement, how far is too far [m], gives them" in result.stdout


def test_water_shows_both_bounds(shell: Shell, mass: Path) -> None:
    mass.write_text(mass.read_text().replace("[back]", "[back]\nwater_m = 0.2"))
    question = ("rockmass", mass, "--n", "300", "--pgv", "0.6", "--pga", "0.7")
    question = (*question, "--displacement", "0.05")
    document = json.loads(shell(*question, "--json").stdout)
    total = document["scenario"]["covered_only"]
    assert total["drained"]["probability"] < total["probability"]
    slides = document["modes"]["slide"]
    assert slides["drained"]["yield_g"]["q50"] > slides["yield_g"]["q50"]
    assert any("keeps acting while the block moves" in text for text in document["warnings"])
    assert any("have another mode where their water drains" in t for t in document["warnings"])
    text = shell(*question).stdout
    assert f"Drained: {round(100 * total['drained']['probability'])} %" in text
    for header in ("drained_k_q50_g", "drained interval"):
        assert header in text
    mass.write_text(mass.read_text().replace("[back]", '[back]\ndrainage = "drained"'))
    drained = json.loads(shell(*question, "--json").stdout)
    assert drained["scenario"]["covered_only"]["probability"] == total["drained"]["probability"]
    assert "Drained:" not in shell(*question).stdout


@pytest.mark.usefixtures("stored_model")
@pytest.mark.parametrize("kind", ["csv", "parquet"])
def test_the_table_holds_the_blocks_with_their_answers(
    shell: Shell, steep: Path, tmp_path: Path, kind: str
) -> None:
    out = tmp_path / f"blocks.{kind}"
    command = ("--pgv", "1.0", "--out", out, "--plot", tmp_path / "a.svg")
    warnings = shell.json("rockmass", steep, *command)["warnings"]
    if kind == "csv":
        notes = json.loads(Path(f"{out}-metadata.json").read_text("utf-8"))["notes"]
        assert [note["text"] for note in notes] == warnings
    result = read_rock_mass(steep).realise()
    names = ("block_id", "p2_1_s2", "kr", "weight", "pgv_m_s", "probability")
    columns = read_columns(out, names)
    assert columns["block_id"].tolist() == list(range(1, 401))
    assert np.array_equal(columns["kr"], result.kr_at_rest, equal_nan=True)
    assert set(columns["pgv_m_s"]) == {1.0}
    answer = scenario(result, {"pgv_m_s": 1.0})
    assert np.array_equal(columns["probability"], answer.probability, equal_nan=True)
    assert (tmp_path / "a.svg").read_text().startswith("<?xml")


def test_a_chart_of_a_table_is_that_of_its_rock_mass(shell: Shell, mass: Path) -> None:
    shell("rockmass", mass, "--out", "blocks.csv", "--json")
    common = ("plot", "modes", "--phi", "40", "--beta", "20")
    shell(*common, "--rockmass", mass, "--out", "a.png")
    result = shell(*common, "--blocks", "blocks.csv", "--out", "b.png")
    assert Path("a.png").read_bytes() == Path("b.png").read_bytes()
    assert "5 of 20000 rows have invalid angles" in result.stdout
    shell(*common, "--out", "c.png")
    assert Path("c.png").read_bytes() != Path("a.png").read_bytes()


def test_a_chart_for_another_friction_is_doubted(shell: Shell, mass: Path) -> None:
    text = shell("plot", "modes", "--phi", "35", "--no-back", "--rockmass", mass, "--out", "a.png")
    assert "friction angle of 35 deg, and that of the rock mass is: 40" in text.stdout
    assert "has a back fracture, and the chart none" in text.stdout


def test_a_block_is_drawn(shell: Shell) -> None:
    block = ("block", "--s1", "1", "--s2", "0.6", "--gamma", "25", "--beta", "20", "--phi", "40")
    plain = shell(*block, "--json").stdout
    assert shell(*block, "--plot", "a.pdf", "--json").stdout == plain
    assert Path("a.pdf").read_bytes().startswith(b"%PDF")
    assert json.loads(plain)["mode"] == "slide"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("mass.toml", "--n", "0"), "n = 0"),
        (("mass.toml", "--n", "-5"), "n = -5"),
        (("mass.toml", "--seed", "-1"), "seed = -1"),
        (("mass.toml", "--pgv", "nan"), "--pgv = nan"),
        (("mass.toml", "--pgv", "-1"), "--pgv = -1"),
        (("mass.toml", "--model", "line"), "--model requires an intensity measure"),
        (("mass.toml", "--db", "a.db"), "--db requires --motion or an intensity measure"),
        (("mass.toml", "--pgv", "1", "--level", "2"), "level = 2.0"),
        (("mass.toml", "--out", "a.xls"), "unsupported suffix '.xls'; use .csv, .xlsx, .parquet"),
        (("mass.toml", "--out", "none/a.csv"), "create the folder none"),
        (("mass.toml", "--plot", "a.gif"), "unsupported suffix '.gif'; use .png"),
        (("none.toml",), "no such file"),
        (("steep.toml", "--pgv", "1", "--db", "none.db"), "none.db"),
    ],
)
def test_rejections(
    rejects: Rejects,
    mass: Path,
    steep: Path,
    tmp_path: Path,
    arguments: tuple[str, ...],
    words: str,
) -> None:
    assert words in rejects("rockmass", *arguments)
    assert {path.name for path in tmp_path.iterdir()} == {"mass.toml", "steep.toml"}


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("phi_deg = 35", "phi_deg = 90", "friction.phi_deg: 90 is out of range"),
        ("phi_deg = 35", "phi_deg = nan", "friction.phi_deg: nan is not finite"),
        ("spacing_m = 1.0", "spacing_m = 0.0", "base.spacing_m: 0 is out of range"),
        ("spacing_m = 1.0", "", "base.spacing_m is missing"),
        ("lognormal", "gamma", "back.spacing_m: distribution = 'gamma' is unknown"),
    ],
)
def test_files_are_rejected_with_file_and_key(
    rejects: Rejects, steep: Path, old: str, new: str, words: str
) -> None:
    steep.write_text(STEEP.replace(old, new, 1))
    message = rejects("rockmass", steep)
    assert words in message
    assert "steep.toml" in message


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--phi", "90"), "phi_deg"),
        (
            ("--phi", "35", "--blocks", "a.csv", "--rockmass", "mass.toml"),
            "cannot be combined with",
        ),
        (("--phi", "35", "--blocks", "a.csv"), "a.csv: no such file"),
        (("--phi", "35", "--blocks", "empty.csv"), "no valid block"),
    ],
)
def test_charts_are_rejected(
    rejects: Rejects, mass: Path, tmp_path: Path, arguments: tuple[str, ...], words: str
) -> None:
    (tmp_path / "empty.csv").write_text("alpha1_deg,alpha3_deg\n,\n20,120\n30,10\n")
    assert words in rejects("plot", "modes", *arguments, "--out", "a.png")
    assert not (tmp_path / "a.png").exists()
