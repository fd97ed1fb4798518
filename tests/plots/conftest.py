"""Figures as tests look at them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from rbfrag.plots import canvas


@pytest.fixture
def figures(monkeypatch: pytest.MonkeyPatch) -> list[Figure]:
    """The figures that are saved from now on."""
    saved: list[Figure] = []
    save: Callable[..., Any] = canvas.save_figure

    def keep(figure: Figure, path: object) -> object:
        saved.append(figure)
        return save(figure, path)

    monkeypatch.setattr(canvas, "save_figure", keep)
    return saved


def overlaps(figure: Figure, texts: list[Any]) -> list[tuple[str, str]]:
    """Return the pairs of texts that cover each other, and those that leave the sheet."""
    agg = FigureCanvasAgg(figure)
    agg.draw()
    renderer = agg.get_renderer()
    boxes = [(t.get_text(), t.get_window_extent(renderer)) for t in texts if t.get_text()]
    sheet = figure.bbox.padded(1.0)
    results = [
        (name, "the edge")
        for name, box in boxes
        if not (sheet.contains(*box.min) and sheet.contains(*box.max))
    ]
    for i, (name, box) in enumerate(boxes):
        results += [(name, other) for other, its in boxes[i + 1 :] if box.overlaps(its)]
    return results


@pytest.fixture
def overlapping() -> Callable[[Figure, list[Any]], list[tuple[str, str]]]:
    """The function that finds texts which cover each other."""
    return overlaps
