"""The mean over draws and its interval, of draws computed by another version of the package."""

from __future__ import annotations

import math

import numpy as np
import pytest

import rbfrag
from rbfrag.question import scenario
from rbfrag.question.measurement import PointAnswer, mixture_of
from tests.question.measurement.draws_of_reference import FIXTURE, ROWS

EXPECTED = {
    1: (0.233122, 4.49e-6, 0.802585, 0),
    2: (0.223366, 4.72e-5, 0.755176, 0),
    3: (0.177781, 0.00983, 0.489719, 0),
    4: (0.967603, 0.7860, 0.999999, 77),
    5: (0.240358, 0.003573, 0.838378, 0),
    6: (0.292300, 1.00e-6, 0.958963, 0),
    7: (0.738361, 0.4271, 0.940679, 0),
    8: (0.006601, 1.64e-4, 0.034009, 0),
}
"""P, the ends of its 95 % interval, and the number of draws that do not stand."""


def drawn_answers(number: int) -> tuple[list[PointAnswer], int]:
    """Return the answers of the draws that stand, and the number of the others."""
    with np.load(FIXTURE) as stored:
        columns = [stored[f"{n}_{number}"] for n in ("probability", "ci_low", "ci_high")]
    is_valid = ~np.isnan(columns[0])
    rows = zip(*(column[is_valid].tolist() for column in columns), strict=True)
    return [PointAnswer(*row, in_domain=True) for row in rows], int((~is_valid).sum())


@pytest.mark.parametrize("number", EXPECTED)
def test_the_mean_and_the_interval_of_given_draws(number: int) -> None:
    probability, low, high, excluded = EXPECTED[number]
    answers, without = drawn_answers(number)
    mixture = mixture_of(answers, 0.95)
    assert without == excluded
    assert mixture.probability == pytest.approx(probability, abs=1e-6)
    for end, expected in ((mixture.low, low), (mixture.high, high)):
        # below .01 to 1 % of the value
        tolerance = 5e-5 if expected >= 0.01 else 0.01 * expected
        assert end == pytest.approx(expected, abs=tolerance)


SIGMAS = {
    "height_m": "height_sigma_m", "width_m": "width_sigma_m", "beta_deg": "beta_sigma_deg",
    "phi_deg": "phi_sigma_deg", "amplification": "gmm_sigma",
}  # fmt: skip


@pytest.mark.parametrize("number", [5])  # the others are answered by models that are replaced
def test_the_package_draws_the_same_blocks(number: int, monkeypatch: pytest.MonkeyPatch) -> None:
    # the fixture's version had the dispersion of a component about RotD50 to all digits: .16118
    monkeypatch.setattr(scenario, "COMPONENT_SIGMA", 0.07 * math.log(10.0))
    inputs, sigmas = ROWS[number - 1]
    named = {SIGMAS[name]: value for name, value in sigmas.items()}
    answer = rbfrag.predict(**inputs, **named)
    expected = mixture_of(drawn_answers(number)[0], 0.95)
    for end, other in (
        (answer.probability, expected.probability),
        (answer.ci_low, expected.low),
        (answer.ci_high, expected.high),
    ):
        assert end == pytest.approx(other, rel=1e-7, abs=1e-12)
