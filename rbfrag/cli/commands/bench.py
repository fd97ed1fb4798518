"""`rbfrag bench`: speed against error, on this machine."""

from __future__ import annotations

import sys
from pathlib import Path

from rbfrag.cli.output import print_json, print_pairs, print_table
from rbfrag.cli.parameters import options
from rbfrag.cli.parameters.stack import option, stacked

EXAMPLE = "Example:  rbfrag bench --quick"


@stacked
def bench(
    *,
    quick: bool = option("Reduced set of cases and settings (less than a minute)", False),
    records: str | None = option(
        "Accelerogram file or folder [default: folder in RBFRAG_TEST_RECORDS, else sample "
        "records of rbfrag[samples], else analytic pulses]",
        metavar="PATH",
    ),
    out: str | None = option(
        "Output folder for the tables (CSV) and, with matplotlib, work-precision.svg",
        metavar="FOLDER",
    ),
    json: options.Json = False,
) -> None:
    """Compare speed and error with general ODE solvers.

    Every method integrates the same blocks under the same records in turns and is compared with an
    extended-precision reference, for blocks backed by a rock face and free-standing blocks. The
    critical search and the scaling with record length and number of workers follow. Times are
    processor times of one thread, for workers wall times. Solvers that are not installed are listed
    and skipped.
    """
    from dataclasses import asdict

    from rbfrag.bench import tables
    from rbfrag.bench.run import run_bench
    from rbfrag.errors import InputError, MissingExtraError

    folder = None if out is None else Path(out)
    if folder is not None and not folder.is_dir():
        raise InputError(f"--out: create the folder {folder} first")

    def say(sentence: str) -> None:
        print(sentence, file=sys.stderr, flush=True)

    result = run_bench(records, quick=quick, say=say)
    if folder is not None:
        for name, rows in result.tables().items():
            tables.write_csv(rows, folder / f"{name}.csv")
        try:
            from rbfrag.plots.work_precision import plot_work_precision

            plot_work_precision(result.work_precision, folder / "work-precision.svg")
        except MissingExtraError as error:
            say(f"no figure: {error}")
    if json:
        print_json(asdict(result))
        return
    print_pairs(result.machine)
    print(f"{result.records}; {result.seconds:.0f} s in all")
    for heading, table in (
        ("Time of one run against its error", tables.work_precision_table(result.work_precision)),
        ("The same of free-standing blocks", tables.work_precision_table(result.rocking)),
        ("Critical search", tables.critical_table(result.critical_search)),
        ("Length of the record", tables.length_table(result.record_length)),
        ("Workers", tables.workers_table(result.workers)),
    ):
        print(f"\n{heading}")
        print_table(*table)
    for name in result.not_installed:
        print(f"\nnot compared with, because not installed: {name} (pip install {name})")
