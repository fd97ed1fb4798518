"""The error that is told after a lost contact, beside a free block on springs."""

from __future__ import annotations

import math

import numpy as np
import pytest

from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.excitation import excitation
from rbfrag.solver.free_motion import OTHER_LAWS, FreeMotion, Release, free_motion
from rbfrag.solver.integrator.one_freedom.equation import Pose
from rbfrag.solver.respond import respond
from rbfrag.solver.results import Outcome
from tests.on_planes import on_planes
from tests.physics.lost_contacts import ELASTIC_M, SORTS, LostContact, of_each_sort
from tests.physics.penalty import STIFFNESS

COUNTS = dict(zip(SORTS, (12, 7, 6, 5), strict=True))
COVERED_LEAST = 27

G = 9.80665


@pytest.fixture(scope="module")
def paths() -> list[LostContact]:
    return of_each_sort(30, COUNTS)


def test_the_springs_are_as_stiff_as_need_be(paths: list[LostContact]) -> None:
    for item in paths[::5]:
        hard, harder = (
            np.array(item.differences(item.on_springs(factor * STIFFNESS))) for factor in (1.0, 6.0)
        )
        apart = float(np.abs(harder - hard).max())
        assert apart < 2e-3 * item.greatest + ELASTIC_M
        assert item.answer.error_estimate is not None
        assert apart < 0.2 * item.answer.error_estimate + ELASTIC_M


def test_the_estimate_covers_the_error_after_a_lost_contact(paths: list[LostContact]) -> None:
    covered = by_a_hundredth = 0
    for path in paths:
        error = path.answer.error_estimate
        if error is None:  # whether it fails is open
            continue
        springs = path.on_springs()
        covered += path.is_covered(springs, error)
        by_a_hundredth += path.is_covered(springs, 0.01 * error)
    assert len(paths) == sum(COUNTS.values()) == 30
    assert covered >= COVERED_LEAST
    # an estimate that is never needed would cover as many
    assert by_a_hundredth < 0.5 * len(paths)


def test_the_error_goes_on_into_the_next_motion(paths: list[LostContact]) -> None:
    separate = next(path for path in paths if path.sort == SORTS[2])
    assert separate.answer.error_estimate is not None
    assert separate.answer.state is not None
    assert separate.answer.state.error == separate.answer.error_estimate
    planes = {
        "beta_deg": separate.beta_deg,
        "phi_deg": separate.phi_deg,
        "phi_back_deg": separate.phi_back_deg,
    }
    both = respond([separate.motion, separate.motion], block=separate.block, **planes)
    second = both.parts[1].response
    assert second.error_estimate is not None
    assert second.error_estimate > separate.answer.error_estimate
    assert both.error_estimate == second.error_estimate


def slides_on(height_m: float, vx: float, *, friction: float) -> FreeMotion:
    """A cube that falls on the whole of a level base while it moves along it."""
    block = Block.rectangle(1.0, 1.0)
    phi_deg = math.degrees(math.atan(friction))
    x, y = block.centroid
    release = Release(0.0, Pose(0.0, (x + 1.0, y + height_m), 1.0), (vx, 0.0))
    excited = excitation(GroundMotion(np.zeros(401), 0.005))
    return free_motion(on_planes(block, 0.0, phi_deg, phi_deg), excited, release)


def slid_m(height_m: float, vx: float, friction: float, law: tuple[float, float]) -> float:
    """Where it stops: an impact takes friction times (1 + restitution) of the speed along it."""
    restitution, mobilised = law
    down, time_s = math.sqrt(2.0 * G * height_m), math.sqrt(2.0 * height_m / G)
    x = 1.0 + vx * time_s
    while down > 1e-3:
        vx -= min(vx, mobilised * friction * (1.0 + restitution) * down)
        down *= restitution
        x += vx * 2.0 * down / G
    return x + vx * vx / (2.0 * friction * G)


def test_the_error_is_what_other_laws_make_of_a_fall() -> None:
    # light friction, so that the cube does not tip as it stops
    height_m, vx, friction = 0.02, 0.5, 0.1
    free_standing = slides_on(height_m, vx, friction=friction)
    rigid = slid_m(height_m, vx, friction, (0.0, 1.0))
    assert free_standing.outcome is Outcome.STABLE
    assert free_standing.slip_m == pytest.approx(rigid, rel=1e-3)
    rest = [slid_m(height_m, vx, friction, law) for law in OTHER_LAWS]
    apart = max(abs(other - rigid) for other in rest)
    assert free_standing.error is not None
    assert free_standing.error.displacement_m == pytest.approx(apart, rel=0.05)
    assert free_standing.step_error.displacement_m < 0.02 * apart
