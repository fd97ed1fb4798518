"""Searches without certificate: how tight their intervals are, and what they hide."""

from __future__ import annotations

import numpy as np
import pytest

from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.solver.excitation import excitation
from rbfrag.solver.integrator.batch import simulate_many
from rbfrag.solver.integrator.toppling_kernel import TOPPLED
from rbfrag.solver.search.critical import _gaps, critical


@pytest.mark.parametrize("seed", range(4))
def test_an_interval_without_certificate_is_tight_and_hides_nothing(seed: int) -> None:
    rng = np.random.default_rng(seed)
    noise = np.convolve(rng.standard_normal(400), np.hanning(15), "same") * np.hanning(400)
    motion = GroundMotion(2.5 * noise / np.abs(noise).max(), 0.01)
    answer = critical(motion, p2=10.0)
    assert not answer.certified
    assert answer.lower is not None
    assert answer.upper is not None
    assert answer.k_up_over_pga is not None
    assert answer.upper / answer.lower - 1.0 <= 0.02
    assert answer.upper <= answer.k_up_over_pga
    assert any("dense scan" in text for text in answer.warnings)
    kr = np.linspace(1.005 * answer.lower, answer.k_up_over_pga, 5000) * answer.pga_g
    runs = simulate_many(excitation(motion), p2=10.0, kr=kr)
    assert not (runs.outcome == TOPPLED).any()


def test_a_cusp_is_a_gap_and_a_round_peak_is_none() -> None:
    kr = np.linspace(1.0, 2.0, 201)
    peak = 1.5 + 0.3 * (kr[1] - kr[0])
    round_peak = 0.8 - (kr - peak) ** 2
    assert _gaps(kr, round_peak).size == 0
    cusp = 0.8 - 0.1 * np.sqrt(np.abs(kr - peak))
    assert _gaps(kr, cusp).tolist() == [100]
    step = np.where(kr < peak, 0.3, 0.7)
    assert _gaps(kr, step).tolist() == [100]
