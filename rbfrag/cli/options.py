"""Options shared by several commands, with one wording each, and which options go together."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from rbfrag.cli.command import Fields, Inputs, option
from rbfrag.errors import InputError, RbfragError
from rbfrag.vocabulary.quantities import (
    ANSWERING,
    COMMON,
    FAILURE,
    INTENSITY,
    NUMBERS,
    PLANES,
    QUANTITIES,
    RANGE,
    SHAKING,
    SHAPE,
    option_of,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rbfrag.motions.polarity import Polarity as PolarityName


def motion_ids(ctx: typer.Context, incomplete: str) -> list[tuple[str, str]]:
    """Return the stored motions whose ids begin with a text, each with its name and PGV.

    This is shell completion: what cannot be read offers nothing, and says nothing.
    """
    from rbfrag.db.engine import opened_database
    from rbfrag.db.motions import motion_rows

    try:
        with (
            opened_database(ctx.params.get("db"), read_only=True) as engine,
            engine.connect() as connection,
        ):
            rows = motion_rows(connection)
    except RbfragError:
        return []
    return [
        (str(row.id), f"{row.name}, PGV {row.pgv_m_s:.3g} m/s")
        for row in rows
        if str(row.id).startswith(incomplete)
    ]


Verbose = Annotated[bool, typer.Option("--verbose", help="Print all values, with six digits")]

Json = Annotated[
    bool, typer.Option("--json", help="Print one JSON document on standard output and nothing else")
]

Db = Annotated[
    str | None, typer.Option("--db", metavar="URL", help=QUANTITIES["db"].help(option_of))
]

Sheet = Annotated[
    str | None,
    typer.Option(
        "--sheet", metavar="NAME", help="Sheet of the workbook with the table [default: first]"
    ),
]

IgnoreColumns = Annotated[
    str | None,
    typer.Option(
        "--ignore-columns",
        metavar="NAME,NAME",
        help="Columns of the table to ignore, separated by commas. Without it, a name close to "
        "that of a known column is rejected, and other unknown columns are ignored with a warning",
    ),
]

Crs = Annotated[
    str | None,
    typer.Option(
        "--crs",
        help="Coordinate reference system of x and y of rows without one, such as EPSG:2056",
    ),
]

ExcelText = Annotated[
    bool,
    typer.Option(
        "--excel-text",
        help="In CSV output, prefix texts that begin with = + - or @ with an apostrophe, against "
        "formulas in Excel; rbfrag removes it from input tables",
    ),
]

Motion = Annotated[
    str,
    typer.Argument(
        metavar="MOTION",
        autocompletion=motion_ids,
        help="Accelerogram: a file, FILE#INDEX for one trace of several, or a database id",
    ),
]

Motions = Annotated[
    list[str],
    typer.Argument(
        metavar="MOTION...",
        autocompletion=motion_ids,
        help="Accelerograms: files, FILE#INDEX for one trace of several, or database ids",
    ),
]

Vertical = Annotated[
    str | None,
    typer.Option(
        "--vertical",
        metavar="MOTION",
        help="Vertical accelerogram of the same recording, positive upward",
    ),
]

Polarity = Annotated[
    str,
    typer.Option(
        "--polarity",
        help="Polarity: forward (positive samples drive forward rotation), reverse or both",
    ),
]

SlopeAzimuth = Annotated[
    float | None,
    typer.Option(
        "--slope-azimuth",
        help="Dip direction of the slope, clockwise from north: both horizontal components of the "
        "recording are rotated into it, and ground acceleration into the slope drives the block "
        "forward [deg]",
    ),
]

AllowPartial = Annotated[
    bool,
    typer.Option(
        "--allow-partial",
        help="Accept and flag a file whose number of samples differs from its header",
    ),
]

IncludeStructures = Annotated[
    bool,
    typer.Option(
        "--include-structures",
        help="Include records of sensors on structures (flag structure), which are excluded by "
        "default",
    ),
]

Suite = Annotated[
    str | None, typer.Option("--suite", help="Suite of motions [default: all motions]")
]

Where = Annotated[
    str | None,
    typer.Option(
        "--where",
        metavar="CONDITION",
        help="Condition over columns of the view outcome, such as 'vs30_m_s > 600 and "
        "magnitude >= 6' [default: all motions]",
    ),
]

BlockDraws = Annotated[
    str | None,
    typer.Option(
        "--block-draws",
        metavar="FILE",
        help="Table of draws of one uncertain block (.csv, .xlsx, .parquet), one per row, with "
        "the columns of a block table and weight for unequal weights",
    ),
]

Weights = Annotated[
    str | None,
    typer.Option(
        "--weights",
        help="Weights of the logic-tree branches in the order of the curves, such as 0.5,0.3,0.2, "
        "or the realizations file of OpenQuake",
    ),
]

Jobs = Annotated[
    int | None,
    typer.Option("--jobs", help="Number of worker processes [default: as many as save time]"),
]

Scheduler = Annotated[
    str | None,
    typer.Option(
        "--scheduler",
        metavar="URL",
        help="Dask scheduler whose workers replace local ones, such as tcp://host:8786",
    ),
]

WithinKm = Annotated[
    float,
    typer.Option(
        "--within-km",
        help="Maximum distance from a block to the nearest site, for sites joined by lon and lat "
        "[km]",
    ),
]

WITHIN_KM = 5.0
"""Default of the distance of blocks to sites [km], as `rbfrag.exchange.nearest_site` has it."""

Block = Annotated[Inputs, Fields(*NUMBERS, *FAILURE, *SHAPE, *PLANES, *COMMON)]
"""One block of which all is known that is stated, by field."""

Measures = Annotated[Inputs, Fields(*INTENSITY)]
"""What may be known of a motion, by field."""

Shaking = Annotated[Inputs, Fields(*SHAKING)]
"""The same, how well it is known, and what may stand for it."""

Answering = Annotated[Inputs, Fields(*ANSWERING)]
"""Which fragility model answers, and how wide its interval is, by field."""

Ranging = Annotated[Inputs, Fields(*RANGE)]
"""The same, and what the range of one earthquake is of."""


def _direction(
    reverse: bool = option(
        "Reverse polarity: positive samples drive backward, k_h(t) = -a(t)", False
    ),
) -> Literal["forward", "reverse"]:
    return "reverse" if reverse else "forward"


Direction = Annotated[Literal["forward", "reverse"], _direction]
"""Direction in which a ground motion acts on the block, as a polarity."""


def _reading(
    units: str | None = option(
        "Acceleration unit of a text file without one: g, m/s2, cm/s2 or mm/s2"
    ),
    dt: float | None = option("Sampling interval of a text file with accelerations only [s]"),
    gain: float | None = option(
        "Gain of a miniSEED file, the sensitivity in the StationXML of its station [counts/(m/s2)]"
    ),
    channel: str | None = option(
        "Channels of a miniSEED file to read, such as HN? or 10.HNE (location and channel), "
        "separated by commas",
        metavar="CODES",
    ),
) -> dict[str, Any]:
    return {"units": units, "dt_s": dt, "gain": gain, "channel": channel}


Reading = Annotated[dict[str, Any], _reading]
"""Properties of an accelerogram that its file does not give, by keyword of `read_motion`."""


def _curve(
    imt: str | None = option("Intensity measure of the curve: PGV, PGA, 'SA(0.5)'"),
    site: str | None = option("Site in the file, by number (from 1) or name"),
    convert: str | None = option(
        "Published conversion of a spectral acceleration to PGV, with its dispersion: "
        "newmark_hall_1982 (SA(1)) or bommer_alarcon_2006 (SA(0.5))"
    ),
    convert_sigma: float | None = option(
        "Standard deviation of ln PGV about the conversion [default: that of the built-in data set]"
    ),
    component: str | None = option(
        "Horizontal component of the intensity measure: single, geometric_mean, rotd50, "
        "rotd100 or larger [default: that of the curve file, else single]"
    ),
    disaggregation: str | None = option(
        "OpenQuake disaggregation of a PGA curve by magnitude (Mag-*.csv or Mag_Dist-*.csv), "
        "for the conversion to PGV",
        metavar="FILE",
    ),
) -> dict[str, Any]:
    return {
        "imt": imt, "site": site, "convert": convert, "convert_sigma": convert_sigma,
        "component": component, "disaggregation": disaggregation,
    }  # fmt: skip


Curve = Annotated[dict[str, Any], _curve]
"""Interpretation of a hazard curve, by keyword of `rbfrag.hazard`."""


def column_names(text: str | None) -> tuple[str, ...]:
    """Return the column names in an option value."""
    return () if text is None else tuple(name.strip() for name in text.split(","))


def number_list(text: str, option: str) -> list[float]:
    """Return the numbers of a comma-separated list."""
    values = []
    for part in text.split(","):
        try:
            values.append(float(part))
        except ValueError:
            raise InputError(
                f"{option}: {part.strip()!r} is not a number: give a list such as 30,10,3,1"
            ) from None
    return values


def polarities(text: str) -> Sequence[PolarityName]:
    """Return the polarities of the value forward, reverse or both."""
    from rbfrag.motions.polarity import POLARITIES

    if text == "both":
        return POLARITIES
    chosen = [polarity for polarity in POLARITIES if polarity == text]
    if not chosen:
        raise InputError(f"--polarity {text!r}: use forward, reverse or both")
    return chosen


def runner(
    work: Callable[..., Any], jobs: int | None, scheduler: str | None
) -> Callable[..., Iterator[Any]]:
    """Return the function that runs work on local processes or on a Dask cluster.

    Args:
        work: does one part, after what all have in common, if there is anything; a function of
            a module, which workers can find.
        jobs: the option --jobs.
        scheduler: the option --scheduler.
    """
    from rbfrag.campaign.executors import check_workers, executor

    check_workers(jobs, scheduler)

    def run(parts: Iterator[Any], number: int, shared: Any = None) -> Iterator[Any]:
        again = "run the same command again"  # nothing is stored
        with executor(work, jobs, scheduler, after_a_death=again, shared=shared) as execute:
            yield from execute(parts, number)

    return run
