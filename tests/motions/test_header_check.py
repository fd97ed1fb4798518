"""A header agrees with its samples, or the file is rejected with both numbers."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from rbfrag.campaign.add_motions import add_motions
from rbfrag.errors import MotionFileError
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.header_check import doubts
from rbfrag.motions.polarity import FloatArray
from rbfrag.motions.readers import read_motions
from tests.motions import written_by_networks as written
from tests.motions.written import v2a
from tests.motions.written_by_networks import Channels
from tests.synthetic import shaking

NPTS = 400
# as small as the narrowest fields ask for
SHAKING = 5.0 * shaking(5, NPTS) / np.abs(shaking(5, NPTS)).max()


def three(values: FloatArray) -> list[str]:
    return [f"{value:.3f}" for value in values]


def six(values: FloatArray) -> list[str]:
    return [f"{value:.6f}" for value in 0.1 * values]


def table(values: FloatArray) -> list[list[str]]:
    return [three(np.array(row)) for row in zip(values, 0.5 * values, -0.2 * values, strict=True)]


def different_channels(
    names: list[str], write: Callable[[FloatArray], list[str]], values: FloatArray
) -> Channels:
    """Channels that differ: equal ones would be remarked upon."""
    return [
        (name, write(values * factor)) for name, factor in zip(names, (1.0, 0.9, 0.8), strict=False)
    ]


MAKE: dict[str, Callable[[FloatArray, float], str]] = {
    "GeoNet V2A": lambda values, dt: v2a(
        different_channels(["N28W", "N62E", "UP"], three, values), dt
    ),
    "CSMIP/CDMG V2": lambda values, dt: written.csmip_v2(
        different_channels(["H1", "H2", "Up"], three, values), dt
    ),
    "COSMOS V1c/V2c": lambda values, dt: written.cosmos(three(values), dt),
    "CDMG V1 series": lambda values, dt: written.csmip_v1(
        different_channels(["360 Deg", "Up", "90 Deg"], six, values), dt
    ),
    "CDMG V1": lambda values, dt: written.cdmg_v1(
        different_channels(["EW", "NS", "V"], three, values), dt
    ),
    "BHRC V1": lambda values, dt: written.bhrc_v1(
        different_channels(["L1", "V2", "T3"], six, values), dt
    ),
    "K-NET/KiK-net ASCII": lambda values, dt: written.knet(
        [int(1e4 * value) for value in values], round(1.0 / dt)
    ),
    "ESM ASC": lambda values, dt: written.esm_asc(three(values), dt),
    "CSMNC text": lambda values, dt: written.csmnc(three(values), dt),
    "SCEC broadband platform": lambda values, dt: written.scec_bbp(table(values), dt),
    "CWB dat": lambda values, dt: written.cwb(table(values), round(1.0 / dt)),
    "UNAM standard file": lambda values, dt: written.unam(
        table(values), dt, names=["V", "N00E", "N90E"]
    ),
    "AFAD NSMN text": lambda values, dt: written.nsmn(table(values), dt),
    "USGS SMC": lambda values, dt: written.usgs_smc([f"{v:.4f}E+0" for v in values], 1.0 / dt),
}


def file_text(name: str) -> str:
    return MAKE[name](SHAKING, 0.02)


MISTAKES: dict[str, list[tuple[str, str, str]]] = {
    "GeoNet V2A": [
        ("dt", r"data at (\S+) sec", "x10"),
        ("duration", r"Duration (\S+) sec", "x2"),
        ("peak", r"Acceleration:\s+peak\s+(\S+)", "x2"),
    ],
    "CSMIP/CDMG V2": [
        ("dt", r"accel data equally spaced at\s+(\S+) sec", "x10"),
        ("duration", r"Record length =\s*(\S+) sec", "x0.5"),
        ("unit", r"sec, in (cm/sec2)", "m/sec2"),
        ("peak", r"Peak acceleration = (\S+)", "x0.5"),
    ],
    "COSMOS V1c/V2c": [
        ("dt", r" (20\.000000) ", "x10"),
        ("duration", r"approx\s+(\S+) secs", "x2"),
        ("unit", r"units=(cm/sec2)", "m/sec2"),
        ("peak", r"Max = (\S+)", "x10"),
    ],
    "CDMG V1 series": [
        ("dt", r"points at\s+(\d+) pts/sec", "x10"),
        ("duration", r"Record Length =\s*(\S+) sec", "x2"),
        ("peak", r"Max  = (\S+)", "x2"),
    ],
    "CDMG V1": [
        ("duration", r"RECORD LENGTH =\s*(\S+) SEC", "x10"),
        ("unit", r"AND (G/10)", "G"),
        ("peak", r"MAX  = (\S+)", "x2"),
    ],
    "BHRC V1": [("duration", r"DURATION =\s*(\S+)", "x10")],
    "K-NET/KiK-net ASCII": [
        ("dt", r"Freq\(Hz\)\s+(\d+)Hz", "x10"),
        ("duration", r"Duration Time\(s\)\s+(\S+)", "x2"),
        ("scale", r"Scale Factor\s+(\d+)\(", "x10"),
        ("peak", r"Max\. Acc\. \(gal\)\s+(\S+)", "x2"),
    ],
    "ESM ASC": [
        ("dt", r"SAMPLING_INTERVAL_S: (\S+)", "x10"),
        ("duration", r"\nDURATION_S: (\S+)", "x2"),
        ("unit", r"UNITS: (\S+)", "m/s^2"),
        ("peak", r"PGA_CM/S\^2: (\S+)", "x2"),
    ],
    "CSMNC text": [
        ("dt", r"INTERVALS OF:\s+(\S+)", "x10"),
        ("duration", r"DURATION:\s+(\S+)", "x2"),
        ("peak", r"PEAK VALUE:\s+(\S+)", "x2"),
    ],
    "CWB dat": [
        ("dt", r"SampleRate\(Hz\): (\d+)", "x10"),
        ("duration", r"RecordLength\(sec\): (\S+)", "x2"),
        ("unit", r"AmplitudeUnit:\s+(gal)", "g"),
        ("peak", r"AmplitudeMAX. U: ([-.\d]+)", "x2"),
    ],
    "UNAM standard file": [
        ("dt", r"INTERVALO DE MUESTREO, C1-C6 \(s\)       : (\S+)", "/0.2/0.2/0.2"),
        ("duration", r"C1-C6       : (/8\.000\S+)", "/4/4/4"),
        ("unit", r": (Gal \(cm/s/s\))", "g"),
        ("peak", r"ACEL. MAX.\(Gal\), C1-C6\s+: /([-.\d]+)", "x2"),
    ],
    "AFAD NSMN text": [("peak", r"\(E-W\) (\S+)", "x2")],
    "USGS SMC": [("peak", r"pk     = (\S+)", "x2")],
}
CASES = [(name, *mistake) for name, mistakes in MISTAKES.items() for mistake in mistakes]


def changed(text: str, pattern: str, new: str) -> str:
    """Return a text with the first group of a pattern changed, columns as wide as before."""
    match = re.search(pattern, text)
    assert match, pattern
    old, after = match[1], new
    if factor := re.fullmatch(r"x([\d.]+)", new):
        digits = len(old.partition(".")[2])
        after = f"{float(factor[1]) * float(old):.{digits}f}"
    start, end = match.span(1)
    if re.fullmatch(r"[-.\d\s]+", text[text.rfind("\n", 0, start) : start]):
        # numbers in columns grow to the left, into the blanks before them
        start -= max(0, len(after) - len(old))
    return text[:start] + after + text[end:]


def read(folder: Path, text: str, **options: object) -> list[GroundMotion]:
    path = folder / "record"
    path.write_text(text)
    return read_motions(path, **options)  # type: ignore[arg-type]


@pytest.mark.parametrize("name", MAKE)
def test_an_honest_file_says_nothing(tmp_path: Path, name: str) -> None:
    for motion in read(tmp_path, file_text(name)):
        assert motion.npts == NPTS
        assert motion.dt_s == pytest.approx(0.02)
        assert not doubts(motion.remarks)


@pytest.mark.parametrize(("name", "subject", "pattern", "new"), CASES)
def test_a_mistake_is_rejected(
    tmp_path: Path, name: str, subject: str, pattern: str, new: str
) -> None:
    text = changed(file_text(name), pattern, new)
    with pytest.raises(MotionFileError) as caught:
        read(tmp_path, text)
    option = "dt_s" if subject in {"dt", "duration"} else "units"
    assert len(re.findall(r"\d[\d.]*", caught.value.reason)) >= 2
    # a column of times that contradicts its header needs no duration to tell
    assert option in caught.value.fields or "time " in caught.value.reason


@pytest.mark.parametrize(
    ("name", "subject", "pattern", "new"), [case for case in CASES if case[1] in {"dt", "duration"}]
)
def test_a_stated_interval_overrides(
    tmp_path: Path, name: str, subject: str, pattern: str, new: str
) -> None:
    text = changed(file_text(name), pattern, new)
    unchanged = read(tmp_path, file_text(name))
    if name in {"K-NET/KiK-net ASCII", "CWB dat"} and subject == "duration":
        # the duration is the count of samples: dt cannot mend it
        with pytest.raises(MotionFileError, match="samples, but 400 follow"):
            read(tmp_path, text, dt_s=0.02)
        return
    motions = read(tmp_path, text, dt_s=0.02)
    assert [motion.sha256 for motion in motions] == [motion.sha256 for motion in unchanged]
    assert all(motion.dt_s == pytest.approx(0.02) for motion in motions)
    assert doubts(motions[0].remarks)
    with pytest.raises(MotionFileError, match="omit dt_s"):
        read(tmp_path, text, dt_s=0.03)


@pytest.mark.parametrize(
    ("name", "unit"),
    [("CSMIP/CDMG V2", "cm/s2"), ("COSMOS V1c/V2c", "cm/s2"), ("CDMG V1", None),
     ("ESM ASC", "cm/s2"), ("CWB dat", "cm/s2"), ("UNAM standard file", "cm/s2")],
)  # fmt: skip
def test_a_stated_unit_overrides(tmp_path: Path, name: str, unit: str | None) -> None:
    (pattern, new) = next(case[2:] for case in CASES if case[:2] == (name, "unit"))
    text = changed(file_text(name), pattern, new)
    if unit is None:
        # no option names a tenth of g: only the header can be corrected
        with pytest.raises(MotionFileError, match="correct the header"):
            read(tmp_path, text)
        return
    motions = read(tmp_path, file_text(name))
    motion = read(tmp_path, text, units=unit)[0]
    assert motion.sha256 == motions[0].sha256
    assert "is what was stated" in doubts(motion.remarks)[0]
    assert motion.stated_unit == unit
    with pytest.raises(MotionFileError, match="omit units"):
        read(tmp_path, text, units="mm/s2")


def test_what_is_stated_as_the_header_has_it_is_kept(tmp_path: Path) -> None:
    file = tmp_path / "record.asc"
    text = changed(file_text("ESM ASC"), r"PGA_CM/S\^2: (\S+)", "x3")
    file.write_text(changed(text, r"\nDURATION_S: (\S+)", "x2"))
    report = add_motions(file, db=tmp_path / "one.db", units="cm/s2", dt_s=0.02)
    assert len(report.added) == 1
    assert [word in " ".join(report.warnings) for word in ("largest", "last 8 s")] == [True, True]


def test_an_interval_of_one_component(tmp_path: Path) -> None:
    # neither duration nor times say it, only the other components
    text = file_text("GeoNet V2A").replace("Duration", "Lasting")
    text = changed(text, r"data at (\S+) sec", "x2")
    with pytest.raises(MotionFileError, match=r"N28W has dt = 0.04 s, but N62E 0.02 s"):
        read(tmp_path, text)
    motions = read(tmp_path, text, dt_s=0.02)
    assert {motion.dt_s for motion in motions} == {0.02}


@pytest.mark.parametrize(
    ("text", "held"),
    [
        (v2a([("N28W", three(SHAKING)), ("UP", three(SHAKING))], 0.02), "2 of the 3"),
        (written.bhrc_v1([("L1", six(SHAKING))], 0.02), "1 of the 3"),
        (written.cwb([row[:2] for row in table(SHAKING)], 50, names="UN"), "2 of the 3"),
    ],
)
def test_a_missing_component_is_told(tmp_path: Path, text: str, held: str) -> None:
    for motion in read(tmp_path, text):
        assert held in doubts(motion.remarks)[0]


@pytest.mark.parametrize(("factor", "is_noted"), [(1.02, False), (0.8, True), (1.7, True)])
def test_a_peak_that_is_a_little_off(tmp_path: Path, factor: float, is_noted: bool) -> None:
    text = changed(file_text("ESM ASC"), r"PGA_CM/S\^2: (\S+)", f"x{factor}")
    (motion,) = read(tmp_path, text)
    assert bool(doubts(motion.remarks)) is is_noted


@pytest.mark.parametrize(("factor", "is_noted"), [(0.995, False), (1.03, True)])
def test_a_duration_that_is_a_little_off(tmp_path: Path, factor: float, is_noted: bool) -> None:
    text = changed(file_text("GeoNet V2A"), r"Duration (\S+) sec", f"x{factor}")
    assert bool(doubts(read(tmp_path, text)[0].remarks)) is is_noted


def test_the_peak_before_correction_does_not_count(tmp_path: Path) -> None:
    text = file_text("CSMIP/CDMG V2")
    assert "Uncor Max" in text
    text = changed(text, r"Uncor Max  =\s+(\S+) g", "x10")
    assert not doubts(read(tmp_path, text)[0].remarks)


def test_a_peak_that_nobody_filled_in(tmp_path: Path) -> None:
    for new in ("", "0.000", "-999.00", "None"):
        text = re.sub(r"(PGA_CM/S\^2:) \S+", rf"\1 {new}", file_text("ESM ASC"))
        assert not doubts(read(tmp_path, text)[0].remarks)


def test_adding_says_it(tmp_path: Path) -> None:
    file = tmp_path / "record.asc"
    file.write_text(changed(file_text("ESM ASC"), r"PGA_CM/S\^2: (\S+)", "x1.3"))
    report = add_motions(file, db=tmp_path / "one.db")
    assert "the largest sample" in report.warnings[0]
    file.write_text(changed(file_text("ESM ASC"), r"UNITS: (\S+)", "m/s^2"))
    assert "units" in add_motions(file, db=tmp_path / "two.db").failed[0].reason
    report = add_motions(file, db=tmp_path / "two.db", units="cm/s2")
    assert len(report.added) == 1
    assert "cm/s2 is what was stated" in report.warnings[0]


@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    name=st.sampled_from(sorted(MAKE)),
    scale=st.floats(0.1, 1.9),
    npts=st.integers(30, 300),
    dt_ms=st.sampled_from([1, 2, 5, 8, 10, 20, 40]),
)
def test_rewritten_honest_files_pass(
    tmp_path: Path, name: str, scale: float, npts: int, dt_ms: int
) -> None:
    for motion in read(tmp_path, MAKE[name](scale * SHAKING[:npts], dt_ms / 1000)):
        assert motion.npts == npts
        assert not doubts(motion.remarks)
