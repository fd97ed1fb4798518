"""Models come back to the bit, over SQLAlchemy and over the fast reader alike."""

from __future__ import annotations

import os
import sqlite3
import subprocess
import sys
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from sqlalchemy import Engine, update

from rbfrag.db import schema
from rbfrag.db.check import check_database
from rbfrag.db.engine import opened_database
from rbfrag.db.insert import table_digests
from rbfrag.db.model_file import COLUMNS, STORED, ModelRow, decode_model, encode_model, read_models
from rbfrag.db.models import load_model, model_rows, save_model, set_default
from rbfrag.errors import (
    DatabaseError,
    DatabaseNotFoundError,
    InputError,
    NotADatabaseError,
    SchemaVersionError,
    UnknownModelError,
)

HEAVY = ("pandas", "statsmodels", "scipy", "numba", "matplotlib", "sqlalchemy", "alembic", "numpy")

finite = st.floats(allow_nan=False, allow_infinity=False)


class TestStore:
    def test_round_trip(self, engine: Engine, model: ModelRow) -> None:
        with engine.begin() as connection:
            stored = save_model(connection, model)
            assert load_model(connection, model.name) == stored
            assert load_model(connection) == stored
        assert stored == model  # without a score it is no default, and answers all the same
        assert list(stored.coefficients) == list(model.coefficients)

    def test_a_chosen_default_stays_until_another_is_chosen(
        self, engine: Engine, model: ModelRow
    ) -> None:
        with engine.begin() as connection:
            for name in ("b", "a"):
                save_model(connection, replace(model, name=name))
            # without scores what is asked decides
            assert [m.name for m in model_rows(connection) if m.is_default] == []
            save_model(connection, replace(model, name="c", is_default=True))
            assert [m.name for m in model_rows(connection) if m.is_default] == ["c"]
            set_default(connection, "a")
            assert [m.name for m in model_rows(connection) if m.is_default] == ["a"]

    def test_a_name_is_not_taken_twice(self, engine: Engine, model: ModelRow) -> None:
        with engine.begin() as connection:
            save_model(connection, replace(model, is_default=True))
            save_model(connection, replace(model, name="other"))
            with pytest.raises(InputError, match="exists: choose another name"):
                save_model(connection, replace(model, term="pga_tm"))
            assert load_model(connection).term == "pgv"
            replaced = save_model(connection, replace(model, term="pga_tm"), replace=True)
            assert replaced.term == "pga_tm"
            assert replaced.is_default
            assert len(model_rows(connection)) == 2

    def test_time_of_creation_is_filled_in(self, engine: Engine, model: ModelRow) -> None:
        with engine.begin() as connection:
            assert save_model(connection, replace(model, created="")).created.endswith("+00:00")

    def test_unknown_names(self, engine: Engine, model: ModelRow) -> None:
        with engine.begin() as connection:
            with pytest.raises(UnknownModelError, match="holds no model yet"):
                load_model(connection)
            save_model(connection, model)
            with pytest.raises(UnknownModelError, match=r"'x'.*it holds: pgv-wls"):
                load_model(connection, "x")
            with pytest.raises(UnknownModelError, match=r"it holds: pgv-wls"):
                set_default(connection, "x")
            assert load_model(connection).name == "pgv-wls"

    @pytest.mark.parametrize(
        "change",
        [
            {"name": " "},
            {"name": "a\x00b"},
            {"name": "a\udcff"},
            {"coefficients": {"slope": float("nan"), "intercept": 0.0, "a": 1.0}},
            {"covariance": ((1.0,),)},
            {"domain": {"pgv_m_s": (0.0, float("inf"))}},
            {"diagnostics": {"score": float("nan")}},
            {"diagnostics": {"what": object()}},
            {"leave_out_steps": ((1.0,),)},
            {"leave_out_steps": ((1.0, 2.0, float("nan")),)},
            {"dependence": {"rho_e": float("nan")}},
        ],
    )
    def test_what_cannot_be_stored(
        self, engine: Engine, model: ModelRow, change: dict[str, Any]
    ) -> None:
        with engine.begin() as connection:
            with pytest.raises(InputError):
                save_model(connection, replace(model, **change))
            assert model_rows(connection) == []

    @pytest.mark.parametrize(
        "column",
        ["coefficients", "covariance", "domain", "diagnostics", "leave_out_steps", "dependence"],
    )
    def test_a_damaged_model(self, engine: Engine, model: ModelRow, column: str) -> None:
        with engine.begin() as connection:
            save_model(connection, model)
            connection.execute(update(schema.fragility_model).values({column: "[1,"}))
            with pytest.raises(DatabaseError, match="model pgv-wls is damaged"):
                load_model(connection)
            if column in ("coefficients", "covariance"):
                altered = {(finding.table, finding.row) for finding in check_database(connection)}
                assert altered == {("fragility_model", "pgv-wls"), ("fragility_model", "1")}


