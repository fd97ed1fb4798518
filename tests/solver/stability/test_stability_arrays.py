"""Many blocks at once: the scalar answers to the last bit, and reasons instead of traces."""

from __future__ import annotations

import math

import numpy as np
import pytest

from rbfrag.errors import InputError
from rbfrag.solver.block.arrays import CHUNK, REASONS, BlockArray
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.stability.arrays import stability_arrays
from rbfrag.solver.stability.single import stability


def same(a: float, b: float | None) -> bool:
    return math.isnan(a) if b is None else a == b


@pytest.mark.parametrize("back_fracture", [True, False])
def test_bit_for_bit_the_scalar_answers(back_fracture: bool) -> None:
    random = np.random.default_rng(6)
    n = 3000
    a1, a3 = np.sort(random.uniform(-89.0, 89.0, (2, n)), axis=0)
    phi, phi_back = random.uniform(0.0, 75.0, (2, n))
    a1[::10], a3[1::10], a3[2::10] = phi[::10], phi[1::10], -a1[2::10]
    keep = a1 < a3
    a1, a3, phi, phi_back = a1[keep], a3[keep], phi[keep], phi_back[keep]
    n = a1.size
    r3, beta = random.uniform(0.1, 10.0, n), random.uniform(-40.0, 40.0, n)
    kv = random.uniform(-0.9, 1.0, n)
    blocks = BlockArray.from_angles(a1, a3, r3)
    result = stability_arrays(
        blocks, beta_deg=beta, phi_deg=phi, phi_back_deg=phi_back, kv=kv,
        back_fracture=back_fracture,
    )  # fmt: skip
    assert not result.reason_code.any()
    for i in range(n):
        block = Block.from_angles(a1[i], a3[i], r3[i])
        single = stability(
            block, beta_deg=beta[i], phi_deg=phi[i], phi_back_deg=phi_back[i], kv=kv[i],
            back_fracture=back_fracture,
        )  # fmt: skip
        assert (result.mode[i], result.state[i]) == (single.mode, single.state)
        assert result.yield_acceleration[i] == single.yield_acceleration
        assert result.ky[i] == single.ky
        assert same(result.kr[i], single.kr)
        assert same(result.ks[i], single.ks)
        assert same(result.kct[i], single.kct)
        assert result.p2[i] == block.p2 == blocks.p2[i]
        if i > 200:
            continue
        assert blocks.shape_factor[i] == block.shape_factor
        assert blocks.r1_m[i] == block.r1_m
        assert blocks.gamma_deg[i] == pytest.approx(block.gamma_deg, rel=1e-15)


@pytest.mark.parametrize("back_fracture", [True, False])
def test_bit_for_bit_with_cohesion(back_fracture: bool) -> None:
    random = np.random.default_rng(16)
    n = 3000
    a1, a3 = np.sort(random.uniform(-89.0, 89.0, (2, n)), axis=0)
    phi, phi_back = random.uniform(0.0, 75.0, (2, n))
    r3, beta = random.uniform(0.1, 10.0, n), random.uniform(-40.0, 40.0, n)
    cohesion = 10.0 ** random.uniform(1.0, 6.0, n)
    cohesion[::7] = 0.0
    density, kv = random.uniform(1500.0, 3500.0, n), random.uniform(-0.9, 1.0, n)
    result = stability_arrays(
        BlockArray.from_angles(a1, a3, r3), beta_deg=beta, phi_deg=phi, phi_back_deg=phi_back,
        kv=kv, back_fracture=back_fracture, cohesion_pa=cohesion, density_kg_m3=density,
    )  # fmt: skip
    assert not result.reason_code.any()
    for i in range(n):
        single = stability(
            Block.from_angles(a1[i], a3[i], r3[i]), beta_deg=beta[i], phi_deg=phi[i],
            phi_back_deg=phi_back[i], kv=kv[i], back_fracture=back_fracture,
            cohesion_pa=cohesion[i], density_kg_m3=density[i],
        )  # fmt: skip
        assert (result.mode[i], result.state[i]) == (single.mode, single.state)
        assert result.yield_acceleration[i] == single.yield_acceleration
        assert result.ky[i] == single.ky
        assert result.toe_lifts[i] == any("toe lifts" in text for text in single.warnings)
    if back_fracture:
        assert {*result.mode} == {"slide", "topple", "slump", "confined_topple"}
        assert result.toe_lifts.any()


