"""The probability of toppling at many sites whose shaking is known with uncertainty."""

from __future__ import annotations

import math
from dataclasses import dataclass
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbfrag.fragility.joint import event_ranges
from rbfrag.fragility.lookup import find_model
from rbfrag.fragility.predict import Model, predict
from rbfrag.fragility.prediction_array import PredictionArray
from rbfrag.hazards.annual_rate import normal_steps
from rbfrag.hazards.conversions import Component

FloatArray = NDArray[np.float64]

CORRELATION = 0.733
"""Correlation of the residuals of ln PGA and ln PGV (Bradley 2012)."""

REACH = 4.0
"""Standard deviations of the shaking that are integrated over, to both sides."""

NOTHING = 1e-9
"""Where even the strongest of these has a smaller probability, zero is answered."""

_STEP = 0.2
"""Greatest step in ln PGV: fragilities are wider."""

_CHUNK = 400_000


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


def site_probability(
    pgv_m_s: FloatArray,
    pga_g: FloatArray,
    p2: FloatArray,
    kr: FloatArray,
    *,
    component: Component,
    weight: FloatArray | None = None,
    own_block: bool = False,
    std_ln_pgv: FloatArray | None = None,
    std_ln_pga: FloatArray | None = None,
    model: Model | None = None,
    level: float = 0.95,
    db: str | PathLike[str] | None = None,
) -> SiteProbability:
    """Return probabilities at sites, integrated over what is not known of the shaking.

    ln PGV and ln PGA at a site are taken as normal about the logarithms of the given values,
    with the given standard deviations and the correlation `CORRELATION`; to these the scatter of a
    single component about the stated definition is added, common to both.

    Args:
        pgv_m_s: peak ground velocity at the sites [m/s], shape (n,).
        pga_g: peak ground acceleration [g], shape (n,).
        p2: frequency parameters [1/s²] of the blocks, shape (m,), or (n,) with `own_block`.
        kr: their toppling yield acceleration coefficients.
        component: what the measures mean.
        weight: weights of the blocks of a class, shape (m,); None for equal ones.
        own_block: every site has its own block; otherwise all blocks stand at every site.
        std_ln_pgv: standard deviation of ln PGV, shape (n,), or None for certain values.
        std_ln_pga: the same of ln PGA.
        model: as in :func:`rbfrag.predict`.
        level: confidence level.
        db: as in :func:`rbfrag.predict`.
    """
    n = pgv_m_s.size
    chosen = find_model(model, ("p2", "kr", "pgv_m_s", "pga_g"), db)
    weights = np.full(p2.size, 1.0) if weight is None else weight
    weights = weights / weights.sum()
    sv = np.zeros(n) if std_ln_pgv is None else std_ln_pgv
    sa = np.zeros(n) if std_ln_pga is None else std_ln_pga
    # the component's scatter is common to both measures
    cov = CORRELATION * sv * sa + component.scatter**2
    lv = np.sqrt(sv**2 + component.scatter**2)
    with np.errstate(divide="ignore", invalid="ignore"):
        along = np.where(lv > 0.0, cov / lv, 0.0)
    across = np.sqrt(np.maximum(sa**2 + component.scatter**2 - along**2, 0.0))
    mean = np.ones(1) if own_block else weights
    widest = float(lv.max(initial=0.0))

    def answers(sites: NDArray[np.intp], first: FloatArray, second: FloatArray) -> PredictionArray:
        """Return answers of shape (sites, blocks, points)."""
        v = pgv_m_s[sites, None] / component.ratio * np.exp(lv[sites, None] * first)
        a = along[sites, None] * first + across[sites, None] * second
        a = pga_g[sites, None] / component.ratio * np.exp(a)
        sizes, strengths = (
            (values[sites, None, None] if own_block else values[None, :, None])
            for values in (p2, kr)
        )
        shaking: dict[str, Any] = {"pgv_m_s": v[:, None, :], "pga_g": a[:, None, :]}
        answer = predict(sizes, strengths, **shaking, model=chosen, level=level)
        assert isinstance(answer, PredictionArray)
        return answer

    probability, low, high = (np.zeros(n) for _ in range(3))
    in_domain = np.empty(n, dtype=bool)
    own = 3 if std_ln_pga is not None else 1
    blocks = 1 if own_block else p2.size
    for sites in _chunks(np.arange(n), _CHUNK // (blocks * own)):
        # the median answers for the domain, the strongest shaking for what can fail at all
        median = answers(sites, np.zeros(1), np.zeros(1))
        in_domain[sites] = median.in_domain[:, :, 0].all(axis=1)
        strongest = median
        if widest > 0.0:
            _, y, _ = _points(1, own)
            strongest = answers(sites, np.full(own, REACH), y)
        probability[sites] = np.nan_to_num(strongest.ci_high, nan=np.inf).max(axis=(1, 2))
    alive = np.flatnonzero(probability > NOTHING)
    probability[probability <= NOTHING] = 0.0
    first, second, both = (np.zeros(1), np.zeros(1), np.ones(1))
    if widest > 0.0:
        count = 2 * math.ceil(REACH * widest / _STEP) + 1
        first, second, both = _points(min(max(count, 9), 65), 5 if std_ln_pga is not None else 1)
    for sites in _chunks(alive, _CHUNK // (blocks * both.size)):
        answer = answers(sites, first, second)
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
    )


def _chunks(places: NDArray[np.intp], size: int) -> list[NDArray[np.intp]]:
    return [places[i : i + max(size, 1)] for i in range(0, places.size, max(size, 1))]


def _points(first: int, second: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return points of two standard normal variables and their weights, shape (first·second,)."""
    x, wx = normal_steps(first, REACH)
    y, wy = normal_steps(second, 3.0)
    return np.repeat(x, second), np.tile(y, first), np.repeat(wx, second) * np.tile(wy, first)
