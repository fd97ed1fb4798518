"""The package's own tangent against exact arithmetic, and the same bits in arrays."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest

from rbfrag.solver.block.formulas import SCALAR, array_elementwise, cot_deg, tan_deg

PI = Fraction("3.14159265358979323846264338327950288419716939937510582097494459")


def exact_tangent(angle_deg: float) -> Fraction:
    """Sine over cosine by their series, in fractions of some sixty digits."""
    y = Fraction(angle_deg) * PI / 180
    y = Fraction(round(y * 10**60), 10**60)
    term, sine, cosine = Fraction(1), Fraction(0), Fraction(1)
    for n in range(1, 60):
        term = Fraction(round(term * y / n * 10**60), 10**60)
        sign = -1 if n % 4 in (2, 3) else 1
        if n % 2:
            sine += sign * term
        else:
            cosine += sign * term
    return sine / cosine


def angles() -> list[float]:
    random = np.random.default_rng(3)
    subset = [*random.uniform(-90.0, 90.0, 300), *10.0 ** random.uniform(-8.0, 1.9, 100)]
    edges = [0.0, 45.0, -45.0, 30.0, 60.0, 89.999999, -89.9, math.nextafter(45.0, 90.0)]
    return [*map(float, subset), *edges]


def test_tangent_is_right_to_rounding() -> None:
    for angle in angles():
        exact = exact_tangent(angle)
        result = tan_deg(angle, SCALAR)
        assert abs(Fraction(result) - exact) <= Fraction(3 * math.ulp(float(exact))), angle


def test_cotangent_is_right_to_rounding() -> None:
    for angle in angles():
        if angle > 1e-7:
            exact = 1 / exact_tangent(angle)
            for sign, gamma in ((1, angle), (-1, 180.0 - angle)):
                if gamma > 90.0 and 180.0 - gamma != angle:
                    continue
                result = sign * Fraction(cot_deg(gamma, SCALAR))
                assert abs(result - exact) <= Fraction(3 * math.ulp(float(exact))), gamma


def test_symmetry_is_exact() -> None:
    for angle in angles():
        assert tan_deg(-angle, SCALAR) == -tan_deg(angle, SCALAR)
    assert cot_deg(90.0, SCALAR) == 0.0
    assert tan_deg(0.0, SCALAR) == 0.0


def test_arrays_have_the_same_bits() -> None:
    inputs = np.array(angles())
    functions = array_elementwise()
    assert tan_deg(inputs, functions).tolist() == [tan_deg(a, SCALAR) for a in inputs.tolist()]
    gammas = np.abs(inputs) + 0.1
    assert cot_deg(gammas, functions).tolist() == [cot_deg(g, SCALAR) for g in gammas.tolist()]
    with np.errstate(invalid="raise"):
        assert np.isnan(tan_deg(np.array([math.nan]), functions)).all()


@pytest.mark.parametrize("angle", [15.0, 36.0, 75.0])
def test_known_tangents(angle: float) -> None:
    expected = {15.0: 2.0 - 3.0**0.5, 36.0: (5.0 - 2.0 * 5.0**0.5) ** 0.5, 75.0: 2.0 + 3.0**0.5}
    assert tan_deg(angle, SCALAR) == pytest.approx(expected[angle], rel=1e-15)
