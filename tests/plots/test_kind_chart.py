"""Charts of kinds other than toppling: labels stand on their lines, captions in the figure."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from matplotlib.text import Text

import rbfrag
from rbfrag.plots import chart, plot


@pytest.mark.parametrize(
    ("model", "labels"),
    [("rocking-sa10", 9), ("rocking-pga_sa10", 8), ("sliding-pgv_pga_m", 9),
     ("sliding-pgv_pga_ia", 9), ("slumping-2deg-pgv_pga_m", 9), ("confined_toppling-pgv_pga", 9)],
)  # fmt: skip
def test_labels_and_caption(tmp_path: Path, figures, model: str, labels: int) -> None:  # type: ignore[no-untyped-def]
    plot.chart(tmp_path / "chart.png", model=model, db=None)
    (figure,) = figures
    (axes,) = figure.axes
    texts = [text for text in axes.texts if text.get_text().endswith("%")]
    assert len(texts) == labels
    if model == "rocking-sa10":
        p2 = float(np.sqrt(0.1 * 30.0))
        for text in texts:
            sa, kr = text.get_position()
            result = rbfrag.predict(p2, kr, kind="rocking", sa10_g=sa, model=model).probability
            assert 100.0 * result == pytest.approx(float(text.get_text()[:-2]), abs=1.0)
    at = axes.transData.transform([text.get_position() for text in texts])
    points = 72.0 / figure.dpi * np.hypot(*np.diff(at, axis=0).T)
    assert points.min() > 8.0  # the height of the letters
    figure.draw_without_rendering()
    title: Text = axes.title
    box, full = title.get_window_extent(), figure.bbox
    assert full.x0 <= box.x0
    assert box.x1 <= full.x1


def test_middle_ratios_go_together() -> None:
    """PGA of a chart over SA(1) is that of the PGV of the chart's own middle ratio."""
    model = plot.find_model("rocking-pga_sa10", ["pga_g", "sa10_g"])
    domain = model.row.domain
    pga, words = chart._in_proportion("pga_g", "sa10_g", np.array([0.3]), model)
    seconds, velocity = (
        np.sqrt(np.prod(domain[name])) for name in ("pgv_over_pga_s", "v10_over_pgv")
    )
    pseudo_velocity = 0.3 * 9.80665 / (2.0 * np.pi)
    assert pga[0] == pytest.approx(pseudo_velocity / velocity / (seconds * 9.80665))
    assert f"{seconds:.3g} s" in words
