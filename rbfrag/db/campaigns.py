"""Storage of campaigns: combinations, response histories and toppling spectra."""

from __future__ import annotations

import json
import math
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import count, repeat
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import Connection, Table, exists, select

from rbfrag.db.insert import insert_row, insert_rows, rows_of_keys, update_rows, utc_now
from rbfrag.db.keys import NOT_DIGESTED, canonical_json
from rbfrag.db.rows import Interval, Point, stored_json
from rbfrag.db.schema import (
    campaign,
    combination,
    metadata,
    motion,
    outcome_interval,
    response,
    simulation,
    toppling_spectrum,
    vertical,
    with_motions,
)
from rbfrag.errors import InputError
from rbfrag.motions.polarity import Polarity
from rbfrag.solver.critical_result import CriticalResult
from rbfrag.solver.results import NUMERICS_VERSION, OutcomeIntervals, Response, SearchPoints
from rbfrag.version import __version__

_COMBINATION_COLUMNS = tuple(
    column.name for column in combination.c if column.name not in NOT_DIGESTED
)
_NUMBERS = (
    "search_limit", "kr_over_pga", "lower", "upper", "kr", "y_m_s", "k_up_over_pga", "undecided",
    "island_width", "kr_over_pga_resolved",
)  # fmt: skip
_OF_A_MAP = ("island_width", "kr_over_pga_resolved", "reentrant", "n_runs", "warnings")
GRID_MEETS_POINT = (
    "(combination_id, kr_over_pga) DO UPDATE SET theta_n = excluded.theta_n, "
    "outcome = excluded.outcome, displacement_m = excluded.displacement_m, "
    "grid = excluded.grid, sensitive = excluded.sensitive, digest = excluded.digest "
    "WHERE simulation.grid IS NULL"
)
"""What becomes of a block that was run before, for another reason, where the grid meets it."""

POINT_COLUMNS = ("combination_id", *Point._fields)
INTERVAL_COLUMNS = ("combination_id", *Interval._fields)


@dataclass(frozen=True)
class CombinationRecord:
    """One combination in stored form.

    Args:
        natural_key: from :func:`rbfrag.db.keys.combination_key`.
        p2: the same that went into the key [1/s²].
        result: the critical value; None where none was looked for.
        block: which block it is, the same that went into the key; None where p² says all.
        yield_g: yield acceleration of that block [g]; None where it is of blocks of any strength.
        grid: the blocks of the kind's grid, number i of it at place i; None to add them later.
    """

    natural_key: str
    motion_id: int
    vertical_motion_id: int | None
    polarity: str
    kind: str
    p2: float | None
    settings: Mapping[str, object]
    result: CriticalResult | None
    block: Mapping[str, object] | None = None
    yield_g: float | None = None
    grid: SearchPoints | None = None
    numerics_version: str = NUMERICS_VERSION


@dataclass(frozen=True)
class KnownCombination:
    """State of a stored combination, for the plan of a campaign.

    Args:
        status: of its search.
        kr_over_pga: its critical value, if one was found.
        certified: whether that is proven.
        reentrant: whether a safe island lies below it; None where no map was made.
        gridded: whether the blocks of the kind's grid are stored.
        mapped: whether a map of intervals is stored.
    """

    id: int
    status: str
    kr_over_pga: float | None
    certified: bool
    reentrant: bool | None
    gridded: bool = False
    mapped: bool = False


def start_campaign(connection: Connection, settings: Mapping[str, object]) -> int:
    """Record the start of a campaign, and return its id.

    Args:
        settings: what the user asked for; values that JSON can hold.
    """
    return insert_row(
        connection,
        campaign,
        {
            "settings": canonical_json(settings),
            "numerics_version": NUMERICS_VERSION,
            "rbfrag_version": __version__,
            "started": utc_now(),
        },
    )


def finish_campaign(connection: Connection, campaign_id: int) -> None:
    """Record that a campaign is complete."""
    update_rows(connection, campaign, campaign.c.id == campaign_id, {"finished": utc_now()})


