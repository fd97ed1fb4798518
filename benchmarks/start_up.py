"""Start-up, with and without compiled kernels on disk:  python -m benchmarks.start_up"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
from collections.abc import Callable, Sequence
from functools import partial
from statistics import median

from benchmarks.page import ROOT, markdown, parser, report
from rbfrag.bench.work_precision import seconds

PULSE = (
    "from rbfrag.motions.sample_motions import reversal_pulse; "
    "m = reversal_pulse(0.4, 0.5, 1.0, 0.005)"
)
RESPOND = f"from rbfrag.solver.toppling_run import respond; {PULSE}; respond(m, p2=3, kr=0.1)"
CRITICAL = f"from rbfrag.solver.search.critical import critical; {PULSE}; critical(m, p2=3)"
SIMULATE = f"""
import os, tempfile
import rbfrag
from rbfrag.motions.readers import export_motions
{PULSE}
os.chdir(tempfile.mkdtemp())
export_motions([m], "pulse.csv")
rbfrag.add_motions(["pulse.csv"], db="first.db", raw=True)
rbfrag.simulate(db="first.db", jobs=1)
"""
NUMBA = "import numba"

STEPS = (
    ("Python starts and ends", "pass", False),
    ("… and imports rbfrag", "import rbfrag", False),
    ("… and imports numba", NUMBA, False),
    ("… and makes one run, kernels on disk", RESPOND, False),
    ("… and makes one critical search, kernels on disk", CRITICAL, False),
    ("… and simulates one motion for six sizes of block, kernels on disk", SIMULATE, False),
    ("… and makes one run, first call after installation", RESPOND, True),
    ("… and makes one critical search, first call after installation", CRITICAL, True),
    ("… and simulates one motion, first call after installation", SIMULATE, True),
)


QUESTION = ("predict", "--p2", "3", "--kr", "0.1", "--pgv", "0.6")
TYPER = '`python -c "import typer"`'
SHELL = {
    TYPER: ("import typer", ()),
    "`rbfrag --version`": ("from rbfrag.cli.main import run; run()", ("--version",)),
    "`rbfrag --help`": ("from rbfrag.cli.main import run; run()", ("--help",)),
    "`rbfrag predict`": ("from rbfrag.cli.main import run; run()", QUESTION),
}


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
    report(
        "start-up",
        markdown((["process", "processor time, median", "least"], cells)),
        write=chosen.write,
    )
    head = ["command", "median", "least", "over `import typer`"]
    report("shell-start", markdown((head, shell(4 * chosen.repeat))), write=chosen.write)


def shell(repeat: int) -> list[list[str]]:
    """Return processor times of commands, which take turns with `import typer`."""
    times: dict[str, list[float]] = {name: [] for name in SHELL}
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    for _ in range(repeat + 1):
        for name, (code, arguments) in SHELL.items():
            program = f"import sys; sys.argv[0] = 'rbfrag'; {code}"
            command = [sys.executable, "-c", program, *arguments]
            run = partial(subprocess.run, command, check=True, env=environment, capture_output=True)
            times[name].append(processor_time(run))
    typer = median(times[TYPER][1:])
    return [
        [name, seconds(median(runs[1:])), seconds(min(runs)), f"{median(runs[1:]) / typer:.2f}"]
        for name, runs in times.items()
    ]


def started(code: str, kernels: str | None) -> float:
    """Processor time of one process and its workers.

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
        program = [sys.executable, "-c", code]
        return processor_time(lambda: subprocess.run(program, check=True, env=environment))


def processor_time(work: Callable[[], object]) -> float:
    """Processor time of the processes that some work starts and waits for."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    work()
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


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
