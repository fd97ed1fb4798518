"""The critical search: its bracket, its certificate, its words."""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from rbfrag.errors import InputError
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.readers import read_motions
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.solver.critical_result import CriticalResult
from rbfrag.solver.excitation import excitation
from rbfrag.solver.results import Outcome
from rbfrag.solver.search.critical import critical
from rbfrag.solver.toppling_run import OUTCOMES, simulate


def shaking(seed: int, npts: int = 1500, dt_s: float = 0.01, pga_g: float = 0.5) -> GroundMotion:
    """Noise under a bell, a stand-in for a record."""
    rng = np.random.default_rng(seed)
    smooth = np.convolve(rng.standard_normal(npts + 40), np.hanning(24), "same")[20:-20]
    samples = smooth * np.hanning(npts)
    return GroundMotion(samples * (pga_g / np.abs(samples).max()), dt_s)


def outcome(motion: GroundMotion, ratio: float, p2: float, **how: object) -> Outcome:
    vertical = how.get("vertical")
    assert vertical is None or isinstance(vertical, GroundMotion)
    excited = excitation(motion, vertical, "reverse" if how.get("reverse") else "forward")
    return OUTCOMES[simulate(excited, p2=p2, kr=ratio * excited.pga_g).outcome]


ISLAND_SEED = 17
"""A motion with a safe island below its critical value."""


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("p2", [30.0, 3.0, 0.3])
def test_bracket_has_the_answer_between_toppling_and_safe(seed: int, p2: float) -> None:
    motion = shaking(seed)
    result = critical(motion, p2=p2)
    assert result.status == "found"
    assert result.lower is not None
    assert result.upper is not None
    assert result.lower == result.kr_over_pga
    assert 0.0 < result.upper - result.lower < 1e-8 * result.upper
    assert outcome(motion, result.lower, p2) is Outcome.TOPPLED
    assert outcome(motion, result.upper * (1.0 + 1e-9), p2) is Outcome.STABLE
    assert result.kr == pytest.approx(result.lower * motion.pga_g)
    assert result.y_m_s == pytest.approx(result.kr * STANDARD_GRAVITY_M_S2 / math.sqrt(p2))


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("p2", [10.0, 1.0])
@pytest.mark.parametrize("with_vertical", [False, True])
def test_nothing_topples_above_a_certified_bracket(
    seed: int, p2: float, with_vertical: bool
) -> None:
    motion = shaking(seed)
    vertical = shaking(seed + 50, pga_g=0.4) if with_vertical else None
    result = critical(motion, p2=p2, vertical=vertical)
    assert result.status == "found"
    assert result.upper is not None
    assert result.k_up_over_pga is not None
    excited = excitation(motion, vertical)
    # where the search makes no promise, K_up still is one
    floor = result.upper if result.certified else result.k_up_over_pga
    ratios = np.linspace(floor, 1.02 * excited.max_q / excited.pga_g, 2001)[1:]
    codes = [simulate(excited, p2=p2, kr=float(ratio) * excited.pga_g).outcome for ratio in ratios]
    assert {OUTCOMES[code] for code in codes} == {Outcome.STABLE}
    assert result.upper <= result.k_up_over_pga


def test_every_answer_within_reach_of_the_proof_is_certified() -> None:
    for seed in range(40):
        result = critical(shaking(seed), p2=10.0)
        assert result.certified
        assert result.undecided is not None
        assert result.undecided <= 1e-9
        assert not any("not certified" in sentence for sentence in result.warnings)


def test_safe_island_below_the_critical_value_is_reported() -> None:
    motion = shaking(ISLAND_SEED)
    short = critical(motion, p2=10.0)
    assert (short.island_width, short.kr_over_pga_resolved, short.reentrant) == (None, None, None)
    result = critical(motion, p2=10.0, full_map=True)
    assert result.status == "found"
    assert result.reentrant
    assert result.island_width is not None
    assert result.lower is not None
    # just above the island's floor blocks topple, just below they stay
    floor = result.lower - result.island_width
    assert outcome(motion, floor + 1e-9, 10.0) is Outcome.TOPPLED
    assert outcome(motion, floor - 1e-9, 10.0) is Outcome.STABLE
    weaker = [
        subject
        for high, subject in zip(result.intervals.k_hi, result.intervals.outcome, strict=True)
        if high <= floor
    ]
    assert {"topples", "safe"} <= set(weaker)


def test_one_pulse_has_no_safe_island() -> None:
    pulse = GroundMotion.from_nodes([0.0, 0.2, 0.4], [0.0, 0.5, 0.0])
    result = critical(pulse, p2=5.0, full_map=True)
    assert result.reentrant is False
    assert result.certified
    assert result.lower is not None
    assert result.island_width == pytest.approx(result.lower - result.search_limit)


def test_points_are_sorted_and_repeat_exactly() -> None:
    motion = shaking(4)
    result = critical(motion, p2=3.0)
    ratios = result.points.kr_over_pga
    assert all(a > b for a, b in pairwise(ratios))
    assert len(result.points.outcome) == ratios.size == result.points.theta_n.size
    excited = excitation(motion)
    for ratio, theta_n, text in zip(
        ratios, result.points.theta_n, result.points.outcome, strict=True
    ):
        kr = float(ratio) * excited.pga_g
        run = simulate(excited, p2=3.0, kr=kr)
        assert OUTCOMES[run.outcome] == text
        if text == Outcome.STABLE:
            assert run.peak_rad / math.atan(kr) == pytest.approx(theta_n, rel=4e-16, abs=0.0)
        else:
            assert math.isnan(theta_n)
    assert result.n_runs >= ratios.size


