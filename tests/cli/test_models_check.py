"""`rbfrag models check`: whether the data of a model are still those it was fitted on."""

from __future__ import annotations

import shutil
import sqlite3
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest

import rbfrag
from rbfrag.db.engine import opened_database
from rbfrag.db.insert import update_rows
from rbfrag.db.location import REFERENCE
from rbfrag.db.schema import fragility_model
from tests.cli.conftest import Rejects, Shell
from tests.synthetic import write_suite


@pytest.fixture
def database(tmp_path: Path) -> Path:
    return Path(shutil.copy(REFERENCE, tmp_path / "rbfrag.db"))


def change(database: Path, statement: str) -> None:
    with closing(sqlite3.connect(database)) as connection, connection:
        assert connection.execute(statement).rowcount > 0


def test_data_as_they_were(shell: Shell, database: Path) -> None:
    answer = shell.json("models", "check")
    values = {item["name"]: item for item in answer}
    assert values["toppling-pgv_pga"] == {
        "name": "toppling-pgv_pga", "state": "unchanged", "remark": ""
    }  # fmt: skip
    # of blocks that slump or topple confined the reference has the models alone
    without = {name for name, item in values.items() if item["state"] != "unchanged"}
    assert without
    assert {name.partition("-")[0] for name in without} == {
        "confined_toppling",
        "slumping",
    }
    assert {values[name]["state"] for name in without} == {"no data"}
    headline, *lines = shell("models", "check").stdout.splitlines()
    assert f"{len(answer)} fitted models: " in headline
    assert f"{len(without)} no data" in headline
    assert ["model", "data"] in [line.split() for line in lines]


def test_another_critical_value_is_noticed(shell: Shell, database: Path) -> None:
    change(
        database,
        "UPDATE combination SET y_m_s = 1.001 * y_m_s WHERE id = (SELECT min(id) FROM combination "
        "WHERE status = 'found' AND kind = 'toppling' AND vertical_motion_id IS NULL)",
    )
    output = shell("models", "check", expect=1).stdout
    assert "other values: fit it again in its place, by rbfrag fit" in output
    assert " changed" in output.splitlines()[0]


def test_a_value_that_is_gone_is_counted(shell: Shell, database: Path) -> None:
    change(
        database,
        "UPDATE combination SET status = 'below_limit', kr_over_pga = NULL, kr = NULL, "
        "y_m_s = NULL, lower = NULL WHERE id = (SELECT min(id) FROM combination WHERE "
        "status = 'found' AND kind = 'toppling' AND vertical_motion_id IS NULL)",
    )
    assert "fitted to 8622 critical values, 8621 today" in shell("models", "check", expect=1).stdout


def test_a_model_that_cannot_be_read_is_told(shell: Shell, database: Path) -> None:
    # as a later rbfrag would have stored it, with its digest
    with opened_database(database) as engine, engine.begin() as connection:
        single = fragility_model.c.name == "toppling-pgv"
        update_rows(connection, fragility_model, single, {"method": "guess"})
    output = shell("models", "check", expect=1).stdout
    assert "unreadable" in output
    assert "'guess', which is not supported by this version" in " ".join(output.split())


def test_without_a_database_it_is_rejected(rejects: Rejects, tmp_path: Path) -> None:
    assert "none.db" in rejects("models", "check", "--db", tmp_path / "none.db")


def test_models_are_listed_where_none_is_named(shell: Shell) -> None:
    assert shell.json("models", "show") == shell.json("models", "list")


def test_a_campaign_of_one_size_ends_in_one_sentence(
    shell: Shell, rejects: Rejects, tmp_path: Path
) -> None:
    shell("motions", "add", write_suite(tmp_path / "records"))
    shell("simulate", "--p2", "10", "--jobs", "1")
    message = rejects("fit", "--term", "pgv", "--method", "toppling")
    assert "do not identify the 5 parameters of method toppling" in message


def test_stronger_blocks_fail_less_often_by_any_fit(shell: Shell, tmp_path: Path) -> None:
    shell("motions", "add", write_suite(tmp_path / "records"))
    shell("simulate", "--p2", "10,1", "--jobs", "1")
    report = shell.json("fit", "--term", "pgv", "--method", "toppling")
    assert report["coefficients"]["b_ln_v"] == 0.02
    assert "b_ln_v is held at 0.02" in " ".join(report["warnings"])
    kr = np.geomspace(0.001, 0.3, 200)
    for p2 in (10.0, 1.0):
        p = rbfrag.predict(p2, kr, pgv_m_s=0.5).probability
        assert (np.diff(p) <= 0.0).all()


def test_a_default_is_chosen_in_a_copy_of_the_built_in_data(
    shell: Shell, rejects: Rejects, tmp_path: Path
) -> None:
    message = rejects("models", "default", "logistic-pgd_tm")
    assert "copy" in message
    assert str(REFERENCE) in message
    shutil.copy(REFERENCE, tmp_path / "rbfrag.db")
    shell("models", "default", "logistic-pgd_tm")
    defaults = [item["name"] for item in shell.json("models", "list") if item["is_default"]]
    assert "logistic-pgd_tm" in defaults
