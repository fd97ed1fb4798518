"""The blocks of a grid: stored beside a search, without one or later, and read as arrays."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from sqlalchemy import Engine, select

from rbfrag.db import schema
from rbfrag.db.campaigns import (
    CombinationRecord,
    add_grids,
    add_maps,
    insert_combinations,
    known_combinations,
    start_campaign,
    stored_combination,
)
from rbfrag.db.check import check_database
from rbfrag.db.engine import opened_database
from rbfrag.db.keys import combination_key, row_digests
from rbfrag.db.merge import merge_databases
from rbfrag.db.motions import add_motion
from rbfrag.db.queries import combination_table, outcome_grid
from rbfrag.db.rows import EarthquakeInfo
from rbfrag.errors import InputError
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.solver.results import NUMERICS_VERSION, OutcomeIntervals, SearchPoints

BLOCK = {"shape": 3}

GRID = SearchPoints(
    kr_over_pga=np.array([0.9, 0.6, 0.3, 0.005]),
    theta_n=np.array([0.1, 0.4, np.nan, np.nan]),
    outcome=("stable", "stable", "undetermined", "toppled"),
)

MAP = OutcomeIntervals(np.array([0.01, 0.1]), np.array([0.1, 1.0]), ("topples", "safe"))

Store = Callable[..., list[str]]


@pytest.fixture
def store(make_motion: Any, make_result: Any) -> Store:
    """Store a combination of each p² of one motion, and return their keys."""

    def stored(engine: Engine, *p2: float, searched: bool = True, **values: Any) -> list[str]:
        motion: GroundMotion = make_motion()
        changes = values.pop("changes", {})
        records = []
        with engine.begin() as connection:
            quake = EarthquakeInfo("E", guessed=False)
            motion_id, _ = add_motion(connection, motion, earthquake=quake, is_vertical=False)
            for value in p2:
                fields: dict[str, Any] = {"kind": "toppling" if searched else "falls", "p2": value}
                fields["block"] = None if searched else BLOCK
                settings = {"search_limit": 0.01} if searched else {}
                key = combination_key(
                    motion_sha256=motion.sha256, dt_s=0.01, vertical_sha256=None,
                    polarity="forward", numerics_version=NUMERICS_VERSION, settings=settings,
                    **fields,
                )  # fmt: skip
                result = make_result(motion.pga_g, p2=value, k=0.1, **changes)
                records.append(
                    CombinationRecord(
                        natural_key=key,
                        motion_id=motion_id,
                        vertical_motion_id=None,
                        result=result if searched else None,
                        settings=settings,
                        polarity="forward",
                        **fields,
                        **values,
                    )
                )
            insert_combinations(connection, start_campaign(connection, {}), records)
        return [record.natural_key for record in records]

    return stored


def test_a_grid_beside_a_search(engine: Engine, store: Store) -> None:
    store(engine, 3.0, 1.0, grid=GRID)
    with engine.connect() as connection:
        table = combination_table(connection)
        ids = table.combination_id[::-1]
        grid = outcome_grid(connection, ids)
        points = stored_combination(connection, table.natural_key[-1]).points
        assert check_database(connection) == []
    np.testing.assert_array_equal(grid.k_over_pga, [GRID.kr_over_pga] * 2)
    np.testing.assert_array_equal(grid.outcome, [[0.0, 0.0, np.nan, 1.0]] * 2)
    np.testing.assert_array_equal(grid.theta_n, [GRID.theta_n] * 2)
    assert np.isnan(grid.displacement_m).all()
    # 0.9 was run by the search as well, and is one block
    np.testing.assert_allclose(points.kr_over_pga, [0.9, 0.6, 0.3, 0.11, 0.1, 0.005])


def test_combinations_without_a_search(engine: Engine, store: Store) -> None:
    slid = np.array([0.0, 0.1, 0.2, 0.9])
    blocks = SearchPoints(GRID.kr_over_pga, np.full(4, np.nan), ("stable",) * 4, slid)
    (key,) = store(engine, 3.0, searched=False, grid=blocks)
    with engine.connect() as connection:
        table = combination_table(connection, kind="falls")
        assert table.status.tolist() == ["not_searched"]
        assert table.block.tolist() == ['{"shape":3}']
        assert np.isnan(table.search_limit).all()
        np.testing.assert_array_equal(
            outcome_grid(connection, table.combination_id).displacement_m, [slid]
        )
        combination = known_combinations(connection, [key])[key]
        assert (combination.gridded, combination.mapped, combination.reentrant) == (
            True,
            False,
            None,
        )
        assert check_database(connection) == []


def test_a_grid_that_comes_later(engine: Engine, store: Store) -> None:
    first, second = store(engine, 3.0, 1.0)
    with engine.connect() as connection:
        ids = combination_table(connection).combination_id
        assert outcome_grid(connection, ids).outcome.shape == (2, 0)
        assert not known_combinations(connection, [first])[first].gridded
    with engine.begin() as connection:
        for _ in range(2):
            add_grids(connection, {first: GRID})
        with pytest.raises(InputError, match="unknown combination"):
            add_grids(connection, {"0" * 64: GRID})
    with engine.connect() as connection:
        combinations = known_combinations(connection, [first, second])
        assert [combinations[key].gridded for key in (first, second)] == [True, False]
        grid = outcome_grid(connection, [combinations[second].id, combinations[first].id])
        assert np.isnan(grid.k_over_pga[0]).all()
        np.testing.assert_array_equal(grid.k_over_pga[1], GRID.kr_over_pga)
        assert check_database(connection) == []


def test_a_map_that_comes_later(engine: Engine, store: Store, make_result: Any) -> None:
    nothing = {"island_width": None, "kr_over_pga_resolved": None, "reentrant": None}
    (key,) = store(engine, 3.0, changes=nothing)
    with engine.begin() as connection:
        combination = known_combinations(connection, [key])[key]
        assert (combination.mapped, combination.reentrant) == (False, None)
        mapped = make_result(0.5, intervals=MAP, reentrant=True, island_width=0.09)
        for _ in range(2):
            add_maps(connection, {key: mapped})
        combination = known_combinations(connection, [key])[key]
        assert (combination.mapped, combination.reentrant) == (True, True)
        row = connection.execute(select(schema.combination)).mappings().one()
        assert row["island_width"] == 0.09
        assert check_database(connection) == []


@pytest.mark.parametrize("ours_is_gridded", [False, True])
def test_grids_and_maps_are_merged(
    sqlite_file: Any, tmp_path: Any, store: Store, ours_is_gridded: bool
) -> None:
    other = tmp_path / "other.db"
    other.write_bytes(sqlite_file.read_bytes())
    shifted = SearchPoints(GRID.kr_over_pga * (1.0 + 1e-15), GRID.theta_n, GRID.outcome)
    with opened_database(sqlite_file) as engine:
        store(engine, 3.0, grid=GRID if ours_is_gridded else None)
    with opened_database(other) as engine:
        store(engine, 3.0, grid=shifted, changes={"intervals": MAP})
    added = merge_databases(other, db=sqlite_file).added
    assert added.pop("outcome_interval") == 2
    assert added.get("simulation", 0) == (0 if ours_is_gridded else 4)
    with opened_database(sqlite_file, read_only=True) as engine, engine.connect() as connection:
        ids = combination_table(connection).combination_id
        ratios = outcome_grid(connection, ids).k_over_pga
        assert check_database(connection) == []
    np.testing.assert_allclose(ratios, [GRID.kr_over_pga], rtol=1e-14)
    assert merge_databases(other, db=sqlite_file).added == {}


def test_digests_are_those_of_values_as_they_are_stored() -> None:
    (digest,) = row_digests(["float", "boolean", "text"], [[2], [1], ["Zürich"]])
    (same,) = row_digests(["float", "boolean", "text"], [[np.float64(2.0)], [np.True_], ["Zürich"]])
    assert digest == same
    zeros = row_digests(["float", "bytes"], [[0.0, -0.0, None], [b"", b"", b""]])
    assert zeros[0] == zeros[1] != zeros[2]
    # written down, since stored digests must be found again by every later version
    assert row_digests(["integer", "float", "text"], [[7], [0.1], [None]]) == [-6115838504293383156]


def test_digests_cost_little() -> None:
    n = 20_000
    types = ["integer", "float", "integer", "float", "text", "float"]
    columns = [[7] * n, [None] * n, list(range(n)), [0.1 + i / n for i in range(n)],
               ["stable"] * n, [i / n for i in range(n)]]  # fmt: skip
    started = time.perf_counter()
    row_digests(types, columns)  # type: ignore[arg-type]
    assert (time.perf_counter() - started) / n < 2e-5  # some 2e-6 on an idle machine
