"""The reference data set that is shipped:  python -m benchmarks.reference_set --records FOLDER

Runs the default campaign with and without vertical motion over the collection of real records
that the tests use, keeps what fits and predictions need, and writes rbfrag/reference/reference.db
and the page of its provenance. No sample of any record is kept. An interrupted run is resumed: the
full database stays in --work.
"""

from __future__ import annotations

import argparse
import csv
import hashlib
import json
import os
import sqlite3
import sys
from collections import Counter, defaultdict
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np
from sqlalchemy import Connection, bindparam, delete, select, true

from benchmarks.all_outcomes import with_all_outcomes
from benchmarks.page import ROOT
from rbfrag.bench.cases import RECORDS_VARIABLE
from rbfrag.bench.tables import markdown
from rbfrag.campaign.add_motions import AddReport, add_motions
from rbfrag.campaign.progress import CampaignProgress
from rbfrag.campaign.simulate import CampaignSummary, simulate
from rbfrag.campaign.simulate_kind import simulate_kind
from rbfrag.db import schema
from rbfrag.db.check.database import check_database
from rbfrag.db.content import content_digest
from rbfrag.db.engine import opened_database
from rbfrag.db.insert import update_rows
from rbfrag.db.keys import canonical_json, combination_key
from rbfrag.db.location import REFERENCE
from rbfrag.db.models import save_model
from rbfrag.db.outcome_maps import SAME_BLOCK
from rbfrag.db.rows import ModelRow
from rbfrag.db.stored_combination import stored_combination
from rbfrag.fragility.fit.data import kr_over_pga_of_grid, read_source
from rbfrag.fragility.fit.fitting import fit
from rbfrag.fragility.fit.report import FitReport
from rbfrag.solver.results import NUMERICS_VERSION, SEARCH_LIMIT
from rbfrag.version import __version__

MAP_DEPTH = 1e-3
"""Width of kr/PGA that the maps leave undecided at a border."""

CLEARANCE = 1e-6
"""The critical island ends no further than this share above the critical value."""

NARROWEST = 2e-2
"""Width of kr/PGA below which intervals are left out: with them the file is too large."""

OF_THE_RECORD = ("the record ends at ", "the record starts at ")
"""How the warnings begin that are flags of the motion."""

SPARED_INDEX = "ix_combination_campaign_id"
"""Left out: of the three campaigns in the file nobody asks for one alone."""

MOST_BYTES = 4_000_000
"""Greatest size of the file that is shipped."""

PAGE = ROOT / "docs" / "reference" / "reference-data.md"

SUITE = "reference"

MODELS = (
    ("bounded", "pgv_pga"),
    ("bounded", "pgv_pga_tm"),
    ("record", "xp"),
    ("weibull", "pgv"),
    ("lognormal", "pgv"),
    ("wls", "pgv"),
    ("logistic", "pga_tm"),
    ("logistic", "pgd_tm"),
)
"""Method and term of the models that are shipped; the first one is the default."""


KINDS: tuple[Literal["slumping", "sliding"], ...] = ("slumping", "sliding")

KIND_MODELS: tuple[dict[str, Any], ...] = (
    {"kind": "sliding", "term": "pgv_pga"},
    {"kind": "sliding", "term": "pgv"},
    {"kind": "slumping", "term": "pgv_pga", "rotation_deg": None},
    {"kind": "slumping", "term": "pgv", "rotation_deg": None},
    {"kind": "slumping", "term": "pgv_pga", "rotation_deg": 2.0},
    {"kind": "slumping", "term": "pgv", "rotation_deg": 2.0},
)
"""The models of other kinds that are shipped; the first of each kind is its default."""


