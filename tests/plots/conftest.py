"""Figures as tests look at them."""

from __future__ import annotations

from collections.abc import Callable
from types import ModuleType
from typing import Any

import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure


@pytest.fixture
def caught(monkeypatch: pytest.MonkeyPatch) -> Callable[[ModuleType], list[Figure]]:
    """Return a function that keeps the figures a module saves from now on."""

    def watch(module: ModuleType) -> list[Figure]:
        figures: list[Figure] = []
        home = getattr(module, "canvas", module)
        save: Callable[..., Any] = home.save_figure

        def keep(figure: Figure, path: object) -> object:
            figures.append(figure)
            return save(figure, path)

        monkeypatch.setattr(home, "save_figure", keep)
        return figures

    return watch


def overlaps(figure: Figure, texts: list[Any]) -> list[tuple[str, str]]:
    """Return the pairs of texts that cover each other, and those that leave the sheet."""
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    renderer = canvas.get_renderer()
    boxes = [(t.get_text(), t.get_window_extent(renderer)) for t in texts if t.get_text()]
    sheet = figure.bbox.padded(1.0)
    found = [
        (name, "the edge")
        for name, box in boxes
        if not (sheet.contains(*box.min) and sheet.contains(*box.max))
    ]
    for i, (name, box) in enumerate(boxes):
        found += [(name, other) for other, its in boxes[i + 1 :] if box.overlaps(its)]
    return found


@pytest.fixture
def overlapping() -> Callable[[Figure, list[Any]], list[tuple[str, str]]]:
    """The function that finds texts which cover each other."""
    return overlaps
