"""Time of whole critical searches and maps, record by record:  python -m benchmarks.search_times"""

from __future__ import annotations

import time
from collections.abc import Sequence

import numpy as np

from benchmarks.page import find_records, markdown, parser, report
from rbfrag.solver.critical_result import CriticalResult
from rbfrag.solver.results import DEFAULT_P2, POLARITIES
from rbfrag.solver.search.critical import critical


def main(arguments: Sequence[str] | None = None) -> None:
    options = parser(__doc__)
    options.add_argument("--every", type=int, default=1, help="take one record in so many")
    chosen = options.parse_args(arguments)
    records = find_records(chosen.records)
    motions = records.motions[:: chosen.every]
    rows = []
    for name, full_map in (("critical search", False), ("search and map", True)):
        critical(motions[0], p2=3.0, full_map=full_map)  # compiles
        seconds: dict[float, list[float]] = {p2: [] for p2 in DEFAULT_P2}
        results: dict[float, list[CriticalResult]] = {p2: [] for p2 in DEFAULT_P2}
        for motion in motions:
            for polarity in POLARITIES:
                for p2 in DEFAULT_P2:
                    started = time.thread_time()
                    result = critical(motion, p2=p2, polarity=polarity, full_map=full_map)
                    seconds[p2].append(time.thread_time() - started)
                    results[p2].append(result)
        for label, sizes in (*((f"{p2:g}", (p2,)) for p2 in DEFAULT_P2), ("all", DEFAULT_P2)):
            ms = 1e3 * np.concatenate([seconds[p2] for p2 in sizes])
            quantiles = np.quantile(ms, (0.5, 0.9, 0.99))
            of_sizes = [result for p2 in sizes for result in results[p2]]
            times = (quantiles[0], ms.mean(), *quantiles[1:])
            rows.append([
                name, label, str(ms.size), *(f"{value:.3g} ms" for value in times),
                str(sum(result.certified for result in of_sizes)),
                f"{np.mean([result.n_runs for result in of_sizes]):,.0f}",
            ])  # fmt: skip
    headers = ["work", "p²", "combinations", "median", "mean", "90 %", "99 %", "certified",
               "trajectories, mean"]  # fmt: skip
    about = f"{len(motions)} of {records.source}, both polarities, as the files have them."
    report("search-times", f"{markdown((headers, rows))}\n\n{about}", write=chosen.write)


if __name__ == "__main__":
    main()