def known_combinations(connection: Connection, keys: Iterable[str]) -> dict[str, KnownCombination]:
    """Return the state of stored combinations, by natural key.

    Args:
        keys: the natural keys asked about; those that are not stored are left out.
    """
    column = combination.c
    query = select(
        column.natural_key,
        column.id,
        column.status,
        column.kr_over_pga,
        column.certified,
        column.reentrant,
        exists().where(simulation.c.combination_id == column.id, simulation.c.grid.is_not(None)),
        exists().where(outcome_interval.c.combination_id == column.id),
    )
    rows = rows_of_keys(connection, query, column.natural_key, keys)
    return {key: KnownCombination(*values) for key, *values in rows}


def known_keys(connection: Connection, keys: Iterable[str], table: str = "combination") -> set[str]:
    """Return the natural keys that are stored in a table of results."""
    column = metadata.tables[table].c.natural_key
    return {key for (key,) in rows_of_keys(connection, select(column), column, keys)}


def combinations_with_points(
    connection: Connection, keys: Iterable[str], kr_over_pga: Sequence[float]
) -> set[str]:
    """Return the natural keys whose combinations have a simulation at every given strength."""
    query = select(combination.c.natural_key, simulation.c.kr_over_pga).join(simulation)
    rows = rows_of_keys(connection, query, combination.c.natural_key, keys)
    # Compared here: a long list of strengths is no list of variables for every database.
    strengths = set(kr_over_pga)
    counts = Counter(key for key, k in rows if k in strengths)
    return {key for key, number in counts.items() if number == len(strengths)}


def insert_combinations(
    connection: Connection, campaign_id: int, records: Sequence[CombinationRecord]
) -> int:
    """Store combinations, each with its simulated points, its grid and, if present, its map.

    Args:
        connection: inside the caller's transaction, so that a combination is never there
            without what belongs to it.
        campaign_id: the campaign that made them; not part of what makes databases equal.
        records: the combinations; one whose key is there already is left alone.

    Returns:
        How many were new.
    """
    there = known_keys(connection, (record.natural_key for record in records))
    new = {record.natural_key: record for record in records if record.natural_key not in there}
    # In one order: two campaigns on one server then wait for each other, never both at once.
    rows = []
    for _, record in sorted(new.items()):
        values = {
            **vars(record),
            "campaign_id": campaign_id,
            "linear": False,
            "p2": _number(record.p2),
            "yield_g": _number(record.yield_g),
            "block": None if record.block is None else canonical_json(record.block),
            "settings": canonical_json(record.settings),
            **_result_values(record.result),
        }
        rows.append(tuple(values[name] for name in _COMBINATION_COLUMNS))
    insert_rows(connection, combination, _COMBINATION_COLUMNS, rows)
    stored = known_combinations(connection, new)
    # What another campaign stored meanwhile stays all its own: two processors may have made
    # maps that differ in the last bits, and a mixture of both would be none.
    query = select(combination.c.natural_key).where(combination.c.campaign_id == campaign_id)
    own_keys = {key for (key,) in rows_of_keys(connection, query, combination.c.natural_key, new)}
    new = {key: record for key, record in new.items() if key in own_keys}
    results = {key: record.result for key, record in new.items() if record.result is not None}
    _insert_intervals(connection, stored, results)
    points = {key: result.points for key, result in results.items()}
    grids = {key: record.grid for key, record in new.items() if record.grid is not None}
    _insert_points(connection, stored, points, grids)
    return len(new)


def insert_points(connection: Connection, points: Mapping[str, SearchPoints]) -> None:
    """Store simulated blocks of stored combinations; strengths already stored are kept.

    Args:
        points: the blocks, by the natural key of their combination.
    """
    _insert_points(connection, _all_known(connection, points), points, {})


def add_grids(connection: Connection, grids: Mapping[str, SearchPoints]) -> None:
    """Store the outcome grids of stored combinations that have none.

    Args:
        grids: the blocks by the natural key of their combination, number i of the grid at place i.
    """
    stored = _all_known(connection, grids)
    lacking = {key: grid for key, grid in grids.items() if not stored[key].gridded}
    _insert_points(connection, stored, {}, lacking)


def add_maps(connection: Connection, results: Mapping[str, CriticalResult]) -> None:
    """Store the maps of stored combinations that have none, and the results that require a map.

    Args:
        results: searches with their maps, by the natural key of their combination.
    """
    stored = _all_known(connection, results)
    new = {key: result for key, result in results.items() if not stored[key].mapped}
    _insert_intervals(connection, stored, new)
    for key, result in new.items():
        columns = _result_values(result)
        values = {name: columns[name] for name in _OF_A_MAP}
        update_rows(connection, combination, combination.c.id == stored[key].id, values)


