"""Models of the displacement of sliding blocks on equal terms.

Same earthquakes, blocks and distances; each published regression as it is, beside ours fitted
without the earthquake concerned, on the same measures.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from benchmarks.page import markdown
from rbfrag.fragility.fit.data import KR, LEAST_DISPLACEMENT_M, FitSource
from rbfrag.fragility.fit.likelihood import CensoredNormal, Standardised
from rbfrag.fragility.fit.maximum_likelihood import most_likely
from rbfrag.fragility.fit.result import CLIP, brier, calibration, left_out, log_loss
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.solver.models.sliding import THRESHOLDS_M

FloatArray = NDArray[np.float64]
Values = Mapping[str, FloatArray]

_LN_CM, _LN_10 = math.log(0.01), math.log(10.0)

KY_G = (0.05, 0.30)
"""Yield accelerations that Saygili & Rathje simulated [g]; Jibson's are like them."""


@dataclass(frozen=True)
class Published:
    """One regression.

    Args:
        name: authors, year and equation.
        predictors: what it reads beside the yield acceleration, of `pga_g`, `pgv_m_s`,
            `arias_m_s`, `magnitude`.
        median: ln of the median displacement [ln m].
        sigma: standard deviation of ln D.
    """

    name: str
    predictors: tuple[str, ...]
    median: Callable[[Values], FloatArray]
    sigma: Callable[[Values], FloatArray]


def _ratio(v: Values) -> FloatArray:
    return v["ky"] / v["pga_g"]


def _quartic(v: Values, *a: float) -> FloatArray:
    return _LN_CM + np.polynomial.polynomial.polyval(_ratio(v), a)


def _power(v: Values, constant: float, rising: float, falling: float) -> FloatArray:
    """Return ln D of log10 D [cm] = constant + log10((1 - r)^rising r^falling)."""
    r = _ratio(v)
    return _LN_CM + _LN_10 * constant + rising * np.log(1.0 - r) + falling * np.log(r)


def _log10(value: float) -> Callable[[Values], FloatArray]:
    return lambda v: np.full_like(v["ky"], value * _LN_10)


PUBLISHED = (
    Published(
        "Jibson (2007), eq. 6", ("pga_g",),
        lambda v: _power(v, 0.215, 2.341, -1.438), _log10(0.510),
    ),
    Published(
        "Saygili & Rathje (2008)", ("pga_g",),
        lambda v: _quartic(v, 5.52, -4.43, -20.39, 42.61, -28.74) + 0.72 * np.log(v["pga_g"]),
        lambda v: np.full_like(v["ky"], 1.13),
    ),
    Published(
        "Jibson (2007), eq. 7", ("pga_g", "magnitude"),
        lambda v: _power(v, -2.710, 2.335, -1.478) + _LN_10 * 0.424 * v["magnitude"],
        _log10(0.454),
    ),
    Published(
        "Rathje & Saygili (2009)", ("pga_g", "magnitude"),
        lambda v: _quartic(v, 4.89, -4.85, -19.64, 42.49, -29.06)
        + 0.72 * np.log(v["pga_g"]) + 0.89 * (v["magnitude"] - 6.0),
        lambda v: 0.73 + 0.789 * _ratio(v) - 0.539 * _ratio(v) ** 2,
    ),
    Published(
        "Jibson (2007), eq. 9", ("arias_m_s",),
        lambda v: _LN_CM + 2.401 * np.log(v["arias_m_s"]) - 3.481 * np.log(v["ky"])
        - 3.230 * _LN_10,
        _log10(0.656),
    ),
    Published(
        "Jibson (2007), eq. 10", ("pga_g", "arias_m_s"),
        lambda v: _LN_CM + 0.561 * np.log(v["arias_m_s"]) - 3.833 * np.log(_ratio(v))
        - 1.474 * _LN_10,
        _log10(0.616),
    ),
    Published(
        "Saygili & Rathje (2008)", ("pga_g", "pgv_m_s"),
        lambda v: _quartic(v, -1.56, -4.58, -20.84, 44.75, -30.50)
        - 0.64 * np.log(v["pga_g"]) + 1.55 * np.log(100.0 * v["pgv_m_s"]),
        lambda v: 0.405 + 0.524 * _ratio(v),
    ),
    Published(
        "Saygili & Rathje (2008)", ("pga_g", "pgv_m_s", "arias_m_s"),
        lambda v: _quartic(v, -0.74, -4.93, -19.91, 43.75, -30.12)
        - 1.30 * np.log(v["pga_g"]) + 1.04 * np.log(100.0 * v["pgv_m_s"])
        + 0.67 * np.log(v["arias_m_s"]),
        lambda v: 0.20 + 0.79 * _ratio(v),
    ),
)  # fmt: skip
"""The regressions by what they read."""


FloatArray = NDArray[np.float64]
Mask = NDArray[np.bool_]

