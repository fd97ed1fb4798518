"""Runs side by side against the same runs one by one:  python -m benchmarks.batch_runs

Both are compiled calls over the same blocks, and their results are compared bit for bit.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from benchmarks.critical_search import choose_combinations, search_runs
from benchmarks.page import find_records, markdown, parser, report
from rbfrag.bench.timing import timed
from rbfrag.solver.excitation import Excitation, Nodes, excitation
from rbfrag.solver.integrator.compiled import kernel
from rbfrag.solver.integrator.taylor import ORDER, PH_MAX
from rbfrag.solver.integrator.toppling_kernel import run_toppling
from rbfrag.solver.integrator.vectorised import run_batch
from rbfrag.solver.results import FloatArray, IntArray

READINGS = 5

MANY = 400


@kernel
def run_blocks(
    nodes: Nodes,
    kr: FloatArray,
    p: FloatArray,
    order: int,
    ph_max: float,
    whole: IntArray,
    real: FloatArray,
) -> None:
    """Run one block after another over one record; arguments as of `run_batch`."""
    # made once for all blocks: the coefficients of a step, and no history
    u = np.empty(9)
    no_rows = np.empty((4, 0))
    for j in range(kr.size):
        (
            whole[0, j], real[0, j], real[1, j], real[2, j], real[3, j],
            whole[1, j], whole[2, j], _,
        ) = run_toppling(nodes, kr[j], p[j], order, ph_max, no_rows, u)  # fmt: skip


def main(arguments: Sequence[str] | None = None) -> None:
    options = parser(__doc__)
    options.add_argument("--combinations", type=int, default=60)
    options.add_argument("--seed", type=int, default=1)
    chosen = options.parse_args(arguments)
    records = find_records(chosen.records)
    combinations = choose_combinations(records, chosen.combinations, seed=chosen.seed)
    searches, grids = [], []
    for motion, polarity, p2 in combinations:
        excited = excitation(motion, None, polarity)
        runs = np.array([case.kr for case in search_runs(motion, polarity, p2)])
        searches.append(compare(excited, p2, runs))
        grids.append(compare(excited, p2, np.geomspace(0.01, 0.99, MANY) * excited.pga_g))
    headers = [
        "runs of one call", "calls", "a step, one by one", "a step, side by side",
        "one by one over side by side, all", "median of the calls", "least", "greatest",
        "results that differ",
    ]  # fmt: skip
    cells = []
    for name, rows in (("23 of a critical search", searches), (f"{MANY} of a grid", grids)):
        table = np.array(rows)
        one, beside, steps, differ = table.T
        ratio = one / beside
        cells.append(
            [
                name,
                str(len(rows)),
                f"{1e9 * one.sum() / steps.sum():.0f} ns",
                f"{1e9 * beside.sum() / steps.sum():.0f} ns",
                f"{one.sum() / beside.sum():.2f}×",
                f"{np.median(ratio):.2f}×",
                f"{ratio.min():.2f}×",
                f"{ratio.max():.2f}×",
                f"{int(differ.sum())}",
            ]
        )
    about = f"{len(combinations)} combinations of {records.source}, seed {chosen.seed}."
    report("batch-runs", f"{markdown((headers, cells))}\n\n{about}", write=chosen.write)


def compare(excited: Excitation, p2: float, kr: np.ndarray) -> tuple[float, float, float, int]:
    """Return the least times of both ways [s], the steps, and the number of runs that differ."""
    p = np.full(kr.size, np.sqrt(p2))
    whole = [np.empty((3, kr.size), dtype=np.int64) for _ in range(2)]
    real = [np.empty((4, kr.size)) for _ in range(2)]
    ways: list[Callable[[], None]] = [
        lambda: run_blocks(excited.nodes, kr, p, ORDER, PH_MAX, whole[0], real[0]),
        lambda: run_batch(excited.nodes, kr, p, PH_MAX, whole[1], real[1]),
    ]
    least = [np.inf, np.inf]
    for way in ways:
        way()  # compiles
    for _ in range(READINGS):
        for number, way in enumerate(ways):
            least[number] = min(least[number], timed(way)[1])
    same = (whole[0] == whole[1]).all(axis=0)
    same &= ((real[0] == real[1]) | (np.isnan(real[0]) & np.isnan(real[1]))).all(axis=0)
    return least[0], least[1], float(whole[0][1].sum()), int(np.count_nonzero(~same))


if __name__ == "__main__":
    main()
