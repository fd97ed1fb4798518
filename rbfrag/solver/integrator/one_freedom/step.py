"""One Taylor step of a motion with one degree of freedom.

On tau in [0, 1] with h the interval, U = h x', a(tau) = a0 + da tau the driving acceleration and
w(tau) = w0 + dw tau the effective gravity, both in g, the equation of motion reads

    D(x) U' = h² [N(x) a - M(x) w] - Q(x) U²

with D, N, M and Q sums of harmonics of x. The Taylor coefficients of U follow one from another:
those of cos x, sin x, cos 2x and sin 2x from U, those of D, N, M, Q from these, and the next one
of U from a division of series. The record is linear between samples, so no step crosses a kink.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from rbfrag.solver.integrator.compiled import fused_kernel, inner_kernel, within
from rbfrag.solver.integrator.state import Peak, Place
from rbfrag.solver.results import FloatArray

AT_REST, UPPER, LOWER, REVERSE, VIOLATED, JUMPED, ENDLESS = range(7)
"""Why a phase ended: for good at rest; at its upper or lower limit; where motion in reverse sets
in; where a condition of the equation fails; where the ground throws the block; not at all."""

NO_REVERSE, REVERSE_MOVES, REVERSE_LEAVES = range(3)
"""What the onset of motion in reverse means."""

LEAVES, COMES_TO_REST = range(2)
"""What an impact at the lowest position does: end the phase, or stop the block (inelastic)."""


class PhaseRules(NamedTuple):
    """Settings of a phase of motion.

    Args:
        forward: table of the equation of forward motion, or of all motion if not `sticks`.
        reverse: table of the equation of motion in reverse.
        sticks: whether friction holds the block at a standstill.
        in_reverse: `NO_REVERSE`, `REVERSE_MOVES` or `REVERSE_LEAVES`.
        lowest: least x.
        highest: greatest x.
        impact: at `lowest`, `LEAVES` or `COMES_TO_REST`.
        uniform: whether the equation is the same everywhere; a step is then exact.
        order: degree of a step. Short steps, that need no more, take a lower one.
        turn_max: greatest step in units of the block's own time.
    """

    forward: FloatArray
    reverse: FloatArray
    sticks: bool
    in_reverse: int
    lowest: float
    highest: float
    impact: int
    uniform: bool
    order: int
    turn_max: float


class PhaseState(NamedTuple):
    """The state of the block.

    Args:
        x: position.
        rate: its rate [1/s].
        cos: cos x; 1 where the equation is the same everywhere, which x then does not enter.
        sin: sin x; 0 there.
        error_x: bound on the error of the position.
        error_rate: bound on the error of the rate.
        sense: of its motion, 1 or -1: which equation holds.
        smooth: whether it starts where the acceleration is zero.
    """

    x: float
    rate: float
    cos: float
    sin: float
    error_x: float
    error_rate: float
    sense: int
    smooth: bool


class Entry(NamedTuple):
    """Where and how a phase is entered, or was left: the end of one is the entry of the next.

    Args:
        place: where in the record.
        free_s: time after the record [s].
        x: position.
        rate: its rate [1/s].
        error_x: bound on the error of the position.
        error_rate: bound on the error of the rate.
    """

    place: Place
    free_s: float
    x: float
    rate: float
    error_x: float
    error_rate: float


class PhaseWork(NamedTuple):
    """Work arrays of the kernels, which allocate none.

    Args:
        series: Taylor coefficients of a step, shape (8, order + 1).
        conditions_forward: conditions of a uniform equation, shape (conditions, 3); (0, 3) where
            the equation depends on x, whose conditions are taken at each step.
        conditions_reverse: the same in reverse.
    """

    series: FloatArray
    conditions_forward: FloatArray
    conditions_reverse: FloatArray


class PhaseRun(NamedTuple):
    """Result of a phase; times are NaN for events that did not occur.

    Args:
        stop: why it ended.
        condition: which condition failed: 0 for the inertia, or the number of the contact from 1.
        time_s: when it ended [s].
        peak: greatest position.
        started_s: first motion [s].
        stopped_s: last standstill [s].
        certain_s: time from which nothing in the rest of the record turns the motion back [s].
        steps: integration steps.
        samples_moved: sample intervals in which the block moved.
        impacts: impacts at the lowest position that stopped the block.
        history_length: columns of the history that are filled.
    """

    stop: int
    condition: int
    time_s: float
    end: Entry
    peak: Peak
    started_s: float
    stopped_s: float
    certain_s: float
    steps: int
    samples_moved: int
    impacts: int
    history_length: int


@within
def resting(state: PhaseState, error_x: float, sense: int, smooth: bool) -> PhaseState:
    """Return a state with a rate of zero, which is exact: the error of the rate is zero too."""
    # x does not change, nor do its cosine and sine
    return PhaseState(state.x, 0.0, state.cos, state.sin, error_x, 0.0, sense, smooth)


@within
def certain_since(
    since_s: float, now_s: float, rate: float, driving: float, resistance: float, least_q: float
) -> float:
    """Return the time from which the motion can no longer turn back; NaN while it may.

    It is (4.19) for an equation of this form: the block moves forward, and the least excitation
    of all that is to come exceeds the resistance where it is.

    Args:
        since_s: the time so far, or NaN.
        now_s: the present.
        rate: rate of the block.
        driving: factor of k_h in the equation of forward motion.
        resistance: factor of 1 + k_v in it.
        least_q: least k_h/(1 + k_v) from now on.
    """
    # with braking (q > 0) this is a criterion and no proof: docs/theory/slumping.md says so
    if not (rate > 0.0 and driving > 0.0 and driving * least_q > resistance):
        return math.nan
    # the first of the nodes from which on it has held without a break
    return now_s if math.isnan(since_s) else since_s


ORDER = 8
"""Degree of the polynomial of U where the equation depends on x."""

UNIFORM_ORDER = 2
"""The same where it does not: then the step is exact."""

TURN_MAX = 0.12
"""Greatest step, in units of the block's own time; longer intervals are split evenly."""

