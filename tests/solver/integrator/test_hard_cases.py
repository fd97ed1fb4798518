"""Cases that break kernels: what is right in each, and why. Judged by numbers of 32 digits.

Outcomes within 1e-3 ... 1e-10 of critical have a file of their own,
tests/solver/test_extended_precision.py.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from benchmarks.extended.toppling import Truth, truth
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.solver.excitation import excitation
from rbfrag.solver.results import Outcome, Response
from rbfrag.solver.search.critical import critical
from rbfrag.solver.toppling_run import respond
from tests.solver.motions import noise


def judged(
    motion: GroundMotion,
    p2: float,
    kr: float,
    vertical: GroundMotion | None = None,
    rel: float = 1e-9,
) -> tuple[Response, Truth]:
    """Run a block both ways: the same outcome, and a peak within its bounds."""
    run = respond(motion, p2=p2, kr=kr, vertical=vertical)
    true = truth(excitation(motion, vertical), p2=p2, kr=kr)
    assert run.outcome == true.outcome
    assert run.samples_moved == true.intervals_moved
    if true.outcome == "stable":
        assert run.peak_theta_rad is not None
        error = abs((run.peak_theta_rad - true.peak_rad) - true.peak_low_rad)
        assert error <= run.error_estimate
        assert error <= rel * true.peak_rad
    return run, true


KR = 0.3
UP_S, DOWN_S = 0.2, 0.35


def grazing(brake: float) -> GroundMotion:
    """Thrown up, pulled down, and braked by a constant acceleration until the base is near."""
    return GroundMotion.from_nodes(
        [0.0, 0.0, UP_S, UP_S, DOWN_S, DOWN_S, 0.9, 0.9],
        [0.0, 0.6, 0.6, -0.5, -0.5, brake, brake, 0.0],
    )


def brake_to_the_base() -> float:
    """The acceleration that stops the block exactly at theta = 0, by energy.

    Under a constant a, theta'²/(2 p²) + a sin(phi) + cos(phi) is kept; at theta = 0 the rate
    vanishes.
    """
    history = respond(grazing(0.0), p2=4.0, kr=KR, history=True).history
    assert history is not None
    at = np.flatnonzero(history.time_s == DOWN_S)[0]
    theta_c = math.atan(KR)
    phi = theta_c - history.theta_rad[at]
    rate = history.theta_dot_rad_s[at]
    assert rate < 0.0
    kinetic = rate**2 / 8.0
    return float(
        (kinetic + math.cos(phi) - math.cos(theta_c)) / (math.sin(theta_c) - math.sin(phi))
    )


@pytest.mark.parametrize(
    "off", [0.0, *(sign * 10.0**-n for n in (2, 5, 8, 11, 13, 15) for sign in (-1.0, 1.0))]
)
def test_grazing_the_base(off: float) -> None:
    """A block that touches and one that turns just above move alike afterwards.

    To turn at theta = 0 it needs q > k_r there, so that a touch have impacts it with next to no
    speed and lifts it again at once: from (0, ~0) either way. But the speed that a touch takes
    away goes as the root of its depth. An error of 1e-16 in theta becomes one of 1e-8 in the
    rate, for any solver in doubles, and the error estimate has to say so.
    """
    brake = brake_to_the_base()
    assert brake > KR
    run, true = judged(grazing(brake * (1.0 + off)), 4.0, KR, rel=1e-7)
    _, exactly = judged(grazing(brake), 4.0, KR)
    assert run.outcome is Outcome.STABLE
    if off:
        # the speed of a touch is as the root of the offset; so is what a touch changes
        assert true.peak_rad == pytest.approx(exactly.peak_rad, rel=20.0 * math.sqrt(abs(off)))


@pytest.mark.parametrize("size", [1e-9, 1e-12])
@pytest.mark.parametrize("p2", [0.3, 10.0])
def test_chatter_about_the_threshold(size: float, p2: float) -> None:
    """An excitation that crosses the threshold at every sample starts one tiny motion an interval.

    At most one start is possible in an interval, because k_h is straight in it; the
    excursions end, because the mean of k_h is at the threshold; nothing is skipped.
    """
    rng = np.random.default_rng(0)
    values = 0.2 + size * rng.choice([-1.0, 1.0], 200)
    motion = GroundMotion(np.concatenate([[0.0], values, [0.0]]), 0.005)
    run = respond(motion, p2=p2, kr=0.2)
    true = truth(excitation(motion), p2=p2, kr=0.2)
    assert run.outcome == true.outcome == "stable"
    assert run.peak_theta_rad is not None
    # the excitation is only known to rounding: 1e-16 of it is 1e-7 of the chatter
    error = abs(run.peak_theta_rad - true.peak_rad)
    assert error <= run.error_estimate
    assert error <= 1e-15 + 1e-6 * true.peak_rad
    assert 0 < run.samples_moved <= run.samples_total


def test_a_search_over_chatter_ends_with_a_proof() -> None:
    values = 0.2 + 1e-9 * np.where(np.arange(300) % 2, 1.0, -1.0)
    motion = GroundMotion(np.concatenate([[0.0], values, [0.0, -0.1, 0.15, 0.0]]), 0.005)
    result = critical(motion, p2=10.0)
    assert result.status == "found"
    assert result.certified
    assert result.kr is not None
    # 1.5 s at 0.2 g: all but the first instants of a rectangular pulse, whose critical angle is
    # close to its height
    assert 0.19 < result.kr < 0.2


@pytest.mark.parametrize("level", [0.2, 0.3, 1.0 / 3.0])
def test_plateau_at_the_threshold(level: float) -> None:
    """A block starts where q exceeds k_r: not at equality, and by one ulp it does."""
    motion = GroundMotion.from_nodes([0.0, 1.0, 3.0, 4.0], [0.0, level, level, 0.0])
    at_rest = respond(motion, p2=10.0, kr=level)
    assert (at_rest.started_s, at_rest.peak_theta_rad, at_rest.samples_moved) == (None, 0.0, 0)
    weaker = float(np.nextafter(level, 0.0))
    run = respond(motion, p2=10.0, kr=weaker)
    true = truth(excitation(motion), p2=10.0, kr=weaker)
    assert run.started_s == pytest.approx(1.0)
    assert run.outcome == true.outcome == "stable"
    # an ulp grows by cosh(p t) over the plateau, and stays an ulp to the solver's rounding
    assert run.peak_theta_rad is not None
    assert abs(run.peak_theta_rad - true.peak_rad) <= run.error_estimate
    assert run.peak_theta_rad < 1e-12


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("kr", [0.05, 0.2, 0.4])
def test_small_block_on_a_coarse_record(seed: int, kr: float) -> None:
    """p² = 100 at dt = 0.02 s is p·h = 0.2: one step of it would err by 1e-6, so it is split."""
    run, true = judged(noise(seed, npts=300, dt_s=0.02), 100.0, kr)
    if true.intervals_moved:
        assert run.steps >= 6 * run.samples_moved / 2


@pytest.mark.parametrize("seed", range(3))
def test_huge_block(seed: int) -> None:
    """p² = 1e-3 (a centroid at 7 km): gravity hardly acts, the rotation is that of the pull."""
    judged(noise(seed, npts=300, dt_s=0.02), 1e-3, 0.05)
    judged(noise(seed, npts=300, dt_s=0.02), 1e-3, 0.3)


@pytest.mark.parametrize("seed", range(4))
def test_extreme_strengths(seed: int) -> None:
    """k_r = 1e-5 topples under any pull; k_r = 1e4 never lifts under 0.5 g.

    Where gravity is all but taken away it does lift, and cos(theta_c) is 1e-4 then.
    """
    run, _ = judged(noise(seed, npts=300, dt_s=0.02), 3.0, 1e-5)
    assert run.outcome is Outcome.TOPPLED
    run, _ = judged(noise(seed, npts=300, dt_s=0.02), 3.0, 1e4)
    assert (run.peak_theta_rad, run.samples_moved) == (0.0, 0)
    pull = GroundMotion.from_nodes([0.0, 0.5, 1.0, 2.0], [0.0, 0.4, 0.0, 0.0])
    weightless = GroundMotion.from_nodes([0.0, 0.5, 1.0, 2.0], [0.0, 1e-5 - 1.0, 0.0, 0.0])
    run, _ = judged(pull, 3.0, 1e4, weightless, rel=1e-7)
    assert run.samples_moved > 0


def test_past_the_critical_angle_and_back() -> None:
    """Beyond its balance a block falls on by itself, yet a pull the other way can save it."""
    motion = GroundMotion.from_nodes(
        [0.0, 0.0, 0.25, 0.25, 0.5, 0.5], [0.0, 1.0, 1.0, -1.0, -1.0, 0.0]
    )
    kr = critical(motion, p2=2.0).kr
    assert kr is not None
    for off in (1e-2, 1e-4, 1e-6, 1e-8):
        run, _ = judged(motion, 2.0, kr * (1.0 + off), rel=1e-7)
        assert run.peak_theta_n is not None
        assert run.peak_theta_n > 1.0
        run, _ = judged(motion, 2.0, kr * (1.0 - off))
        assert run.outcome is Outcome.TOPPLED


@pytest.mark.parametrize("seed", range(3))
def test_zero_padding_before_and_after(seed: int) -> None:
    """Rest before changes no bit and costs no step; rest after is what is assumed anyway."""
    motion = noise(seed, npts=120, dt_s=0.02)
    start = int(np.flatnonzero(motion.acceleration_g > 0.2)[0])
    cut = GroundMotion(motion.acceleration_g[start : start + 40], motion.dt_s)
    late = GroundMotion(np.pad(cut.acceleration_g, (100_000, 0)), motion.dt_s)
    # the jump to rest at the end, written out
    n = cut.npts
    long = GroundMotion.from_nodes(
        np.append(np.append(cut.time_s, cut.time_s[-1]), cut.time_s[-1] + np.arange(1, 900) * 0.02),
        np.append(cut.acceleration_g, np.zeros(900)),
    )
    for p2, kr in ((6.0, 0.3), (0.5, 0.25)):
        plain = respond(cut, p2=p2, kr=kr)
        moved = respond(late, p2=p2, kr=kr)
        # the jump from rest to the first sample takes one interval more
        assert moved.samples_total == n - 1 + 100_000
        assert moved.samples_moved <= plain.samples_moved + 400
        rest = respond(long, p2=p2, kr=kr)
        assert rest.outcome == plain.outcome
        if plain.peak_theta_rad is not None:
            assert rest.peak_theta_rad == pytest.approx(plain.peak_theta_rad, rel=1e-11)
        judged(late, p2, kr)
        judged(long, p2, kr)


@pytest.mark.parametrize("samples", [[0.0], [0.7], [-0.7], [0.0] * 50])
def test_records_in_which_nothing_can_move(samples: list[float]) -> None:
    """One sample lasts no time; zeros pull nothing."""
    motion = GroundMotion(np.array(samples), 0.01)
    run = respond(motion, p2=1.0, kr=0.1)
    assert run.outcome is Outcome.STABLE
    assert (run.peak_theta_n, run.started_s) == (0.0, None)
    assert (run.samples_moved, run.samples_total) == (0, len(samples) - 1)
    assert critical(motion, p2=1.0).status in {"no_motion", "below_limit"}


@pytest.mark.parametrize("p2", [0.5, 5.0, 50.0])
def test_last_sample_that_is_not_zero(p2: float) -> None:
    """After the last sample the ground is at rest: a jump, and energy decides at once."""
    for values in ([0.5, 0.5, 0.5], [0.5, -0.2, 0.6], [0.0, 0.2, 0.9], [0.4, 0.4, -0.9]):
        times = [0.0, 0.1, 0.2]
        run, _ = judged(GroundMotion.from_nodes(times, values), p2, 0.3)
        written_out = respond(
            GroundMotion.from_nodes([*times, 0.2, 3.0], [*values, 0.0, 0.0]), p2=p2, kr=0.3
        )
        assert written_out.outcome == run.outcome
        if run.peak_theta_rad is not None:
            assert written_out.peak_theta_rad == pytest.approx(run.peak_theta_rad, rel=1e-10)


@pytest.mark.parametrize("remaining", [0.1, 1e-3, 1e-6, 1e-12])
def test_gravity_nearly_taken_away(remaining: float) -> None:
    """1 + k_v > 0 is the model, however little is left; q runs up to k_h/(1 + k_v)."""
    motion = GroundMotion.from_nodes([0.0, 0.5, 1.0, 2.0], [0.0, 0.05, -0.3, 0.0])
    vertical = GroundMotion.from_nodes([0.0, 0.5, 1.0, 2.0], [0.0, remaining - 1.0, 0.0, 0.0])
    for kr in (0.3, 2.0):
        judged(motion, 2.0, kr, vertical, rel=1e-8)
    result = critical(motion, p2=2.0, vertical=vertical)
    assert result.status in {"found", "below_limit"}


@pytest.mark.parametrize("least", [0.0, -1e-12, -0.5])
def test_gravity_taken_away(least: float) -> None:
    """1 + k_v <= 0 throws the block: outside the model, said with its time, never guessed."""
    motion = GroundMotion.from_nodes([0.0, 0.5, 1.0, 2.0], [0.0, 0.05, -0.3, 0.0])
    vertical = GroundMotion.from_nodes([0.0, 0.5, 1.0, 2.0], [0.0, least - 1.0, 0.0, 0.0])
    run = respond(motion, p2=2.0, kr=0.3, vertical=vertical)
    assert run.outcome is Outcome.JUMP
    assert run.peak_theta_rad is None
    assert truth(excitation(motion, vertical), p2=2.0, kr=0.3).outcome == "jump"
    when = 0.5 / (1.0 - least)
    assert any(f"at {when:.3f} s" in sentence for sentence in run.warnings)
    assert critical(motion, p2=2.0, vertical=vertical).status == "outside_model"


@pytest.mark.parametrize("seed", range(5))
def test_intervals_of_no_length(seed: int) -> None:
    """A repeated node is a jump; with the same value twice, or three times, it is nothing."""
    rng = np.random.default_rng(seed)
    times = np.cumsum(rng.uniform(0.01, 0.2, 12))
    values = rng.uniform(-0.5, 0.6, 12)
    plain = GroundMotion.from_nodes(times, values)
    doubled = GroundMotion.from_nodes(np.repeat(times, 3), np.repeat(values, 3))
    steps = GroundMotion.from_nodes(np.repeat(times, 2)[1:-1], np.repeat(values[:-1], 2))
    for p2, kr in ((20.0, 0.2), (2.0, 0.35)):
        single, other = (respond(m, p2=p2, kr=kr) for m in (plain, doubled))
        assert (
            single.outcome, single.peak_theta_rad, single.samples_moved, single.samples_total,
        ) == (
            other.outcome, other.peak_theta_rad, other.samples_moved, other.samples_total,
        )  # fmt: skip
        judged(steps, p2, kr)
