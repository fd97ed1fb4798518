"""Labels leave the lines and each other free, and have a halo."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.figure import Figure

from rbfrag.plots.canvas import as_written, settle_labels, write_near


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


def test_names_are_written_as_they_are(axes) -> None:
    for name, shown in (
        ("from $5 to $6", "from $5 to $6"),
        ("_hidden", " _hidden"),
        ("tab\tand\x07bell", "tab and bell"),
    ):
        (line,) = axes.plot([0.0, 1.0], [0.0, 1.0], label=as_written(name, 40))
        axes.set_title(as_written(name, 40) + "\n$p^2$ = 3")
        (written,) = axes.legend(handles=[line]).get_texts()
        assert written.get_text().replace(r"\$", "$") == shown
        assert line in axes.get_legend_handles_labels()[0]
        axes.figure.draw_without_rendering()


def test_a_long_name_has_lines_and_an_end() -> None:
    lines = as_written("name " * 100, 30).split("\n")
    assert len(lines) == 3
    assert all(len(line) <= 30 for line in lines)
    assert lines[-1].endswith("…")
    unbroken = as_written("x" * 70, 30).split("\n")
    assert [len(line) for line in unbroken] == [30, 30, 10]
