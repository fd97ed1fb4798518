"""Storage of response histories of single blocks."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import Connection, select

from rbfrag.db.insert import insert_rows, rows_of_keys
from rbfrag.db.schema import response
from rbfrag.errors import InputError
from rbfrag.solver.results import Response

_COLUMNS = (
    "natural_key", "motion_id", "vertical_motion_id", "polarity", "kind", "linear", "p2", "kr",
    "numerics_version", "outcome", "peak_theta_n", "peak_theta_rad", "npts", "time_s",
    "theta_rad", "theta_dot_rad_s", "k_h", "k_v",
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class ResponseRecord:
    """One response with its history in stored form.

    Args:
        natural_key: from :func:`rbfrag.db.keys.response_key`, of all but `response`.
        p2: frequency parameter p² [1/s²].
        kr: rocking acceleration coefficient.
    """

    natural_key: str
    motion_id: int
    vertical_motion_id: int | None
    polarity: str
    p2: float
    kr: float
    response: Response
    numerics_version: str


def insert_responses(connection: Connection, records: Sequence[ResponseRecord]) -> None:
    """Store responses with their histories; existing keys are skipped."""
    insert_rows(connection, response, _COLUMNS, [_row(record) for record in records])


def known_responses(connection: Connection, keys: Iterable[str]) -> set[str]:
    """Return the natural keys whose responses are stored."""
    column = response.c.natural_key
    return {key for (key,) in rows_of_keys(connection, select(column), column, keys)}


def _row(record: ResponseRecord) -> tuple[object, ...]:
    answer = record.response
    history = answer.history
    if history is None:
        raise InputError("a response without its history is not stored")
    return (
        record.natural_key,
        record.motion_id,
        record.vertical_motion_id,
        record.polarity,
        answer.kind,
        False,
        float(record.p2),
        float(record.kr),
        record.numerics_version,
        str(answer.outcome),
        answer.peak_theta_n,
        answer.peak_theta_rad,
        int(history.time_s.size),
        _blob(history.time_s),
        _blob(history.theta_rad),
        _blob(history.theta_dot_rad_s),
        _blob(history.k_h),
        _blob(history.k_v),
    )


def _blob(values: NDArray[np.float64]) -> bytes:
    return values.astype("<f8").tobytes()
