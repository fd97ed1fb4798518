"""How fast `predict` answers:  python -m benchmarks.predict_speed --db DATABASE

Python: a scalar call with the model in hand, and with the database's path, in CPU time.
Arrays: ten million rows, against one pass of `scipy.special.ndtr` over as many normal scores, in
turn; wall time with a thread for each core, in brackets the processor time, which is what one
thread takes.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from statistics import median

import numpy as np
from scipy.special import ndtr

from benchmarks.page import markdown, parser, report
from rbfrag.fragility.model_selection import suited_models
from rbfrag.question.question import predict

BLOCK = {"p2": 3.0, "kr": 0.1}
REPEATS = 11
"""Arrays are answered and series of calls made so often: on a virtual machine the first ones get
their memory from the host."""

QUESTIONS: tuple[dict[str, float], ...] = (
    {"pgv_m_s": 0.6},
    {"pgv_m_s": 0.6, "pga_g": 0.5},
    {"pgv_m_s": 0.6, "pga_g": 0.5, "tm_s": 0.6},
)


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and report."""
    options = parser(__doc__)
    options.add_argument("--db", required=True, help="database with fitted models")
    options.add_argument("--rows", type=int, default=10_000_000)
    chosen = options.parse_args(arguments)
    cells: list[list[str]] = []
    for question in QUESTIONS:
        cells += scalar(chosen.db, question)
        cells.append(array(chosen.db, question, chosen.rows, interval=False))
        cells.append(array(chosen.db, question, chosen.rows, interval=True))
    head = ["what", "time", "compared with", "time", "ratio"]
    report("predict-speed", markdown((head, cells)), write=chosen.write)


def _words(model: str, question: dict[str, float]) -> str:
    return f"{model} with Tm" if "tm_s" in question else model


def scalar(db: str, question: dict[str, float]) -> list[list[str]]:
    """Return the rows of a call with single numbers."""
    model = suited_models({**BLOCK, **question}, db)[0]
    words = _words(model.name, question)
    rows = []
    for name, call in (
        ("model in hand", lambda: predict(3.0, 0.1, **question, model=model)),
        ("database by path", lambda: predict(3.0, 0.1, **question, db=db)),
    ):
        rows.append(
            [f"one block, {words}, {name}", f"{1e6 * least(call, 2000):.1f} µs", "", "", ""]
        )
    return rows


def array(db: str, question: dict[str, float], rows: int, *, interval: bool) -> list[str]:
    """Return the row of an array."""
    random = np.random.default_rng(0)
    model = suited_models({**BLOCK, **question}, db)[0]
    p2 = np.exp(random.uniform(np.log(0.1), np.log(30.0), rows))
    columns = {
        name: value * np.exp(random.uniform(-0.4, 0.4, rows)) for name, value in question.items()
    }
    kr = columns["pgv_m_s"] * np.sqrt(p2) / 9.80665 * np.exp(random.uniform(-1.5, 0.3, rows))
    kr = np.minimum(kr, 0.99 * columns["pga_g"]) if "pga_g" in columns else kr
    # what a lognormal fragility of the same blocks and motions would hand to ndtr
    score = np.log(columns["pgv_m_s"] * np.sqrt(p2) / (9.80665 * kr)) / 0.29
    wall, cpu, ndtr_wall, ndtr_cpu = [], [], [], []
    for _ in range(REPEATS):
        start, used = time.perf_counter(), time.process_time()
        predict(p2, kr, **columns, model=model, interval=interval)
        wall.append(time.perf_counter() - start)
        cpu.append(time.process_time() - used)
        start, used = time.perf_counter(), time.process_time()
        ndtr(score)
        ndtr_wall.append(time.perf_counter() - start)
        ndtr_cpu.append(time.process_time() - used)
    ratio = median(wall) / median(ndtr_wall)
    of_cpu = median(cpu) / median(ndtr_cpu)
    return [
        f"{rows:,} blocks, {_words(model.name, question)}, "
        f"{'with' if interval else 'without'} interval, wall (processor)",
        f"{median(wall):.2f} s ({median(cpu):.2f} s)",
        "`scipy.special.ndtr` of as many",
        f"{median(ndtr_wall):.2f} s ({median(ndtr_cpu):.2f} s)",
        f"{ratio:.2f} ({of_cpu:.2f})",
    ]


def least(call: Callable[[], object], count: int) -> float:
    """Return the least mean processor time of several series of calls [s]."""
    times = []
    for _ in range(REPEATS):
        before = time.process_time()
        for _ in range(count):
            call()
        times.append((time.process_time() - before) / count)
    return min(times)


if __name__ == "__main__":
    main()
