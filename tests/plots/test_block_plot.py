"""The block is drawn where it stands, to scale, with the resultant it yields to."""

from __future__ import annotations

import math

import numpy as np
import pytest
from matplotlib.patches import Polygon

from rbfrag.errors import InputError
from rbfrag.plots.block import plot_block
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.stability.single import stability

TOPPLE = (Block.from_angles(-20.0, 25.0, 1.0), {"beta_deg": 5.0, "phi_deg": 35.0})
SLUMP = (Block.from_angles(50.0, 72.0, 1.0), {"beta_deg": 5.0, "phi_deg": 35.0})
CONFINED = (Block.from_angles(-60.0, 20.0, 1.0), {"beta_deg": 10.0, "phi_deg": 35.0})
LOCKED = (Block.from_angles(-60.0, -50.0, 1.0), {"beta_deg": 0.0, "phi_deg": 35.0})
UNSTABLE = (Block.from_angles(45.0, 65.0, 1.0), {"beta_deg": 50.0, "phi_deg": 35.0})
OUTLINE = (
    Block.from_polygon([(0, 0), (0.8, 0), (0.95, 0.2), (0.46, 2), (-0.54, 2)], 0, 4, 1, 74.8906),
    {"beta_deg": 12.0, "phi_deg": 35.0},
)
SLAB = (Block.rectangle(0.5, 30.0), {"beta_deg": 5.0, "phi_deg": 35.0})
PEBBLE = (Block.rectangle(1e-3, 4e-4), {"beta_deg": 0.0, "phi_deg": 35.0})
NO_BACK = (TOPPLE[0], {**TOPPLE[1], "back_fracture": False})
CASES = {
    "topple": TOPPLE,
    "slump": SLUMP,
    "confined topple": CONFINED,
    "confined topple locked": LOCKED,
    "slump unstable": UNSTABLE,
    "topple of an outline": OUTLINE,
    "topple of a pebble": PEBBLE,
    "slide of a slab": SLAB,
    "topple without back": (NO_BACK[0], NO_BACK[1]),
}


@pytest.mark.parametrize("case", CASES)
def test_the_drawing_is_the_block_turned_into_the_slope(case, tmp_path, figures, overlapping):
    block, conditions = CASES[case]
    judgement = stability(block, **conditions)
    assert case.startswith(judgement.mode.replace("_", " "))
    plot_block(block, judgement, tmp_path / "a.png")
    (figure,) = figures
    axes, panel = figure.axes
    assert judgement.mode.replace("_", " ") in figure.get_suptitle()
    assert axes.get_aspect() == 1.0

    rock, drawn = (p.get_xy() for p in axes.patches if isinstance(p, Polygon))
    beta = math.radians(conditions["beta_deg"])
    turn = np.array([[math.cos(beta), math.sin(beta)], [-math.sin(beta), math.cos(beta)]])
    expected = np.array(block.outline) @ turn.T
    assert np.allclose(drawn[: len(expected)], expected, atol=1e-12)
    # the base falls to the right by its dip
    toe, heel = turn @ block.toe, turn @ block.heel
    assert (heel[1] - toe[1]) / (toe[0] - heel[0]) == pytest.approx(math.tan(beta))
    # no corner of the rock is in front of both planes, where the block is
    gamma = math.radians(block.gamma_deg)
    behind = np.array([-math.sin(gamma), -math.cos(gamma)])
    for corner in np.linalg.solve(turn, rock.T).T:
        below_base = corner[1] <= block.toe[1] + 1e-9
        assert below_base or (corner - block.back) @ behind >= -1e-9

    labels = {t.get_text() for t in axes.texts if t.get_text()}
    assert labels == ({"1", "3", "C"} if case.endswith("back") else {"1", "2", "3", "C"})
    assert (
        overlapping(figure, [*axes.texts, *panel.texts, axes.xaxis.label, axes.yaxis.label]) == []
    )
    x_left, right = axes.get_xlim()
    ticks = [t.label1 for t in axes.xaxis.get_major_ticks() if x_left <= t.get_loc() <= right]
    assert overlapping(figure, ticks) == []


def test_the_resultant_of_a_topple_runs_through_the_toe(tmp_path, figures):
    block, conditions = TOPPLE
    for kv in (0.0, 0.3):
        judgement = stability(block, **conditions, kv=kv)
        plot_block(block, judgement, tmp_path / "a.svg")
        (arrow,) = [t for t in figures[-1].axes[0].texts if t.arrow_patch is not None]
        x, y = arrow.xy
        beta = math.radians(conditions["beta_deg"])
        toe_x = block.toe[0] * math.cos(beta) + block.toe[1] * math.sin(beta)
        toe_y = -block.toe[0] * math.sin(beta) + block.toe[1] * math.cos(beta)
        assert x / y == pytest.approx(toe_x / toe_y, rel=1e-12)


def test_a_locked_block_shows_its_weight(tmp_path, figures):
    block, conditions = LOCKED
    judgement = stability(block, **conditions)
    assert judgement.state == "locked"
    plot_block(block, judgement, tmp_path / "a.pdf")
    axes, panel = figures[0].axes
    (arrow,) = [t for t in axes.texts if t.arrow_patch is not None]
    assert arrow.xy[0] == 0.0
    assert "weight" in {t.get_text() for t in panel.texts}
    assert "locked" in figures[0].get_suptitle()


def test_a_path_that_cannot_be_written_is_rejected(tmp_path):
    block, conditions = TOPPLE
    with pytest.raises(InputError, match="plot file"):
        plot_block(block, stability(block, **conditions), tmp_path / "a.jpg")
