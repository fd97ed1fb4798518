"""`rbfrag.fit(db=…)` and `rbfrag.simulate(db=…)` read and store as the commands do."""

from __future__ import annotations

import shutil
import sqlite3
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest

import rbfrag
from rbfrag.db.engine import opened_database
from rbfrag.db.location import REFERENCE, SCHEMA_REVISION, VERSION_TABLE
from rbfrag.errors import SchemaVersionError
from rbfrag.fragility.fit import fitting
from rbfrag.fragility.fit.fitting import fit as fit_only
from rbfrag.fragility.fit.stored import NOT_STORED
from rbfrag.fragility.model import SYNTHETIC
from rbfrag.motions.sample_motions import demo_motions
from tests.cli.conftest import Shell, shell
from tests.fragility.portfolio_draws import SHARED
from tests.synthetic import write_suite

__all__ = ["shell"]


def test_python_and_shell_store_the_same(shell: Shell, tmp_path: Path) -> None:
    rbfrag.add_motions([write_suite(tmp_path / "records")], db="a.db")
    summary = rbfrag.simulate(db="a.db", p2=[10.0, 1.0], jobs=1)
    report = rbfrag.fit(db="a.db", term="pgv")
    assert report.model.row.is_default

    at_b = ("--db", "b.db")
    shell("motions", "add", tmp_path / "records", *at_b)
    by_shell = shell.json("simulate", "--p2", "10,1", "--jobs", "1", *at_b)
    seconds = {"seconds": by_shell["seconds"]}
    assert summary.as_dict() | seconds == by_shell
    printed = shell.json("fit", "--term", "pgv", *at_b)
    assert report.as_dict() | {"created": printed["created"]} == printed
    answers = [rbfrag.predict(3.0, 0.1, pgv_m_s=0.3, db=name) for name in ("a.db", "b.db")]
    assert answers[0] == answers[1]

    with pytest.raises(rbfrag.InputError, match=report.name):
        rbfrag.fit(db="a.db", term="pgv")
    again = rbfrag.fit(db="a.db", term="pgv", replace=True)
    assert again.coefficients == report.coefficients
    assert rbfrag.fit("a.db", term="pgv", name="other").name == "other"
    with opened_database("a.db") as engine, engine.connect() as connection:
        with pytest.raises(rbfrag.InputError, match="give a path or URL"):
            rbfrag.fit(connection, term="pgv")  # type: ignore[arg-type]
        fit_only(connection, term="pga_tm")
    stored = [row["name"] for row in shell.json("models", "list", "--db", "a.db")]
    assert stored == sorted(["other", report.name])


