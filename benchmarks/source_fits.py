"""The six fits of the dissertation side by side:  python -m benchmarks.source_fits

Straight line with normal scatter and logistic regression, each in PGV, PGA·Tm/2π and 2π·PGD/Tm, as
they are shipped; and for comparison the straight line in PGV with variances in bins of equal count,
in bins of equal width, and weighted by n/v².
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

from benchmarks.held_out import log_losses, scored_blocks
from benchmarks.page import ROOT, markdown, parser, report
from rbfrag.db.engine import opened_database
from rbfrag.db.location import REFERENCE
from rbfrag.db.rows import CombinationTable
from rbfrag.fragility.fit.data import read_source
from rbfrag.fragility.fit.line import MOST_BINS, Bins, bin_variances, iterate, powers, weighted_line
from rbfrag.fragility.measures import MEASURES
from rbfrag.fragility.model import FragilityModel
from rbfrag.fragility.model_selection import find_model
from rbfrag.fragility.prediction import array_answer
from rbfrag.plots import canvas
from rbfrag.plots.canvas import as_written
from rbfrag.plots.model_lines import failure_line

FloatArray = NDArray[np.float64]

NAMES = tuple(f"{m}-{term}" for m in ("wls", "logistic") for term in ("pgv", "pga_tm", "pgd_tm"))
PGV = ((0.02, 0.1), (0.1, 1.0), (0.5, 1.0), (1.0, 10.0))
"""Decades of PGV [m/s], from the least that there are many of, and the upper half of one."""
PAGE = ROOT / "docs" / "evidence" / "what-differs.md"
FIGURE = ROOT / "docs" / "figures" / "source-fits.png"
TAIL = 0.025


def main(arguments: Sequence[str] | None = None) -> None:
    options = parser(__doc__)
    options.add_argument("--db", default=str(REFERENCE))
    chosen = options.parse_args(arguments)
    with opened_database(chosen.db, read_only=True) as engine, engine.connect() as connection:
        source = read_source(connection)
    models = {name: find_model(name, MEASURES, chosen.db) for name in NAMES}
    line = models["wls-pgv"]
    refits = {
        "wls-pgv, bins of equal count": refitted(line, source.table, Bins.equal_count),
        "wls-pgv, bins of equal width": refitted(line, source.table, equal_width),
        "wls-pgv, variance weighted by n/v²": with_weighted_variance(line, source.table),
    }
    measures, failed = scored_blocks(source)
    rows = []
    for name, model in {**models, **refits}.items():
        pgv, inside = within_lines(model, source.table)
        p = probabilities(model, measures)
        is_known = np.isfinite(p)
        loss = log_losses(np.clip(p[is_known], 1e-4, 1.0 - 1e-4), failed[is_known])
        row = [f"`{name}`" if name in models else name]
        for cells, values, words in (
            (pgv, inside, "{:.1f}"), (measures["pgv_m_s"][is_known], loss, "{:.3f}"),
        ):  # fmt: skip
            row += [words.format(values[(cells >= a) & (cells < b)].mean()) for a, b in PGV]
        rows.append(row)
    ranges = [f"{a:g} to {b:g}" for a, b in PGV[:-1]] + ["above 1"]
    headers = ["fit", *(f"within, {name}" for name in ranges), *(f"loss, {e}" for e in ranges)]
    report("source fits", markdown((headers, rows)), write=chosen.write, page=PAGE)
    if chosen.write:
        plot(models, source.table, FIGURE)


def probabilities(model: FragilityModel, values: dict[str, Any]) -> FloatArray:
    """Return P of blocks; NaN where what the model reads is not known."""
    inputs = {name: values[name] for name in ("p2", "kr", *model.term.inputs)}
    return array_answer(model, inputs, interval=False).probability


def has_critical_value(table: CombinationTable, model: FragilityModel) -> NDArray[np.bool_]:
    """Return which rows have a critical value and what the model reads."""
    has_value = (table.status == "found") & np.isfinite(table.y_m_s)
    for name in model.term.inputs:
        has_value &= np.isfinite(table.measure(name))
    return has_value


def within_lines(model: FragilityModel, table: CombinationTable) -> tuple[FloatArray, FloatArray]:
    """Return PGV of the critical blocks, and 100 where one lies between both lines, else 0."""
    is_known = has_critical_value(table, model)
    names = ("p2", "kr", *model.term.inputs)
    p = probabilities(model, {name: table.measure(name)[is_known] for name in names})
    return table.pgv_m_s[is_known], np.where((p > TAIL) & (p < 1.0 - TAIL), 100.0, 0.0)


def critical_points(
    model: FragilityModel, table: CombinationTable
) -> tuple[FloatArray, FloatArray]:
    """Return PGV [m/s], rising, and the critical toppling velocity [m/s] of the critical blocks."""
    is_known = has_critical_value(table, model)
    x, y = table.pgv_m_s[is_known], table.y_m_s[is_known]
    order = np.lexsort((y, x))
    return x[order], y[order]


def with_coefficients(model: FragilityModel, values: FloatArray) -> FragilityModel:
    """Return the model with other coefficients."""
    coefficients = dict(zip(model.form.parameters, values.tolist(), strict=True))
    return FragilityModel.from_row(replace(model.row, coefficients=coefficients))


def equal_width(x: FloatArray) -> Bins:
    """Cut rising intensities into bins of equal width; those without points are left out."""
    return Bins(x, np.unique(np.searchsorted(x, np.linspace(x[0], x[-1], MOST_BINS + 1)[:-1])))


def refitted(
    model: FragilityModel, table: CombinationTable, cut: Callable[[FloatArray], Bins]
) -> FragilityModel:
    """Return the straight line in PGV fitted again with other bins of the variance."""
    x, y = critical_points(model, table)
    return with_coefficients(model, iterate(cut(x), y, np.ones(x.size), 1).parameters)


def with_weighted_variance(model: FragilityModel, table: CombinationTable) -> FragilityModel:
    """Return the straight line in PGV with bins weighted by the inverse variance of a variance."""
    x, y = critical_points(model, table)
    bins, line, variance = Bins.equal_count(x), weighted_line(x, y, np.ones(x.size)), None
    for _ in range(100):
        squares = (y - line[0] - line[1] * x) ** 2
        counts, centre, spread = bin_variances(bins, squares, np.ones(x.size))
        columns = powers(centre, 1)
        fitted = spread if variance is None else columns @ variance
        weight = np.sqrt(counts) / fitted
        variance, _ = nnls(columns * weight[:, None], spread * weight)
        variance[0] = max(variance[0], 1e-4 * spread.min())
        line = weighted_line(x, y, 1.0 / (powers(x, 1) @ variance))
    return with_coefficients(model, np.concatenate([line, variance]))


@canvas.in_own_style
def plot(models: dict[str, FragilityModel], table: CombinationTable, path: Path) -> canvas.Picture:
    """Draw the critical blocks with the lines of all six fits, logarithmic."""
    figure = canvas.new_figure(10.5, 7.0)
    axes = figure.subplots(2, 3, sharey=True)
    styles = (
        (0.025, "--", canvas.RED, "2.5 % probability of failure"),
        (0.5, "-", "black", "50 %"), (0.975, "-.", "#2166ac", "97.5 %"),
    )  # fmt: skip
    for i, (panel, model) in enumerate(zip(axes.ravel(), models.values(), strict=True)):
        is_known = has_critical_value(table, model)
        values = {name: table.measure(name)[is_known] for name in model.term.inputs}
        x = np.asarray(model.term.intensity_m_s(values), dtype=np.float64)
        canvas.logarithmic(panel)
        panel.plot(
            x, table.y_m_s[is_known], ".", ms=1.2, color="#9a9a9a", alpha=0.4, rasterized=True
        )
        line_x = np.geomspace(x.min(), x.max(), 200)
        for probability, style, colour, label in styles:
            line = failure_line(model, line_x, probability)
            panel.plot(line_x, line, style, color=colour, lw=1.6, label=None if i else label)
        panel.set_ylim(3e-3, 5.0)
        panel.set_xlim(x.min(), x.max())
        canvas.logarithmic(panel, (1.0,), (1.0,))
        panel.set_title(as_written(model.name, 40), fontsize=10)
        if i >= 3:
            panel.set_xlabel(f"{model.term.symbol} [m/s]")
        if i % 3 == 0:
            panel.set_ylabel("critical $y = k_r\\,g/p$ [m/s]")
    canvas.legend_below(figure, 3)
    return canvas.save_figure(figure, path)


if __name__ == "__main__":
    main()
