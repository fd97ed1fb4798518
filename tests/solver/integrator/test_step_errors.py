"""The error estimate of a toppling run, term by term, against steps in numbers of 32 digits.

Each test fails where one of the terms that it is about is left out, or the truncation divided by
32, or the lateness of an impact by 10: `python -m benchmarks.mutations` does just that.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from numba import njit

from benchmarks.extended.double_double import Pair, add, div, mul, sine_versine, sub
from benchmarks.extended.toppling import HIGHEST, _series, _value
from rbfrag.solver.integrator.state import Corner, Peak, State, StepExcitation
from rbfrag.solver.integrator.taylor import drift_of_step, take_step
from rbfrag.solver.integrator.toppling_kernel import TrajectoryBounds, errors_after_impact
from rbfrag.solver.results import FloatArray

ORDER = 8


@njit
def exact_step(
    theta: Pair, rate: Pair, phi: Pair, ph: float, a: float, da: float, w: float, dw: float
) -> tuple[Pair, Pair, Pair, bool]:
    """Return theta, theta'/p and phi after a step, and whether the series has converged."""
    u = np.zeros((HIGHEST + 1, 2))
    s = np.zeros((HIGHEST + 1, 2))
    c = np.zeros((HIGHEST + 1, 2))
    path = np.zeros((HIGHEST + 2, 2))
    sine, versine = sine_versine(phi)
    length = (ph, 0.0)
    degree = _series(
        u, s, c, sine, sub((1.0, 0.0), versine), mul(rate, length), mul(length, length),
        (a, 0.0), (da, 0.0), (w, 0.0), (dw, 0.0), False, 1e-34,
    )  # fmt: skip
    for j in range(degree + 1):
        path[j + 1, 0], path[j + 1, 1] = div((u[j, 0], u[j, 1]), (j + 1.0, 0.0))
    turned = _value(path, degree + 2, (1.0, 0.0))
    rate_end = div(_value(u, degree + 1, (1.0, 0.0)), length)
    return add(theta, turned), rate_end, sub(phi, turned), degree < HIGHEST


@njit
def apart(a: Pair, b: Pair) -> float:
    difference = sub(a, b)
    return abs(difference[0] + difference[1])


@njit
def drawn_steps(
    rng: np.random.Generator, count: int, ph: tuple[float, float], strongest: float
) -> FloatArray:
    """Return of drawn steps error and estimate, error and drift of theta, growth and its bound."""
    u = np.zeros(9)
    rows = np.zeros((count, 6))
    for k in range(count):
        length = math.exp(rng.uniform(math.log(ph[0]), math.log(ph[1])))
        pull = math.log(strongest)
        a = rng.normal() * math.exp(rng.uniform(-7.0, pull))
        da = rng.normal() * math.exp(rng.uniform(-7.0, pull))
        if rng.random() < 0.2:
            a = 0.0
        if rng.random() < 0.2:
            da = 0.0
        w, dw = 1.0, 0.0
        if rng.random() < 0.5:
            w = rng.uniform(0.0, 3.0)
            if rng.random() < 0.5:
                dw = rng.uniform(0.0, 3.0) - w
        phi = rng.uniform(-1.5, 1.57)
        theta = rng.uniform(0.0, 1.57)
        rate = rng.normal() * math.exp(rng.uniform(-18.0, 1.0))
        # small angles and blocks that hardly move leave one term or another alone
        if rng.random() < 0.2:
            rate = 0.0
        if rng.random() < 0.3:
            phi = math.exp(rng.uniform(-18.0, 0.0))
        if rng.random() < 0.3:
            theta = math.exp(rng.uniform(-18.0, 0.0))
        if rng.random() < 0.1:
            a, da = 1e-3 * a, 1e-3 * da
        state = State(theta, rate, math.sin(phi), math.cos(phi))
        step = take_step(ORDER, u, length, state, StepExcitation(a, da, w, dw))
        start = ((theta, 0.0), (rate, 0.0), (phi, 0.0))
        theta_end, rate_end, _, converged = exact_step(
            start[0], start[1], start[2], length, a, da, w, dw
        )
        if not converged or apart(theta_end, start[0]) > 0.5:
            continue
        off = apart(theta_end, (step.theta, 0.0))
        rows[k, 0] = off + apart(rate_end, (step.u_end / length, 0.0))
        rows[k, 1] = step.truncation + step.rounding
        rows[k, 2] = off
        rows[k, 3] = drift_of_step(length, rows[k, 1], step.theta)
        # a start that is wrong in theta (which moves phi the other way), or in theta'/p
        wrong = 1e-9
        in_theta = rng.random() < 0.5
        moved, faster = (wrong, 0.0) if in_theta else (0.0, wrong)
        theta_off, rate_off, _, _ = exact_step(
            add(start[0], (moved, 0.0)), add(start[1], (faster, 0.0)), sub(start[2], (moved, 0.0)),
            length, a, da, w, dw,
        )  # fmt: skip
        grown = apart(theta_end, theta_off) + apart(rate_end, rate_off)
        rows[k, 4] = grown / wrong - 1.0
        rows[k, 5] = math.expm1(step.growth)
    return rows


