"""The free-standing block: reference values, symmetries, closed forms, another integrator."""

from __future__ import annotations

import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import rbfrag
from benchmarks.rocking_runs import compare, draw
from rbfrag.bench.peers import Records
from rbfrag.errors import InputError
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.readers import read_motions
from rbfrag.question.classify import classify_block
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.excitation import excitation
from rbfrag.solver.kind import SupportedBlock
from rbfrag.solver.models import model_of_kind
from rbfrag.solver.models.rocking import SENSITIVITY, free_block, repeated
from rbfrag.solver.respond import block_of_numbers
from rbfrag.solver.results import Outcome, Response, ResponseHistory
from rbfrag.solver.rocking_run import (
    MOST_IMPACTS,
    corner_force,
    rocking_history,
    simulate,
    simulate_free,
)
from tests.synthetic import shaking

PALM, COYOTE = "N_Palm_Springs_1986_WWT-180", "Coyote_Lake_1979_G02-050"
PAC, VSP = "Northridge_1994_PAC-175", "Northridge_1994_VSP-360"

# record, a1, a3, r3, beta, restitution, vertical; p2 of toe and heel, e31, e13; sense of
# overturning; peak/c forward and backward; first impacts [s]: computed with a fixed-step RK4
REFERENCE = [
    ((PALM, -11.0, 11.0, 1.0, 0.0, None, False), (7.354988, 7.354988, 0.9453879, 0.9453879),
     0, 0.356882, 0.265065, (1.893518, 2.333026, 2.670467)),
    ((COYOTE, -6.1, 8.0, 2.0, 2.0, None, False), (3.681253, 3.688810, 0.9804137, 0.9744006),
     0, 0.399629, 0.190029, (2.950806, 3.161463, 3.497258)),
    ((PAC, -14.0, 14.0, 0.5, 0.0, 0.85, True), (14.709975, 14.709975, 0.85, 0.85),
     0, 0.119827, 0.387925, (3.482375, 3.998314, 4.288373)),
    ((VSP, -15.6, 15.6, 1.0, 0.0, None, False), (7.354988, 7.354988, 0.8915232, 0.8915232),
     1, None, 0.851331, (3.398492, 3.459528, 3.483879)),
    ((PALM, -5.4, 7.0, 0.5, 2.0, None, False), (14.721107, 14.743454, 0.9847415, 0.9802703),
     -1, 0.113076, None, (1.665253, 1.711390, 1.790642)),
    ((PAC, -6.9, 6.9, 1.0, 0.0, None, True), (7.354988, 7.354988, 0.9783507, 0.9783507),
     -1, 0.641601, None, (3.628949, 4.570443, 5.272718)),
]  # fmt: skip


def respond_free_standing(
    motion: GroundMotion, p2: float, kr: float, restitution: float | None = None, **more: object
) -> Response:
    return rbfrag.respond(
        motion, kind="rocking", p2=p2, kr=kr, restitution=restitution, history=True, **more
    )


def traced(answer: Response) -> ResponseHistory:
    assert answer.history is not None
    return answer.history


def pulse(k: float, length_s: float, rest_s: float = 0.0) -> GroundMotion:
    """A rectangular pulse after some rest, and rest after it."""
    times, values = [0.0, 0.1, 0.1, 0.1 + length_s], [0.0, 0.0, k, k]
    if rest_s:
        times += [0.1 + length_s, 0.1 + length_s + rest_s]
        values += [0.0, 0.0]
    return GroundMotion.from_nodes(times, values)


