"""Options that several commands share, with one wording each, and what their values mean."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from rbfrag.cli.parameters.completion import motion_ids
from rbfrag.cli.parameters.stack import Given, fields_of, option
from rbfrag.errors import InputError
from rbfrag.vocabulary.quantities import (
    ANSWERING,
    FAILURE,
    INTENSITY,
    NUMBERS,
    PLANES,
    QUANTITIES,
    RANGE,
    SHAKING,
    SHAPE,
    WHOLE,
    option_of,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rbfrag.motions.polarity import Polarity as PolarityName

SHEET = "Sheet of the workbook with the table [default: first]"

IGNORE_COLUMNS = (
    "Columns of the table to ignore, separated by commas. Without it, a name close to that of a "
    "known column is rejected, and other unknown columns are ignored with a warning"
)

CRS = "Coordinate reference system of x and y of rows without one, such as EPSG:2056"


def column_names(text: str | None) -> tuple[str, ...]:
    """Return the names of columns that an option lists."""
    return () if text is None else tuple(name.strip() for name in text.split(","))


EXCEL_TEXT = (
    "In CSV output, prefix texts that begin with = + - or @ with an apostrophe, against "
    "formulas in Excel; rbfrag removes it from input tables"
)

Json = Annotated[
    bool, typer.Option("--json", help="Print one JSON document on standard output and nothing else")
]

Db = Annotated[
    str | None, typer.Option("--db", metavar="URL", help=QUANTITIES["db"].help(option_of))
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

Polarity = Annotated[
    str,
    typer.Option(
        "--polarity",
        help="Polarity: forward (positive samples drive forward rotation), reverse or both",
    ),
]

AllowPartial = Annotated[
    bool,
    typer.Option(
        "--allow-partial",
        help="Accept and flag a file whose number of samples differs from its header",
    ),
]

INCLUDE_STRUCTURES = (
    "Include records of sensors on structures (flag structure), which are excluded by default"
)
Suite = Annotated[
    str | None, typer.Option("--suite", help="Suite of motions [default: all motions]")
]

Block = Annotated[Given, fields_of(*NUMBERS, *FAILURE, *SHAPE, *PLANES, *WHOLE)]
"""One block of which all is known that is stated, by field."""

Measures = Annotated[Given, fields_of(*INTENSITY)]
"""What may be known of a motion, by field."""

Shaking = Annotated[Given, fields_of(*SHAKING)]
"""The same, how well it is known, and what may stand for it."""

Answering = Annotated[Given, fields_of(*ANSWERING)]
"""Which fragility model answers, and how wide its interval is, by field."""

Ranging = Annotated[Given, fields_of(*RANGE)]
"""The same, and what the range of one earthquake is of."""

BlockDraws = Annotated[
    str | None,
    typer.Option(
        "--block-draws",
        metavar="FILE",
        help="Table of draws of one uncertain block (.csv, .xlsx, .parquet), one per row, with "
        "the columns of a block table and weight for unequal weights",
    ),
]

Jobs = Annotated[
    int | None,
    typer.Option("--jobs", help="Number of worker processes [default: one per processor]"),
]


@dataclass(frozen=True, kw_only=True)
class Printing:
    """How an answer is printed: a sentence and a short table unless more is asked for."""

    verbose: bool = option("Print all values, with six digits", False)
    json: Json = False


@dataclass(frozen=True, kw_only=True)
class ReadingOptions:
    """What the file of an accelerogram leaves open."""

    units: str | None = option(
        "Acceleration unit of a text file without one: g, m/s2, cm/s2 or mm/s2"
    )
    dt: float | None = option("Sampling interval of a text file with accelerations only [s]")
    gain: float | None = option(
        "Gain of a miniSEED file, the sensitivity in the StationXML of its station [counts/(m/s2)]"
    )


@dataclass(frozen=True, kw_only=True)
class Direction:
    """How a motion acts on the block."""

    vertical: str | None = option(
        "Vertical accelerogram of the same recording, positive upward", metavar="MOTION"
    )
    reverse: bool = option(
        "Reverse polarity: positive samples drive backward, k_h(t) = -a(t)", False
    )

    @property
    def polarity(self) -> Literal["forward", "reverse"]:
        """The polarity of the motion."""
        return "reverse" if self.reverse else "forward"


WITHIN_KM = 5.0
"""Default of the distance of blocks to sites [km], as `rbfrag.exchange.site_join` has it."""

WITHIN_HELP = (
    "Maximum distance from a block to the nearest site, for sites joined by lon and lat [km]"
)


@dataclass(frozen=True, kw_only=True)
class Curve:
    """What a hazard curve means."""

    imt: str | None = option("Intensity measure of the curve: PGV, PGA, 'SA(1.0)'")
    site: str | None = option("Site in the file, by number (from 1) or name")
    convert: str | None = option(
        "Published conversion of a spectral acceleration to PGV, with its dispersion: "
        "newmark_hall_1982 (SA(1)) or bommer_alarcon_2006 (SA(0.5))"
    )
    convert_sigma: float | None = option(
        "Standard deviation of ln PGV about the conversion [default: that of the built-in data set]"
    )
    component: str | None = option(
        "Horizontal component of the intensity measure: single, geometric_mean, rotd50, "
        "rotd100 or larger [default: that of the curve file, else single]"
    )
    disaggregation: str | None = option(
        "OpenQuake disaggregation of a PGA curve by magnitude (Mag-*.csv or Mag_Dist-*.csv), "
        "for the conversion to PGV",
        metavar="FILE",
    )


def number_list(text: str, option: str) -> list[float]:
    """Return the numbers of a list separated by commas."""
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
    """Return the polarities that forward, reverse or both means."""
    from rbfrag.motions.polarity import POLARITIES

    if text == "both":
        return POLARITIES
    chosen = [each for each in POLARITIES if each == text]
    if not chosen:
        raise InputError(f"--polarity {text!r}: use forward, reverse or both")
    return chosen
