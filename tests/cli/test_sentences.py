"""Rates and numbers in words."""

from __future__ import annotations

import pytest

from rbfrag.cli.hazard_sentences import campaign_in_words, most_often
from rbfrag.cli.sentences import rock_mass_in_words, rounded, table_in_words
from rbfrag.hazards.report import once_in, rate_in_words


@pytest.mark.parametrize(
    ("rate", "said"),
    [
        (1.0 / 4158.2, "once in 4,200 years"),
        (1.0 / 847.0, "once in 850 years"),
        (1.0 / 24340.0, "once in 24,000 years"),
        (0.4, "once in 2.5 years"),
        (0.0, "less than once in a hundred million years"),
    ],
)
def test_once_in_so_many_years(rate: float, said: str) -> None:
    assert once_in(rate) == said


def test_a_rate_with_its_interval_from_the_shorter_time_to_the_longer() -> None:
    document = {
        "annual_rate": 2.4e-4, "ci_low": 1.88e-4, "ci_high": 2.94e-4, "probability": 0.01195,
        "years": 50.0, "level": 0.95,
    }  # fmt: skip
    assert rate_in_words(document) == (
        "The block fails once in 4,200 years on average (3,400 to 5,300, 95 %), with a probability "
        "of 1.2 % in 50 years."
    )


@pytest.mark.parametrize(
    ("value", "said"),
    [(0.1089085, "0.109"), (1234.5, "1,230"), (100.0, "100"), (2.0, "2.00"), (1e-6, "1e-06")],
)
def test_three_digits(value: float, said: str) -> None:
    assert rounded(value) == said


@pytest.mark.parametrize(
    ("report", "said"),
    [
        (
            {"found": 20, "below_limit": 4, "resumed": 0},
            "24 combinations of kind toppling are stored: 20 with a critical value, 4 of which "
            "nothing fails down to the search limit.",
        ),
        (
            {"found": 24, "below_limit": 0, "resumed": 12},
            "24 combinations of kind toppling are stored, 12 of them before: 24 with a critical "
            "value.",
        ),
    ],
)
def test_what_a_campaign_has_stored(report: dict[str, int], said: str) -> None:
    others = dict.fromkeys(("no_motion", "outside_model", "not_searched"), 0)
    whole = {"kind": "toppling", "combinations": 24, **others, **report}
    assert campaign_in_words(whole) == said


def test_how_many_rows_are_answered() -> None:
    assert table_in_words({"rows": 100_000, "answered": 99_999, "without_answer": 1}) == (
        "99,999 of 100,000 blocks are answered; 1 without answer."
    )
    assert table_in_words({"rows": 3, "answered": 3, "without_answer": 0}) == (
        "All 3 blocks are answered."
    )


def test_blocks_of_which_it_is_open_whether_they_fail_are_told() -> None:
    fails = {"share": 0.2, "ci_low": 0.15, "ci_high": 0.26}
    for unknown, end in (
        (0.0, "26 %) fail."),
        (0.3, "; of another 30 % it is open whether they do."),
    ):
        document = {
            "modes": {"slide": {"share": 1.0}}, "blocks": 200, "scenario": None,
            "shaking": {
                "motion": "Rinaldi",
                "scales": [
                    {"scale": 1.0, "all": {"fails_of_all": fails, "open_of_all": unknown}}
                ],
            },
        }  # fmt: skip
        assert list(rock_mass_in_words(document))[1].endswith(end)


def test_the_blocks_that_fail_most_often_come_first() -> None:
    rates = [1e-3, 0.0, 4e-3, 2e-3, 1e-4]
    assert most_often(["a", "b", None, "d", "e"], rates) == (
        "Most often fail block 3 (once in 250 years), d (once in 500 years) and a (once in 1,000 "
        "years)."
    )
