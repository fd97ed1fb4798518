"""`rbfrag critical`: the strongest block that a motion brings down."""

from __future__ import annotations

from typing import Annotated

import typer

from rbfrag.cli.output import print_json, print_pairs, print_warnings
from rbfrag.cli.parameters import options
from rbfrag.cli.parameters.motion import find_motion, find_vertical
from rbfrag.cli.parameters.number_list import number_list
from rbfrag.errors import InputError

EXAMPLE = "Example:  rbfrag critical record.AT2 --p2 3 --json"

FINE_ENOUGH_TO_DRAW = 1e-7
"""Width of k_r/PGA to which the map of a figure is made, borders being thin lines."""

STATUS = {
    "found": "the largest k_r/PGA that topples lies in [lower, upper]",
    "below_limit": "no block down to the search limit topples",
    "no_motion": "no block down to the search limit ever lifts off its base",
    "outside_model": "the motion throws the block off its base",
}


def critical(
    motion: options.Motion,
    p2: Annotated[
        float | None,
        typer.Option(
            "--p2",
            help="Toppling: frequency parameter p² of the block [1/s²].",
            show_default=False,
        ),
    ] = None,
    kind: Annotated[
        str,
        typer.Option("--kind", help="toppling, sliding, slumping or confined_toppling."),
    ] = "toppling",
    block: Annotated[
        str | None,
        typer.Option(
            "--block",
            metavar="FILE",
            help="Slumping and confined toppling: block file (.toml or .csv) with beta_deg and "
            "phi_deg. The factor on the record that brings it down is searched.",
            show_default=False,
        ),
    ] = None,
    rotation: Annotated[
        float | None,
        typer.Option(
            "--rotation",
            help="Slumping and confined toppling: rotation that counts as failure [deg]. Default: "
            "failure past recovery.",
            show_default=False,
        ),
    ] = None,
    displacement: Annotated[
        str | None,
        typer.Option(
            "--displacement",
            metavar="LIST",
            help="Sliding: displacements on a level plane [m]. Default: 0.01,0.05,0.15,0.3.",
            show_default=False,
        ),
    ] = None,
    vertical: options.Vertical = None,
    reverse: options.Reverse = False,
    linear: options.Linear = False,
    full_map: Annotated[
        bool,
        typer.Option(
            "--map",
            help="Map the toppling and safe intervals of k_r/PGA down to 0.01, borders to 1e-4.",
        ),
    ] = False,
    plot: Annotated[
        str | None,
        typer.Option(
            "--plot",
            metavar="FILE",
            help="Draw the map, peak rotations, bracket and upper bound (.png, .pdf, .svg). "
            "Makes the whole map, as --map does, borders to 1e-7.",
            show_default=False,
        ),
    ] = None,
    units: options.Units = None,
    dt: options.Dt = None,
    db: options.Db = None,
    json: options.Json = False,
) -> None:
    """Find the critical block of one accelerogram, with its bracket.

    Toppling: the largest k_r/PGA that topples at --p2. Sliding: the largest k_y/PGA that slides
    further than --displacement. Slumping and confined toppling: the smallest factor on the record
    that brings the block of --block down.
    """
    _refuse_options_of_other_kinds(
        kind,
        {
            "--p2": p2 is not None,
            "--linear": linear,
            "--map": full_map,
            "--plot": plot is not None,
            "--block": block is not None,
            "--rotation": rotation is not None,
            "--displacement": displacement is not None,
        },
    )
    if kind != "toppling":
        from rbfrag.cli.commands import critical_kinds

        ground = find_motion(motion, db=db, units=units, dt_s=dt)
        upward, said = find_vertical(vertical, ground, db=db, units=units, dt_s=dt)
        if kind == "sliding":
            distances = [] if displacement is None else number_list(displacement, "--displacement")
            critical_kinds.sliding(
                ground, upward, said, displacements_m=distances, reverse=reverse, json=json
            )
            return
        critical_kinds.scaled(
            ground, upward, said, kind=kind, block=block, rotation=rotation, reverse=reverse,
            json=json,
        )  # fmt: skip
        return
    if p2 is None:
        raise InputError("--p2 is missing: the critical block is searched for one p² [1/s²]")
    from rbfrag.solver.search.certified import MAP_DEPTH
    from rbfrag.solver.search.critical import critical as search
    from rbfrag.solver.search.report import as_dict

    if plot is not None:
        from rbfrag.plots.canvas import plot_path

        plot_path(plot)
    ground = find_motion(motion, db=db, units=units, dt_s=dt)
    upward, remarks = find_vertical(vertical, ground, db=db, units=units, dt_s=dt)
    result = search(
        ground,
        p2=p2,
        vertical=upward,
        polarity="reverse" if reverse else "forward",
        linear=linear,
        full_map=full_map or plot is not None,
        map_depth=MAP_DEPTH if plot is None else FINE_ENOUGH_TO_DRAW,
    )
    if plot is not None:
        from rbfrag.plots.islands import plot_islands

        plot_islands(ground, result, plot, vertical=upward, title=ground.label)
    answer = as_dict(result, remarks=remarks, full_map=full_map)
    if json:
        print_json(answer)
        return
    warnings = answer.pop("warnings")
    rows = answer.pop("map", [])
    print_pairs(answer)
    print(f"{result.status}: {STATUS[result.status]}")
    for row in rows:
        print(f"{row['k_lo']:.12f}  {row['k_hi']:.12f}  {row['outcome']}")
    print_warnings(warnings)


OPTIONS_OF = {
    "toppling": {"--p2", "--linear", "--map", "--plot"},
    "sliding": {"--displacement"},
    "slumping": {"--block", "--rotation"},
    "confined_toppling": {"--block", "--rotation"},
}
"""Which options go with which kind."""


def _refuse_options_of_other_kinds(kind: str, given: dict[str, bool]) -> None:
    if kind not in OPTIONS_OF:
        raise InputError(f"--kind {kind}: use one of {', '.join(OPTIONS_OF)}")
    for option, is_given in given.items():
        if is_given and option not in OPTIONS_OF[kind]:
            kinds = " and ".join(name for name, its in OPTIONS_OF.items() if option in its)
            raise InputError(f"{option} goes with --kind {kinds}, not with {kind}")
