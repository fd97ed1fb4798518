"""Water in the back fracture and roughness of the base: printed oracles, and equilibrium itself."""

from __future__ import annotations

import math

import numpy as np
import pytest

import rbfrag
from rbfrag import Block, BlockArray, InputError, stability, stability_arrays

RHO, G, WATER = 2650.0, 9.80665, 9810.0


def wet(s1: float, s2: float, gamma: float, beta: float, phi: float, z: float):  # type: ignore[no-untyped-def]
    block = Block.from_fractures(s1, s2, gamma)
    return stability(block, beta_deg=beta, phi_deg=phi, water_m=z, density_kg_m3=RHO)


def top_m(s1: float, gamma: float, beta: float) -> float:
    return s1 * math.sin(math.radians(beta + gamma)) / math.sin(math.radians(gamma))


@pytest.mark.parametrize(
    ("planes", "share", "mode", "k"),
    [
        ((2.0, 3.0, 60.0, 20.0, 38.0), 0.0, "slide", 0.32492),
        ((2.0, 3.0, 60.0, 20.0, 38.0), 0.5, "slide", 0.21820),
        ((3.0, 0.8, 80.0, 5.0, 35.0), 0.0, "topple", 0.34608),
        ((3.0, 0.8, 80.0, 5.0, 35.0), 0.5, "topple", 0.23800),
        ((3.0, 0.8, 80.0, 5.0, 35.0), 1.0, "slide", -0.298),
        ((2.0, 0.5, 35.0, 5.0, 28.0), 0.0, "slump", 0.30997),
        ((2.0, 0.5, 35.0, 5.0, 28.0), 0.5, "slump", 0.00260),
    ],
)
def test_printed_yields(
    planes: tuple[float, float, float, float, float], share: float, mode: str, k: float
) -> None:
    s1, _, gamma, beta, _ = planes
    answer = wet(*planes, share * top_m(s1, gamma, beta))
    assert answer.mode == mode
    assert answer.yield_acceleration == pytest.approx(k, abs=6e-6 if k > -0.1 else 5e-4)
    assert answer.state == ("unstable" if k < 0.0 else "stable")


def test_a_block_that_floats_and_a_fracture_that_spills_are_rejected() -> None:
    top = top_m(2.0, 35.0, 5.0)
    with pytest.raises(InputError, match="floats"):
        wet(2.0, 0.5, 35.0, 5.0, 28.0, top)
    with pytest.raises(InputError, match="above the top"):
        wet(2.0, 0.5, 35.0, 5.0, 28.0, 1.01 * top)


def reactions(block: Block, mode: str, beta: float, phi: float, z: float, k: float):  # type: ignore[no-untyped-def]
    """Sums of forces and moments with the reactions of a mode: the residual and its reactions."""
    gamma = math.radians(block.gamma_deg)
    b, f = math.radians(beta), math.radians(phi)
    weight = RHO * G * block.area_m2
    heel, toe, base = np.array(block.heel), np.array(block.toe), block.base_m
    wetted = z / math.sin(b + gamma)
    loads = [
        (np.zeros(2), weight * np.array([math.sin(b) + k * math.cos(b),
                                         -math.cos(b) + k * math.sin(b)])),
        (heel + wetted / 3.0 * np.array([-math.cos(gamma), math.sin(gamma)]),
         0.5 * WATER * z * wetted * np.array([math.sin(gamma), math.cos(gamma)])),
        (heel + np.array([base / 3.0, 0.0]), 0.5 * WATER * z * base * np.array([0.0, 1.0])),
    ]  # fmt: skip
    base_at, back_at, sign = {
        "slump": (heel, np.array(block.back), -1.0),
        "confined_topple": (toe, heel, 1.0),
    }[mode]
    held = [
        (base_at, np.array([-math.sin(f), math.cos(f)])),
        (back_at, np.array([math.sin(gamma + sign * f), math.cos(gamma + sign * f)])),
    ]
    moment = [at[0] * force[1] - at[1] * force[0] for at, force in loads]
    # unknown: both reactions and the horizontal acceleration, of which k is left out
    push = weight * np.array([math.cos(b), math.sin(b)])
    matrix = np.array([
        [held[0][1][0], held[1][1][0], push[0]],
        [held[0][1][1], held[1][1][1], push[1]],
        [*(at[0] * u[1] - at[1] * u[0] for at, u in held), 0.0],
    ])  # fmt: skip
    total = np.array([*np.sum([force for _, force in loads], axis=0), sum(moment)])
    return np.linalg.solve(matrix, -total)


