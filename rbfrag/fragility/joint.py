"""Joint failure of several blocks in one earthquake, in closed form: number of failures, and P of
any.

The law is the normal copula of :mod:`rbfrag.fragility.dependence`. Means and variances of counts
are exact; the beta-binomial law of both stands for that of the count. Under uncertain shaking the
fraction that fails is a mixture over what the sites share (:func:`shaken_share_range`). Samples are
drawn in :mod:`rbfrag.fragility.joint_sampling`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import betaln, ndtr, ndtri

from rbfrag.errors import InputError
from rbfrag.fragility.dependence import EXACT, Dependence, Loadings, Shares
from rbfrag.fragility.method import arrays
from rbfrag.fragility.model import FragilityModel
from rbfrag.fragility.shaking import POINTS, WEIGHTS
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.solver.results import FloatArray

IntArray = NDArray[np.int64]
Indices = NDArray[np.intp]

UNKNOWN = 0
"""Polarity of a block whose azimuth is not known: component and polarity are drawn at random."""

COMPONENTS = 2
"""Horizontal components that an unknown azimuth is drawn from: labels 0 and 1."""

SIDES = 2 * COMPONENTS
"""Sides that a block may face: both polarities of each component."""

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(32)
_NEAR_ONE = 0.99
_PANELS = (0.0, *(0.25**k for k in range(5, -1, -1)))
_FARTHEST = 38.0
_LEAST_RHO, _MOST_RHO = 1e-9, 1.0 - 1e-12
_PAIRS_AT_ONCE = 2**18


@dataclass(frozen=True, eq=False)
class Placement:
    """Blocks, and the earthquakes, sites and components that they share.

    Args:
        l: ln of the frequency parameter p [1/s], shape (n,).
        ln_y: ln of the toppling velocity y = k_r g/p [m/s], shape (n,).
        earthquake: numbers of earthquakes, shape (n,).
        site: numbers of sites within an earthquake, shape (n,).
        component: numbers of horizontal components within a site, shape (n,).
        polarity: +1 or -1, the side of the component that the block faces; `UNKNOWN` where the
            azimuth is not known, shape (n,). Then the component does not count.
        of_event, of_site, of_component: the :class:`~rbfrag.fragility.dependence.Loadings` of a
            completed spectral velocity, shape (n,); 0 where it is exact.

    Raises:
        InputError: lengths differ, a number is not finite, or a label is none.
    """

    l: FloatArray  # noqa: E741  the symbol of the formula
    ln_y: FloatArray
    earthquake: IntArray
    site: IntArray
    component: IntArray
    polarity: IntArray
    of_event: FloatArray
    of_site: FloatArray
    of_component: FloatArray

    @classmethod
    def of(
        cls,
        l: ArrayLike,  # noqa: E741
        ln_y: ArrayLike,
        *,
        earthquake: ArrayLike = 0,
        site: ArrayLike = 0,
        component: ArrayLike = 0,
        polarity: ArrayLike = 1,
        loadings: Loadings = EXACT,
    ) -> Placement:
        """Return a placement from broadcast values; by default one side of one site."""
        real = (np.asarray(part, dtype=np.float64) for part in (l, ln_y))
        integers = (
            np.asarray(part, dtype=np.int64) for part in (earthquake, site, component, polarity)
        )
        try:
            parts = np.broadcast_arrays(
                *(np.atleast_1d(part) for part in (*real, *integers, *loadings))
            )
        except ValueError as error:
            raise InputError(
                f"blocks of a portfolio must have columns of one length: {error}"
            ) from None
        return cls(*parts)

    @classmethod
    def of_blocks(
        cls, model: FragilityModel, numbers: Mapping[str, FloatArray], **labels: ArrayLike
    ) -> Placement | None:
        """Return a placement of blocks from the inputs of a model that completes its spectral
        velocity as the answers do; None for blocks without a size.
        """
        block = model.method.block
        if block.size is None:
            return None
        p = np.sqrt(numbers[block.size])
        ln_y = np.log(numbers[block.strength] * STANDARD_GRAVITY_M_S2 / p)
        loadings = model.loadings(numbers, arrays())
        return cls.of(np.log(p), ln_y, loadings=loadings, **labels)

    @property
    def loadings(self) -> Loadings:
        """Scatter of a completed spectral velocity in Z of each block."""
        return Loadings(self.of_event, self.of_site, self.of_component)

    def __post_init__(self) -> None:
        columns = vars(self)
        if len({part.shape for part in columns.values()}) != 1 or self.l.ndim != 1:
            shapes = ", ".join(f"{name} {part.shape}" for name, part in columns.items())
            raise InputError(f"blocks of a portfolio must have columns of one length, not {shapes}")
        if not (np.isfinite(self.l).all() and np.isfinite(self.ln_y).all()):
            raise InputError("ln p and ln y of every block of a portfolio must be finite")
        if (np.abs(self.polarity) > 1).any():
            raise InputError("a polarity is +1, -1, or 0 where the azimuth is unknown")
        drawn, component = self.drawn, self.component
        if drawn.any() and ((component < 0) | (component >= COMPONENTS))[~drawn].any():
            raise InputError("with blocks of unknown azimuth the components must be 0 and 1")

    @property
    def size(self) -> int:
        """Number of blocks."""
        return self.l.size

    @property
    def drawn(self) -> NDArray[np.bool_]:
        """Blocks of unknown azimuth, shape (n,)."""
        return np.asarray(self.polarity == UNKNOWN)

    def only(self, chosen: NDArray[np.bool_] | NDArray[np.intp]) -> Placement:
        """Return a subset of the blocks."""
        return Placement(*(part[chosen] for part in vars(self).values()))


def any_fails(probability: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return P that any block fails, fully dependent and independent, tables x nodes each.

    Args:
        probability: P, tables x blocks x nodes.
    """
    with np.errstate(divide="ignore"):
        none = np.log1p(-probability).sum(axis=-2)
    return probability.max(axis=-2), -np.expm1(none)


