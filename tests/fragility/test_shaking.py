"""Shaking that is not known exactly: against samples, closed forms and the certain answer."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.stats import norm

from rbfrag.db.location import REFERENCE
from rbfrag.errors import InputError
from rbfrag.fragility.joint import shaken_share_range, share_range
from rbfrag.fragility.model_selection import find_model
from rbfrag.fragility.prediction import Prediction
from rbfrag.fragility.shaking import POINTS, WEIGHTS, correlation
from rbfrag.question.question import predict

BLOCK = {"p2": 3.6368, "kr": 0.15}
SAMPLES = 1_000_000


def ask(**question: object) -> Prediction:
    answer = predict(**{**BLOCK, "db": REFERENCE, **question})  # type: ignore[call-overload]
    assert isinstance(answer, Prediction)
    return answer


def sampled(model: str | None, **values: object) -> tuple[float, float]:
    """Return the mean of P over samples, and its standard error."""
    p = predict(
        **{**BLOCK, "db": REFERENCE, "model": model, "interval": False, **values}
    ).probability  # type: ignore[call-overload]
    return float(np.mean(p)), float(np.std(p)) / math.sqrt(np.size(p))


def test_points_have_the_moments_of_a_standard_normal_variable() -> None:
    x, w = np.array(POINTS), np.array(WEIGHTS)
    assert x.size == 41
    for power, moment in ((0, 1.0), (1, 0.0), (2, 1.0), (4, 3.0), (6, 15.0)):
        assert w @ x**power == pytest.approx(moment, rel=1e-5, abs=1e-12)


@pytest.mark.parametrize(
    ("pgv", "sigma", "kr_sigma"),
    [(0.5, 0.6, 0.0), (0.5, 0.6, 0.2), (0.8, 0.6, 0.2), (0.16845, 0.6711, 0.0), (0.3, 1.0, 0.0)],
)
def test_one_measure_is_the_mean_over_samples(pgv: float, sigma: float, kr_sigma: float) -> None:
    answer = ask(pgv_m_s=pgv, pgv_sigma=sigma, kr_sigma=kr_sigma)
    z = np.random.default_rng(1).standard_normal((2, SAMPLES))
    mean, error = sampled(
        answer.model, pgv_m_s=pgv * np.exp(sigma * z[0]), kr=0.15 * np.exp(kr_sigma * z[1])
    )
    assert answer.probability == pytest.approx(mean, abs=3.0 * error + 2e-5)
    assert answer.ci_low < answer.probability < answer.ci_high
    assert (answer.block_sd is None) == (kr_sigma == 0.0)


def test_the_median_alone_says_nothing_fails() -> None:
    assert ask(pgv_m_s=0.5).probability < 1e-4
    assert ask(pgv_m_s=0.5, pgv_sigma=0.6).probability > 0.08


def test_rare_failures_keep_their_probability() -> None:
    # far in the tail, where a rule that ends at four deviations loses most
    answer = ask(pgv_m_s=0.059, pgv_sigma=0.671)
    z = np.linspace(-8.0, 8.0, 200_001)
    p = predict(
        **BLOCK, pgv_m_s=0.059 * np.exp(0.671 * z), db=REFERENCE, interval=False
    ).probability
    exact = float(np.sum(p * norm.pdf(z)) * (z[1] - z[0]))
    assert 1e-6 < exact < 1e-4
    assert answer.probability == pytest.approx(exact, rel=0.02)
    beyond = float(np.sum((p * norm.pdf(z))[np.abs(z) > 4.0]) * (z[1] - z[0]))
    assert beyond > 0.2 * exact


def test_the_interval_is_that_of_the_parameters() -> None:
    # one step of all parameters moves P at all points together, as far as it is linear
    answer = ask(pgv_m_s=0.5, pgv_sigma=0.6)
    model = find_model(None, ["p2", "kr", "pgv_m_s"], REFERENCE)
    steps = np.array(model.errors.steps)
    g = len(steps)
    pgv = 0.5 * np.exp(0.6 * np.array(POINTS))

    def mean(parameters: np.ndarray) -> float:
        moved = type(model)(**{**vars(model), "parameters": tuple(parameters)})
        p = predict(**BLOCK, pgv_m_s=pgv, model=moved, interval=False).probability
        return float(p @ np.array(WEIGHTS))

    middle = np.array(model.parameters)
    half = np.array([0.5 * (mean(middle + d) - mean(middle - d)) for d in steps])
    error = math.sqrt((g - 1.0) / g * float(half @ half))
    width = answer.ci_high - answer.ci_low
    assert width / 2.0 == pytest.approx(error * 2.0, rel=0.15)


@pytest.mark.parametrize(
    "names", [("pgv_m_s", "pga_g"), ("sa(1)", "pga_g"), ("sa(1)", "pga_g", "sa(0.3)", "sa(3)"),
              ("pgv_m_s", "pga_g", "sa(1)", "sa(3)")],
)  # fmt: skip
@pytest.mark.parametrize("block", [(3.6368, 0.15), (20.0, 0.1), (1.0, 0.25)])
def test_several_measures_are_the_mean_over_samples(
    names: tuple[str, ...], block: tuple[float, float]
) -> None:
    medians = {"pgv_m_s": 0.5, "pga_g": 0.35, "sa(0.3)": 0.7, "sa(1)": 0.5, "sa(3)": 0.15}
    block_inputs = dict(zip(("p2", "kr"), block, strict=True))
    model = find_model(None, [*block_inputs, *names], REFERENCE)
    assert set(model.term.inputs) == set(names)
    sigma = {name: 0.6 + 0.03 * i for i, name in enumerate(names)}
    nominal = {f"{name.partition('_')[0]}_sigma": value for name, value in sigma.items()}
    arguments = {name: medians[name] for name in names}
    answer = ask(**block_inputs, **arguments, **nominal, amplification_sigma=0.16)
    covariance = np.array(
        [[correlation(a, b) * sigma[a] * sigma[b] + 0.16**2 for b in names] for a in names]
    )
    z = np.random.default_rng(2).multivariate_normal(np.zeros(len(names)), covariance, SAMPLES)
    mean, error = sampled(
        answer.model,
        **block_inputs,
        **{n: arguments[n] * np.exp(z[:, i]) for i, n in enumerate(names)},
    )
    # the spectral velocity of ordinates that scatter is taken as lognormal
    approximate = 0.1 * mean if any(name.startswith("sa(") for name in names) else 0.0
    assert answer.probability == pytest.approx(mean, abs=2e-4 + 3.0 * error + approximate)


def test_arrays_answer_as_single_numbers() -> None:
    pgv, sigma = np.array([0.2, 0.5, 0.8]), np.array([0.3, 0.6, 0.0])
    many = predict(**BLOCK, pgv_m_s=pgv, pgv_sigma=sigma, db=REFERENCE)
    for i in range(3):
        single = ask(pgv_m_s=float(pgv[i]), pgv_sigma=float(sigma[i]))
        for name in ("probability", "ci_low", "ci_high"):
            assert getattr(many, name)[i] == pytest.approx(
                getattr(single, name), rel=1e-9, abs=1e-15
            )


def test_amplification_moves_median_and_scatter() -> None:
    amplified = ask(pgv_m_s=0.5, pgv_sigma=0.6, amplification=1.5, amplification_sigma=0.2)
    assert amplified.probability == ask(pgv_m_s=0.75, pgv_sigma=math.hypot(0.6, 0.2)).probability
    assert amplified.shaking == {
        "pgv_m_s": {"median": 0.75, "sigma": pytest.approx(math.hypot(0.6, 0.2))}
    }
    certain = [ask(pgv_m_s=0.5, amplification=a).probability for a in (1.0, 1.4)]
    assert certain == [ask(pgv_m_s=pgv).probability for pgv in (0.5, 0.7)]


def test_what_cannot_be_used_is_rejected() -> None:
    with pytest.raises(InputError, match="pgv_sigma = -1"):
        ask(pgv_m_s=0.5, pgv_sigma=-1.0)
    with pytest.raises(InputError, match="amplification = 0"):
        ask(pgv_m_s=0.5, amplification=0.0)
    rows = predict(**BLOCK, pgv_m_s=0.5, pgv_sigma=np.array([0.5, -0.5, np.nan]), db=REFERENCE)
    assert np.isfinite(rows.probability).tolist() == [True, False, False]
    assert "pgv_sigma" in rows.reason[1]
    unread = ask(pgv_m_s=0.5, pga_sigma=0.5)
    assert any(text.startswith("pga_sigma was not used") for text in unread.warnings)


def test_the_range_of_one_earthquake_takes_in_what_its_sites_share() -> None:
    question = {"pgv_m_s": 0.5, "pgv_sigma": 0.6}
    assert ask(**question, sites=30).event_low is None
    alone, half, all_of_it = (ask(**question, pgv_tau=t, sites=30) for t in (0.0, 0.4, 0.6))
    widths = [
        item.event_high - item.event_low  # type: ignore[operator]
        for item in (alone, half, all_of_it)
    ]
    assert widths[0] < widths[1] < widths[2]


def test_the_range_without_scatter_is_that_of_certain_shaking() -> None:
    law = find_model(None, ["p2", "kr", "pgv_m_s"], REFERENCE).dependence
    assert law is not None
    along = np.full(41, 0.2)
    for sites in (1, 30):
        ends = shaken_share_range(along, 0.3, 0.6, law, sites, 0.95)
        expected = share_range(0.2, law, sites, 0.95)
        assert ends == pytest.approx([float(end) for end in expected], abs=1.01 / (4 * sites))


def test_the_range_at_many_sites_is_that_of_the_limit() -> None:
    # quantiles of E Φ((a + √ρ u)/√(1-ρ)) over what is shared, by samples
    law = find_model(None, ["p2", "kr", "pgv_m_s"], REFERENCE).dependence
    assert law is not None
    tau, sigma = 0.4, 0.6
    along = norm.cdf(1.5 * np.array(POINTS) - 1.0)
    ends = shaken_share_range(along, tau, sigma, law, 5000, 0.9)
    random, expected = np.random.default_rng(3), np.linspace(-5.0, 5.0, 201)
    shared = random.standard_normal((2, 20_000))
    score = (tau * shared[0][:, None] + math.sqrt(sigma**2 - tau**2) * expected) / sigma
    a = np.interp(score, POINTS, 1.5 * np.array(POINTS) - 1.0)
    inner = norm.cdf((a + math.sqrt(law.rho_e) * shared[1][:, None]) / math.sqrt(1.0 - law.rho_e))
    weight = norm.pdf(expected) / norm.pdf(expected).sum()
    assert ends == pytest.approx(np.quantile(inner @ weight, (0.05, 0.95)), abs=0.02)


def test_the_deviation_over_blocks_is_that_of_uncertain_blocks_alone() -> None:
    question = {"p2": [3.0, 5.0], "kr": [0.1, 0.1], "pgv_m_s": 0.6, "pgv_sigma": 0.5}
    assert predict(**question, db=REFERENCE).block_sd is None
    assert (predict(**question, kr_sigma=0.1, db=REFERENCE).block_sd > 0.0).all()
