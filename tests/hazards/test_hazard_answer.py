"""The sentences, lines and tables of annual rates."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from rbfrag.hazards.answer import hazard
from rbfrag.hazards.curve import hazard_curve
from rbfrag.hazards.hazard_answer import HazardAnswer
from rbfrag.results.numbers import annual_rate, return_period, return_periods, with_interval
from tests.fragility.conftest import SHARED, model_row


def answered(p2: Any = 3.0, kr: Any = 0.1, *, last: float = 10.0, **asked: Any) -> HazardAnswer:
    """Return the rates under a power law of PGV up to a last level [m/s]."""
    x = np.geomspace(0.01, last, 20)
    curve = hazard_curve("pgv_m_s", x, 1e-3 * x**-2.0)
    return hazard(curve, p2, kr, model=model_row(dependence=SHARED), component="single", **asked)


def test_one_block_has_a_return_period_with_its_interval() -> None:
    answer = answered()
    (rate,), (low,), (high,) = answer.annual_rate, answer.ci_low, answer.ci_high
    first, second, third = answer.sentences()
    assert first == answer.headline() == (
        f"Return period of failure {return_period(rate)}   "
        f"(95 % confidence interval {return_periods(low, high)})"
    )  # fmt: skip
    assert second == (
        f"Mean annual rate {annual_rate(rate)} /yr; P(failure in 50 years) = "
        f"{with_interval(*(1.0 - math.exp(-50.0 * value) for value in (rate, low, high)))}"
    )
    assert third.startswith("Not included in the interval: choice of intensity measure, × ")
    drained = replace(answer, drained=np.array([1e-4]))
    assert "Drained return period 10,000 years" in [*drained.sentences()]


def test_a_curve_that_ends_early_gives_a_range() -> None:
    first, second, _ = answered(last=0.7).sentences()
    assert first.startswith("Return period of failure between ")
    assert first.endswith("years: the hazard curve ends at PGV = 0.7 m/s")
    assert re.match(
        r"Mean annual rate [\d.e-]+–2.1e-3 /yr; P\(failure in 50 years\) = [\d.–]+ %", second
    )
    # shaking above the last level, at 0.05 m/s and once in 2.5 years, may fail the block each time
    first, second, _ = answered(last=0.05).sentences()
    assert first == (
        "Return period of failure at least 2.5 years: the hazard curve ends at PGV = 0.05 m/s"
    )
    assert second == "Mean annual rate at most 0.4 /yr; P(failure in 50 years) at most 100 %"
    first, *_, last, _ = answered([3.0, 3.0], 0.1, last=0.7).sentences()
    assert first.endswith(" /yr of 2 blocks: the hazard curve ends too early")
    assert last.startswith("Shortest return periods at most: ")


def test_a_rate_of_never_has_no_interval() -> None:
    first, second, _ = answered(kr=300.0, last=1e4).sentences()
    assert first == "Return period of failure over 100 million years"
    assert second.endswith("P(failure in 50 years) <0.01 %")


def test_several_blocks_have_a_sum_and_their_shortest_return_periods() -> None:
    answer = answered([3.0, 3.0, 10.0, 3.0], [0.2, 0.1, 0.3, 0.4], joint=True)
    named = replace(answer, names=("a", None, "c", "d"), rejected={2: REJECTED})
    first, second, third, _ = named.sentences()
    assert first.startswith("Expected failures ")
    assert second.startswith("At least one failure: return period ")
    rates = answer.annual_rate
    assert third.startswith(f"Shortest return periods: block 2 ({return_period(rates[1])}), c (")
    rows = named.as_dict()["blocks"]
    assert [row["block_id"] for row in rows] == ["a", None, "bad", "c", "d"]
    assert rows[2]["annual_rate"] is None
    *_, table = named.tables()
    assert table.headers == (
        ["block_id", "annual_rate", "ci_low", "ci_high", "probability", "reason"]
    )


REJECTED = {"block_id": "bad", "reason": "no number"}


def test_the_table_of_contributions_adds_up() -> None:
    *_, table = answered().tables()
    assert sum(row[-1] for row in table.rows) == pytest.approx(100.0, abs=0.5)


def test_a_long_table_is_cut_for_a_terminal() -> None:
    answer = answered(np.full(30, 3.0), np.linspace(0.1, 0.4, 30))
    assert ("Blocks", "30, of which the first 20 are listed") in [*answer.lines()]
    *_, shown = answer.tables()
    *_, every = answer.tables(verbose=True)
    assert (len(shown.rows), len(every.rows)) == (20, 30)
