"""A stored combination against the same one computed again."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field

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
"""Relative error of a rotation or displacement that another processor's last bits can make."""

End = tuple[str, float | None, float | None]
"""Outcome, θ_n and displacement [m] of one block; None where there is none."""


@dataclass(frozen=True)
class ComputedAgain:
    """What the present solver answers for a stored combination.

    Args:
        critical: the search; None where the kind has none.
        ends: how each simulated block ended, by k/PGA.
        error: bound on the error of θ_n of one block, by k/PGA: one more run.
    """

    critical: CriticalResult | None
    ends: Mapping[float, End]
    error: Callable[[float], float] = field(default=lambda _: 0.0)


def ends_of(points: SearchPoints | None) -> dict[float, End]:
    """Return how simulated blocks ended, by k/PGA."""
    if points is None:
        return {}
    slid = points.displacement_m
    rows = zip(
        points.kr_over_pga.tolist(),
        points.outcome,
        points.theta_n.tolist(),
        [math.nan] * len(points.outcome) if slid is None else slid.tolist(),
        strict=True,
    )
    return {k: (str(word), _number(theta), _number(at)) for k, word, theta, at in rows}


def differences(stored: StoredCombination, again: ComputedAgain) -> Iterator[str]:
    """Yield every value that is not the same bit for bit, and maps that contradict each other.

    Args:
        stored: what the database says.
        again: the same computed again.
    """
    found = again.critical
    if found is not None:
        for name in _VALUES:
            then, now = stored.values[name], getattr(found, name)
            if then != now:
                yield f"{name} is {then!r}, computed again {now!r}"
        yield from _map_differences(stored, found)
    then_at = ends_of(stored.points)
    for k in sorted(then_at.keys() | again.ends.keys(), reverse=True):
        if k not in then_at:
            yield f"the simulation at kr/PGA {k!r} is missing"
        elif then_at[k] != again.ends.get(k):
            yield (
                f"the simulation at kr/PGA {k!r} is {_told(then_at[k])}, computed again "
                f"{_told(again.ends.get(k))}"
            )


def deviations(stored: StoredCombination, again: ComputedAgain) -> Iterator[str]:
    """Yield what differs by more than the error of the solver.

    Args:
        stored: what the database says.
        again: the same computed again.
    """
    values, found = stored.values, again.critical
    borders: list[float] = []
    if found is not None:
        if values["status"] != found.status:
            yield f"status is {values['status']!r}, computed again {found.status!r}"
            return
        if found.status == "found":
            low = max(values["lower"], found.lower or 0.0)
            high = min(values["upper"], found.upper or math.inf)
            if low > high * (1.0 + BORDER_ERROR):
                yield (
                    f"its bracket {values['lower']!r} to {values['upper']!r} does not meet the one "
                    f"computed again, {found.lower!r} to {found.upper!r}"
                )
        yield from _map_differences(stored, found)
        borders = [*found.intervals.k_lo.tolist(), *found.intervals.k_hi.tolist()]
        borders += [edge for edge in (found.lower, found.upper) if edge is not None]
    for k, (outcome, theta, slid) in ends_of(stored.points).items():
        if k not in again.ends:
            continue
        now, theta_now, slid_now = again.ends[k]
        if outcome != now:
            if not any(math.isclose(k, at, rel_tol=BORDER_ERROR) for at in borders):
                yield f"the simulation at kr/PGA {k!r} is {outcome}, computed again {now}"
        elif not (_close(theta, theta_now) or _within(again.error(k), theta, theta_now)):
            yield (
                f"the simulation at kr/PGA {k!r} reaches {theta!r} of the critical angle, "
                f"computed again {theta_now!r}"
            )
        elif not _close(slid, slid_now):
            yield f"the block of ky/PGA {k!r} slides {slid!r} m, computed again {slid_now!r}"


def _map_differences(stored: StoredCombination, found: CriticalResult) -> Iterator[str]:
    for low, high, then, now in contradictions(
        _intervals(stored.intervals), _intervals(found.intervals)
    ):
        yield f"its map says {then} from kr/PGA {low!r} to {high!r}, computed again {now}"


def _told(end: End | None) -> object:
    if end is None:
        return "none"
    outcome, theta, slid = end
    return (outcome, theta) if slid is None else (outcome, theta, f"{slid!r} m")


def _close(then: float | None, now: float | None) -> bool:
    if then is None or now is None:
        return then is now
    return math.isclose(then, now, rel_tol=ROTATION_ERROR, abs_tol=1e-12)


def _within(error: float, then: float | None, now: float | None) -> bool:
    return then is not None and now is not None and abs(then - now) <= error


def _number(value: float) -> float | None:
    return None if math.isnan(value) else value


def _intervals(of: OutcomeIntervals) -> list[Interval]:
    return list(zip(of.k_lo.tolist(), of.k_hi.tolist(), of.outcome, strict=True))
