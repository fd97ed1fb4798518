"""Options that several commands share, with one wording each."""

from __future__ import annotations

from typing import Annotated

import typer

Json = Annotated[
    bool, typer.Option("--json", help="Print one JSON document on standard output, nothing else.")
]

Db = Annotated[
    str | None,
    typer.Option(
        "--db",
        metavar="URL",
        help="Database: a path or an SQLAlchemy URL. Default: RBFRAG_DB, else rbfrag.db in the "
        "current folder.",
    ),
]

Motion = Annotated[
    str,
    typer.Argument(
        metavar="MOTION",
        help="Accelerogram: a file, FILE#INDEX for one trace of several, or a database id.",
    ),
]

Motions = Annotated[
    list[str],
    typer.Argument(
        metavar="MOTION...",
        help="Accelerograms: files, FILE#INDEX for one trace of several, or database ids.",
    ),
]

Polarity = Annotated[
    str,
    typer.Option(
        "--polarity", help="forward: positive samples drive forward; reverse: negative ones; both."
    ),
]

Vertical = Annotated[
    str | None,
    typer.Option(
        "--vertical",
        metavar="MOTION",
        help="Vertical accelerogram of the same recording, upward positive.",
    ),
]

Reverse = Annotated[
    bool, typer.Option("--reverse", help="Positive samples drive backward: k_h(t) = -a(t).")
]

P2 = Annotated[float, typer.Option("--p2", help="Frequency parameter p² of the block [1/s²].")]

Kr = Annotated[
    float,
    typer.Option("--kr", help="Rocking acceleration coefficient k_r = tan(critical angle) [g]."),
]

P2OrFile = Annotated[
    float | None,
    typer.Option("--p2", help="Frequency parameter p² of the block [1/s²], with --kr."),
]

KrOrFile = Annotated[
    float | None,
    typer.Option(
        "--kr", help="Rocking acceleration coefficient k_r = tan(critical angle) [g], with --p2."
    ),
]

BlockFile = Annotated[
    str | None,
    typer.Option(
        "--block",
        metavar="FILE",
        help="Block file (.toml or .csv) with beta_deg and phi_deg, instead of --p2 and --kr; "
        "refused unless the block topples.",
    ),
]

Linear = Annotated[
    bool,
    typer.Option(
        "--linear",
        help="Linear model, for verification against closed forms only; k_r is then the "
        "critical angle in radians.",
    ),
]

Units = Annotated[
    str | None,
    typer.Option(
        "--units",
        help="Unit of acceleration of a text file that does not state it: g, m/s2, cm/s2 or mm/s2.",
    ),
]

Dt = Annotated[
    float | None,
    typer.Option(
        "--dt", help="Sampling interval [s] of a text file that holds accelerations only."
    ),
]

AllowPartial = Annotated[
    bool,
    typer.Option(
        "--allow-partial",
        help="Read a file whose header states another number of samples than follow, and flag it.",
    ),
]

Suite = Annotated[str | None, typer.Option("--suite", help="Only the motions of this suite.")]

Pgv = Annotated[float | None, typer.Option("--pgv", help="Peak ground velocity [m/s].")]

Pga = Annotated[float | None, typer.Option("--pga", help="Peak ground acceleration [g].")]

Tm = Annotated[float | None, typer.Option("--tm", help="Mean period [s].")]

HeldP2 = Annotated[
    float | None,
    typer.Option(
        "--p2",
        help="Frequency parameter p² [1/s²] of the blocks drawn. Default: the middle of the "
        "fitted range.",
    ),
]

HeldPga = Annotated[
    float | None,
    typer.Option(
        "--pga",
        help="PGA [g] of the motions drawn. Default: in proportion to PGV, by the middle of the "
        "fitted range.",
    ),
]

HeldTm = Annotated[
    float | None,
    typer.Option(
        "--tm",
        help="Mean period [s] of the motions drawn. Default: the middle of the fitted range.",
    ),
]

Pgd = Annotated[float | None, typer.Option("--pgd", help="Peak ground displacement [m].")]

Model = Annotated[
    str | None,
    typer.Option(
        "--model",
        help="Name of a stored model. Default: the database's default if the given "
        "measures suffice for it, else the best that they suffice for.",
    ),
]

Level = Annotated[float, typer.Option("--level", help="Confidence level of the interval.")]


Alpha1 = Annotated[
    float | None, typer.Option("--alpha1", help="Angle of the heel [deg], with --alpha3 and --r3.")
]
Alpha3 = Annotated[float | None, typer.Option("--alpha3", help="Angle of the toe [deg].")]
R3 = Annotated[float | None, typer.Option("--r3", help="Distance from centroid to toe [m].")]
S1 = Annotated[
    float | None,
    typer.Option("--s1", help="Spacing of the base fractures [m], with --s2 and --gamma."),
]
S2 = Annotated[float | None, typer.Option("--s2", help="Spacing of the back fractures [m].")]
Gamma = Annotated[
    float | None, typer.Option("--gamma", help="Dip of the back plane less dip of the base [deg].")
]
Beta = Annotated[
    float | None, typer.Option("--beta", help="Dip of the base, out of the slope positive [deg].")
]
Phi = Annotated[float | None, typer.Option("--phi", help="Friction angle of the base [deg].")]
PhiBack = Annotated[
    float | None,
    typer.Option(
        "--phi-back", help="Friction angle of the back plane [deg]. Default: that of the base."
    ),
]
NoBack = Annotated[bool, typer.Option("--no-back", help="There is no fracture behind the block.")]
