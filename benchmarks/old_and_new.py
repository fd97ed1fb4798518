"""How long two versions of rbfrag take:  python -m benchmarks.old_and_new --old CHECKOUT.

Each version runs the same work in a process of its own, in turns; times are processor times, the
least of all turns, compiling left out. The losses of 10,000,000 pairs and the demo without compiled
kernels, in wall time, are measured in the first turn alone. Only public functions are called, so
that an older checkout can be timed. `--write` keeps the table.
"""

from __future__ import annotations

import json
import os
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

import rbfrag
from rbfrag.motions.sample_motions import sample_folder

TURNS = 5
ONCE_A_TURN_S = 1.0
"""Time of a work above which it is measured once a turn."""

P2 = (30.0, 3.0, 0.3)
HELP_OF = ("block", "hazard", "losses", "models", "motions", "simulate", "survival")

SHELL = (
    sys.executable, "-c",
    "import sys; from rbfrag.cli.main import run; sys.argv[0] = 'rbfrag'; run()",
)  # fmt: skip
PAIRS, DEMO = "losses of 10,000,000 pairs with exceedance curves", "rbfrag demo, nothing compiled"


def main(arguments: Sequence[str] | None = None) -> None:
    from benchmarks.page import parser, report
    from rbfrag.bench.work_precision import seconds

    options = parser(__doc__)
    options.add_argument("--old", type=Path, required=True, help="checkout of the older version")
    options.add_argument("--turns", type=int, default=TURNS, help=f"turns [default: {TURNS}]")
    options.add_argument("--short", action="store_true", help="without the long works")
    chosen = options.parse_args(arguments)
    root = Path(__file__).resolve().parent.parent
    folder = chosen.records or str(sample_folder())
    times: dict[Path, list[dict[str, float]]] = {chosen.old.resolve(): [], root: []}
    once: dict[Path, dict[str, float]] = {}
    facts = []
    for turn in range(chosen.turns):
        print(f"turn {turn + 1} of {chosen.turns}", file=sys.stderr, flush=True)
        for checkout, measured in times.items():
            measured.append(json.loads(measured_in(checkout, folder)))
            if turn == 0 and not chosen.short:
                pairs = json.loads(measured_in(checkout, "pairs"))
                once[checkout] = {PAIRS: pairs["seconds"], DEMO: cold_demo_s(checkout)}
                name = "new" if checkout == root else "old"
                facts.append(f"{name}: {pairs['failures']!r} failures a year, {pairs['mb']:.0f} MB")
    old, new = (
        {name: min(seconds[name] for seconds in measured) for name in measured[0]}
        | once.get(checkout, {})
        for checkout, measured in times.items()
    )
    rows = [
        f"| {name} | {seconds(old[name])} | {seconds(new[name])} | {new[name] / old[name]:.2f} |"
        for name in old
    ]
    head = "| work | older version | now | ratio |\n| --- | --- | --- | --- |"
    if facts:
        rows.append(f"\nThe 10,000,000 pairs, {'; '.join(facts)}.")
    report("old-and-new", "\n".join([head, *rows]), write=chosen.write)


def measured_in(checkout: Path, work: str) -> str:
    """Return what a process of a version prints about some work."""
    # without the folder of this file: its coverage.py would hide the package of that name
    child = [sys.executable, "-P", __file__, work]
    environment = {**os.environ, "PYTHONPATH": str(checkout), "RBFRAG_DB": ""}
    environment.pop("OPENBLAS_NUM_THREADS", None)  # as a user of Python has it
    process = subprocess.run(
        child, cwd=checkout, env=environment, check=True, stdout=subprocess.PIPE, text=True
    )
    return process.stdout


def cold_demo_s(checkout: Path) -> float:
    """Return the wall time of the demo where no kernel is compiled [s]."""
    with tempfile.TemporaryDirectory() as kernels, tempfile.TemporaryDirectory() as folder:
        environment = {
            **os.environ, "PYTHONPATH": str(checkout), "NUMBA_CACHE_DIR": kernels, "RBFRAG_DB": "",
        }  # fmt: skip
        begin = time.perf_counter()
        subprocess.run(
            [*SHELL, "demo"], cwd=folder, env=environment, check=True, stdout=subprocess.DEVNULL
        )
        return time.perf_counter() - begin


