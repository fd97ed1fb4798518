"""What one step of a rotating block does to the error of its motion."""

from __future__ import annotations

from rbfrag.solver.integrator.compiled import within
from rbfrag.solver.integrator.state import State, StepExcitation
from rbfrag.solver.integrator.taylor import MACHINE_EPSILON


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
    highest: tuple[float, float, float],
) -> tuple[float, float, float]:
    """Estimate what one step does to the error of its start, and adds to it.

    Args:
        order: degree N of U.
        ph: p times the step length.
        shaking: over the step.
        turned: theta(1) - theta(0).
        highest: U[N - 2], U[N - 1] and U[N].

    Returns:
        Exponent by which an error grows at most; truncation; rounding.
    """
    a_size = abs(shaking.k_h) + abs(shaking.dk_h)
    w_size = abs(shaking.w) + abs(shaking.dw)
    # the linearised equation: d(theta'/p)/dt = p D d(theta), d(theta)/dt = p d(theta'/p)
    stiffness = w_size * abs(state.cos)
    stiffness += a_size * abs(state.sin)
    growth = ph * max(1.0, stiffness)
    # the first two omitted terms, from u[k+2] ~ (p·h)² D u[k]/((k+1)(k+2)): one
    # alone is fooled, since from rest under constant a every other one vanishes
    omitted = 16.0 * ph * (a_size + w_size) / (order * (order + 1))
    truncation = omitted * (abs(highest[2]) + abs(highest[1]))
    # and the terms in theta³, which from rest come three places apart
    truncation += abs(highest[0] * turned) / ph
    size = a_size * abs(state.cos) + w_size * (abs(state.sin) + abs(turned))
    rounding = MACHINE_EPSILON * (
        2.0 * (abs(state.theta + turned) + abs(state.rate) + abs(state.sin)) + 4.0 * ph * size
    )
    return growth, truncation, rounding


@within
def drift_of_step(ph: float, error: float, truncation: float, theta_end: float) -> float:
    """Return what a step adds to the error of theta: theta' errs by `error`, theta by rounding."""
    return ph * error + truncation + 2.0 * MACHINE_EPSILON * abs(theta_end)
