"""Parameter uncertainty for one block: standard error and Student t quantile of eta.

The interval of P is F(eta ± t(ν) se): se² = xᵀ V x with the slopes x of eta, and V the covariance
of the fits that each leave an earthquake out. Nothing else widens it. No library is loaded here.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache, cached_property, lru_cache
from itertools import chain
from operator import mul
from typing import Any, NamedTuple

from rbfrag.errors import InputError
from rbfrag.fragility.dependence import normal_quantile
from rbfrag.fragility.method import ArrayNamespace, LinearPredictor

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
        node_steps: the same of the coefficients and the scatter of a regression, for each of its
            sizes (G, m); empty for none.
    """

    packed_covariance: tuple[float, ...]
    steps: tuple[tuple[float, ...], ...]
    node_steps: tuple[tuple[tuple[float, ...], ...], ...] = ()

    @property
    def size(self) -> int:
        """Number of parameters, with those of the regression at each of its sizes."""
        of_one = (math.isqrt(8 * len(self.packed_covariance) + 1) - 1) // 2
        return of_one + sum(len(steps[0]) for steps in self.node_steps)

    def half_width(self, x: LinearPredictor, quantiles: Quantiles, ns: ArrayNamespace) -> Any:
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
            variance, k = 0.0, 0
            for i, slope in enumerate(x.slopes):
                inner = self.packed_covariance[k + i] * slope
                for j in range(i):
                    inner = inner + self.packed_covariance[k + j] * x.slopes[j]
                variance = variance + inner * slope
                k += i + 1
            return quantiles.normal * ns.sqrt(ns.maximum(variance, 0.0))
        total, squares = ns.step_sums(self, x)
        total = ns.maximum(total, 0.0)
        per_freedom = 0.5 * squares / ns.maximum(total * total, 1e-300) - 0.5 / g
        per_freedom = ns.minimum(ns.maximum(per_freedom, 1.0 / (g - 1.0)), 1.0 / FEWEST_FREEDOMS)
        return quantiles.student_at(per_freedom) * ns.sqrt(total * ((g - 1.0) / g))

    def sums_of_number(self, x: LinearPredictor) -> tuple[float, float]:
        """Return Σ (x·d)² and Σ (x·d)⁴ of single slopes x."""
        if not self.node_steps and len(x.slopes) == len(self.steps[0]):
            return self.step_sums(*x.slopes)
        slopes = (*x.slopes, *x.node_slopes) if x.node_weights else x.slopes
        rows = self.steps_at(x.node_weights) if x.node_weights else self.all_steps
        squares = _squares_of(len(slopes))(rows, *slopes)
        return sum(squares), sum(map(mul, squares, squares))

    def steps_at(self, weights: tuple[float, ...]) -> list[tuple[float, ...]]:
        """Return the steps of parameters and regression at one size, from the weights of nodes."""
        if self.last.get("weights") != weights:
            nodes = [(w, steps) for w, steps in zip(weights, self.node_steps, strict=True) if w]
            regression = [
                tuple(sum(w * steps[e][i] for w, steps in nodes) for i in range(len(row)))
                for e, row in enumerate(self.node_steps[0])
            ]
            rows = [(*d, *w) for d, w in zip(self.steps, regression, strict=True)]
            self.last.update(weights=weights, rows=rows)
        return list(self.last["rows"])

    @cached_property
    def last(self) -> dict[str, Any]:
        """The last answer of :meth:`steps_at`: many questions are about one block."""
        return {}

    @cached_property
    def all_steps(self) -> list[tuple[float, ...]]:
        """Return the steps of the parameters and of the regression at each node, a line each."""
        return [
            tuple(chain(d, *(steps[e] for steps in self.node_steps)))
            for e, d in enumerate(self.steps)
        ]

    def sums_of_arrays(self, x: LinearPredictor) -> tuple[Any, Any]:
        """Return Σ (x·d)² and Σ (x·d)⁴ of slopes x that are arrays."""
        import numpy as np

        k, columns = len(x.slopes), np.broadcast_arrays(*x.slopes, *x.node_slopes, *x.node_weights)
        steps = self.matrix
        if not x.node_weights:
            return _sums(steps[:, :k], np.stack(columns))
        # only two nodes have a weight: blocks between the same two are worked on together
        slopes, weights = (
            np.stack(columns[: -len(x.node_weights)]),
            np.stack(columns[-len(x.node_weights) :]),
        )
        m, size = len(x.node_slopes), slopes.shape[1]
        first = np.minimum(np.argmax(weights > 0.0, axis=0), len(weights) - 2)
        totals = np.empty((2, size))
        for node in np.unique(first):
            chosen = np.flatnonzero(first == node) if (first != node).any() else slice(None)
            part, at = slopes[:, chosen], weights[node : node + 2, None, chosen]
            both = (at * part[k:]).reshape(2 * m, -1)
            start = k + node * m
            these = np.hstack([steps[:, :k], steps[:, start : start + 2 * m]])
            totals[:, chosen] = _sums(these, np.concatenate([part[:k], both]))
        return totals[0], totals[1]

    def covariance_times(self, gradient: Any) -> Any:
        """Return V g, V of the parameters and the regression at each node, shape (k,).

        Args:
            gradient: g, shape (k,).
        """
        import numpy as np

        if self.steps:
            g = len(self.steps)
            return (g - 1.0) / g * (self.matrix.T @ (self.matrix @ gradient))
        lower = np.zeros((gradient.size, gradient.size))
        lower[np.tril_indices(gradient.size)] = self.packed_covariance
        return 0.5 * (lower + lower.T) @ gradient + 0.5 * np.diag(lower) * gradient

    @cached_property
    def matrix(self) -> Any:
        """Return :attr:`all_steps` as an array."""
        import numpy as np

        return np.array(self.all_steps)

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