@pytest.mark.parametrize("row", REFERENCE, ids=lambda row: f"{row[0][0]} {row[0][1]}")
def test_reference_values(records_dir: Path, row: tuple) -> None:
    (name, a1, a3, r3, beta, restitution, up), numbers, sense, forward, backward, impacts = row
    motion = read_motions(records_dir / "slammer_csv" / f"{name}.csv")[0]
    vertical = GroundMotion(0.4 * np.roll(motion.acceleration_g, 37), motion.dt_s) if up else None
    block = Block.from_angles(a1, a3, r3)
    run = rbfrag.respond(
        motion, kind="rocking", block=block, beta_deg=beta, phi_deg=45.0, restitution=restitution,
        vertical=vertical, history=True,
    )  # fmt: skip
    assert run.outcome is (Outcome.TOPPLED if sense else Outcome.STABLE)
    assert run.critical_angle_deg == pytest.approx(a3 - beta, rel=1e-12)
    assert run.critical_backward_deg == pytest.approx(beta - a1, rel=1e-12)
    for peak, angle_deg, expected in (
        (run.peak_forward_rad, run.critical_angle_deg, forward),
        (run.peak_backward_rad, run.critical_backward_deg, backward),
    ):
        if expected is None:
            assert peak is None
        else:
            assert peak == pytest.approx(expected * math.radians(angle_deg), rel=1e-5)
    if not sense:
        assert run.peak_theta_n == pytest.approx(max(forward, backward), rel=1e-5)
        assert run.peak_theta_rad == max(run.peak_forward_rad, run.peak_backward_rad)
    assert traced(run).impact_s[:3] == pytest.approx(impacts, abs=1e-6)
    assert not run.sensitive
    site = SupportedBlock.of(
        block, rbfrag.stability(block, beta_deg=beta, phi_deg=45.0, back_fracture=False),
        model_of_kind("rocking").mode, {"restitution": restitution},
    )  # fmt: skip
    result = free_block(site)
    answer = (result.toe.p**2, result.heel.p**2, result.toe.passed_on, result.heel.passed_on)
    assert answer == pytest.approx(numbers, rel=1e-7)


@pytest.mark.parametrize("seed", range(6))
def test_the_mirror_image_of_block_and_motion_gives_the_mirrored_answer(seed: int) -> None:
    rng = np.random.default_rng(seed)
    motion = GroundMotion(shaking(seed), 0.02)
    vertical = GroundMotion(0.3 * shaking(seed + 50), 0.02) if seed % 2 else None
    beta = float(rng.uniform(-3.0, 3.0))
    block = Block.from_angles(
        beta - rng.uniform(4.0, 15.0), beta + rng.uniform(4.0, 15.0), rng.uniform(0.3, 3.0)
    )
    single = rbfrag.respond(
        motion, kind="rocking", block=block, beta_deg=beta, vertical=vertical, history=True
    )
    other = rbfrag.respond(
        motion, kind="rocking", block=block.mirror(), beta_deg=-beta, vertical=vertical,
        polarity="reverse", history=True,
    )  # fmt: skip
    assert single.outcome is other.outcome
    assert single.started_s is not None
    assert (single.peak_theta_rad, single.peak_theta_n) == (
        other.peak_theta_rad,
        other.peak_theta_n,
    )
    assert single.peak_forward_rad == other.peak_backward_rad
    assert single.peak_backward_rad == other.peak_forward_rad
    assert (single.impacts, single.sensitive) == (other.impacts, other.sensitive)
    np.testing.assert_array_equal(traced(single).impact_s, traced(other).impact_s)
    np.testing.assert_array_equal(traced(single).theta_rad, -traced(other).theta_rad)


def test_quarter_period_and_ratio_of_speeds_are_housners() -> None:
    # so slender that sines are angles: p t = acosh(1/(1 - θ0/θc)) from a turn to the impact
    kr, p2 = 1e-5, 4.0
    history = traced(respond_free_standing(pulse(1.6 * kr, 0.35, 10.0), p2, kr, 0.9))
    rate, theta, time_s = history.theta_dot_rad_s, history.theta_rad, history.time_s
    turns = np.flatnonzero((rate == 0.0) & (theta != 0.0))
    assert turns.size >= 4
    for turn in turns[:4]:
        impact_s = history.impact_s[history.impact_s > time_s[turn]][0]
        quarter = math.acosh(1.0 / (1.0 - abs(theta[turn]) / kr)) / math.sqrt(p2)
        assert impact_s - time_s[turn] == pytest.approx(quarter, rel=1e-9)
    for impact_s in history.impact_s[:4]:
        before, after = rate[time_s == impact_s]
        assert after / before == pytest.approx(0.9, rel=1e-9)
    housner = 1.0 - 1.5 * math.sin(0.3) ** 2
    history = traced(respond_free_standing(pulse(0.5, 0.2, 5.0), p2, math.tan(0.3)))
    before, after = history.theta_dot_rad_s[history.time_s == history.impact_s[0]]
    assert after / before == pytest.approx(housner, rel=1e-9)


