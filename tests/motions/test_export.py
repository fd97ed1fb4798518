"""Exported motions read back bit for bit, with every label; later changes are noticed."""

from __future__ import annotations

from dataclasses import replace
from datetime import datetime
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from rbfrag.errors import InputError, MotionFileError
from rbfrag.motions.direction import upward
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.processing import processed
from rbfrag.motions.readers import export_motions, read_motion, read_motions
from tests.synthetic import shaking

LABELS = (
    "dt_s", "station", "event", "component", "orientation_deg", "is_vertical", "recording",
    "is_corrected", "is_partial", "start_time", "processing_applied", "source_sha256", "remarks",
)  # fmt: skip

samples_g = hnp.arrays(
    np.float64, st.integers(1, 40), elements=st.floats(-50.0, 50.0, allow_subnormal=True)
)
text = st.text(max_size=30)


def labels(motion: GroundMotion) -> dict[str, object]:
    return {name: getattr(motion, name) for name in LABELS}


@given(
    samples=samples_g, dt_s=st.floats(1e-4, 1.0), station=text, event=text, component=text,
    recording=text, vertical=st.none() | st.booleans(), azimuth=st.none() | st.floats(0.0, 360.0),
    start=st.none() | st.datetimes(min_value=datetime(1900, 1, 1)), remarks=st.lists(text),
)  # fmt: skip
@settings(max_examples=100, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_csv_keeps_every_bit_and_label(
    tmp_path: Path,
    samples: np.ndarray,
    dt_s: float,
    station: str,
    event: str,
    component: str,
    recording: str,
    vertical: bool | None,
    azimuth: float | None,
    start: datetime | None,
    remarks: list[str],
) -> None:
    motion = GroundMotion(
        samples,
        dt_s,
        station=station,
        event=event,
        component=component,
        recording=recording,
        is_vertical=vertical,
        orientation_deg=azimuth,
        start_time=start,
        remarks=tuple(remarks),
    )
    assert export_motions([motion, motion], tmp_path / "m.csv") == "csv"
    first, second = read_motions(tmp_path / "m.csv")
    for back, index in ((first, 0), (second, 1)):
        assert back.acceleration_g.tobytes() == samples.tobytes()
        assert labels(back) == labels(motion)
        assert (back.trace_index, back.source_file) == (index, "m.csv")


@given(samples=samples_g, dt_s=st.floats(1e-4, 1.0), station=text, event=text)
@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_at2_keeps_every_bit(
    tmp_path: Path, samples: np.ndarray, dt_s: float, station: str, event: str
) -> None:
    motion = GroundMotion(samples, dt_s, station=station, event=event, component="090")
    assert export_motions([motion], tmp_path / "m.AT2") == "at2"
    back = read_motion(tmp_path / "m.AT2")
    assert back.acceleration_g.tobytes() == samples.tobytes()
    assert back.dt_s == dt_s
    assert back.component == "090"


def test_processing_and_origin_are_kept(tmp_path: Path) -> None:
    raw = GroundMotion(shaking(1), 0.02, component="DOWN", is_corrected=False)
    motion = upward(processed(raw))
    export_motions([motion], tmp_path / "m.csv")
    back = read_motion(tmp_path / "m.csv")
    assert labels(back) == labels(motion)
    assert back.source_sha256 == raw.sha256
    assert back.processing_applied is not None
    assert back.processing_applied["turned_upward"] is True


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("0.25", "0.26", "not those that were written"),
        ("# npts: 3", "# npts: 4", "4 samples, but 3 follow"),
        ("# npts: 3", "# npts: true", "npts 'true' cannot be used"),
        ("# npts: 3", "# points: 3", "no 'npts'"),
        ("# dt_s: 0.01", "# dt_s: 0.02", "time 0.01 s instead of 0.02 s"),
        ("# dt_s: 0.01", "# dt_s: NaN", "dt_s 'NaN' cannot be used"),
        ("# dt_s: 0.01", f"# dt_s: 1{'0' * 400}", "cannot be used"),
        ("# dt_s: 0.01", "# dt_s: -0.01", "positive"),
        ("# is_vertical: false", "# is_vertical: 0", "is_vertical '0' cannot be used"),
        ("# station: ", "# station: [", "station"),
        ("# start_time: ", "# start_time: 7 ", "start_time"),
        ("time_s,acceleration_g", "t,a", "no line 'time_s,acceleration_g'"),
        ("0.25", "nan", "'nan'"),
        ("0.25", "0.25 1", "3 values"),
    ],
)  # fmt: skip
def test_changed(tmp_path: Path, old: str, new: str, words: str) -> None:
    motion = GroundMotion(
        np.array([0.0, 0.25, 0.0]), 0.01, station="S", is_vertical=False,
        start_time=datetime(2020, 1, 1),
    )  # fmt: skip
    path = tmp_path / "m.csv"
    export_motions([motion], path)
    content = path.read_text()
    assert old in content
    path.write_text(content.replace(old, new, 1))
    with pytest.raises(MotionFileError) as caught:
        read_motions(path)
    assert words in caught.value.reason
    assert caught.value.line


def test_without_its_hash_a_changed_file_is_read(tmp_path: Path) -> None:
    path = tmp_path / "m.csv"
    export_motions([GroundMotion(np.array([0.0, 0.25, 0.0]), 0.01)], path)
    lines = [line for line in path.read_text().splitlines() if "sha256" not in line]
    path.write_text("\n".join(lines).replace("0.25", "0.5") + "\n")
    assert read_motion(path).pga_g == 0.5


def test_cut_file_is_read_on_request(tmp_path: Path) -> None:
    path = tmp_path / "m.csv"
    motion = GroundMotion(shaking(1), 0.02)
    export_motions([motion], path)
    path.write_text(path.read_text()[:-400])
    with pytest.raises(MotionFileError, match="allow_partial"):
        read_motion(path)
    back = read_motion(path, allow_partial=True)
    assert back.is_partial
    assert np.array_equal(back.acceleration_g, motion.acceleration_g[: back.npts])


def test_rejected(tmp_path: Path) -> None:
    motion = GroundMotion(shaking(1), 0.02)
    for motions, name, words in (
        ([motion], "m.txt", "unsupported format 'txt'"),
        ([motion, motion], "m.AT2", "one motion, not 2"),
        ([], "m.csv", "no motion"),
        ([GroundMotion.from_nodes([0.0, 1.0], [0.0, 1.0])], "m.csv", "equally spaced"),
        ([motion, GroundMotion.from_nodes([0.0, 1.0], [0.0, 1.0])], "m.csv", "equally spaced"),
        ([motion], "nowhere/m.csv", "cannot be written"),
    ):
        with pytest.raises(InputError, match=words):
            export_motions(motions, tmp_path / name)
    assert list(tmp_path.iterdir()) == []


def test_exported_twice_is_the_same_file(tmp_path: Path) -> None:
    motion = replace(GroundMotion(shaking(1), 0.02), remarks=("a",))
    for name in ("a.csv", "b.csv"):
        export_motions([motion], tmp_path / name)
    assert (tmp_path / "a.csv").read_bytes() == (tmp_path / "b.csv").read_bytes()