@given(st.dictionaries(st.text(), finite, max_size=4), st.data())
def test_any_numbers_survive_the_record(coefficients: dict[str, float], data: Any) -> None:
    line = st.tuples(*[finite] * len(coefficients))
    row = ModelRow(
        name="m",
        term="pgv",
        method="wls",
        coefficients=coefficients,
        covariance=data.draw(st.tuples(*[line] * len(coefficients))),
        domain=data.draw(st.dictionaries(st.text(), st.tuples(finite, finite), max_size=3)),
        data_fingerprint="",
        diagnostics=data.draw(st.dictionaries(st.text(), st.one_of(finite, st.text(), st.none()))),
    )
    values = encode_model(row)
    (digest,) = table_digests(schema.fragility_model, list(values), [list(values.values())])
    assert decode_model([*(values[column] for column in COLUMNS), digest]) == row


def test_the_digest_is_of_every_column() -> None:
    # what is read back is the whole row, but for its number
    assert {column.name for column in schema.fragility_model.c} - {"id"} == set(STORED)


@pytest.fixture
def stored(sqlite_file: Path, model: ModelRow) -> Path:
    with opened_database(sqlite_file) as engine, engine.begin() as connection:
        save_model(connection, model)
        save_model(connection, replace(model, name="another", term="pga_tm"))
    return sqlite_file


class TestFastReader:
    def test_equals_the_slow_one(self, stored: Path) -> None:
        with opened_database(stored, read_only=True) as engine, engine.connect() as connection:
            assert read_models(str(stored))[0] == load_model(connection, "another")
            assert read_models(stored) == model_rows(connection)

    def test_unknown_names(self, stored: Path) -> None:
        raised = pytest.raises(UnknownModelError, match="another, pgv-wls")
        with (
            opened_database(stored, read_only=True) as engine,
            engine.connect() as connection,
            raised,
        ):
            load_model(connection, "x")

    def test_no_model_yet(self, sqlite_file: Path) -> None:
        raised = pytest.raises(UnknownModelError, match="rbfrag fit")
        with opened_database(sqlite_file) as engine, engine.connect() as connection, raised:
            load_model(connection)
        assert read_models(sqlite_file) == []

    def test_while_another_process_writes(self, stored: Path, model: ModelRow) -> None:
        with opened_database(stored) as engine, engine.begin() as connection:
            save_model(connection, replace(model, name="unfinished", is_default=True))
            assert [row.name for row in read_models(stored)] == ["another", "pgv-wls"]
        assert [m.name for m in read_models(stored) if m.is_default] == ["unfinished"]

    def test_in_a_folder_that_cannot_be_written(self, locked_folder: Any, model: ModelRow) -> None:
        path = locked_folder.folder / "x.db"
        with opened_database(path, create=True) as engine, engine.begin() as connection:
            save_model(connection, model)
        with locked_folder():
            assert read_models(path)[0].coefficients == model.coefficients

    def test_leaves_nothing_behind(self, stored: Path) -> None:
        read_models(stored)
        assert [file.name for file in stored.parent.iterdir()] == [stored.name]

    def test_what_is_no_database(self, tmp_path: Path, stored: Path) -> None:
        with pytest.raises(DatabaseNotFoundError):
            read_models(tmp_path / "none.db")
        with pytest.raises(NotADatabaseError):
            read_models(tmp_path)
        (tmp_path / "text").write_text("NPTS= 4000")
        with pytest.raises(NotADatabaseError):
            read_models(tmp_path / "text")
        with opened_database(stored) as engine, engine.begin() as connection:
            connection.exec_driver_sql("UPDATE rbfrag_revision SET version_num = '9999'")
        with pytest.raises(SchemaVersionError):
            read_models(stored)
        with closing(sqlite3.connect(stored)) as raw, raw:
            raw.execute("DROP TABLE rbfrag_revision")
        with pytest.raises(NotADatabaseError, match="has no schema"):
            read_models(stored)

    def test_loads_nothing_heavy(self, stored: Path) -> None:
        code = (
            "import sys; from rbfrag.db.model_file import read_models\n"
            "assert read_models(sys.argv[1])[1].name == 'pgv-wls'\n"
            f"print(sorted(set({HEAVY!r}) & set(sys.modules)))"
        )
        process = subprocess.run(
            [sys.executable, "-c", code, str(stored)],
            capture_output=True,
            text=True,
            check=True,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
        )
        assert process.stdout.strip() == "[]"
