"""One step of a rotating block, and its effect on the error of the motion."""

from __future__ import annotations

from typing import NamedTuple

from rbfrag.solver.integrator.compiled import within
from rbfrag.solver.integrator.state import State, StepExcitation
from rbfrag.solver.integrator.taylor import MACHINE_EPSILON, taylor_step, turn
from rbfrag.solver.results import FloatArray


@within
def exponential_bound(x: float) -> float:
    """Upper bound of exp(x) for 0 <= x <= 1, close for the small x of one step."""
    return 1.0 + x * (1.0 + x * (0.5 + x * (1.0 / 6.0 + x * 0.06)))


@within
def step_errors(
    order: int,
    ph: float,
    state: State,
    shaking: StepExcitation,
    turned: float,
    highest: tuple[float, float, float, float],
) -> tuple[float, float, float]:
    """Return the growth of the initial error over one step, and the error that the step adds.

    At order 8 truncation and rounding together were no less than what the step adds to
    |error of theta| + |error of theta'/p| in all of a million drawn steps; this is measured, not
    proven. A series of lower order may end before the first terms in theta³: there it is a guess.

    Args:
        order: degree N of U.
        ph: p times the step length.
        shaking: over the step.
        turned: theta(1) - theta(0).
        highest: U[N - 3], U[N - 2], U[N - 1] and U[N].

    Returns:
        Exponent by which an error grows at most; truncation; rounding.
    """
    a_size = abs(shaking.k_h) + abs(shaking.dk_h)
    w_size = abs(shaking.w) + abs(shaking.dw)
    # the linearised equation: d(theta'/p)/dt = p D d(theta), d(theta)/dt = p d(theta'/p)
    stiffness = w_size * abs(state.cos)
    stiffness += a_size * abs(state.sin)
    growth = ph * max(1.0, stiffness)
    # What is omitted begins with U[N + 1]. The linear equation gives it P D U[N - 1]/(N (N + 1))
    # and P D' U[N - 2]/(N (N + 1)), ...
    linear = 8.0 * ph * (a_size + w_size) / (order * order)
    truncation = linear * (abs(highest[2]) + abs(highest[1]))
    # ... and products of angles give it what a linear one has not. From rest under a rising k_h
    # they come three places apart and last for three, so that they show in U[N]; under a constant
    # one four places, and only U[N - 3] theta² tells their size. The factors are those that hold
    # in some million drawn steps
    size = ph * (abs(state.rate) + ph * (a_size * abs(state.cos) + w_size * abs(state.sin)))
    truncation += (0.0625 * abs(highest[3]) + 0.25 * abs(highest[0]) * (size * size)) / ph
    # theta, theta'/p and the sine are rounded where they are stored, theta'' where k_h drives it;
    # what gravity takes back, w sin(psi), is less than the rounding of the sine itself
    rounding = MACHINE_EPSILON * (
        2.0 * (abs(state.theta + turned) + abs(state.rate) + abs(state.sin))
        + 4.0 * ph * a_size * abs(state.cos)
    )
    return growth, truncation, rounding


@within
def drift_of_step(ph: float, error: float, theta_end: float) -> float:
    """Return the error of theta that a step adds: theta' errs by `error`, theta by rounding."""
    return ph * error + 2.0 * MACHINE_EPSILON * abs(theta_end)


class StepRules(NamedTuple):
    """Subdivision of an interval into steps.

    Args:
        order: degree of the Taylor step: 4, 5, 6 or 8.
        ph_max: greatest p·h of one step.
    """

    order: int
    ph_max: float


class StepResult(NamedTuple):
    """Result of a step; U = h theta', with the length of the step as unit of time.

    Args:
        theta: rotation at its end [rad].
        turned: what it has grown by.
        u_start: U at its start.
        v_start: the derivative of U there.
        u_end: U at its end.
        v_end: the derivative of U there.
        growth, truncation, rounding: see :func:`step_errors`.
    """

    theta: float
    turned: float
    u_start: float
    v_start: float
    u_end: float
    v_end: float
    growth: float
    truncation: float
    rounding: float


@within
def take_step(
    order: int, u: FloatArray, ph: float, state: State, shaking: StepExcitation
) -> StepResult:
    """Take one step and estimate its errors; `u` is filled as by `taylor_step`."""
    u_start = ph * state.rate
    # exact up to its truncation where k_h and k_v are straight lines: it ends at a kink
    turned, u_end, v_end = taylor_step(order, u, u_start, ph, state.sin, state.cos, shaking)
    highest = (u[order - 3], u[order - 2], u[order - 1], u[order])
    growth, truncation, rounding = step_errors(order, ph, state, shaking, turned, highest)
    return StepResult(
        state.theta + turned, turned, u_start, u[1], u_end, v_end, growth, truncation, rounding
    )


@within
def state_after(state: State, step: StepResult, ph: float) -> State:
    """Return the state of the block at the end of a step."""
    s, c = turn(state.sin, state.cos, step.turned)
    return State(step.theta, step.u_end / ph, s, c)
