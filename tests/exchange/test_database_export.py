"""Tables out of the database: the same values, every unit said, whole or not at all."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow.parquet as parquet
import pytest
from sqlalchemy import Connection, update

import rbfrag
import rbfrag.exchange.database_tables as database_export
from rbfrag.campaign.add_motions import add_motions
from rbfrag.campaign.simulate import simulate
from rbfrag.db import schema
from rbfrag.db.engine import opened_database
from rbfrag.errors import InputError, WorkFailedError
from rbfrag.exchange.database_tables import export_database
from tests.cli.conftest import Rejects, Shell, rejects, shell
from tests.synthetic import shaking, write_suite

__all__ = ["rejects", "shell"]


@pytest.fixture(scope="module")
def database(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("export")
    add_motions([write_suite(folder / "records", 2)], db=folder / "a.db", suite='näme, "s"')
    simulate(folder / "a.db", p2=(10.0, 1.0), jobs=1)
    with opened_database(folder / "a.db") as engine, engine.begin() as connection:
        nothing = schema.combination.update().where(schema.combination.c.id == 1)
        connection.execute(
            nothing.values(status="below_limit", kr_over_pga=None, kr=None, y_m_s=None)
        )
    return folder / "a.db"


def _values(cells: pd.Series, like: pd.Series) -> list[object]:
    """Read the cells of a CSV column without any parser's rounding."""
    if like.dtype.kind == "f":
        return [float(cell or "nan") for cell in cells]
    if like.dtype.kind == "b":
        return [{"true": True, "false": False}[cell] for cell in cells]
    if like.dtype.kind in "iu":
        return [int(cell) if cell else pd.NA for cell in cells]
    # an empty text and a missing one look the same in CSV
    missing = like.isna().tolist()
    return [None if none else cell for cell, none in zip(cells, missing, strict=True)]


def test_data_frames(database: Path) -> None:
    result = rbfrag.read_table("combination", db=database)
    assert len(result) == 8
    assert result["vertical_motion_id"].dtype == pd.Int64Dtype()
    assert result["vertical_motion_id"].isna().all()
    assert result["kr"].isna().sum() == 1
    motions = rbfrag.read_table("motion", db=database, arrays=True)
    np.testing.assert_allclose(motions["samples"][0], shaking(0), atol=1e-7)
    joined = result.merge(motions, left_on="motion_id", right_on="id", suffixes=("", "_motion"))
    ratio = joined["kr"] / joined["pga_g"]
    np.testing.assert_allclose(ratio, joined["kr_over_pga"], rtol=1e-14)
    subset = rbfrag.read_table("motion", db=database, columns=["dt_s", "id"])
    assert list(subset.columns) == ["dt_s", "id"]


@pytest.mark.parametrize("form", ["parquet", "csv"])
def test_what_is_read_back_is_what_is_stored(database: Path, tmp_path: Path, form: str) -> None:
    report = export_database(tmp_path / "out", db=database, format=form)
    assert {p.name for p in (tmp_path / "out").iterdir()} == {
        *(f"{name}.{form}" for name in schema.metadata.tables),
        "data_dictionary.json",
        "data_dictionary.md",
    }
    assert set(report.rows) == set(schema.metadata.tables)
    for table in schema.metadata.tables:
        stored = rbfrag.read_table(table, db=database)
        file = tmp_path / "out" / f"{table}.{form}"
        assert report.rows[table] == len(stored)
        if form == "parquet":
            read = pd.read_parquet(file)
        else:
            cells = pd.read_csv(file, dtype=str, keep_default_na=False)
            read = pd.DataFrame({c: _values(cells[c], stored[c]) for c in cells.columns})
        pd.testing.assert_frame_equal(
            read.astype(stored.dtypes.to_dict()), stored, check_exact=True
        )


