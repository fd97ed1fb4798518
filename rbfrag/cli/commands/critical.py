"""`rbfrag critical`: the strongest block that fails in a ground motion."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

from rbfrag.cli import options
from rbfrag.cli.command import Fields, Inputs, option
from rbfrag.cli.inputs import find_shaking, numbers_of
from rbfrag.cli.output import check_files, print_result, say_when_compiling
from rbfrag.errors import InputError
from rbfrag.vocabulary.quantities import COMMON, JOINT, PLANES, SHAPE

if TYPE_CHECKING:
    from rbfrag.motions.ground_motion import GroundMotion
    from rbfrag.solver.critical_result import SlidingStrengths
    from rbfrag.solver.kinds import KindSpec

EXAMPLE = "Example:  rbfrag critical record.AT2 --height 2.4 --width 0.5"

FINE_ENOUGH_TO_DRAW = 1e-7
"""Width of k_r/PGA to which the map of a figure is made, borders being thin lines."""


def critical(
    *,
    motion: options.Motion,
    inputs: Annotated[
        Inputs,
        Fields("p2", *SHAPE, *PLANES, *JOINT, *COMMON, without=("kind",)),
    ],
    vertical: options.Vertical = None,
    direction: options.Direction,
    slope_azimuth: options.SlopeAzimuth = None,
    reading: options.Reading,
    kind: str | None = option(
        "Kind of failure: toppling, sliding, slumping or confined_toppling [default: "
        "toppling with --p2, else from the failure mode of the geometry]"
    ),
    rotation: float | None = option(
        "Rotation limit of slumping and confined toppling [deg] [default: failure past recovery]"
    ),
    displacement: str | None = option(
        "Displacement limits of sliding on a level plane [m] [default: 0.01,0.05,0.15,0.3]",
        metavar="LIST",
    ),
    full_map: bool = option(
        "Map of toppling and stable intervals of k_r/PGA down to 0.01, limits to 1e-4",
        False,
        "--map",
    ),
    plot: str | None = option(
        "Figure of the map, peak rotations, bracket and upper bound (.png, .pdf, .svg); "
        "computes the map as --map, limits to 1e-7",
        metavar="FILE",
    ),
    db: options.Db = None,
    verbose: options.Verbose = False,
    json: options.Json = False,
) -> None:
    """Compute the critical strength of an accelerogram, with bounds.

    Toppling: the largest k_r/PGA that topples at --p2, or at the p2 of the block geometry. Sliding:
    the largest k_y/PGA that slides more than --displacement. Slumping and confined toppling: the
    smallest scale factor of the record at which the block fails.
    """
    from rbfrag.solver.critical import critical as search
    from rbfrag.solver.kinds import KINDS, facts_of
    from rbfrag.solver.respond import respond
    from rbfrag.solver.results import MAP_DEPTH

    if kind is not None and (why := facts_of(kind).no_search):
        raise InputError(f"--kind {kind} has no critical value: {why}")
    block, block_kr, block_ky, remarks = _searched_block(inputs, kind)
    model = _chosen_kind(kind, block, displacement)
    for word, name, is_given in (
        ("--p2", "p2", "p2" in block),
        ("--map", "full_map", full_map),
        ("--plot", "full_map", plot is not None),
        ("--block", "block", "block" in block),
        ("--rotation", "rotation_deg", rotation is not None),
        ("--displacement", "displacement_m", displacement is not None),
    ):
        if is_given and name not in model.search_options:
            owners = [kind for kind, facts in KINDS.items() if name in facts.search_options]
            raise InputError(f"{word} requires --kind {' or '.join(owners)}")
    if model.search_needs == "p2" and not block:
        raise InputError("--p2 is missing: the critical strength is computed for one p² [1/s²]")
    check_files(plot=plot)
    ground, upward, about = find_shaking(
        motion, vertical, db=db, reading=reading, slope_azimuth_deg=slope_azimuth
    )
    about += remarks
    shaking: dict[str, Any] = {"vertical": upward, "polarity": direction}
    say_when_compiling()
    if "displacement_m" in model.search_options:
        distances = (
            None if displacement is None else options.number_list(displacement, "--displacement")
        )
        with inputs.named():
            slides = _slides(ground, distances, about, kind=model.kind, **block, **shaking)
            slides = replace(slides, block_ky=block_ky)
        print_result(slides, json=json, verbose=verbose)
        return
    settings: dict[str, Any] = {"rotation_deg": rotation, **block}
    if "full_map" in model.search_options:
        settings["full_map"] = full_map or plot is not None
        settings["map_depth"] = MAP_DEPTH if plot is None else FINE_ENOUGH_TO_DRAW
    with inputs.named():
        result = search(ground, kind=model.kind, **settings, **shaking)
        if block_kr is not None and model.search_needs == "p2":
            response = respond(ground, kind=model.kind, p2=result.p2, kr=block_kr, **shaking)
            result = replace(result, block_kr=block_kr, block_outcome=response.outcome)
    if plot is not None:
        from rbfrag.plots.critical_strength import plot_islands

        plot_islands(ground, result, plot, vertical=upward, title=ground.label)
    result = replace(result, with_map=full_map, warnings=(*about, *result.warnings))
    print_result(result, json=json, verbose=verbose)


def _chosen_kind(kind: str | None, block: dict[str, Any], displacement: str | None) -> KindSpec:
    from rbfrag.question.shape_validation import SIDES_AND_PLANES, WAYS
    from rbfrag.solver.critical import kind_of
    from rbfrag.solver.kinds import facts_of, kind_of_mode

    if kind is not None:
        model = facts_of(kind)
        if model.search_needs == "block" and "block" not in block:
            raise InputError(
                f"the kind {kind} requires the geometry of a block: give {WAYS}, with beta_deg "
                "and phi_deg",
                fields=("beta_deg", *SIDES_AND_PLANES),
            )
        return model
    if block:
        return kind_of(None, block)
    return kind_of_mode("topple" if displacement is None else "slide")


class SearchedBlock(NamedTuple):
    """Block whose strength a search is compared with.

    Args:
        question: the block by keyword of the search.
        kr: its k_r, if it topples; None without a shape.
        ky: its k_y; None without a shape and friction.
        warnings: notes on the block.
    """

    question: dict[str, Any]
    kr: float | None = None
    ky: float | None = None
    warnings: tuple[str, ...] = ()


def _searched_block(inputs: Inputs, kind: str | None) -> SearchedBlock:
    """Return the block of a search."""
    from rbfrag.question.classify import shape_of, without_kv
    from rbfrag.solver.kinds import PLANES, facts_of, kind_of_mode
    from rbfrag.solver.stability.joint import JOINT
    from rbfrag.solver.stability.single import after_first_slip, reject_before_slip, stability

    with inputs.named():
        shape = shape_of(without_kv(inputs))
        if shape is None:
            return SearchedBlock({name: inputs[name] for name in ("p2",) if name in inputs})
        if "p2" in inputs:
            raise InputError(
                "p2 cannot be combined with the geometry of a block: give one of them",
                fields=("p2",),
            )
    topples = kind_of_mode("topple") if kind is None else facts_of(kind)
    if "phi_deg" not in shape.planes and topples.search_needs == "p2":
        _, numbers, remarks = numbers_of(inputs, topples.kind)
        return SearchedBlock({"p2": numbers["p2"]}, numbers["kr"], warnings=remarks)
    with inputs.named():
        planes, after = after_first_slip(shape.block, shape.require_friction().planes)
        reject_before_slip(shape.block, planes, kind)
        for name, nothing in (("cohesion_pa", 0.0), ("back_fracture", True)):
            if planes.pop(name, nothing) != nothing:
                raise InputError(
                    f"{name} cannot be combined with a search for the critical strength: omit it",
                    fields=(name,),
                )
    read = {name: value for name, value in planes.items() if name in PLANES or name not in JOINT}
    yields = stability(shape.block, **read)
    return SearchedBlock({"block": shape.block, **read}, yields.kr, yields.ky, after)


def _slides(
    ground: GroundMotion, distances: list[float] | None, remarks: list[str], **question: Any
) -> SlidingStrengths:
    """Return the critical strengths by displacement, and the displacements by strength."""
    import numpy as np

    from rbfrag.solver.critical import critical as search
    from rbfrag.solver.critical_result import SlidingStrengths
    from rbfrag.solver.models.sliding import KY_OVER_PGA, THRESHOLDS_M, sliding_displacements
    from rbfrag.solver.respond import respond

    distances = distances or [*THRESHOLDS_M]
    thresholds = tuple(search(ground, displacement_m=d, **question) for d in distances)
    shaking = {name: question[name] for name in ("vertical", "polarity")}
    slid = sliding_displacements(ground, **shaking)
    response = respond(ground, **question) if "block" in question else None
    warnings = (*remarks, *thresholds[0].warnings)
    return SlidingStrengths(thresholds, np.array(KY_OVER_PGA), slid, warnings, response)
