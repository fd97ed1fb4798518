"""Stored response spectra, RotD50 and RotD100, and rotated components."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from sqlalchemy import Connection, Engine, select, update

from rbfrag.campaign.rotate_motions import rotate_motions
from rbfrag.db import schema
from rbfrag.db.check import check_database
from rbfrag.db.engine import opened_database
from rbfrag.db.merge import merge_databases
from rbfrag.db.motion_spectra import other_horizontal, recording_peaks
from rbfrag.db.motions import add_motion, load_motion, motion_row, motion_rows
from rbfrag.db.rows import EarthquakeInfo
from rbfrag.errors import InputError
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.response_spectrum import DirectionalPeaks
from rbfrag.motions.rotation import rotate, rotd

Make = Callable[..., GroundMotion]
AZIMUTHS = {"N": 0.0, "E": 90.0, "UP": None}


def components(make_motion: Make, first_seed: int = 0, **labels: Any) -> dict[str, GroundMotion]:
    """North, east and up of one recording."""
    return {
        name: make_motion(first_seed + i, component=name, orientation_deg=azimuth, **labels)
        for i, (name, azimuth) in enumerate(AZIMUTHS.items())
    }


def store(connection: Connection, motions: dict[str, GroundMotion], **labels: Any) -> list[int]:
    chosen = {"earthquake": EarthquakeInfo("E"), "recording": "R", **labels}
    return [
        add_motion(connection, motion, is_vertical=name == "UP", **chosen)[0]
        for name, motion in motions.items()
    ]


def peaks_of(connection: Connection) -> list[DirectionalPeaks]:
    rows = connection.execute(select(schema.recording_spectrum)).mappings()
    return [
        DirectionalPeaks(
            row["percentile"], row["pga_g"], row["pgv_m_s"],
            tuple(row[name] for name in schema.ORDINATES),
        )
        for row in rows
    ]  # fmt: skip


def test_spectra_are_stored_with_the_motions(engine: Engine, make_motion: Make) -> None:
    motions = components(make_motion)
    with engine.begin() as connection:
        ids = store(connection, motions)
        for number, motion in zip(ids, motions.values(), strict=True):
            row = connection.execute(
                select(schema.motion_spectrum).filter_by(motion_id=number)
            ).one()
            assert row[1:22] == motion.spectrum_g
            stored = motion_row(connection, number)
            assert stored.housner_m == motion.housner_m
            assert stored.d5_75_s == motion.measures.d5_75_s
            assert (stored.sa10_g, stored.sa30_g) == (row.sa_009, row.sa_015)
        expected = rotd(motions["N"], motions["E"])
        assert expected is not None
        for peaks, other in zip(recording_peaks(connection, ids[0]), expected, strict=True):
            np.testing.assert_allclose(peaks.sa_g, other.sa_g, rtol=1e-3)
            assert peaks.pga_g == pytest.approx(other.pga_g, rel=1e-3)
        assert recording_peaks(connection, ids[2]) == []
        assert check_database(connection) == []


def test_a_third_horizontal_leaves_no_pair(engine: Engine, make_motion: Make) -> None:
    motions = components(make_motion)
    third = {"X": make_motion(9, component="X", orientation_deg=45.0)}
    with engine.begin() as connection:
        ids = store(connection, motions)
        assert len(peaks_of(connection)) == 2
        assert other_horizontal(connection, ids[0]) == ids[1]
        (number,) = store(connection, third)
        assert peaks_of(connection) == []
        with pytest.raises(InputError, match=f"there are several: .*{number}"):
            other_horizontal(connection, ids[0])
        with pytest.raises(InputError, match="is not a recorded horizontal motion"):
            other_horizontal(connection, ids[2])
        with pytest.raises(InputError, match="is not a recorded horizontal motion"):
            other_horizontal(connection, 999)
        assert check_database(connection) == []


def test_a_stated_recording_renews_the_pairs(engine: Engine, make_motion: Make) -> None:
    motions = components(make_motion)
    value = {"earthquake": EarthquakeInfo("Q", guessed=False)}
    with engine.begin() as connection:
        ids = store(connection, motions)
        store(connection, {"N": motions["N"]}, **value)
        assert peaks_of(connection) == []
        with pytest.raises(InputError, match="there are none"):
            other_horizontal(connection, ids[0])
        store(connection, {"E": motions["E"]}, **value)
        assert len(peaks_of(connection)) == 2
        assert check_database(connection) == []


def test_raw_and_processed_pairs_stand_side_by_side(engine: Engine, make_motion: Make) -> None:
    raw = components(make_motion)
    filtered = {
        name: replace(
            motion.scaled(0.9), processing_applied={"filter": "x"}, source_sha256=motion.sha256
        )
        for name, motion in raw.items()
    }
    with engine.begin() as connection:
        first, second = store(connection, raw), store(connection, filtered)
        assert len(peaks_of(connection)) == 4
        assert other_horizontal(connection, second[0]) == second[1]
        assert other_horizontal(connection, first[1]) == first[0]
        assert check_database(connection) == []


def test_altered_spectra_are_found(engine: Engine, make_motion: Make) -> None:
    with engine.begin() as connection:
        ids = store(connection, components(make_motion))
        spectrum, peaks = schema.motion_spectrum, schema.recording_spectrum
        where = spectrum.c.motion_id == ids[0]
        row = connection.execute(select(spectrum).where(where)).mappings().one()
        connection.execute(update(spectrum).where(where).values(sa_005=2.0 * row["sa_005"]))
        connection.execute(update(peaks).where(peaks.c.percentile == 50).values(pga_g=9.0))
        result = check_database(connection)
    tables = sorted({finding.table for finding in result})
    assert tables == ["motion", "motion_spectrum", "recording_spectrum"]
    text = " ".join(finding.problem for finding in result)
    assert "sa_005 of motion_spectrum is" in text
    assert "pga_g is 9.0, the motions give" in text


def test_rotated_motions_are_stored(engine: Engine, place: str, make_motion: Make) -> None:
    motions = components(make_motion)
    with engine.begin() as connection:
        ids = store(connection, motions)
    report = rotate_motions([ids[0]], 120.0, db=place, suite="slope")
    assert report.pairs == [(ids[0], ids[1])]
    assert "campaign" in report.warnings[0]
    assert rotate_motions([str(ids[0])], 480.0, db=place).motion_ids == report.motion_ids
    with opened_database(place) as again, again.connect() as connection:
        (number,) = report.motion_ids
        loaded = load_motion(connection, number)
        expected = rotate(motions["N"], motions["E"], 120.0)
        assert loaded.acceleration_g.tobytes() == expected.acceleration_g.tobytes()
        row, first = motion_row(connection, number), motion_row(connection, ids[0])
        assert (row.component, row.orientation_deg) == ("az120", 120.0)
        assert (row.recording, row.event_id) == (first.recording, first.event_id)
        assert row.processing_applied is not None
        assert row.processing_applied["rotated"]["components"] == ["N", "E"]  # type: ignore[index]
        assert [r.id for r in motion_rows(connection, suite="slope")] == [number]
        assert other_horizontal(connection, ids[0]) == ids[1]
        assert len(peaks_of(connection)) == 2
        assert check_database(connection) == []
    with pytest.raises(InputError, match="is not a database id"):
        rotate_motions(["a.AT2"], 1.0, db=place)


def test_spectra_are_merged(engine: Engine, place: str, tmp_path: Path, make_motion: Make) -> None:
    motions = components(make_motion)
    with engine.begin() as connection:
        store(connection, {"E": motions["E"]})
    with opened_database(tmp_path / "other.db", create=True) as other, other.begin() as connection:
        store(connection, {name: motions[name] for name in ("N", "UP")})
    merge_databases(tmp_path / "other.db", db=place)
    with opened_database(place) as again, again.connect() as connection:
        assert len(peaks_of(connection)) == 2
        assert connection.execute(select(schema.motion_spectrum)).all()[2:]
        assert check_database(connection) == []
    with opened_database(tmp_path / "other.db", create=True) as other, other.begin() as connection:
        store(connection, {"E": motions["E"]})
    report = merge_databases(tmp_path / "other.db", db=place)
    assert report.added == {}
    assert report.same["recording_spectrum"] == 2