def test_parquet_carries_units_and_arrays(database: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    out.mkdir()  # an empty folder is as good as none
    export_database(out, db=database, tables=["motion"], arrays=True)
    table = parquet.read_table(out / "motion.parquet")
    assert table.schema.field("pgv_m_s").metadata[b"unit"] == b"m/s"
    assert not table.schema.field("pgv_m_s").nullable
    assert table.schema.field("tm_s").nullable
    stored = rbfrag.read_table("motion", db=database, arrays=True)["samples"]
    for written, samples in zip(table["samples"].to_pylist(), stored, strict=True):
        np.testing.assert_array_equal(written, samples)
    dictionary = json.loads((out / "data_dictionary.json").read_text())
    assert {t["name"] for t in dictionary["tables"]} == set(schema.metadata.tables)
    assert "| pgv_m_s | number | m/s |" in (out / "data_dictionary.md").read_text()


def test_csv_is_plain(database: Path, tmp_path: Path) -> None:
    export_database(tmp_path / "out", db=database, format="csv", tables=["combination", "suite"])
    with (tmp_path / "out" / "combination.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    (first,) = (row for row in rows if row["kr"] == "")
    assert first["certified"] in ("true", "false")
    assert float(first["p2"]) in (1.0, 10.0)
    with (tmp_path / "out" / "suite.csv").open(newline="", encoding="utf-8") as file:
        assert next(csv.DictReader(file))["name"] == 'näme, "s"'


def test_all_tables_are_of_one_moment(
    database: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write = database_export._write_csv
    copy = tmp_path / "b.db"
    copy.write_bytes(database.read_bytes())

    def meanwhile(connection: Connection, table: str, *rest: object, **about: object) -> int:
        if table == "recording":
            with opened_database(copy) as other, other.begin() as writer:
                writer.execute(update(schema.motion).values(component="late"))
        return write(connection, table, *rest, **about)  # type: ignore[arg-type]

    monkeypatch.setattr(database_export, "_write_csv", meanwhile)
    export_database(tmp_path / "out", db=copy, format="csv")
    assert set(rbfrag.read_table("motion", db=copy)["component"]) == {"late"}
    assert set(pd.read_csv(tmp_path / "out" / "motion.csv", dtype=str)["component"]) == {"090"}


def test_a_full_disk_leaves_nothing(
    database: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write = database_export._write_csv

    def full(connection: Connection, table: str, *rest: object, **about: object) -> int:
        if table == "combination":
            raise OSError(28, "No space left on device")
        return write(connection, table, *rest, **about)  # type: ignore[arg-type]

    monkeypatch.setattr(database_export, "_write_csv", full)
    with pytest.raises(WorkFailedError, match="No space left on device; nothing of it was kept"):
        export_database(tmp_path / "out", db=database, format="csv")
    assert list(tmp_path.iterdir()) == []


def test_rejections(database: Path, tmp_path: Path) -> None:
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "mine.txt").touch()
    for out, options, message in (
        ("full", {}, "the folder is not empty"),
        ("full/mine.txt", {}, "the folder is not empty"),
        ("none/out", {}, "create the folder"),
        ("out", {"format": "xlsx"}, "choose one of parquet, csv"),
        ("out", {"format": "csv", "arrays": True}, "not supported in CSV"),
        ("out", {"tables": ["motions"]}, "unknown table 'motions'"),
        ("out", {"tables": []}, "at least one table"),
    ):
        with pytest.raises(InputError, match=message):
            export_database(tmp_path / out, db=database, **options)  # type: ignore[arg-type]
    assert [path.name for path in tmp_path.iterdir()] == ["full"]


def test_the_command_line(database: Path, shell: Shell, rejects: Rejects) -> None:
    words = ("db", "export", "--db", database, "--out", "out")
    answer = shell.json(*words, "--tables", "motion, suite")
    assert answer == {
        "folder": "out", "format": "parquet", "rows": {"motion": 2, "suite": 1}, "warnings": []
    }  # fmt: skip
    assert "the folder is not empty" in rejects(*words)
    assert "no database" in rejects("db", "export", "--out", "out2")
