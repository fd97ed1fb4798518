"""Parameter uncertainty for one block: standard error and Student t quantile of eta.

The interval of P is F(eta ± t(ν) se): se² = xᵀ V x with the slopes x of eta, and V the covariance
of the fits that each leave an earthquake out. Nothing else widens it. No library is loaded here.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from operator import mul
from typing import Any, NamedTuple

from rbfrag.errors import InputError
from rbfrag.fragility.dependence import normal_quantile
from rbfrag.fragility.method import ArrayNamespace

FEWEST_FREEDOMS = 2.0
"""No quantile is taken with fewer degrees of freedom."""


class Quantiles(NamedTuple):
    """Quantiles of one confidence level.

    Args:
        normal: quantile of the normal distribution.
        student: Student's quantile as a polynomial in w = 4/ν - 1, highest power first.
    """

    level: float
    normal: float
    student: tuple[float, ...]

    def student_at(self, per_freedom: Any) -> Any:
        """Return the Student t quantile at 1/ν, 0 to 1/2 (error below 1e-6 up to level .9999)."""
        w = 4.0 * per_freedom - 1.0
        value = self.student[0]
        for coefficient in self.student[1:]:
            value = value * w + coefficient
        return value


@dataclass(frozen=True)
class ParameterErrors:
    """Parameter uncertainty from leave-one-earthquake-out fits.

    Args:
        packed_covariance: V on and below its diagonal, row by row, those off it doubled.
        steps: d, the change of the parameters without each earthquake, (G, k); empty where V is
            taken for known, which gives the normal quantile.
    """

    packed_covariance: tuple[float, ...]
    steps: tuple[tuple[float, ...], ...]

    def half_width(self, x: Sequence[Any], quantiles: Quantiles, ns: ArrayNamespace) -> Any:
        """Return t(ν) se, the half width of the confidence interval of eta.

        With c_e = (x·d_e)², se² = (G-1)/G Σ c scatters like a chi-square number of
        ν = 2 (Σc)²/(Σc² - (Σc)²/G) degrees of freedom (Satterthwaite 1946, Biometrics Bulletin
        2(6), 110-114), here no fewer than 2 and no more than G - 1. A factor common to all slopes
        changes nothing in ν.

        Args:
            x: slopes of eta by the parameters, numbers or arrays.
            quantiles: of the confidence level.
        """
        g = len(self.steps)
        if not g:
            return quantiles.normal * ns.sqrt(self._variance(x, ns))
        total, squares = ns.step_sums(self, x)
        total = ns.maximum(total, 0.0)
        per_freedom = 0.5 * squares / ns.maximum(total * total, 1e-300) - 0.5 / g
        per_freedom = ns.minimum(ns.maximum(per_freedom, 1.0 / (g - 1.0)), 1.0 / FEWEST_FREEDOMS)
        return quantiles.student_at(per_freedom) * ns.sqrt(total * ((g - 1.0) / g))

    def _variance(self, x: Sequence[Any], ns: ArrayNamespace) -> Any:
        total, k = 0.0, 0
        for i, slope in enumerate(x):
            inner = self.packed_covariance[k + i] * slope
            for j in range(i):
                inner = inner + self.packed_covariance[k + j] * x[j]
            total = total + inner * slope
            k += i + 1
        return ns.maximum(total, 0.0)

    @cached_property
    def step_sums(self) -> Callable[..., tuple[float, float]]:
        """Return Σ (x·d)² and Σ (x·d)⁴ as a function of the slopes x.

        Polynomials of C(k+1, 2) and C(k+3, 4) terms, written out by Horner's rule as one
        expression: for six parameters and 47 earthquakes that takes 3 µs, a loop over the
        earthquakes 12.
        """
        columns = tuple(zip(*self.steps, strict=True))

        def written(products: Sequence[float], first: int, order: int, repeats: int) -> str:
            # `products` are those of the columns so far; the last of them came `repeats` times
            parts = []
            for i in range(first, len(columns)):
                times = repeats + 1 if i == first else 1
                # a product of n columns, of which some are equal, comes n!/(n1! n2! …) times
                more = [value * (order / times) for value in map(mul, products, columns[i])]
                inner = written(more, i, order - 1, times) if order > 1 else repr(sum(more))
                parts.append(f"x{i}*({inner})")
            return "+".join(parts)

        names = ",".join(f"x{i}" for i in range(len(columns)))
        sums = ",".join(written([1.0] * len(self.steps), 0, order, 0) for order in (2, 4))
        function: Callable[..., tuple[float, float]] = eval(f"lambda {names}: ({sums})")
        return function


def packed(covariance: Sequence[Sequence[float]]) -> tuple[float, ...]:
    """Return a covariance in the packed form of :class:`ParameterErrors`."""
    return tuple(
        float(covariance[i][j]) * (1.0 if i == j else 2.0)
        for i in range(len(covariance))
        for j in range(i + 1)
    )


# Quantiles by own code: `rbfrag predict` takes 50 ms from the shell, and loading scipy.special for
# stdtrit would add 310, loading statistics for NormalDist 11. Arrays read the same polynomial, so
# that they answer as single numbers do. The tests compare with scipy.stats.

_DEGREE = 12


def checked_level(level: object) -> float:
    """Return a valid confidence level; reject others."""
    if not isinstance(level, int | float) or not 0.0 < level < 1.0:
        raise InputError(
            f"level = {level!r}: a confidence level lies between 0 and 1, such as 0.95"
        )
    return level


@lru_cache(maxsize=256)
def quantiles_of(level: float) -> Quantiles:
    """Return the quantiles of a confidence level.

    Student's quantile is smooth in 1/ν: a polynomial through its values at Chebyshev's points
    from 1/ν = 0 to 1/2 is right to 1e-8 at level .9999, and to 1e-10 at .99.

    Raises:
        InputError: the level is not a number between 0 and 1.
    """
    normal = -normal_quantile(0.5 * (1.0 - checked_level(level)))
    n = _DEGREE + 1
    angles = [math.pi * (k + 0.5) / n for k in range(n)]
    values = [student_half_width(level, 4.0 / (math.cos(angle) + 1.0)) for angle in angles]
    total = [0.0] * n
    before, chebyshev = [0.0, 1.0], [1.0]  # T₋₁ = T₁ and T₀, lowest power first
    for j in range(n):
        weight = (1.0 if j == 0 else 2.0) / n
        scale = weight * sum(
            value * math.cos(j * angle) for value, angle in zip(values, angles, strict=True)
        )
        for power, coefficient in enumerate(chebyshev):
            total[power] += scale * coefficient
        following = [0.0, *(2.0 * coefficient for coefficient in chebyshev)]
        for power, coefficient in enumerate(before):
            following[power] -= coefficient
        before, chebyshev = chebyshev, following
    return Quantiles(level, normal, tuple(reversed(total)))


@lru_cache(maxsize=256)
def student_half_width(level: float, degrees_of_freedom: float) -> float:
    """Return t such that a Student t variable lies within ±t with probability `level`.

    Args:
        level: confidence level, between 0 and 1.
        degrees_of_freedom: ν, 2 or more.
    """
    target = 0.5 * (1.0 - checked_level(level))
    t = -normal_quantile(target)
    t *= 1.0 + (t * t + 1.0) / (4.0 * degrees_of_freedom)
    for _ in range(100):
        tail, density = _upper_tail(t, degrees_of_freedom)
        # the logarithm of the tail bends one way: Newton's steps on it end from one side
        step = tail / density * math.log(tail / target)
        t += step
        if abs(step) <= 1e-14 * t:
            break
    return t


def _upper_tail(t: float, nu: float) -> tuple[float, float]:
    """Return the upper-tail probability beyond t, and the density there.

    The tail is I_x(ν/2, 1/2)/2 with x = ν/(ν + t²) (NIST DLMF 8.17.2 and 26.7.1 of Abramowitz and
    Stegun).
    """
    log_beta = math.lgamma(0.5 * nu) + math.lgamma(0.5) - math.lgamma(0.5 * (nu + 1.0))
    density = math.exp(-0.5 * math.log(nu) - log_beta - 0.5 * (nu + 1.0) * math.log1p(t * t / nu))
    x = nu / (nu + t * t)
    if x < (0.5 * nu + 1.0) / (0.5 * nu + 2.5):
        tail = 0.5 * _incomplete_beta(0.5 * nu, 0.5, x, 1.0 - x, log_beta)
    else:
        tail = 0.5 * (1.0 - _incomplete_beta(0.5, 0.5 * nu, t * t / (nu + t * t), x, log_beta))
    return max(tail, 1e-300), density


def _incomplete_beta(a: float, b: float, x: float, rest: float, log_beta: float) -> float:
    """Return I_x(a, b) by its continued fraction (NIST DLMF 8.17.22), with Lentz's algorithm.

    Args:
        a: first parameter.
        b: second parameter.
        x: upper limit, below (a + 1)/(a + b + 2).
        rest: 1 - x.
        log_beta: ln B(a, b).
    """
    c, d = 1.0, 1.0 / (1.0 - (a + b) * x / (a + 1.0))
    value = d
    for m in range(1, 1000):
        for factor in (
            m * (b - m) * x / ((a + 2 * m - 1.0) * (a + 2 * m)),
            -(a + m) * (a + b + m) * x / ((a + 2 * m) * (a + 2 * m + 1.0)),
        ):
            d = 1.0 / (1.0 + factor * d)
            c = 1.0 + factor / c
            value *= c * d
        if abs(c * d - 1.0) < 1e-16:
            break
    return math.exp(a * math.log(x) + b * math.log(rest) - log_beta) / a * value
