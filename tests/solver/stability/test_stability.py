"""Modes, states, margins and rejections of `stability`."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from rbfrag.errors import InputError
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.stability.single import Stability, stability

angle_pairs = st.tuples(
    st.floats(-80.0, 85.0), st.floats(-80.0, 85.0)
).map(sorted).filter(lambda pair: pair[1] - pair[0] > 0.5)  # fmt: skip
frictions = st.floats(1.0, 70.0)
dips = st.floats(-30.0, 40.0)


def at(a1: float, a3: float, phi: float, beta: float = 0.0, **rest: Any) -> Stability:
    return stability(Block.from_angles(a1, a3, 1.0), beta_deg=beta, phi_deg=phi, **rest)


@pytest.mark.parametrize(
    ("a1", "a3", "phi", "mode"),
    [
        (45.0, 65.0, 35.0, "slump"),
        (35.0, 65.0, 35.0, "slide"),  # boundaries belong to sliding
        (10.0, 35.0, 35.0, "slide"),
        (-60.0, 35.0, 35.0, "slide"),
        (10.0, 34.0, 35.0, "topple"),
        (-25.0, 25.0, 35.0, "topple"),  # a back plane normal to the base does not confine
        (-25.1, 25.0, 35.0, "confined_topple"),
    ],
)
def test_modes_and_their_boundaries(a1: float, a3: float, phi: float, mode: str) -> None:
    assert at(a1, a3, phi).mode == mode


def test_only_the_governing_yield_and_that_of_sliding_are_given() -> None:
    names = {"topple": "kr", "slump": "ks", "confined_topple": "kct"}
    for a1, a3 in ((45.0, 65.0), (10.0, 65.0), (0.0, 20.0), (-50.0, 20.0)):
        result = at(a1, a3, 35.0)
        for mode, name in names.items():
            value = getattr(result, name)
            assert value == (result.yield_acceleration if result.mode == mode else None)
        assert result.ky == pytest.approx(math.tan(math.radians(35.0)), rel=1e-14)


@given(frictions, st.floats(0.01, 0.99), st.floats(0.01, 0.99), dips, st.booleans())
def test_slumps_and_topples_start_before_sliding_with_equal_friction(
    phi: float, first: float, other: float, beta: float, steep: bool
) -> None:
    if steep:  # both angles above that of friction
        a1 = phi + first * (85.0 - phi)
        a3 = a1 + other * (85.0 - a1)
    else:
        a3 = first * phi
        a1 = a3 * (2.0 * other - 1.0)
    result = at(a1, a3, phi, beta)
    assert result.mode == ("slump" if steep else "topple")
    assert result.yield_acceleration <= result.ky + 1e-12 * (1.0 + abs(result.ky))


@given(frictions, st.floats(0.1, 80.0), dips)
def test_yields_meet_at_the_boundaries(phi: float, width: float, beta: float) -> None:
    def inclination(a1: float, a3: float) -> float:
        """Return the inclination at which the block yields: it is finite where k is not."""
        assume(-85.0 < a1 < a3 < 85.0)
        return math.atan(at(a1, a3, phi, beta).yield_acceleration)

    sliding = at(phi, phi + width, phi, beta) if phi + width < 85.0 else None
    near = 1e-9
    if sliding is not None:
        assert inclination(phi + near, phi + width) == pytest.approx(
            math.atan(sliding.ky), abs=1e-5
        )
    toe = at(phi - width, phi, phi, beta)
    assert toe.mode == "slide"
    assume(toe.state == "stable")
    assume(abs(phi - width) < 80.0)
    assert inclination(phi - width, phi - near) == pytest.approx(math.atan(toe.ky), abs=1e-5)


def test_jump_where_the_back_plane_begins_to_overhang() -> None:
    free_standing = at(-20.0, 20.0, 30.0, 10.0)
    held = at(-20.0 - 1e-9, 20.0, 30.0, 10.0)
    assert (free_standing.mode, held.mode) == ("topple", "confined_topple")
    assert free_standing.yield_acceleration == pytest.approx(0.176327, abs=1e-6)
    assert held.yield_acceleration == pytest.approx(0.250433, abs=1e-6)


@pytest.mark.parametrize(("phi", "alpha", "least"), [(30.0, 54.3, 0.3382), (40.0, 60.4, 0.5973)])
def test_weakest_slumps_lie_near_the_middle_of_the_diagonal(
    phi: float, alpha: float, least: float
) -> None:
    middles = np.arange(phi + 0.05, 89.0, 0.05)
    yields = [at(float(a), float(a) + 1e-9, phi).yield_acceleration for a in middles]
    assert min(yields) == pytest.approx(least, abs=1e-4)
    assert middles[int(np.argmin(yields))] == pytest.approx(alpha, abs=0.3)
    assert at(50.0, 90.0 - 1e-7, phi).yield_acceleration == pytest.approx(
        math.tan(math.radians(phi)), abs=1e-6
    )


def test_a_much_rougher_back_plane_makes_slumps_stronger_than_sliding() -> None:
    result = at(30.0, 80.0, 20.0, phi_back_deg=55.0)
    assert result.ks == pytest.approx(0.38048, abs=5e-6)
    assert result.ky == pytest.approx(0.36397, abs=5e-6)
    assert any("rougher" in sentence for sentence in result.warnings)


@given(st.floats(-80.0, -1.0), st.floats(-79.0, 60.0), frictions, frictions, dips)
def test_confined_topple_against_sliding(
    a1: float, a3: float, phi: float, phi_back: float, beta: float
) -> None:
    assume(a1 + 0.5 < a3 < phi)
    block = Block.from_angles(a1, a3, 1.0)
    result = stability(block, beta_deg=beta, phi_deg=phi, phi_back_deg=phi_back)
    assume(result.mode == "confined_topple")
    corner = block.gamma_deg + phi + phi_back
    assume(abs(corner - 180.0) > 1e-6)
    if corner < 180.0 and result.ky < math.inf:
        assert result.yield_acceleration < result.ky
        assert result.state != "locked"
    elif corner < 180.0:
        # no acceleration slides the block where phi - beta >= 90, nor need any topple it
        assert result.yield_acceleration <= result.ky
    else:
        assert result.yield_acceleration > result.ky or result.state == "locked"
        assert result.state != "unstable" or result.ky < 0.0


@given(angle_pairs, frictions, frictions, dips, st.floats(-0.9, 2.0))
def test_vertical_acceleration_scales_every_yield(
    pair: list[float], phi: float, phi_back: float, beta: float, kv: float
) -> None:
    still = at(*pair, phi, beta, phi_back_deg=phi_back)
    moved = at(*pair, phi, beta, phi_back_deg=phi_back, kv=kv)
    assert moved.mode == still.mode
    if math.isfinite(still.yield_acceleration):
        assert moved.yield_acceleration == pytest.approx(
            (1.0 + kv) * still.yield_acceleration, rel=1e-12
        )


@given(angle_pairs, frictions, frictions, dips, st.floats(0.01, 50.0))
def test_size_does_not_matter(
    pair: list[float], phi: float, phi_back: float, beta: float, r3_m: float
) -> None:
    small = at(*pair, phi, beta, phi_back_deg=phi_back)
    block = Block.from_angles(*pair, r3_m)
    large = stability(block, beta_deg=beta, phi_deg=phi, phi_back_deg=phi_back)
    assert (large.mode, large.yield_acceleration) == (small.mode, small.yield_acceleration)
    polygon = Block.from_polygon(block.vertices_m, 0, 3, 1, block.gamma_deg)
    assume(abs(block.cot_gamma) > 1e-9)
    assume(min(abs(phi - a) for a in pair) > 1e-6)
    same = stability(polygon, beta_deg=beta, phi_deg=phi, phi_back_deg=phi_back)
    assert (same.mode, same.state) == (large.mode, large.state)
    if math.isfinite(large.yield_acceleration) and abs(large.yield_acceleration) < 1e2:
        assert same.yield_acceleration == pytest.approx(large.yield_acceleration, abs=1e-6)


def test_mirror_image_slides_the_other_way() -> None:
    # (α1, α3, γ, β, k) -> (-α3, -α1, π - γ, -β, -k): a topple about the toe is one about the heel
    block = Block.from_angles(-15.0, 25.0, 1.0)
    mirror = block.mirror()
    local = stability(block, beta_deg=5.0, phi_deg=40.0, back_fracture=False)
    there = stability(mirror, beta_deg=-5.0, phi_deg=40.0, back_fracture=False)
    heel = math.tan(math.radians(block.alpha1_deg - 5.0))  # uphill topple of the block
    assert local.kr == pytest.approx(math.tan(math.radians(20.0)), rel=1e-13)
    assert there.kr == pytest.approx(-heel, rel=1e-13)
    assert mirror.mirror().alpha3_deg == block.alpha3_deg


@given(angle_pairs, frictions, dips, st.booleans())
def test_margins_lead_to_the_mode_they_name(
    pair: list[float], phi: float, beta: float, back: bool
) -> None:
    result = at(*pair, phi, beta, back_fracture=back)
    start = {"alpha1": pair[0], "alpha3": pair[1], "phi": phi}
    for margin in result.margins:
        # on the boundary itself the sense is not told by the sign
        if abs(margin.change_deg) < 1e-3:
            continue
        beyond = dict(start)
        step = math.copysign(1e-6, margin.change_deg)
        beyond[margin.variable] += margin.change_deg + step
        before = dict(start)
        before[margin.variable] += margin.change_deg - step
        if not (-90.0 < beyond["alpha1"] < beyond["alpha3"] < 90.0 and 0.0 <= beyond["phi"] < 90.0):
            continue

        def mode(now: dict[str, float]) -> str:
            there = at(now["alpha1"], now["alpha3"], now["phi"], beta, back_fracture=back)
            return there.mode

        assert mode(beyond) == margin.mode != result.mode
        assert mode(before) == result.mode


def test_margins_of_a_bonded_block_lead_across() -> None:
    bond = {"cohesion_pa": 9000.0, "density_kg_m3": 2600.0}
    for a1, a3 in ((20.0, 60.0), (55.0, 75.0), (5.0, 50.0), (-30.0, 25.0), (-60.0, 30.0)):
        block = Block.from_angles(a1, a3, 1.0)
        result = stability(block, beta_deg=12.0, phi_deg=35.0, **bond)
        checked = 0
        for margin in result.margins:
            if margin.variable == "phi":
                for step, mode in ((1e-7, margin.mode), (-1e-7, result.mode)):
                    phi = 35.0 + margin.change_deg + math.copysign(step, step * margin.change_deg)
                    there = stability(block, beta_deg=12.0, phi_deg=phi, **bond)
                    assert there.mode == mode
                checked += 1
        assert checked


def test_margins_on_a_boundary_are_zero() -> None:
    zero = {m.variable: m for m in at(10.0, 35.0, 35.0).margins if m.change_deg == 0.0}
    assert {m.mode for m in zero.values()} == {"topple"}
    assert set(zero) == {"phi", "alpha3"}


def test_states() -> None:
    stable = at(10.0, 60.0, 35.0, 20.0)
    limit = at(10.0, 60.0, 35.0, 35.0)
    falling = at(10.0, 60.0, 35.0, 36.0)
    assert (stable.state, limit.state, falling.state) == ("stable", "stable", "unstable")
    assert limit.yield_acceleration == 0.0
    assert any("at its limit" in sentence for sentence in limit.warnings)
    assert any("fails at rest" in sentence for sentence in falling.warnings)
    # toppling fails at rest from β above α3, although β is below φ
    assert at(-10.0, 20.0, 40.0, 21.0).state == "unstable"
    locked = at(-40.0, 20.0, 70.0, 10.0)
    assert (locked.mode, locked.state) == ("confined_topple", "locked")
    assert locked.yield_acceleration == math.inf
    assert locked.delta_deg is None
    assert any("wedged" in sentence for sentence in locked.warnings)


def test_a_wedge_locks_even_where_sine_and_cosine_point_backward() -> None:
    # δ* has risen past 180° + β, where atan2 alone would call the block unstable
    result = at(-1.0, 0.0, 65.0, -6.0, phi_back_deg=29.0)
    assert (result.mode, result.state) == ("confined_topple", "locked")
    assert result.yield_acceleration == math.inf


def test_locked_from_the_right_angle_on() -> None:
    # δ* - β = 90 degrees: beyond it a bare tangent gives a plausible k of the wrong sign
    assert at(-10.0, 60.0, 70.0, -29.9).yield_acceleration == pytest.approx(
        math.tan(math.radians(89.9)), rel=1e-9
    )
    for beta in (-30.0, -30.1, -45.0):
        result = at(-10.0, 60.0, 70.0, beta)
        assert (result.mode, result.state) == ("topple", "locked")


def test_without_a_back_plane() -> None:
    free_standing = {"back_fracture": False}
    assert at(-60.0, 20.0, 35.0, **free_standing).mode == "topple"
    assert at(-60.0, 20.0, 35.0, **free_standing).margins
    steep = at(40.0, 60.0, 35.0, 38.0, **free_standing)
    assert (steep.mode, steep.state) == ("slump", "unstable")
    assert steep.yield_acceleration == -math.inf
    sliding = at(40.0, 60.0, 35.0, 45.0, **free_standing)
    assert (sliding.mode, sliding.state) == ("slide", "unstable")
    # below the friction angle, too, a weight upslope of the heel turns the block back
    leaning = at(20.0, 60.0, 35.0, 10.0, **free_standing)
    assert (leaning.mode, leaning.state) == ("slide", "unstable")
    assert any("turns back about the heel" in sentence for sentence in leaning.warnings)
    assert at(20.0, 60.0, 35.0, 20.0, **free_standing).state == "stable"


def test_warnings_tell_what_is_taken_for_granted() -> None:
    def warns(result: Stability, words: str) -> bool:
        return any(words in sentence for sentence in result.warnings)

    assert warns(at(-60.0, 20.0, 35.0, 10.0), "exceeds 180")
    assert not warns(at(-40.0, 20.0, 30.0, 5.0), "exceeds 180")
    assert warns(at(-10.0, 25.0, 35.0), "friction on the back face is neglected")
    assert not warns(
        at(-10.0, 25.0, 35.0, phi_back_deg=0.0), "friction on the back face is neglected"
    )
    assert warns(at(20.0, 60.0, 35.0, 10.0), "leans on the back plane")
    assert not warns(at(20.0, 60.0, 35.0, 20.0), "leans on the back plane")
    assert warns(at(45.0, 65.0, 75.0, 40.0), "") == bool(at(45.0, 65.0, 75.0, 40.0).warnings)
    assert warns(stability(Block.from_fractures(1.0, 1.0, 150.0), beta_deg=40.0, phi_deg=45.0),
                "nearer to horizontal")  # fmt: skip


def test_cohesion_exact_and_equivalent() -> None:
    block = Block.from_angles(5.0, 75.0, 1.0)
    c, rho, phi, beta = 6000.0, 2700.0, math.radians(35.0), math.radians(15.0)
    ratio = c / (rho * 9.80665 * block.s1_m)
    result = stability(block, beta_deg=15.0, phi_deg=35.0, cohesion_pa=c, density_kg_m3=rho)
    exact = math.tan(phi - beta) + ratio * math.cos(phi) / math.cos(phi - beta)
    assert result.mode == "slide"
    assert result.ky == pytest.approx(exact, rel=1e-13)
    assert result.cohesion is not None
    assert result.cohesion.ky == result.ky
    equivalent = math.atan(math.tan(phi) + ratio)
    assert result.cohesion.phi_equivalent_deg == pytest.approx(math.degrees(equivalent), rel=1e-13)
    assert result.cohesion.ky_equivalent == pytest.approx(math.tan(equivalent - beta), rel=1e-13)
    # the two agree where the base is level and nothing shakes it, and only there
    level = stability(block, beta_deg=0.0, phi_deg=35.0, cohesion_pa=c, density_kg_m3=rho)
    assert level.cohesion is not None
    assert level.ky == pytest.approx(level.cohesion.ky_equivalent, rel=1e-13)
    assert result.ky != pytest.approx(result.cohesion.ky_equivalent, rel=1e-3)


def test_a_bond_can_turn_sliding_into_toppling() -> None:
    weak = at(10.0, 40.0, 35.0, 5.0)
    bonded = at(10.0, 40.0, 35.0, 5.0, cohesion_pa=1e5, density_kg_m3=2700.0)
    assert (weak.mode, bonded.mode) == ("slide", "topple")
    assert bonded.kr == pytest.approx(math.tan(math.radians(35.0)), rel=1e-13)
    assert bonded.ky > bonded.yield_acceleration
    no_bond = at(10.0, 40.0, 35.0, 5.0, cohesion_pa=0.0, density_kg_m3=2700.0)
    assert no_bond.yield_acceleration == weak.yield_acceleration
    assert no_bond.cohesion is None


def test_a_back_contact_below_the_centroid_cannot_hold_a_slump() -> None:
    # a low back edge under a block that leans far back
    corners = [(0.0, 0.0), (1.0, 0.0), (-3.0, 4.0), (-0.2, 0.2)]
    block = Block.from_polygon(corners, heel=0, back=3, toe=1, gamma_deg=45.0)
    result = stability(block, beta_deg=0.0, phi_deg=20.0)
    assert (result.mode, result.state) == ("slump", "unstable")
    assert result.yield_acceleration == -math.inf


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"beta_deg": 90.0}, "beta_deg = 90"),
        ({"beta_deg": -90.0}, "between -90 and 90"),
        ({"beta_deg": math.nan}, "beta_deg = nan"),
        ({"phi_deg": 90.0}, "from 0 to below 90"),
        ({"phi_deg": -1.0}, "phi_deg = -1"),
        ({"phi_deg": "35"}, "phi_deg = '35'"),
        ({"phi_back_deg": 95.0}, "phi_back_deg = 95"),
        ({"kv": -1.0}, "kv = -1"),
        ({"kv": math.inf}, "kv = inf"),
        ({"cohesion_pa": -1.0, "density_kg_m3": 2700.0}, "cohesion_pa = -1"),
        ({"cohesion_pa": 1000.0, "density_kg_m3": 0.0}, "density_kg_m3 = 0"),
        ({"density_kg_m3": math.nan}, "density_kg_m3 = nan"),
    ],
)
def test_bad_input(change: dict[str, Any], word: str) -> None:
    block = Block.from_angles(10.0, 40.0, 1.0)
    with pytest.raises(InputError) as rejected:
        stability(block, **{"beta_deg": 10.0, "phi_deg": 35.0} | change)
    assert word in str(rejected.value)


def test_what_is_no_block() -> None:
    with pytest.raises(InputError, match=r"Block\.rectangle"):
        stability((10.0, 40.0, 1.0), beta_deg=0.0, phi_deg=35.0)  # type: ignore[arg-type]
