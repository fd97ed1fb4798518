"""The check of a database with a sample computed again: `rbfrag db check`."""

from __future__ import annotations

import math
import os
import random
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

from sqlalchemy import Connection

from rbfrag.campaign.kind import Case, CaseRequest, SingleBlockCampaign
from rbfrag.campaign.kinds import campaign_of_kind
from rbfrag.campaign.runner import processor_and_compiler
from rbfrag.campaign.sequences import PairWork, SequenceTask, run_pair
from rbfrag.db.campaigns import StoredCombination, keys_with_samples, stored_combination
from rbfrag.db.check import accept_rows, check_database, coverage, mark_sound
from rbfrag.db.check_results import (
    BORDER_ERROR,
    COMPUTE_AGAIN,
    ROTATION_ERROR,
    Damage,
    contradictions,
)
from rbfrag.db.engine import opened_database
from rbfrag.db.insert import utc_now
from rbfrag.db.motions import load_motion
from rbfrag.db.rows import Interval, Point
from rbfrag.db.shock_pairs import (
    PARTS,
    ShockEnd,
    StoredShockPair,
    pair_keys_with_samples,
    stored_shock_pairs,
)
from rbfrag.errors import RbfragError
from rbfrag.results.numbers import count_of
from rbfrag.results.result import Result, TextLine
from rbfrag.solver.critical_result import CriticalResult
from rbfrag.solver.kind import Shaking
from rbfrag.solver.results import MAP_DEPTH, NUMERICS_VERSION, SearchPoints


@dataclass(frozen=True, eq=False, repr=False)
class DatabaseCheck(Result):
    """The damage of a database.

    Args:
        findings: damage that was found.
        accepted: rows that were accepted as complete.
        resimulated: the sample that was computed again; None without one.
        covered: a sentence on what the check covers.
    """

    findings: Sequence[Damage]
    accepted: Sequence[Damage]
    resimulated: Resimulation | None
    covered: str
    warnings: tuple[str, ...] = ()

    @property
    def is_sound(self) -> bool:
        """True if no damage was found."""
        return not self.findings

    def sentences(self) -> Iterator[str]:
        """Yield the number of damaged rows."""
        number = count_of(len(self.findings), "problem")
        yield "no damage found" if self.is_sound else f"{number} found"

    def lines(self) -> Iterator[TextLine]:
        """Yield the damage with advice, the sample that was computed again, and the coverage."""
        for label, rows in (("Damage", self.findings), ("Accepted", self.accepted)):
            for row in rows:
                yield TextLine(label, f"{row.table} {row.row}: {row.problem}")
        for advice in dict.fromkeys(finding.advice for finding in self.findings):
            yield TextLine("Advice", advice)
        if (sample := self.resimulated) is not None:
            yield TextLine(
                "Sample",
                f"{sample.sampled:,} of {count_of(sample.eligible, 'combination')} computed again: "
                f"{sample.exact:,} equal, {sample.within_error:,} within the error of the solver",
            )
        yield TextLine("Covered", self.covered)

    def as_dict(self) -> dict[str, Any]:
        """Return the answer under the keys of the JSON contract."""
        sample = None if self.resimulated is None else asdict(self.resimulated)
        if sample is not None:
            del sample["findings"]
        return {
            "sound": self.is_sound,
            "findings": [asdict(finding) for finding in self.findings],
            "accepted": [asdict(row) for row in self.accepted],
            "resimulated": sample,
            "covered": self.covered,
            "warnings": list(self.warnings),
        }


def check_with_sample(
    db: str | os.PathLike[str] | None, *, sample: int, seed: int, accept: bool
) -> DatabaseCheck:
    """Check a database, and compute a random sample of its combinations again.

    A database without damage is marked as sound.

    Args:
        db: the database (path, URL, or None for the default).
        sample: number of combinations; 0 for none.
        seed: seed of the random sample.
        accept: accept the rows present as complete, after a loss.
    """
    begun, again = utc_now(), None
    accepted = accept_rows(db) if accept else []
    with opened_database(db, read_only=True) as engine, engine.connect() as connection:
        findings = check_database(connection)
        covered = coverage(connection)
        if sample:
            try:
                again = resimulate(connection, sample=sample, seed=seed)
                findings += again.findings
            except Exception as error:
                if not findings:
                    raise
                # a damaged row can raise any error there, and is among the findings already
                why = f"{type(error).__name__}: {error}"
                findings.append(Damage("database", "-", f"computing again broke off ({why})"))
    if not findings:
        mark_sound(db, begun)
    return DatabaseCheck(findings, accepted, again, covered)


_VALUES = (
    "status", "kr_over_pga", "lower", "upper", "kr", "y_m_s", "certified", "k_up_over_pga",
    "undecided", "island_width", "kr_over_pga_resolved", "reentrant", "n_runs",
)  # fmt: skip


