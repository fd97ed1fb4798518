"""Event sets of the OpenQuake engine: what is read from small files whose answer is known."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from rbfrag.errors import InputError
from rbfrag.exchange.openquake_events import job_files, read_events
from rbfrag.hazards.event_set import EventSet
from tests.exchange.openquake_job import EVENTS, SHAKING, write_csv, write_job


def read(folder: Path, **about: object) -> EventSet:
    """Read the files of a folder."""
    return read_events(job_files(folder), **about)  # type: ignore[arg-type]


def replace_text(folder: Path, name: str, old: str, new: str) -> None:
    """Replace a text in one of the files; it must be there."""
    path = next(folder.glob(f"{name}*.csv"))
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))


def test_three_realizations(tmp_path: Path) -> None:
    events = read(write_job(tmp_path))
    # weight over 50 a × 2 sets, of each realization by itself
    assert events.weight == pytest.approx([0.005, 0.005, 0.005, 0.003, 0.002])
    assert events.effective_years == pytest.approx(100.0 / (0.25 + 0.09 + 0.04))
    assert events.site_ids == ("0012", "007", "Z9")
    rows = zip(events.event.tolist(), events.site.tolist(), strict=True)
    assert list(rows) == [(0, 0), (0, 1), (1, 0), (3, 2), (4, 0)]
    assert events.measures["pgv_m_s"] == pytest.approx([0.6, 0.4, 0.8, 0.5, 0.9])


def test_samples_of_a_tree_weigh_alike(tmp_path: Path) -> None:
    rows = [(i, i, 10 + 100 * i) for i in range(6)]
    folder = write_job(tmp_path, events=rows, shaking=[(0, 10.0, "Z9")], weights=[0.16666667] * 6)
    events = read(folder)
    assert events.weight == pytest.approx(np.full(6, 1.0 / (50 * 2 * 6)))
    assert events.effective_years == pytest.approx(600.0)


def test_a_scenario_has_no_rate(tmp_path: Path) -> None:
    rows = [(i, int(i == 3), 0) for i in range(4)]
    folder = write_job(
        tmp_path, events=rows, shaking=[(0, 10.0, "Z9")], weights=(0.4, 0.6), ruptures=False
    )
    events = read(folder)
    assert events.is_scenario
    assert events.effective_years is None
    assert events.weight == pytest.approx([0.4 / 3, 0.4 / 3, 0.4 / 3, 0.6])
    with pytest.raises(InputError, match="scenario"):
        read(folder, investigation_time=50.0, ses=2)


@pytest.mark.parametrize(
    ("names", "mesh"),
    [
        (("site_id", "event_id"), ("custom_site_id", "lon", "lat")),
        (("event_id", "site_id"), ("site_id", "lon", "lat")),
        (("eid", "sid"), ("custom_site_id", "lon", "lat")),
        (("rlzi", "sid", "eid"), ("lon", "lat")),
        (("eid", "custom_site_id"), ("custom_site_id", "lon", "lat")),
    ],
)
def test_older_columns(tmp_path: Path, names: tuple[str, ...], mesh: tuple[str, ...]) -> None:
    folder = write_job(tmp_path)
    ids = {"custom_site_id": ("0012", "007", "Z9"), "site_id": ("0", "1", "2")}.get(mesh[0])
    positions = [(174.0 + i, -41.0) for i in range(3)]
    rows = (
        positions
        if ids is None
        else [(item, *place) for item, place in zip(ids, positions, strict=True)]
    )
    write_csv(folder / "sitemesh_5.csv", mesh, rows)
    number = {"0012": 0, "007": 1, "Z9": 2}
    write_csv(
        folder / "gmf-data_5.csv",
        (*names, "gmv_PGA", "gmv_PGV"),
        [
            (
                *(
                    {"event_id": e, "eid": e, "rlzi": 0, "custom_site_id": s}.get(n, number[s])
                    for n in names
                ),
                0.1,
                v,
            )
            for e, v, s in SHAKING
        ],
    )
    events = read(folder)
    assert events.site.tolist() == [0, 1, 0, 2, 0]
    assert events.measures["pgv_m_s"] == pytest.approx([0.6, 0.4, 0.8, 0.5, 0.9])


def test_measures_by_name(tmp_path: Path) -> None:
    folder = write_job(
        tmp_path,
        measures=("SA(1.0)", "PGV", "Newmark_Disp", "PGA"),
        shaking=[(0, 0.3, 45, 9, 0.2, "Z9")],
    )
    events = read(folder, imts=("PGV", "PGA", "SA(1)"))
    values = {name: value.item() for name, value in events.measures.items()}
    assert values == pytest.approx({"pgv_m_s": 0.45, "pga_g": 0.2, "sa(1)": 0.3})
    with pytest.raises(
        InputError, match=r"no column gmv_SA\(0\.3\); the measures are SA\(1\.0\), PGV, PGA"
    ):
        read(folder, imts=("SA(0.3)",))


def test_time_is_stated_never_guessed(tmp_path: Path) -> None:
    folder = write_job(tmp_path, ruptures=False)
    with pytest.raises(InputError, match="investigation_time and ses"):
        read(folder)
    with pytest.raises(InputError, match="investigation_time and ses"):
        read(folder, ses=2)
    assert read(folder, investigation_time=50.0, ses=2).weight[3] == pytest.approx(0.003)
    with pytest.raises(InputError, match="investigation_time is 50, given is 100"):
        read(write_job(tmp_path / "whole"), investigation_time=100.0)


def test_years_beyond_the_stated_time_are_warned_of(tmp_path: Path) -> None:
    folder = write_job(tmp_path, ruptures=False)
    assert not read(folder, investigation_time=50.0, ses=2).warnings
    (warning,) = read(folder, investigation_time=50.0, ses=1).warnings
    assert "year 250 lies beyond the 50 years" in warning


@pytest.mark.parametrize(
    ("name", "old", "new", "message"),
    [
        ("gmf-data", "0,60.0,0012", "0,60.0,12", r"_5\.csv, line 4: the site '12' is not in"),
        ("gmf-data", "3,50.0,Z9", "8,50.0,Z9", r"line 6: the event 8 is not in the file of events"),
        ("gmf-data", "1,80.0,0012", "0,80.0,007", r"line 5: the event 0 has a second row .*'007'"),
        ("gmf-data", "1,80.0", "1,-80.0", r"line 5: gmv_PGV is -80"),
        ("gmf-data", "1,80.0", "1,nan", r"line 5: gmv_PGV is 'nan', not a number"),
        ("gmf-data", "1,80.0", "1,eighty", r"line 5: gmv_PGV is 'eighty', not a number"),
        ("gmf-data", "1,80.0,0012", "1,80.0", r"line 5: 2 cells under 3 columns"),
        ("gmf-data", "1,80.0,0012", "1,80.0,0012,9", r"line 5: 4 cells under 3 columns"),
        ("gmf-data", "1,80.0", "1.5,80.0", r"line 5: event_id is '1.5', not a whole number"),
        ("gmf-data", "event_id,", "event,", r"line 2: there is no column event_id or eid"),
        ("gmf-data", "checksum=77", "checksum=78", r"checksum is 77, .*gmf-data_5\.csv is 78"),
        ("events", "2026-01", "2026-02", r"events_5\.csv, line 1: start_date .*files of one job"),
        ("events", "3,1073741827,1", "3,1073741827,7", r"line 6: the realization 7 is not in"),
        ("events", "1,1073741825", "0,1073741825", r"line 4: the event 0 occurs twice"),
        ("sitemesh", "custom_site_id,lon", "site,longitude", r"no column custom_site_id or .* lon"),
        ("sitemesh", "007,", "0012,", r"line 4: the site '0012' occurs twice"),
        ("realizations", "1,A~A", "0,A~A", r"line 4: rlz_id 0 occurs twice"),
        ("realizations", "3.0000000e-01", "-0.3", r"line 4: the weight -0.3"),
        ("realizations", "1,A~A", "1e999,A~A", r"line 4: rlz_id is '1e999', not a whole number"),
        ("ruptures", "path=2", "path=0", r"line 1: .*path = .0. is not above zero"),
        ("ruptures", "path=2", "path=2.5", r"rupt.*path = 2\.5 is not a whole number"),
    ],
)  # fmt: skip
def test_rejections_name_the_line(
    tmp_path: Path, name: str, old: str, new: str, message: str
) -> None:
    folder = write_job(tmp_path)
    replace_text(folder, name, old, new)
    with pytest.raises(InputError, match=message) as rejected:
        read(folder)
    assert len(str(rejected.value)) < 500 + len(str(tmp_path))


def test_files_of_a_folder_and_by_name(tmp_path: Path) -> None:
    folder = write_job(tmp_path / "job")
    shutil.copy(folder / "events_5.csv", folder / "events_6.csv")
    with pytest.raises(InputError, match=r"and events_6\.csv.*give the file of events"):
        read(folder)
    named = job_files(folder, {"events": folder / "events_6.csv"})
    assert read_events(named).event_id.size == len(EVENTS)
    (folder / "events_6.csv").unlink()
    (folder / "gmf-data_5.csv").rename(tmp_path / "shaking.csv")
    with pytest.raises(InputError, match="no file of gmf-data"):
        job_files(folder)
    with pytest.raises(InputError, match="is not a folder"):
        job_files(tmp_path / "nowhere")
    with pytest.raises(InputError, match="files: 'gmf' is not one of gmf_data, events"):
        job_files(folder, {"gmf": tmp_path / "shaking.csv"})


def test_many_parts_are_one_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    complete = read(write_job(tmp_path))
    monkeypatch.setattr("rbfrag.exchange.openquake_tables.ROWS", 2)
    parts = read(tmp_path)
    assert parts.measures["pgv_m_s"].tolist() == complete.measures["pgv_m_s"].tolist()
    replace_text(tmp_path, "gmf-data", "4,90.0,0012", "4,90.0,12")
    with pytest.raises(InputError, match="line 7: the site '12'"):
        read(tmp_path)


@pytest.mark.parametrize(
    ("folder", "events", "rows", "effective"),
    [
        ("openquake_event_based/one_realization", 1974, 5890, 90_000.0),
        ("openquake_event_based/three_realizations", 212, 2396, 3000 / 0.38),
        ("openquake_event_based/six_samples", 212, 2400, 9000.0),
        ("openquake_event_based/engine_made_site_ids", 66, 762, 3000.0),
        ("openquake_scenario", 200, 2400, None),
    ],
)
def test_exports_of_the_engine(
    formats_dir: Path, folder: str, events: int, rows: int, effective: float | None
) -> None:
    result = read(formats_dir / folder)
    assert (result.event_id.size, result.event.size) == (events, rows)
    assert result.effective_years == (None if effective is None else pytest.approx(effective))
    assert not result.warnings
