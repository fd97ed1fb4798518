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
        """Return a block to scale.

        It is described as for /v1/block, or by p2 and kr alone: then it is the rectangle on level
        ground that has them. Points are (out of the slope, up) from the centroid [m].
        """
        from rbfrag.plots.block import block_lines
        from rbfrag.solver.stability.single import level_rectangle, rectangle_r3_m

        others = query.model_dump(exclude_defaults=True).keys() - {"p2", "kr"}
        if query.p2 is None and query.kr is None and others:
            body, result = _on_planes(query)
        else:
            if others:
                raise InputError(
                    f"{min(others)} does not go with p2 and kr: a block is these two numbers, or a "
                    "shape with its beta and phi"
                )
            numbers, _ = query.toppling("p2", "kr")
            body, result = level_rectangle(numbers["p2"], numbers["kr"])
        lines = block_lines(body, result)
        return {
            "mode": result.mode,
            "r3_m": body.r3_m,
            "rectangle_r3_m": rectangle_r3_m(body.p2),
            "outline_m": lines.outline,
            "contacts_m": lines.contacts,
            "planes_m": lines.planes,
            "rock_m": lines.rock,
            "resultant_m": lines.resultant,
        }


def _on_planes(query: Shape) -> tuple[Block, Stability]:
    """Return the block that parameters describe, and its stability."""
    from rbfrag.solver.stability.single import stability

    described = query.described()
    if described is None:
        raise InputError(f"there is no block: describe it by {WAYS}")
    body, conditions = described.on_planes()
    return body, stability(body, **conditions)