def test_no_cohesion_leaves_every_bit() -> None:
    random = np.random.default_rng(17)
    a1, a3 = np.sort(random.uniform(-89.0, 89.0, (2, 2000)), axis=0)
    blocks = BlockArray.from_angles(a1, a3, 1.0)
    planes = {"beta_deg": 12.0, "phi_deg": random.uniform(0.0, 75.0, 2000)}
    without = stability_arrays(blocks, **planes)
    none = stability_arrays(blocks, **planes, cohesion_pa=0.0, density_kg_m3=2700.0)
    for name in ("mode_code", "state_code", "yield_acceleration", "ky", "p2", "toe_lifts"):
        assert np.array_equal(getattr(without, name), getattr(none, name), equal_nan=True)


def test_cohesion_that_cannot_be() -> None:
    blocks = BlockArray.from_angles(5.0, 40.0, 1.0)
    planes = {"beta_deg": 0.0, "phi_deg": 35.0, "cohesion_pa": 1e3}
    assumed = stability_arrays(blocks, **planes)
    assert assumed.ky == stability_arrays(blocks, **planes, density_kg_m3=2650.0).ky
    result = stability_arrays(
        blocks, beta_deg=0.0, phi_deg=35.0, cohesion_pa=[-1.0, 1.0, math.inf, 1.0],
        density_kg_m3=[2700.0, 0.0, 2700.0, 2700.0],
    )  # fmt: skip
    assert ["cohesion" in reason for reason in result.reason] == [True, True, True, False]
    assert np.isfinite(result.yield_acceleration).tolist() == [False, False, False, True]


def test_fractures_bit_for_bit() -> None:
    random = np.random.default_rng(7)
    s1, s2 = random.uniform(0.1, 3.0, (2, 500))
    gamma = random.uniform(1.0, 179.0, 500)
    blocks = BlockArray.from_fractures(s1, s2, gamma)
    result = stability_arrays(blocks, beta_deg=10.0, phi_deg=35.0)
    for i in range(500):
        block = Block.from_fractures(s1[i], s2[i], gamma[i])
        single = stability(block, beta_deg=10.0, phi_deg=35.0)
        assert result.yield_acceleration[i] == single.yield_acceleration
        assert result.mode[i] == single.mode
        assert result.p2[i] == block.p2
        assert blocks.alpha1_deg[i] == pytest.approx(block.alpha1_deg, rel=1e-14)


def test_shapes_broadcast() -> None:
    blocks = BlockArray.from_angles(np.array([[-10.0], [5.0]]), np.array([20.0, 40.0, 60.0]), 1.0)
    assert blocks.shape == (2, 3)
    assert blocks.size == 6
    result = stability_arrays(blocks, beta_deg=np.zeros((4, 1, 1)), phi_deg=35.0)
    assert result.mode.shape == (4, 2, 3)
    assert result.p2.shape == (4, 2, 3)
    single = stability_arrays(BlockArray.from_angles(5.0, 40.0, 1.0), beta_deg=0.0, phi_deg=35.0)
    assert single.mode.shape == ()
    assert single.yield_acceleration == result.yield_acceleration[0, 1, 1]
    assert stability_arrays(
        BlockArray.from_angles([], [], []), beta_deg=0.0, phi_deg=35.0
    ).mode.shape == (0,)


