"""The datastore of an OpenQuake job in place of its exports."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import rbfrag
from rbfrag.errors import InputError
from rbfrag.exchange.openquake_events import job_files, read_events
from rbfrag.hazards.event_set import EventSet
from tests.exchange.openquake_job import EVENTS, SITES, write_datastore, write_job

pytest.importorskip("h5py", reason="the extra hdf5 is not installed")


def same(first: EventSet, other: EventSet) -> bool:
    names = ("event_id", "realization", "year", "event", "site", "coordinates")
    assert first.site_ids == other.site_ids
    assert first.duration == other.duration
    assert first.warnings == other.warnings
    assert other.weight == pytest.approx(first.weight, rel=1e-7)  # stored in single precision
    assert other.measures["pgv_m_s"] == pytest.approx(first.measures["pgv_m_s"], rel=1e-7)
    return all(np.array_equal(getattr(first, name), getattr(other, name)) for name in names)


def test_datastore_and_exports_are_one_job(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = write_job(tmp_path / "job")
    store = write_datastore(tmp_path / "calc_5.hdf5")
    exported = read_events(job_files(folder))
    assert same(exported, read_events(job_files(store)))
    monkeypatch.setattr("rbfrag.exchange.openquake_tables.ROWS", 2)  # in parts
    assert same(exported, read_events(job_files(store)))
    # files that are named go before the datastore
    mixed = read_events(job_files(store, {"events": folder / "events_5.csv"}))
    assert same(exported, mixed)


def test_ground_motion_alone_brings_its_sites(tmp_path: Path) -> None:
    folder = write_job(tmp_path / "job")
    exported = read_events(job_files(folder))
    for name in ("gmf-data_5.csv", "sitemesh_5.csv"):
        (folder / name).unlink()
    alone = write_datastore(tmp_path / "gmf-data_5.hdf5", alone=True)
    assert same(exported, read_events(job_files(folder, {"gmf_data": alone})))
    with pytest.raises(InputError, match=r"has no 'events': it is a file of ground motion alone"):
        read_events(job_files(alone))


def test_a_scenario(tmp_path: Path) -> None:
    folder = write_job(
        tmp_path / "job", events=[(event, rlz, 0) for event, rlz, _ in EVENTS], ruptures=False
    )
    store = write_datastore(tmp_path / "calc_5.hdf5", scenario=True)
    assert same(read_events(job_files(folder)), read_events(job_files(store)))


def test_losses_are_equal(tmp_path: Path) -> None:
    blocks = {"p2_1_s2": [3.0] * 3, "kr": [0.1] * 3, "site_id": list(SITES)}
    folder = write_job(tmp_path / "job")
    store = write_datastore(tmp_path / "calc_5.hdf5")
    single, other = (
        rbfrag.losses(inputs, blocks, expected=True, component="rotd50").block_rates
        for inputs in (folder, store)
    )
    assert (single[0] > 0.0).all()
    assert other == pytest.approx(single, rel=1e-6, nan_ok=True)


def _gap_in_sites(file: Any) -> None:
    file["sitecol/sids"][2] = 7


def _no_weights(file: Any) -> None:
    del file["weights"]


def _table_of_weights(file: Any) -> None:
    del file["weights"]
    file["weights"] = np.full((3, 2), 1 / 3)


def _nan(file: Any) -> None:
    file["gmf_data/PGV"][3] = np.nan


def _event_twice(file: Any) -> None:
    file["events"][1] = file["events"][0]


def _one_site_unknown(file: Any) -> None:
    file["gmf_data/sid"][0] = 9


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        (_gap_in_sites, "sitecol: the sites are not numbered from 0 on"),
        (_no_weights, "has no 'weights'"),
        (_table_of_weights, r"weights: of shape \(3, 2\)"),
        (_nan, "gmf_data, row 4: gmv_PGV is nan, no number"),
        (_event_twice, "events, row 2: the event 0 occurs twice"),
        (_one_site_unknown, "gmf_data, row 1: the site '9' is not in calc_5.hdf5"),
    ],
)
def test_rejections_name_the_row(
    tmp_path: Path, changed: Callable[[Any], None], words: str
) -> None:
    store = write_datastore(tmp_path / "calc_5.hdf5", changed=changed)
    with pytest.raises(InputError, match=words):
        read_events(job_files(store))


def test_files_that_are_no_datastore(tmp_path: Path) -> None:
    path = tmp_path / "calc_1.hdf5"
    path.write_text("event_id,gmv_PGV\n")
    with pytest.raises(InputError, match=r"not an HDF5 file: name the datastore"):
        read_events(job_files(path))
    complete = write_datastore(tmp_path / "calc_2.hdf5").read_bytes()
    path.write_bytes(complete[: len(complete) // 2])
    with pytest.raises(InputError, match=r"calc_1.hdf5: cannot be read"):
        read_events(job_files(path))


def test_a_damaged_file_ends(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # with another length of the second text of the heap, the HDF5 library searches it for ever
    store = write_datastore(tmp_path / "calc_5.hdf5")
    damaged = bytearray(store.read_bytes())
    damaged[damaged.index(b"GCOL") + 64] = 67
    store.write_bytes(damaged)
    monkeypatch.setattr("rbfrag.exchange.openquake_tables._LEAST_S", 3.0)
    with pytest.raises(InputError, match=r"damaged|cannot be read"):
        read_events(job_files(store))
