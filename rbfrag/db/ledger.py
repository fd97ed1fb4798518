"""Ledger of written rows: their number in each table, and the XOR of their digests.

A row that another program deletes or adds leaves no trace in the other rows; the ledger tells of
it. It is kept in memory and written by one statement when the transaction commits.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence
from functools import reduce
from itertools import groupby, repeat
from operator import itemgetter, xor

from sqlalchemy import Connection, Engine, Table, delete, event, func, select, update

from rbfrag.db.schema import combination, ledger, metadata

Tallies = dict[tuple[str, int], tuple[int, int]]
"""Number of rows and XOR of their digests, by table and campaign; 0 for rows of no campaign."""

_OWNERS = ("campaign_id", "combination_id")
"""What says whose a row is: a campaign, or a combination, which is of one."""
_PENDING = "rbfrag_ledger"
_IDS_AT_ONCE, _MOST_KEPT = 500, 10_000
_WRITE = (
    "INSERT INTO ledger (of_table, campaign, row_count, digests) VALUES ({0}, {0}, {0}, {0}) "
    "ON CONFLICT (of_table, campaign) DO UPDATE SET "
    "row_count = ledger.row_count + excluded.row_count, digests = "
    # XOR, for which SQLite and PostgreSQL have no sign in common
    "(ledger.digests | excluded.digests) - (ledger.digests & excluded.digests)"
)


def keep_ledger(engine: Engine) -> None:
    """Write the counts of :func:`tally` in each transaction of an engine."""
    event.listen(engine, "begin", _forget)
    event.listen(engine, "rollback", _forget)
    event.listen(engine, "commit", _write)


def tally(
    connection: Connection,
    table: Table,
    columns: Sequence[str],
    rows: Sequence[Sequence[object]],
    digests: Sequence[int],
    *,
    sign: int = 1,
) -> None:
    """Record rows that the open transaction inserts or deletes.

    Args:
        columns: names of the columns of `rows`.
        sign: 1 for rows that come, -1 for rows that go.
    """
    owner = next((name for name in _OWNERS if name in table.c), "")
    owners = map(itemgetter(columns.index(owner)), rows) if owner else repeat(0)
    pending = connection.info.setdefault(_PENDING, {})
    for of, group in groupby(zip(owners, digests, strict=False), itemgetter(0)):
        values = [digest for _, digest in group]
        number, together = pending.get((table.name, owner, of), (0, 0))
        pending[table.name, owner, of] = number + sign * len(values), reduce(xor, values, together)
    if len(pending) > _MOST_KEPT:  # a merge in one transaction may be of any size
        _write(connection)


def written_tallies(connection: Connection) -> Tallies:
    """Return the ledger, including the open transaction."""
    _write(connection)
    rows = connection.execute(select(ledger))
    return {(row.of_table, row.campaign): (row.row_count, row.digests) for row in rows}


def stored_tallies(connection: Connection) -> Tallies:
    """Return the counts and digests of the stored rows."""
    tallies: Tallies = defaultdict(lambda: (0, 0))
    for name, table in sorted(metadata.tables.items()):
        query = select(table.c.digest)
        if "campaign_id" in table.c:
            query = query.add_columns(table.c.campaign_id)
        elif "combination_id" in table.c:
            query = query.add_columns(combination.c.campaign_id).join(combination)
        rows = connection.execute(query, execution_options={"yield_per": 10_000})
        for digest, *campaign in rows:
            key = name, campaign[0] if campaign else 0
            number, together = tallies[key]
            # SQLite accepts any value; one that is not a digest is found by the check of digests
            tallies[key] = number + 1, together ^ (digest if isinstance(digest, int) else 0)
    return dict(tallies)


def renew_ledger(connection: Connection) -> None:
    """Replace the ledger by the present rows."""
    _forget(connection)
    connection.execute(delete(ledger))
    _insert(connection, stored_tallies(connection))


def note_sound(connection: Connection, time: str) -> None:
    """Record that :func:`rbfrag.db.check.check_database` found nothing at that time."""
    connection.execute(update(ledger).values(found_sound=time))


def last_sound(connection: Connection) -> str | None:
    """Return the time of the last check without findings; None if never."""
    time: str | None = connection.scalar(select(func.max(ledger.c.found_sound)))
    return time


def _forget(connection: Connection) -> None:
    # what is noted with a connection goes with it when the server is gone
    if not connection.invalidated:
        connection.info.pop(_PENDING, None)


def _write(connection: Connection) -> None:
    pending = connection.info.pop(_PENDING, {})
    combinations = sorted({of for _, owner, of in pending if owner == "combination_id"})
    campaigns: dict[int, int] = {}
    for start in range(0, len(combinations), _IDS_AT_ONCE):
        id_list = ", ".join(map(str, combinations[start : start + _IDS_AT_ONCE]))
        query = f"SELECT id, campaign_id FROM combination WHERE id IN ({id_list})"
        campaigns.update((row[0], row[1]) for row in connection.exec_driver_sql(query))
    sums: Tallies = {}
    for (name, owner, of), (number, digests) in pending.items():
        key = name, campaigns[of] if owner == "combination_id" else of
        before = sums.get(key, (0, 0))
        sums[key] = before[0] + number, before[1] ^ digests
    _insert(connection, sums)


def _insert(connection: Connection, tallies: Tallies) -> None:
    # in one order, so that two transactions wait for each other and never both at once
    rows: Iterable[tuple[object, ...]] = sorted((*key, *sums) for key, sums in tallies.items())
    if rows:
        mark = "?" if connection.dialect.paramstyle == "qmark" else "%s"
        connection.exec_driver_sql(_WRITE.format(mark), [*rows])
