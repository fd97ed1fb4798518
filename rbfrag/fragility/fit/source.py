"""What every fit starts from: critical values, spectra and outcomes of one selection of motions."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rbfrag.db.rows import CombinationTable
from rbfrag.fragility.fit.scores import GRID_OF_Y0_OVER_PGV
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2

if TYPE_CHECKING:
    from sqlalchemy import Connection

    from rbfrag.db.queries import Vertical

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class FitSource:
    """Combinations with all that the methods of fitting read, columns of equal length.

    Args:
        table: critical values and intensities.
        xp_m_s: toppling spectrum at each combination's p² and polarity [m/s], shape (n,); NaN
            where it is not stored.
        topples: what becomes of blocks at y0 = PGV times `GRID_OF_Y0_OVER_PGV`, shape (n, 25):
            1 topples, 0 safe, NaN not known. The grid does not depend on the outcome.
    """

    table: CombinationTable
    xp_m_s: FloatArray
    topples: FloatArray

    @classmethod
    def of_table(cls, table: CombinationTable) -> FitSource:
        """Return a source of critical values alone."""
        n = table.p2.size
        grid = np.full((n, GRID_OF_Y0_OVER_PGV.size), np.nan)
        return cls(table, np.full(n, np.nan), grid)

    def only(self, chosen: NDArray[np.bool_] | NDArray[np.intp]) -> FitSource:
        """Return some of the combinations."""
        part = {f.name: getattr(self.table, f.name)[chosen] for f in fields(self.table)}
        return FitSource(CombinationTable(**part), self.xp_m_s[chosen], self.topples[chosen])


def read_source(
    connection: Connection,
    *,
    suite: str | None = None,
    vertical: Vertical = "without",
    doubtful_pgd: bool = False,
) -> FitSource:
    """Read critical values, spectra and outcomes from the database.

    Args:
        connection: the database.
        suite: only motions of this suite.
        vertical: ``without`` vertical motion, ``with`` it, or ``both``.
        doubtful_pgd: read the PGD of records with a doubtful baseline too.
    """
    from rbfrag.db.outcome_maps import outcome_maps
    from rbfrag.db.queries import combination_table
    from rbfrag.db.spectra import spectrum_values

    table = combination_table(connection, suite=suite, vertical=vertical, doubtful_pgd=doubtful_pgd)
    spectra = spectrum_values(connection)
    keys = zip(table.motion_id.tolist(), table.polarity, table.p2.tolist(), strict=True)
    xp_m_s = np.array([spectra.get(key, np.nan) for key in keys], dtype=np.float64)
    maps = outcome_maps(connection, table.combination_id)
    blocks = kr_over_pga_of_grid(table.p2, table.pgv_m_s, table.pga_g)
    return FitSource(table, xp_m_s, maps.outcomes(blocks))


def kr_over_pga_of_grid(p2: ArrayLike, pgv_m_s: ArrayLike, pga_g: ArrayLike) -> FloatArray:
    """Return k_r/PGA of the blocks that outcomes are asked for.

    Args:
        p2: frequency parameter p² [1/s²], shape (n,).
        pgv_m_s: PGV [m/s], shape (n,).
        pga_g: PGA [g], shape (n,).

    Returns:
        Shape (n, 25); not finite where PGA is 0.
    """
    pgv, ground = np.asarray(pgv_m_s), np.asarray(pga_g) * STANDARD_GRAVITY_M_S2
    with np.errstate(divide="ignore", invalid="ignore"):
        z = np.sqrt(np.asarray(p2)) * pgv / ground
    return np.asarray(z[..., None] * GRID_OF_Y0_OVER_PGV)
