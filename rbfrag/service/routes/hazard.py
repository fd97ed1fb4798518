"""`/v1/hazard`: how often per year a block topples."""

from __future__ import annotations

from fastapi import APIRouter, Request, Response

from rbfrag.service import work
from rbfrag.service.body import FILE_FORM, MULTIPART, Bodies
from rbfrag.service.documents import HazardAnswer
from rbfrag.service.json_body import answer
from rbfrag.service.operation import (
    KR,
    LEVEL,
    MEASURES,
    MODEL,
    P2,
    Parameter,
    by_name,
    operation,
    own_router,
    read_query,
)
from rbfrag.service.settings import Settings
from rbfrag.service.work import WorkerPool

PARAMETERS = by_name(
    (
        P2,
        KR,
        Parameter(
            "years",
            "number",
            "Period of the probability [years].",
            None,
            {"exclusiveMinimum": 0, "default": 50},
        ),
        Parameter("imt", "string", "Intensity measure of the curve: PGV, PGA, SA(1.0)."),
        Parameter("site", "string", "Site of the file: its number from 1 on, or its name."),
        next(each for each in MEASURES if each.name == "tm"),
        Parameter(
            "convert",
            "string",
            "Published conversion of a spectral acceleration to PGV: newmark_hall_1982 (SA(1)) or "
            "bommer_alarcon_2006 (SA(0.5)).",
        ),
        Parameter(
            "component",
            "string",
            "What the curve's horizontal component means: single, geometric_mean, rotd50 or "
            "larger.",
        ),
        MODEL,
        LEVEL,
    )
)

EXAMPLE = "pgv_m_s,annual_rate\n0.05,0.05\n0.1,0.02\n0.2,0.006\n0.5,0.0008\n1.0,0.0001\n"
"""A made-up hazard curve."""


def router(settings: Settings, bodies: Bodies, pool: WorkerPool) -> APIRouter:
    """Return the operation on `/v1/hazard`."""
    routes = own_router()

    @routes.post(
        "/v1/hazard",
        **operation(
            "Annual rate at which a block topples",
            HazardAnswer,
            parameters=PARAMETERS,
            body={
                "text/csv": {"schema": {"type": "string"}, "example": EXAMPLE},
                "application/json": {"schema": {"type": "object"}},
                MULTIPART: FILE_FORM,
            },
            description="What `rbfrag hazard --json` prints for the curve that is sent: OpenQuake "
            "CSV, USGS NSHM JSON, or CSV of two columns whose header names their units.",
        ),
    )
    async def hazard(request: Request) -> Response:
        asked = read_query(request.scope["query_string"], PARAMETERS)
        given = {
            "tm_s": asked.get("tm"),
            "years": asked.get("years", 50.0),
            "level": asked.get("level", 0.95),
            **{name: asked.get(name) for name in ("convert", "component", "model")},
        }
        async with bodies.read(request) as body:
            found = await pool.run(
                request,
                work.hazard,
                body,
                asked.get("imt"),
                asked.get("site"),
                asked["p2"],
                asked["kr"],
                given,
                settings.db,
            )
        return answer(found)

    return routes
