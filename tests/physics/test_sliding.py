"""The sliding block against closed forms and an independent calculation."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2 as G
from rbfrag.solver.respond import respond
from rbfrag.solver.results import Outcome, Response


def pulse(amplitude_g: float, duration_s: float) -> GroundMotion:
    """A rectangular pulse and rest after it."""
    return GroundMotion.from_nodes(
        [0.0, 0.0, duration_s, duration_s, 60.0], [0.0, amplitude_g, amplitude_g, 0.0, 0.0]
    )


def half_sine(amplitude_g: float, duration_s: float) -> GroundMotion:
    time = np.linspace(0.0, duration_s, 4001)
    return GroundMotion.from_nodes(time, amplitude_g * np.sin(np.pi * time / duration_s))


def slid(response: Response) -> float:
    assert response.outcome is Outcome.STABLE
    assert response.displacement_m is not None
    return response.displacement_m


@pytest.mark.parametrize("ky", [0.05, 0.1, 0.2, 0.39])
@pytest.mark.parametrize("duration_s", [0.02, 0.3, 1.0])
def test_rectangular_pulse(ky: float, duration_s: float) -> None:
    # D = (A g T²/2) (A/k_y - 1)
    answer = respond(pulse(0.4, duration_s), ky=ky)
    exact = 0.2 * G * duration_s**2 * (0.4 / ky - 1.0)
    assert slid(answer) == pytest.approx(exact, rel=1e-10, abs=0.0)
    assert answer.started_s == 0.0
    # it stops when the impulse is used up
    assert answer.stopped_s == pytest.approx(0.4 * duration_s / ky, rel=1e-12)
    assert abs(slid(answer) - exact) <= answer.error_estimate


@pytest.mark.parametrize(("beta_deg", "phi_deg"), [(15.0, 30.0), (-10.0, 12.0), (25.0, 40.0)])
def test_inclined_rectangular_pulse(beta_deg: float, phi_deg: float) -> None:
    phi, beta = math.radians(phi_deg), math.radians(beta_deg)
    ky = math.tan(phi - beta)
    flat = 0.45 * G * (0.9 / ky - 1.0)
    inclined = respond(pulse(0.9, 1.0), ky=ky, beta_deg=beta_deg)
    assert slid(inclined) == pytest.approx(math.cos(phi - beta) / math.cos(phi) * flat, rel=1e-10)
    horizontal = respond(pulse(0.9, 1.0), ky=ky, beta_deg=beta_deg, horizontal=True)
    assert slid(horizontal) == pytest.approx(flat, rel=1e-10)


def test_the_factor_of_an_inclined_plane() -> None:
    # 0.5 g x 0.5 s on 15 degrees with a friction angle of 30: 0.1570 m in a simulation of the
    # contact with g = 9.81; 0.1571 m with the factor and 0.1408 m without (physics of the issue)
    motion = half_sine(0.5, 0.5)
    ky = math.tan(math.radians(15.0))
    with_factor = slid(respond(motion, ky=ky, beta_deg=15.0))
    assert round(with_factor * 9.81 / G, 4) == 0.1571
    without = slid(respond(motion, ky=ky, beta_deg=15.0, horizontal=True))
    assert round(without * 9.81 / G, 4) == 0.1408


def test_vertical_motion_adds_to_friction() -> None:
    # a constant k_v scales the yield: (1 + k_v) k_y
    up = GroundMotion.from_nodes([0.0, 60.0], [0.5, 0.5])
    motion = GroundMotion.from_nodes([0.0, 0.0, 1.0, 1.0, 60.0], [0.0, 0.4, 0.4, 0.0, 0.0])
    common = np.array(motion.time_s)
    up = GroundMotion.from_nodes(common, np.full(common.size, 0.5))
    heavy = slid(respond(motion, ky=0.1, vertical=up))
    light = slid(respond(motion, ky=0.15))
    assert heavy == pytest.approx(light, rel=1e-12)


def test_down_only_and_two_ways() -> None:
    motion = GroundMotion.from_nodes(
        [0.0, 0.0, 0.5, 0.5, 1.0, 1.0, 1.5, 1.5, 30.0],
        [0.0, 0.5, 0.5, 0.0, 0.0, -0.5, -0.5, 0.0, 0.0],
    )
    down = slid(respond(motion, ky=0.25))
    assert down == pytest.approx(0.25 * G * 0.25 * (0.5 / 0.25 - 1.0), rel=1e-10)
    back = respond(motion, ky=0.25, two_way=True)
    # on a level plane the second pulse undoes the first
    assert slid(back) == pytest.approx(0.0, abs=1e-12)
    assert back.peak_displacement_m == pytest.approx(down, rel=1e-12)
    # and the other polarity slides the other way
    other = respond(motion, ky=0.25, two_way=True, polarity="reverse")
    assert slid(other) == pytest.approx(0.0, abs=1e-12)


def test_vertical_motion_lifts_a_block_off_its_base() -> None:
    # a steep plane and a strong push out of it: N = w cos(b) - k sin(b) vanishes
    motion = GroundMotion.from_nodes([0.0, 1.0], [0.0, 6.0])
    answer = respond(motion, ky=0.1, beta_deg=20.0)
    assert answer.outcome is Outcome.CONTACT_LOST
    lost_s = 1.0 / math.tan(math.radians(20.0)) / 6.0
    assert answer.stopped_s == pytest.approx(lost_s, rel=1e-9)
    assert "contact with its base" in answer.warnings[-1]


def by_small_steps(samples: list[float], dt_s: float, ky: float) -> float:
    """Newmark's block by velocities at sub-samples: an independent, first-order calculation."""
    fine = 400
    h = dt_s / fine
    times = np.arange((len(samples) - 1) * fine + 200 * fine) * h
    a = np.interp(times, np.arange(len(samples)) * dt_s, samples, right=0.0)
    v = d = 0.0
    for value in (a - ky) * G:
        before = v
        v = max(0.0, v + value * h)
        d += 0.5 * (before + v) * h
    return d


