"""Stored toppling spectra against their motions."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterator

from sqlalchemy import Connection, select

from rbfrag.db.check.finding import COMPUTE_AGAIN, Finding
from rbfrag.db.motions import load_motion
from rbfrag.db.schema import motion, toppling_spectrum
from rbfrag.errors import RbfragError
from rbfrag.motions.polarity import Polarity
from rbfrag.motions.toppling_spectrum import toppling_spectrum as spectrum_of
from rbfrag.solver.results import NUMERICS_VERSION

# Sums over some 1e5 samples, in another order on another processor.
_ROUNDING = 1e-9


def check_spectra(connection: Connection) -> Iterator[Finding]:
    """Yield every X(p) of the present numerics that its motion does not give.

    Args:
        connection: the database, inside one transaction.
    """
    column = toppling_spectrum.c
    query = (
        select(column.motion_id, column.polarity, column.p2, column.x_m_s)
        .join(motion)
        .where(column.numerics_version == NUMERICS_VERSION, motion.c.samples.is_not(None))
        .order_by(column.motion_id, column.polarity, column.p2)
    )
    by_motion: dict[int, dict[Polarity, list[tuple[float, float]]]] = defaultdict(
        lambda: defaultdict(list)
    )
    for motion_id, polarity, p2, x_m_s in connection.execute(query):
        by_motion[motion_id][polarity].append((p2, x_m_s))
    for motion_id, by_polarity in by_motion.items():
        try:
            record = load_motion(connection, motion_id)
        except RbfragError:
            continue  # its own finding
        for polarity, values in by_polarity.items():
            again = spectrum_of(record, [p2 for p2, _ in values], polarity)
            for (p2, stored), now in zip(values, again.tolist(), strict=True):
                if not math.isclose(stored, now, rel_tol=_ROUNDING, abs_tol=1e-15):
                    row = f"motion {motion_id}, {polarity}, p2 {p2:g}"
                    problem = f"X(p) is {stored!r} m/s, the motion gives {now!r} m/s"
                    yield Finding("toppling_spectrum", row, problem, COMPUTE_AGAIN)
