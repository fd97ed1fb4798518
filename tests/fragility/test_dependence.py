"""The copula of one earthquake: its parameters, correlations and range of the next earthquake."""

from __future__ import annotations

import math
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import ndtr, ndtri
from scipy.stats import binom

from rbfrag.errors import InputError
from rbfrag.fragility.dependence import Dependence, normal_quantile
from rbfrag.fragility.joint import Placement, share_range
from tests.fragility.portfolio_draws import LAW, anywhere, correlation


def test_correlation_is_the_formula_term_by_term() -> None:
    # two sizes and strengths, at every relation that two blocks can have
    ln_p, ln_y = [0.0, 0.5], [0.2, -0.1]
    e, v, o, y = (
        math.exp(-d / length)
        for d, length in ((0.5, LAW.l_e), (0.5, LAW.l_v), (0.5, LAW.l_o), (0.3, LAW.l_y))
    )
    for label, expected in (
        (([0, 1], [0, 0], [0, 0], [1, 1]), 0.0),
        (([0, 0], [0, 1], [0, 0], [1, 1]), LAW.rho_e * e),
        (([0, 0], [0, 0], [0, 1], [1, 1]), (LAW.rho_e + LAW.rho_s) * e),
        (([0, 0], [0, 0], [0, 0], [1, 1]),
         (LAW.rho_e + LAW.rho_s) * e + (LAW.rho_v * v + LAW.rho_o * o) * y),
        (([0, 0], [0, 0], [0, 0], [1, -1]),
         (LAW.rho_e + LAW.rho_s) * e + (LAW.rho_v * v - LAW.rho_o * o) * y),
    ):  # fmt: skip
        names = ("earthquake", "site", "component", "polarity")
        labels = dict(zip(names, label, strict=True))
        r = correlation(LAW, Placement.of(ln_p, ln_y, **labels))
        assert r[0, 1] == r[1, 0] == pytest.approx(expected, abs=1e-15)
        assert r[0, 0] == r[1, 1] == 1.0


@given(
    st.lists(st.floats(0.0, 1.0), min_size=4, max_size=4).filter(lambda x: sum(x) > 0.01),
    st.lists(st.floats(0.05, 20.0), min_size=4, max_size=4),
    st.integers(0, 1000),
)
@settings(max_examples=60)
def test_correlations_are_positive_semidefinite(
    share: list[float], length: list[float], seed: int
) -> None:
    parts = np.array(share) / sum(share)
    law = Dependence(*parts[:3], max(0.0, 1.0 - float(parts[:3].sum())), *length)
    r = correlation(law, anywhere(25, seed))
    assert np.linalg.eigvalsh(r).min() > -1e-9


def test_what_is_no_dependence_is_rejected() -> None:
    with pytest.raises(InputError, match=r"is 0\.955 and must be 1"):
        replace(LAW, rho_e=0.01)
    with pytest.raises(InputError, match="rho_e is a fraction between 0 and 1"):
        replace(LAW, rho_e=-0.1, rho_s=0.317)
    with pytest.raises(InputError, match="rho_o is a fraction"):
        replace(LAW, rho_o=math.nan)
    for length in (0.0, -1.0, math.inf, math.nan):
        with pytest.raises(InputError, match="l_y is a length above 0"):
            replace(LAW, l_y=length)


RECORDED = {
    "pgv_pga": Dependence(0.07, 0.18, 0.19, 0.56, 1.6, 3.8, 8.9, 1.40),
    "sa": Dependence(0.02, 0.14, 0.20, 0.64, 0.9, 2.5, 9.5, 1.41),
}


