"""Captions: each names a command of this program that draws the figure above it."""

from __future__ import annotations

import pytest

from benchmarks.figures import commands, figure_of
from benchmarks.page import ROOT

CAPTIONS = commands()


def test_the_figures_of_the_reference_are_among_them() -> None:
    drawn = {figure_of(arguments).removeprefix("docs/figures/") for _, arguments in CAPTIONS}
    assert drawn >= {"chart.svg", "curve.svg", "fit.svg", "calibration.svg", "critical.svg",
                     "vertical.svg", "failure-modes.svg", "block.svg"}  # fmt: skip
    assert len(CAPTIONS) == len(drawn)


@pytest.mark.parametrize(
    ("page", "arguments"), CAPTIONS, ids=[figure_of(arguments) for _, arguments in CAPTIONS]
)
def test_the_page_shows_what_its_caption_draws(page, arguments) -> None:
    file = ROOT / figure_of(arguments)
    assert file.is_file()
    assert f"figures/{file.name})" in page.read_text(encoding="utf-8")
