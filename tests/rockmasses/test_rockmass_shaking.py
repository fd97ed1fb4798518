"""Rock masses under a motion: each block as if it were alone, and the counts of all."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from rbfrag.errors import InputError
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2 as G
from rbfrag.rockmasses import shaking as rockmass_shaken
from rbfrag.rockmasses.counts import failures
from rbfrag.rockmasses.joint_sets import Realisations, RockMass
from rbfrag.rockmasses.report import outcome_columns
from rbfrag.rockmasses.shaking import (
    OPEN,
    OUTCOMES,
    FailureLimits,
    ShakenMass,
    plan_shaking,
    run_blocks,
)
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.respond import respond
from rbfrag.solver.results import Outcome
from rbfrag.solver.stability.modes import MODES
from tests.synthetic import shaking

UNIFORM = {"distribution": "uniform"}

DESCRIPTION: dict[str, object] = {
    "base.dip_deg": {**UNIFORM, "low": -20.0, "high": 35.0},
    "base.spacing_m": {"distribution": "lognormal", "median": 1.0, "sd_ln": 0.7},
    "back.dip_deg": {**UNIFORM, "low": 25.0, "high": 175.0},
    "back.spacing_m": {"distribution": "lognormal", "median": 1.0, "sd_ln": 0.7},
    "friction.phi_deg": {**UNIFORM, "low": 15.0, "high": 50.0},
}
FOUR_MODES = RockMass.of(DESCRIPTION)
WATER = {"back.water_m": {**UNIFORM, "low": 0.0, "high": 0.6}, "block.density_kg_m3": 2600.0}


def classify_block(**value: object) -> Realisations:
    """A rock mass of three blocks that are all alike."""
    return RockMass.of(
        {
            "base.dip_deg": 20.0,
            "base.spacing_m": 1.0,
            "back.dip_deg": 80.0,
            "back.spacing_m": 2.0,
            "friction.phi_deg": 30.0,
            **value,
        }
    ).realise(3, 1)


def pulse(amplitude_g: float, duration_s: float) -> GroundMotion:
    return GroundMotion.from_nodes(
        [0.0, 0.0, duration_s, duration_s, 30.0], [0.0, amplitude_g, amplitude_g, 0.0, 0.0]
    )


def record(seed: int = 3, pga_g: float = 0.6) -> GroundMotion:
    a = shaking(seed)
    return GroundMotion(pga_g * a / np.abs(a).max(), 0.01)


def shake(
    result: Realisations, motion: GroundMotion, chunk: int = 50, **inputs: object
) -> ShakenMass:
    plan = plan_shaking(result, motion, **inputs)  # type: ignore[arg-type]
    return plan.gathered(run_blocks(work) for work in plan.work(chunk))


def test_sliding_blocks_by_hand() -> None:
    # D = factor (A g T²/2) (A/k_y - 1) on a base of 20 degrees with 30 degrees of friction
    result = classify_block()
    ky = math.tan(math.radians(10.0))
    factor = math.cos(math.radians(10.0)) / math.cos(math.radians(30.0))
    slid = factor * 0.5 * 0.4 * G * 0.2**2 * (0.4 / ky - 1.0)
    for limit, outcome in ((slid * 1.001, "stays"), (slid * 0.999, "fails")):
        answer = shake(result, pulse(0.4, 0.2), limits=FailureLimits(limit))
        assert [OUTCOMES[code] for code in answer.code[0]] == [outcome] * 3
        assert answer.displacement_m[0] == pytest.approx([slid] * 3, rel=1e-10)
        assert np.isnan(answer.rotation_rad).all()
        (separate,) = failures(answer)
        assert separate.total.fails == (3 if outcome == "fails" else 0)
        assert separate.total.of_all.value == (1.0 if outcome == "fails" else 0.0)
        assert separate.modes["slide"].displacement_m is not None
        assert separate.modes["slide"].displacement_m["max"] == pytest.approx(slid, rel=1e-10)
    # on the limit itself rounding decides, and that is said
    at_limit = shake(
        result, pulse(0.4, 0.2), limits=FailureLimits(float(answer.displacement_m[0, 0]))
    )
    assert at_limit.code[0].tolist() == [OUTCOMES.index("undetermined")] * 3
    assert failures(at_limit)[0].total.open == 3


def test_scales_are_factors_on_the_motion() -> None:
    result = classify_block()
    answer = shake(result, pulse(0.4, 0.2), scales=[2.0, 0.4, 1.0, 0.4])
    assert answer.shaking.scales == (0.4, 1.0, 2.0)
    assert answer.pga_g.tolist() == pytest.approx([0.16, 0.4, 0.8])
    # k_y = 0.176 g is not passed at 0.16 g
    assert answer.code[0].tolist() == [OUTCOMES.index("at_rest")] * 3
    assert answer.displacement_m[0].tolist() == [0.0] * 3
    assert answer.runs == 6
    for i, scale in enumerate(answer.shaking.scales):
        alone = shake(result, pulse(0.4 * scale, 0.2))
        assert alone.displacement_m[0] == pytest.approx(answer.displacement_m[i], rel=1e-12)


def test_a_motion_below_every_threshold_needs_no_run() -> None:
    result = FOUR_MODES.realise(200, 4)
    k = result.stability.yield_acceleration
    positive = k[result.is_block & (k > 0.0)]
    plan = plan_shaking(result, pulse(0.999 * float(positive.min()), 5.0))
    assert not plan.moves.any()
    assert list(plan.work()) == []
    answer = plan.gathered([])
    assert answer.runs == 0
    assert failures(answer)[0].total.fails == 0


@pytest.fixture(scope="module")
def four() -> ShakenMass:
    return shake(FOUR_MODES.realise(400, 2), record(), scales=[0.5, 1.5])


@pytest.mark.parametrize("water", [{}, WATER], ids=["dry", "wet"])
def test_every_block_is_what_it_would_be_alone(water: dict[str, object]) -> None:
    mass = RockMass.of({**DESCRIPTION, **water}).realise(400, 2)
    shaken = shake(mass, record(), scales=[1.5])
    result: set[tuple[str, str]] = set()
    followed: Counter[str] = Counter()
    for j in np.flatnonzero(shaken.moves[0])[:150]:
        wet = {"water_m": float(mass.water_m[j]), "density_kg_m3": 2600.0} if water else {}
        alone = respond(
            record().scaled(1.5),
            block=Block.from_fractures(mass.s1_m[j], mass.s2_m[j], mass.gamma_deg[j]),
            beta_deg=float(mass.beta_deg[j]),
            phi_deg=float(mass.phi_deg[j]),
            **wet,
        )
        outcome = OUTCOMES[shaken.code[0, j]]
        result.add((alone.kind, outcome))
        followed[alone.kind] += bool(alone.mode_changes)
        if alone.kind != "sliding" or alone.outcome is not Outcome.STABLE:
            values = {"stable": "stays", "toppled": "fails"}.get(alone.outcome, alone.outcome.value)
            assert outcome == values
        elif outcome != "undetermined":
            assert (outcome == "fails") == (alone.peak_displacement_m > 0.05)
        assert alone.final_mode == MODES[shaken.final_code[0, j]]
        for peak, many in (
            (alone.peak_displacement_m, shaken.displacement_m),
            (alone.peak_theta_rad, shaken.rotation_rad),
        ):
            # to the last bit, also where it is followed step by step
            assert many[0, j] == peak or (peak is None and np.isnan(many[0, j]))
    assert {kind for kind, _ in result} == {
        "sliding", "toppling", "slumping", "confined_toppling",
    }  # fmt: skip
    assert {"stays", "fails"} <= {outcome for _, outcome in result}
    # slides that tip back, topples whose toe slips, slumps that lose a contact
    assert min(followed[kind] for kind in ("sliding", "toppling", "slumping")) > 0


def test_the_fates_are_a_partition(four: ShakenMass) -> None:
    result = four.realisations
    for i, item in enumerate(failures(four)):
        assert item.total.count == result.n_blocks < result.n
        assert sum(answer.count for answer in item.modes.values()) == result.n_blocks
        for answer in (*item.modes.values(), item.total):
            assert sum(answer.outcomes.values()) == answer.count
            assert answer.open == sum(answer.outcomes[name] for name in OPEN)
            assert answer.of_all.low <= answer.of_all.value <= answer.of_all.high
            assert answer.of_all.value == answer.fails / result.n_blocks
        unstable = result.is_block & (result.stability.state == "unstable")
        assert item.total.outcomes["unstable"] == int(unstable.sum()) > 0
        assert item.total.outcomes["locked"] == int((result.stability.state == "locked").sum()) > 0
        assert item.total.moved == int(four.moves[i].sum())
        assert set(four.code[i, ~result.is_block].tolist()) == {-1}
    assert four.runs == int(four.moves.sum())


def test_neither_seed_nor_pieces_leave_chance(four: ShakenMass) -> None:
    again = shake(FOUR_MODES.realise(400, 2), record(), scales=[0.5, 1.5], chunk=7)
    assert np.array_equal(again.code, four.code)
    assert np.array_equal(again.displacement_m, four.displacement_m, equal_nan=True)
    assert np.array_equal(again.rotation_rad, four.rotation_rad, equal_nan=True)
    assert again.about == four.about
    other = shake(FOUR_MODES.realise(400, 3), record(), scales=[0.5, 1.5])
    assert not np.array_equal(other.code, four.code)


def test_a_stated_rotation_is_failure_before_recovery_is_lost(four: ShakenMass) -> None:
    strict = shake(
        four.realisations, record(), scales=[1.5], limits=FailureLimits(rotation_deg=0.05)
    )
    slumps = four.realisations.is_block & (four.realisations.stability.mode == "slump")
    turned = four.rotation_rad[1] > math.radians(0.05)
    lax, now = four.code[1], strict.code[0]
    fails = OUTCOMES.index("fails")
    assert (now[slumps & turned] == fails).all()
    assert (lax[slumps & turned] != fails).any()
    # what a free topple or a slide does is judged as before
    rest = ~slumps & (four.realisations.stability.mode != "confined_topple")
    assert np.array_equal(now[rest], lax[rest])


def test_thrown_off_by_the_vertical_motion() -> None:
    up = GroundMotion(np.array([0.0, 0.0, -2.0, 0.0]), 0.1)
    motion = GroundMotion(np.array([0.0, 0.9, 0.9, 0.0]), 0.1)
    thrown = shake(classify_block(), motion, vertical=up)
    assert thrown.code[0].tolist() == [OUTCOMES.index("jump")] * 3
    # the strength is not passed, and yet the block does not stay
    weak = shake(
        classify_block(), replace(motion, acceleration_g=0.1 * motion.acceleration_g), vertical=up
    )
    assert weak.code[0].tolist() == [OUTCOMES.index("jump")] * 3
    assert weak.runs == 0
    assert failures(weak)[0].total.moved == 0


def test_the_table_has_a_row_for_each_block_and_scale(four: ShakenMass) -> None:
    columns = outcome_columns(four)
    n = four.realisations.n
    assert {values.shape for values in columns.values()} == {(2 * n,)}
    assert columns["block_id"].tolist() == [*range(1, n + 1)] * 2
    assert set(columns["scale"][:n]) == {0.5}
    named = columns["outcome"].reshape(2, n)
    assert all(
        named[1, j] == OUTCOMES[four.code[1, j]] for j in np.flatnonzero(four.realisations.is_block)
    )
    assert set(named[:, ~four.realisations.is_block].ravel()) == {""}
    run = np.isin(named.ravel().astype(str), ["at_rest", "unstable", "locked"], invert=True)
    run &= named.ravel() != ""
    assert set(columns["how"][run]) == {"followed in time"}
    assert set(columns["how"][~run]) == {"by mechanics", ""}


@pytest.mark.parametrize(
    ("inputs", "word"),
    [
        ({"scales": [1.0, 0.0]}, "scale 0"),
        ({"scales": [math.nan]}, "scale nan"),
        ({"scales": []}, "no scale"),
    ],
)
def test_rejected(inputs: dict[str, object], word: str) -> None:
    with pytest.raises(InputError, match=word):
        plan_shaking(classify_block(), pulse(0.4, 0.2), **inputs)  # type: ignore[arg-type]


def test_more_than_the_memory_holds_is_rejected(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rockmass_shaken, "MOST_OUTCOMES", 5)
    with pytest.raises(InputError, match="3 realisations at 2 scales are more than 5"):
        plan_shaking(classify_block(), pulse(0.4, 0.2), scales=[1.0, 2.0])


def test_impossible_limits_are_rejected() -> None:
    with pytest.raises(InputError, match="displacement"):
        FailureLimits(0.0)
    with pytest.raises(InputError, match="rotation"):
        FailureLimits(0.05, -1.0)


def test_a_vertical_acceleration_of_the_mass_is_rejected() -> None:
    with pytest.raises(InputError, match=r"block\.kv"):
        plan_shaking(classify_block(**{"block.kv": 0.1}), pulse(0.4, 0.2))
