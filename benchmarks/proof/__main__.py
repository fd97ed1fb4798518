"""Brackets proven by validated integration:  python -m benchmarks.proof --rows rows.csv

Needs python-flint (in the extras `dev` and `bench`). Rows are written as they are known; the same
command goes on. `--write` puts the tables into the documentation. The other oracle, heyoka, is
`python -m benchmarks.proof.heyoka_runs`.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

from benchmarks.certify.recordings import recordings
from benchmarks.page import report
from benchmarks.proof import PAGE, brackets


def main(arguments: Sequence[str] | None = None) -> list[brackets.Row]:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--records", help="folder with MANIFEST.csv (RBFRAG_TEST_RECORDS)")
    options.add_argument("--combinations", type=int, default=50)
    options.add_argument("--seed", type=int, default=1)
    options.add_argument(
        "--rows", type=Path, required=True, help="CSV file to write and go on from"
    )
    options.add_argument(
        "--seconds", type=float, default=600.0, help="for all stronger blocks of a combination"
    )
    options.add_argument("--write", action="store_true", help="write the tables into the page")
    chosen = options.parse_args(arguments)
    records = recordings(chosen.records)
    rows = brackets.study(records, chosen.combinations, chosen.seed, chosen.rows, chosen.seconds)
    report("proof", brackets.by_size(rows), write=chosen.write, page=PAGE)
    report("proof-by-combination", brackets.by_combination(rows), write=chosen.write, page=PAGE)
    return rows


if __name__ == "__main__":
    main()