def test_slumps_and_confined_topples_are_in_equilibrium() -> None:
    rng = np.random.default_rng(3)
    seen = {"slump": 0, "confined_topple": 0}
    for _ in range(4000):
        s1, s2 = rng.uniform(0.5, 4.0, 2)
        gamma, beta, phi = rng.uniform(20.0, 150.0), rng.uniform(-10.0, 25.0), rng.uniform(20, 50)
        if not 5.0 < gamma + beta < 175.0:
            continue
        z = rng.uniform(0.0, 0.8) * top_m(s1, gamma, beta)
        try:
            answer = wet(s1, s2, gamma, beta, phi, z)
        except InputError:
            continue
        if answer.mode not in seen or not math.isfinite(answer.yield_acceleration):
            continue
        block = Block.from_fractures(s1, s2, gamma)
        k = answer.yield_acceleration
        base, back, rest = reactions(block, answer.mode, beta, phi, z, 0.0)
        assert rest == pytest.approx(k, abs=1e-9 * (1.0 + abs(k)))
        assert base > 0.0
        if answer.state == "stable":
            assert back > -1e-9 * base
            seen[answer.mode] += 1
    assert min(seen.values()) > 50


def test_a_base_slides_with_its_reaction_where_the_mode_says() -> None:
    """The mode is where the normal force of the sliding base is: behind the heel a slump."""
    rng = np.random.default_rng(5)
    for _ in range(500):
        s1, s2 = rng.uniform(0.5, 4.0, 2)
        gamma, beta, phi = rng.uniform(30, 120), rng.uniform(0, 25.0), rng.uniform(25, 50)
        z = 0.5 * top_m(s1, gamma, beta)
        try:
            answer = wet(s1, s2, gamma, beta, phi, z)
        except InputError:
            continue
        block = Block.from_fractures(s1, s2, gamma)
        b, g, f = (math.radians(x) for x in (beta, gamma, phi))
        weight, wetted = RHO * G * block.area_m2, z / math.sin(b + g)
        v, u = 0.5 * WATER * z * wetted, 0.5 * WATER * z * block.base_m
        ky = math.tan(f - b) - (u * math.sin(f) + v * math.sin(g + f)) / weight / math.cos(f - b)
        assert answer.ky == pytest.approx(ky, abs=1e-12)
        normal = weight * (math.cos(b) - ky * math.sin(b)) - u - v * math.cos(g)
        arm = block.centroid  # from the heel
        moment = weight * (arm[0] * (math.cos(b) - ky * math.sin(b))
                           + arm[1] * (math.sin(b) + ky * math.cos(b)))  # fmt: skip
        moment += v * wetted / 3.0 - u * block.base_m / 3.0
        place = moment / normal
        mode = "slump" if place < 0.0 else "slide" if place <= block.base_m else "topple"
        if mode == "topple" and gamma > 90.0:
            mode = "confined_topple"
        assert answer.mode == mode


def test_roughness_at_the_stress_of_the_yield() -> None:
    block = Block.rectangle(1.5, 2.0)
    answer = stability(block, beta_deg=30.0, phi_deg=28.0, jrc=8.0, jcs_mpa=60.0, density_kg_m3=RHO)
    joint = answer.joint
    assert joint is not None
    assert joint.jrc == pytest.approx(4.954, rel=2e-4)
    assert joint.jcs_mpa == pytest.approx(29.24, rel=2e-4)
    assert joint.secant_deg == pytest.approx(42.855, rel=2e-4)
    assert joint.tangent_deg == pytest.approx(40.627, rel=2e-4)
    assert joint.intercept_pa == pytest.approx(2048.0, rel=2e-4)
    assert answer.ky == pytest.approx(0.22821, rel=2e-4)
    # the law at the stress that the yield itself leaves on the base
    normal = RHO * G * 1.5 * (math.cos(math.radians(30.0)) - answer.ky * 0.5)
    assert joint.normal_stress_pa == pytest.approx(normal, rel=1e-9)
    law = 28.0 + joint.jrc * math.log10(joint.jcs_mpa * 1e6 / normal)
    assert joint.secant_deg == pytest.approx(law, abs=1e-9)


