"""The probability that none of some blocks fails, by Genz's separation of variables.

    P(all Z_i > a_i) = ∫ Π_i Φ(-(a_i - Σ_j<i L_ij z_j)/L_ii) du,   R = L Lᵀ

with z_j drawn, by u_j, from those normals that keep block j standing (Genz 1992). The integrand is
smooth, so that points of low discrepancy tell it well; where blocks share nothing it is constant.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr, ndtri

from rbfrag.fragility.dependence import Dependence
from rbfrag.fragility.joint import Placement
from rbfrag.fragility.joint_points import REPLICATES, uniform_points

FloatArray = NDArray[np.float64]

_JITTER = 1e-10
_LEAST = 1e-300
_MATRICES_AT_ONCE = 2**22


def none_fails(
    probability: FloatArray, blocks: Placement, dependence: Dependence, power: int, seed: int = 0
) -> FloatArray:
    """Return the probability that none of the blocks of one earthquake fails, by each scramble.

    Unknown azimuths are drawn anew for each point, by further coordinates of it.

    Args:
        probability: P of each block, shape (n,).
        blocks: where they stand.
        dependence: the copula.
        power: base-2 logarithm of the number of points of each scramble.
        seed: seed of the scrambles.
    """
    order = np.argsort(-probability, kind="stable")  # the most likely first: it varies least then
    bound, some = -ndtri(probability[order]), blocks.only(order)
    n, drawn = order.size, np.flatnonzero(some.drawn)
    none = np.empty(REPLICATES)
    for r, u in enumerate(uniform_points(n + drawn.size, power, seed)):
        if not drawn.size:
            none[r] = _standing(bound, _factors(some, dependence)[None], u).mean()
            continue
        at_once = max(1, _MATRICES_AT_ONCE // (n * n))
        side = np.floor(4.0 * u[:, n:]).astype(np.int64)
        component = np.tile(some.component, (u.shape[0], 1))
        polarity = np.tile(some.polarity, (u.shape[0], 1))
        component[:, drawn], polarity[:, drawn] = side // 2, 2 * (side % 2) - 1
        shared = _SharedParts(some, dependence)
        parts = [
            _standing(bound, shared.factors(component[some_of], polarity[some_of]), u[some_of, :n])
            for some_of in (slice(i, i + at_once) for i in range(0, u.shape[0], at_once))
        ]
        none[r] = np.concatenate(parts).mean()
    return none


def _factors(blocks: Placement, law: Dependence) -> FloatArray:
    return _cholesky(blocks.correlation(law))


def _cholesky(r: FloatArray) -> FloatArray:
    n = r.shape[-1]
    r[..., np.arange(n), np.arange(n)] = 1.0 + _JITTER
    return np.asarray(np.linalg.cholesky(r))


class _SharedParts:
    """What correlations of blocks are made of, whatever sides they face."""

    def __init__(self, blocks: Placement, law: Dependence) -> None:
        d_l = np.abs(blocks.l[:, None] - blocks.l[None])
        d_y = np.abs(blocks.ln_y[:, None] - blocks.ln_y[None])
        site = blocks.site[:, None] == blocks.site[None]
        here, same = np.ones(site.shape, dtype=np.bool_), np.ones(site.shape)
        self._common = law.of_pairs(d_l, d_y, site, ~here, same)
        own = [law.of_pairs(d_l, d_y, here, here, q * same) for q in (1.0, -1.0)]
        apart = law.of_pairs(d_l, d_y, here, ~here, same)
        self._symmetric = (0.5 * (own[0] + own[1]) - apart) * site
        self._antisymmetric = 0.5 * (own[0] - own[1]) * site

    def factors(self, component: NDArray[np.int64], polarity: NDArray[np.int64]) -> FloatArray:
        """Return Cholesky factors of R, shape (k, n, n), of sides of shape (k, n)."""
        q = (polarity[:, :, None] * polarity[:, None, :]).astype(np.float64)
        same = component[:, :, None] == component[:, None, :]
        return _cholesky(self._common + same * (self._symmetric + q * self._antisymmetric))


def _standing(bound: FloatArray, factor: FloatArray, u: FloatArray) -> FloatArray:
    """Return Genz's integrand, shape (k,), at points of shape (k, n), by factors (k or 1, n, n)."""
    below = np.ascontiguousarray(factor.transpose(1, 2, 0))
    x, chance = np.empty(u.shape[::-1]), np.ones(u.shape[0])
    for i in range(bound.size):
        mean = np.einsum("jk,jk->k", np.broadcast_to(below[i, :i], x[:i].shape), x[:i])
        stands = ndtr((bound[i] - mean) / below[i, i])
        chance *= stands
        x[i] = ndtri(np.maximum(u[:, i] * stands, _LEAST))
    return chance
