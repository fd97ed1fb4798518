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

SHEET = "Sheet of a workbook that holds the table. Default: the first."

IGNORE_COLUMNS = (
    "Columns of the table to ignore, separated by commas: those that are not understood and "
    "would be rejected."
)

CRS = "Coordinate reference system of x and y of rows that name none, such as EPSG:2056."


def column_names(text: str | None) -> tuple[str, ...]:
    """Return the names of columns that an option lists."""
    return () if text is None else tuple(name.strip() for name in text.split(","))


EXCEL_TEXT = (
    "In CSV: write texts that begin with = + - or @ with an apostrophe, so that Excel does not "
    "compute them; rbfrag takes it off when it reads the table."
)

Json = Annotated[
    bool, typer.Option("--json", help="Print one JSON document on standard output, nothing else.")
]

Db = Annotated[
    str | None, typer.Option("--db", metavar="URL", help=QUANTITIES["db"].help(option_of))
]

Motion = Annotated[
    str,
    typer.Argument(
        metavar="MOTION",
        autocompletion=motion_ids,
        help="Accelerogram: a file, FILE#INDEX for one trace of several, or a database id.",
    ),
]

Motions = Annotated[
    list[str],
    typer.Argument(
        metavar="MOTION...",
        autocompletion=motion_ids,
        help="Accelerograms: files, FILE#INDEX for one trace of several, or database ids.",
    ),
]

Polarity = Annotated[
    str,
    typer.Option(
        "--polarity", help="forward: positive samples drive forward; reverse: negative ones; both."
    ),
]

AllowPartial = Annotated[
    bool,
    typer.Option(
        "--allow-partial",
        help="Read a file whose header states another number of samples than follow, and flag it.",
    ),
]

INCLUDE_STRUCTURES = "Use records of sensors on structures (flag structure), excluded by default."
Suite = Annotated[str | None, typer.Option("--suite", help="Only the motions of this suite.")]

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
        help="Table of what the one block may be (.csv, .xlsx, .parquet), a row each, with the "
        "columns of a block table and weight if they weigh differently.",
    ),
]

Jobs = Annotated[
    int | None,
    typer.Option(
        "--jobs", help="Worker processes. Default: one per processor, where there is work for them."
    ),
]


@dataclass(frozen=True, kw_only=True)
class Printing:
    """How an answer is printed: a sentence and a short table unless more is asked for."""

    verbose: bool = option("Print every value, with six digits.", False)
    json: Json = False


@dataclass(frozen=True, kw_only=True)
class ReadingOptions:
    """What the file of an accelerogram leaves open."""

    units: str | None = option(
        "Unit of acceleration of a text file that does not state it: g, m/s2, cm/s2 or mm/s2."
    )
    dt: float | None = option("Sampling interval [s] of a text file that holds accelerations only.")
    gain: float | None = option(
        "Gain [counts/(m/s2)] of a miniSEED file: the sensitivity in its station's StationXML."
    )


@dataclass(frozen=True, kw_only=True)
class Direction:
    """How a motion acts on the block."""

    vertical: str | None = option(
        "Vertical accelerogram of the same recording, upward positive.", metavar="MOTION"
    )
    reverse: bool = option("Positive samples drive backward: k_h(t) = -a(t).", False)

    @property
    def polarity(self) -> Literal["forward", "reverse"]:
        """The polarity of the motion."""
        return "reverse" if self.reverse else "forward"


WITHIN_KM = 5.0
"""Default of the distance of blocks to sites [km], as `rbfrag.exchange.site_join` has it."""

WITHIN_HELP = (
    "Farthest distance from a block to the nearest site, where lon and lat join them [km]."
)


@dataclass(frozen=True, kw_only=True)
class Curve:
    """What a hazard curve means."""

    imt: str | None = option("Intensity measure of the curve: PGV, PGA, 'SA(1.0)'.")
    site: str | None = option("Site of the file: its number from 1 on, or its name.")
    convert: str | None = option(
        "Published conversion of a spectral acceleration to PGV: newmark_hall_1982 "
        "(SA(1)) or bommer_alarcon_2006 (SA(0.5)); its scatter is integrated."
    )
    convert_sigma: float | None = option(
        "Standard deviation of ln PGV about the conversion. Default: that of the reference's "
        "motions."
    )
    component: str | None = option(
        "Horizontal component of the shaking: single, geometric_mean, rotd50, rotd100 or larger "
        "[default: that of the curve file, else single]."
    )
    disaggregation: str | None = option(
        "OpenQuake's disaggregation of a curve of PGA by magnitude (Mag-*.csv or Mag_Dist-*.csv): "
        "PGV is taken from both.",
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
                f"{option}: {part.strip()!r} is no number: write a list such as 30,10,3,1"
            ) from None
    return values


def polarities(text: str) -> Sequence[PolarityName]:
    """Return the polarities that forward, reverse or both means."""
    from rbfrag.motions.polarity import POLARITIES

    if text == "both":
        return POLARITIES
    chosen = [each for each in POLARITIES if each == text]
    if not chosen:
        raise InputError(f"--polarity is {text!r}: write forward, reverse or both")
    return chosen
