"""ShakeMap grids: the shaking of one earthquake over a region (grid.xml, uncertainty.xml)."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import InputError
from rbfrag.exchange.shakemap_xml import GridReading, ShakeMapEvent

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class ShakeMapGrid:
    """Nodes of a ShakeMap, rows from west to east, north to south.

    Args:
        event: the earthquake.
        lon: longitudes [deg], shape (n,).
        lat: latitudes [deg], shape (n,).
        pgv_m_s: peak ground velocity [m/s], shape (n,).
        pga_g: peak ground acceleration [g], shape (n,).
        std_ln_pgv: standard deviation of ln PGV, shape (n,), or None.
        std_ln_pga: standard deviation of ln PGA, shape (n,), or None.
        columns: declared number of nodes in a row.
        rows: declared number of rows.
        warnings: what was noticed on reading.
    """

    event: ShakeMapEvent
    lon: FloatArray
    lat: FloatArray
    pgv_m_s: FloatArray
    pga_g: FloatArray
    std_ln_pgv: FloatArray | None
    std_ln_pga: FloatArray | None
    columns: int
    rows: int
    warnings: tuple[str, ...] = ()

    @property
    def is_whole(self) -> bool:
        """Whether there are as many nodes as declared."""
        return self.lon.size == self.columns * self.rows


def read_shakemap(
    path: str | os.PathLike[str],
    *,
    uncertainty: str | os.PathLike[str] | None = None,
    allow_partial: bool = False,
) -> ShakeMapGrid:
    """Return the grid of a ShakeMap, version 3 or 4.

    Columns are found by their names. Units are those stated; where a unit is blank it is that of
    the ShakeMap manual (percent of g, cm/s), with a warning.

    Args:
        path: grid.xml.
        uncertainty: uncertainty.xml of the same map: standard deviations of ln PGA and ln PGV.
        allow_partial: read a grid with fewer or more nodes than it declares, with a warning.

    Raises:
        InputError: not such a file, or numbers that cannot be used; the message names the line.
    """
    event, fields, columns, rows, warnings = GridReading(str(path), ("PGA", "PGV")).read(
        allow_partial
    )
    grid = ShakeMapGrid(
        event=event,
        lon=fields["lon"],
        lat=fields["lat"],
        pgv_m_s=fields["pgv_m_s"],
        pga_g=fields["pga_g"],
        std_ln_pgv=fields.get("std_ln_pgv"),
        std_ln_pga=fields.get("std_ln_pga"),
        columns=columns,
        rows=rows,
        warnings=tuple(warnings),
    )
    return grid if uncertainty is None else _with_uncertainty(grid, uncertainty, allow_partial)


def _with_uncertainty(
    grid: ShakeMapGrid, path: str | os.PathLike[str], allow_partial: bool
) -> ShakeMapGrid:
    event, fields, _, _, warnings = GridReading(str(path), ("STDPGV",)).read(allow_partial)
    if event.event_id and grid.event.event_id and event.event_id != grid.event.event_id:
        raise InputError(
            f"{path}: is of event {event.event_id!r}, the grid of {grid.event.event_id!r}: name "
            "the uncertainty of the same map"
        )
    same = fields["lon"].size == grid.lon.size
    same = same and np.allclose(fields["lon"], grid.lon, rtol=0.0, atol=1e-4)
    if not (same and np.allclose(fields["lat"], grid.lat, rtol=0.0, atol=1e-4)):
        raise InputError(
            f"{path}: has {fields['lon'].size} nodes that are not those of the grid "
            f"({grid.lon.size}): name the uncertainty of the same map"
        )
    return replace(
        grid,
        std_ln_pgv=fields["std_ln_pgv"],
        std_ln_pga=fields.get("std_ln_pga", grid.std_ln_pga),
        warnings=(*grid.warnings, *warnings),
    )
