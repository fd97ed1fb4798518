"""`/v1/drawing`: the lines that a page draws of one block."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from fastapi import APIRouter, Request, Response

from rbfrag.errors import InputError
from rbfrag.service.answer import json_answer
from rbfrag.service.documents import DrawingAnswer
from rbfrag.service.operation import operation
from rbfrag.service.parameters import by_name, read_query
from rbfrag.service.plain_route import plain_router
from rbfrag.service.routes import block as block_api
from rbfrag.service.scenario_parameters import KR, P2

_NUMBERS = by_name((replace(P2, required=False), replace(KR, required=False)))
_SHAPE = {
    name: replace(parameter, required=False, example=None)
    for name, parameter in block_api.PARAMETERS.items()
}

PARAMETERS = {**_NUMBERS, **_SHAPE}


def answer(query: bytes) -> dict[str, Any]:
    """Return the answer to the query of a URL."""
    from rbfrag.plots.block_lines import block_lines
    from rbfrag.solver.block.rectangle import level_rectangle, rectangle_r3_m

    values = read_query(query, PARAMETERS)
    numbers = [name for name in _NUMBERS if name in values]
    if numbers and len(values) > len(numbers):
        raise InputError(
            f"{numbers[0]} does not go with a shape: a block is p2 and kr, or a shape with its "
            "beta and phi"
        )
    if numbers or not values:
        for name, parameter in _NUMBERS.items():
            if name not in values:
                raise InputError(f"{name} is missing: {parameter.words}")
        block, found = level_rectangle(values["p2"], values["kr"])
    else:
        block, found = block_api.block_of(values)
    lines = block_lines(block, found)
    return {
        "mode": found.mode,
        "r3_m": block.r3_m,
        "rectangle_r3_m": rectangle_r3_m(block.p2),
        "outline_m": lines.outline,
        "contacts_m": lines.contacts,
        "planes_m": lines.planes,
        "rock_m": lines.rock,
        "resultant_m": lines.resultant,
    }


def router() -> APIRouter:
    """Return the operation on `/v1/drawing`."""
    routes = plain_router()

    @routes.get(
        "/v1/drawing",
        **operation(
            "The lines of a drawing of a block on its planes",
            DrawingAnswer,
            parameters=PARAMETERS,
            description="A block to scale, described as for /v1/block, or by p2 and kr alone: then "
            "the rectangle on level ground that has them. Points are (out of the slope, up) from "
            "the centroid [m].",
        ),
    )
    async def drawing(request: Request) -> Response:
        return json_answer(answer(request.scope["query_string"]))

    return routes
