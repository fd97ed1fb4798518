"""Small event sets in the form of the OpenQuake engine's exports, for tests."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

ABOUT = "generated_by='OpenQuake engine 3.26.2', start_date='2026-01-02T03:04:05', checksum=77"

Rows = Sequence[Sequence[object]]

SITES = ("0012", "007", "Z9")
EVENTS = ((0, 0, 3), (1, 0, 3), (2, 0, 90), (3, 1, 140), (4, 2, 250))
"""Number, realization and year: two share year 3 of realization 0; event 2 shakes nothing."""
SHAKING = (
    (0, 40.0, "007"),
    (0, 60.0, "0012"),
    (1, 80.0, "0012"),
    (3, 50.0, "Z9"),
    (4, 90.0, "0012"),
)
"""Event, PGV [cm/s] and site."""
WEIGHTS = (0.5, 0.3, 0.2)
TIME, SETS = 50.0, 2
"""Investigation time [a] and event sets of each realization: 100 years each."""


def write_csv(path: Path, names: Sequence[str], rows: Rows, about: str = ABOUT) -> Path:
    """Write one file as the engine does: the comment is the last cell of the first line."""
    lines = ["#" + "," * (len(names) - 1) + f'"{about}"', ",".join(names)]
    lines += [",".join(str(cell) for cell in row) for row in rows]
    path.write_text("\n".join(lines) + "\n")
    return path


def write_job(
    folder: Path,
    *,
    events: Rows = EVENTS,
    shaking: Rows = SHAKING,
    sites: Sequence[str] = SITES,
    weights: Sequence[float] = WEIGHTS,
    ruptures: bool = True,
    measures: Sequence[str] = ("PGV",),
) -> Path:
    """Write the files of a job; without a file of ruptures that of a scenario, or a part."""
    folder.mkdir(parents=True, exist_ok=True)
    columns = ("event_id", *(f"gmv_{measure}" for measure in measures), "custom_site_id")
    write_csv(folder / "gmf-data_5.csv", columns, shaking)
    write_csv(
        folder / "events_5.csv",
        ("event_id", "rup_id", "rlz_id", "year", "ses_id"),
        [(event, 2**30 + event, rlz, year, 1) for event, rlz, year in events],
    )
    write_csv(
        folder / "sitemesh_5.csv",
        ("custom_site_id", "lon", "lat"),
        [(name, 174.0 + i, -41.0) for i, name in enumerate(sites)],
    )
    write_csv(
        folder / "realizations_5.csv",
        ("rlz_id", "branch_path", "weight"),
        [(i, "A~A", f"{weight:.7e}") for i, weight in enumerate(weights)],
    )
    if ruptures:
        about = f"{ABOUT}, investigation_time={TIME}, ses_per_logic_tree_path={SETS}"
        write_csv(
            folder / "ruptures_5.csv",
            ("rup_id", "multiplicity", "mag"),
            [(2**30 + event, 1, 6.5) for event, _, _ in events],
            about,
        )
    return folder


def write_datastore(
    path: Path, *, scenario: bool = False, alone: bool = False, changed: Any = None
) -> Path:
    """Write the job of `write_job` in the layout of the engine's own HDF5 file (3.26).

    Args:
        alone: ground motion and sites without events, as ``oq export gmf_data -e hdf5`` does.
        changed: called with the open file at the end.
    """
    import h5py
    import numpy as np

    with h5py.File(path, "w") as file:
        rows = sorted((event, SITES.index(name), pgv) for event, pgv, name in SHAKING)
        events, sites, values = zip(*rows, strict=True)
        file["gmf_data/eid"] = np.array(events, "u4")
        file["gmf_data/sid"] = np.array(sites, "u4")
        file["gmf_data/PGV"] = np.array(values, "f4")
        file["gmf_data/sigma_epsilon"] = np.zeros(5, [("eid", "u4"), ("eps_inter_PGV", "f4")])
        file["sitecol/sids"] = np.arange(len(SITES), dtype="u4")
        file["sitecol/lon"] = 174.0 + np.arange(len(SITES))
        file["sitecol/lat"] = np.full(len(SITES), -41.0)
        file["sitecol/custom_site_id"] = np.array(SITES, "S8")
        if not alone:
            file.attrs["checksum32"], file.attrs["date"] = 77, "2026-01-02T03:04:05"
            names = ("id", "<u4"), ("rup_id", "<i8"), ("rlz_id", "<u2"), ("year", "<u4")
            stored = [(e, 2**30 + e, rlz, 0 if scenario else year) for e, rlz, year in EVENTS]
            file["events"] = np.array(stored, dtype=list(names))
            file["weights"] = np.array(WEIGHTS, "f4")
            times = (None, None) if scenario else (TIME, SETS)
            value = dict(zip(("investigation_time", "ses_per_logic_tree_path"), times, strict=True))
            file["oqparam"] = json.dumps(value)
        if changed is not None:
            changed(file)
    return path
