"""One block under one motion: the public form of the toppling kernel."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from rbfrag.errors import InputError
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.results.diagnostic import Diagnostic
from rbfrag.solver.excitation import Excitation, kept_excitation, motion_remarks
from rbfrag.solver.history import node_history, with_free_motion
from rbfrag.solver.integrator.taylor import ORDER, PH_MAX
from rbfrag.solver.integrator.toppling_kernel import TOPPLED, Run, run_toppling
from rbfrag.solver.quantity import finite_or_none, positive
from rbfrag.solver.results import FloatArray, Outcome, Polarity, Response, ResponseHistory

OUTCOMES = (Outcome.STABLE, Outcome.TOPPLED, Outcome.UNDETERMINED, Outcome.JUMP)
"""Outcome of each kernel code."""

_NO_HISTORY = np.empty((4, 0))

MOST_STEPS = 1e8
"""Steps of one run beyond which p² cannot be meant: a real record takes some thousands."""


def respond(
    motion: GroundMotion,
    *,
    p2: float,
    kr: float,
    vertical: GroundMotion | None = None,
    polarity: Polarity = "forward",
    kind: str = "toppling",
    history: bool = False,
) -> Response:
    """Return the response of a toppling block to a ground motion.

    Args:
        motion: horizontal ground motion.
        p2: frequency parameter p² of the block [1/s²], > 0.
        kr: rocking acceleration coefficient k_r = tan(critical angle), > 0.
        vertical: vertical motion of the same recording, upward positive.
        polarity: ``forward`` (positive samples drive forward rotation) or ``reverse``.
        kind: name of the model, for the answer.
        history: keep the motion in time.

    Raises:
        InputError: a value that is not a positive finite number, an unknown
            polarity, components that cannot be brought together.

    The model is eq. (4.2) of Gibson's dissertation with the vertical motion of (4.13).
    """
    p2 = positive(p2, "p2", "1/s²")
    kr = positive(kr, "kr", "g")
    excited = kept_excitation(motion, vertical, polarity)
    reject_endless(excited, p2)
    run = simulate(excited, p2=p2, kr=kr)
    outcome = outcome_of(run)
    warnings = [*motion_remarks(motion, vertical, excited)]
    if outcome is Outcome.UNDETERMINED:
        warnings.append(Diagnostic(outcome.advice, "undetermined"))
    if outcome is Outcome.JUMP:
        text = f"at {run.verdict_s:.3f} s: {outcome.advice}"
        warnings.append(Diagnostic(text, "vertical_jump"))
    theta_c = math.atan(kr)
    has_peak = math.isfinite(run.peak_rad)
    return Response(
        kind=kind,
        outcome=outcome,
        peak_theta_n=run.peak_rad / theta_c if has_peak else None,
        peak_theta_rad=run.peak_rad if has_peak else None,
        critical_angle_deg=math.degrees(theta_c),
        started_s=finite_or_none(run.started_s),
        toppled_s=finite_or_none(run.verdict_s) if outcome is Outcome.TOPPLED else None,
        error_estimate=finite_or_none(run.error_rad),
        steps=run.steps,
        samples_moved=run.samples_moved,
        samples_total=excited.samples_total,
        warnings=tuple(warnings),
        history=history_of(excited, p2=p2, kr=kr) if history else None,
    )


def simulate(
    excited: Excitation,
    *,
    p2: float,
    kr: float,
    rows: FloatArray = _NO_HISTORY,
    order: int = ORDER,
    ph_max: float = PH_MAX,
) -> Run:
    """Run the kernel once.

    Args:
        excited: the excitation.
        rows: history to be filled, shape (4, n).
        order: order of the step; for convergence studies.
        ph_max: greatest p·h of a step; for convergence studies.
    """
    return Run(*run_toppling(excited.nodes, kr, math.sqrt(p2), order, ph_max, rows, np.empty(9)))


def outcome_of(run: Run) -> Outcome:
    """Return the outcome of a run; undetermined if its error is not finite."""
    return Outcome.UNDETERMINED if math.isnan(run.error_rad) else OUTCOMES[run.outcome]


def runner(excited: Excitation, *, p2: float) -> Callable[[float], Run]:
    """Return a function of k_r that runs the block of size p2 [1/s²] under one excitation."""
    return lambda kr: simulate(excited, p2=p2, kr=kr)


def reject_endless(excited: Excitation, p2: float) -> None:
    """Reject a block so small that one run would not end in reasonable time."""
    steps = math.sqrt(p2) * excited.duration_s / PH_MAX
    if steps > MOST_STEPS:
        raise InputError(
            f"p2 = {p2:g} 1/s² would take {steps:.1g} steps over this record: a block of 1 mm "
            "has p2 = 7000 1/s²; check its unit"
        )


def history_of(excited: Excitation, *, p2: float, kr: float) -> ResponseHistory:
    """Repeat the run over the record and a stretch of rest after it, recording every node."""
    longer = with_free_motion(excited, math.sqrt(p2))
    # nodes, and at most a start, a peak and an impact twice in an interval
    rows = np.empty((4, 7 * longer.time_s.size + 8))
    run = simulate(longer, p2=p2, kr=kr, rows=rows)
    columns = rows[:, : run.history_length]
    return node_history(excited, longer, columns, toppled=run.outcome == TOPPLED)
