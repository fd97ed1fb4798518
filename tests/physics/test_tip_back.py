"""Slides tipped back by pulses into the slope, and blocks driven up their back plane.

Reference values are those of an independent body on springs (contact stiffness 1e8 per mass,
damping 0.7, step 2.5e-6 s). The second number is the error estimate of the first implementation,
which that of the answer must not exceed by half.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import rbfrag
from rbfrag import Block, GroundMotion, InputError, respond
from rbfrag.solver.models.sliding import KY_ALONE, MAY_SLIDE_UP, MAY_TIP
from rbfrag.solver.simulation import FAILS_BY_SOME_LAWS
from tests.conftest import missing
from tests.physics.pulses import half_sines, smooth_noise

FIRST = ((0.9, 0.3), (-0.6, 0.25), (0.7, 0.3), (-0.5, 0.25))
SECOND = ((0.8, 0.25), (-0.45, 0.3), (0.8, 0.25))
THIRD = ((0.42, 0.2), (-0.6, 0.35)) * 3 + ((0.42, 0.2),)

CASES = Path(__file__).resolve().parents[2] / ".." / "shared" / "cases4" / "physics"


@pytest.fixture(scope="module")
def cases_dir() -> Path:
    if not CASES.is_dir():
        missing(f"no cases at {CASES}")
    return CASES


@pytest.mark.parametrize(
    ("alpha1_deg", "phi_deg", "r3_m", "pulses", "peak_m", "estimate_m"),
    [
        (19.999999, 30.0, 1.0, FIRST, 0.5633, 0.0358),  # P01
        (20.000001, 30.0, 1.0, FIRST, 0.5633, 0.0358),  # P02
        (17.0, 30.0, 1.0, FIRST, 0.5854, 0.0415),  # P03
        (14.0, 30.0, 1.0, FIRST, 0.6044, 0.0280),  # P04
        (14.0, 30.0, 1.0, SECOND, 0.5021, 0.1414),  # P05
        (5.0, 30.0, 1.0, SECOND, 0.6442, 0.0622),  # P06
        (14.0, 33.0, 1.0, THIRD, 0.1465, 0.0672),  # P07
        (5.0, 33.0, 1.0, THIRD, 0.213, 0.0689),  # P08
        (14.0, 33.0, 3.0, THIRD, 0.1558, 0.0775),  # P09
    ],
)
def test_slides_that_tip_back_against_a_body_on_springs(
    alpha1_deg: float, phi_deg: float, r3_m: float, pulses: tuple[tuple[float, float], ...],
    peak_m: float, estimate_m: float,
) -> None:  # fmt: skip
    block = Block.from_angles(alpha1_deg, 55.0, r3_m)
    answer = respond(half_sines(pulses), block=block, beta_deg=20.0, phi_deg=phi_deg)
    assert answer.error_estimate is not None
    assert answer.error_estimate <= 1.5 * estimate_m
    assert answer.peak_displacement_m == pytest.approx(peak_m, abs=answer.error_estimate)
    assert answer.mode_changes[0].motion == "tips about its heel"
    assert answer.final_mode == "slide"


def test_a_block_that_slides_up_its_base_before_it_tips_is_newmarks() -> None:
    """P10: α1 < -φ."""
    block = Block.from_angles(-40.0, 55.0, 1.0)
    answer = respond(half_sines(THIRD), block=block, beta_deg=20.0, phi_deg=33.0)
    assert answer.peak_displacement_m == pytest.approx(0.07947548711946247, rel=1e-12)
    assert answer.mode_changes == ()
    by_number = respond(half_sines(THIRD), ky=math.tan(math.radians(13.0)), beta_deg=20.0)
    assert by_number.peak_displacement_m == pytest.approx(0.07947548711946247, rel=1e-12)
    assert KY_ALONE in by_number.warnings


def test_a_block_driven_up_its_back_plane_against_a_body_on_springs() -> None:
    """P11: a slump whose rotation the mechanism alone makes 20 times too small."""
    time_s = np.arange(0.0, 3.0 + 1e-9, 0.005)
    samples = np.zeros(time_s.size)
    for peak_g, start_s, length_s in ((-1.2, 0.2, 0.3), (0.52, 0.52, 0.33)):
        inside = (time_s >= start_s) & (time_s <= start_s + length_s)
        samples[inside] += peak_g * np.sin(np.pi * (time_s[inside] - start_s) / length_s)
    answer = respond(
        GroundMotion(samples, 0.005), block=Block.from_angles(38.9, 75.5, 0.57), beta_deg=6.8,
        phi_deg=32.4, phi_back_deg=10.6,
    )  # fmt: skip
    assert answer.error_estimate is not None
    assert answer.error_estimate <= 1.5 * 0.02945
    assert answer.peak_theta_rad == pytest.approx(0.0682, abs=answer.error_estimate)
    assert not any("not followed" in text for text in answer.warnings)


def test_a_slide_driven_up_its_back_plane_before_it_has_slid(cases_dir: Path) -> None:
    """P12."""
    case = np.load(cases_dir / "a2_beyond_54_66.npz")
    alpha1, alpha3, phi, phi_back, beta, r3 = case["p"]
    answer = respond(
        GroundMotion.from_nodes(case["t"], case["a"]), block=Block.from_angles(alpha1, alpha3, r3),
        beta_deg=beta, phi_deg=phi, phi_back_deg=phi_back,
    )  # fmt: skip
    assert answer.error_estimate is not None
    assert answer.error_estimate <= 1.5 * 0.0071
    assert answer.peak_displacement_m == pytest.approx(0.0046, abs=answer.error_estimate)


def test_a_sequence_continues_each_law_of_impact_from_its_own_place(cases_dir: Path) -> None:
    """P15: whether the block fails depends on the law, in the joined record and in the sequence."""
    case = np.load(cases_dir / "a11_30.npz")
    alpha1, alpha3, phi, phi_back, beta, r3 = case["p"]
    block = Block.from_angles(alpha1, alpha3, r3)
    planes = {"beta_deg": beta, "phi_deg": phi, "phi_back_deg": phi_back}
    motions = [
        GroundMotion.from_nodes(case["t1"], case["x1"]),
        GroundMotion.from_nodes(case["t2"], case["x2"]),
    ]
    joined = respond(GroundMotion.from_nodes(case["t"], case["a"]), block=block, **planes)
    sequence = respond(motions, block=block, gap_s=8.0, **planes)
    assert joined.error_estimate is None
    assert sequence.error_estimate is None
    assert any(FAILS_BY_SOME_LAWS in text for text in sequence.warnings)


def test_options_that_do_not_tip_warn_where_the_record_reaches_the_threshold() -> None:
    block = Block.from_angles(5.0, 55.0, 1.0)
    strong, weak = half_sines(SECOND), half_sines(((0.8, 0.25), (-0.2, 0.3)))
    for setting in ({"two_way": True}, {"horizontal": True}):
        planes = {"block": block, "beta_deg": 20.0, "phi_deg": 30.0, **setting}
        # tan(20° - 5°) = 0.268
        assert MAY_TIP in respond(strong, **planes).warnings
        assert MAY_TIP not in respond(weak, **planes).warnings


def test_without_a_back_plane_a_block_tips_from_its_first_place() -> None:
    block = Block.from_angles(-20.0, 55.0, 1.0)
    motion = half_sines(((-1.2, 0.2),))
    planes = {"block": block, "beta_deg": 0.0, "phi_deg": 33.0}
    unbacked = respond(motion, **planes, kind="sliding", back_fracture=False)
    assert unbacked.mode_changes[0].motion == "tips about its heel"
    assert unbacked.started_s is not None
    assert unbacked.started_s < 0.2
    assert respond(motion, **planes).started_s is None


def test_accelerations_next_to_the_smallest_numbers_end_undetermined() -> None:
    """P13."""
    samples = np.random.default_rng(0).normal(size=600)
    motion = GroundMotion(samples * (1e-200 / np.abs(samples).max()), 0.01)
    assert respond(motion, ky=1e-202).outcome == "undetermined"
    search = rbfrag.critical(motion.scaled(1e40), displacement_m=0.05)
    assert (search.status, search.certified) == ("outside_model", False)


def test_a_pga_beyond_any_earthquake_is_rejected() -> None:
    """P16."""
    samples = np.zeros(200)
    samples[100] = 1e6
    with pytest.raises(InputError, match="PGA is 1e\\+06 g: check the unit"):
        respond(GroundMotion(samples, 0.01), p2=3.0, kr=0.15)


def test_a_column_of_water_does_not_change_a_dry_block() -> None:
    """P14: a cohesive confined block, alone, and in arrays with a water column of zero."""
    from rbfrag import BlockArray, stability, stability_arrays

    shape = (-68.68676049507266, 37.129644043572995, 0.15677139284049374)
    planes = {
        "beta_deg": 40.82327036735231, "phi_deg": 37.129644043572995,
        "phi_back_deg": 39.737403288094036, "kv": 0.7876556560565494,
        "cohesion_pa": 58993.54835376438, "density_kg_m3": 3122.7523116036564,
    }  # fmt: skip
    alone = stability(Block.from_angles(*shape), **planes).yield_acceleration
    assert alone == pytest.approx(7.436433841813929, rel=1e-12)
    many = stability_arrays(
        BlockArray.from_angles(*([value] for value in shape)),
        **{name: [value] for name, value in planes.items()}, water_m=[0.0],
    )  # fmt: skip
    assert many.yield_acceleration[0] == pytest.approx(7.436433841813929, rel=1e-12)


def assert_continuous(motions: tuple[GroundMotion, GroundMotion], *alphas_deg: float) -> bool:
    """Compare two blocks on a base of 15° with 30° of friction; whether they move."""
    low, high = (
        respond(motion, block=Block.from_angles(alpha, 60.0, 1.0), beta_deg=15.0, phi_deg=30.0)
        for motion, alpha in zip(motions, alphas_deg, strict=True)
    )
    assert low.outcome == high.outcome
    if low.peak_displacement_m is None or high.peak_displacement_m is None:
        return True
    errors = (low.error_estimate, high.error_estimate)
    if None not in errors:
        jump = abs(low.peak_displacement_m - high.peak_displacement_m)
        assert jump <= max(error for error in errors if error is not None) + 1e-6
    return low.peak_displacement_m > 0.0


@pytest.mark.parametrize("boundary", ["alpha1 = beta", "alpha1 = -phi", "threshold", "first slip"])
def test_displacements_have_no_jump_at_a_boundary(boundary: str) -> None:
    moves = 0
    for seed in range(200):
        motion = smooth_noise(seed)
        # at the threshold the greatest pulse into the slope just tips the block
        tips_deg = 15.0 + math.degrees(math.atan(motion.acceleration_g.min()))
        alpha1 = {"alpha1 = beta": 15.0, "alpha1 = -phi": -30.0}.get(boundary, max(tips_deg, -29.0))
        below, above = alpha1 - 1e-6, alpha1 + 1e-6
        motions = (motion, motion)
        if boundary == "first slip":
            # the record just reaches the yield: a block that has not slid leans on its back plane
            reach = math.tan(math.radians(15.0)) / motion.acceleration_g.max()
            motions = (motion.scaled(reach * (1.0 - 1e-9)), motion.scaled(reach * (1.0 + 1e-9)))
            below = above = 5.0
        moves += assert_continuous(motions, below, above)
    assert moves > 150 or boundary == "first slip"


def test_slip_up_the_base_is_what_a_block_neglects_beyond_its_boundary() -> None:
    """α1 = -φ is the one boundary with a jump: with α1 <= -φ slip up the base is neglected.

    Only records above tan(φ + β) = 1 g into the slope cause it, the answer carries a note, the
    displacement is not less than beyond the boundary, and with `two_way` there is no jump.
    """
    planes = {"beta_deg": 15.0, "phi_deg": 30.0}
    jumps = 0
    for seed in range(200):
        motion = smooth_noise(seed, 1.2)
        below = Block.from_angles(-30.0 - 1e-6, 60.0, 1.0)
        neglects = respond(motion, block=below, **planes)
        both_ways = respond(motion, block=below, **planes, two_way=True)
        tips = respond(motion, block=Block.from_angles(-30.0 + 1e-6, 60.0, 1.0), **planes)
        assert neglects.peak_displacement_m is not None
        assert tips.peak_displacement_m is not None
        assert tips.error_estimate is not None
        error_m = tips.error_estimate + 1e-5
        assert both_ways.peak_displacement_m == pytest.approx(tips.peak_displacement_m, abs=error_m)
        jump_m = neglects.peak_displacement_m - tips.peak_displacement_m
        assert jump_m >= -error_m
        exceeds = bool(motion.acceleration_g.min() < -1.0)
        assert (MAY_SLIDE_UP in neglects.warnings) == exceeds
        assert exceeds or jump_m <= error_m
        jumps += jump_m > error_m
    assert jumps > 50
