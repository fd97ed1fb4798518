"""`rbfrag critical`: the strongest block that fails in a ground motion."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

from rbfrag.cli.output import check_files, print_result, say_when_compiling
from rbfrag.cli.parameters import options
from rbfrag.cli.parameters.block import numbers_of
from rbfrag.cli.parameters.motion import find_shaking
from rbfrag.cli.parameters.option_groups import ParsedInputs, fields_of, option, stacked
from rbfrag.errors import InputError
from rbfrag.vocabulary.quantities import COMMON, JOINT, PLANES, SHAPE

if TYPE_CHECKING:
    from rbfrag.motions.ground_motion import GroundMotion
    from rbfrag.solver.critical_result import SlidingStrengths
    from rbfrag.solver.kinds import KindSpec

EXAMPLE = "Example:  rbfrag critical record.AT2 --height 2.4 --width 0.5"

FINE_ENOUGH_TO_DRAW = 1e-7
"""Width of k_r/PGA to which the map of a figure is made, borders being thin lines."""


@dataclass(frozen=True, kw_only=True)
class Searched:
    """Kind of failure and failure limit of the search."""

    kind: str | None = option(
        "Kind of failure: toppling, sliding, slumping or confined_toppling [default: "
        "toppling with --p2, else from the failure mode of the geometry]"
    )
    rotation: float | None = option(
        "Rotation limit of slumping and confined toppling [deg] [default: failure past recovery]"
    )
    displacement: str | None = option(
        "Displacement limits of sliding on a level plane [m] [default: 0.01,0.05,0.15,0.3]",
        metavar="LIST",
    )


@stacked
def critical(
    *,
    motion: options.Motion,
    inputs: Annotated[
        ParsedInputs,
        fields_of("p2", *SHAPE, *PLANES, *JOINT, *COMMON, without=("kind",)),
    ],
    direction: options.Direction,
    reading: options.ReadingOptions,
    searched: Searched,
    full_map: bool = option(
        "Map of toppling and stable intervals of k_r/PGA down to 0.01, limits to 1e-4",
        False,
        word="--map",
    ),
    plot: str | None = option(
        "Figure of the map, peak rotations, bracket and upper bound (.png, .pdf, .svg); "
        "computes the map as --map, limits to 1e-7",
        metavar="FILE",
    ),
    db: options.Db = None,
    printing: options.Printing,
) -> None:
    """Compute the critical strength of an accelerogram, with bounds.

    Toppling: the largest k_r/PGA that topples at --p2, or at the p2 of the block geometry. Sliding:
    the largest k_y/PGA that slides more than --displacement. Slumping and confined toppling: the
    smallest scale factor of the record at which the block fails.
    """
    from rbfrag.solver.critical import critical as search
    from rbfrag.solver.kinds import facts_of
    from rbfrag.solver.respond import respond
    from rbfrag.solver.results import MAP_DEPTH

    rotation, displacement = searched.rotation, searched.displacement
    if searched.kind is not None and (why := facts_of(searched.kind).no_search):
        raise InputError(f"--kind {searched.kind} has no critical value: {why}")
    block, block_kr, block_ky, remarks = _searched_block(inputs, searched.kind)
    model = _chosen_kind(searched.kind, block, displacement)
    _reject_options_of_other_kinds(
        model,
        {
            "--p2": "p2" in block,
            "--map": full_map,
            "--plot": plot is not None,
            "--block": "block" in block,
            "--rotation": rotation is not None,
            "--displacement": displacement is not None,
        },
    )
    check_files(plot=plot)
    ground, upward, about = find_shaking(motion, direction, db=db, reading=reading)
    about += remarks
    shaking: dict[str, Any] = {"vertical": upward, "polarity": direction.polarity}
    say_when_compiling()
    if "displacement_m" in model.search_options:
        distances = (
            None if displacement is None else options.number_list(displacement, "--displacement")
        )
        with inputs.named():
            slides = _slides(ground, distances, about, kind=model.kind, **block, **shaking)
            slides = replace(slides, block_ky=block_ky)
        print_result(slides, json=printing.json, verbose=printing.verbose)
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
        from rbfrag.plots.islands import plot_islands

        plot_islands(ground, result, plot, vertical=upward, title=ground.label)
    result = replace(result, with_map=full_map, warnings=(*about, *result.warnings))
    print_result(result, json=printing.json, verbose=printing.verbose)


SEARCH_OPTION = {
    "--p2": "p2",
    "--map": "full_map",
    "--plot": "full_map",
    "--block": "block",
    "--rotation": "rotation_deg",
    "--displacement": "displacement_m",
}
"""What an option is called by the kinds that understand it."""


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


def _reject_options_of_other_kinds(model: KindSpec, used_options: dict[str, bool]) -> None:
    from rbfrag.solver.kinds import KINDS

    for word, is_given in used_options.items():
        if is_given and SEARCH_OPTION[word] not in model.search_options:
            name = SEARCH_OPTION[word]
            owners = [kind for kind, its in KINDS.items() if name in its.search_options]
            raise InputError(f"{word} requires --kind {' or '.join(owners)}")
    if model.search_needs == "p2" and not (used_options["--p2"] or used_options["--block"]):
        raise InputError("--p2 is missing: the critical strength is computed for one p² [1/s²]")


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


def _searched_block(inputs: ParsedInputs, kind: str | None) -> SearchedBlock:
    """Return the block of a search."""
    from rbfrag.question.classify import shape_of, without_kv
    from rbfrag.solver.kinds import PLANES, facts_of, kind_of_mode
    from rbfrag.solver.stability.residual_strength import (
        JOINT,
        after_first_slip,
        reject_before_slip,
    )
    from rbfrag.solver.stability.single import stability

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
