"""Free-standing blocks that rock about both corners, under made-up records."""

from __future__ import annotations

import sys

import numpy as np

import rbfrag
from benchmarks.hard_cases import Row
from benchmarks.hard_cases._records import made_up, vertical_of
from rbfrag.solver.excitation import excitation
from tests.solver.rocking_reference import integrate, parallelogram

SEED = 31
RUNS = 60
LEAST_RAD = 1e-9
"""Difference of peaks that the other integrator, whose tolerance is 1e-12, may itself cause."""


def rows() -> list[Row]:
    """Run all cases: wrong is another outcome, or a peak beyond the error estimate."""
    rng = np.random.default_rng(SEED)
    tried = wrong = within = undecided = 0
    while tried < RUNS:
        motion, p2 = made_up(rng)
        up = vertical_of(motion, rng, 0.7) if rng.random() < 0.4 else None
        alpha1, alpha3 = rng.uniform(-20.0, -3.0), rng.uniform(3.0, 20.0)
        beta = rng.uniform(-2.0, 2.0)
        restitution = None if rng.random() < 0.5 else float(rng.uniform(0.6, 0.95))
        # a block of about that p², so that the step is as long for it as it was made
        block = rbfrag.Block.from_angles(alpha1, alpha3, 0.75 * 9.80665 / p2)
        excited = excitation(motion, up)
        weakest = np.tan(np.radians(min(alpha3 - beta, beta - alpha1)))
        if np.abs(excited.q).max() <= weakest:
            continue
        answer = rbfrag.respond(
            motion, vertical=up, block=block, beta_deg=beta, kind="rocking", restitution=restitution
        )
        if (answer.impacts or 0) > 60:  # what so many impacts make of rounding is no test
            continue
        tried += 1
        mechanism = parallelogram(alpha1, alpha3, block.r3_m, beta, restitution)
        true = integrate(excited.time_s, excited.k_h, excited.w, mechanism)
        outcome = "toppled" if true.toppled else "stable"
        if answer.sensitive or answer.outcome not in ("stable", "toppled"):
            undecided += 1
            continue
        error = 0.0
        if answer.outcome == outcome == "stable":
            error = max(
                abs((mine or 0.0) - true.peak[side])
                for side, mine in ((1, answer.peak_forward_rad), (-1, answer.peak_backward_rad))
            )
        if answer.outcome != outcome or error > max(answer.error_estimate or 0.0, LEAST_RAD):
            wrong += 1
            print(
                f"rocking {tried}: alpha {alpha1!r}, {alpha3!r}, r3 {block.r3_m!r}, beta {beta!r}, "
                f"restitution {restitution!r}: {answer.outcome}, not {outcome}; "
                f"off by {error:.3g}, estimate {answer.error_estimate}; {answer.impacts} impacts",
                file=sys.stderr,
            )
        else:
            within += 1
    subject = "free-standing blocks on both corners"
    return [
        Row(
            subject,
            "DOP853 at 1e-12, restarted at samples and impacts",
            tried,
            wrong,
            within,
            undecided,
        )
    ]
