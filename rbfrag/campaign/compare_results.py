"""A stored combination against the same one computed again."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from rbfrag.db.check.maps import BORDER_ERROR, Interval, contradictions
from rbfrag.db.stored_combination import StoredCombination
from rbfrag.solver.results import CriticalResult, OutcomeIntervals, SearchPoints

_VALUES = (
    "status",
    "kr_over_pga",
    "lower",
    "upper",
    "kr",
    "y_m_s",
    "certified",
    "k_up_over_pga",
    "undecided",
    "island_width",
    "kr_over_pga_resolved",
    "reentrant",
    "n_runs",
)

ROTATION_ERROR = 1e-6
"""Relative error of a rotation that another processor's last bits can make."""


@dataclass(frozen=True)
class SingleRun:
    """One block run for itself.

    Args:
        outcome: how it ended.
        theta_n: peak rotation over the critical angle; None when it toppled.
        error: estimated bound on its error.
    """

    outcome: str
    theta_n: float | None
    error: float


def differences(
    stored: StoredCombination, again: CriticalResult, runs: Mapping[float, SingleRun]
) -> Iterator[str]:
    """Yield every value that is not the same bit for bit.

    Args:
        stored: what the database says.
        again: the search made again.
        runs: single blocks that are stored but not part of the search, run again, by k_r/PGA.
    """
    for name in _VALUES:
        then, now = stored.values[name], getattr(again, name)
        if then != now:
            yield f"{name} is {then!r}, computed again {now!r}"
    # earlier databases hold no maps; the search then still proves a part of one
    if stored.intervals.k_lo.size and not _same_intervals(stored.intervals, again.intervals):
        yield "its map of intervals is another when computed again"
    yield from _displacement_differences(stored.points, again.points, 0.0)
    points = stored.points
    then_at = dict(zip(points.kr_over_pga.tolist(), _ends(stored), strict=True))
    now_at = {k: _end(run.theta_n, run.outcome) for k, run in runs.items()}
    for k, theta, outcome in zip(
        again.points.kr_over_pga.tolist(),
        again.points.theta_n.tolist(),
        again.points.outcome,
        strict=True,
    ):
        now_at[k] = _end(theta, outcome)
    for k in sorted(then_at.keys() | now_at.keys(), reverse=True):
        if k not in then_at:
            yield f"the simulation at kr/PGA {k!r} is missing"
        elif then_at[k] != now_at[k]:
            yield f"the simulation at kr/PGA {k!r} is {then_at[k]}, computed again {now_at[k]}"


def deviations(
    stored: StoredCombination, again: CriticalResult, runs: Mapping[float, SingleRun]
) -> Iterator[str]:
    """Yield what differs by more than the error of the solver.

    Args:
        stored: what the database says.
        again: the search made again.
        runs: single blocks that are stored but not part of the search, run again, by k_r/PGA.
    """
    values = stored.values
    if values["status"] != again.status:
        yield f"status is {values['status']!r}, computed again {again.status!r}"
        return
    if again.status == "found":
        low = max(values["lower"], again.lower or 0.0)
        high = min(values["upper"], again.upper or math.inf)
        if low > high * (1.0 + BORDER_ERROR):
            yield (
                f"its bracket {values['lower']!r} to {values['upper']!r} does not meet the one "
                f"computed again, {again.lower!r} to {again.upper!r}"
            )
    for low, high, then, now in contradictions(
        _intervals(stored.intervals), _intervals(again.intervals)
    ):
        yield f"its map says {then} from kr/PGA {low!r} to {high!r}, computed again {now}"
    yield from _displacement_differences(stored.points, again.points, ROTATION_ERROR)
    then_at = dict(zip(stored.points.kr_over_pga.tolist(), _ends(stored), strict=True))
    borders = _borders(again)
    for k, run in runs.items():
        outcome, theta = then_at[k]
        if outcome != run.outcome:
            if not any(math.isclose(k, at, rel_tol=BORDER_ERROR) for at in borders):
                yield (f"the simulation at kr/PGA {k!r} is {outcome}, computed again {run.outcome}")
        elif (
            theta is not None
            and run.theta_n is not None
            and abs(theta - run.theta_n) > run.error + ROTATION_ERROR * run.theta_n
        ):
            yield (
                f"the simulation at kr/PGA {k!r} reaches {theta!r} of the critical angle, "
                f"computed again {run.theta_n!r}"
            )


def _displacement_differences(
    then: SearchPoints, now: SearchPoints, relative: float
) -> Iterator[str]:
    """Yield displacements of sliding blocks of one strength that differ."""
    if then.displacement_m is None or now.displacement_m is None:
        return
    now_at = dict(zip(now.kr_over_pga.tolist(), now.displacement_m.tolist(), strict=True))
    for k, slid in zip(then.kr_over_pga.tolist(), then.displacement_m.tolist(), strict=True):
        again = now_at.get(k, slid)
        if not math.isclose(slid, again, rel_tol=relative, abs_tol=1e-12 if relative else 0.0):
            yield f"the block of ky/PGA {k!r} slides {slid!r} m, computed again {again!r}"


def _ends(stored: StoredCombination) -> list[tuple[str, float | None]]:
    points = stored.points
    return [
        _end(theta, outcome)
        for theta, outcome in zip(points.theta_n.tolist(), points.outcome, strict=True)
    ]


def _end(theta_n: float | None, outcome: str) -> tuple[str, float | None]:
    return str(outcome), None if theta_n is None or math.isnan(theta_n) else theta_n


def _same_intervals(one: OutcomeIntervals, other: OutcomeIntervals) -> bool:
    return (
        one.outcome == other.outcome
        and one.k_lo.tolist() == other.k_lo.tolist()
        and one.k_hi.tolist() == other.k_hi.tolist()
    )


def _borders(result: CriticalResult) -> list[float]:
    return [
        *result.intervals.k_lo.tolist(),
        *result.intervals.k_hi.tolist(),
        *(edge for edge in (result.lower, result.upper) if edge is not None),
    ]


def _intervals(of: OutcomeIntervals) -> list[Interval]:
    return list(zip(of.k_lo.tolist(), of.k_hi.tolist(), of.outcome, strict=True))
