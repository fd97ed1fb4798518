"""Several samples in one step: the same motion as one by one, and what the cubics miss."""

from __future__ import annotations

import math

import numpy as np
import pytest

from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.solver.excitation import Excitation, excitation
from rbfrag.solver.integrator.block_excitation import COLUMNS, fill_spans, span_step
from rbfrag.solver.integrator.state import StepExcitation
from rbfrag.solver.integrator.taylor import ORDER, taylor_step, turn
from tests.solver.search.test_critical import shaking

START = (0.3, 0.12, -0.2)
"""Critical angle, rotation and theta'/p at the start of a trajectory."""


def integrated(
    excited: Excitation, p: float, length: int, nodes: int, rows: int = 0
) -> tuple[float, float]:
    """Rotation and theta'/p after `nodes` intervals, by spans of `length` or by single steps."""
    critical, theta, rate = START
    s, c = math.sin(critical - theta), math.cos(critical - theta)
    table = np.empty((nodes // max(length, 1), COLUMNS))
    if length:
        fill_spans(excited.interval_s, excited.k_h, excited.w, length, table)
    u = np.empty(9)
    for i in range(nodes // max(length, 1)):
        if length:
            ph = p * float(table[i, 0])
            turned, u_end = span_step(table, i, ph * rate, ph, s, c)
        else:
            ph = p * float(excited.interval_s[i])
            a, w = excited.k_h, excited.w
            over = StepExcitation(a[i], a[i + 1] - a[i], w[i], w[i + 1] - w[i])
            turned, u_end, _ = taylor_step(ORDER, u, ph * rate, ph, s, c, over)
        theta += turned
        rate = u_end / ph
        s, c = turn(s, c, turned)
    return theta, rate


@pytest.mark.parametrize("with_vertical", [False, True])
@pytest.mark.parametrize("length", [2, 8, 32])
def test_spans_fly_as_single_steps_do(length: int, with_vertical: bool) -> None:
    vertical = shaking(8, npts=600, pga_g=0.4) if with_vertical else None
    excited = excitation(shaking(7, npts=600), vertical)
    for ph, error in ((0.04, 3e-8), (0.01, 3e-11)):
        p = ph / (length * 0.01)
        exact = integrated(excited, p, 0, 512)
        spanned = integrated(excited, p, length, 512)
        assert abs(exact[0] - spanned[0]) + abs(exact[1] - spanned[1]) < error


def test_what_the_cubics_miss_is_taken_into_account() -> None:
    excited = excitation(shaking(7, npts=600))
    length, p = 32, 0.0125 / 0.32
    exact = integrated(excited, p, 0, 512)
    table = np.empty((16, COLUMNS))
    fill_spans(excited.interval_s, excited.k_h, excited.w, length, table)
    # for a cubic excitation nothing is missed
    t = np.linspace(0.0, 1.0, 33)
    smooth = excitation(GroundMotion(0.3 + 0.4 * t, 0.01))
    plain = np.empty((1, COLUMNS))
    fill_spans(smooth.interval_s, smooth.k_h, smooth.w, length, plain)
    assert np.abs(plain[0, 10:18]).max() < 1e-15
    assert plain[0, 18] < 1e-14
    np.testing.assert_allclose(plain[0, 2:10], [0.3, 0.4, 0, 0, 1, 0, 0, 0], atol=1e-13)
    assert np.abs(table[:, 10]).max() > 1e-7
    spanned = integrated(excited, p, length, 512)
    assert abs(exact[0] - spanned[0]) < 1e-10


def test_jumps_inside_a_span_are_exact_in_the_mean() -> None:
    times = np.repeat(np.arange(9) * 0.05, 2)[1:-1]
    values = np.repeat([0.2, -0.1, 0.4, 0.0, 0.3, -0.3, 0.1, 0.2], 2)
    excited = excitation(GroundMotion.from_nodes(times, values))
    n = excited.interval_s.size // 4 * 4
    table = np.empty((n // 4, COLUMNS))
    fill_spans(excited.interval_s, excited.k_h, excited.w, 4, table)
    area = (
        (0.5 * excited.interval_s * (excited.k_h[1:] + excited.k_h[:-1]))[:n].reshape(-1, 4).sum(1)
    )
    mean = table[:, 2] + table[:, 3] / 2 + table[:, 4] / 3 + table[:, 5] / 4
    np.testing.assert_allclose(mean * table[:, 0], area, atol=1e-15)


def test_the_error_of_a_span_of_rough_samples_is_within_its_bound() -> None:
    """`take_span` leaves out the spans whose bound is too great."""
    rng = np.random.default_rng(3)
    errors = []
    for _ in range(300):
        length = int(rng.choice([2, 4, 8, 16]))
        rough = 10.0 ** rng.uniform(-2.0, 0.0) * rng.standard_normal((2, length + 1))
        motion = GroundMotion(rng.uniform(-1.0, 1.0) + rough[0], 0.01)
        drive = excitation(motion, GroundMotion(0.3 * rough[1].clip(-3.0), 0.01))
        p = 10.0 ** rng.uniform(-2.5, -2.0) / (length * 0.01)
        table = np.empty((1, COLUMNS))
        fill_spans(drive.interval_s, drive.k_h, drive.w, length, table)
        exact, spanned = (integrated(drive, p, item, length) for item in (0, length))
        bound = ((p * table[0, 0]) ** 2 * table[0, 18]) ** 2
        errors.append((abs(exact[1] - spanned[1]), bound))
    error, bounds = np.array(errors).T
    assert (error <= bounds + 1e-15).all()
    # and there is something to be bounded
    assert (error > 1e-13).sum() > 20
