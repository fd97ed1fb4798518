"""Every real record in a supported format reads as its manifest says."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest

from rbfrag.errors import MotionFileError, UnknownFormatError
from rbfrag.motions.formats import delimited_text
from rbfrag.motions.metadata import read_metadata
from rbfrag.motions.readers import HEAD_CHARACTERS, READERS, read_motion, read_motions
from rbfrag.motions.text import read_text

COUNTS = {
    "peer_at2_opensees": 52,
    "nga_at2_misc": 22,
    "slammer_csv": 13,
    "geonet_v2a": 9,
    "geer_chihshang_2022_acc": 57,
    "fema_p695_far_field": 32,
    "geonet_ucgmsim_text": 9,
    "csmip_v2": 15,
    "cosmos_v1c_v2c": 9,
    "knet_ascii": 21,
    "kiknet_ascii": 3,
    "renadic_v1": 36,
    "bhrc_v1": 9,
    "cwb_dat": 36,
    "esm_asc": 3,
    "unam_smis": 6,
    "nsmn_txt": 3,
    "usgs_smc": 6,
}
"""Traces by set."""

STATES_NO_UNIT = {"geer_chihshang_2022_acc", "fema_p695_far_field", "geonet_ucgmsim_text"}
NAMES_NO_COMPONENT = {"geer_chihshang_2022_acc", "fema_p695_far_field"}


def manifest(records_dir: Path) -> list[dict[str, str]]:
    with (records_dir / "MANIFEST.csv").open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


@pytest.mark.parametrize("name", COUNTS)
def test_npts_dt_and_pga(records_dir: Path, name: str) -> None:
    rows = [row for row in manifest(records_dir) if row["set"] == name]
    assert len(rows) == COUNTS[name]
    for row in rows:
        units = row["file_units"] if name in STATES_NO_UNIT else None
        path = records_dir / row["file"]
        motions = read_motions(path, units=units)
        assert len(motions) == sum(other["file"] == row["file"] for other in rows)
        motion = motions[int(row["trace_index"])]
        assert motion.trace_index == int(row["trace_index"])
        assert motion.source_file == path.name
        assert motion.npts == int(row["npts"]), path
        assert motion.dt_s == float(row["dt_s"]), path
        assert f"{motion.pga_g:.5f}" == f"{float(row['pga_g']):.5f}", path
        if name in NAMES_NO_COMPONENT:
            assert motion.is_vertical is None
        else:
            assert motion.is_vertical is (row["is_vertical"] == "1"), path


@pytest.mark.parametrize(
    ("name", "event", "station", "component", "orientation_deg"),
    [
        ("Chi-Chi_1999_TCU068-090", "Chi-Chi, Taiwan 1999", "TCU068", "090", 90.0),
        ("Coyote_Lake_1979_G02-050", "Coyote Lake 1979", "G02", "050", 50.0),
        ("Northridge_1994_VSP-360", "Northridge 1994", "VSP", "360", 0.0),
    ],
)
def test_title_of_sample_files(
    records_dir: Path,
    name: str,
    event: str,
    station: str,
    component: str,
    orientation_deg: float,
) -> None:
    (motion,) = read_motions(records_dir / "slammer_csv" / f"{name}.csv")
    assert (motion.event, motion.station, motion.component) == (event, station, component)
    assert motion.orientation_deg == orientation_deg


def test_unit_is_not_guessed(records_dir: Path) -> None:
    for row in manifest(records_dir):
        if row["set"] in STATES_NO_UNIT:
            with pytest.raises(MotionFileError, match="units"):
                read_motions(records_dir / row["file"])


def test_three_components_of_one_recording(records_dir: Path) -> None:
    path = records_dir / "geonet_v2a" / "20161113_110259_WTMC_20.V2A"
    motions = read_motions(path)
    assert [motion.is_vertical for motion in motions] == [False, False, True]
    assert len({motion.recording for motion in motions}) == 1
    assert motions[0].orientation_deg == 332.0
    assert read_motion(f"{path}#2").sha256 == motions[2].sha256
    with pytest.raises(MotionFileError, match=r"holds 3 traces.*#2"):
        read_motion(path)
    with pytest.raises(MotionFileError, match="no trace #3"):
        read_motion(f"{path}#3")


def test_every_trace_is_of_one_set(records_dir: Path) -> None:
    assert sum(COUNTS.values()) == len(manifest(records_dir)) == 341


def test_one_reader_recognises_each_file(records_dir: Path) -> None:
    plain = {"slammer_csv", "geer_chihshang_2022_acc", "fema_p695_far_field"}
    readers: dict[str, set[str]] = {}
    for row in manifest(records_dir):
        head = read_text(records_dir / row["file"])[:HEAD_CHARACTERS]
        recognised = [r.FORMAT for r in READERS if r is not delimited_text and r.recognises(head)]
        assert len(recognised) == (0 if row["set"] in plain else 1), row["file"]
        readers.setdefault(row["set"], set()).update(recognised)
    assert all(len(formats) <= 1 for formats in readers.values())


@pytest.mark.parametrize(
    ("file", "index", "station", "component", "orientation_deg"),
    [
        ("csmip_v2/CIWLT.V2", 1, "WLT Hacienda Heights", "360 Deg", 0.0),
        ("csmip_v2/CE58667.V2", 2, "58667 Concord - Clayton & Ellis", "H2", None),
        ("cosmos_v1c_v2c/NCMLI--n.00725272.HNE.--.V1c", 0, "NC-MLI", "HNE", 90.0),
        ("knet_ascii/AOM0031801241951.EW", 0, "AOM003", "E-W", 90.0),
        ("kiknet_ascii/AICH040010061330.NS2", 0, "AICH04", "NS2", 0.0),
        ("renadic_v1/curico1002271parte1.v1", 2, "CURICO S/N 499", "EW", 90.0),
        ("bhrc_v1/5523-1.V1", 2, "Amand", "T3", 267.0),
        ("cwb_dat/3-EHY.dat", 1, "EHY", "N", 0.0),
        ("esm_asc/20230206011732_0131_ap_Acc_N.asc", 0, "TK.0131", "HNN", 0.0),
        ("unam_smis/PZPU1709.191", 2, "PZPU", "N90E", 90.0),
        ("nsmn_txt/20170720223109_0921.txt", 1, "0921", "E-W", 90.0),
        ("usgs_smc/np01002p_4225a_a.smc", 0, "APEEL Array #2 - Redwood City", "133", 133.0),
    ],
)
def test_names_of_networks(
    records_dir: Path,
    file: str,
    index: int,
    station: str,
    component: str,
    orientation_deg: float | None,
) -> None:
    motion = read_motions(records_dir / file)[index]
    assert (motion.station, motion.component) == (station, component)
    assert motion.orientation_deg == orientation_deg


def test_components_share_a_recording(records_dir: Path) -> None:
    for name in COUNTS:
        if name in NAMES_NO_COMPONENT:
            continue
        groups: dict[str, set[str]] = {}
        for row in manifest(records_dir):
            if row["set"] == name:
                units = row["file_units"] if name in STATES_NO_UNIT else None
                motion = read_motions(records_dir / row["file"], units=units)[
                    int(row["trace_index"])
                ]
                groups.setdefault(motion.recording, set()).add(row["companion_group"])
        assert all(len(group) == 1 for group in groups.values()), name
        if name not in {"peer_at2_opensees", "nga_at2_misc", "slammer_csv"}:
            assert len(groups) == len(set.union(*groups.values())), name


def test_channel_of_zeros_is_left_out(records_dir: Path) -> None:
    motions = read_motions(records_dir / "renadic_v1" / "curico1002271parte1.v1")
    assert [motion.component for motion in motions] == ["NS", "V", "EW"]
    assert all("INTC" in motion.remarks[0] for motion in motions)


def test_interval_of_a_list_comes_from_its_index(records_dir: Path) -> None:
    (motion,) = read_motions(records_dir / "fema_p695_far_field" / "120921.th", units="g")
    assert motion.dt_s == 0.0025
    assert "dt_index.txt, line" in motion.remarks[0]


def test_event_whose_counts_disagree(formats_dir: Path) -> None:
    with pytest.raises(MotionFileError, match=r"line 5: numSteps is 1992, .* 1991 values"):
        read_motions(formats_dir / "simcenter_event_rinaldi.json", units="g")


def test_tables_are_no_accelerograms(records_dir: Path) -> None:
    tables = [records_dir / "MANIFEST.csv"]
    tables += (records_dir / "geer_chihshang_2022_acc").glob("*.csv")
    assert len(tables) == 2
    for table in tables:
        with pytest.raises(UnknownFormatError, match=table.name):
            read_motions(table, units="g")


def test_manifest_is_metadata(records_dir: Path) -> None:
    metadata = read_metadata(records_dir / "MANIFEST.csv")
    for row in manifest(records_dir):
        traced = metadata.trace(records_dir / row["file"], int(row["trace_index"]))
        assert traced is not None
        assert traced.event_id == row["event_id"]
        assert traced.is_vertical == (row["is_vertical"] == "1")
        assert traced.units == row["file_units"]
        assert traced.companion_group == row["companion_group"]
