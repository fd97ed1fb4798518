"""The weakest shaking that brings a block down: a search over the scale of the record.

The strength and the frequency parameter of a slumping block do not fix its motion, as those of a
toppling block do. What is searched is therefore the factor on the record, for one block. The
outcome need not be monotone in it: a stronger record may drive the block back in time. The search
goes up from the scale at which the block first moves, which is known in closed form, in equal
ratios, and closes in on the first scale that is not safe. What lies between two scales that were
looked at is not proven.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from rbfrag.errors import InputError
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.quality import quality_flags
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.excitation import Excitation, excitation
from rbfrag.solver.integrator.one_freedom.follow import Course, follow
from rbfrag.solver.quantity import number, positive
from rbfrag.solver.results import (
    SEARCH_LIMIT,
    CriticalResult,
    IntervalOutcome,
    Outcome,
    OutcomeIntervals,
    Polarity,
    SearchPoints,
    Status,
)
from rbfrag.solver.shaken_mechanism import ShakenMechanism, shaken_mechanism

SCAN_RATIO = 1.05
"""Ratio of two scales that are looked at one after the other; its square beyond the answer."""

BRACKET = 1e-6
"""Width of the bracket of the critical scale, over the scale."""

Verdict = Literal["safe", "fails", "outside", "undecided"]

_MAP_WORDS: dict[Verdict, IntervalOutcome] = {"safe": "safe", "fails": "topples"}


@dataclass(frozen=True, eq=False)
class ScaledRun:
    """One block under one scale of the record.

    Args:
        scale: factor on the record.
        peak_rad: peak rotation [rad].
        outcome: how the run ended.
        verdict: ``safe``; ``fails``; ``outside`` where the model ended first; ``undecided`` where
            the run is closer to its end than its error.
        sentence: what ended the model, empty where nothing did.
    """

    scale: float
    peak_rad: float
    outcome: Outcome
    verdict: Verdict
    sentence: str


@dataclass(frozen=True, eq=False)
class ScaledResult:
    """The critical scale of one record for one block.

    Args:
        kind: ``slumping`` or ``confined_toppling``.
        polarity: ``forward`` or ``reverse``.
        rotation_deg: rotation that counts as failure [deg]; None for failure past recovery.
        pga_g: PGA of the record as it is [g].
        yield_g: yield acceleration of the block [g].
        p2: its frequency parameter p_s² at rest [1/s²].
        leaves_g: k_h at which a contact opens as the motion starts [g].
        critical_rotation_rad: rotation without strength left, or at the end of the model [rad].
        status: ``found``; ``below_limit`` (nothing fails up to `scale_limit`); ``no_motion`` (the
            block does not move up to there).
        scale: smallest factor on the record known to bring the block down; None unless found.
        lower: lower end of the bracket of it (safe); None unless found.
        upper: upper end (fails); equals `scale`.
        starts: factor at which the block first moves; None for a record that never drives it.
        scale_limit: greatest factor that the answer covers: that of k/PGA = 0.01, or the last
            safe one before the model ended.
        ended: why the answer covers no more; empty if it goes on to k/PGA = 0.01.
        certified: False: what lies between the scales that were looked at is not proven.
        reentrant: True when a stronger record was seen to spare the block.
        n_runs: number of simulations made.
        runs: all of them, by rising scale.
        warnings: sentences about suspicious input or an uncertain answer.
    """

    kind: str
    polarity: Polarity
    rotation_deg: float | None
    pga_g: float
    yield_g: float
    p2: float
    leaves_g: float
    critical_rotation_rad: float
    status: Status
    scale: float | None
    lower: float | None
    upper: float | None
    starts: float | None
    scale_limit: float
    ended: str
    certified: bool
    reentrant: bool
    n_runs: int
    runs: tuple[ScaledRun, ...]
    warnings: tuple[str, ...]

    def k_over_pga(self, scale: float) -> float:
        """Return the yield acceleration over the PGA of the scaled record."""
        return self.yield_g / (scale * self.pga_g)

    @property
    def y_m_s(self) -> float | None:
        """Critical velocity k_s g/p_s over the scale [m/s]: what the record as it is can do."""
        if self.scale is None:
            return None
        return self.yield_g / self.scale * STANDARD_GRAVITY_M_S2 / math.sqrt(self.p2)

    @property
    def search_limit(self) -> float:
        """Least k/PGA that the answer covers."""
        return self.k_over_pga(self.scale_limit) if self.pga_g > 0.0 else SEARCH_LIMIT

    @property
    def points(self) -> SearchPoints:
        """The two runs of the bracket, or the last safe one, by falling k/PGA."""
        ends = (self.lower, self.upper, None if self.scale else self.scale_limit)
        kept = [run for run in self.runs if run.scale in ends]
        return SearchPoints(
            kr_over_pga=np.array([self.k_over_pga(run.scale) for run in kept]),
            theta_n=np.array(
                [
                    np.nan
                    if run.outcome is Outcome.TOPPLED
                    else run.peak_rad / self.critical_rotation_rad
                    for run in kept
                ]
            ),
            outcome=tuple(run.outcome.value for run in kept),
        )

    @property
    def intervals(self) -> OutcomeIntervals:
        """What was seen, by rising k/PGA: neighbours of one verdict, the gaps left out.

        Blocks that do not move, and those between them and the first that was looked at, are safe.
        Where the model ended before the block failed, nothing is told of stronger records, even if
        one of those that were looked at brought it down.
        """
        rows: list[tuple[float, float, IntervalOutcome]] = []
        before: ScaledRun | None = None
        still = () if self.starts is None else (_at_rest(self.starts),)
        told = [run for run in self.runs if self.scale is not None or run.scale <= self.scale_limit]
        for run in sorted((*told, *still), key=lambda each: -each.scale):
            word = _MAP_WORDS.get(run.verdict)
            if word is not None:
                k = self.k_over_pga(run.scale)
                if rows and before is not None and before.verdict == run.verdict:
                    rows[-1] = (rows[-1][0], k, word)
                else:
                    rows.append((k, k, word))
            before = run
        rows = [row for row in rows if row[1] > row[0]]
        return OutcomeIntervals(
            k_lo=np.array([row[0] for row in rows], dtype=np.float64),
            k_hi=np.array([row[1] for row in rows], dtype=np.float64),
            outcome=tuple(row[2] for row in rows),
        )


def critical_scale(
    motion: GroundMotion,
    block: Block,
    *,
    beta_deg: float,
    phi_deg: float,
    phi_back_deg: float | None = None,
    kind: str = "slumping",
    rotation_deg: float | None = None,
    vertical: GroundMotion | None = None,
    polarity: Polarity = "forward",
    search_limit: float = SEARCH_LIMIT,
    scan_ratio: float = SCAN_RATIO,
    bracket: float = BRACKET,
) -> ScaledResult:
    """Return the smallest factor on a record that brings a block down.

    Args:
        motion: horizontal ground motion.
        block: shape and size.
        beta_deg: dip of the base, out of the slope positive [deg].
        phi_deg: friction angle of the base [deg].
        phi_back_deg: friction angle of the back plane [deg]; None for that of the base.
        kind: ``slumping`` or ``confined_toppling``; the block's mode must be that one.
        rotation_deg: peak rotation that counts as failure [deg]; None for failure past recovery.
        vertical: vertical motion of the same recording, upward positive; scaled with the
            horizontal one.
        polarity: ``forward`` or ``reverse``.
        search_limit: least k/PGA that is looked at.
        scan_ratio: ratio of two scales that are looked at one after the other, above 1; beyond
            the answer its square.
        bracket: width of the bracket over the scale.

    Raises:
        InputError: a value outside its range, a block of another mode, or one that no earthquake
            decides about.
    """
    (found,) = critical_scales(
        motion,
        block,
        rotations_deg=[rotation_deg],
        beta_deg=beta_deg,
        phi_deg=phi_deg,
        phi_back_deg=phi_back_deg,
        kind=kind,
        vertical=vertical,
        polarity=polarity,
        search_limit=search_limit,
        scan_ratio=scan_ratio,
        bracket=bracket,
    )
    return found


def critical_scales(
    motion: GroundMotion,
    block: Block,
    *,
    rotations_deg: Sequence[float | None],
    beta_deg: float,
    phi_deg: float,
    phi_back_deg: float | None = None,
    kind: str = "slumping",
    vertical: GroundMotion | None = None,
    polarity: Polarity = "forward",
    search_limit: float = SEARCH_LIMIT,
    scan_ratio: float = SCAN_RATIO,
    bracket: float = BRACKET,
) -> tuple[ScaledResult, ...]:
    """Return the same for several rotations that count as failure; they share their runs.

    Args:
        motion: horizontal ground motion.
        block: shape and size.
        rotations_deg: the rotations [deg]; None among them for failure past recovery.
        beta_deg: the others as for :func:`critical_scale`, whose answers these are.
        phi_deg: likewise.
        phi_back_deg: likewise.
        kind: likewise.
        vertical: likewise.
        polarity: likewise.
        search_limit: likewise.
        scan_ratio: likewise.
        bracket: likewise.

    Raises:
        InputError: as for :func:`critical_scale`.
    """
    limit = positive(search_limit, "search_limit", "k/PGA")
    ratio = number(scan_ratio, "scan_ratio", "a ratio above 1")
    if not ratio > 1.0:
        raise InputError(f"scan_ratio = {ratio:g} is not above 1: give a ratio such as 1.05")
    width = positive(bracket, "bracket", "a width over the scale")
    shaken = shaken_mechanism(
        block, kind=kind, beta_deg=beta_deg, phi_deg=phi_deg, phi_back_deg=phi_back_deg
    )
    failures_rad = [_rotation_rad(rotation_deg, shaken) for rotation_deg in rotations_deg]
    drive = excitation(motion, vertical, polarity)
    remarks = [*shaken.remarks, *motion.remarks]
    remarks += [flag.sentence for flag in quality_flags(motion)]
    if vertical is not None:
        remarks += [f"vertical: {flag.sentence}" for flag in quality_flags(vertical)]
    remarks += drive.warnings
    nothing = ScaledResult(
        kind=kind,
        polarity=polarity,
        rotation_deg=None,
        pga_g=drive.pga_g,
        yield_g=shaken.yield_g,
        p2=shaken.p2,
        leaves_g=shaken.leaves_g,
        critical_rotation_rad=_critical_rad(shaken),
        status="no_motion",
        scale=None,
        lower=None,
        upper=None,
        starts=first_motion(drive, shaken.yield_g),
        scale_limit=shaken.yield_g / (limit * drive.pga_g) if drive.pga_g > 0.0 else math.inf,
        ended="",
        certified=False,
        reentrant=False,
        n_runs=0,
        runs=(),
        warnings=tuple(remarks),
    )
    courses: dict[float, Course] = {}

    def runner(fails_rad: float) -> Callable[[float], ScaledRun]:
        def run(scale: float) -> ScaledRun:
            if scale not in courses:
                courses[scale] = follow(shaken.mechanism, drive.scaled(scale))
            return _judged(courses[scale], scale, fails_rad)

        return run

    found = []
    for rotation_deg, fails_rad in zip(rotations_deg, failures_rad, strict=True):
        empty = replace(nothing, rotation_deg=rotation_deg)
        if empty.starts is None or empty.starts >= empty.scale_limit:
            found.append(replace(empty, certified=True))
        else:
            found.append(_search(empty, runner(fails_rad), ratio, width))
    return tuple(found)


def first_motion(drive: Excitation, yield_g: float) -> float | None:
    """Return the least factor on an excitation at which a block of that yield moves.

    The block moves where s k_h > (1 + s k_v) k, that is s > k/(k_h - k k_v); between two nodes the
    denominator is linear, so that its greatest value is at a node.

    Args:
        drive: the excitation, both components scaled together.
        yield_g: yield acceleration where 1 + k_v = 1 [g].
    """
    most = float(np.max(drive.k_h - yield_g * (drive.w - 1.0)))
    return yield_g / most if most > 0.0 else None


def _at_rest(scale: float) -> ScaledRun:
    return ScaledRun(scale, 0.0, Outcome.STABLE, "safe", "")


def _rotation_rad(rotation_deg: float | None, shaken: ShakenMechanism) -> float:
    if rotation_deg is None:
        return math.inf
    stated = math.radians(positive(rotation_deg, "rotation_deg", "degrees"))
    highest = shaken.mechanism.first.highest
    if shaken.kind == "slumping" and stated >= highest:
        raise InputError(
            f"rotation_deg = {rotation_deg:g}: at {math.degrees(highest):.4g} degrees the back "
            "edge of the block lies on its base plane; give less, or leave it out for failure "
            "past recovery"
        )
    return stated


def _critical_rad(shaken: ShakenMechanism) -> float:
    critical = shaken.mechanism.critical
    if critical is not None:
        return critical
    highest = shaken.mechanism.first.highest
    return highest if math.isfinite(highest) else 0.5 * math.pi


def _judged(course: Course, scale: float, fails_rad: float) -> ScaledRun:
    return ScaledRun(
        scale, course.peak, course.outcome, _verdict(course, fails_rad), _ending(course)
    )


def _verdict(course: Course, fails_rad: float) -> Verdict:
    if course.outcome is Outcome.TOPPLED or course.peak - course.error >= fails_rad:
        return "fails"
    if course.outcome is Outcome.UNDETERMINED or course.peak + course.error >= fails_rad:
        return "undecided"
    return "safe" if course.outcome is Outcome.STABLE else "outside"


def _ending(course: Course) -> str:
    if course.outcome in (Outcome.STABLE, Outcome.TOPPLED):
        return ""
    return course.sentences[-1] if course.sentences else course.outcome.advice


def _search(
    nothing: ScaledResult, run: Callable[[float], ScaledRun], ratio: float, width: float
) -> ScaledResult:
    """Scan upward, close in on the first scale that is not safe, and look further."""
    assert nothing.starts is not None
    runs: list[ScaledRun] = []
    safe, limit = nothing.starts, nothing.scale_limit
    first: ScaledRun | None = None
    while first is None and safe < limit:
        scale = min(safe * ratio, limit)
        runs.append(run(scale))
        if runs[-1].verdict == "safe":
            safe = scale
        else:
            first = runs[-1]
    if first is None:
        return _result(nothing, runs, None, limit, "")
    while first.scale - safe > width * first.scale:
        middle = 0.5 * (safe + first.scale)
        if not safe < middle < first.scale:
            break
        runs.append(run(middle))
        if runs[-1].verdict == "safe":
            safe = middle
        else:
            first = runs[-1]
    if first.verdict == "fails":
        scale = first.scale
        while scale < limit:
            scale = min(scale * ratio * ratio, limit)
            runs.append(run(scale))
            if runs[-1].verdict == "outside":
                break
        return _result(nothing, runs, (safe, first.scale), limit, "")
    return _result(nothing, runs, None, safe, first.sentence or first.outcome.advice)


def _result(
    nothing: ScaledResult,
    runs: list[ScaledRun],
    found: tuple[float, float] | None,
    limit: float,
    ended: str,
) -> ScaledResult:
    runs = sorted(runs, key=lambda each: each.scale)
    warnings = list(nothing.warnings)
    if ended:
        warnings.append(
            f"beyond {limit:.6g} times the record the model has no answer ({ended}): whether the "
            "block fails there is not known"
        )
    if any(each.verdict == "undecided" for each in runs):
        warnings.append("some runs end closer to failure than their error: they count as not safe")
    reentrant = found is not None and any(
        each.verdict == "safe" and each.scale > found[1] for each in runs
    )
    return replace(
        nothing,
        status="below_limit" if found is None else "found",
        scale=None if found is None else found[1],
        lower=None if found is None else found[0],
        upper=None if found is None else found[1],
        scale_limit=limit,
        ended=ended,
        reentrant=reentrant,
        n_runs=len(runs),
        runs=tuple(runs),
        warnings=tuple(warnings),
    )


def as_critical_result(found: ScaledResult) -> CriticalResult:
    """Return a critical scale in the terms of toppling, as it is stored.

    k/PGA takes the place of k_r/PGA: the yield acceleration over the PGA of the scaled record. The
    critical k is that over the critical scale, which the record as it is brings down.
    """
    k = None if found.scale is None else found.k_over_pga(found.scale)
    safe = None if found.lower is None else found.k_over_pga(found.lower)
    kr = None if k is None else k * found.pga_g
    return CriticalResult(
        p2=found.p2,
        polarity=found.polarity,
        linear=False,
        pga_g=found.pga_g,
        status=found.status,
        search_limit=found.search_limit,
        kr_over_pga=k,
        lower=k,
        upper=safe,
        kr=kr,
        y_m_s=None if kr is None else kr * STANDARD_GRAVITY_M_S2 / math.sqrt(found.p2),
        certified=found.certified,
        k_up_over_pga=None if found.starts is None else found.k_over_pga(found.starts),
        undecided=None,
        island_width=None,
        kr_over_pga_resolved=None,
        reentrant=found.reentrant,
        n_runs=found.n_runs,
        warnings=found.warnings,
        points=found.points,
        intervals=found.intervals,
    )