@cache
def _squares_of(size: int) -> Callable[..., list[float]]:
    """Return (x·d)² of rows d as a function of the rows and the slopes x, written out: in half the
    time of sums of products.
    """
    slopes, row = (",".join(f"{name}{i}" for i in range(size)) for name in ("x", "d"))
    product = "+".join(f"x{i}*d{i}" for i in range(size))
    function: Callable[..., list[float]] = eval(
        f"lambda rows,{slopes}: [({product})**2 for {row}, in rows]"
    )
    return function


def _sums(steps: Any, columns: Any) -> tuple[Any, Any]:
    """Return Σ (x·d)² and Σ (x·d)⁴ over the rows d of `steps`, of the columns x."""
    import numpy as np

    # more terms than earthquakes: here the products are faster than the polynomials
    total, fourths = np.empty((2, columns.shape[1]))
    # so few at a time stay near the processor, and BLAS starts no threads of its own
    for start in range(0, columns.shape[1], 512):
        part = slice(start, start + 512)
        squares = steps @ columns[:, part]
        squares *= squares
        np.add.reduce(squares, axis=0, out=total[part])
        squares *= squares
        np.add.reduce(squares, axis=0, out=fourths[part])
    return total, fourths


def packed(covariance: Sequence[Sequence[float]]) -> tuple[float, ...]:
    """Return a covariance in the packed form of :class:`ParameterErrors`."""
    return tuple(
        float(covariance[i][j]) * (1.0 if i == j else 2.0)
        for i in range(len(covariance))
        for j in range(i + 1)
    )


# `rbfrag predict` takes 50 ms from the shell; to load scipy.special for stdtrit would add 310.
_DEGREE = 12
_STUDENT = {
    0.9: (
        -2.3844939697972645e-08, -3.387724343785801e-08, 3.133597794238505e-07,
        -5.216341666989767e-07, 9.339697070432663e-08, 5.472550400808221e-06,
        1.794445874791196e-05, 0.00031746260316613587, 0.003070203404707633,
        0.02471939136287874, 0.14748428655395598, 0.6125242056890943, 2.131846786326649,
    ),
    0.95: (
        -5.8653479475022045e-08, -3.6280880522099324e-09, 5.182674665495422e-07,
        -8.493354772991342e-07, 1.4081027571294796e-06, 2.3455152912150042e-05,
        0.00018352602534959646, 0.0015801782466254256, 0.011896164942025193,
        0.07476688275393431, 0.34278169326718755, 1.0949747094035325, 2.77644510519779,
    ),
    0.99: (
        -1.8281973377899985e-07, -1.96089698734935e-07, 2.891833542679916e-06,
        1.4449924356960346e-05, 8.027252836812366e-05, 0.0006907184015814823,
        0.004825543553736203, 0.02601085580065561, 0.12456944255937781,
        0.5038776666364793, 1.5167634132376027, 3.143913453970899, 4.604094871349986,
    ),
}  # fmt: skip
"""Student's quantile at the usual levels, as :func:`quantiles_of` fits it."""


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
    tail = 0.5 * (1.0 - checked_level(level))
    student = _STUDENT.get(level)
    if student is None:
        from numpy.polynomial import chebyshev
        from scipy.special import stdtrit

        def student_at(w: Any) -> Any:
            return -stdtrit(4.0 / (w + 1.0), tail)

        fitted: Any = chebyshev.chebinterpolate(student_at, _DEGREE)
        student = tuple(chebyshev.cheb2poly(fitted)[::-1].tolist())
    return Quantiles(level, -normal_quantile(tail), student)
