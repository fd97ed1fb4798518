"""Models of the measure that a hazard is given in:  python -m benchmarks.measure_models --db FILE

Fits each to a database with outcomes of the whole grid and prints what it scores on earthquakes
left out, beside what is asked of it: log loss, calibration slope, log loss of each block size, and
the failures of strong blocks that stay the same under every motion, predicted over observed.
--write keeps the table in benchmarks/results. The exit status is 1 where anything is missed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from benchmarks.page import ROOT, parser, report
from rbfrag.bench.tables import markdown
from rbfrag.db.engine import opened_database
from rbfrag.db.location import REFERENCE
from rbfrag.fragility.fit.clusters import left_out
from rbfrag.fragility.fit.data import FitData, FitSource, fit_data, read_source
from rbfrag.fragility.fit.likelihood import maximise, most_likely
from rbfrag.fragility.fit.outcomes import outcome_rows, parameter_names
from rbfrag.fragility.fit.scores import brier, calibration, log_loss
from rbfrag.fragility.measures import TERMS
from rbfrag.fragility.method import Method, arrays
from rbfrag.fragility.methods import method_named
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.solver.results import DEFAULT_P2

FloatArray = NDArray[np.float64]

STRENGTHS = (0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.7)
"""k_r of the blocks that stay the same under every motion, each of every size."""

STRONG_KR = 0.2
"""Those of at least this k_r are strong."""

RARE = 0.1
"""Blocks of which a smaller share of the motions topples any are rare."""

USUAL_SLOPE, USUAL_STRONG = (0.93, 1.07), (0.8, 1.25)


@dataclass(frozen=True)
class Asked:
    """What is asked of one model.

    Args:
        method: its method.
        log_loss: that it may exceed by `WITHIN`.
        slope: least and greatest calibration slope.
        strong: least and greatest failures of strong blocks, predicted over observed.
    """

    method: str
    log_loss: float
    slope: tuple[float, float] = USUAL_SLOPE
    strong: tuple[float, float] = USUAL_STRONG


WITHIN = 0.005
MODELS = {
    "sa10": Asked("logistic", 0.221),
    "sa20": Asked("logistic", 0.258),
    "sa30": Asked("logistic", 0.277),
    "sa03": Asked("logistic", 0.336, (0.83, 0.97)),
    "pga": Asked("bounded", 0.339, (0.83, 0.97), (0.8, 1.5)),
    "pgv_kr": Asked("bounded", 0.164),
    "pga_sa10": Asked("bounded", 0.199),
    "pga_sa03_sa10_sa30": Asked("bounded", 0.174),
}


@dataclass(frozen=True)
class Scores:
    """What one model scores on earthquakes left out.

    Args:
        log_loss: mean over the grid.
        brier: Brier score.
        slope: of the outcomes on the logit of the probability.
        by_size: log loss by p².
        strong: failures of strong blocks, predicted over observed.
        rare: the same of blocks that few motions topple.
    """

    log_loss: float
    brier: float
    slope: float
    by_size: tuple[float, ...]
    strong: float
    rare: float


def measured(source: FitSource, name: str) -> Scores:
    """Return what the model of a term scores on earthquakes left out."""
    method, term = method_named(MODELS[name].method), TERMS[name]
    data = fit_data(source, method, term)
    rows = outcome_rows(data, method, term, parameter_names(method, term))
    best = most_likely(rows.data)
    parameters = left_out(
        rows.data.event, lambda rest: maximise(rows.data.only(rest), best, tolerance=1e-9)[0]
    )
    grid = np.zeros(rows.bounded.shape)
    for event, b in parameters.items():
        own = rows.data.event == event
        grid.flat[rows.place[own]] = rows.data.only(own).probability(b)
    judged = data.judged
    size = data.grid("p2")
    predicted, observed, share = fixed_blocks(data, method, name, parameters)
    strong = np.repeat(np.array(STRENGTHS) >= STRONG_KR, len(DEFAULT_P2))
    rare = (share < RARE) & (observed > 0)
    return Scores(
        log_loss(grid, judged.failed, judged.known),
        brier(grid, judged.failed, judged.known),
        calibration(grid, judged.failed, judged.known).slope,
        tuple(
            log_loss(grid, judged.failed, judged.known & (size == p2)) for p2 in DEFAULT_P2
        ),
        float(predicted[strong].sum() / observed[strong].sum()),
        float(predicted[rare].sum() / observed[rare].sum()),
    )  # fmt: skip


def fixed_blocks(
    data: FitData, method: Method, name: str, parameters: dict[int, FloatArray]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return failures of each fixed block, predicted and observed, and the share of its motions.

    A block fails where it is not above the critical block of its size: safe islands below that are
    not seen.
    """
    form, ns = method.forms[name], arrays()
    critical = np.where(data.observed, data.values["kr"], 0.0)
    result = []
    for kr in STRENGTHS:
        values = {**data.values, "kr": np.full(critical.size, kr)}
        values["y_m_s"] = kr * STANDARD_GRAVITY_M_S2 / values["p"]
        probability = np.zeros(critical.size)
        for event, b in parameters.items():
            own = data.event == event
            part = {key: column[own] for key, column in values.items()}
            with np.errstate(all="ignore"):
                eta = np.clip(form.eta(b.tolist(), part, ns).eta, -700.0, 700.0)
            p = method.link.probability(eta, ns)
            for bound in form.bounds:
                p = np.where(bound.holds(part), 0.0, p)
            probability[own] = p
        for p2 in DEFAULT_P2:
            of_size = data.values["p2"] == p2
            fails = critical[of_size] >= kr
            result.append((probability[of_size].sum(), fails.sum(), fails.mean()))
    predicted, observed, share = np.array(result, dtype=np.float64).T
    return predicted, observed, share


