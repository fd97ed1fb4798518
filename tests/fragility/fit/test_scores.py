import math

import numpy as np
import pytest

from rbfrag.fragility.fit.scores import (
    CLIP,
    brier,
    calibration,
    critical_outcomes,
    log_loss,
    normal_log_density,
)


def test_outcomes_of_found_and_censored_points():
    y = np.array([0.5, 0.05, np.nan])
    found = np.array([True, False, True])
    y0, outcome, known = critical_outcomes(y, found, np.array([1.0, 0.2, np.nan]))
    assert y0.shape == (3, 25)
    assert np.array_equal(outcome[0], (y0[0] <= 0.5).astype(float))
    assert known[0].all()
    # The censored value lies below 0.05: blocks above are safe, of those below nothing is known.
    assert np.array_equal(known[1], y0[1] > 0.05)
    assert not outcome[1].any()
    assert not known[2].any()


def test_scores_by_hand():
    p = np.array([[0.8, 0.4, 0.0]])
    outcome = np.array([[1.0, 0.0, 1.0]])
    known = np.array([[True, True, False]])
    assert log_loss(p, outcome, known) == pytest.approx(-(math.log(0.8) + math.log(0.6)) / 2)
    assert brier(p, outcome, known) == pytest.approx((0.04 + 0.16) / 2)
    everything = np.ones((1, 3), dtype=bool)
    assert log_loss(p, outcome, everything) == pytest.approx(
        -(math.log(0.8) + math.log(0.6) + math.log(CLIP)) / 3
    )


def test_normal_density():
    density = np.exp(normal_log_density(np.linspace(-4, 6, 2001), np.array(1.0), np.array(0.25)))
    assert density.sum() * 0.005 == pytest.approx(1.0, abs=1e-9)
    assert density.max() == pytest.approx(1 / math.sqrt(2 * math.pi * 0.25))


@pytest.mark.parametrize("between", [0, 5, 50])
def test_calibration_of_a_model_that_is_far_too_sure(between):
    from scipy.optimize import minimize

    # nearly all probabilities are 0 or 1 and many of them wrong: whole Newton steps run away
    rng = np.random.default_rng(0)
    p = np.concatenate([np.zeros(500), np.ones(500), rng.uniform(size=between)])
    toppled = (rng.uniform(size=p.size) < np.repeat([0.02, 0.9, 0.5], [500, 500, between])) * 1.0
    found = calibration(p[None], toppled[None], np.ones((1, p.size), dtype=bool))
    x = np.log(np.clip(p, CLIP, 1 - CLIP) / (1 - np.clip(p, CLIP, 1 - CLIP)))

    def loss(b):
        eta = b[0] + b[1] * x
        return float(np.sum(np.logaddexp(0.0, eta) - toppled * eta))

    best = minimize(loss, [0.0, 0.3], method="BFGS", tol=1e-10)
    assert loss([found.intercept, found.slope]) <= best.fun + 1e-9
    assert (found.intercept, found.slope) == pytest.approx(best.x, abs=1e-4)