def main(arguments: Sequence[str] | None = None) -> None:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--records", help="folder of records with MANIFEST.csv")
    options.add_argument("--work", type=Path, required=True, help="folder for the full database")
    options.add_argument("--jobs", type=int, help="worker processes")
    options.add_argument("--out", type=Path, default=REFERENCE, help="the file that is shipped")
    options.add_argument("--page", type=Path, default=PAGE, help="the page of its provenance")
    options.add_argument("--without-models", action="store_true", help="results alone")
    chosen = options.parse_args(arguments)
    root = chosen.records or os.environ.get(RECORDS_VARIABLE)
    if root is None:
        raise SystemExit("no records: name a folder with --records")
    manifest = Path(root) / "MANIFEST.csv"
    full = chosen.work / "reference-full.db"
    added = add_motions([root], db=full, suite=SUITE, metadata=manifest)
    summary = simulate(
        full, suite=SUITE, vertical="both", map_depth=MAP_DEPTH, jobs=chosen.jobs,
        on_progress=show,
    )  # fmt: skip
    # of slumping only models are shipped
    for kind in KINDS[1:] if chosen.without_models else KINDS:
        simulate_kind(full, kind=kind, suite=SUITE, jobs=chosen.jobs, on_progress=show)
    made = chosen.work / "reference.db"
    reduce(full, made)
    models = [] if chosen.without_models else add_models(full, made)
    kinds = [] if chosen.without_models else add_kind_models(full, made)
    examine(made)
    chosen.out.parent.mkdir(parents=True, exist_ok=True)
    # in place at once or not at all
    beside = chosen.out.with_name(f"{chosen.out.name}.new")
    beside.write_bytes(made.read_bytes())
    beside.replace(chosen.out)
    chosen.page.write_text(
        provenance(made, manifest, added, summary, models, kinds), encoding="utf-8"
    )
    print(f"{chosen.out}: {made.stat().st_size:,} bytes\n{chosen.page}")


def show(progress: CampaignProgress) -> None:
    print(f"{progress.done}/{progress.total} combinations", file=sys.stderr, flush=True)


def reduce(full: Path, made: Path) -> None:
    """Copy the full database without samples, and with no more of each combination than needed."""
    made.unlink(missing_ok=True)
    raw = sqlite3.connect(full)
    raw.execute("VACUUM INTO ?", (str(made),))
    raw.close()
    with opened_database(made) as engine, engine.begin() as connection:
        update_rows(connection, schema.motion, true(), {"samples": None})
        keep_curves_alone(connection)
        connection.execute(delete(schema.response))
        keep_what_is_asked_for(connection)
        keep_what_is_not_of_the_record(connection)
        rename(connection)
    raw = sqlite3.connect(made, isolation_level=None)
    raw.execute(f"DROP INDEX {SPARED_INDEX}")
    raw.execute("PRAGMA journal_mode = DELETE")
    raw.execute("VACUUM")
    raw.close()


def keep_what_is_asked_for(connection: Connection) -> None:
    """Keep every outcome of the blocks that fits look at, and of the maps what is wide.

    Of the maps the decided intervals are kept, below the critical value those that hold such a
    block and those that are no narrower than NARROWEST; what lies between them is undecided. Of
    the simulations the critical block stays, and the blocks that the map left open above the
    search limit; those below are too many.
    """
    table, interval, point = schema.combination, schema.outcome_interval, schema.simulation
    query = (
        select(table.c.id, table.c.kr_over_pga, table.c.p2, schema.motion.c.pgv_m_s,
               schema.motion.c.pga_g)
        .join(schema.motion, schema.motion.c.id == table.c.motion_id)
        .where(table.c.kind == "toppling")
    )  # fmt: skip
    for number, critical, p2, pgv_m_s, pga_g in connection.execute(query).all():
        blocks = kr_over_pga_of_grid(p2, pgv_m_s, pga_g)
        rows = connection.execute(
            select(interval.c.k_lo, interval.c.k_hi, interval.c.outcome).where(
                interval.c.combination_id == number
            )
        ).all()
        unwanted = []
        for low, high, outcome in rows:
            narrow = critical is not None and high < (1.0 - CLEARANCE) * critical
            narrow = narrow and high - low < NARROWEST
            asked_for = ((low <= blocks) & (blocks <= high)).any()
            if outcome == "undecided" or (narrow and not asked_for):
                unwanted.append({"lo": low})
        if unwanted:
            gone = delete(interval).where(
                interval.c.combination_id == number, interval.c.k_lo == bindparam("lo")
            )
            connection.execute(gone, unwanted)
        own = select(point.c.kr_over_pga).where(
            point.c.combination_id == number, point.c.displacement_m.is_(None)
        )
        run = np.array(connection.scalars(own).all(), dtype=np.float64)
        asked = np.abs(run[:, None] / blocks - 1.0).min(axis=1, initial=np.inf) <= SAME_BLOCK
        spare = run[(~asked | (run < SEARCH_LIMIT)) & (run != critical)]
        if spare.size:
            gone = delete(point).where(
                point.c.combination_id == number, point.c.kr_over_pga == bindparam("k")
            )
            connection.execute(gone, [{"k": k} for k in spare.tolist()])


