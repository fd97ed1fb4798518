"""Labels leave the lines and each other free, and have a halo."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.figure import Figure

from rbfrag.plots.labels import settle_labels, write_near


@pytest.fixture
def axes():
    figure = Figure(figsize=(5.0, 4.0), layout="constrained")
    axes = figure.add_subplot()
    axes.set(xlim=(0.0, 1.0), ylim=(0.0, 1.0))
    return axes


def box_of(label):
    return label.get_window_extent().padded(1.0)


def test_a_label_leaves_the_line_that_it_would_cover(axes) -> None:
    x = np.linspace(0.0, 1.0, 50)
    (line,) = axes.plot(x, x)
    write_near(axes, "a label", (0.5, 0.5), (4, 4))
    label = axes.texts[0]
    axes.figure.draw_without_rendering()
    drawn = line.get_transform().transform_path(line.get_path())
    assert drawn.intersects_bbox(box_of(label), filled=False)
    settle_labels(axes.figure)
    assert not drawn.intersects_bbox(box_of(label), filled=False)
    assert label.get_path_effects()


def test_labels_of_one_place_do_not_cover_each_other(axes) -> None:
    for word in ("first", "second", "third", "fourth"):
        write_near(axes, word, (0.5, 0.5), (4, 4))
    settle_labels(axes.figure)
    boxes = [label.get_window_extent() for label in axes.texts]
    for i, box in enumerate(boxes):
        assert not any(box.overlaps(other) for other in boxes[:i])


def test_a_label_at_the_edge_stays_inside_and_a_fixed_one_where_it_is(axes) -> None:
    write_near(axes, "a long label at the edge", (0.97, 0.97), (4, 4))
    write_near(axes, "fixed", (0.97, 0.5), (4, 4), movable=False)
    settle_labels(axes.figure)
    moved, fixed = axes.texts
    frame = axes.get_window_extent()
    assert frame.contains(*moved.get_window_extent().min)
    assert frame.contains(*moved.get_window_extent().max)
    assert fixed.xyann == (4, 4)