@dataclass(frozen=True)
class Resimulation:
    """Result of the repeated computation of a sample.

    Args:
        sampled: combinations, and blocks under two motions, computed again.
        exact: of these, equal bit for bit.
        within_error: equal within the error of the solver, made on another machine.
        eligible: combinations of the present numerics whose samples are stored.
    """

    sampled: int
    exact: int
    within_error: int
    eligible: int
    seed: int
    findings: tuple[Damage, ...]


def resimulate(connection: Connection, *, sample: int, seed: int = 0) -> Resimulation:
    """Compute a random sample of combinations and motion pairs again, and compare.

    What was made on this kind of processor with this version of numba must come out bit for
    bit, anything else within the error of the solver. The sample is drawn from the sorted
    natural keys: equal databases give equal samples.

    Args:
        sample: number of combinations; all there are when there are fewer.
    """
    keys = keys_with_samples(connection, numerics_version=NUMERICS_VERSION)
    pairs = pair_keys_with_samples(connection, numerics_version=NUMERICS_VERSION)
    of_pairs = set(pairs)
    keys = sorted([*keys, *pairs])
    chosen = random.Random(seed).sample(keys, min(sample, len(keys)))
    processor = processor_and_compiler()
    exact = within_error = 0
    findings: list[Damage] = []
    for key in chosen:
        if key in of_pairs:
            (pair,) = stored_shock_pairs(connection, [key])
            off = _pair_differences(connection, pair, exactly=True)
            exact += not off
            if off and pair.processor != processor:
                off = _pair_differences(connection, pair, exactly=False)
                within_error += not off
            findings += (
                Damage("shock_pair", str(pair.id), problem, COMPUTE_AGAIN) for problem in off
            )
            continue
        stored = stored_combination(connection, key)
        try:
            again = _compute(connection, stored)
        except RbfragError as error:
            problem = f"cannot be computed again: {error}"
            findings.append(Damage("combination", str(stored.id), problem, COMPUTE_AGAIN))
            continue
        off = list(differences(stored, again))
        if not off:
            exact += 1
            continue
        if stored.campaign_settings.get("made_on") != processor:
            off = list(deviations(stored, again))
            within_error += not off
        findings += (
            Damage("combination", str(stored.id), problem, COMPUTE_AGAIN) for problem in off
        )
    return Resimulation(len(chosen), exact, within_error, len(keys), seed, tuple(findings))


def _pair_differences(connection: Connection, pair: StoredShockPair, *, exactly: bool) -> list[str]:
    """Return the differences of a repeated computation of a block under two motions."""
    then = pair.record
    first, second = (
        load_motion(connection, row) for row in (then.first_motion_id, then.second_motion_id)
    )
    task = SequenceTask(then.natural_key, then.polarity, then.block)
    work = PairWork(
        then.kind, then.first_motion_id, then.second_motion_id, then.pairing, first, second, (task,)
    )
    try:
        (now,) = run_pair(work).records
    except RbfragError as error:
        return [f"cannot be computed again: {error}"]
    return [
        f"{part}_{name} is {old!r}, computed again {new!r}"
        for part in PARTS
        for name, old, new in zip(
            ShockEnd._fields, getattr(then, part), getattr(now, part), strict=True
        )
        if old != new and (exactly or isinstance(old, str) or not _close(old, new))
    ]


def _compute(connection: Connection, stored: StoredCombination) -> ComputedAgain:
    values = stored.values
    kind = campaign_of_kind(str(values["kind"]))
    case = Case(kind.kind, values["p2"], stored.block, stored.settings)
    motion = load_motion(connection, stored.motion_id)
    vertical = None
    if stored.vertical_motion_id is not None:
        vertical = load_motion(connection, stored.vertical_motion_id)
    shaking = Shaking(motion, vertical, values["polarity"])
    request = CaseRequest(
        search=values["status"] != "not_searched",
        grid=bool((stored.grid >= 0).any()),
        full_map=stored.intervals.k_lo.size > 0,
        map_depth=stored.campaign_settings.get("map_depth") or MAP_DEPTH,
    )
    (answer,) = kind.run_cases(shaking, [case], request)
    ends = ends_of(answer.grid)
    if answer.critical is not None:
        ends = {**ends_of(answer.critical.points), **ends}
    missing = tuple(k for k in stored.points.kr_over_pga.tolist() if k not in ends)
    if missing and isinstance(kind, SingleBlockCampaign):
        ends |= ends_of(kind.run_blocks(shaking, case, missing))

    def error(k_over_pga: float) -> float:
        if not isinstance(kind, SingleBlockCampaign):
            return 0.0
        alone = kind.history(shaking, case, k_over_pga)
        if not alone.peak_theta_rad or alone.peak_theta_n is None or not alone.error_estimate:
            return 0.0
        return alone.error_estimate * alone.peak_theta_n / alone.peak_theta_rad

    return ComputedAgain(answer.critical, ends, error)


