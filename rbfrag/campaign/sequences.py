"""Campaigns of sequences: blocks under two consecutive motions, and under the second alone.

Pairs of motions are consecutive shocks at one station, or drawn at random.
"""

from __future__ import annotations

import hashlib
import math
import os
import re
import time
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from heapq import nsmallest
from itertools import pairwise
from operator import itemgetter
from typing import Any

from sqlalchemy import Connection, Engine

from rbfrag.campaign.kind import Case, Sequences
from rbfrag.campaign.kinds import campaign_of_kind
from rbfrag.campaign.plan import MotionChoice, horizontal_motions
from rbfrag.campaign.runner import Workforce
from rbfrag.campaign.summary import CampaignSummary, SequenceReport
from rbfrag.db.campaigns import known_keys
from rbfrag.db.engine import opened_database
from rbfrag.db.keys import pair_key
from rbfrag.db.motions import load_motion, times_of_earthquakes
from rbfrag.db.rows import MotionRow
from rbfrag.db.shock_pairs import (
    NOT_RUN,
    Pairing,
    ShockEnd,
    ShockPairRecord,
    insert_shock_pairs,
    stored_shock_pairs,
)
from rbfrag.errors import InputError
from rbfrag.fragility.conditional import conditional_shares
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.results.diagnostic import Diagnostic
from rbfrag.solver.kind import Shaking, SupportedBlock
from rbfrag.solver.models import model_of_kind
from rbfrag.solver.respond import STARTS_ANEW
from rbfrag.solver.results import NUMERICS_VERSION, BlockState, Polarity, Response


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
            plan = [(pair, _sequence_tasks(pair, kind, blocks)) for pair in pairs]
            keys = [task.natural_key for _, tasks in plan for task in tasks]
            stored = known_keys(connection, keys, "shock_pair")
        lacking = [
            (pair, tuple(task for task in tasks if task.natural_key not in stored))
            for pair, tasks in plan
        ]
        todo = [(pair, tasks) for pair, tasks in lacking if tasks]
        runs = 0

        def store(campaign_id: int, results: PairResults) -> int:
            nonlocal runs
            with engine.begin() as connection:
                insert_shock_pairs(connection, campaign_id, results.records)
            runs += results.runs
            return len(results.records)

        settings = {
            "kind": kind.kind, "suite": motions["suite"], "where": motions["where"],
            "sequence": True, "seed": seed, "draws": draws,
        }  # fmt: skip
        work = (_with_samples(engine, kind.kind, *part) for part in todo)
        workforce.carry_out(
            engine, settings, run_pair, work, len(todo), store,
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


def _sequence_tasks(
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


def _with_samples(
    engine: Engine, kind: str, pair: MotionPair, tasks: tuple[SequenceTask, ...]
) -> PairWork:
    with engine.connect() as connection:
        first, second = (load_motion(connection, row.id) for row in (pair.first, pair.second))
    return PairWork(kind, pair.first.id, pair.second.id, pair.pairing, first, second, tasks)


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


@dataclass(frozen=True)
class MotionPair:
    """Two horizontal motions, one after the other.

    Args:
        pairing: ``station`` for two shocks of one station, ``drawn`` for others.
    """

    first: MotionRow
    second: MotionRow
    pairing: Pairing


def motion_pairs(
    connection: Connection, rows: Sequence[MotionRow], *, seed: int, draws: int
) -> tuple[MotionPair, ...]:
    """Return the pairs of a campaign, the longest first.

    Args:
        rows: its horizontal motions.
        draws: how many first motions are drawn for each that is no later shock of a station.

    Raises:
        InputError: there are no two earthquakes.
    """
    real = shocks_of_stations(rows, times_of_earthquakes(connection))
    pairs = (*real, *drawn_pairs(rows, {pair.second.id for pair in real}, seed, draws))
    if not pairs:
        raise InputError(
            "no motions of two earthquakes: add some with a metadata table that gives the "
            "earthquakes"
        )

    def longest_first(pair: MotionPair) -> tuple[int, str, str]:
        npts = pair.first.npts + pair.second.npts
        return -npts, pair.second.sha256, pair.first.sha256

    return tuple(sorted(pairs, key=longest_first))


def shocks_of_stations(
    rows: Iterable[MotionRow], times: Mapping[str, str]
) -> tuple[MotionPair, ...]:
    """Return each shock with its predecessor, at one station in one direction.

    Their order is that of the times that the metadata state; where these are equal, such as one
    year, that of the clocks of the files if all tell the time, and else that of the ids of the
    events, in which catalogues number the shocks of a sequence.

    Args:
        times: time or year by event id, of earthquakes that metadata state.
    """
    by_station: defaultdict[tuple[str, object], list[MotionRow]] = defaultdict(list)
    for row in rows:
        if row.station and not row.event_guessed and row.event_id in times:
            direction = row.component if row.orientation_deg is None else row.orientation_deg
            by_station[row.station, direction].append(row)
    pairs = []
    for shocks in by_station.values():
        clocks = all(row.start_time for row in shocks)
        by_event = {row.event_id: row for row in sorted(shocks, key=lambda row: row.sha256)}
        in_order = sorted(
            by_event.values(),
            key=lambda row: (
                times[row.event_id],
                (row.start_time or "") if clocks else "",
                _numbered(row.event_id),
            ),
        )
        pairs += [MotionPair(first, other, "station") for first, other in pairwise(in_order)]
    return tuple(pairs)


def drawn_pairs(
    rows: Sequence[MotionRow], without: set[int], seed: int, draws: int
) -> tuple[MotionPair, ...]:
    """Return random pairs: each second motion after motions of other earthquakes.

    Drawn are the first motions of least hash with the second (Thaler and Ravishankar 1998,
    IEEE/ACM Transactions on Networking 6(1), 1-14): the draw depends on samples and seed alone,
    and a motion that is added later changes only the pairs that it is drawn for.

    Args:
        without: ids of motions that are no second ones here.
        draws: first motions for each second one.
    """
    pairs = []
    for second in rows:
        candidates = [row for row in rows if row.event_id != second.event_id]
        if second.id not in without:
            hashes = (
                hashlib.sha256(f"{seed}:{second.sha256}:{row.sha256}".encode("ascii")).digest()
                for row in candidates
            )
            firsts = nsmallest(draws, zip(hashes, candidates, strict=True), key=itemgetter(0))
            pairs += [MotionPair(first, second, "drawn") for _, first in firsts]
    return tuple(pairs)


def _numbered(event_id: str) -> list[tuple[int, str]]:
    """Return a sort key that puts shock 2 before shock 10."""
    parts = re.findall(r"\d+|\D+", event_id)
    return [(int(part), "") if part.isdecimal() else (-1, part) for part in parts]
