"""Campaigns of sequences: which motions follow one another, what is stored, and what it shows."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import Engine, select, update

from rbfrag.campaign.database_check import resimulate
from rbfrag.campaign.kinds.slumping import FAMILY, BlockClass
from rbfrag.campaign.sequences import MotionPair, drawn_pairs, shocks_of_stations
from rbfrag.campaign.simulate import CampaignProgress, CampaignSummary, simulate
from rbfrag.db import schema
from rbfrag.db.check import check_database
from rbfrag.db.engine import open_database, opened_database
from rbfrag.db.insert import renew_digests
from rbfrag.db.merge import merge_databases
from rbfrag.db.motions import add_motion, load_motion, motion_rows
from rbfrag.db.rows import EarthquakeInfo, MotionRow
from rbfrag.errors import InputError, MergeConflictError, StoppedError
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.solver.respond import STARTS_ANEW, respond
from tests.synthetic import shaking

TWO = (FAMILY[0], FAMILY[8])
QUAKES = ("shock-1", "shock-10", "shock-2", "other")


def fill(place: str | Path, seeds: tuple[int, ...] = (0, 1, 2, 3)) -> None:
    """Store three shocks of one station and a motion of another one."""
    with opened_database(place, create=True) as engine, engine.begin() as connection:
        for seed in seeds:
            motion = GroundMotion(2.0 * shaking(seed, 450), 0.02, source_file=f"{seed}.txt")
            event = QUAKES[seed]
            add_motion(
                connection,
                motion,
                earthquake=EarthquakeInfo(event, time="1986", guessed=False),
                is_vertical=False,
                recording=str(seed),
                station="" if event == "other" else "ZAK",
                component="360",
            )


@pytest.fixture
def database(tmp_path: Path) -> Path:
    fill(tmp_path / "s.db")
    return tmp_path / "s.db"


def run(place: str | Path, kind: str = "sliding", **more: Any) -> CampaignSummary:
    block_inputs = {"family": TWO, "rotations_deg": (1.0, None)} if kind == "slumping" else {}
    return simulate(place, kind=kind, sequence=True, **{"jobs": 1, **block_inputs, **more})


def stored(engine: Engine) -> list[Any]:
    query = select(schema.shock_pair).order_by(schema.shock_pair.c.natural_key)
    with engine.connect() as connection:
        return list(connection.execute(query).mappings())


def test_slips_of_a_level_plane_add_up_and_nothing_else_changes(place: str) -> None:
    fill(place)
    summary = run(place, displacements_m=(0.05, 0.5))
    assert summary.sequence is not None
    # 4 motions, 2 polarities, 4 blocks
    assert summary.combinations == summary.not_searched == 4 * 2 * 4
    assert (summary.sequence.station_pairs, summary.sequence.drawn_pairs) == (2, 2)
    assert summary.runs == 3 * summary.combinations
    engine = open_database(place)
    try:
        rows = stored(engine)
        assert len(rows) == summary.combinations
        for row in rows:
            parts = row["first_displacement_m"] + row["intact_displacement_m"]
            assert row["second_displacement_m"] == pytest.approx(parts, rel=1e-12)
            assert row["first_rotation_rad"] is row["critical_rad"] is None
            assert row["yield_g"] == json.loads(row["block"])["ky"]
        assert any(row["first_displacement_m"] > 0.0 for row in rows)
        with engine.connect() as connection:
            assert check_database(connection) == []
            again = resimulate(connection, sample=100)
        assert (again.sampled, again.exact) == (len(rows), len(rows))
    finally:
        engine.dispose()
    for share in summary.sequence.conditional:
        assert share.probability >= share.intact_probability
        if share.state_to == 0.0:
            assert share.fails == share.intact_fails


def test_slumps_are_those_of_a_sequence_of_two_motions(place: str) -> None:
    fill(place)
    assert run(place, "slumping").combinations == 4 * 2 * 2
    moved = 0
    engine = open_database(place)
    try:
        for row in stored(engine):
            with engine.connect() as connection:
                first = load_motion(connection, row["first_motion_id"])
                second = load_motion(connection, row["second_motion_id"])
            separate = BlockClass(**json.loads(row["block"]))
            planes: dict[str, Any] = {"beta_deg": separate.beta_deg, "phi_deg": separate.phi_deg}
            planes |= {"block": separate.block, "polarity": row["polarity"]}
            both, alone = respond([first, second], **planes), respond(second, **planes)
            assert row["intact_peak_rad"] == alone.peak_theta_rad
            assert row["first_outcome"] == both.parts[0].response.outcome
            assert row["critical_rad"] == math.radians(alone.critical_angle_deg or 0.0)
            if row["second_outcome"] is None:
                assert len(both.parts) == 1
                continue
            assert (row["second_outcome"], row["second_peak_rad"]) == (
                both.outcome,
                both.peak_theta_rad,
            )
            if both.displacement_m is not None:
                slip = pytest.approx(both.displacement_m, rel=1e-12, abs=1e-15)
                assert row["second_displacement_m"] == slip
            moved += row["first_rotation_rad"] > 0.0
        # both of the station; which ones are drawn hangs on the last bits of the made-up samples
        assert moved >= 2
    finally:
        engine.dispose()


def test_one_and_two_workers_give_equal_databases_and_tables(
    database: Path, copy_of: Callable[[Path, str], Path], digest_of: Callable[[Path], str]
) -> None:
    other = copy_of(database, "other.db")
    tables = [run(place, jobs=jobs).sequence for place, jobs in ((database, 1), (other, 2))]
    assert digest_of(database) == digest_of(other)
    assert tables[0] == tables[1]


def test_a_campaign_that_was_stopped_goes_on_where_it_stopped(
    database: Path, copy_of: Callable[[Path, str], Path], digest_of: Callable[[Path], str]
) -> None:
    other = copy_of(database, "other.db")
    complete = run(other)
    seen: list[CampaignProgress] = []
    with pytest.raises(StoppedError, match="8 of 32 stored; the same command goes on"):
        run(database, on_progress=seen.append, stopped=lambda: seen[-1].completed > 0)
    again = run(database)
    assert (again.resumed, again.combinations) == (8, 32)
    assert again.sequence == complete.sequence
    assert digest_of(database) == digest_of(other)
    assert (run(database).runs, run(database).resumed) == (0, 32)


def test_another_seed_and_more_draws_add_to_what_is_there(database: Path) -> None:
    assert run(database, seed=1).runs == 96
    more = run(database, seed=1, draws=2)
    assert more.sequence is not None
    assert (more.sequence.station_pairs, more.sequence.drawn_pairs) == (2, 4)
    assert (more.resumed, more.runs) == (32, 48)
    # the shocks of the station are there; which of the others are depends on the draws
    assert run(database, seed=2).resumed >= 16


def test_merged_databases_hold_both(
    database: Path, tmp_path: Path, digest_of: Callable[[Path], str]
) -> None:
    run(database)
    report = merge_databases(database, db=tmp_path / "new.db")
    assert report.added["shock_pair"] == 32
    assert digest_of(database) == digest_of(tmp_path / "new.db")
    again = merge_databases(database, db=tmp_path / "new.db")
    assert again.same["shock_pair"] == 32
    assert "shock_pair" not in again.added
    for values, accepted in (
        ({"pairing": "drawn"}, True),
        ({"second_displacement_m": 7.0}, False),
    ):
        with opened_database(database) as engine, engine.begin() as connection:
            connection.execute(update(schema.shock_pair).values(**values))
            renew_digests(connection, schema.shock_pair)
        if accepted:
            assert merge_databases(database, db=tmp_path / "new.db").added == {}
        else:
            with pytest.raises(MergeConflictError, match="second_displacement_m"):
                merge_databases(database, db=tmp_path / "new.db")


@pytest.mark.parametrize(
    ("values", "problem"),
    [
        ({"natural_key": "0" * 64}, "natural key is not the hash"),
        ({"block": "{"}, "block cannot be read"),
        ({"first_outcome": "jump"}, "yet the second is said to find the block at rest"),
    ],
)
def test_damage_is_found(database: Path, values: dict[str, str], problem: str) -> None:
    run(database)
    with opened_database(database) as engine, engine.begin() as connection:
        first = schema.shock_pair.c.id == 1
        connection.execute(update(schema.shock_pair).where(first).values(**values))
        problems = [item.problem for item in check_database(connection)]
    assert any(problem in item for item in problems)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"kind": "toppling"}, f"sequence cannot be combined with kind toppling: {STARTS_ANEW}"),
        ({"kind": "rocking"}, f"sequence cannot be combined with kind rocking: {STARTS_ANEW}"),
        ({"vertical": "both"}, "vertical cannot be combined with sequence"),
        ({"p2": (3.0,)}, "p2 requires kind rocking or toppling"),
        ({"draws": 0}, "draws must be at least 1, not 0"),
    ],
)
def test_what_does_not_go_with_a_sequence_is_rejected(
    database: Path, options: dict[str, Any], message: str
) -> None:
    with pytest.raises(InputError) as rejected:
        simulate(database, **{"kind": "sliding", "sequence": True, **options})
    assert message in str(rejected.value)
    assert len(str(rejected.value)) < 500


def test_one_earthquake_makes_no_pair(tmp_path: Path) -> None:
    fill(tmp_path / "one.db", (3,))
    with pytest.raises(InputError, match="no motions of two earthquakes"):
        run(tmp_path / "one.db")


def _rows(database: Path) -> list[MotionRow]:
    with opened_database(database, read_only=True) as engine, engine.connect() as connection:
        return motion_rows(connection)


def _events(pairs: tuple[MotionPair, ...]) -> list[tuple[str, str]]:
    return [(pair.first.event_id, pair.second.event_id) for pair in pairs]


def test_shocks_of_a_station_follow_one_another_in_time(database: Path) -> None:
    rows = _rows(database)
    year = dict.fromkeys(QUAKES, "1986")
    numbered = [("shock-1", "shock-2"), ("shock-2", "shock-10")]
    assert _events(shocks_of_stations(rows, year)) == numbered
    # a time that is stated comes before the number
    dated = {**year, "shock-10": "1986-01-01T00:00"}
    dated |= {"shock-1": "1986-07-21T14:42", "shock-2": "1986-07-21T14:51"}
    in_time = [("shock-10", "shock-1"), ("shock-1", "shock-2")]
    assert _events(shocks_of_stations(rows, dated)) == in_time
    clocks = {"shock-1": "14:52", "shock-2": "14:42", "shock-10": "14:29", "other": None}
    document = [replace(row, start_time=clocks[row.event_id]) for row in rows]
    assert _events(shocks_of_stations(document, year)) == [
        ("shock-10", "shock-2"),
        ("shock-2", "shock-1"),
    ]


def test_what_metadata_do_not_say_makes_no_shocks_of_a_station(database: Path) -> None:
    rows = _rows(database)
    year = dict.fromkeys(QUAKES, "1986")
    for changes in (
        {"event_guessed": True},
        {"component": "270", "orientation_deg": 270.0},
        {"station": "BEN"},
    ):
        changed = [replace(row, **changes) if row.id == 2 else row for row in rows]
        assert _events(shocks_of_stations(changed, year)) == [("shock-1", "shock-2")]
    assert shocks_of_stations(rows, {}) == ()


def test_draws_depend_on_samples_and_seed_alone(database: Path) -> None:
    rows = _rows(database)
    pairs = drawn_pairs(rows, set(), 1, 2)
    assert _events(drawn_pairs(rows[::-1], set(), 1, 2))[::-1] != []
    key = {(pair.first.sha256, pair.second.sha256) for pair in pairs}
    backward = drawn_pairs(rows[::-1], set(), 1, 2)
    assert {(pair.first.sha256, pair.second.sha256) for pair in backward} == key
    assert all(item != other for item, other in _events(pairs))
    # a motion that is not there changes only the pairs that it is drawn for
    fewer = drawn_pairs(rows[:-1], set(), 1, 2)
    retained = {(item, other) for item, other in _events(pairs) if "other" not in (item, other)}
    assert retained <= set(_events(fewer))
