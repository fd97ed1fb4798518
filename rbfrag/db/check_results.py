"""Check of stored results against their inputs, brackets, maps and simulations."""

from __future__ import annotations

import itertools
import json
import math
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from sqlalchemy import Connection, RowMapping, func, select

from rbfrag.db.campaigns import intervals_of, points_of
from rbfrag.db.keys import key_of_row
from rbfrag.db.motions import samples_of_motions
from rbfrag.db.rows import Interval, Point
from rbfrag.db.schema import campaign, combination, motion, response, shock_pair
from rbfrag.errors import InputError
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2

RESTORE = "restore the database from a backup"
COMPUTE_AGAIN = (
    "restore the database from a backup, or add the motions to a new database and run  rbfrag "
    "simulate  there"
)
ACCEPT = "restore the database from a backup, or take it as known, by rbfrag db check with accept"
FIT_AGAIN = "fit it again in its place, by rbfrag fit"


@dataclass(frozen=True)
class Damage:
    """One problem of a database: table, row, description and remedy."""

    table: str
    row: str
    problem: str
    advice: str = RESTORE


# What a few roundings of a product and a quotient can do.
_ROUNDING = 1e-12

# What summing the displacements of thousands of samples rounds by, over the greatest of them.
_ROUNDING_OF_SUMS = 1e-9

_ROWS_AT_ONCE = 500


def check_combinations(connection: Connection) -> Iterator[Damage]:
    """Yield damage of combinations, their intervals and their simulations."""
    query = (
        select(combination, motion.c.pga_g)
        .join(motion, motion.c.id == combination.c.motion_id)
        .order_by(combination.c.id)
    )
    inputs = stored_inputs(connection)
    last = 0
    while True:
        page = query.where(combination.c.id > last).limit(_ROWS_AT_ONCE)
        rows = connection.execute(page).mappings().all()
        if not rows:
            return
        last = rows[-1]["id"]
        ids = [row["id"] for row in rows]
        intervals, points = intervals_of(connection, ids), points_of(connection, ids)
        for row in rows:
            of_row = intervals[row["id"]], points[row["id"]]
            for problem in _problems(row, inputs, *of_row):
                yield Damage("combination", str(row["id"]), problem, COMPUTE_AGAIN)


def _problems(
    row: RowMapping, inputs: Inputs, intervals: Sequence[Interval], points: Sequence[Point]
) -> Iterator[str]:
    """Yield the problems of one combination."""
    yield from input_problems(row, inputs)
    try:
        json.loads(row["warnings"])
    except ValueError as error:
        yield f"its warnings cannot be read: {error}"
    if row["status"] == "found":
        yield from _value_problems(row)
    yield from displacement_problems(row, points)
    by_outcome: defaultdict[str, list[float]] = defaultdict(list)
    for point in points:
        by_outcome[point.outcome].append(point.kr_over_pga)
    toppled, unsure = by_outcome["toppled"], by_outcome["undetermined"]
    k = row["kr_over_pga"]
    status = row["status"] if fails_by_outcome(row["settings"]) else ""
    if status == "found":
        # a run next to a very sensitive border may not decide; the certificate of its interval does
        if k not in toppled and k not in unsure:
            yield "no simulation topples at its critical kr/PGA"
        elif max(toppled, default=0.0) > k:
            yield f"a simulation topples above its critical kr/PGA, at {max(toppled)!r}"
    elif status in ("below_limit", "no_motion"):
        above = [strength for strength in toppled if strength >= row["search_limit"]]
        if above:
            yield f"status {status}, yet a simulation topples at kr/PGA {max(above)!r}"
    yield from interval_problems(row, intervals, toppled, by_outcome["stable"])


def _value_problems(row: RowMapping) -> Iterator[str]:
    k, lower, upper = row["kr_over_pga"], row["lower"], row["upper"]
    if lower is not None and lower > k:
        yield f"kr/PGA {k!r} lies below its bracket, {lower!r} to {upper!r}"
    if upper is not None and upper < k:
        yield f"kr/PGA {k!r} lies above its bracket, {lower!r} to {upper!r}"
    if not math.isclose(row["kr"], k * row["pga_g"], rel_tol=_ROUNDING):
        yield f"kr {row['kr']!r} is not kr/PGA times the motion's PGA"
    if row["p2"] is None:
        return
    y_m_s = row["kr"] * STANDARD_GRAVITY_M_S2 / math.sqrt(row["p2"])
    if not math.isclose(row["y_m_s"], y_m_s, rel_tol=_ROUNDING):
        yield f"y {row['y_m_s']!r} m/s is not kr g/p = {y_m_s!r} m/s"


