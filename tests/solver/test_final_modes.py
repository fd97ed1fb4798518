"""The mode in which a block ends, beside the one in which it begins."""

from __future__ import annotations

import numpy as np
import pytest

import rbfrag
from rbfrag import Block, GroundMotion

LEANS = Block.from_angles(30.0, 72.0, 1.0)
"""On a base of 24 degrees it leans on its back plane, and slides before it slumps."""


def pulses(*peaks_g: float) -> GroundMotion:
    """Rectangular pulses of 0.2 s with 4 s of rest after each."""
    time_s, acceleration_g, begins_s = [0.0], [0.0], 0.0
    for peak_g in peaks_g:
        ends_s = begins_s + 0.2
        time_s += [begins_s, ends_s, ends_s, begins_s + 4.2]
        acceleration_g += [peak_g, peak_g, 0.0, 0.0]
        begins_s += 4.2
    return GroundMotion.from_nodes(time_s, acceleration_g)


def test_a_slide_becomes_a_slump() -> None:
    on = {"block": LEANS, "beta_deg": 24.0, "phi_deg": 32.0}
    short = rbfrag.respond(pulses(0.3), **on)
    assert (short.mode, short.final_mode) == ("slide", "slide")
    both = rbfrag.respond(pulses(0.5, 0.5), **on)
    assert (both.mode, both.final_mode) == ("slide", "slump")
    assert both.mode_changes[-1].motion == "slumps against its back plane"
    # as two motions, of which the second finds a block that has tipped back
    parts = rbfrag.respond([pulses(0.5), pulses(0.5)], **on)
    assert [part.response.final_mode for part in parts.parts] == ["slide", "slump"]
    assert (parts.mode, parts.final_mode) == ("slide", "slump")
    over = rbfrag.respond(pulses(0.9, 0.9), **on)
    assert (over.outcome, over.final_mode) == ("toppled", "slump")


@pytest.mark.parametrize(
    ("block", "beta_deg", "mode"),
    [
        (Block.rectangle(4.0, 1.0), 0.0, "topple"),
        (Block.from_angles(-30.0, 60.0, 1.0), 10.0, "slide"),
        (Block.from_angles(50.0, 75.0, 1.0), 5.0, "slump"),
        (Block.from_fractures(1.0, 0.3, 110.0), 5.0, "confined_topple"),
    ],
)
def test_a_push_moves_a_block_in_its_own_mode(block: Block, beta_deg: float, mode: str) -> None:
    on = {"block": block, "beta_deg": beta_deg, "phi_deg": 35.0}
    k = rbfrag.stability(**on).yield_acceleration
    moved = rbfrag.respond(GroundMotion(np.array([0.0, 1.2 * k, 0.0]), 0.05), **on)
    assert (moved.mode, moved.final_mode) == (mode, mode)
    still = rbfrag.respond(GroundMotion(np.array([0.0, 0.9 * k, 0.0]), 0.05), **on)
    assert (still.mode, still.final_mode) == (mode, None)


def test_numbers_mean_the_mode_of_their_kind() -> None:
    motion = pulses(0.5)
    assert rbfrag.respond(motion, p2=3.0, kr=0.2).final_mode == "topple"
    assert rbfrag.respond(motion, p2=3.0, kr=0.2, kind="rocking").final_mode == "topple"
    answer = rbfrag.respond(motion, ky=0.2)
    assert (answer.mode, answer.final_mode) == ("slide", "slide")
