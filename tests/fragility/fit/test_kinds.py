"""Fits of every kind: formulas, known parameters, blocks that a new kind shares with another."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from rbfrag.db.engine import opened_database
from rbfrag.errors import FitError, InputError
from rbfrag.fragility.fit import maximum_likelihood
from rbfrag.fragility.fit.data import FitSource, fit_data
from rbfrag.fragility.fit.fitting import fit, fit_source
from rbfrag.fragility.fit.maximum_likelihood import censored_rows, most_likely
from rbfrag.fragility.fit.report import FitReport
from rbfrag.fragility.measures import TERMS
from rbfrag.fragility.methods import method_named, methods
from rbfrag.fragility.model import FragilityModel
from tests.fragility.kind_draws import METHOD_OF, TRUE, drawn
from tests.fragility.outcome_draws import TRUTH, drawn_outcomes


@pytest.fixture(autouse=True)
def few_replicates(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(maximum_likelihood, "REPLICATES", 40)


@pytest.mark.parametrize(("kind", "term"), sorted(TRUE))
def test_a_fit_finds_the_parameters_that_made_the_data(kind: str, term: str) -> None:
    report = fit(drawn(kind, term), kind=kind, term=term, bootstrap=True)
    for (name, value), true in zip(report.coefficients.items(), TRUE[kind, term], strict=True):
        assert value == pytest.approx(true, abs=4.0 * report.standard_errors[name])
        assert report.standard_errors[name] < 0.2
    assert report.scores["calibration_slope_held_out"] == pytest.approx(1.0, abs=0.15)
    assert report.details["bootstrap"]["standard_errors"][name] == pytest.approx(  # type: ignore[index]
        report.standard_errors[name], rel=0.5
    )
    assert (report.kind, report.events) == (kind, 20)
    again = FitReport.from_model(FragilityModel.from_row(report.model.row))
    assert again.as_dict() == report.as_dict()
    for key in ("kind", "n", "n_censored", "events", "judged_outcomes", "rotation_deg", "scores"):
        assert key in report.as_dict()


def with_magnitude(source: FitSource, magnitude: NDArray[np.float64]) -> FitSource:
    """Return a source with other magnitudes."""
    measures = {**source.table.measures, "magnitude": magnitude}
    return replace(source, table=replace(source.table, measures=measures))


def test_rows_without_magnitude_are_left_out_and_told() -> None:
    source = drawn("sliding", "pgv_pga_m", n=2000)
    magnitude = source.table.measure("magnitude").copy()
    magnitude[source.table.event_id == "event-03"] = np.nan
    lacking = with_magnitude(source, magnitude)
    ky = source.k_over_pga[:, 0] * source.table.pga_g
    without = int((np.isnan(magnitude) & (ky >= 0.02) & (ky <= 1.0)).sum())
    assert without > 20
    report = fit(lacking, kind="sliding", term="pgv_pga_m")
    assert report.details["n_excluded_undefined_term"] == without
    assert any("measure that the term reads is not known" in text for text in report.warnings)
    assert report.events == 19
    assert report.model.row.domain["ky"] == (0.02, 1.0)
    least, most = report.model.row.domain["magnitude"]
    assert 5.0 <= least < most <= 8.0
    assert fit(lacking, kind="sliding", term="pgv_pga").events == 20


def test_fits_of_rocking_read_two_factors_on_restitution_and_blocks_up_to_one_g() -> None:
    source = drawn_outcomes("toppling", "pgv_pga", TRUTH["toppling", "pgv_pga"])
    n = source.table.p2.size
    factor = np.resize([1.0, 0.95, 0.9, 0.8], n)
    strong = replace(
        source, of_block={"restitution_factor": factor}, k_over_pga=4.0 * source.k_over_pga
    )
    data = fit_data(strong, method_named("rocking"), TERMS["pga"])
    assert set(factor[data.combination]) == {1.0, 0.9}
    kr = data.grid("kr")
    assert kr.max() > 1.0
    for part in (data.read, data.scored):
        assert 0.02 <= kr[part].min() < kr[part].max() <= 1.0


def test_leaving_the_censored_rows_out_would_be_wrong() -> None:
    method, term = METHOD_OF["sliding"], TERMS["pgv_pga"]
    data = fit_data(drawn("sliding", "pgv_pga"), method, term)
    assert 0.05 < np.mean(~data.observed) < 0.6
    form = method.forms["pgv_pga"]
    rows, start = censored_rows(data, form), np.array(form.start)
    right, wrong = most_likely(rows, start), most_likely(rows.only(data.observed), start)
    true = np.array(TRUE["sliding", "pgv_pga"])
    assert np.abs(right - true).max() < 0.5 * np.abs(wrong - true).max()


def test_undecided_outcomes_and_those_of_a_search_are_left_out() -> None:
    source = drawn("slumping", "pgv_pga", n=400)
    report = fit(source, kind="slumping", term="pgv_pga")
    assert report.details["judged_on"] == "simulated outcomes"
    failed = source.failed.copy()
    failed[3, 2] = np.nan
    undecided = fit(replace(source, failed=failed), kind="slumping", term="pgv_pga")
    assert any("1 of 2400 blocks of the grid have no outcome" in w for w in undecided.warnings)
    # what an older rbfrag stored beside them ends where a contact is lost
    status = source.table.status.copy()
    status[::2] = "below_limit"
    table = replace(source.table, status=status)
    half = fit(replace(source, table=table), kind="slumping", term="pgv_pga")
    chosen = np.arange(1, 400, 2)
    assert (
        half.coefficients == fit(source.only(chosen), kind="slumping", term="pgv_pga").coefficients
    )


def test_rows_without_magnitude_are_left_out_of_forms_with_it() -> None:
    source = drawn("slumping", "pgv_pga_m", n=400)
    magnitude = source.table.measure("magnitude").copy()
    magnitude[::2] = np.nan
    unknown = with_magnitude(source, magnitude)
    chosen = source.only(np.arange(1, 400, 2))
    of_m = fit(unknown, kind="slumping", term="pgv_pga_m").coefficients
    assert of_m == fit(chosen, kind="slumping", term="pgv_pga_m").coefficients
    without = fit(unknown, kind="slumping", term="pgv_pga").coefficients
    assert without == fit(source, kind="slumping", term="pgv_pga").coefficients


@pytest.mark.parametrize(
    ("kind", "term"), [("toppling", "pgv"), ("sliding", "pgv"), ("slumping", "pgv_pga")]
)
def test_a_database_without_such_campaigns_is_rejected(
    kind: str, term: str, tmp_path: Path
) -> None:
    place = tmp_path / "empty.db"
    with (
        opened_database(place, create=True) as engine,
        engine.connect() as connection,
        pytest.raises(FitError, match=f"rbfrag simulate, of kind {kind}"),
    ):
        fit(connection, kind=kind, term=term)


def test_what_does_not_go_together_is_rejected() -> None:
    source = drawn("sliding", "pgv_pga", n=100)
    with pytest.raises(InputError, match="unknown kind 'falling'"):
        fit(source, kind="falling", term="pgv")
    with pytest.raises(InputError, match=r"method confined cannot be combined with the term pgv:"):
        fit(source, kind="confined_toppling", term="pgv")
    with pytest.raises(InputError, match=r"wls fits blocks with p2 and kr.*by displacement"):
        fit(source, kind="sliding", term="pgv", method="wls")
    with pytest.raises(InputError, match=r"displacement cannot be combined with the term xp"):
        fit(source, kind="sliding", term="xp")
    with pytest.raises(InputError, match="not a failure criterion of kind sliding"):
        fit(source, kind="sliding", term="pgv", rotation_deg=2.0)
    with pytest.raises(InputError, match="keeps M = 1"):
        fit(source, kind="sliding", term="pgv", estimate_m=True)


def test_another_kind_of_the_same_block_is_fitted_by_the_same_methods() -> None:
    # no file knows this kind: what describes its block is enough
    source = drawn_outcomes("logistic", "pgv", TRUTH["logistic", "pgv"], events=12)
    logistic = next(m for m in methods() if m.name == "logistic")
    toppling = fit_source(source, TERMS["pgv"], logistic, name="m").report
    falls = fit_source(source, TERMS["pgv"], logistic, kind="falls", name="m").report
    assert falls.coefficients == toppling.coefficients
    assert (falls.kind, falls.model.row.kind) == ("falls", "falls")
    assert "falls" in falls.model.meaning


def test_a_kind_without_a_search_is_fitted_to_its_outcomes() -> None:
    source = drawn_outcomes("logistic", "pgv", TRUTH["logistic", "pgv"], events=12)
    n = source.table.p2.size
    none = {name: np.full(n, np.nan) for name in ("kr_over_pga", "kr", "y_m_s")}
    table = replace(source.table, status=np.full(n, "not_searched", dtype=object), **none)
    expected = fit(source, term="pgv", method="logistic")
    report = fit(replace(source, table=table), term="pgv", method="logistic")
    assert report.coefficients == pytest.approx(expected.coefficients, rel=1e-9)
    read = fit_data(source, method_named("logistic"), TERMS["pgv"]).read
    assert (report.n, report.n_censored, report.events) == (read.sum(), 0, 12)
    with pytest.raises(FitError, match="0 critical values were found"):
        fit(replace(source, table=table), term="pgv", method="lognormal")