def test_energy_is_kept_between_impacts_and_falls_by_their_ratio() -> None:
    p2, theta_c, e = 3.0, 0.25, 0.93
    history = traced(respond_free_standing(pulse(0.4, 0.4, 8.0), p2, math.tan(theta_c), e))
    after = history.time_s > 0.5
    theta, rate = np.abs(history.theta_rad[after]), history.theta_dot_rad_s[after]
    energy = 0.5 * rate**2 + p2 * (np.cos(theta_c - theta) - math.cos(theta_c))
    number = np.searchsorted(history.impact_s, history.time_s[after], side="left")
    within = number - number.min()
    inside = ~np.isin(history.time_s[after], history.impact_s)
    assert within.max() > 6
    first = energy[inside & (within == 0)][0]
    expected = first * e ** (2.0 * within[inside])
    np.testing.assert_allclose(energy[inside], expected, rtol=1e-11, atol=2e-15)


def test_nodes_on_the_line_between_samples_change_nothing() -> None:
    samples, dt_s = shaking(5), 0.02
    time_s = dt_s * np.arange(samples.size)
    finer_s = np.unique(np.concatenate([time_s, time_s[:-1] + 0.3 * dt_s]))
    finer = GroundMotion.from_nodes(finer_s, np.interp(finer_s, time_s, samples))
    single = respond_free_standing(GroundMotion(samples, dt_s), 3.0, 0.25, 0.85)
    other = respond_free_standing(finer, 3.0, 0.25, 0.85)
    assert single.peak_forward_rad == pytest.approx(other.peak_forward_rad, rel=1e-10)
    assert single.peak_backward_rad == pytest.approx(other.peak_backward_rad, rel=1e-10)
    np.testing.assert_allclose(
        traced(single).impact_s[:20], traced(other).impact_s[:20], atol=1e-11
    )


def test_the_closed_form_after_the_record_is_what_integration_gives() -> None:
    # a stop inside the pulse in every state: rising, falling, past balance, after impacts
    outcomes = set()
    for e, first in ((None, 0.37), (0.7, 0.37), (None, 0.5), (0.8, 0.43)):
        for end_s in np.linspace(0.55, 2.6, 25):
            times = [0.0, 0.1, 0.1, 0.5, 0.5, end_s]
            values = [0.0, 0.0, first, first, -0.31, -0.31]
            record = GroundMotion.from_nodes(times, values)
            longer = GroundMotion.from_nodes([*times, end_s, end_s + 40.0], [*values, 0.0, 0.0])
            short, long = (
                respond_free_standing(record, 6.0, 0.22, e),
                respond_free_standing(longer, 6.0, 0.22, e),
            )
            outcomes.add((short.outcome, short.peak_forward_rad is None))
            assert short.outcome is long.outcome
            for ours, theirs in (
                (short.peak_forward_rad, long.peak_forward_rad),
                (short.peak_backward_rad, long.peak_backward_rad),
            ):
                assert (ours is None) == (theirs is None)
                if ours is not None and short.outcome is Outcome.STABLE:
                    assert ours == pytest.approx(theirs, rel=1e-10)
    assert len(outcomes) == 3  # stays, falls forward, falls backward


def test_without_restitution_a_block_that_cannot_turn_back_topples_as_a_backed_one() -> None:
    block = Block.from_angles(-80.0, 9.0, 0.8)
    kr = math.tan(math.radians(9.0))
    outcomes = set()
    for seed in range(8):
        for scale in (0.5, 0.9, 1.4, 2.2):
            motion = GroundMotion(scale * shaking(seed), 0.02)
            free_one = rbfrag.respond(
                motion, kind="rocking", block=block, beta_deg=0.0, restitution=1e-12
            )
            backed = rbfrag.respond(motion, p2=block.p2, kr=kr)
            outcomes.add(backed.outcome)
            assert free_one.outcome is backed.outcome
            assert free_one.started_s == pytest.approx(backed.started_s, rel=1e-12)
            assert free_one.peak_backward_rad == 0.0
            if backed.peak_theta_rad is not None:
                assert free_one.peak_forward_rad == pytest.approx(backed.peak_theta_rad, rel=1e-9)
    assert outcomes == {Outcome.STABLE, Outcome.TOPPLED}