@pytest.mark.parametrize(
    ("name", "sites", "low", "high"),
    [
        ("pgv_pga", 1, 0.0, 0.75), ("pgv_pga", 5, 0.0, 0.45), ("pgv_pga", 30, 0.07, 0.38),
        ("sa", 1, 0.0, 0.75), ("sa", 5, 0.05, 0.40), ("sa", 30, 0.11, 0.31),
    ],
)  # fmt: skip
def test_ranges_at_some_sites(name: str, sites: int, low: float, high: float) -> None:
    # these copulas are rounded, which moves the ends by at most a block in 120 and half a percent
    assert share_range(0.2, RECORDED[name], sites) == pytest.approx((low, high), abs=0.0134)


@pytest.mark.parametrize("sites", [1, 4])
@pytest.mark.parametrize("p", [0.03, 0.2, 0.7])
def test_ranges_are_those_of_simulated_earthquakes(p: float, sites: int) -> None:
    law, n = RECORDED["pgv_pga"], 4 * sites
    r = np.full((n, n), law.rho_e)
    site, side = np.repeat(np.arange(sites), 4), np.tile([0, 1, 2, 3], sites)
    local = site[:, None] == site
    r += local * law.rho_s
    sign = np.where(side[:, None] % 2 == side % 2, 1.0, -1.0)
    r += local * (side[:, None] // 2 == side // 2) * (law.rho_v + sign * law.rho_o)
    z = np.random.default_rng(1).multivariate_normal(np.zeros(n), r, 40_000, method="cholesky")
    share = (z <= ndtri(p)).mean(axis=1)
    low, high = share_range(p, law, sites)
    assert np.quantile(share, [0.025, 0.975]) == pytest.approx((low, high), abs=1.01 / n)
    held = np.mean((share >= low) & (share <= high))
    assert held >= 0.94
    # what an earthquake shares alone leaves out what sites and blocks scatter
    reach = math.sqrt(law.rho_e) * 1.96
    ends = ndtr((ndtri(p) + np.array([-reach, reach])) / math.sqrt(1.0 - law.rho_e))
    assert np.mean((share >= ends[0]) & (share <= ends[1])) < 0.8


def test_ranges_at_their_limits() -> None:
    alone = replace(LAW, rho_e=0.0, rho_s=0.0, rho_v=0.5, rho_o=0.5)
    together = replace(LAW, rho_e=1.0, rho_s=0.0, rho_v=0.0, rho_o=0.0)
    p = np.array([[0.0, 0.001, 0.3], [np.nan, 0.97, 1.0]])
    low, high = share_range(p, together, 7)
    np.testing.assert_array_equal(low, [[0.0, 0.0, 0.0], [np.nan, 0.0, 1.0]])
    np.testing.assert_array_equal(high, [[0.0, 0.0, 1.0], [np.nan, 1.0, 1.0]])
    low, high = share_range(p, alone, 7)
    np.testing.assert_allclose(low, binom.ppf(0.025, 28, p) / 28.0)
    np.testing.assert_allclose(high, binom.ppf(0.975, 28, p) / 28.0)
    wide, narrow = (share_range(0.3, LAW, sites) for sites in (1, 10_000))
    assert wide[0] <= narrow[0] < narrow[1] <= wide[1]


def test_ranges_of_many_are_those_of_each() -> None:
    p = np.random.default_rng(0).uniform(size=(40, 50))
    low, high = share_range(p, LAW, 300, 0.9)
    for place in ((0, 0), (17, 3), (39, 49)):
        assert (low[place], high[place]) == share_range(p[place], LAW, 300, 0.9)


def test_normal_quantile_is_that_of_scipy() -> None:
    p = np.concatenate([10.0 ** -np.arange(1.0, 300.0, 7.0), np.linspace(0.001, 0.999, 999)])
    mine = np.array([normal_quantile(item) for item in p.tolist()])
    np.testing.assert_allclose(mine, ndtri(p), rtol=1e-13, atol=1e-15)


def test_single_numbers_load_no_library() -> None:
    code = (
        "import sys; from rbfrag.fragility.dependence import *;"
        "normal_share(normal_quantile(.3));"
        "sys.exit('numpy' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
