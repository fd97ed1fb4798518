"""Models fitted to a part of the outcomes and judged on all: what the selection does is seen."""

from __future__ import annotations

import math

import numpy as np
import pytest

from benchmarks.model_acceptance import Mark
from benchmarks.shipped_models import HeldOut, held_out
from rbfrag.fragility.fit import scores
from rbfrag.fragility.fit.fitting import fit_source
from rbfrag.fragility.fit.source import FitSource
from rbfrag.fragility.measures import TERMS
from tests.fragility.outcome_draws import drawn_outcomes

WEIBULL = (-1.0, 2.4)


def slope(seen: HeldOut) -> float:
    return scores.calibration(seen.p, seen.toppled, np.ones(seen.p.shape, dtype=bool)).slope


@pytest.mark.parametrize(
    ("method", "term", "parameters"),
    [("weibull", "pgv", WEIBULL), ("logistic", "pgv", (-2.0, 4.8))],
)
def test_fitted_to_all_it_is_the_held_out_fit(method, term, parameters) -> None:
    source = drawn_outcomes(method, term, parameters)
    fitted = fit_source(source, TERMS[term], method, compared=False)
    np.testing.assert_allclose(
        held_out(source, source, method, term).p, fitted.result.held_out, atol=1e-7
    )


def test_hidden_outcomes_matter_only_where_the_outcome_decides_which() -> None:
    source = drawn_outcomes("weibull", "pgv", WEIBULL)
    random = np.random.default_rng(2).uniform(size=source.topples.shape) < 0.6
    y0_over_pgv = np.broadcast_to(scores.GRID_OF_Y0_OVER_PGV, source.topples.shape)
    safe_among_falling = (source.topples == 0.0) & (y0_over_pgv < 0.6)

    def hidden(where: np.ndarray) -> FitSource:
        left = np.where(where, np.nan, source.topples)
        return FitSource(source.table, source.xp_m_s, left)

    by_chance = slope(held_out(hidden(random), source, "weibull", "pgv"))
    by_outcome = slope(held_out(hidden(random & safe_among_falling), source, "weibull", "pgv"))
    assert by_chance == pytest.approx(1.0, abs=0.05)
    assert by_outcome < 0.9


def test_a_mark_says_where_it_is_missed() -> None:
    mark = Mark("a", "slope", 0.93, 1.07, 1.0, 0.925)
    assert mark.asked == "0.93 to 1.07"
    assert (mark.cell(mark.value), mark.cell(mark.by_maps)) == ("1", "**0.925, missed**")
    assert mark.cell(math.nan) == "**nan, missed**"
    assert Mark("a", "gain", 0.02, math.inf, 0.03, also=("above 0", False)).cell(0.03) != "0.03"
    assert Mark("a", "loss", -math.inf, 0.1, 0.1).asked == "≤ 0.1"