def test_pieces_join_without_a_seam() -> None:
    random = np.random.default_rng(8)
    n = 2 * CHUNK + 3
    a1, a3 = np.sort(random.uniform(-80.0, 80.0, (2, n)), axis=0)
    complete = stability_arrays(BlockArray.from_angles(a1, a3, 1.0), beta_deg=5.0, phi_deg=30.0)
    for piece in (slice(0, 7), slice(CHUNK - 3, CHUNK + 3), slice(n - 4, n)):
        part = stability_arrays(
            BlockArray.from_angles(a1[piece], a3[piece], 1.0), beta_deg=5.0, phi_deg=30.0
        )
        assert (part.yield_acceleration == complete.yield_acceleration[piece]).all()
        assert (part.p2 == complete.p2[piece]).all()


def test_what_is_no_block_is_nan_with_its_reason() -> None:
    a1 = [10.0, math.nan, -95.0, 30.0, 20.0, 10.0, 10.0, 10.0]
    a3 = [40.0, 40.0, 40.0, 20.0, 20.0, 40.0, math.inf, 40.0]
    r3 = [1.0, 1.0, 1.0, 1.0, 1.0, 0.0, 1.0, math.nan]
    blocks = BlockArray.from_angles(a1, a3, r3)
    words = ["", "finite", "out of range", "not below", "not below", "length", "finite", "finite"]
    for reason, word in zip(blocks.reason, words, strict=True):
        assert word in reason
        assert bool(reason) == bool(word)
    result = stability_arrays(blocks, beta_deg=0.0, phi_deg=35.0)
    assert result.reason.tolist() == blocks.reason.tolist()
    assert result.mode.tolist() == ["slide"] + [""] * 7
    assert result.state.tolist() == ["stable"] + [""] * 7
    for values in (result.yield_acceleration, result.ky, result.kr, result.p2):
        assert np.isnan(values[1:]).all()
    assert np.isfinite(result.p2[0])


def test_planes_that_cannot_be_have_their_reason() -> None:
    blocks = BlockArray.from_angles(np.full(6, 10.0), 40.0, 1.0)
    result = stability_arrays(
        blocks,
        beta_deg=[0.0, 90.0, 0.0, 0.0, 0.0, math.nan],
        phi_deg=[35.0, 35.0, 90.0, 35.0, 35.0, 35.0],
        phi_back_deg=[35.0, 35.0, 35.0, -1.0, 35.0, 35.0],
        kv=[0.0, 0.0, 0.0, 0.0, -1.0, 0.0],
    )
    words = ["", "beta_deg", "phi_deg", "phi_back_deg", "kv", "beta_deg"]
    for reason, word in zip(result.reason, words, strict=True):
        assert word in reason
    assert result.mode.tolist() == ["slide", "", "", "", "", ""]
    assert np.isnan(result.yield_acceleration[1:]).all()
    for number in ({"beta_deg": 95.0, "phi_deg": 35.0}, {"beta_deg": 0.0, "phi_deg": math.nan}):
        assert (stability_arrays(blocks, **number).mode == "").all()  # type: ignore[arg-type]
    with pytest.raises(InputError, match="element 1: beta_deg"):
        stability_arrays(blocks, beta_deg=[0, 90, 0, 0, 0, 0], phi_deg=35.0, nan="raise")


def test_fractures_that_cut_no_block() -> None:
    blocks = BlockArray.from_fractures([1.0, 0.0, 1.0, 1.0], [1.0, 1.0, -1.0, 1.0], [60, 60, 60, 0])
    assert [bool(reason) for reason in blocks.reason] == [False, True, True, True]
    assert set(blocks.reason) <= set(REASONS)


def test_arguments_that_do_not_go_together() -> None:
    with pytest.raises(InputError, match="shapes of the arrays are not compatible"):
        BlockArray.from_angles([1.0, 2.0], [3.0, 4.0, 5.0], 1.0)
    with pytest.raises(InputError, match="alpha1_deg has an element"):
        BlockArray.from_angles(["a"], [3.0], 1.0)
    with pytest.raises(InputError, match="'ignore'"):
        stability_arrays(
            BlockArray.from_angles(1.0, 2.0, 1.0), beta_deg=0, phi_deg=1, nan="ignore"  # type: ignore[arg-type]
        )  # fmt: skip