def measure(folder: str) -> dict[str, float]:
    """Return the processor time of each kind of work [s]."""
    motions: list[Any] = []
    for file in sorted(item for item in Path(folder).rglob("*") if item.is_file())[::5]:
        try:
            read = rbfrag.read_motions(file)
        except rbfrag.RbfragError:
            continue  # manifests and read-mes lie beside the records
        suitable = (item for item in read if item.is_vertical is not True and item.npts > 1)
        motions += [item for item in suitable if item.acceleration_g.any()][:1]
    motions = motions[:12]
    slope: dict[str, Any] = {"beta_deg": 0.0, "phi_deg": 35.0}
    slump = rbfrag.Block.from_fractures(0.5, 0.2, 30.0)
    tips = rbfrag.Block.from_fractures(1.0, 0.6, 45.0)

    def runs(**request: Any) -> Callable[[], None]:
        def work() -> None:
            for motion in motions:
                for p2 in P2:
                    kr = 0.3 * motion.pga_g
                    rbfrag.respond(motion, p2=p2, kr=kr, **request)

        return work

    def slides() -> None:
        for motion in motions:
            for ratio in (0.1, 0.3, 0.6):
                rbfrag.respond(motion, ky=ratio * motion.pga_g)

    def searches() -> None:
        for motion in motions:
            # an excitation that was worked out before is kept with its motion
            again = rbfrag.GroundMotion(acceleration_g=motion.acceleration_g, dt_s=motion.dt_s)
            for p2 in P2:
                rbfrag.critical(again, p2=p2)

    built_in = Path(rbfrag.__file__).parent / "reference" / "reference.db"
    place = tempfile.TemporaryDirectory()  # a fit is stored: not in the file that is shipped
    database = shutil.copy(built_in, place.name)
    subprocess.run([*SHELL, "db", "upgrade", "--db", database], check=True, capture_output=True)

    def fits() -> None:
        rbfrag.fit(db=database, term="pgv_pga", name="timed", replace=True)

    def shapes(block: Any, **planes: Any) -> Callable[[], None]:
        def work() -> None:
            for motion in motions:
                rbfrag.respond(motion, block=block, **planes)

        return work

    kr_table = np.geomspace(0.05, 0.5, 1_000_000)
    works: dict[str, Callable[[], object]] = {
        f"{len(motions) * len(P2)} topples": runs(),
        f"{len(motions) * len(P2)} rocking blocks": runs(kind="rocking", restitution=0.9),
        f"{len(motions) * 3} slides": slides,
        f"{len(motions)} slumps": shapes(slump, **slope),
        f"{len(motions)} slides of a block that tips back": shapes(tips, beta_deg=30, phi_deg=40),
        f"{len(motions) * len(P2)} critical values": searches,
        "fit of the built-in outcomes": fits,
        "losses of 500,000 pairs with exceedance curves": all_failures,
        **{f"rbfrag {word} --help": (lambda word=word: show_help(word)) for word in HELP_OF},
        "1,000 predictions": lambda: [rbfrag.predict(3.0, 0.1, pgv_m_s=0.6) for _ in range(1000)],
        "an array of 1,000,000 predictions": lambda: rbfrag.predict(3.0, kr_table, pgv_m_s=0.6),
    }
    times = {}
    for name, work in works.items():
        work()  # compiles
        first = processor_time_s(work)
        again = 0 if first > ONCE_A_TURN_S else 2
        times[name] = min([first, *(processor_time_s(work) for _ in range(again))])
    return times


def all_failures(events: int = 500) -> Any:
    """Return the failures of 1,000 blocks in events at 100 sites, with exceedance curves."""
    from benchmarks.region import event_set
    from rbfrag.hazards.losses import event_losses

    return event_losses(*event_set(events, 100, 1000), samples=100)


def failures_of_all_pairs() -> dict[str, float]:
    """Return processor time [s], peak memory [MB] and annual failures of 10,000,000 pairs."""
    all_failures(20)  # compiles
    begin = time.process_time()
    answer = all_failures(10_000)
    seconds = time.process_time() - begin
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3
    return {"seconds": seconds, "mb": peak, "failures": answer.average_annual_failures}


def show_help(*words: str) -> None:
    subprocess.run([*SHELL, *words, "--help"], check=True, stdout=subprocess.DEVNULL)


def processor_time_s(work: Callable[[], object]) -> float:
    """Return the processor time of this process and of those that it waits for [s]."""

    def until_now() -> float:
        of_children = resource.getrusage(resource.RUSAGE_CHILDREN)
        return time.process_time() + of_children.ru_utime + of_children.ru_stime

    begin = until_now()
    work()
    return until_now() - begin


if __name__ == "__main__":
    # of the older version only the package is read: the work is that of this file
    if len(sys.argv) == 2 and not sys.argv[1].startswith("-"):
        word = sys.argv[1]
        print(json.dumps(failures_of_all_pairs() if word == "pairs" else measure(word)))
    else:
        main()
