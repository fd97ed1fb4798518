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

from rbfrag.errors import InputError
from rbfrag.fragility.dependence import Dependence, EventSpread, normal_quantile, normal_share
from rbfrag.fragility.joint import event_ranges
from tests.fragility.portfolio_draws import LAW, anywhere


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
        r = LAW.correlation(ln_p, ln_y, *label)
        assert r[0, 1] == r[1, 0] == pytest.approx(expected, abs=1e-15)
        assert r[0, 0] == r[1, 1] == 1.0


def test_labels_may_be_text() -> None:
    r = LAW.correlation([0, 0], [0, 0], ["a", "a"], ["s", "s"], ["NS", "EW"], [1, -1])
    assert r[0, 1] == pytest.approx(LAW.rho_e + LAW.rho_s)


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
    r = anywhere(25, seed).correlation(law)
    assert np.linalg.eigvalsh(r).min() > -1e-9


def test_what_is_no_dependence_is_refused() -> None:
    with pytest.raises(InputError, match=r"is 0\.955 and must be 1"):
        replace(LAW, rho_e=0.01)
    with pytest.raises(InputError, match="rho_e is a share between 0 and 1"):
        replace(LAW, rho_e=-0.1, rho_s=0.317)
    with pytest.raises(InputError, match="rho_o is a share"):
        replace(LAW, rho_o=math.nan)
    for length in (0.0, -1.0, math.inf, math.nan):
        with pytest.raises(InputError, match="l_y is a length above 0"):
            replace(LAW, l_y=length)
    with pytest.raises(InputError, match="draw unknown azimuths"):
        LAW.correlation([0, 0], [0, 0], [0, 0], [0, 0], [0, 0], [1, 0])


@pytest.mark.parametrize(
    ("rho_e", "low", "high"),
    [(0.136, 0.22, 0.78), (0.055, 0.32, 0.68), (0.035, 0.35, 0.65), (0.082, 0.28, 0.72)],
)
def test_range_of_one_earthquake_at_one_half(rho_e: float, low: float, high: float) -> None:
    found = event_ranges(0.5, rho_e)
    assert found == pytest.approx((low, high), abs=0.005)
    assert sum(found) == pytest.approx(1.0, abs=1e-15)


def test_range_of_one_earthquake_is_that_of_simulated_earthquakes() -> None:
    p, rho = 0.1, 0.2
    shared = np.random.default_rng(1).standard_normal(400_000)
    share = ndtr((ndtri(p) - math.sqrt(rho) * shared) / math.sqrt(1.0 - rho))
    assert share.mean() == pytest.approx(p, abs=1e-3)
    assert event_ranges(p, rho, 0.9) == pytest.approx(np.quantile(share, [0.05, 0.95]), abs=2e-3)


def test_range_of_one_earthquake_at_its_limits() -> None:
    assert event_ranges(0.0, 0.2) == (0.0, 0.0)
    assert event_ranges(1.0, 0.2) == (1.0, 1.0)
    assert event_ranges(0.3, 0.0) == pytest.approx((0.3, 0.3), rel=1e-14)
    assert event_ranges(0.3, 1.0) == (0.0, 1.0)
    assert event_ranges(0.001, 1.0) == (0.0, 0.0)
    with pytest.raises(InputError, match="rho_e"):
        event_ranges(0.3, 1.1)


@pytest.mark.parametrize("rho_e", [0.0, 0.136, 1.0])
def test_ranges_of_many_are_those_of_each(rho_e: float) -> None:
    p = np.array([[0.0, 1e-9, 0.2], [0.5, 0.97, 1.0]])
    low, high = event_ranges(p, rho_e, 0.9)
    spread = EventSpread.of(rho_e)
    each = [
        spread.ends(normal_quantile(one), -normal_quantile(0.05), normal_share)
        for one in p.ravel().tolist()
    ]
    np.testing.assert_allclose(low.ravel(), [one[0] for one in each], rtol=1e-12)
    np.testing.assert_allclose(high.ravel(), [one[1] for one in each], rtol=1e-12)
    assert low.shape == high.shape == p.shape


def test_normal_quantile_is_that_of_scipy() -> None:
    p = np.concatenate([10.0 ** -np.arange(1.0, 300.0, 7.0), np.linspace(0.001, 0.999, 999)])
    mine = np.array([normal_quantile(one) for one in p.tolist()])
    np.testing.assert_allclose(mine, ndtri(p), rtol=1e-13, atol=1e-15)


def test_single_numbers_load_no_library() -> None:
    code = (
        "import sys; from rbfrag.fragility.dependence import *;"
        "EventSpread.of(.1).ends(normal_quantile(.3), 1.96, normal_share);"
        "sys.exit('numpy' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
