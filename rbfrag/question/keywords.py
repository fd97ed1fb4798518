"""Keywords that functions about blocks share: block inputs, model and confidence level."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from rbfrag.errors import InputError
from rbfrag.fragility.model_selection import find_model
from rbfrag.question.question import by_field_name

if TYPE_CHECKING:
    from rbfrag.fragility.model import FragilityModel
    from rbfrag.question.fields import AnsweringFields

LEVEL = 0.95
"""Confidence level where none is asked for."""


def parts_of(
    numbers: Sequence[Any], keywords: Mapping[str, Any], *parts: Collection[str]
) -> list[Any]:
    """Split keywords into the parts they belong to, without those that are None.

    Args:
        numbers: what is given without a name: p2 and kr.
        keywords: what is given by name.
        parts: names of keywords.

    Raises:
        InputError: p2 or kr is given twice, or there are more numbers than these.
        UnknownFieldError: a keyword of no part.
    """
    fields = {name for part in parts for name in part}
    if not keywords.keys() <= fields:
        keywords = by_field_name(keywords, fields)
    first = dict(zip(("p2", "kr"), numbers, strict=False))
    if len(numbers) > len(first) or not first.keys().isdisjoint(keywords):
        raise InputError("p2 and kr are given twice, by position and by name: give each once")
    inputs = {name: value for name, value in {**first, **keywords}.items() if value is not None}
    return [{n: v for n, v in inputs.items() if n in part} for part in parts]


def model_for(
    answering: AnsweringFields, names: Sequence[str], kind: str | None = None
) -> FragilityModel:
    """Return the model for the given inputs; see :func:`find_model`.

    Args:
        answering: which model.
        names: names of what is known of block and motion.
        kind: how the block fails.
    """
    return find_model(answering.get("model"), names, answering.get("db"), kind=kind)
