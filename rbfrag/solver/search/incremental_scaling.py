"""Incremental scaling of a record to the weakest shaking at which a block fails (compare
incremental dynamic analysis, Vamvatsikos and Cornell 2002).

The strength and the frequency parameter of a slumping block do not fix its motion, as those of a
toppling block do. What is searched is therefore the factor on the record, for one block. The
outcome need not be monotone in it: a stronger record may drive the block back in time. The search
goes up from the scale at which the block first moves, which is known in closed form, in equal
ratios, and closes in on the first scale that is not safe. What lies between two scales that were
looked at is not proven. Where runs end closer to failure than their error, as those do that go on
step by step, the bracket reaches from the last safe scale to the first that fails.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal, NamedTuple

import numpy as np

from rbfrag.errors import InputError
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.results.diagnostic import Diagnostic
from rbfrag.solver.critical_result import CriticalScale
from rbfrag.solver.excitation import Excitation
from rbfrag.solver.kind import Shaking
from rbfrag.solver.quantity import number, positive
from rbfrag.solver.results import (
    SEARCH_LIMIT,
    FloatArray,
    IntervalOutcome,
    Outcome,
    OutcomeIntervals,
    Polarity,
    SearchPoints,
    Status,
)
from rbfrag.solver.simulation import MechanismKind, ShakenMechanism, Simulation, shaken_mechanism

SCAN_RATIO = 1.05
"""Ratio of two scales that are looked at one after the other; its square beyond the answer."""

BRACKET = 1e-6
"""Width of the bracket of the critical scale, over the scale."""

NOT_PROVEN = Diagnostic(
    "the scale is the smallest that was seen to fail: the scales between those that were looked "
    "at (5 % apart) are not proven safe",
    "not_certified",
)

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
        lost_contact: whether the block was followed past a lost contact.
    """

    scale: float
    peak_rad: float
    outcome: Outcome
    verdict: Verdict
    sentence: str
    lost_contact: bool = False

    def theta_n(self, critical_rad: float) -> float:
        """Return the peak over the critical rotation; NaN where the block is past recovery."""
        return math.nan if self.outcome is Outcome.TOPPLED else self.peak_rad / critical_rad


