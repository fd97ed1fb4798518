"""Blocks that are followed past the end of their mechanism, beside a free block on springs."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.excitation import excitation
from rbfrag.solver.free_motion import Release, free_motion
from rbfrag.solver.integrator.one_freedom.equation import Pose
from rbfrag.solver.kind import SupportedBlock
from rbfrag.solver.respond import respond
from rbfrag.solver.results import Outcome, Response
from tests.on_planes import on_planes
from tests.physics.penalty import Simulated, simulate
from tests.physics.test_against_penalty import DT_S, SLUMPS, Case, half_sines

# after a slide the block tips back, and a later pulse makes it slump
SLIDES = {
    "one pulse": Case(33, 60, 1, 10, 35, 35, ((0.1, 0.4, 0.9),), until=2.4),
    "slump in the second": Case(33, 60, 1, 10, 35, 35, ((0.1, 0.4, 0.9), (1.6, 0.4, 0.9))),
    "stays below friction": Case(25, 60, 1, 10, 35, 35, ((0.1, 0.3, 0.9), (1.4, 0.3, 0.9))),
    "far": Case(25, 60, 1, 10, 35, 35, ((0.1, 0.4, 1.2), (1.4, 0.4, 1.2))),
    "large": Case(34, 74, 3, 20, 40, 40, ((0.1, 0.4, 0.6), (1.2, 0.3, 0.8))),
    "small": Case(34, 70, 0.3, 15, 38, 38, ((0.1, 0.2, 0.9), (0.9, 0.2, 0.9))),
    "smoother back": Case(33, 60, 1, 10, 35, 20, ((0.1, 0.4, 0.8), (1.5, 0.4, 0.8))),
    "rougher back": Case(30, 65, 1, 15, 35, 45, ((0.1, 0.4, 0.9), (1.5, 0.4, 0.9))),
    "level base": Case(20, 55, 1, 0, 28, 28, ((0.1, 0.4, 0.9), (1.5, 0.4, 0.9))),
    "vertical": Case(33, 62, 1, 10, 35, 35, ((0.1, 0.4, 0.8), (1.5, 0.4, 0.8)), ((0.2, 0.2, 0.3),)),
}
LOST = {
    "driven off its back plane": Case(40, 75, 1, 15, 30, 35, ((0.1, 0.3, 1.3),), until=2.4),
    "twice": Case(44, 73, 1, 20, 40, 40, ((0.1, 0.2, 1.3), (1.2, 0.2, 1.3)), until=2.4),
}


def both(case: Case) -> tuple[Response, Simulated]:
    """The answer, and the free block on springs; its contacts take all of an impact but a part."""
    horizontal = half_sines(case.lobes)
    vertical = half_sines(case.vertical) if case.vertical else None
    answer = respond(
        GroundMotion(horizontal, DT_S),
        block=case.block, beta_deg=case.beta, phi_deg=case.phi, phi_back_deg=case.back,
        vertical=None if vertical is None else GroundMotion(vertical, DT_S), history=True,
    )  # fmt: skip
    free_standing = simulate(
        case.block, beta_deg=case.beta, phi_deg=case.phi, phi_back_deg=case.back,
        time_s=np.arange(horizontal.size) * DT_S, k_h=horizontal, k_v=vertical, until_s=2.4,
        damping=0.7,
    )  # fmt: skip
    return answer, free_standing


def first_time(time_s: NDArray[np.float64], holds: NDArray[np.bool_]) -> float:
    """Return the first time at which something holds."""
    return float(time_s[int(np.argmax(holds))])


@pytest.mark.parametrize("name", SLIDES)
def test_a_slide_that_tips_back_and_slumps(name: str) -> None:
    case = SLIDES[name]
    answer, free_standing = both(case)
    assert answer.kind == "sliding"
    assert answer.outcome is Outcome.STABLE
    assert not any("not followed" in text for text in answer.warnings)
    assert free_standing.heel_m[-1] == pytest.approx(answer.displacement_m, rel=0.05)
    assert free_standing.turned_rad[-1] == pytest.approx(answer.final_theta_rad, rel=0.05)
    # at rest on heel and upper back corner: heel and rotation are bound to each other
    gamma = math.radians(case.block.gamma_deg)
    edge_m = case.block.s1_m / math.sin(gamma)
    assert answer.displacement_m is not None
    assert answer.final_theta_rad is not None
    leaning = math.asin(answer.displacement_m * math.sin(gamma) / edge_m)
    assert answer.final_theta_rad == pytest.approx(leaning, rel=1e-3)
    # the block begins to tip, and first leans, when the springs say so
    history = answer.history
    assert history is not None
    for part in (0.02, 0.98):
        least = part * first_rest_rad(answer)
        ours = first_time(history.time_s, history.theta_rad > least)
        theirs = first_time(free_standing.time_s, free_standing.turned_rad > least)
        assert ours == pytest.approx(theirs, abs=0.01)


def first_rest_rad(answer: Response) -> float:
    """Return the rotation at which the block first leans."""
    history = answer.history
    assert history is not None
    still = (history.theta_rad > 1e-4) & (history.theta_dot_rad_s == 0.0)
    return float(history.theta_rad[int(np.argmax(still))])


@pytest.mark.parametrize("name", LOST)
def test_a_slump_that_loses_a_contact(name: str) -> None:
    answer, free_standing = both(LOST[name])
    assert answer.kind == "slumping"
    assert answer.outcome is Outcome.STABLE
    assert answer.mode_changes
    assert free_standing.heel_m[-1] == pytest.approx(answer.displacement_m, rel=0.01)
    assert free_standing.turned_rad[-1] == pytest.approx(answer.final_theta_rad, rel=0.01)


def test_steps_find_the_motion_that_mechanisms_solve_for() -> None:
    # the same block by steps from its first place: no mechanism is known to them
    for name in ("pulse", "two pulses", "vertical", "far", "partly reversed"):
        case = SLUMPS[name]
        motion = GroundMotion(half_sines(case.lobes), DT_S)
        vertical = GroundMotion(half_sines(case.vertical), DT_S) if case.vertical else None
        exact = respond(
            motion, vertical=vertical, block=case.block, beta_deg=case.beta, phi_deg=case.phi,
            phi_back_deg=case.back,
        )  # fmt: skip
        excited = excitation(motion, vertical)
        free_standing = free_motion(
            site_of(case), excited, Release(0.0, Pose(0.0, case.block.centroid, 0.0))
        )
        assert free_standing.outcome is Outcome.STABLE
        assert free_standing.backward_rad == pytest.approx(exact.peak_theta_rad, rel=1e-4)
        assert free_standing.pose.turned_rad == pytest.approx(exact.final_theta_rad, rel=1e-4)
        assert free_standing.slip_m == pytest.approx(exact.peak_displacement_m, rel=1e-4)
        assert free_standing.time_s == pytest.approx(exact.stopped_s, abs=5e-4)
        assert (
            abs(free_standing.backward_rad - exact.peak_theta_rad)
            < 3.0 * free_standing.step_error.rotation_rad + 1e-7
        )


def site_of(case: Case) -> SupportedBlock:
    return on_planes(case.block, case.beta, case.phi, case.back)


def test_free_fall() -> None:
    # above both planes, under no shaking: it falls as bodies do, and comes to rest on its base
    block = Block.rectangle(1.0, 1.0)
    case = Case(-45, 45, block.r3_m, 0, 35, 35, ())
    excited = excitation(GroundMotion(np.zeros(201), DT_S))
    x, y = block.centroid
    start = Release(0.0, Pose(0.0, (x + 0.5, y + 0.2), 0.5))
    free_standing = free_motion(site_of(case), excited, start)
    landed_s = math.sqrt(2.0 * 0.2 / 9.80665)
    assert free_standing.landed_s == pytest.approx(landed_s, abs=1e-3)
    falling = free_standing.history.time_s < landed_s - 1e-3
    height = y + 0.2 - 0.5 * 9.80665 * free_standing.history.time_s[falling] ** 2
    assert free_standing.history.centroid_m[falling, 1] == pytest.approx(height, abs=5e-4)
    assert free_standing.pose.centroid_m == pytest.approx((x + 0.5, y), abs=1e-9)
    assert free_standing.outcome is Outcome.STABLE
