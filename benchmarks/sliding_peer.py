"""Sliding displacements beside pyslammer's rigid analysis:  python -m benchmarks.sliding_peer

pyslammer (GPL-3.0, extra `samples`) is run here, beside rbfrag, and imported nowhere else. It
integrates at the samples: a slide starts and stops at a sample, and the last part of a step in
which it stops is left out. The same records with straight lines between more and more samples show
that this is all of the difference, but for one thing: a block slower than 1e-5 m/s is not braked
there, and creeps on until the ground drives it again. That is at most 1e-5 m/s times the length of
the record, which matters beside displacements of less than a millimetre.
"""

from __future__ import annotations

from collections.abc import Sequence
from importlib import import_module

import numpy as np

from benchmarks.page import ROOT, find_records, markdown, parser, report
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.solver.respond import respond

PAGE = ROOT / "docs" / "theory" / "sliding.md"

YIELDS = (0.05, 0.1, 0.2, 0.4)
"""Yield acceleration over PGA."""

REFINED = (1, 4, 16)
"""Samples that one of the record becomes."""

CREEP_M_S = 1e-5
"""Speed below which pyslammer 0.2.2 does not brake a block (`tol` in its rigid analysis)."""

LEAST_M = 1e-4
"""Displacements below are not compared: they are a few samples long."""


def main(arguments: Sequence[str] | None = None) -> None:
    options = parser(__doc__)
    options.add_argument("--most", type=int, default=18, help="records to compare")
    chosen = options.parse_args(arguments)
    records = find_records(chosen.records)
    motions = [motion for motion in records.motions if motion.dt_s is not None][: chosen.most]
    errors: dict[int, list[float]] = {fine: [] for fine in REFINED}
    beyond: dict[int, list[float]] = {fine: [] for fine in REFINED}
    for motion in motions:
        for share in YIELDS:
            ky = share * motion.pga_g
            ours = respond(motion, ky=ky).displacement_m
            if ours is None or ours < LEAST_M:
                continue
            for fine in REFINED:
                error_m = abs(peer(motion, ky, fine) - ours)
                errors[fine].append(error_m / ours)
                crept_m = CREEP_M_S * motion.duration_s
                beyond[fine].append(max(error_m - crept_m, 0.0) / ours)
    cells = [
        [
            "as recorded" if fine == 1 else f"{fine} times as many",
            str(len(of)),
            *(
                f"{100.0 * value:.2g} %"
                for value in (np.median(of), np.max(of), np.max(beyond[fine]))
            ),
        ]
        for fine, of in errors.items()
    ]
    headers = ["samples", "cases", "median difference", "greatest", "beyond creep"]
    text = markdown((headers, cells))
    text += (
        f"\n\n{len(motions)} records, k_y/PGA of {', '.join(map(str, YIELDS))}; {records.source}."
    )
    report("sliding-peer", text, write=chosen.write, page=PAGE)


def peer(motion: GroundMotion, ky: float, fine: int) -> float:
    """Return pyslammer's displacement [m] on the record with `fine` samples for one."""
    pyslammer = import_module("pyslammer")
    assert motion.dt_s is not None
    n = (motion.npts - 1) * fine
    time = np.arange(n + 1 + 100 * fine) * (motion.dt_s / fine)
    samples = np.interp(time, motion.time_s, motion.acceleration_g, right=0.0)
    if fine == 1:
        samples = np.concatenate([motion.acceleration_g, np.zeros(100)])
    analysis = pyslammer.RigidAnalysis(
        ky=ky, ground_motion=pyslammer.GroundMotion(samples, motion.dt_s / fine)
    )
    return float(analysis.max_sliding_disp)


if __name__ == "__main__":
    main()
