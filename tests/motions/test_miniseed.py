"""miniSEED: the counts of each channel, with the gain that is stated for them, or a rejection."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from rbfrag.campaign.add_motions import add_motions
from rbfrag.errors import InputError, MissingExtraError, MotionFileError, UnitNotStatedError
from rbfrag.motions.readers import motions_in, read_motion, read_motions
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from tests.motions.written_miniseed import COUNTS, miniseed

GAIN = 214580.746


def written(folder: Path, *pieces: bytes, name: str = "record.mseed") -> Path:
    path = folder / name
    path.write_bytes(b"".join(pieces))
    return path


def in_g(counts: NDArray[np.int32], gain: float) -> NDArray[np.float64]:
    return (counts - counts.mean()) / (gain * STANDARD_GRAVITY_M_S2)


def test_a_real_file(formats_dir: Path) -> None:
    path = formats_dir / "records" / "CE.79435.mseed"
    motion = read_motion(path, gain=GAIN)
    assert (motion.npts, motion.dt_s, motion.component) == (45000, 0.01, "HNE")
    assert motion.pga_g == pytest.approx(0.00058641, rel=1e-5)
    assert abs(motion.acceleration_g.mean()) < 1e-12
    assert (motion.station, motion.orientation_deg, motion.is_corrected) == (
        "CE.79435",
        90.0,
        False,
    )
    assert motion.start_time is not None
    assert motion.start_time.isoformat() == "2021-12-20T20:13:10.750000"
    with pytest.raises(UnitNotStatedError, match=r"HNE is in counts.*StationXML"):
        read_motions(path)


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("encoding", ["STEIM1", "STEIM2", "INT32", "FLOAT32", "FLOAT64"])
def test_counts_come_back(tmp_path: Path, version: int, encoding: str) -> None:
    path = written(tmp_path, miniseed(COUNTS, version=version, encoding=encoding))
    motion = read_motion(path, gain=GAIN)
    assert motion.acceleration_g == pytest.approx(in_g(COUNTS, GAIN), rel=1e-12, abs=1e-15)
    assert (motion.dt_s, motion.file_format) == (0.01, "miniSEED")
    assert "the mean of" in motion.remarks[0]
    sent = motions_in(path.read_bytes(), "upload", gain=GAIN)
    assert sent[0].sha256 == motion.sha256


def test_channels_go_together_and_have_gains_of_their_own(tmp_path: Path) -> None:
    channels = [miniseed(COUNTS * (i + 1), channel=f"HN{code}") for i, code in enumerate("ENZ")]
    path = written(tmp_path, *channels)
    motions = read_motions(path, gain={0: 1000.0, 1: 2000.0, 2: 3000.0})
    assert [motion.component for motion in motions] == ["HNE", "HNN", "HNZ"]
    assert [motion.is_vertical for motion in motions] == [False, False, True]
    assert len({motion.recording for motion in motions}) == 1
    for motion in motions:
        assert motion.acceleration_g == pytest.approx(in_g(COUNTS, 1000.0), rel=1e-12, abs=1e-15)
    with pytest.raises(UnitNotStatedError, match="HNZ is in counts"):
        read_motions(path, gain={0: 1000.0, 1: 2000.0})


def test_several_stations_are_remarked_upon(tmp_path: Path) -> None:
    path = written(tmp_path, miniseed(COUNTS), miniseed(COUNTS[::2], station="OTHER"))
    motions = read_motions(path, gain=GAIN)
    assert {motion.station for motion in motions} == {"CE.79435", "CE.OTHER"}
    assert all("several stations" in motion.remarks[-1] for motion in motions)


@pytest.mark.parametrize("channel", ["BHZ", "HHE", "EHZ", "LDO"])
def test_channels_of_other_quantities(tmp_path: Path, channel: str) -> None:
    path = written(tmp_path, miniseed(COUNTS, channel=channel))
    with pytest.raises(MotionFileError, match=f"{channel}: not an accelerometer"):
        read_motions(path, gain=GAIN)


def test_a_gap(tmp_path: Path) -> None:
    later = miniseed(COUNTS, start="2021-12-20T20:30:00Z")
    path = written(tmp_path, miniseed(COUNTS), later)
    with pytest.raises(MotionFileError, match=r"HNE has 2 segments: it ends at .* without gaps"):
        read_motions(path, gain=GAIN)
    other_rate = miniseed(COUNTS, start="2021-12-20T20:13:40Z", rate_hz=50.0)
    with pytest.raises(MotionFileError, match="2 segments"):
        read_motions(written(tmp_path, miniseed(COUNTS), other_rate), gain=GAIN)


def test_a_file_that_was_cut(tmp_path: Path) -> None:
    complete = miniseed(COUNTS, record_bytes=512)
    path = written(tmp_path, complete[:-200])
    with pytest.raises(MotionFileError, match="truncated or damaged") as rejected:
        read_motions(path, gain=GAIN)
    assert rejected.value.fields == ("allow_partial",)
    motion = read_motion(path, gain=GAIN, allow_partial=True)
    assert motion.is_partial
    assert "left out" in motion.remarks[-1]
    assert 0 < motion.npts < COUNTS.size
    expected = COUNTS[: motion.npts]
    assert motion.acceleration_g == pytest.approx(in_g(expected, GAIN), rel=1e-12, abs=1e-15)


def test_a_damaged_record(tmp_path: Path) -> None:
    # version 3 has a checksum; in version 2 the differences must lead to the last sample
    for version, encoding in ((3, "INT32"), (2, "STEIM1"), (2, "STEIM2")):
        content = bytearray(miniseed(COUNTS, record_bytes=512, version=version, encoding=encoding))
        content[700] ^= 0x01
        with pytest.raises(MotionFileError, match="truncated or damaged"):
            read_motions(written(tmp_path, bytes(content)), gain=GAIN)


def test_what_is_stated_must_fit(tmp_path: Path) -> None:
    path = written(tmp_path, miniseed(COUNTS))
    with pytest.raises(InputError, match="gain must be a positive number"):
        read_motions(path, gain=0.0)
    with pytest.raises(MotionFileError, match="not g: omit units"):
        read_motions(path, gain=GAIN, units="g")
    with pytest.raises(MotionFileError, match=r"dt = 0\.01 s, not 0.02"):
        read_motions(path, gain=GAIN, dt_s=0.02)
    text = tmp_path / "record.csv"
    text.write_text("# Time (s),Acceleration (g)\n0,0\n0.01,1\n0.02,0\n")
    with pytest.raises(MotionFileError, match="not in counts: omit gain"):
        read_motions(text, gain=GAIN)


def test_without_the_extra(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = written(tmp_path, miniseed(COUNTS))
    monkeypatch.setitem(sys.modules, "pymseed", None)
    with pytest.raises(MissingExtraError, match=r"rbfrag\[mseed\]"):
        read_motions(path, gain=GAIN)


def test_gains_of_a_table(tmp_path: Path) -> None:
    records = tmp_path / "records"
    records.mkdir()
    written(records, miniseed(COUNTS), miniseed(COUNTS, channel="HNZ"), name="a.mseed")
    written(records, miniseed(COUNTS, station="OTHER"), name="b.mseed")
    table = records / "META.csv"
    table.write_text(
        "file,trace_index,event_id,gain\na.mseed,0,e,1000\na.mseed,1,e,2000\nb.mseed,,e,\n"
    )
    report = add_motions(records, db=tmp_path / "one.db", metadata=table, gain=4000.0)
    assert (len(report.added), report.failed, len(report.processed)) == (3, (), 3)
    report = add_motions(records, db=tmp_path / "two.db", metadata=table)
    assert [Path(bad.path).name for bad in report.failed] == ["b.mseed"]
    assert "gain" in report.failed[0].reason
    table.write_text("file,gain\na.mseed,-1\n")
    with pytest.raises(MotionFileError, match="gain '-1' must be a positive number"):
        add_motions(records, db=tmp_path / "one.db", metadata=table)


def test_a_gain_that_nobody_needs(tmp_path: Path) -> None:
    path = tmp_path / "record.csv"
    path.write_text("# Time (s),Acceleration (g)\n0,0\n0.01,1\n0.02,0\n")
    report = add_motions(path, db=tmp_path / "one.db", gain=GAIN)
    assert "omit gain" in report.failed[0].reason


def test_channels_are_chosen(tmp_path: Path) -> None:
    codes = ("HNE", "HNZ", "ENE", "BHZ")
    pieces = [miniseed(COUNTS * (i + 1), channel=code) for i, code in enumerate(codes)]
    path = written(tmp_path, *pieces)
    for channel, read in (
        (None, ["ENE", "HNE", "HNZ"]),
        ("HN?", ["HNE", "HNZ"]),
        ("ene, hnz", ["ENE", "HNZ"]),
        ("*Z,ENE", ["ENE", "HNZ"]),
    ):
        motions = read_motions(path, gain=GAIN, channel=channel)
        assert sorted(motion.component for motion in motions) == read
    assert read_motion(path, gain=GAIN, channel="HNZ").component == "HNZ"
    report = add_motions(path, db=tmp_path / "a.db", gain=GAIN, channel="HN?")
    assert len(report.added) == 2
    with pytest.raises(MotionFileError, match=r"no channel HX\?: the file has .*HNE"):
        read_motions(path, gain=GAIN, channel="HX?")
    with pytest.raises(MotionFileError, match="BHZ: not an accelerometer"):
        read_motions(path, gain=GAIN, channel="BHZ")
    text = tmp_path / "a.txt"
    text.write_text("0.1\n0.2\n0.1\n0\n0.1\n0.2\n")
    with pytest.raises(MotionFileError, match="has no channel codes: omit channel"):
        read_motions(text, units="g", dt_s=0.01, channel="HNE")
