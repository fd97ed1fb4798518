"""Words of `rbfrag predict` for P, its interval and a single earthquake."""

from __future__ import annotations

from typing import Any

import pytest

from rbfrag.fragility import describe
from rbfrag.fragility.prediction import Prediction
from rbfrag.question.document import answer_block
from rbfrag.results.diagnostic import Diagnostic
from rbfrag.results.numbers import percent, with_interval
from tests.cli.conftest import Shell


def answer(p: float, low: float, high: float, **values: Any) -> Prediction:
    numbers = {"p2": 7.1372, "kr": 0.25, "pgv_m_s": 0.6, "pga_g": 0.5}
    block_inputs: dict[str, Any] = {
        "kind": "toppling", "failure": "toppling", "model": "m", "data": "a file", "term": "pgv",
        "method": "toppling", "in_domain": True, "event_low": None, "event_high": None,
        "how": "model m", "level": 0.95, "y_m_s": 0.9, "intensity_m_s": 0.6, "inputs": numbers,
    }  # fmt: skip
    return Prediction(
        **{**block_inputs, "probability": p, "ci_low": low, "ci_high": high, **values}
    )


def test_the_headline_is_the_probability_with_its_interval() -> None:
    assert answer(0.148, 0.074, 0.261).headline() == (
        "P(toppling) = 15 %   (95 % confidence interval 7.4–26 %)"
    )
    rocking = answer(0.148, 0.074, 0.261, kind="rocking", failure="overturning", level=0.9)
    assert rocking.headline() == "P(overturning) = 15 %   (90 % confidence interval 7.4–26 %)"
    slide = answer(0.5, 0.4, 0.6, kind="sliding", failure="displacement above 0.1 m")
    assert slide.headline().startswith("P(displacement above 0.1 m) = 50 %")
    reason = (Diagnostic("k_r = 0.7 is not below PGA = 0.5 g", "by_mechanics"),)
    assert answer(0.0, 0.0, 0.0, how="by mechanics", warnings=reason).headline() == (
        "P(toppling) = 0   k_r = 0.7 is not below PGA = 0.5 g   (by mechanics)"
    )
    assert answer(0.0, 0.0, 1e-9).headline() == (
        "P(toppling) < 0.01 %   (95 % confidence interval <0.01 %)"
    )
    assert answer(1.0, 1.0, 1.0, how="by mechanics").headline() == (
        "P(toppling) = 1   the block is unstable without shaking   (by mechanics)"
    )


def test_labelled_lines_say_what_was_asked_and_which_model_answers() -> None:
    values = dict(answer(0.2, 0.1, 0.3).lines())
    assert values["Shaking"] == "PGV 0.6 m/s, PGA 0.5 g"
    assert values["Block"].startswith("p² = 7.14 s⁻², k_r = 0.25; assumed backed by a rock face")
    assert values["Model"] == "m, a file; inputs within the fitted range"
    about = {"pgv_m_s": {"median": 0.17, "sigma": 0.67, "tau": None}}
    values = dict(
        answer(0.2, 0.1, 0.3, shaking=about, sites=5, event_low=0.0, event_high=0.1,
               in_domain=False, block_sd=0.12).lines()
    )  # fmt: skip
    assert values["Shaking"] == (
        "PGA 0.5 g, median PGV 0.17 m/s, σ_ln 0.67; P is the mean over this distribution"
    )
    assert values["Sites"] == (
        "in one earthquake at 5 such sites, 0–10 % of the blocks fail (95 % prediction interval)"
    )
    assert values[""] == "block uncertainty: standard deviation of P 0.12"
    assert values["Model"].endswith("inputs outside the fitted range")


def test_a_scenario_is_named_with_its_mechanism_and_ground_motion_model() -> None:
    inputs = {"height_m": 2.0, "width_m": 0.4, "magnitude": 6.5, "rjb_km": 5.0, "vs30_m_s": 500.0}
    values = dict(answer_block(inputs, mechanism="reverse").lines())
    assert values["Shaking"] == (
        "magnitude 6.5, reverse, R_JB 5 km, Vs30 500 m/s (BSSA14): median PGV 0.34 m/s (RotD50), "
        "σ_ln 0.67 of a single component, median PGA 0.37 g (RotD50), σ_ln 0.63 of a single "
        "component, SA at 16 periods; P is the mean over these distributions"
    )
    values = dict(answer_block({**inputs, "amplification": 1.5}).lines())
    assert values["Shaking"].startswith(
        "magnitude 6.5, mechanism unspecified, R_JB 5 km, Vs30 500 m/s, amplification 1.5 (BSSA14)"
    )


def test_the_block_is_named_with_how_it_is_assumed_to_stand() -> None:
    assert "free-standing" in describe.block("rocking", {"p2": 7.1, "kr": 0.25})
    slide = describe.block("displacement", {"ky": 0.1, "displacement_m": 0.3})
    assert slide == "k_y = 0.1, displacement limit 0.3 m"
    assert describe.block("toppling", {"p2": [3.0, 4.0], "kr": 0.1}) == ""


@pytest.mark.parametrize(
    ("share", "message"),
    [
        (0.0, "0 %"), (1e-9, "<0.01 %"), (3e-4, "0.030 %"), (0.0123, "1.2 %"),
        (0.1161, "12 %"), (0.996, "99.6 %"), (0.99995, ">99.99 %"), (1.0, "100 %"),
        (199 / 200, "99.5 %"), (0.9949, "99 %"), (0.0996, "10 %"), (0.0994, "9.9 %"),
    ],
)  # fmt: skip
def test_percent_has_the_digits_of_an_engineer(share: float, message: str) -> None:
    assert percent(share) == message


def test_an_interval_that_says_no_more_is_left_out() -> None:
    assert with_interval(1e-5, 1e-6, 3e-5) == "<0.01 %"
    assert with_interval(0.13, 0.11, 0.152) == "13 % (11–15 %)"
    assert with_interval(0.13, 0.131, 0.1312) == "13 %"


@pytest.mark.parametrize(
    ("term", "method", "message"),
    [
        ("pgv", "toppling", "PGV"),
        ("sa", "toppling", "SA(T)"),
        ("pgv", "wls", "PGV, wls"),
        ("pga", "rocking", "PGA, rocking"),
        ("pgv_pga_m", "confined", "PGV, PGA, magnitude, confined toppling"),
        ("xp", "record", "toppling spectrum, PGA"),
        ("pgv, pga", "toppling", "two names"),
    ],
)
def test_models_have_names_that_people_say(term: str, method: str, message: str) -> None:
    assert describe.model({"term": term, "method": method, "model": "two names"}) == message


def test_models_of_the_reference_are_told_apart(shell: Shell) -> None:
    rows = shell.json("models", "list")
    of = [(row["kind"], describe.model({**row, "model": row["name"]})) for row in rows]
    same = [item for item in of if of.count(item) > 1]
    assert {kind for kind, _ in same} == {"slumping"}  # which differ by what counts as failure


def test_other_suited_models_are_listed_and_none_is_said_to_be_wrong(shell: Shell) -> None:
    command = ["--p2", "3", "--kr", "0.1", "--pgv", "0.6", "--pga", "0.5", "--tm", "0.5"]
    document = shell.json("predict", *command)
    assert len(document["answers"]) >= 3
    assert document["answers"][0]["recommended"]
    assert not any("agree" in text for text in document["warnings"])
