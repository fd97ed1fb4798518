"""A sample computed again: exact here, within the error elsewhere, and what is wrong is seen."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import delete, func, select, update

import rbfrag.campaign.database_check
from rbfrag.campaign.add_motions import add_motions
from rbfrag.campaign.database_check import Resimulation, resimulate
from rbfrag.campaign.simulate import simulate
from rbfrag.db.engine import opened_database
from rbfrag.db.schema import combination, motion, simulation
from rbfrag.errors import RbfragError
from tests.cli.conftest import Shell
from tests.synthetic import write_suite


@pytest.fixture(scope="module")
def campaign(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """The content of a database after a small campaign."""
    folder = tmp_path_factory.mktemp("campaign")
    add_motions([write_suite(folder / "records", 2)], db=folder / "a.db")
    simulate(folder / "a.db", p2=(10.0, 1.0), jobs=1, grid=7)
    return (folder / "a.db").read_bytes()


@pytest.fixture
def database(campaign: bytes, tmp_path: Path) -> Path:
    place = tmp_path / "a.db"
    place.write_bytes(campaign)
    return place


def _change(database: Path, *statements: Any) -> None:
    with opened_database(database) as engine, engine.begin() as connection:
        for statement in statements:
            connection.execute(statement)


def _again(database: Path, sample: int = 100, seed: int = 0) -> Resimulation:
    with opened_database(database, read_only=True) as engine, engine.connect() as connection:
        return resimulate(connection, sample=sample, seed=seed)


def test_on_the_same_machine_every_bit_is_the_same(database: Path) -> None:
    again = _again(database)
    assert (again.sampled, again.exact, again.within_error, again.eligible) == (8, 8, 0, 8)
    assert again.findings == ()


def test_the_seed_decides_the_sample(database: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[list[str]] = []
    stored = rbfrag.campaign.database_check.stored_combination

    def watch(connection: Any, key: str) -> Any:
        seen[-1].append(key)
        return stored(connection, key)

    monkeypatch.setattr(rbfrag.campaign.database_check, "stored_combination", watch)
    for seed in (3, 3, 4):
        seen.append([])
        assert _again(database, sample=3, seed=seed).sampled == 3
    assert seen[0] == seen[1] != seen[2]


SHIFT = 1.0 + 1e-13
LAST_BITS = update(combination).values(
    kr_over_pga=combination.c.kr_over_pga * SHIFT,
    lower=combination.c.lower * SHIFT,
    upper=combination.c.upper * SHIFT,
)


def test_last_bits_count_here_but_not_from_elsewhere(
    database: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    _change(database, LAST_BITS)
    again = _again(database)
    assert again.exact == 0
    assert any("kr_over_pga is" in finding.problem for finding in again.findings)
    module = rbfrag.campaign.database_check
    monkeypatch.setattr(module, "processor_and_compiler", lambda: "another machine")
    again = _again(database)
    assert (again.exact, again.within_error, again.findings) == (0, 8, ())


@pytest.mark.parametrize("elsewhere", [False, True])
@pytest.mark.parametrize(
    ("statement", "problem"),
    [
        (
            update(combination).values(
                lower=combination.c.lower * 1.01, upper=combination.c.upper * 1.01
            ),
            "computed again",
        ),
        (
            update(combination).values(
                status="below_limit", kr_over_pga=None, kr=None, y_m_s=None, lower=None, upper=None
            ),
            "status is 'below_limit', computed again 'found'",
        ),
    ],
)
def test_a_wrong_value_is_found(
    database: Path, monkeypatch: pytest.MonkeyPatch, statement: Any, problem: str, elsewhere: bool
) -> None:
    if elsewhere:
        module = rbfrag.campaign.database_check
        monkeypatch.setattr(module, "processor_and_compiler", lambda: "another machine")
    with opened_database(database, read_only=True) as engine, engine.connect() as connection:
        row_id = connection.scalar(
            select(func.min(combination.c.id)).where(combination.c.status == "found")
        )
    _change(database, statement.where(combination.c.id == row_id))
    again = _again(database)
    assert {finding.row for finding in again.findings} == {str(row_id)}
    assert problem in again.findings[0].problem


def test_simulations_are_compared(database: Path) -> None:
    least = select(func.min(combination.c.id)).scalar_subquery()
    of_it = simulation.c.combination_id == least
    _change(database, update(simulation).where(of_it).values(theta_n=0.123, outcome="stable"))
    problems = [finding.problem for finding in _again(database).findings]
    assert any("is ('stable', 0.123), computed again" in problem for problem in problems)
    _change(database, delete(simulation).where(of_it))
    problems = [finding.problem for finding in _again(database).findings]
    assert any("is missing" in problem for problem in problems)


def test_what_cannot_be_computed_is_no_part_of_the_sample(database: Path) -> None:
    _change(database, update(motion).values(samples=None))
    again = _again(database)
    assert (again.sampled, again.eligible, again.findings) == (0, 0, ())
    _change(database, update(combination).values(numerics_version="0"))
    assert _again(database).eligible == 0


def test_what_fails_is_a_finding(database: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def reject(*arguments: Any, **options: Any) -> None:
        raise RbfragError("no")

    monkeypatch.setattr(rbfrag.campaign.database_check, "load_motion", reject)
    findings = _again(database, sample=1).findings
    assert [finding.problem for finding in findings] == ["cannot be computed again: no"]


def test_the_command_line(database: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shell = Shell()
    answer = shell.json("db", "check", "--db", database, "--sample", "3", "--seed", "5")
    assert answer["sound"] is True
    assert answer["resimulated"] == {
        "sampled": 3, "exact": 3, "within_error": 0, "eligible": 8, "seed": 5
    }  # fmt: skip
    assert shell.json("db", "check", "--db", database, "--sample", "0")["resimulated"] is None
    _change(database, LAST_BITS)
    result = shell("db", "check", "--db", database, expect=1)
    assert "combination" in result.stdout
    assert "Advice    restore the database from a backup" in result.stdout