def _all_known(connection: Connection, keys: Iterable[str]) -> dict[str, KnownCombination]:
    stored = known_combinations(connection, keys := [*keys])
    for key in keys:
        if key not in stored:
            raise InputError(f"unknown combination {key}")
    return stored


def _insert_points(
    connection: Connection,
    stored: Mapping[str, KnownCombination],
    points: Mapping[str, SearchPoints],
    grids: Mapping[str, SearchPoints],
) -> None:
    # a search may come back to a point, and the grid may meet one: the first row of each strength
    met: dict[tuple[object, ...], tuple[object, ...]] = {}
    numbered: dict[tuple[object, ...], tuple[object, ...]] = {}
    for key, blocks in points.items():
        for row in _point_rows(stored[key].id, blocks, repeat(None)):
            met.setdefault(row[:2], row)
    for key, blocks in grids.items():
        for row in _point_rows(stored[key].id, blocks, count()):
            numbered.setdefault(row[:2], row)
    unnumbered = [row for place, row in met.items() if place not in numbered]
    insert_rows(connection, simulation, POINT_COLUMNS, unnumbered)
    insert_rows(
        connection, simulation, POINT_COLUMNS, [*numbered.values()], on_conflict=GRID_MEETS_POINT
    )


def _insert_intervals(
    connection: Connection,
    stored: Mapping[str, KnownCombination],
    results: Mapping[str, CriticalResult],
) -> None:
    rows: list[tuple[object, ...]] = []
    for key, result in results.items():
        map_ = result.intervals
        ends = zip(map_.k_lo.tolist(), map_.k_hi.tolist(), map_.outcome, strict=True)
        rows += ((stored[key].id, *interval) for interval in ends)
    insert_rows(connection, outcome_interval, INTERVAL_COLUMNS, rows)


def _result_values(result: CriticalResult | None) -> dict[str, object]:
    if result is None:
        values: dict[str, object] = dict.fromkeys((*_NUMBERS, "reentrant"))
        return values | {
            "status": "not_searched", "certified": False, "n_runs": 0, "warnings": "[]"
        }  # fmt: skip
    return {
        **{name: _number(getattr(result, name)) for name in _NUMBERS},
        "status": result.status,
        "certified": bool(result.certified),
        "reentrant": None if result.reentrant is None else bool(result.reentrant),
        "n_runs": int(result.n_runs),
        "warnings": json.dumps(list(result.warnings)),
    }


def _point_rows(
    combination_id: int, points: SearchPoints, numbers: Iterable[int | None]
) -> Iterator[tuple[object, ...]]:
    # A search may come back to a point; a run of the same input gives the same answer.
    slid, sensitive = points.displacement_m, points.sensitive
    return zip(
        repeat(combination_id),
        points.kr_over_pga.tolist(),
        map(_number, points.theta_n.tolist()),
        map(str, points.outcome),
        repeat(None) if slid is None else map(_number, slid.tolist()),
        numbers,
        repeat(None) if sensitive is None else sensitive.tolist(),
        strict=False,
    )


def _number(value: float | None) -> float | None:
    # Drivers do not all understand numpy's scalars, and databases disagree about NaN.
    return None if value is None or math.isnan(value) else float(value)


