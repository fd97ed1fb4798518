"""Charts of kinds other than toppling: labels stand on their lines, captions in the figure."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from matplotlib.text import Text

import rbfrag
from rbfrag.plots import plot


@pytest.mark.parametrize(
    ("model", "labels"),
    [("rocking-sa", 9), ("rocking-pga", 7), ("sliding-pgv_pga_m", 9),
     ("sliding-pgv_pga_ia", 9), ("slumping-2deg-pgv_pga_m", 9), ("confined_toppling-pgv_pga", 9)],
)  # fmt: skip
def test_labels_and_caption(tmp_path: Path, figures, model: str, labels: int) -> None:  # type: ignore[no-untyped-def]
    plot.chart(tmp_path / "chart.png", model=model, db=None)
    (figure,) = figures
    (axes,) = figure.axes
    texts = [text for text in axes.texts if text.get_text().endswith("%")]
    assert len(texts) == labels
    if model == "rocking-sa":
        p2 = float(np.sqrt(0.3 * 30.0))
        for text in texts:
            sa, kr = text.get_position()
            result = rbfrag.predict(p2, kr, kind="rocking", sa_g={1.0: sa}, model=model).probability
            assert 100.0 * result == pytest.approx(float(text.get_text()[:-2]), abs=1.0)
    at = axes.transData.transform([text.get_position() for text in texts])
    points = 72.0 / figure.dpi * np.hypot(*np.diff(at, axis=0).T)
    assert points.min() > 8.0  # the height of the letters
    figure.draw_without_rendering()
    title: Text = axes.title
    box, full = title.get_window_extent(), figure.bbox
    assert full.x0 <= box.x0
    assert box.x1 <= full.x1


def test_pga_may_be_held(tmp_path: Path, figures) -> None:  # type: ignore[no-untyped-def]
    plot.chart(tmp_path / "chart.png", model="rocking-pga", pga_g=0.4, p2=3.0)
    (axes,) = figures[0].axes
    assert axes.get_xlabel() == "peak ground velocity [m/s]"
    assert "at p² = 3 1/s², peak ground acceleration = 0.4 g" in axes.get_title()
