"""Merge of rows and of results: inserted, completed or rejected."""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import islice
from typing import Any

from sqlalchemy import Connection, RowMapping, Table, select

from rbfrag.db.campaigns import (
    GRID_MEETS_POINT,
    INTERVAL_COLUMNS,
    POINT_COLUMNS,
    intervals_of,
    points_of,
)
from rbfrag.db.check_results import BORDER_ERROR, ROTATION_ERROR, contradictions
from rbfrag.db.insert import insert_row, insert_rows, rows_of_keys, update_rows
from rbfrag.db.keys import NOT_DIGESTED, key_of_row
from rbfrag.db.motions import samples_of_motions
from rbfrag.db.rows import Interval, Point
from rbfrag.db.schema import combination, outcome_interval, simulation
from rbfrag.results.diagnostic import Diagnostic

Row = RowMapping | Mapping[str, Any]


@dataclass(frozen=True)
class Rule:
    """Unique keys of a table, and the treatment of existing rows.

    Args:
        keys: columns by which rows are the same, the ones tried first before others; one that
            holds None tells nothing.
        label: how messages name a row.
        compared: columns that must agree, and to which relative error.
        filled: columns that are filled in where they are missing here.
    """

    table: Table
    keys: tuple[tuple[str, ...], ...] = (("natural_key",),)
    label: str = "{natural_key:.12}…"
    compared: Mapping[str, float] = field(default_factory=dict)
    filled: tuple[str, ...] = ()


@dataclass
class Merge:
    """Source and target of a merge, with its counts and conflicts.

    Args:
        target: the database that is merged into, inside the caller's transaction.
        ids: the row here of each row there, by table.
        other_bits: whether some motion has samples of other last bits here, as another machine's
            filter rounds; natural keys are then those with the samples here.
    """

    source: Connection
    target: Connection
    added: Counter[str] = field(default_factory=Counter)
    same: Counter[str] = field(default_factory=Counter)
    restated: int = 0
    within_error: int = 0
    warnings: list[Diagnostic] = field(default_factory=list)
    conflicts: list[str] = field(default_factory=list)
    ids: dict[str, dict[int, int]] = field(default_factory=lambda: defaultdict(dict))
    other_bits: bool = False

    def warn_of_name(self, subject: str, name: str) -> None:
        """Add a warning of a row that is stored under another name.

        Args:
            subject: what the databases have one of each, with the name they share.
            name: the new name of the other's.
        """
        text = f"the databases differ in {subject}: that of the other is stored as {name!r}"
        self.warnings.append(Diagnostic(text, "renamed"))

    def rows(self, table: Table) -> Iterator[Row]:
        """Yield the source rows with the ids of the target, without their own id."""
        references = [(c.name, key.column.table.name) for c in table.c for key in c.foreign_keys]
        samples = samples_of_motions(self.target) if self.other_bits else {}
        for row in stored_rows(self.source, table):
            values = dict(row)
            for name, owner in references:
                values[name] = None if row[name] is None else self.ids[owner][row[name]]
            if self.other_bits and "natural_key" in values:
                values["natural_key"] = key_of_row(values, samples)
            yield values

    def bring(self, rule: Rule, theirs: Row) -> int:
        """Insert a new row, or compare and complete an existing one; return its id."""
        name, number = rule.table.name, theirs.get("id")
        id_map = self.ids[name]
        if number in id_map:
            return id_map[number]
        ours = self.find(rule, theirs)
        if ours is None:
            columns = [c.name for c in rule.table.c if c.name not in NOT_DIGESTED]
            row_id = insert_row(self.target, rule.table, {c: theirs[c] for c in columns})
            self.added[name] += 1
        else:
            row_id = ours.get("id", 0)
            self.same[name] += 1
            self.compare(rule, ours, theirs)
        if number is not None:
            id_map[number] = row_id
        return row_id

    def find(self, rule: Rule, theirs: Row) -> Row | None:
        """Return the same row of the target."""
        for key in rule.keys:
            values = {column: theirs[column] for column in key}
            if None in values.values():
                continue
            query = select(rule.table).filter_by(**values).order_by(*rule.table.primary_key.columns)
            ours = self.target.execute(query).mappings().first()
            if ours is not None:
                return ours
        return None

    def compare(self, rule: Rule, ours: Row, theirs: Row) -> None:
        """Record contradictions, and fill in missing values of the target."""
        exact = True
        for column, error in rule.compared.items():
            our_value, there = ours[column], theirs[column]
            unknown = column in rule.filled and None in (our_value, there)
            if unknown or ours.get("guessed"):
                continue
            exact &= our_value == there
            if not agree(our_value, there, error):
                self.conflict(rule, theirs, column, our_value, there)
                return
        self.within_error += not exact
        missing = {
            column: theirs[column]
            for column in rule.filled
            if ours[column] in (None, "") and theirs[column] not in (None, "")
        }
        if missing:
            update_rows(self.target, rule.table, rule.table.c.id == ours["id"], missing)

    def conflict(self, rule: Rule, row: Row, column: str, our_value: object, there: object) -> None:
        """Record a conflict between two values."""
        name = rule.label.format_map(row)
        self.conflicts.append(
            f"{rule.table.name} {name}: {column} is {our_value!r} here and {there!r} there"
        )


def stored_rows(connection: Connection, table: Table) -> Iterator[Row]:
    """Yield the rows of a table in key order, a few in memory at once."""
    query = select(table).order_by(*table.primary_key.columns)
    yield from connection.execute(query, execution_options={"yield_per": 16}).mappings()


def agree(our_value: object, there: object, error: float) -> bool:
    """Return whether two values are equal; numbers within a relative error."""
    if isinstance(our_value, float) and isinstance(there, float):
        return math.isclose(our_value, there, rel_tol=error, abs_tol=1e-6 * error)
    return our_value == there


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
                if ours["status"] == "found":
                    # runs of the other search in this range of k/PGA belong to its own bracket
                    ends = *_bracket(ours), *_bracket(theirs)
                    band = min(ends) * (1.0 - BORDER_ERROR), max(ends) * (1.0 + BORDER_ERROR)
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
