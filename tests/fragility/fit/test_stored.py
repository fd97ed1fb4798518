"""`rbfrag.fit(db=…)` and `rbfrag.simulate(db=…)` read and store as the commands do."""

from __future__ import annotations

from pathlib import Path

import pytest

import rbfrag
from rbfrag.db.engine import opened_database
from rbfrag.fragility.fit.fitting import fit as fit_only
from tests.cli.conftest import Shell, shell
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
    stored = [each["name"] for each in shell.json("models", "list", "--db", "a.db")]
    assert stored == sorted(["other", report.name])
