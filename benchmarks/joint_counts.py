"""Speed and accuracy of joint failures:  python -m benchmarks.joint_counts [--write]

Rates of any failure at a site against many more points; numbers of failures in events by rows of
identical blocks. Times are processor times, the best of some.
"""

from __future__ import annotations

import resource
import time
from collections.abc import Callable, Sequence
from typing import Any
from unittest.mock import patch

import numpy as np
from scipy.special import ndtr

from benchmarks.page import markdown, parser, report
from rbfrag.fragility.joint import Placement
from rbfrag.hazards import joint_rate
from rbfrag.hazards.event_counts import EventYears, count_part
from rbfrag.hazards.joint_rate import joint_rates
from rbfrag.solver.results import FloatArray
from tests.fragility.portfolio_draws import LAW, SHARED
from tests.hazards.test_event_counts import events, portfolio

U = np.arange(-4.6, 1.4, 0.0112)
MASS = 0.0112 * 2.5e-3 * np.exp(-2.5 * U)
MANY_POINTS, SITES_TRIED = 1 << 17, 10


def blocks(n: int, sites: int, level: float, seed: int) -> tuple[Placement, FloatArray]:
    """Return blocks at random, and how far ln of their toppling velocity is below the shaking."""
    random = np.random.default_rng(seed)
    site = np.sort(random.integers(sites, size=n))
    p = np.exp(random.uniform(-0.5, 1.5, n))
    ln_y = np.log(9.81 * np.exp(random.uniform(-3.0, -1.2, n)) / p)
    away = np.log(level / 1.6) + 0.6 * random.standard_normal(sites)[site] - ln_y
    return Placement.of(np.log(p), ln_y, site=site, polarity=0), away


def seconds(work: Callable[[], Any], repeats: int = 5) -> float:
    """Return the processor time of a call, the least of some after a first."""
    work()
    times = []
    for _ in range(repeats):
        start = time.process_time()
        work()
        times.append(time.process_time() - start)
    return min(times)


def rates() -> list[list[str]]:
    """Return time and error of the rate of any failure by the number of blocks of a site."""
    rows = []
    for n in (1, 2, 3, 5, 10, 15, 50, 100, 400, 1000):
        errors, took = [], np.inf
        for seed in range(SITES_TRIED if n <= 100 else 1):
            where, away = blocks(n, 1, 1.0, seed)
            p = ndtr((U + away[:, None]) / 0.45)[None]
            took = min(took, seconds(lambda p=p, w=where: joint_rates(p, MASS, w, LAW), 3))
            if 2 < n <= 100:
                names = dict.fromkeys(
                    ("MOST_POINTS", "FEWEST_POINTS"), MANY_POINTS // max(1, n // 25)
                )
                with patch.multiple(joint_rate, **names):
                    exact = joint_rates(p, MASS, where, LAW, seed=5).rate[0, 0]
                rate = joint_rates(p, MASS, where, LAW).rate[0, 0]
                errors.append(rate / exact - 1.0)
        cells = ("exact", "exact") if n <= 2 else ("", "")
        if errors:
            e = np.abs(errors)
            cells = f"{100 * np.sqrt((e**2).mean()):.2f} %", f"{100 * e.max():.2f} %"
        rows.append([str(n), f"{1e3 * took:.2f} ms", *cells])
    return rows


def like_blocks() -> list[list[str]]:
    """Return time and memory of one row of 100,000 like blocks in 1,000 events of 100 samples."""
    shaking = events(0.3 * np.exp(0.5 * np.random.default_rng(0).normal(size=(1000, 1))))
    row = portfolio(shaking, SHARED, "single", y=0.39, count=100_000.0)
    part = EventYears(0, row, shaking, np.arange(1.0, 40.0), np.empty(0), 100, 0)
    took = seconds(lambda: count_part(part), 3)
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
    return [["100,000", "1,000", "100", f"{took:.2f} s", f"{memory:.0f} MB"]]


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and print."""
    chosen = parser(__doc__).parse_args(arguments)
    tables = {
        "like-blocks": (["like blocks", "events", "samples", "time", "peak memory"], like_blocks),
        "joint-rates": (["blocks", "time of a site", "error, rms", "greatest"], rates),
    }  # fmt: skip
    for name, (head, measured) in tables.items():
        report(name, markdown((head, measured())), write=chosen.write)


if __name__ == "__main__":
    main()
