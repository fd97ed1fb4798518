"""The sentences, lines and tables of annual rates."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from rbfrag.hazards.curve import hazard_curve
from rbfrag.hazards.hazard_answer import HazardAnswer
from rbfrag.hazards.hazard_rates import hazard
from rbfrag.results.numbers import annual_rate, return_period, return_periods, with_interval
from tests.fragility.conftest import SHARED, model_row


def answered(p2: Any = 3.0, kr: Any = 0.1, *, last: float = 10.0, **inputs: Any) -> HazardAnswer:
    """Return the rates under a power law of PGV up to a last level [m/s]."""
    x = np.geomspace(0.01, last, 20)
    curve = hazard_curve("pgv_m_s", x, 1e-3 * x**-2.0)
    return hazard(curve, p2, kr, model=model_row(dependence=SHARED), component="single", **inputs)


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
    assert third.startswith("Not included in the interval: choice of intensity measure, rate × ")
    drained = replace(answer, drained=np.array([1e-4]))
    assert "Drained return period 10,000 years" in [*drained.sentences()]


def test_a_curve_that_ends_early_gives_a_range() -> None:
    first, second = answered(last=0.7).sentences()
    assert first.startswith("Return period of failure between ")
    assert first.endswith("years: the hazard curve ends at PGV = 0.7 m/s")
    assert re.match(
        r"Mean annual rate [\d.e-]+–2.1e-3 /yr; P\(failure in 50 years\) = [\d.–]+ %", second
    )
    # shaking above the last level, at 0.05 m/s and once in 2.5 years, may fail the block each time
    first, second = answered(last=0.05).sentences()
    assert first == (
        "Return period of failure at least 2.5 years: the hazard curve ends at PGV = 0.05 m/s"
    )
    assert second == "Mean annual rate at most 0.4 /yr; P(failure in 50 years) at most 100 %"
    first, *_, last = answered([3.0, 3.0], 0.1, last=0.7).sentences()
    assert first.endswith(" /yr of 2 blocks: the hazard curve ends too early")
    assert re.search(r"periods: block 1 \(between 490 and [\d,]+ years\), block 2", last)


def test_the_range_of_a_truncated_curve_is_in_tables_and_documents() -> None:
    complete, truncated = answered([3.0, 3.0], 0.1), answered([3.0, 3.0], 0.1, last=0.7)
    for answer, factor in ((complete, 1.01), (truncated, 4.0)):
        bounds, rates = answer.upper_bound, answer.annual_rate
        np.testing.assert_array_equal(answer.rate_columns["annual_rate_upper_bound"], bounds)
        assert ((bounds >= rates) & ((bounds < factor * rates) == (answer is complete))).all()
        document = answer.as_dict()
        assert [row["annual_rate_upper_bound"] for row in document["blocks"]] == bounds.tolist()
        assert document["expected_failures_upper_bound"] == pytest.approx(bounds.sum())
        *_, table = answer.tables()
        assert ("annual_rate_upper_bound" in table.headers) == (answer is truncated)
    (rate,) = (alone := answered(last=0.7)).annual_rate
    assert alone.as_dict()["annual_rate_upper_bound"] == alone.upper_bound[0] > 4.0 * rate


def test_a_curve_that_begins_too_late_gives_no_upper_bound() -> None:
    x = np.geomspace(1.0, 10.0, 20)
    curve = hazard_curve("pgv_m_s", x, 1e-3 * x**-2.0)
    inputs: dict[str, Any] = {"model": model_row(dependence=SHARED), "component": "single"}
    alone = hazard(curve, 3.0, 0.1, **inputs)
    first, second, *_ = alone.sentences()
    period, rate = return_period(alone.annual_rate[0]), annual_rate(alone.annual_rate[0])
    assert first == (
        f"Return period of failure at most {period}: the hazard curve begins at PGV = 1 m/s"
    )
    assert second.startswith(f"Mean annual rate at least {rate} /yr; P(failure in 50 years) at ")
    assert alone.as_dict()["annual_rate_upper_bound"] is None
    several = hazard(curve, [3.0, 3.0], 0.1, joint=True, **inputs)
    assert several.as_dict()["expected_failures_upper_bound"] is None
    first, second, *_ = several.sentences()
    assert re.fullmatch(
        r"Expected failures at least .* /yr of 2 blocks: a block fails below .*", first
    )
    assert second.startswith("At least one failure: return period at most ")


def test_a_rate_of_never_has_no_interval() -> None:
    first, second = answered(kr=300.0, last=1e4).sentences()
    assert first == "Return period of failure over 100 million years"
    assert second.endswith("P(failure in 50 years) < 0.01 %")


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


def test_the_component_is_noted_where_it_matters() -> None:
    x = np.geomspace(0.01, 10.0, 20)
    curve = hazard_curve("pgv_m_s", x, 1e-3 * x**-2.0)
    row = model_row(dependence=SHARED)
    alone, rotd50 = (hazard(curve, 3.0, 0.1, model=row, component=c) for c in (None, "rotd50"))
    (note,) = (text for text in alone.warnings if "single horizontal component" in text)
    assert note.endswith(f"as RotD50 the return period would be {rotd50.return_period_text(0)}")
    # a range is not compared with the return period by another component
    short = hazard_curve("pgv_m_s", x[:12], 1e-3 * x[:12] ** -2.0)
    (note,) = (text for text in hazard(short, 3.0, 0.1, model=row).warnings if "RotD50" in text)
    assert "return period" not in note
    several = hazard(curve, [3.0, 3.0], 0.1, model=row)
    assert any("assumed to be of a single horizontal" in text for text in several.warnings)
    for inputs in ({"kr": 300.0}, {"kr": 0.1, "component": "single"}):
        answer = hazard(curve, p2=3.0, model=row, **inputs)  # type: ignore[arg-type]
        assert not any("single horizontal component" in text for text in answer.warnings)


REJECTED = {"block_id": "bad", "reason": "no number"}


def test_the_table_of_contributions_adds_up() -> None:
    *_, table = answered().tables()
    assert sum(row[-1] for row in table.rows) == pytest.approx(100.0, abs=0.5)
    *_, table = answered(last=0.7).tables()
    assert table.rows[-1][0] == "> 0.7, with P(failure) at 0.7"


def test_the_contributions_of_weighted_branches_are_those_of_their_mean() -> None:
    x, weights = np.geomspace(0.01, 1.0, 20), [0.5, 0.3, 0.2]
    curves = [
        hazard_curve("pgv_m_s", x, rate * x**-slope, statistic=f"rlz-{i:03d}")
        for i, (rate, slope) in enumerate(((1e-3, 2.0), (2e-3, 1.5), (1e-4, 3.0)))
    ]
    inputs: dict[str, Any] = {"model": model_row(), "component": "rotd50"}
    answer = hazard(curves, 3.0, 0.1, weights=weights, **inputs)
    branches = [hazard(curve, 3.0, 0.1, **inputs) for curve in curves]
    for name in ("contribution", "above", "above_at_most", "annual_rate"):
        mean = sum(w * getattr(branch, name) for w, branch in zip(weights, branches, strict=True))
        np.testing.assert_allclose(getattr(answer, name), mean, rtol=1e-9, atol=1e-18)
    total = answer.contribution.sum() + answer.above[0]
    assert total == pytest.approx(answer.annual_rate[0], rel=1e-3)
    assert answer.fractions_between(answer.edges).sum() == pytest.approx(
        answer.contribution.sum() / answer.annual_rate[0]
    )


def test_a_long_table_is_cut_for_a_terminal() -> None:
    answer = answered(np.full(30, 3.0), np.linspace(0.1, 0.4, 30))
    assert ("Blocks", "30, of which the first 20 are listed") in [*answer.lines()]
    *_, shown = answer.tables()
    *_, every = answer.tables(verbose=True)
    assert (len(shown.rows), len(every.rows)) == (20, 30)


def test_blocks_of_two_kinds_name_both_models() -> None:
    x = np.geomspace(0.01, 10.0, 20)
    curve = hazard_curve("pgv_m_s", x, 1e-3 * x**-2.0)
    blocks: Any = {"p2": [3.0, 3.0], "kr": [0.1, 0.1], "kind": ["toppling", "rocking"]}
    answer = hazard(curve, **blocks, component="single")
    (line,) = (line.text for line in answer.lines() if line.label == "Model")
    assert line == answer.model == "rocking-pgv, toppling-pgv"


def test_the_first_of_several_curves_without_weights_is_named() -> None:
    x = np.geomspace(0.01, 10.0, 20)
    first, other = (hazard_curve("pgv_m_s", x, c * 1e-3 * x**-2.0) for c in (1.0, 3.0))
    answer = hazard([first, other], 3.0, 0.1, component="single")
    (warning,) = (item for item in answer.warnings if item.code == "first_curve")
    assert "first of 2 hazard curves" in warning
    assert answer.annual_rate == hazard(first, 3.0, 0.1, component="single").annual_rate
    mean = replace(first, statistic="mean")
    answer = hazard([mean, other], 3.0, 0.1, component="single")
    assert "first_curve" not in [item.code for item in answer.warnings]


def test_a_single_curve_has_no_spread_whatever_its_weight() -> None:
    x = np.geomspace(0.01, 10.0, 20)
    curve = hazard_curve("pgv_m_s", x, 1e-3 * x**-2.0)
    weighted = hazard([curve], 3.0, 0.1, weights=[1.0], component="single")
    alone = hazard(curve, 3.0, 0.1, component="single")
    assert weighted.annual_rate == alone.annual_rate
    assert np.isnan(weighted.logic_tree_low).all()
