"""Looking for damage: `rbfrag db check`."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from sqlalchemy import Connection, exists, select

from rbfrag.db.natural_key import combination_key
from rbfrag.db.schema import (
    combination,
    earthquake,
    fragility_model,
    motion,
    recording,
    simulation,
)
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2

# What a few roundings of a product and a quotient can do.
_ROUNDING = 1e-12


@dataclass(frozen=True)
class Finding:
    """One thing that is wrong.

    Args:
        table: where it is.
        row: the row, as the database numbers or names it.
        problem: what is wrong, in words.
    """

    table: str
    row: str
    problem: str


def check_database(connection: Connection) -> list[Finding]:
    """Return everything that is wrong with a database; an empty list is a clean bill.

    Looks at the file itself (SQLite), references, the samples against their sha256, keys
    against what they are hashes of, brackets, y = kr·g/p, simulations against the status of
    their combination, rows that nothing refers to, and the models.

    Args:
        connection: the database, inside one transaction.
    """
    found: list[Finding] = []
    if connection.dialect.name == "sqlite":
        found += _check_sqlite_file(connection)
    found += _check_motions(connection)
    found += _check_unused(connection)
    found += _check_combinations(connection)
    found += _check_models(connection)
    return found


def _check_sqlite_file(connection: Connection) -> Iterator[Finding]:
    for (line,) in connection.exec_driver_sql("PRAGMA integrity_check"):
        if line != "ok":
            yield Finding("file", "-", str(line))
    for table, row, parent, _ in connection.exec_driver_sql("PRAGMA foreign_key_check"):
        yield Finding(str(table), str(row), f"points to a row of {parent} that is not there")


def _check_motions(connection: Connection) -> Iterator[Finding]:
    query = select(motion.c.id, motion.c.npts, motion.c.samples_sha256, motion.c.samples)
    for row_id, npts, sha256, samples in connection.execute(query.order_by(motion.c.id)):
        if samples is None:
            continue
        if len(samples) != 8 * npts:
            yield Finding("motion", str(row_id), f"holds {len(samples)} bytes, not 8 x {npts}")
        elif hashlib.sha256(samples).hexdigest() != sha256:
            yield Finding("motion", str(row_id), "the samples do not match their sha256")


def _check_unused(connection: Connection) -> Iterator[Finding]:
    no_motion = ~exists().where(motion.c.recording_id == recording.c.id)
    for row_id in connection.scalars(select(recording.c.id).where(no_motion)):
        yield Finding("recording", str(row_id), "no motion belongs to it")
    no_recording = ~exists().where(recording.c.earthquake_id == earthquake.c.id)
    for event_id in connection.scalars(select(earthquake.c.event_id).where(no_recording)):
        yield Finding("earthquake", str(event_id), "no recording belongs to it")


def _check_combinations(connection: Connection) -> Iterator[Finding]:
    vertical = motion.alias("vertical")
    query = (
        select(
            combination,
            motion.c.pga_g,
            motion.c.dt_s,
            motion.c.samples_sha256,
            vertical.c.samples_sha256.label("vertical_sha256"),
        )
        .select_from(
            combination.join(motion, motion.c.id == combination.c.motion_id).outerjoin(
                vertical, vertical.c.id == combination.c.vertical_motion_id
            )
        )
        .order_by(combination.c.id)
    )
    toppled = _toppled_points(connection)
    for row in connection.execute(query).mappings():
        problems = [*_key_problems(row), *_value_problems(row)]
        problems += _point_problems(row, toppled.get(row["id"], []))
        for problem in problems:
            yield Finding("combination", str(row["id"]), problem)


def _toppled_points(connection: Connection) -> dict[int, list[float]]:
    query = select(simulation.c.combination_id, simulation.c.kr_over_pga).where(
        simulation.c.outcome == "toppled"
    )
    points: dict[int, list[float]] = {}
    for combination_id, k in connection.execute(query):
        points.setdefault(combination_id, []).append(k)
    return points


def _key_problems(row: Any) -> Iterator[str]:
    try:
        settings = json.loads(row["settings"])
        expected = combination_key(
            motion_sha256=row["samples_sha256"],
            dt_s=row["dt_s"],
            vertical_sha256=row["vertical_sha256"],
            polarity=row["polarity"],
            kind=row["kind"],
            p2=row["p2"],
            settings=settings,
            numerics_version=row["numerics_version"],
            linear=row["linear"],
        )
    except ValueError as error:
        yield f"its settings cannot be read: {error}"
        return
    if expected != row["natural_key"]:
        yield "its natural key is not the hash of its inputs"


def _value_problems(row: Any) -> Iterator[str]:
    if row["status"] != "found":
        return
    k, lower, upper = row["kr_over_pga"], row["lower"], row["upper"]
    if lower is not None and lower > k:
        yield f"kr/PGA {k!r} lies below its bracket, {lower!r} to {upper!r}"
    if upper is not None and upper < k:
        yield f"kr/PGA {k!r} lies above its bracket, {lower!r} to {upper!r}"
    if not math.isclose(row["kr"], k * row["pga_g"], rel_tol=_ROUNDING):
        yield f"kr {row['kr']!r} is not kr/PGA times the motion's PGA"
    y_m_s = row["kr"] * STANDARD_GRAVITY_M_S2 / math.sqrt(row["p2"])
    if not math.isclose(row["y_m_s"], y_m_s, rel_tol=_ROUNDING):
        yield f"y {row['y_m_s']!r} m/s is not kr g/p = {y_m_s!r} m/s"


def _point_problems(row: Any, toppled: list[float]) -> Iterator[str]:
    if row["status"] == "found":
        if row["kr_over_pga"] not in toppled:
            yield "no simulation topples at its critical kr/PGA"
        elif max(toppled) > row["kr_over_pga"]:
            yield f"a simulation topples above its critical kr/PGA, at {max(toppled)!r}"
    elif row["status"] in ("below_limit", "no_motion") and toppled:
        yield f"status {row['status']}, yet a simulation topples at kr/PGA {max(toppled)!r}"


def _check_models(connection: Connection) -> Iterator[Finding]:
    for name, coefficients, covariance in connection.execute(
        select(
            fragility_model.c.name, fragility_model.c.coefficients, fragility_model.c.covariance
        ).order_by(fragility_model.c.name)
    ):
        try:
            n = len(json.loads(coefficients))
            lines = json.loads(covariance)
            if len(lines) != n or any(len(line) != n for line in lines):
                yield Finding("fragility_model", name, f"the covariance is not {n} by {n}")
        except (ValueError, TypeError) as error:
            yield Finding("fragility_model", name, f"cannot be read: {error}")
