"""Every real record in a supported format reads as its manifest says."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest

from rbfrag.errors import MotionFileError, UnknownFormatError
from rbfrag.motions.metadata import read_metadata
from rbfrag.motions.recognise import read_motion, read_motions

COUNTS = {
    "peer_at2_opensees": 52,
    "nga_at2_misc": 22,
    "slammer_csv": 13,
    "geonet_v2a": 9,
    "geer_chihshang_2022_acc": 57,
    "fema_p695_far_field": 32,
}
"""Traces by set."""

STATES_NO_UNIT = {"geer_chihshang_2022_acc", "fema_p695_far_field"}
STATES_NO_DT = {"fema_p695_far_field"}


def manifest(records_dir: Path) -> list[dict[str, str]]:
    with (records_dir / "MANIFEST.csv").open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


@pytest.mark.parametrize("name", COUNTS)
def test_npts_dt_and_pga(records_dir: Path, name: str) -> None:
    rows = [row for row in manifest(records_dir) if row["set"] == name]
    assert len(rows) == COUNTS[name]
    for row in rows:
        units = row["file_units"] if name in STATES_NO_UNIT else None
        path = records_dir / row["file"]
        dt_s = float(row["dt_s"]) if name in STATES_NO_DT else None
        motions = read_motions(path, units=units, dt_s=dt_s)
        assert len(motions) == sum(other["file"] == row["file"] for other in rows)
        motion = motions[int(row["trace_index"])]
        assert motion.trace_index == int(row["trace_index"])
        assert motion.source_file == path.name
        assert motion.npts == int(row["npts"]), path
        assert motion.dt_s == float(row["dt_s"]), path
        assert f"{motion.pga_g:.5f}" == f"{float(row['pga_g']):.5f}", path
        if motion.is_vertical is not None:
            assert motion.is_vertical == (row["is_vertical"] == "1"), path


@pytest.mark.parametrize(
    ("name", "event", "station", "component", "orientation_deg"),
    [
        ("Chi-Chi_1999_TCU068-090", "Chi-Chi, Taiwan 1999", "TCU068", "090", 90.0),
        ("Coyote_Lake_1979_G02-050", "Coyote Lake 1979", "G02", "050", 50.0),
        ("Northridge_1994_VSP-360", "Northridge 1994", "VSP", "360", 0.0),
    ],
)
def test_title_of_sample_files(
    records_dir: Path,
    name: str,
    event: str,
    station: str,
    component: str,
    orientation_deg: float,
) -> None:
    (motion,) = read_motions(records_dir / "slammer_csv" / f"{name}.csv")
    assert (motion.event, motion.station, motion.component) == (event, station, component)
    assert motion.orientation_deg == orientation_deg


def test_unit_is_not_guessed(records_dir: Path) -> None:
    for row in manifest(records_dir):
        if row["set"] in STATES_NO_UNIT:
            with pytest.raises(MotionFileError, match="--units"):
                read_motions(records_dir / row["file"])


def test_three_components_of_one_recording(records_dir: Path) -> None:
    path = records_dir / "geonet_v2a" / "20161113_110259_WTMC_20.V2A"
    motions = read_motions(path)
    assert [motion.is_vertical for motion in motions] == [False, False, True]
    assert len({motion.recording for motion in motions}) == 1
    assert motions[0].orientation_deg == 332.0
    assert read_motion(f"{path}#2").sha256 == motions[2].sha256
    with pytest.raises(MotionFileError, match=r"holds 3 traces.*#2"):
        read_motion(path)
    with pytest.raises(MotionFileError, match="no trace #3"):
        read_motion(f"{path}#3")


def test_other_formats_are_refused_and_never_misread(records_dir: Path) -> None:
    rows = [row for row in manifest(records_dir) if row["set"] not in COUNTS]
    others = {row["set"]: row["file"] for row in rows}
    assert others
    for file in others.values():
        with pytest.raises(MotionFileError):
            read_motions(records_dir / file)


def test_tables_are_no_accelerograms(records_dir: Path) -> None:
    tables = [records_dir / "MANIFEST.csv"]
    tables += (records_dir / "geer_chihshang_2022_acc").glob("*.csv")
    assert len(tables) == 2
    for table in tables:
        with pytest.raises(UnknownFormatError, match=table.name):
            read_motions(table, units="g")


def test_manifest_is_metadata(records_dir: Path) -> None:
    metadata = read_metadata(records_dir / "MANIFEST.csv")
    for row in manifest(records_dir):
        traced = metadata.trace(records_dir / row["file"], int(row["trace_index"]))
        assert traced is not None
        assert traced.event_id == row["event_id"]
        assert traced.is_vertical == (row["is_vertical"] == "1")
        assert traced.units == row["file_units"]
        assert traced.companion_group == row["companion_group"]