REGIMES = (((1e-4, 0.03), 2.0), ((0.01, 0.03), 50.0), ((0.03, 0.2), 5.0))
"""p·h, and how strong the excitation is at most [g]: as used, under blasts, and beyond."""


@pytest.fixture(scope="module")
def steps() -> FloatArray:
    rng = np.random.default_rng(1)
    rows = [drawn_steps(rng, 60_000, ph, most) for ph, most in REGIMES]
    return np.concatenate(rows)


def test_no_step_adds_more_than_its_estimate(steps: FloatArray) -> None:
    error, estimate = steps[:, 0], steps[:, 1]
    assert (error > 0.0).sum() > 100_000
    assert (error <= estimate).all(), (error / estimate).max()


def test_an_estimate_is_no_alarm(steps: FloatArray) -> None:
    # that an estimate bounds is worth nothing where it is far too large
    expected = steps[steps[:, 0] > 0.0]
    assert np.median(expected[:, 1] / expected[:, 0]) < 100.0


def test_theta_drifts_by_no_more_than_its_own_bound(steps: FloatArray) -> None:
    assert (steps[:, 2] <= steps[:, 3]).all()


def test_an_error_grows_no_faster_than_its_bound(steps: FloatArray) -> None:
    # as used; the bound is that of the angle at the start of the step, which moves meanwhile
    used = steps[: steps.shape[0] // len(REGIMES)]
    assert (used[:, 4] <= 1.1 * used[:, 5] + 1e-9).all()


@pytest.mark.parametrize("order", [4, 5, 6])
def test_drift_holds_a_wrong_rate(order: int) -> None:
    # theta'/p wrong by e for a step of p·h turns theta by p·h e
    assert drift_of_step(0.01 * order, 1e-6, 0.0) >= 0.01 * order * 1e-6


CORNER = Corner(0.2, math.atan(0.2), math.sin(math.atan(0.2)), math.cos(math.atan(0.2)), 1.0, 0.0)


def through(
    impact: float, threshold: float, drift: float, error: float = 0.0
) -> tuple[TrajectoryBounds, bool]:
    bounds = TrajectoryBounds(error, drift, Peak(0.0, 0.0))
    after, hidden = errors_after_impact(bounds, -impact, threshold, CORNER)
    return TrajectoryBounds(*after), hidden


@pytest.mark.parametrize("impact", [1e-3, 1e-2, 0.3])
@pytest.mark.parametrize("threshold", [0.01, 0.2, 2.0])
@pytest.mark.parametrize("drift", [1e-13, 1e-9, 2e-7])
def test_a_late_impact_starts_a_late_motion(impact: float, threshold: float, drift: float) -> None:
    push = threshold * CORNER.cos
    expected, hidden = through(impact, threshold, drift)
    assert not hidden
    if impact * impact <= 4.0 * push * drift:
        return  # a graze, which has a test of its own
    # theta = drift - v t + push t²/2 in units of 1/p: when a block that is too high comes to rest
    late = 2.0 * drift / (impact + math.sqrt(impact * impact - 2.0 * push * drift))
    # by then the other one has started from rest
    assert expected.error >= push * late + 0.5 * push * late**2
    assert expected.drift >= 0.5 * push * late**2
    # and not by more than some times that
    assert expected.error <= 5.0 * push * late


@pytest.mark.parametrize("impact", [0.0, 1e-7, 1e-5])
@pytest.mark.parametrize("threshold", [0.0, 0.3])
def test_a_graze_may_be_none(impact: float, threshold: float) -> None:
    drift = 1e-9
    push = threshold * CORNER.cos
    expected, hidden = through(impact, threshold, drift, error=0.6 * impact)
    # the block loses its speed where it touches; lower by `drift`, it would have touched with
    # sqrt(v² + 2 push drift), and one that is higher keeps its own
    assert expected.error >= 0.6 * impact + math.sqrt(impact * impact + 2.0 * push * drift)
    assert expected.error > 0.0 or impact == threshold == 0.0
    assert not hidden


def test_a_graze_that_hides_what_follows_is_told() -> None:
    assert through(0.05, 0.0, 1e-3, error=0.05)[1]
    assert not through(0.01, 0.0, 1e-3, error=0.01)[1]


@pytest.mark.parametrize("slower", [1.0, 1e-3, 1e-6])
def test_a_block_that_may_not_touch_is_no_later_than_never(slower: float) -> None:
    # higher by `drift` it turns above its base where v² < 2 push drift: it then keeps a speed of v,
    # which one that touches loses. What is not late has no lateness, which grows as 1/v
    drift, threshold = 1e-9, 1.0
    most = math.sqrt(2.0 * threshold * CORNER.cos * drift)
    impact = slower * most * (1.0 - 1e-9)
    expected, _ = through(impact, threshold, drift)
    assert impact <= expected.error <= 3.0 * most


def test_an_impact_that_ends_in_rest_ends_the_error() -> None:
    expected, hidden = through(0.1, -0.2, 1e-9, error=1e-9)
    assert (expected.error, expected.drift, hidden) == (0.0, 0.0, False)
