"""How fast and how exact annual rates are:  python -m benchmarks.hazard_speed [--write]

Blocks at random under a curve of 100 levels, with the intervals and the joint rates; and rates
under a curve of which ever fewer levels are kept, by the interpolation and by straight chords.
"""

from __future__ import annotations

import time
from collections.abc import Sequence

import numpy as np
from scipy.special import ndtr

from benchmarks.page import parser, report
from rbfrag.bench.tables import markdown
from rbfrag.hazards.annual_rate import failure_rate
from rbfrag.hazards.answer import NEVER, HazardAnswer, hazard
from rbfrag.hazards.curve import HazardCurve, hazard_curve

REPEATS = 5


def bending(n: int) -> HazardCurve:
    """Return a curve that bends down in log-log, by n levels of PGV from 0.01 to 4 m/s."""
    x = np.geomspace(0.01, 4.0, n)
    return hazard_curve("pgv_m_s", x, 0.02 / (1.0 + (x / 0.03) ** 1.5) * np.exp(-x / 0.8))


def with_chords(curve: HazardCurve) -> HazardCurve:
    """Return the curve with straight chords in log-log, by many levels on them."""
    u = np.log(curve.levels)
    fine = np.linspace(u[0], u[-1], 40 * (u.size - 1) + 1)
    return hazard_curve(
        "pgv_m_s", np.exp(fine), np.exp(np.interp(fine, u, np.log(curve.annual_rate)))
    )


def times() -> list[list[str]]:
    """Return wall and processor time and errors by number of blocks."""
    rows, curve = [], bending(100)
    for component in ("single", "geometric_mean"):
        for n in (1, 10, 100, 1000):
            random = np.random.default_rng(n)
            p2, kr = np.exp(random.uniform(0.0, 3.0, n)), np.exp(random.uniform(-3.0, -1.2, n))
            wall, used = [], []
            answer: HazardAnswer | None = None
            for _ in range(REPEATS):
                start, before = time.perf_counter(), time.process_time()
                answer = hazard(curve, p2, kr, component=component)
                wall.append(time.perf_counter() - start)
                used.append(time.process_time() - before)
            assert answer is not None
            joint = answer.joint.at_least[0].numerical_error if answer.joint is not None else None
            worst = answer.numerical_error[answer.annual_rate > NEVER].max()
            rows.append([
                str(n), component, f"{min(wall):.2f} s", f"{min(used):.2f} s",
                f"{worst:.1e}", "" if joint is None else f"{joint:.1e}",
            ])  # fmt: skip
    return rows


def thinned() -> list[list[str]]:
    """Return how far rates under few levels are from those under 1,000."""
    rows = []
    for n in (9, 13, 17, 25):
        row = [str(n)]
        for median in (0.4, 1.5):
            rates = [
                failure_rate(one, lambda v, m=median: ndtr(np.log(v / m) / 0.4)).annual_rate[0]
                for one in (bending(1000), bending(n), with_chords(bending(n)))
            ]
            row += [f"{100.0 * (rate / rates[0] - 1.0):+.2f} %" for rate in rates[1:]]
        rows.append(row)
    return rows


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and report."""
    chosen = parser(__doc__).parse_args(arguments)
    head = ["blocks", "component", "wall time", "processor time", "error of a block's rate",
            "of the rate of any failure"]  # fmt: skip
    report("hazard-speed", markdown((head, times())), write=chosen.write)
    head = ["levels", "median 0.4 m/s", "by chords", "median 1.5 m/s", "by chords"]
    report("hazard-thinned", markdown((head, thinned())), write=chosen.write)


if __name__ == "__main__":
    main()
