"""Check of the map of one combination against its bracket, its simulations and another map."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence

from sqlalchemy import RowMapping

from rbfrag.db.rows import Interval

# k_r is divided by PGA and the limit was multiplied by it before.
_ROUNDING = 1e-12

# The critical block is taken clear of the border by up to this part of its k_r.
_CLEARANCE = 1.01e-8

BORDER_ERROR = 1e-7
"""Relative error of a border that another processor's last bits can make."""

ROTATION_ERROR = 1e-6
"""The same of a rotation or displacement."""


def interval_problems(
    row: RowMapping,
    intervals: Sequence[Interval],
    toppled: Sequence[float],
    stable: Sequence[float],
) -> Iterator[str]:
    """Yield problems of a map.

    Searches that did not ask for one hold none, nor do motions outside the model or that never
    lift a block. A gap says that nothing is known in it.

    Args:
        intervals: its rows of `outcome_interval`, by rising k_lo.
        toppled: kr/PGA of its simulations that toppled.
        stable: kr/PGA of those that did not.
    """
    if not intervals:
        return
    yield from _cover_problems(row, intervals)
    yield from _bracket_problems(row, intervals)
    for points, word, outcome, other in (
        (toppled, "topples", "safe", "safe"),
        (stable, "stays", "topples", "said to topple"),
    ):
        for k in points:
            inside = _holding(intervals, k)
            if inside is not None and inside.outcome == outcome:
                yield (
                    f"a simulation {word} at kr/PGA {k!r}, inside the interval "
                    f"{inside.k_lo!r} to {inside.k_hi!r} that is {other}"
                )


def _cover_problems(row: RowMapping, intervals: Sequence[Interval]) -> Iterator[str]:
    limit, bottom = row["search_limit"], intervals[0].k_lo
    if limit is not None and bottom < limit * (1.0 - _ROUNDING):
        yield f"its map begins at kr/PGA {bottom!r}, below the search limit {limit!r}"
    # a map that says where it is undecided leaves nothing out; others hold what was seen alone
    is_complete = any(interval.outcome == "undecided" for interval in intervals)
    needed = limit if row["lower"] is None else row["lower"]
    if is_complete and needed is not None and bottom > needed * (1.0 + _CLEARANCE):
        yield f"its map begins at kr/PGA {bottom!r}, above {needed!r}"
    for below, above in itertools.pairwise(intervals):
        if is_complete and below.k_hi < above.k_lo:
            yield f"its map has a gap from kr/PGA {below.k_hi!r} to {above.k_lo!r}"
        elif below.k_hi > above.k_lo:
            yield f"two of its intervals overlap from kr/PGA {above.k_lo!r} to {below.k_hi!r}"
    top, k_up = intervals[-1].k_hi, row["k_up_over_pga"]
    if k_up is not None and top < k_up * (1.0 - _ROUNDING):
        yield f"its map ends at kr/PGA {top!r}, below K_up {k_up!r}"


def _bracket_problems(row: RowMapping, intervals: Sequence[Interval]) -> Iterator[str]:
    topples = [interval for interval in intervals if interval.outcome == "topples"]
    highest = topples[-1].k_hi if topples else None
    if row["status"] != "found":
        if highest is not None:
            yield f"status {row['status']}, yet its map topples up to kr/PGA {highest!r}"
        return
    k, upper = row["kr_over_pga"], row["upper"]
    bound = k if upper is None else upper
    if highest is not None and highest > bound * (1.0 + _ROUNDING):
        yield f"its map topples up to kr/PGA {highest!r}, above its bracket that ends at {bound!r}"
    inside = _holding(intervals, k)
    if inside is not None and inside.outcome == "safe":
        depth = min(k - inside.k_lo, inside.k_hi - k)
        if depth > _CLEARANCE * k:
            yield f"its critical kr/PGA {k!r} lies in an interval that is safe"
    if row["certified"] and row["undecided"] is not None:
        measured = sum(
            interval.k_hi - interval.k_lo
            for interval in intervals
            if interval.outcome == "undecided" and interval.k_lo >= bound
        )
        if measured > row["undecided"] * (1.0 + 1e-6) + _CLEARANCE * bound:
            yield (
                f"its map is undecided over {measured!r} above the bracket, more than the "
                f"{row['undecided']!r} it states"
            )


def _holding(intervals: Sequence[Interval], k: float) -> Interval | None:
    """Return the interval with `k` strictly inside, if any."""
    for interval in intervals:
        if interval.k_lo * (1.0 + _ROUNDING) < k < interval.k_hi * (1.0 - _ROUNDING):
            return interval
    return None


def contradictions(
    first: Sequence[Interval], other: Sequence[Interval]
) -> Iterator[tuple[float, float, str, str]]:
    """Yield intervals that topple in one map and are safe in the other.

    Returns:
        Lower end, upper end, what the first says, what the second says.
    """
    i = j = 0
    while i < len(first) and j < len(other):
        low, high, word = first[i]
        low_2, high_2, word_2 = other[j]
        bottom, top = max(low, low_2), min(high, high_2)
        if {word, word_2} == {"topples", "safe"} and top - bottom > BORDER_ERROR * top:
            yield bottom, top, word, word_2
        if high <= high_2:
            i += 1
        else:
            j += 1