@dataclass(frozen=True)
class ComputedAgain:
    """Result of the present solver for a stored combination.

    Args:
        critical: the search; None where the kind has none.
        ends: how each simulated block ended, by k/PGA.
        error: bound on the error of θ_n of one block, by k/PGA: one more run.
    """

    critical: CriticalResult | None
    ends: Mapping[float, Point]
    error: Callable[[float], float] = field(default=lambda _: 0.0)


def ends_of(points: SearchPoints | None) -> dict[float, Point]:
    """Return the final states of simulated blocks, by k/PGA."""
    if points is None:
        return {}
    slid, sensitive = points.displacement_m, points.sensitive
    rows = zip(
        points.kr_over_pga.tolist(),
        points.outcome,
        points.theta_n.tolist(),
        [math.nan] * len(points.outcome) if slid is None else slid.tolist(),
        [None] * len(points.outcome) if sensitive is None else sensitive.tolist(),
        strict=True,
    )
    return {
        k: Point(k, _number(theta), str(word), _number(at), None, flips)
        for k, word, theta, at, flips in rows
    }


def differences(stored: StoredCombination, again: ComputedAgain) -> Iterator[str]:
    """Yield every value that is not bit-identical, and contradictory maps."""
    critical = again.critical
    if critical is not None:
        for name in _VALUES:
            then, now = stored.values[name], getattr(critical, name)
            if then != now:
                yield f"{name} is {then!r}, computed again {now!r}"
        yield from _map_differences(stored, critical)
    then_at = ends_of(stored.points)
    for k in sorted(then_at.keys() | again.ends.keys(), reverse=True):
        if k not in then_at:
            yield f"the simulation at kr/PGA {k!r} is missing"
        elif then_at[k] != again.ends.get(k):
            yield (
                f"the simulation at kr/PGA {k!r} is {_described(then_at[k])}, computed again "
                f"{_described(again.ends.get(k))}"
            )


def deviations(stored: StoredCombination, again: ComputedAgain) -> Iterator[str]:
    """Yield differences larger than the error of the solver."""
    values, critical = stored.values, again.critical
    borders: list[float] = []
    if critical is not None:
        if values["status"] != critical.status:
            yield f"status is {values['status']!r}, computed again {critical.status!r}"
            return
        if critical.status == "found":
            low = max(values["lower"], critical.lower or 0.0)
            high = min(values["upper"], critical.upper or math.inf)
            if low > high * (1.0 + BORDER_ERROR):
                yield (
                    f"its bracket {values['lower']!r} to {values['upper']!r} does not meet the one "
                    f"computed again, {critical.lower!r} to {critical.upper!r}"
                )
        yield from _map_differences(stored, critical)
        borders = [*critical.intervals.k_lo.tolist(), *critical.intervals.k_hi.tolist()]
        borders += [edge for edge in (critical.lower, critical.upper) if edge is not None]
    for k, then in ends_of(stored.points).items():
        if k not in again.ends:
            continue
        now = again.ends[k]
        theta, theta_now = then.theta_n, now.theta_n
        if then.outcome != now.outcome:
            # another processor's last bits turn a sensitive outcome as other motions do
            if not (
                then.sensitive
                or now.sensitive
                or any(math.isclose(k, at, rel_tol=BORDER_ERROR) for at in borders)
            ):
                yield (
                    f"the simulation at kr/PGA {k!r} is {then.outcome}, computed again "
                    f"{now.outcome}"
                )
        # where outcomes may be sensitive the size of peaks may be chaotic
        elif (
            then.sensitive is None
            and not _close(theta, theta_now)
            and (theta is None or theta_now is None or abs(theta - theta_now) > again.error(k))
        ):
            yield (
                f"the simulation at kr/PGA {k!r} reaches {theta!r} of the critical angle, "
                f"computed again {theta_now!r}"
            )
        elif not _close(then.displacement_m, now.displacement_m):
            yield (
                f"the block of ky/PGA {k!r} slides {then.displacement_m!r} m, computed again "
                f"{now.displacement_m!r}"
            )


def _map_differences(stored: StoredCombination, critical: CriticalResult) -> Iterator[str]:
    first, other = (
        list(map(Interval, map_.k_lo.tolist(), map_.k_hi.tolist(), map_.outcome))
        for map_ in (stored.intervals, critical.intervals)
    )
    for low, high, then, now in contradictions(first, other):
        yield f"its map says {then} from kr/PGA {low!r} to {high!r}, computed again {now}"


def _described(end: Point | None) -> object:
    if end is None:
        return "none"
    parts: list[object] = [end.outcome, end.theta_n]
    if end.displacement_m is not None:
        parts.append(f"{end.displacement_m!r} m")
    if end.sensitive is not None:
        parts.append("sensitive" if end.sensitive else "not sensitive")
    return tuple(parts)


def _close(then: float | None, now: float | None) -> bool:
    if then is None or now is None:
        return then is now
    return math.isclose(then, now, rel_tol=ROTATION_ERROR, abs_tol=1e-12)


def _number(value: float) -> float | None:
    return None if math.isnan(value) else value
