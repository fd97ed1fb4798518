"""Yields after a rotation: against equilibrium of the turned block, and their limits."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from rbfrag.errors import InputError
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.stability.rotated_yield import (
    confined_limit_deg,
    kct_after_rotation,
    kr_after_rotation,
    ks_after_rotation,
)
from rbfrag.solver.stability.single import stability
from tests.physics import equilibrium as statics


def turned(arm: NDArray[np.float64], theta_deg: float) -> NDArray[np.float64]:
    c, s = math.cos(math.radians(theta_deg)), math.sin(math.radians(theta_deg))
    return np.array([c * arm[0] - s * arm[1], s * arm[0] + c * arm[1]])


def turned_case(case: statics.Case, theta_deg: float) -> statics.Case:
    heel, back, toe = (turned(arm, theta_deg) for arm in (case.heel, case.back, case.toe))
    return replace(case, heel=heel, back=back, toe=toe)


def test_slumps_against_equilibrium_of_the_turned_block() -> None:
    random = np.random.default_rng(1)
    for _ in range(300):
        phi, phi_back = random.uniform(5.0, 50.0, 2)
        a1 = random.uniform(phi, 80.0)
        a3 = random.uniform(a1 + 1.0, 86.0)
        beta, kv = random.uniform(-20.0, 30.0), random.uniform(-0.5, 0.5)
        case = statics.parallelogram(a1, a3, 1.7, beta, phi, phi_back, kv)
        block = Block.from_angles(a1, a3, 1.7)
        theta = random.uniform(0.0, 0.99) * block.gamma_deg
        result = ks_after_rotation(
            block, theta, beta_deg=beta, phi_deg=phi, phi_back_deg=phi_back, kv=kv
        )
        r_base, r_back, k = statics.slump(turned_case(case, theta))
        if math.isfinite(result):
            assert r_base > 0.0
            assert r_back > 0.0
            assert result == pytest.approx(k, rel=1e-10, abs=1e-10)
        else:
            assert min(r_base, r_back) <= 0.0


def test_confined_topples_against_equilibrium_of_the_turned_block() -> None:
    random = np.random.default_rng(2)
    finite = 0
    for _ in range(400):
        phi, phi_back = random.uniform(5.0, 60.0, 2)
        a3 = random.uniform(-40.0, phi)
        a1 = random.uniform(-80.0, -abs(a3) - 1.0)
        beta = random.uniform(-20.0, 30.0)
        case = statics.parallelogram(a1, a3, 0.6, beta, phi, phi_back)
        block = Block.from_angles(a1, a3, 0.6)
        theta = random.uniform(0.0, 0.99) * (block.gamma_deg - 90.0)
        result = kct_after_rotation(block, theta, beta_deg=beta, phi_deg=phi, phi_back_deg=phi_back)
        r_base, r_back, k = statics.confined(turned_case(case, -theta))
        if math.isfinite(result):
            finite += 1
            assert r_base > 0.0
            assert r_back > 0.0
            assert result == pytest.approx(k, rel=1e-10, abs=1e-10)
    assert finite > 250


def test_toppling_falls_to_zero_at_balance() -> None:
    block = Block.from_angles(-10.0, 25.0, 1.0)
    thetas = np.array([0.0, 5.0, 15.0, 30.0])
    result = kr_after_rotation(block, thetas, beta_deg=10.0)
    assert result == pytest.approx(np.tan(np.radians(15.0 - thetas)), abs=1e-14)
    assert kr_after_rotation(block, 15.0, beta_deg=10.0) == pytest.approx(0.0, abs=1e-15)
    # more than 90 degrees past balance the tangent itself would be positive again
    slender = Block.from_angles(-1.0, 1.0 + 1e-3, 1.0)
    assert slender.gamma_deg < 90.0
    assert kr_after_rotation(block, 90.0, beta_deg=20.0) < -5.0
    assert kr_after_rotation(block, 97.0, beta_deg=20.0) == -math.inf


def test_at_rest_they_are_the_yields() -> None:
    for a1, a3, function, name in (
        (45.0, 65.0, ks_after_rotation, "ks"),
        (-50.0, 20.0, kct_after_rotation, "kct"),
    ):
        block = Block.from_angles(a1, a3, 2.0)
        planes = {"beta_deg": 7.0, "phi_deg": 35.0, "phi_back_deg": 30.0, "kv": 0.2}
        at_rest = getattr(stability(block, **planes), name)  # type: ignore[arg-type]
        assert function(block, 0.0, **planes) == pytest.approx(at_rest, rel=1e-14)  # type: ignore[operator]


def test_slumps_weaken_as_they_turn() -> None:
    random = np.random.default_rng(3)
    for _ in range(300):
        phi = random.uniform(5.0, 60.0)
        a1 = random.uniform(phi + 0.1, 84.0)
        block = Block.from_angles(a1, random.uniform(a1 + 0.5, 86.0), 1.0)
        thetas = np.linspace(0.0, block.gamma_deg, 30)
        assert (np.diff(ks_after_rotation(block, thetas, beta_deg=0.0, phi_deg=phi)) < 0.0).all()


def test_which_confined_topples_weaken_as_they_turn() -> None:
    # The text says that k_ct always falls. The base's share of the load changes with the sign of
    # sin(γ + φ1 + φ2 - (α3 - α1)), and k with that of sin(γ + φ1 + φ2) besides.
    random = np.random.default_rng(4)
    seen: Counter[str] = Counter()
    for _ in range(1500):
        phi = random.uniform(5.0, 70.0)
        a3 = random.uniform(-70.0, phi)
        block = Block.from_angles(random.uniform(-80.0, -abs(a3) - 1.0), a3, 1.0)
        corner = block.gamma_deg + 2.0 * phi
        wide = 180.0 + block.alpha3_deg - block.alpha1_deg
        if min(abs(corner - 180.0), abs(corner - wide)) < 1.0:
            continue
        thetas = np.linspace(0.0, 0.999 * (block.gamma_deg - 90.0), 30)
        k = kct_after_rotation(block, thetas, beta_deg=0.0, phi_deg=phi)
        if not np.isfinite(k).all():
            continue
        kind = "open" if corner < 180.0 else ("narrow" if corner < wide else "wedge")
        seen[kind] += 1
        assert ((np.diff(k) > 0.0) == (kind == "narrow")).all(), (block, phi)
    assert seen["open"] > 100
    assert seen["narrow"] > 100
    assert seen["wedge"] >= 1


def test_numbers_and_arrays_agree() -> None:
    block = Block.from_angles(45.0, 65.0, 2.0)
    thetas = np.linspace(0.0, block.gamma_deg, 7)
    result = ks_after_rotation(block, thetas, beta_deg=3.0, phi_deg=30.0)
    singles = [ks_after_rotation(block, float(t), beta_deg=3.0, phi_deg=30.0) for t in thetas]
    assert result == pytest.approx(np.array(singles), rel=1e-14)


@pytest.mark.parametrize(
    ("function", "pair", "theta", "word"),
    [
        (ks_after_rotation, (45.0, 65.0), 33.0, "0 to 32.4576"),
        (ks_after_rotation, (45.0, 65.0), -1.0, "theta_deg = -1"),
        (ks_after_rotation, (45.0, 65.0), math.nan, "theta_deg = nan"),
        (ks_after_rotation, (45.0, 65.0), np.array([0.0, 40.0]), "theta_deg = 40"),
        (ks_after_rotation, (45.0, 65.0), np.array([0.0, math.nan]), "theta_deg = nan"),
        (ks_after_rotation, (10.0, 65.0), 1.0, "does not slump"),
        (kct_after_rotation, (-60.0, 20.0), 35.0, "0 to 34.3737"),
        (kct_after_rotation, (-10.0, 20.0), 1.0, "does not topple against"),
        (kct_after_rotation, (-60.0, 40.0), 1.0, "does not topple against"),
    ],
)
def test_limits(function: Any, pair: tuple[float, float], theta: Any, word: str) -> None:
    with pytest.raises(InputError) as rejected:
        function(Block.from_angles(*pair, 1.0), theta, beta_deg=0.0, phi_deg=35.0)
    assert word in str(rejected.value)


def test_limit_of_free_toppling() -> None:
    with pytest.raises(InputError, match="front face meets the base"):
        kr_after_rotation(Block.from_angles(-10.0, 25.0, 1.0), 120.0, beta_deg=0.0)


def test_a_back_plane_that_turns_with_the_block() -> None:
    # Fig. 3.20b of the dissertation: the numbers are its own construction, done by hand
    block = Block.from_angles(45.0, 65.0, 1.0)
    planes = {"beta_deg": 0.0, "phi_deg": 35.0}
    expected = {0.0: (0.618, 0.524, 0.491), 0.5: (0.618, 0.570, 0.580), 1.0: (0.618, 0.622, 0.681)}
    for share, values in expected.items():
        for theta, value in zip((0.0, 20.0, 30.0), values, strict=True):
            result = ks_after_rotation(block, theta, **planes, back_follows=share)
            assert result == pytest.approx(value, abs=1e-3)
    thetas = np.linspace(0.0, block.gamma_deg, 500)
    turning = ks_after_rotation(block, thetas, **planes, back_follows=1.0)
    assert turning.min() == pytest.approx(0.597, abs=1e-3)
    assert thetas[turning.argmin()] == pytest.approx(9.15, abs=0.1)


@pytest.mark.parametrize(
    ("pair", "function", "sense"),
    [((45.0, 65.0), ks_after_rotation, 1.0), ((-60.0, 20.0), kct_after_rotation, -1.0)],
)
def test_a_plane_that_follows_altogether_by_three_equations(
    pair: tuple[float, float], function: Any, sense: float
) -> None:
    # block and back plane turned together: both forces and k from equilibrium
    block, theta, share = Block.from_angles(*pair, 1.0), math.radians(7.0), 1.0
    gamma, phi = math.radians(block.gamma_deg) - sense * share * theta, math.radians(35.0)
    turn = np.array([[math.cos(theta), -sense * math.sin(theta)],
                     [sense * math.sin(theta), math.cos(theta)]])  # fmt: skip
    on_base, on_back = (block.heel, block.back) if sense > 0 else (block.toe, block.heel)
    r1, r2 = turn @ on_base, turn @ on_back
    u1 = np.array([-math.sin(phi), math.cos(phi)])
    u2 = np.array([math.sin(gamma - sense * phi), math.cos(gamma - sense * phi)])
    # R1 u1 + R2 u2 + (k, -1) = 0 and no moment, the base being level
    moments = [r[0] * u[1] - r[1] * u[0] for r, u in ((r1, u1), (r2, u2))]
    *_, k = np.linalg.solve(
        [[u1[0], u2[0], 1.0], [u1[1], u2[1], 0.0], [*moments, 0.0]], [0.0, 1.0, 0.0]
    )
    result = function(block, 7.0, beta_deg=0.0, phi_deg=35.0, back_follows=share)
    assert result == pytest.approx(k, rel=1e-12)


def test_how_far_a_confined_topple_turns_before_its_plane_lets_it_go() -> None:
    block = Block.from_angles(-40.0, 20.0, 1.0)
    free_standing = block.gamma_deg - 90.0
    assert confined_limit_deg(block) == free_standing
    assert confined_limit_deg(block, back_follows=0.5) == pytest.approx(2.0 * free_standing)
    assert confined_limit_deg(block, back_follows=1.0) == 180.0 - block.gamma_deg
    with pytest.raises(InputError, match="from 0 to 1"):
        confined_limit_deg(block, back_follows=-0.1)
