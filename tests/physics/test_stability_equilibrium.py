"""Modes and yields of random blocks against statics that knows none of the formulas."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from rbfrag.errors import InputError
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.stability.single import Stability, stability
from tests.physics import equilibrium as statics

BLOCKS = 2400
UNIQUE_BY = 1e-6  # degrees kept from the borders of non-uniqueness


def random_cases(seed: int, count: int) -> list[statics.Case]:
    """Blocks of all kinds; every sixth kind lies exactly on a boundary between modes."""
    random = np.random.default_rng(seed)
    cases = []
    for i in range(count):
        a1, a3 = np.sort(random.uniform(-80.0, 85.0, 2))
        phi1, phi2 = random.uniform(1.0, 70.0), random.uniform(0.0, 70.0)
        kind = i % 6
        if kind == 1:
            a1, a3 = phi1, random.uniform(phi1 + 1.0, 86.0)
        elif kind == 2:
            a1, a3 = random.uniform(-80.0, phi1 - 1.0), phi1
        elif kind == 3:
            a3 = abs(a3) + 1.0
            a1 = -a3
        elif kind == 4:
            phi2 = phi1
        beta = random.uniform(-30.0, 40.0)
        kv = random.uniform(-0.5, 0.5) if i % 2 else 0.0
        cases.append(
            statics.parallelogram(
                float(a1), float(a3), float(random.uniform(0.2, 5.0)), beta, phi1, phi2, kv
            )
        )
    return cases


def answer(case: statics.Case, **rest: object) -> Stability:
    block = Block.from_angles(case.a1, case.a3, float(np.hypot(*case.toe)))
    return stability(
        block,
        beta_deg=case.beta,
        phi_deg=case.phi1,
        phi_back_deg=case.phi2,
        kv=case.kv,
        **rest,  # type: ignore[arg-type]
    )


def admissible_and_yield(case: statics.Case, mode: str) -> tuple[bool, float]:
    """Return whether the forces of a mode can act and its motion can happen, and k."""
    slack = 1e-9
    if mode == "slide":
        normal, place, k = statics.slide(case)
        inside = case.heel[0] - slack <= place <= case.toe[0] + slack
        return normal > 0.0 and bool(inside), k
    if mode == "topple":
        shear, normal, k = statics.topple(case)
        holds = abs(shear) <= normal * math.tan(math.radians(case.phi1)) * (1.0 + slack)
        # about the toe the heel rises along the base's normal, away from the back plane
        return normal > 0.0 and holds and case.gamma <= 90.0 + slack, k
    if mode == "slump":
        r_base, r_back, k = statics.slump(case)
        return r_base > 0.0 and r_back > -slack, k
    r_base, r_back, k = statics.confined(case)
    return r_base > 0.0 and r_back > -slack and case.gamma > 90.0, k


def close(a: float, b: float) -> bool:
    return abs(a - b) <= 1e-10 * max(1.0, abs(b))


def test_every_mode_is_admissible_and_its_yield_solves_the_equilibrium() -> None:
    seen: Counter[tuple[str, str]] = Counter()
    for case in random_cases(11, BLOCKS):
        document = answer(case)
        seen[document.mode, document.state] += 1
        admissible, k = admissible_and_yield(case, document.mode)
        if math.isfinite(document.yield_acceleration):
            assert admissible, (case, document)
            assert close(document.yield_acceleration, k), (case, document, k)
        else:
            # forces that oppose gravity exist for no horizontal acceleration
            assert not admissible, (case, document)
    for mode in ("slide", "topple", "slump", "confined_topple"):
        assert seen[mode, "stable"] > 50, seen
        assert seen[mode, "unstable"] > 20, seen
    assert seen["confined_topple", "locked"] > 50


def test_sliding_yield_is_given_for_every_mode() -> None:
    for case in random_cases(12, 300):
        document = answer(case)
        if math.isfinite(document.ky):
            _, _, k = statics.slide(case)
            assert close(document.ky, k)


def is_unique(case: statics.Case, mode: str) -> bool:
    """Return whether no wedge and no hang-up can hold the block beyond the mechanism."""
    corner = case.gamma + case.phi1 + case.phi2
    rough_back = case.phi2 > case.phi1 + case.gamma - UNIQUE_BY
    if mode in ("slide", "confined_topple"):
        return corner < 180.0 - UNIQUE_BY and not rough_back
    if mode == "topple":
        return case.gamma + case.phi2 < 90.0 - UNIQUE_BY
    return not rough_back


def test_limit_analysis_finds_the_same_mode_and_yield() -> None:
    agreed: Counter[str] = Counter()
    for case in random_cases(13, BLOCKS):
        document = answer(case)
        if not is_unique(case, document.mode):
            continue
        k = document.yield_acceleration
        limit = statics.limit_of_equilibrium(case)
        if limit is None:
            assert not math.isfinite(k) or abs(k) > 1e3, (case, document)
            continue
        assert math.isfinite(k), (case, document, limit)
        assert close(k, limit.k), (case, document, limit)
        agreed[document.mode] += 1
        # the contacts that carry load name the mode
        tiny = 1e-7
        if document.mode == "topple":
            assert limit.heel < tiny
            assert limit.back_high < tiny
        elif document.mode == "slump":
            assert limit.toe < tiny
            assert limit.back_low < tiny
        elif document.mode == "confined_topple":
            assert limit.heel < tiny
            assert limit.back_high < tiny
        else:
            assert limit.back_low + limit.back_high < tiny
        if document.mode != "topple":
            assert limit.base_shear_left < tiny  # friction of the base is fully used
    assert sum(agreed.values()) > 1000
    assert min(agreed[mode] for mode in ("slide", "slump", "confined_topple")) > 50
    assert agreed["topple"] > 10


def test_limit_analysis_without_a_back_plane() -> None:
    agreed: Counter[str] = Counter()
    for case in random_cases(14, 600):
        document = answer(case, back_fracture=False)
        limit = statics.limit_of_equilibrium(case, back_plane=False)
        stands = case.a1 <= case.beta and case.a1 <= case.phi1
        if not stands:
            # its weight passes upslope of the heel, or it slides
            assert document.state == "unstable" or document.yield_acceleration <= 1e-12, (
                case,
                document,
            )
        elif limit is not None and math.isfinite(document.yield_acceleration):
            assert close(document.yield_acceleration, limit.k), (case, document, limit)
            agreed[document.mode] += 1
        if case.a1 > case.phi1:
            assert document.state == "unstable"
    assert agreed["slide"] > 50
    assert agreed["topple"] > 50


def random_polygon(random: np.random.Generator) -> tuple[Block, statics.Case]:
    """A pentagon on its planes, every other one without the corner at its heel."""
    while True:
        gamma = random.uniform(20.0, 160.0)
        up = np.array([-1.0 / math.tan(math.radians(gamma)), 1.0])
        base, height = random.uniform(0.3, 3.0, 2)
        back = up * height * random.uniform(0.5, 1.0)
        front = np.array([base * random.uniform(0.7, 1.6), height * random.uniform(0.3, 1.0)])
        top = np.array([back[0] + base * random.uniform(0.1, 0.7), max(back[1], front[1]) + 0.2])
        corners = [np.zeros(2), np.array([base, 0.0]), front, top, back]
        low = np.zeros(2)
        if random.random() < 0.5:
            low = back * random.uniform(0.05, 0.3)
            corners[0] = np.array([base * random.uniform(0.05, 0.3), 0.0])
            corners.append(low)
        try:
            block = Block.from_polygon([tuple(c) for c in corners], 0, 4, 1, gamma)
        except InputError:  # edges that cross, or a corner behind the back plane
            continue
        centroid = np.array(block.toe) - corners[1]
        phi1, phi2 = random.uniform(1.0, 60.0), random.uniform(0.0, 60.0)
        case = statics.Case(
            a1=block.alpha1_deg, a3=block.alpha3_deg, gamma=gamma,
            heel=corners[0] + centroid, back=back + centroid, toe=corners[1] + centroid,
            beta=random.uniform(-30.0, 40.0), phi1=phi1, phi2=phi2, low=low + centroid,
        )  # fmt: skip
        return block, case


def test_polygons_whole_and_with_a_broken_heel() -> None:
    random = np.random.default_rng(16)
    agreed: Counter[str] = Counter()
    for _ in range(1200):
        block, case = random_polygon(random)
        result = stability(block, beta_deg=case.beta, phi_deg=case.phi1, phi_back_deg=case.phi2)
        k = result.yield_acceleration
        if result.mode == "confined_topple":
            r_base, r_back, solved = statics.two_contacts(case, case.toe, case.lowest, -1)
            if math.isfinite(k):
                assert min(r_base, r_back) > 0.0
                assert close(k, solved)
        elif result.mode == "slump" and math.isfinite(k):
            r_base, r_back, solved = statics.slump(case)
            assert min(r_base, r_back) > 0.0
            assert close(k, solved)
        limit = statics.limit_of_equilibrium(case)
        if limit is not None and math.isfinite(k) and is_unique(case, result.mode):
            assert close(k, limit.k), (case, result, limit)
            agreed[result.mode] += 1
    assert min(agreed.values()) > 10
    assert len(agreed) == 4


@pytest.mark.parametrize("share", [0.05, 0.4])
def test_cohesion_of_the_base_in_every_mode(share: float) -> None:
    seen: Counter[str] = Counter()
    for case in random_cases(15, 900):
        block = Block.from_angles(case.a1, case.a3, float(np.hypot(*case.toe)))
        density = 2500.0
        cohesion = share * density * 9.80665 * block.s1_m
        document = answer(case, cohesion_pa=cohesion, density_kg_m3=density)
        if not math.isfinite(document.yield_acceleration) or abs(document.yield_acceleration) > 1e3:
            continue
        bonded = replace(case, bond=share)
        if document.mode == "slide":
            normal, place, k = statics.slide(bonded)
            if normal <= 0.0:
                continue
            assert case.heel[0] - 1e-9 <= place <= case.toe[0] + 1e-9
        elif document.mode == "topple":
            shear, normal, k = statics.topple(bonded)
            assert -shear <= normal * math.tan(math.radians(case.phi1)) + share + 1e-9
        elif document.mode == "slump":
            r_base, r_back, k = statics.slump(bonded)
            if r_base <= 0.0:
                continue
            assert r_back > -1e-9
        else:
            r_base, r_back, k = statics.confined(bonded)
            if r_base <= 0.0:
                continue
            assert r_back > -1e-9
        assert close(document.yield_acceleration, k), (case, document, k)
        seen[document.mode] += 1
    assert min(seen.values()) > 20
    assert len(seen) == 4