def joint_excess(bound: ArrayLike, other: ArrayLike, r: ArrayLike) -> FloatArray:
    """Return Φ₂(a, b; R) - Φ(a) Φ(b), the covariance of two failures.

        1/2π ∫₀^{asin R} exp(-(a² + b² - 2ab sin t)/(2 cos² t)) dt

    by 32 Gauss-Legendre nodes. Near R = 1 the same integral is taken from there, where Φ₂ is
    min(Φ(a), Φ(b)), so that the error stays below 1e-9 for every R.

    Args:
        bound: a, any shape; infinite where P is 0 or 1.
        other: b.
        r: correlation, -1 to 1.
    """
    # sums of loadings may pass 1 by rounding
    columns = (np.asarray(x, dtype=np.float64) for x in (bound, other, np.clip(r, -1.0, 1.0)))
    first, second, r = np.broadcast_arrays(*columns)
    first = np.clip(first, -_FARTHEST, _FARTHEST)
    second = np.clip(second, -_FARTHEST, _FARTHEST)
    near = np.abs(r) > _NEAR_ONE
    a, b, angle = first[~near], second[~near], np.arcsin(r[~near])
    total, squares, product = np.zeros(angle.shape), 0.5 * (a * a + b * b), a * b
    for node, weight in zip(_NODES, _WEIGHTS, strict=True):
        sine = np.sin(angle * (0.5 + 0.5 * node))
        total += weight * np.exp((product * sine - squares) / (1.0 - sine * sine))
    excess = np.empty(r.shape)
    excess[~near] = total * angle / (4.0 * np.pi)
    if near.any():
        excess[near] = _excess_near_one(first[near], second[near], r[near])
    return excess


def _excess_near_one(a: FloatArray, b: FloatArray, r: FloatArray) -> FloatArray:
    # Φ₂(a, b; -R) = Φ(a) - Φ₂(a, -b; R) leaves R > 0; from there t = π/2 - s. What is missing
    # begins as exp(-c/s²): panels that shrink towards 0 follow it wherever it rises.
    sign = np.where(r < 0.0, -1.0, 1.0)
    b = b * sign
    apart, product, missing = 0.5 * (a - b) ** 2, a * b, np.zeros(a.shape)
    for low, high in pairwise(_PANELS):
        for node, weight in zip(_NODES, _WEIGHTS, strict=True):
            s = np.arccos(np.abs(r)) * (low + (high - low) * (0.5 + 0.5 * node))
            sine = np.maximum(np.sin(s), 1e-150)
            decay = np.exp(-apart / (sine * sine) - product / (1.0 + np.cos(s)))
            missing += weight * (high - low) * decay
    pa, pb = ndtr(a), ndtr(b)
    missing *= np.arccos(np.abs(r)) / (4.0 * np.pi)
    return np.asarray(sign * (np.minimum(pa, pb) - pa * pb - missing))


