"""Reliability of P on held-out earthquakes:  python -m benchmarks.reliability [--write]

In bins of P: how many blocks of how many earthquakes support it, how many failures are predicted
and how many are observed, of the default models of toppling and rocking. Each earthquake is
predicted without it. --write puts the tables into docs/evidence/model-choice.md and draws
docs/figures/reliability.svg.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from benchmarks.held_out import Predicted, StoredModels, clustered_mean
from benchmarks.model_aims import REQUIRED_ONLY, SA_21, WITH_PGV, MeasureSet
from benchmarks.page import ROOT, markdown, parser, write_table
from rbfrag.db.location import REFERENCE
from rbfrag.db.model_file import read_models
from rbfrag.plots import canvas

PAGE = ROOT / "docs" / "evidence" / "model-choice.md"
FIGURE = ROOT / "docs" / "figures" / "reliability.svg"

EDGES = (0.0, 1e-4, 1e-3, 1e-2, 0.05, 0.2, 0.5, 0.8, 0.95, 0.99, 0.999, 1.0)
"""Edges of the bins of P; P = 0 by mechanics is a bin of its own."""

SHOWN: Mapping[str, Sequence[tuple[str, MeasureSet, str]]] = {
    "toppling": (
        ("toppling-pgv_pga", REQUIRED_ONLY, "PGV, PGA"),
        ("toppling-pgv_pga", SA_21, "PGV, PGA, SA at 21 periods"),
    ),
    "rocking": (
        ("rocking-pga", WITH_PGV, "PGV, PGA"), ("rocking-pga", SA_21, "PGA, SA at 21 periods"),
    ),
}  # fmt: skip
"""Models and what they are given, by kind."""

LOWEST = 3e-5
"""Lower end of the axes; bins without a failure are drawn there, as open triangles."""


@dataclass(frozen=True)
class Bin:
    """Held-out blocks with P in one bin.

    Args:
        words: the range of P.
        blocks: their number.
        earthquakes: how many earthquakes they are of.
        predicted: expected number of failures.
        observed: number of failures.
        error: standard error of the observed fraction, clustered by earthquake.
    """

    words: str
    blocks: int
    earthquakes: int
    predicted: float
    observed: int
    error: float


def percent(p: float) -> str:
    """Return a probability in per cent as the answers print it."""
    return f"{100.0 * p:.6g}"


def bins_of(predicted: Predicted) -> list[Bin]:
    """Return the blocks by bins of P, the lowest first."""
    ranges = [("0 by mechanics", predicted.p == 0.0)]
    for low, high in pairwise(EDGES):
        inside = (predicted.p > 0.0) & (predicted.p >= low) & (predicted.p < high)
        words = f"{percent(low)}–{percent(high)} %"
        if low == 0.0:
            words = f"< {percent(high)} %"
        elif high == 1.0:
            words, inside = f"≥ {percent(low)} %", predicted.p >= low
        ranges.append((words, inside))
    result = []
    for words, inside in ranges:
        part = predicted.only(inside)
        earthquakes = np.unique(part.event).size
        error = clustered_mean(part.failed, part.event)[1] if earthquakes > 1 else np.nan
        result.append(
            Bin(words, part.p.size, earthquakes, float(part.p.sum()), int(part.failed.sum()), error)
        )
    return result


def fraction(count: float, blocks: int) -> str:
    """Return a number of failures with its fraction in per cent."""
    if not blocks:
        return "–"
    share = count / blocks
    digits = 4 if share >= 0.99 else 2
    words = f"{100.0 * share:.{digits}g} %" if share >= EDGES[1] or not count else "< 0.01 %"
    return f"{count:,.0f} ({words})"


def table(bins: Mapping[str, Sequence[Bin]]) -> str:
    """Return predicted and observed failures by bins of P, for what is given."""
    head = ["$P$"]
    for words in bins:
        head += [f"{words}: blocks (earthquakes)", "predicted failures", "observed failures"]
    cells = []
    for line in zip(*bins.values(), strict=True):
        row = [line[0].words]
        for part in line:
            row += [
                f"{part.blocks:,} ({part.earthquakes})", fraction(part.predicted, part.blocks),
                fraction(part.observed, part.blocks),
            ]  # fmt: skip
        cells.append(row)
    return markdown((head, cells))


@canvas.in_own_style
def plot(bins_by_kind: Mapping[str, Mapping[str, Sequence[Bin]]], path: Path) -> canvas.Picture:
    """Draw the observed fraction by P with 95 % intervals, and the number of blocks below."""
    figure = canvas.new_figure(8.4, 5.0)
    axes = figure.subplots(2, 2, sharex=True, sharey="row", height_ratios=(3, 1))
    for column, (kind, bins_by_words) in enumerate(bins_by_kind.items()):
        upper, lower = axes[:, column]
        for number, (words, bins) in enumerate(bins_by_words.items()):
            _draw(upper, lower, bins, words, number)
        upper.plot([LOWEST, 1.0 - LOWEST], [LOWEST, 1.0 - LOWEST], "-", color="#999999", lw=1.0)
        upper.set_title("backed blocks (toppling)" if kind == "toppling" else
                        "free-standing blocks (rocking)")  # fmt: skip
        upper.set_xscale("logit")
        upper.set_yscale("logit")
        upper.set_xlim(LOWEST, 1.0 - LOWEST)
        upper.set_ylim(LOWEST, 1.0 - LOWEST)
        lower.set_yscale("log")
        lower.set_ylim(1e3, 5e4)
        lower.set_xlabel("predicted P(failure)")
        ticks = (1e-4, 1e-2, 0.5, 0.99, 0.9999)
        for axis in (upper.xaxis, upper.yaxis, lower.xaxis):
            axis.set_ticks(ticks, [f"{percent(tick)} %" for tick in ticks])
            axis.set_ticks([], minor=True)
        counts = (1_000, 3_000, 10_000, 30_000)
        lower.yaxis.set_ticks(counts, [f"{count:,}" for count in counts])
        lower.yaxis.set_ticks([], minor=True)
        upper.legend(loc="upper left", fontsize=8.5)
        canvas.light_grid(upper, lower)
    axes[0, 0].set_ylabel("observed fraction of held-out blocks")
    axes[1, 0].set_ylabel("blocks")
    return canvas.save_figure(figure, path)


def _draw(upper: Axes, lower: Axes, bins: Sequence[Bin], words: str, number: int) -> None:
    colour, marker = (("#2166ac", "s"), (canvas.RED, "o"))[number]
    shown = [part for part in bins if part.blocks and part.predicted > 0.0]
    p = np.array([part.predicted / part.blocks for part in shown])
    observed = np.array([part.observed / part.blocks for part in shown])
    reach = 1.96 * np.array([part.error for part in shown])
    low, high = (np.clip(observed + side * reach, LOWEST, 1.0 - LOWEST) for side in (-1.0, 1.0))
    x, y = (np.clip(values, LOWEST, 1.0 - LOWEST) for values in (p, observed))
    any_failed = observed > 0.0
    upper.errorbar(x[any_failed], y[any_failed],
                   [(y - low)[any_failed], np.clip(high - y, 0.0, None)[any_failed]],
                   fmt=marker, ms=4.5, color=colour, lw=1.0, label=words)  # fmt: skip
    upper.plot(x[~any_failed], y[~any_failed], "v", ms=6, mec=colour, mfc="white", clip_on=False)
    lower.plot(x, [part.blocks for part in shown], marker, ms=4.5, color=colour, clip_on=False)


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the tables, and keep them with the figure if asked to."""
    options = parser(__doc__)
    options.add_argument("--db", default=str(REFERENCE), help="database with outcomes and models")
    chosen = options.parse_args(arguments)
    models = StoredModels(chosen.db, read_models(chosen.db))
    bins_by_kind = {
        kind: {
            words: bins_of(models.predicted(name, measures.names))
            for name, measures, words in shown
        }
        for kind, shown in SHOWN.items()
    }
    for kind, bins in bins_by_kind.items():
        text = table(bins)
        print(f"## {kind}\n\n{text}\n", flush=True)
        if chosen.write:
            write_table(PAGE, f"reliability-{kind}", text)
    if chosen.write:
        plot(bins_by_kind, FIGURE)


if __name__ == "__main__":
    main()
