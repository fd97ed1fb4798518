"""Texts that a spreadsheet would compute: warned of, written as text on request, read back."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from rbfrag.exchange.block_rows import read_blocks
from rbfrag.exchange.table_answers import predict_table
from rbfrag.exchange.tables.csv_file import as_text, as_written, formula_warnings
from rbfrag.exchange.tables.files import write_block_table
from tests.cli.conftest import Shell
from tests.synthetic import shaking, write_at2

TEXTS = [
    "=1+1",
    "+cmd|' /C calc'!A0",
    "-x",
    "@SUM(A1)",
    "block",
    "'quoted'",
    "",
    "-0.5",
    "+1e-3",
    "-",
]
COMPUTED = ["=1+1", "+cmd|' /C calc'!A0", "-x", "@SUM(A1)", "-"]


@pytest.mark.parametrize("text", TEXTS)
def test_there_and_back(text: str) -> None:
    written = as_text(text)
    assert written == (f"'{text}" if text in COMPUTED else text)
    assert as_written(written) == text


def test_a_table_is_read_back(tmp_path: Path) -> None:
    names = np.array([text for text in TEXTS if text], dtype=object)
    columns = {
        "block_id": names,
        "p2_1_s2": np.full(names.size, 3.0),
        "kr": np.full(names.size, 0.1),
    }
    path = write_block_table(columns, tmp_path / "blocks.csv", excel_text=True)
    assert "\n'=1+1,3.0,0.1\n" in path.read_text()
    assert read_blocks(path).require_all()["block_id"].tolist() == names.tolist()
    assert write_block_table(columns, tmp_path / "b.csv").read_text().count("\n=1+1,") == 1


def test_the_first_cell_is_named() -> None:
    (warning,) = formula_warnings({"kr": np.array([-1.0]), "block_id": ["a", "=1+1", "@b"]})
    assert "'=1+1' of the column block_id begins with =" in warning
    assert "excel_text" in warning
    assert formula_warnings({"x": ["-0.5", "a=b"], "y": np.array(["+1"], dtype=object)}) == []


@pytest.mark.parametrize("excel_text", [True, False])
def test_answers_of_a_table(tmp_path: Path, excel_text: bool) -> None:
    source, out = tmp_path / "blocks.csv", tmp_path / "answers.csv"
    source.write_text("name,p2_1_s2,kr,pgv_m_s\n'=1+1,3,0.1,0.5\n-2.5,3,0.1,0.5\nx,3,0.1,0.5\n")
    summary = predict_table(
        source, out, inputs={}, model=None, level=0.95, db=None, excel_text=excel_text
    )
    first, second, _ = out.read_text().splitlines()[1:]
    assert first.replace('"', "").startswith("'=1+1,3" if excel_text else "=1+1,3")
    assert second.replace('"', "").startswith("-2.5,3")
    warnings = summary.warnings
    assert any("excel_text" in text for text in warnings) is not excel_text


def test_every_writer_of_csv_has_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of the database, of a rock mass, of a spectrum; rejected where it would do nothing."""
    monkeypatch.chdir(tmp_path)
    shell = Shell()
    record = write_at2(tmp_path / "=1+1.AT2", shaking(3), station="=1+1")
    shell("motions", "add", record)
    document = shell("db", "export", "--out", "plain", "--format", "csv", "--tables", "motion")
    assert "--excel-text" in document.stdout
    assert ",'=1+1" not in Path("plain/motion.csv").read_text()
    shell("db", "export", "--out", "text", "--format", "csv", "--tables", "motion", "--excel-text")
    assert ",'=1+1" in Path("text/motion.csv").read_text()
    shell("db", "export", "--out", "none", "--excel-text", expect=2)
    for words in ([], ["--excel-text"]):
        shell("spectrum", "=1+1.AT2", "--p2", "3", "--csv", "x.csv", *words)
        assert Path("x.csv").read_text().splitlines()[1].startswith("'=" if words else "=")
    assert "requires --csv" in shell("spectrum", "1", "--excel-text", expect=2).stderr
    mass = Path(__file__).parents[2] / "docs" / "examples" / "rockmass.toml"
    shell("rockmass", mass, "--n", "20", "--out", "blocks.csv", "--excel-text")
    for name in ("blocks.xlsx", "blocks.parquet"):
        document = shell("rockmass", mass, "--n", "20", "--out", name, "--excel-text", expect=2)
        assert f"--excel-text applies to CSV output only, not to {name}" in document.stderr
