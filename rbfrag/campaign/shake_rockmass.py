"""Simulation of the blocks of a rock mass under one motion, by workers."""

from __future__ import annotations

import math
import os
import time
from collections.abc import Callable, Iterator
from typing import Unpack

from rbfrag.campaign.executors.local import run_locally
from rbfrag.campaign.summary import CampaignProgress
from rbfrag.errors import InputError
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.rockmasses.joint_sets import Realisations
from rbfrag.rockmasses.shaking import (
    CHUNK,
    BlockOutcomes,
    ShakenMass,
    ShakingOptions,
    plan_shaking,
    run_blocks,
)

WORTH_A_PROCESS = 500
"""Blocks below which a worker process takes longer to start than to work."""


def shake(
    blocks: Realisations,
    motion: GroundMotion,
    *,
    jobs: int | None = None,
    on_progress: Callable[[CampaignProgress], None] | None = None,
    **shaking: Unpack[ShakingOptions],
) -> ShakenMass:
    """Simulate every block of a rock mass that a motion moves, each in its own mode.

    The answer does not depend on the number of workers.

    Args:
        jobs: worker processes; None for one per processor, where there is work enough for them.
        on_progress: called at the beginning and after each chunk of work; counts blocks.
        shaking: as for :func:`rbfrag.rockmasses.shaking.plan_shaking`.

    Raises:
        InputError: as for :func:`rbfrag.rockmasses.shaking.plan_shaking`; `jobs` below 1;
            a block that cannot be run.
        WorkFailedError: a worker died.
    """
    if jobs is not None and jobs < 1:
        raise InputError(f"jobs must be at least 1, not {jobs}", fields=("jobs",))
    plan = plan_shaking(blocks, motion, **shaking)
    total = int(plan.indices.size)
    workers = min(jobs or os.cpu_count() or 1, math.ceil(total / CHUNK))
    if jobs is None and total < WORTH_A_PROCESS:
        workers = 1
    started = time.perf_counter()

    def reported(answers: Iterator[BlockOutcomes]) -> Iterator[BlockOutcomes]:
        completed = 0
        if on_progress is not None and total:
            on_progress(CampaignProgress(0, total, 0, 0.0))
        for answer in answers:
            completed += int(answer.place.size)
            if on_progress is not None:
                on_progress(CampaignProgress(completed, total, 0, time.perf_counter() - started))
            yield answer

    answers = run_locally(
        run_blocks, plan.work(), workers, after_a_death="run the same command again"
    )
    return plan.gathered(reported(answers))
