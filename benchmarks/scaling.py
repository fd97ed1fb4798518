"""Record length, combinations, workers:  python -m benchmarks.scaling"""

from __future__ import annotations

from collections.abc import Sequence

from benchmarks.page import parser, report
from rbfrag.bench import tables
from rbfrag.bench.cases import find_records
from rbfrag.bench.scaling import record_length, workers


def main(arguments: Sequence[str] | None = None) -> None:
    options = parser(__doc__)
    options.add_argument("--times", type=int, nargs="+", default=[1, 2, 4, 8, 16])
    options.add_argument("--workers", type=int, nargs="+", default=[1, 2])
    options.add_argument("--combinations", type=int, nargs="+", default=[24, 48, 96, 192])
    chosen = options.parse_args(arguments)
    records = find_records(chosen.records)
    lengths = record_length(records.motions[0], times=chosen.times)
    by_workers = workers(
        records.motions, processes=chosen.workers, combinations=chosen.combinations
    )
    if chosen.out is not None:
        tables.write_csv(lengths, chosen.out / "record-length.csv")
        tables.write_csv(by_workers, chosen.out / "workers.csv")
    report("record-length", tables.markdown(tables.length_table(lengths)), write=chosen.write)
    report("workers", tables.markdown(tables.workers_table(by_workers)), write=chosen.write)


if __name__ == "__main__":
    main()
