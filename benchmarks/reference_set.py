"""The reference that is shipped:  python -m benchmarks.reference_set --records FOLDER --work FOLDER

Runs the default campaigns of all kinds over folders of real records (--records for each), toppling
with and without vertical motion, keeps what fits and predictions need, and writes
rbfrag/reference/reference.db and the page of its provenance. No sample of any record is kept. The
full database stays in --work as reference-full.db: one that is there is gone on with.
"""

from __future__ import annotations

import argparse
import csv
import hashlib
import os
import sqlite3
import sys
import textwrap
from bisect import bisect_right
from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from itertools import repeat
from multiprocessing import get_context
from pathlib import Path
from random import Random
from typing import Any

from sqlalchemy import ColumnElement, Connection, delete, func, select

from benchmarks.database_content import content_digest
from benchmarks.page import RECORDS_VARIABLE, ROOT, markdown
from rbfrag.campaign.add_motions import add_motions
from rbfrag.campaign.simulate import CampaignProgress, CampaignSummary, simulate
from rbfrag.db import schema
from rbfrag.db.check import check_database
from rbfrag.db.engine import opened_database
from rbfrag.db.insert import update_rows
from rbfrag.db.ledger import renew_ledger
from rbfrag.db.location import REFERENCE
from rbfrag.db.model_file import ModelRow
from rbfrag.db.models import save_model
from rbfrag.db.motions import add_to_suite
from rbfrag.fragility.fit.data import KR
from rbfrag.fragility.fit.fitting import fit
from rbfrag.fragility.fit.report import FitReport
from rbfrag.fragility.model import FragilityModel
from rbfrag.solver.results import NUMERICS_VERSION
from rbfrag.version import __version__

SPARED_INDEX = "ix_combination_campaign_id"
"""Left out: of the few campaigns in the file nobody asks for one alone."""

MOST_BYTES = 26_000_000
"""Greatest size of the file that is shipped: everyone downloads it. What models of slumping and
confined blocks are fitted to is left out."""

PAGE = ROOT / "docs" / "evidence" / "reference-data.md"

SUITE = "reference"

FEW = "two-recordings"
"""Suite of the campaigns of slumping and confined toppling, whose runs take a hundred times as
long."""

RECORDINGS = 2
"""Recordings of each earthquake in it, drawn at random."""

MODELS: tuple[dict[str, Any], ...] = (
    *({"method": "toppling", "term": term} for term in ("pgv_pga", "pga", "sa", "pgv")),
    {"method": "record", "term": "xp"},
    *(
        {"method": method, "term": term}
        for method in ("wls", "logistic")
        for term in ("pgv", "pga_tm", "pgd_tm")
    ),
    *({"kind": "sliding", "term": term} for term in ("pgv_pga_m", "pgv_pga", "pgv_pga_ia", "pgv")),
    *({"kind": "rocking", "term": term} for term in ("pga", "sa", "pgv")),
)
"""The models that are shipped and fitted to what is shipped."""

MODELS_OF_ALL: tuple[dict[str, Any], ...] = (
    *(
        {"kind": "slumping", "term": term, "rotation_deg": rotation, "suite": FEW}
        for rotation in (None, 2.0)
        for term in ("pgv_pga_m", "pgv_pga")
    ),
    *(
        {"kind": "confined_toppling", "term": term, "suite": FEW}
        for term in ("pgv_pga_m", "pgv_pga")
    ),
)
"""The models that are fitted to the full database: what they read is too much to be shipped."""

MODELS_ALONE = {model["kind"]: model.get("suite", SUITE) for model in MODELS_OF_ALL}
"""The kinds of which models are shipped without what they are fitted to, and their suites."""


def main(arguments: Sequence[str] | None = None) -> None:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument(
        "--records", action="append", type=Path, help="folder of records with MANIFEST.csv; several"
    )
    options.add_argument("--work", type=Path, required=True, help="folder for the full database")
    options.add_argument("--jobs", type=int, help="worker processes")
    options.add_argument("--out", type=Path, default=REFERENCE, help="the file that is shipped")
    options.add_argument("--page", type=Path, default=PAGE, help="the page of its provenance")
    options.add_argument("--without-models", action="store_true", help="results alone")
    chosen = options.parse_args(arguments)
    roots = chosen.records or [Path(root) for root in (os.environ.get(RECORDS_VARIABLE),) if root]
    if not roots:
        raise SystemExit("no records: name a folder with --records")
    full = chosen.work / "reference-full.db"
    for root in roots:
        add_motions([root], db=full, suite=SUITE, metadata=root / "MANIFEST.csv")
    run = {"db": full, "suite": SUITE, "jobs": chosen.jobs, "on_progress": show}
    summary = simulate(kind="toppling", vertical="both", **run)
    for kind in ("sliding", "rocking"):
        simulate(kind=kind, **run)
    if not chosen.without_models:
        draw_recordings(full)
        for kind, suite in MODELS_ALONE.items():
            simulate(kind=kind, **{**run, "suite": suite})
    database = chosen.work / "reference.db"
    reduce(full, database)
    reports = []
    if not chosen.without_models:
        reports = add_models(database, database, MODELS, chosen.jobs)
        reports += add_models(full, database, MODELS_OF_ALL, chosen.jobs)
    pack(database)
    examine(database)
    chosen.out.parent.mkdir(parents=True, exist_ok=True)
    # in place at once or not at all
    beside = chosen.out.with_name(f"{chosen.out.name}.new")
    beside.write_bytes(database.read_bytes())
    beside.replace(chosen.out)
    chosen.page.write_text(provenance(database, roots, summary, reports), encoding="utf-8")
    print(f"{chosen.out}: {database.stat().st_size:,} bytes\n{chosen.page}")


