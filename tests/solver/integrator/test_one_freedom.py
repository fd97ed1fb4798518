"""The engine for one degree of freedom, and how models are found."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import rbfrag.solver.models
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.excitation import excitation
from rbfrag.solver.integrator.one_freedom.contact_equations import rocking_equation
from rbfrag.solver.integrator.one_freedom.equation import (
    Condition,
    Ending,
    Equation,
    Exit,
    Mechanism,
    Phase,
    Pose,
    constant,
    cosine,
    sine,
    turning,
)
from rbfrag.solver.integrator.one_freedom.follow import MechanismRun, follow
from rbfrag.solver.integrator.one_freedom.step import TURN_MAX
from rbfrag.solver.kinds import KINDS, KindSpec
from rbfrag.solver.models import confined_toppling, sliding, slumping
from rbfrag.solver.respond import respond
from rbfrag.solver.results import Outcome
from rbfrag.solver.toppling_run import respond as topple
from tests.on_planes import on_planes
from tests.synthetic import shaking

DT_S = 0.01


def record(seed: int, amplitude_g: float) -> GroundMotion:
    a = shaking(seed)
    return GroundMotion(amplitude_g * a / np.abs(a).max(), DT_S)


@settings(max_examples=30)
@given(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0), st.floats(-3.0, 3.0), st.floats(-3.0, 3.0))
def test_harmonics_are_the_functions_that_they_stand_for(
    x: float, first: float, two: float, three: float
) -> None:
    product = cosine(first) * sine(two, -1) * (cosine(three, -1) - 2.0)
    value = math.cos(first + x) * math.sin(two - x) * (math.cos(three - x) - 2.0)
    assert product(x) == pytest.approx(value, abs=1e-13)
    slope = (product(x + 1e-6) - product(x - 1e-6)) / 2e-6
    assert product.derivative()(x) == pytest.approx(slope, abs=1e-7)
    arm = turning((first, two), -1)
    turned = complex(first, two) * complex(math.cos(x), -math.sin(x))
    assert (arm.x(x), arm.y(x)) == pytest.approx((turned.real, turned.imag), abs=1e-13)


def test_harmonics_above_the_third_are_rejected() -> None:
    with pytest.raises(ValueError, match="harmonics above 3"):
        cosine() * sine() * cosine() * sine()


def rocking(block: Block, beta_deg: float) -> Mechanism:
    """Free toppling as a mechanism: without friction, seated at zero."""

    def after(exit: Exit) -> Ending:
        return Ending(Outcome.TOPPLED)

    equation = rocking_equation(block, math.radians(beta_deg))
    return Mechanism(
        first=Phase(
            name="rocks",
            forward=equation,
            reverse=equation,
            pose=lambda x: Pose(-x, (0.0, 0.0), 0.0),
            after=after,
            highest=0.5 * math.pi,
        ),
        rotates=True,
        critical=None,
    )


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("scale", [0.5, 1.2, 2.0])
def test_the_engine_as_a_toppling_block(seed: int, scale: float) -> None:
    block = Block.from_angles(-15.0, 18.0, 0.8)
    beta = 4.0
    kr = math.tan(math.radians(14.0))
    motion = record(seed, scale * kr)
    ours = follow(rocking(block, beta), excitation(motion))
    theirs = topple(motion, p2=block.p2, kr=kr)
    assert (ours.outcome is Outcome.TOPPLED) == (theirs.outcome is Outcome.TOPPLED)
    assert (ours.started_s is None) == (theirs.started_s is None)
    if theirs.peak_theta_rad is not None:
        assert ours.peak == pytest.approx(
            theirs.peak_theta_rad, abs=ours.error + theirs.error_estimate + 1e-15
        )


MECHANISMS = {
    "slump": slumping.MODEL.mechanism(on_planes(Block.from_angles(45, 65, 2.0), 12, 35, 30)),
    "small slump": slumping.MODEL.mechanism(on_planes(Block.from_angles(40, 75, 0.2), 15, 30, 35)),
    "confined": confined_toppling.MODEL.mechanism(
        on_planes(Block.from_angles(-60, 20, 1.0), 15, 35, 35)
    ),
}


@pytest.mark.parametrize("name", MECHANISMS)
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_error_estimate_covers_the_error(name: str, seed: int) -> None:
    excited = excitation(record(seed, 0.8))
    usual = follow(MECHANISMS[name], excited)
    fine = follow(MECHANISMS[name], excited, turn_max=TURN_MAX / 30.0)
    assert usual.started_s is not None
    assert usual.outcome is fine.outcome
    assert usual.steps < fine.steps
    assert abs(usual.peak - fine.peak) <= usual.error + fine.error
    assert usual.error < 1e-10


def test_the_history_changes_nothing() -> None:
    excited = excitation(record(1, 0.8))
    for mechanism in (*MECHANISMS.values(), TWO_WAY):
        with_history = follow(mechanism, excited, history=True)
        without = follow(mechanism, excited)
        assert with_history.history is not None
        assert without_history(with_history) == without_history(without)


def without_history(run: MechanismRun) -> list[object]:
    plain = replace(run, history=None)
    names = [name for name in plain.__dataclass_fields__ if name != "phase"]
    return [run.phase.name, *(getattr(plain, name) for name in names)]


TWO_WAY = sliding.MODEL.mechanism(
    on_planes(Block.from_angles(10, 60, 1.0), 12, 30, 30, two_way=True)
)


@pytest.mark.parametrize("calm", [1, 15, 16, 17, 200])
def test_calm_stretches_are_passed_over(calm: int) -> None:
    # shaking below every threshold, of a length that does and does not fill blocks of nodes
    pieces = [np.array(record(seed, 0.9).acceleration_g[100:400]) for seed in (1, 2)]
    for samples in pieces:
        samples[[0, -1]] = 0.0
    rest = 0.1 * np.sin(np.arange(calm))
    for mechanism in (*MECHANISMS.values(), TWO_WAY):
        short, long = (
            follow(mechanism, excitation(GroundMotion(np.concatenate(parts), DT_S)))
            for parts in (
                [pieces[0], np.zeros(200), pieces[1]],
                [rest, pieces[0], np.zeros(200), rest, pieces[1], rest],
            )
        )
        assert short.started_s is not None
        assert (long.peak, long.x, long.outcome) == (short.peak, short.x, short.outcome)
        assert long.samples_moved == short.samples_moved
        assert long.started_s == pytest.approx(short.started_s + calm * DT_S, abs=1e-9)


def test_limits_and_contacts_are_met_in_the_same_place_by_long_and_short_steps() -> None:
    # an equation that is the same everywhere, and one that is all but the same
    excited = excitation(record(3, 0.8))

    def run(wobble: float, highest: float, lift: float) -> MechanismRun:
        equation = Equation(
            inertia=constant(1.0),
            driving=constant(9.0) + cosine() * wobble,
            resistance=constant(1.5),
            conditions=(
                Condition(constant(-lift), constant(0.3), constant(-0.004),
                          Outcome.CONTACT_LOST, "it lifts"),
            ),
        )  # fmt: skip
        phase = Phase(
            name="moves",
            forward=equation,
            reverse=None,
            pose=lambda x: Pose(0.0, (x, 0.0), x),
            after=lambda exit: Ending(Outcome.TOPPLED),
            highest=highest,
        )
        return follow(Mechanism(first=phase, rotates=False, critical=None), excited)

    outcomes = set()
    for highest, lift in itertools.product((0.01, 0.1, 0.5, math.inf), (0.2, 0.5, 1.0)):
        plain, other = run(0.0, highest, lift), run(1e-14, highest, lift)
        assert plain.outcome is other.outcome
        assert plain.ended_s == pytest.approx(other.ended_s, abs=1e-7)
        assert plain.peak == pytest.approx(other.peak, rel=1e-8)
        assert plain.samples_moved == other.samples_moved
        outcomes.add(plain.outcome)
    assert outcomes == {Outcome.TOPPLED, Outcome.CONTACT_LOST, Outcome.STABLE}


def test_a_scaled_time_axis_and_size_give_the_same_rotation() -> None:
    # lengths times four are times times two
    a = shaking(4)
    a = 0.8 * a / np.abs(a).max()
    answers = [
        respond(
            GroundMotion(a, dt),
            block=Block.from_angles(45, 65, size),
            beta_deg=8.0,
            phi_deg=35.0,
        )
        for dt, size in ((0.01, 1.0), (0.02, 4.0))
    ]
    small, large = answers
    assert small.peak_theta_rad is not None
    assert small.peak_theta_rad > 1e-3
    assert large.peak_theta_rad == pytest.approx(small.peak_theta_rad, rel=1e-11)
    assert small.displacement_m is not None
    assert large.displacement_m == pytest.approx(4.0 * small.displacement_m, rel=1e-11)


def test_thrown_off_by_the_vertical_motion() -> None:
    up = GroundMotion(np.array([0.0, 0.0, -2.0, 0.0]), 0.1)
    motion = GroundMotion(np.array([0.0, 0.9, 0.9, 0.0]), 0.1)
    answer = respond(
        motion, block=Block.from_angles(45, 65, 1.0), beta_deg=0.0, phi_deg=35.0, vertical=up
    )
    assert answer.outcome is Outcome.JUMP
    assert answer.stopped_s == pytest.approx(0.15, rel=1e-12)


def test_painleve() -> None:
    # an overhanging toe: the inertia of the rigid problem is negative
    block = Block.from_angles(-70.0, -65.0, 1.0)
    equation = confined_toppling.equation(on_planes(block, 10.0, 15.0, 15.0))
    assert equation.inertia(0.0) < 0.0
    k = equation.threshold(0.0)
    motion = GroundMotion.from_nodes([0.0, 1.0, 2.0], [0.0, 2.0 * k, 0.0])
    answer = respond(motion, block=block, beta_deg=10.0, phi_deg=15.0)
    assert answer.outcome is Outcome.INDETERMINATE
    assert answer.started_s == pytest.approx(0.5, rel=1e-9)
    assert any("Painlev" in warning for warning in answer.warnings)
    calm = respond(motion.scaled(0.4), block=block, beta_deg=10.0, phi_deg=15.0)
    assert calm.outcome is Outcome.STABLE
    assert calm.started_s is None


def test_an_end_nearer_to_the_limit_than_the_error_is_open() -> None:
    # a pulse and a limit that the block reaches but for rounding, a little more, a little less
    equation = Equation(inertia=constant(1.0), driving=constant(3.0), resistance=constant(0.7))
    excited = excitation(
        GroundMotion.from_nodes([0.0, 0.0, 0.3, 0.3, 9.0], [0.0, 0.6, 0.6, 0.0, 0.0])
    )
    reach = 0.5 * 1.1 * 0.3**2 + (1.1 * 0.3) ** 2 / (2.0 * 0.7)

    def run(limit: float) -> Outcome:
        phase = Phase(
            name="moves",
            forward=equation,
            pose=lambda x: Pose(0.0, (x, 0.0), x),
            after=lambda exit: Ending(Outcome.TOPPLED),
            highest=limit,
        )
        return follow(Mechanism(first=phase, rotates=False, critical=None), excited).outcome

    assert run(reach * (1.0 + 1e-9)) is Outcome.STABLE
    assert run(reach * (1.0 - 1e-9)) is Outcome.TOPPLED
    assert run(reach) is Outcome.UNDETERMINED


FIFTH = '''
"""A block on a belt: a model of a test."""
from rbfrag.solver.integrator.one_freedom.equation import Ending, Equation, Mechanism, Phase, Pose
from rbfrag.solver.integrator.one_freedom.equation import constant
from rbfrag.solver.simulation import MechanismKind
from rbfrag.solver.results import Outcome


def mechanism(site):
    equation = Equation(inertia=constant(2.0), driving=constant(9.80665), resistance=constant(0.5))
    return Mechanism(
        first=Phase("moves", equation, lambda x: Pose(0.0, (x, 0.0), x),
                    lambda exit: Ending(Outcome.TOPPLED, "it has left the belt"), highest=0.01),
        rotates=False,
        critical=None,
    )


class Belt(MechanismKind):
    def mechanism(self, site):
        return mechanism(site)


MODEL = Belt.named("belt")
'''


def test_a_fifth_model_is_a_line_of_facts_and_a_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "belt.py").write_text(FIFTH)
    monkeypatch.setitem(KINDS, "belt", KindSpec("belt", "slide"))
    path = [*rbfrag.solver.models.__path__, str(tmp_path)]
    monkeypatch.setattr(rbfrag.solver.models, "__path__", path)
    motion = GroundMotion.from_nodes([0.0, 1.0, 3.0], [0.0, 0.5, 0.0])
    block = Block.from_fractures(1.0, 2.0, 60.0)
    answer = respond(motion, block=block, beta_deg=20.0, phi_deg=30.0, kind="belt")
    assert answer.kind == "belt"
    assert answer.outcome is Outcome.TOPPLED
    assert answer.warnings[-1] == "it has left the belt"


def test_equations_that_are_the_same_everywhere_are_solved_exactly() -> None:
    equation = Equation(inertia=constant(1.0), driving=constant(2.0), resistance=constant(1.0))
    assert equation.uniform
    assert not rocking_equation(Block.from_angles(-15, 18, 1.0), 0.0).uniform


def test_a_scaled_excitation_scales_the_ground_and_not_gravity() -> None:
    excited = excitation(record(1, 0.5), record(2, 0.3))
    half = excited.scaled(0.5)
    assert half.k_h == pytest.approx(0.5 * excited.k_h, rel=1e-15)
    assert half.w - 1.0 == pytest.approx(0.5 * (excited.w - 1.0), abs=1e-15)
    assert half.pga_g == 0.5 * excited.pga_g
    # the same numbers as of the motion times one half
    motion = excitation(record(1, 0.5).scaled(0.5), record(2, 0.3).scaled(0.5))
    assert half.q == pytest.approx(motion.q, rel=1e-14)
    same = excited.scaled(1.0)
    assert np.array_equal(same.w, excited.w)
