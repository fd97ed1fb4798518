"""Shaking at places between the nodes of a ShakeMap."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import InputError
from rbfrag.exchange.shakemap_grid import ShakeMapGrid

FloatArray = NDArray[np.float64]


def at_places(
    grid: ShakeMapGrid, lon: FloatArray, lat: FloatArray
) -> tuple[dict[str, FloatArray | None], NDArray[np.bool_]]:
    """Return the fields of a grid at places, and which places lie on the map.

    Bilinear between the four nodes around a place, in the logarithm of PGV and PGA; off the map
    NaN.

    Args:
        grid: a whole grid.
        lon: longitudes [deg], shape (n,).
        lat: latitudes [deg], shape (n,).

    Raises:
        InputError: the grid is not whole, or its rows are not regular.
    """
    if not grid.is_whole:
        raise InputError(
            "blocks between nodes need a whole grid: this one has not as many nodes as it declares"
        )
    shape = (grid.rows, grid.columns)
    x, y = grid.lon.reshape(shape)[0], grid.lat.reshape(shape)[:, 0]
    regular = np.allclose(grid.lon.reshape(shape), x, atol=1e-4)
    regular = regular and np.allclose(grid.lat.reshape(shape), y[:, None], atol=1e-4)
    if (
        not regular
        or x.size < 2
        or y.size < 2
        or not (np.diff(x) > 0).all()
        or not (np.diff(y) < 0).all()
    ):
        raise InputError("the nodes of the grid do not run west to east and north to south")
    on_map = (lon >= x[0]) & (lon <= x[-1]) & (lat <= y[0]) & (lat >= y[-1])
    i = np.clip(np.searchsorted(x, lon, side="right") - 1, 0, x.size - 2)
    j = np.clip(np.searchsorted(-y, -lat, side="right") - 1, 0, y.size - 2)
    u = (lon - x[i]) / (x[i + 1] - x[i])
    v = (lat - y[j]) / (y[j + 1] - y[j])

    def between(values: FloatArray | None, logarithmic: bool) -> FloatArray | None:
        if values is None:
            return None
        table = values.reshape(shape)
        if logarithmic:
            table = np.log(np.maximum(table, 1e-300))
        found = (
            (1 - u) * (1 - v) * table[j, i]
            + u * (1 - v) * table[j, i + 1]
            + (1 - u) * v * table[j + 1, i]
            + u * v * table[j + 1, i + 1]
        )
        return np.where(on_map, np.exp(found) if logarithmic else found, np.nan)

    fields = {
        "pgv_m_s": between(grid.pgv_m_s, True),
        "pga_g": between(grid.pga_g, True),
        "std_ln_pgv": between(grid.std_ln_pgv, False),
        "std_ln_pga": between(grid.std_ln_pga, False),
    }
    return fields, on_map
