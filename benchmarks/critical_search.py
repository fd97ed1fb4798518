"""The critical search against 23 runs of the same blocks:  python -m benchmarks.critical_search"""

from __future__ import annotations

import sys
from collections.abc import Sequence

from benchmarks.page import parser, report
from rbfrag.bench import tables
from rbfrag.bench.cases import choose_combinations, find_records
from rbfrag.bench.critical_search import compare_searches


def main(arguments: Sequence[str] | None = None) -> None:
    options = parser(__doc__)
    options.add_argument("--combinations", type=int, default=12)
    options.add_argument("--seed", type=int, default=1)
    options.add_argument("--rtol", type=float, nargs="+", default=[1e-6, 1e-8])
    chosen = options.parse_args(arguments)
    records = find_records(chosen.records)
    combinations = choose_combinations(records, chosen.combinations, seed=chosen.seed)
    rows = compare_searches(
        combinations,
        tolerances=chosen.rtol,
        seed=chosen.seed,
        on_combination=lambda done, total: print(f"{done}/{total}", file=sys.stderr),
    )
    if chosen.out is not None:
        tables.write_csv(rows, chosen.out / "critical-search.csv")
    about = f"{len(combinations)} combinations of {records.source}, seed {chosen.seed}."
    report(
        "critical-search",
        f"{tables.markdown(tables.critical_table(rows))}\n\n{about}",
        write=chosen.write,
    )


if __name__ == "__main__":
    main()
