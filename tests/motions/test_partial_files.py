"""Files whose header states another number of samples: rejected, or read and marked."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from rbfrag.errors import MotionFileError
from rbfrag.motions.quality import quality_flags
from rbfrag.motions.readers import read_motion, read_motions
from tests.motions import written_by_networks as written
from tests.motions.test_network_round_trips import STATE_NO_UNIT, WRITTEN
from tests.motions.written import at2, v2a

SAMPLES = [f"{0.001 * i:.5E}" for i in range(1, 41)]

COUNTS: dict[str, Sequence[tuple[str, str]]] = {
    "CSMIP/CDMG V2": [("     12 points of accel", "     14 points of accel")],
    "COSMOS V1c/V2c": [("      12 accel", "      14 accel")],
    "CDMG V1": [("POINTS =     12", "POINTS =     24"), ("LENGTH =  0.120", "LENGTH =  0.240")],
    "BHRC V1": [("POINTS =     12", "POINTS =     24"), ("=   0.120", "=   0.240")],
    "K-NET/KiK-net ASCII": [("0.12\n", "0.14\n")],
    "CSMNC text": [("POINTS:  12", "POINTS:  14")],
    "ESM ASC": [("NDATA: 12", "NDATA: 14")],
    "CWB dat": [("(sec): 0.12", "(sec): 0.15")],
    "UNAM standard file": [("/12/12/12", "/13/13/13")],
    "AFAD NSMN text": [("DATA          : 12", "DATA          : 11")],
    "USGS SMC": [("        12    -32768", "        14    -32768")],
    "SimCenter event JSON": [('"numSteps": 12', '"numSteps": 13')],
    "GeoNet text (.000/.090/.ver)": [("12  1.0", "13  1.0")],
    "K-NET CSV": [("#0.12", "#0.14")],
}  # fmt: skip
"""What to change in each format so that its header states another number."""


@pytest.mark.parametrize("name", WRITTEN)
def test_another_number(tmp_path: Path, name: str) -> None:
    path = tmp_path / "record"
    text = WRITTEN[name]()
    units = "g" if name in STATE_NO_UNIT else None
    path.write_text(text)
    complete = read_motions(path, units=units, allow_partial=True)
    assert not any(motion.is_partial for motion in complete)
    for old, new in COUNTS[name]:
        assert old in text
        text = text.replace(old, new, 1)
    path.write_text(text)
    with pytest.raises(MotionFileError, match="allow_partial"):
        read_motions(path, units=units)
    motions = read_motions(path, units=units, allow_partial=True)
    # a count may be one channel's, or that of them all
    assert motions[0].is_partial
    for motion, expected in zip(motions, complete, strict=True):
        assert motion.sha256 == expected.sha256
        assert motion.dt_s == pytest.approx(0.01)
        assert ("partial" in {flag.code for flag in quality_flags(motion)}) is motion.is_partial
        assert any("partial" in remark for remark in motion.remarks) is motion.is_partial


def test_at2(tmp_path: Path) -> None:
    path = tmp_path / "record"
    path.write_text(at2(SAMPLES, 0.01, npts=41))
    motion = read_motion(path, allow_partial=True)
    assert (motion.npts, motion.is_partial) == (40, True)
    assert "41 samples, but 40 follow" in motion.remarks[0]


def test_cut_within_a_number(tmp_path: Path) -> None:
    path = tmp_path / "record"
    text = at2(SAMPLES, 0.01)
    # of the last number, 4.00000E-02, is left what is still a number
    path.write_text(text[:-5])
    with pytest.raises(MotionFileError, match=r"truncated within the number '4.00000'"):
        read_motion(path)
    motion = read_motion(path, allow_partial=True)
    path.write_text(text)
    complete = read_motion(path)
    assert motion.is_partial
    assert np.array_equal(motion.acceleration_g, complete.acceleration_g[: motion.npts])
    assert "ends within a line" in motion.remarks[-1]


@pytest.mark.parametrize("name", [*WRITTEN, "PEER AT2", "GeoNet V2A"])
def test_cut_anywhere_gives_a_beginning_or_a_rejection(tmp_path: Path, name: str) -> None:
    cut = {
        "PEER AT2": lambda: at2(SAMPLES, 0.01),
        "AFAD NSMN text": lambda: written.nsmn(
            [[f"{i + j / 7:.6f}" for j in range(3)] for i in range(20)], 0.01
        ),
        "GeoNet V2A": lambda: v2a([("N28W", ["1.5"] * 24), ("UP", ["-2.5"] * 24)], 0.02),
    }
    content = {**WRITTEN, **cut}[name]().encode()
    units = "g" if name in STATE_NO_UNIT else None
    path = tmp_path / "record"
    path.write_bytes(content)
    complete = {motion.component: motion for motion in read_motions(path, units=units)}
    read = 0
    for size in range(1, len(content), 7):
        path.write_bytes(content[:size])
        try:
            motions = read_motions(path, units=units, allow_partial=True)
        except MotionFileError:
            continue
        for motion in motions:
            read += 1
            expected = complete[motion.component]
            if name not in {"K-NET/KiK-net ASCII", "K-NET CSV"}:  # less the mean of what there is
                begins = expected.acceleration_g[: motion.npts]
                assert np.array_equal(motion.acceleration_g, begins)
            assert motion.dt_s == expected.dt_s
            assert motion.is_partial or motion.npts == expected.npts
    assert read or name in {"SimCenter event JSON"}


def test_v2a_with_a_wrong_count_is_rejected_all_the_same(tmp_path: Path) -> None:
    path = tmp_path / "record"
    text = v2a([("N28W", ["1.5"] * 24)], 0.02)
    path.write_text(text.replace("points  24", "points 240", 1))
    with pytest.raises(MotionFileError, match=r"number of points is wrong|240 points"):
        read_motions(path, allow_partial=True)
    lines = text.splitlines(keepends=True)
    del lines[27]  # one of the lines of acceleration
    path.write_text("".join(lines))
    with pytest.raises(MotionFileError, match="24 points"):
        read_motions(path, allow_partial=True)


def test_no_sample_at_all_is_rejected(tmp_path: Path) -> None:
    path = tmp_path / "record"
    path.write_text("".join(at2(SAMPLES, 0.01).splitlines(keepends=True)[:4]))
    with pytest.raises(MotionFileError):
        read_motions(path, allow_partial=True)


def test_a_missing_row_beside_a_time_column_is_rejected(tmp_path: Path) -> None:
    lines = written.cwb([["1.0", "2.0", "3.0"]] * 12, 100).splitlines(keepends=True)
    del lines[-5]
    path = tmp_path / "record"
    path.write_text("".join(lines))
    with pytest.raises(MotionFileError, match="instead of"):
        read_motions(path, allow_partial=True)


def test_real_event_whose_counts_disagree(formats_dir: Path) -> None:
    path = formats_dir / "simcenter_event_rinaldi.json"
    (motion,) = read_motions(path, units="g", allow_partial=True)
    assert motion.is_partial
    assert motion.npts == 1991
    assert "1992 samples, but 1991 follow" in motion.remarks[0]
