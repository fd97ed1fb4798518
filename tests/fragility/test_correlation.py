"""Correlations of intensity measures in closed form, and the nearest correlation matrix."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

from rbfrag.fragility.correlation import correlation, nearest_correlation

PERIODS_S = [float(f"{period_s:.6g}") for period_s in np.geomspace(0.01, 10.0, 120)]


@pytest.mark.parametrize(
    ("measure", "other", "expected"),
    [
        # pygmm 0.8, calc_correls of Baker and Jayaram (2008)
        ("sa(0.01)", "sa(0.1)", 0.8958), ("sa(0.1)", "sa(1)", 0.2791),
        ("sa(0.1)", "sa(0.3)", 0.6406), ("sa(0.3)", "sa(1)", 0.5735),
        ("sa(0.3)", "sa(3)", 0.2535), ("sa(1)", "sa(3)", 0.6087), ("sa(0.01)", "sa(10)", 0.0576),
        # by hand from the equation of Bradley (2011, 2012)
        ("pga_g", "sa(0.06)", 0.9475), ("pga_g", "sa(0.8)", 0.61), ("pga_g", "sa(3)", 0.3275),
        ("pgv_m_s", "sa(0.045)", 0.635), ("pgv_m_s", "sa(0.28)", 0.675),
        ("pgv_m_s", "sa(1.1)", 0.78), ("pgv_m_s", "sa(5)", 0.73), ("pgv_m_s", "pga_g", 0.733),
        ("pga_g", "pga_g", 1.0), ("sa(2)", "sa(2)", 1.0), ("sa(0.05)", "sa(0.05)", 1.0),
    ],
)  # fmt: skip
def test_values_of_the_papers(measure: str, other: str, expected: float) -> None:
    assert correlation(measure, other) == pytest.approx(expected, abs=6e-5)
    assert correlation(other, measure) == correlation(measure, other)


def test_correlations_are_continuous_and_between_0_and_1() -> None:
    names = ["pgv_m_s", "pga_g", *(f"sa({period_s:g})" for period_s in PERIODS_S)]
    table = np.array([[correlation(f"sa({t:.6g})", name) for name in names] for t in PERIODS_S])
    assert table.min() >= 0.0
    assert table.max() == 1.0
    assert np.abs(np.diff(table, axis=0)).max() < 0.06  # periods rise by 6 %
    for name in names:
        for corner_s in (0.1, 0.109, 0.2, 0.75, 2.5):
            before, after = (
                correlation(f"sa({corner_s * factor!r})", name) for factor in (1 - 1e-9, 1 + 1e-9)
            )
            assert before == pytest.approx(after, abs=0.0025)


def test_the_nearest_correlation_matrix() -> None:
    good = np.array([[1.0, 0.7, 0.9], [0.7, 1.0, 0.6], [0.9, 0.6, 1.0]])
    bad = np.array([[1.0, 0.9, 0.1], [0.9, 1.0, 0.8], [0.1, 0.8, 1.0]])
    first, second = nearest_correlation([good, bad])
    assert (first == good).all()
    assert np.linalg.eigvalsh(second).min() == pytest.approx(0.01, rel=0.07)
    assert np.diag(second) == pytest.approx(np.ones(3))
    assert second == pytest.approx(second.T)
    assert np.abs(second - bad).max() < 0.15
    assert nearest_correlation(bad) == pytest.approx(second)


def test_no_library_is_loaded() -> None:
    code = "import sys, rbfrag.fragility.correlation; sys.exit('numpy' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
