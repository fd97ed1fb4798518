"""Geometry of blocks: conversions, polygons, mirror image, and what is no block."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rbfrag.errors import InputError
from rbfrag.solver.block.geometry import Block, polygon_properties
from rbfrag.solver.stability.single import stability

angles = st.tuples(
    st.floats(-85.0, 85.0), st.floats(-85.0, 85.0)
).map(sorted).filter(lambda pair: pair[1] - pair[0] > 1.0)  # fmt: skip
sizes = st.floats(0.01, 100.0)


@given(angles, sizes)
def test_angles_to_fractures_and_back(pair: list[float], r3_m: float) -> None:
    block = Block.from_angles(*pair, r3_m)
    again = Block.from_fractures(block.s1_m, block.s2_m, block.gamma_deg)
    # the rounding of γ alone changes tan α by as much as cot γ is large
    condition = 1.0 + abs(block.tan_alpha1) + abs(block.tan_alpha3)
    assert again.alpha1_deg == pytest.approx(block.alpha1_deg, abs=1e-12 * condition, rel=0)
    assert again.alpha3_deg == pytest.approx(block.alpha3_deg, abs=1e-12 * condition, rel=0)
    assert again.r3_m == pytest.approx(block.r3_m, rel=1e-12 * condition)


@given(st.floats(0.05, 20.0), st.floats(0.05, 20.0), st.floats(5.0, 175.0))
def test_fractures_to_angles_and_back(s1_m: float, s2_m: float, gamma_deg: float) -> None:
    block = Block.from_fractures(s1_m, s2_m, gamma_deg)
    again = Block.from_angles(block.alpha1_deg, block.alpha3_deg, block.r3_m)
    condition = 1.0 + block.tan_alpha1**2 + block.tan_alpha3**2
    assert again.s1_m == pytest.approx(s1_m, rel=1e-12 + 1e-16 * condition)
    assert again.s2_m == pytest.approx(s2_m, rel=1e-12 + 1e-16 * condition)
    assert again.gamma_deg == pytest.approx(gamma_deg, rel=1e-12 + 1e-16 * condition)


@given(angles, sizes, st.floats(-10.0, 10.0), st.floats(-10.0, 10.0))
def test_parallelogram_as_polygon(pair: list[float], r3_m: float, x: float, y: float) -> None:
    block = Block.from_angles(*pair, r3_m)
    moved = [(vx + x * r3_m, vy + y * r3_m) for vx, vy in block.vertices_m]
    polygon = Block.from_polygon(moved, heel=0, back=3, toe=1, gamma_deg=block.gamma_deg)
    # slivers lose digits when their vertices are added up far from the origin
    slack = 1e-12 * (1.0 + abs(block.tan_alpha1) + abs(block.tan_alpha3)) ** 2
    for name in ("alpha1_deg", "alpha3_deg", "r1_m", "r2_m", "r3_m", "s1_m", "s2_m"):
        expected = getattr(block, name)
        assert getattr(polygon, name) == pytest.approx(expected, rel=slack, abs=slack * 1.0), name
    for name in ("area_m2", "inertia_toe_m2", "shape_factor", "p2"):
        assert getattr(polygon, name) == pytest.approx(getattr(block, name), rel=slack), name
    turn = (polygon.alpha2_deg - block.alpha2_deg + 180.0) % 360.0 - 180.0
    assert turn == pytest.approx(0.0, abs=1e-9)
    assert polygon.confines == block.confines


@given(angles, sizes)
def test_mirror(pair: list[float], r3_m: float) -> None:
    block = Block.from_angles(*pair, r3_m)
    mirror = block.mirror()
    assert (mirror.alpha1_deg, mirror.alpha3_deg) == (-block.alpha3_deg, -block.alpha1_deg)
    assert mirror.gamma_deg == pytest.approx(180.0 - block.gamma_deg, rel=1e-14)
    assert mirror.r1_m == pytest.approx(block.r3_m, rel=1e-14)
    assert (mirror.s1_m, mirror.area_m2) == pytest.approx((block.s1_m, block.area_m2), rel=1e-14)
    assert mirror.s2_m == pytest.approx(block.s2_m, rel=1e-12)
    back = mirror.mirror()
    assert (back.alpha1_deg, back.alpha3_deg, back.cot_gamma) == (
        block.alpha1_deg,
        block.alpha3_deg,
        block.cot_gamma,
    )
    assert back.r3_m == pytest.approx(block.r3_m, rel=1e-14)


@given(angles, sizes)
def test_edge_lengths(pair: list[float], r3_m: float) -> None:
    block = Block.from_angles(*pair, r3_m)
    a1, a3 = (math.radians(angle) for angle in pair)
    gamma = math.radians(block.gamma_deg)
    assert block.base_m == pytest.approx(
        block.r3_m * math.sin(a3) - block.r1_m * math.sin(a1), rel=1e-10
    )
    assert block.base_m == pytest.approx(block.s2_m / math.sin(gamma), rel=1e-10)
    assert math.dist(block.heel, block.back) == pytest.approx(
        block.s1_m / math.sin(gamma), rel=1e-10
    )
    assert block.area_m2 == pytest.approx(block.base_m * block.s1_m, rel=1e-12)
    assert block.centroid == (-block.heel[0], -block.heel[1])


def test_obtuse_gamma_has_no_wrong_sign() -> None:
    # (3.12) read as an arctangent of one argument gives -55.6 degrees here
    assert Block.from_angles(-60.0, 20.0, 1.0).gamma_deg == pytest.approx(124.373700, abs=1e-6)
    assert Block.from_angles(-25.0, 25.0, 1.0).gamma_deg == 90.0


def test_rectangle() -> None:
    for slope in (5.0, 30.0, 60.0):
        block = Block.from_angles(-slope, slope, 2.0)
        assert block.shape_factor == 0.75
        assert block.p2 == pytest.approx(3.0 * 9.80665 / (4.0 * 2.0), rel=1e-15)


def test_inertia_of_an_outline_that_is_not_star_shaped() -> None:
    # an L of three unit squares; unsigned cross products would give other numbers
    corners = [(0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.0, 1.0), (1.0, 2.0), (0.0, 2.0)]
    squares = [(0.5, 0.5), (1.5, 0.5), (0.5, 1.5)]
    area_m2, middle, inertia_m2 = polygon_properties([(x + 30.0, y - 70.0) for x, y in corners])
    centroid = (sum(x for x, _ in squares) / 3.0, sum(y for _, y in squares) / 3.0)
    inertia = sum(1.0 / 6.0 + math.dist(square, centroid) ** 2 for square in squares) / 3.0
    assert area_m2 == pytest.approx(3.0, rel=1e-14)
    assert middle == pytest.approx((30.0 + centroid[0], -70.0 + centroid[1]), rel=1e-14)
    assert inertia_m2 == pytest.approx(inertia, rel=1e-13)


def test_a_broken_heel_is_confined_by_the_lowest_point_of_the_back_edge() -> None:
    # back plane at 100 degrees; the missing corner moves the first obstacle up
    cot = 1.0 / math.tan(math.radians(100.0))

    def block(missing_m: float) -> Block:
        top, low = (-3.0 * cot, 3.0), (-missing_m * cot, missing_m)
        corners = [(0.3, 0.0), (1.5, 0.0), (2.0, 3.0), top, low]
        return Block.from_polygon(corners, heel=0, back=3, toe=1, gamma_deg=100.0)

    assert block(0.1).confines
    # a rotation about the toe moves a point at (x, y) along the plane's normal (1, cot) by
    # y + (1.5 - x) cot, which is y (1 + cot²) + 1.5 cot on the plane
    touch = -1.5 * cot / (1.0 + cot * cot)
    assert block(0.999 * touch).confines
    assert not block(1.001 * touch).confines


SQUARE = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"vertices_m": SQUARE[:2]}, ["at least 3", "2"]),
        ({"vertices_m": []}, ["at least 3", "0"]),
        ({"vertices_m": 7}, ["pairs"]),
        ({"vertices_m": [(0, 0), (1, 0), "ab", (0, 1)]}, ["vertex 2"]),
        ({"vertices_m": [(0, 0), (1, 0), (1, math.nan), (0, 1)]}, ["vertex 2", "nan"]),
        ({"vertices_m": [(0, 0), (1, 0), (1, math.inf), (0, 1)]}, ["vertex 2", "inf"]),
        ({"vertices_m": [*SQUARE, SQUARE[0]]}, ["same point", "closing"]),
        ({"vertices_m": [SQUARE[0], SQUARE[1], SQUARE[1], SQUARE[3]]}, ["1 and 2", "same point"]),
        ({"vertices_m": SQUARE[::-1]}, ["clockwise"]),
        ({"vertices_m": [(0, 0), (1, 1), (1, 0), (0, 1)]}, ["crosses"]),
        ({"vertices_m": [(0, 0), (1, 0), (1, 1), (0, 1), (0.5, 0), (0.2, 0.5)]}, ["touches"]),
        ({"vertices_m": [(0, 0), (1, 0), (1, 1), (1, 0.5), (0, 1)]}, ["touches"]),
        ({"heel": 4}, ["heel = 4", "0 to 3"]),
        ({"heel": -1}, ["heel = -1", "0 to 3"]),
        ({"toe": 1.0}, ["toe = 1.0"]),
        ({"back": True}, ["back = True"]),
        ({"back": 1}, ["three different vertices"]),
        ({"heel": 1, "toe": 0}, ["downslope"]),
        ({"toe": 2, "back": 3}, ["tolerance", "base plane"]),
        ({"gamma_deg": 0.0}, ["gamma_deg = 0", "0 and 180"]),
        ({"gamma_deg": 180.0}, ["gamma_deg = 180"]),
        ({"gamma_deg": math.nan}, ["gamma_deg = nan"]),
        ({"gamma_deg": 80.0}, ["back plane", "gamma_deg = 80", "tolerance"]),
        ({"gamma_deg": 100.0}, ["back plane", "gamma_deg = 100", "tolerance"]),
        ({"back": 2, "gamma_deg": 90.0}, ["back plane"]),
        ({"vertices_m": [(0, 0), (1e200, 0), (1e200, 1), (0, 1)]}, ["out of range"]),
        ({"vertices_m": [(3, 3)] * 4}, ["out of range"]),
    ],
    ids=str,
)
def test_polygons_that_are_no_block(change: dict[str, Any], words: list[str]) -> None:
    arguments: dict[str, Any] = {
        "vertices_m": SQUARE, "heel": 0, "back": 3, "toe": 1, "gamma_deg": 90.0,
    }  # fmt: skip
    Block.from_polygon(**arguments)
    with pytest.raises(InputError) as rejected:
        Block.from_polygon(**arguments | change)
    for word in words:
        assert word in str(rejected.value)


def test_a_vertex_below_the_base_is_rejected() -> None:
    corners = [(0.0, 0.0), (0.5, -0.2), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]
    with pytest.raises(InputError, match="below the base plane"):
        Block.from_polygon(corners, heel=0, back=4, toe=2, gamma_deg=90.0)


def test_contact_tolerance_is_a_thousandth_of_the_size() -> None:
    for off, fits in ((1.3e-3, True), (1.6e-3, False)):
        corners = [(0.0, 0.0), (1.0, off), (1.0, 1.0), (0.0, 1.0)]  # diagonal 1.414 m
        if fits:
            Block.from_polygon(corners, heel=0, back=3, toe=1, gamma_deg=90.0)
        else:
            with pytest.raises(InputError, match=r"0\.0016 m apart"):
                Block.from_polygon(corners, heel=0, back=3, toe=1, gamma_deg=90.0)


@pytest.mark.parametrize(
    ("alpha1", "alpha3", "r3", "word"),
    [
        (30.0, 20.0, 1.0, "alpha1_deg = 30 is not below alpha3_deg = 20"),
        (20.0, 20.0, 1.0, "not below"),
        (-90.0, 20.0, 1.0, "alpha1_deg = -90"),
        (-95.0, 20.0, 1.0, "between -90 and 90"),
        (10.0, 90.0, 1.0, "alpha3_deg = 90"),
        (math.nan, 20.0, 1.0, "alpha1_deg = nan"),
        (10.0, math.inf, 1.0, "alpha3_deg = inf"),
        (10.0, 20.0, 0.0, "r3_m = 0"),
        (10.0, 20.0, -1.0, "r3_m = -1"),
        (10.0, 20.0, math.nan, "r3_m = nan"),
        ("a", 20.0, 1.0, "alpha1_deg = 'a'"),
        (10.0, None, 1.0, "alpha3_deg = None"),
        (10.0, 20.0, True, "r3_m = True"),
        (10.0, 20.0, 1e-200, "out of range"),
        (10.0, 20.0, 1e200, "out of range"),
        (-89.999, 89.9999999, 1e-320, "out of range"),
    ],
)
def test_angles_that_are_no_block(alpha1: Any, alpha3: Any, r3: Any, word: str) -> None:
    with pytest.raises(InputError) as rejected:
        Block.from_angles(alpha1, alpha3, r3)
    assert word in str(rejected.value)


@pytest.mark.parametrize(
    ("s1", "s2", "gamma", "word"),
    [
        (0.0, 1.0, 60.0, "s1_m = 0"),
        (1.0, -0.5, 60.0, "s2_m = -0.5"),
        (math.nan, 1.0, 60.0, "s1_m = nan"),
        (1.0, 1.0, 0.0, "gamma_deg = 0"),
        (1.0, 1.0, 180.0, "between 0 and 180"),
        (1.0, 1.0, -10.0, "gamma_deg = -10"),
        (1.0, 1e-30, 60.0, "without thickness"),
    ],
)
def test_fractures_that_are_no_block(s1: Any, s2: Any, gamma: Any, word: str) -> None:
    with pytest.raises(InputError) as rejected:
        Block.from_fractures(s1, s2, gamma)
    assert word in str(rejected.value)


def test_a_polygon_has_no_mirror_image_of_its_own() -> None:
    block = Block.from_polygon(SQUARE, 0, 3, 1, 90.0)
    with pytest.raises(InputError, match="from_polygon"):
        block.mirror()


def test_numpy_numbers_are_numbers() -> None:
    assert Block.from_angles(np.float64(-10.0), np.int64(20), np.float32(2.0)).alpha3_deg == 20.0


@given(st.floats(0.05, 20.0), st.floats(0.05, 20.0))
def test_a_rectangle_is_its_outline_and_the_closed_forms(height_m: float, width_m: float) -> None:
    block = Block.rectangle(height_m, width_m)
    corners = [(0.0, 0.0), (width_m, 0.0), (width_m, height_m), (0.0, height_m)]
    outline = Block.from_polygon(corners, heel=0, back=3, toe=1, gamma_deg=90.0)
    half_diagonal = math.hypot(height_m, width_m) / 2.0
    assert block.r3_m == pytest.approx(half_diagonal, rel=1e-14)
    assert block.p2 == pytest.approx(3.0 * 9.80665 / (4.0 * half_diagonal), rel=1e-13)
    assert block.p2 == pytest.approx(outline.p2, rel=1e-11)
    assert block.alpha3_deg == pytest.approx(math.degrees(math.atan2(width_m, height_m)), rel=1e-14)
    assert (block.alpha1_deg, block.gamma_deg) == (-block.alpha3_deg, 90.0)
    assert block.alpha3_deg == pytest.approx(outline.alpha3_deg, rel=1e-11)
    assert (block.s1_m, block.base_m) == pytest.approx((height_m, width_m), rel=1e-14)
    assert block.area_m2 == pytest.approx(height_m * width_m, rel=1e-13)
    assert not block.confines
    topples = stability(block, beta_deg=0.0, phi_deg=89.9)
    if topples.mode == "topple":
        assert topples.kr == pytest.approx(width_m / height_m, rel=1e-13)


@pytest.mark.parametrize("sides", [(0.0, 1.0), (1.0, -1.0), (math.nan, 1.0), (1.0, math.inf)])
def test_a_rectangle_has_sides_above_zero(sides: tuple[float, float]) -> None:
    with pytest.raises(InputError, match=r"height_m|width_m"):
        Block.rectangle(*sides)
