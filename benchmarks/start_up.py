"""Start-up, with and without compiled kernels on disk:  python -m benchmarks.start_up"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from statistics import median

from benchmarks.page import ROOT, parser, report
from rbfrag.bench.tables import markdown, seconds

PULSE = "from rbfrag.motions.pulses import reversal_pulse; m = reversal_pulse(0.4, 0.5, 1.0, 0.005)"
RESPOND = f"from rbfrag.solver.toppling_run import respond; {PULSE}; respond(m, p2=3, kr=0.1)"
CRITICAL = f"from rbfrag.solver.search.critical import critical; {PULSE}; critical(m, p2=3)"
NUMBA = "import numba"

STEPS = (
    ("Python starts and ends", "pass", False),
    ("… and imports rbfrag", "import rbfrag", False),
    ("… and imports numba", NUMBA, False),
    ("… and makes one run, kernels on disk", RESPOND, False),
    ("… and makes one critical search, kernels on disk", CRITICAL, False),
    ("… and makes one run, first call after installation", RESPOND, True),
    ("… and makes one critical search, first call after installation", CRITICAL, True),
)


def main(arguments: Sequence[str] | None = None) -> None:
    options = parser(__doc__)
    options.add_argument("--repeat", type=int, default=5, help="starts of each kind")
    options.add_argument(
        "--no-cold", action="store_true", help="compile nothing anew, use what is on disk"
    )
    chosen = options.parse_args(arguments)
    cells = []
    with tempfile.TemporaryDirectory() as new:
        warm = os.environ.get("NUMBA_CACHE_DIR", "") if chosen.no_cold else new
        for name, code, cold in STEPS:
            if cold and chosen.no_cold:
                continue
            if not cold:
                started(code, warm)  # what is to be on disk gets there
            times = [
                started(code, None if cold else warm) for _ in range(2 if cold else chosen.repeat)
            ]
            cells.append([name, seconds(median(times)), seconds(min(times))])
    cells.append(["`import rbfrag` alone", *import_alone(chosen.repeat)])
    report("start-up", markdown((["process", "median", "least"], cells)), write=chosen.write)


def started(code: str, kernels: str | None) -> float:
    """Wall time of one process.

    Args:
        code: what it does.
        kernels: folder of compiled code; None for a new one, empty for numba's own choice.
    """
    with tempfile.TemporaryDirectory() as empty:
        environment = {
            **os.environ,
            "PYTHONPATH": str(ROOT),
            "NUMBA_CACHE_DIR": empty if kernels is None else kernels,
        }  # fmt: skip
        before = time.perf_counter()
        subprocess.run([sys.executable, "-c", code], check=True, env=environment)
        return time.perf_counter() - before


def import_alone(repeat: int) -> tuple[str, str]:
    """Time of the import statement, measured inside new processes."""
    code = "import time; t = time.perf_counter(); import rbfrag; print(time.perf_counter() - t)"
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    times = [
        float(
            subprocess.run(
                [sys.executable, "-c", code], check=True, env=environment, capture_output=True
            ).stdout
        )
        for _ in range(repeat)
    ]
    return seconds(median(times)), seconds(min(times))


if __name__ == "__main__":
    main()
