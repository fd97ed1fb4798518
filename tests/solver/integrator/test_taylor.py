"""The step that is written out is the series of the equation of motion."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from rbfrag.solver.integrator.state import StepExcitation
from rbfrag.solver.integrator.taylor import ORDER, lean_step, taylor_step

FloatArray = NDArray[np.float64]


def series(order: int, u0: float, ph: float, phi: float, excited: StepExcitation) -> FloatArray:
    """Coefficients of U by the recurrence in sin(phi) and cos(phi) of numerics, section 1."""
    u, s, c = np.zeros(9), np.zeros(9), np.zeros(9)
    u[0], s[0], c[0] = u0, math.sin(phi), math.cos(phi)
    for k in range(order):
        pull = excited.k_h * c[k] - excited.w * s[k]
        if k > 0:
            pull += excited.dk_h * c[k - 1] - excited.dw * s[k - 1]
        u[k + 1] = ph * ph * pull / (k + 1)
        s[k + 1] = -sum(u[j] * c[k - j] for j in range(k + 1)) / (k + 1)
        c[k + 1] = sum(u[j] * s[k - j] for j in range(k + 1)) / (k + 1)
    return u


@pytest.mark.parametrize("order", [4, 5, 6, 8])
def test_the_step_is_the_series_of_the_equation(order: int) -> None:
    rng = np.random.default_rng(order)
    u = np.empty(9)
    for _ in range(300):
        ph = 10.0 ** rng.uniform(-3.0, -0.3)
        phi, u0 = rng.uniform(-1.2, 1.5), ph * rng.normal()
        excited = StepExcitation(
            rng.normal(), 0.3 * rng.normal(), 1.0 + 0.3 * rng.normal(), 0.1 * rng.normal()
        )
        turned, u_end, v_end = taylor_step(order, u, u0, ph, math.sin(phi), math.cos(phi), excited)
        expected = series(order, u0, ph, phi, excited)
        k = np.arange(9)
        size = np.abs(expected).max()
        np.testing.assert_allclose(u, expected, rtol=1e-12, atol=1e-15 * size)
        assert turned == pytest.approx(float((expected / (k + 1)).sum()), abs=1e-14 * size)
        assert u_end == pytest.approx(float(expected.sum()), abs=1e-14 * size)
        assert v_end == pytest.approx(float((k * expected).sum()), abs=1e-13 * size)


def test_a_lean_step_leaves_out_little_however_rough_the_record() -> None:
    """The excitation may change by all of it within one step: the length alone does not tell."""
    rng = np.random.default_rng(5)
    u = np.empty(9)
    lower = 0
    for _ in range(3000):
        ph = 10.0 ** rng.uniform(-4.0, -1.6)
        phi, rate = rng.uniform(-0.3, 1.2), rng.uniform(-1.0, 1.0)
        rough = 10.0 ** rng.uniform(-4.0, 0.0)
        over = StepExcitation(
            rng.uniform(-1.2, 1.2), rough * rng.normal(), rng.uniform(0.2, 1.8),
            rough * rng.normal() * rng.integers(2),
        )  # fmt: skip
        s, c = math.sin(phi), math.cos(phi)
        turned, u_end, _ = lean_step.py_func(u, ph * rate, ph, s, c, over)
        lower += u[ORDER] == 0.0
        exact, u_exact, _ = taylor_step(ORDER, u, ph * rate, ph, s, c, over)
        assert abs(u_end - u_exact) < 6e-14 * ph + 1e-18
        assert abs(turned - exact) < 1e-15
    # it is lean as a rule
    assert lower > 1000
