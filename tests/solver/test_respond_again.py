"""Answers of a motion whose excitation is kept from an earlier run."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

import rbfrag
from rbfrag.solver.excitation import excitation, kept_excitation
from rbfrag.solver.results import Outcome, Response
from tests.solver.motions import noise

BLOCKS: tuple[dict[str, Any], ...] = (
    {"p2": 3.0, "kr": 0.15},
    {"p2": 3.0, "kr": 0.15, "kind": "rocking", "restitution": 0.9},
    {"ky": 0.05},
    {"block": rbfrag.Block.from_fractures(0.5, 0.2, 30.0), "beta_deg": 0.0, "phi_deg": 35.0},
)


@pytest.mark.parametrize("block", BLOCKS, ids=("toppling", "rocking", "sliding", "slumping"))
def test_an_answer_does_not_depend_on_what_was_run_before(block: dict[str, Any]) -> None:
    motion, upward = noise(5), noise(6).scaled(0.3)
    for vertical, polarity in ((None, "forward"), (None, "reverse"), (upward, "forward")):
        request: dict[str, Any] = {**block, "polarity": polarity}
        first = rbfrag.respond(motion, vertical=vertical, **request).as_dict()
        rbfrag.respond(motion, vertical=vertical, **{**request, "polarity": "reverse"})
        again = rbfrag.respond(motion, vertical=vertical, **request).as_dict()
        up = None if vertical is None else replace(vertical)
        assert first == again == rbfrag.respond(replace(motion), vertical=up, **request).as_dict()


def test_an_excitation_is_kept_by_motion_and_polarity() -> None:
    motion = noise(5)
    retained = kept_excitation(motion, None, "forward")
    assert kept_excitation(motion, None, "forward") is retained
    assert kept_excitation(motion, None, "reverse") is not retained
    assert kept_excitation(replace(motion), None, "forward") is not retained
    assert retained.duration_s == motion.duration_s
    assert retained.samples_total == excitation(motion).interval_s.size


def test_other_values_of_an_answer_are_those_of_a_replaced_one() -> None:
    answer = rbfrag.respond(noise(5), p2=3.0, kr=0.15)
    values: dict[str, Any] = {"outcome": Outcome.TOPPLED, "toppled_s": 2.0}
    changed = answer.with_values(**values)
    assert type(changed) is Response
    assert vars(changed) == vars(replace(answer, **values))
    assert answer.toppled_s != 2.0
