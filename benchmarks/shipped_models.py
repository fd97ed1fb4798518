"""Models fitted to what the shipped maps decide, judged on every outcome.

python -m benchmarks.shipped_models --db DATABASE

Which outcomes the maps decide depends on how hard they are to decide, and so on the outcome. Here
each shipped outcome model is fitted to them alone, every earthquake left out in turn, and judged on
every block of the grid, simulated for itself, those below the search limit too; beside it the same
model fitted to all outcomes, as it is shipped.

The database needs the samples of the motions of the reference, as for benchmarks.model_choice.
With --write the table of docs/theory/model-choice.md is replaced.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from benchmarks.page import ROOT, parser, replaced
from benchmarks.simulated_source import simulated_source
from rbfrag.bench.tables import markdown
from rbfrag.db.engine import opened_database
from rbfrag.db.location import REFERENCE
from rbfrag.db.motions import motion_rows
from rbfrag.db.outcome_maps import outcome_maps
from rbfrag.fragility import formulas
from rbfrag.fragility.fit import scores
from rbfrag.fragility.fit.binomial import maximum_likelihood, newton
from rbfrag.fragility.fit.data import FitData, fit_data
from rbfrag.fragility.fit.outcomes import LINKS_BY_CODE, outcome_rows
from rbfrag.fragility.fit.source import FitSource, kr_over_pga_of_grid, read_source
from rbfrag.fragility.measures import TERMS
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2

FloatArray = NDArray[np.float64]

PAGE = ROOT / "docs" / "theory" / "model-choice.md"

MODELS = (
    ("bounded", "pgv_pga"),
    ("bounded", "pgv_pga_tm"),
    ("record", "xp"),
    ("weibull", "pgv"),
    ("logistic", "pga_tm"),
)
"""The shipped models of outcomes that all motions can be asked of."""

AGREES = 1e-9
RESAMPLES = 500


@dataclass(frozen=True, eq=False)
class HeldOut:
    """Probabilities by fits without the earthquake concerned, and what happened.

    Args:
        p: probabilities on the grid, shape (n, 25).
        toppled: 0 or 1, same shape.
        limited: where the block is not below the search limit, same shape.
        event: number of each combination's earthquake, shape (n,).
    """

    p: FloatArray
    toppled: FloatArray
    limited: NDArray[np.bool_]
    event: NDArray[np.intp]


def with_shipped_outcomes(simulated: FitSource) -> FitSource:
    """Return the same combinations with the outcomes that the shipped maps alone decide.

    Raises:
        SystemExit: combinations, critical values or outcomes are not those of the reference.
    """
    with opened_database(str(REFERENCE), read_only=True) as engine, engine.connect() as connection:
        shipped = read_source(connection)
        maps = outcome_maps(connection, shipped.table.combination_id)
        sha256 = {row.id: row.sha256 for row in motion_rows(connection)}
    table = shipped.table
    place = {
        f"{sha256[int(motion)]} {polarity} {p2:g} False": i
        for i, (motion, polarity, p2) in enumerate(
            zip(table.motion_id, table.polarity, table.p2, strict=True)
        )
    }
    try:
        order = np.array([place[str(key)] for key in simulated.table.natural_key], dtype=np.intp)
    except KeyError as error:
        raise SystemExit(f"a combination is not in the reference: {error}") from None
    there = table.kr_over_pga[order]
    same = np.isclose(there, simulated.table.kr_over_pga, rtol=AGREES, atol=0.0, equal_nan=True)
    if len(place) != order.size or not same.all():
        raise SystemExit(
            f"{len(place)} combinations in the reference, {order.size} here, of which "
            f"{int((~same).sum())} have another critical value"
        )
    none = np.empty(0)
    alone = replace(maps, run_start=np.zeros_like(maps.run_start), run_k=none, run_outcome=none)
    blocks = kr_over_pga_of_grid(table.p2, table.pgv_m_s, table.pga_g)
    topples = alone.outcomes(blocks)[order]
    known = np.isfinite(topples)
    wrong = int((topples[known] != simulated.topples[known]).sum())
    if wrong:
        raise SystemExit(f"{wrong} outcomes of the shipped maps are not those of simulations")
    return FitSource(simulated.table, simulated.xp_m_s, topples)


def held_out(fitted_to: FitSource, judged_on: FitSource, method: str, term: str) -> HeldOut:
    """Fit to one set of outcomes without each earthquake, and predict all outcomes of it.

    Args:
        fitted_to: the outcomes of the fits.
        judged_on: the same combinations with every outcome known.
        method: name of an outcome method.
        term: name of its term.
    """
    shape, link = formulas.SHAPES[method, term], LINKS_BY_CODE[formulas.LINKS[method]]
    names = formulas.PARAMETERS[shape][: None if shape != formulas.RATIO else 2]
    fitted = outcome_rows(fit_data(fitted_to, TERMS[term]), shape, len(names)).data
    data = fit_data(judged_on, TERMS[term])
    rows = outcome_rows(data, shape, len(names))
    start = maximum_likelihood(fitted, link)
    p = np.zeros(data.topples.shape)
    for event in np.unique(rows.data.event):
        own = rows.data.event == event
        b, _ = newton(fitted.only(fitted.event != event), link, start, tolerance=1e-9)
        p.flat[rows.place[own]] = link.probability(rows.data.columns[own] @ b)
    return HeldOut(p, data.topples, _limited(data), data.event)


def _limited(data: FitData) -> NDArray[np.bool_]:
    kr = np.sqrt(data.p2)[:, None] * data.y0_m_s / STANDARD_GRAVITY_M_S2
    return np.asarray(kr >= 0.01 * data.pga_g[:, None])


def scores_in_words(seen: HeldOut) -> list[str]:
    """Return log loss, Brier score, slope, intercept, and the slope from the search limit on."""
    everything = np.ones(seen.p.shape, dtype=bool)
    line = scores.calibration(seen.p, seen.toppled, everything)
    limited = scores.calibration(seen.p, seen.toppled, seen.limited)
    g = int(seen.event.max()) + 1
    random = np.random.default_rng(0)
    drawn = []
    for _ in range(RESAMPLES):
        times = np.bincount(random.integers(g, size=g), minlength=g)[seen.event].astype(float)
        weights = np.broadcast_to(times[:, None], seen.p.shape)
        part = scores.calibration(seen.p, seen.toppled, everything, weights)
        drawn.append((part.slope, part.intercept))
    low, high = np.quantile(np.array(drawn), [0.025, 0.975], axis=0)
    return [
        f"{scores.log_loss(seen.p, seen.toppled, everything):.4f}",
        f"{scores.brier(seen.p, seen.toppled, everything):.4f}",
        f"{line.slope:.3f} ({low[0]:.2f}–{high[0]:.2f})",
        f"{line.intercept:+.3f} ({low[1]:+.2f}…{high[1]:+.2f})",
        f"{limited.slope:.3f}",
    ]


def table(simulated: FitSource) -> str:
    """Return the table of the page."""
    shipped = with_shipped_outcomes(simulated)
    cells = []
    for method, term in MODELS:
        for words, source in (("what the maps decide", shipped), ("all", simulated)):
            seen = held_out(source, simulated, method, term)
            cells.append([f"{method}-{term}", words, *scores_in_words(seen)])
    head = ["model", "fitted to outcomes", "log loss", "Brier", "calibration slope", "intercept",
            "slope from 0.01 PGA on"]  # fmt: skip
    return f"{markdown((head, cells))}\n\n{selection(shipped, simulated)}"


def selection(shipped: FitSource, simulated: FitSource) -> str:
    """Say how many outcomes the shipped maps leave open, and how these differ from the others."""
    t = simulated.table
    k = kr_over_pga_of_grid(t.p2, t.pgv_m_s, t.pga_g)
    below = (k >= 0.01) & (k < np.nan_to_num(t.kr_over_pga)[:, None])
    known = np.isfinite(shipped.topples)
    safe = simulated.topples == 0.0
    return (
        f"Of {known.size:,} blocks the maps decide {int(known.sum()):,}. Of the "
        f"{int(below.sum()):,} between search limit and critical value they leave "
        f"{int((below & ~known).sum()):,} open, of which {safe[below & ~known].mean():.1%} are "
        f"safe, against {safe[below & known].mean():.1%} of those decided; "
        f"{int((k < 0.01).sum()):,} lie below the search limit, and {safe[k < 0.01].mean():.1%} of "
        "them are safe."
    ).replace("%", " %")


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table, or write it into the page."""
    options = parser(__doc__ or "")
    options.add_argument("--db", required=True, help="database of the motions of the reference")
    chosen = options.parse_args(arguments)
    file = None if chosen.out is None else chosen.out / "without-vertical.npz"
    found = table(simulated_source(chosen.db, vertical=False, cache=file))
    print(found, flush=True)
    if chosen.write:
        PAGE.write_text(replaced(PAGE.read_text(encoding="utf-8"), "shipped", found))


if __name__ == "__main__":
    main()
