"""Delimited text: units stated and never guessed, dt exact, every bad row named."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbfrag.errors import MotionFileError
from rbfrag.motions.formats.delimited_text import FORMAT
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.readers import read_motion
from rbfrag.motions.text import sampling_interval
from tests.motions.written import two_columns

G = 9.80665


def read(
    folder: Path, text: str, *, units: str | None = None, dt_s: float | None = None
) -> GroundMotion:
    path = folder / "record.csv"
    path.write_text(text, encoding="utf-8", newline="")
    return read_motion(path, units=units, dt_s=dt_s)


def rejection(
    folder: Path, text: str, *, units: str | None = None, dt_s: float | None = None
) -> MotionFileError:
    with pytest.raises(MotionFileError) as caught:
        read(folder, text, units=units, dt_s=dt_s)
    assert str(caught.value).startswith(str(folder / "record.csv"))
    return caught.value


@pytest.mark.parametrize(
    ("header", "in_g"),
    [
        ("# Time (s),Acceleration (g's)\n", 1.0),
        ("# Time (s),Acceleration (g)\n", 1.0),
        ("time [s]; acc [m/s2]\n", 1.0 / G),
        ('"Time (s)","Acceleration (cm/s^2)"\n', 0.01 / G),
        ("# anything\n# t(s)  a(m/s²)\n", 1.0 / G),
        ("time_s,acc_g\n", 1.0),
        ("time_s,acceleration_m_s2\n", 1.0 / G),
        ("# units: gal\n", 0.01 / G),
        ("# Acceleration in mm/s2, sampled at 200 Hz\n", 0.001 / G),
        ("# Accelerogram (corrected), units of g\n", 1.0),
        ("# Ground acceleration [cm/sec**2] at the crest\n# t, a\n", 0.01 / G),
        ("Zeit [s],Beschleunigung [m/s²]\n", 1.0 / G),
        ("# Zeit (s), Beschleunigung (m s^-2)\n", 1.0 / G),
        ("temps {s},signal {cm·s⁻²}\n", 0.01 / G),
        ("zaman,ivme [gal]\n", 0.01 / G),
    ],
)
def test_units_of_header(tmp_path: Path, header: str, in_g: float) -> None:
    motion = read(tmp_path, header + "0.00,1.5\n0.01,-2.5\n0.02,0.5\n")
    assert motion.acceleration_g.tolist() == pytest.approx([1.5 * in_g, -2.5 * in_g, 0.5 * in_g])
    assert motion.dt_s == 0.01
    assert motion.file_format == FORMAT


def test_unit_of_caller(tmp_path: Path) -> None:
    text = "0.00 1.0\n0.01 2.0\n"
    for units, in_g in (("g", 1.0), ("m/s2", 1 / G), ("gal", 0.01 / G), ("mm/s2", 0.001 / G)):
        assert read(tmp_path, text, units=units).acceleration_g[1] == pytest.approx(2.0 * in_g)


def test_unit_is_never_guessed(tmp_path: Path) -> None:
    for header in ("", "# Quarry road\n", "time,acc\n", "# Time (s),Acceleration\n"):
        assert "give units" in rejection(tmp_path, header + "0,1\n0.01,2\n").reason


def test_unit_in_brackets_is_not_overruled(tmp_path: Path) -> None:
    text = "Zeit [s],Beschleunigung [m/s²]\n0,1\n0.01,2\n"
    assert "m/s², not g" in rejection(tmp_path, text, units="g").reason


def test_header_and_caller_disagree(tmp_path: Path) -> None:
    text = "# Time (s),Acceleration (m/s2)\n0,1\n0.01,2\n"
    assert read(tmp_path, text, units="m/sec/sec").npts == 2
    error = rejection(tmp_path, text, units="g")
    assert error.line == 1
    assert "m/s2, not g" in error.reason
    assert "omit units" in error.reason


@pytest.mark.parametrize(
    ("header", "line", "words"),
    [
        ("# a title\n# Time (s),Acceleration (counts)\n", 2, ("'counts'", "m/s2")),
        ("# units: g\n# Time (s),Acceleration (gal)\n", 2, ("gal", "line 1")),
        ("# Time (ms),Acceleration (g)\n", 1, ("'ms'", "seconds")),
        ("# Time (s),Velocity (cm/s)\n", 1, ("Velocity", "acceleration")),
        ("Acceleration (g),Time (s)\n", 1, ("swap",)),
        ("Zeit [ms],Beschleunigung [m/s²]\n", 1, ("'ms'", "seconds")),
        ("Beschleunigung [m/s²],Zeit [s]\n", 1, ("swap",)),
    ],
)
def test_headers_that_say_something_else(
    tmp_path: Path, header: str, line: int, words: tuple[str, ...]
) -> None:
    error = rejection(tmp_path, header + "0,1\n0.01,2\n")
    assert error.line == line
    for word in words:
        assert word in error.reason


@pytest.mark.parametrize("mark", [",", ";", "\t", " ", "   ", " , ", "; "])
@pytest.mark.parametrize("newline", ["\n", "\r\n", "\r"])
def test_separators_newlines_and_mark(tmp_path: Path, mark: str, newline: str) -> None:
    text = two_columns(["0.00", "0.01", "0.02"], ["1E-1", "-.25", "+3."], mark=mark)
    motion = read(tmp_path, "\ufeff# t (s), acc (g)\n".replace("\n", newline) + text)
    assert motion.acceleration_g.tolist() == [0.1, -0.25, 3.0]


def test_blank_lines_around_rows(tmp_path: Path) -> None:
    motion = read(tmp_path, "\n# acc (g)\n\n0.00 1\n\n0.01 2\n\n\n")
    assert motion.acceleration_g.tolist() == [1.0, 2.0]


def test_one_column(tmp_path: Path) -> None:
    text = "# acc (g)\n0.1\n-0.2\n0.3\n"
    motion = read(tmp_path, text, dt_s=0.005)
    assert motion.acceleration_g.tolist() == [0.1, -0.2, 0.3]
    assert motion.dt_s == 0.005
    assert "dt_s" in rejection(tmp_path, text).reason
    error = rejection(tmp_path, "# acc (g)\n0.1\n\n0.3\n", dt_s=0.005)
    assert error.line == 3
    assert "missing sample" in error.reason


@pytest.mark.parametrize(
    ("title", "expected"),
    [
        (
            "# Time Series: Chi-Chi, Taiwan 1999 - TCU068-090",
            ("Chi-Chi, Taiwan 1999", "TCU068", "090", 90.0),
        ),
        ("# Northridge 1994 - VSP-360,", ("Northridge 1994", "VSP", "360", 0.0)),
        ("# Mammoth Lakes-1 1980 - CVK-UP", ("Mammoth Lakes-1 1980", "CVK", "UP", None)),
        ("# Quarry road - sensor 3", ("", "", "", None)),
        ("# Quarry road, north component", ("", "", "", None)),
    ],
)
def test_title(tmp_path: Path, title: str, expected: tuple[str, str, str, float | None]) -> None:
    motion = read(tmp_path, f"{title}\n# Time (s),Acceleration (g)\n0,1\n0.01,2\n")
    assert (
        motion.event,
        motion.station,
        motion.component,
        motion.orientation_deg,
    ) == expected


def test_caller_may_state_the_dt_that_the_times_show(tmp_path: Path) -> None:
    text = "# acc (g)\n0.000 1\n0.008 2\n0.017 3\n0.025 4\n"
    assert read(tmp_path, text).dt_s == 0.0083
    assert read(tmp_path, text, dt_s=1.0 / 120.0).dt_s == 1.0 / 120.0
    error = rejection(tmp_path, text, dt_s=0.005)
    assert "0.0083" in error.reason
    assert "0.005" in error.reason
    assert "dt_s" in error.reason


def test_single_row(tmp_path: Path) -> None:
    assert "dt_s" in rejection(tmp_path, "# acc (g)\n0.0 1\n").reason
    assert read(tmp_path, "# acc (g)\n0.0 1\n", dt_s=0.01).npts == 1


def test_start_other_than_zero_is_remarked(tmp_path: Path) -> None:
    motion = read(tmp_path, "# acc (g)\n12.50 1\n12.51 2\n12.52 3\n")
    assert motion.dt_s == 0.01
    assert motion.time_s[0] == 0.0
    assert "12.5 s" in motion.remarks[0]


@pytest.mark.parametrize(
    ("rows", "line", "words"),
    [
        ("0.00,1\n0.01,x\n0.02,3\n", 3, ("acceleration", "'x'")),
        ("0.00,1\n0.01,NaN\n0.02,3\n", 3, ("'NaN'", "finite")),
        ("0.00,inf\n0.01,2\n", 2, ("'inf'", "finite")),
        ("0.00,1\n0.01,-Infinity\n", 3, ("'-Infinity'",)),
        ("0.00,1\n0.01,1e999\n", 3, ("'1e999'", "large")),
        ("0.00,1\n0.01,1_000\n", 3, ("'1_000'",)),
        ("0.00,1\n0.01,٣\n", 3, ("'٣'",)),
        ("0.00,1\nnan,2\n0.02,3\n", 3, ("time", "'nan'")),
        ("0.00,1\n0.01\n0.02,3\n", 3, ("2 columns", "'0.01'")),
        ("0.00,1\n0.01,2,3\n", 3, ("2 columns", "'0.01,2,3'")),
        ("0.00,1\n0.01,\n", 3, ("''",)),
        ("0.00,1\n# cut\n0.01,2\n", 3, ("'# cut'",)),
        ("0.00,1,2\n0.01,1,2\n", 2, ("3 columns", "one component")),
        ("0.000,1\n0.010,2\n0.030,3\n0.040,4\n", 4, ("0.030", "0.01 s is usual")),
        ("0.00,1\n0.01 2\n0.02,3\n", 3, ("2 columns", "'0.01 2'")),
        ("0.00,1\n0.01,2\n0.01,3\n0.02,4\n", 4, ("must rise",)),
        ("0.00,1\n0.01,2\n0.01,3\n0.02,4\n0.02,5\n0.03,6\n", 4, ("must rise",)),
        ("0.02,1\n0.01,2\n0.00,3\n", 3, ("must rise",)),
        ("0.00,1\n0.00,2\n0.00,3\n", 3, ("must rise",)),
        ("0,005;1,5\n0,010;2,5\n", 2, ("decimal comma", "0.005")),
        ("0,005 1,5\n0,010 2,5\n", 2, ("decimal comma",)),
        ("0;1,5\n1;2,5\n", 2, ("decimal comma", "'0;1,5'")),
    ],
)
def test_bad_rows(tmp_path: Path, rows: str, line: int, words: tuple[str, ...]) -> None:
    error = rejection(tmp_path, "# Time (s), Acceleration (g)\n" + rows)
    assert error.line == line
    for word in words:
        assert word in error.reason


def test_header_without_rows(tmp_path: Path) -> None:
    rejection(tmp_path, "# Time (s), Acceleration (g)\n")
    rejection(tmp_path, "time_s,acc_g\n")


@pytest.mark.parametrize(
    ("times", "dt_s"),
    [
        (["0", "0.005", "0.01", "0.015", "0.02"], 0.005),
        (["000.00000000", "000.01000000", "000.02000000"], 0.01),
        (["0.000", "0.008", "0.016", "0.023", "0.031", "0.039", "0.047"], 0.0078),
        ([f"{i / 128:.3f}" for i in range(4000)], 0.0078125),
        ([f"{i / 120:.4f}" for i in range(1, 401)], 0.0083333),
        ([f"{i * 0.02:.6E}" for i in range(3000)], 0.02),
        ([f"{i * 0.005:.6g}" for i in range(250_000)], 0.005),
        ([repr(i * 0.01) for i in range(5000)], 0.01),
        ([str(t) for t in np.arange(9000, dtype=np.float32) * np.float32(0.005)], 0.005),
        ([str(t) for t in np.cumsum(np.full(20_000, 0.002))], 0.002),
        (["-0.02", "-0.01", "0", "0.01"], 0.01),
        ([f"{i / 256:.3f}" for i in range(3000)], 0.00390625),
        (["0", "1", "2"], 1.0),
    ],
)
def test_interval_behind_printed_times(tmp_path: Path, times: list[str], dt_s: float) -> None:
    numbers = np.array([float(token) for token in times])
    lines = range(1, len(times) + 1)
    assert sampling_interval(tmp_path, times, numbers, lines, None) == dt_s


@given(
    thousandths=st.integers(1, 100),
    first=st.integers(0, 50_000),
    count=st.integers(25, 400),
    data=st.data(),
)
def test_a_missing_row_is_always_noticed(
    thousandths: int, first: int, count: int, data: st.DataObject
) -> None:
    tokens = [f"{(first + i * thousandths) / 1000:.3f}" for i in range(count)]
    gone = data.draw(st.integers(1, count - 2))
    lines = [number for number in range(1, count + 1) if number != gone + 1]
    del tokens[gone]
    numbers = np.array([float(token) for token in tokens])
    with pytest.raises(MotionFileError) as caught:
        sampling_interval(Path("record.csv"), tokens, numbers, lines, None)
    assert caught.value.line == gone + 2


@pytest.mark.parametrize("tokens", [("0", "9.5e307", "1.79e308"), ("1e300", "9e307", "1.75e308")])
def test_times_near_the_largest_number_are_judged_without_overflow(tokens: tuple[str, ...]) -> None:
    # a warning is an error in these tests, and a line that is no JSON in the log of a service
    times = np.array([float(token) for token in tokens])
    with pytest.raises(MotionFileError, match=r"r\.csv"):
        sampling_interval(Path("r.csv"), tokens, times, [1, 2, 3], None)
