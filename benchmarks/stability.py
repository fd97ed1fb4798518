"""Time of classifying a million random blocks against one pass of numpy.sin over as many.

    python benchmarks/stability.py [--blocks 1000000]

Both times are the best of several, taken in one run, so that their ratio depends little on the
machine.
"""

from __future__ import annotations

import argparse
import resource
import time
from collections.abc import Callable

import numpy as np

from rbfrag.solver.block.arrays import BlockArray
from rbfrag.solver.stability.arrays import stability_arrays


def best_s(run: Callable[[], object], repeats: int = 9) -> float:
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        run()
        times.append(time.perf_counter() - start)
    return min(times)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--blocks", type=int, default=1_000_000)
    n = parser.parse_args().blocks
    random = np.random.default_rng(1)
    angles = np.sort(random.uniform(-85.0, 85.0, (2, n)), axis=0)
    alpha1, alpha3 = angles[0].copy(), angles[1].copy()
    s1, s2 = random.uniform(0.2, 3.0, (2, n))
    gamma = random.uniform(10.0, 170.0, n)
    r3 = random.uniform(0.2, 5.0, n)
    beta = random.uniform(-20.0, 40.0, n)
    phi, phi_back = random.uniform(10.0, 60.0, (2, n))

    def one_slope() -> object:
        blocks = BlockArray.from_angles(alpha1, alpha3, r3)
        return stability_arrays(blocks, beta_deg=20.0, phi_deg=40.0)

    def everything_random() -> object:
        blocks = BlockArray.from_angles(alpha1, alpha3, r3)
        return stability_arrays(blocks, beta_deg=beta, phi_deg=phi, phi_back_deg=phi_back)

    def from_spacings() -> object:
        blocks = BlockArray.from_fractures(s1, s2, gamma)
        return stability_arrays(blocks, beta_deg=beta, phi_deg=phi)

    radians = np.radians(alpha1)
    sine = best_s(lambda: np.sin(radians))
    print(f"numpy.sin of {n} angles: {1e3 * sine:.1f} ms")
    for name, run in (
        ("angles random, one dip and friction", one_slope),
        ("spacings, dip and friction random", from_spacings),
        ("angles, dip and both frictions random", everything_random),
    ):
        taken = best_s(run)
        print(f"{name}: {1e3 * taken:.0f} ms, {taken / sine:.1f} times numpy.sin")
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
    print(f"peak memory of the process: {peak:.0f} MB")


if __name__ == "__main__":
    main()
