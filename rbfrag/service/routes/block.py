"""`/v1/block`: how one block fails, and at which acceleration."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from fastapi import APIRouter, Request, Response

from rbfrag.service.answer import json_answer
from rbfrag.service.documents import BlockAnswer
from rbfrag.service.operation import operation
from rbfrag.service.parameters import Parameter, by_name, read_query
from rbfrag.service.plain_route import plain_router

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

    Raises:
        InputError: a block that is described in no way, or in two.
    """
    from rbfrag.solver.block.described import described
    from rbfrag.solver.stability.single import stability

    block, conditions = described(
        {name: values.get(name) for name in ("alpha1", "alpha3", "r3")},
        {name: values.get(name) for name in ("s1", "s2", "gamma")},
        {keyword: values.get(name) for name, keyword in _KEYWORD.items()},
        values.get("no_back", False),
    )
    return block, stability(block, **conditions)


def answer(query: bytes) -> dict[str, Any]:
    """Return the answer to the query of a URL."""
    from rbfrag.solver.stability.report import as_dict

    return as_dict(*block_of(read_query(query, PARAMETERS)))


def router() -> APIRouter:
    """Return the operation on `/v1/block`."""
    routes = plain_router()

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
        return json_answer(answer(request.scope["query_string"]))

    return routes
