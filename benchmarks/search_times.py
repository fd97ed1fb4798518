"""Time of whole critical searches and maps, record by record:  python -m benchmarks.search_times"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from benchmarks.page import find_records, parser, report
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.solver.excitation import kept_excitation
from rbfrag.solver.results import DEFAULT_P2, POLARITIES, SEARCH_LIMIT, Polarity
from rbfrag.solver.search.certified import bracket_of, certified_map
from rbfrag.solver.search.critical import SLIVERS, critical


class Done(NamedTuple):
    """Whether the answer is proven, and the work it took; steps where they are counted."""

    certified: bool
    trajectories: int
    steps: int | None


def main(arguments: Sequence[str] | None = None) -> None:
    options = parser(__doc__)
    options.add_argument("--every", type=int, default=1, help="take one record in so many")
    chosen = options.parse_args(arguments)
    records = find_records(chosen.records)
    motions = records.motions[:: chosen.every]
    lines = [
        "| work | p² | combinations | median | mean | 90 % | 99 % | certified | trajectories, mean "
        "| steps, median | steps, mean |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    works: tuple[tuple[str, Callable[[GroundMotion, Polarity, float], Done]], ...] = (
        ("certified bracket", bracket_alone),
        ("bracket and map", bracket_with_map),
        ("critical search", search),
        ("search and map", search_with_map),
    )
    for name, work in works:
        work(motions[0], "forward", 3.0)  # compiles
        seconds: dict[float, list[float]] = {p2: [] for p2 in DEFAULT_P2}
        done: dict[float, list[Done]] = {p2: [] for p2 in DEFAULT_P2}
        for motion in motions:
            for polarity in POLARITIES:
                for p2 in DEFAULT_P2:
                    started = time.thread_time()
                    made = work(motion, polarity, p2)
                    seconds[p2].append(time.thread_time() - started)
                    done[p2].append(made)
        for label, sizes in (*((f"{p2:g}", (p2,)) for p2 in DEFAULT_P2), ("all", DEFAULT_P2)):
            ms = 1e3 * np.concatenate([seconds[p2] for p2 in sizes])
            middle, high, highest = np.quantile(ms, (0.5, 0.9, 0.99))
            all_done = [each for p2 in sizes for each in done[p2]]
            trajectories = np.mean([each.trajectories for each in all_done])
            steps = [each.steps for each in all_done if each.steps is not None]
            counts = [f"{np.median(steps):,.0f}", f"{np.mean(steps):,.0f}"] if steps else ["", ""]
            lines.append(
                f"| {name} | {label} | {ms.size} | {middle:.3g} ms | {ms.mean():.3g} ms "
                f"| {high:.3g} ms | {highest:.3g} ms | {sum(each.certified for each in all_done)} "
                f"| {trajectories:,.0f} | {' | '.join(counts)} |"
            )
    about = f"{len(motions)} of {records.source}, both polarities, as the files have them."
    report("search-times", "\n".join([*lines, "", about]), write=chosen.write)


def bracket_alone(motion: GroundMotion, polarity: Polarity, p2: float) -> Done:
    """Give verdicts from K_up to the critical value."""
    return _verdicts(motion, polarity, p2, full=False)


def bracket_with_map(motion: GroundMotion, polarity: Polarity, p2: float) -> Done:
    """Give verdicts from K_up to the search limit."""
    return _verdicts(motion, polarity, p2, full=True)


def _verdicts(motion: GroundMotion, polarity: Polarity, p2: float, *, full: bool) -> Done:
    excited = kept_excitation(motion, None, polarity)
    if excited.max_q <= SEARCH_LIMIT * excited.pga_g:
        return Done(True, 0, 0)
    bottom = SEARCH_LIMIT * excited.pga_g
    found = certified_map(excited, p2=p2, bottom=bottom, full=full)
    bracket = bracket_of(found)
    undecided = found.undecided_above(bottom) if bracket is None else bracket.undecided
    return Done(undecided <= SLIVERS * excited.pga_g, found.runs, found.steps)


def search(motion: GroundMotion, polarity: Polarity, p2: float) -> Done:
    """Make the whole search."""
    found = critical(motion, p2=p2, polarity=polarity)
    return Done(found.certified, found.n_runs, None)


def search_with_map(motion: GroundMotion, polarity: Polarity, p2: float) -> Done:
    """Make the whole search with the map."""
    found = critical(motion, p2=p2, polarity=polarity, full_map=True)
    return Done(found.certified, found.n_runs, None)


if __name__ == "__main__":
    main()
