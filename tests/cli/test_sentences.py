"""Rates and numbers in words."""

from __future__ import annotations

import pytest

from rbfrag.cli.sentences import rounded
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