def draw_recordings(full: Path) -> None:
    """Put the horizontal motions of some recordings of each earthquake into a suite."""
    motion, recording, earthquake = schema.motion.c, schema.recording.c, schema.earthquake.c
    query = (
        select(earthquake.event_id, recording.id, motion.id)
        .join(schema.recording, recording.earthquake_id == earthquake.id)
        .join(schema.motion, motion.recording_id == recording.id)
        .where(~motion.is_vertical)
        .order_by(earthquake.event_id, recording.id, motion.id)
    )
    random = Random(31)
    with opened_database(full) as engine, engine.begin() as connection:
        of_events: dict[str, dict[int, list[int]]] = defaultdict(lambda: defaultdict(list))
        for event, place, number in connection.execute(query):
            of_events[event][place].append(number)
        events = list(of_events)
        random.shuffle(events)
        for event in events:
            positions = list(of_events[event])
            random.shuffle(positions)
            for place in positions[:RECORDINGS]:
                for number in of_events[event][place]:
                    add_to_suite(connection, FEW, number)


def show(progress: CampaignProgress) -> None:
    print(f"{progress.completed}/{progress.total} combinations", file=sys.stderr, flush=True)


def reduce(full: Path, database: Path) -> None:
    """Copy the full database without samples, and with no more of each combination than needed.

    Of toppling all stays but the grids of combinations with vertical motion, which no shipped model
    reads, blocks that are too weak to be read, but for the strongest of a grid, above which all are
    safe, and the upper ends of brackets. Of rocking the blocks stay that are read. Of sliding the
    combinations of displacement 0 stay, whose grids are the whole curves.
    """
    database.unlink(missing_ok=True)
    raw = sqlite3.connect(full)
    raw.execute("VACUUM INTO ?", (str(database),))
    raw.close()
    table, point = schema.combination, schema.simulation
    settings = func.json_extract(table.c.settings, "$.displacement_m")
    spare = table.c.kind.in_(list(MODELS_ALONE)) | ((table.c.kind == "sliding") & (settings != 0.0))
    vertical = select(table.c.id).where(table.c.vertical_motion_id.is_not(None))
    with opened_database(database) as engine, engine.begin() as connection:
        motion = schema.motion
        update_rows(connection, motion, motion.c.samples.is_not(None), {"samples": None})
        connection.execute(delete(schema.response))
        for child in (schema.outcome_interval, point):
            owner = child.c.combination_id
            connection.execute(delete(child).where(owner.in_(select(table.c.id).where(spare))))
        connection.execute(delete(table).where(spare))
        beside = point.c.grid.is_(None)
        connection.execute(delete(point).where(~beside, point.c.combination_id.in_(vertical)))
        strongest = select(func.max(point.c.grid)).scalar_subquery()
        pga = (
            select(motion.c.pga_g)
            .join(table, table.c.motion_id == motion.c.id)
            .where(table.c.id == point.c.combination_id, table.c.kind.in_(("toppling", "rocking")))
            .scalar_subquery()
        )
        weak = (point.c.kr_over_pga * pga < KR[0] * (1.0 - 1e-9)) & (point.c.grid < strongest)
        connection.execute(delete(point).where(~beside, weak))
        upper = point.c.kr_over_pga == table.c.upper
        ends = select(table.c.id).where(upper, table.c.id == point.c.combination_id)
        connection.execute(delete(point).where(beside, ends.exists()))
        renew_ledger(connection)  # what is left is the whole of what is shipped


def pack(database: Path) -> None:
    """Leave one file without gaps or journal."""
    raw = sqlite3.connect(database, isolation_level=None)
    raw.execute(f"DROP INDEX IF EXISTS {SPARED_INDEX}")
    raw.execute("PRAGMA journal_mode = DELETE")
    raw.execute("VACUUM")
    raw.close()