EPSILON = 2.220446049250313e-16
"""Machine epsilon; the errors count a few roundings of it a step."""

SLOW = 1e-4
"""Size of the last two terms of a series, over its first three, at which a step is halved."""

INERTIA, DRIVING, RESISTANCE, BRAKING, CONDITIONS = 0, 1, 2, 3, 4
"""Rows of a table of coefficients."""


class Step(NamedTuple):
    """One Taylor step, with tau in [0, 1].

    Args:
        h: its length [s].
        a0: driving acceleration at its start [g].
        da: change of it over the step.
        w0: effective gravity 1 + k_v at its start.
        dw: change of it over the step.
    """

    h: float
    a0: float
    da: float
    w0: float
    dw: float


class Errors(NamedTuple):
    """Bounds on the errors of the position and of its rate."""

    x: float
    rate: float


@inner_kernel
def harmonic_sum(table: FloatArray, row: int, c: float, s: float) -> float:
    """Return the value of one row of coefficients (up to the second harmonic) at cos x = c, sin x =
    s.
    """
    return with_double(table, row, c, s, c * c - s * s, 2.0 * c * s)


@inner_kernel
def with_double(table: FloatArray, row: int, c: float, s: float, c2: float, s2: float) -> float:
    """Return the same value where c2 = cos 2x and s2 = sin 2x are given."""
    value: float = table[row, 0] + table[row, 1] * c + table[row, 2] * s
    value += table[row, 3] * c2 + table[row, 4] * s2
    return value


@inner_kernel
def harmonic_slope(table: FloatArray, row: int, c: float, s: float) -> float:
    """Return the derivative of one row of coefficients (up to the second harmonic)."""
    c2 = c * c - s * s
    s2 = 2.0 * c * s
    slope: float = table[row, 2] * c - table[row, 1] * s
    slope += 2.0 * (table[row, 4] * c2 - table[row, 3] * s2)
    return slope


@fused_kernel
def uniform_terms(
    inertia: float,
    driving: float,
    resistance: float,
    h: float,
    a0: float,
    da: float,
    w0: float,
    dw: float,
) -> tuple[float, float]:
    """Return the first and second Taylor coefficients of U of an equation that does not depend on
    x.
    """
    # U' = h² [N a - M w]/D is linear in tau: two terms are exact
    scale = h * h / inertia
    first = scale * (driving * a0 - resistance * w0)
    return first, 0.5 * scale * (driving * da - resistance * dw)


