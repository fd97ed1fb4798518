"""Files in a network's format are read back to the printed digit, with their names."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from rbfrag.errors import MotionFileError
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.readers import READERS, read_motion, read_motions
from rbfrag.motions.units import unit_in_g
from tests.motions import written_by_networks as written
from tests.synthetic import shaking

in_folder = settings(
    max_examples=40,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)

GAL = unit_in_g("cm/s2")

milliseconds = st.integers(1, 50)
rates_hz = st.sampled_from([50, 100, 125, 200, 250, 500])


def tokens(decimals: int, digits: int) -> st.SearchStrategy[list[str]]:
    """Printed numbers of so many digits in all, negative ones included."""
    largest = 10**digits - 1
    return st.lists(
        st.integers(-largest, largest).map(lambda n: f"{n / 10**decimals:.{decimals}f}"),
        min_size=1,
        max_size=45,
    )


def tables(columns: int) -> st.SearchStrategy[list[list[str]]]:
    """Printed rows as wide as their fields: the columns touch."""
    value = st.integers(-9_999_999, 9_999_999).map(lambda n: f"{n / 1000:.3f}")
    return st.lists(st.lists(value, min_size=columns, max_size=columns), min_size=1, max_size=30)


def read(folder: Path, text: str, **options: object) -> list[GroundMotion]:
    path = folder / "record"
    path.write_text(text, encoding="latin-1", errors="replace")
    motions = read_motions(path, **options)  # type: ignore[arg-type]
    assert [motion.trace_index for motion in motions] == list(range(len(motions)))
    assert len({motion.recording for motion in motions}) == 1
    assert motions[0].recording
    return motions


def assert_samples(motion: GroundMotion, printed: list[str], factor: float) -> None:
    assert motion.acceleration_g.tolist() == (np.array(printed, dtype=float) * factor).tolist()


channel_lists = st.lists(
    st.tuples(
        st.sampled_from([" 90 Deg", "360 Deg", "Up", "H1"]),
        # as wide as a field, so that neighbours touch: -99999.999
        tokens(decimals=3, digits=8),
    ),
    min_size=1,
    max_size=3,
)


@in_folder
@given(channels=channel_lists, dt_ms=milliseconds, old=st.booleans())
def test_csmip_v2(
    tmp_path: Path, channels: list[tuple[str, list[str]]], dt_ms: int, old: bool
) -> None:
    motions = read(tmp_path, written.csmip_v2(channels, dt_ms / 1000, old=old))
    assert len(motions) == len(channels)
    for motion, (name, printed) in zip(motions, channels, strict=True):
        assert_samples(motion, printed, GAL)
        assert motion.dt_s == dt_ms / 1000
        assert motion.component == (name.upper() if old else name).strip()
        assert motion.is_vertical is (name == "Up")
        assert motion.orientation_deg == {" 90 Deg": 90.0, "360 Deg": 0.0}.get(name)
        assert len(motion.remarks) == (len(channels) < 3)
        assert motion.station.upper() == "58667 SOMEWHERE - CLAYTON & ELLIS"
        assert motion.event.upper() == "SOMEWHERE EARTHQUAKE MAY 2, 1983 16:42 PDT"


@in_folder
@given(
    printed=tokens(decimals=4, digits=8),
    dt_ms=milliseconds,
    layout=st.sampled_from([(1, 15), (8, 10), (5, 12)]),
    channel=st.sampled_from([("HNE", " 90 Deg", False), ("HNZ", "Up      ", True)]),
)
def test_cosmos(
    tmp_path: Path,
    printed: list[str],
    dt_ms: int,
    layout: tuple[int, int],
    channel: tuple[str, str, bool],
) -> None:
    name, direction, vertical = channel
    text = written.cosmos(printed, dt_ms / 1000, channel=name, direction=direction, layout=layout)
    (motion,) = read(tmp_path, text)
    assert_samples(motion, printed, GAL)
    assert motion.dt_s == dt_ms / 1000
    assert (motion.station, motion.component) == ("CI-ABCD", name)
    assert motion.is_vertical is vertical
    assert motion.orientation_deg == (None if vertical else 90.0)
    assert motion.recording == "NN.00725272.CI.ABCD"
    assert motion.event.startswith("Somewhere, NV Earthquake")


def test_cosmos_passes_over_velocities(tmp_path: Path) -> None:
    velocity = written.cosmos(["1.0"] * 4, 0.01, quantity="velocity", unit="cm/sec(05)")
    acceleration = written.cosmos(["2.0"] * 3, 0.01)
    (motion,) = read(tmp_path, velocity + acceleration)
    assert motion.npts == 3


@in_folder
@given(
    channels=st.lists(
        st.tuples(st.sampled_from(["EW", "NS", "V", "L", "T"]), tokens(decimals=3, digits=5)),
        min_size=1,
        max_size=3,
    ).filter(lambda channels: all(any(map(float, printed)) for _, printed in channels)),
    dt_ms=st.sampled_from([5, 10, 20]),
)
def test_cdmg_v1(tmp_path: Path, channels: list[tuple[str, list[str]]], dt_ms: int) -> None:
    motions = read(tmp_path, written.cdmg_v1(channels, dt_ms / 1000))
    assert len(motions) == len(channels)
    for motion, (name, printed) in zip(motions, channels, strict=True):
        assert_samples(motion, printed, 0.1)
        assert motion.dt_s == dt_ms / 1000
        assert motion.component == name
        assert motion.is_vertical is (name == "V")
        assert motion.orientation_deg == {"EW": 90.0, "NS": 0.0}.get(name)
        missing = "the header says 3 channels, but the file holds"
        assert all(remark.startswith(missing) for remark in motion.remarks)
        assert len(motion.remarks) == (len(channels) < 3)


@pytest.mark.parametrize("series", written.SERIES_LINES)
@pytest.mark.parametrize("unit", written.UNIT_LINES)
@pytest.mark.parametrize("last", [0, 1])
def test_csmip_v1_accelerations_alone(tmp_path: Path, series: str, unit: str, last: int) -> None:
    tokens = [f"{value:.6f}".replace("0.", ".", 1) for value in shaking(7, 100)]
    channels = [("360 Deg", tokens), ("Up", tokens[::-1])]
    text = written.csmip_v1(channels, 0.005, unit=unit, series=series, last=last)
    first, second = read(tmp_path, text)
    assert first.acceleration_g.tolist() == [float(token) for token in tokens]
    assert second.acceleration_g.tolist() == first.acceleration_g.tolist()[::-1]
    assert first.dt_s == 0.005
    assert (first.orientation_deg, second.is_vertical) == (0.0, True)
    assert first.is_corrected is False
    assert first.recording == second.recording


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("data are sec and g.", "data are sec and g/10.", "in g by this line, but in g/10"),
        ("  100 Acc", "   99 Acc", "99 points follow by this line, but 100"),
        ("at 200 pts/sec in", "at 100 pts/sec in", "last 1 s, but the header says 0.500"),
        ("at 200 pts/sec in", "at   0 pts/sec in", "must be positive"),
    ],
)
def test_csmip_v1_that_contradicts_itself(tmp_path: Path, old: str, new: str, words: str) -> None:
    text = written.csmip_v1([("360 Deg", ["  .000001"] * 100)], 0.005)
    assert old in text
    with pytest.raises(MotionFileError, match=words):
        read(tmp_path, text.replace(old, new))


def test_csmip_v1_without_a_unit(tmp_path: Path) -> None:
    text = written.csmip_v1([("360 Deg", ["  .000001"] * 100)], 0.005, unit="")
    with pytest.raises(MotionFileError, match="no unit of acceleration"):
        read(tmp_path, text.replace("in units of g", ""))


def test_cdmg_v1_channel_of_zeros(tmp_path: Path) -> None:
    channels = [("NS", ["0.1"] * 7), ("INTC", ["0.000"] * 7), ("V", ["0.2"] * 7)]
    # the channel of zeros is one of the three that the header announces
    motions = read(tmp_path, written.cdmg_v1(channels, 0.01))
    assert [motion.component for motion in motions] == ["NS", "V"]
    for motion in motions:
        assert motion.remarks == ("the channel INTC holds zeros only and is left out",)


@in_folder
@given(
    channels=st.lists(
        st.tuples(st.sampled_from(["L1", "V2", "T3"]), tokens(decimals=8, digits=11)),
        min_size=1,
        max_size=3,
    ),
    dt_ms=milliseconds,
)
def test_bhrc_v1(tmp_path: Path, channels: list[tuple[str, list[str]]], dt_ms: int) -> None:
    motions = read(tmp_path, written.bhrc_v1(channels, dt_ms / 1000))
    assert len(motions) == len(channels)
    for motion, (name, printed) in zip(motions, channels, strict=True):
        assert_samples(motion, printed, 0.1)
        assert motion.dt_s == dt_ms / 1000
        assert (motion.station, motion.component) == ("Abcd", name)
        assert motion.is_vertical is (name == "V2")
        assert motion.orientation_deg == {"L1": 352.0, "T3": 82.0}.get(name)


@in_folder
@given(
    counts=st.lists(st.integers(-8_388_608, 8_388_607), min_size=1, max_size=40),
    rate=rates_hz,
    direction=st.sampled_from(["E-W", "N-S", "U-D", "1", "2", "3", "4", "5", "6"]),
)
def test_knet(tmp_path: Path, counts: list[int], rate: int, direction: str) -> None:
    text = written.knet(counts, rate, direction=direction, duration=repr(len(counts) / rate))
    (motion,) = read(tmp_path, text)
    gal = (np.array(counts) - np.mean(counts)) * 7845 / 8223790
    assert motion.acceleration_g == pytest.approx(gal * GAL, rel=1e-12, abs=1e-12)
    assert motion.dt_s == 1 / rate
    assert motion.is_vertical is (direction in {"U-D", "3", "6"})
    assert motion.orientation_deg == {
        "E-W": 90.0, "2": 90.0, "5": 90.0, "N-S": 0.0, "1": 0.0, "4": 0.0,
    }.get(direction)  # fmt: skip
    assert "mean" in motion.remarks[0]
    assert any("borehole" in remark for remark in motion.remarks) is (direction in {"1", "2", "3"})


def test_knet_levels_are_recordings_apart(tmp_path: Path) -> None:
    (borehole,) = read(tmp_path, written.knet([1, 2], 100, direction="1"))
    (surface,) = read(tmp_path, written.knet([1, 2], 100, direction="4"))
    assert borehole.component == "NS1"
    assert surface.component == "NS2"
    assert borehole.recording != surface.recording


@in_folder
@given(
    printed=tokens(decimals=6, digits=9),
    dt_ms=milliseconds,
    stream=st.sampled_from(["HNE", "HNN", "HNZ"]),
    unit=st.sampled_from(["cm/s^2", "m/s^2"]),
)
def test_esm_asc(tmp_path: Path, printed: list[str], dt_ms: int, stream: str, unit: str) -> None:
    (motion,) = read(tmp_path, written.esm_asc(printed, dt_ms / 1000, stream=stream, unit=unit))
    assert_samples(motion, printed, unit_in_g(unit))
    assert motion.dt_s == dt_ms / 1000
    assert (motion.station, motion.component) == ("TK.0131", stream)
    assert motion.is_vertical is (stream == "HNZ")


@in_folder
@given(table=tables(3), rate=rates_hz, names=st.permutations("UNE"))
def test_cwb(tmp_path: Path, table: list[list[str]], rate: int, names: list[str]) -> None:
    motions = read(tmp_path, written.cwb(table, rate, names="".join(names)))
    assert [motion.component for motion in motions] == names
    for index, motion in enumerate(motions):
        assert_samples(motion, [row[index] for row in table], GAL)
        assert motion.dt_s == 1 / rate
        assert motion.is_vertical is (motion.component == "U")


@in_folder
@given(table=tables(3), dt_ms=milliseconds, names=st.permutations(["V", "N00E", "N90E"]))
def test_unam(tmp_path: Path, table: list[list[str]], dt_ms: int, names: list[str]) -> None:
    motions = read(tmp_path, written.unam(table, dt_ms / 1000, names=names))
    assert [motion.component for motion in motions] == names
    azimuths = {"N00E": 0.0, "N90E": 90.0}
    for index, motion in enumerate(motions):
        assert_samples(motion, [row[index] for row in table], GAL)
        assert motion.dt_s == dt_ms / 1000
        assert motion.is_vertical is (motion.component == "V")
        assert motion.orientation_deg == azimuths.get(motion.component)


@in_folder
@given(table=tables(3), dt_ms=milliseconds)
def test_nsmn(tmp_path: Path, table: list[list[str]], dt_ms: int) -> None:
    motions = read(tmp_path, written.nsmn(table, dt_ms / 1000))
    assert [motion.component for motion in motions] == ["N-S", "E-W", "U-D"]
    assert [motion.is_vertical for motion in motions] == [False, False, True]
    for index, motion in enumerate(motions):
        assert_samples(motion, [row[index] for row in table], GAL)
        assert motion.dt_s == dt_ms / 1000


@in_folder
@given(
    samples=st.lists(
        st.tuples(st.integers(-99_999, 99_999), st.integers(-9, 9)), min_size=1, max_size=45
    ),
    rate=rates_hz,
    component=st.sampled_from(["    360", "   up", "43"]),
)
def test_usgs_smc(
    tmp_path: Path, samples: list[tuple[int, int]], rate: int, component: str
) -> None:
    # ten characters with the one-digit exponent: -1.9234E+0
    printed = [f"{mantissa / 10_000:.4f}E{power:+d}" for mantissa, power in samples]
    (motion,) = read(tmp_path, written.usgs_smc(printed, rate, component=component))
    assert_samples(motion, printed, GAL)
    assert motion.dt_s == 1 / rate
    assert motion.component == component.strip()
    assert motion.station == "San Somewhere, 1295 Street, F"
    assert motion.is_vertical is (motion.component == "up")


@in_folder
@given(
    values=st.lists(st.floats(-3.0, 3.0), min_size=1, max_size=30),
    dt_s=st.floats(1e-4, 0.1),
    dof=st.sampled_from([1, 2, 3]),
)
def test_simcenter_event(tmp_path: Path, values: list[float], dt_s: float, dof: int) -> None:
    text = written.simcenter_event(values, dt_s, dof=dof)
    (motion,) = read(tmp_path, text, units="g")
    assert motion.acceleration_g.tolist() == values
    assert motion.dt_s == dt_s
    assert motion.is_vertical is {1: False, 2: None, 3: True}[dof]
    assert (motion.event, motion.component) == ("Somewhere-Station", "accel_X")


@in_folder
@given(
    values=st.lists(st.floats(-3.0, 3.0), min_size=1, max_size=30),
    dt_ms=milliseconds,
    component=st.sampled_from(["000", "090", "ver"]),
    unit=st.sampled_from(["g", "cm/s2"]),
)
def test_ucgmsim_text(
    tmp_path: Path, values: list[float], dt_ms: int, component: str, unit: str
) -> None:
    printed = [f"{value:.5e}" for value in values]
    text = written.ucgmsim_text(printed, dt_ms / 1000, component=component)
    (motion,) = read(tmp_path, text, units=unit)
    assert_samples(motion, printed, unit_in_g(unit))
    assert motion.dt_s == dt_ms / 1000
    assert (motion.station, motion.component) == ("ABCD", component)
    assert motion.is_vertical is (component == "ver")


CHANNELS = [("EW", ["0.1"] * 12), ("V", ["-0.2"] * 12)]
TABLE = [["0.1", "0.2", "-0.3"]] * 12
WRITTEN: dict[str, Callable[[], str]] = {
    "CSMIP/CDMG V2": lambda: written.csmip_v2(CHANNELS, 0.01),
    "COSMOS V1c/V2c": lambda: written.cosmos(["1.0"] * 12, 0.01),
    "CDMG V1": lambda: written.cdmg_v1(CHANNELS, 0.01),
    "BHRC V1": lambda: written.bhrc_v1([("L1", ["0.1"] * 12)], 0.01),
    "K-NET/KiK-net ASCII": lambda: written.knet(list(range(12)), 100),
    "K-NET CSV": lambda: written.knet_csv(TABLE, 100),
    "ESM ASC": lambda: written.esm_asc(["1.0"] * 12, 0.01),
    "CSMNC text": lambda: written.csmnc(["1.0"] * 12, 0.01),
    "CWB dat": lambda: written.cwb(TABLE, 100),
    "UNAM standard file": lambda: written.unam(TABLE, 0.01, names=["V", "N00E", "N90E"]),
    "AFAD NSMN text": lambda: written.nsmn(TABLE, 0.01),
    "USGS SMC": lambda: written.usgs_smc(["1.0000E+0"] * 12, 100),
    "SimCenter event JSON": lambda: written.simcenter_event([0.1] * 12, 0.01),
    "GeoNet text (.000/.090/.ver)": lambda: written.ucgmsim_text(["1.0"] * 12, 0.01),
}
STATE_NO_UNIT = {"SimCenter event JSON", "GeoNet text (.000/.090/.ver)"}


def test_every_reader_has_a_writer() -> None:
    elsewhere = {"PEER AT2", "GeoNet V2A", "delimited text", "rbfrag CSV"}
    # which state no number of samples, or are no text
    elsewhere |= {"SCEC broadband platform", "miniSEED"}
    assert {reader.FORMAT for reader in READERS} == set(WRITTEN) | elsewhere


@pytest.mark.parametrize("name", WRITTEN)
@pytest.mark.parametrize("newline", ["\n", "\r\n"])
def test_content_decides_and_newlines_do_not_matter(
    tmp_path: Path, name: str, newline: str
) -> None:
    path = tmp_path / "record.AT2"
    path.write_bytes(WRITTEN[name]().replace("\n", newline).encode())
    units = "g" if name in STATE_NO_UNIT else None
    motions = read_motions(path, units=units)
    assert {motion.file_format for motion in motions} == {name}
    assert read_motion(f"{path}#0", units=units).sha256 == motions[0].sha256
