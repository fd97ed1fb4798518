"""Values that no column can have: a finding and one sentence each, and no answer from them."""

from __future__ import annotations

import sqlite3
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import Engine
from typer.testing import CliRunner

import rbfrag
from rbfrag.cli.main import app
from rbfrag.db.campaigns import keys_with_samples, stored_combination
from rbfrag.db.check import check_database, coverage
from rbfrag.db.engine import opened_database
from rbfrag.db.location import reference_file
from rbfrag.db.model_file import STORED, ModelRow, read_models
from rbfrag.db.models import model_rows, save_model, set_default
from rbfrag.db.motions import motion_rows
from rbfrag.db.queries import combination_table
from rbfrag.errors import DatabaseError, RbfragError


@pytest.mark.parametrize("value", ["2", "0.5", "-1"])
def test_a_truth_value_is_zero_or_one(sqlite_file: Path, fill: Any, value: str) -> None:
    with opened_database(sqlite_file) as engine, engine.begin() as connection:
        fill(connection, [1])
    _raw(sqlite_file, f"UPDATE motion SET is_vertical = {value} WHERE id = 1")
    with opened_database(sqlite_file, read_only=True) as engine, engine.connect() as connection:
        findings = check_database(connection)
    assert any("is_vertical" in finding.problem for finding in findings)


def test_a_change_of_a_row_does_not_hide_that_it_was_altered(
    sqlite_file: Path, model: ModelRow
) -> None:
    with opened_database(sqlite_file) as engine, engine.begin() as connection:
        save_model(connection, replace(model, name="first", is_default=True))
        save_model(connection, replace(model, name="second", is_default=False))
    _raw(sqlite_file, "UPDATE fragility_model SET covariance = '[[9]]' WHERE name = 'first'")
    with opened_database(sqlite_file) as engine:
        with engine.begin() as connection, pytest.raises(DatabaseError, match="is damaged"):
            set_default(connection, "second")
        with engine.connect() as connection:
            assert {finding.row for finding in check_database(connection)} >= {"first"}
        # what the check advises goes on working
        with engine.begin() as connection:
            save_model(connection, replace(model, name="first"), replace=True)
            set_default(connection, "second")
            assert check_database(connection) == []


@pytest.mark.parametrize(
    ("column", "value"),
    [
        ("motion.dt_s", "'short'"),
        ("motion.samples", "'text'"),
        ("motion.start_time", "'noon'"),
        ("simulation.theta_n", "'x'"),
        ("combination.natural_key", "x'00'"),
    ],
)
def test_the_command_ends_with_findings(
    sqlite_file: Path, fill: Any, column: str, value: str
) -> None:
    with opened_database(sqlite_file) as engine, engine.begin() as connection:
        fill(connection, [1, 2])
    table, _, name = column.partition(".")
    _raw(sqlite_file, f"UPDATE {table} SET {name} = {value} WHERE rowid = 1"
         if table != "simulation" else f"UPDATE {table} SET {name} = {value}")  # fmt: skip
    result = CliRunner().invoke(app, ["db", "check", "--db", str(sqlite_file), "--sample", "9"])
    assert isinstance(result.exception, SystemExit), result.exception
    assert result.exit_code == 1
    assert table in result.output


def test_what_is_not_covered_is_said(filled: Engine) -> None:
    with filled.connect() as connection:
        text = coverage(connection)
    assert "of 15 tables, each column but id by the digest of its row" in text
    assert "measures of 3 motions" in text
    assert "rows deleted, added, or altered with their digest by another program" in text


def _raw(path: Path, *statements: str) -> None:
    with closing(sqlite3.connect(path)) as raw, raw:
        raw.execute("PRAGMA ignore_check_constraints = ON")
        for statement in statements:
            raw.execute(statement)


