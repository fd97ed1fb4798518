"""The lines that a block is drawn with."""

import math

import pytest

from rbfrag.plots.block import block_lines
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.stability.single import stability

BETA_DEG = 20.0

BLOCK = Block.from_angles(-15.0, 24.0, 2.5)
LINES = block_lines(BLOCK, stability(BLOCK, beta_deg=BETA_DEG, phi_deg=38.0))


def slope_deg(start, end):
    return math.degrees(math.atan2(end[1] - start[1], end[0] - start[0]))


def test_the_drawing_keeps_every_length():
    outline = LINES.outline
    for i, j in [(0, 1), (0, 2), (1, 3)]:
        drawn, real = (
            math.dist(outline[i], outline[j]),
            math.dist(BLOCK.outline[i], BLOCK.outline[j]),
        )
        assert drawn == pytest.approx(real)


def test_the_base_dips_out_of_the_slope_and_the_back_plane_stands_on_it():
    end, corner, top = LINES.planes
    assert slope_deg(corner, end) == pytest.approx(-BETA_DEG)
    assert slope_deg(corner, top) == pytest.approx(180.0 - BETA_DEG - BLOCK.gamma_deg)


def test_contacts_lie_on_the_planes():
    end, corner, top = LINES.planes
    for name, (a, b) in {"1": (corner, end), "3": (corner, end), "2": (corner, top)}.items():
        x, y = LINES.contacts[name]
        across = (x - a[0]) * (b[1] - a[1]) - (y - a[1]) * (b[0] - a[0])
        assert across == pytest.approx(0.0, abs=1e-9)


def test_the_resultant_at_yield_points_at_the_toe_of_a_block_that_topples():
    toe, tip = LINES.contacts["3"], LINES.resultant
    assert slope_deg((0, 0), tip) == pytest.approx(slope_deg((0, 0), toe))


def test_a_block_without_a_back_plane_has_two_contacts_and_one_plane():
    judgement = stability(BLOCK, beta_deg=BETA_DEG, phi_deg=38.0, back_fracture=False)
    lines = block_lines(BLOCK, judgement)
    assert set(lines.contacts) == {"1", "3"}
    assert len(lines.planes) == 2
