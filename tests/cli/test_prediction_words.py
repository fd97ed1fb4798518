"""What `rbfrag predict` says in words of P, its interval and one single earthquake."""

from __future__ import annotations

import math
from typing import Any

import pytest

import rbfrag
from rbfrag.fragility.words import (
    block_in_words,
    glossary,
    model_in_words,
    percent,
    prediction_in_words,
    with_interval,
)
from tests.cli.conftest import Shell


def words(p: float, low: float, high: float, **more: Any) -> tuple[str, ...]:
    document = {"probability": p, "level": 0.95, "ci_low": low, "ci_high": high}
    document |= {"event_low": None, "warnings": []}
    return prediction_in_words({**document, "mode": "topple", **more})


def test_one_block_falls_or_stands() -> None:
    assert words(0.13, 0.11, 0.152) == (
        "This block falls or stands; of 100 such cases 13 fall "
        "(11 to 15 as far as the data tell it, 95 %).",
    )
    assert words(0.13, 0.11, 0.152, sites=5, event_low=0.0, event_high=0.4)[1:] == (
        "At 5 sites of one earthquake, facing all sides, 0 to 40 of 100 such blocks fall (95 %).",
    )
    (_, unknown) = words(0.13, 0.11, 0.152, sites=1)
    assert unknown == (
        "At 1 site of one earthquake it is not known what share of such blocks falls together."
    )
    (slide,) = words(0.13, 0.11, 0.152, mode="slide")
    assert slide.startswith("This block fails or stands; of 100 such cases 13 fail (11")


@pytest.mark.parametrize(
    ("p", "low", "high", "said"),
    [
        (0.004, 0.001, 0.008, "of 1,000 such cases 4 fall (1 to 8 "),
        (0.9996, 0.99, 1.0, "of 10,000 such cases 9,996 fall (9,900 to 10,000 "),
        (1e-7, 1e-9, 1e-6, "cases fewer than 1 falls (as far as"),
        (0.99999, 0.99998, 0.999999, "of 10,000 such cases more than 9,999 fall (as far as"),
        (0.0101, 0.01, 0.02, "cases 1 falls (1 to 2 as"),
        (0.5, 0.5, 0.5, "50 fall (as"),
    ],
)
def test_counts_tell_p_from_0_and_1(p: float, low: float, high: float, said: str) -> None:
    (sentence,) = words(p, low, high)
    assert said in sentence


def test_what_cannot_fail_is_said_once() -> None:
    assert words(0.0, 0.0, 0.0) == ("No such block fails.",)


def test_the_block_is_named_with_how_it_is_taken_to_stand() -> None:
    numbers, backed = block_in_words("bounded", {"p2": 7.1372, "kr": 0.25, "pgv_m_s": 0.6})
    assert numbers == "The block has p² = 7.14 1/s² and k_r = 0.25."
    assert backed.startswith("The block is taken to be backed by a slope")
    assert "stand free" in block_in_words("overturning", {"p2": 7.1, "kr": 0.25})[1]
    assert block_in_words("displacement", {"ky": 0.1, "displacement_m": 0.3}) == (
        "The block has k_y = 0.1.",
        "It has failed when it has slid further than 0.3 m.",
    )
    assert block_in_words("bounded", {"p2": [3.0, 4.0], "kr": 0.1}) == ()


@pytest.mark.parametrize(
    ("share", "said"),
    [
        (0.0, "0 %"), (1e-9, "below 0.01 %"), (3e-4, "0.03 %"), (0.0123, "1.2 %"),
        (0.1161, "12 %"), (0.996, "99.6 %"), (0.9999, "above 99.9 %"), (1.0, "100 %"),
        (199 / 200, "99.5 %"), (0.9949, "99 %"),
    ],
)  # fmt: skip
def test_percent_has_the_digits_of_an_engineer(share: float, said: str) -> None:
    assert percent(share) == said


def test_an_interval_that_says_no_more_is_left_out() -> None:
    assert with_interval(1e-5, 1e-6, 3e-5) == "below 0.01 %"
    assert with_interval(0.13, 0.11, 0.152) == "13 % (11 % to 15 %)"
    assert with_interval(0.13, 0.131, 0.1312) == "13 %"


@pytest.mark.parametrize(
    ("term", "method", "said"),
    [
        ("pgv_kr", "bounded", "PGV, size-dependent"),
        ("pgv", "wls", "PGV, wls"),
        ("pgv_pga_sa10_sa30", "overturning", "PGV, PGA, SA(1 s), SA(3 s), rocking"),
        ("pgv_pga_m", "confined", "PGV, PGA, magnitude, confined toppling"),
        ("xp", "record", "toppling spectrum, PGA"),
        ("pgv, pga", "bounded", "two names"),
    ],
)
def test_models_have_names_that_people_say(term: str, method: str, said: str) -> None:
    assert model_in_words({"term": term, "method": method, "model": "two names"}) == said


def test_models_of_the_reference_are_told_apart(shell: Shell) -> None:
    rows = shell.json("models", "list")
    of = [(row["kind"], model_in_words({**row, "model": row["name"]})) for row in rows]
    same = [each for each in of if of.count(each) > 1]
    assert {kind for kind, _ in same} == {"slumping"}  # which differ by what counts as failure


def test_words_that_a_geologist_cannot_know_are_told_once(shell: Shell) -> None:
    assert glossary("The block has p_s² = 3.") == ""
    assert glossary("p² = 3", "p² and k_r").count("p²:") == 1
    printed = shell("predict", "--p2", "3", "--kr", "0.1", "--pgv", "0.6").stdout
    assert printed.splitlines()[-1].startswith("(p²: 15/p² m is a rectangle's diagonal; k_r: ")
    assert "model        PGV, size-dependent" in printed
    named = shell.json("predict", "--p2", "3", "--kr", "0.1", "--pgv", "0.6")["model"]
    assert named == "bounded-pgv_kr"
    # 15/p²: a rectangle's p² is 3 g/2 over its diagonal
    assert 1.5 * 9.80665 / rbfrag.Block.rectangle(2.4, 0.5).p2 == pytest.approx(
        math.hypot(2.4, 0.5)
    )


def test_other_suited_models_are_listed_and_none_is_said_to_be_wrong(shell: Shell) -> None:
    asked = ["--p2", "3", "--kr", "0.1", "--pgv", "0.6", "--pga", "0.5", "--tm", "0.5"]
    document = shell.json("predict", *asked)
    assert len(document["answers"]) > 3
    assert document["answers"][0]["recommended"]
    assert not any("agree" in text for text in document["warnings"])
