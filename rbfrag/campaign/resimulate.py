"""A random sample of what is stored, computed again: `rbfrag db check --sample`."""

from __future__ import annotations

import random
from dataclasses import dataclass

from sqlalchemy import Connection

from rbfrag.campaign.compare_results import ComputedAgain, deviations, differences, ends_of
from rbfrag.campaign.machine import made_on
from rbfrag.db.check.finding import COMPUTE_AGAIN, Finding
from rbfrag.db.motions import load_motion
from rbfrag.db.stored_combination import (
    StoredCombination,
    keys_with_samples,
    stored_combination,
)
from rbfrag.errors import RbfragError
from rbfrag.solver.kind import Case
from rbfrag.solver.kinds import model_of_kind
from rbfrag.solver.results import MAP_DEPTH, NUMERICS_VERSION


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
        off = list(differences(stored, again))
        if not off:
            exact += 1
            continue
        if stored.campaign_settings.get("made_on") != here:
            off = list(deviations(stored, again))
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


def _compute(connection: Connection, stored: StoredCombination) -> ComputedAgain:
    values = stored.values
    kind = model_of_kind(str(values["kind"]))
    case = Case(kind.kind, values["p2"], stored.block, stored.settings)
    polarity = values["polarity"]
    motion = load_motion(connection, stored.motion_id)
    vertical = None
    if stored.vertical_motion_id is not None:
        vertical = load_motion(connection, stored.vertical_motion_id)
    (found,) = kind.run_cases(
        motion,
        vertical,
        polarity,
        [case],
        search=values["status"] != "not_searched",
        grid=bool((stored.grid >= 0).any()),
        full_map=stored.intervals.k_lo.size > 0,
        map_depth=stored.campaign_settings.get("map_depth") or MAP_DEPTH,
    )
    ends = ends_of(found.grid)
    if found.critical is not None:
        ends = {**ends_of(found.critical.points), **ends}
    others = tuple(k for k in stored.points.kr_over_pga.tolist() if k not in ends)
    if others:
        ends |= ends_of(kind.run_blocks(motion, vertical, polarity, case, others))

    def error(k_over_pga: float) -> float:
        if "store_responses" not in kind.campaign_options:
            return 0.0
        alone = kind.history(motion, vertical, polarity, case, k_over_pga)
        if not alone.peak_theta_rad or alone.peak_theta_n is None:
            return 0.0
        return alone.error_estimate * alone.peak_theta_n / alone.peak_theta_rad

    return ComputedAgain(found.critical, ends, error)
