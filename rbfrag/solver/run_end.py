"""What became of a block, in the numbers that are counted where many blocks are run."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from rbfrag.solver.excitation import Excitation
from rbfrag.solver.integrator.one_freedom.equation import Mechanism
from rbfrag.solver.integrator.one_freedom.follow import follow
from rbfrag.solver.results import Outcome


@dataclass(frozen=True)
class Fate:
    """The end of one run, without its history.

    Args:
        outcome: how it ended.
        moved: whether the block moved at all.
        peak_rad: peak rotation [rad]; None for a block that slides, or that has failed.
        peak_displacement_m: greatest displacement of the contact on the base along it [m]; None
            for a block that rocks, or that has failed.
        error: bound on the error of the peak [rad], of a sliding block [m].
        about_block: what the model takes for granted about this block, whatever the motion.
    """

    outcome: Outcome
    moved: bool
    peak_rad: float | None
    peak_displacement_m: float | None
    error: float
    about_block: tuple[str, ...] = ()


Runner = Callable[[Excitation], Fate]
"""One block, made ready: says what becomes of it under an excitation."""


def mechanism_runner(mechanism: Mechanism) -> Runner:
    """Return a function that runs a mechanism, made once, under one excitation after another.

    Args:
        mechanism: the block.
    """

    def run(drive: Excitation) -> Fate:
        course = follow(mechanism, drive)
        failed = course.outcome is Outcome.TOPPLED
        return Fate(
            outcome=course.outcome,
            moved=course.started_s is not None,
            peak_rad=course.peak if mechanism.rotates and not failed else None,
            peak_displacement_m=None if failed else course.peak_displacement_m,
            error=course.error,
            about_block=mechanism.warnings,
        )

    return run
