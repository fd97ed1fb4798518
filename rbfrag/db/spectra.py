"""Storage of the toppling spectrum of each motion."""

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
) -> None:
    """Store values of one motion's spectrum; existing values are kept.

    Args:
        p2: frequency parameters [1/s²], shape (n,).
        x_m_s: X(p) at each of them [m/s], shape (n,).
    """
    rows: list[tuple[object, ...]] = [
        (motion_id, polarity, float(size), numerics_version, float(velocity))
        for size, velocity in zip(p2, x_m_s, strict=True)
    ]
    insert_rows(connection, toppling_spectrum, _COLUMNS, rows)


def spectrum_values(
    connection: Connection,
    *,
    p2: Iterable[float] | None = None,
    numerics_version: str = NUMERICS_VERSION,
) -> dict[SpectrumKey, float]:
    """Return X(p) [m/s] of all motions, by motion id, polarity and p².

    Args:
        p2: only these frequency parameters [1/s²].
    """
    query = select(
        toppling_spectrum.c.motion_id,
        toppling_spectrum.c.polarity,
        toppling_spectrum.c.p2,
        toppling_spectrum.c.x_m_s,
    ).where(toppling_spectrum.c.numerics_version == numerics_version)
    sizes = None if p2 is None else set(map(float, p2))
    return {
        (motion_id, polarity, size): x
        for motion_id, polarity, size, x in connection.execute(query)
        if sizes is None or size in sizes
    }
