"""`/v1/block` and `/v1/drawing`: how one block fails, and the lines that a page draws of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from fastapi import APIRouter, Request, Response

from rbfrag.errors import InputError
from rbfrag.service.documents import BlockAnswer, DrawingAnswer
from rbfrag.service.json_body import json_answer
from rbfrag.service.operation import KR, P2, Parameter, by_name, operation, own_router, read_query

if TYPE_CHECKING:
    from rbfrag.solver.block.geometry import Block
    from rbfrag.solver.stability.single import Stability

PARAMETERS = by_name(
    (
        Parameter("alpha1", "number", "Angle of the heel [deg], with alpha3 and r3."),
        Parameter("alpha3", "number", "Angle of the toe [deg]."),
        Parameter("r3", "number", "Distance from centroid to toe [m]."),
        Parameter("s1", "number", "Spacing of the base fractures [m], with s2 and gamma.", 1.0),
        Parameter("s2", "number", "Spacing of the back fractures [m].", 0.6),
        Parameter("gamma", "number", "Dip of the back plane less dip of the base [deg].", 25.0),
        Parameter(
            "beta",
            "number",
            "Dip of the base, out of the slope positive [deg].",
            20.0,
            required=True,
        ),
        Parameter("phi", "number", "Friction angle of the base [deg].", 40.0, required=True),
        Parameter("phi_back", "number", "Friction angle of the back plane [deg]. Default: phi."),
        Parameter("cohesion", "number", "Cohesion of the base [Pa], with density."),
        Parameter("density", "number", "Density of the rock [kg/m3]."),
        Parameter("kv", "number", "Vertical acceleration of the ground, up positive [g]."),
        Parameter("no_back", "boolean", "There is no fracture behind the block."),
    )
)

_KEYWORD = {
    "beta": "beta_deg",
    "phi": "phi_deg",
    "phi_back": "phi_back_deg",
    "cohesion": "cohesion_pa",
    "density": "density_kg_m3",
    "kv": "kv",
}


def block_of(values: Mapping[str, Any]) -> tuple[Block, Stability]:
    """Return the block that parameters describe, and its stability.

    Args:
        values: those of :data:`PARAMETERS` that were given, by name.
    """
    from rbfrag.solver.block.file import described
    from rbfrag.solver.stability.single import stability

    block, conditions = described(
        {name: values.get(name) for name in ("alpha1", "alpha3", "r3")},
        {name: values.get(name) for name in ("s1", "s2", "gamma")},
        {keyword: values.get(name) for name, keyword in _KEYWORD.items()},
        values.get("no_back", False),
    )
    return block, stability(block, **conditions)


def block_answer(query: bytes) -> dict[str, Any]:
    """Return the answer to the query of a URL."""
    from rbfrag.solver.stability.single import stability_as_dict

    return stability_as_dict(*block_of(read_query(query, PARAMETERS)))


_NUMBERS = by_name((replace(P2, required=False), replace(KR, required=False)))
_SHAPE = {
    name: replace(parameter, required=False, example=None) for name, parameter in PARAMETERS.items()
}

DRAWING = {**_NUMBERS, **_SHAPE}


def drawing_answer(query: bytes) -> dict[str, Any]:
    """Return the answer to the query of a URL."""
    from rbfrag.plots.block import block_lines
    from rbfrag.solver.stability.single import level_rectangle, rectangle_r3_m

    values = read_query(query, DRAWING)
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
        block, found = block_of(values)
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
    """Return the operations on `/v1/block` and `/v1/drawing`."""
    routes = own_router()

    @routes.get(
        "/v1/block",
        **operation(
            "Failure mode, yield accelerations and size parameter of a block",
            BlockAnswer,
            parameters=PARAMETERS,
            description="What `rbfrag block --json` prints. A block is described by alpha1, "
            "alpha3 and r3, or by s1, s2 and gamma.",
        ),
    )
    async def block(request: Request) -> Response:
        return json_answer(block_answer(request.scope["query_string"]))

    @routes.get(
        "/v1/drawing",
        **operation(
            "The lines of a drawing of a block on its planes",
            DrawingAnswer,
            parameters=DRAWING,
            description="A block to scale, described as for /v1/block, or by p2 and kr alone: then "
            "the rectangle on level ground that has them. Points are (out of the slope, up) from "
            "the centroid [m].",
        ),
    )
    async def drawing(request: Request) -> Response:
        return json_answer(drawing_answer(request.scope["query_string"]))

    return routes
