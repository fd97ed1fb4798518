"""`/v1/vocabulary`: names, labels, units and ranges of all quantities, and the intensity terms."""

from __future__ import annotations

from functools import cache
from typing import Any

from fastapi import APIRouter
from pydantic import BaseModel, Field

from rbfrag.fragility.describe import measures
from rbfrag.fragility.measures import TERMS
from rbfrag.vocabulary.quantities import (
    GROUPS,
    INPUTS,
    OTHER_WORDS,
    Limits,
    Quantity,
    parameter_of,
)


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


def add_routes(routes: APIRouter) -> None:
    """Add the operation."""

    @routes.get(
        "/v1/vocabulary",
        summary="Names, labels, units and ranges of the quantities",
        response_model=VocabularyDocument,
    )
    async def vocabulary() -> Any:
        """Return the quantities and the intensity terms; this operation asks for no token."""
        return _document()


@cache
def _document() -> VocabularyDocument:
    quantities = [_quantity(group, about) for group, members in GROUPS.items() for about in members]
    terms = [
        TermDocument(name=name, measures=[*term.inputs], label=measures(term.inputs))
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
