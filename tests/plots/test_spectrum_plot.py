"""The figure of toppling spectra: true curves, a true size axis, nothing on top of anything."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

from rbfrag.errors import InputError
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.toppling_spectrum import toppling_spectrum
from rbfrag.plots.spectrum import block_size_m, plot_spectrum
from tests.synthetic import shaking

MOTIONS = [
    GroundMotion(factor * shaking(seed), 0.02, event=f"EVENT {seed}", station="SOMEWHERE FAR")
    for seed, factor in ((0, 1.0), (1, 0.4), (2, 2.0))
]


@pytest.mark.parametrize("suffix", ["png", "svg", "pdf"])
def test_is_written(tmp_path: Path, suffix: str) -> None:
    path = plot_spectrum(MOTIONS, tmp_path / f"s.{suffix}").path
    assert path.stat().st_size > 2000


def test_curves_are_the_spectra_and_pgv(tmp_path: Path, figures: list[Figure]) -> None:
    plot_spectrum(MOTIONS[:1], tmp_path / "s.png", polarities=("reverse",), p2=(1.0, 30.0))
    axes = figures[0].axes[0]
    curve, pgv = axes.lines[:2]
    p2, x = np.asarray(curve.get_xdata()), np.asarray(curve.get_ydata())
    assert (p2[0], p2[-1]) == pytest.approx((1.0, 30.0))
    np.testing.assert_array_equal(x, toppling_spectrum(MOTIONS[0], p2, "reverse"))
    assert set(np.asarray(pgv.get_ydata())) == {MOTIONS[0].pgv_m_s}


def test_size_axis_is_that_of_a_rectangle() -> None:
    # p² = 3 g/(4 r3): 1 1/s² is 7.355 m
    assert float(block_size_m(np.array(1.0))) == pytest.approx(7.35499, abs=1e-5)
    np.testing.assert_allclose(block_size_m(block_size_m(np.array([0.1, 30.0]))), [0.1, 30.0])


def test_nothing_covers_anything(
    tmp_path: Path, figures: list[Figure], overlapping: Callable[[Figure, list[Any]], list[Any]]
) -> None:
    plot_spectrum(MOTIONS, tmp_path / "s.png")
    figure = figures[0]
    axes = figure.axes[0]
    figure.canvas.draw()
    texts = [axes.xaxis.label, axes.yaxis.label, *axes.get_xticklabels(), *axes.get_yticklabels()]
    texts += figure.legends[0].get_texts()
    inside = [text for text in texts if text.get_text()]
    low, high = axes.get_xlim()
    bottom, top = axes.get_ylim()
    seen = [
        text
        for text in inside
        if not (
            (text in axes.get_xticklabels() and not low <= text.get_position()[0] <= high)
            or (text in axes.get_yticklabels() and not bottom <= text.get_position()[1] <= top)
        )
    ]
    assert overlapping(figure, seen) == []


def test_too_many_and_nothing_to_draw(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="9 motions"):
        plot_spectrum([*MOTIONS] * 3, tmp_path / "s.png")
    with pytest.raises(InputError, match="nothing to draw"):
        plot_spectrum([GroundMotion([0.0, 0.0], 0.01)], tmp_path / "s.png")
    assert not list(tmp_path.iterdir())
