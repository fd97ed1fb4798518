"""Stored combinations and histories against their inputs, their brackets and what was simulated."""

from __future__ import annotations

import itertools
import json
import math
from collections.abc import Iterator, Sequence

from sqlalchemy import Connection, RowMapping, func, select

from rbfrag.db.check.finding import COMPUTE_AGAIN, Finding
from rbfrag.db.check.maps import interval_problems
from rbfrag.db.keys import key_of_row, response_key
from rbfrag.db.rows import Interval, Point
from rbfrag.db.schema import campaign, combination, motion, response, vertical, with_motions
from rbfrag.db.stored_combination import intervals_of, points_of
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2

# What a few roundings of a product and a quotient can do.
_ROUNDING = 1e-12

# What summing the displacements of thousands of samples rounds by, over the greatest of them.
_ROUNDING_OF_SUMS = 1e-9

_ROWS_AT_ONCE = 500

_SERIES = ("time_s", "theta_rad", "theta_dot_rad_s", "k_h", "k_v")
_BLOCK_OF_RESPONSE = ("polarity", "kind", "p2", "kr", "numerics_version", "linear")


def check_combinations(connection: Connection) -> Iterator[Finding]:
    """Yield what is wrong with combinations, their intervals and their simulations."""
    query = (
        select(
            combination,
            motion.c.pga_g,
            motion.c.dt_s,
            motion.c.samples_sha256,
            vertical.c.samples_sha256.label("vertical_sha256"),
            campaign.c.numerics_version.label("campaign_numerics"),
        )
        .select_from(with_motions(combination).outerjoin(campaign))
        .order_by(combination.c.id)
    )
    last = 0
    while True:
        some = query.where(combination.c.id > last).limit(_ROWS_AT_ONCE)
        rows = connection.execute(some).mappings().all()
        if not rows:
            return
        last = rows[-1]["id"]
        ids = [row["id"] for row in rows]
        intervals, points = intervals_of(connection, ids), points_of(connection, ids)
        for row in rows:
            for problem in _problems(row, intervals[row["id"]], points[row["id"]]):
                yield Finding("combination", str(row["id"]), problem, COMPUTE_AGAIN)


def _problems(
    row: RowMapping, intervals: Sequence[Interval], points: Sequence[Point]
) -> Iterator[str]:
    yield from _key_problems(row)
    if row["campaign_numerics"] not in (None, row["numerics_version"]):
        yield (
            f"numerics version {row['numerics_version']}, its campaign says "
            f"{row['campaign_numerics']}"
        )
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


def _key_problems(row: RowMapping) -> Iterator[str]:
    for name in ("block", "settings"):
        try:
            json.loads(row[name] or "{}")
        except ValueError as error:
            yield f"its {name} cannot be read: {error}"
            return
    expected = key_of_row(row, row["samples_sha256"], row["dt_s"], row["vertical_sha256"])
    if expected != row["natural_key"]:
        yield "its natural key is not the hash of its inputs"


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
    """Return whether failure is the outcome itself, not a stated rotation or displacement."""
    try:
        stated = json.loads(settings)
        return stated.get("rotation_deg") is None and stated.get("displacement_m") is None
    except (ValueError, AttributeError):
        return True  # its own finding


def displacement_problems(row: RowMapping, points: Sequence[Point]) -> Iterator[str]:
    """Yield what cannot be of blocks that slide: displacements fall with strength.

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


def check_responses(connection: Connection) -> Iterator[Finding]:
    """Yield histories whose key is not the hash of their inputs, or of another length."""
    lengths = [func.length(response.c[name]).label(name) for name in _SERIES]
    query = (
        select(
            response.c.id,
            response.c.natural_key,
            response.c.npts,
            *(response.c[name] for name in _BLOCK_OF_RESPONSE),
            motion.c.samples_sha256,
            motion.c.dt_s,
            vertical.c.samples_sha256.label("vertical_sha256"),
            *lengths,
        )
        .select_from(with_motions(response))
        .order_by(response.c.id)
    )
    for row in connection.execute(query).mappings():
        expected = response_key(
            motion_sha256=row["samples_sha256"],
            dt_s=row["dt_s"],
            vertical_sha256=row["vertical_sha256"],
            **{name: row[name] for name in _BLOCK_OF_RESPONSE},
        )
        if expected != row["natural_key"]:
            problem = "its natural key is not the hash of its inputs"
            yield Finding("response", str(row["id"]), problem, COMPUTE_AGAIN)
        for name in _SERIES:
            if row[name] != 8 * row["npts"]:
                problem = f"{name} holds {row[name]} bytes, not 8 x {row['npts']}"
                yield Finding("response", str(row["id"]), problem, COMPUTE_AGAIN)
