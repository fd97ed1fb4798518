"""Damage of every kind is found, named by its row, and told with what to do."""

from __future__ import annotations

import math
import sqlite3
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import Engine, Text, and_, delete, func, select, update
from sqlalchemy.exc import IntegrityError

from rbfrag.db import schema
from rbfrag.db.campaigns import store_spectrum
from rbfrag.db.check import ALTERED, check_database, check_digests
from rbfrag.db.check_results import Damage
from rbfrag.db.engine import opened_database
from rbfrag.db.insert import insert_if_new, insert_row, insert_rows
from rbfrag.db.keys import pair_key, response_key
from rbfrag.db.model_file import ModelRow
from rbfrag.db.models import save_model
from rbfrag.db.motion_spectra import HorizontalPair, pair_rows
from rbfrag.db.motions import load_motion
from rbfrag.db.shock_pairs import PARTS, ShockEnd
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.polarity import POLARITIES
from rbfrag.motions.toppling_spectrum import toppling_spectrum as spectrum_of
from rbfrag.solver.results import NUMERICS_VERSION

# The map of the first found combination of `filled`, whose critical kr/PGA is 0.1.
MAP = (
    (0.01, 0.05, "topples"),
    (0.05, 0.05 + 1e-9, "undecided"),
    (0.05 + 1e-9, 0.08, "safe"),
    (0.08, 0.08 + 1e-9, "undecided"),
    (0.08 + 1e-9, 0.1 - 1e-9, "topples"),
    (0.1 - 1e-9, 0.1 + 1e-12, "undecided"),
    (0.1 + 1e-12, 1.0, "safe"),
)


def _checked(connection: Any) -> list[Damage]:
    """Return the findings without the digests, which differ wherever a test alters a value."""
    return [finding for finding in check_database(connection) if finding.problem != ALTERED]


class TestCheck:
    def test_a_sound_database(self, filled: Engine) -> None:
        with filled.connect() as connection:
            assert _checked(connection) == []

    @pytest.mark.parametrize(
        ("table", "values", "problem"),
        [
            ("motion", {"samples": b"\x00" * 512}, "do not match their sha256"),
            ("motion", {"samples": b"\x00" * 511}, "holds 511 bytes"),
            ("combination", {"natural_key": "0" * 64}, "natural key is not the hash"),
            ("combination", {"p2": 2.0}, "is not kr g/p"),
            ("combination", {"kr": 0.7}, "times the motion's PGA"),
            ("combination", {"lower": 0.95}, "lies below its bracket"),
            ("combination", {"upper": 0.05}, "lies above its bracket"),
            ("combination", {"settings": "{"}, "settings cannot be read"),
            ("combination", {"settings": '{"a":NaN}'}, "natural key is not the hash"),
            ("simulation", {"outcome": "stable"}, "no simulation topples at its critical"),
            ("simulation", {"outcome": "toppled"}, "topples above its critical"),
            ("simulation", {"outcome": "toppled"}, "status below_limit, yet"),
        ],
    )
    def test_damage_is_found(self, filled: Engine, table: str, values: Any, problem: str) -> None:
        changed = schema.metadata.tables[table]
        query = update(changed).values(**values)
        if table == "combination":
            first = select(func.min(changed.c.id)).where(changed.c.status == "found")
            query = query.where(changed.c.id == first.scalar_subquery())
        with filled.begin() as connection:
            connection.execute(query)
            findings = _checked(connection)
        assert {finding.table for finding in findings} <= {table, "combination"}
        assert any(problem in finding.problem for finding in findings)
        assert all(finding.advice for finding in findings)

    def test_a_run_that_cannot_tell_is_no_damage(self, filled: Engine) -> None:
        # beside a very sensitive border the certificate decides, not the run
        point, combination = schema.simulation, schema.combination
        critical = select(combination.c.kr_over_pga).where(
            combination.c.id == point.c.combination_id
        )
        unsure = update(point).values(outcome="undetermined", theta_n=None)
        with filled.begin() as connection:
            connection.execute(unsure.where(point.c.kr_over_pga == critical.scalar_subquery()))
            assert _checked(connection) == []

    def test_rows_that_nothing_refers_to(self, filled: Engine) -> None:
        with filled.begin() as connection:
            values = {"event_id": "lost", "guessed": True, "name": ""}
            insert_row(connection, schema.earthquake, values)
            (finding,) = _checked(connection)
        assert (finding.table, finding.row) == ("earthquake", "lost")

    def test_a_damaged_file(self, tmp_path: Path) -> None:
        path = tmp_path / "x.db"
        with opened_database(path, create=True) as engine:
            with engine.connect() as connection:
                connection.exec_driver_sql("PRAGMA ignore_check_constraints = ON")
                values = {"event_id": "", "guessed": True, "name": ""}
                insert_row(connection, schema.earthquake, values)
                connection.commit()
                connection.exec_driver_sql("PRAGMA ignore_check_constraints = OFF")
            with engine.connect() as connection:
                problems = [finding.problem for finding in _checked(connection)]
        assert any("CHECK constraint failed in earthquake" in problem for problem in problems)

    def test_broken_references(self, sqlite_file: Path) -> None:
        raw = sqlite3.connect(sqlite_file)
        raw.execute("INSERT INTO suite_motion VALUES (7, 8, 0)")
        raw.commit()
        raw.close()
        with opened_database(sqlite_file, read_only=True) as engine, engine.connect() as c:
            problems = {finding.problem for finding in _checked(c)}
        assert problems == {
            "points to a row of motion that is not there",
            "points to a row of suite that is not there",
            "rows were added by another program: 0 were written, 1 are there",
        }