MEASURE_WORDS = {"pga_g": "PGA", "pgv_m_s": "PGV", "arias_m_s": "Ia", "magnitude": "M"}


@dataclass(frozen=True, eq=False)
class Slides:
    """Blocks that slide, one row each.

    Args:
        values: `ky`, `pga_g`, `pgv_m_s`, `arias_m_s`, `magnitude`, NaN where not known.
        displacement_m: how far they slide on a level plane [m].
        event: number of the earthquake.
    """

    values: Mapping[str, FloatArray]
    displacement_m: FloatArray
    event: NDArray[np.intp]

    @classmethod
    def of_source(cls, source: FitSource) -> Slides:
        """Return the rows of the stored grids of kind sliding, of strengths that fits read."""
        assert source.displacement_m is not None
        table, k = source.table, source.k_over_pga
        names = ("pga_g", "pgv_m_s", "arias_m_s", "magnitude")
        columns = {n: np.broadcast_to(table.measure(n)[:, None], k.shape) for n in names}
        columns["ky"] = ky = k * table.pga_g[:, None]
        event = np.unique(table.event_id.astype(str), return_inverse=True)[1]
        used = np.isfinite(source.displacement_m) & (k < 1.0) & (ky >= KR[0]) & (ky <= KR[1])
        rows = np.broadcast_to(event[:, None], k.shape)[used].astype(np.intp)
        return cls({n: v[used] for n, v in columns.items()}, source.displacement_m[used], rows)

    def only(self, chosen: Mask) -> Slides:
        """Return some rows."""
        values = {name: v[chosen] for name, v in self.values.items()}
        return Slides(values, self.displacement_m[chosen], self.event[chosen])


def larger_of_two(source: FitSource) -> FitSource:
    """Return one row for each motion: blocks that may face either way, and slide the further."""
    assert source.displacement_m is not None
    table = source.table
    forward, reverse = (np.flatnonzero(table.polarity == side) for side in ("forward", "reverse"))
    place = {int(table.motion_id[i]): i for i in reverse}
    partner = np.array([place[int(table.motion_id[i])] for i in forward])
    if not np.array_equal(source.k_over_pga[forward], source.k_over_pga[partner]):
        raise SystemExit("the two polarities of a motion were simulated at different strengths")
    further = np.maximum(source.displacement_m[forward], source.displacement_m[partner])
    return replace(source.only(forward), displacement_m=further)


def columns_of(predictors: Sequence[str], v: Mapping[str, FloatArray]) -> FloatArray:
    """Return the regressors of our form on some measures, shape (n, k).

    With PGV they are those of the method `displacement`; without, strength, 1 - r and the measures
    have a power each.
    """
    ky, ones = v["ky"], np.ones_like(v["ky"])
    if "pga_g" not in predictors:
        return np.column_stack([ones, np.log(ky), *(np.log(v[name]) for name in predictors)])
    ln_rest = np.log(1.0 - ky / v["pga_g"])
    if "pgv_m_s" in predictors:
        size = np.log(v["pgv_m_s"] ** 2 / (ky * STANDARD_GRAVITY_M_S2))
        columns = [ones, size, ln_rest]
        if "arias_m_s" in predictors:
            columns += [np.log(v["arias_m_s"] / v["pgv_m_s"] ** 2)]
        return np.column_stack(columns)
    columns = [ones, np.log(ky / v["pga_g"]), ln_rest, np.log(v["pga_g"])]
    columns += [np.log(v["arias_m_s"])] if "arias_m_s" in predictors else []
    columns += [v["magnitude"] - 6.0] if "magnitude" in predictors else []
    return np.column_stack(columns)


def held_out(predictors: Sequence[str], slides: Slides) -> tuple[FloatArray, FloatArray]:
    """Return ln of the median displacement and sigma, fitted without each row's earthquake."""
    columns = columns_of(predictors, slides.values)
    r = slides.values["ky"] / slides.values["pga_g"]
    scatter = np.column_stack([np.ones_like(r), *([r] if "pga_g" in predictors else [])])
    k = columns.shape[1]
    y = np.log(np.maximum(slides.displacement_m, LEAST_DISPLACEMENT_M))

    def formula(b: FloatArray, values: Mapping[str, FloatArray]) -> Standardised:
        log_sigma = values["scatter"] @ b[k:]
        per = np.exp(-log_sigma)
        eta = (values["columns"] @ b[:k] - values["y"]) * per
        slopes = [*(values["columns"].T * per), *(-eta * values["scatter"].T)]
        return eta, log_sigma, slopes, [*([0.0] * k), *values["scatter"].T]

    is_displaced = slides.displacement_m >= LEAST_DISPLACEMENT_M
    values = {"columns": columns, "scatter": scatter, "y": y}
    rows = CensoredNormal(formula, values, is_displaced, slides.event)
    start = np.linalg.lstsq(columns[is_displaced], y[is_displaced], rcond=None)[0]
    start = most_likely(rows, np.concatenate([start, [-0.3], np.zeros(scatter.shape[1] - 1)]))
    median, sigma = np.empty(y.size), np.empty(y.size)
    for event, b in left_out(rows.event, lambda rest: most_likely(rows.only(rest), start)).items():
        of_event = slides.event == event
        median[of_event], sigma[of_event] = (
            columns[of_event] @ b[:k],
            np.exp(scatter[of_event] @ b[k:]),
        )
    return median, sigma