def keep_what_is_not_of_the_record(connection: Connection) -> None:
    """Of the warnings of each combination, leave out what its motions say themselves."""
    table = schema.combination
    told = select(schema.motion.c.remarks)
    remarks = {text for row in connection.scalars(told) for text in json.loads(row)}
    for number, said in connection.execute(select(table.c.id, table.c.warnings)).all():
        kept = [
            sentence
            for sentence in json.loads(said)
            if not sentence.removeprefix("vertical: ").startswith(OF_THE_RECORD)
            and sentence not in remarks
        ]
        if len(kept) < len(json.loads(said)):
            update_rows(connection, table, table.c.id == number, {"warnings": canonical_json(kept)})


def keep_curves_alone(connection: Connection) -> None:
    """Of the other kinds, keep the displacements of sliding blocks.

    The critical values of slumps are too many to be shipped; their models stay.
    """
    table = schema.combination
    rows = connection.execute(
        select(table.c.id, table.c.settings).where(table.c.kind != "toppling")
    )
    dropped = [row.id for row in rows if json.loads(row.settings).get("displacement_m") != 0.0]
    some = 500
    for start in range(0, len(dropped), some):
        chosen = dropped[start : start + some]
        for child in (schema.outcome_interval, schema.simulation):
            connection.execute(delete(child).where(child.c.combination_id.in_(chosen)))
        connection.execute(delete(table).where(table.c.id.in_(chosen)))


def add_kind_models(full: Path, made: Path) -> list[ModelRow]:
    """Fit the models of other kinds to the full database, and store them in what is shipped."""
    rows = []
    for asked in KIND_MODELS:
        with opened_database(full, read_only=True) as engine, engine.connect() as connection:
            row = fit(connection, **asked).model.row
        with opened_database(made) as engine, engine.begin() as connection:
            rows.append(save_model(connection, row, replace=True))
        print(f"fitted {row.name}", file=sys.stderr, flush=True)
    raw = sqlite3.connect(made, isolation_level=None)
    raw.execute("PRAGMA journal_mode = DELETE")
    raw.execute("VACUUM")
    raw.close()
    return rows


def add_models(full: Path, made: Path) -> list[FitReport]:
    """Fit the models that are shipped, without vertical motion.

    To what is shipped and to the outcomes of the grid below the search limit: which blocks lie
    there does not depend on the outcome, yet they are a part of what is asked.
    """
    reports = []
    with opened_database(made, read_only=True) as engine, engine.connect() as connection:
        source = with_all_outcomes(read_source(connection), full)
    for method, term in MODELS:
        reports.append(fit(source, term=term, method=method))
        with opened_database(made) as engine, engine.begin() as connection:
            save_model(connection, reports[-1].model.row)
        print(f"fitted {reports[-1].name}", file=sys.stderr, flush=True)
    raw = sqlite3.connect(made, isolation_level=None)
    raw.execute("PRAGMA journal_mode = DELETE")
    raw.execute("VACUUM")
    raw.close()
    return reports


