"""Combinations of a campaign: components x vertical x polarity x p², grids, histories."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from sqlalchemy import select, update

from rbfrag.campaign.database_check import resimulate
from rbfrag.campaign.plan import strengths_of
from rbfrag.campaign.simulate import simulate
from rbfrag.db import schema
from rbfrag.db.campaigns import stored_combination
from rbfrag.db.check import check_database
from rbfrag.db.engine import opened_database
from rbfrag.db.motions import add_motion, load_motion, motion_rows
from rbfrag.db.queries import combination_table
from rbfrag.db.rows import EarthquakeInfo
from rbfrag.errors import InputError
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.solver.search.critical import critical
from rbfrag.solver.toppling_run import respond
from tests.synthetic import shaking

P2 = (10.0, 1.0)
Digest = Callable[[Path], str]
Copy = Callable[[Path, str], Path]


def _combinations(database: Path) -> list[Any]:
    with opened_database(database, read_only=True) as engine, engine.connect() as connection:
        return list(connection.execute(select(schema.combination)).mappings())


def _sound(database: Path) -> None:
    with opened_database(database, read_only=True) as engine, engine.connect() as connection:
        assert check_database(connection) == []
        again = resimulate(connection, sample=4)
        assert (again.exact, again.findings) == (again.sampled, ())


class TestVertical:
    def test_with_without_and_both(self, three_component_database: Path) -> None:
        database = three_component_database
        with_up = simulate(database, p2=P2, vertical="with", jobs=1)
        assert (with_up.combinations, with_up.without_vertical) == (4 * 2 * 2, 1)
        assert "1 of 5 horizontal motions" in with_up.warnings[0]
        assert "left out" in with_up.warnings[0]
        both = simulate(database, p2=P2, vertical="both", jobs=1)
        assert (both.combinations, both.resumed) == (16 + 5 * 4, 16)
        assert "shaken without one only" in both.warnings[0]
        alone = simulate(database, p2=P2, jobs=1)
        assert (alone.combinations, alone.resumed, alone.warnings) == (20, 20, ())
        _sound(database)

    def test_a_row_is_what_the_solver_says_of_both_components(
        self, three_component_database: Path
    ) -> None:
        database = three_component_database
        simulate(database, p2=(3.0,), vertical="with", jobs=1)
        rows = _combinations(database)
        with opened_database(database, read_only=True) as engine, engine.connect() as connection:
            motions = {row.id: load_motion(connection, row.id) for row in motion_rows(connection)}
        assert any(motions[row["vertical_motion_id"]].npts == 450 for row in rows)
        for row in rows:
            motion, up = motions[row["motion_id"]], motions[row["vertical_motion_id"]]
            assert (motion.station, up.component) == (up.station, "UP")
            document = critical(motion, p2=3.0, vertical=up, polarity=row["polarity"])
            assert row["kr_over_pga"] == document.kr_over_pga
            short = "450 samples" in row["warnings"]
            assert short == (up.npts == 450)

    def test_verticals_need_not_be_in_the_suite(self, three_component_database: Path) -> None:
        document = simulate(
            three_component_database, suite="horizontals", p2=(3.0,), vertical="with", jobs=1
        )
        assert document.combinations == 8

    def test_what_throws_the_block_is_outside_the_model(
        self, three_component_database: Path
    ) -> None:
        database = three_component_database
        quake = EarthquakeInfo("somewhere", guessed=False)
        thrown = shaking(7) * 0.0
        thrown[300] = -1.5
        with opened_database(database) as engine, engine.begin() as connection:
            add_motion(
                connection, GroundMotion(thrown, 0.02), earthquake=quake, is_vertical=True,
                recording="c", station="c",
            )  # fmt: skip
        document = simulate(database, p2=P2, vertical="with", grid=[0.5], jobs=1)
        assert (document.outside_model, document.without_vertical) == (4, 0)
        (row,) = {
            (row["kr_over_pga"], row["certified"])
            for row in _combinations(database)
            if row["status"] == "outside_model"
        }
        assert row == (None, False)
        _sound(database)

    def test_none_at_all_is_rejected(self, three_component_database: Path) -> None:
        database = three_component_database
        with opened_database(database) as engine, engine.begin() as connection:
            connection.execute(update(schema.motion).values(is_vertical=False))
        with pytest.raises(InputError, match="none of the 7 horizontal motions has a vertical"):
            simulate(database, p2=P2, vertical="with", jobs=1)
        with pytest.raises(InputError, match="'up'"):
            simulate(database, p2=P2, vertical="up", jobs=1)  # type: ignore[arg-type]


class TestGrid:
    def test_its_values(self) -> None:
        grid = strengths_of(23)
        assert (len(grid), grid[0], grid[-1]) == (23, 0.99, 0.01)
        ratios = np.diff(np.log(grid))
        np.testing.assert_allclose(ratios, ratios[0], rtol=1e-10)

    @pytest.mark.parametrize(
        ("grid", "message"),
        [(1, "2 to"), ([0.5, 0.5], "twice"), ([-1.0], "above zero"), ([float("nan")], "finite")],
    )
    def test_what_is_rejected(
        self, three_component_database: Path, grid: Any, message: str
    ) -> None:
        with pytest.raises(InputError, match=message):
            simulate(three_component_database, p2=P2, grid=grid)

    def test_its_runs_are_stored(self, three_component_database: Path) -> None:
        database = three_component_database
        document = simulate(database, p2=(3.0,), vertical="both", grid=7, jobs=1)
        assert document.grid_runs == 7 * document.combinations
        with opened_database(database, read_only=True) as engine, engine.connect() as connection:
            table = combination_table(connection)
            motion = load_motion(connection, int(table.motion_id[0]))
            points = stored_combination(connection, table.natural_key[0]).points
        for k in strengths_of(7):
            run = respond(motion, p2=3.0, kr=k * motion.pga_g, polarity=table.polarity[0])
            i = points.kr_over_pga.tolist().index(k)
            assert points.outcome[i] == run.outcome
            expected = np.nan if run.peak_theta_n is None else run.peak_theta_n
            np.testing.assert_equal(points.theta_n[i], expected)
        _sound(database)

    def test_it_comes_to_the_same_afterwards(
        self, three_component_database: Path, copy_of: Copy, digest_of: Digest
    ) -> None:
        at_once, later = three_component_database, copy_of(three_component_database, "later.db")
        simulate(at_once, p2=P2, grid=5, jobs=1)
        searched = simulate(later, p2=P2, jobs=1)
        assert searched.grid_runs == 0
        gridded = simulate(later, p2=P2, grid=5, jobs=1)
        assert (gridded.resumed, gridded.runs) == (0, 5 * gridded.combinations)
        again = simulate(later, p2=P2, grid=5, jobs=1)
        assert (again.resumed, again.runs) == (again.combinations, 0)
        assert digest_of(at_once) == digest_of(later)


class TestHistories:
    def test_those_asked_for_are_kept(
        self, three_component_database: Path, copy_of: Copy, digest_of: Digest
    ) -> None:
        database = three_component_database
        later = copy_of(database, "later.db")
        document = simulate(
            database, p2=(3.0,), vertical="both", store_responses=[0.3, "critical"], jobs=1
        )
        assert document.responses == document.combinations + document.found
        simulate(later, p2=(3.0,), vertical="both", jobs=1)
        simulate(later, p2=(3.0,), vertical="both", store_responses=["critical"], jobs=2)
        last = simulate(later, p2=(3.0,), vertical="both", store_responses=[0.3], jobs=1)
        assert last.responses == last.combinations
        again = simulate(
            later, p2=(3.0,), vertical="both", store_responses=[0.3, "critical"], jobs=1
        )
        assert (again.resumed, again.responses) == (again.combinations, 0)
        assert digest_of(database) == digest_of(later)
        _sound(database)

    def test_they_are_those_of_the_solver(self, three_component_database: Path) -> None:
        database = three_component_database
        simulate(database, p2=(3.0,), vertical="with", store_responses=["critical"], jobs=1)
        with opened_database(database, read_only=True) as engine, engine.connect() as connection:
            rows = list(connection.execute(select(schema.response)).mappings())
            critical_values = {row["kr"] for row in _combinations(database)}
            assert {row["kr"] for row in rows} == critical_values - {None}
            row = rows[0]
            document = respond(
                load_motion(connection, row["motion_id"]),
                vertical=load_motion(connection, row["vertical_motion_id"]),
                p2=3.0,
                kr=row["kr"],
                polarity=row["polarity"],
                history=True,
            )
        assert row["outcome"] == document.outcome == "toppled"
        assert document.history is not None
        for name in ("time_s", "theta_rad", "theta_dot_rad_s", "k_h", "k_v"):
            stored = np.frombuffer(row[name], dtype="<f8")
            np.testing.assert_array_equal(stored, getattr(document.history, name))
