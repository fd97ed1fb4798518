"""`/v1/block` and `/v1/drawing`: how one block fails, and the lines that a page draws of it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

from fastapi import APIRouter, Query

from rbfrag.errors import InputError
from rbfrag.service.documents import BlockAnswer, DrawingAnswer
from rbfrag.service.parameters import WAYS, BlockQuery, DrawingQuery, Shape
from rbfrag.service.problem import READ

if TYPE_CHECKING:
    from rbfrag.solver.block.geometry import Block
    from rbfrag.solver.stability.single import Stability


def add_routes(routes: APIRouter) -> None:
    """Add the operations on blocks."""

    @routes.get(
        "/v1/block",
        summary="Failure mode, yield accelerations and size parameter of a block",
        response_model=BlockAnswer,
        responses=READ,
    )
    async def block(query: Annotated[BlockQuery, Query()]) -> Any:
        """Return what `rbfrag block --json` prints.

        A block is described by height and width, by alpha1, alpha3 and r3, or by s1, s2 and gamma.
        """
        from rbfrag.solver.stability.single import stability_as_dict

        return stability_as_dict(*_on_planes(query))

    @routes.get(
        "/v1/drawing",
        summary="The lines of a drawing of a block on its planes",
        response_model=DrawingAnswer,
        responses=READ,
    )
    async def drawing(query: Annotated[DrawingQuery, Query()]) -> Any:
        """Return a block to scale, how it fails, and what predictions read of it.

        It is described as for /v1/block, or by p2 and kr alone: then it is the rectangle on level
        ground that has them. A rectangle without phi is taken to be rough enough to topple.
        """
        from rbfrag.plots.block import block_lines
        from rbfrag.solver.stability.single import rectangle_r3_m, stability_as_dict

        body, result, kind, numbers = _drawn(query)
        lines = block_lines(body, result)
        return {
            "kind": kind,
            "numbers": numbers,
            "block": stability_as_dict(body, result),
            "rectangle_r3_m": rectangle_r3_m(body.p2),
            "outline_m": lines.outline,
            "contacts_m": lines.contacts,
            "planes_m": lines.planes,
            "rock_m": lines.rock,
            "resultant_m": lines.resultant,
        }


def _drawn(query: DrawingQuery) -> tuple[Block, Stability, str, dict[str, float] | None]:
    """Return a block, how it stands, the kind of its failure and what a prediction reads of it."""
    from rbfrag.question.blocks import described_block
    from rbfrag.solver.kinds import facts_of, kind_of_mode
    from rbfrag.solver.stability.single import level_rectangle, rough_deg, stability

    def kind_of(result: Stability) -> str:
        return kind_of_mode(result.mode, back_fracture=not query.no_back).kind

    others = query.model_dump(exclude_defaults=True).keys() - {"p2", "kr", "no_back"}
    if query.p2 is not None or query.kr is not None or not others:
        if others:
            raise InputError(
                f"{min(others)} does not go with p2 and kr: a block is these two numbers, or a "
                "shape with its beta and phi"
            )
        _, numbers, _ = query.model_copy(update={"no_back": False}).toppling("p2", "kr")
        body, result = level_rectangle(numbers["p2"], numbers["kr"])
        return body, result, kind_of(result), numbers
    described = query.described()
    if described is None:
        raise InputError(f"there is no block: describe it by {WAYS}")
    body, conditions = described.block, dict(described.conditions)
    if described.only_topples:
        conditions["phi_deg"] = rough_deg(body)
    result = stability(body, **conditions)
    kind = kind_of(result)
    try:
        slides = {"displacement_m": 1.0} if "ky" in facts_of(kind).parameters else {}
        (group,) = described_block(described, slides, kind).groups
        numbers = {n: value for n, value in group.numbers.items() if n != "displacement_m"}
        return body, result, kind, numbers
    except InputError:  # no earthquake decides about it, or no model answers
        return body, result, kind, None


def _on_planes(query: Shape) -> tuple[Block, Stability]:
    """Return the block that parameters describe, and its stability."""
    from rbfrag.solver.stability.single import stability

    described = query.described()
    if described is None:
        raise InputError(f"there is no block: describe it by {WAYS}")
    body, conditions = described.on_planes()
    return body, stability(body, **conditions)
