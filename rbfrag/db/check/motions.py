"""Check of stored motions and their toppling spectra against their samples."""

from __future__ import annotations

import hashlib
import json
import math
from collections import defaultdict
from collections.abc import Iterator
from typing import Any

import numpy as np
from sqlalchemy import Connection, select

from rbfrag.db.check.damage import COMPUTE_AGAIN, Damage
from rbfrag.db.motions import load_motion, measures_of, same_measure
from rbfrag.db.schema import motion, toppling_spectrum
from rbfrag.errors import InputError, RbfragError
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.polarity import Polarity
from rbfrag.motions.toppling_spectrum import toppling_spectrum as spectrum_of
from rbfrag.solver.results import NUMERICS_VERSION

# Sums over some 1e5 samples, in another order on another processor.
_ROUNDING = 1e-9


def check_motions(connection: Connection) -> Iterator[Damage]:
    """Yield damage of motions: bytes, SHA-256 and recomputed intensity measures."""
    query = select(motion).order_by(motion.c.id)
    ids = list(connection.scalars(select(motion.c.id).order_by(motion.c.id)))
    for row_id in ids:  # one at a time: the samples of all may not fit into memory
        row = connection.execute(query.where(motion.c.id == row_id)).mappings().one()
        for problem in _problems(row):
            file = row["source_file"] or "the file of its record"
            advice = f"restore the database from a backup, or add {file} to a new database"
            yield Damage("motion", str(row_id), problem, advice)


def _problems(row: Any) -> Iterator[str]:
    for column in ("flags", "remarks", "processing_applied"):
        try:
            value = json.loads(row[column] or "{}")
            if column != "processing_applied" and not isinstance(value, list):
                yield f"its {column} are no JSON list"
        except (ValueError, RecursionError) as error:
            yield f"its {column} cannot be read: {error}"
    if row["processing_applied"] is None and row["source_sha256"] != row["samples_sha256"]:
        yield "its samples are not those of the file, yet no processing is said to be applied"
    samples = row["samples"]
    if samples is None:
        return
    if len(samples) != 8 * row["npts"]:
        yield f"holds {len(samples)} bytes, not 8 x {row['npts']}"
    elif hashlib.sha256(samples).hexdigest() != row["samples_sha256"]:
        yield "the samples do not match their sha256"
    else:
        yield from _measure_problems(row, np.frombuffer(samples, dtype="<f8"))


def _measure_problems(row: Any, samples: np.ndarray) -> Iterator[str]:
    try:
        record = GroundMotion(samples.astype(np.float64), row["dt_s"])
        measures = measures_of(record)
    except InputError as error:
        yield f"the samples are no accelerogram: {error}"
        return
    for name, now in measures.items():
        stored = row[name]
        if not same_measure(name, stored, now, record.pgv_m_s, record.pgd_m):
            yield f"{name} is {stored!r}, the samples give {now!r}"


def check_spectra(connection: Connection) -> Iterator[Damage]:
    """Yield every X(p) of the present numerics that its motion does not reproduce."""
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
                    yield Damage("toppling_spectrum", row, problem, COMPUTE_AGAIN)
