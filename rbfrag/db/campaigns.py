"""Storage of campaigns and their combinations."""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import count, repeat

from sqlalchemy import Connection, exists, select

from rbfrag.db.digest import NOT_DIGESTED
from rbfrag.db.insert import insert_row, insert_rows, rows_of_keys, update_rows, utc_now
from rbfrag.db.keys import canonical_json
from rbfrag.db.rows import Interval, Point
from rbfrag.db.schema import campaign, combination, outcome_interval, simulation
from rbfrag.errors import InputError
from rbfrag.solver.critical_result import CriticalResult
from rbfrag.solver.results import NUMERICS_VERSION, SearchPoints
from rbfrag.version import __version__

_COLUMNS = tuple(column.name for column in combination.c if column.name not in NOT_DIGESTED)
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


def known_keys(connection: Connection, keys: Iterable[str]) -> set[str]:
    """Return the natural keys whose combinations are stored."""
    return set(known_combinations(connection, keys))


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
    rows = [_combination_row(campaign_id, new[key]) for key in sorted(new)]
    insert_rows(connection, combination, _COLUMNS, rows)
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
    _insert_points(
        connection, stored, {}, {k: v for k, v in grids.items() if not stored[k].gridded}
    )


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
    key_list = list(keys)
    stored = known_combinations(connection, key_list)
    for key in key_list:
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
    meeting = GRID_MEETS_POINT
    insert_rows(connection, simulation, POINT_COLUMNS, [*numbered.values()], on_conflict=meeting)


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


def _combination_row(campaign_id: int, record: CombinationRecord) -> tuple[object, ...]:
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
    return tuple(values[name] for name in _COLUMNS)


def _result_values(result: CriticalResult | None) -> dict[str, object]:
    if result is None:
        nothing = dict.fromkeys((*_NUMBERS, "reentrant"))
        return {
            **nothing, "status": "not_searched", "certified": False, "n_runs": 0, "warnings": "[]"
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