@settings(max_examples=12)
@given(
    samples=st.lists(st.floats(-1.0, 1.0), min_size=3, max_size=12),
    ky=st.floats(0.15, 0.9),
)
def test_any_record_against_small_steps(samples: list[float], ky: float) -> None:
    answer = slid(respond(GroundMotion(np.array(samples), 0.1), ky=ky))
    assert answer == pytest.approx(by_small_steps(samples, 0.1, ky), rel=0.02, abs=2e-4)


def by_intervals(samples: list[float], dt_s: float, ky: float) -> float:
    """The cubics of all intervals, cut at the roots of acceleration and rate: exact."""
    nodes = [*samples, *np.zeros(round(60.0 / dt_s))]
    nodes.insert(len(samples), 0.0)
    d = v = 0.0
    for i, (a0, a1) in enumerate(itertools.pairwise(nodes)):
        f0, slope = (a0 - ky) * G, (a1 - a0) * G / dt_s
        length = 0.0 if i == len(samples) - 1 else dt_s  # the ground stops at once
        t = 0.0
        while t < length:
            f = f0 + slope * t
            if v == 0.0 and not (f > 0.0 or (abs(f) < 1e-12 and slope > 0.0)):
                start = -f0 / slope if slope > 0.0 else math.inf
                if not t < start < length:
                    break
                t, f = start, 0.0
            roots = np.roots([0.5 * slope, f, v])
            stops = [r.real for r in roots if abs(r.imag) < 1e-12 and 1e-9 < r.real < length - t]
            h = min(stops, default=length - t)
            d += v * h + f * h**2 / 2.0 + slope * h**3 / 6.0
            v = 0.0 if stops else v + f * h + slope * h**2 / 2.0
            t += h
    return d


@pytest.mark.parametrize("seed", range(12))
def test_any_record_against_the_cubics_of_its_intervals(seed: int) -> None:
    rng = np.random.default_rng(seed)
    samples = (0.6 * rng.normal(size=80)).tolist()
    for ky in (0.02, 0.1, 0.4):
        answer = respond(GroundMotion(np.array(samples), 0.05), ky=ky)
        assert slid(answer) == pytest.approx(by_intervals(samples, 0.05, ky), rel=1e-9, abs=1e-14)


@settings(max_examples=50)
@given(
    samples=st.lists(st.floats(-1.0, 1.0), min_size=2, max_size=30),
    ky=st.floats(0.01, 0.9),
    weaker=st.floats(0.3, 1.0),
)
def test_displacement_grows_with_weakness_and_never_shrinks_in_time(
    samples: list[float], ky: float, weaker: float
) -> None:
    motion = GroundMotion(np.array(samples), 0.05)
    strong = respond(motion, ky=ky, history=True)
    assert slid(respond(motion, ky=weaker * ky)) >= slid(strong) - 1e-12
    assert strong.history is not None
    assert strong.history.displacement_m is not None
    assert np.all(np.diff(strong.history.displacement_m) >= -1e-12)
    assert (strong.started_s is None) == (slid(strong) == 0.0 and max(samples) <= ky)
