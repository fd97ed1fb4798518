"""Fits of outcomes: known parameters come back, and bad data are rejected."""

from dataclasses import replace

import numpy as np
import pytest

from rbfrag.errors import FitError, InputError
from rbfrag.fragility.fit import maximum_likelihood
from rbfrag.fragility.fit.data import FitSource, fit_data
from rbfrag.fragility.fit.fitting import fit, fit_source
from rbfrag.fragility.fit.likelihood import most_likely
from rbfrag.fragility.fit.maximum_likelihood import outcome_rows, parameter_names
from rbfrag.fragility.fit.report import FitReport
from rbfrag.fragility.fit.result import cr3, jackknife_steps
from rbfrag.fragility.measures import TERMS
from rbfrag.fragility.method import SINGLE
from rbfrag.fragility.methods import method_named
from rbfrag.fragility.model import FragilityModel
from tests.fragility.outcome_draws import TRUTH, drawn_outcomes


@pytest.fixture(autouse=True)
def few_replicates(monkeypatch):
    monkeypatch.setattr(maximum_likelihood, "OUTCOME_REPLICATES", 20)


def rows_of(source, method, term):
    how, of = method_named(method), TERMS[term]
    return outcome_rows(fit_data(source, how, of), how, of, parameter_names(how, of))


@pytest.mark.parametrize(("method", "term"), TRUTH)
def test_known_parameters_come_back(method, term):
    source = drawn_outcomes(method, term, TRUTH[method, term], shared=0.1, seed=2)
    report = fit(source, term=term, method=method)
    parameters = np.array(list(report.coefficients.values()))
    errors = np.array(list(report.standard_errors.values()))
    assert np.all(np.abs(parameters - TRUTH[method, term]) < 3.5 * errors)
    assert np.all(errors < 0.3 * np.abs(TRUTH[method, term]) + 0.3)


def test_the_intervals_cover_as_often_as_they_say():
    # A reduced form of benchmarks/recovery.py: binomial(40, 0.95) is below 34 in 1 % of cases.
    truth = TRUTH["logistic", "pgv"]
    hits = np.zeros(2)
    for seed in range(40):
        source = drawn_outcomes("logistic", "pgv", truth, shared=0.15, motions=1, seed=seed)
        rows = rows_of(source, "logistic", "pgv").data
        b = most_likely(rows)
        covariance = cr3(jackknife_steps(rows, b))
        hits += np.abs(b - truth) <= 2.013 * np.sqrt(np.diag(covariance))
    assert np.all(hits >= 34)


def test_the_report_holds_what_it_promises():
    source = drawn_outcomes("toppling", "pgv_pga", TRUTH["toppling", "pgv_pga"], shared=0.1)
    report = fit(source, term="pgv_pga", method="toppling")
    names = ["b0", "b_ln_r", "b_ln_1_minus_r", "b_ln_1_minus_v", "b_ln_z", "b_ln_x"]
    assert list(report.coefficients) == names
    assert report.details["judged_on"] == "simulated outcomes"
    assert report.details["n_bounded_toppled"] == 0
    assert report.scores["calibration_slope_held_out"] == pytest.approx(1.0, abs=0.15)
    low, high = report.details["score_intervals"]["log_loss_held_out"]
    assert low < report.scores["log_loss_held_out"] < high
    again = FitReport.from_model(FragilityModel.from_row(report.model.row))
    assert again.as_dict() == report.as_dict()


def test_errors_grow_with_what_earthquakes_share():
    values = []
    for shared in (0.0, 0.3):
        source = drawn_outcomes("logistic", "pgv", TRUTH["logistic", "pgv"], shared=shared)
        report = fit(source, term="pgv", method="logistic", bootstrap=True)
        naive = report.details["naive_standard_errors"]["b0"]
        values.append(report.standard_errors["b0"] / naive)
        boot = report.details["bootstrap"]["standard_errors"]["b0"]
        assert boot == pytest.approx(report.standard_errors["b0"], rel=0.6)
    assert 0.6 < values[0] < 1.6
    assert values[1] > 1.5 * values[0]


def test_held_out_probabilities_are_those_of_separate_fits():
    source = drawn_outcomes("record", "xp", TRUTH["record", "xp"], events=8)
    record = method_named("record")
    fitted = fit_source(source, TERMS["xp"], record)
    data = fitted.data
    reference = data.event == 3
    names = [data.event_names[i] for i in data.event]
    alternatives = source.only(source.table.event_id != names[int(np.argmax(reference))])
    names_of_fit = parameter_names(record, TERMS["xp"])
    rest = fit_data(alternatives, record, TERMS["xp"])
    b = most_likely(outcome_rows(rest, record, TERMS["xp"], names_of_fit).data)
    i = int(np.flatnonzero(reference)[0])
    for j in np.flatnonzero(data.read[i])[::5]:
        values = {name: float(data.grid(name)[i, j]) for name in data.blocks}
        form = record.forms["xp"]
        if any(bound.holds(values) for bound in form.bounds):
            assert fitted.result.held_out[i, j] == 0.0
            continue
        eta = form.eta(b.tolist(), values, SINGLE).eta
        expected = record.link.probability(eta, SINGLE)
        assert fitted.result.held_out[i, j] == pytest.approx(expected, rel=1e-5)


