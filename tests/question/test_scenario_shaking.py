"""The shaking of a scenario in words and under the keys of JSON."""

from __future__ import annotations

from rbfrag.question.bssa14 import PERIODS_S
from rbfrag.question.scenario import Source, scenario_shaking

SITE = {"magnitude": 6.8, "rjb_km": 12.0, "vs30_m_s": 760.0}


def test_the_median_comes_first_with_its_percentiles() -> None:
    answer = scenario_shaking(SITE, Source("reverse"))
    pgv = answer.as_dict()["pgv_m_s"]
    assert answer.headline() == (
        f"Median PGV {pgv['median']:.2g} m/s   "
        f"(16th–84th percentile {pgv['p16']:.2g}–{pgv['p84']:.2g} m/s)"
    )
    assert [*answer.lines()] == [
        ("Scenario", "M 6.8, R_JB 12 km, Vs30 760 m/s, reverse"),
        ("Model", "BSSA14 (Boore et al. 2014), component RotD50"),
    ]
    (table,) = answer.tables()
    assert [row[0] for row in table.rows] == [
        "PGV", "PGA", *(f"SA({period_s:g} s)" for period_s in PERIODS_S),
    ]  # fmt: skip
    assert answer.document() == answer.as_dict()


def test_amplification_moves_medians() -> None:
    plain, ridge = (
        scenario_shaking({**SITE, **more}, Source()) for more in ({}, {"amplification": 1.5})
    )
    ratio = ridge.measures["pgv_m_s"]["median"] / plain.measures["pgv_m_s"]["median"]
    assert abs(ratio - 1.5) < 1e-12
    assert "amplification 1.5" in next(ridge.lines()).text
