"""Files are read back to the printed digit; damaged files are rejected, never misread."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from rbfrag.errors import MotionFileError
from rbfrag.motions.readers import read_motion, read_motions
from rbfrag.motions.units import unit_in_g
from tests.motions.written import AT2_SAMPLING, at2, two_columns, v2a

in_folder = settings(
    max_examples=100,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)

values = st.lists(st.floats(-3.0, 3.0), min_size=1, max_size=60)
intervals = st.integers(1, 500).map(lambda steps: steps / 10_000)


@in_folder
@given(
    samples=values,
    dt_s=intervals,
    sampling=st.sampled_from(AT2_SAMPLING),
    form=st.sampled_from(["{:.7E}", "{: .6f}", "{:.3E}"]),
    per_line=st.integers(1, 8),
    newline=st.sampled_from(["\n", "\r\n"]),
)
def test_at2(
    tmp_path: Path,
    samples: list[float],
    dt_s: float,
    sampling: str,
    form: str,
    per_line: int,
    newline: str,
) -> None:
    printed = [form.format(value) for value in samples]
    path = tmp_path / "record"
    text = at2(printed, dt_s, sampling=sampling, per_line=per_line)
    path.write_text(text, newline=newline)
    motion = read_motion(path)
    assert motion.acceleration_g.tolist() == [float(token) for token in printed]
    assert motion.dt_s == dt_s
    assert (motion.station, motion.component) == ("TCU068", "N")
    assert motion.event == "CHI-CHI 09/20/99"


@in_folder
@given(
    samples=values.filter(lambda samples: len(samples) > 1),
    dt_s=intervals,
    first=st.integers(0, 1000),
    decimals=st.integers(4, 8),
    mark=st.sampled_from([",", ";", "\t", "  ", ", "]),
    unit=st.sampled_from(["g", "m/s2", "cm/s2", "mm/s2"]),
    stated_by=st.sampled_from(["# Time (s),Acceleration ({})\n", "time [s],acc [{}]\n", ""]),
)
def test_two_columns(
    tmp_path: Path,
    samples: list[float],
    dt_s: float,
    first: int,
    decimals: int,
    mark: str,
    unit: str,
    stated_by: str,
) -> None:
    times = [f"{(first + i) * dt_s:.{decimals}f}" for i in range(len(samples))]
    printed = [repr(value) for value in samples]
    path = tmp_path / "record"
    path.write_text(two_columns(times, printed, mark=mark, header=stated_by.format(unit)))
    motion = read_motion(path, units=None if stated_by else unit)
    assert motion.acceleration_g.tolist() == (np.array(samples) * unit_in_g(unit)).tolist()
    assert motion.dt_s == dt_s


@in_folder
@given(samples=values, dt_s=st.floats(1e-4, 0.1), unit=st.sampled_from(["g", "gal"]))
def test_one_column(tmp_path: Path, samples: list[float], dt_s: float, unit: str) -> None:
    path = tmp_path / "record"
    path.write_text("\n".join(map(repr, samples)))
    motion = read_motion(path, units=unit, dt_s=dt_s)
    assert motion.acceleration_g.tolist() == (np.array(samples) * unit_in_g(unit)).tolist()
    assert motion.dt_s == dt_s


@in_folder
@given(
    components=st.lists(
        st.tuples(
            st.sampled_from(["N28W", "S62W", "UP"]),
            # wide enough to touch the field before: -99999.9
            st.lists(st.integers(-999_999, 999_999), min_size=1, max_size=45),
        ),
        min_size=1,
        max_size=3,
    ),
    thousandths=st.integers(1, 50),
)
def test_v2a(tmp_path: Path, components: list[tuple[str, list[int]]], thousandths: int) -> None:
    printed = [(name, [f"{value / 10:.1f}" for value in tenths]) for name, tenths in components]
    path = tmp_path / "record"
    path.write_text(v2a(printed, thousandths / 1000))
    motions = read_motions(path)
    assert len(motions) == len(printed)
    for index, (motion, (name, tokens)) in enumerate(zip(motions, printed, strict=True)):
        expected = np.array([float(token) for token in tokens]) * unit_in_g("mm/s2")
        assert motion.acceleration_g.tolist() == expected.tolist()
        assert motion.dt_s == thousandths / 1000
        assert motion.component == name
        assert motion.is_vertical is (name == "UP")
        assert motion.trace_index == index


_PRINTED = [f"{0.03 * np.sin(0.7 * i):.5E}" for i in range(30)]
SOUND = (
    at2(_PRINTED, 0.005),
    at2(_PRINTED, 0.005, sampling=AT2_SAMPLING[5]),
    two_columns(
        [f"{i * 0.005:g}" for i in range(30)], _PRINTED, header="# Time (s),Acceleration (g's)\n"
    ),
    two_columns([f"{i * 0.01:012.8f}" for i in range(30)], _PRINTED, mark=" "),
    v2a([("N28W", [f"{9.0 * i:.1f}" for i in range(23)]), ("UP", ["-0.1"] * 23)], 0.02),
)


@settings(max_examples=600, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_damaged_files(tmp_path: Path, data: st.DataObject) -> None:
    content = bytearray(data.draw(st.sampled_from(SOUND)).encode())
    for _ in range(data.draw(st.integers(1, 4), label="edits")):
        at = data.draw(st.integers(0, max(len(content) - 1, 0)), label="at")
        edit = data.draw(st.sampled_from(["change", "insert", "delete", "cut", "repeat"]))
        damage = data.draw(st.binary(min_size=1, max_size=4) | st.sampled_from(
            [b"nan", b"-", b".", b"E", b"9", b"0", b" ", b"\n", b"\r", b",", b";", b"#", b"inf",
             b"1e999", b"\xff", b"\xe2\x80\xa8", b"\x0c", b"\x1c", b"_"]
        ))  # fmt: skip
        if edit == "change":
            content[at : at + len(damage)] = damage
        elif edit == "insert":
            content[at:at] = damage
        elif edit == "delete":
            del content[at : at + data.draw(st.integers(1, 200))]
        elif edit == "cut":
            del content[at:]
        else:
            content[at:at] = content[at : at + data.draw(st.integers(1, 200))]
    path = tmp_path / "damaged.txt"
    path.write_bytes(bytes(content))
    try:
        motions = read_motions(path, units=data.draw(st.sampled_from([None, "g"])))
    except MotionFileError as error:
        message, motions = str(error), []
        lines = bytes(content).replace(b"\r\n", b"\n").replace(b"\r", b"\n").count(b"\n") + 1
        line_is_there = error.line is None or 1 <= error.line <= lines
    else:
        message, line_is_there = str(path), bool(motions)
    assert message.startswith(str(path))
    assert line_is_there
    for motion in motions:
        assert np.isfinite(motion.acceleration_g).all()
        assert motion.dt_s is not None
        assert motion.dt_s > 0.0
