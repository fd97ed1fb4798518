"""`rbfrag bench`: computing time against error on this machine."""

from __future__ import annotations

import sys

from rbfrag.cli import options
from rbfrag.cli.command import option
from rbfrag.cli.output import print_json, print_pairs, print_table

EXAMPLE = "Example:  rbfrag bench"

CASES = 12
"""Runs by each method: half a minute on a quiet machine, most of it for callbacks in Python."""


def bench(
    *,
    records: str | None = option(
        "Accelerogram file or folder [default: sample records of rbfrag[samples], else analytic "
        "pulses]",
        metavar="PATH",
    ),
    json: options.Json = False,
) -> None:
    """Compare speed and error with general ODE solvers.

    Every method integrates the same blocks, backed by a rock face, under the same records in turns.
    Errors are differences from the rbfrag solution in steps a third as long, times are processor
    times of one thread. The command takes less than a minute.
    """
    import time
    from dataclasses import asdict

    from rbfrag.bench.peers import choose_cases, find_records
    from rbfrag.bench.work_precision import (
        BenchMethod,
        general_methods,
        measure,
        taylor_run,
        work_precision_table,
    )
    from rbfrag.campaign.runner import machine

    started = time.perf_counter()
    about = machine()
    motions = find_records(records)
    cases = choose_cases(motions, CASES)
    print(f"{CASES} runs under {motions.source}, by every method ...", file=sys.stderr, flush=True)
    as_used = BenchMethod("rbfrag", "as used", taylor_run, of_use=True)
    rows = measure(cases, (as_used, *general_methods()))
    seconds = time.perf_counter() - started
    if json:
        print_json(
            {
                "machine": about,
                "records": motions.source,
                "seconds": seconds,
                "work_precision": [asdict(row) for row in rows],
            }
        )
        return
    print_pairs(about)
    print(f"{motions.source}; {seconds:.0f} s in all\n")
    print("Time of one run against its error, the difference from rbfrag in steps a third as long")
    print_table(*work_precision_table(rows))