@fused_kernel
def fill_step(
    table: FloatArray, series: FloatArray, order: int, state: PhaseState, step: Step
) -> None:
    """Fill the Taylor coefficients of U for one step.

    Args:
        table: coefficients of an equation.
        series: shape (8, order + 1); its first row is filled with those of U, the others with
            those of cos x, sin x, cos 2x, sin 2x, D, Q and U².
        order: degree of U.
        state: state of the block at the start.
        step: length and accelerations.
    """
    # Coefficients of tau^k of D U' = h² (N a - M w) - Q U², with a = a0 + da tau, w = w0 + dw tau:
    #     sum_j D_j (k-j+1) U_(k-j+1) = h² (a0 N_k + da N_(k-1) - w0 M_k - dw M_(k-1))
    #                                   - sum_j Q_j (U²)_(k-j)
    # which is solved for U_(k+1), the only unknown in it
    h, a0, da, w0, dw = step
    u = series[0]
    u[0] = h * state.rate
    if order == UNIFORM_ORDER:
        u[1], u[2] = uniform_terms(
            table[INERTIA, 0], table[DRIVING, 0], table[RESISTANCE, 0], h, a0, da, w0, dw
        )
        return
    # dx/dtau = U: the series of x is that of U integrated, and needs no row of its own
    hh = h * h
    c, s = state.cos, state.sin
    c1, s1, c2, s2 = series[1], series[2], series[3], series[4]
    d, q, squared = series[5], series[6], series[7]
    c1[0], s1[0], c2[0], s2[0] = c, s, c * c - s * s, 2.0 * c * s
    n_before = 0.0
    m_before = 0.0
    inverse = 0.0
    for k in range(order):
        ck, sk, c2k, s2k = c1[k], s1[k], c2[k], s2[k]
        dk = table[0, 1] * ck + table[0, 2] * sk + table[0, 3] * c2k + table[0, 4] * s2k
        n = table[1, 1] * ck + table[1, 2] * sk + table[1, 3] * c2k + table[1, 4] * s2k
        m = table[2, 1] * ck + table[2, 2] * sk + table[2, 3] * c2k + table[2, 4] * s2k
        qk = table[3, 1] * ck + table[3, 2] * sk + table[3, 3] * c2k + table[3, 4] * s2k
        if k == 0:  # the constants of the harmonics enter the first coefficients only
            dk += table[0, 0]
            n += table[1, 0]
            m += table[2, 0]
            qk += table[3, 0]
            inverse = 1.0 / dk
        d[k] = dk
        q[k] = qk
        # products of series (Cauchy), and the derivatives (cos x)' = -x' sin x, (sin x)' = x' cos x
        square = 0.0
        turn_c = 0.0
        turn_s = 0.0
        turn_c2 = 0.0
        turn_s2 = 0.0
        for j in range(k + 1):
            uj = u[j]
            square += uj * u[k - j]
            turn_c += uj * s1[k - j]
            turn_s += uj * c1[k - j]
            turn_c2 += uj * s2[k - j]
            turn_s2 += uj * c2[k - j]
        squared[k] = square
        # explicit part of (D U')_k: the driving terms less Q U² and the D_j U'_(k-j) with j > 0
        explicit = hh * (a0 * n + da * n_before - w0 * m - dw * m_before)
        n_before = n
        m_before = m
        for j in range(k + 1):
            explicit -= q[j] * squared[k - j]
        # D_0 is divided by at the end: it is not zero, least_condition() sees to it
        for j in range(1, k + 1):
            explicit -= d[j] * (k - j + 1) * u[k - j + 1]
        part = 1.0 / (k + 1)
        u[k + 1] = explicit * inverse * part
        c1[k + 1] = -turn_c * part
        s1[k + 1] = turn_s * part
        c2[k + 1] = -2.0 * turn_c2 * part
        s2[k + 1] = 2.0 * turn_s2 * part


@within
def local_frequency(table: FloatArray, c: float, s: float) -> float:
    """Return the local frequency parameter [1/s], sqrt((N + M)/D): p for a toppling block."""
    driving = abs(harmonic_sum(table, DRIVING, c, s))
    resistance = abs(harmonic_sum(table, RESISTANCE, c, s))
    inertia = harmonic_sum(table, INERTIA, c, s)
    # D = 0 (Painlevé) gives a rate without bound and steps that do not end: keep it finite
    return math.sqrt((driving + resistance) / max(abs(inertia), 1e-300))


