"""Quality signs: an ordinary record has none, each doubt has its own."""

from __future__ import annotations

import numpy as np
import pytest

from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.quality import quality_flags
from tests.physics.pulses import rectangle


def ordinary(npts: int = 2001, dt_s: float = 0.01, pga_g: float = 0.3) -> np.ndarray:
    """A wave packet that ends at rest: the third derivative of a smooth bell."""
    t = (np.arange(npts) - npts // 2) * dt_s
    bell = np.exp(-((t / 0.5) ** 2)) * (4.0 * t**3 - 1.5 * t)
    return pga_g * bell / np.max(np.abs(bell))


def codes(samples: np.ndarray, dt_s: float = 0.01) -> set[str]:
    return {flag.code for flag in quality_flags(GroundMotion(samples, dt_s))}


def test_ordinary_record_has_none() -> None:
    assert codes(ordinary()) == set()


def test_all_zero_says_only_that() -> None:
    assert codes(np.zeros(50)) == {"all_zero"}


@pytest.mark.parametrize(("pga_g", "flagged"), [(4.9, False), (5.1, True)])
def test_pga(pga_g: float, flagged: bool) -> None:
    assert ("pga_suspicious" in codes(ordinary(pga_g=pga_g))) is flagged


def test_gal_read_as_g_is_noticed() -> None:
    assert {"pga_suspicious", "pgv_suspicious"} <= codes(980.665 * ordinary())


@pytest.mark.parametrize(
    ("dt_s", "expected"),
    [
        (0.02, set()),
        (0.025, set()),
        (0.03, {"coarse_for_tm"}),
        (0.11, {"coarse_for_tm", "dt_suspicious"}),
        (0.5e-4, {"dt_suspicious"}),
    ],
)
def test_dt(dt_s: float, expected: set[str]) -> None:
    assert codes(ordinary(), dt_s) & {"coarse_for_tm", "dt_suspicious"} == expected


def test_short_record() -> None:
    assert "short_record" in codes(ordinary(npts=99))
    assert "short_record" not in codes(ordinary(npts=100))


def test_baseline_offset_leaves_velocity_and_displacement() -> None:
    offset = ordinary(npts=6001) + 0.0005
    assert {"final_velocity", "final_displacement"} <= codes(offset)


def test_final_velocity_share() -> None:
    samples = ordinary()
    pgv = GroundMotion(samples, 0.01).pgv_m_s
    for share, flagged in ((0.04, False), (0.06, True)):
        kicked = samples.copy()
        # one sample of a triangle of base 2 dt, early, where the record is still at rest
        kicked[100] += share * pgv / 9.80665 / 0.01
        assert ("final_velocity" in codes(kicked)) is flagged


@pytest.mark.parametrize(
    ("at", "code"), [(0, "first_sample_not_zero"), (-1, "last_sample_not_zero")]
)
def test_edges(at: int, code: str) -> None:
    samples = ordinary()
    samples[at] = -0.029
    assert code not in codes(samples)
    samples[at] = -0.031
    assert code in codes(samples)


def test_analytic_pulse_is_not_suspected() -> None:
    assert quality_flags(rectangle(0.5, 0.3)) == ()
    assert [flag.code for flag in quality_flags(rectangle(0.01, 6.0))] == ["pga_suspicious"]


def test_sentences_state_value_and_limit() -> None:
    (flag,) = quality_flags(rectangle(0.01, 6.0))
    assert "6 g" in flag.sentence
    assert "5 g" in flag.sentence