def test_the_first_joint_question_estimates_the_dependence_and_stores_it(
    shell: Shell, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    estimated: list[int] = []

    def estimate(*, seed: int, **_: object) -> dict[str, object]:
        estimated.append(seed)
        return dict(SHARED)

    monkeypatch.setattr(fitting, "estimate_dependence", estimate)
    monkeypatch.setattr(fitting, "observed_blocks", lambda *_: {})
    rbfrag.add_motions([write_suite(tmp_path / "records")], db="a.db")
    rbfrag.simulate(db="a.db", p2=[10.0, 1.0], jobs=1)
    report = rbfrag.fit(db="a.db", term="pgv", seed=3)
    assert report.as_dict()["dependence"] is None
    block = {"p2": 3.0, "kr": 0.1, "pgv_m_s": 0.3}
    alone = rbfrag.predict(**block, db="a.db")
    assert estimated == []
    joint = rbfrag.predict(**block, db="a.db", sites=5)
    assert (joint.probability, joint.ci_low) == (alone.probability, alone.ci_low)
    assert joint.event_low is not None
    assert joint.event_low < joint.probability
    assert rbfrag.predict(**block, db="a.db", sites=5).event_low == joint.event_low
    assert estimated == [3]
    shown = shell.json("models", "show", report.name, "--db", "a.db")
    assert shown["dependence"] == SHARED
    assert shown["is_default"] is report.as_dict()["is_default"]
    shell("db", "check", "--db", "a.db")
    # of a database that cannot be written the answer says what to run
    shutil.copy("a.db", "b.db")
    rbfrag.fit(db="b.db", term="pgv", replace=True)
    monkeypatch.setattr("rbfrag.db.engine.REFERENCE", tmp_path / "b.db")
    read_only = rbfrag.predict(**block, db="b.db", sites=5)
    assert read_only.event_low is None
    assert any("fit it again with dependence" in text for text in read_only.warnings)
    assert rbfrag.fit(db="a.db", term="pgv", name="all", dependence=True).as_dict()["dependence"]
    assert estimated == [3, 0]


def test_the_built_in_data_are_fitted_where_there_is_no_database(
    shell: Shell, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    rbfrag.add_motions([write_suite(tmp_path / "records")], db="built-in.db")
    rbfrag.simulate(db="built-in.db", p2=[10.0, 1.0], jobs=1)
    monkeypatch.setattr("rbfrag.db.location.REFERENCE", tmp_path / "built-in.db")
    before = (tmp_path / "built-in.db").read_bytes()
    report = rbfrag.fit(term="pgv", method="wls")
    assert report.warnings[-1].startswith("the fit is of the built-in data set")
    stored = rbfrag.fit("built-in.db", term="pgv", method="wls", name="own")
    assert report.coefficients == stored.coefficients
    assert NOT_STORED not in stored.warnings
    (tmp_path / "built-in.db").write_bytes(before)
    messageut = shell("fit", "--term", "pgv", "--method", "wls")
    assert "Model     wls-pgv (" in messageut.stdout
    assert "the model is not stored" in messageut.stdout
    assert not Path("rbfrag.db").exists()
    assert (tmp_path / "built-in.db").read_bytes() == before
    assert rbfrag.read_table("motion").equals(rbfrag.read_table("motion", db="built-in.db"))
    messageut = shell("models", "default", "wls-pgv", expect=2).stderr
    assert "the built-in data set is read-only: use --model wls-pgv" in messageut


def test_schema_and_name_are_checked_before_anything_is_computed(
    shell: Shell, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copy(REFERENCE, "newer.db")
    with closing(sqlite3.connect("newer.db")) as connection, connection:
        connection.execute(f"UPDATE {VERSION_TABLE} SET version_num = '9999'")
    rbfrag.add_motions([write_suite(tmp_path / "records")], db="own.db")
    rbfrag.simulate(db="own.db", p2=[10.0, 1.0], jobs=1)
    rbfrag.fit("own.db", term="pgv", method="wls")

    def read_source(*inputs: object, **options: object) -> None:
        raise AssertionError("the data were read")

    monkeypatch.setattr(fitting, "read_source", read_source)
    with pytest.raises(SchemaVersionError, match=f"has schema 9999, newer than {SCHEMA_REVISION}"):
        rbfrag.fit("newer.db", term="pgv")
    with pytest.raises(rbfrag.InputError, match="the model 'wls-pgv' exists"):
        rbfrag.fit("own.db", term="pgv", method="wls")
    with pytest.raises(AssertionError, match="the data were read"):
        rbfrag.fit("own.db", term="pgv", method="wls", replace=True)


def test_a_model_of_synthetic_pulses_says_so_in_every_answer(
    shell: Shell, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("rbfrag.motions.sample_motions.find_spec", lambda name: None)
    files, _ = demo_motions(tmp_path)
    assert rbfrag.add_motions(files, db="pulses.db").warnings == ()
    rbfrag.simulate(db="pulses.db", p2=[3.0], jobs=1)
    output = shell("fit", "--term", "pgv", "--method", "logistic", "--db", "pulses.db").stdout
    assert "of 12 synthetic pulses, which are not earthquakes" in output
    single = rbfrag.predict(3.0, 0.1, pgv_m_s=0.6, db="pulses.db")
    assert SYNTHETIC in single.warnings
    many = rbfrag.predict(np.array([3.0, 1.0]), np.array([0.1, 0.2]), pgv_m_s=0.6, db="pulses.db")
    assert SYNTHETIC in many.warnings
    Path("curve.csv").write_text("pgv_m_s,annual_rate\n0.05,0.1\n0.5,0.001\n2,0.00001\n")
    rate = rbfrag.hazard("curve.csv", p2=3.0, kr=0.1, db="pulses.db")
    assert any(SYNTHETIC in warning for warning in rate.warnings)
    assert SYNTHETIC not in rbfrag.predict(3.0, 0.1, pgv_m_s=0.6, db=REFERENCE).warnings
