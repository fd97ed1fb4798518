"""The observed order of the Taylor step is its degree, within 0.3."""

from __future__ import annotations

import math

import numpy as np
import pytest

from benchmarks.extended.toppling import Truth, truth
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.solver.excitation import Excitation, excitation
from rbfrag.solver.integrator.taylor import ORDER
from rbfrag.solver.toppling_run import respond, simulate

END_S = 2.0

Problem = tuple[Excitation, float, Truth]


@pytest.fixture(scope="module")
def problems() -> list[Problem]:
    """Two dozen blocks thrown up by a jump, under a straight k_h and a straight gravity.

    Chosen so that nothing but the step can err. The motion starts at a node and the steps are
    of one length, so no step is cut by an event. The block is still rising when the record
    ends, so its peak is a closed form of the state there and not a root inside a step, where
    the polynomial is less accurate than at its end. None is close to toppling, where the error
    of a coarse step would decide. With one problem alone the leading term of its error may
    happen to be small (its sign changes with the problem, and from rest under a constant k_h
    every other coefficient vanishes): hence the root mean square over many.
    """
    rng = np.random.default_rng(0)
    values: list[Problem] = []
    while len(values) < 24:
        kr = rng.uniform(0.1, 0.5)
        pull = GroundMotion.from_nodes(
            [0.0, 0.0, END_S], [0.0, kr + rng.uniform(0.1, 0.6), rng.uniform(-0.6, 0.2)]
        )
        lift = GroundMotion.from_nodes([0.0, 0.0, END_S], [0.0, *rng.uniform(-0.3, 0.3, 2)])
        run = respond(pull, vertical=lift, p2=1.0, kr=kr, history=True)
        if run.peak_theta_n is None or run.peak_theta_n > 0.9 or run.history is None:
            continue
        rising = np.interp(END_S, run.history.time_s, run.history.theta_dot_rad_s)
        if rising > 0.02:
            excited = excitation(pull, lift)
            values.append((excited, kr, truth(excited, p2=1.0, kr=kr)))
    return values


def error(problems: list[Problem], order: int, steps: int) -> float:
    """Root mean square of the relative errors of the peaks."""
    squares = []
    for excited, kr, true in problems:
        run = simulate(excited, p2=1.0, kr=kr, order=order, ph_max=END_S / steps)
        squares.append((((run.peak_rad - true.peak_rad) - true.peak_low_rad) / true.peak_rad) ** 2)
    return math.sqrt(sum(squares) / len(squares))


@pytest.mark.parametrize("order", [4, 5, 6, ORDER])
def test_observed_order(problems: list[Problem], order: int) -> None:
    coarse, fine = error(problems, order, 12), error(problems, order, 24)
    # rounding has no say yet
    assert fine > 1e-13
    assert math.log2(coarse / fine) == pytest.approx(order, abs=0.3)
