"""Layouts of everyday use: named components, rows of values, K-NET CSV, StationXML."""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np
import pytest

from rbfrag.errors import MotionFileError, UnitNotStatedError
from rbfrag.motions.quality import quality_flags
from rbfrag.motions.readers import read_motion, read_motions
from tests.motions.test_miniseed import GAIN, in_g, written
from tests.motions.written_miniseed import COUNTS, miniseed

PGA_G = (0.1831, 0.1427, 0.0916)
"""Of the samples' north-south, east-west and vertical components."""


@pytest.fixture
def records(formats_dir: Path) -> Path:
    folder = formats_dir.parent / "cases4" / "records"
    if not folder.is_dir():
        pytest.skip("the folder cases4/records is not next to the sample formats")
    return folder


@pytest.mark.parametrize(
    ("name", "components", "directions", "pga_g"),
    [
        ("knet.csv", ("N-S", "E-W", "U-D"), (0.0, 90.0, None), PGA_G),
        ("three_components.csv", ("NS", "EW", "UD"), (0.0, 90.0, None), PGA_G),
        ("csmip_sta_chn.v2", ("UP", "360 DEG", "270 DEG"), (None, 0.0, 270.0),
         (PGA_G[2], PGA_G[0], PGA_G[1])),
        ("unam_one_short_line.001", ("N00E", "V", "N90E"), (0.0, None, 90.0),
         (PGA_G[0], PGA_G[2], PGA_G[1])),
    ],
)  # fmt: skip
def test_samples_of_three_components(
    records: Path,
    name: str,
    components: tuple[str, ...],
    directions: tuple[float | None, ...],
    pga_g: tuple[float, ...],
) -> None:
    motions = read_motions(records / name)
    assert tuple(motion.component for motion in motions) == components
    assert tuple(motion.orientation_deg for motion in motions) == directions
    assert [motion.is_vertical for motion in motions] == [angle is None for angle in directions]
    assert [motion.pga_g for motion in motions] == pytest.approx(pga_g, abs=5.1e-5)
    assert {(motion.npts, motion.dt_s) for motion in motions} == {(3000, 0.01)}
    assert len({motion.recording for motion in motions}) == 1


def test_a_channel_on_a_roof_has_a_flag(records: Path) -> None:
    motions = read_motions(records / "csmip_sta_chn.v2")
    flags = [{flag.code for flag in quality_flags(motion)} for motion in motions]
    assert ["structure" in codes for codes in flags] == [False, False, True]


def test_offset_of_an_instrument_is_subtracted(records: Path) -> None:
    vertical = read_motions(records / "knet.csv")[2]
    assert "the mean of 16.5 gal" in vertical.remarks[0]
    assert abs(vertical.acceleration_g.mean()) < 1e-15


@pytest.mark.parametrize(("name", "units"), [("wrapped5.g3", "g"), ("eqsig_npts_dt.txt", "m/s2")])
def test_samples_of_one_component(records: Path, name: str, units: str) -> None:
    motion = read_motion(records / name, units=units, dt_s=0.01)
    assert (motion.npts, motion.dt_s) == (3000, 0.01)
    assert motion.pga_g == pytest.approx(PGA_G[0], abs=5.1e-5)


VALUES = [0.1, -0.2, 0.3, 0.25, -0.15, 0.05, 0.5]


def text_file(folder: Path, text: str) -> Path:
    file = folder / "record.txt"
    file.write_text(text)
    return file


