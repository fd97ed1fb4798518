"""Files that are no accelerogram, or a damaged one: one message with file, line and value."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from rbfrag.errors import InputError, MotionFileError, UnknownFormatError
from rbfrag.motions.readers import read_motion, read_motions
from tests.motions.written import AT2_SAMPLING, at2, v2a

SAMPLES = [f"{0.001 * i:.5E}" for i in range(1, 13)]


def rejection(path: Path, **options: object) -> MotionFileError:
    with pytest.raises(MotionFileError) as caught:
        read_motions(path, **options)  # type: ignore[arg-type]
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)
    return caught.value


def written(folder: Path, content: str | bytes, name: str = "record.AT2") -> Path:
    path = folder / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


def test_missing(tmp_path: Path) -> None:
    assert "no such file" in rejection(tmp_path / "nowhere.AT2").reason


def test_folder(tmp_path: Path) -> None:
    assert "folder" in rejection(tmp_path).reason


@pytest.mark.parametrize("name", ["x" * 5000, "x" * 5000 + "#0", "a\0b", "a#" + "9" * 5000])
def test_name_that_no_file_can_have(name: str) -> None:
    with pytest.raises(MotionFileError, match=r"cannot be read|no such file"):
        read_motion(name)


@pytest.mark.parametrize("content", [b"", b"\n\n  \n", b"\xef\xbb\xbf"])
def test_empty(tmp_path: Path, content: bytes) -> None:
    assert "empty" in rejection(written(tmp_path, content)).reason


@pytest.mark.parametrize(
    "content", [b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR", bytes(range(256)) * 4, b"SQLite format 3\0"]
)
def test_binary(tmp_path: Path, content: bytes) -> None:
    assert "binary" in rejection(written(tmp_path, content)).reason


def test_packed(tmp_path: Path) -> None:
    assert "it is a gzip file: unpack it" in rejection(written(tmp_path, b"\x1f\x8b\x08\0")).reason


@pytest.mark.parametrize(
    "content",
    [
        "Dear colleague,\nplease find the records attached.\n",
        "a,b,c\nfirst,1,x\nsecond,2,y\n",
        '{"npts": 3, "dt": 0.01}\n',
        "<html><body>404</body></html>\n",
    ],
)
def test_wrongly_labelled(tmp_path: Path, content: str) -> None:
    path = written(tmp_path, content)
    with pytest.raises(UnknownFormatError, match="supported are rbfrag CSV, PEER AT2, GeoNet V2A"):
        read_motions(path, units="g", dt_s=0.01)


def test_content_decides_not_the_name(tmp_path: Path) -> None:
    path = written(tmp_path, v2a([("N28W", ["1.0"] * 12)], 0.02), "record.AT2")
    assert read_motion(path).file_format == "GeoNet V2A"
    path = written(tmp_path, at2(SAMPLES, 0.01), "record.V2A")
    assert read_motion(path).file_format == "PEER AT2"


@pytest.mark.parametrize("sampling", AT2_SAMPLING)
@pytest.mark.parametrize("count", [11, 13])
def test_at2_count_disagrees(tmp_path: Path, sampling: str, count: int) -> None:
    error = rejection(written(tmp_path, at2(SAMPLES, 0.01, sampling=sampling, npts=count)))
    assert error.line == 4
    assert f"{count} samples" in error.reason
    assert "12 follow" in error.reason
    assert "export" in error.reason


def test_at2_truncated_at_every_line(tmp_path: Path) -> None:
    lines = at2(SAMPLES, 0.01).splitlines(keepends=True)
    for number in range(len(lines)):
        rejection(written(tmp_path, "".join(lines[:number])))


@pytest.mark.parametrize(
    ("old", "new", "line", "words"),
    [
        (SAMPLES[6], "NaN", 6, ("'NaN'", "finite")),
        (SAMPLES[6], "-inf", 6, ("'-inf'", "finite")),
        (SAMPLES[11], "1.0E+999", 7, ("'1.0E+999'", "large")),
        (SAMPLES[0], "*********", 5, ("'*********'",)),
        (SAMPLES[0], "0.1_2", 5, ("'0.1_2'",)),
        ("DT=  .01000", "DT=  .00000", 4, ("DT", ".00000", "positive")),
        ("DT=  .01000", "DT= -.01000", 4, ("DT", "-.01000", "positive")),
        ("DT=  .01000", "DT= nan", 4, ("DT", "'nan'")),
        ("DT=  .01000", "DT= fast", 4, ("DT", "'fast'")),
        ("NPTS=     12", "NPTS=   12.5", 4, ("NPTS", "'12.5'")),
        ("NPTS=     12", "NPTS=      0", 4, ("NPTS", "'0'")),
        ("NPTS=     12", "NPTS=     -3", 4, ("NPTS", "'-3'")),
        ("ACCELERATION TIME", "VELOCITY TIME", 3, ("velocity", "acceleration")),
        ("NPTS=     12", "NPTS= " + "9" * 50, 4, ("NPTS", "999")),
        ("UNITS OF G", "UNITS OF FURLONGS", 3, ("FURLONGS", "m/s2")),
    ],
)
def test_at2_bad_value(
    tmp_path: Path, old: str, new: str, line: int, words: tuple[str, ...]
) -> None:
    text = at2(SAMPLES, 0.01)
    assert old in text
    error = rejection(written(tmp_path, text.replace(old, new, 1)))
    assert error.line == line
    for word in words:
        assert word in error.reason


def test_at2_contradicting_options(tmp_path: Path) -> None:
    path = written(tmp_path, at2(SAMPLES, 0.01))
    assert "omit units" in rejection(path, units="m/s2").reason
    assert "omit dt_s" in rejection(path, dt_s=0.02).reason
    assert read_motion(path, units="g", dt_s=0.01).npts == 12


def test_at2_without_unit(tmp_path: Path) -> None:
    path = written(tmp_path, at2(SAMPLES, 0.01, quantity="ACCELERATION TIME HISTORY"))
    assert "give units" in rejection(path).reason
    assert read_motion(path, units="m/s2").pga_g == pytest.approx(0.012 / 9.80665)


V2A = v2a([("N28W", [f"{i}.5" for i in range(24)]), ("UP", ["-1.5"] * 24)], 0.02)


def _drop_last_line(text: str) -> str:
    return text[: text.rstrip("\n").rindex("\n") + 1]


@pytest.mark.parametrize(
    ("change", "line", "words"),
    [
        (lambda text: text.replace("points  24", "points  240", 1), 10, ("240 points",)),
        (lambda text: text.replace("points  24", "points  0", 1), 10, ("'0'",)),
        (lambda text: text.replace("points  24", "points  many", 1), 10, ("'many'",)),
        (lambda text: text.replace("points  24", "points  " + "9" * 5000, 1), 10, ("999",)),
        (lambda text: text.replace("at 0.020 sec", "at 0.000 sec", 1), 11, ("0.000", "positive")),
        (lambda text: text.replace("at 0.020 sec", "at -.020 sec", 1), 11, ("-.020", "positive")),
        (lambda text: text.replace("at 0.020 sec", "at nan sec", 1), 11, ("'nan'",)),
        (lambda text: text.replace("mm/s/s", "mi/h/s", 1), 14, ("mi/h/s",)),
        (lambda text: text.replace("    13.5", "     NaN", 1), 28, ("'NaN'",)),
        (lambda text: text.replace("    13.5", "  ******", 1), 28, ("'******'",)),
        (lambda text: text.replace("    13.5", "        ", 1), 28, ("''",)),
        (_drop_last_line, 45, ("component 1", "24 points", "truncated")),
        (lambda text: text[: len(text) // 4], 10, ("component 0", "truncated")),
        (lambda text: text.replace("\nComponent UP", "\nPart UP", 1), 36, ("component",)),
    ],
)
def test_v2a_bad_value(
    tmp_path: Path, change: Callable[[str], str], line: int, words: tuple[str, ...]
) -> None:
    assert len(read_motions(written(tmp_path, V2A))) == 2
    changed = change(V2A)
    assert changed != V2A
    error = rejection(written(tmp_path, changed))
    assert error.line == line
    for word in words:
        assert word in error.reason


def test_v2a_contradicting_options(tmp_path: Path) -> None:
    path = written(tmp_path, V2A)
    assert "omit units" in rejection(path, units="g").reason
    assert "omit dt_s" in rejection(path, dt_s=0.01).reason


@pytest.mark.parametrize("dt_s", [0.0, -0.01, float("nan"), float("inf")])
def test_stated_dt(tmp_path: Path, dt_s: float) -> None:
    with pytest.raises(InputError, match="dt_s must be a positive number"):
        read_motions(written(tmp_path, "0.1\n0.2\n"), units="g", dt_s=dt_s)


def test_stated_unit(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"'furlongs'.*m/s2"):
        read_motions(written(tmp_path, "0.1\n0.2\n"), units="furlongs", dt_s=0.01)


def test_words_of_any_length_are_cut(tmp_path: Path) -> None:
    long = "9" * 2000
    for text in (
        f"0.0,1.0\n0.01,2.0\n0.02{long},3.0\n0.03,1.0\n",
        at2(SAMPLES, 0.01).replace("UNITS OF G", f"UNITS OF {long}"),
        V2A.replace("mm/s/s", long),
    ):
        error = rejection(written(tmp_path, text), units="g")
        assert len(error.reason) < 500
        assert "999…" in error.reason


def test_a_dt_that_nothing_can_be_integrated_with(tmp_path: Path) -> None:
    path = written(tmp_path, at2(SAMPLES, 0.01).replace("DT=  .01000", "DT= 1.5E308"))
    assert "12 samples at dt = 1.5e+308 s" in rejection(path).reason