DAMAGE = {
    "motion.flags": ("'1 2'", "'{'", "'[' || replace(printf('%5000s', ''), ' ', '[')", "7"),
    "motion.remarks": ("'[1'", "'{}'"),
    "motion.processing_applied": ("'['", "'[]'"),
    "motion.pga_g": ("'strong'", "9e999", "x'00'"),
    "motion.npts": ("'many'",),
    "motion.dt_s": ("'short'", "-1"),
    "motion.is_vertical": ("'up'", "2", "-1"),
    "motion.samples": ("'text'", "x'00'"),
    "motion.start_time": ("'noon'",),
    "motion.component": ("cast(x'ff' as text)",),
    "recording.earthquake_id": ("'first'",),
    "combination.settings": ("'['", "'[]'", "'7'"),
    "combination.block": ("'{'",),
    "combination.warnings": ("'{'", "cast(x'ff' as text)"),
    "combination.kr_over_pga": ("'x'",),
    "combination.certified": ("'yes'",),
    "simulation.theta_n": ("'x'",),
    "campaign.settings": ("'{'",),
    "fragility_model.coefficients": ("'{\"slope\": NaN}'", "'[]'", "'7'", "x'ff'"),
    "fragility_model.covariance": ("'[[1e999]]'", "'{}'"),
    "fragility_model.domain": ("'{\"pgv_m_s\": 1}'", "'{'"),
    "fragility_model.diagnostics": ("''", "'[1 2]'"),
    "fragility_model.form": ("'two'",),
    "fragility_model.is_default": ("'maybe'",),
    "fragility_model.leave_out_steps": ("'7'",),
    "fragility_model.dependence": ("'7'",),
}
"""By column, SQL values that no column of its kind can have."""


@pytest.mark.parametrize(
    ("column", "value"), [(column, value) for column in DAMAGE for value in DAMAGE[column]]
)
def test_no_value_ends_in_a_traceback(
    sqlite_file: Path, fill: Any, model: ModelRow, column: str, value: str
) -> None:
    table, _, name = column.partition(".")
    with opened_database(sqlite_file) as engine, engine.begin() as connection:
        fill(connection, [1, 2])
        save_model(connection, model)
    condition = "" if table == "simulation" else "WHERE id = 1"
    _raw(sqlite_file, f"UPDATE {table} SET {name} = {value} {condition}")
    with opened_database(sqlite_file, read_only=True) as engine, engine.connect() as connection:
        findings = check_database(connection)
        # the row itself is named, but where SQLite cannot even hand it out
        expected = "database" if "cast(" in value else table
        assert expected in {finding.table for finding in findings}
        for look in (motion_rows, model_rows, combination_table, stored_combinations):
            try:
                look(connection)
            except RbfragError as error:
                assert str(error).isprintable()  # noqa: PT017


def stored_combinations(connection: Any) -> None:
    for key in keys_with_samples(connection, numerics_version="2")[:3]:
        stored_combination(connection, key)


@pytest.mark.parametrize("column", [name for name in STORED if name not in ("name", "digest")])
def test_every_prediction_verifies_its_model(tmp_path: Path, column: str) -> None:
    shipped = reference_file()
    assert shipped is not None
    row = next(row for row in read_models(shipped) if row.is_default and row.kind == "toppling")
    path = tmp_path / "models.db"
    with opened_database(path, create=True) as engine, engine.begin() as connection:
        save_model(connection, row)
    shaking = {"pgv_m_s": 0.5, "pga_g": 0.4, "sa_g": {1.0: 0.4, 3.0: 0.1}}
    assert 0.0 < rbfrag.predict(3.0, 0.1, **shaking, db=path).probability < 1.0
    altered = {"form": "form + 1", "is_default": "NOT is_default"}.get(column, f"{column} || ' '")
    _raw(path, f"UPDATE fragility_model SET {column} = {altered}")
    with pytest.raises(DatabaseError, match=f"model {row.name} is damaged .*its digest differs"):
        rbfrag.predict(3.0, 0.1, **shaking, db=path)
    with opened_database(path, read_only=True) as engine, engine.connect() as connection:
        assert {finding.table for finding in check_database(connection)} == {"fragility_model"}