def row(name: str, scores: Scores) -> tuple[list[str], bool]:
    """Return a line of the table, and whether all that is asked is reached."""
    asked = MODELS[name]
    reached = [
        scores.log_loss <= asked.log_loss + WITHIN,
        asked.slope[0] <= scores.slope <= asked.slope[1],
        asked.strong[0] <= scores.strong <= asked.strong[1],
    ]
    marks = ["" if good else " (missed)" for good in reached]
    line = [
        f"`{asked.method}-{name}`",
        f"{scores.log_loss:.4f} (≤ {asked.log_loss + WITHIN:.3f}){marks[0]}",
        f"{scores.brier:.4f}",
        f"{scores.slope:.2f} ({asked.slope[0]}–{asked.slope[1]}){marks[1]}",
        " ".join(f"{loss:.3f}" for loss in scores.by_size),
        f"{scores.strong:.2f} ({asked.strong[0]}–{asked.strong[1]}){marks[2]}",
        f"{scores.rare:.2f}",
    ]
    return line, all(reached)


HEADERS = [
    "model", "log loss (asked)", "Brier", "slope (asked)", "log loss by $p^2$ = 30 … 0.1",
    "strong blocks (asked)", "rare blocks",
]  # fmt: skip


def main() -> None:
    options = parser(__doc__)
    options.add_argument("--db", default=str(REFERENCE), help="database with outcomes")
    chosen = options.parse_args()
    with opened_database(chosen.db, read_only=True) as engine, engine.connect() as connection:
        source = read_source(connection)
    lines, good = [], True
    for name in MODELS:
        line, reached = row(name, measured(source, name))
        print(" | ".join(line), flush=True)
        lines.append(line)
        good &= reached
    page = ROOT / "docs" / "theory" / "fragility.md"
    report("measure-models", markdown((HEADERS, lines)), write=chosen.write, page=page)
    if not good:
        raise SystemExit(1)


if __name__ == "__main__":
    main()
