"""Operations on uploaded files: accelerograms, hazard curves and rock masses."""

from __future__ import annotations

import tomllib
from typing import Annotated

from fastapi import APIRouter, Query, Request

from rbfrag.service import work
from rbfrag.service.documents import CriticalAnswer, HazardDocument, RockmassAnswer, SpectrumAnswer
from rbfrag.service.parameters import CriticalQuery, HazardQuery, RockmassQuery, SpectrumQuery
from rbfrag.service.problem import SENT, RequestRefusedError
from rbfrag.service.reading import FILE_FORM, MULTIPART, media_type, sent_as, sent_file
from rbfrag.service.settings import ServiceSettings
from rbfrag.service.work import WorkerPool

CURVE = "pgv_m_s,annual_rate\n0.05,0.05\n0.1,0.02\n0.2,0.006\n0.5,0.0008\n1.0,0.0001\n"
"""A made-up hazard curve."""

ROCK_MASS_TOML = """\
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

ROCK_MASS = tomllib.loads(ROCK_MASS_TOML)

_TEXT = {"type": "string"}

_FORMS = {
    "application/json": "json",
    "application/toml": "toml",
    "text/plain": "toml",
    "text/csv": "csv",
}


_ACCELEROGRAM = sent_as(
    {
        "application/octet-stream": {
            "schema": {"type": "string", "format": "binary"},
            "example": work.EXAMPLE,
        },
        "text/plain": {"schema": _TEXT, "example": work.EXAMPLE},
        MULTIPART: FILE_FORM,
    }
)
"""An accelerogram in any format that rbfrag reads, as the body itself or as a form's one file."""


def add_routes(routes: APIRouter, settings: ServiceSettings, pool: WorkerPool) -> None:
    """Add the operations on files, which are processed by a pool."""

    @routes.post(
        "/v1/spectrum",
        summary="Toppling spectrum of an accelerogram",
        response_model=SpectrumAnswer | list[SpectrumAnswer],
        responses=SENT,
        openapi_extra=_ACCELEROGRAM,
    )
    async def spectrum(request: Request, query: Annotated[SpectrumQuery, Query()]) -> bytes:
        """Return what `rbfrag spectrum` prints as JSON: one object, or two in a list for both."""
        query.sizes()
        body = await sent_file(request)
        return await pool.run(request, work.spectrum, body, query)

    @routes.post(
        "/v1/critical",
        summary="Critical strength of an accelerogram",
        response_model=CriticalAnswer,
        responses=SENT,
        openapi_extra=_ACCELEROGRAM,
    )
    async def critical(request: Request, query: Annotated[CriticalQuery, Query()]) -> bytes:
        """Return what `rbfrag critical` prints as JSON.

        The certified search of a long record may need more time than one request is given.
        """
        body = await sent_file(request)
        return await pool.run(request, work.critical, body, query)

    @routes.post(
        "/v1/hazard",
        summary="Annual rate of failure of a block",
        response_model=HazardDocument,
        responses=SENT,
        openapi_extra=sent_as(
            {
                "text/csv": {"schema": _TEXT, "example": CURVE},
                "application/json": {"schema": {"type": "object"}},
                MULTIPART: FILE_FORM,
            }
        ),
    )
    async def hazard(request: Request, query: Annotated[HazardQuery, Query()]) -> bytes:
        """Return what `rbfrag hazard` prints as JSON for one block and the curve that is sent.

        A curve is OpenQuake CSV, USGS NSHM JSON, or CSV of two columns whose header names their
        units.
        """
        body = await sent_file(request)
        return await pool.run(request, work.hazard, body, query, settings.db)

    @routes.post(
        "/v1/rockmass",
        summary="Modes and yield accelerations of the blocks of a rock mass",
        response_model=RockmassAnswer,
        responses=SENT,
        openapi_extra=sent_as(
            {
                "application/json": {"schema": {"type": "object"}, "example": ROCK_MASS},
                "application/toml": {"schema": _TEXT, "example": ROCK_MASS_TOML},
                "text/plain": {"schema": _TEXT, "example": ROCK_MASS_TOML},
                "text/csv": {"schema": _TEXT},
            }
        ),
    )
    async def rockmass(request: Request, query: Annotated[RockmassQuery, Query()]) -> bytes:
        """Return what `rbfrag rockmass` prints as JSON for a rock mass file.

        It is TOML, its tables as JSON, or CSV. With a measure of the motion, the probability of
        failure by mode is in it.
        """
        form = _FORMS.get(media_type(request))
        if form is None:
            raise RequestRefusedError(
                415,
                "media-type",
                f"unsupported Content-Type of a rock mass: use {', '.join(_FORMS)}",
            )
        arguments = await request.body(), form, query, settings.row_limit, settings.db
        return await pool.run(request, work.rock_mass, *arguments)
