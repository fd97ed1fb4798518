"""`rbfrag respond`: one block under one motion."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rbfrag.cli.output import print_json, print_pairs, print_warnings
from rbfrag.cli.parameters import options
from rbfrag.cli.parameters.motion import find_motion, find_vertical
from rbfrag.errors import InputError

if TYPE_CHECKING:
    from rbfrag.solver.block.geometry import Block
    from rbfrag.solver.results import Response

EXAMPLE = "Example:  rbfrag respond record.AT2 --p2 3 --kr 0.1 --plot response.png"


def respond(
    motion: options.Motion,
    p2: options.P2OrFile = None,
    kr: options.KrOrFile = None,
    ky: Annotated[
        float | None,
        typer.Option(
            "--ky",
            help="Yield acceleration coefficient tan(phi - beta) [g] of a block that slides on a "
            "plane of dip --beta (default 0), whatever its shape.",
        ),
    ] = None,
    block: Annotated[
        str | None,
        typer.Option(
            "--block",
            metavar="FILE",
            help="Block file (.toml or .csv); its mode chooses the model. What it states about "
            "the planes may be given anew by options.",
        ),
    ] = None,
    alpha1: options.Alpha1 = None,
    alpha3: options.Alpha3 = None,
    r3: options.R3 = None,
    s1: options.S1 = None,
    s2: options.S2 = None,
    gamma: options.Gamma = None,
    beta: options.Beta = None,
    phi: options.Phi = None,
    phi_back: options.PhiBack = None,
    no_back: options.NoBack = False,
    kind: Annotated[
        str | None,
        typer.Option(
            "--kind",
            help="Response model: toppling, sliding, slumping or confined_toppling. Default: that "
            "of the block's failure mode.",
        ),
    ] = None,
    vertical: options.Vertical = None,
    reverse: options.Reverse = False,
    linear: options.Linear = False,
    two_way: Annotated[
        bool, typer.Option("--two-way", help="Sliding: the block may slide up the base too.")
    ] = False,
    horizontal: Annotated[
        bool,
        typer.Option(
            "--horizontal",
            help="Sliding: leave out the factor cos(phi - beta)/cos(phi), as Newmark's horizontal "
            "block does.",
        ),
    ] = False,
    csv: Annotated[
        str | None, typer.Option("--csv", help="Write the motion of the block in time.")
    ] = None,
    plot: Annotated[
        str | None,
        typer.Option(
            "--plot",
            help="Draw the acceleration against the strength that is left, and the motion of the "
            "block (.png, .pdf, .svg).",
        ),
    ] = None,
    animate: Annotated[
        str | None,
        typer.Option(
            "--animate",
            help="Film the block on its planes (.gif, .mp4 where ffmpeg is installed, .html); it "
            "must be given by its geometry.",
        ),
    ] = None,
    exaggerate: Annotated[
        float,
        typer.Option(
            "--exaggerate", help="Factor on displacement and rotation in the film; 1 is true scale."
        ),
    ] = 1.0,
    units: options.Units = None,
    dt: options.Dt = None,
    db: options.Db = None,
    json: options.Json = False,
) -> None:
    """Run one block under one accelerogram.

    The block is --p2 and --kr (toppling), --ky (sliding), or its geometry, from which the failure
    mode and with it the model follow.
    """
    from rbfrag.solver.reports import response_as_dict, write_history
    from rbfrag.solver.respond import respond as run

    shape, planes, p2, kr = _block(
        {"p2": p2, "kr": kr, "ky": ky},
        {"alpha1": alpha1, "alpha3": alpha3, "r3": r3},
        {"s1": s1, "s2": s2, "gamma": gamma},
        block,
        {"beta_deg": beta, "phi_deg": phi, "phi_back_deg": phi_back},
        no_back,
    )
    if animate is not None and shape is None:
        raise InputError("--animate needs the shape of the block: give --block or its geometry")
    if animate is not None:
        from rbfrag.plots.film import film_path

        film_path(animate)
    ground = find_motion(motion, db=db, units=units, dt_s=dt)
    upward, about = find_vertical(vertical, ground, db=db, units=units, dt_s=dt)
    try:
        response = run(
            ground,
            p2=p2,
            kr=kr,
            ky=ky,
            block=shape,
            vertical=upward,
            polarity="reverse" if reverse else "forward",
            kind=kind,
            linear=linear,
            two_way=two_way,
            horizontal=horizontal,
            history=any(path is not None for path in (csv, plot, animate)),
            **planes,
        )
    except InputError as error:
        raise InputError(f"{block}: {error}" if block else str(error)) from None
    response = replace(response, warnings=(*about, *response.warnings))
    if csv is not None:
        write_history(response, csv)
    if plot is not None:
        _draw(response, plot, shape, p2, kr, linear=linear, title=ground.label, reverse=reverse)
    if animate is not None and shape is not None:
        from rbfrag.plots.film import film

        film(
            response, shape, animate, beta_deg=planes["beta_deg"], exaggerate=exaggerate,
            back_fracture=planes.get("back_fracture", True), title=ground.label,
        )  # fmt: skip
    answer = response_as_dict(response)
    if json:
        print_json(answer)
        return
    answer.pop("warnings")
    changes = answer.pop("mode_changes")
    print_pairs({name: value for name, value in answer.items() if value is not None})
    for change in changes:
        print(f"from {change['time_s']:.6g} s on the block {change['motion']}")
    print(response.outcome.advice)
    print_warnings(response.warnings)


def _block(
    numbers: dict[str, float | None],
    angles: dict[str, float | None],
    fractures: dict[str, float | None],
    file: str | None,
    planes: dict[str, float | None],
    no_back: bool,
) -> tuple[Block | None, dict[str, Any], float | None, float | None]:
    """Return the described block and its planes, or what numbers say instead, p2 and k_r."""
    by_number = [f"--{name}" for name, value in numbers.items() if value is not None]
    shape = {**angles, **fractures, "block": file}
    by_shape = [f"--{name}" for name, value in shape.items() if value is not None]
    if by_number and by_shape:
        raise InputError(
            f"{by_number[0]} does not go with {by_shape[0]}: the block is described once"
        )
    if by_shape:
        from rbfrag.solver.block.file import described

        block, conditions = described(
            angles, fractures, planes, no_back, file_option="--block", path=file
        )
        if conditions.pop("kv", 0.0) != 0.0:
            raise InputError(
                f"{file}: kv does not belong in a block that is to be shaken: the vertical "
                "acceleration comes with the motion; leave the line out"
            )
        return block, conditions, None, None
    if not by_number:
        raise InputError(
            "no block: give --p2 and --kr, or --ky, or --block FILE, or its geometry with --beta "
            "and --phi"
        )
    for name, other in (("p2", "kr"), ("kr", "p2")):
        if numbers[name] is not None and numbers[other] is None and numbers["ky"] is None:
            raise InputError(f"--{other} is missing: --p2 and --kr together give a block")
    if no_back:
        raise InputError(f"--no-back does not go with {by_number[0]}")
    given = {name: value for name, value in planes.items() if value is not None}
    return None, given, numbers["p2"], numbers["kr"]


def _draw(
    response: Response,
    path: str,
    block: Block | None,
    p2: float | None,
    kr: float | None,
    *,
    linear: bool,
    title: str,
    reverse: bool,
) -> None:
    if response.history is not None and response.history.displacement_m is not None:
        from rbfrag.plots.response import plot_motion

        plot_motion(response, path, title=title, reverse=reverse)
        return
    from rbfrag.plots.response import plot_response

    assert response.critical_angle_deg is not None
    p2 = block.p2 if block is not None else p2
    kr = math.tan(math.radians(response.critical_angle_deg)) if kr is None else kr
    assert p2 is not None
    plot_response(response, path, p2=p2, kr=kr, linear=linear, title=title, reverse=reverse)
