"""Headers of tables: which column states which field, in which unit."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from functools import cache
from typing import NamedTuple

from rbfrag.errors import InputError
from rbfrag.question.fields import column_of, columns_declared, declared

FACTORS = {
    "m": {"m": 1.0, "cm": 0.01, "mm": 0.001},
    "m/s": {"m/s": 1.0, "cm/s": 0.01, "mm/s": 0.001},
    "g": {"g": 1.0, "%g": 0.01, "m/s2": 1.0 / 9.80665, "cm/s2": 0.01 / 9.80665},
    "deg": {"deg": 1.0, "°": 1.0, "degrees": 1.0},
    "1/s²": {"1/s2": 1.0, "s-2": 1.0, "rad2/s2": 1.0},
    "s": {"s": 1.0, "ms": 0.001},
    "": {"": 1.0, "-": 1.0, "g": 1.0, "%": 0.01},
}
"""By the unit of a field the units that a column may state, and what turns them into it."""

_IN_BRACKETS = re.compile(r"\s*[\[(]\s*([^\])]*?)\s*[\])]\s*$")
_SUPERSCRIPTS = str.maketrans({"²": "2", " ": None, "^": None})
_FEWEST_LETTERS = 6

LOUD = ("phi", "frict", "dip", "beta", "incl", "pg", "sa", "shak", "slope")
"""Beginnings of words that sound like friction, dip or shaking."""


WRITTEN = ("block_sd",)
"""Columns of answers that miss a field's name by a letter and are none; they may be read again."""


class Column(NamedTuple):
    """A column that states a field.

    Args:
        header: what the table calls it.
        factor: what turns its numbers into the unit of the field.
    """

    header: str
    factor: float


class Header(NamedTuple):
    """The columns of a table.

    Args:
        columns: those that state a field, by what written tables call it.
        remarks: which units are converted.
    """

    columns: dict[str, Column]
    remarks: tuple[str, ...]

    def unread(self, header: Sequence[str], read: Collection[str]) -> tuple[str, ...]:
        """Return what is to be said of columns that an answer does not read.

        Args:
            header: all columns of the table.
            read: those that are read or written, by what written tables call them.
        """
        used = {self.columns[name].header for name in read if name in self.columns} | {*read}
        left = [name for name in header if name.strip() and name not in used]
        loud = [name for name in left if _sounds_like_input(name)]
        texts = []
        if loud:
            texts.append(
                f"NOT READ: {_listed(loud)}: the answer does not depend on "
                f"{'this column' if len(loud) == 1 else 'these columns'}"
            )
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
        for each in (name, column_of(name), *declared()[name].others):
            by_name[each] = name
    return by_name


def field_of(header: str) -> tuple[str, str | None] | None:
    """Return the field that a column states and the unit that it names; None for no field."""
    exact = _names().get(header)
    if exact is not None:
        return exact, None
    text = header.strip()
    for bare, unit in ((text, None), *_without_unit(text)):
        word = re.sub(r"[\s\-]+", "_", bare.lower())
        name = _names().get(word)
        if name is not None:
            return name, unit
    return None


def _without_unit(text: str) -> list[tuple[str, str | None]]:
    bracket = _IN_BRACKETS.search(text)
    return [] if bracket is None else [(text[: bracket.start()], bracket[1])]


class Numeric:
    """The columns that hold numbers, whatever a table calls them.

    Args:
        columns: what written tables call them.
    """

    def __init__(self, columns: Collection[str]) -> None:
        self._columns = frozenset(columns)

    def __contains__(self, header: object) -> bool:
        if header in self._columns:
            return True
        stated = field_of(str(header))
        return stated is not None and column_of(stated[0]) in self._columns


def columns_in(header: Sequence[str], source: object, read: Collection[str]) -> Header:
    """Return which columns of a table state which fields.

    Args:
        header: what the table calls its columns.
        source: the table, for messages.
        read: the columns that the answer may read, by what written tables call them; what is
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
            _refuse_near_miss(text, source, read)
            continue
        name, unit = stated
        column, field = column_of(name), declared()[name]
        if column not in read:
            continue
        if column in columns and field.is_text:  # of several names its own goes before the others
            if text in (name, column):
                columns[column] = Column(text, 1.0)
            continue
        if column in columns:
            other = columns[column].header
            twice = (
                f"the column {text} is there twice"
                if text == other
                else (f"the columns {other} and {text} both state the {field.what}")
            )
            raise InputError(f"{source}: {twice}: leave one of them out")
        factor = 1.0 if unit is None else _factor(field.unit, unit)
        if factor is None:
            raise InputError(
                f"{source}: the column {text} is in {unit!r}, and the {field.what} is read in "
                f"{' or '.join(_units(field.unit))}: convert it, or name another unit"
            )
        if factor != 1.0:
            remarks.append(f"the column {text} is converted from {unit} to {field.unit or '1'}")
        columns[column] = Column(text, factor)
    return Header(columns, tuple(remarks))


def _units(unit: str) -> list[str]:
    return [each or "no unit" for each in FACTORS[unit]]


def _factor(unit: str, stated: str) -> float | None:
    word = stated.lower().translate(_SUPERSCRIPTS).replace("[", "").replace("]", "")
    return FACTORS.get(unit, {}).get(word)


def _refuse_near_miss(text: str, source: object, read: Collection[str]) -> None:
    """Refuse a header of six letters or more that misses a name by an edit, or by a swap."""
    bare = _IN_BRACKETS.sub("", text.strip()).lower().replace(" ", "_")
    if bare in WRITTEN or sum(map(str.isalpha, bare)) < _FEWEST_LETTERS:
        return
    for name, field in _names().items():
        if column_of(field) in read and _is_near(bare, name):
            raise InputError(
                f"{source}: the column {text[:60]} is no name of a field: did you mean {name}, "
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
