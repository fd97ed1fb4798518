"""How long two versions of rbfrag take:  python -m benchmarks.old_and_new --old CHECKOUT.

Each version runs the same work in a process of its own, in turns; times are processor times, the
least of all turns, compiling left out. Only public functions are called, so that an older checkout
can be timed. `--write` keeps the table.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

import rbfrag

TURNS = 5
P2 = (30.0, 3.0, 0.3)


def main(arguments: Sequence[str] | None = None) -> None:
    from benchmarks.page import parser, report

    options = parser(__doc__)
    options.add_argument("--old", type=Path, required=True, help="checkout of the older version")
    chosen = options.parse_args(arguments)
    root = Path(__file__).resolve().parent.parent
    folder = chosen.records or str(Path(rbfrag.__file__).parent / "samples")
    times: dict[Path, list[dict[str, float]]] = {chosen.old.resolve(): [], root: []}
    for turn in range(TURNS):
        print(f"turn {turn + 1} of {TURNS}", file=sys.stderr, flush=True)
        for checkout, measured in times.items():
            environment = {**os.environ, "PYTHONPATH": str(checkout)}
            child = [sys.executable, __file__, folder]
            done = subprocess.run(
                child, cwd=checkout, env=environment, check=True, capture_output=True, text=True
            )
            measured.append(json.loads(done.stdout))
    old, new = (
        {name: min(one[name] for one in measured) for name in measured[0]}
        for measured in times.values()
    )
    rows = [f"| {name} | {1e3 * new[name]:.3g} ms | {new[name] / old[name]:.2f} |" for name in old]
    head = "| work | now | over the older version |\n| --- | --- | --- |"
    report("old-and-new", "\n".join([head, *rows]), write=chosen.write)


def measure(folder: str) -> dict[str, float]:
    """Return the processor time of each kind of work [s]."""
    motions: list[Any] = []
    for file in sorted(each for each in Path(folder).rglob("*") if each.is_file())[::5]:
        try:
            read = rbfrag.read_motions(file)
        except rbfrag.RbfragError:
            continue  # manifests and read-mes lie beside the records
        usable = (each for each in read if each.is_vertical is not True and each.npts > 1)
        motions += [each for each in usable if each.acceleration_g.any()][:1]
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
        "1,000 predictions": lambda: [rbfrag.predict(3.0, 0.1, pgv_m_s=0.6) for _ in range(1000)],
        "an array of 1,000,000 predictions": lambda: rbfrag.predict(3.0, kr_table, pgv_m_s=0.6),
    }
    times = {}
    for name, work in works.items():
        work()  # compiles
        times[name] = min(processor_time_s(work) for _ in range(3))
    return times


def processor_time_s(work: Callable[[], object]) -> float:
    begin = time.process_time()
    work()
    return time.process_time() - begin


if __name__ == "__main__":
    # of the older version only the package is read: the work is that of this file
    if len(sys.argv) == 2 and not sys.argv[1].startswith("-"):
        print(json.dumps(measure(sys.argv[1])))
    else:
        main()
