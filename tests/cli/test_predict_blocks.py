"""`rbfrag predict --blocks`: workbooks as people write them, and answers on the terminal."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import openpyxl
import pytest

from tests.cli.conftest import Rejects, Shell

ROWS: tuple[tuple[Any, ...], ...] = (
    (None, "Survey of the north wall"),
    (),
    (None, "by", "A. Smith", "2024"),
    (None, "Name", "H (m)", "Width [cm]", None, "Dip", "friction", "remark"),
    (None, "A7", "2,4", 50, None, 3, 35, "loose"),
    (None, None, None, None, None, None, None, " "),
    (None, "B2", 3, 60, "beside", 5, 35),
)
"""A title, rows and columns that are empty, units, a decimal comma, a cell without a header."""

COMMAND = ("--blocks", "survey.xlsx", "--sheet", "north wall")


@pytest.fixture
def book(shell: Shell, tmp_path: Path) -> Path:
    book = openpyxl.Workbook()
    book.active.append(["Contents"])
    sheet = book.create_sheet("north wall")
    for row in ROWS:
        sheet.append(row)
    book.save(tmp_path / "survey.xlsx")
    (tmp_path / "curve.csv").write_text("pgv_m_s,annual_rate\n0.1,0.1\n0.5,0.01\n2,0.0001\n")
    return tmp_path


BACK_FRICTION = "friction on the back face is neglected (conservative)"


def of_one(shell: Shell, height: str, width: str, dip: str) -> Any:
    return shell.json(
        "predict", "--height", height, "--width", width, "--dip", dip, "--phi", "35", "--pgv", ".6"
    )


@pytest.mark.usefixtures("book")
def test_a_sheet_with_titles_is_answered_as_its_blocks_are_alone(shell: Shell) -> None:
    answer = shell.json("predict", *COMMAND, "--pgv", "0.6", "--component", "single")
    assert [row["block_id"] for row in answer["blocks"]] == ["A7", "B2"]
    for row, sides in zip(answer["blocks"], (("2.4", ".5", "3"), ("3", ".6", "5")), strict=True):
        alone = of_one(shell, *sides)
        for name in ("probability", "ci_low", "ci_high"):
            assert row[name] == pytest.approx(alone[name], rel=1e-12)
        assert (row["kind"], row["mode"], row["reason"]) == ("toppling", "topple", "")
    assert answer["warnings"] == [
        BACK_FRICTION,
        "the names of the columns are in row 4: the lines above are ignored",
        "column 5 without a name is ignored and not written",
        "column Width [cm]: converted from cm to m",
        "column ignored: remark",
    ]


@pytest.mark.usefixtures("book")
def test_the_list_on_the_terminal(shell: Shell, monkeypatch: pytest.MonkeyPatch) -> None:
    head, _, table = shell("predict", *COMMAND, "--pgv", "0.6").stdout.partition("\n\n")
    assert head == "All 2 blocks are answered."
    assert "Failures  expected 0.242; 0–1 if one earthquake shakes all blocks" in table
    assert "Model     toppling-pgv; 2 of 2 rows within the fitted range" in table
    assert table[table.index("\n\n") :].splitlines()[2:4] == [
        "block  kind      mode    probability  interval",
        "A7     toppling  topple  1.8 %        0.92–3.2 %",
    ]
    monkeypatch.setattr("rbfrag.exchange.table_answers.SHOWN", 1)
    monkeypatch.setattr("rbfrag.exchange.table_answers.MOST_LISTED", 1)
    assert "... 1 of 2 rows: --out FILE" in shell("predict", *COMMAND, "--pgv", "0.6").stdout
    cut = shell.json("predict", *COMMAND, "--pgv", "0.6")
    assert (cut["rows"], len(cut["blocks"])) == (2, 1)


@pytest.mark.usefixtures("book")
def test_every_command_reads_the_sheet(shell: Shell, rejects: Rejects) -> None:
    answer = shell.json("hazard", "curve.csv", *COMMAND)
    assert [row["block_id"] for row in answer["blocks"]] == ["A7", "B2"]
    shell("survival", "curve.csv", *COMMAND, "--kind", "rocking", "--age", "100")
    shell("export", "pelicun", *COMMAND, "--out", "a.csv")
    first = rejects("predict", "--pgv", "0.6", "--blocks", "survey.xlsx")
    assert "columns are Contents (of the first sheet; the sheets are Sheet, north wall)" in first
    for command in (
        ("predict", "--pgv", "0.6"),
        ("hazard", "curve.csv"),
        ("survival", "curve.csv", "--age", "100"),
        ("shakemap", "grid.xml", "--out", "a.csv"),
        ("losses", "."),
        ("export", "nrml", "--out", "a.xml"),
        ("plot", "modes", "--phi", "30", "--out", "a.png"),
    ):
        message = rejects(*command, "--blocks", "survey.xlsx", "--sheet", "south wall")
        assert "no sheet 'south wall'; the sheets are Sheet, north wall" in message
    Path("a.csv").write_text("p2,kr\n3,0.1\n")
    only = rejects("predict", "--pgv", "0.6", "--blocks", "a.csv", "--sheet", "x")
    assert "only workbooks (.xlsx) have sheets" in only
    assert "--sheet requires --blocks" in rejects("predict", "--p2", "3", "--sheet", "x")


def add_row(path: Path) -> None:
    """Write a block below the example of a template: the same with another name."""
    if path.suffix == ".csv":
        text = path.read_text("utf-8")
        path.write_text(text + text.splitlines()[1].replace("example", "A1") + "\n", "utf-8")
        return
    book = openpyxl.load_workbook(path)
    sheet = book["blocks"]
    sheet.append(["A1", *[cell.value for cell in sheet[2]][1:]])
    book.save(path)


@pytest.mark.parametrize("suffix", ["xlsx", "csv"])
def test_a_template_is_answered(shell: Shell, rejects: Rejects, suffix: str) -> None:
    name = f"blocks.{suffix}"
    assert f"predict --blocks {name}" in shell("block", "--template", name).stdout
    untouched = shell.json("predict", "--blocks", name, "--pgv", "0.6", "--component", "single")
    assert untouched["warnings"] == [BACK_FRICTION, "the only row is 'example' of the template"]
    add_row(Path(name))
    answer = shell.json("predict", "--blocks", name, "--pgv", "0.6", "--component", "single")
    (row,) = answer["blocks"]
    # nothing is said of columns that are empty
    skipped = "the row 'example' of the template is skipped"
    assert answer["warnings"] == [BACK_FRICTION, skipped]
    alone = of_one(shell, "2.4", "0.5", "3")
    assert row["block_id"] == "A1"
    assert row["probability"] == pytest.approx(alone["probability"], rel=1e-12)
    assert "--template cannot be combined with --height" in rejects(
        "block", "--template", name, "--height", "2"
    )
    assert "unsupported suffix '.parquet'; use .xlsx, .csv" in rejects(
        "block", "--template", "a.parquet"
    )
