"""The curves are the shares that were counted, and the bars add up."""

from __future__ import annotations

import numpy as np
import pytest

from rbfrag.errors import InputError
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.plots.rockmass import plot_failures
from rbfrag.rockmasses.counts import failures
from rbfrag.rockmasses.joint_sets import RockMass
from rbfrag.rockmasses.shaking import plan_shaking, run_blocks
from tests.synthetic import shaking

UNIFORM = {"distribution": "uniform"}


def shaken(scales):
    mass = RockMass.of(
        {
            "base.dip_deg": {**UNIFORM, "low": -20.0, "high": 35.0},
            "base.spacing_m": {"distribution": "lognormal", "median": 1.0, "sd_ln": 0.7},
            "back.dip_deg": {**UNIFORM, "low": 25.0, "high": 175.0},
            "back.spacing_m": {"distribution": "lognormal", "median": 1.0, "sd_ln": 0.7},
            "friction.phi_deg": {**UNIFORM, "low": 15.0, "high": 50.0},
        }
    )
    a = shaking(3)
    motion = GroundMotion(0.6 * a / np.abs(a).max(), 0.01)
    plan = plan_shaking(mass.realise(300, 2), motion, scales=scales)
    return plan.gathered(map(run_blocks, plan.work()))


def test_curves_and_bars_of_four_modes(tmp_path, figures, overlapping):
    result = shaken([0.5, 0.9, 1.6])
    plot_failures(result, tmp_path / "a.png")
    (figure,) = figures
    curves, bars, above = figure.axes
    counted = failures(result)
    lines = {line.get_label(): line for line in curves.lines}
    assert set(lines) == {"all blocks", "slide", "topple", "slump", "confined topple"}
    for mode, name in (("slide", "slide"), ("confined_topple", "confined topple")):
        assert lines[name].get_ydata().tolist() == [
            100.0 * item.modes[mode].of_all.value for item in counted
        ]
    assert lines["all blocks"].get_xdata().tolist() == [0.5, 0.9, 1.6]
    assert above.get_xlim()[1] / curves.get_xlim()[1] == pytest.approx(0.6)
    # the bars are those of the scale nearest to the record, and each is whole
    assert "times 0.9" in bars.get_title()
    tops = {}
    for bar in bars.patches:
        tops[round(bar.get_x(), 6)] = max(
            tops.get(round(bar.get_x(), 6), 0.0), bar.get_y() + bar.get_height()
        )
    assert list(tops.values()) == pytest.approx([100.0] * 5)
    texts = [*bars.texts, *bars.get_xticklabels(), *curves.get_legend().get_texts()]
    assert overlapping(figure, texts) == []


def test_one_scale_has_bars_alone(tmp_path, figures):
    plot_failures(shaken([1.0]), tmp_path / "a.svg")
    assert len(figures[0].axes) == 1


def test_a_path_that_cannot_be_written_is_rejected(tmp_path):
    with pytest.raises(InputError, match="plot file"):
        plot_failures(shaken([1.0]), tmp_path / "none" / "a.png")