def _store_map(connection: Any, intervals: Any, *, status: str = "found") -> None:
    combination = schema.combination
    first = select(func.min(combination.c.id)).where(combination.c.status == status)
    row_id = connection.scalar(first)
    columns = ("combination_id", "k_lo", "k_hi", "outcome")
    insert_rows(
        connection,
        schema.outcome_interval,
        columns,
        [(row_id, *interval) for interval in intervals],
    )


def _store_response(connection: Any) -> None:
    block = {
        "polarity": "forward", "kind": "toppling", "linear": False, "p2": 3.0, "kr": 0.1,
        "numerics_version": "2",
    }  # fmt: skip
    row = connection.execute(select(schema.motion).order_by(schema.motion.c.id)).first()
    key = response_key(
        motion_sha256=row.samples_sha256, dt_s=row.dt_s, vertical_sha256=None, **block
    )
    series = dict.fromkeys(("time_s", "theta_rad", "theta_dot_rad_s", "k_h", "k_v"), b"0" * 16)
    values = {"natural_key": key, "motion_id": row.id, "outcome": "stable", "npts": 2}
    insert_row(connection, schema.response, {**values, **block, **series})


def _store_pair(connection: Any) -> None:
    first, second = connection.execute(
        select(schema.motion).order_by(schema.motion.c.id).limit(2)
    ).all()
    block = {"polarity": "forward", "kind": "slumping", "numerics_version": NUMERICS_VERSION}
    key = pair_key(
        first_sha256=first.samples_sha256,
        first_dt_s=first.dt_s,
        motion_sha256=second.samples_sha256,
        dt_s=second.dt_s,
        block={"gamma_deg": 20.0},
        **block,
    )
    ends = {f"{part}_{name}": 0.1 for part in PARTS for name in ShockEnd._fields}
    values = {
        "natural_key": key,
        "campaign_id": connection.scalar(select(func.min(schema.campaign.c.id))),
        "first_motion_id": first.id,
        "second_motion_id": second.id,
        "pairing": "drawn",
        "block": '{"gamma_deg":20.0}',
        "yield_g": 0.1,
        "critical_rad": 0.3,
        **ends,
        **{f"{part}_outcome": "stable" for part in PARTS},
    }
    insert_row(connection, schema.shock_pair, {**values, **block})


def _store_spectrum(connection: Any, motion: GroundMotion) -> None:
    motion_id = connection.scalar(select(func.min(schema.motion.c.id)))
    for polarity in POLARITIES:
        values = spectrum_of(motion, [3.0, 0.1], polarity)
        store_spectrum(connection, motion_id, polarity=polarity, p2=[3.0, 0.1], x_m_s=values)