def add_models(
    source: Path, database: Path, models: Sequence[dict[str, Any]], jobs: int | None
) -> list[FitReport]:
    """Fit models to one database, without vertical motion, and store them in what is shipped."""
    with ProcessPoolExecutor(jobs, mp_context=get_context("spawn")) as pool:
        rows = list(pool.map(fitted_row, repeat(source), models))
    with opened_database(database) as engine, engine.begin() as connection:
        for row in rows:
            save_model(connection, row, replace=True)
    return [FitReport.from_model(FragilityModel.from_row(row)) for row in rows]


def fitted_row(source: Path, options: dict[str, Any]) -> ModelRow:
    """Return one model, fitted in a process of its own."""
    row = fit(source, dependence=True, **options).model.row
    print(f"fitted {row.name}", file=sys.stderr, flush=True)
    return row


def examine(database: Path) -> None:
    """Reject to ship a file that is damaged, too large, or holds samples."""
    with opened_database(database, read_only=True) as engine, engine.connect() as connection:
        findings = list(check_database(connection))
        if findings:
            raise SystemExit(f"the reduced database is damaged: {findings[0]}")
        column = schema.motion.c.samples
        if connection.execute(select(column).where(column.is_not(None))).first() is not None:
            raise SystemExit("the reduced database holds samples")
    if database.stat().st_size > MOST_BYTES:
        raise SystemExit(
            f"{database} has {database.stat().st_size:,} bytes, more than {MOST_BYTES:,}"
        )


CLASSES: tuple[tuple[str, str, tuple[float, ...]], ...] = (
    ("magnitude", "magnitude", (5.0, 5.6, 6.4, 7.0, 7.5)),
    ("PGV [m/s]", "pgv_of_samples", (0.05, 0.1, 0.2, 0.4, 0.8)),
    ("Vs30 [m/s]", "vs30_m_s", (180.0, 360.0, 760.0, 1500.0)),
    ("distance to the rupture's projection [km]", "rjb_km", (5.0, 15.0, 30.0, 60.0)),
)
"""What the page counts motions by: words, column, edges."""


SOURCES = {"motions_nga": "gerardjoreilly/Infilled-RC-Building-Database"}
"""Where the records of folders come from whose manifest does not say so."""


def measured(connection: Connection) -> list[dict[str, str]]:
    """Return PGV and earthquake of every horizontal motion."""
    motion, recording, earthquake = schema.motion.c, schema.recording.c, schema.earthquake.c
    query = (
        select(motion.pgv_m_s, earthquake.event_id)
        .join(schema.recording, recording.id == motion.recording_id)
        .join(schema.earthquake, earthquake.id == recording.earthquake_id)
        .where(~motion.is_vertical)
    )
    return [
        {"pgv_of_samples": str(pgv), "event_id": event} for pgv, event in connection.execute(query)
    ]


def manifest_rows(roots: Sequence[Path]) -> list[dict[str, str]]:
    """Return the horizontal motions of all manifests, those without a set under their folder's."""
    rows = []
    for root in roots:
        with (root / "MANIFEST.csv").open(encoding="utf-8", newline="") as file:
            rows += [{"set": root.name, **row} for row in csv.DictReader(file)]
    return rows


def class_table(
    rows: Sequence[Mapping[str, str]], words: str, name: str, edges: Sequence[float]
) -> str:
    """Return how many motions and earthquakes lie in each class of one column."""
    classes: dict[int, list[Mapping[str, str]]] = defaultdict(list)
    for row in rows:
        value = row.get(name)
        classes[bisect_right(edges, float(value)) if value else -1].append(row)
    names = {-1: "unknown", 0: f"below {edges[0]:g}", len(edges): f"{edges[-1]:g} and more"}
    names |= {i: f"{edges[i - 1]:g} to {edges[i]:g}" for i in range(1, len(edges))}
    cells = [
        [names[number], str(len(members)), str(len({row["event_id"] for row in members}))]
        for number, members in sorted(classes.items(), key=lambda item: item[0] % (len(edges) + 2))
    ]
    return markdown(([words, "horizontal motions", "earthquakes"], cells))


