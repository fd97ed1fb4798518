"""One excursion of one block: from a given state to the impact, toppling or stop that ends it.

The search for critical values runs many short excursions with the same kernel; one here has no
error estimate, no peak and no history, only what happens to the block.
A position in a record is a pair (interval i, fraction tau in [0, 1]); node i is (i, 0).
"""

from __future__ import annotations

import math
from typing import NamedTuple

from rbfrag.solver.integrator.block_excitation import BlockExcitation, span_step
from rbfrag.solver.integrator.compiled import inner_kernel, within
from rbfrag.solver.integrator.events import eventful, examine_step, irrecoverable, upright_rate
from rbfrag.solver.integrator.state import Place, State, StepExcitation, at_rest, excitation_over
from rbfrag.solver.integrator.taylor import ORDER, even_parts, lean_step, turn, value
from rbfrag.solver.results import FloatArray

IMPACT, TOPPLED, IN_AIR, STOPPED, ORDER_LOST = 0, 1, 2, 3, 4


ORDER_TRUSTED, ORDER_TO_REST, ORDER_TO_BORDER = 0, 1, 2


class Rules(NamedTuple):
    """Settings of the integration of an excursion.

    Args:
        impacts: False carries the motion on below theta = 0, as if there were no base.
        order: ORDER_TRUSTED takes D = k_h sin(psi) + (1 + k_v) cos(psi) >= 0 for granted;
            ORDER_TO_REST checks it on the way between this motion and a block with `kr_other` at
            rest; ORDER_TO_BORDER between this motion and the border of the irrecoverable states.
        kr_other: see `order`.
    """

    impacts: bool
    order: int
    kr_other: float


TRUSTED = Rules(True, ORDER_TRUSTED, 0.0)
"""A block on its base, D >= 0 taken for granted."""

NO_IMPACT = Rules(False, ORDER_TRUSTED, 0.0)
"""The same carried on below its base: a motion that bounds others."""


class Excursion(NamedTuple):
    """Result of one excursion.

    Args:
        event: IMPACT, TOPPLED, IN_AIR (at the end of the record), STOPPED or ORDER_LOST.
        state: state of the block there.
        steps: integration steps taken.
    """

    event: int
    place: Place
    state: State
    steps: int


@within
def order_lost(
    shaking: StepExcitation,
    s0: float,
    c0: float,
    s1: float,
    c1: float,
    turned: float,
    tangent: float,
) -> bool:
    """Return whether D may be negative between the states of one step and tan(psi) = tangent.

    Args:
        shaking: the excitation over the step.
        s0: sin(psi) at its start.
        c0: cos(psi) there.
        s1: sin(psi) at its end.
        c1: cos(psi) there.
        turned: bound of the angle that psi can turn in the step [rad].
        tangent: tan(psi) of the other motion.
    """
    a0, da, w0, dw = shaking
    a1 = a0 + da
    w1 = w0 + dw
    # D is linear in k_h and w: its least value over the step is at one of the ends
    least = min(
        min(a0 * s0 + w0 * c0, a1 * s0 + w1 * c0), min(a0 * s1 + w0 * c1, a1 * s1 + w1 * c1)
    )
    # psi leaves the range of its ends by less than it can turn in the step
    slack = (abs(a0) + abs(da) + abs(w0) + abs(dw)) * turned
    return least < slack or min(a0 * tangent + w0, a1 * tangent + w1) < 0.0 or min(c0, c1) <= 0.0


@within
def take_span(excitation: BlockExcitation, i: int, stop: int, state: State) -> tuple[int, State]:
    """Advance by the longest span from node i that ends by `stop`; return its length, 0 if none
    fits.
    """
    spans = excitation.spans
    theta, rate, s, c = state
    for level in range(excitation.span_length.size):
        length = excitation.span_length[level]
        # rows stand at multiples of their length
        if i % length != 0 or i + length > stop:
            continue
        row = excitation.span_row[level] + i // length
        ph = excitation.p * spans[row, 0]
        if not 0.0 < ph <= excitation.span_ph:
            continue
        # the samples of this span are too rough for cubics
        if (ph * ph * spans[row, 18]) ** 2 > excitation.span_error:
            continue
        # |theta''| <= p² (|a| + w): the block cannot touch down in this span
        if theta + min(ph * rate, 0.0) - 0.5 * ph * ph * spans[row, 1] <= 0.0:
            continue
        turned, u_end = span_step(spans, row, ph * rate, ph, s, c)
        s, c = turn(s, c, turned)
        return length, State(theta + turned, u_end / ph, s, c)
    return 0, state


@within
def impact_in_step(
    theta: float, theta_end: float, u: FloatArray, u_start: float, u_end: float, v_end: float
) -> float:
    """Return the fraction of a step at which theta returns to 0, or -1; see `examine_step`."""
    # of a peak nothing is asked: only a dip that may be an impact is looked into
    if not eventful(theta, theta_end, u_start, u[1], u_end, v_end, math.inf, 0.0):
        return -1.0
    return examine_step(theta, u, ORDER, theta_end, u_end, v_end).impact


@inner_kernel
def end_of_record(excitation: BlockExcitation) -> Place:
    """Return the last node, for an excursion without a stop."""
    return Place(excitation.q.size - 1, 0.0)


