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
from typing import Any, Literal

import numpy as np

from rbfrag.errors import InputError
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.excitation import Excitation, excitation, motion_remarks
from rbfrag.solver.integrator.one_freedom.follow import Course, follow
from rbfrag.solver.kind import PLANES
from rbfrag.solver.mechanism import MechanismKind, ShakenMechanism, shaken_mechanism
from rbfrag.solver.quantity import number, positive
from rbfrag.solver.results import (
    SEARCH_LIMIT,
    CriticalResult,
    FloatArray,
    IntervalOutcome,
    Outcome,
    OutcomeIntervals,
    Polarity,
    SearchPoints,
    Status,
)

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

    def theta_n(self, critical_rad: float) -> float:
        """Return the peak over the critical rotation; NaN where the block is past recovery."""
        return math.nan if self.outcome is Outcome.TOPPLED else self.peak_rad / critical_rad


@dataclass(frozen=True, eq=False)
class Found:
    """What the search found of one record and block, before it is put in terms of k/PGA.

    Args:
        rotation_deg: rotation that counts as failure [deg]; None for failure past recovery.
        pga_g: PGA of the record as it is [g].
        yield_g: yield acceleration of the block [g].
        starts: factor at which the block first moves; None for a record that never drives it.
        scale_limit: greatest factor that the answer covers: that of k/PGA = 0.01, or the last
            safe one before the model ended.
        status: as of the answer.
        lower: lower end of the bracket of the scale (safe); None unless found.
        scale: upper end (fails); None unless found.
        ended: why the answer covers no more; empty if it goes on to k/PGA = 0.01.
        certified: whether a proof covers the scales between those that were looked at.
        reentrant: True when a stronger record was seen to spare the block.
        runs: all runs, by rising scale.
        warnings: sentences about an uncertain answer.
    """

    rotation_deg: float | None
    pga_g: float
    yield_g: float
    starts: float | None
    scale_limit: float
    status: Status = "no_motion"
    lower: float | None = None
    scale: float | None = None
    ended: str = ""
    certified: bool = False
    reentrant: bool = False
    runs: tuple[ScaledRun, ...] = ()
    warnings: tuple[str, ...] = ()

    def k_over_pga(self, scale: float) -> float:
        """Return the yield acceleration over the PGA of the scaled record."""
        return self.yield_g / (scale * self.pga_g)

    def points(self, critical_rad: float) -> SearchPoints:
        """Return the two runs of the bracket, or the last safe one, by falling k/PGA."""
        ends = (self.lower, self.scale, None if self.scale else self.scale_limit)
        kept = [run for run in self.runs if run.scale in ends]
        return SearchPoints(
            kr_over_pga=np.array([self.k_over_pga(run.scale) for run in kept]),
            theta_n=np.array([run.theta_n(critical_rad) for run in kept]),
            outcome=tuple(run.outcome.value for run in kept),
        )

    def intervals(self) -> OutcomeIntervals:
        """Return what was seen, by rising k/PGA: neighbours of one verdict, the gaps left out.

        Blocks that do not move, and those between them and the first that was looked at, are safe.
        Where the model ended before the block failed, nothing is said of stronger records, even if
        one of those that were looked at brought it down.
        """
        rows: list[tuple[float, float, IntervalOutcome]] = []
        before: ScaledRun | None = None
        at_rest = () if self.starts is None else (_at_rest(self.starts),)
        seen = [run for run in self.runs if self.scale is not None or run.scale <= self.scale_limit]
        for run in sorted((*seen, *at_rest), key=lambda each: -each.scale):
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


