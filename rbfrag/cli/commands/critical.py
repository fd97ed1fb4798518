"""`rbfrag critical`: the strongest block that a motion brings down."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from rbfrag.cli.output import print_json, print_pairs, print_table, print_warnings
from rbfrag.cli.parameters import options
from rbfrag.cli.parameters.motion import find_motion, find_vertical
from rbfrag.cli.parameters.values import number_list
from rbfrag.errors import InputError

if TYPE_CHECKING:
    from rbfrag.motions.ground_motion import GroundMotion
    from rbfrag.solver.kind import Kind
    from rbfrag.solver.results import Polarity

EXAMPLE = "Example:  rbfrag critical record.AT2 --p2 3 --json"

FINE_ENOUGH_TO_DRAW = 1e-7
"""Width of k_r/PGA to which the map of a figure is made, borders being thin lines."""

STATUS = {
    "found": "the largest k_r/PGA that topples lies in [lower, upper]",
    "below_limit": "no block down to the search limit topples",
    "no_motion": "no block down to the search limit ever lifts off its base",
    "outside_model": "the motion throws the block off its base",
}

SCALED_STATUS = {
    "found": "a record of this factor brings the block down; one of the lower end does not",
    "below_limit": "no factor up to scale_limit brings the block down, as far as it was looked at",
    "no_motion": "no factor up to scale_limit moves the block",
}

SLIDING_STATUS = {
    "found": "blocks with k_y/PGA below this slide further than displacement_m on a level plane",
    "below_limit": "no block down to the search limit slides that far",
    "no_motion": "no block down to the search limit slides",
    "outside_model": "the vertical motion throws blocks off their base",
}


def critical(
    motion: options.Motion,
    p2: Annotated[
        float | None,
        typer.Option("--p2", help="Toppling: frequency parameter p² of the block [1/s²]."),
    ] = None,
    kind: Annotated[
        str | None,
        typer.Option(
            "--kind",
            help="toppling, sliding, slumping or confined_toppling. Default: toppling with --p2, "
            "the kind of the failure mode with --block.",
        ),
    ] = None,
    block: Annotated[
        str | None,
        typer.Option(
            "--block",
            metavar="FILE",
            help="Block file (.toml or .csv) with beta_deg and phi_deg. Slumping and confined "
            "toppling: the factor on the record that brings it down is searched.",
        ),
    ] = None,
    rotation: Annotated[
        float | None,
        typer.Option(
            "--rotation",
            help="Slumping and confined toppling: rotation that counts as failure [deg]. Default: "
            "failure past recovery.",
        ),
    ] = None,
    displacement: Annotated[
        str | None,
        typer.Option(
            "--displacement",
            metavar="LIST",
            help="Sliding: displacements on a level plane [m]. Default: 0.01,0.05,0.15,0.3.",
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
    from rbfrag.solver.critical import critical as search
    from rbfrag.solver.reports import critical_as_dict
    from rbfrag.solver.results import MAP_DEPTH

    given = {
        "--p2": p2 is not None,
        "--linear": linear,
        "--map": full_map,
        "--plot": plot is not None,
        "--block": block is not None,
        "--rotation": rotation is not None,
        "--displacement": displacement is not None,
    }
    of_file = {} if block is None else _block_of_file(block)
    model = _chosen_kind(kind, of_file, displacement)
    _refuse_options_of_other_kinds(model, given)
    polarity: Polarity = "reverse" if reverse else "forward"
    if plot is not None:
        from rbfrag.plots.canvas import plot_path

        plot_path(plot)
    ground = find_motion(motion, db=db, units=units, dt_s=dt)
    upward, remarks = find_vertical(vertical, ground, db=db, units=units, dt_s=dt)
    if "displacement_m" in model.search_options:
        distances = None if displacement is None else number_list(displacement, "--displacement")
        _slides(model.kind, ground, upward, polarity, distances, remarks, json=json)
        return
    options: dict[str, Any] = {"p2": p2, "rotation_deg": rotation, "linear": linear, **of_file}
    if "full_map" in model.search_options:
        options["full_map"] = full_map or plot is not None
        options["map_depth"] = MAP_DEPTH if plot is None else FINE_ENOUGH_TO_DRAW
    try:
        result = search(ground, kind=model.kind, vertical=upward, polarity=polarity, **options)
    except InputError as error:
        raise InputError(f"{block}: {error}" if block else str(error)) from None
    if plot is not None:
        from rbfrag.plots.islands import plot_islands

        plot_islands(ground, result, plot, vertical=upward, title=ground.label)
    answer = critical_as_dict(result, remarks=remarks, full_map=full_map)
    if json:
        print_json(answer)
        return
    warnings = answer.pop("warnings")
    rows = answer.pop("map", [])
    print_pairs(answer)
    print(f"{result.status}: {(SCALED_STATUS if 'scale' in answer else STATUS)[result.status]}")
    for row in rows:
        print(f"{row['k_lo']:.12f}  {row['k_hi']:.12f}  {row['outcome']}")
    print_warnings(warnings)


SEARCH_OPTION = {
    "--p2": "p2",
    "--linear": "linear",
    "--map": "full_map",
    "--plot": "full_map",
    "--block": "block",
    "--rotation": "rotation_deg",
    "--displacement": "displacement_m",
}
"""What an option is called by the kinds that understand it."""


def _chosen_kind(kind: str | None, of_file: dict[str, Any], displacement: str | None) -> Kind:
    from rbfrag.solver.critical import kind_of
    from rbfrag.solver.kinds import model_of_kind, model_of_mode

    if kind is not None:
        model = model_of_kind(kind)
        if model.search_needs == "block" and not of_file:
            raise InputError(
                f"--block is missing: shape, friction and dip of a block decide about {kind}; "
                "give a block file with beta_deg and phi_deg"
            )
        return model
    if of_file:
        return kind_of(None, of_file)
    return model_of_mode("topple" if displacement is None else "slide")


def _refuse_options_of_other_kinds(model: Kind, given: dict[str, bool]) -> None:
    from rbfrag.solver.kinds import models

    for option, is_given in given.items():
        if is_given and SEARCH_OPTION[option] not in model.search_options:
            name = SEARCH_OPTION[option]
            owners = [kind for kind, its in models().items() if name in its.search_options]
            raise InputError(
                f"{option} goes with --kind {' and '.join(owners)}, not with {model.kind}"
            )
    if model.search_needs == "p2" and not (given["--p2"] or given["--block"]):
        raise InputError("--p2 is missing: the critical block is searched for one p² [1/s²]")


def _block_of_file(path: str) -> dict[str, Any]:
    """Return the options of a search that a block file holds."""
    from rbfrag.solver.block.file import read_block

    file = read_block(path)
    conditions: dict[str, Any] = dict(file.conditions)
    for name in ("beta_deg", "phi_deg"):
        if name not in conditions:
            raise InputError(f"{path}: {name} is missing: the mode of a block depends on it")
    for name, nothing in (("kv", 0.0), ("cohesion_pa", 0.0), ("back_fracture", True)):
        if conditions.pop(name, nothing) != nothing:
            raise InputError(f"{path}: {name} does not go with a search in time: leave it out")
    conditions.pop("density_kg_m3", None)
    return {"block": file.block, **conditions}


def _slides(
    kind: str,
    ground: GroundMotion,
    upward: GroundMotion | None,
    polarity: Polarity,
    distances: list[float] | None,
    remarks: list[str],
    *,
    json: bool,
) -> None:
    """Print the strengths that slide stated distances, and how far blocks of any strength slide."""
    from rbfrag.solver.critical import critical as search
    from rbfrag.solver.models.sliding import KY_OVER_PGA, THRESHOLDS_M, sliding_displacements
    from rbfrag.solver.reports import critical_as_dict

    found = [
        critical_as_dict(
            search(ground, kind=kind, displacement_m=d, vertical=upward, polarity=polarity)
        )
        for d in distances or THRESHOLDS_M
    ]
    curve = sliding_displacements(ground, vertical=upward, polarity=polarity)
    warnings = [*remarks, *found[0]["warnings"]]
    rows = [
        {"ky_over_pga": k, "displacement_m": None if d != d else d}
        for k, d in zip(KY_OVER_PGA, curve.tolist(), strict=True)
    ]
    if json:
        document = {**found[0], "warnings": warnings, "thresholds": found, "displacements": rows}
        print_json(document)
        return
    names = ("displacement_m", "ky_over_pga", "ky", "lower", "upper", "status", "n_runs")
    print_pairs({name: found[0][name] for name in ("kind", "polarity", "pga_g")})
    print_table(names, [[each[name] for name in names] for each in found])
    for status in dict.fromkeys(each["status"] for each in found):
        print(f"{status}: {SLIDING_STATUS[status]}")
    print("\non a base that dips, times cos(phi - beta)/cos(phi):")
    print_table(tuple(rows[0]), [list(row.values()) for row in rows])
    print_warnings(warnings)
