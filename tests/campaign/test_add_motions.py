"""Adding files: uncorrected records are processed, companions found, troubles said once each."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rbfrag.campaign.add_motions import AddReport, add_motions
from rbfrag.campaign.simulate import simulate
from rbfrag.db.engine import opened_database
from rbfrag.db.motions import load_motion, motion_row, motion_rows
from rbfrag.db.queries import combination_table, motions_on_structures
from rbfrag.db.rows import MotionRow
from rbfrag.db.vertical_pairs import VerticalPair, vertical_pair, vertical_pairs
from rbfrag.errors import InputError
from rbfrag.fragility.fit.data import read_source
from rbfrag.motions.ground_motion import LOCATION, GroundMotion
from rbfrag.motions.processing import HighPass, processed
from rbfrag.motions.quality import is_on_structure, quality_flags
from rbfrag.motions.readers import read_motion, read_motions
from tests.motions import written_by_networks as written
from tests.synthetic import shaking, write_at2


def tokens(seed: int, npts: int = 600) -> list[str]:
    return [f"{value:.6f}" for value in 10.0 * shaking(seed, npts)]


def volume_1(path: Path, *names: str, dt_s: float = 0.02, seed: int = 0) -> Path:
    """An uncorrected file, in tenths of g."""
    channels = [(name, tokens(seed + i)) for i, name in enumerate(names)]
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(written.bhrc_v1(channels, dt_s))
    return path


@pytest.fixture
def db(tmp_path: Path) -> Path:
    return tmp_path / "motions.db"


def rows(db: Path) -> list[MotionRow]:
    with opened_database(db, read_only=True) as engine, engine.connect() as connection:
        return motion_rows(connection)


def pairs(db: Path, suite: str | None = None) -> dict[int, VerticalPair]:
    with opened_database(db, read_only=True) as engine, engine.connect() as connection:
        return vertical_pairs(connection, suite=suite)


def mixed(folder: Path) -> Path:
    """Files that state g, g/10, m/s2 and nothing."""
    volume_1(folder / "tenths.V1", "L1")
    write_at2(folder / "g.AT2", shaking(11))
    for name, header, seed in (("none.txt", "", 12), ("metres.txt", "Zeit [s],a [m/s²]\n", 13)):
        lines = [f"{0.01 * i:.2f},{value:.6f}" for i, value in enumerate(shaking(seed))]
        (folder / name).write_text(header + "\n".join(lines) + "\n")
    return folder


def test_units_are_for_the_files_that_state_none(tmp_path: Path, db: Path) -> None:
    folder = tmp_path / "records"
    folder.mkdir()
    report = add_motions([mixed(folder)], db=db, units="g", raw=True)
    assert report.failed == ()
    values = {row.source_file: row.pga_g for row in rows(db)}
    assert values["none.txt"] == pytest.approx(np.abs(shaking(12)).max(), rel=1e-5)
    assert values["metres.txt"] == pytest.approx(np.abs(shaking(13)).max() / 9.80665, rel=1e-5)
    # what was stated is checked against the others, each of which keeps its own
    warned = [text for text in report.warnings if "which is for the files" in text]
    assert [Path(text.split(" is in ")[0]).name for text in warned] == ["metres.txt", "tenths.V1"]
    assert "in m/s², as is stated for it, not in g" in warned[0]


def test_units_of_the_metadata_are_a_statement_too(tmp_path: Path, db: Path) -> None:
    folder = mixed(tmp_path)
    table = tmp_path / "meta.csv"
    table.write_text("file,units\nnone.txt,mm/s2\n")
    report = add_motions([folder], db=db, units="g", metadata=table, raw=True)
    values = {row.source_file: row.pga_g for row in rows(db)}
    expected = np.abs(shaking(12)).max() / 9806.65
    assert values["none.txt"] == pytest.approx(expected, rel=1e-5)
    assert any("none.txt is in mm/s2" in text for text in report.warnings)


def test_units_that_contradict_the_only_file(tmp_path: Path, db: Path) -> None:
    (bad,) = add_motions([mixed(tmp_path) / "metres.txt"], db=db, units="g").failed
    assert "its unit is m/s², not g: omit units" in bad.reason


def test_a_row_without_an_index_is_about_the_whole_file(tmp_path: Path, db: Path) -> None:
    volume_1(tmp_path / "a.V1", "L1", "V2", "T3")
    table = tmp_path / "meta.csv"
    table.write_text("file,event_id,magnitude,companion_group\na.V1,quake,6.1,one\n")
    add_motions([tmp_path], db=db, metadata=table)
    assert len(rows(db)) == 3
    assert {(row.event_id, row.magnitude, row.recording) for row in rows(db)} == {
        ("quake", 6.1, "one")
    }
    assert not any("event_guessed" in row.flags for row in rows(db))


def test_texts_about_the_records_are_passed_over_in_a_folder_only(tmp_path: Path, db: Path) -> None:
    volume_1(tmp_path / "records" / "a.V1", "L1")
    about = tmp_path / "records" / "README.md"
    about.write_text("# Where these come from\n")
    report = add_motions([tmp_path / "records"], db=db)
    assert (report.added, report.failed) == ((1,), ())
    named = add_motions([about], db=db)
    assert [bad.path for bad in named.failed] == [str(about)]


def test_uncorrected_records_are_processed(tmp_path: Path, db: Path) -> None:
    path = volume_1(tmp_path / "a.V1", "L1", "V2", "T3")
    report = add_motions([path], db=db)
    assert report.added == report.processed == (1, 2, 3)
    assert report.warnings == ()
    for row, raw in zip(rows(db), read_motions(path), strict=True):
        result = processed(raw)
        assert (row.sha256, row.source_sha256) == (result.sha256, raw.sha256)
        assert row.npts == raw.npts + 2000
        assert row.processing == "uncorrected"
        assert row.processing_applied == result.processing_applied
        assert "uncorrected" not in row.flags
    with opened_database(db, read_only=True) as engine, engine.connect() as connection:
        back = load_motion(connection, 1)
    assert back.processing_applied == rows(db)[0].processing_applied
    assert back.source_sha256 == read_motions(path)[0].sha256


def test_read_motions_gives_the_file(tmp_path: Path) -> None:
    path = volume_1(tmp_path / "a.V1", "L1")
    (motion,) = read_motions(path)
    assert motion.npts == 600
    assert motion.acceleration_g[7] == float(tokens(0)[7]) * 0.1


def test_raw_leaves_them_and_says_so(tmp_path: Path, db: Path) -> None:
    path = volume_1(tmp_path / "a.V1", "L1")
    report = add_motions([path], db=db, raw=True)
    assert report.processed == ()
    (row,) = rows(db)
    assert row.sha256 == row.source_sha256 == read_motions(path)[0].sha256
    assert row.processing_applied is None
    assert "uncorrected" in row.flags
    with opened_database(db, read_only=True) as engine, engine.connect() as connection:
        assert load_motion(connection, row.id).is_corrected is False


def test_metadata_decide(tmp_path: Path, db: Path) -> None:
    write_at2(tmp_path / "raw.AT2", shaking(1))
    volume_1(tmp_path / "good.V1", "L1")
    table = tmp_path / "meta.csv"
    table.write_text("file,processing,operator\nraw.AT2,Uncorrected,\ngood.V1,corrected by hand,\n")
    report = add_motions([tmp_path], db=db, metadata=table)
    (row,) = rows(db)
    assert row.source_file == "raw.AT2"
    assert row.processing_applied is not None
    assert report.processed == (row.id,)
    assert report.not_read == ()
    # the format holds uncorrected records only: who knows better says so twice
    (bad,) = report.failed
    assert "by its header or format the record is uncorrected" in bad.reason
    add_motions(tmp_path / "good.V1", db=db, metadata=table, processing="corrected")
    good = next(row for row in rows(db) if row.source_file == "good.V1")
    assert good.processing_applied is None
    assert good.processing == "corrected by hand"


def test_other_settings_are_stored(tmp_path: Path, db: Path) -> None:
    path = volume_1(tmp_path / "a.V1", "L1")
    add_motions([path], db=db, high_pass=HighPass(corner_hz=0.2, order=4, padding_s=30.0))
    applied = rows(db)[0].processing_applied
    assert applied is not None
    assert (applied["corner_hz"], applied["order"], applied["padding_s"]) == (0.2, 4, 30.0)


def test_added_again_nothing_is_new(tmp_path: Path, db: Path) -> None:
    path = volume_1(tmp_path / "a.V1", "L1", "V2", "T3")
    add_motions([path], db=db)
    before = rows(db)
    again = add_motions([path], db=db)
    assert (again.added, again.already_stored, again.warnings) == ((), (1, 2, 3), ())
    assert rows(db) == before


def test_another_arithmetic_makes_no_other_motion(
    tmp_path: Path, db: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = volume_1(tmp_path / "a.V1", "L1")
    add_motions([path], db=db)

    def otherwise(motion: object, high_pass: HighPass) -> object:
        result = processed(motion, high_pass)  # type: ignore[arg-type]
        return replace(result, acceleration_g=result.acceleration_g * (1.0 + 1e-15))

    monkeypatch.setattr("rbfrag.campaign.add_motions.processed", otherwise)
    again = add_motions([path], db=db)
    assert (again.added, again.already_stored) == ((), (1,))


def test_raw_and_processed_are_two_and_said(tmp_path: Path, db: Path) -> None:
    path = volume_1(tmp_path / "a.V1", "L1")
    add_motions([path], db=db, raw=True)
    report = add_motions([path], db=db)
    assert report.added == (2,)
    warning, of_header = report.warnings
    assert "motion 2" in warning
    assert "other processing as motion 1" in warning
    assert "1 of the 3 components" in of_header


def test_two_files_of_the_same_samples(tmp_path: Path, db: Path) -> None:
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        write_at2(tmp_path / name / "same.AT2", shaking(1), station=name)
    report = add_motions([tmp_path / "a", tmp_path / "b"], db=db)
    assert (report.added, report.already_stored) == ((1,), (1,))
    (warning,) = report.warnings
    assert "b/same.AT2#0 holds the same samples as" in warning
    assert "stored once, as motion 1" in warning
    assert len(rows(db)) == 1


def test_two_files_of_the_same_samples_on_two_days(tmp_path: Path, db: Path) -> None:
    write_at2(tmp_path / "first.AT2", shaking(1))
    write_at2(tmp_path / "second.AT2", shaking(1))
    add_motions([tmp_path / "first.AT2"], db=db)
    (warning,) = add_motions([tmp_path / "second.AT2"], db=db).warnings
    assert "second.AT2#0 holds the same samples as first.AT2#0" in warning


def test_a_file_that_the_metadata_name_is_missing(tmp_path: Path, db: Path) -> None:
    folder = tmp_path / "records"
    folder.mkdir()
    write_at2(folder / "there.AT2", shaking(1))
    table = tmp_path / "meta.csv"
    table.write_text(
        "file,event_id\nrecords/there.AT2,e\nrecords/gone.AT2,e\nelsewhere/gone.AT2,e\n"
    )
    report = add_motions([folder], db=db, metadata=table)
    assert report.added == (1,)
    (bad,) = report.failed
    assert bad.path == str(folder / "gone.AT2")
    assert "line 3 of the metadata" in bad.reason


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ("file,trace_index\na.V1,3\n", "trace_index 3, but the file has 2 traces"),
        ("file,trace_index,units\na.V1,0,g\na.V1,1,m/s2\n", "lines 2, 3 of the metadata"),
        ("file,trace_index,dt_s\na.V1,0,0.02\na.V1,1,0.01\n", "state dt_s 0.01 and 0.02"),
        ("file,trace_index,dt_s\na.V1,0,0.01\n", "not 0.01"),
        ("file,is_vertical\na.V1,0\n", "line 2 of the metadata says horizontal of trace 1"),
        ("file,component\na.V1,N\n", "calls all 2 traces of the file N: give each a row"),
    ],
)  # fmt: skip
def test_metadata_that_contradict_the_file(
    tmp_path: Path, db: Path, table: str, words: str
) -> None:
    path = volume_1(tmp_path / "a.V1", "L1", "V2")
    other = write_at2(tmp_path / "b.AT2", shaking(9))
    (tmp_path / "meta.csv").write_text(table)
    report = add_motions([path, other], db=db, metadata=tmp_path / "meta.csv")
    (bad,) = report.failed
    assert words in bad.reason
    assert [row.source_file for row in rows(db)] == ["b.AT2"]


def test_horizontals_find_their_vertical(tmp_path: Path, db: Path) -> None:
    volume_1(tmp_path / "a.V1", "L1", "V2", "T3")
    write_at2(tmp_path / "alone.AT2", shaking(9), event="E", station="S", component="090")
    add_motions([tmp_path], db=db, suite="all")
    result = pairs(db, "all")
    by_name = {row.id: row.component for row in rows(db)}
    assert {by_name[i]: pair.vertical_id for i, pair in result.items()} == {
        "L1": 2, "T3": 2, "090": None,
    }  # fmt: skip
    vertical = rows(db)[1]
    assert {p.vertical_sha256 for p in result.values() if p.vertical_id} == {vertical.sha256}
    with opened_database(db, read_only=True) as engine, engine.connect() as connection:
        assert all(vertical_pair(connection, i) == pair for i, pair in result.items())
        assert "no vertical" in next(p.reason for p in result.values() if p.reason)
        with pytest.raises(ValueError, match="motion 2 is a vertical component"):
            vertical_pair(connection, 2)


def at2_recording(folder: Path, **changes: object) -> Path:
    """Two components of one recording in two files, the second changed."""
    write_at2(folder / "H.AT2", shaking(1), event="E", station="S", component="090")
    settings: dict[str, object] = {"samples": shaking(2), "component": "UP", **changes}
    samples = settings.pop("samples")
    write_at2(folder / "V.AT2", samples, event="E", station="S", **settings)  # type: ignore[arg-type]
    return folder


def one_pair(folder: Path, db: Path, **settings: object) -> tuple[VerticalPair, AddReport]:
    report = add_motions([folder], db=db, **settings)  # type: ignore[arg-type]
    (pair,) = pairs(db).values()
    return pair, report


def test_a_longer_or_shorter_vertical_is_used_and_said(tmp_path: Path, db: Path) -> None:
    for npts, words in (
        (590, "the vertical component has 590 samples, the other 600"),
        (610, "the horizontal component has 600 samples, the other 610"),
    ):
        folder = tmp_path / str(npts)
        folder.mkdir()
        pair, _ = one_pair(at2_recording(folder, samples=shaking(2, npts)), tmp_path / f"{npts}.db")
        assert pair.vertical_id == 2
        assert words in pair.remark
        assert "rest" in pair.remark


def test_mixed_dt_is_rejected_and_said(tmp_path: Path, db: Path) -> None:
    pair, report = one_pair(at2_recording(tmp_path, dt_s=0.01), db)
    assert pair.vertical_id is None
    assert "dt = 0.01 s, the horizontal 0.02 s" in pair.reason
    (warning,) = report.warnings
    assert "dt = 0.01 and 0.02 s" in warning


def test_downward_is_stored_upward(tmp_path: Path, db: Path) -> None:
    pair, report = one_pair(at2_recording(tmp_path, component="DOWN"), db)
    assert pair.vertical_id is not None
    vertical = next(row for row in rows(db) if row.is_vertical)
    assert vertical.component == "UP"
    with opened_database(db, read_only=True) as engine, engine.connect() as connection:
        stored = load_motion(connection, vertical.id)
    assert np.array_equal(stored.acceleration_g, -read_motion(tmp_path / "V.AT2").acceleration_g)
    assert "turned" in stored.remarks[-1]
    assert report.processed == ()


def test_raw_downward_is_not_used(tmp_path: Path, db: Path) -> None:
    pair, _ = one_pair(at2_recording(tmp_path, component="DOWN"), db, raw=True)
    assert pair.vertical_id is None
    assert "downward" in pair.reason


def test_processed_and_raw_do_not_mix(tmp_path: Path, db: Path) -> None:
    folder = at2_recording(tmp_path)
    table = tmp_path / "meta.csv"
    table.write_text(
        "file,event_id,companion_group,processing\nH.AT2,e,g,uncorrected\nV.AT2,e,g,corrected\n"
    )
    pair, _ = one_pair(folder, db, metadata=table)
    assert "1000 samples before the horizontal" in pair.reason


def test_of_raw_and_processed_the_like_is_chosen(tmp_path: Path, db: Path) -> None:
    path = volume_1(tmp_path / "a.V1", "L1", "V2")
    add_motions([path], db=db, raw=True)
    add_motions([path], db=db)
    assert {i: pair.vertical_id for i, pair in pairs(db).items()} == {1: 2, 3: 4}


def test_several_verticals_are_not_guessed_among(tmp_path: Path, db: Path) -> None:
    at2_recording(tmp_path)
    write_at2(tmp_path / "W.AT2", shaking(5), event="E", station="S", component="UP")
    pair, _ = one_pair(tmp_path, db)
    assert pair.vertical_id is None
    assert "several vertical motions (2, 3)" in pair.reason


def test_strangers_without_a_station_are_no_companions(tmp_path: Path, db: Path) -> None:
    for name, component, seed in (("a", "090", 1), ("b", "UP", 2)):
        path = write_at2(tmp_path / f"{name}.AT2", shaking(seed), component=component)
        text = path.read_text().replace(f"SOMEWHERE 01/02/03, STA, {component}", "SOMEWHERE 1999")
        path.write_text(text)
    add_motions([tmp_path], db=db)
    assert len({row.recording for row in rows(db)}) == 2


@pytest.fixture(scope="module")
def everything(
    records_dir: Path, tmp_path_factory: pytest.TempPathFactory
) -> tuple[Path, AddReport]:
    db = tmp_path_factory.mktemp("everything") / "motions.db"
    return db, add_motions([records_dir], db=db, metadata=records_dir / "MANIFEST.csv")


def test_the_real_set(everything: tuple[Path, AddReport]) -> None:
    db, report = everything
    assert (len(report.added), len(report.processed), report.already_stored) == (341, 123, ())
    assert {Path(bad.path).suffix for bad in report.failed} == {".csv"}
    assert report.warnings == ()
    stored = rows(db)
    horizontals = [row for row in stored if not row.is_vertical]
    assert len(horizontals) == 265
    assert len({row.event_id for row in horizontals}) == 48
    # the near-fault set keeps its permanent displacement, and six of it a velocity as well
    flags = Counter((row.file_format, flag) for row in horizontals for flag in row.flags)
    assert flags == {
        ("delimited text", "final_velocity"): 6,
        ("PEER AT2", "first_sample_not_zero"): 2,
    }


def test_processed_real_records_end_at_rest(everything: tuple[Path, AddReport]) -> None:
    db, report = everything
    with opened_database(db, read_only=True) as engine, engine.connect() as connection:
        result = [motion_row(connection, i) for i in report.processed]
    for row in result:
        assert abs(row.final_velocity_m_s) < 1e-4 * row.pgv_m_s
        assert abs(row.final_displacement_m) < 0.02 * row.pgd_m
        assert row.pgv_m_s < 0.6
        assert row.pgd_m < 0.3


def test_real_verticals_go_with_their_horizontals(everything: tuple[Path, AddReport]) -> None:
    db, _ = everything
    result = pairs(db)
    assert sum(pair.vertical_id is not None for pair in result.values()) == 152
    assert all(pair.reason.startswith("no vertical") for pair in result.values() if pair.reason)
    assert sum(bool(pair.remark) for pair in result.values()) == 8
    stored = {row.id: row for row in rows(db)}
    for i, pair in result.items():
        if pair.vertical_id is not None:
            assert stored[pair.vertical_id].recording == stored[i].recording
    helena = [row for row in stored.values() if row.recording == "RSN1" and row.is_vertical]
    assert [row.component for row in helena] == ["UP"]


def test_metadata_take_precedence_over_a_name_of_the_file(tmp_path: Path, db: Path) -> None:
    volume_1(tmp_path / "a.V1", "L1", "V2")
    (tmp_path / "meta.csv").write_text(
        "file,trace_index,is_vertical,component\na.V1,0,1,\na.V1,1,,N\n"
    )
    report = add_motions([tmp_path / "a.V1"], db=db, metadata=tmp_path / "meta.csv")
    assert [row.is_vertical for row in rows(db)] == [True, False]
    first, second, _ = report.warnings
    assert "line 2 of the metadata says vertical of trace 0 (L1)" in first
    assert first.endswith("the metadata are used")
    assert "line 3 of the metadata says horizontal of trace 1 (V2)" in second


def test_a_direction_that_is_guessed_is_a_warning(tmp_path: Path, db: Path) -> None:
    write_at2(tmp_path / "a.AT2", shaking(1), event="E", station="S", component="INTC")
    write_at2(tmp_path / "b.AT2", shaking(2), event="E", station="S", component="+V")
    (warning,) = add_motions([tmp_path / "a.AT2", tmp_path / "b.AT2"], db=db).warnings
    assert warning.startswith("1 traces are assumed horizontal though")
    assert warning.endswith("a.AT2#0 INTC")
    guessed, vertical = rows(db)
    assert (guessed.is_vertical, "direction_guessed" in guessed.flags) == (False, True)
    assert vertical.is_vertical
    (document,) = simulate(db, p2=[3.0], jobs=1).warnings
    assert document.startswith("the direction of 1 of 1 motions is guessed")


@pytest.fixture
def sample(cases_dir: Path) -> Path:
    """A CSMIP file of one instrument in the free field and one on a roof."""
    return cases_dir / "records" / "csmip_sta_chn.v2"


def test_a_sensor_on_a_structure_is_excluded_by_default(sample: Path, db: Path) -> None:
    report = add_motions([sample], db=db)
    document = [
        (row.is_vertical, row.orientation_deg, "structure" in row.flags) for row in rows(db)
    ]
    assert document == [
        (True, None, False), (False, 0.0, False), (False, 270.0, True),
    ]  # fmt: skip
    (warning,) = report.warnings
    assert "1 traces were recorded on a structure" in warning
    assert warning.endswith("csmip_sta_chn.v2#2 270 DEG at ROOF")
    with opened_database(db) as engine, engine.connect() as connection:
        assert "'ROOF'" in quality_flags(load_motion(connection, 3))[0].sentence
    default = simulate(db, p2=[3.0], jobs=1)
    assert default.combinations == 2
    assert default.warnings[0].startswith("1 of 2 horizontal motions were recorded on structures")
    assert simulate(db, p2=[3.0], jobs=1, include_structures=True).combinations == 4
    with opened_database(db, read_only=True) as engine, engine.connect() as connection:
        assert (
            combination_table(connection).p2.size,
            motions_on_structures(connection, "toppling"),
        ) == (2, 1)
        assert combination_table(connection, include_structures=True).p2.size == 4
        assert (
            read_source(connection).structures,
            read_source(connection, include_structures=True).structures,
        ) == (1, 0)


def test_only_records_of_structures(sample: Path, tmp_path: Path, db: Path) -> None:
    text = sample.read_text()
    (tmp_path / "roof.v2").write_text(text.replace("FREEFIELD", "DECK     "))
    add_motions([tmp_path / "roof.v2"], db=db)
    with pytest.raises(
        InputError, match="all 2 horizontal motions in the database were recorded on"
    ):
        simulate(db, p2=[3.0], jobs=1)


@pytest.mark.parametrize(
    ("location", "on_structure"),
    [
        ("FREEFIELD", False), ("Free-field", False), ("Ground Level", False), ("", False),
        ("Ground Floor", True), ("Bent 3: South Column, Grnd Level", True), ("Roof: Center", True),
    ],
)  # fmt: skip
def test_locations(location: str, on_structure: bool) -> None:
    remarks = (LOCATION + location,) if location else ()
    assert is_on_structure(GroundMotion(np.ones(3), 0.01, remarks=remarks)) is on_structure


def test_locations_of_every_format_that_states_them(tmp_path: Path) -> None:
    channels = [("UP", [f"{value:.4f}" for value in shaking(1)]), ("90 DEG", tokens(2))]
    channels[1] = ("90 DEG", channels[0][1])
    text = written.cdmg_v1(channels, 0.02)
    text = text.replace("(STA CHN:  2)       ", "(STA CHN:  2)  LOCATION: ROOF")
    (tmp_path / "a.v1").write_text(text)
    assert [motion.location for motion in read_motions(tmp_path / "a.v1")] == ["", "ROOF"]
    text = written.cosmos([f"{value:.6E}" for value in shaking(1)], 0.02)
    (tmp_path / "b.V1c").write_text(text.replace("Location:", "Location:Roof Center"))
    (motion,) = read_motions(tmp_path / "b.V1c")
    assert (motion.location, motion.orientation_deg) == ("Roof Center", 90.0)