def _store_peaks(connection: Any) -> None:
    ids = connection.scalars(select(schema.motion.c.id).order_by(schema.motion.c.id).limit(2)).all()
    motions = [load_motion(connection, number) for number in ids]
    for values in pair_rows(HorizontalPair(*ids), *motions):
        insert_if_new(connection, schema.recording_spectrum, values)


@pytest.mark.parametrize("table", sorted(schema.metadata.tables))
def test_an_altered_value_is_found(
    filled: Engine, make_motion: Any, model: ModelRow, table: str
) -> None:
    # by the digest of its row, whatever else there is to compare a value with
    altered = schema.metadata.tables[table]
    columns = [column for column in altered.c if column.name != "id"]
    with filled.begin() as connection:
        _store_map(connection, MAP)
        _store_response(connection)
        _store_pair(connection)
        _store_spectrum(connection, make_motion(1))
        _store_peaks(connection)
        save_model(connection, model)
        assert check_database(connection) == []
        row = connection.execute(select(altered).limit(1)).mappings().one()
        same_row = and_(*(key == row[key.name] for key in altered.primary_key.columns))
        for column in columns:
            point = connection.begin_nested()
            value = _altered(row[column.name], column.type)
            try:
                connection.execute(update(altered).where(same_row).values({column: value}))
            except IntegrityError:
                pass  # the schema rejects it
            else:
                findings = list(check_digests(connection))
                assert [finding.table for finding in findings] == [table], column.name
            point.rollback()


def _altered(value: Any, column_type: Any) -> object:
    if isinstance(value, bool):
        return not value
    if isinstance(value, float):
        return value + math.ulp(value)
    if isinstance(value, int):
        return value + 1
    if isinstance(value, bytes):
        return bytes([value[0] ^ 1]) + value[1:]
    if isinstance(value, str):
        return f"{value}." if len(value) < 64 else f"-{value[1:]}"
    return "new" if isinstance(column_type, Text) else 1


class TestMaps:
    def test_a_sound_map(self, filled: Engine) -> None:
        with filled.begin() as connection:
            _store_map(connection, MAP[2:])  # given up on the way down
            assert _checked(connection) == []

    @pytest.mark.parametrize(
        ("intervals", "problem"),
        [
            (((0.2, 0.3, "undecided"), (0.3, 1.0, "safe")), "begins at kr/PGA 0.2, above 0.1"),
            (((0.001, 0.01, "safe"), *MAP), "begins at kr/PGA 0.001, below the search limit 0.01"),
            (MAP[:2] + MAP[3:], "a gap from kr/PGA"),
            ((*MAP[:-1], (0.099, 1.0, "safe")), "overlap from kr/PGA 0.099"),
            (MAP[:-1], "below K_up 1.0"),
            ((*MAP[:-1], (MAP[-1][0], 1.0, "topples")), "topples up to kr/PGA 1.0, above its"),
            ((*MAP[:-1], (MAP[-1][0], 1.0, "undecided")), "more than the 0.0 it states"),
            (((0.01, 1.0, "safe"),), "its critical kr/PGA 0.1 lies in an interval that is safe"),
            (((0.01, 1.0, "safe"),), "topples at kr/PGA 0.1, inside the interval 0.01 to 1.0"),
            (((0.01, 0.95, "topples"), (0.95, 1.0, "safe")), "a simulation stays at kr/PGA 0.9"),
        ],
    )
    def test_a_wrong_map(self, filled: Engine, intervals: Any, problem: str) -> None:
        with filled.begin() as connection:
            _store_map(connection, intervals)
            findings = _checked(connection)
        assert {finding.table for finding in findings} == {"combination"}
        assert any(problem in finding.problem for finding in findings), findings
        assert all("rbfrag simulate" in finding.advice for finding in findings)

    def test_a_censored_combination_has_no_toppling_interval(self, filled: Engine) -> None:
        with filled.begin() as connection:
            _store_map(connection, MAP, status="below_limit")
            problems = [finding.problem for finding in _checked(connection)]
        assert any("status below_limit, yet its map topples" in text for text in problems)


