"""Distribution of the block-relative spectral velocity where spectral accelerations are lognormal.

The ordinates V(T) = SA(T) g T/2π are interpolated: ln V is linear in ln T and constant beyond the
first and last period. With p of the block, the velocity of toppling is the cubic mean

    X = [mean of (V φ)³]^(1/3),   φ = x/√(1 + x²),   x = 1.4·2π/(p T),

over 60 periods from 0.1 to 10 s, and that of rocking, A, is the geometric mean of V over 24 periods
from 0.25 to 2 times 2π/p, limited to 0.1 to 10 s. To first order (ln A: exactly) their logarithms
are weighted means of ln V of the ordinates, and have the variance Σ w_i w_j σ_i σ_j ρ_ij.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from rbfrag.fragility.completion import UNCERTAIN_VELOCITY
from rbfrag.fragility.correlation import correlation, nearest_correlation
from rbfrag.fragility.measures import SIGMAS
from rbfrag.fragility.method import Velocity
from rbfrag.fragility.model import FragilityModel
from rbfrag.fragility.spectral_velocity import (
    LONGEST_S,
    PGA_PERIOD_S,
    SHORTEST_S,
    ln_rocking_velocity,
    ln_toppling_velocity,
)
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.solver.results import FloatArray
from rbfrag.vocabulary.spectral import period_of, spectral_name

_TOPPLING_PERIODS_S = SHORTEST_S * 100.0 ** (np.arange(60) / 59.0)
_ROCKING_RATIOS = 0.25 * 8.0 ** (np.arange(24) / 23.0)

_JENSEN = 1.1
"""Rise of the median of ln X per difference between mean and resulting variance, simulated."""


class VelocityMoments(NamedTuple):
    """Lognormal distribution of a block-relative spectral velocity; arrays, one for each block.

    Args:
        ln_median: logarithm of its median [m/s].
        sigma: standard deviation of its logarithm.
        pgv_correlation: correlation of its logarithm with ln PGV.
        pga_correlation: the same with ln PGA.
    """

    ln_median: FloatArray
    sigma: FloatArray
    pgv_correlation: FloatArray
    pga_correlation: FloatArray


class _Ordinates(NamedTuple):
    """Ordinates of a spectrum by rising period; ln V and σ have the shape (…, ordinates)."""

    names: tuple[str, ...]
    periods_s: FloatArray
    ln_velocity: FloatArray
    sigma: FloatArray

    @classmethod
    def of(
        cls,
        sa_g: Mapping[float, ArrayLike],
        sa_sigma: Mapping[float, ArrayLike],
        pga_g: ArrayLike | None,
        pga_sigma: ArrayLike,
    ) -> _Ordinates:
        """Return the ordinates, with PGA at 0.03 s unless SA(0.03 s) is one of them."""
        rows = {
            max(period_s, PGA_PERIOD_S): (spectral_name(period_s), value, sa_sigma.get(period_s, 0))
            for period_s, value in sorted(sa_g.items())
            if period_s <= LONGEST_S
        }
        if pga_g is not None:
            rows.setdefault(PGA_PERIOD_S, ("pga_g", pga_g, pga_sigma))
        periods_s = np.array(sorted(rows))
        names, medians, sigmas = zip(*(rows[period_s] for period_s in periods_s), strict=True)
        numbers = [np.asarray(x, np.float64) for x in (*medians, *sigmas)]
        sa, sigma = np.split(np.stack(np.broadcast_arrays(*numbers), axis=-1), 2, axis=-1)
        ln_velocity = np.log(sa * (STANDARD_GRAVITY_M_S2 * periods_s / (2.0 * math.pi)))
        return cls(names, periods_s, ln_velocity, sigma)

    def moments(self, weights: FloatArray, ln_median: FloatArray) -> VelocityMoments:
        """Return the moments of Σ w ln V about this median."""
        parts = weights * self.sigma
        rho, with_pgv, with_pga = (
            np.array([[correlation(name, other) for other in self.names] for name in names])
            for names in (self.names, ("pgv_m_s",), ("pga_g",))
        )
        sigma = np.sqrt(((parts @ rho) * parts).sum(axis=-1))
        scale = 1.0 / np.where(sigma > 0.0, sigma, np.inf)
        return VelocityMoments(
            ln_median, sigma, (parts @ with_pgv[0]) * scale, (parts @ with_pga[0]) * scale
        )


def toppling_moments(
    p: ArrayLike,
    sa_g: Mapping[float, ArrayLike],
    sa_sigma: Mapping[float, ArrayLike],
    pga_g: ArrayLike | None = None,
    pga_sigma: ArrayLike = 0.0,
) -> VelocityMoments:
    """Return the distribution of X of each block.

    The weights of the ordinates are the fractions of the cubic mean at the median spectrum. The
    median exceeds X of the median spectrum, because the cubic mean is convex in ln V.

    Args:
        p: square root of the frequency parameter [1/s], a number or shape (n,).
        sa_g: medians of the spectral accelerations [g] by period [s], numbers or shape (n,);
            periods above 10 s are ignored.
        sa_sigma: standard deviations of their logarithms, likewise.
        pga_g: median of PGA [g], the ordinate at 0.03 s where SA(0.03 s) is not given.
        pga_sigma: standard deviation of its logarithm.
    """
    ordinates = _Ordinates.of(sa_g, sa_sigma, pga_g, pga_sigma)
    interpolation = toppling_weights(ordinates.periods_s)
    x = 1.4 * 2.0 * math.pi / (np.asarray(p, np.float64)[..., None] * _TOPPLING_PERIODS_S)
    cubes = (np.exp(ordinates.ln_velocity @ interpolation.T) * x / np.sqrt(1.0 + x * x)) ** 3
    weights = cubes / cubes.sum(axis=-1, keepdims=True) @ interpolation
    result = ordinates.moments(weights, np.log(cubes.mean(axis=-1)) / 3.0)
    spread = (weights * ordinates.sigma**2).sum(axis=-1) - result.sigma**2
    return result._replace(ln_median=result.ln_median + _JENSEN * spread)


def rocking_moments(
    p: ArrayLike,
    sa_g: Mapping[float, ArrayLike],
    sa_sigma: Mapping[float, ArrayLike],
    pga_g: ArrayLike | None = None,
    pga_sigma: ArrayLike = 0.0,
) -> VelocityMoments:
    """Return the distribution of A of each block; arguments as for :func:`toppling_moments`."""
    ordinates = _Ordinates.of(sa_g, sa_sigma, pga_g, pga_sigma)
    weights = rocking_weights(p, ordinates.periods_s)
    return ordinates.moments(weights, (weights * ordinates.ln_velocity).sum(axis=-1))


_MOMENTS: Mapping[Velocity, Callable[..., VelocityMoments]] = {
    ln_toppling_velocity: toppling_moments,
    ln_rocking_velocity: rocking_moments,
}

_AT_ONCE = 1 << 14


def correlated_moments(
    model: FragilityModel, names: Sequence[str], inputs: Mapping[str, Any]
) -> dict[str, Any]:
    """Return the spectral velocity of uncertain ordinates, its standard deviation, and its
    correlation with other measures, as inputs of a question.

    Where the correlations of PGV, PGA and the velocity do not form a positive definite matrix, the
    nearest one takes their place.

    Args:
        model: the model that answers, completed for the inputs.
        names: the other measures that scatter, among PGV and PGA.
        inputs: the question, numbers or arrays of one size.
    """
    assert model.form.velocity is not None
    used, moments_of = model.term.inputs, _MOMENTS[model.form.velocity.ln_velocity]
    spectrum = [name for name in used if period_of(name) is not None]
    read = [*spectrum, *(SIGMAS[name] for name in spectrum), "pga_g", "pga_sigma"]
    columns = {name: np.atleast_1d(inputs[name]) for name in read if name in inputs}
    columns["p"] = np.sqrt(np.atleast_1d(inputs[str(model.method.block.size)]))
    columns = dict(zip(columns, np.broadcast_arrays(*columns.values()), strict=True))
    parts = []
    with np.errstate(divide="ignore", invalid="ignore"):
        for start in range(0, columns["p"].size, _AT_ONCE):
            part = {name: column[start : start + _AT_ONCE] for name, column in columns.items()}
            sa = {float(period_of(name) or 0.0): part[name] for name in spectrum}
            sigma = {
                float(period_of(name) or 0.0): part.get(SIGMAS[name], 0.0) for name in spectrum
            }
            pga = part.get("pga_g") if "pga_g" in used else None
            parts.append(moments_of(part["p"], sa, sigma, pga, part.get("pga_sigma", 0.0)))
    median, sigma_ln, with_pgv, with_pga = (
        np.concatenate(column) for column in zip(*parts, strict=True)
    )
    pairs = {"pgv_m_s": with_pgv, "pga_g": with_pga}
    order = [*names, UNCERTAIN_VELOCITY]
    matrix = np.empty((median.size, len(order), len(order)))
    for i, first in enumerate(order):
        for j, other in enumerate(order):
            if UNCERTAIN_VELOCITY not in (first, other):
                matrix[:, i, j] = correlation(first, other)
            else:
                matrix[:, i, j] = 1.0 if first == other else pairs[other if i > j else first]
    matrix = nearest_correlation(matrix)
    result = {UNCERTAIN_VELOCITY: np.exp(median), f"{UNCERTAIN_VELOCITY}_sigma": sigma_ln}
    for i, j in combinations(range(len(order)), 2):
        result[f"{order[i]} {order[j]}"] = matrix[:, i, j]
    is_single = all(np.ndim(value) == 0 for value in inputs.values())
    return {n: float(value[0]) if is_single else value for n, value in result.items()}


def toppling_weights(periods_s: FloatArray) -> FloatArray:
    """Return the weight of each ordinate in ln V at each period of X, shape (60, ordinates).

    Args:
        periods_s: rising periods [s] of the ordinates.
    """
    return np.stack([*_weights(_TOPPLING_PERIODS_S, periods_s)], axis=-1)


def rocking_weights(p: ArrayLike, periods_s: FloatArray) -> FloatArray:
    """Return the weight of each ordinate in ln A of each block, shape (…, ordinates).

    Args:
        p: square root of the frequency parameter [1/s], shape (…).
        periods_s: rising periods [s] of the ordinates.
    """
    points_s = _ROCKING_RATIOS * (2.0 * math.pi / np.asarray(p, np.float64)[..., None])
    points_s = np.clip(points_s, SHORTEST_S, LONGEST_S)
    # averaged one ordinate at a time: all at once would take 3 kB for each block
    return np.stack([row.mean(axis=-1) for row in _weights(points_s, periods_s)], axis=-1)


def _weights(points_s: FloatArray, periods_s: FloatArray) -> Iterator[FloatArray]:
    """Yield the weight of each ordinate in the interpolated ln V at some periods."""
    points, nodes = np.log(points_s), np.log(periods_s)
    for unit in np.eye(nodes.size):
        yield np.interp(points, nodes, unit)
