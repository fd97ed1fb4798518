"""How good the models of sliding blocks are:  python -m benchmarks.sliding_models DATABASE

Reads the sliding campaign of a database and prints what each model scores on earthquakes left out,
how far it is off by magnitude, and published regressions on the same rows beside our form; --write
keeps the tables, in docs/evidence/other-kinds.md or benchmarks/results.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Mapping
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from benchmarks.model_choice import clustered_mean, log_losses
from benchmarks.page import ROOT, write_table
from benchmarks.slide_comparison import comparison
from rbfrag.bench.tables import markdown
from rbfrag.db.engine import opened_database
from rbfrag.fragility.fit.data import FitSource, read_source
from rbfrag.fragility.fit.fitting import Fitted, fit_source
from rbfrag.fragility.fit.scores import calibration
from rbfrag.fragility.measures import TERMS
from rbfrag.fragility.methods import method_named

PAGE = ROOT / "docs" / "evidence" / "other-kinds.md"
MAGNITUDES = (0.0, 5.6, 6.0, 6.5, 7.5, math.inf)
"""Edges of the classes that intercepts are told by."""

AIM = 0.9
"""How far an intercept of the model that reads the magnitude may be off."""


def magnitude_of_rows(source: FitSource, fit: Fitted) -> NDArray[np.float64]:
    """Return the magnitude of each row of a fit, NaN where it is not known."""
    return source.table.magnitude[fit.data.combination]


def intercepts(source: FitSource, fit: Fitted) -> list[float]:
    """Return the calibration intercept of each class of magnitude, above 0 where P is too low."""
    judged, magnitude = fit.data.judged, magnitude_of_rows(source, fit)
    return [
        calibration(
            fit.result.held_out, judged.failed,
            judged.known & ((magnitude >= low) & (magnitude < high))[:, None],
        ).intercept
        for low, high in pairwise(MAGNITUDES)
    ]  # fmt: skip


def score_table(source: FitSource, fits: Mapping[str, Fitted]) -> str:
    """Return log loss, slope and intercepts of the models, best first."""
    cells = []
    for fit in sorted(fits.values(), key=lambda f: f.report.scores["log_loss_held_out"]):
        judged = fit.data.judged
        event = np.broadcast_to(fit.data.event[:, None], judged.known.shape)[judged.known]
        losses = log_losses(fit.result.held_out, judged.failed)[judged.known]
        mean, error = clustered_mean(losses, event.astype(np.intp))
        cells.append([
            f"`{fit.report.name}`", ", ".join(fit.report.model.term.inputs),
            f"{mean:.4f} ± {error:.4f}",
            f"{fit.report.scores['calibration_slope_held_out']:.2f}",
            *(f"{value:+.2f}" for value in intercepts(source, fit)),
        ])  # fmt: skip
    classes = [
        f"M {low:g} to {high:g}" if low > 0.0 and high < math.inf
        else f"M < {high:g}" if high < math.inf else f"M ≥ {low:g}"
        for low, high in pairwise(MAGNITUDES)
    ]  # fmt: skip
    return markdown((["model", "reads", "log loss", "slope", *classes], cells))


def main(arguments: list[str] | None = None) -> None:
    """Print the tables, and keep them if asked to."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("database")
    options.add_argument("--write", action="store_true", help="keep the tables")
    chosen = options.parse_args(arguments)
    method = method_named("displacement")
    with opened_database(chosen.database, read_only=True) as engine, engine.connect() as connection:
        source = read_source(connection, method.block)
    fits = {term: fit_source(source, TERMS[term], method, shared=False) for term in method.forms}
    tables = {
        "sliding-scores": score_table(source, fits),
        "sliding-one": comparison(source, facing="one"),
        "sliding-either": comparison(source, facing="either"),
    }
    for name, table in tables.items():
        print(f"## {name}\n\n{table}\n", flush=True)
        if chosen.write:
            write_table(PAGE, name, table)
    if max(map(abs, intercepts(source, fits["pgv_pga_m"]))) > AIM:
        raise SystemExit(f"an intercept of sliding-pgv_pga_m is off by more than {AIM:g}")


if __name__ == "__main__":
    main()
