"""Critical strength over frequency: counts and lines."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rbfrag.errors import InputError
from rbfrag.plots.critical_strength import plot_critical, pulse_line
from tests.plots.critical_values import N, critical_values


def test_every_critical_value_is_shown_and_counted(tmp_path, figures) -> None:
    table = critical_values()
    plot_critical(table, tmp_path / "s.png", data="made up")
    axes = figures[0].axes[0]
    assert len(axes.collections[0].get_offsets()) == N * 9 // 10
    assert "360 critical blocks" in axes.get_title()
    assert "made up" in axes.get_title()
    assert not axes.texts
    x = 2.0 * np.pi / (table.tm_s * np.sqrt(table.p2))
    result = table.status == "found"
    *legend, limit = [text.get_text() for text in figures[0].legends[0].get_texts()]
    assert limit == "search limit: 40 below it"
    for name, words in zip(("rectangular", "half-sine", "triangular"), legend, strict=True):
        above = int(np.sum(table.kr_over_pga[result] > pulse_line(name, x[result])))
        assert words.startswith(f"{name} pulse: {above} above")


def test_nothing_covers_anything(tmp_path, figures, overlapping) -> None:
    plot_critical(critical_values(), tmp_path / "s.png")
    axes = figures[0].axes[0]
    texts = [*figures[0].legends[0].get_texts(), axes.title, axes.xaxis.label]
    assert overlapping(figures[0], texts) == []


def test_without_a_mean_period_there_is_nothing(tmp_path) -> None:
    table = replace(critical_values(), tm_s=np.full(N, np.nan))
    with pytest.raises(InputError, match="mean period"):
        plot_critical(table, tmp_path / "s.png")
    assert not list(tmp_path.iterdir())
