"""Fraction of identical blocks that fail at several sites in one earthquake (uncertain shaking)."""

from __future__ import annotations

import numpy as np
from scipy.special import ndtr, ndtri

from rbfrag.fragility.dependence import Dependence
from rbfrag.fragility.joint import SIDES, beta_binomial_quantiles, joint_excess
from rbfrag.fragility.shaking import POINTS, WEIGHTS
from rbfrag.solver.results import FloatArray

_LEVELS: FloatArray = (np.arange(200.0) + 0.5) / 200.0
_LEAST, _MOST = 1e-9, 1.0 - 1e-9


def shaken_share_range(
    along: FloatArray, tau: float, sigma: float, law: Dependence, sites: int, level: float
) -> tuple[float, float]:
    """Return the prediction interval of the failed fraction of identical blocks at several sites in
    one earthquake.

    Given what the shaking of all sites shares, that of each site is independent, and the number of
    failures is beta-binomial, as in :func:`rbfrag.fragility.joint.share_range`, of the mean and of
    the variance of pairs over what each site has of its own; blocks of one site share all of it.
    The law is the mixture over what is shared. For many sites it is that of the mean over a site's
    own shaking of Φ((a + √ρ_e u)/√(1 - ρ_e)), u and the shared part being standard normal.

    Args:
        along: P at each of the points of the first measure, shape (41,).
        tau: standard deviation of what all sites share of its logarithm.
        sigma: that of the whole.
        law: what the blocks of one earthquake share beyond the shaking.
        sites: their number.
        level: probability that the share lies between both ends.
    """
    x, w = np.array(POINTS), np.array(WEIGHTS)
    ratio = min(tau / sigma, 1.0)
    # rows are what is shared, columns what is a site's own
    score = ratio * x[:, None] + np.sqrt(1.0 - ratio * ratio) * x
    p = np.clip(np.interp(score, x, along), _LEAST * _LEAST, _MOST)
    mean, a = p @ w, ndtri(p)
    root = np.sqrt(1.0 - law.rho_e)
    common = ndtr((a[:, None] + np.sqrt(law.rho_e) * x[:, None]) / root) @ w
    n, site = SIDES * sites, law.rho_e + law.rho_s
    pairs = (n - SIDES) / (n - 1.0) * (np.square(common) @ w)
    for number, r in ((1.0, site + law.rho_v - law.rho_o), (2.0, site)):
        pairs += number / (n - 1.0) * ((joint_excess(a, a, np.full(a.shape, r)) + p * p) @ w)
    alone = np.maximum(mean * (1.0 - mean), _LEAST * _LEAST)
    rho = np.asarray(np.clip((pairs - mean * mean) / alone, _LEAST, _MOST), dtype=np.float64)
    counts = beta_binomial_quantiles(n, mean, rho, _LEVELS)
    order = np.argsort(counts, axis=None)
    below = np.cumsum(np.broadcast_to(w / _LEVELS.size, counts.shape).ravel()[order])
    tail = 0.5 - 0.5 * level
    indices = np.minimum(np.searchsorted(below, (tail, 1.0 - tail)), order.size - 1)
    low, high = counts.ravel()[order[indices]] / n
    return float(low), float(high)
