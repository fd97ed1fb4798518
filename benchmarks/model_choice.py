"""Which fragility model predicts best:  python -m benchmarks.model_choice --db DATABASE

The database needs motions with their samples, with earthquakes that are named:

    rbfrag motions add FOLDER --metadata FOLDER/MANIFEST.csv --db DATABASE

With --write the tables of docs/theory/model-choice.md are replaced.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from benchmarks.model_acceptance import Mark, acceptance_table
from benchmarks.page import ROOT, parser, replaced
from benchmarks.simulated_source import simulated_source
from rbfrag.bench.tables import markdown
from rbfrag.fragility.fit import scores
from rbfrag.fragility.fit.data import FitSource
from rbfrag.fragility.fit.fitting import Fitted, fit_source, methods_of_kind
from rbfrag.fragility.measures import TERMS
from rbfrag.fragility.methods import TOPPLING_BLOCK, method_named

FloatArray = NDArray[np.float64]

PAGE = ROOT / "docs" / "theory" / "model-choice.md"
RESAMPLES = 1000

ASKED = ("bounded-pgv_pga", "record-xp", "logistic-pgv", "power-xp", "lognormal-pgv", "wls-pgv")
"""The models of the table of what was asked."""


@dataclass(frozen=True, eq=False)
class Judged:
    """A fit with all that its row of the table needs.

    Args:
        fitted: the fit.
        event: number of each combination's earthquake.
        loss: log loss of each block of the grid on held-out earthquakes, NaN where unknown.
        squared: squared error, likewise.
    """

    fitted: Fitted
    event: NDArray[np.intp]
    loss: FloatArray
    squared: FloatArray


def judged(source: FitSource, method: str, term: str, vertical: str, *, free_m: bool) -> Judged:
    """Fit one model and keep its held-out losses."""
    fitted = fit_source(
        source,
        TERMS[term],
        method_named(method),
        estimate_m=free_m,
        selection={"vertical": vertical},
        shared=False,
    )
    seen = fitted.data.judged
    p = np.clip(fitted.result.held_out, scores.CLIP, 1.0 - scores.CLIP)
    loss = -np.where(seen.failed > 0.5, np.log(p), np.log1p(-p))
    squared = (fitted.result.held_out - seen.failed) ** 2
    return Judged(
        fitted,
        fitted.data.event,
        np.where(seen.known, loss, np.nan),
        np.where(seen.known, squared, np.nan),
    )


def interval(values: FloatArray, event: NDArray[np.intp], seed: int = 0) -> tuple[float, float]:
    """Return the 95 % interval of a mean by resampling whole earthquakes."""
    g = int(event.max()) + 1
    known = np.isfinite(values)
    total = np.bincount(event, np.where(known, values, 0.0).sum(axis=1), minlength=g)
    count = np.bincount(event, known.sum(axis=1), minlength=g)
    random = np.random.default_rng(seed)
    drawn = random.multinomial(g, np.full(g, 1.0 / g), size=RESAMPLES).astype(np.float64)
    low, high = np.quantile(drawn @ total / (drawn @ count), [0.025, 0.975])
    return float(low), float(high)


def calibration_interval(one: Judged, replicates: int = 200) -> tuple[float, float, float, float]:
    """Return 95 % intervals of calibration slope and intercept by resampling earthquakes."""
    seen = one.fitted.data.judged
    g = int(one.event.max()) + 1
    random = np.random.default_rng(0)
    found = []
    for _ in range(replicates):
        times = np.bincount(random.integers(g, size=g), minlength=g)[one.event].astype(float)
        weights = np.broadcast_to(times[:, None], seen.known.shape)
        line = scores.calibration(one.fitted.result.held_out, seen.failed, seen.known, weights)
        found.append((line.slope, line.intercept))
    low, high = np.nanquantile(np.array(found), [0.025, 0.975], axis=0)
    return float(low[0]), float(high[0]), float(low[1]), float(high[1])


def all_models(source: FitSource, vertical: str) -> dict[str, Judged]:
    """Fit every method on every term that goes with it."""
    result = {}
    for method in methods_of_kind(TOPPLING_BLOCK.kind):
        for term in method.forms:
            one = judged(source, method.name, term, vertical, free_m=False)
            result[f"{method.name}-{term}"] = one
    result["lognormal-pgv, M free"] = judged(source, "lognormal", "pgv", vertical, free_m=True)
    result["logistic-pgv, M free"] = judged(source, "logistic", "pgv", vertical, free_m=True)
    return result


def main_table(models: dict[str, Judged]) -> str:
    """Return the table of all models, best first."""
    head = ["model", "log loss", "95 %", "Brier", "95 %", "calibration slope", "intercept",
            "sharpness", "scatter of ln y"]  # fmt: skip
    cells = []
    order = sorted(models, key=lambda name: float(np.nanmean(models[name].loss)))
    for name in order:
        one = models[name]
        told = one.fitted.report
        lost, missed = interval(one.loss, one.event), interval(one.squared, one.event)
        scatter = told.details.get("scatter_ln_y")
        bands = calibration_interval(one)
        cells.append([
            name,
            f"{np.nanmean(one.loss):.4f}",
            f"{lost[0]:.3f}–{lost[1]:.3f}",
            f"{np.nanmean(one.squared):.4f}",
            f"{missed[0]:.3f}–{missed[1]:.3f}",
            _around(told.scores.get("calibration_slope_held_out"), bands[0], bands[1]),
            _around(told.scores.get("calibration_intercept_held_out"), bands[2], bands[3]),
            f"{told.scores['sharpness_held_out']:.4f}",
            "" if not isinstance(scatter, dict) else f"{scatter['total']:.3f}",
        ])  # fmt: skip
    return markdown((head, cells))


def _around(value: float | None, low: float, high: float) -> str:
    if value is None or not abs(value) < 100.0:
        return "not defined"
    return (
        f"{value:.3f} ({low:.2f}–{high:.2f})"
        if low > 0
        else f"{value:+.3f} ({low:+.2f}…{high:+.2f})"
    )


def difference_table(models: dict[str, Judged], pairs: Sequence[tuple[str, str]]) -> str:
    """Return by how much the second model of each pair beats the first."""
    cells = []
    for worse, better in pairs:
        gain = models[worse].loss - models[better].loss
        low, high = interval(gain, models[better].event)
        cells.append(
            [f"{better} over {worse}", f"{np.nanmean(gain):.4f}", f"{low:.4f} to {high:.4f}"]
        )
    return markdown((["gain in log loss", "mean", "95 % by earthquakes"], cells))


def class_table(models: dict[str, Judged], names: Sequence[str]) -> str:
    """Return the log loss by p² and by Tm class."""
    values = models[names[0]].fitted.data.values
    p2s, tm_s = values["p2"], values["tm_s"]
    classes = [(f"p² = {p2:g} 1/s²", p2s == p2) for p2 in sorted(set(p2s.tolist()))[::-1]]
    edges = np.quantile(tm_s, [0.0, 0.25, 0.5, 0.75, 1.0])
    for low, high in pairwise(edges):
        inside = (tm_s >= low) & ((tm_s < high) | (high == edges[-1]))
        classes.append((f"Tm {low:.2f} to {high:.2f} s", inside))
    cells = []
    for words, inside in classes:
        row = [words, str(int(inside.sum()))]
        for name in names:
            one = models[name]
            seen = one.fitted.data.judged
            line = scores.calibration(
                one.fitted.result.held_out[inside], seen.failed[inside], seen.known[inside]
            )
            row.append(f"{np.nanmean(one.loss[inside]):.3f} ({line.slope:.2f})")
        cells.append(row)
    return markdown((["class", "combinations", *names], cells))


def curve_table(one: Judged) -> str:
    """Return the calibration curve of a model on held-out earthquakes."""
    seen = one.fitted.data.judged
    p, failed = one.fitted.result.held_out[seen.known], seen.failed[seen.known]
    number = np.minimum((p * 10.0).astype(np.intp), 9)
    classes = [number == i for i in range(10) if (number == i).any()]
    cells = [[f"{p[c].mean():.3f}", f"{failed[c].mean():.3f}", str(int(c.sum()))] for c in classes]
    return markdown((["predicted, mean", "toppled", "blocks"], cells))


def coefficient_table(models: dict[str, Judged]) -> str:
    """Return coefficients with clustered and naive standard errors."""
    cells = []
    for name, one in models.items():
        told = one.fitted.report
        naive = told.details.get("naive_standard_errors") or {}
        boot = (told.details.get("bootstrap") or {}).get("standard_errors", {})  # type: ignore[attr-defined]
        for parameter, value in told.coefficients.items():
            error = told.standard_errors[parameter]
            plain = naive.get(parameter)  # type: ignore[attr-defined]
            cells.append([
                name, parameter, f"{value:.4f}", f"{error:.4f}",
                f"{boot[parameter]:.4f}" if parameter in boot else "",
                f"{error / plain:.1f}" if plain else "",
            ])  # fmt: skip
    head = ["model", "parameter", "value", "clustered error", "by bootstrap", "over the naive one"]
    return markdown((head, cells))


def exponents(source: FitSource) -> list[tuple[str, float, float, int]]:
    """Return M of y = k_r g/p^M against PGV by range of p²: words, value, error, number."""
    found = []
    for words, chosen in (
        ("p² ≤ 1", source.table.p2 <= 1.0),
        ("p² ≥ 3", source.table.p2 >= 3.0),
        ("all", source.table.p2 > 0.0),
    ):
        one = judged(source.only(chosen), "lognormal", "pgv", "without", free_m=True)
        told = one.fitted.report
        m, error = told.coefficients["m_minus_1"], told.standard_errors["m_minus_1"]
        found.append((words, 1.0 + m, error, told.n))
    return found


def m_table(found: Sequence[tuple[str, float, float, int]]) -> str:
    """Return the table of exponents."""
    cells = [[words, f"{m:.3f}", f"{error:.3f}", str(n)] for words, m, error, n in found]
    return markdown((["blocks", "M", "clustered error", "critical values"], cells))


def marks(models: dict[str, Judged], found: Sequence[tuple[str, float, float, int]]) -> list[Mark]:
    """Return what was asked of the models, with what they reach."""
    default, record = "bounded-pgv_pga", "record-xp"
    result = []
    for name, loss, brier, slopes, intercepts in (
        (default, 0.158, 0.048, (0.93, 1.07), (-0.05, 0.05)),
        (record, 0.115, 0.033, (0.92, 1.05), None),
    ):
        told = models[name].fitted.report.scores
        slope, intercept = "calibration_slope_held_out", "calibration_intercept_held_out"
        result += [
            Mark(name, "held-out log loss", -np.inf, loss, told["log_loss_held_out"]),
            Mark(name, "held-out Brier score", -np.inf, brier, told["brier_held_out"]),
            Mark(name, "calibration slope", *slopes, told[slope]),
        ]
        if intercepts is not None:
            result.append(Mark(name, "calibration intercept", *intercepts, told[intercept]))
    gain = models["logistic-pgv"].loss - models[default].loss
    least = interval(gain, models[default].event)[0]
    result.append(
        Mark(default, "gain in log loss over logistic-pgv", 0.02, np.inf, float(np.nanmean(gain)),
             ("interval above 0", least > 0.0))
    )  # fmt: skip
    scatter = models["power-xp"].fitted.report.details["scatter_ln_y"]
    assert isinstance(scatter, dict)
    result.append(Mark("X(p)", "scatter of ln(y/X)", -np.inf, 0.124, scatter["total"]))
    normal, line_fit = (models[n].fitted.report for n in ("lognormal-pgv", "wls-pgv"))
    by_words = {words: m for words, m, _, _ in found}
    result += [
        Mark("lognormal-pgv", "slope", 0.944, 0.964, normal.coefficients["slope"]),
        Mark("lognormal-pgv", "scatter", 0.277, 0.297,
             float(np.exp(normal.coefficients["ln_sigma"]))),
        Mark("wls-pgv", "slope", 0.707, 0.727, line_fit.coefficients["c1"]),
        Mark("lognormal-pgv, M free", "M for p² ≤ 1", 0.996, 1.018, by_words["p² ≤ 1"]),
        Mark("lognormal-pgv, M free", "M for p² ≥ 3", 0.779, 0.845, by_words["p² ≥ 3"]),
    ]  # fmt: skip
    for name in ASKED:
        if name != "power-xp":
            ratios = _error_ratios(models[name])
            worst = min(ratios, key=lambda k: ratios[k])
            words = f"clustered over naive error of {worst}, the least"
            result.append(Mark(name, words, 2.0, np.inf, ratios[worst]))
    return result


def _error_ratios(one: Judged) -> dict[str, float]:
    """Return clustered over naive standard errors; not of the intercept of a straight line."""
    told = one.fitted.report
    naive = told.details["naive_standard_errors"]
    assert isinstance(naive, dict)
    return {k: told.standard_errors[k] / v for k, v in naive.items() if v and k != "c0"}


CHOSEN = ("bounded-pgv", "bounded-pgv_pga", "bounded-pgv_pga_tm", "record-xp")
PAIRS = (
    ("logistic-pgv", "weibull-pgv"),
    ("logistic-pgv", "weibull-pgv_pga"),
    ("logistic-pgv", "bounded-pgv_pga"),
    ("weibull-pgv_pga", "bounded-pgv_pga"),
    ("bounded-pgv_pga", "bounded-pgv_pga_tm"),
    ("bounded-pgv_pga_tm", "record-xp"),
    ("power-xp", "record-xp"),
    ("wls-pgv", "lognormal-pgv"),
    ("lognormal-pgv", "logistic-pgv"),
)


def study(without: FitSource, with_vertical: FitSource | None) -> dict[str, str]:
    """Return every table of the page by its name."""
    models = all_models(without, "without")
    found = exponents(without)
    tables = {
        "models": main_table(models),
        "differences": difference_table(models, PAIRS),
        "classes": class_table(models, ("logistic-pgv", *CHOSEN)),
        "curve": curve_table(models["bounded-pgv_pga"]),
        "record-curve": curve_table(models["record-xp"]),
        "coefficients": coefficient_table(models),
        "exponent": m_table(found),
        "acceptance": acceptance_table(marks(models, found)),
    }
    if with_vertical is not None and with_vertical.table.p2.size:
        shaken = all_models(with_vertical, "with")
        tables["vertical"] = main_table(shaken)
    return tables


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the tables, or write them into the page."""
    options = parser(__doc__ or "")
    options.add_argument("--db", required=True, help="database of motions and critical values")
    options.add_argument("--asked", action="store_true", help="only the table of what was asked")
    chosen = options.parse_args(arguments)
    files = [None, None]
    if chosen.out is not None:
        files = [chosen.out / "without-vertical.npz", chosen.out / "with-vertical.npz"]
    without = simulated_source(chosen.db, vertical=False, cache=files[0])
    if chosen.asked:
        some = {n: judged(without, *n.split("-"), "without", free_m=False) for n in ASKED}
        tables = {"acceptance": acceptance_table(marks(some, exponents(without)))}
    else:
        tables = study(without, simulated_source(chosen.db, vertical=True, cache=files[1]))
    page = PAGE.read_text() if chosen.write else ""
    for name, table in tables.items():
        print(f"## {name}\n\n{table}\n", flush=True)
        if chosen.write:
            page = replaced(page, name, table)
    if chosen.write:
        PAGE.write_text(page)


if __name__ == "__main__":
    main()
