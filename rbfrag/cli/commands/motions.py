"""`rbfrag motions`: the ground motions of a database."""

from __future__ import annotations

import sys
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import typer

from rbfrag.cli import options
from rbfrag.cli.command import Commands, argument, option
from rbfrag.cli.inputs import find_horizontals, find_motion, stored_peaks, stored_row
from rbfrag.cli.output import ProgressBar, check_files, print_json, print_result, print_table
from rbfrag.results.numbers import count_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rbfrag.db.rows import MotionRow
    from rbfrag.motions.response_spectrum import DirectionalPeaks

WIDTH = 100
"""Characters of a line of the list."""

METADATA = (
    "magnitude", "mechanism", "depth_km", "network", "lat", "lon", "rjb_km", "rrup_km", "repi_km",
    "vs30_m_s", "attributes",
)  # fmt: skip
STORED_LABELS = (
    "id", "event_id", "event_guessed", *METADATA, "is_vertical", "processing", "flags",
)  # fmt: skip
"""What the database knows of a motion better than its samples do."""

app = Commands(
    "Add, list, show, rotate and export accelerograms.",
    "Example:  rbfrag motions add records/ --metadata records/META.csv",
)


@app.command("add", epilog="Example:  rbfrag motions add records/ --metadata records/META.csv")
def add(
    *,
    paths: list[str] = argument(
        "Files, zip archives, members of one (FILE.zip/NAME), or folders to search",
        metavar="PATHS...",
    ),
    reading: options.Reading,
    suite: str | None = option("Suite that the motions are added to"),
    metadata: str | None = option(
        "Table with the columns file (required), trace_index, event_id, units, is_vertical, "
        "companion_group, magnitude, processing, mechanism, depth_km, station, network, lat, "
        "lon, rjb_km, rrup_km, repi_km, vs30_m_s; further columns are stored as attributes of "
        "the recording; file names are relative to the folder of the table",
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
            processing=processing,
            raw=raw,
            allow_partial=allow_partial,
            **reading,
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
    shown = {
        label: [getattr(row, name) for row in rows]
        for label, name in (
            ("M", "magnitude"), ("R_JB [km]", "rjb_km"), ("Vs30 [m/s]", "vs30_m_s")
        )
    }  # fmt: skip
    metadata = {label: cells for label, cells in shown.items() if set(cells) != {None}}
    print_table(
        ("id", "motion", "event", *metadata, "vert.", "dt [s]", "PGA [g]", "PGV [m/s]", "Tm [s]",
         "processed", "flags"),
        [
            (row.id, row.name, row.event_id, *cells, row.is_vertical, row.dt_s,
             round(row.pga_g, 4), round(row.pgv_m_s, 4),
             None if row.tm_s is None else round(row.tm_s, 3),
             row.processing_applied is not None, row.flags)
            for row, *cells in zip(rows, *metadata.values(), strict=True)
        ],
        width=WIDTH,
    )  # fmt: skip


@app.command("show", epilog="Example:  rbfrag motions show record.AT2")
def show(
    motion: options.Motion,
    reading: options.Reading,
    plot: str | None = option(
        "Figure of the response spectrum, with RotD50 and RotD100 of a stored recording (.png, "
        ".pdf, .svg)",
        metavar="FILE",
    ),
    allow_partial: options.AllowPartial = False,
    db: options.Db = None,
    *,
    verbose: options.Verbose = False,
    json: options.Json = False,
) -> None:
    """Show one motion with its intensity measures: a file as it is, or a stored one by its id."""
    from rbfrag.motions.quality import MotionSummary

    check_files(plot=plot)

    ground = find_motion(motion, db=db, reading=reading, allow_partial=allow_partial)
    values: dict[str, Any] = {}
    recording: Sequence[DirectionalPeaks] = ()
    if (stored := stored_row(motion, db=db)) is not None:
        row, pair = stored
        document = _as_dict(row)
        values = {name: document[name] for name in STORED_LABELS}
        values["vertical_id"] = None if pair is None else pair.vertical_id
        values["vertical_remark"] = None if pair is None else pair.reason or pair.remark or None
        recording = stored_peaks(row.id, db=db)
    if plot is not None:
        from rbfrag.plots.response_spectrum import plot_response_spectrum

        plot_response_spectrum(ground, plot, recording=recording)
    print_result(MotionSummary(ground, values, recording), json=json, verbose=verbose)


@app.command("export", epilog="Example:  rbfrag motions export 1 2 --out two.csv")
def export(
    *,
    motions: options.Motions,
    reading: options.Reading,
    out: str = option("Output file", ..., metavar="FILE"),
    file_format: str | None = option(
        "File format: csv (several motions, all labels) or at2 (one motion) [default: from "
        "the suffix of FILE]",
        None,
        "--format",
    ),
    allow_partial: options.AllowPartial = False,
    db: options.Db = None,
    json: options.Json = False,
) -> None:
    """Export motions to a file, without loss of precision."""
    from rbfrag.motions.readers import export_motions

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


@app.command("rotate", epilog="Example:  rbfrag motions rotate 1 --azimuth 120 --out az120.csv")
def rotate(
    *,
    motions: options.Motions,
    reading: options.Reading,
    azimuth: float = option(
        "Azimuth of the positive direction, clockwise from north [deg]", ..., metavar="DEG"
    ),
    out: str | None = option(
        "Output file (.csv, .at2) [default: the database, in the recordings of the motions]",
        metavar="FILE",
    ),
    suite: str | None = option("Suite that the rotated motions are added to"),
    db: options.Db = None,
    json: options.Json = False,
) -> None:
    """Rotate the two horizontal components of recordings to an azimuth.

    MOTION is one of the two: the other is that of the same recording or file. Their orientations
    must be known and at least 30 deg apart, sampling interval and start equal, and lengths within
    5 %. In the database the component is called az120 for 120 deg.
    """
    if out is None:
        from rbfrag.campaign.rotate_motions import rotate_motions

        print_result(rotate_motions(motions, azimuth, db=db, suite=suite), json=json)
        return
    from rbfrag.motions.readers import export_motions
    from rbfrag.motions.rotation import rotate as rotate_pair

    pairs = [find_horizontals(text, db=db, reading=reading) for text in motions]
    records = [rotate_pair(*pair, azimuth) for pair in pairs]
    written = export_motions(records, out)
    if json:
        print_json(
            {"file": out, "format": written, "sha256": [motion.sha256 for motion in records]}
        )
        return
    print(out)


def _as_dict(row: MotionRow) -> dict[str, Any]:
    document = asdict(row)
    document["flags"] = list(row.flags)
    document["attributes"] = dict(row.attributes)
    return document
