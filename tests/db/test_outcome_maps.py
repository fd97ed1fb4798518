"""The maps of outcomes: stored with their combination, read as arrays."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from sqlalchemy import Engine, func, select

from rbfrag.db import schema
from rbfrag.db.campaigns import CombinationRecord, insert_combinations, start_campaign
from rbfrag.db.motions import add_motion
from rbfrag.db.outcome_maps import OutcomeMaps, outcome_maps
from rbfrag.db.queries import combination_table
from rbfrag.db.rows import EarthquakeInfo
from rbfrag.errors import InputError
from rbfrag.solver.results import CriticalResult, OutcomeIntervals

QUAKE = EarthquakeInfo("chi-chi-1999", guessed=False)

MAP = OutcomeIntervals(
    k_lo=np.array([0.01, 0.2, 0.200001, 0.4, 0.400001]),
    k_hi=np.array([0.2, 0.200001, 0.4, 0.400001, 1.0]),
    outcome=("safe", "undecided", "topples", "undecided", "safe"),
)
NAN = float("nan")


def _record(key: str, motion_id: int, result: CriticalResult) -> CombinationRecord:
    return CombinationRecord(key, motion_id, None, "forward", "toppling", result.p2, {}, result)


def _filled(engine: Engine, make_motion: Any, make_result: Any) -> dict[str, int]:
    """Store one combination of each kind; return their row ids by what they are."""
    kinds = {
        "mapped": {"intervals": MAP},
        "given_up": {"intervals": OutcomeIntervals(MAP.k_lo[2:], MAP.k_hi[2:], MAP.outcome[2:])},
        "no_motion": {"status": "no_motion"},
        "outside_model": {"status": "outside_model", "certified": False},
    }
    motion = make_motion()
    with engine.begin() as connection:
        motion_id, _ = add_motion(connection, motion, earthquake=QUAKE, is_vertical=False)
        records = [
            _record(f"{n:064d}", motion_id, make_result(motion.pga_g, **kind))
            for n, kind in enumerate(kinds.values())
        ]
        campaign = start_campaign(connection, {})
        assert insert_combinations(connection, campaign, records) == len(records)
        assert insert_combinations(connection, campaign, records[::-1]) == 0
        assert connection.scalar(select(func.count()).select_from(schema.outcome_interval)) == 8
        table = combination_table(connection)
        assert len(set(table.p2)) == 1
        ids = connection.execute(
            select(schema.combination.c.natural_key, schema.combination.c.id)
        ).all()
    by_key = {row.natural_key: row.id for row in ids}
    return {kind: by_key[f"{n:064d}"] for n, kind in enumerate(kinds)}


def _maps(engine: Engine, ids: list[int]) -> OutcomeMaps:
    with engine.connect() as connection:
        return outcome_maps(connection, ids)


def test_what_each_block_does(engine: Engine, make_motion: Any, make_result: Any) -> None:
    ids = _filled(engine, make_motion, make_result)
    k = [0.005, 0.01, 0.1, 0.2, 0.2000005, 0.200001, 0.3, 0.4, 0.400001, 0.9, 1.0, 7.0, NAN]
    expected = {
        "outside_model": [NAN] * 13,
        "mapped": [NAN, 0, 0, 0, NAN, 1, 1, 1, 0, 0, 0, 0, NAN],
        "no_motion": [NAN, *[0] * 11, NAN],
        "given_up": [NAN, NAN, NAN, NAN, NAN, 1, 1, 1, 0, 0, 0, 0, NAN],
    }
    maps = _maps(engine, [ids[kind] for kind in expected])
    np.testing.assert_array_equal(maps.outcomes(k), list(expected.values()))
    assert maps.combination_id.tolist() == [ids[kind] for kind in expected]


def test_each_combination_has_its_own_grid(
    engine: Engine, make_motion: Any, make_result: Any
) -> None:
    ids = _filled(engine, make_motion, make_result)
    maps = _maps(engine, [ids["mapped"], ids["given_up"]])
    np.testing.assert_array_equal(maps.outcomes([[0.1, 0.3], [0.3, 0.1]]), [[0, 1], [1, NAN]])
    with pytest.raises(InputError, match="for 2 combinations"):
        maps.outcomes([[0.1], [0.2], [0.3]])


def test_the_same_combination_twice_and_none_at_all(
    engine: Engine, make_motion: Any, make_result: Any
) -> None:
    ids = _filled(engine, make_motion, make_result)
    twice = _maps(engine, [ids["mapped"], ids["mapped"]])
    np.testing.assert_array_equal(twice.outcomes([0.3]), [[1], [1]])
    assert _maps(engine, []).outcomes([0.3]).shape == (0, 1)
    with pytest.raises(InputError, match="no combination 999"):
        _maps(engine, [999])


def test_the_search_limit_is_known_whatever_its_rounding(
    engine: Engine, make_motion: Any, make_result: Any
) -> None:
    ids = _filled(engine, make_motion, make_result)
    just_below = np.nextafter(0.01, 0.0)
    np.testing.assert_array_equal(_maps(engine, [ids["mapped"]]).outcomes([just_below]), [[0]])


def test_what_lies_between_decided_intervals_is_not_known(
    engine: Engine, make_motion: Any, make_result: Any
) -> None:
    decided = [i for i, word in enumerate(MAP.outcome) if word != "undecided"]
    alone = OutcomeIntervals(
        MAP.k_lo[decided], MAP.k_hi[decided], tuple(MAP.outcome[i] for i in decided)
    )
    motion = make_motion()
    with engine.begin() as connection:
        motion_id, _ = add_motion(connection, motion, earthquake=QUAKE, is_vertical=False)
        record = _record("0" * 64, motion_id, make_result(motion.pga_g, intervals=alone))
        insert_combinations(connection, start_campaign(connection, {}), [record])
        (row_id,) = connection.scalars(select(schema.combination.c.id))
    k = [0.005, 0.01, 0.2, 0.2000005, 0.200001, 0.4, 0.4000005, 0.400001, 1.0, 7.0]
    told = _maps(engine, [row_id]).outcomes(k)
    np.testing.assert_array_equal(told, [[NAN, 0, 0, NAN, 1, 1, NAN, 0, 0, 0]])
