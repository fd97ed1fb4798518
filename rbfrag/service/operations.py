"""The operations on one block, on uploaded files, and on the vocabulary.

Uploaded files are accelerograms, hazard curves and rock masses. `rbfrag.service.predict` has the
operations on probabilities.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from typing import TYPE_CHECKING, Annotated, Any

from fastapi import APIRouter, Query, Request
from pydantic import BaseModel, Field

from rbfrag.errors import InputError
from rbfrag.fragility.describe import measures
from rbfrag.fragility.measures import TERMS
from rbfrag.service import work
from rbfrag.service.documents import (
    BlockAnswer,
    CriticalAnswer,
    DrawingAnswer,
    HazardDocument,
    RockmassAnswer,
    SpectrumAnswer,
)
from rbfrag.service.parameters import (
    BlockQuery,
    CriticalQuery,
    DrawingQuery,
    HazardQuery,
    RockmassQuery,
    SpectrumQuery,
)
from rbfrag.service.problem import READ, SENT, RequestRefusedError
from rbfrag.service.reading import FILE_FORM, MULTIPART, media_type, sent_as, sent_file
from rbfrag.service.settings import ServiceSettings
from rbfrag.service.work import WorkerPool
from rbfrag.vocabulary.quantities import GROUPS, INPUTS, OTHER_WORDS, parameter_of
from rbfrag.vocabulary.quantity import Limits, Quantity

if TYPE_CHECKING:
    from rbfrag.solver.block.geometry import Block
    from rbfrag.solver.stability.single import Stability

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


class RangeDocument(BaseModel):
    """Limits of a quantity; null for none."""

    above: float | None = Field(description="Lower limit, excluded")
    least: float | None = Field(description="Lower limit, included")
    below: float | None = Field(description="Upper limit, excluded")
    most: float | None = Field(description="Upper limit, included")


class QuantityDocument(BaseModel):
    """A quantity."""

    name: str = Field(description="Name in Python, JSON, tables and the database")
    parameters: list[str] = Field(description="Names in requests; empty where it is no input")
    label: str
    description: str = Field(description="Label with details")
    unit: str = Field(description="Unit; empty for a pure number or a text")
    symbol: str = Field(description="Symbol in formulas; empty for none")
    group: str
    range: RangeDocument
    imt: str = Field(description="Intensity measure type of OpenQuake; empty for none")
    axis: str = Field(description="Label of an axis without the unit; empty for none")


class TermDocument(BaseModel):
    """An intensity term: the measures that its models use."""

    name: str
    measures: list[str] = Field(description="Names of the measures")
    label: str = Field(description="The measures as people call them: PGV and SA(1 s)")


class VocabularyDocument(BaseModel):
    """Quantities in the order of the help, and intensity terms."""

    quantities: list[QuantityDocument]
    terms: list[TermDocument]


def add_routes(routes: APIRouter, settings: ServiceSettings, pool: WorkerPool) -> None:
    """Add the operations; files are processed by a pool."""

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
        ground that has them. A rectangle without phi is assumed to be rough enough to topple.
        """
        from rbfrag.plots.block import block_lines
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

    @routes.get(
        "/v1/vocabulary",
        summary="Names, labels, units and ranges of the quantities",
        response_model=VocabularyDocument,
    )
    async def vocabulary() -> Any:
        """Return the quantities and the intensity terms; this operation asks for no token."""
        return vocabulary_document()


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
        work.require(numbers, "p2", "kr")
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


@cache
def vocabulary_document() -> VocabularyDocument:
    """Return the quantities in the order of the help, and the intensity terms."""
    quantities = [_quantity(group, about) for group, members in GROUPS.items() for about in members]
    terms = [
        TermDocument(
            name=name,
            measures=[*term.inputs] or ["sa_g"],
            label=measures(term.inputs) if term.inputs else "SA(T)",
        )
        for name, term in TERMS.items()
    ]
    return VocabularyDocument(quantities=quantities, terms=terms)


def _quantity(group: str, about: Quantity) -> QuantityDocument:
    words = [word for word, name in OTHER_WORDS.items() if name == about.name]
    limits = {name: getattr(about.range, name) for name in Limits.__slots__}
    return QuantityDocument(
        name=about.name,
        parameters=[parameter_of(about.name), *words] if about.name in INPUTS else [],
        label=about.label,
        description=about.description(parameter_of),
        unit=about.unit,
        symbol=about.symbol,
        group=group,
        range=RangeDocument(**limits),
        imt=about.measure.imt if about.measure else "",
        axis=about.measure.axis.replace("$", "") if about.measure else "",
    )
