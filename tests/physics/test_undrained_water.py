"""Water that keeps acting while a block moves: closed forms, and the equations of rigid bodies."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from rbfrag import (
    Block,
    BlockArray,
    GroundMotion,
    InputError,
    critical,
    respond,
    stability,
    stability_arrays,
)
from rbfrag.solver.excitation import excitation
from rbfrag.solver.free_motion import Release, corner_at, free_motion
from rbfrag.solver.integrator.one_freedom.equation import Pose
from rbfrag.solver.kind import SupportedBlock
from rbfrag.solver.stability.joint import IS_DRAINED, STAYS_UNDRAINED
from rbfrag.solver.stability.validity import moment_about_toe, toe_needs_deg
from rbfrag.solver.toppling_run import respond as topple
from tests.physics.pulses import half_sines, rectangle, smooth_noise

G = 9.80665

SLIDE = {"block": Block.from_fractures(2.0, 3.0, 60.0), "beta_deg": 20.0, "phi_deg": 38.0}
WATER = {"water_m": 1.1372, "density_kg_m3": 2650.0}


@pytest.mark.parametrize(
    ("peak_g", "length_s", "slid_m"),
    [(0.5, 0.4, 0.611435158582149), (0.4, 0.6, 0.7100321918523677)],  # P17, P18
)
def test_a_wet_slide_under_a_rectangular_pulse(
    peak_g: float, length_s: float, slid_m: float
) -> None:
    """D = F A g T²/2 (A/k_y - 1), with the factor of the dry block."""
    answer = respond(rectangle(length_s, peak_g), **SLIDE, **WATER)
    ky = stability(**SLIDE, **WATER).ky
    assert ky == pytest.approx(0.2181973617547316, rel=1e-12)
    factor = math.cos(math.radians(18.0)) / math.cos(math.radians(38.0))
    assert answer.displacement_m == pytest.approx(slid_m, rel=1e-12)
    closed = factor * peak_g * G * length_s**2 / 2.0 * (peak_g / ky - 1.0)
    assert answer.displacement_m == pytest.approx(closed, rel=1e-12)
    assert answer.drained is not None
    assert answer.drained.yield_acceleration == stability(**SLIDE).ky
    assert STAYS_UNDRAINED in answer.warnings


def test_a_drained_block_is_a_dry_one() -> None:
    motion = rectangle(0.4, 0.5)
    drained = respond(motion, **SLIDE, **WATER, drainage="drained")
    dry = respond(motion, **SLIDE)
    assert drained.displacement_m == dry.displacement_m
    assert IS_DRAINED in drained.warnings
    assert dry.drained is None
    assert drained.drained == respond(motion, **SLIDE, **WATER).drained
    with pytest.raises(InputError, match="drainage = 'wet': it must be undrained or drained"):
        respond(motion, **SLIDE, **WATER, drainage="wet")


@pytest.mark.parametrize(
    ("block", "beta_deg", "phi_deg"),
    [
        (Block.from_fractures(2.0, 3.0, 60.0), 20.0, 38.0),
        (Block.from_angles(5.0, 60.0, 1.0), 15.0, 30.0),
        (Block.rectangle(4.0, 1.6), 5.0, 45.0),
        (Block.rectangle(2.0, 1.0), 5.0, 30.0),
        (Block.from_angles(45.0, 65.0, 1.0), 5.0, 35.0),
        (Block.from_angles(-40.0, 20.0, 1.0), 5.0, 30.0),
    ],
    ids=["slides", "slides and tips", "topples", "toe slips", "slumps", "topples confined"],
)
def test_answers_have_no_jump_at_a_water_depth_of_zero(
    block: Block, beta_deg: float, phi_deg: float
) -> None:
    """A depth of 1e-7 m, undrained, and any depth, drained, are the dry block: 200 records."""
    planes = {"block": block, "beta_deg": beta_deg, "phi_deg": phi_deg, "density_kg_m3": 2650.0}
    for seed in range(200):
        motion = smooth_noise(seed)
        dry = respond(motion, **planes)
        wet = respond(motion, **planes, water_m=1e-7)
        assert wet.outcome == dry.outcome
        for name in ("peak_theta_rad", "peak_displacement_m"):
            expected = getattr(dry, name)
            if expected is not None:
                assert dry.error_estimate is not None
                error = dry.error_estimate + 1e-6
                assert getattr(wet, name) == pytest.approx(expected, rel=0.0, abs=error)
        if seed % 5 == 0:
            drained = respond(motion, **planes, water_m=0.5, drainage="drained")
            assert drained.peak_theta_rad == dry.peak_theta_rad
            assert drained.peak_displacement_m == dry.peak_displacement_m


@pytest.mark.parametrize(
    ("height_m", "width_m", "beta_deg", "water_m", "period_s", "kr", "amplitude_g"),
    [
        (4.0, 2.0, 20.0, 1.0, 1.0, 0.083353, 0.36308),  # P19
        (4.0, 1.6, 5.0, 1.5, 0.8, 0.250099, 1.47103),  # P20
        (2.0, 0.9, 10.0, 0.8, 0.5, 0.194690, 1.37674),  # P21
        (8.0, 3.0, 8.0, 3.0, 2.0, 0.172413, 0.48941),  # P22
    ],
)
def test_a_wet_topple_is_conservative_by_up_to_two_per_cent(
    height_m: float, width_m: float, beta_deg: float, water_m: float, period_s: float, kr: float,
    amplitude_g: float,
) -> None:  # fmt: skip
    """(k_r wet, p²) against the constant moment: θ'' = p² [k cos(θc - θ) - sin(θc - θ) + m0]."""
    block = Block.rectangle(height_m, width_m)
    result = stability(
        block, beta_deg=beta_deg, phi_deg=45.0, water_m=water_m, density_kg_m3=2700.0
    )
    assert result.kr == pytest.approx(kr, abs=1e-6)
    time_s = np.linspace(0.0, period_s, 401)
    wave = np.sin(2.0 * np.pi * time_s / period_s)

    def topples(amplitude: float) -> bool:
        motion = GroundMotion(amplitude * wave, period_s / 400)
        assert result.kr is not None
        return topple(motion, p2=block.p2, kr=result.kr).outcome == "toppled"

    low, high = 0.5 * amplitude_g, 2.0 * amplitude_g
    while high - low > 1e-5 * amplitude_g:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if topples(middle) else (middle, high)
    assert -0.02 <= high / amplitude_g - 1.0 <= 0.0
    # and the reference itself, by an integrator that shares nothing with this one
    theta_c, m0 = math.radians(block.alpha3_deg - beta_deg), moment_about_toe(block, result.push)

    def falls(amplitude: float) -> bool:
        def rates(t: float, y: list[float]) -> list[float]:
            k = amplitude * math.sin(2.0 * math.pi * t / period_s) if t < period_s else 0.0
            remaining = theta_c - y[0]
            return [y[1], block.p2 * (k * math.cos(remaining) - math.sin(remaining) + m0)]

        begins = math.asin(kr / amplitude) * period_s / (2.0 * math.pi)

        def returns(_: float, y: list[float]) -> float:
            return y[0] + 1e-9

        def past(_: float, y: list[float]) -> float:
            return y[0] - 2.0 * theta_c

        returns.terminal = past.terminal = True  # type: ignore[attr-defined]
        returns.direction = -1.0  # type: ignore[attr-defined]
        run = solve_ivp(rates, (begins, 20.0), [0.0, 0.0], method="DOP853", rtol=1e-9, atol=1e-12,
                        max_step=0.02, events=(returns, past))  # fmt: skip
        return bool(run.t_events[1].size)

    assert falls(1.002 * amplitude_g)
    assert not falls(0.998 * amplitude_g)


TWO_CONTACTS = [
    ((45.0, 65.0, 1.0), 35.0, 35.0, 0.4, (0.75, 0.3), 0.264695467, 0.0850631402, "slump"),  # P23
    ((50.0, 72.0, 2.0), 35.0, 20.0, 0.8, (0.6, 0.3), 0.185338656, 0.033344342, "slump"),  # P24
    ((-40.0, 20.0, 1.0), 30.0, 30.0, 0.5, (0.6, 0.3), 0.365664613, 0.0290601318,
     "confined_topple"),  # P25
    ((-60.0, 20.0, 1.5), 35.0, 10.0, 0.8, (0.55, 0.3), 0.491553095, 0.000683254125,
     "confined_topple"),  # P26
]  # fmt: skip


@pytest.mark.parametrize(
    ("shape", "phi_deg", "phi_back_deg", "water_m", "pulse", "k", "peak_rad", "mode"), TWO_CONTACTS
)
def test_wet_blocks_on_two_contacts(
    shape: tuple[float, float, float], phi_deg: float, phi_back_deg: float, water_m: float,
    pulse: tuple[float, float], k: float, peak_rad: float, mode: str,
) -> None:  # fmt: skip
    block = Block.from_angles(*shape)
    planes = {
        "beta_deg": 5.0, "phi_deg": phi_deg, "phi_back_deg": phi_back_deg, "water_m": water_m,
        "density_kg_m3": 2600.0,
    }  # fmt: skip
    judged = stability(block, **planes)
    assert judged.mode == mode
    assert judged.yield_acceleration == pytest.approx(k, abs=1e-9)
    motion = half_sines((pulse,))
    answer = respond(motion, block=block, **planes)
    assert answer.peak_theta_rad == pytest.approx(peak_rad, rel=1e-6)
    # the free body with the same push, which knows nothing of mechanisms
    site = SupportedBlock.of(block, judged, judged.mode, {})
    release = Release(0.0, Pose(0.0, corner_at((0.0, 0.0), 0.0, block.centroid), 0.0))
    free_standing = free_motion(site, excitation(motion), release)
    error = free_standing.step_error.rotation_rad
    peak = max(free_standing.backward_rad, free_standing.forward_rad)
    assert peak == pytest.approx(peak_rad, abs=2.0 * error + 1e-6)


@pytest.mark.parametrize(
    ("width_m", "beta_deg", "water_m", "needs_deg"),
    [(2.0, 20.0, 1.0, 34.27), (1.6, 5.0, 1.5, 28.11)],  # P27, P28
)
def test_the_toe_of_a_wet_block(
    width_m: float, beta_deg: float, water_m: float, needs_deg: float
) -> None:
    block = Block.rectangle(4.0, width_m)
    on = {"beta_deg": beta_deg, "phi_back_deg": 0.0, "water_m": water_m, "density_kg_m3": 2700.0}
    push = stability(block, phi_deg=60.0, **on).push
    assert toe_needs_deg(block, beta_deg, 0.6, push) == pytest.approx(needs_deg, abs=0.02)
    # the free body slips below it and holds above it
    step = GroundMotion.from_nodes([0.0, 0.0, 0.05], [0.0, 0.6, 0.6])
    for less_deg, slips in ((0.3, True), (-0.3, False)):
        judged = stability(block, phi_deg=needs_deg - less_deg, **on)
        site = SupportedBlock.of(block, judged, judged.mode, {})
        release = Release(0.0, Pose(0.0, block.centroid, 0.0))
        free_standing = free_motion(site, excitation(step), release, at_toe=True)
        at_once = free_standing.history.time_s < 0.01
        assert (abs(free_standing.history.slip_m[at_once]).max() > 1e-8) == slips


def test_arrays_have_the_drained_bound_too() -> None:
    shapes = BlockArray.from_fractures([2.0] * 3, [3.0] * 3, [60.0] * 3)
    many = stability_arrays(
        shapes, beta_deg=20.0, phi_deg=38.0, water_m=1.1372,
        drainage=np.array(["undrained", "drained", ""]),
    )  # fmt: skip
    dry, wet = stability(**SLIDE).ky, stability(**SLIDE, **WATER).ky
    assert many.yield_acceleration == pytest.approx([wet, dry, wet], rel=1e-14)


def test_cohesion_has_no_effect_on_a_topple_and_that_is_said() -> None:
    topple_on = {"block": Block.rectangle(4.0, 1.0), "beta_deg": 5.0, "phi_deg": 40.0}
    bonded = stability(**topple_on, cohesion_pa=5e4)
    assert bonded.kr == stability(**topple_on).kr
    assert any("cohesion has no effect on k_r" in text for text in bonded.warnings)
    assert any("2,650" in text for text in bonded.warnings)


def test_a_wet_slump_fails_under_a_weaker_record() -> None:
    block, motion = Block.from_angles(45.0, 65.0, 1.0), half_sines(((0.75, 0.3),))
    planes = {"beta_deg": 5.0, "phi_deg": 35.0, "rotation_deg": 3.0}
    dry = critical(motion, block=block, **planes)
    wet = critical(motion, block=block, **planes, water_m=0.4, density_kg_m3=2600.0)
    drained = critical(motion, block=block, **planes, water_m=0.4, drainage="drained")
    assert wet.scale < dry.scale
    assert drained.scale == dry.scale
