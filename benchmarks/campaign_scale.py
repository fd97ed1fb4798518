"""The default campaign at full scale:  python -m benchmarks.campaign_scale --records FOLDER

FOLDER is the collection of real records that the tests use, with its MANIFEST.csv. Everything is
done by rbfrag itself on databases in a temporary folder; each campaign is a process of its own.
"""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Sequence
from pathlib import Path

from sqlalchemy import func, select

from benchmarks.one_campaign import run_campaign
from benchmarks.page import RECORDS_VARIABLE, markdown, parser, report
from rbfrag.campaign.add_motions import add_motions
from rbfrag.db import schema
from rbfrag.db.engine import opened_database
from rbfrag.db.motions import add_to_suite, motion_rows

SUITE = "timed"
TABLES = (schema.combination, schema.outcome_interval, schema.simulation)
"""Tables of results whose rows are counted."""


def main(arguments: Sequence[str] | None = None) -> None:
    options = parser(__doc__)
    options.add_argument("--motions", type=int, help="take only so many horizontal motions")
    chosen = options.parse_args(arguments)
    root = chosen.records or os.environ.get(RECORDS_VARIABLE)
    if root is None:
        raise SystemExit("no records: name a folder with --records")
    with tempfile.TemporaryDirectory() as folder:
        base = Path(folder) / "base.db"
        motions = prepare(Path(root), base, chosen.motions)
        cells = [campaign(base, jobs) for jobs in (1, 2)]
    headers = [
        "workers", "combinations", "found / below the limit / no motion", "certified", "runs",
        "rows", "wall time", "processor time", "rows per second", "database grows by",
    ]  # fmt: skip
    text = f"{markdown((headers, cells))}\n\n{motions} horizontal motions."
    report("campaign-default", text, write=chosen.write)


def prepare(root: Path, base: Path, at_most: int | None) -> int:
    """Make a database of the records with the suite; return how many horizontals it has."""
    manifest = root / "MANIFEST.csv"
    added = add_motions([root], db=base, metadata=manifest if manifest.exists() else None)
    print(f"{len(added.added)} traces added", flush=True)
    with opened_database(base) as engine, engine.begin() as connection:
        rows = [row for row in motion_rows(connection) if not row.is_vertical]
        # by digest: an order that has nothing to do with the records
        rows = sorted(rows, key=lambda row: row.sha256)[:at_most]
        for row in rows:
            add_to_suite(connection, SUITE, row.id)
    return len(rows)


def campaign(base: Path, jobs: int) -> list[str]:
    """Run the default campaign on a copy of a database; return a row of the table."""
    place = base.with_name(f"run-{jobs}.db")
    shutil.copy(base, place)
    before = place.stat().st_size
    summary = run_campaign(place, jobs=jobs, suite=SUITE)
    with opened_database(place, read_only=True) as engine, engine.connect() as connection:
        rows = sum(
            connection.execute(select(func.count()).select_from(table)).scalar_one()
            for table in TABLES
        )
    return [
        str(jobs),
        f"{summary['combinations']:,}",
        f"{summary['found']:,} / {summary['below_limit']:,} / {summary['no_motion']:,}",
        f"{summary['certified']:,}",
        f"{summary['runs']:,}",
        f"{rows:,}",
        f"{summary['seconds']:.0f} s",
        f"{summary['writer_s'] + summary['workers_s']:.0f} s",
        f"{rows / summary['seconds']:,.0f}",
        f"{(place.stat().st_size - before) / 1e6:.1f} MB",
    ]


if __name__ == "__main__":
    main()
