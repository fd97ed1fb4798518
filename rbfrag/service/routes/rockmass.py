"""`/v1/rockmass`: the blocks between two fracture sets that scatter."""

from __future__ import annotations

from typing import Literal

from fastapi import APIRouter, Request, Response

from rbfrag.service import work
from rbfrag.service.body import Bodies, media_type
from rbfrag.service.documents import RockmassAnswer
from rbfrag.service.json_body import answer
from rbfrag.service.operation import (
    LEVEL,
    MEASURES,
    MODEL,
    Parameter,
    by_name,
    measures_in,
    operation,
    own_router,
    read_query,
)
from rbfrag.service.problem import RequestRefusedError
from rbfrag.service.settings import Settings
from rbfrag.service.work import WorkerPool

PARAMETERS = by_name(
    (
        Parameter(
            "n",
            "integer",
            "Number of realisations. Default: that of the body, else 20000.",
            None,
            {"minimum": 1},
        ),
        Parameter(
            "seed",
            "integer",
            "Seed of the random numbers. Default: that of the body, else 1.",
            None,
            {"minimum": 0},
        ),
        *MEASURES,
        MODEL,
        LEVEL,
    )
)

EXAMPLE = {
    "realisations": 2000,
    "seed": 1,
    "base": {
        "dip_deg": {"distribution": "normal", "mean": 20.0, "sd": 5.0},
        "spacing_m": {"distribution": "lognormal", "median": 1.0, "sd_ln": 0.1, "low": 0.5},
    },
    "back": {"dip_deg": {"distribution": "normal", "mean": 70.0, "sd": 5.0}, "spacing_m": 0.6},
    "friction": {"phi_deg": 40.0},
}

EXAMPLE_TOML = """\
realisations = 2000
seed = 1

[base]
dip_deg = { distribution = "normal", mean = 20.0, sd = 5.0 }
spacing_m = { distribution = "lognormal", median = 1.0, sd_ln = 0.1, low = 0.5 }

[back]
dip_deg = { distribution = "normal", mean = 70.0, sd = 5.0 }
spacing_m = 0.6

[friction]
phi_deg = 40.0
"""

_FORMS: dict[str, Literal["toml", "json", "csv"]] = {
    "application/json": "json",
    "application/toml": "toml",
    "text/plain": "toml",
    "text/csv": "csv",
}


def router(settings: Settings, bodies: Bodies, pool: WorkerPool) -> APIRouter:
    """Return the operation on `/v1/rockmass`."""
    routes = own_router()

    @routes.post(
        "/v1/rockmass",
        **operation(
            "Modes and yield accelerations of the blocks of a rock mass",
            RockmassAnswer,
            parameters=PARAMETERS,
            body={
                "application/json": {"schema": {"type": "object"}, "example": EXAMPLE},
                "application/toml": {"schema": {"type": "string"}, "example": EXAMPLE_TOML},
                "text/plain": {"schema": {"type": "string"}, "example": EXAMPLE_TOML},
                "text/csv": {"schema": {"type": "string"}},
            },
            description="What `rbfrag rockmass --json` prints for a rock mass file: TOML, its "
            "tables as JSON, or CSV. With a measure of the motion, the probability of failure "
            "by mode is in it.",
        ),
    )
    async def rockmass(request: Request) -> Response:
        asked = read_query(request.scope["query_string"], PARAMETERS)
        form = _FORMS.get(media_type(request))
        if form is None:
            raise RequestRefusedError(
                415,
                "media-type",
                f"a rock mass comes as {', '.join(_FORMS)}: say which by the header Content-Type",
            )
        async with bodies.read(request) as body:
            found = await pool.run(
                request,
                work.rock_mass,
                body,
                form,
                measures_in(asked),
                asked.get("n"),
                asked.get("seed"),
                asked.get("model"),
                asked.get("level"),
                settings.row_limit,
                settings.db,
            )
        return answer(found)

    return routes