def rename(connection: Connection) -> None:
    """Give the reduced combinations the natural keys of what they are now."""
    motions = {
        row.id: row
        for row in connection.execute(
            select(schema.motion.c.id, schema.motion.c.samples_sha256, schema.motion.c.dt_s)
        )
    }
    toppling = schema.combination.c.kind == "toppling"
    for key in connection.scalars(select(schema.combination.c.natural_key).where(toppling)).all():
        stored = stored_combination(connection, key)
        settings = {**stored.settings, "map": "decided"}
        up = stored.vertical_motion_id
        named = {
            "settings": canonical_json(settings),
            "natural_key": combination_key(
                motion_sha256=motions[stored.motion_id].samples_sha256,
                dt_s=motions[stored.motion_id].dt_s,
                vertical_sha256=None if up is None else motions[up].samples_sha256,
                polarity=stored.values["polarity"],
                kind=stored.values["kind"],
                p2=stored.values["p2"],
                settings=settings,
                numerics_version=stored.values["numerics_version"],
                linear=stored.values["linear"],
            ),
        }
        update_rows(connection, schema.combination, schema.combination.c.id == stored.id, named)


def examine(made: Path) -> None:
    """Refuse to ship a file that is damaged, too large, or holds samples."""
    with opened_database(made, read_only=True) as engine, engine.connect() as connection:
        findings = list(check_database(connection))
        if findings:
            raise SystemExit(f"the reduced database is damaged: {findings[0]}")
        column = schema.motion.c.samples
        if connection.execute(select(column).where(column.is_not(None))).first() is not None:
            raise SystemExit("the reduced database holds samples")
    if made.stat().st_size > MOST_BYTES:
        raise SystemExit(f"{made} has {made.stat().st_size:,} bytes, more than {MOST_BYTES:,}")


def provenance(
    made: Path,
    manifest: Path,
    added: AddReport,
    summary: CampaignSummary,
    models: Sequence[FitReport],
    kinds: Sequence[ModelRow],
) -> str:
    """Return the page that says where the shipped data come from."""
    with manifest.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    sets: dict[str, list[dict[str, str]]] = defaultdict(list)
    for row in rows:
        sets[row["set"]].append(row)
    cells = [
        [
            name,
            some[0]["format"],
            str(sum(not int(row["is_vertical"]) for row in some)),
            str(sum(int(row["is_vertical"]) for row in some)),
            str(len({row["event_id"] for row in some})),
            ", ".join(sorted({row["source_repo"] for row in some})),
        ]
        for name, some in sorted(sets.items())
    ]
    headers = ["set", "format", "horizontal", "vertical", "earthquakes", "source repository"]
    with opened_database(made, read_only=True) as engine, engine.connect() as connection:
        digest = content_digest(connection)
        toppling = schema.combination.c.kind == "toppling"
        status = Counter(connection.scalars(select(schema.combination.c.status).where(toppling)))
        slid = schema.simulation.c.displacement_m.is_not(None)
        curves = select(schema.simulation.c.kr_over_pga).where(slid)
        curves_of_none = select(schema.simulation.c.kr_over_pga).where(~slid)
        displacements = len(connection.execute(curves).all())
        runs = len(connection.execute(curves_of_none).all()) - status["found"]
        intervals = len(connection.execute(select(schema.outcome_interval.c.k_lo)).all())
        vertical = schema.combination.c.vertical_motion_id.is_not(None)
        shaken = len(connection.execute(select(schema.combination.c.id).where(vertical)).all())
    counts = ", ".join(f"{number:,} {name}" for name, number in sorted(status.items()))
    return f"""# The reference data set

`rbfrag/reference/reference.db` is shipped with rbfrag: a read-only SQLite database with the
results of the default campaign over a collection of recorded earthquakes. Where there is no
database of your own, `rbfrag predict` answers from it. It holds **no samples of any record**, only
what was computed from them: intensity measures, toppling spectra, critical values with their
brackets, and maps of outcomes.

```sh
python -m benchmarks.reference_set --records FOLDER --work FOLDER
```

builds the file and this page from the records.

## What it holds

- {summary.combinations:,} combinations ({counts}), {shaken:,} of them with vertical motion:
  every horizontal motion, with and without the vertical motion of its recording, in both
  polarities, for $p^2$ = 30, 10, 3, 1, 0.3 and 0.1 1/s². {summary.certified:,} are certified.
- {intervals:,} intervals of their maps: toppling and safe ones. What lies between two of them is
  undecided, and so is what lies below the lowest. Borders below the critical value were closed in
  on to {MAP_DEPTH:g} of $k_r/\\mathrm{{PGA}}$; intervals narrower than {NARROWEST:g} are left
  out, unless they hold a block of the grid that fits look at. The critical value itself is as
  exact as everywhere. The setting `map` is `decided`, and the natural keys say so too.
- {displacements:,} displacements of sliding blocks, of 23 strengths in both polarities of every
  horizontal motion ([how](../theory/other-kinds.md)).
- Of the simulations of toppling the critical block of each combination, and the blocks of that grid
  which its map leaves open: {runs:,} of them, so that no outcome above the search limit is missing
  from a fit. The search itself was made with all.
- {len(added.added) + len(added.known)} motions with their intensity measures, the hash of their
  samples, their earthquake, and what was done to them: uncorrected records were filtered as
  `rbfrag motions add` does it.

{model_section(models)}{kind_section(kinds)}## Where the records come from

{markdown((headers, cells))}

The earthquakes are those of the metadata of the collection, one name for each. The records
themselves belong to the networks that made them and are not passed on here.

## Identity

| | |
| --- | --- |
| rbfrag | {__version__} |
| numerics version | {NUMERICS_VERSION} |
| combinations | {summary.combinations:,} |
| content digest | `{digest}` |
| sha256 of the file | `{hashlib.sha256(made.read_bytes()).hexdigest()}` |
| size | {made.stat().st_size:,} bytes |

The content digest is that of [equal databases](../howto/keep-a-database.md): it is the same for a
file that was built elsewhere from the same records with the same numerics, as far as processors
agree in the last bit.
"""