def test_many_answer_as_one() -> None:
    rng = np.random.default_rng(8)
    n = 300
    s1, s2 = rng.uniform(0.5, 4.0, (2, n))
    gamma, beta, phi = rng.uniform(30, 130, n), rng.uniform(0, 25, n), rng.uniform(20, 45, n)
    z = rng.uniform(0.0, 1.0, n) * s1
    jrc, jcs = rng.uniform(0.0, 15.0, n), rng.uniform(20, 150, n)
    many = stability_arrays(
        BlockArray.from_fractures(s1, s2, gamma), beta_deg=beta, phi_deg=phi, water_m=z, jrc=jrc,
        jcs_mpa=jcs, density_kg_m3=RHO,
    )  # fmt: skip
    answered = 0
    for i in range(n):
        try:
            single = stability(
                Block.from_fractures(s1[i], s2[i], gamma[i]), beta_deg=beta[i], phi_deg=phi[i],
                phi_back_deg=phi[i], water_m=z[i], jrc=jrc[i], jcs_mpa=jcs[i], density_kg_m3=RHO,
            )  # fmt: skip
        except InputError:
            assert many.reason[i]
            continue
        answered += 1
        assert many.mode[i] == single.mode
        assert many.yield_acceleration[i] == pytest.approx(single.yield_acceleration, rel=1e-9)
    assert answered > 100


SHAPE = {"s1_m": 2.0, "s2_m": 3.0, "gamma_deg": 60.0, "beta_deg": 20.0, "phi_deg": 38.0}


def test_roughness_has_no_probability_unless_a_residual_angle_is_given() -> None:
    inputs = {**SHAPE, "displacement_m": 0.05, "pgv_m_s": 0.6}
    rough = {"jrc": 8.0, "jcs_mpa": 60.0, "density_kg_m3": RHO}
    with pytest.raises(InputError, match="roughness ends with the first slip"):
        rbfrag.predict(**inputs, **rough)
    remaining = rbfrag.predict(**inputs, **rough, phi_residual_deg=30.0)
    smooth = rbfrag.predict(**{**inputs, "phi_deg": 30.0})
    assert remaining.probability == smooth.probability
    assert any("phi_residual_deg" in text for text in remaining.warnings)
    with pytest.raises(InputError, match="does not stand"):
        rbfrag.predict(**inputs, **rough, phi_residual_deg=15.0)


def test_roughness_is_not_followed_in_time_before_the_first_slip() -> None:
    block = Block.from_fractures(2.0, 3.0, 60.0)
    on = {"block": block, "beta_deg": 20.0, "phi_deg": 38.0, "density_kg_m3": RHO}
    motion = rbfrag.GroundMotion(np.array([0.0, 0.6, 0.0]), 0.2)
    with pytest.raises(InputError, match=r"jrc cannot be combined with .* history of sliding"):
        rbfrag.respond(motion, **on, jrc=8.0, jcs_mpa=60.0)
    rough = {"jrc": 8.0, "jcs_mpa": 60.0}
    remaining = rbfrag.respond(motion, **on, **rough, water_m=1.1372, phi_residual_deg=30.0)
    smooth = rbfrag.respond(motion, **{**on, "phi_deg": 30.0}, water_m=1.1372)
    assert remaining.displacement_m == smooth.displacement_m
    assert smooth.displacement_m is not None
    assert any("after its first slip" in text for text in remaining.warnings)
    with pytest.raises(InputError, match="does not stand on phi_residual_deg"):
        rbfrag.respond(motion, **on, **rough, water_m=1.1372, phi_residual_deg=15.0)
    with pytest.raises(InputError, match="water_m cannot be combined with p2 and kr"):
        rbfrag.respond(motion, p2=3.0, kr=0.2, water_m=1.0)
    # a topple turns about its toe whatever the roughness of its base
    slender = {"block": Block.rectangle(4.0, 1.0), "beta_deg": 0.0, "phi_deg": 30.0}
    rough = {"jrc": 8.0, "jcs_mpa": 60.0, "density_kg_m3": RHO}
    assert (
        rbfrag.respond(motion, **slender, **rough).peak_theta_rad
        == rbfrag.respond(motion, **slender).peak_theta_rad
    )
