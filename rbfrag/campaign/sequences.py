"""Campaigns of sequences: blocks under two consecutive motions, and under the second alone."""

from __future__ import annotations

import math
import os
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from sqlalchemy import Engine

from rbfrag.campaign.horizontal_motions import MotionChoice, horizontal_motions
from rbfrag.campaign.kind import Case, Sequences
from rbfrag.campaign.kinds import campaign_of_kind
from rbfrag.campaign.motion_pairs import MotionPair, motion_pairs
from rbfrag.campaign.runner import Workforce
from rbfrag.campaign.summary import CampaignSummary, SequenceReport
from rbfrag.db.engine import opened_database
from rbfrag.db.keys import pair_key
from rbfrag.db.motions import load_motion
from rbfrag.db.shock_pairs import (
    NOT_RUN,
    Pairing,
    ShockEnd,
    ShockPairRecord,
    insert_shock_pairs,
    known_shock_pairs,
    stored_shock_pairs,
)
from rbfrag.errors import InputError
from rbfrag.fragility.conditional import conditional_shares
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.results.diagnostic import Diagnostic
from rbfrag.solver.kind import Shaking, SupportedBlock
from rbfrag.solver.models import model_of_kind
from rbfrag.solver.results import NUMERICS_VERSION, BlockState, Polarity, Response
from rbfrag.solver.sequence import STARTS_ANEW


@dataclass(frozen=True)
class SequenceTask:
    """One block under one pair of motions in one polarity."""

    natural_key: str
    polarity: Polarity
    block: Mapping[str, object]


@dataclass(frozen=True, eq=False)
class PairWork:
    """Two motions with all work on them, sent once."""

    kind: str
    first_id: int
    second_id: int
    pairing: Pairing
    first: GroundMotion
    second: GroundMotion
    tasks: tuple[SequenceTask, ...]


@dataclass(frozen=True)
class PairResults:
    """Results, number of runs, and the numerics version of the worker."""

    records: tuple[ShockPairRecord, ...]
    runs: int
    numerics_version: str


def sequences_of_kind(name: str) -> Sequences:
    """Return the sequence campaign of a kind.

    Raises:
        InputError: there is no such kind, or a motion leaves its blocks where they were.
    """
    campaign = campaign_of_kind(name)
    if not isinstance(campaign, Sequences):
        raise InputError(
            f"sequence cannot be combined with kind {name}: {STARTS_ANEW}",
            fields=("sequence", "kind"),
        )
    return campaign


def simulate_sequences(
    kind: Sequences,
    cases: Sequence[Case],
    *,
    db: str | os.PathLike[str] | None,
    motions: MotionChoice,
    seed: int,
    draws: int,
    workforce: Workforce,
) -> CampaignSummary:
    """Simulate the blocks of a kind under pairs of motions, and store and tabulate the results.

    Args:
        cases: what the campaign is asked for: the blocks of slumps, and what counts as failure.
        motions: which motions it is of.
        seed: of the pairs that are drawn.
        draws: first motions that are drawn for each second one.
    """
    if draws < 1:
        raise InputError(f"draws must be at least 1, not {draws}", fields=("draws",))
    blocks, limits = kind.blocks(cases), kind.limits(cases)
    started = time.perf_counter()
    with opened_database(db) as engine:
        with engine.connect() as connection:
            rows, warnings = horizontal_motions(connection, **motions)
            pairs = motion_pairs(connection, rows, seed=seed, draws=draws)
            plan = [(pair, _tasks(pair, kind, blocks)) for pair in pairs]
            keys = [task.natural_key for _, tasks in plan for task in tasks]
            stored = known_shock_pairs(connection, keys)
        lacking = (
            (pair, tuple(task for task in tasks if task.natural_key not in stored))
            for pair, tasks in plan
        )
        todo = [(pair, tasks) for pair, tasks in lacking if tasks]
        runs = 0

        def store(campaign_id: int, results: PairResults) -> int:
            nonlocal runs
            with engine.begin() as connection:
                insert_shock_pairs(connection, campaign_id, results.records)
            runs += results.runs
            return len(results.records)

        settings = {
            "kind": kind.kind, "suite": motions["suite"], "sequence": True, "seed": seed,
            "draws": draws,
        }  # fmt: skip
        workforce.carry_out(
            engine, settings, run_pair, _work(engine, kind.kind, todo), len(todo), store,
            total=len(keys), resumed=len(stored), started=started,
        )  # fmt: skip
        with engine.connect() as connection:
            answers = stored_shock_pairs(connection, keys)
    of_station = sum(pair.pairing == "station" for pair in pairs)
    drawn = len(pairs) - of_station
    warning = Diagnostic(
        f"{of_station} of {len(pairs)} pairs of motions are shocks of one station; the other "
        f"{drawn} are motions of different earthquakes, drawn with seed {seed}",
        "pairs_drawn",
    )
    return CampaignSummary(
        kind=kind.kind,
        combinations=len(keys),
        not_searched=len(keys),
        runs=runs,
        seconds=time.perf_counter() - started,
        resumed=len(stored),
        warnings=(*warnings, *([warning] if drawn else ())),
        sequence=SequenceReport(
            seed=seed,
            station_pairs=of_station,
            drawn_pairs=drawn,
            conditional=conditional_shares(answers, kind.measure, limits),
        ),
    )