def model_section(models: Sequence[FitReport]) -> str:
    """Return the part of the page on the models, empty without any."""
    if not models:
        return ""
    rows = [
        [
            f"`{report.name}`",
            ", ".join(
                f"{name} = {value:.4g} ± {report.standard_errors[name]:.2g}"
                for name, value in report.coefficients.items()
            ),
            str(report.n),
            str(report.events),
        ]
        for report in models
    ]
    columns = ["model", "coefficients ± standard error", "critical values", "earthquakes"]
    return f"""## Models

Fitted without vertical motion ([how](../theory/fragility.md), [how
well](../theory/model-choice.md)) to what is shipped, and to the blocks of the grid below the search
limit, each simulated for itself; `{models[0].name}` is the default.

{markdown((columns, rows))}

"""


def kind_section(models: Sequence[ModelRow]) -> str:
    """Return the part of the page on the models of other kinds, empty without any."""
    if not models:
        return ""
    rows = []
    for row in models:
        told: dict[str, Any] = dict(row.diagnostics)
        errors = told["standard_errors"]
        rows.append(
            [
                f"`{row.name}`",
                ", ".join(
                    f"{name} = {value:.4g} ± {errors[name]:.2g}"
                    for name, value in row.coefficients.items()
                ),
                f"{told['n']:,}",
                f"{told['n_censored']:,}",
                f"{told['scores']['held_out_log_loss']:.3f}",
                f"{told['scores']['calibration_slope']:.2f}",
            ]
        )
    columns = ["model", "coefficients ± standard error", "found", "censored", "held-out log loss",
               "calibration slope"]  # fmt: skip
    return f"""## Models of blocks that slide or slump

Without vertical motion ([what they say](../theory/other-kinds.md)). Those of slumping are fitted to
the critical values of the family of blocks, which are too many to be shipped.

{markdown((columns, rows))}

"""


if __name__ == "__main__":
    main()