@dataclass(frozen=True, eq=False)
class ScaleSearch:
    """Result of the search for one record and block, in terms of the scale.

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
        ends_runs = [run for run in self.runs if run.scale in ends]
        return SearchPoints(
            kr_over_pga=np.array([self.k_over_pga(run.scale) for run in ends_runs]),
            theta_n=np.array([run.theta_n(critical_rad) for run in ends_runs]),
            outcome=tuple(run.outcome.value for run in ends_runs),
        )

    def intervals(self) -> OutcomeIntervals:
        """Return the outcomes by rising k/PGA, merged where neighbours agree; gaps are omitted.

        Blocks that do not move, and those between them and the first that was looked at, are safe.
        Where the model ended before the block failed, nothing is said of stronger records, even if
        one of those that were looked at brought it down.
        """
        rows: list[tuple[float, float, IntervalOutcome]] = []
        before: ScaledRun | None = None
        rests = () if self.starts is None else (self.starts,)
        at_rest = [ScaledRun(scale, 0.0, Outcome.STABLE, "safe", "") for scale in rests]
        seen = [run for run in self.runs if self.scale is not None or run.scale <= self.scale_limit]
        for run in sorted((*seen, *at_rest), key=lambda item: -item.scale):
            word = _MAP_WORDS.get(run.verdict)
            if word is not None:
                k = self.k_over_pga(run.scale)
                if rows and before is not None and before.verdict == run.verdict:
                    rows[-1] = (rows[-1][0], k, word)
                else:
                    rows.append((k, k, word))
            before = run
        # a run alone says nothing of its neighbourhood
        rows = [row for row in rows if row[1] > row[0]]
        return OutcomeIntervals(
            k_lo=np.array([row[0] for row in rows], dtype=np.float64),
            k_hi=np.array([row[1] for row in rows], dtype=np.float64),
            outcome=tuple(row[2] for row in rows),
        )


class ScaledKind(MechanismKind):
    """A kind whose critical value is the smallest factor on the record at which a block fails."""

    def critical(
        self,
        motion: GroundMotion,
        *,
        vertical: GroundMotion | None = None,
        polarity: Polarity = "forward",
        search_limit: float = SEARCH_LIMIT,
        rotation_deg: float | None = None,
        **options: Any,
    ) -> CriticalScale:
        """Return the smallest factor on a record at which a block fails.

        Options: `block` with `beta_deg`, `phi_deg`, `phi_back_deg`; `rotation_deg`, the peak
        rotation that counts as failure [deg], None for failure past recovery; `scan_ratio`;
        `bracket`. The vertical motion is scaled with the horizontal one.

        Raises:
            InputError: a value outside its range, a block of another mode, or one that no
                earthquake decides about.
        """
        # k_s and p_s² do not fix the motion of these blocks, as k_r and p² do for toppling: the
        # search is over the factor on the record for one block, not over the strength
        self.reject_foreign(options, self.search_options)
        for name in ("block", "beta_deg", "phi_deg"):
            if options.get(name) is None:
                raise InputError(
                    f"{name} is missing: {self.kind} requires geometry, friction and dip of a block"
                )
        rules = scan_rules(
            search_limit, options.pop("scan_ratio", SCAN_RATIO), options.pop("bracket", BRACKET)
        )
        shaken = shaken_mechanism(self, options.pop("block"), **options)
        shaking = Shaking(motion, vertical, polarity)
        fails_rad = rotation_rad(rotation_deg)
        excited = shaking.excitation
        pga_g = excited.pga_g
        scale_limit = shaken.yield_g / (rules.search_limit * pga_g) if pga_g > 0.0 else math.inf
        starts = first_motion(excited, shaken.yield_g)

        def run(scale: float) -> ScaledRun:
            return scaled_run(shaken.run(excited.scaled(scale)), scale, fails_rad)

        start = ScaleSearch(rotation_deg, pga_g, shaken.yield_g, starts, scale_limit)
        if starts is None or starts >= scale_limit:
            # nothing moves below the limit: the closed form of the first motion is the proof
            return _answer(replace(start, certified=True), shaken, shaking)
        return _answer(_search(start, run, rules), shaken, shaking)


class ScanRules(NamedTuple):
    """Range and resolution of the scan over scales.

    Args:
        search_limit: least k/PGA that is looked at: the greatest scale.
        ratio: ratio of two scales that are looked at one after the other, above 1; beyond the
            answer its square.
        bracket: width of the bracket of the critical scale, over the scale.
    """

    search_limit: float
    ratio: float
    bracket: float


def scan_rules(search_limit: float, scan_ratio: float, bracket: float) -> ScanRules:
    """Return the rules of a search.

    Raises:
        InputError: a value outside its range.
    """
    limit = positive(search_limit, "search_limit", "k/PGA")
    ratio = number(scan_ratio, "scan_ratio", "a ratio above 1")
    if not ratio > 1.0:
        raise InputError(f"scan_ratio = {ratio:g} is not above 1: give a ratio such as 1.05")
    return ScanRules(limit, ratio, positive(bracket, "bracket", "a width over the scale"))


def first_motion(excited: Excitation, yield_g: float) -> float | None:
    """Return the smallest factor on an excitation at which a block of that yield moves.

    The block moves where s k_h > (1 + s k_v) k, that is s > k/(k_h - k k_v); between two nodes the
    denominator is linear, so that its greatest value is at a node.

    Args:
        excited: the excitation, both components scaled together.
        yield_g: yield acceleration where 1 + k_v = 1 [g].
    """
    most = float(np.max(excited.k_h - yield_g * (excited.w - 1.0)))
    return yield_g / most if most > 0.0 else None


def rotation_rad(rotation_deg: float | None) -> float:
    """Return the rotation that counts as failure [rad]; infinite for failure past recovery."""
    if rotation_deg is None:
        return math.inf
    return math.radians(positive(rotation_deg, "rotation_deg", "degrees"))


def critical_rad(shaken: ShakenMechanism) -> float:
    """Return the rotation without strength left, or at the end of the model [rad]."""
    critical = shaken.mechanism.critical
    if critical is not None:
        return critical
    highest = shaken.mechanism.first.highest
    return highest if math.isfinite(highest) else 0.5 * math.pi


def scaled_run(run: Simulation, scale: float, fails_rad: float) -> ScaledRun:
    """Return a run with its verdict: whether it reaches the rotation that counts as failure."""
    outcome, peak = run.outcome, run.peak_rad
    # a block that slides has no rotation
    assert peak is not None
    verdict: Verdict = "safe" if outcome is Outcome.STABLE else "outside"
    # a rotation that was reached counts, whatever ended the model afterwards
    if outcome is Outcome.TOPPLED or peak - run.step_error >= fails_rad:
        verdict = "fails"
    elif outcome is Outcome.UNDETERMINED or peak + run.step_error >= fails_rad:
        verdict = "undecided"
    ending = ""
    if outcome not in (Outcome.STABLE, Outcome.TOPPLED):
        ending = run.ending or outcome.advice
    return ScaledRun(scale, peak, outcome, verdict, ending, run.free_motion is not None)


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


def _search(start: ScaleSearch, run: Callable[[float], ScaledRun], rules: ScanRules) -> ScaleSearch:
    """Scan upward, close in on the first scale that is not safe, and look further."""
    assert start.starts is not None
    limit = start.scale_limit
    runs, safe = _scan(run, start.starts, limit, rules.ratio, ("safe",))
    if runs[-1].verdict == "safe":
        return _result(start, runs, None, limit)
    more, safe = _close_in(run, safe, runs[-1].scale, rules.bracket, ("safe",))
    runs += more
    # closing in may have met a lower scale of another verdict than the one it began with
    first = min(
        (candidate for candidate in runs if candidate.verdict != "safe"),
        key=lambda candidate: candidate.scale,
    )
    if first.verdict == "undecided":
        first = _first_decided(run, runs, first, limit, rules)
    if first.verdict != "fails":  # the model ends before the block fails, or it is too close
        close = first.verdict == "undecided"
        advice = Outcome.UNDETERMINED.advice if close else first.outcome.advice
        return _result(start, runs, None, safe, first.sentence or advice)
    # stronger records, in steps twice as wide, may spare the block
    scale = first.scale
    while scale < limit:
        scale = min(scale * rules.ratio * rules.ratio, limit)
        runs.append(run(scale))
        # where the model has ended, a yet stronger record ends it too
        if runs[-1].verdict == "outside":
            break
    return _result(start, runs, (safe, first.scale), limit)


def _scan(
    run: Callable[[float], ScaledRun],
    scale: float,
    limit: float,
    ratio: float,
    passed: tuple[Verdict, ...],
) -> tuple[list[ScaledRun], float]:
    """Increase the scale until the verdict changes; return the runs and the scale before it."""
    runs: list[ScaledRun] = []
    while scale < limit:
        runs.append(run(min(scale * ratio, limit)))
        if runs[-1].verdict not in passed:
            break
        scale = runs[-1].scale
    return runs, scale


def _close_in(
    run: Callable[[float], ScaledRun],
    low: float,
    high: float,
    width: float,
    passed: tuple[Verdict, ...],
) -> tuple[list[ScaledRun], float]:
    """Bisect a bracket whose lower end has one of some verdicts and whose upper end has none of
    them.

    Returns:
        The runs, and the lower end.
    """
    runs: list[ScaledRun] = []
    while high - low > width * high:
        middle = 0.5 * (low + high)
        # neighbouring floating-point numbers have no middle
        if not low < middle < high:
            break
        runs.append(run(middle))
        if runs[-1].verdict in passed:
            low = middle
        else:
            high = middle
    return runs, low


def _first_decided(
    run: Callable[[float], ScaledRun],
    runs: list[ScaledRun],
    undecided: ScaledRun,
    limit: float,
    rules: ScanRules,
) -> ScaledRun:
    """Find the first scale that fails, past those too close to it to decide; add the runs.

    Returns:
        The run there, or that which was undecided where none fails.
    """
    passed: tuple[Verdict, ...] = ("safe", "undecided")
    highest = max(item.scale for item in runs)
    if all(item.verdict in passed for item in runs):
        runs += _scan(run, highest, limit, rules.ratio, passed)[0]
    later = [item for item in runs if item.verdict not in passed]
    if not later:
        return undecided
    high = min(item.scale for item in later)
    low = max(item.scale for item in runs if item.scale < high)
    closer, _ = _close_in(run, low, high, rules.bracket, passed)
    runs += closer
    return min((*later, *closer), key=lambda item: (item.verdict in passed, item.scale))


def _result(
    start: ScaleSearch,
    runs: list[ScaledRun],
    bracket: tuple[float, float] | None,
    limit: float,
    ended: str = "",
) -> ScaleSearch:
    # `bracket` is (last safe scale, first scale that fails): the outcome need not be monotone in
    # the scale, and a safe run above the second makes the set of failing scales reentrant
    runs = sorted(runs, key=lambda item: item.scale)
    warnings = list(start.warnings)
    if ended:
        text = (
            f"beyond {limit:.6g} times the record the model has no answer ({ended}): whether the "
            "block fails there is unknown"
        )
        warnings.append(Diagnostic(text, "beyond_model"))
    if any(item.verdict == "undecided" for item in runs):
        text = "some runs end closer to failure than their error: they count as not safe"
        warnings.append(Diagnostic(text, "near_limit"))
    if any(item.lost_contact for item in runs):
        text = (
            "past a lost contact the block is assumed to fall on its planes without rebound, which "
            "rigid contact does not decide: another impact may bring it down at another scale"
        )
        warnings.append(Diagnostic(text, "model_limits"))
    if bracket is not None:
        warnings.append(NOT_PROVEN)
    lower, scale = bracket or (None, None)
    return replace(
        start,
        status="below_limit" if bracket is None else "found",
        scale=scale,
        lower=lower,
        scale_limit=limit,
        ended=ended,
        reentrant=scale is not None
        and any(item.verdict == "safe" and item.scale > scale for item in runs),
        runs=tuple(runs),
        warnings=tuple(warnings),
    )


def _answer(search: ScaleSearch, shaken: ShakenMechanism, shaking: Shaking) -> CriticalScale:
    # yield acceleration over the PGA of the scaled record falls as the scale rises: the scale that
    # fails is the lower end of the bracket in k/PGA, the safe one its upper end
    k = None if search.scale is None else search.k_over_pga(search.scale)
    kr = None if k is None else k * search.pga_g
    critical = critical_rad(shaken)
    return CriticalScale(
        kind=shaken.kind,
        p2=shaken.p2,
        polarity=shaking.polarity,
        pga_g=search.pga_g,
        status=search.status,
        search_limit=search.k_over_pga(search.scale_limit) if search.pga_g > 0.0 else SEARCH_LIMIT,
        kr_over_pga=k,
        lower=k,
        upper=None if search.lower is None else search.k_over_pga(search.lower),
        kr=kr,
        y_m_s=None if kr is None else kr * STANDARD_GRAVITY_M_S2 / math.sqrt(shaken.p2),
        certified=search.certified,
        k_up_over_pga=None if search.starts is None else search.k_over_pga(search.starts),
        reentrant=search.reentrant,
        n_runs=len(search.runs),
        warnings=(*shaken.remarks, *shaking.warnings, *search.warnings),
        points=search.points(critical),
        intervals=search.intervals(),
        rotation_deg=search.rotation_deg,
        scale=search.scale,
        lower_scale=search.lower,
        starts_scale=search.starts,
        scale_limit=search.scale_limit,
        yield_name=shaken.yield_name,
        yield_g=shaken.yield_g,
        critical_rotation_rad=critical,
        ended=search.ended,
        runs=search.runs,
    )
