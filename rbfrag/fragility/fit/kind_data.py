"""What the fits of blocks that slide or slump read: one row for each block under one motion."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import FitError

if TYPE_CHECKING:
    from sqlalchemy import Connection

    from rbfrag.db.queries import Vertical

FloatArray = NDArray[np.float64]

LEAST_DISPLACEMENT_M = 1e-4
"""Displacements below this count as less than it, whether zero or not."""

FEWEST_EVENTS = 3
FEWEST_FOUND = 20


@dataclass(frozen=True, eq=False)
class KindData:
    """Rows of one fit; arrays of shape (n,).

    A row says at which value of the last variable the block just fails (`found`), or that it does
    so beyond it, on the safe side.

    Args:
        kind: ``sliding`` or ``slumping``.
        values: what the formulas read, by name, at that value. Slumping: PGV and PGA are those of
            the scaled record. Sliding: the displacement is that of the block.
        found: False for censored rows.
        event: number of the earthquake.
        group: number of motion and polarity.
        block: number of the block among those of the same motion and polarity.
        pgv_m_s: PGV of the record as it is [m/s].
        pga_g: PGA of the record as it is [g].
        guessed_events: number of earthquakes read off file headers.
        fingerprint: hash of keys and values.
    """

    kind: str
    values: dict[str, FloatArray]
    found: NDArray[np.bool_]
    event: NDArray[np.intp]
    group: NDArray[np.intp]
    block: NDArray[np.intp]
    pgv_m_s: FloatArray
    pga_g: FloatArray
    guessed_events: int
    fingerprint: str

    @property
    def events(self) -> int:
        """Number of earthquakes."""
        return int(self.event.max()) + 1


def sliding_data(
    connection: Connection, *, suite: str | None = None, vertical: Vertical = "without"
) -> KindData:
    """Return the displacements of blocks of every stored strength below PGA.

    Args:
        connection: the database.
        suite: only motions of this suite.
        vertical: ``without`` or ``with`` vertical motion, or ``both``.

    Raises:
        FitError: the data cannot carry a fit.
    """
    from rbfrag.db.displacement_curves import displacement_curves

    table = displacement_curves(connection, suite=suite, vertical=vertical)
    chosen = (table.ky_over_pga < 1.0) & (table.pgv_m_s > 0.0)
    slid = table.displacement_m[chosen]
    values = {
        "ky": table.ky_over_pga[chosen] * table.pga_g[chosen],
        "displacement_m": np.maximum(slid, LEAST_DISPLACEMENT_M),
        "pgv_m_s": table.pgv_m_s[chosen],
        "pga_g": table.pga_g[chosen],
    }
    return _data(
        "sliding",
        values,
        slid >= LEAST_DISPLACEMENT_M,
        table.event_id[chosen],
        table.event_guessed[chosen],
        table.natural_key[chosen],
        table.ky_over_pga[chosen],
        table.pgv_m_s[chosen],
        table.pga_g[chosen],
    )


def slumping_data(
    connection: Connection,
    *,
    rotation_deg: float | None,
    suite: str | None = None,
    vertical: Vertical = "without",
) -> KindData:
    """Return the critical scales of the blocks of the family.

    Args:
        connection: the database.
        rotation_deg: rotation that counts as failure [deg]; None for failure past recovery.
        suite: only motions of this suite.
        vertical: ``without`` or ``with`` vertical motion, or ``both``.

    Raises:
        FitError: the data cannot carry a fit.
    """
    from rbfrag.db.queries import combination_table, stored_blocks
    from rbfrag.fragility.fit.stored_slumps import slump_yields

    table = combination_table(
        connection, kind="slumping", rotation_deg=rotation_deg, suite=suite, vertical=vertical
    )
    known = np.isin(table.status.astype(str), ("found", "below_limit")) & (table.pgv_m_s > 0.0)
    if not known.any():
        raise FitError(
            "no critical values of blocks that slump are stored for this rotation: run  rbfrag "
            "simulate --kind slumping"
        )
    found = (table.status == "found")[known]
    ratio = np.where(found, table.kr_over_pga[known], table.search_limit[known])
    pga, pgv = table.pga_g[known], table.pgv_m_s[known]
    ks = slump_yields(stored_blocks(connection, table.combination_id[known]))
    # the scaled record: its PGA is k_s over the critical ratio, and PGV goes with it
    values = {
        "ks": ks,
        "ps2": table.p2[known],
        "pgv_m_s": ks / ratio * pgv / pga,
        "pga_g": ks / ratio,
    }
    usable = ratio < 1.0
    return _data(
        "slumping",
        {name: value[usable] for name, value in values.items()},
        found[usable],
        table.event_id[known][usable],
        table.event_guessed[known][usable],
        table.natural_key[known][usable],
        table.p2[known][usable] + 1e6 * ks[usable],
        pgv[usable],
        pga[usable],
        groups=np.array(
            [
                f"{motion} {polarity}"
                for motion, polarity in zip(
                    table.motion_id[known][usable].tolist(),
                    table.polarity[known][usable],
                    strict=True,
                )
            ],
            dtype=object,
        ),
    )


def _data(
    kind: str,
    values: dict[str, FloatArray],
    found: NDArray[np.bool_],
    event_id: NDArray[np.object_],
    guessed: NDArray[np.bool_],
    key: NDArray[np.object_],
    block: FloatArray,
    pgv_m_s: FloatArray,
    pga_g: FloatArray,
    groups: NDArray[np.object_] | None = None,
) -> KindData:
    # in an order that does not depend on that of the rows
    order = np.lexsort((block, key.astype(str)))
    values = {name: np.ascontiguousarray(value[order]) for name, value in values.items()}
    found, event_id, key = found[order], event_id[order], key[order]
    names, event = np.unique(event_id.astype(str), return_inverse=True)
    if int(found.sum()) < FEWEST_FOUND or names.size < FEWEST_EVENTS:
        raise FitError(
            f"{int(found.sum())} critical values of {names.size} earthquakes; a fit of {kind} "
            f"needs {FEWEST_FOUND} of {FEWEST_EVENTS}: add motions and run  rbfrag simulate --kind "
            f"{kind}"
        )
    labels = (key if groups is None else groups[order]).astype(str)
    group = np.unique(labels, return_inverse=True)[1]
    lines = [
        "\t".join([name, quake, *(float(v).hex() for v in row)]) + "\n"
        for name, quake, row in zip(
            key, event_id, np.column_stack([*values.values(), found]).tolist(), strict=True
        )
    ]
    return KindData(
        kind=kind,
        values=values,
        found=found,
        event=event.astype(np.intp),
        group=group.astype(np.intp),
        block=np.unique(block[order], return_inverse=True)[1].astype(np.intp),
        pgv_m_s=pgv_m_s[order],
        pga_g=pga_g[order],
        guessed_events=len(set(event_id[guessed[order]].tolist())),
        fingerprint=hashlib.sha256("".join(sorted(lines)).encode()).hexdigest(),
    )