def test_unknown_outcomes_are_left_out():
    source = drawn_outcomes("logistic", "pgv", TRUTH["logistic", "pgv"])
    failed = source.failed.copy()
    failed[::2, :5] = np.nan
    data = fit_data(replace(source, failed=failed), method_named("logistic"), TERMS["pgv"])
    rows = rows_of(replace(source, failed=failed), "logistic", "pgv")
    expected = data.read & np.isfinite(data.failed)
    assert rows.data.weights.sum() == expected.sum() < data.read.sum()


def test_fits_read_blocks_as_rock_has_them_and_are_judged_on_the_grid():
    source = drawn_outcomes("logistic", "pgv", TRUTH["logistic", "pgv"])
    weaker = source.k_over_pga[:, :1] * np.geomspace(0.0215, 0.1, 11)[:-1] / 0.1
    wider = replace(
        source,
        k_over_pga=np.column_stack([weaker, source.k_over_pga]),
        failed=np.column_stack([np.ones(weaker.shape), source.failed]),
    )
    data = fit_data(wider, method_named("logistic"), TERMS["pgv"])
    kr, ratio = data.grid("kr"), data.grid("y_m_s") / data.grid("pgv_m_s")
    assert (kr[data.read] >= 0.02).all()
    assert (kr[data.read] <= 1.0).all()
    assert data.domain["kr"] == (0.02, 1.0)
    assert np.array_equal(data.read, (kr >= 0.02) & (kr <= 1.0))
    # ten steps above the grid, all of them safe, and ten below it
    assert ratio.max() == pytest.approx(4.0 * 40.0 ** (10.0 / 24.0))
    steps = np.diff(np.log(ratio), axis=1)
    assert steps == pytest.approx(np.full_like(steps, np.log(40.0) / 24.0), rel=1e-3)
    above, below = ratio > 4.0 * (1.0 + 1e-9), ratio < 0.1 * (1.0 - 1e-9)
    assert (data.read & above).sum() > 100 < (data.read & below).sum()
    assert (data.failed[above] == 0.0).all()
    # judged is what was run on the grid
    judged = data.judged.is_known
    assert np.array_equal(judged, data.read & ~above & ~below)
    real = data.judged_real
    assert real is not None
    assert np.array_equal(real.is_known, judged & (kr >= 0.05))
    scores = fit_source(wider, TERMS["pgv"], method_named("logistic")).report.scores
    assert scores["log_loss_held_out_kr05"] != scores["log_loss_held_out"]


def test_where_nothing_was_run_nothing_is_added():
    source = drawn_outcomes("logistic", "pgv", TRUTH["logistic", "pgv"])
    failed = source.failed.copy()
    failed[0] = np.nan
    data = fit_data(replace(source, failed=failed), method_named("logistic"), TERMS["pgv"])
    assert np.isnan(data.failed).all(axis=1).sum() == 1


def broken(source: FitSource, kind: str) -> FitSource:
    if kind == "none":
        return replace(source, failed=np.full_like(source.failed, np.nan))
    if kind == "all alike":
        return replace(source, failed=np.zeros_like(source.failed))
    if kind == "separated":
        grid = np.broadcast_to(np.arange(25) < 12, source.failed.shape)
        return replace(source, failed=grid.astype(float))
    few = np.zeros_like(source.failed)
    kr = source.k_over_pga * source.table.pga_g[:, None]
    few.flat[np.flatnonzero((kr > 0.05) & (kr < 0.5))[:7]] = 1.0
    return replace(source, failed=few)


@pytest.mark.parametrize(
    ("kind", "words"),
    [
        ("none", "none are stored: simulate kind toppling"),
        ("all alike", "0 toppled.*identical outcomes"),
        ("separated", "separated without error"),
        ("few", "7 outcomes on the grid toppled; a fit requires 20"),
    ],
)
def test_outcomes_that_cannot_carry_a_fit_are_rejected(kind, words):
    source = drawn_outcomes("logistic", "pgv", TRUTH["logistic", "pgv"])
    with pytest.raises(FitError, match=words):
        fit(broken(source, kind), term="pgv", method="logistic")


def test_what_does_not_go_together_is_rejected():
    source = drawn_outcomes("logistic", "pgv", TRUTH["logistic", "pgv"], events=5)
    with pytest.raises(
        InputError, match=r"record cannot be combined with the term pgv: it fits xp"
    ):
        fit(source, term="pgv", method="record")
    with pytest.raises(InputError, match=r"toppling keeps M = 1.*logistic, lognormal"):
        fit(source, term="pgv", method="toppling", estimate_m=True)
    no_spectrum = replace(source, xp_m_s=np.full(source.xp_m_s.size, np.nan))
    with pytest.raises(FitError, match=r"requires the toppling spectrum X\(p\).*rbfrag simulate"):
        fit(no_spectrum, term="xp", method="record")


def test_an_exponent_that_is_estimated():
    truth = (-2.0, 4.8, -0.5)
    source = drawn_outcomes("logistic", "pgv", truth, shared=0.1)
    report = fit(source, term="pgv", method="logistic", estimate_m=True)
    assert report.coefficients["b_ln_p"] == pytest.approx(
        -0.5, abs=3.5 * report.standard_errors["b_ln_p"]
    )
    assert list(fit(source, term="pgv", method="logistic").coefficients) == [
        "b0",
        "b_ln_x_over_y",
    ]
