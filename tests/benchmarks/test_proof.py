"""Runs in ball arithmetic prove what they say, and say nothing that they cannot prove."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from flint import arb, ctx

from benchmarks.certify.made_up import noise, plateaus, ties, vertical_of
from benchmarks.certify.recordings import Combination, Recording
from benchmarks.extended.toppling import truth
from benchmarks.proof import above, brackets
from benchmarks.proof.enclosed_run import (
    NOT_ENCLOSED,
    STABLE,
    TOPPLED,
    Block,
    NotEnclosedError,
    Place,
    enclose,
    exact,
    least_later_q,
)
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.sample_motions import reversal_pulse
from rbfrag.solver.excitation import excitation
from rbfrag.solver.search.critical import critical
from tests.synthetic import shaking

PULSE = GroundMotion.from_nodes([0.0, 0.2, 0.4], [0.0, 0.5, 0.0])


@pytest.mark.parametrize("ratio", [0.35, 1.25])
def test_both_ends_of_a_pulse(ratio: float) -> None:
    motion = reversal_pulse(1.0, ratio, 0.5, 0.01)
    result = critical(motion, p2=2.0)
    assert result.lower is not None
    assert result.upper is not None
    excited = excitation(motion)
    for kr, outcome in ((result.lower, TOPPLED), (result.upper, STABLE)):
        for off in (0.0, 1e-6):
            sign = -1.0 if outcome == TOPPLED else 1.0
            proven = enclose(excited, p2=2.0, kr=kr * excited.pga_g * (1.0 + sign * off))
            assert proven.outcome == outcome
            assert proven.width < 1e-25


def test_energy_under_a_constant_drive_is_enclosed() -> None:
    # theta'²/2 + p² (k_h sin phi + w cos phi) is kept
    excited = excitation(
        GroundMotion.from_nodes([0.0, 1.0], [0.3, 0.3]),
        GroundMotion.from_nodes([0.0, 1.0], [-0.2, -0.2]),
    )
    with ctx.workprec(256):
        block = Block(excited, 3.0, exact(0.25))
        k_h, w = arb(float(excited.k_h[0])), arb(float(excited.w[0]))

        def energy(theta: arb, rate: arb) -> arb:
            phi = block.theta_c - theta
            return rate**2 / 2 + 3 * (k_h * phi.sin() + w * phi.cos())

        stop = Place(0, arb(0.75))
        trajectory = block.integrate(Place(0, arb(0)), arb(0), arb(0), lifted=True, stop=stop)
        assert trajectory.theta > 0.05
        conserved = energy(trajectory.theta, trajectory.rate)
        assert conserved.overlaps(energy(arb(0), arb(0)))
        assert conserved.rad() < 1e-40


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("p2", [30.0, 1.0])
def test_outcomes_and_impacts_are_those_of_32_digits(seed: int, p2: float) -> None:
    motion = GroundMotion(shaking(seed, npts=500), 0.02)
    excited = excitation(motion, GroundMotion(0.5 * shaking(seed + 7, npts=500), 0.02))
    seen = set()
    for kr in (0.03, 0.08, 0.15, 0.24):
        proven = enclose(excited, p2=p2, kr=kr)
        assert proven.outcome == truth(excited, p2=p2, kr=kr).outcome
        seen.add(proven.outcome)
        closer = enclose(excited, p2=p2, kr=kr, bits=(500,))
        assert len(closer.impacts_s) == len(proven.impacts_s)
        for (item, width), (other, less) in zip(proven.impacts_s, closer.impacts_s, strict=True):
            assert less < width < 1e-20
            assert item == pytest.approx(other, abs=1e-15)
    assert seen


def test_few_bits_say_nothing_rather_than_something_wrong() -> None:
    motion = GroundMotion(shaking(3, npts=500), 0.02)
    excited = excitation(motion)
    result = critical(motion, p2=3.0)
    assert result.lower is not None
    assert result.upper is not None
    outcomes = [
        enclose(excited, p2=3.0, kr=kr * excited.pga_g, bits=(bits,)).outcome
        for kr in (result.lower, result.upper)
        for bits in (24, 32, 40, 64, 128)
    ]
    assert set(outcomes[:5]) <= {NOT_ENCLOSED, TOPPLED}
    assert set(outcomes[5:]) <= {NOT_ENCLOSED, STABLE}
    assert NOT_ENCLOSED in outcomes
    assert outcomes[4] == TOPPLED
    assert outcomes[9] == STABLE


def test_a_plateau_at_the_threshold_is_rest_and_an_ulp_above_is_motion() -> None:
    excited = excitation(GroundMotion.from_nodes([0.0, 1.0, 3.0, 4.0], [0.0, 0.3, 0.3, 0.0]))
    assert enclose(excited, p2=3.0, kr=0.3).decided_by == "rest"
    below = enclose(excited, p2=3.0, kr=math.nextafter(0.3, 0.0))
    assert below.steps > 0
    assert (below.outcome, below.decided_by) == (STABLE, "last impact")


def test_a_ball_that_holds_both_sides_is_rejected() -> None:
    # after the record upright to within the ball: no verdict
    excited = excitation(PULSE)
    with ctx.workprec(100):
        block = Block(excited, 5.0, exact(0.2))
        end = Place(2, arb(0))
        upright = block.theta_c + arb(0, 1e-20)
        with pytest.raises(NotEnclosedError, match="energy"):
            block.integrate(end, upright, arb(0, 1e-20), lifted=False)
        assert block.integrate(end, upright, arb(1e-9), lifted=False).event == "topples"
        assert block.integrate(end, upright, arb(-1e-9), lifted=False).event == "returns"


def test_least_later_q_is_below_every_later_q() -> None:
    motion, vertical = (GroundMotion(shaking(seed, npts=300), 0.02) for seed in (2, 9))
    excited = excitation(motion, vertical)
    least = least_later_q(excited)
    for node in range(0, 300, 37):
        later = min(exact(excited.k_h[j]) / exact(excited.w[j]) for j in range(node, 300))
        assert exact(least[node]) < min(later, 0) or (least[node] == 0.0 and later >= 0)


def test_outside_the_model_is_rejected() -> None:
    excited = excitation(PULSE, GroundMotion.from_nodes([0.0, 0.2, 0.4], [0.0, -1.5, 0.0]))
    with pytest.raises(ValueError, match="1 \\+ k_v"):
        enclose(excited, p2=3.0, kr=0.1)
    with pytest.raises(ValueError, match="positive"):
        enclose(excitation(PULSE), p2=3.0, kr=0.0)


def test_the_study_goes_on_where_it_was_ended(tmp_path: Path) -> None:
    recordings_drawn = [
        Recording(f"made-{seed}", GroundMotion(shaking(seed, npts=300), 0.02), None)
        for seed in (1, 2)
    ]
    upright = Recording(
        "made-3",
        GroundMotion(shaking(3, npts=300), 0.02),
        GroundMotion(0.3 * shaking(5, npts=300), 0.02),
    )
    rows = tmp_path / "rows.csv"
    first = brackets.study([*recordings_drawn, upright], 3, 1, rows, 60.0)
    text = rows.read_text()
    again = brackets.study([*recordings_drawn, upright], 5, 1, rows, 60.0)
    assert again[:3] == first
    assert rows.read_text().startswith(text)
    assert all(row.off_proven and row.at_proven and row.above_proven for row in again)
    assert len({row.p2 for row in again}) == 5
    table = brackets.by_size(again)
    assert "| all | 5, 1 | 5 | 5 | 5 |" in table
    assert brackets.by_combination(again).count("\n") == 6


def test_no_proof_where_a_stronger_block_topples() -> None:
    motion = GroundMotion(shaking(3, npts=300), 0.02)
    excited = excitation(motion)
    result = critical(motion, p2=3.0)
    assert result.lower is not None
    assert result.k_up_over_pga is not None
    k_up = result.k_up_over_pga * excited.pga_g
    for off in (1e-2, 1e-5):
        kr = result.lower * excited.pga_g * (1.0 - off)
        verdict_above = above.nothing_above(excited, p2=3.0, kr=kr, k_up=k_up, seconds=60.0)
        assert not verdict_above.proven
        assert verdict_above.reached >= result.lower * excited.pga_g
    low = above.nothing_above(excited, p2=3.0, kr=kr, k_up=kr, seconds=60.0)
    assert "from rest" in low.reason
    assert not above.nothing_above(
        excited, p2=3.0, kr=0.99 * k_up, k_up=1.1 * k_up, seconds=0.0
    ).proven


def test_strong_shaking_both_ways_keeps_no_order() -> None:
    motion = GroundMotion.from_nodes([0.0, 0.1, 0.2, 0.3], [0.0, 2.0, -0.5, 0.0])
    assert above.keeps_order(excitation(motion))
    motion = GroundMotion.from_nodes([0.0, 0.1, 0.2, 0.3], [0.0, 2.0, -0.501, 0.0])
    assert not above.keeps_order(excitation(motion))
    verdict_above = above.nothing_above(excitation(motion), p2=3.0, kr=0.5, k_up=1.0, seconds=60.0)
    assert "D >= 0" in verdict_above.reason


@pytest.mark.parametrize("seed", range(3))
def test_verdicts_hold_for_blocks_inside(seed: int) -> None:
    rng = np.random.default_rng(seed)
    motion = (noise, plateaus, ties)[seed](rng)
    excited = excitation(motion, vertical_of(motion, rng) if seed == 0 else None)
    assert above.keeps_order(excited)
    p2 = 10.0
    seen = []
    for _ in range(16):
        low = excited.max_q * rng.uniform(0.05, 1.0)
        high = low * (1.0 + 10.0 ** rng.uniform(-5.0, -1.0))
        with ctx.workprec(above.BITS):
            record = above.Record(excited, p2)
            table = above.Table(record, exact(low))
            verdict = above.decide(record, exact(low), exact(high), table, 0).verdict
        seen.append(verdict)
        if verdict != above.SPLIT:
            expected = TOPPLED if verdict == above.TOPPLE else STABLE
            for kr in (low, *rng.uniform(low, high, 4)):
                assert truth(excited, p2=p2, kr=float(kr)).outcome == expected
    assert {above.SAFE, above.TOPPLE} <= set(seen)


def test_a_block_on_the_wrong_side_is_no_proof() -> None:
    combination = Combination(Recording("pulse", PULSE, None), "forward", 5.0, False)
    row = brackets.prove(combination, 60.0)
    assert row is not None
    assert row.off_proven
    result = critical(PULSE, p2=5.0)
    assert result.upper is not None
    wrong = enclose(
        combination.excited(), p2=5.0, kr=result.upper * combination.excited().pga_g * (1.0 + 1e-9)
    )
    assert wrong.outcome != TOPPLED


def test_heyoka_agrees() -> None:
    pytest.importorskip("heyoka", reason="heyoka is in the extra bench")
    from benchmarks.proof.heyoka_runs import Oracle, compare
    from rbfrag.bench.peers import Records, choose_cases

    motions = tuple(GroundMotion(shaking(seed, npts=500), 0.02) for seed in range(3))
    oracle = Oracle()
    for case in choose_cases(Records(motions, "made up"), 6, seed=2):
        difference = compare(oracle, case)
        assert len(set(difference.outcomes)) == 1
        assert np.isnan(difference.peak) or difference.peak < 1e-10
        assert not difference.impact_s > 1e-9
        assert not difference.outside_s > 1e-9
