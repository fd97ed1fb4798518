"""The figure of standing blocks names a few branches, and draws many alike."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rbfrag.hazards.curve import hazard_curve
from rbfrag.hazards.survival import survival
from rbfrag.plots.hazard import plot_survival


def branches(n, name="rlz-{:03d}"):
    x = np.geomspace(0.01, 10.0, 20)
    return [
        hazard_curve("pgv_m_s", x, (1.0 + i) * 1e-5 * x**-2.0, source=name.format(i))
        for i in range(n)
    ]


def answer(curves):
    return survival(
        curves, fragility=lambda x: np.clip(x, 0.0, 1.0), age_years=5000.0,
        weights=[1.0 / len(curves)] * len(curves),
    )  # fmt: skip


@pytest.mark.parametrize("n", [1, 3, 10])
def test_a_few_branches_are_named(n, tmp_path, figures, overlapping):
    curves = branches(n)
    plot_survival(curves, answer(curves), tmp_path / "a.png")
    (figure,) = figures
    hazards, standing, weights = figure.axes
    named = [line.get_label() for line in hazards.lines]
    assert named == [curve.source for curve in curves]
    assert [tick.get_text() for tick in weights.get_yticklabels()] == named
    (legend,) = figure.legends
    assert set(named) <= {text.get_text() for text in legend.get_texts()}
    assert {"m/s" in hazards.get_xlabel(), "%" in standing.get_ylabel()} == {True}
    texts = [*legend.get_texts(), *weights.get_yticklabels()]
    assert overlapping(figure, texts) == []


def test_the_title_says_p_as_the_shell_does(tmp_path, figures):
    curves = branches(1)
    result = answer(curves)
    plot_survival(curves, result, tmp_path / "a.png")
    assert figures[0].get_suptitle() == result.headline()


def test_large_factors_have_no_exponent():
    (*_, factor) = replace(answer(branches(1)), factor_5_percent=893.4).sentences()
    assert "multiplied by 890" in factor


def test_many_branches_are_drawn_alike_and_those_of_most_weight_listed(
    tmp_path, figures, overlapping
):
    curves = branches(60, "a long name of a branch of a logic tree, number {:02d}")
    result = answer(curves)
    plot_survival(curves, result, tmp_path / "a.png")
    (figure,) = figures
    hazards, _, weights = figure.axes
    assert len(hazards.lines) == 60
    assert len({line.get_color() for line in hazards.lines}) == 1
    (legend,) = figure.legends
    assert "each of 60 curves" in [text.get_text() for text in legend.get_texts()]
    assert weights.get_title() == "10 of 60 branches"
    after = [bar.get_width() for bar in weights.patches[10:]]
    heaviest = sorted((branch.weight_given_standing for branch in result.branches), reverse=True)
    assert after == pytest.approx([100.0 * weight for weight in heaviest[:10]])
    assert overlapping(figure, [*legend.get_texts(), *weights.get_yticklabels()]) == []
