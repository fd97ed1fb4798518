"""How good models are on earthquakes left out:  python -m benchmarks.model_choice [--db DATABASE]

Every model is fitted to 15 of 16 parts of the earthquakes and judged on the other, on blocks of
k_r >= 0.02 and of k_r >= 0.05. --aims prints what is aimed at beside what is reached, and the exit
status is then 1 where an aim is missed; --kind and --model choose. The database has to hold what
the models read: the reference has that of toppling and sliding. --write keeps the tables, in
the page of their kind or benchmarks/results. Models of a kind that the database has no outcomes of
are passed over: of rocking the reference has none. Those of sliding have aims alone here, and
their tables by benchmarks.sliding_models.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from benchmarks.held_out import STEP, folds
from benchmarks.page import ROOT, markdown, parser, write_table
from rbfrag.db.engine import opened_database
from rbfrag.db.location import REFERENCE
from rbfrag.fragility.fit.data import REAL_KR, Y0_OVER_PGV, FitSource, fit_data, read_source
from rbfrag.fragility.fit.fitting import fit_source
from rbfrag.fragility.fit.likelihood import Binomial, maximise, most_likely
from rbfrag.fragility.fit.maximum_likelihood import outcome_rows, parameter_names
from rbfrag.fragility.fit.result import CLIP, calibration, cr3, jackknife_steps
from rbfrag.fragility.measures import TERMS
from rbfrag.fragility.method import LOGIT
from rbfrag.fragility.methods import method_named
from rbfrag.vocabulary.quantities import word_of


@dataclass(frozen=True)
class Mark:
    """One number that is aimed at.

    Args:
        model: whose number it is.
        words: what it is.
        low: least value that is accepted.
        high: greatest value that is accepted.
        value: what is reached.
        also: a further condition, in words, with whether it holds.
    """

    model: str
    words: str
    low: float
    high: float
    value: float
    also: tuple[str, bool] | None = None

    @property
    def aim(self) -> str:
        """The range in words."""
        if math.isinf(self.low):
            words = f"≤ {self.high:g}"
        elif math.isinf(self.high):
            words = f"≥ {self.low:g}"
        else:
            words = f"{self.low:g} to {self.high:g}"
        return words if self.also is None else f"{words}, {self.also[0]}"

    @property
    def reached(self) -> bool:
        """Whether it is."""
        return self.low <= self.value <= self.high and (self.also is None or self.also[1])

    @property
    def cell(self) -> str:
        """The value with whether it is reached."""
        return f"{self.value:.4g}" if self.reached else f"**{self.value:.4g}, missed**"


def acceptance_table(marks: Sequence[Mark]) -> str:
    """Return the table of the page."""
    head = ["model", "what", "aim", "reached"]
    return markdown((head, [[m.model, m.words, m.aim, m.cell] for m in marks]))


FloatArray = NDArray[np.float64]
Labels = NDArray[np.intp]
Mask = NDArray[np.bool_]

PAGES = {
    "toppling": ROOT / "docs" / "evidence" / "model-choice.md",
    "rocking": ROOT / "docs" / "theory" / "rocking.md",
    "sliding": ROOT / "docs" / "evidence" / "other-kinds.md",
}

KR_CLASSES = (0.02, 0.05, 0.1, 0.2, 0.4, 1.0)
"""Edges of the classes of k_r that slopes are told by."""

MAGNITUDES = (0.0, 5.6, 6.0, 6.5, 7.5, math.inf)
"""Edges of the classes of magnitude that intercepts are told by."""

STRONG_KR = 0.2
"""From here on predicted failures are compared with observed ones."""

LOSS_WITHIN, SLOPE_WITHIN = 0.002, 0.05
"""How near a log loss and a slope have to be to those that the forms were chosen by."""


@dataclass(frozen=True)
class Aims:
    """What is aimed at, of one model; losses and slopes are those of the study of its form.

    Args:
        method: how it is fitted.
        term: what it reads.
        kind: response kind.
        loss: log loss; of blocks known by k_r from 0.02 on.
        loss_kr05: log loss from k_r = 0.05 on.
        slope_kr05: calibration slope from there on.
        strong: least and greatest ratio of predicted to observed failures of strong blocks.
        kr_slopes: slopes by class of `KR_CLASSES`, as many as were measured.
        size_slopes: least and greatest slope of a size p².
        intercept: how far the calibration intercept of a class of `MAGNITUDES` may be off.
    """

    method: str
    term: str
    kind: str = "toppling"
    loss: float | None = None
    loss_kr05: float | None = None
    slope_kr05: float | None = None
    strong: tuple[float, float] | None = None
    kr_slopes: tuple[float, ...] = ()
    size_slopes: tuple[float, float] | None = None
    intercept: float | None = None


_STRONG = (0.8, 1.35)

MODELS: dict[str, Aims] = {
    "bounded-pgv_kr": Aims("bounded", "pgv_kr", "toppling", 0.1295, 0.1078, 0.87, _STRONG),
    "bounded-pgv_pga": Aims("bounded", "pgv_pga", "toppling", 0.1128, 0.0860, 0.92, _STRONG),
    "bounded-pgv_pga_tm": Aims("bounded", "pgv_pga_tm", "toppling", 0.1075, 0.0797, 0.96, _STRONG),
    "bounded-pgv_pga_sa10_sa30": Aims(
        "bounded", "pgv_pga_sa10_sa30", "toppling", 0.1068, 0.0784, 0.98, _STRONG,
        (1.05, 1.02, 0.91, 0.85), (0.93, 1.17),
    ),
    "logistic-sa10": Aims("logistic", "sa10", "toppling", 0.1890, 0.1408, 1.02, (0.7, 1.35)),
    "bounded-pga": Aims("bounded", "pga", "toppling", 0.2495, 0.1695, 0.98, _STRONG),
    "bounded-pga_sa10": Aims("bounded", "pga_sa10", "toppling", 0.1495, 0.1043, 1.07, _STRONG),
    "bounded-pga_sa03_sa10_sa30": Aims(
        "bounded", "pga_sa03_sa10_sa30", "toppling", 0.1311, 0.0931, 1.03, _STRONG
    ),
    "record-xp": Aims("record", "xp", "toppling", 0.0265, 0.0108, 1.08, _STRONG),
    "wls-pgv": Aims("wls", "pgv"),
    "logistic-pga_tm": Aims("logistic", "pga_tm"),
    "logistic-pgd_tm": Aims("logistic", "pgd_tm"),
    **{
        f"rocking-{term}": Aims("overturning", term, "rocking", *losses, size_slopes=slopes)
        for term, losses, slopes in (
            ("pgv_pga_sa10_sa30", (0.1235, 0.0974), (0.80, 1.20)),
            ("pgv_pga", (0.1488, 0.1179), None),
            ("pgv", (0.1877, 0.1523), None),
            ("sa10", (0.2024, 0.1672), None),
            ("pga_sa10", (0.1683, 0.1287), None),
            ("pga_sa10_sa30", (0.1264, 0.0985), None),
            ("pga_m", (0.2248, 0.1792), None),
        )
    },
    **{
        f"sliding-{term}": Aims("displacement", term, "sliding", loss, intercept=intercept)
        for term, loss, intercept in (
            ("pgv_pga_m", 0.0934, 0.9), ("pgv_pga", 0.1040, None), ("pgv_pga_ia", 0.0801, None),
            ("pgv", None, None),
        )
    },
}  # fmt: skip
"""The models that are judged, by the names that they are stored under."""


@dataclass(frozen=True, eq=False)
class Predicted:
    """What a model said of blocks of earthquakes that it had not seen, all of length n.

    Args:
        p: probability of failure.
        failed: 1 or 0.
        event: number of the earthquake.
        kr: strength; None of blocks that are not known by it.
        p2: size [1/s²], likewise.
        shares: share of the blocks of the same y/PGV and size that failed in other earthquakes.
        magnitude: of the earthquake, NaN where it is not known.
    """

    p: FloatArray
    failed: FloatArray
    event: Labels
    kr: FloatArray | None = None
    p2: FloatArray | None = None
    shares: FloatArray | None = None
    magnitude: FloatArray | None = None

    def only(self, chosen: Mask) -> Predicted:
        """Return some of the blocks."""
        columns = (getattr(self, field.name) for field in fields(self))
        return Predicted(*(None if c is None else c[chosen] for c in columns))

    def kr_from(self, least: float, below: float = math.inf) -> Predicted:
        """Return the blocks of some strengths."""
        assert self.kr is not None
        return self.only((self.kr >= least) & (self.kr < below))

    def of_size(self, p2: float) -> Predicted:
        """Return the blocks of one size [1/s²]."""
        assert self.p2 is not None
        return self.only(np.isclose(self.p2, p2))

    def of_magnitude(self, least: float, below: float) -> Predicted:
        """Return the blocks of some earthquakes."""
        assert self.magnitude is not None
        return self.only((self.magnitude >= least) & (self.magnitude < below))

    @property
    def loss(self) -> float:
        """Mean log loss."""
        return float(log_losses(self.p, self.failed).mean())

    @property
    def slope(self) -> tuple[float, float]:
        """Calibration slope with its error; not a number where P tells all outcomes apart."""
        failed = self.failed > 0.5
        if not failed.any() or failed.all() or self.p[failed].min() > self.p[~failed].max():
            return math.nan, math.nan
        return calibration_slope(self.p, self.failed, self.event)

    @property
    def intercepts(self) -> list[float]:
        """Calibration intercept of each class of magnitude, above 0 where P is too low."""
        parts = [self.of_magnitude(low, high) for low, high in pairwise(MAGNITUDES)]
        return [
            calibration(part.p, part.failed, np.ones(part.p.size, dtype=np.bool_)).intercept
            for part in parts
        ]

    @property
    def ratio(self) -> float:
        """Predicted over observed failures."""
        return float(self.p.sum() / self.failed.sum())


def log_losses(p: FloatArray, failed: FloatArray) -> FloatArray:
    """Return the log loss of each block."""
    clipped = np.clip(p, CLIP, 1.0 - CLIP)
    return np.asarray(-np.where(failed > 0.5, np.log(clipped), np.log1p(-clipped)))


def clustered_mean(values: FloatArray, event: Labels) -> tuple[float, float]:
    """Return the mean of finite values and its standard error clustered by earthquake."""
    finite = np.isfinite(values)
    values, event = values[finite], event[finite]
    mean = float(values.mean())
    sums = np.bincount(event, values - mean)
    g = np.unique(event).size
    return mean, float(np.sqrt(g / (g - 1.0) * (sums @ sums)) / values.size)


def calibration_slope(p: FloatArray, failed: FloatArray, event: Labels) -> tuple[float, float]:
    """Return the slope of outcomes on the clipped logit of P, and its CR3 error.

    1 is perfect, and less than 1 over-confidence.
    """
    clipped = np.clip(p, CLIP, 1.0 - CLIP)
    columns = np.column_stack([np.ones(p.size), np.log(clipped / (1.0 - clipped))])
    number = np.unique(event, return_inverse=True)[1].astype(np.intp)
    rows = Binomial(LOGIT, columns, failed, np.ones(p.size), number)
    b = most_likely(rows)
    return float(b[1]), float(np.sqrt(cr3(jackknife_steps(rows, b))[1, 1]))


def table_of_shares(failed: FloatArray, event: Labels, cell: Labels) -> FloatArray:
    """Return the share of other earthquakes' blocks of the same cell that failed.

    Half a failure in one more block is counted in, so that no share is 0 or 1.
    """
    shape = (int(event.max()) + 1, int(cell.max()) + 1)
    place = event * shape[1] + cell
    n = np.bincount(place, minlength=shape[0] * shape[1]).reshape(shape)
    failures = np.bincount(place, failed, minlength=shape[0] * shape[1]).reshape(shape)
    of_other_events, of_others = n.sum(axis=0) - n, failures.sum(axis=0) - failures
    return np.asarray(((of_others + 0.5) / (of_other_events + 1.0)).ravel()[place])


def predicted(source: FitSource, aims: Aims) -> Predicted:
    """Return what a model says of earthquakes left out: by folds, or one by one.

    One by one are left out those of methods that read no outcomes.
    """
    method, term = method_named(aims.method), TERMS[aims.term]
    if method.reads == "outcomes":
        data = fit_data(source, method, term, kind=aims.kind)
        rows = outcome_rows(data, method, term, parameter_names(method, term))
        best, fold = most_likely(rows.data), folds(data.event)[rows.place // data.failed.shape[1]]
        grid = np.zeros(rows.bounded.shape)
        for in_fold in (fold == number for number in range(fold.max() + 1)):
            b = maximise(rows.data.only(~in_fold), best, tolerance=1e-9)[0]
            grid.flat[rows.place[in_fold]] = rows.data.only(in_fold).probability(b)
    else:
        fitted = fit_source(source, term, method, kind=aims.kind)
        data, grid = fitted.data, fitted.result.held_out
    judged = data.judged
    is_known = judged.is_known
    event = np.broadcast_to(data.event[:, None], is_known.shape)[is_known]
    failed = judged.failed[is_known]
    of_motions = source.table.measure("magnitude")[data.combination]
    magnitude = np.broadcast_to(of_motions[:, None], is_known.shape)[is_known]
    if not {"kr", "p2"} <= set(data.blocks):
        return Predicted(grid[is_known], failed, event, magnitude=magnitude)
    kr, p2 = (data.grid(name)[is_known] for name in ("kr", "p2"))
    ratio = (data.grid("y_m_s") / data.grid("pgv_m_s"))[is_known]
    strength = np.rint(np.log(ratio / Y0_OVER_PGV[0]) / STEP).astype(np.intp)
    size = np.unique(p2, return_inverse=True)[1].astype(np.intp)
    shares = table_of_shares(failed, event, size * (int(strength.max()) + 1) + strength)
    return Predicted(grid[is_known], failed, event, kr, p2, shares, magnitude)


def score_table(predictions_by_model: Mapping[str, Predicted]) -> str:
    """Return the scores of models whose blocks are known by k_r, best first."""
    cells = []
    for name, prediction in sorted(predictions_by_model.items(), key=lambda item: item[1].loss):
        real, strong = prediction.kr_from(REAL_KR), prediction.kr_from(STRONG_KR)
        assert real.shares is not None
        skill = 1.0 - real.loss / log_losses(real.shares, real.failed).mean()
        cells.append([
            f"`{name}`", measures_cell(name),
            loss_cell(prediction), loss_cell(real), f"{skill:+.2f}", _slope(real),
            f"{strong.ratio:.2f}",
        ])  # fmt: skip
    head = [
        "model", "reads", "log loss, $k_r$ ≥ .02", "log loss, $k_r$ ≥ .05", "skill", "slope",
        "predicted/observed, $k_r$ ≥ .2",
    ]  # fmt: skip
    return markdown((head, cells))


def measures_cell(name: str) -> str:
    """Return what a model reads of the shaking, in the words of the command line."""
    return ", ".join(map(word_of, TERMS[MODELS[name].term].inputs))


def loss_cell(blocks: Predicted) -> str:
    """Return the log loss with its error by earthquakes."""
    mean, error = clustered_mean(log_losses(blocks.p, blocks.failed), blocks.event)
    return f"{mean:.4f} ± {error:.4f}"


def class_table(predictions_by_model: Mapping[str, Predicted], by: str = "kr") -> str:
    """Return the slope of each class of k_r or of `magnitude`, or of each size `p2`.

    By magnitude it is that of blocks of `REAL_KR` and more, with predicted over observed failures.
    """
    models = predictions_by_model.values()
    classes: dict[str, list[Predicted]] = {}
    if by == "p2":
        for p2 in np.unique(
            np.concatenate([prediction.p2 for prediction in models if prediction.p2 is not None])
        )[::-1]:
            classes[f"$p^2$ = {p2:g} 1/s²"] = [prediction.of_size(p2) for prediction in models]
    elif by == "magnitude":
        for words, low, high in magnitude_classes():
            of_class = [prediction.of_magnitude(low, high) for prediction in models]
            classes[words] = [prediction.kr_from(REAL_KR) for prediction in of_class]
    else:
        for low, high in pairwise(KR_CLASSES):
            words = f"$k_r$ {low:g} to {high:g}"
            classes[words] = [prediction.kr_from(low, high) for prediction in models]
    cells = []
    for words, predictions in classes.items():
        ratios = [
            f"; {prediction.ratio:.2f}" if by == "magnitude" else "" for prediction in predictions
        ]
        cells.append(
            [
                words,
                *(
                    _slope(prediction) + ratio
                    for prediction, ratio in zip(predictions, ratios, strict=True)
                ),
            ]
        )
    return markdown((["slope", *(f"`{name}`" for name in predictions_by_model)], cells))


def magnitude_classes() -> Iterator[tuple[str, float, float]]:
    """Yield the classes of magnitude in words, with their ends."""
    for low, high in pairwise(MAGNITUDES):
        if math.isinf(high):
            yield f"M ≥ {low:g}", low, high
        else:
            yield (f"M {low:g} to {high:g}" if low > 0.0 else f"M < {high:g}"), low, high


def _slope(blocks: Predicted) -> str:
    slope, error = blocks.slope
    return f"{slope:.2f} ± {error:.2f}" if math.isfinite(slope) else "–"


def marks(name: str, aims: Aims, predictions: Predicted) -> Iterator[Mark]:
    """Yield what is aimed at, with what is reached."""
    of_kr = predictions.kr is not None

    def loss(words: str, aim: float, prediction: Predicted) -> Mark:
        return Mark(name, words, aim - LOSS_WITHIN, aim + LOSS_WITHIN, round(prediction.loss, 4))

    def slope(words: str, aim: float, prediction: Predicted) -> Mark:
        reached = round(prediction.slope[0], 2)
        return Mark(name, words, aim - SLOPE_WITHIN, aim + SLOPE_WITHIN, reached)

    if aims.loss is not None:
        yield loss("log loss, k_r ≥ 0.02" if of_kr else "log loss", aims.loss, predictions)
    if aims.loss_kr05 is not None:
        yield loss("log loss, k_r ≥ 0.05", aims.loss_kr05, predictions.kr_from(REAL_KR))
    if aims.slope_kr05 is not None:
        yield slope("slope, k_r ≥ 0.05", aims.slope_kr05, predictions.kr_from(REAL_KR))
    if aims.strong is not None:
        words = f"predicted over observed failures, k_r ≥ {STRONG_KR:g}"
        yield Mark(name, words, *aims.strong, round(predictions.kr_from(STRONG_KR).ratio, 2))
    for aim, (low, high) in zip(aims.kr_slopes, pairwise(KR_CLASSES), strict=False):
        yield slope(f"slope, k_r {low:g} to {high:g}", aim, predictions.kr_from(low, high))
    if aims.size_slopes is not None and predictions.p2 is not None:
        of_sizes = [
            predictions.only(predictions.p2 == p2).slope[0] for p2 in np.unique(predictions.p2)
        ]
        low, high = aims.size_slopes[0] - SLOPE_WITHIN, aims.size_slopes[1] + SLOPE_WITHIN
        for words, value in (("least", min(of_sizes)), ("greatest", max(of_sizes))):
            yield Mark(name, f"{words} slope of a size", low, high, round(value, 2))
    if aims.intercept is not None:
        worst = max(
            (intercept for intercept in predictions.intercepts if math.isfinite(intercept)), key=abs
        )
        words = "farthest intercept of a class of magnitude"
        yield Mark(name, words, -aims.intercept, aims.intercept, round(worst, 2))


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the tables, and keep them if asked to."""
    options = parser(__doc__)
    options.add_argument("--db", default=str(REFERENCE), help="database with outcomes of the grid")
    options.add_argument("--aims", action="store_true", help="only the table of aims")
    options.add_argument("--kind", help="only models of one kind")
    options.add_argument("--model", action="append", help="only the named models")
    chosen = options.parse_args(arguments)
    missed = False
    with opened_database(chosen.db, read_only=True) as engine, engine.connect() as connection:
        for kind in PAGES if chosen.kind is None else [chosen.kind]:
            models = {
                name: aims
                for name, aims in MODELS.items()
                if aims.kind == kind and name in (chosen.model or MODELS)
                if not chosen.aims or aims.loss is not None
            }
            if not models:
                continue
            block = method_named(next(iter(models.values())).method).block
            source = read_source(connection, block, kind=kind)
            if not source.table.p2.size:
                continue
            predictions_by_model = {name: predicted(source, aims) for name, aims in models.items()}
            reached = [
                mark
                for name, prediction in predictions_by_model.items()
                for mark in marks(name, models[name], prediction)
            ]
            missed = missed or not all(mark.reached for mark in reached)
            tables = {"aims": acceptance_table(reached)}
            if not chosen.aims:
                tables |= tables_of(predictions_by_model)
            for name, table in tables.items():
                print(f"## {kind}: {name}\n\n{table}\n", flush=True)
                if chosen.write:
                    write_table(PAGES[kind], name, table)
    if chosen.aims and missed:
        raise SystemExit(1)


def tables_of(predictions_by_model: Mapping[str, Predicted]) -> dict[str, str]:
    """Return the tables of models of one kind, if its blocks are known by k_r."""
    if any(prediction.kr is None for prediction in predictions_by_model.values()):
        return {}
    shown = {
        name: prediction
        for name, prediction in predictions_by_model.items()
        if MODELS[name].loss is not None
    }
    if not shown:
        return {"scores": score_table(predictions_by_model)}
    return {
        "scores": score_table(predictions_by_model),
        "strengths": class_table(shown),
        "sizes": class_table(shown, "p2"),
        "magnitudes": class_table(shown, "magnitude"),
    }


if __name__ == "__main__":
    main()
