"""Coefficients of the ground-motion model at all its periods, against other implementations."""

from __future__ import annotations

import numpy as np
import pytest

from rbfrag.fragility.method import SINGLE, arrays
from rbfrag.question.bssa14 import MEASURES, PERIODS_S, bssa14
from rbfrag.vocabulary.quantities import MECHANISMS

# Median [g] for M 7, R_JB 20 km, Vs30 250 m/s, strike-slip and total standard deviation for M 5,
# R_JB 0 km, Vs30 250 m/s: OpenQuake's test tables BSSA_2014_MEAN.csv and BSSA_2014_TOTAL_STD.csv,
# and pygmm 0.8 at 0.75 s, which the tables do not have. PGV in m/s.
REFERENCE = {
    "pgv_m_s": (0.259938, 0.6626), "pga_g": (0.218622, 0.6651), "sa(0.1)": (0.335235, 0.7629),
    "sa(0.15)": (0.425460, 0.7217), "sa(0.2)": (0.480526, 0.6800), "sa(0.25)": (0.488948, 0.6635),
    "sa(0.3)": (0.488694, 0.6568), "sa(0.4)": (0.447782, 0.6513), "sa(0.5)": (0.411351, 0.6513),
    "sa(0.75)": (0.312087, 0.6641), "sa(1)": (0.252744, 0.7004), "sa(1.5)": (0.172427, 0.7074),
    "sa(2)": (0.127737, 0.7119), "sa(3)": (0.0822638, 0.7255), "sa(4)": (0.0591291, 0.7285),
    "sa(5)": (0.0445474, 0.7201), "sa(7.5)": (0.0239807, 0.6934), "sa(10)": (0.0135034, 0.6648),
}  # fmt: skip

SITES = tuple(
    (magnitude, vs30, mechanism)
    for magnitude in (4.0, 5.5, 7.0)
    for vs30 in (200.0, 500.0, 1200.0)
    for mechanism in range(len(MECHANISMS))
)


def test_every_measure_equals_other_implementations() -> None:
    assert tuple(REFERENCE) == MEASURES
    for measure, (median, sigma) in REFERENCE.items():
        strike_slip = MECHANISMS.index("strike-slip")
        result = bssa14(measure, 7.0, 20.0, 250.0, strike_slip, SINGLE)
        assert result.median == pytest.approx(median, rel=1e-5)
        result = bssa14(measure, 5.0, 0.0, 250.0, strike_slip, SINGLE)
        assert result.sigma(SINGLE) == pytest.approx(sigma, abs=6e-5)


@pytest.mark.parametrize("measure", MEASURES)
def test_medians_fall_with_distance_and_rise_with_magnitude(measure: str) -> None:
    rjb = np.geomspace(1.0, 400.0, 60)
    for magnitude, vs30, mechanism in SITES:
        medians = bssa14(measure, magnitude, rjb, vs30, mechanism, arrays()).median
        assert (np.diff(medians) < 0.0).all()
    magnitude = np.linspace(3.0, 7.0, 41)
    for vs30 in (500.0, 760.0):  # on soft ground the nonlinear site response limits PGA
        medians = bssa14(measure, magnitude, 30.0, vs30, 0, arrays()).median
        assert (np.diff(medians) > 0.0).all()


def test_spectra_are_smooth_and_have_one_peak() -> None:
    for magnitude, vs30, mechanism in SITES:
        ordinates = [
            bssa14(measure, magnitude, 20.0, vs30, mechanism, SINGLE) for measure in MEASURES[2:]
        ]
        ln_sa = np.log([ordinate.median for ordinate in ordinates])
        slopes = np.diff(ln_sa) / np.diff(np.log(PERIODS_S))
        assert (np.abs(np.diff(slopes)) < 1.2).all()
        assert (np.diff(np.sign(slopes)) != 0.0).sum() <= 1
        sigma = [ordinate.sigma(SINGLE) for ordinate in ordinates]
        assert 0.5 < min(sigma) < max(sigma) < 0.9
