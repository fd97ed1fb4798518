"""Methods for free-standing blocks: rbfrag, RK4 with fixed steps (compiled), the reference.

RK4 is the usual way to integrate rocking about both corners: impacts at the root of the step's
cubic, the rest of the step from there, the motion after the record by energy.
"""

from __future__ import annotations

import math
from functools import partial

import numpy as np

from benchmarks.reference import reference
from rbfrag.bench.peers import STABLE, TOPPLED, BenchCase, PeerAnswer, Real, free_motion
from rbfrag.bench.work_precision import BenchMethod, step_setting
from rbfrag.solver.integrator.compiled import kernel
from rbfrag.solver.integrator.rocking_kernel import IMPACTS_THAT_DECIDE, PAST_BALANCE
from rbfrag.solver.integrator.taylor import ORDER
from rbfrag.solver.models.rocking import free_block
from rbfrag.solver.respond import block_of_numbers
from rbfrag.solver.results import FloatArray
from rbfrag.solver.rocking_run import REST_SPEED, simulate
from rbfrag.solver.toppling_run import OUTCOMES

HALVINGS = 52
"""Of a step, to the rounding of where an impact is in it."""

RESTITUTION = 0.85
"""Of the free-standing blocks. With Housner's the responses of slender ones are chaotic, and an
error says nothing of the method."""


def rocking_methods() -> tuple[BenchMethod, ...]:
    """Return the methods for free-standing blocks."""
    return (
        *(
            BenchMethod(
                "rbfrag, rocking", f"order {order}", partial(rocking_run, order=order),
                of_use=order == ORDER,
            )
            for order in (4, 5, 6, ORDER)
        ),
        *(
            BenchMethod("RK4, rocking", step_setting(parts), partial(runge_kutta, parts=parts))
            for parts in (1, 4, 16)
        ),
    )  # fmt: skip


def rocking_run(case: BenchCase, order: int = ORDER) -> PeerAnswer:
    """Run one case with rbfrag's kernel for free-standing blocks."""
    block = free_block(block_of_numbers(case.p2, case.kr, {"restitution": RESTITUTION}))
    run = simulate(case.excitation, block, order=order)
    return PeerAnswer(OUTCOMES[run.outcome].value, max(run.forward.x, run.backward.x))


def rocking_reference(case: BenchCase) -> PeerAnswer:
    """Run one case with the extended-precision reference."""
    return reference(case, sides=(1, -1), restitution=RESTITUTION, after_record=free_rocking)


def free_rocking(theta: Real, rate: Real, p: Real, theta_c: Real, peak: Real) -> PeerAnswer:
    """Determine by energy, impact by impact, the outcome after the end of the ground motion.

    Args:
        theta: rotation at the end of the record [rad].
        rate: rotation rate [rad/s].
        p: frequency parameter [1/s].
        theta_c: critical angle of both corners [rad].
        peak: maximum rotation so far [rad].
    """
    answer = free_motion(theta, rate, p, theta_c, peak)
    for _ in range(IMPACTS_THAT_DECIDE):
        if answer.outcome == TOPPLED:
            break
        height = np.sin((theta_c + theta_c - theta) / 2) * np.sin(theta / 2)
        # rate² + 2 p² (cos(theta_c - theta) - cos theta_c), without a difference of cosines
        speed = RESTITUTION * np.sqrt(max(rate * rate + 4 * p * p * height, 0 * rate))
        if speed < REST_SPEED * p * theta_c:
            break
        theta, rate = 0 * theta, speed
        answer = free_motion(theta, rate, p, theta_c, answer.peak_rad)
    return answer


