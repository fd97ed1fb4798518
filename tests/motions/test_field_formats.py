"""Records of AFAD with a preamble, of CSMNC and of the SCEC broadband platform."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from rbfrag.errors import MotionFileError, UnitNotStatedError
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.header_check import doubts
from rbfrag.motions.readers import read_motions
from rbfrag.motions.units import unit_in_g
from tests.motions import written_by_networks as written
from tests.synthetic import shaking

GAL = unit_in_g("cm/s2")
in_folder = settings(
    max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None
)
tokens = st.lists(
    st.integers(-9_999_999, 9_999_999).map(lambda n: f"{n / 1e3:.6E}"), min_size=1, max_size=40
)
TABLE = [
    [f"{100 * f * value:.6e}" for f in (1.0, 0.7, -0.3)] for value in shaking(3, 120, dt_s=0.025)
]


def read(folder: Path, text: str, **options: object) -> list[GroundMotion]:
    path = folder / "2001-ABC.acc.bbp"
    path.write_text(text)
    return read_motions(path, **options)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("file", "npts", "dt_s", "pga_g", "corrected"),
    [
        ("afad_0118_E.asc", 13501, 0.01, [0.0388148], True),
        ("chnua481414.dat", 8008, 0.005, [0.00205381], False),
        ("ua0001.dat", 12800, 0.005, [0.0173212], False),
        ("2001-SCE.acc.bbp", 4096, 0.025, [0.448886, 0.422724, 0.183115], None),
        ("2001-SCE.bbp", 8000, 0.005, [0.834387, 0.502422, 0.834387], None),
        ("58658_V2_members.zip/chan001.v2", 13000, 0.005, [0.017777], True),
    ],
)
def test_real_files(
    formats_dir: Path, file: str, npts: int, dt_s: float, pga_g: list[float], corrected: bool | None
) -> None:
    motions = read_motions(formats_dir / "records" / file)
    assert [motion.pga_g for motion in motions] == pytest.approx(pga_g, rel=1e-4)
    for motion in motions:
        assert (motion.npts, motion.dt_s, motion.is_corrected) == (npts, dt_s, corrected)


def test_components_that_are_copies_are_remarked_upon(formats_dir: Path) -> None:
    motions = read_motions(formats_dir / "records" / "2001-SCE.bbp")
    assert ["a copy" in " ".join(doubts(motion.remarks)) for motion in motions] == [
        True, False, True,
    ]  # fmt: skip
    # an offset at the beginning is no jump, and stays
    assert motions[0].acceleration_g[0] == -2.5936 * GAL
    assert not doubts(read_motions(formats_dir / "records" / "2001-SCE.acc.bbp")[0].remarks)


def test_afad_preamble(tmp_path: Path) -> None:
    text = written.esm_asc(["1.0", "-2.0", "0.5"], 0.01)
    (complete,) = read(tmp_path, text)
    (motion,) = read(tmp_path, written.AFAD_PREAMBLE + text)
    assert motion.sha256 == complete.sha256
    assert motion.file_format == "ESM ASC"
    # what stands before the header is of the archive's own filter, not the header's
    assert motion.is_corrected is complete.is_corrected is None
    assert not motion.remarks


@pytest.mark.parametrize("factor", [0.82, 1.23])
def test_afad_peaks_of_another_filter_are_a_remark(tmp_path: Path, factor: float) -> None:
    text = written.AFAD_PREAMBLE + written.esm_asc(["1.0", "-2.0", "0.5"], 0.01)
    assert "PGA_CM/S^2: -2" in text
    text = text.replace("PGA_CM/S^2: -2", f"PGA_CM/S^2: {2 * factor:g}")
    (motion,) = read(tmp_path, text.replace(f"{2 * factor:g}.0", f"{2 * factor:g}"))
    assert "the largest sample" in doubts(motion.remarks)[0]


@in_folder
@given(printed=tokens, dt_ms=st.sampled_from([5, 10, 20]), corrected=st.booleans())
def test_csmnc(tmp_path: Path, printed: list[str], dt_ms: int, corrected: bool) -> None:
    quantity = "CORRECTED ACCELERATION" if corrected else "UNCORRECTED ACCELERATION"
    (motion,) = read(tmp_path, written.csmnc(printed, dt_ms / 1000, quantity=quantity))
    assert motion.acceleration_g.tolist() == (np.array(printed, dtype=float) * GAL).tolist()
    assert (motion.dt_s, motion.is_corrected) == (dt_ms / 1000, corrected)
    assert (motion.station, motion.component, motion.orientation_deg) == ("12ABC", "EW", 90.0)
    assert motion.event == "SOMEWHERE EARTHQUAKE, SOMEWHERE,CHN 2012-01-03 15:39:57 BTM"
    assert motion.start_time is None


@pytest.mark.parametrize("quantity", ["CORRECTED VELOCITY", "CORRECTED DISPLACEMENT"])
def test_csmnc_of_another_quantity(tmp_path: Path, quantity: str) -> None:
    with pytest.raises(MotionFileError, match=f"line 11: .*{quantity.lower()}"):
        read(tmp_path, written.csmnc(["1.0", "2.0"], 0.01, quantity=quantity))


@pytest.mark.parametrize(
    ("columns", "names", "azimuths"),
    [
        ("names", ["N-S", "E-W", "U-D"], [0.0, 90.0, None]),
        ("lines", ["N", "E", "UP"], [0.0, 90.0, None]),
        ("units", ["000", "090", "UP"], [0.0, 90.0, None]),
    ],
)
@pytest.mark.parametrize(("unit", "factor"), [("cm/s/s", GAL), ("m/s^2", 100 * GAL), ("g", 1.0)])
def test_scec(
    tmp_path: Path,
    columns: str,
    names: list[str],
    azimuths: list[float | None],
    unit: str,
    factor: float,
) -> None:
    motions = read(tmp_path, written.scec_bbp(TABLE, 0.025, columns=columns, unit=unit))
    assert [motion.component for motion in motions] == names
    assert [motion.orientation_deg for motion in motions] == azimuths
    assert [motion.is_vertical for motion in motions] == [False, False, True]
    assert {motion.recording for motion in motions} == {"2001-ABC"}
    for motion, column in zip(motions, zip(*TABLE, strict=True), strict=True):
        assert motion.dt_s == 0.025
        expected = np.array(column, dtype=float) * factor
        assert motion.acceleration_g == pytest.approx(expected, rel=1e-14)


@pytest.mark.parametrize("columns", ["names", "lines", "units"])
@pytest.mark.parametrize("unit", ["cm/s", "m/s", "cm"])
def test_scec_velocities(tmp_path: Path, columns: str, unit: str) -> None:
    text = written.scec_bbp(TABLE, 0.025, columns=columns, unit=unit)
    for units in (None, "cm/s2"):
        with pytest.raises(MotionFileError, match=f"line .*hold {unit}, no acceleration"):
            read(tmp_path, text, units=units)


def test_scec_velocity_in_words(tmp_path: Path) -> None:
    text = written.scec_bbp(TABLE, 0.025, columns="units").replace("acceleration", "velocity")
    with pytest.raises(MotionFileError, match="hold velocity, no acceleration"):
        read(tmp_path, text)


def test_scec_without_a_unit(tmp_path: Path) -> None:
    text = written.scec_bbp(TABLE, 0.025, columns="none")
    with pytest.raises(UnitNotStatedError):
        read(tmp_path, text)
    motions = read(tmp_path, text, units="cm/s2")
    assert [motion.component for motion in motions] == ["N-S", "E-W", "U-D"]
    assert motions[0].station == "abcd"


def test_scec_columns_of_two_units(tmp_path: Path) -> None:
    text = written.scec_bbp(TABLE, 0.025).replace("E-W(cm/s/s)", "E-W(m/s/s)")
    with pytest.raises(MotionFileError, match="m/s/s, another in cm/s/s"):
        read(tmp_path, text)


def test_scec_missing_row(tmp_path: Path) -> None:
    lines = written.scec_bbp(TABLE, 0.025).splitlines(keepends=True)
    with pytest.raises(MotionFileError, match=r"step of 0\.05 s"):
        read(tmp_path, "".join(lines[:50] + lines[51:]))
    with pytest.raises(MotionFileError, match="3 values, not 4"):
        read(tmp_path, "".join(lines).rsplit("\t", 1)[0] + "\n")


def test_v3_holds_spectra(tmp_path: Path, formats_dir: Path) -> None:
    (tmp_path / "made.v3").write_text(
        "RESPONSE AND FOURIER AMPLITUDE SPECTRA  (91 PERIODS)\nCORRECTED ACCELEROGRAM  X-1\n"
    )
    for path in (formats_dir / "records" / "chan001.v3", tmp_path / "made.v3"):
        with pytest.raises(MotionFileError, match=r"with spectra: use the \.v2"):
            read_motions(path)


def test_a_csmip_channel_with_its_location(tmp_path: Path) -> None:
    text = written.csmip_v2([("Up", ["1.0"] * 12)], 0.01)
    assert "Chan  1: Up            " in text
    (motion,) = read(tmp_path, text.replace("Chan  1: Up     ", "Chan  1: Up      Location: Pier "))
    assert (motion.component, motion.is_vertical) == ("Up", True)
    assert "location by the header: Pier" in motion.remarks[-1]
