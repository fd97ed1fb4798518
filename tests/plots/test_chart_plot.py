"""The design chart: its lines mean what is written on them, and can be read."""

from __future__ import annotations

import numpy as np
import pytest

from rbfrag.errors import InputError
from rbfrag.plots.chart import CONTOURS, plot_chart
from rbfrag.question.question import predict
from tests.plots.critical_values import straight_line_model


def ends_of_labels(axes) -> dict[str, tuple[float, float]]:
    """Return where on the sheet the leader of each label ends, in its units."""
    results = {}
    leaders = {line.get_label()[1:]: line for line in axes.lines}
    for text in axes.texts:
        (across, beside), (up, place) = leaders[text.get_text()].get_data()
        assert abs(beside - text.get_position()[0]) < 0.01
        assert place == text.get_position()[1]
        results[text.get_text()] = axes.transData.inverted().transform(
            axes.transAxes.transform((across, up))
        )
    return results


@pytest.mark.parametrize("suffix", ["png", "svg", "pdf"])
def test_is_written(tmp_path, suffix) -> None:
    path = plot_chart(straight_line_model(), tmp_path / f"c.{suffix}").path
    assert path.stat().st_size > 5000


def test_lines_have_the_probabilities_written_on_them(tmp_path, figures) -> None:
    model = straight_line_model()
    plot_chart(model, tmp_path / "c.png")
    axes = figures[0].axes[0]
    ends = ends_of_labels(axes)
    assert len(ends) == len(CONTOURS)
    for words, (x, y) in ends.items():
        answer = predict(0.3, y * 0.3**0.5 / 9.80665, pgv_m_s=x, model=model)
        assert 100.0 * answer.probability == pytest.approx(float(words.split()[0]), rel=1e-6)


def test_labels_do_not_cover_each_other(tmp_path, figures, overlapping) -> None:
    for term in ("pgv", "pga_tm"):
        plot_chart(straight_line_model(term), tmp_path / "c.png")
        axes = figures[-1].axes[0]
        texts = [*axes.texts, axes.title, axes.xaxis.label, axes.yaxis.label]
        assert overlapping(figures[-1], texts) == []


def test_labels_stand_in_the_order_of_their_lines(tmp_path, figures) -> None:
    plot_chart(straight_line_model(), tmp_path / "c.png")
    axes = figures[0].axes[0]
    ends = ends_of_labels(axes)
    by_line = sorted(ends, key=lambda words: ends[words][1])
    by_place = [t.get_text() for t in sorted(axes.texts, key=lambda t: t.get_position()[1])]
    assert by_place == by_line == [f"{100.0 * p:g} %" for p in reversed(CONTOURS)]


def test_shading_starts_where_the_fit_ends(tmp_path, figures) -> None:
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


def test_bad_path_is_rejected(tmp_path) -> None:
    with pytest.raises(InputError, match=r"\.jpg"):
        plot_chart(straight_line_model(), tmp_path / "c.jpg")
