"""The design chart: its lines mean what is written on them, and can be read."""

from __future__ import annotations

import numpy as np
import pytest

from rbfrag.errors import InputError
from rbfrag.fragility.prediction import predict
from rbfrag.plots import chart as module
from rbfrag.plots.chart import CONTOURS, plot_chart
from tests.plots.critical_values import straight_line_model


@pytest.mark.parametrize("suffix", ["png", "svg", "pdf"])
def test_is_written(tmp_path, suffix) -> None:
    path = plot_chart(straight_line_model(), tmp_path / f"c.{suffix}")
    assert path.stat().st_size > 5000


def test_lines_have_the_probabilities_written_on_them(tmp_path, caught) -> None:
    figures = caught(module)
    model = straight_line_model()
    plot_chart(model, tmp_path / "c.png")
    axes = figures[0].axes[0]
    texts = {text.get_text(): text.get_position() for text in axes.texts}
    assert len(texts) >= len(CONTOURS) - 2
    for words, (x, y) in texts.items():
        answer = predict(0.3, y * 0.3**0.5 / 9.80665, pgv_m_s=x, model=model)
        assert 100.0 * answer.probability == pytest.approx(float(words.split()[0]), rel=1e-6)


def test_labels_do_not_cover_each_other(tmp_path, caught, overlapping) -> None:
    figures = caught(module)
    for term in ("pgv", "pga_tm"):
        plot_chart(straight_line_model(term), tmp_path / "c.png")
        axes = figures[-1].axes[0]
        texts = [*axes.texts, axes.title, axes.xaxis.label, axes.yaxis.label]
        assert overlapping(figures[-1], texts) == []


def test_shading_starts_where_the_fit_ends(tmp_path, caught) -> None:
    figures = caught(module)
    plot_chart(straight_line_model(), tmp_path / "c.png")
    axes = figures[0].axes[0]
    edges = sorted({float(v) for patch in axes.patches for v in np.ravel(patch.get_xy())})
    for edge in (0.02, 1.2, 0.01, 1.0):
        near = min(
            abs(v - edge)
            for patch in axes.patches
            for v in (
                patch.get_x(),
                patch.get_x() + patch.get_width(),
                patch.get_y(),
                patch.get_y() + patch.get_height(),
            )
        )
        assert near < 1e-12, (edge, edges)


def test_bad_path_is_refused(tmp_path) -> None:
    with pytest.raises(InputError, match=r"\.jpg"):
        plot_chart(straight_line_model(), tmp_path / "c.jpg")