def test_an_independent_integrator_agrees() -> None:
    motions = tuple(GroundMotion(shaking(seed, npts=350), 0.02) for seed in range(4))
    runs = [compare(item) for item in draw(Records(motions, "made up"), 8, seed=3)]
    certain = [run for run in runs if not run.sensitive]
    assert len(certain) >= 6
    assert all(run.impacts >= 0 for run in runs)
    for run in certain:
        assert run.same
        if not math.isnan(run.deviation) and run.impacts <= 30:
            assert run.deviation < (1e-8 if run.impacts <= 10 else 1e-5)
    assert sum(not math.isnan(run.deviation) for run in certain) >= 2


@pytest.mark.parametrize("seed", range(8))
def test_the_error_estimate_covers_the_error_of_coarse_steps(seed: int) -> None:
    excited = excitation(GroundMotion(shaking(seed), 0.02))
    block = free_block(block_of_numbers(10.0, 0.3, {"restitution": 0.8}))
    exact = simulate(excited, block)
    coarse = simulate(excited, block, order=4, ph_max=0.2)
    if exact.side or coarse.side:
        assert exact.side == coarse.side
        return
    assert exact.impacts > 3
    for ours, truth in ((coarse.forward, exact.forward), (coarse.backward, exact.backward)):
        assert 0.0 < abs(ours.x - truth.x) <= 2.0 * ours.error
        assert truth.error < 1e-9


def test_a_block_at_its_border_is_sensitive() -> None:
    motion = GroundMotion(shaking(3), 0.02)
    low, high = 0.02, 3.0
    while high - low > 1e-8 * low:
        middle = 0.5 * (low + high)
        stays = respond_free_standing(motion, 3.0, middle, 0.8).outcome is Outcome.STABLE
        low, high = (low, middle) if stays else (middle, high)
    border = respond_free_standing(motion, 3.0, high, 0.8)
    assert border.outcome is Outcome.STABLE
    assert border.sensitive
    assert any("sensitive" in warning for warning in border.warnings)
    assert not respond_free_standing(motion, 3.0, 2.0 * high, 0.8).sensitive


def test_a_batch_gives_each_block_what_its_own_run_gives() -> None:
    excited = excitation(GroundMotion(0.8 * shaking(5), 0.02))
    blocks = [
        free_block(block_of_numbers(p2, kr, {}))
        for p2 in (30.0, 1.0)
        for kr in np.geomspace(0.02, 0.6, 12).tolist()
    ]
    outcome, theta_n, sensitive = simulate_free(
        excited,
        np.array([(block.toe, block.heel) for block in blocks]),
        np.array([block.rest_speed for block in blocks]),
        most_impacts=MOST_IMPACTS,
        change=SENSITIVITY,
    )
    for i, block in enumerate(blocks):
        alone = simulate(excited, block)
        assert outcome[i] == alone.outcome
        assert sensitive[i] == repeated(excited, block, alone)[0]
        if alone.outcome == 0:
            ratios = (alone.forward.x, alone.backward.x)
            assert theta_n[i] == max(ratios) / block.toe.theta_c
        else:
            assert np.isnan(theta_n[i])
    assert 0 < (outcome == 1).sum() < len(blocks)


def test_a_polygon_answers_as_the_rectangle_it_is() -> None:
    motion = GroundMotion(shaking(2), 0.02)
    corners = [(0.0, 0.0), (0.4, 0.0), (0.4, 1.2), (0.2, 1.2), (0.0, 1.2)]
    polygon = Block.from_polygon(corners, heel=0, back=4, toe=1, gamma_deg=90.0)
    single, other, numbers = (
        rbfrag.respond(motion, kind="rocking", **subject)
        for subject in (
            {"block": polygon, "beta_deg": 0.0},
            {"block": Block.rectangle(1.2, 0.4), "beta_deg": 0.0},
            {"p2": Block.rectangle(1.2, 0.4).p2, "kr": 0.4 / 1.2},
        )
    )
    assert single.outcome is other.outcome is numbers.outcome is Outcome.STABLE
    assert single.impacts > 0
    assert single.peak_forward_rad == pytest.approx(other.peak_forward_rad, rel=1e-9)
    assert numbers.peak_forward_rad == pytest.approx(other.peak_forward_rad, rel=1e-9)


