"""The probability of toppling at many sites whose shaking is known with uncertainty."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbfrag.fragility.joint import event_ranges
from rbfrag.fragility.lookup import find_model
from rbfrag.fragility.predict import Model, answer_given
from rbfrag.fragility.prediction_array import PredictionArray
from rbfrag.fragility.uncertain import normal_steps
from rbfrag.hazards.conversions import Component
from rbfrag.hazards.correlations import correlations

FloatArray = NDArray[np.float64]

REACH = 4.0
"""Standard deviations of the shaking that are integrated over, to both sides."""

NOTHING = 1e-9
"""Where even the strongest of these has a smaller probability, zero is answered."""

_STEP = 0.2
"""Greatest step in ln PGV: fragilities are wider."""

_CHUNK = 400_000

_MOST_GRID, _SOBOL_POWER = 2, 10
"""Most variables that a grid of points is laid over, and the power of two that draw more."""


@dataclass(frozen=True, eq=False)
class SiteProbability:
    """Probabilities at n sites.

    Args:
        probability: P at each site, the mean over the blocks of a class, shape (n,).
        ci_low: lower end of its interval, as far as the data tell the parameters of the model.
        ci_high: upper end.
        event_low: lower end of the share of such blocks at many such sites that fails in one single
            earthquake, taken at P; NaN where the model does not know it.
        event_high: upper end.
        in_domain: whether every block and the site's shaking lie in the ranges fitted.
        level: confidence level.
        model: name of the model that answered.
        term: its intensity term.
        method: how it was fitted.
        measures: the measures that it read.
        integrated: those of them whose standard deviations were integrated over.
        advice: what is to be said of a measure that tells little; empty for nothing.
    """

    probability: FloatArray
    ci_low: FloatArray
    ci_high: FloatArray
    event_low: FloatArray
    event_high: FloatArray
    in_domain: NDArray[np.bool_]
    level: float
    model: str
    term: str
    method: str
    measures: tuple[str, ...]
    integrated: tuple[str, ...]
    advice: str


def site_probability(
    measures: Mapping[str, FloatArray],
    p2: FloatArray,
    kr: FloatArray,
    *,
    component: Component,
    weight: FloatArray | None = None,
    own_block: bool = False,
    std_ln: Mapping[str, FloatArray] | None = None,
    model: Model | None = None,
    level: float = 0.95,
    db: str | PathLike[str] | None = None,
) -> SiteProbability:
    """Return probabilities at sites, integrated over what is not known of the shaking.

    The best model that the measures suffice for reads its own of them. Their logarithms at a site
    are taken as normal about those of the given values, with the given standard deviations and the
    correlations of :func:`~rbfrag.hazards.correlations.correlation`; to these the scatter of a
    single component about the stated definition is added, common to all.

    Args:
        measures: what is known of the shaking at the sites, by the names of
            :func:`rbfrag.predict` (pgv_m_s [m/s], pga_g and sa10_g [g], …), each of shape (n,).
        p2: frequency parameters [1/s²] of the blocks, shape (m,), or (n,) with `own_block`.
        kr: their toppling yield acceleration coefficients.
        component: what the measures mean.
        weight: weights of the blocks of a class, shape (m,); None for equal ones.
        own_block: every site has its own block; otherwise all blocks stand at every site.
        std_ln: standard deviations of the measures' logarithms by name, shape (n,); where one that
            the model reads is missing all values are taken as certain, but PGA beside PGV alone.
        model: as in :func:`rbfrag.predict`.
        level: confidence level.
        db: as in :func:`rbfrag.predict`.
    """
    chosen = find_model(model, ("p2", "kr", *measures), db)
    names = chosen.term.inputs
    n = measures[names[0]].size
    weights = np.full(p2.size, 1.0) if weight is None else weight
    weights = weights / weights.sum()
    given = integrated_deviations(names, std_ln or {})
    deviations = np.stack([given.get(name, np.zeros(n)) for name in names], axis=-1)
    # the component's scatter is common to all measures
    covariance = correlations(names) * deviations[:, :, None] * deviations[:, None, :]
    factors = _cholesky(covariance + component.scatter**2)
    mean = np.ones(1) if own_block else weights
    widest = float(factors[:, 0, 0].max(initial=0.0))

    def answers(sites: NDArray[np.intp], points: FloatArray) -> PredictionArray:
        """Return answers of shape (sites, blocks, points) at normal scores, shape (points, k)."""
        logs = np.einsum("sij,pj->isp", factors[sites], points)
        sizes, strengths = (
            (values[sites, None, None] if own_block else values[None, :, None])
            for values in (p2, kr)
        )
        shaking: dict[str, Any] = {
            name: (measures[name][sites, None] / component.ratio * np.exp(own))[:, None, :]
            for name, own in zip(names, logs, strict=True)
        }
        answer = answer_given(chosen, {"p2": sizes, "kr": strengths, **shaking}, level)
        assert isinstance(answer, PredictionArray)
        return answer

    probability, low, high = (np.zeros(n) for _ in range(3))
    in_domain = np.empty(n, dtype=bool)
    median_point = np.zeros((1, len(names)))
    strong = median_point if widest == 0.0 else _strongest(len(names), across=bool(given))
    blocks = 1 if own_block else p2.size
    for sites in _chunks(np.arange(n), _CHUNK // (blocks * len(strong))):
        # the median answers for the domain, the strongest shaking for what can fail at all
        in_domain[sites] = answers(sites, median_point).in_domain[:, :, 0].all(axis=1)
        strongest = answers(sites, strong)
        probability[sites] = np.nan_to_num(strongest.ci_high, nan=np.inf).max(axis=(1, 2))
    alive = np.flatnonzero(probability > NOTHING)
    probability[probability <= NOTHING] = 0.0
    points, both = median_point, np.ones(1)
    if widest > 0.0:
        points, both = _points(len(names), widest, across=bool(given))
    for sites in _chunks(alive, _CHUNK // (blocks * both.size)):
        answer = answers(sites, points)
        probability[sites] = (answer.probability @ both) @ mean
        low[sites] = (answer.ci_low @ both) @ mean
        high[sites] = (answer.ci_high @ both) @ mean
    event_low = event_high = np.full(n, np.nan)
    if chosen.event_spread is not None:
        event_low, event_high = event_ranges(probability, chosen.event_spread.root**2, level)
    return SiteProbability(
        probability=probability,
        ci_low=low,
        ci_high=high,
        event_low=event_low,
        event_high=event_high,
        in_domain=in_domain,
        level=level,
        model=chosen.name,
        term=chosen.term.name,
        method=chosen.row.method,
        measures=names,
        integrated=tuple(given),
        advice=chosen.term.advice,
    )


def integrated_deviations(
    names: tuple[str, ...], std_ln: Mapping[str, FloatArray]
) -> dict[str, FloatArray]:
    """Return the standard deviations that are integrated over of the measures that a model reads.

    All or none, lest a measure varies while one that goes with it does not; PGA alone may be
    missing beside PGV, which tells most.
    """
    needed = names[:1] if names[0] == "pgv_m_s" else names
    if not all(name in std_ln for name in needed):
        return {}
    return {name: std_ln[name] for name in names if name in std_ln}


def _cholesky(covariance: FloatArray) -> FloatArray:
    """Return lower factors of covariances that may be singular, shape (n, k, k)."""
    n, k, _ = covariance.shape
    factor = np.zeros((n, k, k))
    for i in range(k):
        for j in range(i + 1):
            rest = covariance[:, i, j] - np.einsum("sm,sm->s", factor[:, i, :j], factor[:, j, :j])
            if i == j:
                factor[:, i, i] = np.sqrt(np.maximum(rest, 0.0))
            else:
                pivot = factor[:, j, j]
                factor[:, i, j] = np.divide(rest, pivot, out=np.zeros(n), where=pivot > 0.0)
    return factor


def _chunks(places: NDArray[np.intp], size: int) -> list[NDArray[np.intp]]:
    return [places[i : i + max(size, 1)] for i in range(0, places.size, max(size, 1))]


def _strongest(k: int, *, across: bool) -> FloatArray:
    """Return scores of the strongest shaking, the first measure at its reach, shape (points, k)."""
    others = np.array(list(product((-3.0, 0.0, 3.0) if across else (0.0,), repeat=k - 1)))
    return np.column_stack([np.full(len(others), REACH), others])


def _points(k: int, widest: float, *, across: bool) -> tuple[FloatArray, FloatArray]:
    """Return points of k standard normal variables, shape (points, k), and their weights.

    One variable is taken in equal steps, a second in five; four and more are drawn by a sequence of
    low discrepancy (Sobol), whose mean is good to some thousandths of P.

    Args:
        k: number of variables.
        widest: greatest standard deviation that the first one stands for.
        across: False where the others do not vary beside the first.
    """
    if k > _MOST_GRID and across:
        from scipy.stats import norm, qmc

        sobol = qmc.Sobol(k, scramble=True, rng=np.random.default_rng(0))
        drawn = norm.ppf(sobol.random_base2(_SOBOL_POWER))
        return drawn, np.full(len(drawn), 1.0 / len(drawn))
    count = 2 * math.ceil(REACH * widest / _STEP) + 1
    x, wx = normal_steps(min(max(count, 9), 65), REACH)
    y, wy = normal_steps(5 if k > 1 and across else 1, 3.0)
    points = np.zeros((x.size * y.size, k))
    points[:, 0] = np.repeat(x, y.size)
    points[:, 1:2] = np.tile(y, x.size)[:, None]
    return points, np.repeat(wx, y.size) * np.tile(wy, x.size)
