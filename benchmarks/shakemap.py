"""Probabilities and joint failures over a ShakeMap grid for a class of blocks.

    python -m benchmarks.shakemap GRID.xml DATABASE [--blocks 20] [--std 0.55] [--times 1]

Prints the processor time of reading the grid, of answering it, and of drawing how many blocks fail
together. With --std the logarithms of all measures have this standard deviation everywhere; 0 takes
the map's values as certain.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from typing import TypeVar

import numpy as np

from rbfrag.exchange.shakemap import read_shakemap
from rbfrag.hazards.map_failures import DRAWS, map_failures
from rbfrag.hazards.map_probability import SiteProbability, site_probability
from rbfrag.question.components import component_named

T = TypeVar("T")


def timed(work: Callable[[], T]) -> tuple[T, str]:
    """Return what some work gives, and its processor and wall time."""
    wall, processor = time.perf_counter(), time.process_time()
    result = work()
    return result, f"{time.process_time() - processor:.2f} s ({time.perf_counter() - wall:.2f} s)"


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("grid")
    parser.add_argument("database")
    parser.add_argument("--blocks", type=int, default=20)
    parser.add_argument("--component", default="larger")
    parser.add_argument("--std", type=float, default=0.0)
    parser.add_argument("--times", type=float, default=1.0, help="factor on the map's values")
    parser.add_argument("--draws", type=int, default=DRAWS)
    options = parser.parse_args()
    random = np.random.default_rng(1)
    p2 = 10.0 ** random.uniform(-0.5, 1.0, options.blocks)
    kr = random.uniform(0.05, 0.3, options.blocks)
    grid, read = timed(lambda: read_shakemap(options.grid))
    names = tuple(grid.measures) if options.std > 0.0 else ()

    def answer(rows: slice) -> SiteProbability:
        return site_probability(
            {name: options.times * values[rows] for name, values in grid.measures.items()}, p2, kr,
            component=component_named(options.component), db=options.database,
            std_ln={name: np.full(grid.lon[rows].size, options.std) for name in names},
        )  # fmt: skip

    answer(slice(0, 10))  # the first call loads the model
    answers, took = timed(lambda: answer(slice(None)))
    sites = grid.lon, grid.lat
    failures, joint = timed(
        lambda: map_failures(answers, {"p2": p2, "kr": kr}, *sites, draws=options.draws)
    )
    print(f"{grid.lon.size} nodes x {options.blocks} blocks, processor time (wall time):")
    print(f"  read {read}, answered {took}, {options.draws} draws {joint}")
    print(
        f"  {answers.pair_probability.size} pairs of node and block can fail; {failures.as_dict()}"
    )


if __name__ == "__main__":
    main()