def test_the_pose_turns_about_the_corner_that_the_block_stands_on() -> None:
    block = Block.from_angles(-7.0, 9.0, 1.0)
    motion = GroundMotion(shaking(2), 0.02)
    history = traced(
        rbfrag.respond(motion, kind="rocking", block=block, beta_deg=1.0, history=True)
    )
    assert history.centroid_m is not None
    forward = history.theta_rad >= 0.0
    assert forward.any()
    assert not forward.all()
    pivot = np.where(forward[:, None], [block.base_m, 0.0], [0.0, 0.0])
    arm = np.linalg.norm(history.centroid_m - pivot, axis=1)
    np.testing.assert_allclose(arm, np.where(forward, block.r3_m, block.r1_m), rtol=1e-12)
    assert history.turned_rad is not None
    np.testing.assert_array_equal(history.turned_rad, -history.theta_rad)


def test_the_force_on_the_corner_is_that_of_the_motion_of_the_centroid() -> None:
    g, dt_s, beta = 9.80665, 0.0005, 4.0
    t = dt_s * np.arange(2400)
    motion = GroundMotion(0.35 * np.sin(2.0 * np.pi * t / 0.9), dt_s)
    vertical = GroundMotion(0.2 * np.sin(2.0 * np.pi * t / 0.4), dt_s)
    block = Block.from_angles(-9.0, 14.0, 1.0)
    answer = rbfrag.respond(
        motion, kind="rocking", block=block, beta_deg=beta, vertical=vertical, history=True
    )
    history = traced(answer)
    at = np.flatnonzero(np.isin(history.time_s, t))
    at = at[np.unique(history.time_s[at], return_index=True)[1]]
    time_s, centroid = history.time_s[at], history.centroid_m[at]
    pull = (centroid[2:] - 2.0 * centroid[1:-1] + centroid[:-2]) / dt_s**2
    k_h, w = history.k_h[at][1:-1], 1.0 + history.k_v[at][1:-1]
    cb, sb = math.cos(math.radians(beta)), math.sin(math.radians(beta))
    along = pull[:, 0] / g - (w * sb + k_h * cb)
    across = pull[:, 1] / g + (w * cb - k_h * sb)
    events = np.concatenate(
        [history.impact_s, history.time_s[np.flatnonzero(history.theta_dot_rad_s)[[0]]]]
    )
    away = np.abs(time_s[1:-1, None] - events).min(axis=1) > 3.0 * dt_s
    moves = away & (history.theta_rad[at][1:-1] != 0.0)
    assert moves.sum() > 500
    needed = (np.abs(along) / across)[moves].max()
    site = SupportedBlock.of(
        block, rbfrag.stability(block, beta_deg=beta, phi_deg=45.0, back_fracture=False),
        model_of_kind("rocking").mode, {},
    )  # fmt: skip
    result = free_block(site)
    excited = excitation(motion, vertical)
    shown = rocking_history(excited, result, answer.impacts)
    force = corner_force(result, shown, math.inf, float(time_s[-1]))
    assert force.slips_s is None
    assert force.friction == pytest.approx(needed, rel=0.01)


def test_friction_warns_and_does_not_reject() -> None:
    motion = GroundMotion(shaking(2), 0.02)
    block = Block.from_angles(-9.0, 9.0, 1.0)
    for phi_deg, slips in ((60.0, False), (12.0, True), (5.0, True)):
        answer = rbfrag.respond(motion, kind="rocking", block=block, beta_deg=0.0, phi_deg=phi_deg)
        assert answer.started_s is not None
        assert any("friction does not hold" in text for text in answer.warnings) == slips
    assert any("the mode of the block is slide" in text for text in answer.warnings)


def test_a_stocky_block_comes_to_rest_at_every_impact() -> None:
    answer = respond_free_standing(pulse(3.0, 0.2, 3.0), 5.0, 2.0)
    assert answer.outcome is Outcome.STABLE
    assert answer.impacts == 1
    assert answer.peak_backward_rad == 0.0
    assert any("stocky" in text for text in answer.warnings)


