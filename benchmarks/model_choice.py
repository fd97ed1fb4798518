"""Which fragility model predicts best:  python -m benchmarks.model_choice [--db DATABASE]

Every method on every measure is judged by earthquakes that it was not fitted to, and beside the
plain table of what share of the blocks fails at each strength and size. The reference that is
shipped has all that is read. Two minutes of processor time; --aims prints the aims alone. --write
keeps the tables, in docs/evidence/model-choice.md or benchmarks/results.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from benchmarks.held_out import MODELS, PUBLISHED, Outcomes, Study, predictions, read, studied
from benchmarks.model_acceptance import Mark, acceptance_table
from benchmarks.page import ROOT, parser, write_table
from rbfrag.bench.tables import markdown
from rbfrag.db.location import REFERENCE
from rbfrag.errors import FitError
from rbfrag.fragility.fit.clusters import cr3, jackknife_steps
from rbfrag.fragility.fit.data import Y0_OVER_PGV, FitSource
from rbfrag.fragility.fit.fitting import Fitted, fit_source, methods_of_kind
from rbfrag.fragility.fit.likelihood import Binomial, most_likely
from rbfrag.fragility.fit.scores import CLIP
from rbfrag.fragility.measures import TERMS
from rbfrag.fragility.method import LOGIT, TOPPLING_BLOCK, Method
from rbfrag.fragility.methods import method_named

FloatArray = NDArray[np.float64]
Labels = NDArray[np.intp]
Mask = NDArray[np.bool_]

PAGE = ROOT / "docs" / "evidence" / "model-choice.md"

MIDDLE = (Y0_OVER_PGV >= 0.3) & (Y0_OVER_PGV <= 1.5)
"""Strengths of the grid at which outcomes are not nearly decided."""

SHARES = "table of shares"
"""The name of what the models are compared with."""

PAIRS = (
    (SHARES, "pgv"),
    ("pgv", "pgv_pga"),
    ("pgv_pga", "pgv_pga_tm"),
    ("pgv_pga_tm", "record"),
    ("pgv", "pgv_kr"),
    ("pga_sa03_sa10_sa30", "pgv"),
    ("pga_sa10", "pga_sa03_sa10_sa30"),
    ("sa10", "pga_sa10"),
    ("sa03", "sa10"),
    ("pga", "sa10"),
    ("pga_tm", "pgv"),
    ("logistic pgv", "pgv"),
)
"""Models that are compared with one another, the worse one first."""


@dataclass(frozen=True, eq=False)
class Rows:
    """Blocks of a study by what tables sort them by, all of length n.

    Args:
        failed: 1 or 0.
        event: number of the earthquake.
        p2: squared frequency parameter [1/s²].
        strength: number of y/PGV in its grid.
    """

    failed: FloatArray
    event: Labels
    p2: FloatArray
    strength: Labels

    @classmethod
    def of(cls, data: Outcomes) -> Rows:
        """Return the blocks of a study."""
        return cls(data.failed, data.event, data.value["p2"], data.strength)

    @property
    def middle(self) -> Mask:
        """Whether a block is of a strength that decides nothing, shape (n,)."""
        return np.asarray(MIDDLE[self.strength])


Predicted = Mapping[str, FloatArray]
"""P of each block by model, by a fit without its earthquake; NaN where a model has none."""


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


def table_of_shares(rows: Rows) -> FloatArray:
    """Return the share of other earthquakes' blocks of the same strength and size that failed.

    Half a failure in one more block is counted in, so that no share is 0 or 1.
    """
    size = np.unique(rows.p2, return_inverse=True)[1]
    cell = size * MIDDLE.size + rows.strength
    shape = (int(rows.event.max()) + 1, int(cell.max()) + 1)
    place = rows.event * shape[1] + cell
    n = np.bincount(place, minlength=shape[0] * shape[1]).reshape(shape)
    failed = np.bincount(place, rows.failed, minlength=shape[0] * shape[1]).reshape(shape)
    others, failures = n.sum(axis=0) - n, failed.sum(axis=0) - failed
    return np.asarray(((failures + 0.5) / (others + 1.0)).ravel()[place])


@dataclass(frozen=True)
class Score:
    """How well a model predicts.

    Args:
        log_loss: mean, with its standard error clustered by earthquake.
        brier: mean squared error.
        slope: of calibration, with its standard error.
        middle: log loss at the strengths of the undecided middle.
        skill_log: 1 less log loss over that of the table of shares, of the same blocks.
        skill_middle: the same of the log loss in the middle.
    """

    log_loss: tuple[float, float]
    brier: float
    slope: tuple[float, float]
    middle: float
    skill_log: float
    skill_middle: float


def score(rows: Rows, p: FloatArray, shares: FloatArray) -> Score:
    """Return the scores of a model, of the blocks that it predicts."""
    known, failed = np.isfinite(p), rows.failed
    loss, plain = log_losses(p, failed), log_losses(shares, failed)
    middle = known & rows.middle
    return Score(
        log_loss=clustered_mean(loss, rows.event),
        brier=float(((p - failed) ** 2)[known].mean()),
        slope=calibration_slope(p[known], failed[known], rows.event[known]),
        middle=float(loss[middle].mean()),
        skill_log=float(1.0 - loss[known].mean() / plain[known].mean()),
        skill_middle=float(1.0 - loss[middle].mean() / plain[middle].mean()),
    )


def score_table(scores: Mapping[str, Score]) -> str:
    """Return the scores of models, best first."""
    head = ["model", "log loss", "calibration slope", "undecided middle", "skill"]
    order = sorted(scores, key=lambda name: scores[name].log_loss[0])
    cells = [
        [
            name,
            f"{one.log_loss[0]:.4f} ± {one.log_loss[1]:.4f}",
            f"{one.slope[0]:.2f} ± {one.slope[1]:.2f}",
            f"{one.middle:.3f}",
            f"{one.skill_log:+.3f}",
        ]
        for name, one in ((name, scores[name]) for name in order)
    ]
    return markdown((head, cells))


def difference_table(
    rows: Rows, predicted: Predicted, pairs: Sequence[tuple[str, str]] = PAIRS
) -> str:
    """Return by how much the second model of each pair beats the first."""
    cells = []
    for worse, better in pairs:
        gain = log_losses(predicted[worse], rows.failed)
        gain = gain - log_losses(predicted[better], rows.failed)
        mean, error = clustered_mean(gain, rows.event)
        cells.append([f"{better} over {worse}", f"{mean:.4f} ± {error:.4f}"])
    return markdown((["gain in log loss", "mean, error by earthquakes"], cells))


def class_table(rows: Rows, predicted: Predicted, names: Sequence[str]) -> str:
    """Return log loss and calibration slope by block size."""
    cells = []
    for p2 in np.unique(rows.p2)[::-1]:
        line = [f"p² = {p2:g} 1/s²"]
        for name in names:
            here = (rows.p2 == p2) & np.isfinite(predicted[name])
            p, failed = predicted[name][here], rows.failed[here]
            slope, error = calibration_slope(p, failed, rows.event[here])
            line.append(f"{log_losses(p, failed).mean():.3f}, {slope:.2f} ± {error:.2f}")
        cells.append(line)
    return markdown((["log loss, slope", *names], cells))


def class_slopes(rows: Rows, p: FloatArray) -> FloatArray:
    """Return the calibration slope of each block size."""
    slopes = []
    for p2 in np.unique(rows.p2):
        here = rows.p2 == p2
        slopes.append(calibration_slope(p[here], rows.failed[here], rows.event[here])[0])
    return np.array(slopes)


@dataclass(frozen=True, eq=False)
class Model:
    """A model of the study.

    Args:
        name: of the model.
        own: P of each block by a fit without its earthquake, shape (n,).
        parameters: value, clustered error and naive error of each by its name.
        domain: range of each variable that the fit covers.
    """

    name: str
    own: FloatArray
    parameters: Mapping[str, tuple[float, float, float]]
    domain: Mapping[str, tuple[float, float]]


def best_methods() -> dict[str, Method]:
    """Return the method that answers for each measure, by the name of the measure."""
    known = methods_of_kind(TOPPLING_BLOCK.kind)
    return {
        term: min((m for m in known if term in m.forms), key=lambda m: m.forms[term].rank)
        for term in TERMS
        if any(term in m.forms for m in known)
    }


def all_models(source: FitSource, data: Outcomes) -> dict[str, Model]:
    """Fit every method on every measure that it goes with; the best of a measure has its name."""
    best, result = best_methods(), {}
    for method in methods_of_kind(TOPPLING_BLOCK.kind):
        for term in method.forms:
            name = term if best[term] == method else f"{method.name} {term}"
            name = "record" if name == "xp" else name
            try:
                result[name] = model(source, data, name, method, term)
            except FitError as error:
                print(f"{name}: {error}", flush=True)
    free = "lognormal pgv, M free"
    lognormal = method_named("lognormal")
    result[free] = of_critical(source, data, free, lognormal, "pgv", estimate_m=True)
    return result


def model(source: FitSource, data: Outcomes, name: str, method: Method, term: str) -> Model:
    """Return one model of the study."""
    if method.reads != "outcomes":
        return of_critical(source, data, name, method, term)
    study = studied(source, data, term, method)
    return of_outcomes(name, study, method.forms[term].parameters)


def of_outcomes(name: str, study: Study, parameters: Sequence[str]) -> Model:
    """Return a model that was fitted to what blocks did."""
    naive = np.sqrt(np.diag(np.linalg.inv(study.rows.data.derivatives(study.b)[1])))
    values = zip(study.b.tolist(), study.errors.tolist(), naive.tolist(), strict=True)
    named = dict(zip(parameters, values, strict=False))  # the exponent is not fitted
    return Model(name, study.own, named, study.data.domain)


def of_critical(
    source: FitSource,
    data: Outcomes,
    name: str,
    method: Method,
    term: str,
    *,
    estimate_m: bool = False,
) -> Model:
    """Return a model that was fitted to critical values."""
    fitted = critical_fit(source, method, term, estimate_m=estimate_m)
    report = fitted.report
    naive = report.details.get("naive_standard_errors") or {}
    assert isinstance(naive, dict)
    return Model(
        name,
        data.joined(predictions(source, fitted.data, fitted.result.held_out)),
        {
            name: (value, report.standard_errors[name], naive.get(name, np.nan))
            for name, value in report.coefficients.items()
        },
        fitted.data.domain,
    )


def critical_fit(source: FitSource, method: Method, term: str, *, estimate_m: bool) -> Fitted:
    """Fit a method of critical values."""
    return fit_source(source, TERMS[term], method, estimate_m=estimate_m, shared=False)


def coefficient_table(models: Mapping[str, Model]) -> str:
    """Return the parameters with clustered errors, and how much larger these are than naive ones.

    Those of an earlier study stand beside them where it has some.
    """
    cells = []
    for name, one in models.items():
        earlier = PUBLISHED.get(name)
        for i, (parameter, (value, error, naive)) in enumerate(one.parameters.items()):
            cells.append([
                name, parameter, f"{value:.4f}", f"{error:.4f}",
                f"{error / naive:.1f}" if naive > 0.0 else "",
                f"{earlier.b[i]:.3f} ± {earlier.errors[i]:.3f}" if earlier else "",
            ])  # fmt: skip
    head = ["model", "parameter", "value", "clustered error", "over the naive one", "earlier"]
    return markdown((head, cells))


def domain_table(models: Mapping[str, Model]) -> str:
    """Return the range of each variable and ratio, with the models that it is that of."""
    covering: dict[tuple[str, float, float], list[str]] = {}
    for name, one in models.items():
        for variable, ends in one.domain.items():
            covering.setdefault((variable, *ends), []).append(name)
    cells = [
        [f"`{variable}`", f"{low:.3g} to {high:.3g}", ", ".join(names)]
        for (variable, low, high), names in sorted(covering.items())
    ]
    return markdown((["variable", "range", "models"], cells))


def exponent_table(source: FitSource) -> str:
    """Return M of y = k_r g/p^M against PGV by range of p²."""
    cells = []
    for words, chosen in (
        ("p² ≤ 1", source.table.p2 <= 1.0),
        ("p² ≥ 3", source.table.p2 >= 3.0),
        ("all", source.table.p2 > 0.0),
    ):
        some, lognormal = source.only(chosen), method_named("lognormal")
        report = critical_fit(some, lognormal, "pgv", estimate_m=True).report
        m, error = report.coefficients["m_minus_1"], report.standard_errors["m_minus_1"]
        cells.append([words, f"{1.0 + m:.3f}", f"{error:.3f}", str(report.n)])
    return markdown((["blocks", "M", "clustered error", "critical values"], cells))


def data_table(data: Outcomes) -> str:
    """Return what the blocks come from."""
    event = data.event[np.unique(data.motion, return_index=True)[1]]
    motions = np.sort(np.bincount(event))[::-1]
    of_half = int(np.searchsorted(np.cumsum(motions), 0.5 * motions.sum()) + 1)
    share = motions / motions.sum()
    cells = [
        ["horizontal motions", str(int(motions.sum()))],
        ["recording sites", str(np.unique(data.site).size)],
        ["earthquakes", str(motions.size)],
        ["earthquakes that hold half of the motions", str(of_half)],
        ["earthquakes of two motions or fewer", str(int((motions <= 2).sum()))],
        ["earthquakes of equal weight that would say as much, 1/Σ share²",
         f"{1.0 / (share @ share):.1f}"],
        ["outcomes of blocks", f"{data.failed.size:,}"],
    ]  # fmt: skip
    return markdown((["", "number"], cells))


SKILL_AIMS = {
    "pgv": (-0.01, -0.01),
    "pgv_pga": (0.06, 0.06),
    "pgv_pga_tm": (0.085, 0.09),
    "record": (0.43, 0.47),
}
"""Least skill that is aimed at: of all strengths, and of the middle."""

NOT_ABOVE = 0.00005
"""A log loss of four published digits is not exceeded by less than this."""


def marks(rows: Rows, predicted: Predicted, scores: Mapping[str, Score]) -> list[Mark]:
    """Return the aims, with what is reached."""
    aims = []
    for name in MODELS:
        slopes, one = class_slopes(rows, predicted[name]), scores[name]
        before = PUBLISHED[name].log_loss_before + NOT_ABOVE
        low, middle = SKILL_AIMS[name]
        aims += [
            Mark(name, "least calibration slope of a block size", 0.9, 1.1, float(slopes.min())),
            Mark(name, "greatest calibration slope of a block size", 0.9, 1.1, float(slopes.max())),
            Mark(name, "calibration slope", 0.95, 1.05, one.slope[0]),
            Mark(name, "log loss, of the form without h(p)", -np.inf, before, one.log_loss[0]),
            Mark(name, "skill", low, np.inf, one.skill_log),
            Mark(name, "skill in the middle", middle, np.inf, one.skill_middle),
        ]
    return aims


def study(source: FitSource, data: Outcomes, *, aims_alone: bool = False) -> dict[str, str]:
    """Return every table of the page by its name."""
    rows = Rows.of(data)
    shares = table_of_shares(rows)
    if aims_alone:
        own = {name: studied(source, data, name).own for name in MODELS}
        scores = {name: score(rows, own[name], shares) for name in MODELS}
        return {"aims": acceptance_table(marks(rows, own, scores))}
    models = all_models(source, data)
    predicted = {SHARES: shares} | {name: one.own for name, one in models.items()}
    scores = {name: score(rows, p, shares) for name, p in predicted.items()}
    of_a_measure = [name for name in models if name in {*best_methods(), "record"}]
    main = {name: scores[name] for name in (SHARES, *of_a_measure)}
    return {
        "scores": score_table(main),
        "classes": class_table(rows, predicted, tuple(MODELS)),
        "differences": difference_table(rows, predicted),
        "aims": acceptance_table(marks(rows, predicted, scores)),
        "data": data_table(data),
        "others": score_table({name: one for name, one in scores.items() if name not in main}),
        "domain": domain_table({name: models[name] for name in of_a_measure}),
        "coefficients": coefficient_table(models),
        "exponent": exponent_table(source),
    }


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the tables, and keep them if asked to."""
    options = parser(__doc__)
    options.add_argument("--db", default=str(REFERENCE), help="database with outcomes of the grid")
    options.add_argument("--aims", action="store_true", help="only the table of aims")
    chosen = options.parse_args(arguments)
    for name, table in study(*read(chosen.db), aims_alone=chosen.aims).items():
        print(f"## {name}\n\n{table}\n", flush=True)
        if chosen.write:
            write_table(PAGE, name, table)


if __name__ == "__main__":
    main()
