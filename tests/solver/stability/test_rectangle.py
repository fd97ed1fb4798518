"""The rectangle of a given p² and k_r."""

import math

import pytest

from rbfrag.errors import InputError
from rbfrag.solver.stability.single import level_rectangle, rectangle_r3_m

BLOCKS = [(0.1, 0.02), (3.0, 0.1), (30.0, 1.5), (12.0, 5.0)]


@pytest.mark.parametrize(("p2", "kr"), BLOCKS)
def test_it_has_the_numbers_it_was_made_of(p2, kr):
    block, result = level_rectangle(p2, kr)
    assert block.p2 == pytest.approx(p2, rel=1e-12)
    assert result.kr == pytest.approx(kr, rel=1e-12)
    assert (result.mode, result.state) == ("topple", "stable")


@pytest.mark.parametrize(("p2", "kr"), BLOCKS)
def test_it_is_a_rectangle_of_width_over_height_kr(p2, kr):
    block, _ = level_rectangle(p2, kr)
    (x1, y1), (x2, y2), (x3, y3), _ = block.outline
    width, height = math.hypot(x2 - x1, y2 - y1), math.hypot(x3 - x2, y3 - y2)
    assert width / height == pytest.approx(kr, rel=1e-12)
    assert (x2 - x1) * (x3 - x2) + (y2 - y1) * (y3 - y2) == pytest.approx(0.0, abs=1e-9)
    assert rectangle_r3_m(p2) == pytest.approx(0.5 * math.hypot(width, height), rel=1e-12)


@pytest.mark.parametrize(("p2", "kr"), [(0.0, 0.1), (3.0, 0.0), (3.0, -0.1), (math.nan, 0.1)])
def test_no_block_is_made_of_nothing(p2, kr):
    with pytest.raises(InputError):
        level_rectangle(p2, kr)
