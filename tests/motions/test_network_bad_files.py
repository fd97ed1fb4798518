"""Damaged files of networks: one message with file, line and both numbers."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from rbfrag.errors import MotionFileError
from rbfrag.motions.readers import read_motions
from tests.motions import written_by_networks as written
from tests.motions.test_network_round_trips import STATE_NO_UNIT, WRITTEN

UNITS = {name: ("g" if name in STATE_NO_UNIT else None) for name in WRITTEN}


def rejection(
    folder: Path, text: str, *, units: str | None = None, dt_s: float | None = None
) -> MotionFileError:
    path = folder / "record"
    path.write_text(text)
    with pytest.raises(MotionFileError) as caught:
        read_motions(path, units=units, dt_s=dt_s)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)
    return caught.value


@pytest.mark.parametrize("name", WRITTEN)
def test_cut_after_every_line(tmp_path: Path, name: str) -> None:
    lines = WRITTEN[name]().splitlines(keepends=True)
    path = tmp_path / "record"
    path.write_text("".join(lines))
    complete = read_motions(path, units=UNITS[name])
    for number in range(1, len(lines)):
        path.write_text("".join(lines[:number]))
        try:
            motions = read_motions(path, units=UNITS[name])
        except MotionFileError:
            continue
        # nothing but a closing line, or whole channels, may be missing
        for motion in motions:
            assert motion.sha256 == complete[motion.trace_index].sha256


@pytest.mark.parametrize("name", WRITTEN)
def test_a_line_of_samples_missing(tmp_path: Path, name: str) -> None:
    lines = WRITTEN[name]().splitlines(keepends=True)
    path = tmp_path / "record"
    path.write_text("".join(lines))
    first = read_motions(path, units=UNITS[name])[0].npts
    assert first == 12
    rejected = 0
    for left_out in range(len(lines)):
        path.write_text("".join(lines[:left_out] + lines[left_out + 1 :]))
        try:
            assert all(m.npts == 12 for m in read_motions(path, units=UNITS[name]))
        except MotionFileError:
            rejected += 1
    assert rejected >= 2


@pytest.mark.parametrize("name", WRITTEN)
def test_contradicting_options(tmp_path: Path, name: str) -> None:
    text = WRITTEN[name]()
    path = tmp_path / "record"
    path.write_text(text)
    assert read_motions(path, units=UNITS[name], dt_s=0.01)[0].dt_s == 0.01
    assert "omit dt_s" in rejection(tmp_path, text, units=UNITS[name], dt_s=0.02).reason
    if name in STATE_NO_UNIT:
        assert "give units" in rejection(tmp_path, text).reason
    else:
        assert "omit units" in rejection(tmp_path, text, units="mm/s2").reason


def test_stated_unit_of_a_header_in_gal(tmp_path: Path) -> None:
    for name in set(WRITTEN) - STATE_NO_UNIT - {"CDMG V1", "BHRC V1"}:
        path = tmp_path / "record"
        path.write_text(WRITTEN[name]())
        assert read_motions(path, units="cm/s2")[0].sha256 == read_motions(path)[0].sha256


Change = tuple[str, str]


@pytest.mark.parametrize(
    ("name", "change", "words"),
    [
        ("CSMIP/CDMG V2", ("     12 points of accel data", "    120 points of accel data"),
         ("120 samples", "12 follow", "channel 0")),
        ("CSMIP/CDMG V2", ("     12 points of accel data", "      9 points of accel data"),
         ("9 samples", "12 follow")),
        ("CSMIP/CDMG V2", ("at  0.010 sec", "at  0.000 sec"), ("0.000", "positive")),
        ("CSMIP/CDMG V2", ("in cm/sec2.", "in furlongs."), ("'furlongs'", "m/s2")),
        ("CSMIP/CDMG V2", ("       0.1", "       NaN"), ("'NaN'",)),
        ("CSMIP/CDMG V2", ("       0.1", "      0.1"), ("79 characters", "8 fields of 10")),
        ("COSMOS V1c/V2c", ("      12 accel", "      13 accel"), ("13 samples", "12 follow")),
        ("COSMOS V1c/V2c", ("cm/sec2(04)", "counts(50)"), ("'counts'",)),
        ("COSMOS V1c/V2c", ("      10.000000", "    -999.000000"), ("-999.000000", "unknown")),
        ("COSMOS V1c/V2c", ("      10.000000", "   10000.000000"), ("120 s", "says 0 s")),
        ("COSMOS V1c/V2c", ("Format=(1E15.6)", "Format=free"), ("no format",)),
        ("COSMOS V1c/V2c", ("acceleration pts", "velocity pts"), ("velocity",)),
        ("CDMG V1", ("POINTS =     12", "POINTS =     11"), ("11 samples", "12 follow")),
        ("CDMG V1", ("  0.030    0.1", "  0.035    0.1"), ("0.035", "0.03 s")),
        ("CDMG V1", ("AND G/10", "AND VOLTS"), ("'VOLTS'",)),
        ("CDMG V1", ("POINTS =     12", "POINTS =   12.5"), ("'12.5'",)),
        ("BHRC V1", ("POINTS =     12", "POINTS =     13"), ("13 samples", "12 follow")),
        ("BHRC V1", ("DURATION =   0.120", "DURATION =  -0.120"), ("-0.120", "positive")),
        ("K-NET/KiK-net ASCII", ("0.12\n", "0.13\n"), ("13 samples", "12 follow")),
        ("K-NET/KiK-net ASCII", ("100Hz", "0Hz"), ("0", "positive")),
        ("K-NET/KiK-net ASCII", ("/8223790", "/0"), ("0", "positive")),
        ("K-NET/KiK-net ASCII", ("/8223790", ""), ("7845(gal)", "form")),
        ("K-NET/KiK-net ASCII", ("Memo.", "Notes"), ("'Memo.'",)),
        ("K-NET/KiK-net ASCII", ("       11 ", " 99999999999 "), ("99999999999", "32 bits")),
        ("ESM ASC", ("NDATA: 12", "NDATA: 14"), ("14 samples", "12 follow")),
        ("ESM ASC", ("DATA_TYPE: Acceleration", "DATA_TYPE: Velocity"), ("velocity",)),
        ("ESM ASC", ("STREAM: HNE", "STREAM: "), ("'STREAM'", "empty")),
        ("ESM ASC", ("1.0\n", "1.0 2.0\n"), ("2 values", "not 1")),
        ("CSMNC text", ("POINTS:  12", "POINTS:  14"), ("14 samples", "12 follow")),
        ("CSMNC text", ("UNCORRECTED ACCELERATION", "CORRECTED VELOCITY"), ("velocity",)),
        ("CSMNC text", ("1.0 \n", "1.O \n"), ("'1.O'",)),
        ("CWB dat", ("(sec): 0.12", "(sec): 0.15"), ("15 samples", "12 follow")),
        ("CWB dat", ("U(+)", "U(-)"), ("U(-)", "form")),
        ("CWB dat", ("4F10.3", "3F10.3"), ("3F10.3", "4 columns")),
        ("CWB dat", ("     0.050", "     0.070"), ("0.07 s", "0.05 s")),
        ("UNAM standard file", ("/12/12/12", "/13/13/13"), ("13 samples", "12 follow")),
        ("UNAM standard file", ("/12/12/12", "/12/12/11"), ("differ", "/12/12/11")),
        ("UNAM standard file", ("/0.01/0.01/0.01", "/0.01/0.01/0.02"), ("differ", "0.02")),
        ("UNAM standard file", ("/0.01/0.01/0.01", "/0.02/0.02/0.02"), ("0.24 s", "0.12")),
        ("UNAM standard file", ("CANALES                      : 3", "CANALES     : 4"),
         ("4 channels", "orientations of 3")),
        ("UNAM standard file", ("3F10.4", "6F10.4"), ("6F10.4", "3 channels")),
        ("AFAD NSMN text", ("DATA          : 12", "DATA          : 11"),
         ("11 samples", "12 follow")),
        ("AFAD NSMN text", ("0.1          0.2", "0.1             "), ("2 values", "not 3")),
        ("AFAD NSMN text", ("          E-W", "          N-S"), ("twice",)),
        ("USGS SMC", ("        12    -32768", "        11    -32768"),
         ("11 samples", "12 follow")),
        ("USGS SMC", ("         3\n", "         4\n"), ("4 comment", "|")),
        ("USGS SMC", ("CORRECTED ACCELEROGRAM", "VELOCITY             "), ("velocity",)),
        ("USGS SMC", ("1.0000000E+02", "0.0000000E+02"), ("samples per second", "positive")),
        ("SimCenter event JSON", ('"numSteps": 12', '"numSteps": 13'),
         ("numSteps is 13", "12 values")),
        ("SimCenter event JSON", ("     0.1,", "     NaN,"), ("nan", "finite")),
        ("SimCenter event JSON", ("     0.1,", "     0.1;"), ("not JSON",)),
        ("SimCenter event JSON", ('"dT": 0.01', '"dT": 0.02'), ("a single dT", "0.02")),
        ("GeoNet text (.000/.090/.ver)", ("12  1.0", "13  1.0"), ("13 samples", "12 follow")),
        ("GeoNet text (.000/.090/.ver)", (" 1.0\n", " inf\n"), ("'inf'",)),
    ],
)  # fmt: skip
def test_bad_value(tmp_path: Path, name: str, change: Change, words: tuple[str, ...]) -> None:
    text = WRITTEN[name]()
    changed = text.replace(change[0], change[1], 1)
    assert changed != text
    error = rejection(tmp_path, changed, units=UNITS[name])
    for word in words:
        assert word in error.reason
    # a file of velocities alone has no line to blame
    assert (error.line is None) is (change[1] == "velocity pts")


@pytest.mark.parametrize(
    "change",
    [
        lambda text: "[" * 200_000,
        lambda text: text.replace('"Events": [', '"Events": [' + "[" * 100_000, 1),
        lambda text: text.replace("12", "9" * 5000, 1),
        lambda text: text.replace("     0.1,", "     1e400,", 1),
        lambda text: text.replace('"data": [', '"data": [[1],', 1),
        lambda text: text.replace('"timeSeries": [', '"timeSeries": [7,', 1),
        lambda text: text.replace('"Events": [', '"Events": [7,', 1),
        lambda text: text.replace('"Events": [', '"Events": 7, "events": [', 1),
    ],
)
def test_strange_json(tmp_path: Path, change: Callable[[str], str]) -> None:
    rejection(tmp_path, change(WRITTEN["SimCenter event JSON"]()), units="g")


def test_csmip_v2_cut_within_its_velocities(tmp_path: Path) -> None:
    text = WRITTEN["CSMIP/CDMG V2"]()
    error = rejection(tmp_path, text[: text.rindex("2.0")])
    assert "channel 1 does not end" in error.reason


def test_cdmg_v1_of_zeros_alone(tmp_path: Path) -> None:
    text = written.cdmg_v1([("NS", ["0.000"] * 12)], 0.01)
    assert "zero" in rejection(tmp_path, text).reason


def test_volume_1_without_samples(tmp_path: Path) -> None:
    text = written.bhrc_v1([("L1", ["0.1"] * 12)], 0.01)
    head = text[: text.index("UNITS ARE")] + "UNITS ARE SECONDS AND G/10\n"
    assert "no samples follow" in rejection(tmp_path, head).reason


def test_a_blank_that_numpy_does_not_know(tmp_path: Path) -> None:
    text = WRITTEN["COSMOS V1c/V2c"]()
    path = tmp_path / "record"
    path.write_text(text)
    (complete,) = read_motions(path)
    at = text.index("            1.0")
    path.write_text(f"{text[:at]}\x1c{text[at + 1 :]}", encoding="latin-1")
    (motion,) = read_motions(path, allow_partial=True)
    assert motion.sha256 == complete.sha256
