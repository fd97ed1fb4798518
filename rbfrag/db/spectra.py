"""The toppling spectrum of each motion, stored and read back."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import Connection, select

from rbfrag.db.insert import insert_rows
from rbfrag.db.schema import toppling_spectrum
from rbfrag.motions.polarity import Polarity
from rbfrag.solver.results import NUMERICS_VERSION

_COLUMNS = ("motion_id", "polarity", "p2", "numerics_version", "x_m_s")

SpectrumKey = tuple[int, str, float]
"""Motion, polarity and p² [1/s²] that a value belongs to."""


def store_spectrum(
    connection: Connection,
    motion_id: int,
    *,
    polarity: Polarity,
    p2: Sequence[float] | NDArray[np.float64],
    x_m_s: Sequence[float] | NDArray[np.float64],
    numerics_version: str = NUMERICS_VERSION,
) -> int:
    """Store values of one motion's spectrum; values that are there already stay.

    Args:
        connection: inside the caller's transaction.
        motion_id: the motion.
        polarity: ``forward`` or ``reverse``.
        p2: frequency parameters [1/s²], shape (n,).
        x_m_s: X(p) at each of them [m/s], shape (n,).
        numerics_version: of the computation.

    Returns:
        How many were new.
    """
    there, _ = stored_spectrum(
        connection, motion_id, polarity=polarity, numerics_version=numerics_version
    )
    known = set(there.tolist())
    rows: list[tuple[object, ...]] = [
        (motion_id, polarity, float(size), numerics_version, float(velocity))
        for size, velocity in zip(p2, x_m_s, strict=True)
        if float(size) not in known
    ]
    insert_rows(connection, toppling_spectrum, _COLUMNS, rows)
    return len(rows)


def stored_spectrum(
    connection: Connection,
    motion_id: int,
    *,
    polarity: Polarity,
    numerics_version: str = NUMERICS_VERSION,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return what is stored of one motion's spectrum: p² [1/s²], rising, and X(p) [m/s]."""
    rows = connection.execute(
        select(toppling_spectrum.c.p2, toppling_spectrum.c.x_m_s)
        .where(
            toppling_spectrum.c.motion_id == motion_id,
            toppling_spectrum.c.polarity == polarity,
            toppling_spectrum.c.numerics_version == numerics_version,
        )
        .order_by(toppling_spectrum.c.p2)
    ).all()
    table = np.array([tuple(row) for row in rows], dtype=np.float64).reshape(-1, 2)
    return table[:, 0].copy(), table[:, 1].copy()


def spectrum_values(
    connection: Connection,
    *,
    p2: Iterable[float] | None = None,
    numerics_version: str = NUMERICS_VERSION,
) -> dict[SpectrumKey, float]:
    """Return X(p) [m/s] of all motions, by motion id, polarity and p².

    Args:
        connection: the database.
        p2: only these frequency parameters [1/s²].
        numerics_version: of the computation.
    """
    query = select(
        toppling_spectrum.c.motion_id,
        toppling_spectrum.c.polarity,
        toppling_spectrum.c.p2,
        toppling_spectrum.c.x_m_s,
    ).where(toppling_spectrum.c.numerics_version == numerics_version)
    wanted = None if p2 is None else set(map(float, p2))
    return {
        (motion_id, polarity, size): x
        for motion_id, polarity, size, x in connection.execute(query)
        if wanted is None or size in wanted
    }
