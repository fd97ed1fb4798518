"""How long two versions of rbfrag take:  python -m benchmarks.old_and_new --old CHECKOUT.

Each version runs the same work in a process of its own, in turns; times are processor times, the
least of all turns, compiling left out. Only public functions are called, so that an older checkout
can be timed. `--write` keeps the table.
"""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

import rbfrag

TURNS = 5
ONCE_A_TURN_S = 1.0
"""Time of a work above which it is measured once a turn."""

P2 = (30.0, 3.0, 0.3)


def main(arguments: Sequence[str] | None = None) -> None:
    from benchmarks.page import parser, report

    options = parser(__doc__)
    options.add_argument("--old", type=Path, required=True, help="checkout of the older version")
    options.add_argument("--turns", type=int, default=TURNS, help=f"turns [default: {TURNS}]")
    chosen = options.parse_args(arguments)
    root = Path(__file__).resolve().parent.parent
    folder = chosen.records or str(Path(rbfrag.__file__).parent / "samples")
    times: dict[Path, list[dict[str, float]]] = {chosen.old.resolve(): [], root: []}
    for turn in range(chosen.turns):
        print(f"turn {turn + 1} of {chosen.turns}", file=sys.stderr, flush=True)
        for checkout, measured in times.items():
            environment = {
                **os.environ, "PYTHONPATH": str(checkout), "OPENBLAS_NUM_THREADS": "1",
                "RBFRAG_DB": "",
            }  # fmt: skip
            # without the folder of this file: its coverage.py would hide the package of that name
            child = [sys.executable, "-P", __file__, folder]
            process = subprocess.run(
                child, cwd=checkout, env=environment, check=True, capture_output=True, text=True
            )
            measured.append(json.loads(process.stdout))
    old, new = (
        {name: min(seconds[name] for seconds in measured) for name in measured[0]}
        for measured in times.values()
    )
    rows = [f"| {name} | {1e3 * new[name]:.3g} ms | {new[name] / old[name]:.2f} |" for name in old]
    head = "| work | now | over the older version |\n| --- | --- | --- |"
    report("old-and-new", "\n".join([head, *rows]), write=chosen.write)


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
        "fit of the built-in outcomes": lambda: rbfrag.fit(term="pgv_pga"),
        "losses of 500,000 pairs with exceedance curves": all_failures,
        "rbfrag block --help": lambda: show_help("block"),
        "rbfrag hazard --help": lambda: show_help("hazard"),
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


def all_failures() -> object:
    """Return the failures of 500,000 pairs of block and earthquake, with exceedance curves."""
    from benchmarks.region import event_set
    from rbfrag.hazards.losses import event_losses

    return event_losses(*event_set(500, 100, 1000), samples=100)


def show_help(*words: str) -> None:
    program = "import sys; from rbfrag.cli.main import run; sys.argv[0] = 'rbfrag'; run()"
    child = [sys.executable, "-c", program, *words, "--help"]
    subprocess.run(child, check=True, stdout=subprocess.DEVNULL)


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
        print(json.dumps(measure(sys.argv[1])))
    else:
        main()
