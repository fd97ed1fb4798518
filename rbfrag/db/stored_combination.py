"""One stored combination with all that belongs to it, as arrays."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import Connection, select

from rbfrag.db.schema import campaign, combination, motion, outcome_interval, simulation
from rbfrag.solver.results import OutcomeIntervals, SearchPoints


@dataclass(frozen=True, eq=False)
class StoredCombination:
    """What a database says about one critical search.

    Args:
        id: its row.
        motion_id: the horizontal motion.
        vertical_motion_id: the vertical one, or None.
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
    """Return, sorted, the natural keys of combinations that can be computed again.

    Args:
        connection: the database.
        numerics_version: of the solver at hand; other versions may give other numbers.
    """
    vertical = motion.alias("vertical")
    query = (
        select(combination.c.natural_key)
        .select_from(
            combination.join(motion, motion.c.id == combination.c.motion_id).outerjoin(
                vertical, vertical.c.id == combination.c.vertical_motion_id
            )
        )
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
    points = connection.execute(
        select(
            simulation.c.kr_over_pga,
            simulation.c.theta_n,
            simulation.c.outcome,
            simulation.c.displacement_m,
            simulation.c.grid,
        )
        .where(simulation.c.combination_id == row["id"])
        .order_by(simulation.c.kr_over_pga.desc())
    ).all()
    intervals = connection.execute(
        select(outcome_interval.c.k_lo, outcome_interval.c.k_hi, outcome_interval.c.outcome)
        .where(outcome_interval.c.combination_id == row["id"])
        .order_by(outcome_interval.c.k_lo)
    ).all()
    return StoredCombination(
        id=row["id"],
        motion_id=row["motion_id"],
        vertical_motion_id=row["vertical_motion_id"],
        pga_g=row["pga_g"],
        values={column.name: row[column.name] for column in combination.c},
        settings=json.loads(row["settings"]),
        block=None if row["block"] is None else json.loads(row["block"]),
        campaign_settings=json.loads(row["campaign_settings"]),
        points=SearchPoints(
            kr_over_pga=_floats([point.kr_over_pga for point in points]),
            theta_n=_floats([point.theta_n for point in points]),
            outcome=tuple(point.outcome for point in points),
            displacement_m=None
            if all(point.displacement_m is None for point in points)
            else _floats([point.displacement_m for point in points]),
        ),
        intervals=OutcomeIntervals(
            k_lo=_floats([low for low, _, _ in intervals]),
            k_hi=_floats([high for _, high, _ in intervals]),
            outcome=tuple(outcome for _, _, outcome in intervals),
        ),
        grid=np.array(
            [-1 if point.grid is None else point.grid for point in points], dtype=np.int64
        ),
    )


def _floats(values: list[float | None]) -> NDArray[np.float64]:
    return np.array([np.nan if value is None else value for value in values], dtype=np.float64)
