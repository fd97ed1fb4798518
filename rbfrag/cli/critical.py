"""`rbfrag critical`: the strongest block that a motion topples."""

from __future__ import annotations

from typing import Annotated

import typer

from rbfrag.cli import options
from rbfrag.cli.motion_argument import find_motion, find_vertical
from rbfrag.cli.output import print_json, print_pairs, print_warnings

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
    p2: options.P2,
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
    """Find the largest k_r/PGA that one accelerogram topples, with its bracket."""
    from rbfrag.solver.certified import MAP_DEPTH
    from rbfrag.solver.critical import critical as search
    from rbfrag.solver.critical_report import as_dict, map_rows

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
    answer = as_dict(result)
    answer["warnings"] = [*remarks, *answer["warnings"]]
    if full_map:
        answer["map"] = map_rows(result)
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