def test_rows_of_values_are_read_row_by_row(tmp_path: Path) -> None:
    file = text_file(tmp_path, "0.1 -0.2 0.3\n0.25 -0.15 0.05\n0.5\n")
    assert read_motion(file, units="g", dt_s=0.02).acceleration_g.tolist() == VALUES
    for options in ({}, {"units": "g"}, {"dt_s": 0.02}):
        with pytest.raises(MotionFileError, match="give its interval and unit"):
            read_motions(file, **options)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("0.00 0.1 0.2\n0.01 0.2 0.1\n0.02 0.3 0.1\n", "3 columns without names"),
        ("0.1 -0.2 0.3\n0.1 0.2 0.3\n0.25 -0.15\n0.4 0.2 0.1\n", "line 3.*2 values, not 3"),
        ("0.1 -0.2 0.3\n0.25 -0.15 0.1\n0.1 0.2 0.3 0.4\n", "line 3.*4 values, not 3"),
        ("0.1 -0.2 0.3\n\n0.25 -0.15 0.1\n", "line 2.*missing sample"),
        ("0.1 -0.2 0.3\n0.1 0.2 0.3\n0.25 x 0.1\n", "line 3.*'x' is not a finite number"),
    ],
)
def test_rows_in_doubt_are_rejected(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(MotionFileError, match=message):
        read_motions(text_file(tmp_path, text), units="g", dt_s=0.01)


def test_number_of_samples_and_interval_below_a_title(tmp_path: Path) -> None:
    text = "my motion\n7 0.005\n" + "".join(f"{value}\n" for value in VALUES)
    motion = read_motion(text_file(tmp_path, text), units="m/s2")
    assert (motion.npts, motion.dt_s) == (7, 0.005)
    assert motion.acceleration_g * 9.80665 == pytest.approx(VALUES, rel=1e-14)
    with pytest.raises(UnitNotStatedError):
        read_motions(text_file(tmp_path, text))
    with pytest.raises(MotionFileError, match="8 samples, but 7 follow"):
        read_motions(text_file(tmp_path, text.replace("7 0.005", "8 0.005")), units="g")


def test_exponents_after_d(tmp_path: Path) -> None:
    plain = "# Time (s),Acceleration (g)\n0.00,1.0E-1\n0.01,-2.5E-02\n0.02,.3E0\n"
    numbers = read_motion(text_file(tmp_path, plain)).acceleration_g
    fortran = plain.replace("0.00,1.0E-1", "0.00D+00,1.0D-1").replace("5E-02", "5d-02")
    assert np.array_equal(read_motion(text_file(tmp_path, fortran)).acceleration_g, numbers)


def test_named_columns_have_units_of_their_own(tmp_path: Path) -> None:
    text = "Time (s);acc N10E (g);acc N100E (m/s2);Z [gal]\n0;0,1;1;98,0665\n"
    text += "0.01;.2;2;10\n0.02;.1;1;5\n"
    motions = read_motions(text_file(tmp_path, text.replace("0,1", "0.1").replace("98,", "98.")))
    assert [motion.acceleration_g[0] for motion in motions] == pytest.approx(
        [0.1, 1 / 9.80665, 0.1]
    )
    assert [motion.orientation_deg for motion in motions] == [10.0, None, None]
    assert [motion.is_vertical for motion in motions] == [False, None, True]
    no_unit = text_file(tmp_path, "time,NS,EW,UD\n0,1,2,3\n.01,2,1,0\n")
    with pytest.raises(UnitNotStatedError):
        read_motions(no_unit)
    assert len(read_motions(no_unit, units="cm/s2")) == 3


@pytest.mark.parametrize("other", ["vel (cm/s)", "temperature", "displacement_m"])
def test_columns_of_other_quantities_are_rejected(tmp_path: Path, other: str) -> None:
    text = f"time,acc (g),{other}\n0,.1,2\n.01,.2,1\n"
    with pytest.raises(MotionFileError, match=r"line 1.* is not an acceleration"):
        read_motions(text_file(tmp_path, text))


STATION = """<?xml version="1.0"?>
<FDSNStationXML xmlns="http://www.fdsn.org/xml/station/1" schemaVersion="1.1">
 <Network code="CE"><Station code="79435">
  <Channel code="HNE" locationCode="10"><Response><InstrumentSensitivity>
   <Value>{gain}</Value><InputUnits><Name>{unit}</Name></InputUnits>
  </InstrumentSensitivity></Response></Channel>
 </Station></Network>
</FDSNStationXML>
"""


def test_a_gain_of_station_xml(tmp_path: Path) -> None:
    record = written(tmp_path, miniseed(COUNTS))
    inventory = tmp_path / "CE.xml"
    inventory.write_text(STATION.format(gain=GAIN, unit="m/s**2"))
    motion = read_motion(record)
    assert motion.acceleration_g == pytest.approx(in_g(COUNTS, GAIN), rel=1e-12, abs=1e-15)
    assert any("CE.xml" in remark for remark in motion.remarks)
    assert read_motion(record, gain=2 * GAIN).pga_g == pytest.approx(motion.pga_g / 2)
    second = tmp_path / "other.xml"
    second.write_text(STATION.format(gain=2 * GAIN, unit="M/S**2"))
    with pytest.raises(MotionFileError, match=r"but .* in CE\.xml: give gain"):
        read_motion(record)
    second.unlink()
    for text in (
        STATION.format(gain=GAIN, unit="M/S"),
        STATION.format(gain=-1, unit="M/S**2"),
        STATION.format(gain=GAIN, unit="M/S**2").replace("79435", "OTHER"),
        "<!DOCTYPE x [<!ENTITY a 'b'>]>" + STATION.format(gain=GAIN, unit="M/S**2"),
        "<FDSNStationXML>",
    ):
        inventory.write_text(text)
        with pytest.raises(UnitNotStatedError, match="put that file into the same folder"):
            read_motion(record)


def test_channels_of_other_quantities_are_skipped(tmp_path: Path) -> None:
    record = written(tmp_path, miniseed(COUNTS, channel="BHZ"), miniseed(COUNTS))
    (motion,) = read_motions(record, gain=GAIN)
    assert motion.component == "HNE"
    assert motion.remarks[-1] == "channels of other quantities were skipped: BHZ"


def test_a_workbook_is_not_a_record(tmp_path: Path) -> None:
    file = tmp_path / "record.xlsx"
    with zipfile.ZipFile(file, "w") as archive:
        archive.writestr("[Content_Types].xml", "<Types/>")
        archive.writestr("xl/worksheets/sheet1.xml", "<worksheet/>")
    with pytest.raises(MotionFileError, match=r"workbook.*save the sheet as CSV"):
        read_motions(file)
