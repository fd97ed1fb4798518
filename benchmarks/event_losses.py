"""Time and memory of `rbfrag losses`:  python -m benchmarks.event_losses [--rows 1000000] [--write]

The event set is made up: as many events as give the rows, each shaking every site. A case is a
process of its own, whose processor time, from reading the files to the answer, and peak memory are
given. --write keeps the table in benchmarks/results.
"""

from __future__ import annotations

import multiprocessing
import resource
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

import numpy as np

from benchmarks.page import markdown, parser, report
from tests.exchange.openquake_job import ABOUT, write_csv

BLOCKS = 1000


class Case(NamedTuple):
    """One run.

    Args:
        sites: number of sites, with as many blocks each.
        component: what the measures mean.
        samples: samples of each event; 0 for expected values alone.
    """

    sites: int
    component: str
    samples: int


CASES = (
    Case(100, "single", 100),
    Case(100, "rotd50", 100),
    Case(100, "single", 0),
)


def write_event_set(folder: Path, rows: int, sites: int) -> None:
    """Write a made-up event set and its blocks."""
    random = np.random.default_rng(1)
    names = [f"site{i:03d}" for i in range(sites)]
    events = rows // sites
    years = np.sort(random.integers(1, 100_001, events)).tolist()
    median = 8.0 * np.exp(0.8 * random.standard_normal(events))
    with (folder / "gmf-data_1.csv").open("w") as file:
        file.write(f'#,,"{ABOUT}"\nevent_id,gmv_PGV,custom_site_id\n')
        for event in range(events):
            values = median[event] * np.exp(0.6 * random.standard_normal(sites))
            cells = zip(values.tolist(), names, strict=True)
            file.write("".join(f"{event},{value:.5E},{name}\n" for value, name in cells))
    columns = ("event_id", "rup_id", "rlz_id", "year", "ses_id")
    write_csv(folder / "events_1.csv", columns, [(e, e, 0, y, 1) for e, y in enumerate(years)])
    places = [(name, 174.0, -41.0) for name in names]
    write_csv(folder / "sitemesh_1.csv", ("custom_site_id", "lon", "lat"), places)
    write_csv(folder / "realizations_1.csv", ("rlz_id", "weight"), [(0, 1.0)])
    about = f"{ABOUT}, investigation_time=50.0, ses_per_logic_tree_path=2000"
    write_csv(folder / "ruptures_1.csv", ("rup_id", "mag"), [(0, 6.0)], about)
    p2 = np.exp(random.uniform(-1.0, 3.0, BLOCKS)).tolist()
    kr = np.exp(random.uniform(np.log(0.05), np.log(0.4), BLOCKS)).tolist()
    lines = [f"{i},{names[i % sites]},{p2[i]:.5g},{kr[i]:.5g},1000,0.5" for i in range(BLOCKS)]
    header = "block_id,site_id,p2_1_s2,kr,loss,loss_sigma"
    (folder / "blocks.csv").write_text("\n".join([header, *lines]))


def measured(case: Case, folder: str) -> tuple[float, float, float]:
    """Return processor time [s], peak memory [MB] and failures a year of a case."""
    import rbfrag

    started = time.process_time()
    answer = rbfrag.losses(
        folder, Path(folder) / "blocks.csv", component=case.component, samples=case.samples or 1,
        expected=not case.samples,
    )  # fmt: skip
    failures = answer.average_annual_failures
    own = time.process_time() - started
    return own, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0, failures


def main() -> None:
    """Measure and print."""
    options = parser(__doc__.split("\n")[0])
    options.add_argument("--rows", type=int, default=1_000_000)
    given = options.parse_args()
    lines = []
    spawn = multiprocessing.get_context("spawn")
    for case in CASES:
        with tempfile.TemporaryDirectory() as folder, spawn.Pool(1) as pool:
            write_event_set(Path(folder), given.rows, case.sites)
            own, memory, failures = pool.apply(measured, (case, folder))
        lines.append(
            [
                f"{given.rows:,}", str(case.sites), f"{given.rows * BLOCKS // case.sites:,}",
                case.component, str(case.samples or "none"), f"{failures:.3g}", f"{own:.0f} s",
                f"{memory:.0f} MB",
            ]
        )  # fmt: skip
    headers = [
        "rows", "sites", "pairs of row and block", "component", "samples", "failures a year",
        "processor time", "peak memory",
    ]  # fmt: skip
    report("event-losses", markdown((headers, lines)), write=given.write)


if __name__ == "__main__":
    main()
