"""Where an arc comes down: Newton's method from the first terms against extended precision."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numba import njit
from numpy.typing import NDArray

from rbfrag.solver.integrator.events import examine_descent, keeps_direction, landing
from rbfrag.solver.integrator.state import StepExcitation
from rbfrag.solver.integrator.taylor import taylor_step

FloatArray = NDArray[np.float64]
descend = njit(examine_descent.py_func)

EPSILON = float(np.finfo(float).eps)


def arcs(order: int, number: int) -> list[tuple[float, FloatArray, tuple[float, float, float]]]:
    """Steps that come down once: rotation at the start, U, and theta, U and U' at the end."""
    rng = np.random.default_rng(order)
    values = []
    while len(values) < number:
        ph = 10.0 ** rng.uniform(-3.0, math.log10(0.03))
        phi = rng.uniform(0.01, 0.6)
        theta = 0.0 if rng.random() < 0.5 else ph * ph * 10.0 ** rng.uniform(-6.0, 1.0)
        u0 = ph * ph * rng.choice([-1.0, 1.0]) * 10.0 ** rng.uniform(-6.0, 1.0)
        excited = StepExcitation(rng.normal(), rng.normal(), 1.0 + 0.2 * rng.normal(), 0.0)
        u = np.empty(9)
        turned, u_end, v_end = taylor_step(order, u, u0, ph, math.sin(phi), math.cos(phi), excited)
        rounds = u0 > 0.0 and u[1] < 0.0 and v_end < 0.0
        falls = theta > 0.0 and u0 < 0.0 and keeps_direction(u0, u[1], u_end, v_end)
        if theta + turned <= 0.0 and (rounds or falls):
            values.append((theta, u, (theta + turned, u_end, v_end)))
    return values


@pytest.mark.parametrize("order", [4, 6, 8])
def test_a_landing_is_a_root_to_rounding(order: int) -> None:
    for theta, u, _ in arcs(order, 600):
        at, rate = landing(theta, u, order)
        assert 0.0 < at <= 1.0
        tau = np.longdouble(at)
        terms = [np.longdouble(u[k]) * tau ** (k + 1) / (k + 1) for k in range(order + 1)]
        size = theta + float(sum(map(abs, terms)))
        assert abs(float(theta + sum(terms))) <= 8.0 * EPSILON * size
        rates = [np.longdouble(u[k]) * tau**k for k in range(order + 1)]
        assert rate < 0.0
        assert abs(rate - float(sum(rates))) <= 8.0 * EPSILON * float(sum(map(abs, rates)))


def test_the_peak_of_an_arc_is_given_where_it_counts() -> None:
    seen = 0
    for theta, u, end in arcs(8, 300):
        every = descend(theta, u, 8, *end, -1.0)
        assert every.impact > 0.0
        if u[0] < 0.0:
            assert every.peak == -1.0
            continue
        seen += 1
        tau = np.linspace(0.0, every.impact, 2001)
        path = theta + sum(u[k] * tau ** (k + 1) / (k + 1) for k in range(9))
        assert path.max() <= every.peak * (1.0 + 1e-14)
        assert every.peak == pytest.approx(path.max(), rel=1e-5)
        above = descend(theta, u, 8, *end, 0.9 * every.peak)
        beneath = descend(theta, u, 8, *end, theta + u[0])
        assert above == every
        assert (beneath.impact, beneath.peak) == (every.impact, -1.0)
    assert seen > 100
