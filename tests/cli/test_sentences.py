"""Rates and numbers in words."""

from __future__ import annotations

import pytest

from rbfrag.results.numbers import annual_rate, annual_rates, return_period, return_periods, rounded


@pytest.mark.parametrize(
    ("rate", "message"),
    [
        (1.0 / 4158.2, "4,200 years"),
        (1.0 / 847.0, "850 years"),
        (1.0 / 24340.0, "24,000 years"),
        (0.4, "2.5 years"),
        (0.0, "over 100 million years"),
    ],
)
def test_return_periods_have_two_digits(rate: float, message: str) -> None:
    assert return_period(rate) == message


def test_an_interval_of_return_periods_starts_with_the_shorter() -> None:
    assert return_periods(1.0 / 5312.0, 1.0 / 3704.0) == "3,700–5,300"
    assert return_periods(0.0, 1.0 / 3704.0) == "3,700–over 100 million"
    assert return_periods(0.001, 0.001001) == "1,000"


def test_rates_have_two_digits_and_an_exponent_where_they_are_small() -> None:
    assert [annual_rate(value) for value in (0.0, 0.5, 12.0, 2.34e-4, 1e-10)] == [
        "0", "0.5", "12", "2.3e-4", "1.0e-10",
    ]  # fmt: skip
    assert annual_rates(1.9e-4, 2.73e-4) == "1.9e-4–2.7e-4"
    assert annual_rates(1.9e-4, 1.91e-4) == "1.9e-4"


@pytest.mark.parametrize(
    ("value", "message"),
    [(0.1089085, "0.109"), (1234.5, "1,230"), (100.0, "100"), (2.0, "2.00"), (1e-6, "1e-06")],
)
def test_three_digits(value: float, message: str) -> None:
    assert rounded(value) == message