def share_range(
    probability: ArrayLike, law: Shares, sites: int, level: float = 0.95
) -> tuple[FloatArray, FloatArray]:
    """Return the prediction interval of the fraction of identical blocks that fail at several sites
    in one earthquake.

    The blocks face all sides: two components times two polarities at each site, m = 4 sites in all.
    Their number is beta-binomial of mean m P and of the variance that Φ₂ gives pairs: of opposite
    sides R = ρ_e + ρ_s + ρ_v - ρ_o, of the two components ρ_e + ρ_s, of other sites ρ_e.

    Args:
        probability: P of one block, 0 to 1, of any shape, which both ends have.
        sites: their number, each shaken by the same measures.
        level: probability that the share lies between both ends.
    """
    p, n = np.asarray(probability, dtype=np.float64), SIDES * sites
    rho, tail = overdispersion(p, law, sites), 0.5 - 0.5 * level
    low, high = beta_binomial_quantiles(n, p, rho, np.array([tail, 1.0 - tail])) / n
    return low, high


def overdispersion(p: FloatArray, law: Shares, sites: int) -> FloatArray:
    """Return the mean correlation of the failures of two blocks of :func:`share_range`, at least 0.

    Args:
        p: P of one block, any shape.
    """
    other_blocks, site, excess = SIDES * sites - 1.0, law.rho_e + law.rho_s, np.zeros(p.shape)
    a = ndtri(p)
    for number, r in (
        (1.0, site + law.rho_v - law.rho_o), (2.0, site), (other_blocks - 3.0, law.rho_e)
    ):  # fmt: skip
        if number:
            excess += number / other_blocks * joint_excess(a, a, r)
    alone = p * (1.0 - p)
    rho = np.divide(excess, alone, out=np.zeros(p.shape), where=alone > 0.0)
    return np.clip(rho, _LEAST_RHO, _MOST_RHO)