def runge_kutta(case: BenchCase, parts: int) -> PeerAnswer:
    """Run one case with `parts` RK4 steps per sampling interval; no vertical motion."""
    excited = case.excitation
    p, theta_c = math.sqrt(case.p2), math.atan(case.kr)
    topples, side, theta, rate, peak = _march(
        excited.k_h, float(excited.interval_s[0]), case.kr, case.p2, theta_c, RESTITUTION,
        REST_SPEED * p * theta_c, parts,
    )  # fmt: skip
    if topples:
        return PeerAnswer(TOPPLED, math.nan)
    if side == 0:
        return PeerAnswer(STABLE, peak)
    return free_rocking(theta, rate, p, theta_c, peak)


@kernel
def _march(
    k_h: FloatArray, dt: float, kr: float, p2: float, theta_c: float, e: float, slowest: float,
    parts: int,
) -> tuple[bool, int, float, float, float]:  # fmt: skip
    theta = 0.0
    rate = 0.0
    peak = 0.0
    side = 0
    for i in range(k_h.size - 1):
        slope = (k_h[i + 1] - k_h[i]) / dt
        if side == 0 and abs(k_h[i]) <= kr and abs(k_h[i + 1]) <= kr:
            continue
        for j in range(parts):
            t = j * dt / parts
            h = dt / parts
            while h > 1e-12 * dt:
                if side == 0:
                    a = k_h[i] + slope * t
                    b = a + slope * h
                    if abs(a) > kr:
                        side = 1 if a > 0.0 else -1
                    elif abs(b) > kr:
                        side = 1 if b > 0.0 else -1
                        wait = (side * kr - a) / slope
                        t += wait
                        h -= wait
                    else:
                        break
                theta_end, rate_end = _step(
                    theta, rate, h, side * (k_h[i] + slope * t), side * slope, p2, theta_c
                )
                if rate > 0.0 > rate_end:
                    top = _hermite(theta, rate, theta_end, rate_end, h, rate / (rate - rate_end))
                    peak = max(peak, top[0])
                if theta_end > 0.0:
                    theta, rate = theta_end, rate_end
                    if theta > theta_c + PAST_BALANCE:
                        return True, side, theta, rate, peak
                    break
                low, high = 0.0, 1.0
                for _ in range(HALVINGS):
                    middle = 0.5 * (low + high)
                    if _hermite(theta, rate, theta_end, rate_end, h, middle)[0] > 0.0:
                        low = middle
                    else:
                        high = middle
                speed = -e * _hermite(theta, rate, theta_end, rate_end, h, high)[1]
                t += high * h
                h -= high * h
                theta = 0.0
                rate = speed
                side = -side
                if speed < slowest:
                    side = 0
                    rate = 0.0
    return False, side, theta, rate, peak


@kernel
def _step(
    theta: float, rate: float, h: float, a: float, slope: float, p2: float, theta_c: float
) -> tuple[float, float]:
    middle, end = a + 0.5 * slope * h, a + slope * h
    x = theta_c - theta
    k1 = p2 * (a * math.cos(x) - math.sin(x))
    x = theta_c - (theta + 0.5 * h * rate)
    k2 = p2 * (middle * math.cos(x) - math.sin(x))
    x = theta_c - (theta + 0.5 * h * (rate + 0.5 * h * k1))
    k3 = p2 * (middle * math.cos(x) - math.sin(x))
    x = theta_c - (theta + h * (rate + 0.5 * h * k2))
    k4 = p2 * (end * math.cos(x) - math.sin(x))
    return (
        theta + h * rate + h * h * (k1 + k2 + k3) / 6.0,
        rate + h * (k1 + 2.0 * k2 + 2.0 * k3 + k4) / 6.0,
    )


@kernel
def _hermite(
    theta: float, rate: float, theta_end: float, rate_end: float, h: float, x: float
) -> tuple[float, float]:
    """Return rotation and rate at a fraction of a step, by the cubic through both ends."""
    u0, u1 = h * rate, h * rate_end
    c2 = 3.0 * (theta_end - theta) - 2.0 * u0 - u1
    c3 = 2.0 * (theta - theta_end) + u0 + u1
    return (theta + x * (u0 + x * (c2 + x * c3)), (u0 + x * (2.0 * c2 + x * 3.0 * c3)) / h)
