"""Motions come back bit for bit, are stored once, and keep guessed events apart from stated."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from sqlalchemy import Engine, func, select, update

from rbfrag.db import schema
from rbfrag.db.engine import opened_database
from rbfrag.db.motions import add_motion, load_motion, motion_row, motion_rows, suite_names
from rbfrag.db.rows import EarthquakeInfo
from rbfrag.errors import DatabaseError, InputError
from rbfrag.motions.ground_motion import GroundMotion

MakeMotion = Callable[..., GroundMotion]

GUESS = EarthquakeInfo("CHRISTCHURCH 2011")
QUAKE = EarthquakeInfo("christchurch-2011", "Christchurch", 6.2, "2011-02-21", guessed=False)

samples_g = hnp.arrays(
    np.float64,
    st.integers(1, 60),
    elements=st.floats(-50.0, 50.0, allow_nan=False, allow_subnormal=True),
)


def _rows(engine: Engine, table: str) -> int:
    with engine.connect() as connection:
        return connection.scalar(select(func.count()).select_from(schema.metadata.tables[table]))


@given(samples_g, st.floats(1e-4, 1.0))
@settings(max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_samples_come_back_bit_for_bit(engine: Engine, samples: np.ndarray, dt_s: float) -> None:
    motion = GroundMotion(samples, dt_s)
    with engine.begin() as connection:
        motion_id, _ = add_motion(connection, motion, earthquake=GUESS, is_vertical=False)
        back = load_motion(connection, motion_id)
    assert back.acceleration_g.tobytes() == samples.tobytes()
    assert back.dt_s == dt_s
    assert back.sha256 == motion.sha256


def test_all_labels_come_back(engine: Engine, make_motion: MakeMotion) -> None:
    motion = make_motion(
        component="N10E",
        orientation_deg=10.0,
        recording="R1",
        trace_index=2,
        file_format="at2",
        remarks=("the header says 4001 samples, the file has 4000",),
    )
    with engine.begin() as connection:
        motion_id, new = add_motion(
            connection,
            motion,
            earthquake=QUAKE,
            is_vertical=False,
            processing="corrected",
            flags=["low_amplitude"],
            suite="canterbury",
        )
        row = motion_row(connection, motion_id)
        back = load_motion(connection, motion_id)
    assert new
    assert row.name == "HVSC N10E"
    assert (row.event_id, row.event_guessed, row.magnitude) == ("christchurch-2011", False, 6.2)
    assert (row.recording, row.station, row.component) == ("R1", "HVSC", "N10E")
    assert (row.orientation_deg, row.is_vertical) == (10.0, False)
    assert (row.source_file, row.trace_index, row.file_format) == ("0.txt", 2, "at2")
    assert (row.processing, row.flags) == ("corrected", ("low_amplitude",))
    assert (row.dt_s, row.npts, row.sha256) == (0.01, 64, motion.sha256)
    measures = motion.measures
    assert (row.pga_g, row.pgv_m_s, row.pgd_m, row.tm_s) == (
        measures.pga_g,
        measures.pgv_m_s,
        measures.pgd_m,
        measures.tm_s,
    )
    assert row.final_velocity_m_s == measures.final_velocity_m_s
    assert row.final_displacement_m == measures.final_displacement_m
    assert back.remarks == motion.remarks
    assert (back.event, back.station, back.component) == ("Christchurch", "HVSC", "N10E")
    assert back.recording == "R1"


def test_the_same_samples_are_stored_once(engine: Engine, make_motion: MakeMotion) -> None:
    with engine.begin() as connection:
        first = add_motion(connection, make_motion(), earthquake=GUESS, is_vertical=False)
        again = add_motion(
            connection,
            make_motion(source_file="copy.txt", station="other"),
            earthquake=EarthquakeInfo("another guess"),
            is_vertical=False,
        )
        other_dt = add_motion(
            connection,
            replace(make_motion(), dt_s=0.02),
            earthquake=GUESS,
            is_vertical=False,
        )
        rows = motion_rows(connection)
    assert first[1]
    assert again == (first[0], False)
    assert other_dt[1]
    assert [row.id for row in rows] == [first[0], other_dt[0]]
    assert rows[0].station == "HVSC"
    assert rows[0].event_id == GUESS.event_id
    assert _rows(engine, "earthquake") == 1


def test_what_is_stated_replaces_the_guess(engine: Engine, make_motion: MakeMotion) -> None:
    with engine.begin() as connection:
        motion_id, _ = add_motion(
            connection, make_motion(), earthquake=GUESS, is_vertical=False, flags=["event_guessed"]
        )
        again = add_motion(
            connection,
            make_motion(),
            earthquake=QUAKE,
            is_vertical=True,
            recording="group",
            station="HVS",
            component="UP",
            processing="corrected",
        )
        row = motion_row(connection, motion_id)
    assert again == (motion_id, False)
    assert (row.event_id, row.event_guessed, row.is_vertical) == (QUAKE.event_id, False, True)
    assert (row.recording, row.station, row.component) == ("group", "HVS", "UP")
    assert (row.processing, row.flags) == ("corrected", ())
    assert (_rows(engine, "earthquake"), _rows(engine, "recording")) == (1, 1)


def test_a_guess_replaces_nothing(engine: Engine, make_motion: MakeMotion) -> None:
    with engine.begin() as connection:
        motion_id, _ = add_motion(connection, make_motion(), earthquake=QUAKE, is_vertical=False)
        before = motion_row(connection, motion_id)
        add_motion(connection, make_motion(), earthquake=GUESS, is_vertical=True, recording="x")
        assert motion_row(connection, motion_id) == before
    assert _rows(engine, "earthquake") == 1


def test_a_guess_of_the_same_spelling_is_not_merged(
    engine: Engine, make_motion: MakeMotion
) -> None:
    guess = replace(QUAKE, guessed=True)
    with engine.begin() as connection:
        add_motion(connection, make_motion(1), earthquake=QUAKE, is_vertical=False)
        add_motion(connection, make_motion(2), earthquake=guess, is_vertical=False)
        guessed = [row.event_guessed for row in motion_rows(connection)]
    assert guessed == [False, True]
    assert _rows(engine, "earthquake") == 2


def test_unknown_events_are_not_one_event(engine: Engine, make_motion: MakeMotion) -> None:
    nothing = EarthquakeInfo("")
    with engine.begin() as connection:
        for seed, recording in ((1, "A"), (2, "A"), (3, "")):
            add_motion(
                connection,
                make_motion(seed),
                earthquake=nothing,
                is_vertical=False,
                recording=recording,
            )
        events = [row.event_id for row in motion_rows(connection)]
    assert events[0] == events[1] != events[2]


def test_stated_events_that_differ_are_rejected(engine: Engine, make_motion: MakeMotion) -> None:
    with engine.begin() as connection:
        add_motion(connection, make_motion(), earthquake=QUAKE, is_vertical=False)
        other = replace(QUAKE, event_id="darfield-2010")
        with pytest.raises(InputError, match=r"0\.txt.*christchurch-2011.*darfield-2010"):
            add_motion(connection, make_motion(), earthquake=other, is_vertical=False)
        with pytest.raises(InputError, match="a horizontal component"):
            add_motion(connection, make_motion(), earthquake=QUAKE, is_vertical=True)


def test_magnitude_is_filled_in_and_the_first_one_stays(
    engine: Engine, make_motion: MakeMotion
) -> None:
    with engine.begin() as connection:
        for seed, magnitude in ((1, None), (2, 6.69), (3, 6.7)):
            quake = EarthquakeInfo("northridge-1994", magnitude=magnitude, guessed=False)
            add_motion(connection, make_motion(seed), earthquake=quake, is_vertical=False)
        assert {row.magnitude for row in motion_rows(connection)} == {6.69}


def test_suites(engine: Engine, make_motion: MakeMotion) -> None:
    with engine.begin() as connection:
        for seed, suite in ((1, "b"), (2, "a"), (2, "b"), (2, "b"), (3, None)):
            add_motion(
                connection, make_motion(seed), earthquake=GUESS, is_vertical=False, suite=suite
            )
        assert suite_names(connection) == ["a", "b"]
        assert len(motion_rows(connection)) == 3
        assert [row.source_file for row in motion_rows(connection, suite="a")] == ["2.txt"]
        assert len(motion_rows(connection, suite="b")) == 2
        with pytest.raises(InputError, match="unknown suite 'c'; the suites are a, b"):
            motion_rows(connection, suite="c")
        with pytest.raises(InputError, match="suite must not be empty"):
            add_motion(connection, make_motion(1), earthquake=GUESS, is_vertical=False, suite=" ")


@pytest.mark.parametrize("motion_id", [7, 0, -1, 2**31, 10**30])
def test_an_unknown_id_is_rejected(engine: Engine, motion_id: int) -> None:
    with engine.connect() as connection:
        with pytest.raises(InputError, match=f"unknown motion {motion_id}:"):
            load_motion(connection, motion_id)
        with pytest.raises(InputError, match=f"unknown motion {motion_id}:"):
            motion_row(connection, motion_id)


def test_names_that_are_no_text_are_stored_visibly(engine: Engine, make_motion: MakeMotion) -> None:
    motion = make_motion(source_file="rec\udcff.txt", station="A\x00B", component="ü")
    with engine.begin() as connection:
        motion_id, _ = add_motion(
            connection, motion, earthquake=EarthquakeInfo("E\x00"), is_vertical=False, suite="s\x00"
        )
        row = motion_row(connection, motion_id)
        assert [m.id for m in motion_rows(connection, suite="s\x00")] == [motion_id]
    assert (row.source_file, row.station, row.component) == ("rec\\udcff.txt", "A\\x00B", "ü")


@pytest.mark.parametrize("magnitude", [62.0, float("nan"), float("inf")])
def test_impossible_magnitudes_are_rejected(
    engine: Engine, make_motion: MakeMotion, magnitude: float
) -> None:
    quake = replace(QUAKE, magnitude=magnitude)
    with (
        engine.begin() as connection,
        pytest.raises(InputError, match=r"christchurch-2011.*not a valid magnitude"),
    ):
        add_motion(connection, make_motion(), earthquake=quake, is_vertical=False)


def test_samples_beyond_all_accelerations_are_rejected(engine: Engine) -> None:
    motion = GroundMotion(np.array([0.0, 1e308, 1e308, 0.0]), 10.0)
    with (
        engine.begin() as connection,
        np.errstate(all="ignore"),
        pytest.raises(InputError, match="units"),
    ):
        add_motion(connection, motion, earthquake=GUESS, is_vertical=False)


def test_nodes_are_rejected(engine: Engine) -> None:
    motion = GroundMotion.from_nodes([0.0, 0.0, 1.0], [0.0, 1.0, 1.0])
    with engine.begin() as connection, pytest.raises(InputError, match="equally spaced"):
        add_motion(connection, motion, earthquake=GUESS, is_vertical=False)


@pytest.mark.parametrize("samples", [b"", b"\x00" * 512])
def test_tampered_samples_are_rejected(
    engine: Engine, make_motion: MakeMotion, samples: bytes
) -> None:
    with engine.begin() as connection:
        motion_id, _ = add_motion(connection, make_motion(), earthquake=GUESS, is_vertical=False)
        connection.execute(update(schema.motion).values(samples=samples))
        with pytest.raises(DatabaseError, match=f"motion {motion_id}.*sha256"):
            load_motion(connection, motion_id)


def test_a_motion_without_samples_says_so(engine: Engine, make_motion: MakeMotion) -> None:
    with engine.begin() as connection:
        motion_id, _ = add_motion(connection, make_motion(), earthquake=GUESS, is_vertical=False)
        connection.execute(update(schema.motion).values(samples=None))
        with pytest.raises(InputError, match="the database has no samples"):
            load_motion(connection, motion_id)


def test_a_failed_transaction_leaves_nothing(sqlite_file: Path, make_motion: MakeMotion) -> None:
    def fail(engine: Engine) -> None:
        with engine.begin() as connection:
            add_motion(connection, make_motion(), earthquake=GUESS, is_vertical=False, suite="gone")
            raise RuntimeError

    with opened_database(sqlite_file) as engine:
        with pytest.raises(RuntimeError):
            fail(engine)
        for table in ("motion", "earthquake", "recording", "suite"):
            assert _rows(engine, table) == 0