class ScaledKind(MechanismKind):
    """A kind whose critical value is the smallest factor on the record that brings a block down."""

    searchable = True
    search_needs = "block"
    search_options = ("block", *PLANES, "rotation_deg", "scan_ratio", "bracket")

    def critical(
        self,
        motion: GroundMotion,
        *,
        vertical: GroundMotion | None = None,
        polarity: Polarity = "forward",
        search_limit: float = SEARCH_LIMIT,
        rotation_deg: float | None = None,
        **options: Any,
    ) -> CriticalResult:
        """Return the smallest factor on a record that brings a block down.

        Options: `block` with `beta_deg`, `phi_deg`, `phi_back_deg`; `rotation_deg`, the peak
        rotation that counts as failure [deg], None for failure past recovery; `scan_ratio`;
        `bracket`. The vertical motion is scaled with the horizontal one.

        Raises:
            InputError: a value outside its range, a block of another mode, or one that no
                earthquake decides about.
        """
        self.refuse_foreign(options, self.search_options)
        for name in ("block", "beta_deg", "phi_deg"):
            if options.get(name) is None:
                raise InputError(
                    f"{name} is missing: shape, friction and dip of a block decide about "
                    f"{self.kind}"
                )
        (found,) = critical_scales(
            motion,
            options.pop("block"),
            kind=self.kind,
            rotations_deg=[rotation_deg],
            vertical=vertical,
            polarity=polarity,
            search_limit=search_limit,
            **options,
        )
        return found


