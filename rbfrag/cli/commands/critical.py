"""`rbfrag critical`: the strongest block that a motion brings down."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

from rbfrag.cli.output import (
    check_files,
    print_json,
    print_pairs,
    print_sentences,
    print_table,
    print_warnings,
    say_when_compiling,
)
from rbfrag.cli.parameters import options
from rbfrag.cli.parameters.block import numbers_of
from rbfrag.cli.parameters.motion import find_shaking
from rbfrag.cli.parameters.stack import Given, fields_of, option, stacked
from rbfrag.cli.sentences import critical_in_words, slides_in_words
from rbfrag.errors import InputError
from rbfrag.vocabulary.quantities import JOINT, PLANES, SHAPE, WHOLE

if TYPE_CHECKING:
    from rbfrag.motions.ground_motion import GroundMotion
    from rbfrag.solver.kinds import KindFacts
    from rbfrag.solver.results import Polarity

EXAMPLE = "Example:  rbfrag critical record.AT2 --height 2.4 --width 0.5"

FINE_ENOUGH_TO_DRAW = 1e-7
"""Width of k_r/PGA to which the map of a figure is made, borders being thin lines."""

SHORT = ("kr", "kr_over_pga", "scale", "y_m_s", "pga_g")
"""Values that are shown without --verbose."""


@dataclass(frozen=True, kw_only=True)
class Searched:
    """What is searched for."""

    kind: str | None = option(
        "toppling, sliding, slumping or confined_toppling. Default: toppling with --p2, "
        "the kind of the failure mode of a shape."
    )
    rotation: float | None = option(
        "Slumping and confined toppling: rotation that counts as failure [deg]. Default: "
        "failure past recovery."
    )
    displacement: str | None = option(
        "Sliding: displacements on a level plane [m]. Default: 0.01,0.05,0.15,0.3.", metavar="LIST"
    )


@stacked
def critical(
    *,
    motion: options.Motion,
    given: Annotated[
        Given,
        fields_of("p2", *SHAPE, *PLANES, *JOINT, *WHOLE, without=("kind",)),
    ],
    direction: options.Direction,
    reading: options.ReadingOptions,
    searched: Searched,
    full_map: bool = option(
        "Map the toppling and safe intervals of k_r/PGA down to 0.01, borders to 1e-4.",
        False,
        word="--map",
    ),
    plot: str | None = option(
        "Draw the map, peak rotations, bracket and upper bound (.png, .pdf, .svg). "
        "Makes the whole map, as --map does, borders to 1e-7.",
        metavar="FILE",
    ),
    db: options.Db = None,
    printing: options.Printing,
) -> None:
    """Find the critical block of one accelerogram, with its bracket.

    Toppling: the largest k_r/PGA that topples at --p2, or at the p2 of a shape. Sliding: the
    largest k_y/PGA that slides further than --displacement. Slumping and confined toppling: the
    smallest factor on the record that brings the block down.
    """
    from rbfrag.solver.critical import critical as search
    from rbfrag.solver.reports import critical_as_dict
    from rbfrag.solver.results import MAP_DEPTH

    rotation, displacement = searched.rotation, searched.displacement
    block, about = _searched_block(given, searched.kind)
    block_kr = _strength_of(block) if "block" in block else None
    model = _chosen_kind(searched.kind, block, displacement)
    _refuse_options_of_other_kinds(
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
    ground, upward, remarks = find_shaking(motion, direction, db=db, reading=reading)
    remarks += about
    say_when_compiling()
    if "displacement_m" in model.search_options:
        distances = (
            None if displacement is None else options.number_list(displacement, "--displacement")
        )
        with given.named():
            document = _slides(
                model.kind, block, ground, upward, direction.polarity, distances, remarks
            )
        print_json(document) if printing.json else _show_slides(document, verbose=printing.verbose)
        return
    settings: dict[str, Any] = {"rotation_deg": rotation, **block}
    if "full_map" in model.search_options:
        settings["full_map"] = full_map or plot is not None
        settings["map_depth"] = MAP_DEPTH if plot is None else FINE_ENOUGH_TO_DRAW
    with given.named():
        result = search(
            ground, kind=model.kind, vertical=upward, polarity=direction.polarity, **settings
        )
    if plot is not None:
        from rbfrag.plots.islands import plot_islands

        plot_islands(ground, result, plot, vertical=upward, title=ground.label)
    answer = critical_as_dict(result, remarks=remarks, full_map=full_map)
    if printing.json:
        print_json(answer)
        return
    warnings = answer.pop("warnings")
    rows = answer.pop("map", [])
    for sentence in critical_in_words(answer, block_kr):
        print(sentence)
    print()
    print_pairs(
        answer if printing.verbose else {name: answer[name] for name in SHORT if name in answer}
    )
    for row in rows:
        print(f"{row['k_lo']:.12f}  {row['k_hi']:.12f}  {row['outcome']}")
    print_warnings(warnings)


SEARCH_OPTION = {
    "--p2": "p2",
    "--map": "full_map",
    "--plot": "full_map",
    "--block": "block",
    "--rotation": "rotation_deg",
    "--displacement": "displacement_m",
}
"""What an option is called by the kinds that understand it."""


def _chosen_kind(kind: str | None, block: dict[str, Any], displacement: str | None) -> KindFacts:
    from rbfrag.question.shapes import SIDES_AND_PLANES, WAYS
    from rbfrag.solver.critical import kind_of
    from rbfrag.solver.kinds import facts_of, kind_of_mode

    if kind is not None:
        model = facts_of(kind)
        if model.search_needs == "block" and "block" not in block:
            raise InputError(
                f"no block: its shape, dip and friction decide about {kind}; describe it by "
                f"{WAYS}, with beta_deg and phi_deg",
                fields=("beta_deg", *SIDES_AND_PLANES),
            )
        return model
    if block:
        return kind_of(None, block)
    return kind_of_mode("topple" if displacement is None else "slide")


def _refuse_options_of_other_kinds(model: KindFacts, given: dict[str, bool]) -> None:
    from rbfrag.solver.kinds import KINDS

    if model.no_search:
        raise InputError(f"--kind {model.kind} has no critical value: {model.no_search}")
    for word, is_given in given.items():
        if is_given and SEARCH_OPTION[word] not in model.search_options:
            name = SEARCH_OPTION[word]
            owners = [kind for kind, its in KINDS.items() if name in its.search_options]
            raise InputError(
                f"{word} goes with --kind {' and '.join(owners)}, not with {model.kind}"
            )
    if model.search_needs == "p2" and not (given["--p2"] or given["--block"]):
        raise InputError("--p2 is missing: the critical block is searched for one p² [1/s²]")


def _searched_block(given: Given, kind: str | None) -> tuple[dict[str, Any], tuple[str, ...]]:
    """Return the keywords of a search that say which block, and what is to be said of it."""
    from rbfrag.question.blocks import shape_of, without_kv
    from rbfrag.solver.kinds import PLANES, facts_of, kind_of_mode
    from rbfrag.solver.stability.first_slip import JOINT, after_first_slip, refuse_before_slip

    with given.named():
        shape = shape_of(without_kv(given))
        if shape is None:
            return {name: given[name] for name in ("p2",) if name in given}, ()
        if "p2" in given:
            raise InputError(
                "p2 does not go with the shape of a block: a block is described once",
                fields=("p2",),
            )
    topples = kind_of_mode("topple") if kind is None else facts_of(kind)
    if "phi_deg" not in shape.planes and topples.search_needs == "p2":
        _, numbers, remarks = numbers_of(given, topples.kind)
        return {"p2": numbers["p2"]}, remarks
    with given.named():
        planes, after = after_first_slip(shape.block, shape.known().planes)
        refuse_before_slip(shape.block, planes, kind)
        for name, nothing in (("cohesion_pa", 0.0), ("back_fracture", True)):
            if planes.pop(name, nothing) != nothing:
                raise InputError(
                    f"{name} does not go with a search in time: leave it out", fields=(name,)
                )
    read = {name: value for name, value in planes.items() if name in PLANES or name not in JOINT}
    return {"block": shape.block, **read}, after


def _strength_of(block: dict[str, Any]) -> float | None:
    """Return k_r of the block of a search; None of one that does not topple."""
    from rbfrag.solver.stability.single import stability

    planes = {name: value for name, value in block.items() if name != "block"}
    return stability(block["block"], **planes).kr


def _slides(
    kind: str,
    block: dict[str, Any],
    ground: GroundMotion,
    upward: GroundMotion | None,
    polarity: Polarity,
    distances: list[float] | None,
    remarks: list[str],
) -> dict[str, Any]:
    """Return the strengths that slide stated distances, and how far blocks slide by strength."""
    from rbfrag.solver.critical import critical as search
    from rbfrag.solver.models.sliding import KY_OVER_PGA, THRESHOLDS_M, sliding_displacements
    from rbfrag.solver.reports import critical_as_dict

    results = [
        critical_as_dict(
            search(ground, kind=kind, displacement_m=d, vertical=upward, polarity=polarity, **block)
        )
        for d in distances or THRESHOLDS_M
    ]
    curve = sliding_displacements(ground, vertical=upward, polarity=polarity)
    warnings = [*remarks, *results[0]["warnings"]]
    rows = [
        {"ky_over_pga": k, "displacement_m": None if d != d else d}
        for k, d in zip(KY_OVER_PGA, curve.tolist(), strict=True)
    ]
    return {**results[0], "warnings": warnings, "thresholds": results, "displacements": rows}


def _show_slides(document: dict[str, Any], *, verbose: bool) -> None:
    thresholds, rows = document["thresholds"], document["displacements"]
    print_sentences(slides_in_words(document))
    names = ["displacement_m", "ky_over_pga", "ky"]
    if verbose:
        print_pairs({name: document[name] for name in ("kind", "polarity", "pga_g")})
        names += ["lower", "upper", "status", "n_runs"]
    print_table(names, [[each[name] for name in names] for each in thresholds])
    print("\ndisplacement of blocks by strength:")
    print_table(tuple(rows[0]), [list(row.values()) for row in rows])
    print_warnings(document["warnings"])
