"""The certificate: every interval it decides is checked by the blocks inside it."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.readers import read_motions
from rbfrag.solver.critical_result import CriticalResult
from rbfrag.solver.excitation import Excitation, excitation
from rbfrag.solver.integrator.block_excitation import remaining_excitation
from rbfrag.solver.integrator.toppling_kernel import STABLE, TOPPLED
from rbfrag.solver.search.certified import (
    MAP_DEPTH,
    CertifiedMap,
    certified_map,
    keeps_order,
    outcome_intervals,
)
from rbfrag.solver.search.critical import critical
from rbfrag.solver.search.march import SAFE, TOPPLES
from rbfrag.solver.toppling_run import simulate
from tests.physics.linear_block import largest_failing


def noise(seed: int, npts: int = 900, dt_s: float = 0.01, pga_g: float = 0.6) -> GroundMotion:
    """Enveloped noise with a slow swell."""
    rng = np.random.default_rng(seed)
    t = np.arange(npts) * dt_s
    fast = np.convolve(rng.standard_normal(npts), np.hanning(int(rng.integers(5, 30))), "same")
    slow = np.sin(2.0 * np.pi * t / rng.uniform(0.5, 2.0) + rng.uniform(0.0, 6.0))
    samples = np.hanning(npts) * (fast / np.abs(fast).max() + rng.uniform(0.0, 1.0) * slow)
    return GroundMotion(samples * (pga_g / np.abs(samples).max()), dt_s)


def steps(seed: int) -> GroundMotion:
    """Few distinct levels: plateaus, and peaks that tie exactly."""
    rng = np.random.default_rng(seed)
    levels = rng.integers(-4, 5, 60) / 10.0
    return GroundMotion(np.repeat(levels, rng.integers(1, 12, 60)), 0.02)


def pulses(seed: int) -> GroundMotion:
    """Rectangular pulses: jumps in no time."""
    rng = np.random.default_rng(seed)
    edges = np.sort(rng.uniform(0.0, 6.0, 14))
    levels = rng.uniform(-0.5, 0.5, 13)
    return GroundMotion.from_nodes(np.repeat(edges, 2)[1:-1], np.repeat(levels, 2))


def started(seed: int) -> GroundMotion:
    """Above most thresholds from the first sample on, and not at rest at the last."""
    complete = noise(seed)
    return GroundMotion(complete.acceleration_g[430:470] + 0.25, 0.01)


MAKERS = {"noise": noise, "steps": steps, "pulses": pulses, "started": started}


def contradictions(
    result: CriticalResult, excited: Excitation, count: int, rng: np.random.Generator
) -> list[str]:
    """Blocks inside decided intervals that do otherwise."""
    values = []
    for low, high, subject in zip(
        result.intervals.k_lo, result.intervals.k_hi, result.intervals.outcome, strict=True
    ):
        if subject == "undecided":
            continue
        for ratio in rng.uniform(low, high, count):
            outcome = simulate(excited, p2=result.p2, kr=ratio * excited.pga_g).outcome
            if outcome in (STABLE, TOPPLED) and (outcome == TOPPLED) != (subject == "topples"):
                values.append(f"{ratio!r} in [{low!r}, {high!r}] {subject}")
    return values


@pytest.mark.parametrize("kind", sorted(MAKERS))
@pytest.mark.parametrize("with_vertical", [False, True])
def test_blocks_inside_decided_intervals_do_as_they_say(kind: str, with_vertical: bool) -> None:
    rng = np.random.default_rng(7)
    decided = 0
    for seed in range(6):
        motion = MAKERS[kind](seed)
        vertical = None
        if with_vertical:
            other = np.resize(0.6 * noise(seed + 90).acceleration_g, motion.npts)
            vertical = (
                GroundMotion(other, motion.dt_s)
                if motion.node_time_s is None
                else GroundMotion.from_nodes(motion.node_time_s, other)
            )
        for p2 in (30.0, 2.0):
            result = critical(motion, p2=p2, vertical=vertical, search_limit=0.1, full_map=True)
            excited = excitation(motion, vertical)
            assert contradictions(result, excited, 10, rng) == []
            outcomes = result.intervals.outcome
            decided += len(outcomes)
            assert np.array_equal(result.intervals.k_lo[1:], result.intervals.k_hi[:-1])
            assert result.intervals.k_lo[0] == pytest.approx(0.1, rel=1e-12)
            if result.status == "found":
                assert result.certified
    assert decided > 12


@pytest.mark.parametrize("seed", range(4))
def test_brute_force_finds_nothing_that_the_map_denies(seed: int) -> None:
    motion = noise(seed + 20)
    result = critical(motion, p2=12.0, search_limit=0.05, full_map=True)
    excited = excitation(motion)
    ratios = np.linspace(0.05, excited.max_q / excited.pga_g, 3000)
    runs = np.array([simulate(excited, p2=12.0, kr=r * excited.pga_g).outcome for r in ratios])
    at = np.searchsorted(result.intervals.k_hi, ratios)
    at = np.minimum(at, len(result.intervals.outcome) - 1)
    message = np.array(result.intervals.outcome)[at]
    assert not np.any((message == "safe") & (runs == TOPPLED))
    assert not np.any((message == "topples") & (runs == STABLE))
    assert result.upper is not None
    assert ratios[runs == TOPPLED].max() <= result.upper


def test_maps_have_islands_and_little_that_is_undecided() -> None:
    islands = 0
    for seed in range(8):
        for depth in (1e-9, MAP_DEPTH):
            result = critical(
                noise(seed + 20), p2=12.0, search_limit=0.1, full_map=True, map_depth=depth
            )
            gaps = result.intervals.outcome.count("safe") - 1
            islands += gaps
            assert result.reentrant == (gaps > 0)
            width = result.intervals.k_hi - result.intervals.k_lo
            unknown = width[np.array(result.intervals.outcome) == "undecided"]
            assert unknown.sum() <= 4.0 * unknown.size * depth
            assert depth > 1e-9 or unknown.sum() < 1e-6
    assert islands > 0


@pytest.mark.parametrize("kind", sorted(MAKERS))
def test_coarse_and_fine_maps_agree_where_both_decide(kind: str) -> None:
    compared = 0
    for seed in range(4):
        motion = MAKERS[kind](seed + 60)
        fine, coarse = (
            critical(motion, p2=6.0, search_limit=0.1, full_map=True, map_depth=depth)
            for depth in (1e-7, 1e-3)
        )
        # what depends on the bracket alone does not depend on the depth of the map
        assert (fine.lower, fine.upper, fine.undecided) == (
            coarse.lower, coarse.upper, coarse.undecided,
        )  # fmt: skip
        assert coarse.intervals.k_lo[0] == fine.intervals.k_lo[0]
        assert coarse.intervals.k_hi[-1] == fine.intervals.k_hi[-1]
        edges = np.unique(np.concatenate([fine.intervals.k_hi, coarse.intervals.k_hi]))
        middles = 0.5 * (edges[1:] + edges[:-1])
        message = [
            np.array(item.intervals.outcome)[np.searchsorted(item.intervals.k_hi, middles)]
            for item in (fine, coarse)
        ]
        both = (message[0] != "undecided") & (message[1] != "undecided")
        assert np.array_equal(message[0][both], message[1][both])
        compared += int(both.sum())
    assert compared > 0


def test_what_a_map_does_not_reach_is_undecided_in_it(monkeypatch: pytest.MonkeyPatch) -> None:
    motion = noise(21)
    short = critical(motion, p2=12.0, search_limit=0.05)
    monkeypatch.setattr("rbfrag.solver.search.certified.MAP_STEPS", 1)
    result = critical(motion, p2=12.0, search_limit=0.05, full_map=True)
    assert result.certified
    assert (result.lower, result.upper) == (short.lower, short.upper)
    assert result.intervals.k_lo[0] == pytest.approx(0.05, rel=1e-12)
    assert result.intervals.outcome[0] == "undecided"
    assert any("the map" in sentence for sentence in result.warnings)


def test_short_answer_agrees_with_the_full_map() -> None:
    for seed in range(6):
        motion = noise(seed + 40)
        short = critical(motion, p2=8.0, search_limit=0.1)
        full = critical(motion, p2=8.0, search_limit=0.1, full_map=True)
        assert short.lower == full.lower
        assert short.upper == full.upper
        assert short.k_up_over_pga == full.k_up_over_pga
        assert short.intervals.outcome == ()
        assert full.intervals.k_lo[0] == 0.1


def test_fresh_excursions_fail_monotonely_in_kr() -> None:
    """The premise of K_up: cut the record before a rise, and weaker blocks only do worse."""
    motion = noise(3)
    a = motion.acceleration_g
    rng = np.random.default_rng(0)
    rises = np.flatnonzero((a[:-1] < 0.05) & (a[1:] >= 0.05))
    compared = 0
    for node in rng.choice(rises, 6, replace=False):
        excited = excitation(GroundMotion(a[node:], motion.dt_s))
        # a weakest block that lifts with the others, so that its first excursion is the same one
        result = certified_map(excited, p2=4.0, bottom=0.02, full=False)
        compared += 1
        for kr in rng.uniform(result.k_up, excited.max_q, 50):
            assert simulate(excited, p2=4.0, kr=kr * (1.0 + 1e-9)).outcome == STABLE
    assert compared == 6


def test_linear_upper_bound_is_the_backward_integral() -> None:
    motion = noise(5)
    p = 1.7
    still = np.empty(motion.npts)
    greatest, node = remaining_excitation(motion.interval_s, motion.acceleration_g, p, still)
    fine_t = np.linspace(0.0, motion.time_s[-1], 40 * (motion.npts - 1) + 1)
    fine_a = np.interp(fine_t, motion.time_s, motion.acceleration_g)
    faded = fine_a * np.exp(-p * fine_t)
    area = 0.5 * (faded[1:] + faded[:-1]) * np.diff(fine_t)
    rest = np.append(np.cumsum(area[::-1])[::-1], 0.0)
    integral = p * rest * np.exp(p * fine_t)
    assert greatest == pytest.approx(integral.max(), rel=1e-4)
    assert still[0] == pytest.approx(integral[0], rel=1e-3, abs=1e-5)
    assert 0 < node < motion.npts
    # of the linearised block it is the largest failing excursion from rest itself
    result = largest_failing(excitation(motion), p * p)
    assert result == pytest.approx(greatest, rel=1e-8)


def test_plateau_exactly_at_the_block_is_no_start() -> None:
    motion = GroundMotion(np.array([0.0, 0.2, 0.2, 0.2, 0.0, 0.1, 0.0]), 0.5)
    result = critical(motion, p2=1.0, full_map=True)
    assert result.certified
    assert result.upper is not None
    assert result.upper < 1.0
    assert simulate(excitation(motion), p2=1.0, kr=0.2).outcome == STABLE


def test_order_is_kept_where_no_pull_follows_a_push_of_inverse_size() -> None:
    push = GroundMotion.from_nodes([0.0, 0.5, 1.0, 1.5, 2.0], [0.0, -2.0, 0.0, 2.0, 0.0])
    assert keeps_order(excitation(push))
    assert not keeps_order(excitation(push, None, "reverse"))
    assert critical(push, p2=3.0).certified


def test_answers_without_proof_are_still_toppling_and_say_why() -> None:
    rng = np.random.default_rng(2)
    rejected = 0
    for seed in range(8):
        motion = noise(seed, pga_g=3.0)
        result = critical(motion, p2=8.0, search_limit=0.05)
        excited = excitation(motion)
        assert contradictions(result, excited, 10, rng) == []
        if not result.certified:
            rejected += 1
            assert any("not certified" in sentence for sentence in result.warnings)
            assert result.undecided is not None
            assert result.undecided > 1e-9
        if result.status == "found":
            assert result.kr is not None
            assert simulate(excited, p2=8.0, kr=result.kr).outcome == TOPPLED
    assert rejected > 0


@pytest.mark.parametrize(
    ("name", "p2"), [("Rinaldi228.AT2", 3.0), ("B-BEN360.AT2", 0.1), ("TCU120-N.AT2", 10.0)]
)
def test_recorded_motions_are_certified(records_dir: Path, name: str, p2: float) -> None:
    path = next(records_dir.rglob(name), None)
    if path is None:
        pytest.skip(f"no {name} below {records_dir}")
    (motion,) = read_motions(path)
    rng = np.random.default_rng(1)
    for polarity in ("forward", "reverse"):
        result = critical(motion, p2=p2, polarity=polarity)  # type: ignore[arg-type]
        assert result.status == "found"
        assert result.certified
        assert result.lower is not None
        assert result.upper is not None
        assert result.upper - result.lower <= 1e-6 * result.upper
        excited = excitation(motion, None, polarity)  # type: ignore[arg-type]
        assert contradictions(result, excited, 40, rng) == []
        peaks: NDArray[np.float64] = result.points.theta_n
        assert math.isnan(peaks[-1])


def test_ends_that_fall_together_in_the_quotient_leave_no_interval() -> None:
    # two neighbouring numbers whose quotients by this PGA are one
    pga = 3.0
    edge = next(x for x in np.linspace(0.1, 0.2, 997) if x / pga == np.nextafter(x, 1.0) / pga)
    above = np.nextafter(edge, 1.0)
    high = np.array([1.0, above, edge])
    low = np.array([above, edge, 0.01])
    result = CertifiedMap(
        k_up=1.0, low=low, high=high, verdict=np.array([SAFE, TOPPLES, SAFE]),
        point=np.full(3, np.nan), reached=0.01, complete=True, runs=3, steps=3,
    )  # fmt: skip
    retained = outcome_intervals(result, pga, 1.0)
    assert retained.outcome == ("safe", "safe")
    assert (retained.k_hi > retained.k_lo).all()
    np.testing.assert_array_equal(retained.k_lo[1:], retained.k_hi[:-1])
