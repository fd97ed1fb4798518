"""Campaigns: written once, read in one order, equal however they came about."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from sqlalchemy import Engine, delete, exc, func, select, update

from benchmarks.database_content import CONTENT_TABLES, content_digest, table_rows_by_natural_key
from rbfrag.db import schema
from rbfrag.db.campaigns import (
    finish_campaign,
    known_combinations,
    known_keys,
    start_campaign,
    stored_combination,
)
from rbfrag.db.engine import opened_database
from rbfrag.db.keys import combination_key
from rbfrag.db.motions import add_motion, add_to_suite
from rbfrag.db.queries import SuiteCount, combination_table, database_info, suite_counts
from rbfrag.db.rows import EarthquakeInfo
from rbfrag.errors import InputError
from rbfrag.solver.results import NUMERICS_VERSION

QUAKE = EarthquakeInfo("chi-chi-1999", magnitude=7.62, guessed=False)

KEY: dict[str, Any] = {
    "motion_sha256": "a" * 64,
    "dt_s": 0.01,
    "vertical_sha256": None,
    "polarity": "forward",
    "kind": "toppling",
    "p2": 3.0,
    "settings": {"search_limit": 0.01, "b": 1},
    "numerics_version": "1",
}


def _count(connection: Any, table: Any) -> int:
    return int(connection.scalar(select(func.count()).select_from(table)))


class TestNaturalKey:
    def test_is_the_same_for_ever(self) -> None:
        # A stored key must mean the same input in every later version.
        assert combination_key(**KEY) == (
            "f0ec9444269a0a88c0c8ae7797789b3f2642766b419b770d9c8a3a932aef3358"
        )

    def test_spelling_does_not_matter(self) -> None:
        same = {
            **KEY,
            "p2": np.float64(3),
            "dt_s": np.float64(0.01),
            "settings": {"b": np.int64(1), "search_limit": np.float64(0.01)},
        }
        assert combination_key(**same) == combination_key(**KEY)
        assert combination_key(**{**KEY, "p2": 3}) == combination_key(**KEY)

    @pytest.mark.parametrize(
        "change",
        [
            {"motion_sha256": "b" * 64},
            {"dt_s": np.nextafter(0.01, 1.0)},
            {"vertical_sha256": "a" * 64},
            {"polarity": "reverse"},
            {"kind": "sliding"},
            {"p2": np.nextafter(3.0, 4.0)},
            {"settings": {"search_limit": 0.02, "b": 1}},
            {"settings": {"search_limit": 0.01}},
            {"numerics_version": "2"},
            {"linear": True},
        ],
    )
    def test_every_input_counts(self, change: dict[str, Any]) -> None:
        assert combination_key(**{**KEY, **change}) != combination_key(**KEY)

    @given(
        st.floats(min_value=5e-324, max_value=1e300), st.floats(min_value=5e-324, max_value=1e300)
    )
    def test_equal_keys_mean_equal_numbers(self, a: float, b: float) -> None:
        keys = {combination_key(**{**KEY, "p2": value}) for value in (a, b)}
        assert (len(keys) == 1) == (a == b)

    @pytest.mark.parametrize("value", [float("nan"), float("inf"), object()])
    def test_rejects_what_equals_nothing(self, value: object) -> None:
        with pytest.raises(InputError):
            combination_key(**{**KEY, "settings": {"x": value}})


def test_a_combination_is_stored_once(
    engine: Engine, make_motion: Any, make_result: Any, store_result: Callable[..., str]
) -> None:
    motion = make_motion()
    result = make_result(motion.pga_g)
    with engine.begin() as connection:
        motion_id, _ = add_motion(connection, motion, earthquake=QUAKE, is_vertical=False)
        campaign = start_campaign(connection, {"p2": [3.0]})
        key = store_result(connection, campaign, motion, motion_id, result)
    with engine.begin() as connection:
        second = start_campaign(connection, {"p2": [3.0]})
        assert store_result(connection, second, motion, motion_id, result) == key
        assert _count(connection, schema.combination) == 1
        # A point that the search came back to is stored once.
        assert _count(connection, schema.simulation) == 3
        assert known_keys(connection, [key, "0" * 64]) == {key}
        stored = known_combinations(connection, (k for k in [key, key]))
        assert {stored_key: stored[stored_key].status for stored_key in stored} == {key: "found"}
        row = connection.execute(select(schema.combination)).mappings().one()
    assert row["campaign_id"] == campaign
    for name in ("kr_over_pga", "lower", "upper", "kr", "y_m_s", "k_up_over_pga", "island_width"):
        assert row[name] == getattr(result, name)
    assert row["warnings"] == '["a warning"]'


def test_many_keys_at_once(engine: Engine) -> None:
    with engine.connect() as connection:
        assert known_keys(connection, (f"{i:064x}" for i in range(2500))) == set()
        assert known_keys(connection, []) == set()


def test_campaigns_say_whether_they_finished(engine: Engine) -> None:
    with engine.begin() as connection:
        first = start_campaign(connection, {"suite": None})
        start_campaign(connection, {"suite": None})
        finish_campaign(connection, first)
        query = select(schema.campaign.c.finished.is_not(None)).order_by(schema.campaign.c.id)
        assert list(connection.scalars(query)) == [True, False]


@pytest.mark.parametrize(
    "change",
    [
        {"status": "lost"},
        {"polarity": "sideways"},
        {"p2": -1.0},
        {"kr_over_pga": None},
        {"y_m_s": -1.0},
    ],
)
def test_the_schema_rejects_nonsense(
    engine: Engine, make_motion: Any, make_result: Any, store_result: Any, change: dict[str, Any]
) -> None:
    motion = make_motion()
    with engine.begin() as connection:
        motion_id, _ = add_motion(connection, motion, earthquake=QUAKE, is_vertical=False)
        campaign = start_campaign(connection, {})
    with pytest.raises(exc.IntegrityError), engine.begin() as connection:
        store_result(connection, campaign, motion, motion_id, make_result(**change))
    with engine.connect() as connection:
        assert _count(connection, schema.combination) == 0


class TestTables:
    def test_columns(self, filled: Engine) -> None:
        with filled.connect() as connection:
            table = combination_table(connection)
        assert table.natural_key.tolist() == sorted(table.natural_key.tolist())
        assert len(set(table.natural_key.tolist())) == 6
        is_found = table.status == "found"
        assert is_found.sum() == 3
        for column in (table.kr_over_pga, table.kr, table.y_m_s):
            assert np.isnan(column[~is_found]).all()
            assert np.isfinite(column[is_found]).all()
        np.testing.assert_array_equal(
            table.kr[is_found], (table.kr_over_pga * table.pga_g)[is_found]
        )
        assert set(table.event_id) == {"chi-chi-1999", "guess"}
        assert table.event_guessed.sum() == 2
        assert table.p2.dtype == np.float64

    def test_pgd_of_a_drifting_baseline_is_left_out(self, filled: Engine) -> None:
        with filled.begin() as connection:
            first = combination_table(connection).motion_id[0]
            for flag in ("final_velocity", "final_displacement", "short_record"):
                connection.execute(
                    update(schema.motion)
                    .where(schema.motion.c.id == int(first))
                    .values(flags=f'["event_guessed", "{flag}"]')
                )
                table = combination_table(connection)
                doubtful = (table.motion_id == first) & (flag != "short_record")
                assert np.isnan(table.pgd_m[doubtful]).all()
                assert np.isfinite(table.pgd_m[~doubtful]).all()
                with_doubtful = combination_table(connection, doubtful_pgd=True)
                assert np.isfinite(with_doubtful.pgd_m).all()
                assert np.isfinite(table.pgv_m_s).all()

    def test_suite(self, filled: Engine) -> None:
        with filled.connect() as connection:
            assert len(combination_table(connection, suite="s").p2) == 4
            with pytest.raises(InputError, match="unknown suite 't'"):
                combination_table(connection, suite="t")

    def test_empty(self, engine: Engine) -> None:
        with engine.connect() as connection:
            table = combination_table(connection)
        assert table.p2.shape == table.event_id.shape == (0,)

    def test_what_does_not_belong_together_stays_apart(
        self, engine: Engine, make_motion: Any, make_result: Any, store_result: Any
    ) -> None:
        motion, up = make_motion(1), make_motion(2)
        plain = make_result(motion.pga_g)
        with engine.begin() as connection:
            motion_id, _ = add_motion(connection, motion, earthquake=QUAKE, is_vertical=False)
            up_id, _ = add_motion(connection, up, earthquake=QUAKE, is_vertical=True)
            campaign = start_campaign(connection, {})

            def store(result: Any, **changes: Any) -> str:
                return str(store_result(connection, campaign, motion, motion_id, result, **changes))

            key = store(plain)
            # a row of the linear model, which older versions stored, is not among the answers
            linear = store(make_result(motion.pga_g, search_limit=0.3))
            connection.execute(
                update(schema.combination)
                .where(schema.combination.c.natural_key == linear)
                .values(linear=True)
            )
            store(plain, numerics_version="0")
            store(make_result(motion.pga_g, search_limit=0.2))
            with_up = store(plain, vertical=(up_id, up))
            assert combination_table(connection).natural_key.tolist() == [key]
            both = combination_table(connection, vertical="both").natural_key.tolist()
            assert both == sorted([key, with_up])
            only = combination_table(connection, vertical="with").natural_key.tolist()
            assert only == [with_up]
            with pytest.raises(InputError, match="vertical must be"):
                combination_table(connection, vertical="up")  # type: ignore[arg-type]

    def test_points(self, filled: Engine) -> None:
        with filled.connect() as connection:
            table = combination_table(connection)
            i = int(np.flatnonzero(table.status == "found")[0])
            points = stored_combination(connection, table.natural_key[i]).points
        k = table.kr_over_pga[i]
        np.testing.assert_array_equal(points.kr_over_pga, [0.9, k + 0.01, k])
        np.testing.assert_array_equal(points.theta_n, [0.1, 0.7, np.nan])
        assert points.outcome == ("stable", "stable", "toppled")

    def test_info(self, filled: Engine) -> None:
        with filled.connect() as connection:
            info = database_info(connection)
        assert info.rows["combination"] == 6
        assert info.rows["motion"] == 3
        assert info.combinations_by_status == {"below_limit": 3, "found": 3}
        assert info.numerics_versions == (NUMERICS_VERSION,)
        assert info.default_model is None
        assert info.dialect == filled.dialect.name

    def test_by_suite(
        self, filled: Engine, make_motion: Any, make_result: Any, store_result: Any
    ) -> None:
        motion, up, idle = (make_motion(seed) for seed in (4, 5, 6))
        with filled.begin() as connection:
            ids = [
                add_motion(connection, item, earthquake=QUAKE, is_vertical=vertical, suite=suite)[0]
                for item, vertical, suite in (
                    (motion, False, "t"),
                    (up, True, "t"),
                    (idle, False, "not searched"),
                )
            ]
            add_to_suite(connection, "s", ids[0])
            campaign = start_campaign(connection, {})
            result = make_result(motion.pga_g)
            store_result(connection, campaign, motion, ids[0], result, vertical=(ids[1], up))
        with filled.connect() as connection:
            counts = suite_counts(connection).suites
        # Motions 1 and 2 of suite s and motion 3 of none have a found and a censored search each;
        # the new motion, in s and t, has one with its vertical component.
        assert counts == (
            SuiteCount("not searched", None, 1, 0, 0, 0, 0),
            SuiteCount("s", "toppling", 3, 5, 3, 2, 1),
            SuiteCount("t", "toppling", 1, 1, 1, 0, 1),
            SuiteCount(None, "toppling", 1, 2, 1, 1, 0),
        )

    def test_by_suite_of_an_empty_database(self, engine: Engine) -> None:
        with engine.connect() as connection:
            assert suite_counts(connection).suites == ()


class TestEqualDatabases:
    def test_order_times_and_campaigns_do_not_count(
        self, filled: Engine, fill: Any, tmp_path: Any
    ) -> None:
        # Against a file, so that SQLite and the server are also compared with each other.
        with opened_database(tmp_path / "other.db", create=True) as other:
            for order in ([3, 1], [2], [1, 2, 3]):
                with other.begin() as connection:
                    fill(connection, order)
            with filled.connect() as a, other.connect() as b:
                for table in CONTENT_TABLES:
                    mine = list(table_rows_by_natural_key(a, table))
                    assert mine == list(table_rows_by_natural_key(b, table))
                assert len(list(table_rows_by_natural_key(a, "simulation"))) == 18
                assert content_digest(a) == content_digest(b)

    @pytest.mark.parametrize(
        ("table", "values"),
        [
            ("simulation", {"theta_n": 0.5}),
            ("motion", {"samples": b""}),
            ("motion", {"processing": "raw"}),
            ("combination", {"n_runs": 41}),
            ("earthquake", {"magnitude": 7.6}),
            ("suite", {"name": "t"}),
        ],
    )
    def test_every_value_counts(self, filled: Engine, table: str, values: Any) -> None:
        with filled.begin() as connection:
            before = content_digest(connection)
            connection.execute(update(schema.metadata.tables[table]).values(**values))
            assert content_digest(connection) != before

    def test_a_missing_row_counts(self, filled: Engine) -> None:
        with filled.begin() as connection:
            before = content_digest(connection)
            connection.execute(delete(schema.suite_motion))
            assert content_digest(connection) != before

    def test_every_table_is_compared(self) -> None:
        assert {*CONTENT_TABLES, "campaign"} == set(schema.metadata.tables)
