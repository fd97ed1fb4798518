"""What a worker process does: all searches of one motion, arrays in, results out."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from dataclasses import dataclass
from multiprocessing.connection import wait

from rbfrag.campaign.plan import Case
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.solver.critical import critical
from rbfrag.solver.results import CriticalResult


@dataclass(frozen=True)
class MotionWork:
    """One motion with the searches to make on it."""

    motion_id: int
    motion: GroundMotion
    cases: tuple[Case, ...]


@dataclass(frozen=True)
class MotionResults:
    """The answers, in the order of the cases."""

    motion_id: int
    cases: tuple[Case, ...]
    results: tuple[CriticalResult, ...]


def run_work(work: MotionWork) -> MotionResults:
    """Make every search of one motion."""
    results = tuple(
        critical(work.motion, p2=case.p2, polarity=case.polarity, full_map=True)
        for case in work.cases
    )
    return MotionResults(motion_id=work.motion_id, cases=work.cases, results=results)


def prepare_worker() -> None:
    """Leave Ctrl-C to the main process, and end with it however it ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()
    if parent is not None:
        # A killed main process cannot tell its workers: without this they would wait for ever.
        threading.Thread(target=_end_with, args=(parent.sentinel,), daemon=True).start()


def _end_with(sentinel: int) -> None:
    wait([sentinel])
    os._exit(1)
