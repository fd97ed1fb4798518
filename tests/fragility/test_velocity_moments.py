"""Moments of the block-relative spectral velocities of a scenario, against simulation."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from rbfrag.fragility import velocity_moments
from rbfrag.fragility.correlation import correlation, nearest_correlation
from rbfrag.fragility.method import SINGLE
from rbfrag.fragility.velocity_moments import (
    VelocityMoments,
    rocking_moments,
    rocking_weights,
    toppling_moments,
    toppling_weights,
)
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.question.bssa14 import PERIODS_S, bssa14

P = np.sqrt([30.0, 10.0, 3.0, 1.0, 0.1])
SITES = ((6.0, 20.0, 500.0), (6.5, 10.0, 760.0), (7.0, 20.0, 400.0), (7.5, 5.0, 300.0))
DRAWS = 8000


def spectrum(site: tuple[float, float, float]) -> tuple[dict[float, float], dict[float, float]]:
    """Medians [g] and standard deviations of the spectral accelerations, by period."""
    ordinates = {period_s: bssa14(f"sa({period_s:g})", *site, 0, SINGLE) for period_s in PERIODS_S}
    return (
        {period_s: ordinate.median for period_s, ordinate in ordinates.items()},
        {period_s: ordinate.sigma(SINGLE) for period_s, ordinate in ordinates.items()},
    )


def velocities(ln_v: np.ndarray[Any, Any], p: float) -> tuple[Any, Any]:
    """ln X and ln A of spectra of ln V at PERIODS_S, from their definition."""
    nodes = np.log(PERIODS_S)
    periods = 0.1 * 100.0 ** (np.arange(60) / 59.0)
    x = 1.4 * 2.0 * math.pi / (p * periods)
    v = np.exp([np.interp(np.log(periods), nodes, row) for row in ln_v])
    ln_x = np.log(np.mean((v * x / np.sqrt(1.0 + x * x)) ** 3, axis=-1)) / 3.0
    periods = np.clip(0.25 * 8.0 ** (np.arange(24) / 23.0) * 2.0 * math.pi / p, 0.1, 10.0)
    return ln_x, np.mean([np.interp(np.log(periods), nodes, row) for row in ln_v], axis=-1)


@pytest.mark.parametrize("site", SITES)
def test_moments_equal_a_simulation(
    site: tuple[float, float, float], monkeypatch: pytest.MonkeyPatch
) -> None:
    sa_g, sa_sigma = spectrum(site)
    names = ["pgv_m_s", "pga_g", *(f"sa({period_s:g})" for period_s in PERIODS_S)]
    # the ordinates alone are positive definite, with PGV and PGA they are not: both use the nearest
    rho = nearest_correlation([[correlation(a, b) for b in names] for a in names])
    monkeypatch.setattr(
        velocity_moments, "correlation", lambda a, b: rho[names.index(a), names.index(b)]
    )
    z = np.random.default_rng(5).multivariate_normal(np.zeros(len(names)), rho, DRAWS)
    ln_v = np.log([sa * STANDARD_GRAVITY_M_S2 * t / (2.0 * math.pi) for t, sa in sa_g.items()])
    draws = ln_v + z[:, 2:] * np.array([*sa_sigma.values()])
    moments = toppling_moments(P, sa_g, sa_sigma), rocking_moments(P, sa_g, sa_sigma)
    for i, p in enumerate(P):
        for closed, simulated in zip(moments, velocities(draws, p), strict=True):
            assert closed.ln_median[i] == pytest.approx(np.median(simulated), abs=0.05)
            assert closed.sigma[i] == pytest.approx(simulated.std(), rel=0.05)
            of_peaks = np.corrcoef(simulated, z[:, :2].T)[0, 1:]
            expected = closed.pgv_correlation[i], closed.pga_correlation[i]
            assert expected == pytest.approx(of_peaks, abs=0.03)


def test_moments_are_those_of_the_specification() -> None:
    for site in SITES:
        sa_g, sa_sigma = spectrum(site)
        x, a = toppling_moments(P, sa_g, sa_sigma), rocking_moments(P, sa_g, sa_sigma)
        assert x.sigma[:3] == pytest.approx([0.57] * 3, abs=0.02)
        assert 0.84 < x.pgv_correlation[:3].min() < x.pgv_correlation[:3].max() < 0.92
        assert ((a.sigma[:3] > 0.57) & (a.sigma[:3] < 0.61)).all()
        assert a.pga_correlation[:3] == pytest.approx([0.69, 0.56, 0.43], abs=0.01)


def test_zero_variance_gives_the_velocities_of_the_spectrum() -> None:
    sa_g, _ = spectrum(SITES[0])
    ln_v = np.log([sa * STANDARD_GRAVITY_M_S2 * t / (2.0 * math.pi) for t, sa in sa_g.items()])
    for p in P:
        for result, (expected,) in zip(
            (toppling_moments(p, sa_g, {}), rocking_moments(p, sa_g, {})),
            velocities(ln_v[None], p),
            strict=True,
        ):
            assert result.ln_median == pytest.approx(expected, rel=1e-12)
            assert result[1:] == (0.0, 0.0, 0.0)


def test_pga_is_the_ordinate_at_0_03_s() -> None:
    # ln X of PGA .4 g and SA(.3, 1, 3 s) = .9, .5, .15 g for p² = 18: a value of the specification
    sa_g, p = {0.3: 0.9, 1.0: 0.5, 3.0: 0.15}, math.sqrt(18.0)
    x = toppling_moments(p, sa_g, {}, 0.4)
    assert x.ln_median == pytest.approx(-0.7627, abs=5e-5)
    replaced = toppling_moments(p, {0.03: 0.4, **sa_g}, {}, 7.0, 3.0)
    assert replaced.ln_median == pytest.approx(x.ln_median, rel=1e-12)
    assert replaced.sigma == 0.0
    # PGA alone: V ∝ PGA at every period, so its variance and correlation are those of PGA
    for moments in (toppling_moments, rocking_moments):
        alone = moments(P, {}, {}, 0.4, 0.6)
        assert alone.sigma == pytest.approx(0.6)
        assert alone.pga_correlation == pytest.approx(1.0)
        assert alone.pgv_correlation == pytest.approx(0.733)
    longer = rocking_moments(P, {**sa_g, 12.0: 5.0}, {12.0: 3.0})
    assert longer.sigma == pytest.approx(0.0)


def test_numbers_and_arrays_agree() -> None:
    sa_g, sa_sigma = spectrum(SITES[1])
    for moments in (toppling_moments, rocking_moments):
        many = moments(
            P,
            {t: np.full(P.size, sa) for t, sa in sa_g.items()},
            sa_sigma,
            0.3,
            np.full(P.size, 0.6),
        )
        separate = [moments(p, sa_g, sa_sigma, 0.3, 0.6) for p in P]
        for name in VelocityMoments._fields:
            assert getattr(many, name) == pytest.approx([getattr(item, name) for item in separate])
        sites = moments(3.0, {1.0: np.array([0.1, 0.2, 0.4])}, {1.0: 0.6})
        assert [values.shape for values in sites] == [(3,)] * 4
        assert np.diff(sites.ln_median) == pytest.approx(math.log(2.0))


def test_weights_of_the_ordinates_sum_to_1() -> None:
    periods_s = np.array([0.03, 0.3, 1.0, 3.0])
    for weights in (toppling_weights(periods_s), rocking_weights(P, periods_s)):
        assert weights.shape[-1] == periods_s.size
        assert (weights >= 0.0).all()
        assert weights.sum(axis=-1) == pytest.approx(1.0)
