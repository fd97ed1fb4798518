"""Parameter uncertainty for one block: standard error and Student t quantile of eta.

The interval of P is F(eta ± t(ν) se): se² = xᵀ V x with the slopes x of eta, and V the covariance
of the fits that each leave an earthquake out. Nothing else widens it. No library is loaded here.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache, cached_property, lru_cache
from itertools import chain, pairwise
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
        slopes, rows, node = x.slopes, self.all_steps, 0
        if x.node_weights:
            while node < len(x.node_weights) - 2 and x.node_weights[node] <= 0.0:
                node += 1
            at_nodes = (w * s for w in x.node_weights[node : node + 2] for s in x.node_slopes)
            slopes, rows = (*slopes, *at_nodes), self.steps_of_pairs[node]
        if "numpy" in sys.modules:
            # the same sums in the same order give the same bits in a third of the time
            import numpy as np

            steps = self.columns_of_pairs[node] if x.node_weights else self.matrix.T.copy()
            products = np.add.reduce(steps * np.array(slopes)[:, None])
            products *= products
            return sum(products.tolist()), sum((products * products).tolist())
        squares = _squares_of(len(slopes))(rows, *slopes)
        return sum(squares), sum(map(mul, squares, squares))

    @cached_property
    def steps_of_pairs(self) -> list[list[tuple[float, ...]]]:
        """Steps of the parameters and of the regression at two adjacent nodes, for each pair."""
        return [
            [(*d, *lower, *upper) for d, lower, upper in zip(self.steps, *both, strict=True)]
            for both in pairwise(self.node_steps)
        ]

    @cached_property
    def columns_of_pairs(self) -> Any:
        """:attr:`steps_of_pairs` by parameter, shape (pairs, parameters, G)."""
        import numpy as np

        return np.array(self.steps_of_pairs).swapaxes(1, 2).copy()

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

        forms, mixture, square_weights = self.square_forms
        k, m = len(x.slopes), len(x.node_slopes)
        nodes = [i for i, weight in enumerate(x.node_weights) if np.any(weight)]
        if len(nodes) < len(x.node_weights):  # blocks of one size lie between two nodes
            forms = forms[:, [*range(k), *(k + i * m + j for i in nodes for j in range(m))]]
        weights = [x.node_weights[i] for i in nodes]
        inputs = np.stack(np.broadcast_arrays(*x.slopes, *x.node_slopes, *weights))
        slopes, node_slopes, node_weights = np.split(inputs, (k, k + m))
        # BLAS starts threads, which wait for each other, from 2^18 multiplications of a matrix by
        # a matrix and 9216 of a vector by a matrix: as many columns at a time need fewer
        largest, ones = forms if mixture is None else mixture, np.ones(len(forms))
        size = inputs.shape[1]
        most = max(16, min(2**18 // largest.size, 9_000 // len(forms)) // 16 * 16)
        width = max(1, min(most, size))
        count = max(1, min(512, size) // width)  # so few groups at a time stay near the processor
        step = count * width
        columns = np.zeros((forms.shape[1], step))
        groups = columns.reshape(-1, count, width).swapaxes(0, 1)
        totals = np.empty((2, -(-size // step), count, width))
        for i, start in enumerate(range(0, size, step)):
            part, n = slice(start, start + step), min(step, size - start)
            columns[:k, :n] = slopes[:, part]
            at_nodes = columns[k:, :n].reshape(len(nodes), m, n)
            np.multiply(node_weights[:, None, part], node_slopes[:, part], out=at_nodes)
            squares = forms @ groups
            squares *= squares
            np.matmul(square_weights, squares, out=totals[0, i])
            if mixture is not None:
                squares = mixture @ squares
            squares *= squares
            np.matmul(ones, squares, out=totals[1, i])
        total, fourths = totals.reshape(2, -1)[:, :size]
        return total, fourths

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
    def square_forms(self) -> tuple[Any, Any, Any]:
        """Return F, B, c with Σ (x·d)² = c·s and Σ (x·d)⁴ = |B s|², s the squares of F x.

        F is the matrix D of the steps and B = 1, stated as None, unless fewer rows do. With
        D = W R, WᵀW = 1 and z = R x, Σ (x·d)² = |z|², and (x·d)² = (w·z)² is a sum over i ≤ j of
        a_ij f_ij² with f_ij = z_i + z_j, f_ii = z_i, a_ij = w_i w_j and a_ii = w_i (2 w_i - Σ w).
        F has the rows f, k(k + 1)/2 of them, and B is the triangle of A = Q B, QᵀQ = 1. Whitening
        keeps this from cancelling: |z|⁴/G ≤ Σ (x·d)⁴ ≤ |z|⁴.
        """
        import numpy as np

        i, j = np.triu_indices(self.size)
        if 2 * i.size > len(self.steps):
            return self.matrix, None, np.ones(len(self.steps))
        w, r = np.linalg.qr(self.matrix)
        is_square = (i == j)[:, None]
        pairs = np.where(is_square.T, 2.0 * w[:, i] - w.sum(axis=1)[:, None], w[:, j]) * w[:, i]
        forms = r[i] + np.where(is_square, 0.0, r[j])
        return forms, np.linalg.qr(pairs, mode="r"), 1.0 * is_square[:, 0]

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
        f"lambda rows,{slopes}: [y*y for {row}, in rows for y in [{product}]]"
    )
    return function


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