_RESPONSE_COLUMNS = (
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
    rows: list[tuple[object, ...]] = []
    for record in records:
        answer, history = record.response, record.response.history
        if history is None:
            raise InputError("a response without its history is not stored")
        series = (
            history.time_s, history.theta_rad, history.theta_dot_rad_s, history.k_h, history.k_v
        )  # fmt: skip
        rows.append((
            record.natural_key, record.motion_id, record.vertical_motion_id, record.polarity,
            answer.kind, False, float(record.p2), float(record.kr), record.numerics_version,
            str(answer.outcome), answer.peak_theta_n, answer.peak_theta_rad,
            int(history.time_s.size), *(values.astype("<f8").tobytes() for values in series),
        ))  # fmt: skip
    insert_rows(connection, response, _RESPONSE_COLUMNS, rows)


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
    columns = ("motion_id", "polarity", "p2", "numerics_version", "x_m_s")
    insert_rows(connection, toppling_spectrum, columns, rows)


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


@dataclass(frozen=True, eq=False)
class StoredCombination:
    """Results of one stored critical search.

    Args:
        pga_g: PGA of the horizontal motion [g].
        values: the columns of the combination by name.
        settings: what else went into its natural key.
        block: which block it is; None for toppling.
        campaign_settings: what the campaign that made it was asked for, and on which machine.
        points: its simulations, by falling k_r/PGA.
        intervals: its map; empty where none is stored.
        grid: number in the kind's outcome grid of each simulation, -1 for those outside it.
    """

    id: int
    motion_id: int
    vertical_motion_id: int | None
    pga_g: float
    values: Mapping[str, Any]
    settings: Mapping[str, Any]
    block: Mapping[str, Any] | None
    campaign_settings: Mapping[str, Any]
    points: SearchPoints
    intervals: OutcomeIntervals
    grid: NDArray[np.int64]


def keys_with_samples(connection: Connection, *, numerics_version: str) -> list[str]:
    """Return the sorted natural keys of combinations that can be computed again.

    Args:
        numerics_version: of this solver; other versions may give other numbers.
    """
    query = (
        select(combination.c.natural_key)
        .select_from(with_motions(combination))
        .where(
            combination.c.numerics_version == numerics_version,
            motion.c.samples.is_not(None),
            combination.c.vertical_motion_id.is_(None) | vertical.c.samples.is_not(None),
        )
    )
    return sorted(connection.scalars(query))


def stored_combination(connection: Connection, natural_key: str) -> StoredCombination:
    """Return one combination by its natural key."""
    row = (
        connection.execute(
            select(combination, motion.c.pga_g, campaign.c.settings.label("campaign_settings"))
            .select_from(
                combination.join(motion, motion.c.id == combination.c.motion_id).join(campaign)
            )
            .where(combination.c.natural_key == natural_key)
        )
        .mappings()
        .one()
    )
    points = points_of(connection, [row["id"]])[row["id"]][::-1]
    intervals = intervals_of(connection, [row["id"]])[row["id"]]
    return StoredCombination(
        id=row["id"],
        motion_id=row["motion_id"],
        vertical_motion_id=row["vertical_motion_id"],
        pga_g=row["pga_g"],
        values={column.name: row[column.name] for column in combination.c},
        settings=stored_json(row["settings"], dict, f"settings of combination {row['id']}"),
        block=stored_json(row["block"], dict, f"block of combination {row['id']}"),
        campaign_settings=stored_json(row["campaign_settings"], dict, "settings of a campaign"),
        points=SearchPoints(
            kr_over_pga=_floats([point.kr_over_pga for point in points]),
            theta_n=_floats([point.theta_n for point in points]),
            outcome=tuple(point.outcome for point in points),
            displacement_m=None
            if all(point.displacement_m is None for point in points)
            else _floats([point.displacement_m for point in points]),
            sensitive=None
            if any(point.sensitive is None for point in points)
            else np.array([point.sensitive for point in points], dtype=np.bool_),
        ),
        intervals=OutcomeIntervals(
            k_lo=_floats([interval.k_lo for interval in intervals]),
            k_hi=_floats([interval.k_hi for interval in intervals]),
            outcome=tuple(interval.outcome for interval in intervals),
        ),
        grid=np.array(
            [-1 if point.grid is None else point.grid for point in points], dtype=np.int64
        ),
    )


def intervals_of(connection: Connection, ids: Sequence[int]) -> Mapping[int, list[Interval]]:
    """Return the maps of combinations, by their id."""
    return _belonging(connection, outcome_interval, Interval, ids)


def points_of(connection: Connection, ids: Sequence[int]) -> Mapping[int, list[Point]]:
    """Return the simulations of combinations, by their id."""
    return _belonging(connection, simulation, Point, ids)


def _belonging(
    connection: Connection, table: Table, row: type[Any], ids: Sequence[int]
) -> defaultdict[int, list[Any]]:
    query = select(table.c.combination_id, *(table.c[name] for name in row._fields))
    query = query.where(table.c.combination_id.in_(ids)).order_by(*table.primary_key.columns)
    by_id: defaultdict[int, list[Any]] = defaultdict(list)
    for owner, *values in connection.execute(query):
        by_id[owner].append(row._make(values))
    return by_id


def _floats(values: list[float | None]) -> NDArray[np.float64]:
    return np.array([np.nan if value is None else value for value in values], dtype=np.float64)