def fails_by_outcome(settings: str) -> bool:
    """Return whether failure is the outcome itself, not a rotation or displacement limit."""
    try:
        criteria = json.loads(settings)
        return criteria.get("rotation_deg") is None and criteria.get("displacement_m") is None
    except (ValueError, AttributeError):
        return True  # its own finding


def displacement_problems(row: RowMapping, points: Sequence[Point]) -> Iterator[str]:
    """Yield impossible displacements of sliding blocks: they decrease with strength.

    Args:
        points: its rows of `simulation`, by rising k_y/PGA.
    """
    slid = [(p.kr_over_pga, p.displacement_m) for p in points if p.displacement_m is not None]
    most = max((d for _, d in slid), default=0.0)
    for (weak, far), (strong, near) in itertools.pairwise(slid):
        if near > far + _ROUNDING_OF_SUMS * most:
            yield (
                f"a block of ky/PGA {strong!r} slides {near!r} m, further than the {far!r} m of a "
                f"weaker one, ky/PGA {weak!r}"
            )
    if (
        slid
        and row["status"] == "found"
        and json.loads(row["settings"]).get("displacement_m") == 0.0
    ):
        for k, d in slid:
            if d > 0.0 and k >= row["kr_over_pga"]:
                yield f"a block of ky/PGA {k!r} slides, yet none moves from {row['kr_over_pga']!r}"


_SERIES = ("time_s", "theta_rad", "theta_dot_rad_s", "k_h", "k_v")

Inputs = tuple[Mapping[int, tuple[str, float]], Mapping[int, str]]
"""The samples of each motion, as for a natural key, and the numerics of each campaign."""


def stored_inputs(connection: Connection) -> Inputs:
    """Return the inputs that stored results refer to."""
    rows = connection.execute(select(campaign.c.id, campaign.c.numerics_version))
    return samples_of_motions(connection), {row.id: row.numerics_version for row in rows}


def input_problems(row: RowMapping, inputs: Inputs) -> Iterator[str]:
    """Yield problems with the key or the numerics version of a combination, history or pair."""
    samples, numerics = inputs
    motions = {row[name] for name in row if name.endswith("motion_id")} - {None}
    unreadable = []
    for name in ("block", "settings"):
        try:
            json.loads(row.get(name) or "{}")
        except ValueError as error:
            unreadable.append(f"its {name} cannot be read: {error}")
    yield from unreadable
    # a motion that is not there is a broken reference, which is its own finding
    if not unreadable and motions <= samples.keys():
        try:
            is_its_key = key_of_row(row, samples) == row["natural_key"]
        except InputError:  # a number that is not finite
            is_its_key = False
        if not is_its_key:
            yield "its natural key is not the hash of its inputs"
    of_campaign = numerics.get(row.get("campaign_id", 0), row["numerics_version"])
    if of_campaign != row["numerics_version"]:
        yield f"numerics version {row['numerics_version']}, its campaign says {of_campaign}"


def check_responses(connection: Connection) -> Iterator[Damage]:
    """Yield histories with a wrong key or length."""
    inputs = stored_inputs(connection)
    columns = [column for column in response.c if column.name not in _SERIES]
    lengths = [func.length(response.c[name]).label(name) for name in _SERIES]
    query = select(*columns, *lengths).order_by(response.c.id)
    for row in connection.execute(query).mappings():
        problems = [*input_problems(row, inputs)]
        problems += (
            f"{name} holds {row[name]} bytes, not 8 x {row['npts']}"
            for name in _SERIES
            if row[name] != 8 * row["npts"]
        )
        for problem in problems:
            yield Damage("response", str(row["id"]), problem, COMPUTE_AGAIN)


def check_shock_pairs(connection: Connection) -> Iterator[Damage]:
    """Yield motion pairs with a wrong key or impossible values."""
    inputs = stored_inputs(connection)
    for row in connection.execute(select(shock_pair).order_by(shock_pair.c.id)).mappings():
        problems = [*input_problems(row, inputs)]
        if row["second_outcome"] is not None and row["first_outcome"] != "stable":
            problems.append(
                f"the first motion ends as {row['first_outcome']}, yet the second is said to find "
                "the block at rest"
            )
        for problem in problems:
            yield Damage("shock_pair", str(row["id"]), problem, COMPUTE_AGAIN)


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