def beta_binomial_quantiles(
    n: int, share: FloatArray, rho: FloatArray, q: FloatArray
) -> FloatArray:
    """Return quantiles q of the beta-binomial number of failures among n, shape (q, …).

    Args:
        share: mean over n, any shape.
        rho: overdispersion, same shape.
    """
    flat, more = share.ravel(), 1.0 / rho.ravel() - 1.0
    result, k = np.empty((q.size, flat.size)), np.arange(n + 1.0)
    ways = -np.log(n + 1.0) - betaln(n - k + 1.0, k + 1.0)
    at_once = max(1, _PAIRS_AT_ONCE // (n + 1))
    for start in range(0, flat.size, at_once):
        chunk = slice(start, start + at_once)
        alpha = (flat[chunk] * more[chunk])[:, None]
        beta = more[chunk, None] - alpha
        with np.errstate(invalid="ignore"):
            chance = np.exp(ways + betaln(k + alpha, n - k + beta) - betaln(alpha, beta))
        below = np.cumsum(chance, axis=1)
        result[:, chunk] = [(below < level).sum(axis=1) for level in q]
    result = np.where((flat > 0.0) & (flat < 1.0), np.minimum(result, n), n * flat)
    return result.reshape(q.shape + share.shape)


def count_moments(
    probability: ArrayLike,
    blocks: Placement,
    dependence: Dependence,
    weights: ArrayLike | None = None,
) -> tuple[float, float]:
    """Return the exact mean and variance of the weighted number of failures.

        E = Σ w_i P_i,   Var = Σ w_i² P_i (1-P_i) + 2 Σ_{i<j} w_i w_j [Φ₂(a_i, a_j; R_ij) - P_i P_j]

    Of a block with unknown azimuth the covariance is the mean over the azimuths.

    Args:
        probability: P of each block, shape (n,).
        weights: weight or loss of each block, shape (n,); None for 1.
    """
    p, w = checked(probability, blocks, weights)
    variance = float((w * w * p * (1.0 - p)).sum())
    for number in np.unique(blocks.earthquake):
        rows = np.flatnonzero(blocks.earthquake == number)
        shaken, n, shared = blocks.only(rows), rows.size, 0.0
        a, weight = ndtri(p[rows]), w[rows]
        at_once = max(1, _PAIRS_AT_ONCE // n)
        for start in range(0, n, at_once):  # pairs i < j
            i, j = np.nonzero(np.arange(start, min(start + at_once, n))[:, None] < np.arange(n))
            i += start
            excess = pair_excess(a[i], a[j], shaken, i, j, dependence)
            shared += float(excess @ (weight[i] * weight[j]))
        variance += 2.0 * shared
    return float(p @ w), variance


def pair_excess(
    a: FloatArray, b: FloatArray, blocks: Placement, i: Indices, j: Indices, law: Dependence
) -> FloatArray:
    """Return the covariance of the failures of pairs in one earthquake, shape (pairs,).

    Of a block with unknown azimuth it is the mean over the azimuths: another component in half of
    the cases, else the same or the opposite side.

    Args:
        a: bounds of Z of the first blocks, shape (pairs,).
        b: the same of the others.
        i: indices of the first blocks.
        j: of the others.
    """
    r, either, sides = pair_correlations(blocks, i, j, law)
    excess = joint_excess(a, b, r)
    if either.any():
        by_side = sum(joint_excess(a[either], b[either], side) for side in sides)
        excess[either] = 0.5 * excess[either] + 0.25 * by_side
    return excess


def least_and_greatest(blocks: Placement, law: Dependence) -> tuple[float, float]:
    """Return the minimum and maximum R of two blocks in one earthquake."""
    r, _, sides = pair_correlations(blocks, *np.triu_indices(blocks.size, 1), law)
    ways = np.concatenate([r, *sides])
    return float(ways.min(initial=1.0)), float(ways.max(initial=-1.0))


def pair_correlations(
    blocks: Placement, i: Indices, j: Indices, law: Dependence
) -> tuple[FloatArray, NDArray[np.bool_], list[FloatArray]]:
    """Return R of pairs, the pairs that may face either way, and their R for both ways.

    The first R of these is that of different components.
    """
    d_l, d_y = np.abs(blocks.l[i] - blocks.l[j]), np.abs(blocks.ln_y[i] - blocks.ln_y[j])
    site = blocks.site[i] == blocks.site[j]
    sign = (blocks.polarity[i] * blocks.polarity[j]).astype(np.float64)
    either = site & (sign == UNKNOWN)
    component = site & ~either & (blocks.component[i] == blocks.component[j])
    is_same = np.ones(int(either.sum()), dtype=np.bool_)
    scale = np.sqrt(blocks.loadings.variance)
    event, of_site, of_component = (part[i] * part[j] for part in blocks.loadings)
    apart = scale[i] * scale[j]
    shared = event + site * of_site
    sides = [
        law.of_pairs(d_l[either], d_y[either], is_same, is_same, np.full(is_same.size, side))
        for side in (-1.0, 1.0)
    ]
    r = law.of_pairs(d_l, d_y, site, component, sign) + shared + component * of_component
    completed = (shared + of_component)[either]
    return (
        np.clip(r / apart, -1.0, 1.0),
        either,
        [np.clip((side + completed) / apart[either], -1.0, 1.0) for side in sides],
    )


def checked(
    probability: ArrayLike, blocks: Placement, weights: ArrayLike | None
) -> tuple[FloatArray, FloatArray]:
    """Return P and weights of the blocks, each of shape (n,); reject invalid ones.

    Raises:
        InputError: their numbers are not that of the blocks, or a value makes no sense.
    """
    p = np.asarray(probability, dtype=np.float64)
    w = np.ones(p.shape) if weights is None else np.asarray(weights, dtype=np.float64)
    for name, part in (("probabilities", p), ("weights", w)):
        if part.shape != (blocks.size,):
            raise InputError(f"{blocks.size} blocks need as many {name}, not {part.shape}")
    if not np.all((p >= 0.0) & (p <= 1.0)):
        raise InputError("a probability of the portfolio is not between 0 and 1")
    if not np.isfinite(w).all():
        raise InputError("a weight of the portfolio is not finite")
    return p, w


def count_quantiles(n: int, mean: float, variance: float, q: ArrayLike) -> IntArray:
    """Return quantiles q of the number of failures among n blocks.

    The law is beta-binomial, of this mean and variance: ρ = 1/(α + β + 1) solves
    Var = n π(1-π)(1 + (n-1)ρ), π = mean/n. Blocks of unlike P that are nearly independent scatter
    less than a binomial number; then it is the binomial law of as many blocks as have this mean and
    variance.
    """
    from scipy.stats import binom

    share, levels = mean / max(n, 1), np.asarray(q, dtype=np.float64)
    alone = n * share * (1.0 - share)
    rho = (variance / alone - 1.0) / (n - 1.0) if n > 1 and alone > 0.0 else 0.0
    if not 0.0 < share < 1.0:
        counts = np.full(levels.shape, mean)
    elif rho > _LEAST_RHO:
        law = np.array(share), np.array(min(rho, _MOST_RHO))
        counts = beta_binomial_quantiles(n, *law, levels.ravel()).reshape(levels.shape)
    else:  # of whole blocks: the mean stays
        p = 1.0 - variance / mean
        trials = int(np.clip(np.ceil(mean / p if p > 0.0 else n), np.ceil(mean), n))
        counts = binom.ppf(levels, trials, mean / trials)
    return np.asarray(np.rint(counts), dtype=np.int64)


_LEVELS: FloatArray = (np.arange(200.0) + 0.5) / 200.0
_LEAST, _MOST = 1e-9, 1.0 - 1e-9


def shaken_share_range(
    along: FloatArray, tau: float, sigma: float, law: Shares, sites: int, level: float
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
