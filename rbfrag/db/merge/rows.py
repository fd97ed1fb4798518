"""Merge of rows: inserted, completed or rejected."""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from sqlalchemy import Connection, RowMapping, Table, select

from rbfrag.db.digest import NOT_DIGESTED
from rbfrag.db.insert import insert_row, update_rows
from rbfrag.db.keys import key_of_row
from rbfrag.db.motions import samples_of_motions
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
