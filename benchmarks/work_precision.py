"""Time of one run against its error, for every method:  python -m benchmarks.work_precision"""

from __future__ import annotations

import sys
from collections.abc import Sequence

from benchmarks.page import FIGURE, parser, report
from rbfrag.bench import tables
from rbfrag.bench.cases import choose_cases, find_records
from rbfrag.bench.methods import (
    methods,
    missing_peers,
    rocking_methods,
    rocking_reference_run,
)
from rbfrag.bench.work_precision import measure
from rbfrag.plots.work_precision import plot_work_precision


def main(arguments: Sequence[str] | None = None) -> None:
    options = parser(__doc__)
    options.add_argument("--cases", type=int, default=24)
    options.add_argument("--seed", type=int, default=1)
    options.add_argument("--quick", action="store_true", help="leave out the slowest settings")
    options.add_argument("--only", nargs="+", help="methods whose name holds one of these words")
    chosen = options.parse_args(arguments)
    records = find_records(chosen.records)
    cases = choose_cases(records, chosen.cases, seed=chosen.seed)
    rows = measure(
        cases,
        [
            method
            for method in methods(quick=chosen.quick)
            if method.of_use or not chosen.only or any(w in method.name for w in chosen.only)
        ],
        seed=chosen.seed,
        on_case=lambda done, total: print(f"{done}/{total}", file=sys.stderr),
    )
    for name in missing_peers():
        print(f"not installed: {name}", file=sys.stderr)
    rocking = measure(
        cases, rocking_methods(quick=chosen.quick), judge=rocking_reference_run, seed=chosen.seed
    )
    if chosen.out is not None:
        tables.write_csv(rocking, chosen.out / "work-precision-rocking.csv")
        tables.write_csv(rows, chosen.out / "work-precision.csv")
        plot_work_precision(rows, chosen.out / "work-precision.png")
    if chosen.write:
        plot_work_precision(rows, FIGURE)
    about = f"{len(cases)} runs under {records.source}, seed {chosen.seed}."
    for name, measured in (("work-precision", rows), ("work-precision-rocking", rocking)):
        table = tables.markdown(tables.work_precision_table(measured))
        report(name, f"{table}\n\n{about}", write=chosen.write)


if __name__ == "__main__":
    main()
