"""Figures of calibration and of vertical motion: what is drawn is what was counted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rbfrag.errors import InputError
from rbfrag.fragility.fit.result import CalibrationBins
from rbfrag.plots.critical_strength import plot_vertical, vertical_pairs
from rbfrag.plots.fit import plot_calibration
from tests.plots.critical_values import N, critical_values

P = np.array([0.02, 0.3, 0.7, 0.98])
BINS = CalibrationBins(
    predicted=P,
    observed=P**1.1,
    low=0.8 * P,
    high=np.minimum(1.2 * P, 1.0),
    blocks=np.array([900, 200, 150, 800]),
    events=47,
)


def test_calibration_shows_shares_and_counts(tmp_path, figures, overlapping) -> None:
    scores = {"a": {"log_loss_held_out": 0.155, "brier_held_out": 0.047}}
    plot_calibration({"a": BINS, "b": BINS}, tmp_path / "c.png", scores=scores, data="made up")
    axes, below = figures[0].axes
    assert "2050 blocks under motions of 47 earthquakes" in axes.get_title()
    words = [text.get_text() for text in figures[0].legends[0].get_texts()]
    assert words == ["a (log loss 0.155, Brier 0.047)", "b"]
    curves = [line for line in axes.lines if len(line.get_ydata()) == P.size]
    np.testing.assert_array_equal(curves[0].get_ydata(), BINS.observed)
    np.testing.assert_array_equal(below.lines[0].get_ydata(), BINS.blocks)
    texts = [axes.title, axes.yaxis.label, below.yaxis.label, below.xaxis.label]
    assert overlapping(figures[0], [*texts, *figures[0].legends[0].get_texts()]) == []


def test_calibration_of_too_many_is_rejected(tmp_path) -> None:
    with pytest.raises(InputError, match="5 models"):
        plot_calibration(dict.fromkeys("abcde", BINS), tmp_path / "c.png")


def test_vertical_shows_every_pair(tmp_path, figures, overlapping) -> None:
    without = critical_values()
    random = np.random.default_rng(0).normal(size=N)
    shaken = replace(without, kr_over_pga=without.kr_over_pga * np.exp(0.05 * random))
    pairs = vertical_pairs(without, shaken)
    plot_vertical(pairs, tmp_path / "v.png")
    axes, beside = figures[0].axes
    assert len(axes.collections[0].get_offsets()) == 360
    assert sum(patch.get_height() for patch in beside.patches) == 360
    assert f"standard deviation {pairs.ln_ratio.std():.3f}" in beside.get_title()
    texts = [beside.title, axes.xaxis.label, beside.xaxis.label]
    assert overlapping(figures[0], [*texts, axes.yaxis.label, beside.yaxis.label]) == []


def test_vertical_without_pairs_is_rejected(tmp_path) -> None:
    without = critical_values()
    none = replace(without, status=np.full(N, "below_limit", dtype=object))
    with pytest.raises(InputError, match="run  rbfrag simulate  for both"):
        plot_vertical(vertical_pairs(without, none), tmp_path / "v.png")
    assert not list(tmp_path.iterdir())
