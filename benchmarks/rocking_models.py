"""Models of free-standing blocks on earthquakes left out:  python -m benchmarks.rocking_models

Fits them to the rocking campaign of --db FILE, or to one that is made of --records (a folder with
MANIFEST.csv), and prints what each scores on earthquakes that it has not seen, beside what is
asked: log loss, Brier score, calibration slope over all and by block size. T0, T1 and T2 are the
forms of two, three and five terms, without the factor of size, that the shipped ones are compared
with; T1 is of blocks with Housner's restitution alone. --write keeps the tables in
benchmarks/results. The exit status is 1 where anything is missed.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.page import ROOT, parser, report
from rbfrag.bench.cases import RECORDS_VARIABLE
from rbfrag.bench.tables import markdown
from rbfrag.campaign.add_motions import add_motions
from rbfrag.campaign.simulate import simulate
from rbfrag.db.engine import opened_database
from rbfrag.fragility.fit.clusters import jackknife_steps
from rbfrag.fragility.fit.data import FitData, FitSource, fit_data, read_source
from rbfrag.fragility.fit.likelihood import most_likely
from rbfrag.fragility.fit.outcomes import outcome_rows, sensitive_share
from rbfrag.fragility.fit.scores import ScoredBlocks, brier, calibration, log_loss
from rbfrag.fragility.measures import TERMS
from rbfrag.fragility.method import Eta, Form, Method, Numbers
from rbfrag.fragility.methods import method_named
from rbfrag.fragility.methods.overturning import BLOCK
from rbfrag.solver.results import DEFAULT_P2

FloatArray = NDArray[np.float64]

PAGE = ROOT / "docs" / "theory" / "rocking.md"

SHIPPED = method_named("overturning")

SLOPE, SLOPE_OF_SIZE = (0.95, 1.05), (0.75, 1.25)
"""Calibration slopes that are asked over all, and of each block size."""


def _first_terms(count: int) -> Form:
    """Return the first terms of the shipped form on PGV and PGA, without its factor of size."""
    whole = SHIPPED.forms["pgv_pga"]

    def formula(b: Sequence[float], v: Mapping[str, Any], ns: Numbers) -> Eta:
        eta = whole.formula([*b, *[0.0] * (len(whole.parameters) - count)], v, ns)
        return Eta(eta.eta, eta.slopes[:count])

    return replace(whole, parameters=whole.parameters[:count], formula=formula, size_factor=None)


def _velocity_alone(b: Sequence[float], v: Mapping[str, Any], ns: Numbers) -> Eta:
    ratio = ns.log(v["y_m_s"] / v["intensity_m_s"])
    return Eta(b[0] + b[1] * ratio, (1.0, ratio))


@dataclass(frozen=True)
class Study:
    """One model, and what is asked of it.

    Args:
        name: its name in the table.
        form: its formula.
        term: what it reads of the shaking.
        housner: of blocks with Housner's restitution alone, not of all.
        log_loss: the greatest that is asked; None for a model that is there to compare with.
    """

    name: str
    form: Form
    term: str
    housner: bool = False
    log_loss: float | None = None


STUDIES = (
    Study("T0: PGV/y alone", Form(("b0", "b1"), _velocity_alone, 0), "pgv"),
    Study("T1: Housner's restitution", _first_terms(3), "pgv_pga", True, 0.248),
    Study("T2: restitution given", _first_terms(5), "pgv_pga", False, 0.223),
    *(
        Study(f"`{BLOCK.kind}-{term}`", form, term, False, 0.223 if term == "pgv_pga" else None)
        for term, form in SHIPPED.forms.items()
    ),
)

PUBLISHED = {
    "T1: Housner's restitution": ((5.491, 0.27), (-1.885, 0.09), (4.072, 0.16)),
    "T2: restitution given": (
        (7.377, 0.32), (-1.818, 0.08), (4.575, 0.16), (-8.514, 0.37), (-1.102, 0.09),
    ),
}  # fmt: skip
"""Coefficients with clustered standard errors of the same forms, fitted independently to 265
horizontal motions of 47 earthquakes of this collection."""


@dataclass(frozen=True, eq=False)
class Scores:
    """What a model scores on earthquakes left out.

    Args:
        coefficients: of the fit to all.
        errors: their standard errors, clustered by earthquake.
        log_loss: mean over the grid, and its standard error clustered by earthquake.
        brier: Brier score.
        slope: calibration slope.
        loss_by_size: log loss by p².
        slope_by_size: calibration slope by p².
        loss_by_factor: log loss by the factor on Housner's restitution, the greatest first.
    """

    coefficients: FloatArray
    errors: FloatArray
    log_loss: tuple[float, float]
    brier: float
    slope: float
    loss_by_size: tuple[float, ...]
    slope_by_size: tuple[float, ...]
    loss_by_factor: tuple[float, ...]


def measured(source: FitSource, study: Study) -> Scores:
    """Return what a model scores."""
    factor = source.of_block["restitution_factor"]
    if study.housner:
        source = source.only(factor == 1.0)
    method: Method = replace(SHIPPED, forms={study.term: study.form})
    data = fit_data(source, method, TERMS[study.term])
    rows = outcome_rows(data, method, TERMS[study.term], study.form.parameters)
    best = most_likely(rows.data)
    steps = jackknife_steps(rows.data, best)
    held_out = rows.held_out(best)
    judged = data.judged
    size, own = data.grid("p2"), data.grid("restitution_factor")

    def loss(chosen: NDArray[np.bool_]) -> float:
        return log_loss(held_out, judged.failed, judged.known & chosen)

    every = np.ones_like(judged.known)
    return Scores(
        best,
        np.sqrt((steps**2).sum(axis=0) * (len(steps) - 1) / len(steps)),
        (loss(every), clustered_error(held_out, judged)),
        brier(held_out, judged.failed, judged.known),
        calibration(held_out, judged.failed, judged.known).slope,
        tuple(loss(size == p2) for p2 in DEFAULT_P2),
        tuple(
            calibration(held_out, judged.failed, judged.known & (size == p2)).slope
            for p2 in DEFAULT_P2
        ),
        tuple(loss(own == value) for value in np.unique(own)[::-1]),
    )


def clustered_error(held_out: FloatArray, judged: ScoredBlocks) -> float:
    """Return the standard error of the mean log loss, clustered by earthquake."""
    p = np.clip(held_out, 1e-4, 1.0 - 1e-4)
    loss = np.where(judged.failed > 0.5, -np.log(p), -np.log1p(-p)) * judged.known
    mean = loss.sum() / judged.known.sum()
    beyond = np.bincount(judged.event, (loss - mean * judged.known).sum(axis=1))
    return float(np.sqrt((beyond**2).sum()) / judged.known.sum())


def missed(study: Study, scores: Scores) -> list[str]:
    """Return what is asked of a model and not reached."""
    if study.log_loss is None:
        return []
    low, high = SLOPE_OF_SIZE
    checks = {
        "log loss": scores.log_loss[0] <= study.log_loss,
        "slope": SLOPE[0] <= scores.slope <= SLOPE[1],
        "slope of a size": all(low <= each <= high for each in scores.slope_by_size),
    }
    return [name for name, reached in checks.items() if not reached]


def line(study: Study, scores: Scores) -> list[str]:
    """Return a line of the table."""
    asked = "" if study.log_loss is None else f" (≤ {study.log_loss})"
    return [
        study.name,
        f"{scores.log_loss[0]:.4f} ± {scores.log_loss[1]:.3f}{asked}",
        " ".join(f"{value:.3f}" for value in scores.loss_by_factor),
        f"{scores.brier:.4f}",
        f"{scores.slope:.2f}",
        " ".join(f"{value:.2f}" for value in scores.loss_by_size),
        " ".join(f"{value:.2f}" for value in scores.slope_by_size),
    ]


HEADERS = [
    "model", "log loss (asked)", "by factor 1, .95, .9, .8", "Brier", "slope",
    "log loss by p² = 30 … 0.1", "slope by p²",
]  # fmt: skip


def compared(study: Study, scores: Scores) -> list[list[str]]:
    """Return the lines of coefficients beside those of an independent fit."""
    return [
        [
            study.name.partition(":")[0],
            f"`{name}`",
            f"{ours:.3f} ± {error:.2f}",
            f"{theirs:.3f} ± {their_error:.2f}",
        ]
        for name, ours, error, (theirs, their_error) in zip(
            study.form.parameters, scores.coefficients, scores.errors, PUBLISHED[study.name],
            strict=True,
        )
    ]  # fmt: skip


def campaign(root: str, place: Path) -> Path:
    """Make the rocking campaign over a folder of records."""
    add_motions([root], db=place, suite="records", metadata=Path(root) / "MANIFEST.csv")
    simulate(place, kind=BLOCK.kind)
    return place


def read(place: str | Path) -> tuple[FitSource, FitData]:
    """Return what fits read, and the rows of the shipped form."""
    with opened_database(place, read_only=True) as engine, engine.connect() as connection:
        source = read_source(connection, BLOCK)
    return source, fit_data(source, SHIPPED, TERMS["pgv_pga"])


def main() -> None:
    options = parser(__doc__)
    options.add_argument("--db", help="database with the rocking campaign")
    chosen = options.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        place = chosen.db
        if place is None:
            root = chosen.records or os.environ.get(RECORDS_VARIABLE)
            if root is None:
                raise SystemExit("name a database with --db, or a folder with --records")
            place = campaign(root, Path(folder) / "rocking.db")
        source, data = read(place)
    lines, coefficients, failures = [], [], []
    for study in STUDIES:
        scores = measured(source, study)
        lines.append(line(study, scores))
        print(" | ".join(lines[-1]), flush=True)
        failures += [f"{study.name}: {what}" for what in missed(study, scores)]
        if study.name in PUBLISHED:
            coefficients += compared(study, scores)
    rows = outcome_rows(data, SHIPPED, TERMS["pgv_pga"], SHIPPED.forms["pgv_pga"].parameters)
    share = sensitive_share(data, rows)["sensitive_share"]
    text = "\n\n".join((
        markdown((HEADERS, lines)),
        f"{int(data.judged.known.sum()):,} outcomes of {np.unique(data.motion).size} horizontal "
        f"motions of {data.events} earthquakes, each predicted by fits without its earthquake; "
        f"{100.0 * share:.1f} % of the fitted ones are sensitive.",
        markdown((["model", "term", "here", "independent fit"], coefficients)),
    ))  # fmt: skip
    report("rocking-models", text, write=chosen.write, page=PAGE)
    if failures:
        raise SystemExit("missed: " + "; ".join(failures))


if __name__ == "__main__":
    main()