def critical_scales(
    motion: GroundMotion,
    block: Block,
    *,
    kind: str,
    rotations_deg: Sequence[float | None],
    beta_deg: float,
    phi_deg: float,
    phi_back_deg: float | None = None,
    vertical: GroundMotion | None = None,
    polarity: Polarity = "forward",
    search_limit: float = SEARCH_LIMIT,
    scan_ratio: float = SCAN_RATIO,
    bracket: float = BRACKET,
) -> tuple[CriticalResult, ...]:
    """Return the smallest factors on a record that turn a block so far; they share their runs.

    Args:
        motion: horizontal ground motion.
        block: shape and size.
        kind: name of the model; the block's mode must be its.
        rotations_deg: peak rotations that count as failure [deg]; None among them for failure
            past recovery.
        beta_deg: dip of the base, out of the slope positive [deg].
        phi_deg: friction angle of the base [deg].
        phi_back_deg: friction angle of the back plane [deg]; None for that of the base.
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
    limit = positive(search_limit, "search_limit", "k/PGA")
    ratio = number(scan_ratio, "scan_ratio", "a ratio above 1")
    if not ratio > 1.0:
        raise InputError(f"scan_ratio = {ratio:g} is not above 1: give a ratio such as 1.05")
    width = positive(bracket, "bracket", "a width over the scale")
    shaken = shaken_mechanism(
        block, kind=kind, beta_deg=beta_deg, phi_deg=phi_deg, phi_back_deg=phi_back_deg
    )
    failures_rad = [rotation_rad(rotation_deg, shaken) for rotation_deg in rotations_deg]
    drive = excitation(motion, vertical, polarity)
    remarks = (*shaken.remarks, *motion_remarks(motion, vertical, drive))
    courses: dict[float, Course] = {}

    def runner(fails_rad: float) -> Callable[[float], ScaledRun]:
        def run(scale: float) -> ScaledRun:
            if scale not in courses:
                courses[scale] = follow(shaken.mechanism, drive.scaled(scale))
            return judged(courses[scale], scale, fails_rad)

        return run

    answers = []
    for rotation_deg, fails_rad in zip(rotations_deg, failures_rad, strict=True):
        found = Found(
            rotation_deg=rotation_deg,
            pga_g=drive.pga_g,
            yield_g=shaken.yield_g,
            starts=first_motion(drive, shaken.yield_g),
            scale_limit=shaken.yield_g / (limit * drive.pga_g) if drive.pga_g > 0.0 else math.inf,
        )
        if found.starts is None or found.starts >= found.scale_limit:
            found = replace(found, certified=True)
        else:
            found = _search(found, runner(fails_rad), ratio, width)
        answers.append(_answer(found, shaken, polarity, remarks))
    return tuple(answers)


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


def rotation_rad(rotation_deg: float | None, shaken: ShakenMechanism) -> float:
    """Return the rotation that counts as failure [rad]; infinite for failure past recovery."""
    if rotation_deg is None:
        return math.inf
    stated = math.radians(positive(rotation_deg, "rotation_deg", "degrees"))
    if stated >= shaken.most_rad:
        raise InputError(
            f"rotation_deg = {rotation_deg:g}: at {math.degrees(shaken.most_rad):.4g} degrees the "
            "back edge of the block lies on its base plane; give less, or leave it out for failure "
            "past recovery"
        )
    return stated


def critical_rad(shaken: ShakenMechanism) -> float:
    """Return the rotation without strength left, or at the end of the model [rad]."""
    critical = shaken.mechanism.critical
    if critical is not None:
        return critical
    highest = shaken.mechanism.first.highest
    return highest if math.isfinite(highest) else 0.5 * math.pi


def judged(course: Course, scale: float, fails_rad: float) -> ScaledRun:
    """Return a run with its verdict: whether it reaches the rotation that counts as failure."""
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


def grid_points(ratios: FloatArray, runs: Sequence[ScaledRun], critical_rad: float) -> SearchPoints:
    """Return the runs of an outcome grid; ``toppled`` where a block fails by its measure."""
    outcomes: dict[Verdict, str] = {
        "safe": Outcome.STABLE.value,
        "fails": Outcome.TOPPLED.value,
        "undecided": Outcome.UNDETERMINED.value,
    }
    return SearchPoints(
        kr_over_pga=ratios,
        theta_n=np.array([run.theta_n(critical_rad) for run in runs]),
        outcome=tuple(outcomes.get(run.verdict, run.outcome.value) for run in runs),
    )


def _search(nothing: Found, run: Callable[[float], ScaledRun], ratio: float, width: float) -> Found:
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
    nothing: Found,
    runs: list[ScaledRun],
    found: tuple[float, float] | None,
    limit: float,
    ended: str,
) -> Found:
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
        scale_limit=limit,
        ended=ended,
        reentrant=reentrant,
        runs=tuple(runs),
        warnings=tuple(warnings),
    )


def _answer(
    found: Found, shaken: ShakenMechanism, polarity: Polarity, remarks: tuple[str, ...]
) -> CriticalResult:
    k = None if found.scale is None else found.k_over_pga(found.scale)
    kr = None if k is None else k * found.pga_g
    critical = critical_rad(shaken)
    return CriticalResult(
        kind=shaken.kind,
        p2=shaken.p2,
        polarity=polarity,
        linear=False,
        pga_g=found.pga_g,
        status=found.status,
        search_limit=found.k_over_pga(found.scale_limit) if found.pga_g > 0.0 else SEARCH_LIMIT,
        kr_over_pga=k,
        lower=k,
        upper=None if found.lower is None else found.k_over_pga(found.lower),
        kr=kr,
        y_m_s=None if kr is None else kr * STANDARD_GRAVITY_M_S2 / math.sqrt(shaken.p2),
        certified=found.certified,
        k_up_over_pga=None if found.starts is None else found.k_over_pga(found.starts),
        undecided=None,
        island_width=None,
        kr_over_pga_resolved=None,
        reentrant=found.reentrant,
        n_runs=len(found.runs),
        warnings=(*remarks, *found.warnings),
        points=found.points(critical),
        intervals=found.intervals(),
        of_kind={
            "rotation_deg": found.rotation_deg,
            "scale": found.scale,
            "lower_scale": found.lower,
            "starts_scale": found.starts,
            "scale_limit": found.scale_limit,
            "yield_name": shaken.yield_name,
            "yield_g": shaken.yield_g,
            "leaves_g": shaken.leaves_g,
            "critical_rotation_rad": critical,
            "ended": found.ended,
            "runs": found.runs,
        },
    )
