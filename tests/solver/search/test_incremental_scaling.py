"""The search over the scale of the record, against closed forms and a brute-force scan."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rbfrag.errors import InputError
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.critical import critical
from rbfrag.solver.critical_result import CriticalResult
from rbfrag.solver.excitation import excitation
from rbfrag.solver.integrator.one_freedom.follow import follow
from rbfrag.solver.models import model_of_kind
from rbfrag.solver.models.sliding import sliding_displacements
from rbfrag.solver.respond import respond
from rbfrag.solver.results import Outcome
from rbfrag.solver.search.incremental_scaling import (
    ScaledRun,
    ScaleSearch,
    Verdict,
    _search,
    first_motion,
    scan_rules,
)
from rbfrag.solver.simulation import shaken_mechanism
from tests.synthetic import shaking as samples

PLANES = {"beta_deg": 22.0, "phi_deg": 30.0}


def slump(size: float = 0.3) -> Block:
    return Block.from_angles(56.0, 76.0, 2.3 * size)


def shaking(seed: int = 3) -> GroundMotion:
    return GroundMotion(samples(seed), 0.02)


def vertical_of(motion: GroundMotion, seed: int = 4) -> GroundMotion:
    up = samples(seed)
    assert motion.dt_s is not None
    return GroundMotion(0.4 * up[: motion.npts], motion.dt_s)


def times(motion: GroundMotion, factor: float) -> GroundMotion:
    assert motion.dt_s is not None
    return GroundMotion(factor * motion.acceleration_g, motion.dt_s)


def search(motion: GroundMotion, block: Block, **more: object) -> CriticalResult:
    return critical(motion, block=block, **PLANES, **more)  # type: ignore[arg-type]


@pytest.mark.parametrize("with_vertical", [False, True])
def test_the_block_moves_just_above_the_scale_of_first_motion(with_vertical: bool) -> None:
    motion = shaking()
    up = vertical_of(motion) if with_vertical else None
    shaken = shaken_mechanism(model_of_kind("slumping"), slump(), **PLANES)
    excited = excitation(motion, up)
    starts = first_motion(excited, shaken.yield_g)
    assert starts is not None
    below = follow(shaken.mechanism, excited.scaled(starts * (1.0 - 1e-9)))
    above = follow(shaken.mechanism, excited.scaled(starts * (1.0 + 1e-3)))
    assert below.peak == 0.0
    assert above.peak > 0.0


@pytest.mark.parametrize("rotation_deg", [None, 1.0, 4.0])
def test_a_brute_force_scan_finds_the_same_scale(rotation_deg: float | None) -> None:
    motion, block = shaking(), slump()
    result = search(motion, block, rotation_deg=rotation_deg)
    assert result.status == "found"
    lower, upper = result.lower_scale, result.scale
    assert upper - lower <= 1e-6 * upper

    def fails(scale: float) -> bool:
        answer = respond(times(motion, scale), block=block, **PLANES)
        if answer.outcome is Outcome.TOPPLED:
            return True
        assert answer.peak_theta_rad is not None
        return rotation_deg is not None and answer.peak_theta_rad >= math.radians(rotation_deg)

    scan = np.geomspace(result.starts_scale, upper * 1.3, 150)
    assert not any(fails(s) for s in scan[scan <= lower])
    assert fails(upper)


def test_the_critical_scale_is_the_inverse_of_the_strength_of_the_record() -> None:
    motion, block = shaking(), slump()
    single, three = (search(times(motion, f), block, rotation_deg=2.0) for f in (1.0, 3.0))
    assert three.scale == pytest.approx(single.scale / 3.0, rel=3e-6)
    assert three.y_m_s == pytest.approx(3.0 * (single.y_m_s or 0.0), rel=3e-6)
    assert three.kr_over_pga == pytest.approx(single.kr_over_pga, rel=3e-6)


def test_a_small_slump_turns_as_far_as_a_level_slide_says() -> None:
    # θ'' = p_s² (k_h - k_s) is Newmark's block times p_s²/g while θ is small
    motion, block = shaking(), slump(2.0)
    result = search(motion, block, rotation_deg=0.02)
    assert result.kr_over_pga is not None
    slid = sliding_displacements(motion, [result.kr_over_pga])[0] * result.scale
    turned = result.p2 * slid / STANDARD_GRAVITY_M_S2
    assert turned == pytest.approx(math.radians(0.02), rel=2e-3)


def test_rotations_are_reached_one_after_the_other_and_failure_last() -> None:
    motion, block = shaking(), slump()
    answers = [search(motion, block, rotation_deg=d) for d in (0.5, 1.0, 2.0, 5.0, None)]
    scales = [result.scale for result in answers]
    expected = [scale for scale in scales if scale is not None]
    assert len(expected) == 5
    assert expected == sorted(expected)


def test_a_block_that_leaves_its_back_plane_is_followed_to_its_fall() -> None:
    big = Block.from_angles(45.0, 70.0, 60.0)
    planes = {"beta_deg": 10.0, "phi_deg": 40.0}
    result = critical(shaking(), block=big, **planes)
    assert result.status == "found"
    assert any("past a lost contact" in sentence for sentence in result.warnings)
    lower, upper = (
        respond(times(shaking(), getattr(result, name)), block=big, **planes)
        for name in ("lower_scale", "scale")
    )
    assert upper.outcome is Outcome.TOPPLED
    assert lower.outcome is Outcome.STABLE


def test_a_record_that_drives_only_uphill_never_moves_the_block() -> None:
    pulse = GroundMotion(-np.hanning(60), 0.01)
    result = search(pulse, slump())
    assert (result.status, result.starts_scale, result.n_runs) == ("no_motion", None, 0)
    assert result.certified
    still = search(GroundMotion(np.zeros(20), 0.01), slump())
    assert still.status == "no_motion"
    assert still.as_dict()["scale_limit"] is None


def test_what_was_seen_is_told_as_intervals_and_points() -> None:
    result = search(shaking(), slump(), rotation_deg=2.0)
    assert result.status == "found"
    seen = result.intervals
    assert seen.outcome[-1] == "safe"
    assert seen.k_lo[-1] == result.upper
    assert "topples" in seen.outcome
    assert np.all(np.diff(seen.k_lo) > 0.0)
    assert seen.k_hi[seen.outcome.index("topples")] == result.kr_over_pga
    assert result.kr_over_pga in result.points.kr_over_pga
    assert not result.certified
    assert "not proven" in result.as_dict()["warnings"][-1]


@settings(max_examples=10)
@given(seed=st.integers(0, 10_000), size=st.floats(0.1, 3.0))
def test_everything_that_was_looked_at_below_the_critical_scale_is_safe(
    seed: int, size: float
) -> None:
    result = search(shaking(seed), slump(size), rotation_deg=1.0)
    limit = min(result.scale if result.scale is not None else math.inf, result.scale_limit)
    assert all(run.verdict == "safe" for run in result.runs if run.scale < limit)
    scales = [run.scale for run in result.runs]
    assert scales == sorted(set(scales))
    assert result.n_runs == len(scales)


@pytest.mark.parametrize("rotation_deg", [None, 2.0])
def test_a_confined_block_is_searched_past_its_fall_on_the_base(rotation_deg: float | None) -> None:
    block, planes = Block.from_angles(-40.0, 20.0, 0.5), {"beta_deg": 5.0, "phi_deg": 30.0}
    result = critical(
        shaking(), block=block, **planes, kind="confined_toppling", rotation_deg=rotation_deg
    )
    assert result.status == "found"
    lower, upper = result.lower_scale, result.scale
    # between them runs may end closer to failure than their error
    assert upper - lower < 2e-3 * upper
    outcomes = set()
    for scale in (*np.geomspace(result.starts_scale, lower, 40)[1:], upper):
        answer = respond(times(shaking(), scale), block=block, **planes)
        peak = answer.peak_theta_rad
        outcomes.add(answer.outcome)
        fails = peak is None or (rotation_deg is not None and peak >= math.radians(rotation_deg))
        assert fails == (scale == upper)
    assert outcomes <= {Outcome.STABLE, Outcome.TOPPLED}


def of_verdicts(verdict: Callable[[float], Verdict]) -> ScaleSearch:
    """A search of a made-up block whose verdict at each scale is known; from 1 to 10."""
    start = ScaleSearch(None, 1.0, 0.1, starts=1.0, scale_limit=10.0)

    def run(scale: float) -> ScaledRun:
        return ScaledRun(scale, 0.1, Outcome.STABLE, verdict(scale), "")

    return _search(start, run, scan_rules(0.01, 1.05, 1e-6))


def test_scales_too_close_to_failure_lie_inside_the_bracket() -> None:
    result = of_verdicts(lambda s: "safe" if s < 2.0 else "undecided" if s < 2.2 else "fails")
    assert (result.status, result.reentrant) == ("found", False)
    assert result.lower == pytest.approx(2.0, rel=1e-6)
    assert result.scale == pytest.approx(2.2, rel=1e-6)
    assert result.lower < 2.0
    assert result.scale >= 2.2
    # one that is spared after all does not make those below it safe
    spared = of_verdicts(lambda s: "undecided" if 2.0 < s < 2.3 else "safe" if s < 4.0 else "fails")
    assert spared.lower == pytest.approx(2.0, rel=1e-6)
    assert spared.scale == pytest.approx(4.0, rel=1e-6)
    # nothing fails, or the model ends, above what is undecided
    open_end = of_verdicts(lambda s: "safe" if s < 2.0 else "undecided")
    assert (open_end.status, open_end.scale) == ("below_limit", None)
    assert open_end.scale_limit == pytest.approx(2.0, rel=1e-6)
    assert open_end.ended == Outcome.UNDETERMINED.advice
    outside = of_verdicts(lambda s: "safe" if s < 2 else "undecided" if s < 2.2 else "outside")
    assert (outside.status, outside.scale) == ("below_limit", None)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (
            {"kind": "toppling", "rotation_deg": 2.0},
            "rotation_deg cannot be combined with toppling",
        ),
        ({"kind": "sliding"}, "displacement_m is missing"),
        ({"full_map": True}, "full_map cannot be combined with slumping"),
        ({"kind": "confined_toppling"}, "its mode is slump"),
        ({"rotation_deg": 0.0}, "above zero"),
        ({"scan_ratio": 1.0}, "above 1"),
    ],
)
def test_what_cannot_be_searched_is_rejected(options: dict[str, object], words: str) -> None:
    with pytest.raises(InputError, match=words):
        search(shaking(), slump(), **options)


def test_a_block_that_slumps_at_rest_is_rejected() -> None:
    with pytest.raises(InputError, match="unstable at rest"):
        critical(shaking(), block=slump(), beta_deg=29.0, phi_deg=30.0)


def test_beyond_the_end_of_the_model_nothing_is_told() -> None:
    result = search(shaking(), slump(), rotation_deg=2.0)
    last = result.runs[0].scale
    ended = ScaleSearch(
        rotation_deg=2.0,
        pga_g=result.pga_g,
        yield_g=result.yield_g,
        starts=result.starts_scale,
        scale_limit=last,
        status="below_limit",
        runs=result.runs,
    )
    assert any(run.verdict == "fails" for run in ended.runs)
    assert ended.intervals().outcome == ("safe",)
    assert ended.intervals().k_lo[0] == ended.k_over_pga(last)
