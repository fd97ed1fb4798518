"""Sequences of motions: what one leaves is what the next finds."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from rbfrag.errors import InputError
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.respond import respond
from rbfrag.solver.results import Outcome, Response
from tests.synthetic import shaking

DT_S = 0.01

BLOCKS: dict[str, dict[str, Any]] = {
    "slides": {"ky": 0.1, "beta_deg": 10.0},
    "slides, then leans": {
        "block": Block.from_angles(30.0, 70.0, 1.0), "beta_deg": 20.0, "phi_deg": 38.0,
    },
    "slumps": {"block": Block.from_angles(45.0, 65.0, 1.0), "beta_deg": 10.0, "phi_deg": 35.0},
}  # fmt: skip


def motion(seed: int, factor: float = 3.0) -> GroundMotion:
    """Shaking between two stretches of rest."""
    quiet = np.zeros(300)
    return GroundMotion(np.concatenate([quiet, factor * shaking(seed), quiet]), DT_S)


def final(answer: Response) -> tuple[float, ...]:
    state = answer.state
    assert state is not None
    return (*state.centroid_m, state.turned_rad, state.displacement_m)


@pytest.mark.parametrize("name", BLOCKS)
def test_one_motion_in_two_parts_is_one_motion(name: str) -> None:
    # cut where nothing moves: the trajectory is the same
    first, second = motion(1), motion(2)
    complete = GroundMotion(np.concatenate([first.acceleration_g, second.acceleration_g[1:]]), DT_S)
    single = respond(complete, **BLOCKS[name], history=True)
    two = respond([first, second], **BLOCKS[name], history=True)
    assert single.displacement_m is not None
    assert single.displacement_m > 0.005
    assert [part.response.started_s is not None for part in two.parts] == [True, True]
    assert final(two) == pytest.approx(final(single), rel=1e-10, abs=1e-12)
    assert two.displacement_m == pytest.approx(single.displacement_m, rel=1e-10)
    if single.peak_theta_rad is not None:
        assert two.peak_theta_rad == pytest.approx(single.peak_theta_rad, rel=1e-10)
    assert two.peak_displacement_m == pytest.approx(single.peak_displacement_m, rel=1e-10)
    assert two.started_s == single.started_s
    assert two.stopped_s == pytest.approx(single.stopped_s, abs=1e-10)
    assert two.centroid_displacement_m == pytest.approx(single.centroid_displacement_m, rel=1e-10)
    # and so it is on the way, where both histories have a state
    assert single.history is not None
    assert two.history is not None
    for ours in ("displacement_m", "turned_rad"):
        there = np.interp(single.history.time_s, two.history.time_s, getattr(two.history, ours))
        nodes = np.isin(single.history.time_s, complete.time_s)
        local = getattr(single.history, ours)
        assert there[nodes] == pytest.approx(local[nodes], abs=1e-10)


@pytest.mark.parametrize("name", BLOCKS)
def test_a_block_that_has_not_moved_answers_to_the_bit(name: str) -> None:
    weak, strong = motion(1, 0.01), motion(2)
    alone = respond(strong, **BLOCKS[name]).as_dict()
    both = respond([weak, strong], **BLOCKS[name])
    after = both.parts[1].response.as_dict()
    assert after == alone
    assert both.displacement_m == alone["displacement_m"]
    assert both.parts[0].response.started_s is None


def test_values_of_a_sequence() -> None:
    motions = [motion(1), motion(2), motion(3)]
    answer = respond(motions, **BLOCKS["slumps"], gap_s=5.0)
    parts = [part.response for part in answer.parts]
    assert answer.displacement_m == pytest.approx(sum(part.displacement_m or 0.0 for part in parts))
    assert answer.peak_theta_rad == max(part.peak_theta_rad or 0.0 for part in parts)
    assert answer.final_theta_rad == parts[-1].final_theta_rad
    # a slump is not undone: what one motion leaves, the next finds
    for before, part in zip(answer.parts, answer.parts[1:], strict=False):
        assert part.start == before.response.state
        length_s = float(motions[0].time_s[-1])
        assert part.begins_s == pytest.approx(before.begins_s + length_s + 5.0)
    assert answer.samples_total == sum(part.samples_total for part in parts)
    as_dict = answer.as_dict()
    assert [part["motion"] for part in as_dict["parts"]] == [item.label for item in motions]
    assert as_dict["parts"][1]["start"] == as_dict["parts"][0]["end"]
    assert "parts" not in parts[0].as_dict()


def test_toppling_and_rocking_start_again_from_rest() -> None:
    for kind in ("toppling", "rocking"):
        motions = [motion(1, 1.0), motion(2, 1.0)]
        alone = [respond(item, p2=3.0, kr=0.25, kind=kind) for item in motions]
        answer = respond(motions, p2=3.0, kr=0.25, kind=kind)
        assert None not in [item.peak_theta_n for item in alone]
        assert [part.response.peak_theta_n for part in answer.parts] == [
            item.peak_theta_n for item in alone
        ]
        assert any("carries no state" in text for text in answer.warnings)
        assert answer.displacement_m is None
        # the block may still rock when the next motion begins: that is the unsafe side
        assert any("may fail where this says that it stays" in text for text in answer.warnings)
    fallen = respond([motion(1, 20.0), motion(2)], p2=3.0, kr=0.05)
    assert fallen.outcome is Outcome.TOPPLED
    assert len(fallen.parts) == 1
    assert fallen.peak_theta_n is None
    assert any("left out" in text for text in fallen.warnings)


def test_a_block_still_in_motion_is_waited_for() -> None:
    # the record stops in its strongest pulse: the slide goes on after it
    cut = GroundMotion.from_nodes([0.0, 0.5, 0.5], [0.0, 1.0, 0.0])
    answer = respond([cut, motion(2)], ky=0.05, gap_s=0.0)
    first, second = answer.parts
    assert first.response.stopped_s is not None
    assert first.response.stopped_s > 0.6
    assert second.begins_s == pytest.approx(first.response.stopped_s)
    (message,) = [text for text in answer.warnings if "longer than the gap" in text]
    longer_s = first.response.stopped_s - 0.5
    assert f"moves on after motion 1 for {longer_s:.3g} s longer than the gap" in message
    assert "motion 2 is applied when it is at rest" in message
    assert len(message) < 500
    # after the last motion nothing begins
    assert not any("longer than the gap" in text for text in respond([cut], **SLIDE).warnings)


SLIDE: dict[str, Any] = {"ky": 0.05, "gap_s": 0.0}


def pulse(level_g: float, length_s: float = 0.5) -> GroundMotion:
    """A rectangle that the end of the record cuts off."""
    return GroundMotion.from_nodes([0.0, length_s], [level_g, level_g])


def joined(*levels_g: float) -> GroundMotion:
    """The rectangles one after the other in one record."""
    ends_s = 0.5 * np.arange(len(levels_g) + 1)
    return GroundMotion.from_nodes(np.repeat(ends_s, 2)[1:-1], np.repeat(levels_g, 2))


def slip(answer: Response) -> float:
    assert answer.displacement_m is not None
    return answer.displacement_m


@pytest.mark.parametrize("count", [2, 3])
def test_too_short_a_gap_before_a_push_on_errs_on_the_unsafe_side(count: int) -> None:
    # v = (a - k_y) g t and v²/(2 k_y g) after it: the slip grows with the square of the length
    pushed = respond([pulse(0.2)] * count, **SLIDE)
    together = respond(joined(*[0.2] * count), ky=0.05)
    alone = 0.5 * (0.2 - 0.05) * 0.2 / 0.05 * STANDARD_GRAVITY_M_S2 * 0.5**2
    assert slip(pushed) == pytest.approx(count * alone, rel=1e-12)
    assert slip(together) == pytest.approx(count**2 * alone, rel=1e-12)
    shorter = [text for text in pushed.warnings if "are too small" in text]
    assert len(shorter) == count - 1
    # the advice of the sentence: one record has both at once
    assert "Join the two into one record" in shorter[0]


def test_too_short_a_gap_before_a_push_back_is_too_great_by_no_more_than_the_slip_after() -> None:
    pushed = respond([pulse(0.2), pulse(-0.4)], **SLIDE)
    together = respond(joined(0.2, -0.4), ky=0.05)
    speed = (0.2 - 0.05) * STANDARD_GRAVITY_M_S2 * 0.5
    slip_after = speed**2 / (2.0 * 0.05 * STANDARD_GRAVITY_M_S2)
    # the second stops the block at k_y + .4 g, in less than its length
    too_great = slip_after - speed**2 / (2.0 * (0.05 + 0.4) * STANDARD_GRAVITY_M_S2)
    assert slip(pushed) - slip(together) == pytest.approx(too_great, rel=1e-12)
    assert too_great < slip_after
    assert any("by no more than the slip after motion 1" in text for text in pushed.warnings)


def test_sums_of_slides_with_too_short_a_gap_keep_within_what_the_warning_says() -> None:
    rng = np.random.default_rng(3)
    moved_on = 0
    for seed in range(40):
        first = rng.uniform(1.5, 5.0) * shaking(seed)[: rng.integers(250, 400)]
        second = rng.uniform(1.5, 5.0) * shaking(seed + 100)[rng.integers(150, 300) :]
        single = DT_S * np.arange(first.size)
        other = single[-1] + DT_S * np.arange(second.size)
        complete = GroundMotion.from_nodes(np.r_[single, other], np.r_[first, second])
        motions = [GroundMotion(first, DT_S), GroundMotion(second, DT_S)]
        apart = respond(motions, **SLIDE, history=True)
        if not any("longer than the gap" in text for text in apart.warnings):
            continue
        moved_on += 1
        history = apart.parts[0].response.history
        assert history is not None
        assert history.displacement_m is not None
        at_end = np.interp(single[-1], history.time_s, history.displacement_m)
        slip_after = slip(apart.parts[0].response) - at_end
        assert slip(apart) - slip(respond(complete, ky=0.05)) <= slip_after + 1e-12
    assert moved_on > 15


def test_a_run_from_a_state() -> None:
    block = BLOCKS["slides, then leans"]
    first = respond(motion(1), **block)
    assert first.state is not None
    assert first.state.gap_m > 0.0
    assert set(first.state.touching) == {"heel on the base", "upper back corner on the back plane"}
    second = respond(motion(2), **block, start=first.state)
    together = respond([motion(1), motion(2)], **block)
    assert final(second) == final(together)


@pytest.mark.parametrize(
    ("motions", "options", "word"),
    [
        ([], {}, "no motion"),
        (motion(1), {"gap_s": 1.0}, "requires a list"),
        ([motion(1)], {"gap_s": -1.0}, "negative"),
        ([motion(1), motion(2)], {"vertical": [None]}, "give one for each motion"),
        ([motion(1), motion(2)], {"vertical": motion(1)}, "give a list for a list of motions"),
        (motion(1), {"vertical": [motion(1)]}, "one vertical motion"),
    ],
)
def test_what_is_rejected(
    motions: GroundMotion | Sequence[GroundMotion], options: dict[str, Any], word: str
) -> None:
    with pytest.raises(InputError, match=word):
        respond(motions, ky=0.1, **options)


def test_a_state_of_a_block_that_carries_none() -> None:
    slid = respond(motion(1), ky=0.1).state
    with pytest.raises(InputError, match="start cannot be combined with toppling"):
        respond(motion(1), p2=3.0, kr=0.1, start=slid)
