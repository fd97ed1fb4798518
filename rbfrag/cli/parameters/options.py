"""Options shared by several commands, with one wording each."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from rbfrag.cli.parameters.completion import motion_ids
from rbfrag.cli.parameters.option_groups import ParsedInputs, fields_of, option
from rbfrag.errors import InputError
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

SHEET = "Sheet of the workbook with the table [default: first]"

IGNORE_COLUMNS = (
    "Columns of the table to ignore, separated by commas. Without it, a name close to that of a "
    "known column is rejected, and other unknown columns are ignored with a warning"
)

CRS = "Coordinate reference system of x and y of rows without one, such as EPSG:2056"


def column_names(text: str | None) -> tuple[str, ...]:
    """Return the column names in an option value."""
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

Block = Annotated[ParsedInputs, fields_of(*NUMBERS, *FAILURE, *SHAPE, *PLANES, *COMMON)]
"""One block of which all is known that is stated, by field."""

Measures = Annotated[ParsedInputs, fields_of(*INTENSITY)]
"""What may be known of a motion, by field."""

Shaking = Annotated[ParsedInputs, fields_of(*SHAKING)]
"""The same, how well it is known, and what may stand for it."""

Answering = Annotated[ParsedInputs, fields_of(*ANSWERING)]
"""Which fragility model answers, and how wide its interval is, by field."""

Ranging = Annotated[ParsedInputs, fields_of(*RANGE)]
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
    """Output format: headline and short table by default."""

    verbose: bool = option("Print all values, with six digits", False)
    json: Json = False


@dataclass(frozen=True, kw_only=True)
class ReadingOptions:
    """Properties of an accelerogram that its file does not give."""

    units: str | None = option(
        "Acceleration unit of a text file without one: g, m/s2, cm/s2 or mm/s2"
    )
    dt: float | None = option("Sampling interval of a text file with accelerations only [s]")
    gain: float | None = option(
        "Gain of a miniSEED file, the sensitivity in the StationXML of its station [counts/(m/s2)]"
    )


@dataclass(frozen=True, kw_only=True)
class Direction:
    """Direction in which a ground motion acts on the block."""

    vertical: str | None = option(
        "Vertical accelerogram of the same recording, positive upward", metavar="MOTION"
    )
    reverse: bool = option(
        "Reverse polarity: positive samples drive backward, k_h(t) = -a(t)", False
    )

    @property
    def polarity(self) -> Literal["forward", "reverse"]:
        """Polarity of the ground motion."""
        return "reverse" if self.reverse else "forward"


WITHIN_KM = 5.0
"""Default of the distance of blocks to sites [km], as `rbfrag.exchange.nearest_site` has it."""

WITHIN_HELP = (
    "Maximum distance from a block to the nearest site, for sites joined by lon and lat [km]"
)


@dataclass(frozen=True, kw_only=True)
class Curve:
    """Interpretation of a hazard curve."""

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
