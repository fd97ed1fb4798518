"""One stored combination with all its results, as arrays."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import Connection, Table, select

from rbfrag.db.rows import Interval, Point
from rbfrag.db.schema import (
    campaign,
    combination,
    motion,
    outcome_interval,
    simulation,
    vertical,
    with_motions,
)
from rbfrag.db.stored_json import stored_json
from rbfrag.solver.results import OutcomeIntervals, SearchPoints


@dataclass(frozen=True, eq=False)
class StoredCombination:
    """Results of one stored critical search.

    Args:
        pga_g: PGA of the horizontal motion [g].
        values: the columns of the combination by name.
        settings: what else went into its natural key.
        block: which block it is; None for toppling.
        campaign_settings: what the campaign that made it was asked for, and on which machine.
        points: its simulations, by falling k_r/PGA.
        intervals: its map; empty where none is stored.
        grid: number in the kind's outcome grid of each simulation, -1 for those beside it.
    """

    id: int
    motion_id: int
    vertical_motion_id: int | None
    pga_g: float
    values: Mapping[str, Any]
    settings: Mapping[str, Any]
    block: Mapping[str, Any] | None
    campaign_settings: Mapping[str, Any]
    points: SearchPoints
    intervals: OutcomeIntervals
    grid: NDArray[np.int64]


def keys_with_samples(connection: Connection, *, numerics_version: str) -> list[str]:
    """Return the sorted natural keys of combinations that can be computed again.

    Args:
        numerics_version: of the solver at hand; other versions may give other numbers.
    """
    query = (
        select(combination.c.natural_key)
        .select_from(with_motions(combination))
        .where(
            combination.c.numerics_version == numerics_version,
            motion.c.samples.is_not(None),
            combination.c.vertical_motion_id.is_(None) | vertical.c.samples.is_not(None),
        )
    )
    return sorted(connection.scalars(query))


def stored_combination(connection: Connection, natural_key: str) -> StoredCombination:
    """Return one combination by its natural key."""
    row = (
        connection.execute(
            select(combination, motion.c.pga_g, campaign.c.settings.label("campaign_settings"))
            .select_from(
                combination.join(motion, motion.c.id == combination.c.motion_id).join(campaign)
            )
            .where(combination.c.natural_key == natural_key)
        )
        .mappings()
        .one()
    )
    points = points_of(connection, [row["id"]])[row["id"]][::-1]
    intervals = intervals_of(connection, [row["id"]])[row["id"]]
    return StoredCombination(
        id=row["id"],
        motion_id=row["motion_id"],
        vertical_motion_id=row["vertical_motion_id"],
        pga_g=row["pga_g"],
        values={column.name: row[column.name] for column in combination.c},
        settings=stored_json(row["settings"], dict, f"settings of combination {row['id']}"),
        block=stored_json(row["block"], dict, f"block of combination {row['id']}"),
        campaign_settings=stored_json(row["campaign_settings"], dict, "settings of a campaign"),
        points=SearchPoints(
            kr_over_pga=_floats([point.kr_over_pga for point in points]),
            theta_n=_floats([point.theta_n for point in points]),
            outcome=tuple(point.outcome for point in points),
            displacement_m=None
            if all(point.displacement_m is None for point in points)
            else _floats([point.displacement_m for point in points]),
            sensitive=None
            if any(point.sensitive is None for point in points)
            else np.array([point.sensitive for point in points], dtype=np.bool_),
        ),
        intervals=OutcomeIntervals(
            k_lo=_floats([interval.k_lo for interval in intervals]),
            k_hi=_floats([interval.k_hi for interval in intervals]),
            outcome=tuple(interval.outcome for interval in intervals),
        ),
        grid=np.array(
            [-1 if point.grid is None else point.grid for point in points], dtype=np.int64
        ),
    )


def intervals_of(connection: Connection, ids: Sequence[int]) -> Mapping[int, list[Interval]]:
    """Return the maps of combinations, by their id."""
    return _belonging(connection, outcome_interval, Interval, ids)


def points_of(connection: Connection, ids: Sequence[int]) -> Mapping[int, list[Point]]:
    """Return the simulations of combinations, by their id."""
    return _belonging(connection, simulation, Point, ids)


def _belonging(
    connection: Connection, table: Table, row: type[Any], ids: Sequence[int]
) -> defaultdict[int, list[Any]]:
    query = select(table.c.combination_id, *(table.c[name] for name in row._fields))
    query = query.where(table.c.combination_id.in_(ids)).order_by(*table.primary_key.columns)
    by_id: defaultdict[int, list[Any]] = defaultdict(list)
    for owner, *values in connection.execute(query):
        by_id[owner].append(row._make(values))
    return by_id


def _floats(values: list[float | None]) -> NDArray[np.float64]:
    return np.array([np.nan if value is None else value for value in values], dtype=np.float64)