@within
def converges_slowly(u: FloatArray, order: int) -> bool:
    """Return whether the last two terms of a series are not small compared with its first three."""
    last_terms: float = abs(u[order]) + abs(u[order - 1])
    first_terms: float = abs(u[0]) + abs(u[1]) + abs(u[2])
    return last_terms > SLOW * first_terms


@within
def truncation(u: FloatArray, order: int, frequency: float, rate: float, h: float) -> float:
    """Return a bound on the contribution of the omitted terms to x at the end of a step.

    The first two of them follow from the last two of the series as those did from earlier ones.
    One would not do: from rest under a constant acceleration every other term vanishes.

    Args:
        u: Taylor coefficients of U.
        order: degree of U.
        frequency: rate of the block's own time [1/s].
        rate: rate at the start [1/s].
        h: length of the step [s].
    """
    last_terms: float = abs(u[order]) + abs(u[order - 1])
    # every second term falls by about (own h)²/(n (n + 1)); 64 leaves a margin of eight in own h
    ratio = 64.0 * (frequency * frequency + 4.0 * rate * rate) * h * h
    return min(1.0, ratio / (order * (order + 1))) * last_terms / order


@within
def sensitivity(
    table: FloatArray, state: PhaseState, step: Step, acceleration: float
) -> tuple[float, float]:
    """Return bounds on the derivatives of x'' by x [1/s²] and x' [1/s] at a step's start."""
    c, s, rate = state.cos, state.sin, state.rate
    inertia = harmonic_sum(table, INERTIA, c, s)
    # the derivative of D x'' = N a - M w - Q x'² by x, with x'' as the series has it
    by_x = abs(
        harmonic_slope(table, DRIVING, c, s) * step.a0
        - harmonic_slope(table, RESISTANCE, c, s) * step.w0
        - harmonic_slope(table, BRAKING, c, s) * rate * rate
        - harmonic_slope(table, INERTIA, c, s) * acceleration
    ) / abs(inertia)
    return by_x, abs(2.0 * harmonic_sum(table, BRAKING, c, s) * rate / inertia)


@within
def error_growth(
    rules: PhaseRules,
    table: FloatArray,
    u: FloatArray,
    order: int,
    frequency: float,
    state: PhaseState,
    step: Step,
    tau: float,
    x: float,
) -> Errors:
    """Return the errors after a step: the earlier ones carried through it, and those that it adds.

    Args:
        table: coefficients of the equation of the present sense.
        u: Taylor coefficients of U.
        order: degree of U.
        frequency: rate of the block's own time [1/s]; 0 where the equation is the same everywhere.
        state: state at the start.
        step: length and accelerations.
        tau: fraction of the step that is taken.
        x: position that it leads to.
    """
    # with e = (error of x, error of x'): e' = (e_2, by_x e_1 + by_rate e_2), by_x = d(x'')/dx and
    # by_rate = d(x'')/d(x') in absolute value at the start of the step
    by_x, by_rate, left_out = 0.0, 0.0, 0.0
    if not rules.uniform:
        left_out = truncation(u, order, frequency, state.rate, step.h)
        by_x, by_rate = sensitivity(table, state, step, u[1] / (step.h * step.h))
    # the linearised equation to second order in the span
    span_s = tau * step.h
    pull = by_x * state.error_x + by_rate * state.error_rate
    error_x = state.error_x + span_s * (state.error_rate + 0.5 * span_s * pull)
    error_rate = state.error_rate + span_s * (
        pull + 0.5 * span_s * (by_x * state.error_rate + by_rate * pull)
    )
    # truncation of x and, as its derivative by tau, of the rate; a few roundings of each
    error_x += left_out + EPSILON * (2.0 * abs(x) + abs(u[0]))
    error_rate += order * left_out / step.h
    error_rate += EPSILON * (2.0 * abs(state.rate) + 4.0 * frequency * frequency * span_s)
    if rules.uniform:
        error_rate += 4.0 * EPSILON * (abs(u[1]) + abs(u[2])) / step.h
    return Errors(error_x, error_rate)
