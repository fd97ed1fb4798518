"""Fractions of simulated draws: against closed forms of pulses, single runs and predictions."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.stats import norm

import rbfrag
from rbfrag.errors import InputError
from rbfrag.fragility.method import SINGLE
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.question.measurement_draws import (
    DrawnBlock,
    drawn_values,
    lattice,
    split_sigmas,
)
from rbfrag.question.respond_draws import respond_draws, wilson

G = 9.80665

PULSE = GroundMotion.from_nodes(np.array([0.0, 0.5, 0.5, 0.6]), np.array([0.4, 0.4, 0.0, 0.0]))
SHAKEN = GroundMotion(
    0.4 * np.sin(2.0 * math.pi * np.arange(0.0, 4.0, 0.01) / 0.8) * np.linspace(1.0, 0.0, 400),
    0.01,
)  # fmt: skip


def test_toppling_under_a_pulse_is_the_lognormal_strength_below_the_critical_one() -> None:
    critical = rbfrag.critical(PULSE, p2=3.0).kr
    assert critical is not None
    answer = respond_draws(PULSE, p2=3.0, kr=0.9 * critical, kr_sigma=0.2, draws=1000)
    expected = norm.cdf(-math.log(0.9) / 0.2)
    assert answer.kind == "toppling"
    assert abs(answer.share_failed - expected) < 4.0 * answer.standard_error
    assert answer.outcomes == {"stable": 1000 - answer.failed, "toppled": answer.failed}


def test_sliding_under_a_pulse_is_the_strength_below_that_of_newmark() -> None:
    # a pulse a of duration T slides v²/(2 k g)·(1 - k/a) with v = a g T (Newmark 1965)
    a, duration, limit = 0.4, 0.5, 0.4
    v = a * G * duration
    at_limit = v * v / (2.0 * G * limit + v * v / a)
    answer = respond_draws(
        PULSE, ky=at_limit, ky_sigma=0.3, displacement_m=limit, horizontal=True, draws=1000
    )
    assert abs(answer.share_failed - 0.5) < 4.0 * answer.standard_error
    assert answer.outcomes == {"stable": 1000}


@pytest.mark.parametrize("kind", ["toppling", "rocking"])
def test_without_scatter_every_draw_is_the_single_run(kind: str) -> None:
    for kr in (0.05, 0.3):
        single = rbfrag.respond(SHAKEN, p2=7.0, kr=kr, kind=kind)
        answer = respond_draws(SHAKEN, p2=7.0, kr=kr, kind=kind, draws=3)
        assert answer.outcomes == {single.outcome.value: 3}
        assert answer.standard_error == 0.0
        assert answer.ci_high - answer.ci_low > 0.4


def test_an_unknown_direction_is_every_other_draw_the_one_way() -> None:
    inputs: Any = {"p2": 7.0, "kr": 0.1, "kr_sigma": 0.3, "kind": "rocking"}
    skewed = GroundMotion(np.maximum(SHAKEN.acceleration_g, -0.1), SHAKEN.dt_s)
    single, other, both = (
        respond_draws(skewed, **inputs, draws=400, polarity=way)
        for way in ("forward", "reverse", "both")
    )
    mean = 0.5 * (single.share_failed + other.share_failed)
    assert abs(both.share_failed - mean) < 4.0 * both.standard_error
    assert both.polarity == "both"
    # a symmetric block on level ground rocks alike both ways, if both ways are the same motion
    level = respond_draws(SHAKEN, **inputs, draws=50)
    turned = respond_draws(SHAKEN, **inputs, draws=50, polarity="reverse")
    assert level.outcomes == turned.outcomes


def test_draws_are_a_lattice_of_a_power_of_two() -> None:
    inputs: Any = {"p2": 7.0, "kr": 0.12, "kr_sigma": 0.4, "kind": "rocking"}
    assert respond_draws(SHAKEN, **inputs, draws=60).draws == 60
    two = respond_draws(SHAKEN, **inputs, p2_sigma=0.1, draws=300)
    assert two == respond_draws(SHAKEN, **inputs, p2_sigma=0.1, draws=300)
    assert (two.draws, two.excluded) == (512, 0)
    assert respond_draws(SHAKEN, **inputs, p2_sigma=0.1, draws=20).draws == 256
    with pytest.raises(InputError, match="no standard deviation"):
        respond_draws(SHAKEN, p2=7.0, kr=0.12)


def test_a_table_of_draws_is_drawn_from_by_weight() -> None:
    weak, strong = 0.02, 3.0
    answer = respond_draws(SHAKEN, p2=7.0, kr=[weak, strong], weights=[1.0, 3.0], draws=80)
    assert answer.share_failed == 0.25
    assert respond_draws(SHAKEN, p2=7.0, kr=[weak, strong, strong]).failed == 1


def test_restitution_scatters_between_0_and_1() -> None:
    loses = respond_draws(
        SHAKEN, p2=7.0, kr=0.12, kind="rocking", restitution=0.95, restitution_sigma=0.2, draws=100
    )
    assert sum(loses.outcomes.values()) == 100


def test_the_interval_of_a_count_is_that_of_wilson() -> None:
    for failed, count in ((0, 20), (3, 20), (10, 20), (20, 20)):
        for end in wilson(failed, count):
            if 0.0 < end < 1.0:
                z = (failed / count - end) / math.sqrt(end * (1.0 - end) / count)
                assert abs(z) == pytest.approx(norm.ppf(0.975), rel=1e-9)
    assert wilson(0, 20)[0] == 0.0
    assert wilson(20, 20)[1] == 1.0


@pytest.mark.parametrize(
    ("inputs", "words"),
    [
        ({"draws": 0}, "draws = 0"),
        ({"draws": 2.5}, "draws = 2.5"),
        ({"kr_sigma": -0.1}, "kr_sigma = -0.1"),
        ({"polarity": "sideways"}, "polarity = 'sideways'"),
        ({"ky_sigma": 0.1}, "ky_sigma requires ky"),
        ({"displacement_m": 0.1}, "displacement_m cannot be combined with kind toppling"),
        ({"p2": None, "kr": None, "ky": 0.1}, "displacement_m is missing"),
        ({"restitution": 0.9}, "restitution cannot be combined with kind toppling"),
        ({"restitution": 1.2, "kind": "rocking"}, "restitution = 1.2"),
        ({"kr": [0.1, 0.2], "kr_sigma": 0.1}, "cannot be combined with draws"),
        ({"kr": [0.1, -0.2], "weights": [0.0, 1.0]}, "kr = -0.2"),
        ({"kr": [0.1, 0.2], "weights": [-1.0, 1.0]}, "weights of draws"),
        ({"kr": [0.1, 0.2], "weights": [1.0, 1.0, 1.0]}, "one length"),
    ],
)
def test_what_is_no_draw_is_rejected(inputs: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        respond_draws(SHAKEN, **{"p2": 7.0, "kr": 0.12, "draws": 5, **inputs})


SLAB: Any = {"height_m": 2.0, "width_m": 0.4, "phi_deg": 40.0}


def test_measured_blocks_are_the_draws_of_predictions() -> None:
    sigmas: Any = {"height_sigma_m": "5%", "width_sigma_m": 0.04, "dip_sigma": 2.0}
    answer = respond_draws(SHAKEN, **SLAB, **sigmas)
    assert (answer.kind, answer.draws, answer.excluded) == ("toppling", 512, 0)
    inputs, errors = split_sigmas(
        {**SLAB, "height_sigma_m": "5%", "width_sigma_m": 0.04, "beta_sigma_deg": 2.0},
        is_scenario=False,
    )
    block = DrawnBlock(inputs, None)
    points = zip(*lattice(3, 512), strict=True)
    draws = (block.draw(drawn_values(block.fields, errors, z, SINGLE)) for z in points)
    fails = [
        rbfrag.respond(SHAKEN, p2=draw.numbers["p2"], kr=draw.numbers["kr"]).outcome.value
        for draw in draws
    ]
    assert answer.failed == fails.count("toppled")
    assert 0 < answer.failed < 512


def test_draws_that_do_not_stand_are_excluded() -> None:
    answer = respond_draws(SHAKEN, **SLAB, beta_deg=9.0, beta_sigma_deg=2.0, width_sigma_m=0.04)
    predicted = rbfrag.predict(
        **SLAB, beta_deg=9.0, beta_sigma_deg=2.0, width_sigma_m=0.04, pgv_m_s=0.5
    )
    (note,) = [text for text in predicted.warnings if text.code == "excluded_draws"]
    assert note in answer.warnings
    assert answer.excluded / answer.draws == pytest.approx(float(note.split()[0]) / 100, abs=5e-3)
    assert sum(answer.outcomes.values()) == answer.draws - answer.excluded
    above = respond_draws(SHAKEN, **SLAB, beta_deg=12.0, beta_sigma_deg=2.0)
    assert [text.code for text in above.warnings if "measured range" in text] == ["check_stability"]
    with pytest.raises(InputError, match="would not stand at rest"):
        respond_draws(SHAKEN, **SLAB, beta_deg=15.0, beta_sigma_deg=2.0)


def test_each_draw_fails_in_its_mode() -> None:
    block: Any = {**SLAB, "width_m": 1.6, "phi_deg": 40.0, "phi_sigma_deg": 3.0}
    with pytest.raises(InputError, match="% of the measured range slides: give displacement_m"):
        respond_draws(SHAKEN, **block, draws=30)
    answer = respond_draws(SHAKEN, **block, displacement_m=0.01, draws=30)
    assert set(answer.kind.split(", ")) == {"toppling", "sliding"}
    free_standing = respond_draws(
        SHAKEN, height_m=0.6, width_m=0.12, kind="rocking", restitution=0.9,
        restitution_sigma=0.05, width_sigma_m="5%", draws=100,
    )  # fmt: skip
    assert (free_standing.kind, free_standing.draws) == ("rocking", 256)


def test_the_public_functions_name_each_other() -> None:
    block = rbfrag.Block.rectangle(2.0, 0.4)
    with pytest.raises(
        InputError, match=r"height_sigma_m requires draws: use rbfrag\.respond_draws"
    ):
        rbfrag.respond(SHAKEN, block=block, beta_deg=0.0, phi_deg=40.0, height_sigma_m=0.1)
    for inputs, words in (
        ({"width_sigma_m": 0.04, "kr_sigma": 0.1}, "kr_sigma cannot be combined"),
        ({"weights": [1.0]}, "weights are of given draws"),
        ({"s1_sigma_m": 0.1}, "s1_sigma_m requires s1_m"),
        ({"pgv_m_s": 0.9}, "unknown field"),
    ):
        with pytest.raises(rbfrag.RbfragError, match=words):
            respond_draws(SHAKEN, **SLAB, **inputs)
