"""A random sample of what is stored, computed again: `rbfrag db check --sample`."""

from __future__ import annotations

import math
import random
from collections.abc import Iterator
from dataclasses import dataclass

from sqlalchemy import Connection

from rbfrag.campaign.compare_results import SingleRun, deviations, differences
from rbfrag.campaign.grid import run_grid
from rbfrag.campaign.made_on import made_on
from rbfrag.campaign.recompute_kind import recompute_kind
from rbfrag.db.check.finding import COMPUTE_AGAIN, Finding
from rbfrag.db.motions import load_motion
from rbfrag.db.stored_combination import (
    StoredCombination,
    keys_with_samples,
    stored_combination,
)
from rbfrag.errors import InputError, RbfragError
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.solver.excitation import excitation
from rbfrag.solver.results import MAP_DEPTH, NUMERICS_VERSION, CriticalResult
from rbfrag.solver.search.critical import critical
from rbfrag.solver.toppling_run import respond


@dataclass(frozen=True)
class Resimulation:
    """What computing a sample again showed.

    Args:
        sampled: combinations computed again.
        exact: of these, equal bit for bit.
        within_error: equal within the error of the solver, made on another machine.
        eligible: combinations of the present numerics whose samples are stored.
        seed: of the random choice.
        findings: what was wrong.
    """

    sampled: int
    exact: int
    within_error: int
    eligible: int
    seed: int
    findings: tuple[Finding, ...]


def resimulate(connection: Connection, *, sample: int, seed: int = 0) -> Resimulation:
    """Compute a random sample of the stored combinations again and compare.

    What was made on this kind of processor with this version of numba must come out bit for
    bit, anything else within the error of the solver. The sample is drawn from the sorted
    natural keys: equal databases give equal samples.

    Args:
        connection: the database, inside one transaction.
        sample: number of combinations; all there are when there are fewer.
        seed: of the random choice.
    """
    keys = keys_with_samples(connection, numerics_version=NUMERICS_VERSION)
    chosen = random.Random(seed).sample(keys, min(sample, len(keys)))
    here = made_on()
    exact = within_error = 0
    findings: list[Finding] = []
    for key in chosen:
        stored = stored_combination(connection, key)
        try:
            again = _compute(connection, stored)
        except RbfragError as error:
            findings.append(_finding(stored, f"cannot be computed again: {error}"))
            continue
        off = list(differences(stored, *again))
        if not off:
            exact += 1
            continue
        if stored.campaign_settings.get("made_on") != here:
            off = list(deviations(stored, *again))
            within_error += not off
        findings += (_finding(stored, problem) for problem in off)
    return Resimulation(
        sampled=len(chosen),
        exact=exact,
        within_error=within_error,
        eligible=len(keys),
        seed=seed,
        findings=tuple(findings),
    )


def _finding(stored: StoredCombination, problem: str) -> Finding:
    return Finding("combination", str(stored.id), problem, COMPUTE_AGAIN)


def _compute(
    connection: Connection, stored: StoredCombination
) -> tuple[CriticalResult, dict[float, SingleRun]]:
    values = stored.values
    if values["kind"] != "toppling":
        again = recompute_kind(connection, stored)
        searched = set(again.points.kr_over_pga.tolist())
        if extra := [k for k in stored.points.kr_over_pga.tolist() if k not in searched]:
            raise InputError(f"it holds a simulation at k/PGA {extra[0]!r} that no search makes")
        return again, {}
    motion = load_motion(connection, stored.motion_id)
    vertical = None
    if stored.vertical_motion_id is not None:
        vertical = load_motion(connection, stored.vertical_motion_id)
    result = critical(
        motion,
        p2=values["p2"],
        vertical=vertical,
        polarity=values["polarity"],
        linear=values["linear"],
        search_limit=values["search_limit"],
        full_map=stored.intervals.k_lo.size > 0,
        map_depth=stored.settings.get("map_depth", MAP_DEPTH),
    )
    searched = set(result.points.kr_over_pga.tolist())
    others = [k for k in stored.points.kr_over_pga.tolist() if k not in searched]
    return result, dict(_runs(stored, motion, vertical, others))


def _runs(
    stored: StoredCombination,
    motion: GroundMotion,
    vertical: GroundMotion | None,
    strengths: list[float],
) -> Iterator[tuple[float, SingleRun]]:
    """Yield the runs that were asked for beside the search, by k_r/PGA."""
    values = stored.values
    polarity, p2 = values["polarity"], values["p2"]
    grid = run_grid(excitation(motion, vertical, polarity), p2, strengths)
    for k, theta_n, outcome in zip(strengths, grid.theta_n.tolist(), grid.outcome, strict=True):
        kr = k * stored.pga_g
        alone = respond(motion, p2=p2, kr=kr, vertical=vertical, polarity=polarity)
        error = alone.error_estimate / math.atan(kr)
        yield k, SingleRun(outcome, None if math.isnan(theta_n) else theta_n, error)
