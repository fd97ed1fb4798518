"""Rows of the database as frozen dataclasses, and the values of their JSON and number columns.

This module loads neither SQLAlchemy nor numpy, because `rbfrag predict` needs it.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, TypedDict

from rbfrag.errors import DatabaseError

Vertical = Literal["without", "with", "both"]


class Selection(TypedDict, total=False):
    """Selection of combinations of a kind.

    Args:
        suite: only motions of this suite.
        vertical: ``without`` vertical motion, ``with`` it, or ``both``.
        rotation_deg: the rotation that counts as failure [deg]; None for failure past recovery
            and of kinds that know none.
        doubtful_pgd: True to return the PGD of motions that are flagged for an implausible
            final velocity or displacement; by default it is NaN, so that no fit reads it.
        include_structures: True to read motions of sensors on structures, too.
        where: condition over columns of the view `outcome`, as
            :func:`rbfrag.db.conditions.parsed_condition` reads it.
    """

    suite: str | None
    vertical: Vertical
    rotation_deg: float | None
    doubtful_pgd: bool
    include_structures: bool
    where: str | None


if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


@dataclass(frozen=True)
class EarthquakeInfo:
    """The earthquake of a motion.

    Args:
        event_id: the key that earthquakes are told apart by.
        name: name for people.
        magnitude: magnitude as the source gives it (scale not harmonised), if known.
        time: origin time or year as text, if known.
        guessed: True when the event was read off a file header instead of stated by metadata.
        mechanism: fault mechanism, if known.
        depth_km: depth of the hypocentre [km], if known.
    """

    event_id: str
    name: str = ""
    magnitude: float | None = None
    time: str | None = None
    guessed: bool = True
    mechanism: str | None = None
    depth_km: float | None = None


@dataclass(frozen=True)
class MotionRow:
    """One stored motion without its samples; units are in the names."""

    id: int
    name: str
    event_id: str
    event_guessed: bool
    magnitude: float | None
    mechanism: str | None
    depth_km: float | None
    recording: str
    station: str
    network: str | None
    lat: float | None
    lon: float | None
    rjb_km: float | None
    rrup_km: float | None
    repi_km: float | None
    vs30_m_s: float | None
    attributes: Mapping[str, str]
    component: str
    orientation_deg: float | None
    is_vertical: bool
    dt_s: float
    npts: int
    pga_g: float
    pgv_m_s: float
    pgd_m: float
    tm_s: float | None
    sa03_g: float | None
    sa05_g: float | None
    sa10_g: float | None
    sa20_g: float | None
    sa30_g: float | None
    cav_m_s: float | None
    arias_m_s: float | None
    d5_95_s: float | None
    d5_75_s: float | None
    housner_m: float | None
    final_velocity_m_s: float
    final_displacement_m: float
    source_file: str
    trace_index: int
    file_format: str
    processing: str
    processing_applied: Mapping[str, object] | None
    source_sha256: str
    start_time: str | None
    sha256: str
    flags: tuple[str, ...]


class Interval(NamedTuple):
    """One interval of a map: its ends in k_r/PGA, and the outcome of every block in it."""

    k_lo: float
    k_hi: float
    outcome: Literal["topples", "safe", "undecided"]


class Point(NamedTuple):
    """One simulated block; `grid` is its index in the kind's outcome grid, None outside of it.

    `sensitive` is None of kinds whose outcomes are not.
    """

    kr_over_pga: float
    theta_n: float | None
    outcome: str
    displacement_m: float | None
    grid: int | None
    sensitive: bool | None = None


IMPORTED = "imported"  # numerics version of critical values that rbfrag has not computed


@dataclass(frozen=True)
class CombinationTable:
    """Critical values with the intensity measures of their motions: columns of equal length.

    What the fits read. `kr_over_pga`, `kr` and `y_m_s` are NaN unless `status` is ``found``,
    `upper`, the upper end of the bracket of `kr_over_pga`, where there is none;
    `tm_s` is NaN where the mean period is not defined, `pgd_m` where the baseline of the record
    is in doubt, unless it was asked for. `measures` holds every other stored measure of the
    vocabulary by name, NaN where it was not computed or is unknown.
    `block` is JSON text, None where p² says all; `yield_g` is NaN where that names no strength.
    `numerics_version` is the same in all rows.
    """

    combination_id: NDArray[np.int64]
    motion_id: NDArray[np.int64]
    event_id: NDArray[np.object_]
    event_guessed: NDArray[np.bool_]
    polarity: NDArray[np.object_]
    p2: NDArray[np.float64]
    status: NDArray[np.object_]
    search_limit: NDArray[np.float64]
    kr_over_pga: NDArray[np.float64]
    upper: NDArray[np.float64]
    kr: NDArray[np.float64]
    y_m_s: NDArray[np.float64]
    pga_g: NDArray[np.float64]
    pgv_m_s: NDArray[np.float64]
    pgd_m: NDArray[np.float64]
    tm_s: NDArray[np.float64]
    natural_key: NDArray[np.object_]
    block: NDArray[np.object_]
    yield_g: NDArray[np.float64]
    numerics_version: NDArray[np.object_]
    measures: Mapping[str, NDArray[np.float64]]

    def measure(self, name: str) -> NDArray[np.float64]:
        """Return a measure of the motions, or another column, by its name."""
        column: NDArray[np.float64] = {**vars(self), **self.measures}[name]
        return column

    def only(self, chosen: NDArray[np.bool_] | NDArray[np.intp]) -> CombinationTable:
        """Return some of the combinations."""
        columns: dict[str, Any] = {
            name: column[chosen] for name, column in vars(self).items() if name != "measures"
        }
        measures = {name: column[chosen] for name, column in self.measures.items()}
        return CombinationTable(**columns, measures=measures)


def stored_json(text: Any, kind: type, where: str) -> Any:
    """Return the value of a JSON column.

    Args:
        text: what the column holds; None (nothing) gives None.
        kind: list or dict, which it must be.
        where: table, row and column, for the message.

    Raises:
        DatabaseError: it is no JSON, or something else than a `kind`.
    """
    if text is None:
        return None
    try:
        value = json.loads(text)
    except (ValueError, TypeError, RecursionError) as error:
        raise _damaged(where, str(error)) from None
    if not isinstance(value, kind):
        raise _damaged(where, f"no JSON {'list' if kind is list else 'object'}")
    return value


def stored_number(value: Any, where: str) -> Any:
    """Return a number of a column, or None; SQLite accepts text in number columns."""
    if value is None or isinstance(value, int | float):
        return value
    raise _damaged(where, f"{value!r} is not a number")


def _damaged(where: str, reason: str) -> DatabaseError:
    return DatabaseError(
        f"{where} of the database is damaged ({reason}): run  rbfrag db check  and restore the "
        "database from a backup"
    )
