"""The example scripts, run as a reader would run them."""

from __future__ import annotations

import os
import re
import runpy
import sqlite3
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from typer.testing import CliRunner

import rbfrag
from rbfrag.cli.main import app
from tests.conftest import ROOT
from tests.synthetic import shaking, write_at2

EXAMPLES = ROOT / "examples"


@pytest.fixture(scope="module")
def database(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A small campaign on made-up records, with a model on PGV."""
    folder = tmp_path_factory.mktemp("examples")
    path = folder / "campaign.db"
    suite = folder / "records"
    suite.mkdir()
    for seed in range(24):
        # strengths that do not follow the periods
        samples = (0.3 + 0.25 * (seed * 5 % 6)) * shaking(seed)
        write_at2(suite / f"{seed}.AT2", samples, event=f"EVENT {seed // 2}", station=f"S{seed}")
    for arguments in (
        ("motions", "add", suite, "--db", path),
        ("simulate", "--p2", "10,3,1", "--jobs", "1", "--db", path),
        ("fit", "--term", "pgv", "--method", "lognormal", "--db", path),
    ):
        result = CliRunner().invoke(app, [str(argument) for argument in arguments])
        assert result.exit_code == 0, result.output
    return path


def run(script: str, *arguments: str | Path) -> str:
    process = subprocess.run(
        [sys.executable, EXAMPLES / script, *arguments],
        capture_output=True, text=True, check=False, timeout=300,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )  # fmt: skip
    assert process.returncode == 0, process.stderr
    return process.stdout


def test_annual_loss(database: Path) -> None:
    printed = run("annual_loss.py", database)
    match = re.search(r"mean annual loss (\d+) EUR \(95 % interval (\d+) to (\d+)\)", printed)
    assert match
    loss, low, high = map(int, match.groups())
    assert 0 < low < loss < high
    rows = [line for line in printed.splitlines() if line.lstrip().startswith("km ")]
    assert len(rows) == 4


def percent(text: str) -> list[float]:
    return [float(value) for value in re.findall(r"([0-9.e+-]+) %", text)]


def test_any_fall_on_the_road(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)  # no database here: the reference answers
    monkeypatch.delenv("RBFRAG_DB", raising=False)
    lines = run("annual_loss.py").splitlines()
    low, high = percent(next(line for line in lines if "any block of the road falls" in line))
    # an earthquake brings down many of the 53 blocks; their rates do not add up to it
    assert 1.1 <= low < high <= 4.3
    sites = [percent(line) for line in lines if ".csv falls:" in line]
    assert len(sites) == 2
    for site, together, apart in sites:
        assert together < site < apart
    assert (low, high) == pytest.approx((sites[0][0], sites[0][0] + sites[1][0]), abs=0.11)
    (wrong,) = percent(next(line for line in lines if line.startswith("not ")))
    assert wrong > 4 * high
    rates = [re.findall(r"[0-9.e-]*[0-9]", line) for line in lines if "bring down any:" in line]
    for rate, together, apart in rates:
        assert float(together) < float(rate) < float(apart)
    # the documentation tells the same
    for page in ("docs/howto/examples.md", "README.md"):
        text = " ".join((ROOT / page).read_text().split())
        assert f"{low:g} to {high:g} % in 50 years" in text, page
        assert f"{wrong:g} %" in text, page


def test_the_road_without_an_estimate_of_what_blocks_share(database: Path, tmp_path: Path) -> None:
    unknown = tmp_path / "unknown.db"
    unknown.write_bytes(database.read_bytes())
    with sqlite3.connect(unknown) as connection:
        connection.execute("UPDATE fragility_model SET dependence = NULL")
    connection.close()
    printed = run("annual_loss.py", unknown)
    assert printed.count("falls: not known (") == 2
    low, high = percent(printed.split("any block of the road falls:")[1].splitlines()[0])
    assert 0.0 < low < high


def test_refit_with_pandas(database: Path) -> None:
    printed = run("refit_with_pandas.py", database)
    match = re.search(r"ln y = (\S+) \+ (\S+) ln PGV .* scatter (\S+)", printed)
    assert match
    # strong shaking brings down strong blocks, about in proportion
    assert 0.5 < float(match.group(2)) < 1.5
    result = rbfrag.read_table("combination", db=str(database)).query("status == 'found'")
    assert f"{len(result)} critical blocks of 12 earthquakes" in printed


def test_refit_with_pandas_on_the_reference() -> None:
    printed = run("refit_with_pandas.py", ROOT / "rbfrag" / "reference" / "reference.db")
    assert "nan" not in printed
    # each motion once: not also with its vertical component
    assert "8625 critical blocks of 100 earthquakes" in printed
    slope = re.search(r"\+ (\S+) ln PGV", printed)
    assert slope
    assert 0.9 < float(slope.group(1)) < 1.1


def test_no_example_prints_what_is_not_a_number(
    database: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    read_table = rbfrag.read_table

    def without_values(name: str, **options: str) -> pd.DataFrame:
        table = read_table(name, **options)
        return table.assign(y_m_s=np.nan) if name == "combination" else table

    monkeypatch.setattr(rbfrag, "read_table", without_values)
    monkeypatch.setattr(sys, "argv", ["refit_with_pandas.py", str(database)])
    with pytest.raises(SystemExit, match="a number is missing"):
        runpy.run_path(str(EXAMPLES / "refit_with_pandas.py"), run_name="__main__")


def test_canterbury(records_dir: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)  # no database here: the reference answers
    monkeypatch.delenv("RBFRAG_DB", raising=False)
    printed = run("canterbury.py", records_dir, "--out", "a.png")
    rows = [line.split() for line in printed.splitlines() if re.match(r" *(HVSC|PARS|DFHS)", line)]
    assert len(rows) == 6
    for row in rows:
        simulated, by_record = float(row[5]), float(row[6])
        assert by_record == pytest.approx(simulated, rel=0.2)
    assert Path("a.png").stat().st_size > 10_000


READ_BACK = """
import pathlib, sys
import dlml
from dlml import _catalog

_catalog.data_root = lambda: pathlib.Path(sys.argv[1])
name = "seismic/rock_slope/component/made up"
assert dlml.list_datasets() == [name]
table, entries = dlml.get_fragility(name), dlml.get_metadata(name, "fragility")
assert list(table.index) == ["block"]
assert table.index.nlevels == 1
assert table[("Demand", "Type")].iloc[0] in dlml.DEMAND_TYPES
assert table[("Demand", "Directional")].iloc[0] == 1
assert table[("LS1", "Family")].iloc[0] in dlml.DISTRIBUTION_FAMILIES
assert set(entries) - {"_GeneralInformation", "References"} == {"block"}
assert set(entries["block"]["LimitStates"]) == {"LS1"}
"""
"""The table as simcenter-dlml reads a data set of its own library."""


def test_the_engine_and_pelicun_get_what_we_answer() -> None:
    python = os.environ.get("RBFRAG_TEST_TOOLS_PYTHON")
    if not python:
        pytest.skip("RBFRAG_TEST_TOOLS_PYTHON names no Python that has openquake-engine, pelicun")
    process = subprocess.run(
        [sys.executable, "-m", "benchmarks.interoperability", python],
        cwd=ROOT, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert process.returncode == 0, process.stdout + process.stderr


def test_pelicun(database: Path, tmp_path: Path) -> None:
    python = os.environ.get("RBFRAG_TEST_PELICUN_PYTHON")
    if not python:
        pytest.skip("RBFRAG_TEST_PELICUN_PYTHON names no Python that has pelicun")
    table = tmp_path / "block.csv"
    arguments = ["export", "pelicun", "--p2", "3", "--kr", "0.1", "--out", str(table), "--db",
                 str(database)]  # fmt: skip
    assert CliRunner().invoke(app, arguments).exit_code == 0
    library = tmp_path / "seismic" / "rock_slope" / "component" / "made up"
    library.mkdir(parents=True)
    table.rename(library / "fragility.csv")
    table.with_suffix(".json").rename(library / "fragility.json")
    table = library / "fragility.csv"
    subprocess.run([python, "-c", READ_BACK, tmp_path], check=True, capture_output=True, text=True)
    for pgv in (0.5, 0.7, 0.9):
        process = subprocess.run(
            [python, EXAMPLES / "pelicun_damage.py", table, str(pgv)],
            capture_output=True, text=True, check=True,
        )  # fmt: skip
        p = rbfrag.predict(3.0, 0.1, pgv_m_s=pgv, db=str(database)).probability
        share = float(process.stdout.split()[-1])
        assert share == pytest.approx(p, abs=4.0 * (p * (1 - p) / 20_000) ** 0.5 + 1e-3)
