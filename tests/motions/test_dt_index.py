"""Lists of bare accelerations: where their sampling interval comes from."""

from __future__ import annotations

from pathlib import Path

import pytest

from rbfrag.errors import MotionFileError
from rbfrag.motions.readers import read_motion


@pytest.fixture
def record(tmp_path: Path) -> Path:
    path = tmp_path / "120111.th"
    path.write_text("  2.2780000e-005\n  1.4320000e-005\n -2.6030000e-005")
    return path


def index(record: Path, text: str) -> None:
    (record.parent / "dt_index.txt").write_text(text)


def test_index_beside_the_file(record: Path) -> None:
    index(record, "120112.th\t0.02\n120111.th\t0.005\n")
    motion = read_motion(record, units="g")
    assert motion.acceleration_g.tolist() == [2.278e-5, 1.432e-5, -2.603e-5]
    assert motion.dt_s == 0.005
    assert motion.remarks == ("the file has no dt; 0.005 s is from dt_index.txt, line 2",)


def test_what_is_stated(record: Path) -> None:
    motion = read_motion(record, units="g", dt_s=0.01)
    assert motion.dt_s == 0.01
    assert "0.01 s is what was stated" in motion.remarks[0]


def test_index_and_statement_agree(record: Path) -> None:
    index(record, "120111.th 0.005")
    assert read_motion(record, units="g", dt_s=0.005).dt_s == 0.005
    with pytest.raises(MotionFileError, match=r"dt_index\.txt, line 1 .* 0\.005 s, not 0\.01"):
        read_motion(record, units="g", dt_s=0.01)


@pytest.mark.parametrize("text", [None, "120112.th 0.01\n", "120111.th\n", "120111 0.01\n"])
def test_interval_is_never_guessed(record: Path, text: str | None) -> None:
    if text is not None:
        index(record, text)
    with pytest.raises(MotionFileError, match=r"dt_s 0\.005.*dt_index\.txt"):
        read_motion(record, units="g")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("x.th 0.01\n120111.th fast\n", r"dt_index\.txt, line 2: dt 'fast'"),
        ("120111.th -0.01\n", r"line 1: dt -0\.01 must be positive"),
        ("120111.th nan\n", r"line 1: dt 'nan'"),
        ("120111.th 0.01\n120111.th 0.02\n", r"line 2: .*dt = 0\.02 s here, but 0\.01"),
    ],
)
def test_bad_index(record: Path, text: str, words: str) -> None:
    index(record, text)
    with pytest.raises(MotionFileError, match=words):
        read_motion(record, units="g")
