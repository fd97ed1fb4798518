"""The figure of the yield over the rotation: its lines are the yields."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from rbfrag.errors import InputError
from rbfrag.plots.modes import plot_rotation, yield_lines
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.stability.rotated_yield import kct_after_rotation, ks_after_rotation


def test_lines_are_the_yields(tmp_path: Path, figures: list[Figure]) -> None:
    for angles, function in (
        ((45.0, 65.0), ks_after_rotation),
        ((-60.0, 20.0), kct_after_rotation),
    ):
        block = Block.from_angles(*angles, 1.0)
        planes = {"beta_deg": 3.0, "phi_deg": 35.0}
        plot_rotation(block, tmp_path / "r.png", back_follows=(0.0, 0.5), **planes)
        lines = yield_lines(block, back_follows=(0.0, 0.5), **planes)
        (axes,) = figures[-1].axes
        drawn = [line for line in axes.lines if len(np.atleast_1d(line.get_xdata())) > 2]
        for share, line in zip((0.0, 0.5), drawn, strict=True):
            theta = np.asarray(line.get_xdata())
            k = function(block, theta, back_follows=share, **planes)  # type: ignore[operator]
            assert np.asarray(line.get_ydata()) == pytest.approx(k)
        assert lines[0].at_rest_g == lines[1].at_rest_g
        for line in lines:
            assert line.least_g <= min(line.at_rest_g, line.end_g)


def test_only_blocks_that_turn_against_their_back_plane(tmp_path: Path) -> None:
    block = Block.rectangle(2.0, 1.0)
    with pytest.raises(InputError, match="the mode of the block is topple"):
        plot_rotation(block, tmp_path / "r.png", beta_deg=0.0, phi_deg=50.0)
    assert not (tmp_path / "r.png").exists()
