"""`rbfrag respond`: one block under one motion."""

from __future__ import annotations

from typing import Annotated

import typer

from rbfrag.cli import options
from rbfrag.cli.block_argument import toppling_block
from rbfrag.cli.motion_argument import find_motion, find_vertical
from rbfrag.cli.output import print_json, print_pairs, print_warnings

EXAMPLE = "Example:  rbfrag respond record.AT2 --p2 3 --kr 0.1 --plot response.png"


def respond(
    motion: options.Motion,
    p2: options.P2OrFile = None,
    kr: options.KrOrFile = None,
    block: options.BlockFile = None,
    vertical: options.Vertical = None,
    reverse: options.Reverse = False,
    linear: options.Linear = False,
    csv: Annotated[
        str | None,
        typer.Option("--csv", help="Write the motion of the block in time.", show_default=False),
    ] = None,
    plot: Annotated[
        str | None,
        typer.Option(
            "--plot",
            help="Draw acceleration against k_r(theta), and theta over the critical angle "
            "(.png, .pdf, .svg).",
            show_default=False,
        ),
    ] = None,
    units: options.Units = None,
    dt: options.Dt = None,
    db: options.Db = None,
    json: options.Json = False,
) -> None:
    """Run one toppling block under one accelerogram."""
    from rbfrag.solver.respond import respond as run
    from rbfrag.solver.response_report import as_dict, write_history

    p2, kr, remarks = toppling_block(p2, kr, block)
    ground = find_motion(motion, db=db, units=units, dt_s=dt)
    upward, about = find_vertical(vertical, ground, db=db, units=units, dt_s=dt)
    remarks = (*remarks, *about)
    response = run(
        ground,
        p2=p2,
        kr=kr,
        vertical=upward,
        polarity="reverse" if reverse else "forward",
        linear=linear,
        history=csv is not None or plot is not None,
    )
    if csv is not None:
        write_history(response, csv)
    if plot is not None:
        from rbfrag.plots.response import plot_response

        plot_response(
            response, plot, p2=p2, kr=kr, linear=linear, title=ground.label, reverse=reverse
        )
    answer = as_dict(response)
    answer["warnings"] = [*remarks, *answer["warnings"]]
    if json:
        print_json(answer)
        return
    answer.pop("warnings")
    print_pairs(answer)
    print(response.outcome.advice)
    print_warnings([*remarks, *response.warnings])
