"""Merge of the combinations of another database, with their maps and simulations."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from itertools import islice

from sqlalchemy import Connection, select

from rbfrag.db.campaigns import GRID_MEETS_POINT, INTERVAL_COLUMNS, POINT_COLUMNS
from rbfrag.db.check.maps import BORDER_ERROR, ROTATION_ERROR, contradictions
from rbfrag.db.digest import NOT_DIGESTED
from rbfrag.db.insert import insert_rows, rows_of_keys, update_rows
from rbfrag.db.merge.rows import Merge, Row, Rule, agree
from rbfrag.db.rows import Interval, Point
from rbfrag.db.schema import combination, outcome_interval, simulation
from rbfrag.db.stored_combination import intervals_of, points_of

_AT_ONCE = 500

_COLUMNS = tuple(c.name for c in combination.c if c.name not in NOT_DIGESTED)
_OF_A_MAP = ("island_width", "kr_over_pga_resolved", "reentrant")
_NOT_COMPARED = (
    "natural_key", "polarity", "kind", "linear", "p2", "block", "settings", "numerics_version",
    "campaign_id", "motion_id", "vertical_motion_id", "warnings", *_OF_A_MAP,
)  # fmt: skip
_OF_A_SEARCH = tuple(name for name in _COLUMNS if name not in _NOT_COMPARED)

_COMBINATION = Rule(combination)
_SIMULATION = Rule(simulation)


def merge_combinations(merge: Merge) -> None:
    """Merge combinations, each with its map and its simulations."""
    rows = merge.rows(combination)
    while portion := list(islice(rows, _AT_ONCE)):
        keys = [row["natural_key"] for row in portion]
        existing = _combinations_here(merge.target, keys).keys()
        values = [tuple(row[name] for name in _COLUMNS) for row in portion]
        insert_rows(merge.target, combination, _COLUMNS, values)
        combinations = _combinations_here(merge.target, keys)
        merge.added["combination"] += len(combinations.keys() - existing)
        _merge_results(
            merge, [(combinations[row["natural_key"]], row) for row in portion], existing
        )


def _combinations_here(target: Connection, keys: Sequence[str]) -> dict[str, Row]:
    column = combination.c.natural_key
    rows = rows_of_keys(target, select(combination), column, keys)
    return {row.natural_key: row._mapping for row in rows}


def _merge_results(
    merge: Merge, pairs: Sequence[tuple[Row, Row]], existing: Collection[str]
) -> None:
    """Merge maps and simulations, and compare those of existing combinations."""
    our_ids, their_ids = ([row["id"] for row in rows] for rows in zip(*pairs, strict=True))
    our_maps = intervals_of(merge.target, our_ids)
    their_maps = intervals_of(merge.source, their_ids)
    our_points = points_of(merge.target, our_ids)
    their_points = points_of(merge.source, their_ids)
    intervals: list[tuple[object, ...]] = []
    points: list[tuple[object, ...]] = []
    for ours, theirs in pairs:
        our_id, their_id = ours["id"], theirs["id"]
        maps = our_maps[our_id], their_maps[their_id]
        band = None
        if theirs["natural_key"] in existing:
            merge.same["combination"] += 1
            compared = (*_OF_A_SEARCH, *_OF_A_MAP) if all(maps) else _OF_A_SEARCH
            exact = all(ours[name] == theirs[name] for name in compared)
            if not exact or (all(maps) and maps[0] != maps[1]):
                if not _is_same_search(merge, ours, theirs, *maps):
                    continue
                merge.within_error += 1
                band = _band(ours, theirs)
            if maps[1] and not maps[0]:
                values = {name: theirs[name] for name in _OF_A_MAP}
                update_rows(merge.target, combination, combination.c.id == our_id, values)
        if not maps[0]:
            intervals += ((our_id, *interval) for interval in maps[1])
        more = _more_points(merge, theirs, our_points[our_id], their_points[their_id], band)
        points += ((our_id, *point) for point in more)
    insert_rows(merge.target, outcome_interval, INTERVAL_COLUMNS, intervals)
    insert_rows(merge.target, simulation, POINT_COLUMNS, points, on_conflict=GRID_MEETS_POINT)
    merge.added["outcome_interval"] += len(intervals)
    merge.added["simulation"] += len(points)


def _is_same_search(
    merge: Merge, ours: Row, theirs: Row, our_map: Sequence[Interval], their_map: Sequence[Interval]
) -> bool:
    """Return whether two searches agree within the solver's error; record a conflict otherwise."""
    if ours["status"] != theirs["status"]:
        merge.conflict(_COMBINATION, theirs, "status", ours["status"], theirs["status"])
        return False
    if ours["status"] == "found":
        (low, high), (low_2, high_2) = _bracket(ours), _bracket(theirs)
        if max(low, low_2) > min(high, high_2) * (1.0 + BORDER_ERROR):
            both = ours["kr_over_pga"], theirs["kr_over_pga"]
            merge.conflict(_COMBINATION, theirs, "kr_over_pga", *both)
            return False
    for bottom, top, our_outcome, there in contradictions(our_map, their_map):
        column = f"the outcome from kr/PGA {bottom!r} to {top!r}"
        merge.conflict(_COMBINATION, theirs, column, our_outcome, there)
        return False
    return True


def _more_points(
    merge: Merge,
    row: Row,
    ours: Sequence[Point],
    theirs: Sequence[Point],
    band: tuple[float, float] | None,
) -> Iterator[Point]:
    """Yield the simulations missing in the target; record contradictory ones.

    Args:
        band: where runs of the other search belong to its bracket, not to the one here.
    """
    by_strength = {point.kr_over_pga: point for point in ours}
    numbered = {point.grid: point for point in ours if point.grid is not None}
    for there in theirs:
        k, number = there.kr_over_pga, there.grid
        # another processor may have given a block of the grid a strength of other last bits
        our_point = (
            by_strength.get(k) if number is None else numbered.get(number, by_strength.get(k))
        )
        in_band = band is not None and band[0] <= k <= band[1]
        if our_point is None:
            if number is not None or not in_band:
                yield there
            continue
        if number is not None and our_point.grid is None:
            yield our_point._replace(grid=number)
        slid = f"displacement_m at ky/PGA {k!r}"
        compared: list[tuple[str, object, object]]
        compared = [(slid, our_point.displacement_m, there.displacement_m)]
        if our_point.outcome != there.outcome:
            # another processor's last bits turn a sensitive outcome as other motions do
            if not (in_band or our_point.sensitive or there.sensitive):
                compared.append((f"the outcome at kr/PGA {k!r}", our_point.outcome, there.outcome))
        elif our_point.sensitive is None:  # elsewhere the size of peaks may be chaotic
            compared.append((f"theta_n at kr/PGA {k!r}", our_point.theta_n, there.theta_n))
        for column, our_value, other in compared:
            if not agree(our_value, other, ROTATION_ERROR):
                merge.conflict(_SIMULATION, row, column, our_value, other)


def _bracket(row: Row) -> tuple[float, float]:
    k, lower, upper = row["kr_over_pga"], row["lower"], row["upper"]
    return k if lower is None else lower, k if upper is None else upper


def _band(ours: Row, theirs: Row) -> tuple[float, float] | None:
    """Return the range of k/PGA in which runs of the other search belong to its own bracket."""
    if ours["status"] != "found":
        return None
    (low, high), (low_2, high_2) = _bracket(ours), _bracket(theirs)
    return min(low, low_2) * (1.0 - BORDER_ERROR), max(high, high_2) * (1.0 + BORDER_ERROR)
