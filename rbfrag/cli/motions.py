"""`rbfrag motions`: the accelerograms of a database."""

from __future__ import annotations

import sys
from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rbfrag.cli import options
from rbfrag.cli.motion_argument import find_motion
from rbfrag.cli.output import print_json, print_pairs, print_table, print_warnings

if TYPE_CHECKING:
    from rbfrag.db.rows import MotionRow

app = typer.Typer(
    help="Add, list and show accelerograms.",
    no_args_is_help=True,
    rich_markup_mode=None,
    epilog="Example:  rbfrag motions add records/ --metadata records/MANIFEST.csv",
)


@app.command("add", epilog="Example:  rbfrag motions add records/ --metadata records/META.csv")
def add(
    paths: Annotated[
        list[str],
        typer.Argument(metavar="PATHS...", help="Files, or folders to search.", show_default=False),
    ],
    suite: Annotated[
        str | None,
        typer.Option("--suite", help="Put the motions into this suite.", show_default=False),
    ] = None,
    metadata: Annotated[
        str | None,
        typer.Option(
            "--metadata",
            metavar="CSV",
            help="Table with the columns file, trace_index, event_id, units, is_vertical, "
            "companion_group, magnitude, processing (only file must be there). Files are named "
            "relative to the table's folder.",
            show_default=False,
        ),
    ] = None,
    raw: Annotated[
        bool,
        typer.Option(
            "--raw", help="Store every record as its file has it; uncorrected ones are flagged."
        ),
    ] = False,
    allow_partial: options.AllowPartial = False,
    units: options.Units = None,
    dt: options.Dt = None,
    db: options.Db = None,
    json: options.Json = False,
) -> None:
    """Read accelerogram files and store them; uncorrected records are processed first.

    Uncorrected, by metadata, header or format: mean removed, 20 s of zeros on each side,
    Butterworth high-pass of order 2 at 0.1 Hz forward and backward. Corrected records are
    stored as they are. Vertical components called DOWN are turned upward.

    Formats are recognised by content. A file that cannot be read is listed with its reason,
    the others are added, and the exit status is 1. Without --metadata an earthquake is only a
    guess from the file's header, flagged, and never merged with one that was stated.
    """
    from rbfrag.campaign.add_motions import add_motions

    def show(done: int, total: int) -> None:
        if sys.stderr.isatty():
            end = "\n" if done == total else ""
            print(f"\r\x1b[Kmotions add: {done}/{total} files", end=end, file=sys.stderr)

    report = add_motions(
        paths,
        db=db,
        suite=suite,
        metadata=metadata,
        units=units,
        dt_s=dt,
        raw=raw,
        allow_partial=allow_partial,
        on_file=show,
    )
    if json:
        print_json(report.as_dict())
    else:
        print_pairs(
            {
                "added": len(report.added),
                "of these processed": len(report.processed),
                "stored before": len(report.known),
                "left out": len(report.failed),
            }
        )
    print_warnings(report.warnings)
    for bad in report.failed:
        print(f"left out: {bad.path}: {bad.reason}", file=sys.stderr)
    if report.failed:
        raise typer.Exit(1)


@app.command("list", epilog="Example:  rbfrag motions list --json")
def list_motions(
    suite: options.Suite = None, db: options.Db = None, json: options.Json = False
) -> None:
    """List the stored motions with their intensity measures and quality flags."""
    from rbfrag.db.engine import opened_database
    from rbfrag.db.motion_store import motion_rows

    with opened_database(db, read_only=True) as engine, engine.connect() as connection:
        rows = motion_rows(connection, suite=suite)
    if json:
        print_json([_as_dict(row) for row in rows])
        return
    print_table(
        ("id", "motion", "event", "vert.", "dt [s]", "npts", "PGA [g]", "PGV [m/s]", "PGD [m]",
         "Tm [s]", "flags"),
        [
            (row.id, row.name, row.event_id, row.is_vertical, row.dt_s, row.npts,
             round(row.pga_g, 4), round(row.pgv_m_s, 4), round(row.pgd_m, 4),
             None if row.tm_s is None else round(row.tm_s, 3), row.flags)
            for row in rows
        ],
    )  # fmt: skip


@app.command("show", epilog="Example:  rbfrag motions show record.AT2")
def show(
    motion: options.Motion,
    allow_partial: options.AllowPartial = False,
    units: options.Units = None,
    dt: options.Dt = None,
    db: options.Db = None,
    json: options.Json = False,
) -> None:
    """Show one motion: a file, or a stored one by its id."""
    from rbfrag.motions.quality import quality_flags

    ground = find_motion(motion, db=db, units=units, dt_s=dt, allow_partial=allow_partial)
    flags = quality_flags(ground)
    document: dict[str, Any] = {
        "name": ground.label,
        "event": ground.event,
        "station": ground.station,
        "component": ground.component,
        "orientation_deg": ground.orientation_deg,
        "is_vertical": ground.is_vertical,
        "source_file": ground.source_file,
        "trace_index": ground.trace_index,
        "format": ground.file_format,
        "dt_s": ground.dt_s,
        "npts": ground.npts,
        "duration_s": ground.duration_s,
        **asdict(ground.measures),
        "sha256": ground.sha256,
        "flags": [flag.code for flag in flags],
    }
    if json:
        print_json(document)
        return
    print_pairs(document)
    print_warnings([*ground.remarks, *(flag.sentence for flag in flags)])


def _as_dict(row: MotionRow) -> dict[str, Any]:
    document = asdict(row)
    document["flags"] = list(row.flags)
    return document
