"""Time of the response models per moving sample:  python -m benchmarks.models_speed

The runs of all models are interleaved on the same records, in one process, and compared by
processor time, so that the ratios depend little on the machine. The mechanism of a block is made
once, as a campaign would.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence

import numpy as np

from benchmarks.page import find_records, markdown, parser, report
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.excitation import Excitation, excitation
from rbfrag.solver.integrator.one_freedom.equation import Mechanism
from rbfrag.solver.integrator.one_freedom.follow import follow
from rbfrag.solver.kind import SupportedBlock
from rbfrag.solver.models import confined_toppling, rocking, sliding, slumping
from rbfrag.solver.respond import block_of_numbers
from rbfrag.solver.rocking_run import simulate
from rbfrag.solver.toppling_run import runner

REPEATS = 7

LEAST_MOVED = 100
"""Runs of fewer moving samples are left out: their time is that of getting started."""

Run = Callable[[], int]


def main(arguments: Sequence[str] | None = None) -> None:
    chosen = parser(__doc__).parse_args(arguments)
    found = find_records(chosen.records)
    ratios: dict[str, list[float]] = {}
    times: dict[str, list[float]] = {}
    for motion in found.motions:
        excited = excitation(motion)
        runs = models(excited)
        moved = {name: run() for name, run in runs.items()}
        spent = dict.fromkeys(runs, math.inf)
        for _ in range(REPEATS):
            for name, run in runs.items():
                start = time.process_time_ns()
                run()
                spent[name] = min(spent[name], time.process_time_ns() - start)
        if moved["toppling"] < LEAST_MOVED:
            continue
        base = spent["toppling"] / moved["toppling"]
        for name, of in spent.items():
            if moved[name] >= LEAST_MOVED:
                times.setdefault(name, []).append(of / moved[name])
                ratios.setdefault(name, []).append(of / moved[name] / base)
    cells = [
        [
            name.replace("_", " "),
            str(len(of)),
            f"{np.median(times[name]):.0f} ns",
            f"{np.median(of):.2g}",
            f"{np.quantile(of, 0.9):.2g}",
        ]
        for name, of in ratios.items()
    ]
    headers = ["model", "runs", "a moving sample", "over toppling, median", "90 %"]
    text = markdown((headers, cells)) + f"\n\n{found.source}."
    report("models-speed", text, write=chosen.write)


def models(excited: Excitation) -> dict[str, Run]:
    """Return runs of blocks whose strength is a fifth of PGA, or a little less, by model."""
    k = 0.2 * excited.pga_g
    topple = runner(excited, p2=3.0)
    stands = rocking.free_block(block_of_numbers(3.0, k, {}))
    mechanisms = {
        "sliding": sliding.mechanism(planes(None, 0.0, math.degrees(math.atan(k)))),
        "slumping": slumping.mechanism(at_strength(Block.from_angles(45, 65, 2.0), k, slumping)),
        "confined_toppling": confined_toppling.mechanism(
            at_strength(Block.from_angles(-60, 20, 1.0), k, confined_toppling)
        ),
    }

    def runs(mechanism: Mechanism) -> Run:
        return lambda: follow(mechanism, excited).samples_moved

    return {
        "toppling": lambda: topple(k).samples_moved,
        "rocking": lambda: simulate(excited, stands).samples_moved,
        **{name: runs(mechanism) for name, mechanism in mechanisms.items()},
    }


def planes(block: Block | None, beta_deg: float, phi_deg: float) -> SupportedBlock:
    phi = math.radians(phi_deg)
    return SupportedBlock(
        block=block,
        beta_rad=math.radians(beta_deg),
        phi_rad=phi,
        phi_back_rad=phi,
        back_fracture=block is not None,
        cohesive=False,
        yield_g=None,
        settings={},
    )


def at_strength(block: Block, k: float, model: object) -> SupportedBlock:
    """Return the planes, with friction of 35 degrees, on which a block yields at k."""
    low, high = -30.0, 60.0
    for _ in range(40):
        middle = 0.5 * (low + high)
        mechanism = model.mechanism(planes(block, middle, 35.0))  # type: ignore[attr-defined]
        if mechanism.first.forward.threshold(0.0) > k:
            low = middle
        else:
            high = middle
    return planes(block, low, 35.0)


if __name__ == "__main__":
    main()