@dataclass(frozen=True, eq=False)
class Scored:
    """A model's probabilities of the asked distances, and its residuals.

    Args:
        probability: of sliding further, shape (n, m).
        failed: whether it did, same shape.
        residual: ln D less ln of the median, of blocks that slide at least 1 mm.
    """

    probability: FloatArray
    failed: FloatArray
    residual: FloatArray

    @classmethod
    def of(cls, median: FloatArray, sigma: FloatArray, slides: Slides) -> Scored:
        """Score a model against what blocks did."""
        thresholds_m = np.array(THRESHOLDS_M)
        p = ndtr((median[:, None] - np.log(thresholds_m)) / sigma[:, None])
        failed = (slides.displacement_m[:, None] > thresholds_m).astype(np.float64)
        far = slides.displacement_m >= LEAST_DISPLACEMENT_M
        return cls(p, failed, np.log(slides.displacement_m[far]) - median[far])

    @property
    def losses(self) -> FloatArray:
        """Log loss of each outcome."""
        p = np.clip(self.probability, CLIP, 1.0 - CLIP)
        return -np.where(self.failed > 0.5, np.log(p), np.log1p(-p))

    def cells(self) -> list[str]:
        """Return log loss, Brier score, slope, bias and sigma of ln D."""
        is_known = np.ones(self.failed.shape, dtype=bool)
        scores = [score(self.probability, self.failed, is_known) for score in (log_loss, brier)]
        slope = calibration(self.probability, self.failed, is_known).slope
        return [
            *(f"{value:.3f}" for value in scores),
            f"{slope:.2f}",
            f"{self.residual.mean():+.2f}",
            f"{self.residual.std():.2f}",
        ]


def clustered_mean(values: FloatArray, event: NDArray[np.intp]) -> tuple[float, float]:
    """Return a mean over rows of shape (n, m) and its standard error, clustered by earthquake."""
    mean = float(values.mean())
    sums = np.bincount(event, (values - mean).sum(axis=1))
    g = np.unique(event).size
    return mean, float(np.sqrt(g / (g - 1.0) * (sums**2).sum()) / values.size)


def comparison(source: FitSource, *, facing: str) -> str:
    """Return the table of published regressions beside ours, by what they read.

    Args:
        source: displacements of both polarities.
        facing: ``one``: each polarity for itself, all strengths; ``either``: the larger of the two,
            k_y of 0.05 to 0.30 g, which the published ones were made for.
    """
    if facing == "either":
        source = larger_of_two(source)
    every = Slides.of_source(source)
    rows, ours_of = [], {}
    for published in PUBLISHED:
        names = published.predictors
        is_known = np.logical_and.reduce([np.isfinite(every.values[name]) for name in names])
        in_range = is_known & _in_range(every) if facing == "either" else is_known
        slides = every.only(in_range)
        if names not in ours_of:
            fitted = every.only(is_known)
            median, sigma = held_out(names, fitted)
            ours_of[names] = Scored.of(
                median[in_range[is_known]], sigma[in_range[is_known]], slides
            )
        theirs = Scored.of(published.median(slides.values), published.sigma(slides.values), slides)
        rows.append((published, theirs, ours_of[names], slides))
    return _table(rows)


def _in_range(slides: Slides) -> Mask:
    # the grid is of k_y/PGA, so that no strength lies on an edge but by chance
    return np.asarray((slides.values["ky"] >= KY_G[0]) & (slides.values["ky"] <= KY_G[1]))


def _table(rows: Sequence[tuple[Published, Scored, Scored, Slides]]) -> str:
    heads = ["reads, beside k_y", "model", "log loss", "Brier", "slope", "bias", "sigma of ln D",
             "gain of ours"]  # fmt: skip
    cells, before = [], None
    for published, theirs, ours, slides in rows:
        words = ", ".join(MEASURE_WORDS[name] for name in published.predictors)
        gain, error = clustered_mean(theirs.losses - ours.losses, slides.event)
        cells.append([words, published.name, *theirs.cells(), f"{gain:+.3f} ± {error:.3f}"])
        if published.predictors != before:
            before = published.predictors
            cells.insert(-1, [words, "**ours, held out**", *ours.cells(), ""])
    return markdown((heads, cells))
