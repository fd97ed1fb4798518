"""Keywords of functions about blocks, by any of their names."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from rbfrag.errors import InputError, UnknownFieldError
from rbfrag.fragility.model_selection import find_model
from rbfrag.solver.kinds import FREE_STANDING
from rbfrag.vocabulary.quantities import INVERSE, MEASURED, ONLY_PREDICT
from rbfrag.vocabulary.spectral import BY_PERIOD, input_of, spectral_inputs

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
    for name in BY_PERIOD:
        if name in inputs:
            inputs |= spectral_inputs(name, inputs.pop(name))
    return [{n: v for n, v in inputs.items() if input_of(n) in part} for part in parts]


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


def reject_inverse(names: Collection[str]) -> None:
    """Reject the search for a probability where there are many blocks."""
    if fields := tuple(name for name in INVERSE if name in names):
        raise InputError(f"{fields[0]} is for a single block: omit it", fields=fields)


def by_field_name(question: Mapping[str, Any], fields: Collection[str]) -> dict[str, Any]:
    """Translate keywords, option names and column names to field names.

    Args:
        question: values by keyword, option word or name of a column.
        fields: fields that the answer takes.

    Raises:
        UnknownFieldError: a name of no such field, with the one that may be meant.
        InputError: one field by two names.
    """
    from rbfrag.question.table import field_of

    result: dict[str, Any] = {}
    names: dict[str, str] = {}
    for name, value in question.items():
        field = name
        if name not in fields:
            match = field_of(name)
            if match is None or input_of(match.field) not in fields or match.unit is not None:
                raise unknown_field(name, fields)
            field = match.field
            if match.column == "no_back" and value is not None:
                value = not value
            elif match.column == "free_standing":
                value = FREE_STANDING if value else None
        if field in result:
            both = (names[field], name)
            raise InputError(f"{name} and {names[field]} are the same field: give one", fields=both)
        result[field], names[field] = value, name
    return result


def unknown_field(name: str, fields: Collection[str]) -> UnknownFieldError:
    """Return the error for a name that is not a field, with a suggestion."""
    from difflib import get_close_matches

    from rbfrag.question.table import field_of

    match = field_of(name)
    if (match.field if match else name) in MEASURED:
        return UnknownFieldError(ONLY_PREDICT.format(name))
    near = [match.field] if match else get_close_matches(name, fields, 1)
    near = [field for field in near if field in fields]
    hint = f"; did you mean {near[0]!r}?" if near else "; see help(rbfrag.predict)"
    return UnknownFieldError(f"unknown field {name[:60]!r}{hint}")