@pytest.mark.parametrize(
    ("values", "problem"),
    [
        ({"pga_g": 0.123}, "pga_g is 0.123, the samples give"),
        ({"pgv_m_s": 0.123}, "pgv_m_s is 0.123"),
        ({"pgd_m": 0.123}, "pgd_m is 0.123"),
        ({"tm_s": 0.123}, "tm_s is 0.123"),
        ({"tm_s": None}, "tm_s is None"),
        ({"final_velocity_m_s": 0.123}, "final_velocity_m_s is 0.123"),
        ({"final_displacement_m": 0.123}, "final_displacement_m is 0.123"),
        ({"npts": 63}, "not 8 x 63"),
        ({"flags": "{}"}, "its flags are no JSON list"),
        ({"remarks": "["}, "its remarks cannot be read"),
        ({"processing_applied": "{"}, "its processing_applied cannot be read"),
        ({"source_sha256": "0" * 64}, "no processing is said to be applied"),
    ],
)
def test_measures_are_calculated_anew(filled: Engine, values: Any, problem: str) -> None:
    motion = schema.motion
    with filled.begin() as connection:
        first = connection.scalar(select(func.min(motion.c.id)))
        connection.execute(update(motion).where(motion.c.id == first).values(**values))
        findings = [finding for finding in _checked(connection) if finding.table == "motion"]
    assert [finding.row for finding in findings] == [str(first)]
    assert problem in findings[0].problem
    assert "1.txt" in findings[0].advice  # the file to add again


def test_measures_within_rounding_are_the_same(filled: Engine) -> None:
    motion = schema.motion
    with filled.begin() as connection:
        connection.execute(update(motion).values(pgv_m_s=motion.c.pgv_m_s * (1.0 + 1e-12)))
        assert _checked(connection) == []


def test_a_database_without_samples_is_sound(filled: Engine) -> None:
    with filled.begin() as connection:
        connection.execute(update(schema.motion).values(samples=None))
        assert _checked(connection) == []


@pytest.mark.parametrize("value", [float("inf"), float("-inf"), float("nan")])
def test_numbers_must_be_finite(filled: Engine, value: float) -> None:
    if filled.dialect.name == "sqlite" and value != value:
        pytest.skip("SQLite holds NaN as NULL")
    with filled.begin() as connection:
        connection.execute(update(schema.combination).values(island_width=value))
        findings = _checked(connection)
    wrong = [finding for finding in findings if "island_width: not a finite" in finding.problem]
    assert len(wrong) == 6


def test_a_history_has_the_key_and_the_length_it_states(filled: Engine) -> None:
    response = schema.response
    with filled.begin() as connection:
        _store_response(connection)
        assert _checked(connection) == []
        connection.execute(update(response).values(theta_rad=b"0" * 8))
        (finding,) = _checked(connection)
        assert finding.problem == "theta_rad holds 8 bytes, not 8 x 2"
        connection.execute(update(response).values(theta_rad=b"0" * 16, kr=0.2))
        (finding,) = _checked(connection)
        assert finding.problem == "its natural key is not the hash of its inputs"


def test_spectra_are_calculated_anew(filled: Engine, make_motion: Any) -> None:
    table = schema.toppling_spectrum
    with filled.begin() as connection:
        _store_spectrum(connection, make_motion(1))
        motion_id = connection.scalar(select(func.min(schema.motion.c.id)))
        assert _checked(connection) == []
        wrong = update(table).where(table.c.polarity == "reverse", table.c.p2 == 3.0)
        connection.execute(wrong.values(x_m_s=table.c.x_m_s * 1.001))
        (finding,) = _checked(connection)
        assert finding.row == f"motion {motion_id}, reverse, p2 3"
        connection.execute(update(table).values(numerics_version="0"))
        assert _checked(connection) == []


def test_numerics_of_the_campaign_agree(filled: Engine) -> None:
    with filled.begin() as connection:
        connection.execute(update(schema.campaign).values(numerics_version="0"))
        findings = _checked(connection)
    assert len(findings) == 6
    assert "its campaign says 0" in findings[0].problem


def test_rows_are_looked_at_in_any_number(filled: Engine, monkeypatch: Any) -> None:
    import rbfrag.db.check_results

    monkeypatch.setattr(rbfrag.db.check_results, "_ROWS_AT_ONCE", 2)
    with filled.begin() as connection:
        connection.execute(update(schema.combination).values(settings="{"))
        connection.execute(delete(schema.simulation))
        findings = _checked(connection)
    assert len({finding.row for finding in findings if finding.table == "combination"}) == 6