def _tasks(
    pair: MotionPair, kind: Sequences, blocks: Sequence[Mapping[str, object]]
) -> tuple[SequenceTask, ...]:
    inputs: dict[str, Any] = {
        "first_sha256": pair.first.sha256,
        "first_dt_s": pair.first.dt_s,
        "motion_sha256": pair.second.sha256,
        "dt_s": pair.second.dt_s,
        "kind": kind.kind,
        "numerics_version": NUMERICS_VERSION,
    }
    return tuple(
        SequenceTask(pair_key(**inputs, polarity=polarity, block=block), polarity, block)
        for polarity in kind.polarities
        for block in blocks
    )


def _work(
    engine: Engine, kind: str, todo: Sequence[tuple[MotionPair, tuple[SequenceTask, ...]]]
) -> Iterator[PairWork]:
    for pair, tasks in todo:
        with engine.connect() as connection:
            first, second = (load_motion(connection, row.id) for row in (pair.first, pair.second))
        yield PairWork(kind, pair.first.id, pair.second.id, pair.pairing, first, second, tasks)


def run_pair(work: PairWork) -> PairResults:
    """Run every block under both motions, and under the second alone."""
    campaign, model = sequences_of_kind(work.kind), model_of_kind(work.kind)
    records, runs = [], 0
    for task in work.tasks:
        supported_block = campaign.supported_block(task.block)

        def under(
            motion: GroundMotion,
            start: BlockState | None = None,
            supported_block: SupportedBlock = supported_block,
            polarity: Polarity = task.polarity,
        ) -> Response:
            """Return the response of the block to a motion from an initial state."""
            shaking = Shaking(motion, None, polarity, start=start, laws=False, stepwise=False)
            return model.respond(supported_block, shaking)

        first, intact = under(work.first), under(work.second)
        second, runs = None, runs + 2
        if first.state is not None:
            second, runs = under(work.second, first.state), runs + 1
        critical = first.critical_angle_deg
        assert supported_block.yield_g is not None
        records.append(
            ShockPairRecord(
                natural_key=task.natural_key,
                first_motion_id=work.first_id,
                second_motion_id=work.second_id,
                pairing=work.pairing,
                polarity=task.polarity,
                kind=work.kind,
                block=task.block,
                yield_g=supported_block.yield_g,
                critical_rad=None if critical is None else math.radians(critical),
                numerics_version=NUMERICS_VERSION,
                first=_end(first, None),
                second=NOT_RUN if second is None else _end(second, first.state),
                intact=_end(intact, None),
            )
        )
    return PairResults(tuple(records), runs, NUMERICS_VERSION)


def _end(response: Response, start: BlockState | None) -> ShockEnd:
    slip = response.displacement_m
    before = 0.0 if start is None else start.displacement_m
    return ShockEnd(
        outcome=response.outcome.value,
        displacement_m=None if slip is None else before + slip,
        rotation_rad=response.final_theta_rad,
        peak_rad=response.peak_theta_rad,
    )
