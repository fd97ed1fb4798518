"""`/v1/spectrum` and `/v1/critical`: what an accelerogram that is sent can topple."""

from __future__ import annotations

from dataclasses import replace

from fastapi import APIRouter, Request, Response

from rbfrag.errors import InputError
from rbfrag.service import work
from rbfrag.service.body import FILE_FORM, MULTIPART, Bodies
from rbfrag.service.documents import CriticalAnswer, SpectrumAnswer
from rbfrag.service.json_body import answer
from rbfrag.service.operation import P2, Parameter, by_name, operation, own_router, read_query
from rbfrag.service.work import WorkerPool

MOST_SIZES = 100
"""Most values of p² in one request for a spectrum."""

_READING = (
    Parameter(
        "trace", "integer", "Number of the trace in the file, from 0; where there are several.",
        None, {"minimum": 0},
    ),
    Parameter(
        "units", "string",
        "Unit of acceleration of a text file that does not state it.",
        None, {"enum": ["g", "m/s2", "cm/s2", "mm/s2"]},
    ),
    Parameter(
        "dt", "number", "Sampling interval [s] of a text file that holds accelerations only.",
        None, {"exclusiveMinimum": 0},
    ),
)  # fmt: skip

SPECTRUM = by_name(
    (
        Parameter(
            "p2",
            "numbers",
            "Frequency parameters p² [1/s²], separated by commas.",
            None,
            {"default": "30,10,3,1,0.3,0.1"},
        ),
        Parameter(
            "polarity",
            "string",
            "forward: positive samples drive forward; reverse: negative ones; both.",
            None,
            {"enum": ["forward", "reverse", "both"], "default": "forward"},
        ),
        *_READING,
    )
)

CRITICAL = by_name(
    (
        replace(P2, words="Frequency parameter p² of the block [1/s²]."),
        Parameter("reverse", "boolean", "Positive samples drive backward: k_h(t) = -a(t)."),
        Parameter(
            "linear",
            "boolean",
            "Linear model, for verification against closed forms only.",
        ),
        Parameter(
            "map",
            "boolean",
            "Map the toppling and safe intervals of k_r/PGA down to 0.01, borders to 1e-4.",
        ),
        *_READING,
    )
)

ACCELEROGRAM = {
    "application/octet-stream": {
        "schema": {"type": "string", "format": "binary"},
        "example": work.EXAMPLE,
    },
    "text/plain": {"schema": {"type": "string"}, "example": work.EXAMPLE},
    MULTIPART: FILE_FORM,
}
"""An accelerogram in any format that rbfrag reads, as the body itself or as a form's one file."""


def router(bodies: Bodies, pool: WorkerPool) -> APIRouter:
    """Return the operations on accelerograms."""
    routes = own_router()

    @routes.post(
        "/v1/spectrum",
        **operation(
            "Toppling spectrum of an accelerogram",
            SpectrumAnswer | list[SpectrumAnswer],
            parameters=SPECTRUM,
            body=ACCELEROGRAM,
            description="What `rbfrag spectrum --json` prints: an object for one polarity, a list "
            "of two for both.",
        ),
    )
    async def spectrum(request: Request) -> Response:
        asked = read_query(request.scope["query_string"], SPECTRUM)
        sizes = asked.get("p2", [30.0, 10.0, 3.0, 1.0, 0.3, 0.1])
        if len(sizes) > MOST_SIZES:
            raise InputError(f"p2 has {len(sizes)} values; one request may ask for {MOST_SIZES}")
        async with bodies.read(request) as body:
            found = await pool.run(
                request,
                work.spectrum,
                body,
                asked.get("trace"),
                asked.get("units"),
                asked.get("dt"),
                sizes,
                asked.get("polarity", "forward"),
            )
        return answer(found)

    @routes.post(
        "/v1/critical",
        **operation(
            "The strongest block that an accelerogram topples",
            CriticalAnswer,
            parameters=CRITICAL,
            body=ACCELEROGRAM,
            description="What `rbfrag critical --json` prints. The certified search of a long "
            "record may need more time than the service gives one request.",
        ),
    )
    async def critical(request: Request) -> Response:
        asked = read_query(request.scope["query_string"], CRITICAL)
        async with bodies.read(request) as body:
            found = await pool.run(
                request,
                work.critical,
                body,
                asked.get("trace"),
                asked.get("units"),
                asked.get("dt"),
                asked["p2"],
                asked.get("reverse", False),
                asked.get("linear", False),
                asked.get("map", False),
            )
        return answer(found)

    return routes
