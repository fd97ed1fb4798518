"""The stored displacements of sliding blocks with the intensity of their motions."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import Connection, and_, select

from rbfrag.db.motions import require_suite
from rbfrag.db.queries import Vertical
from rbfrag.db.schema import combination, earthquake, motion, recording, simulation, suite_motion
from rbfrag.solver.results import NUMERICS_VERSION


@dataclass(frozen=True)
class DisplacementCurves:
    """One row for each block under each motion; arrays of equal length.

    `displacement_m` is that down a level plane, `natural_key` that of the combination.
    """

    natural_key: NDArray[np.object_]
    event_id: NDArray[np.object_]
    event_guessed: NDArray[np.bool_]
    pga_g: NDArray[np.float64]
    pgv_m_s: NDArray[np.float64]
    ky_over_pga: NDArray[np.float64]
    displacement_m: NDArray[np.float64]


def displacement_curves(
    connection: Connection,
    *,
    suite: str | None = None,
    vertical: Vertical = "without",
    numerics_version: str = NUMERICS_VERSION,
) -> DisplacementCurves:
    """Return the displacements of blocks of every stored strength, of whole curves alone.

    Args:
        connection: the database.
        suite: only motions of this suite.
        vertical: ``without`` vertical motion, ``with`` it, or ``both``.
        numerics_version: of the solver.

    Raises:
        InputError: there is no such suite.
    """
    query = (
        select(
            combination.c.natural_key,
            combination.c.settings,
            earthquake.c.event_id,
            earthquake.c.guessed,
            motion.c.pga_g,
            motion.c.pgv_m_s,
            simulation.c.kr_over_pga,
            simulation.c.displacement_m,
        )
        .select_from(
            combination.join(simulation)
            .join(motion, motion.c.id == combination.c.motion_id)
            .join(recording)
            .join(earthquake)
        )
        .where(
            combination.c.kind == "sliding",
            combination.c.numerics_version == numerics_version,
            simulation.c.displacement_m.is_not(None),
        )
        .order_by(combination.c.natural_key, simulation.c.kr_over_pga)
    )
    if vertical != "both":
        column = combination.c.vertical_motion_id
        query = query.where(column.is_(None) if vertical == "without" else column.is_not(None))
    if suite is not None:
        suite_id = require_suite(connection, suite)
        query = query.join(
            suite_motion,
            and_(suite_motion.c.motion_id == motion.c.id, suite_motion.c.suite_id == suite_id),
        )
    rows: list[Any] = [
        row
        for row in connection.execute(query)
        if json.loads(row.settings).get("displacement_m") == 0.0
    ]

    def floats(name: str) -> NDArray[np.float64]:
        return np.array([getattr(row, name) for row in rows], dtype=np.float64)

    return DisplacementCurves(
        natural_key=np.array([row.natural_key for row in rows], dtype=object),
        event_id=np.array([row.event_id for row in rows], dtype=object),
        event_guessed=np.array([row.guessed for row in rows], dtype=np.bool_),
        pga_g=floats("pga_g"),
        pgv_m_s=floats("pgv_m_s"),
        ky_over_pga=floats("kr_over_pga"),
        displacement_m=floats("displacement_m"),
    )
