"""Check of stored combinations against their inputs, their brackets and their simulations."""

from __future__ import annotations

import itertools
import json
import math
from collections.abc import Iterator, Sequence

from sqlalchemy import Connection, RowMapping, select

from rbfrag.db.check.damage import COMPUTE_AGAIN, Damage
from rbfrag.db.check.inputs import Inputs, input_problems, stored_inputs
from rbfrag.db.check.maps import interval_problems
from rbfrag.db.rows import Interval, Point
from rbfrag.db.schema import combination, motion
from rbfrag.db.stored_combination import intervals_of, points_of
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2

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
            for problem in _problems(row, inputs, intervals[row["id"]], points[row["id"]]):
                yield Damage("combination", str(row["id"]), problem, COMPUTE_AGAIN)


def _problems(
    row: RowMapping, inputs: Inputs, intervals: Sequence[Interval], points: Sequence[Point]
) -> Iterator[str]:
    yield from input_problems(row, inputs)
    try:
        json.loads(row["warnings"])
    except ValueError as error:
        yield f"its warnings cannot be read: {error}"
    yield from _value_problems(row)
    yield from displacement_problems(row, points)
    toppled = [point.kr_over_pga for point in points if point.outcome == "toppled"]
    unsure = [point.kr_over_pga for point in points if point.outcome == "undetermined"]
    if fails_by_outcome(row["settings"]):
        yield from _point_problems(row, toppled, unsure)
    stable = [point.kr_over_pga for point in points if point.outcome == "stable"]
    yield from interval_problems(row, intervals, toppled, stable)


def _value_problems(row: RowMapping) -> Iterator[str]:
    if row["status"] != "found":
        return
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


def _point_problems(
    row: RowMapping, toppled: Sequence[float], unsure: Sequence[float]
) -> Iterator[str]:
    if row["status"] == "found":
        # a run beside a very sensitive border may not tell; the certificate of its interval does
        if row["kr_over_pga"] not in toppled and row["kr_over_pga"] not in unsure:
            yield "no simulation topples at its critical kr/PGA"
        elif max(toppled, default=0.0) > row["kr_over_pga"]:
            yield f"a simulation topples above its critical kr/PGA, at {max(toppled)!r}"
    elif row["status"] in ("below_limit", "no_motion") and toppled:
        above = [k for k in toppled if k >= row["search_limit"]]
        if above:
            yield f"status {row['status']}, yet a simulation topples at kr/PGA {max(above)!r}"


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