def test_censored_below_the_limit() -> None:
    result = critical(GroundMotion([0.0, 0.3, 0.0, -0.3, 0.0], 0.005), p2=0.1)  # type: ignore[arg-type]
    assert result.status == "below_limit"
    assert result.search_limit == 0.01
    assert result.certified
    assert result.kr_over_pga is result.lower is result.upper is result.kr is result.y_m_s is None


def test_lower_limit_finds_what_the_default_censors() -> None:
    motion = GroundMotion([0.0, 0.3, 0.0], 0.005)  # type: ignore[arg-type]
    assert critical(motion, p2=0.1).status == "below_limit"
    result = critical(motion, p2=0.1, search_limit=1e-5)
    assert result.status == "found"
    assert result.lower is not None
    # impulse limit: k_r g/p = V
    assert result.lower * 0.3 == pytest.approx(0.3 * 0.005 * math.sqrt(0.1), rel=1e-2)


@pytest.mark.parametrize(
    "samples", [[0.0], [0.0] * 20, [-0.2, -0.4, -0.1], [0.0, 0.0, 0.001, -1.0]]
)
def test_motion_that_lifts_no_block(samples: list[float]) -> None:
    result = critical(GroundMotion(samples, 0.01), p2=1.0)  # type: ignore[arg-type]
    assert result.status == "no_motion"
    assert result.certified
    assert result.n_runs == 0


def test_vertical_that_throws_the_block_is_outside_the_model() -> None:
    motion = shaking(1, npts=300)
    down = shaking(2, npts=300).acceleration_g
    thrown = GroundMotion(down * (-1.2 / down[np.argmax(np.abs(down))]), 0.01)
    result = critical(motion, p2=1.0, vertical=thrown)
    assert result.status == "outside_model"
    assert result.kr_over_pga is None
    assert not result.certified
    assert any("1 + k_v <= 0" in sentence for sentence in result.warnings)


def test_with_vertical_motion_a_block_stronger_than_pga_can_topple() -> None:
    motion = GroundMotion.from_nodes([0.0, 0.0, 2.0, 2.0], [0.0, 0.4, 0.4, 0.0])
    vertical = GroundMotion.from_nodes([0.0, 0.0, 2.0, 2.0], [0.0, -0.5, -0.5, 0.0])
    result = critical(motion, p2=30.0, vertical=vertical)
    assert result.kr_over_pga is not None
    assert 1.0 < result.kr_over_pga < 2.0


def test_no_certificate_where_the_proof_does_not_reach() -> None:
    result = critical(shaking(17, pga_g=2.5), p2=10.0)
    assert result.status == "found"
    assert not result.certified
    assert any("1 g both ways" in s or "not certified" in s for s in result.warnings)


def test_reverse_is_forward_of_the_negated_motion() -> None:
    motion = shaking(7)
    single = critical(motion, p2=3.0, polarity="reverse")
    other = critical(motion.scaled(-1.0), p2=3.0)
    assert single.kr_over_pga == other.kr_over_pga
    assert single.pga_g == other.pga_g
    assert single.kr_over_pga != critical(motion, p2=3.0).kr_over_pga


@pytest.mark.parametrize(
    ("bad", "words"),
    [
        ({"p2": math.nan}, "p2 = nan is not finite"),
        ({"p2": 0.0}, "p2 = 0 is not above zero"),
        ({"p2": -3.0}, "-3"),
        ({"p2": "three"}, "'three'"),
        ({"p2": 1.0, "search_limit": 0.0}, "search_limit = 0 is not above zero"),
        ({"p2": 1.0, "search_limit": math.inf}, "inf"),
        ({"p2": 1.0, "polarity": "uphill"}, "'uphill'"),
    ],
)
def test_bad_input_is_named(bad: dict[str, object], words: str) -> None:
    with pytest.raises(InputError, match=words):
        critical(shaking(0, npts=50), **bad)  # type: ignore[arg-type]


RECORDS = ("nga_at2_misc/Rinaldi228.AT2", "nga_at2_misc/RSN763_LOMAP_GIL067.AT2",
           "nga_at2_misc/RSN30_PARKF_C05085.AT2")  # fmt: skip


def real_result(records_dir: Path, file: str, p2: float) -> tuple[GroundMotion, CriticalResult]:
    motion = read_motions(records_dir / file)[0]
    return motion, critical(motion, p2=p2)


@pytest.mark.parametrize("file", RECORDS)
@pytest.mark.parametrize("p2", [10.0, 1.0])
def test_real_record_against_a_scan(records_dir: Path, file: str, p2: float) -> None:
    motion, result = real_result(records_dir, file, p2)
    assert result.status == "found"
    assert result.upper is not None
    assert result.lower is not None
    excited = excitation(motion)
    ratios = np.linspace(result.upper, 1.0, 1001)[1:]
    topple = [r for r in ratios if simulate(excited, p2=p2, kr=r * excited.pga_g).outcome == 1]
    if result.certified:
        assert not topple
    assert all(ratio <= (result.k_up_over_pga or 0.0) for ratio in topple)
    assert outcome(motion, result.lower, p2) is Outcome.TOPPLED
