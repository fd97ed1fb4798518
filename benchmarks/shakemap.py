"""Probabilities over a ShakeMap grid for a class of blocks.

    python -m benchmarks.shakemap GRID.xml DATABASE [--blocks 20] [--component larger]

Prints the processor time of reading the grid, of answering it, and of numpy.exp over as many
numbers as there are nodes and blocks, which makes the ratio independent of the machine.
"""

from __future__ import annotations

import argparse
import time

import numpy as np

from rbfrag.exchange.shakemap import read_shakemap
from rbfrag.hazards.conversions import component
from rbfrag.hazards.site_probability import site_probability


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("grid")
    parser.add_argument("database")
    parser.add_argument("--blocks", type=int, default=20)
    parser.add_argument("--component", default="larger")
    given = parser.parse_args()
    random = np.random.default_rng(1)
    p2 = 10.0 ** random.uniform(-0.5, 1.0, given.blocks)
    kr = random.uniform(0.05, 0.3, given.blocks)

    def answer(rows: slice) -> None:
        site_probability(
            {name: values[rows] for name, values in grid.measures.items()},
            p2,
            kr,
            component=component(given.component),
            db=given.database,
        )

    start = time.process_time()
    grid = read_shakemap(given.grid)
    read = time.process_time() - start
    answer(slice(0, 10))  # the first call loads the model
    start = time.process_time()
    answer(slice(None))
    took = time.process_time() - start
    numbers = random.uniform(0.0, 1.0, grid.lon.size * given.blocks)
    start = time.process_time()
    np.exp(numbers)
    plain = time.process_time() - start
    print(
        f"{grid.lon.size} nodes x {given.blocks} blocks: read {read:.2f} s, answered {took:.2f} s"
    )
    print(f"numpy.exp over as many numbers: {plain:.4f} s, {took / plain:.0f} times less")


if __name__ == "__main__":
    main()