def test_without_a_back_plane_a_block_that_topples_rocks() -> None:
    motion = GroundMotion(shaking(3), 0.02)
    block = Block.from_angles(-9.0, 9.0, 1.0)
    planes = {"beta_deg": 0.0, "phi_deg": 35.0}
    assert rbfrag.respond(motion, block=block, **planes).kind == "toppling"
    alone = rbfrag.respond(motion, block=block, back_fracture=False, **planes)
    assert alone.kind == "rocking"
    assert alone.impacts > 0
    backed = rbfrag.respond(motion, block=block, back_fracture=False, kind="toppling", **planes)
    assert any("no plane backs the block" in text for text in backed.warnings)
    assert not any("no plane backs" in text for text in alone.warnings)
    document = classify_block(
        {"block": block, **planes, "back_fracture": False}, "toppling"
    ).remarks
    assert any("no plane backs" in text for text in document)
    assert rbfrag.respond(motion, p2=3.0, kr=0.2).kind == "toppling"
    flat = Block.from_fractures(1.0, 2.0, 90.0)
    slides = rbfrag.respond(motion, block=flat, beta_deg=20.0, phi_deg=30.0, back_fracture=False)
    assert slides.kind == "sliding"


def test_a_throw_is_reported() -> None:
    motion = GroundMotion(shaking(3), 0.02)
    samples = np.zeros(600)
    samples[260] = -1.2
    answer = respond_free_standing(motion, 3.0, 0.3, vertical=GroundMotion(samples, 0.02))
    assert answer.outcome is Outcome.JUMP
    assert (answer.peak_theta_rad, answer.peak_forward_rad, answer.toppled_s) == (None, None, None)
    assert any("throws" in text for text in answer.warnings)


@pytest.mark.parametrize(
    ("inputs", "words"),
    [
        ({"p2": 3.0, "kr": 0.2, "restitution": 0.0}, "restitution = 0: give the coefficient"),
        ({"p2": 3.0, "kr": 0.2, "restitution": 1.01}, "above 0 and up to 1"),
        ({"p2": 3.0, "kr": 0.2, "restitution": math.nan}, "restitution = nan is not finite"),
        ({"p2": 3.0, "kr": -0.2}, "kr = -0.2 is not above zero"),
        ({"p2": 3.0}, "kr is missing"),
        ({"p2": 3.0, "kr": 0.2, "beta_deg": 2.0}, "beta_deg cannot be combined with p2 and kr"),
        ({"block": Block.from_angles(2.0, 9.0, 1.0), "beta_deg": 0.0}, "backward over its heel"),
        ({"block": Block.from_angles(-9.0, 9.0, 1.0), "beta_deg": 9.5}, "forward over its toe"),
        ({"block": Block.from_angles(-9.0, 80.0, 1.0), "beta_deg": -11.0}, "overturns backward"),
        ({"block": Block.from_angles(-70.0, 80.0, 1.0), "beta_deg": -15.0}, "below 90 degrees"),
        ({"block": Block.from_angles(-9.0, 9.0, 1.0)}, "beta_deg is missing"),
        (
            {
                "block": Block.from_angles(-9.0, 9.0, 1.0), "beta_deg": 0.0, "phi_deg": 30.0,
                "cohesion_pa": 1e3, "density_kg_m3": 2700.0,
            },
            "cohesion_pa cannot be combined with rocking",
        ),
    ],
)  # fmt: skip
def test_what_no_model_covers_is_rejected(inputs: dict, words: str) -> None:
    motion = GroundMotion(shaking(3), 0.02)
    with pytest.raises(InputError, match=words):
        rbfrag.respond(motion, kind="rocking", **inputs)


def test_restitution_is_an_option_of_this_kind_alone() -> None:
    motion = GroundMotion(shaking(3), 0.02)
    with pytest.raises(InputError, match="restitution cannot be combined with kind toppling"):
        rbfrag.respond(motion, p2=3.0, kr=0.2, restitution=0.9)


def test_there_is_no_critical_value() -> None:
    motion = GroundMotion(shaking(3), 0.02)
    with pytest.raises(InputError, match=r"kind rocking .* 122 islands"):
        rbfrag.critical(motion, kind="rocking", p2=3.0)


def test_a_toppling_answer_compiles_no_kernel_of_two_corners() -> None:
    code = (
        "import numpy as np, rbfrag\n"
        "motion = rbfrag.GroundMotion(0.3 * np.sin(np.arange(200) * 0.1), 0.02)\n"
        "rbfrag.respond(motion, p2=3.0, kr=0.2)\n"
        "from rbfrag.solver.integrator.rocking_kernel import run_rocking\n"
        "assert run_rocking.signatures == []\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
