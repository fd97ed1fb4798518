"""Time of whole critical searches and maps, record by record:  python -m benchmarks.search_times"""

from __future__ import annotations

import time
from collections.abc import Sequence

import numpy as np

from benchmarks.page import parser, report
from rbfrag.campaign.bench.cases import find_records
from rbfrag.campaign.plan import DEFAULT_P2
from rbfrag.solver.critical import critical
from rbfrag.solver.results import POLARITIES


def main(arguments: Sequence[str] | None = None) -> None:
    options = parser(__doc__)
    options.add_argument("--every", type=int, default=1, help="take one record in so many")
    chosen = options.parse_args(arguments)
    records = find_records(chosen.records)
    motions = records.motions[:: chosen.every]
    lines = [
        "| work | p² | combinations | median | mean | 90 % | 99 % | certified |",
        "| --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for name, full_map in (("critical search", False), ("search and map", True)):
        critical(motions[0], p2=3.0, full_map=full_map)  # compiles
        seconds: dict[float, list[float]] = {p2: [] for p2 in DEFAULT_P2}
        certified = dict.fromkeys(DEFAULT_P2, 0)
        for motion in motions:
            for polarity in POLARITIES:
                for p2 in DEFAULT_P2:
                    started = time.thread_time()
                    result = critical(motion, p2=p2, polarity=polarity, full_map=full_map)
                    seconds[p2].append(time.thread_time() - started)
                    certified[p2] += result.certified
        for label, sizes in (*((f"{p2:g}", (p2,)) for p2 in DEFAULT_P2), ("all", DEFAULT_P2)):
            ms = 1e3 * np.concatenate([seconds[p2] for p2 in sizes])
            middle, high, highest = np.quantile(ms, (0.5, 0.9, 0.99))
            lines.append(
                f"| {name} | {label} | {ms.size} | {middle:.3g} ms | {ms.mean():.3g} ms "
                f"| {high:.3g} ms | {highest:.3g} ms | {sum(certified[p2] for p2 in sizes)} |"
            )
    about = f"{len(motions)} of {records.source}, both polarities, as the files have them."
    report("search-times", "\n".join([*lines, "", about]), write=chosen.write)


if __name__ == "__main__":
    main()
