"""Figures of losses, rates and maps: numbers beside every axis, names as they are."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from rbfrag.errors import InputError
from rbfrag.hazards.curve import hazard_curve
from rbfrag.hazards.hazard_rates import hazard
from rbfrag.hazards.loss_answer import Exceedance
from rbfrag.plots.hazard import plot_contribution, plot_losses
from rbfrag.plots.shakemap import plot_shakemap

LONG = "a name of costs of $5 and $6 that goes on " * 4


def reached(values, years=1000.0):
    rates = 0.1 / np.arange(1, len(values) + 1)
    curve = tuple(
        Exceedance(
            float(x),
            rate,
            (0.5 * rate, 2.0 * rate),
            (0.9 * rate, 1.1 * rate),
            None,
            rate,
            rate,
            rate < 1.0 / years,
        )
        for x, rate in zip(values, rates.tolist(), strict=True)
    )
    return SimpleNamespace(
        has_losses=True, exceedance={"copula": curve}, loss_exceedance={"copula": curve},
        level=0.95, events=SimpleNamespace(is_scenario=False, effective_years=years),
    )  # fmt: skip


@pytest.mark.parametrize("values", [(1,), (1, 2, 3), (35, 60, 80), (1, 40, 4e4), (1e3, 1e8, 3e9)])
def test_every_axis_of_losses_has_numbers_and_a_unit(values, tmp_path, figures):
    plot_losses(reached(values), tmp_path / "a.png")
    (figure,) = figures
    for axes in figure.axes:
        figure.canvas.draw_idle()
        low, high = axes.get_xlim()
        written = [
            tick.label1.get_text()
            for tick in axes.xaxis.get_major_ticks()
            if low <= tick.get_loc() <= high and tick.label1.get_text()
        ]
        assert written
        assert not [text for text in written if "e+" in text]
        assert "[yr⁻¹]" in axes.get_ylabel()
    words = [text.get_text() for text in figure.legends[0].get_texts()]
    assert "less than once in 1,000 years" in words


def test_losses_without_a_curve_are_rejected(tmp_path):
    nothing = reached(())
    with pytest.raises(InputError, match="no curve to draw"):
        plot_losses(nothing, tmp_path / "a.png")
    assert list(tmp_path.iterdir()) == []


def test_shares_of_a_rate_are_those_of_the_shell(tmp_path, figures):
    x = np.geomspace(0.01, 3.0, 60)
    curve = hazard_curve("pgv_m_s", x, 1e-3 * np.exp(-x / 0.02))
    answer = hazard(curve, 3.0, 0.01, component="single")
    plot_contribution(curve, answer, tmp_path / "a.png")
    heights = [bar.get_height() for bar in figures[0].axes[1].patches]
    full = 100.0 * answer.contribution[0].sum() / answer.annual_rate[0]
    assert sum(heights) == pytest.approx(full)
    assert 50.0 < full <= 100.0
    assert figures[0].axes[1].get_ylabel().startswith("fraction of the rate [%]")


def test_names_of_sites_and_events_are_letters_and_stay_on_the_sheet(
    tmp_path, figures, overlapping
):
    x = np.geomspace(0.01, 10.0, 20)
    curve = hazard_curve("pgv_m_s", x, 1e-4 * x**-2.0, site=LONG)
    answer = hazard(curve, 3.0, 0.1, component="single")
    plot_contribution(curve, answer, tmp_path / "a.png")
    degrees = np.linspace(10.0, 10.1, 5)
    plot_shakemap(degrees, degrees, np.geomspace(1e-4, 1, 5), tmp_path / "b.png", title=LONG)
    rate, sheet = figures
    assert "\\$5" in rate.get_suptitle()
    assert answer.headline() in rate.get_suptitle()
    assert overlapping(rate, [rate._suptitle, *(axes.title for axes in rate.axes)]) == []
    title = sheet.axes[0].title
    assert "\\$5" in title.get_text()
    assert overlapping(sheet, [title]) == []