@inner_kernel
def excursion_from_rest(
    excitation: BlockExcitation, kr: float, start: Place, rules: Rules
) -> Excursion:
    """Integrate the excursion of a block that lifts off at a place where q >= kr and rises."""
    return integrate_excursion(
        excitation, kr, start, at_rest(kr), True, end_of_record(excitation), rules
    )


@inner_kernel
def integrate_excursion(
    excitation: BlockExcitation,
    kr: float,
    start: Place,
    state: State,
    lifting: bool,
    stop: Place,
    rules: Rules,
) -> Excursion:
    """Integrate an excursion until the block impacts, topples or the stop comes.

    Args:
        kr: rocking acceleration coefficient.
        start: where it begins.
        lifting: theta >= 0, theta' >= 0 and q >= kr at the start: until q next falls below
            kr the rotation rate cannot become negative, so that no impact is looked for.
        stop: where it ends; the last node for none.
        rules: how it is followed.
    """
    interval_s = excitation.interval_s
    k_h, w = excitation.k_h, excitation.w
    tail_min_q, u = excitation.tail_min_q, excitation.u
    lengths = excitation.span_length
    p, ph_max = excitation.p, excitation.ph_max
    i, tau = start
    theta, rate, s, c = state
    last = k_h.size - 1
    steps = 0
    ph_now = -1.0
    per_ph = u_now = 0.0
    # Invariant of the loop: (theta, rate, s, c) is the state at the place (i, tau), with
    # s = sin(psi) and c = cos(psi) carried by rotation, psi = theta_c - theta. An excursion starts
    # from a given state and ends at its first event, so that it depends on the past by that
    # state alone; this is what the rules of the search compose

    # a span says nothing of what happens inside it: neither impacts below 0 nor the sign of D
    use_spans = rules.impacts and rules.order == ORDER_TRUSTED and lengths.size > 0
    while i < last and (i < stop.interval or (i == stop.interval and tau < stop.fraction)):
        if use_spans and tau == 0.0 and i % lengths[lengths.size - 1] == 0:
            length, after = take_span(excitation, i, stop.interval, State(theta, rate, s, c))
            if length > 0:
                theta, rate, s, c = after
                steps += 1
                lifting = False
                ph_now = -1.0
                i += length
                if s < 0.0 and irrecoverable(rate, s, c, tail_min_q[i], 0.0):
                    return Excursion(TOPPLED, Place(i, 0.0), State(theta, rate, s, c), steps)
                continue
        end = 1.0
        if i == stop.interval and stop.fraction < 1.0:
            end = stop.fraction
        # q is a ratio of straight lines: above kr at both nodes it is so between them
        if lifting and k_h[i + 1] - kr * w[i + 1] < 0.0:
            lifting = False
        # intervals are cut as in the single run, so that both see the same steps
        part = end - tau
        parts, part, ph = even_parts(p * interval_s[i] * part, part, ph_max)
        if ph <= 0.0:  # nothing moves in an interval of no time
            parts = 0
        for number in range(parts):
            at = tau + number * part
            shaking = excitation_over(k_h, w, i, at, part)
            steps += 1
            if ph != ph_now:
                # as long as steps have one length, U goes on without being rounded again
                ph_now = ph
                per_ph = 1.0 / ph
                u_now = ph * rate
            # no error is estimated here: the margins of the search are above that of every order
            turned, u_end, v_end = lean_step(u, u_now, ph, s, c, shaking)
            theta_end = theta + turned
            if lifting:
                # lemma "lift": neither theta nor theta' falls below 0; rounding may say so
                theta_end = max(theta_end, 0.0)
                u_end = max(u_end, 0.0)
            elif rules.impacts:
                x = impact_in_step(theta, theta_end, u, u_now, u_end, v_end)
                if x >= 0.0:
                    rest = at_rest(kr)
                    # rounding may leave a rate above 0 at the root: a block does not close so
                    rate = min(value(u, ORDER, x) / ph, 0.0)
                    place = Place(i, min(at + part * x, 1.0))
                    return Excursion(IMPACT, place, State(0.0, rate, rest.sin, rest.cos), steps)
            theta = theta_end
            s_end, c_end = turn(s, c, turned)
            if rules.order != ORDER_TRUSTED:
                tangent = rules.kr_other if rules.order == ORDER_TO_REST else tail_min_q[i]
                most = ph * (abs(rate) + abs(u_end * per_ph))
                if order_lost(shaking, s, c, s_end, c_end, most, tangent):
                    return Excursion(ORDER_LOST, Place(i, at), State(theta, rate, s, c), steps)
            s = s_end
            c = c_end
            rate = u_end * per_ph
            u_now = u_end
            # in a long interval the block could swing right round before its end
            if number < parts - 1 and s < 0.0 and irrecoverable(rate, s, c, tail_min_q[i], 0.0):
                return Excursion(TOPPLED, Place(i, at + part), State(theta, rate, s, c), steps)
        if end < 1.0:  # the stop lies inside this interval
            return Excursion(STOPPED, Place(i, end), State(theta, rate, s, c), steps)
        i += 1
        tau = 0.0
        if s < 0.0 and irrecoverable(rate, s, c, tail_min_q[i], 0.0):
            return Excursion(TOPPLED, Place(i, tau), State(theta, rate, s, c), steps)
    event = STOPPED
    if i >= last and stop.interval >= last:
        # the ground is at rest from here on, and energy decides
        event = TOPPLED if rate > upright_rate(s, c) else IN_AIR
    return Excursion(event, Place(i, tau), State(theta, rate, s, c), steps)
