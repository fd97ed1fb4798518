"""Models of the displacement of sliding blocks on equal terms.

Same earthquakes, blocks and distances; each published regression as it is, beside ours fitted
without the earthquake concerned, on the same measures.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from benchmarks.page import markdown
from benchmarks.published_slides import KY_G, PUBLISHED, Published
from rbfrag.fragility.fit.clusters import left_out
from rbfrag.fragility.fit.critical import most_likely
from rbfrag.fragility.fit.data import KR, LEAST_DISPLACEMENT_M, FitSource
from rbfrag.fragility.fit.likelihood import CensoredNormal, Standardised
from rbfrag.fragility.fit.scores import CLIP, brier, calibration, log_loss
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.solver.models.sliding import THRESHOLDS_M

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
    ky, one = v["ky"], np.ones_like(v["ky"])
    if "pga_g" not in predictors:
        return np.column_stack([one, np.log(ky), *(np.log(v[name]) for name in predictors)])
    left = np.log(1.0 - ky / v["pga_g"])
    if "pgv_m_s" in predictors:
        size = np.log(v["pgv_m_s"] ** 2 / (ky * STANDARD_GRAVITY_M_S2))
        columns = [one, size, left]
        if "arias_m_s" in predictors:
            columns += [np.log(v["arias_m_s"] / v["pgv_m_s"] ** 2)]
        return np.column_stack(columns)
    columns = [one, np.log(ky / v["pga_g"]), left, np.log(v["pga_g"])]
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

    found = slides.displacement_m >= LEAST_DISPLACEMENT_M
    values = {"columns": columns, "scatter": scatter, "y": y}
    rows = CensoredNormal(formula, values, found, slides.event)
    start = np.linalg.lstsq(columns[found], y[found], rcond=None)[0]
    start = most_likely(rows, np.concatenate([start, [-0.3], np.zeros(scatter.shape[1] - 1)]))
    median, sigma = np.empty(y.size), np.empty(y.size)
    for event, b in left_out(rows.event, lambda rest: most_likely(rows.only(rest), start)).items():
        own = slides.event == event
        median[own], sigma[own] = columns[own] @ b[:k], np.exp(scatter[own] @ b[k:])
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
        asked = np.array(THRESHOLDS_M)
        p = ndtr((median[:, None] - np.log(asked)) / sigma[:, None])
        failed = (slides.displacement_m[:, None] > asked).astype(np.float64)
        far = slides.displacement_m >= LEAST_DISPLACEMENT_M
        return cls(p, failed, np.log(slides.displacement_m[far]) - median[far])

    @property
    def losses(self) -> FloatArray:
        """Log loss of each outcome."""
        p = np.clip(self.probability, CLIP, 1.0 - CLIP)
        return -np.where(self.failed > 0.5, np.log(p), np.log1p(-p))

    def cells(self) -> list[str]:
        """Return log loss, Brier score, slope, bias and sigma of ln D."""
        known = np.ones(self.failed.shape, dtype=bool)
        scores = [each(self.probability, self.failed, known) for each in (log_loss, brier)]
        slope = calibration(self.probability, self.failed, known).slope
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
        known = np.logical_and.reduce([np.isfinite(every.values[name]) for name in names])
        asked = known & _in_range(every) if facing == "either" else known
        slides = every.only(asked)
        if names not in ours_of:
            fitted = every.only(known)
            median, sigma = held_out(names, fitted)
            ours_of[names] = Scored.of(median[asked[known]], sigma[asked[known]], slides)
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
