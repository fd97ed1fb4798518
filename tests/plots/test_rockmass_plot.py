"""The curves are counts of blocks, and the crossing is marked where they meet."""

from __future__ import annotations

import numpy as np
import pytest

from rbfrag.errors import InputError
from rbfrag.plots.rockmass import plot_rockmass
from rbfrag.rockmasses.counts import crossings, mode_counts
from rbfrag.rockmasses.joint_sets import RockMass


def normal(mean, sd):
    return {"distribution": "normal", "mean": mean, "sd": sd}


@pytest.fixture(scope="module")
def realisations():
    return RockMass.of(
        {
            "base.dip_deg": normal(20.0, 5.0),
            "base.spacing_m": normal(1.0, 0.1),
            "back.dip_deg": normal(45.0, 5.0),
            "back.spacing_m": normal(0.6, 0.1),
            "friction.phi_deg": 40.0,
        }
    ).realise(5_000, 1)


def test_curves_shares_and_crossing(realisations, tmp_path, figures, overlapping):
    plot_rockmass(realisations, tmp_path / "a.png")
    (figure,) = figures
    axes, bars = figure.axes
    curves = {line.get_label(): line for line in axes.lines if len(line.get_xdata()) > 2}
    assert set(curves) == {"slide", "slump"}
    result = realisations.stability
    for mode, line in curves.items():
        k = result.yield_acceleration[realisations.is_block & (result.mode == mode)]
        for pga, count in zip(line.get_xdata()[::60], line.get_ydata()[::60], strict=True):
            assert count == np.sum(np.maximum(k, 0.0) <= pga)
    (crossing,) = crossings(realisations)
    (mark,) = [line for line in axes.lines if line.get_marker() == "o"]
    assert (mark.get_xdata()[0], mark.get_ydata()[0]) == (crossing.pga_g, crossing.count)
    lines = list(curves.values())
    meet = [np.interp(crossing.pga_g, c.get_xdata(), c.get_ydata()) for c in lines]
    assert meet == pytest.approx([crossing.count] * 2, rel=0.02)
    assert f"{crossing.pga_g:.3f}" in axes.texts[0].get_text()
    heights = [bar.get_height() for bar in bars.patches]
    counts = mode_counts(realisations)
    assert heights == [100.0 * counts[m].share for m in ("slide", "slump")]
    assert "[g]" in axes.get_xlabel()
    assert "[%]" in bars.get_ylabel()
    assert overlapping(figure, [*axes.texts, *bars.texts, *axes.get_legend().get_texts()]) == []


def test_four_modes_fit_side_by_side(tmp_path, figures, overlapping):
    uniform = {"distribution": "uniform"}
    mass = RockMass.of(
        {
            "base.dip_deg": {**uniform, "low": -20.0, "high": 35.0},
            "base.spacing_m": {"distribution": "lognormal", "median": 1.0, "sd_ln": 0.7},
            "back.dip_deg": {**uniform, "low": 25.0, "high": 175.0},
            "back.spacing_m": {"distribution": "lognormal", "median": 1.0, "sd_ln": 0.7},
            "friction.phi_deg": {**uniform, "low": 15.0, "high": 50.0},
        }
    )
    plot_rockmass(mass.realise(4_000, 2), tmp_path / "a.png")
    bars = figures[0].axes[1]
    assert len(bars.patches) == 4
    assert overlapping(figures[0], [*bars.texts, *bars.get_xticklabels()]) == []


def test_a_path_that_cannot_be_written_is_rejected(realisations, tmp_path):
    with pytest.raises(InputError, match="plot file"):
        plot_rockmass(realisations, tmp_path / "none" / "a.png")
