"""The figure of the other kinds' models is drawn, and shows its data."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from benchmarks.other_kinds import jibson_2007, saygili_rathje_2008, within_motion
from benchmarks.other_kinds_figure import plot_other_kinds
from rbfrag.errors import InputError
from rbfrag.fragility.fit.fitting import fit_source
from rbfrag.fragility.measures import TERMS
from tests.fragility.kind_draws import METHOD_OF, drawn


def test_the_figure_is_written(tmp_path: Path) -> None:
    fits = [
        fit_source(drawn(kind, "pgv_pga", 400), TERMS["pgv_pga"], METHOD_OF[kind])
        for kind in ("sliding", "slumping")
    ]
    both = [part for fit in fits for part in (fit.report.model, fit.data)]
    path = plot_other_kinds(*both, tmp_path / "kinds.svg")
    text = path.read_text(encoding="utf-8")
    assert text.count("<g id=") > 20
    with pytest.raises(InputError, match="suffix"):
        plot_other_kinds(*both, tmp_path / "kinds.txt")


def one(**values: float) -> dict[str, np.ndarray]:
    return {name: np.array([value]) for name, value in values.items()}


def test_published_medians_are_exceeded_in_half_of_the_cases() -> None:
    # log10 D [cm] = 0.215 + log10(0.5^(2.341 - 1.438)) at k_y = PGA/2
    median_cm = 10.0**0.215 * 0.5 ** (2.341 - 1.438)
    values = one(ky=0.2, pga_g=0.4, pgv_m_s=0.3, displacement_m=0.01 * median_cm)
    assert jibson_2007(values)[0] == pytest.approx(0.5)
    # ln D [cm] of the other at k_y/PGA = 0.5, PGA = 1 g, PGV = 100 cm/s
    polynomial = -1.56 - 2.29 - 5.21 + 5.59375 - 1.90625
    median_cm = np.exp(polynomial) * 100.0**1.55
    values = one(ky=0.5, pga_g=1.0, pgv_m_s=1.0, displacement_m=0.01 * median_cm)
    assert saygili_rathje_2008(values)[0] == pytest.approx(0.5)


def test_scatter_is_parted_between_blocks_and_motions() -> None:
    rng = np.random.default_rng(2)
    group = np.repeat(np.arange(2000), 6)
    residual = rng.normal(0.0, 0.3, 2000)[group] + rng.normal(0.0, 0.1, group.size)
    within, between = within_motion(residual, group)
    assert within == pytest.approx(0.1, rel=0.05)
    assert between == pytest.approx(np.hypot(0.3, 0.1 / np.sqrt(6.0)), rel=0.05)
