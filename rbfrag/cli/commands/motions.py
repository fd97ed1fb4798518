"""`rbfrag motions`: the ground motions of a database."""

from __future__ import annotations

import sys
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import typer

from rbfrag.cli.output import ProgressBar, print_json, print_result, print_table
from rbfrag.cli.parameters import options
from rbfrag.cli.parameters.motion import find_motion, stored_row
from rbfrag.cli.parameters.option_groups import argument, command_group, option, stacked
from rbfrag.results.numbers import count_of

if TYPE_CHECKING:
    from rbfrag.db.rows import MotionRow

WIDTH = 100
"""Characters of a line of the list."""

STORED_LABELS = (
    "id", "event_id", "event_guessed", "magnitude", "is_vertical", "processing", "flags",
)  # fmt: skip
"""What the database knows of a motion better than its samples do."""

app = command_group(
    "Add, list, show and export accelerograms.",
    "Example:  rbfrag motions add records/ --metadata records/META.csv",
)


@app.command("add", epilog="Example:  rbfrag motions add records/ --metadata records/META.csv")
@stacked
def add(
    *,
    paths: list[str] = argument(
        "Files, zip archives, members of one (FILE.zip/NAME), or folders to search",
        metavar="PATHS...",
    ),
    reading: options.ReadingOptions,
    suite: str | None = option("Suite that the motions are added to"),
    metadata: str | None = option(
        "Table with the columns file (required), trace_index, event_id, units, is_vertical, "
        "companion_group, magnitude, processing; file names are relative to the folder of "
        "the table",
        metavar="CSV",
    ),
    processing: str = option(
        "Processing of records without metadata: corrected or uncorrected; overrides the "
        "file format",
        "",
        metavar="WORDS",
    ),
    raw: bool = option("Store every record unprocessed; uncorrected records are flagged", False),
    allow_partial: options.AllowPartial = False,
    db: options.Db = None,
    json: options.Json = False,
) -> None:
    """Store accelerograms; uncorrected records are processed first.

    Processing of uncorrected records (by metadata, header or format): mean removed, 20 s of zeros
    on each side, Butterworth high-pass of order 2 at 0.1 Hz forward and backward. Corrected records
    are stored unchanged. Vertical components called DOWN are reversed to point upward.

    Formats are detected from the content. In a folder or zip archive, documents (.md, .pdf, .html,
    .rst, .doc) and V3 files next to the V2 file of the record are skipped. Invalid files are listed
    with the reason, all others are added, and the exit status is 1. Without --metadata the
    earthquake is guessed from the file header, flagged, and never merged with an earthquake from
    metadata.
    """
    from rbfrag.campaign.add_motions import add_motions

    with ProgressBar("motions add", "files", on_lines=False) as bar:
        report = add_motions(
            paths,
            db=db,
            suite=suite,
            metadata=metadata,
            units=reading.units,
            dt_s=reading.dt,
            processing=processing,
            raw=raw,
            allow_partial=allow_partial,
            gain=reading.gain,
            on_file=bar.show,
        )
    print_result(report, json=json)
    for bad in report.failed:
        print(f"left out: {bad.path}: {bad.reason}", file=sys.stderr)
    if report.failed:
        raise typer.Exit(1)


@app.command("list", epilog="Example:  rbfrag motions list --json")
def list_motions(
    suite: options.Suite = None, db: options.Db = None, json: options.Json = False
) -> None:
    """List the stored motions with their intensity measures and quality flags.

    Long names are shortened; --json prints full names and all intensity measures.
    """
    from rbfrag.db.engine import opened_database
    from rbfrag.db.motions import motion_rows

    with opened_database(db, read_only=True) as engine, engine.connect() as connection:
        rows = motion_rows(connection, suite=suite)
    if json:
        print_json([_as_dict(row) for row in rows])
        return
    processed = sum(row.processing_applied is not None for row in rows)
    flagged = sum(bool(row.flags) for row in rows)
    print(
        f"{count_of(len(rows), 'motion')} of "
        f"{count_of(len({row.event_id for row in rows}), 'earthquake')}; {processed} processed "
        f"here, {flagged} with a quality flag."
    )
    print()
    print_table(
        ("id", "motion", "event", "vert.", "dt [s]", "PGA [g]", "PGV [m/s]", "Tm [s]",
         "processed", "flags"),
        [
            (row.id, row.name, row.event_id, row.is_vertical, row.dt_s, round(row.pga_g, 4),
             round(row.pgv_m_s, 4), None if row.tm_s is None else round(row.tm_s, 3),
             row.processing_applied is not None, row.flags)
            for row in rows
        ],
        width=WIDTH,
    )  # fmt: skip


@app.command("show", epilog="Example:  rbfrag motions show record.AT2")
@stacked
def show(
    motion: options.Motion,
    reading: options.ReadingOptions,
    allow_partial: options.AllowPartial = False,
    db: options.Db = None,
    *,
    printing: options.Printing,
) -> None:
    """Show one motion: a file as it is, or a stored one by its id."""
    from rbfrag.motions.motion_summary import MotionSummary

    ground = find_motion(motion, db=db, reading=reading, allow_partial=allow_partial)
    values: dict[str, Any] = {}
    if (stored := stored_row(motion, db=db)) is not None:
        row, pair = stored
        document = _as_dict(row)
        values = {name: document[name] for name in STORED_LABELS}
        values["vertical_id"] = None if pair is None else pair.vertical_id
        values["vertical_remark"] = None if pair is None else pair.reason or pair.remark or None
    print_result(MotionSummary(ground, values), json=printing.json, verbose=printing.verbose)


@app.command("export", epilog="Example:  rbfrag motions export 1 2 --out two.csv")
@stacked
def export(
    *,
    motions: options.Motions,
    reading: options.ReadingOptions,
    out: str = option("Output file", ..., metavar="FILE"),
    file_format: str | None = option(
        "File format: csv (several motions, all labels) or at2 (one motion) [default: from "
        "the suffix of FILE]",
        word="--format",
    ),
    allow_partial: options.AllowPartial = False,
    db: options.Db = None,
    json: options.Json = False,
) -> None:
    """Export motions to a file, without loss of precision."""
    from rbfrag.motions.export import export_motions

    records = [
        find_motion(text, db=db, reading=reading, allow_partial=allow_partial) for text in motions
    ]
    written = export_motions(records, out, file_format=file_format)
    if json:
        print_json(
            {"file": out, "format": written, "sha256": [motion.sha256 for motion in records]}
        )
        return
    print(out)


def _as_dict(row: MotionRow) -> dict[str, Any]:
    document = asdict(row)
    document["flags"] = list(row.flags)
    return document
