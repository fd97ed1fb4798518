"""Rows of a table of blocks that cannot be used, command by command."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import rbfrag
from rbfrag.db.engine import opened_database
from rbfrag.db.models import save_model
from tests.cli.conftest import Rejects, Shell
from tests.exchange.openquake_job import write_job
from tests.exchange.test_shakemap_grid import GRID
from tests.fragility.conftest import model_row

UNUSED = ("--ignore-columns", "weight")
HEAD = "block_id,p2_1_s2,kr,mode,kind,weight,loss,site_id,lon,lat,pgv_m_s\n"
SOUND = {
    "A": "A,3,0.1,topple,,1,100,0012,20.0,40.5,0.6\n",
    "C": "C,4,0.08,,toppling,,,007,20.5,40.5,0.6\n",
}
BAD = {
    "empty": "B,3,,topple,,1,100,0012,20.0,40.5,0.6\n",
    "NaN": "B,nan,0.1,topple,,1,100,0012,20.0,40.5,0.6\n",
    "negative": "B,-3,0.1,topple,,1,100,0012,20.0,40.5,0.6\n",
    "text": "B,3,n/a,topple,,1,100,0012,20.0,40.5,0.6\n",
    "mode": "B,3,0.1,slide,,1,100,0012,20.0,40.5,0.6\n",
    "kind": "B,3,0.1,topple,sliding,1,100,0012,20.0,40.5,0.6\n",
    "short": "B,3,0.1\n",
}
MESSAGE = "1 of 3 blocks could not be used"
SINGLE = ("--component", "single")


@pytest.fixture
def tables(shell: Shell) -> None:
    """A table with one bad row, the table without it, and what the commands read beside."""
    write_job(Path("job"))
    Path("grid.xml").write_text(GRID.replace(" 10 5", " 60 40"))
    x = np.geomspace(0.01, 10.0, 20)
    lines = [f"{a!r},{b!r}" for a, b in zip(x.tolist(), (1e-3 * x**-2).tolist(), strict=True)]
    Path("curve.csv").write_text("\n".join(["pgv_m_s,annual_rate", *lines]))
    Path("sound.csv").write_text(HEAD + "".join(SOUND.values()))
    with opened_database("rbfrag.db", create=True) as engine, engine.begin() as connection:
        save_model(connection, model_row())


def rows_of(name: str) -> list[dict[str, str]]:
    with Path(name).open(newline="") as file:
        return list(csv.DictReader(file))


def without_texts(document: dict[str, Any]) -> dict[str, Any]:
    """An answer without warnings, reasons and the row that could not be used."""
    return {
        name: [{k: v for k, v in row.items() if k != "reason"} for row in value
               if row["block_id"] != "B"] if name == "blocks" else value
        for name, value in document.items() if name not in ("warnings", "file")
    }  # fmt: skip


@pytest.mark.usefixtures("tables")
@pytest.mark.parametrize("kind", BAD)
@pytest.mark.parametrize(
    ("command", "value"),
    [
        (("predict", *UNUSED, "--batch"), "probability"),
        (("hazard", "curve.csv", *SINGLE, *UNUSED, "--blocks"), "annual_rate"),
        (("shakemap", "grid.xml", *SINGLE, "--blocks"), "probability"),
    ],
)
def test_a_bad_row_comes_back_with_its_reason(
    shell: Shell, command: tuple[str, ...], value: str, kind: str
) -> None:
    Path("b.csv").write_text(HEAD + SOUND["A"] + BAD[kind] + SOUND["C"])
    answer = shell.json(*command, "b.csv", "--out", "out.csv")
    (message,) = (text for text in answer["warnings"] if "could not be used" in text)
    assert message.startswith(MESSAGE)
    assert "the reasons stand in the column reason; it is line 3" in message
    first, bad, last = rows_of("out.csv")
    assert [row["block_id"] for row in (first, bad, last)] == ["A", "B", "C"]
    assert (bad[value], first["reason"], last["reason"]) == ("", "", "")
    assert bad["reason"] in message
    assert len(bad["reason"]) > 10
    expected = shell.json(*command, "sound.csv", "--out", "sound-out.csv")
    for row, same in zip((first, last), rows_of("sound-out.csv"), strict=True):
        assert row == same
    if command[0] == "predict":
        assert (answer["rows"], answer["answered"], answer["without_answer"]) == (3, 2, 1)
        return
    assert "lower bounds" in message
    assert without_texts(answer) == without_texts(expected)
    assert "Traceback" not in shell(*command, "b.csv", "--out", "out.csv").stderr


@pytest.mark.usefixtures("tables")
@pytest.mark.parametrize("kind", [*BAD, "site", "loss", "weight"])
def test_losses_leave_a_bad_row_out(shell: Shell, kind: str) -> None:
    other = {
        "site": "B,3,0.1,,,1,100,,20.0,40.5,0.6\n", "loss": "B,3,0.1,,,1,-5,0012,20,40.5,0.6\n",
        "weight": "B,3,0.1,,,some,100,0012,20.0,40.5,0.6\n",
    }  # fmt: skip
    Path("b.csv").write_text(HEAD + SOUND["A"] + {**BAD, **other}[kind] + SOUND["C"])
    command = ("losses", "job", *SINGLE, "--samples", "20", "--blocks")
    answer, expected = shell.json(*command, "b.csv"), shell.json(*command, "sound.csv")
    assert without_texts(answer) == without_texts(expected)
    first, bad, last = answer["blocks"]
    assert [row["block_id"] for row in (first, bad, last)] == ["A", "B", "C"]
    assert bad["average_annual_failures"] is bad["average_annual_loss"] is None
    assert (first["reason"], last["reason"]) == ("", "")
    message = [text for text in answer["warnings"] if text not in expected["warnings"]]
    assert len(message) == 1
    assert message[0].startswith(f"{MESSAGE} and are left out of all sums, which are lower bounds")
    assert bad["reason"] in message[0]
    assert any("1 of 2 blocks have no loss and count as 0" in text for text in answer["warnings"])
    assert (first["average_annual_loss"] > 0.0, last["average_annual_loss"]) == (True, None)
    assert rbfrag.losses("job", "b.csv", component="single", samples=20).as_dict() == answer
    printed = shell(*command, "b.csv")
    assert "reason" in printed.stdout
    assert "reason" not in shell(*command, "sound.csv").stdout


@pytest.mark.usefixtures("tables")
@pytest.mark.parametrize("command", ["survival", "export"])
def test_answers_that_need_every_row_name_all_that_are_bad(
    shell: Shell, rejects: Rejects, command: str
) -> None:
    Path("b.csv").write_text(HEAD + SOUND["A"] + "".join(BAD.values()) + SOUND["C"])
    inputs: dict[str, tuple[str, ...]] = {
        "survival": (
            "survival",
            "curve.csv",
            *SINGLE,
            *UNUSED,
            "--kind",
            "toppling",
            "--age",
            "100",
        ),
        "export": ("export", "nrml", *UNUSED, "--out", "a.xml"),
    }
    message = rejects(*inputs[command], "--blocks", "b.csv")
    assert "7 of 9 blocks are invalid" in message
    assert "line 3 (block B)" in message
    assert "correct or remove these rows" in message
    assert len(message) < 500
    assert not Path("a.xml").exists()
    shell(*inputs[command], "--blocks", "sound.csv")


@pytest.mark.usefixtures("tables")
def test_only_a_table_without_a_block_is_rejected(shell: Shell, rejects: Rejects) -> None:
    Path("b.csv").write_text(HEAD + "".join(BAD.values()))
    for inputs in (
        ("predict", "--batch", "b.csv", "--out", "o.csv", *UNUSED),
        ("hazard", "curve.csv", "--blocks", "b.csv", "--out", "o.csv", *UNUSED),
        ("shakemap", "grid.xml", "--blocks", "b.csv", "--out", "o.csv"),
        ("losses", "job", "--blocks", "b.csv"),
    ):
        message = rejects(*inputs)
        assert "b.csv: none of 7 blocks is valid, the first 6: line 2" in message
        assert not Path("o.csv").exists()


@pytest.mark.usefixtures("tables")
def test_one_block_of_a_table_keeps_its_name(shell: Shell) -> None:
    Path("b.csv").write_text(HEAD + BAD["empty"] + SOUND["C"])
    answer = shell.json("hazard", "curve.csv", "--blocks", "b.csv", *UNUSED)
    bad, sound = answer["blocks"]
    assert (bad["block_id"], bad["annual_rate"]) == ("B", None)
    assert (sound["block_id"], sound["reason"]) == ("C", "")
    assert answer["expected_failures_per_year"] == sound["annual_rate"] == answer["annual_rate_any"]
    assert "reason" in shell("hazard", "curve.csv", "--blocks", "b.csv", *UNUSED).stdout


@pytest.mark.usefixtures("tables")
def test_points_that_cannot_be_used_stay_on_the_map(shell: Shell) -> None:
    rows = [SOUND["A"], BAD["text"], "D,3,0.1,,,,,,,,\n", "E,3,0.1,,,,,,30.0,40.5,\n"]
    Path("b.csv").write_text(HEAD + "".join(rows))
    command = ("shakemap", "grid.xml", *SINGLE, "--blocks", "b.csv", "--plot", "a.svg", "--out")
    answer = shell.json(*command, "a.geojson")
    features = json.loads(Path("a.geojson").read_text())["features"]
    assert [feature["properties"]["block_id"] for feature in features] == ["A", "B", "D", "E"]
    positions = [feature["geometry"] and feature["geometry"]["coordinates"] for feature in features]
    assert positions == [[20.0, 40.5], [20.0, 40.5], None, [30.0, 40.5]]
    expected = [feature["properties"]["probability"] is not None for feature in features]
    assert expected == [True, False, False, False]
    assert features[3]["properties"]["reason"] == "the block lies off the map"
    assert answer["places"] == 1
    assert answer["expected_failures"] == features[0]["properties"]["probability"]
    same = rbfrag.shakemap("grid.xml", blocks="b.csv", component="single")
    assert {name: answer[name] for name in same.as_dict()} == same.as_dict()
    assert same.to_frame()["reason"].tolist() == [e["properties"]["reason"] for e in features]
    raw = pytest.importorskip("pyogrio.raw")
    shell(*command, "a.gpkg")
    meta, _, geometry, columns = raw.read("a.gpkg", layer="toppling_probability")
    assert [feature is None for feature in geometry] == [False, False, True, False]
    assert np.isnan(columns[list(meta["fields"]).index("probability")]).tolist() == [
        False, True, True, True,
    ]  # fmt: skip


@pytest.mark.usefixtures("tables")
def test_the_mean_of_a_table_says_which_rows_it_is_without(shell: Shell) -> None:
    Path("b.csv").write_text("p2_1_s2,kr\n3,0.1\n3,x\n10,0.3\n3,\n")
    Path("s.csv").write_text("p2_1_s2,kr\n3,0.1\n10,0.3\n")
    result, expected = (
        shell.json("shakemap", "grid.xml", *SINGLE, "--blocks", name, "--out", "a.csv")
        for name in ("b.csv", "s.csv")
    )
    (message,) = (text for text in result["warnings"] if text not in expected["warnings"])
    assert message.startswith(
        "2 of 4 blocks could not be used and are left out of the mean: line 3:"
    )
    assert "; line 5: kr is not a number" in message
    assert result["expected_failures"] == expected["expected_failures"]


@pytest.mark.usefixtures("tables")
def test_arrays_in_python_are_answered_as_tables() -> None:
    p2, kr = [3.0, 3.0, np.nan, 10.0], [0.1, -0.1, 0.1, 0.3]
    answer = rbfrag.hazard("curve.csv", p2, kr, component="single")
    sound = rbfrag.hazard("curve.csv", [3.0, 10.0], [0.1, 0.3], component="single")
    assert np.isnan(answer.annual_rate).tolist() == [False, True, True, False]
    assert answer.annual_rate[[0, 3]].tolist() == sound.annual_rate.tolist()
    assert answer.annual_rate_any == sound.annual_rate_any
    assert answer.expected_failures_per_year == sound.expected_failures_per_year
    assert [bool(text) for text in answer.reason] == [False, True, True, False]
    assert answer.to_frame()["reason"].tolist() == answer.reason.tolist()
    (message,) = (
        text for text in answer.warnings if text not in sound.warnings and "could" in text
    )
    assert message.startswith("2 of 4 blocks could not be used and are left out of all sums")
    assert "element 1: kr = -0.1 is not above zero" in message
    with pytest.raises(rbfrag.InputError, match=r"^kr = -0\.1 is not above zero"):
        rbfrag.hazard("curve.csv", 3.0, -0.1)
    with pytest.raises(rbfrag.InputError, match="none of 2 blocks is valid: element 0: p2 = 0"):
        rbfrag.hazard("curve.csv", [0.0, np.nan], 0.1)
    with pytest.raises(
        rbfrag.InputError, match=r"2 of 4 blocks.*that all of them stand.*element 1.*element 2"
    ):
        rbfrag.survival("curve.csv", p2, kr, kind="toppling", age_years=100.0)
    with pytest.raises(rbfrag.InputError, match=r"2 of 4 blocks.*row 2: kr = -0\.1.*row 3: p2"):
        rbfrag.export.nrml("a.xml", p2, kr)


@pytest.mark.usefixtures("tables")
def test_blocks_of_sites_without_a_curve_have_their_reason(
    shell: Shell, rejects: Rejects, formats_dir: Path
) -> None:
    curve = (
        formats_dir
        / "openquake_classical_logic_tree/three_realizations/hazard_curve-mean-PGV_7.csv"
    )
    head = "block_id,p2_1_s2,kr,site_id\n"
    Path("b.csv").write_text(head + "A,3,0.1,SLIDE-A\nB,10,0.2,12\nC,3,0.2,0012\nD,3,,0012\n")
    answer = shell.json("hazard", curve, "--blocks", "b.csv", *SINGLE, "--out", "o.csv")
    assert [row["block_id"] for row in answer["blocks"]] == ["A", "B", "C", "D"]
    assert "stands at site '12', of which there is no curve" in answer["blocks"][1]["reason"]
    assert any(text.startswith("2 of 4 blocks could not be used") for text in answer["warnings"])
    assert [row["site"] for row in rows_of("o.csv")] == ["SLIDE-A", "12", "0012", "0012"]
    only = shell.json("hazard", curve, "--blocks", "b.csv", *SINGLE, "--site", "0012")
    assert [row["block_id"] for row in only["blocks"]] == ["C", "D"]
    Path("b.csv").write_text(head + "B,10,0.2,12\n")
    assert "stands at site '12'" in rejects("hazard", curve, "--blocks", "b.csv")


def test_a_chart_shows_the_blocks_that_it_can(shell: Shell) -> None:
    Path("b.csv").write_text("alpha1_deg,alpha3_deg\n-20,20\nsteep,20\n,20\n-30,10\n")
    process = shell("plot", "modes", "--phi", "30", "--blocks", "b.csv", "--out", "a.svg")
    assert "2 of 4 rows have invalid angles and are not shown" in process.stdout
