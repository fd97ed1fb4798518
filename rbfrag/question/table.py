"""Headers of tables: which column states which field, in which unit."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from functools import cache
from typing import NamedTuple

from rbfrag.errors import InputError
from rbfrag.question.fields import (
    RowFields,
    column_of,
    columns_declared,
    declared,
    names_of,
    word_of,
)

FACTORS = {
    "m": {"m": 1.0, "cm": 0.01, "mm": 0.001},
    "km": {"km": 1.0, "m": 0.001},
    "m/s": {"m/s": 1.0, "cm/s": 0.01, "mm/s": 0.001},
    "g": {
        "g": 1.0, "%g": 0.01, "m/s2": 1.0 / 9.80665, "cm/s2": 0.01 / 9.80665, "gal": 0.01 / 9.80665,
    },
    "deg": {"deg": 1.0, "°": 1.0, "degrees": 1.0},
    "1/s²": {"1/s2": 1.0, "s-2": 1.0, "rad2/s2": 1.0},
    "s": {"s": 1.0, "ms": 0.001},
    "MPa": {"mpa": 1.0},
    "": {"": 1.0, "-": 1.0, "g": 1.0, "%": 0.01},
}  # fmt: skip
"""By the unit of a field the units that a column may state, and what turns them into it."""

_IN_BRACKETS = re.compile(r"\s*[\[(]\s*([^\])]*?)\s*[\])]$")
_UNITS = {unit.replace("/", "[/_]") for units in FACTORS.values() for unit in units if unit}
_AT_THE_END = re.compile(rf"(.+?)[\s,_]+({'|'.join(sorted(_UNITS))})")
_SUPERSCRIPTS = str.maketrans({"²": "2", " ": None, "^": None})
_FEWEST_LETTERS = 6

LOUD = ("phi", "frict", "dip", "beta", "incl", "pg", "sa", "shak", "slope")
"""Beginnings of words that sound like friction, dip or shaking."""

WRITTEN = frozenset((
    "kind", "mode", "probability", "ci_low", "ci_high", "event_low", "event_high", "in_domain",
    "how", "reason", "block_sd", "model", "term", "method", "level", "years", "numerical_error",
    "site", "state", "yield_g", "kct", "azimuth_deg",
))  # fmt: skip
"""Columns of answers: nothing is said of them where they are not read again."""

ROWS_ABOVE = 20
"""So many rows are looked at for the names of the columns."""


class Column(NamedTuple):
    """A column that states a field.

    Args:
        header: what the table calls it.
        factor: what turns its numbers into the unit of the field.
    """

    header: str
    factor: float = 1.0


class Header(NamedTuple):
    """The columns of a table.

    Args:
        columns: those that are read, by the field that they state.
        remarks: which units are converted.
    """

    columns: dict[str, Column]
    remarks: tuple[str, ...]

    def unread(self, header: Sequence[str], read: Collection[str]) -> tuple[str, ...]:
        """Return what is to be said of columns that an answer does not read.

        Args:
            header: all columns of the table.
            read: the fields that it depends on, or hands on.
        """
        stated = {name: (field_of(name) or ("",))[0] for name in header if name not in WRITTEN}
        left = [n for n, own in stated.items() if own not in read and n[:11] != "annual_rate"]
        loud = [name for name in left if _sounds_like_input(name)]
        texts = []
        if loud:
            which = "it" if len(loud) == 1 else "them"
            texts.append(f"NOT READ: {_listed(loud)}: the answer does not depend on {which}")
        if quiet := [name for name in left if name not in loud]:
            texts.append(f"not read: {_listed(quiet)}")
        return tuple(texts)


def _listed(names: Sequence[str]) -> str:
    shown = ", ".join(names[:12])
    return f"{shown} and {len(names) - 12} more" if len(names) > 12 else shown


def _sounds_like_input(name: str) -> bool:
    words = re.split(r"[^a-zφβ]+", name.lower())
    return any(word.startswith(LOUD) or word in ("φ", "β") for word in words)


@cache
def _names() -> dict[str, str]:
    """Return the fields by all the names that a column may have."""
    by_name: dict[str, str] = {}
    for name in columns_declared():
        for each in (name, column_of(name), word_of(name), *declared()[name].others):
            by_name[each] = name
    return by_name


def header_of(name: str) -> str:
    """Return a name for the column of a field: what people call it, and its unit."""
    unit = declared()[name].unit
    return f"{word_of(name)} [{unit}]" if unit else word_of(name)


def field_of(header: str) -> tuple[str, str | None] | None:
    """Return the field that a column states and the unit that it names; None for no field."""
    exact = _names().get(header)
    if exact is not None:
        return exact, None
    text = header.strip().lower()
    name = _called(text)
    if name is not None:
        return name, None
    if bracket := _IN_BRACKETS.search(text):
        name = _called(text[: bracket.start()])
        return None if name is None else (name, bracket[1])
    if end := _AT_THE_END.fullmatch(text.replace("²", "2")):
        name, unit = _called(end[1]), end[2].replace("_", "/")
        if name is not None and declared()[name].unit and unit_factor(declared()[name].unit, unit):
            return name, unit
    return None


def _called(text: str) -> str | None:
    return _names().get(re.sub(r"[\s\-]+", "_", text.strip()))


def header_row(rows: Sequence[Sequence[object]]) -> int:
    """Return which of the first rows of a table holds the names of its columns.

    That is the first which is not empty; one that states no number is a title above the first that
    states two fields, or above the only one that states a number.
    """
    first = next((i for i, row in enumerate(rows) if any(map(_text, row))), 0)
    stated = [_fields_in(row) for row in rows]
    if not stated or _has_number(stated[first]):
        return first
    below = [
        i
        for i, fields in enumerate(stated)
        if _has_number(fields) and not any(map(_is_number, rows[i]))
    ]
    two = [i for i in below if len(stated[i]) > 1]
    return two[0] if two else below[0] if len(below) == 1 else first


def fields_stated(rows: Sequence[Sequence[object]]) -> int:
    """Return how many fields the names of the columns state; see :func:`header_row`."""
    return len(_fields_in(rows[header_row(rows)])) if rows else 0


def _fields_in(row: Sequence[object]) -> set[str]:
    stated = (field_of(cell) for cell in row if isinstance(cell, str) and cell.strip())
    return {each[0] for each in stated if each is not None}


def _has_number(fields: Collection[str]) -> bool:
    return any(not declared()[name].is_text for name in fields)


def _text(cell: object) -> str:
    return "" if cell is None else str(cell).strip()


def _is_number(cell: object) -> bool:
    try:
        float(_text(cell).replace(",", "."))
    except ValueError:
        return False
    return True


def columns_in(header: Sequence[str], source: object, read: Collection[str]) -> Header:
    """Return which columns of a table state which fields.

    Args:
        header: what the table calls its columns.
        source: the table, for messages.
        read: the fields that the answer may read, and other columns by their own names; what is
            wrong with others is no concern.

    Raises:
        InputError: two columns of one field, a unit that is none of the field's, or a name that
            misses a field's by one letter.
    """
    columns: dict[str, Column] = {}
    remarks = []
    for text in header:
        stated = field_of(text)
        if stated is None:
            if text in read:
                columns[text] = Column(text)
            else:
                _refuse_near_miss(text, source, read)
            continue
        name, unit = stated
        field = declared()[name]
        if name not in read:
            continue
        if field.is_text:  # of several names its own goes before the others
            if name not in columns or text == name:
                columns[name] = Column(text)
            continue
        if name in columns:
            other = columns[name].header
            twice = (
                f"the column {text} is there twice"
                if text == other
                else f"the columns {other} and {text} both state the {field.what}"
            )
            raise InputError(f"{source}: {twice}: leave one of them out")
        factor = 1.0 if unit is None else unit_factor(field.unit, unit)
        if factor is None and name in names_of(RowFields) and not field.unit:
            factor = 1.0  # losses are in any currency, weights of anything
        if factor is None:
            units = " or ".join(each or "no unit" for each in FACTORS.get(field.unit, ("",)))
            raise InputError(
                f"{source}: the column {text} is in {unit!r}, and the {field.what} is read in "
                f"{units}: convert it, or name another unit"
            )
        if factor != 1.0:
            remarks.append(f"the column {text} is converted from {unit} to {field.unit or '1'}")
        columns[name] = Column(text, factor)
    return Header(columns, tuple(remarks))


def unit_factor(unit: str, stated: str) -> float | None:
    """Return what turns numbers in a stated unit into one of :data:`FACTORS`; None if nothing."""
    own, word = (each.lower().translate(_SUPERSCRIPTS) for each in (unit, stated))
    return FACTORS.get(unit, {}).get(word, 1.0 if own and own == word else None)


def _refuse_near_miss(text: str, source: object, read: Collection[str]) -> None:
    """Refuse a header of six letters or more that misses a name by an edit, or by a swap."""
    bare = _IN_BRACKETS.sub("", text.strip().lower()).replace(" ", "_")
    end = _AT_THE_END.fullmatch(bare)
    if bare in WRITTEN or sum(map(str.isalpha, bare)) < _FEWEST_LETTERS:
        return
    for name, field in _names().items():
        if field in read and (_is_near(bare, name) or (end and _is_near(end[1], name))):
            raise InputError(
                f"{source}: the column {text[:60]!r} is no name of a field: did you mean {name}, "
                f"the {declared()[field].what}? Rename it"
            )


def _is_near(one: str, other: str) -> bool:
    """Return whether two texts differ by one edit, or by a swap of two neighbours."""
    if abs(len(one) - len(other)) > 1 or one == other:
        return False
    start = next((i for i, (a, b) in enumerate(zip(one, other, strict=False)) if a != b), None)
    if start is None:
        return True
    a, b = one[start:], other[start:]
    if len(one) == len(other):
        return a[1:] == b[1:] or (a[:2] == b[1::-1] and a[2:] == b[2:])
    return a[1:] == b if len(one) > len(other) else a == b[1:]
