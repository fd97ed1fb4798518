"""Small event sets in the form of the OpenQuake engine's exports, for tests."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

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
