"""Time of one run against its error, for every method:  python -m benchmarks.work_precision"""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from functools import partial

from benchmarks.cvode import CVODE_INSTALL, cvode_is_installed, cvode_run
from benchmarks.page import FIGURE, find_records, markdown, parser, report, write_csv
from benchmarks.reference import reference
from benchmarks.rocking_peer import rocking_methods, rocking_reference
from benchmarks.work_precision_figure import plot_work_precision
from rbfrag.bench.cases import choose_cases
from rbfrag.bench.work_precision import (
    BenchMethod,
    general_methods,
    measure,
    taylor_run,
    work_precision_table,
)
from rbfrag.solver.integrator.taylor import ORDER, PH_MAX

UNSPLIT = math.inf


def methods() -> tuple[BenchMethod, ...]:
    """Return every available method."""
    settings = tuple(
        BenchMethod(
            "rbfrag, unsplit" if ph_max == UNSPLIT else f"rbfrag, p·h ≤ {ph_max:g}",
            f"order {order}",
            partial(taylor_run, order=order, ph_max=ph_max),
            of_use=(order, ph_max) == (ORDER, PH_MAX),
        )
        for ph_max in (UNSPLIT, PH_MAX, PH_MAX / 3.0)
        for order in (4, 5, 6, ORDER)
    )
    tolerances = (1e-6, 1e-8, 1e-10) if cvode_is_installed() else ()
    cvode = tuple(
        BenchMethod("CVODE in Python", f"rtol {rtol:.0e}", partial(cvode_run, rtol=rtol))
        for rtol in tolerances
    )
    return (*settings, *general_methods(), *cvode)


def main(arguments: Sequence[str] | None = None) -> None:
    options = parser(__doc__)
    options.add_argument("--cases", type=int, default=24)
    options.add_argument("--seed", type=int, default=1)
    options.add_argument("--only", nargs="+", help="methods whose name holds one of these words")
    chosen = options.parse_args(arguments)
    records = find_records(chosen.records)
    cases = choose_cases(records, chosen.cases, seed=chosen.seed)
    rows = measure(
        cases,
        [
            method
            for method in methods()
            if method.of_use
            or not chosen.only
            or any(word in f"{method.family}, {method.setting}" for word in chosen.only)
        ],
        judge=reference,
        seed=chosen.seed,
        on_case=lambda number, total: print(f"{number}/{total}", file=sys.stderr),
    )
    if not cvode_is_installed():
        print(f"not installed: {CVODE_INSTALL}", file=sys.stderr)
    rocking = measure(cases, rocking_methods(), judge=rocking_reference, seed=chosen.seed)
    if chosen.out is not None:
        write_csv(rocking, chosen.out / "work-precision-rocking.csv")
        write_csv(rows, chosen.out / "work-precision.csv")
        plot_work_precision(rows, chosen.out / "work-precision.png")
    if chosen.write:
        plot_work_precision(rows, FIGURE)
    about = f"{len(cases)} runs under {records.source}, seed {chosen.seed}."
    for name, measured in (("work-precision", rows), ("work-precision-rocking", rocking)):
        table = markdown(work_precision_table(measured))
        report(name, f"{table}\n\n{about}", write=chosen.write)


if __name__ == "__main__":
    main()
