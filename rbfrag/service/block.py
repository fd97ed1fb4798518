"""`/v1/block` and `/v1/drawing`: failure mode of one block, and the lines of its drawing."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Any

from fastapi import APIRouter, Query

from rbfrag.errors import InputError
from rbfrag.service.documents import BlockAnswer, DrawingAnswer
from rbfrag.service.parameters import BlockQuery, DrawingQuery
from rbfrag.service.problem import READ

if TYPE_CHECKING:
    from rbfrag.solver.block.geometry import Block
    from rbfrag.solver.stability.single import Stability


def add_routes(routes: APIRouter) -> None:
    """Add the operations on blocks."""

    @routes.get(
        "/v1/block",
        summary="Failure mode, yield accelerations and p2 of a block",
        response_model=BlockAnswer,
        responses=READ,
    )
    async def block(query: Annotated[BlockQuery, Query()]) -> Any:
        """Return what `rbfrag block` prints as JSON.

        A block is described by height and width, by alpha1, alpha3 and r3, or by s1, s2 and gamma.
        """
        from rbfrag.question.classify import on_planes
        from rbfrag.solver.stability.single import stability

        shape = on_planes(query.inputs())
        result = stability(shape.block, **shape.planes)
        warnings = tuple(dict.fromkeys((*shape.remarks, *result.warnings)))
        return replace(result, warnings=warnings).document(text=query.text)

    @routes.get(
        "/v1/drawing",
        summary="Lines of a drawing of a block on its planes",
        response_model=DrawingAnswer,
        responses=READ,
    )
    async def drawing(query: Annotated[DrawingQuery, Query()]) -> Any:
        """Return a block to scale, how it fails, and what predictions read of it.

        It is described as for /v1/block, or by p2 and kr alone: then it is the rectangle on level
        ground that has them. A rectangle without phi is taken to be rough enough to topple.
        """
        from rbfrag.plots.blocks.block import block_lines
        from rbfrag.solver.stability.single import rectangle_r3_m

        body, result, kind, numbers, reason = _drawn(query.inputs())
        lines = block_lines(body, result)
        return {
            "kind": kind,
            "numbers": numbers,
            "reason": reason,
            "block": result.document(text=True),
            "rectangle_r3_m": rectangle_r3_m(body.p2),
            "outline_m": lines.outline,
            "contacts_m": lines.contacts,
            "planes_m": lines.planes,
            "rock_m": lines.rock,
            "resultant_m": lines.resultant,
        }


def _drawn(
    inputs: Mapping[str, Any],
) -> tuple[Block, Stability, str, Mapping[str, float] | None, str]:
    """Return a block, its stability, its kind of failure, and the inputs of a prediction."""
    from rbfrag.question.classify import classify_block, shape_of
    from rbfrag.solver.kinds import facts_of, kind_of_mode
    from rbfrag.solver.stability.single import level_rectangle, stability

    def kind_of(result: Stability) -> str:
        return kind_of_mode(result.mode, back_fracture=inputs.get("back_fracture", True)).kind

    numbers = {name: inputs[name] for name in ("p2", "kr") if name in inputs}
    shape = None if numbers else shape_of(inputs)
    if shape is None:
        require(numbers, "p2", "kr")
        conflicts = [name for name in inputs if name not in (*numbers, "back_fracture")]
        if conflicts:
            raise InputError(
                f"{conflicts[0]} cannot be combined with p2 and kr: give p2 and kr, or a geometry "
                "with dip and friction",
                fields=(conflicts[0],),
            )
        body, result = level_rectangle(**numbers)
        return body, result, kind_of(result), numbers, ""
    result = stability(shape.block, **shape.rough())
    kind = kind_of(result)
    slides = {"displacement_m": 1.0} if "ky" in facts_of(kind).parameters else {}
    try:
        (group,) = classify_block({**inputs, **slides}, kind).groups
    except InputError as error:  # no earthquake decides about it, or no model answers
        return shape.block, result, kind, None, "" if result.state == "unstable" else str(error)
    read = {name: value for name, value in group.numbers.items() if name not in slides}
    return shape.block, result, kind, read, ""


def require(numbers: Collection[str], *names: str) -> None:
    """Reject a block with a missing number."""
    from rbfrag.question.shape_validation import OF_A_SHAPE, WAYS

    for name in names:
        if name not in numbers:
            raise InputError(
                f"{name} is missing: a block is given by {' and '.join(names)}, or by {WAYS}",
                fields=OF_A_SHAPE,
            )