def provenance(
    database: Path, roots: Sequence[Path], summary: CampaignSummary, models: Sequence[FitReport]
) -> str:
    """Return the page that says where the shipped data come from."""
    rows = manifest_rows(roots)
    sets: dict[str, list[dict[str, str]]] = defaultdict(list)
    for row in rows:
        sets[row["set"]].append(row)
    cells = [
        [
            name,
            members[0].get("format", "AT2 (PEER)"),
            str(sum(not int(row["is_vertical"]) for row in members)),
            str(sum(int(row["is_vertical"]) for row in members)),
            str(len({row["event_id"] for row in members})),
            ", ".join(
                sorted(
                    {row.get("source_repo") or SOURCES.get(name, "not stated") for row in members}
                )
            ),
        ]
        for name, members in sorted(sets.items())
    ]
    headers = ["set", "format", "horizontal", "vertical", "earthquakes", "source repository"]
    horizontal = [row for row in rows if not int(row["is_vertical"])]
    table, point = schema.combination, schema.simulation
    with opened_database(database, read_only=True) as engine, engine.connect() as connection:
        digest = content_digest(connection)
        toppling = table.c.kind == "toppling"
        status = Counter(connection.scalars(select(table.c.status).where(toppling)))
        slid = point.c.displacement_m.is_not(None)
        displacements = count(connection, slid)
        outcomes = count(connection, point.c.grid.is_not(None) & ~slid)
        ends = count(connection, point.c.grid.is_(None))
        velocities = measured(connection)
        shaken = connection.scalar(
            select(func.count()).where(table.c.vertical_motion_id.is_not(None))
        )
    counts = ", ".join(f"{number:,} {name}" for name, number in sorted(status.items()))
    events = len({row["event_id"] for row in horizontal})
    classes = "\n\n".join(
        class_table(velocities if name == "pgv_of_samples" else horizontal, words, name, edges)
        for words, name, edges in CLASSES
    )
    return f"""# The reference data set

`rbfrag/reference/reference.db` is shipped with rbfrag: a read-only SQLite database with the
results of the default campaigns over a collection of recorded earthquakes. Where there is no
database of your own, `rbfrag predict` answers from it. It holds **no samples of any record**, only
what was computed from them: intensity measures, toppling spectra, critical values with their
brackets, and outcomes of blocks.

```sh
python -m benchmarks.reference_set --records FOLDER --records FOLDER --work FOLDER
```

builds the file and this page from the records.

## What it holds

- {summary.combinations:,} combinations of toppling ({counts}), {shaken:,} of them with vertical
  motion: every horizontal motion, with and without the vertical motion of its recording, in both
  polarities, for $p^2$ = 30, 10, 3, 1, 0.3 and 0.1 1/s². {summary.certified:,} are certified.
- {outcomes:,} outcomes of the combinations without vertical motion, of toppling and of
  free-standing blocks with two factors on the restitution: of the
  [grid](../howto/run-a-campaign.md) of each the blocks of $k_r$ = {KR[0]:g} and more, which
  fits read, and the strongest; each block simulated for itself, also below the search limit. A fit
  to the file is exactly the model that is shipped in it.
- {ends:,} critical blocks.
- {displacements:,} displacements of sliding blocks, of 23 strengths in both polarities of every
  horizontal motion ([how](other-kinds.md)).
- {len(rows)} motions of {events} earthquakes with their intensity
  measures, their response spectra at 21 periods, RotD50 and RotD100 of their recordings, the
  hash of their samples, their earthquake, and what was done to them: uncorrected records were
  filtered as `rbfrag motions add` does it.

Maps of intervals, weaker blocks, and the grids of combinations with vertical motion are not in it:
`rbfrag simulate` makes them where the records are.

## What the motions are

{classes}

{model_section(models)}## Where the records come from

{markdown((headers, cells))}

The records themselves belong to the networks that made them and are not passed on here.

## Identity

| | |
| --- | --- |
| rbfrag | {__version__} |
| numerics version | {NUMERICS_VERSION} |
| combinations | {summary.combinations:,} |
| content digest | `{digest}` |
| sha256 of the file | `{hashlib.sha256(database.read_bytes()).hexdigest()}` |
| size | {database.stat().st_size:,} bytes |

The content digest is that of [equal databases](../howto/keep-a-database.md): it is the same for a
file that was built elsewhere from the same records with the same numerics, as far as processors
agree in the last bit.
"""


def count(connection: Connection, chosen: ColumnElement[bool]) -> int:
    """Return the number of simulations that meet a condition."""
    return connection.scalar(select(func.count()).select_from(schema.simulation).where(chosen)) or 0


def model_section(models: Sequence[FitReport]) -> str:
    """Return the part of the page on the models, empty without any."""
    if not models:
        return ""
    names = textwrap.fill(", ".join(f"`{report.name}`" for report in models), 120)
    return f"""## Models

Fitted without vertical motion ([how](../theory/fragility.md), [how well](model-choice.md), [blocks
that slide, slump or topple confined](other-kinds.md), [free-standing
blocks](../theory/rocking.md)) to what is shipped, of {models[0].events} earthquakes; those of
slumping and confined toppling to grids of blocks whose results are too many to be shipped.
One of each kind is the default. `rbfrag models show` prints coefficients, errors and domain.

{names}

"""


if __name__ == "__main__":
    main()
