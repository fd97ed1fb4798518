"""Headers and cells of tables: the field and unit of each column.

Names in five languages stand in :mod:`rbfrag.vocabulary.headers`. A column that is not understood
is named as ignored; one that sounds like an input that would change the answer is rejected.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Collection, Iterator, Mapping, Sequence
from functools import cache
from typing import NamedTuple

from rbfrag.errors import InputError
from rbfrag.files import is_numeral
from rbfrag.results.diagnostic import Diagnostic
from rbfrag.solver.kinds import KINDS
from rbfrag.solver.stability.joint import DRAINED, UNDRAINED
from rbfrag.vocabulary import headers
from rbfrag.vocabulary.quantities import (
    COLUMNS,
    INPUTS,
    INTENSITY,
    MEASURED,
    ONLY_PREDICT,
    QUANTITIES,
    column_of,
    word_of,
)
from rbfrag.vocabulary.spectral import (
    BY_PERIOD,
    LONGEST_S,
    SHORTEST_S,
    input_of,
    period_of,
    spectral_name,
)

_SPECTRAL = re.compile(r"sa\s*\(\s*(\d*[.,]?\d+|\d+[.,])\s*s?\s*\)(_sigma)?")
"""A spectral acceleration by its period, "sa(0.5)", or the standard deviation of its logarithm."""
_LIKE_SPECTRAL = re.compile(r"p?sa\s*[\s_(]?\s*\d.*")

_PRESSURES = {"pa": 1.0, "kpa": 1e3, "mpa": 1e6, "n/m2": 1.0, "kn/m2": 1e3, "mn/m2": 1e6}

FACTORS = {
    "m": {"m": 1.0, "cm": 0.01, "mm": 0.001},
    "km": {"km": 1.0, "m": 0.001},
    "m/s": {"m/s": 1.0, "cm/s": 0.01, "cms": 0.01, "mm/s": 0.001},
    "g": {
        "g": 1.0, "%g": 0.01, "m/s2": 1.0 / 9.80665, "cm/s2": 0.01 / 9.80665, "gal": 0.01 / 9.80665,
    },
    "deg": {"deg": 1.0, "°": 1.0, "degrees": 1.0, "grad": 1.0, "rad": 57.29577951308232},
    "1/s²": {"1/s2": 1.0, "s-2": 1.0, "rad2/s2": 1.0},
    "s": {"s": 1.0, "ms": 0.001},
    "Pa": _PRESSURES,
    "MPa": {unit: factor / 1e6 for unit, factor in _PRESSURES.items()},
    "kg/m³": {
        "kg/m3": 1.0, "g/cm3": 1e3, "t/m3": 1e3, "kn/m3": 1e3 / 9.80665, "n/m3": 1.0 / 9.80665,
    },
    "": {"": 1.0, "-": 1.0, "g": 1.0, "%": 0.01},
}  # fmt: skip
"""By the unit of a field the units of a column or a value, and the factor into the field's unit."""

_IN_BRACKETS = re.compile(r"\s*[\[(]\s*([^\])]*?)\s*[\])]\s*\??$")
_UNITS = {unit.replace("/", "[/_]") for units in FACTORS.values() for unit in units if unit}
_AT_THE_END = re.compile(rf"(.+?)[\s,_]+({'|'.join(sorted(_UNITS))})")
_SUPERSCRIPTS = str.maketrans({"²": "2", "³": "3", " ": None, "^": None})
_NUMBER = re.compile(r"([+\-−]?(?:\d+(?:[.,]\d*)?|[.,]\d+)(?:[eE][+-]?\d+)?)\s*(.*)", re.DOTALL)
_THOUSANDS = re.compile(r"[+-]?[1-9]\d{0,2},\d{3}")
_FEWEST_LETTERS = 5

WRITTEN = frozenset((
    "kind", "mode", "probability", "ci_low", "ci_high", "event_low", "event_high", "in_domain",
    "how", "warnings", "reason", "block_sd", "model", "term", "method", "level", "years",
    "numerical_error", "site", "state", "yield_g", "kct", "azimuth_deg", "kr_forward",
    "kr_backward", "p2_forward_1_s2", "p2_backward_1_s2", "restitution_forward",
    "restitution_backward",
))  # fmt: skip
"""Columns of answers, which a table that is read again has as well."""

INSTEAD_OF = {
    "beta_deg": ("base", "kr", "ks", "kct"),
    "phi_deg": ("kr", "ky", "ks", "kct"),
    "kind": ("free_standing", "ky", "ks", "kct"),
    "back_fracture": ("kind", "free_standing", "back"),
    "height_m": ("kr", "ky", "ks", "kct", "alpha1_deg", "s1_m"),
    "width_m": ("kr", "ky", "ks", "kct", "alpha1_deg", "s1_m"),
    "s1_m": ("kr", "ky", "ks", "kct", "height_m", "alpha1_deg"),
    "pgv_m_s": (*INTENSITY, "rjb_km"),
}
"""By a field that a column sounds like the fields that may take its place."""

CARRIED = ("lon", "lat", "x", "y", "z", "crs")
"""Fields of where a block is, which are handed on where that does not matter."""

MULTIPLIERS = ("count", "weight", "component")
"""Fields of a column that an answer uses or rejects, and never ignores."""

ROWS_ABOVE = 20
"""So many rows are looked at for the names of the columns."""


class Column(NamedTuple):
    """A column that is a field.

    Args:
        header: what the table calls it.
        factor: what turns its numbers into the unit of the field.
        inverse: whether it says the contrary, as "no back" does.
    """

    header: str
    factor: float = 1.0
    inverse: bool = False


class HeaderMatch(NamedTuple):
    """The field that a header names.

    Args:
        field: the field.
        unit: the unit that the header names; None for none.
        column: ``free_standing`` and ``no_back`` for yes-or-no columns of kind and back fracture,
            else the field.
    """

    field: str
    unit: str | None
    column: str


@cache
def _names() -> dict[str, str]:
    """Return the fields by all accepted names of their columns."""
    by_name: dict[str, str] = {}
    for name in COLUMNS:
        for alias in (name, column_of(name), word_of(name), *INPUTS[name].aliases):
            by_name[alias] = name
    return by_name


_KINDS = headers.KINDS | {kind.replace("_", " "): kind for kind in KINDS}


def normalized_words(text: str) -> list[str]:
    """Return the words of a text without case, accents and punctuation."""
    letters = unicodedata.normalize("NFD", text.casefold().replace("ϕ", "φ"))
    bare = "".join(c for c in letters if not unicodedata.combining(c))
    return re.sub(r"[\W_]+", " ", bare).split()


def header_of(name: str) -> str:
    """Return a readable column header for a field: its name and unit."""
    unit = QUANTITIES[name].unit
    return f"{word_of(name)} [{unit}]" if unit else word_of(name)


def field_of(header: str) -> HeaderMatch | None:
    """Return the field that a header names; None for an unknown header."""
    if (exact := _names().get(header)) is not None:
        return HeaderMatch(exact, None, "no_back" if header == "no_back" else exact)
    text = header.strip().lower()
    if (name := _names().get(_as_name(text)) or _spectral_named(text)) is not None:
        return HeaderMatch(name, None, name)
    if bracket := _IN_BRACKETS.search(text):
        return _called(text[: bracket.start()], bracket[1])
    if (match := _called(text)) is not None:
        return match
    if end := _AT_THE_END.fullmatch(text.translate({ord("²"): "2", ord("³"): "3"})):
        match, unit = _called(end[1]), end[2].replace("_", "/")
        if match is not None and unit_factor(QUANTITIES[match.field].unit, unit):
            return match._replace(unit=unit)
    return None


def _as_name(text: str) -> str:
    return re.sub(r"[\s\-]+", "_", text.strip())


def _spectral_named(text: str) -> str | None:
    """Return the spectral acceleration, or its standard deviation, that a text names."""
    match = _SPECTRAL.fullmatch(text.strip())
    if match is None:
        return None
    name = spectral_name(float(match[1].replace(",", ".")))
    return None if period_of(name) is None else name + (match[2] or "")


def _called(text: str, unit: str | None = None) -> HeaderMatch | None:
    """Return the field of a header, without its unit."""
    name = _names().get(_as_name(text)) or _spectral_named(text)
    if name is not None:
        return HeaderMatch(name, unit, "no_back" if text == "no_back" else name)
    words = normalized_words(text)
    column = headers.PHRASES.get(" ".join(words))
    default = None
    if column is None:
        meaning: set[str] = set()
        for word in words:
            if (concepts := headers.CONCEPTS.get(word)) is None:
                return None
            meaning.update(concepts)
        for pattern in headers.PATTERNS:
            if pattern[1] <= meaning <= pattern[2]:
                column, _, _, default = pattern
                break
        else:
            return None
        if words == ["c"] and not (unit and unit_factor("Pa", unit)):
            return None  # one letter names a cohesion only with its unit
        assert column is not None
        if column == "back" and text.rstrip().endswith("?"):
            column = "back_fracture"
        elif column == "back_fracture" and unit and "/" in unit:
            column = "back"  # dip/dip direction
    field = {"free_standing": "kind", "no_back": "back_fracture"}.get(column, column)
    return HeaderMatch(field, unit or default, column)


def yes_or_no(text: str) -> bool | None:
    """Return whether a cell means yes; None if it means neither yes nor no."""
    return headers.ANSWERS.get(" ".join(normalized_words(text)))


def drainage_named(text: str) -> str:
    """Return the drainage named by a cell in any of five languages; yes means drained.

    What names none is returned as it is.
    """
    word = " ".join(normalized_words(text))
    answer = yes_or_no(text)
    named = headers.DRAINAGES.get(word, text)
    return named if answer is None else DRAINED if answer else UNDRAINED


def kinds_in(cells: Sequence[str], header: str, source: object) -> list[str] | None:
    """Return the kinds named by the cells of a column; None if no cell names one.

    Raises:
        InputError: some words name a kind and some do not, or one is misspelled.
    """
    words = (cell for cell in dict.fromkeys(cells) if cell.strip())
    by_word = {cell: _KINDS.get(" ".join(normalized_words(cell))) for cell in words}
    rest = [word for word, kind in by_word.items() if kind is None]
    near = next((w for w in rest for k in _KINDS if _is_near(w.lower(), k)), None)
    if near is not None or (rest and len(rest) < len(by_word)):
        raise InputError(
            f"{source}: column {header!r}: {near or rest[0]!r:.42} is not a kind of failure; use "
            f"{', '.join(KINDS)}, or leave the cell empty"
        )
    return None if rest else [by_word.get(cell) or "" for cell in cells]


def number_with_unit(text: str, unit: str, *, commas: bool = True) -> float | None:
    """Return the number in a text with a unit ("40cm/s", "5°", "2,6"); None if there is none.

    Args:
        text: a number, perhaps with its unit behind it.
        unit: the unit of the field.
        commas: whether a comma may stand before the decimals.
    """
    match = _NUMBER.fullmatch(text.strip())
    if match is None or ("," in match[1] and (not commas or _THOUSANDS.fullmatch(match[1]))):
        return None
    factor = 1.0 if not match[2] else unit_factor(unit, match[2])
    number = float(match[1].replace(",", ".").replace("−", "-"))
    return None if factor is None else number * factor


def header_row(rows: Sequence[Sequence[object]]) -> int:
    """Return the index of the row with the column names of a table.

    That is the first which is not empty; one without a field that is a number is a title above the
    first row that names two fields, or above the only one that names a number.
    """
    first = next((i for i, row in enumerate(rows) if any(map(_text, row))), 0)
    row_fields = [_fields_in(row) for row in rows]
    if not row_fields or _has_number(row_fields[first]):
        return first
    below = [
        i
        for i, fields in enumerate(row_fields)
        if _has_number(fields)
        and not any(is_numeral(_text(cell).replace(",", ".")) for cell in rows[i])
    ]
    two = [i for i in below if len(row_fields[i]) > 1]
    return two[0] if two else below[0] if len(below) == 1 else first


def fields_stated(rows: Sequence[Sequence[object]]) -> int:
    """Return the number of fields that column names match; see :func:`header_row`."""
    return len(_fields_in(rows[header_row(rows)])) if rows else 0


def _fields_in(row: Sequence[object]) -> set[str]:
    matches = (field_of(cell) for cell in row if isinstance(cell, str) and cell.strip())
    return {match.field for match in matches if match is not None}


def _has_number(fields: Collection[str]) -> bool:
    return any(INPUTS[name].type is not str for name in fields)


def _text(cell: object) -> str:
    return "" if cell is None else str(cell).strip()


class Header(NamedTuple):
    """The columns of a table.

    Args:
        columns: those that are used, by their field, or ``free_standing``.
        unknown: headers that name no field.
        unused: headers of other fields, and these fields.
        warnings: which units are converted.
    """

    columns: dict[str, Column]
    unknown: tuple[str, ...]
    unused: Mapping[str, str]
    warnings: tuple[Diagnostic, ...]

    def ignored(self, header: Sequence[str], used: Collection[str]) -> Iterator[Diagnostic]:
        """Yield the warning that names the ignored columns.

        Args:
            header: all columns of the table.
            used: the fields that it depends on, or hands on.
        """
        headers = {column.header for name, column in self.columns.items() if input_of(name) in used}
        carried = {text for text, field in self.unused.items() if field in CARRIED}
        names = [name for name in header if name not in headers | carried]
        earlier = [name for name in names if name in WRITTEN or name.startswith("annual_rate")]
        unused = [name for name in names if name not in earlier]
        for names, text in ((unused, "ignored"), (earlier, "of an earlier answer ignored")):
            if names:
                word = "column" if len(names) == 1 else "columns"
                yield Diagnostic(f"{word} {text}: {', '.join(names)}", "ignored_columns")

    def check_unused(self, source: object, present: Collection[str]) -> None:
        """Reject an unused column that would change the answer.

        That is one that is not understood and sounds like an input, and one that multiplies
        what is counted.

        Args:
            source: the table, for messages.
            present: the fields of the table, and those that are given for all rows.

        Raises:
            InputError: the first such column, with the field that may be meant.
        """
        for text, multiplier in self.unused.items():
            if multiplier in MEASURED:
                raise InputError(f"{source}: {ONLY_PREDICT.format(text)}")
            if multiplier in MULTIPLIERS:
                raise InputError(
                    f"{source}: the column {text!r} is not used by this answer: remove it, or use "
                    f"ignore_columns {text!r}",
                    fields=("ignore_columns",),
                )
        for text in self.unknown:
            field = sounds_like(text)
            fields = {field, *INSTEAD_OF.get(field or "", ())}
            if field is None or not fields.isdisjoint(map(input_of, present)):
                continue
            noun = "back fracture" if field == "back_fracture" else QUANTITIES[field].noun
            raise InputError(
                f"{source}: the column {text[:60]!r} is unknown; for the {noun} use "
                f"{column_of(field)!r}, else use ignore_columns {text[:60]!r}",
                fields=("ignore_columns",),
            )


def sounds_like(header: str) -> str | None:
    """Return the field that an unknown header probably means, if it would change the answer."""
    words = normalized_words(header)
    if any(word.startswith(headers.REMARKS) for word in words):
        return None
    for word in words:
        for stem, field in headers.STEMS:
            if word == stem[:-1] if stem[-1] == "=" else word.startswith(stem):
                return field
    return None


def columns_in(
    header: Sequence[str],
    source: object,
    read: Collection[str],
    ignore_columns: Collection[str] = (),
) -> Header:
    """Return the field of each column of a table.

    Args:
        header: what the table calls its columns.
        source: the table, for messages.
        read: the fields that the answer may use, and other columns by their own names; what is
            wrong with others is no concern.
        ignore_columns: columns that the caller wants to be ignored.

    Raises:
        InputError: two columns of one field, a unit that does not belong to the field, a name that
            misses a field's by one letter, or a column to be ignored that the table does not have.
    """
    for text in ignore_columns:
        if text not in header:
            have = ", ".join(header)
            raise InputError(f"{source}: unknown column {text!r} to ignore; the columns are {have}")
    columns: dict[str, Column] = {}
    unknown, warnings = [], []
    unused: dict[str, str] = {}
    for text in header:
        match = None if text in ignore_columns else field_of(text)
        if text in ignore_columns:
            continue
        if match is None or match.field in BY_PERIOD:
            if text in read:
                columns[text] = Column(text)
            else:
                _reject_near_miss(text, source, read)
                unknown += [] if text in WRITTEN else [text]
            continue
        name, unit, column = match
        field = QUANTITIES[name]
        if input_of(name) not in read:
            unused[text] = name
            continue
        key = "free_standing" if column == "free_standing" else name
        if INPUTS[name].type is str or name == "back_fracture":
            # of several names its own goes before the others
            if key not in columns or text == name:
                columns[key] = Column(text, inverse=column == "no_back")
            continue
        if name in columns:
            other = columns[name].header
            twice = (
                f"the column {text} occurs twice"
                if text == other
                else f"the columns {other} and {text} are both the {field.noun}"
            )
            raise InputError(f"{source}: {twice}: remove one of them")
        factor = 1.0 if unit is None else unit_factor(field.unit, unit)
        if factor is None and name in ("loss", "weight"):
            factor = 1.0  # losses are in any currency, weights of anything
        if factor is None:
            units = " or ".join(word or "no unit" for word in FACTORS.get(field.unit, ("",)))
            raise InputError(
                f"{source}: the column {text} is in {unit!r}, and the {field.noun} is expected in "
                f"{units}: convert it, or change the unit"
            )
        if factor != 1.0:
            warnings.append(
                Diagnostic(
                    f"column {text}: converted from {unit} to {field.unit or '1'}", "unit_converted"
                )
            )
        columns[name] = Column(text, factor)
    return Header(columns, tuple(unknown), unused, tuple(warnings))


def unit_factor(unit: str, source_unit: str) -> float | None:
    """Return the factor from the source unit to the unit of a field in :data:`FACTORS`; None if
    unknown.
    """
    target, word = (text.lower().translate(_SUPERSCRIPTS) for text in (unit, source_unit))
    word = word.rstrip(".") or word
    return FACTORS.get(unit, {}).get(word, 1.0 if target and target == word else None)


def _reject_near_miss(text: str, source: object, read: Collection[str]) -> None:
    """Reject a header of five letters or more that is one edit or one swap away from a name."""
    bare = _IN_BRACKETS.sub("", text.strip().lower()).replace(" ", "_")
    end = _AT_THE_END.fullmatch(bare)
    if "sa_g" in read and _LIKE_SPECTRAL.fullmatch(text.strip().lower()):
        raise InputError(
            f"{source}: unknown column {text[:60]!r}; did you mean a spectral acceleration? Name "
            f"it by its period from {SHORTEST_S:g} to {LONGEST_S:g} s, such as 'sa(0.3)'"
        )
    if bare in WRITTEN or sum(map(str.isalpha, bare)) < _FEWEST_LETTERS:
        return
    for name, field in _names().items():
        if field in read and (_is_near(bare, name) or (end and _is_near(end[1], name))):
            raise InputError(
                f"{source}: unknown column {text[:60]!r}; did you mean {name!r}, the "
                f"{QUANTITIES[field].noun}?"
            )


def _is_near(text: str, other: str) -> bool:
    """Return whether two texts differ by one edit, or by a swap of two neighbouring letters."""
    if abs(len(text) - len(other)) > 1 or text == other or len(other) < _FEWEST_LETTERS:
        return False
    start = next((i for i, (a, b) in enumerate(zip(text, other, strict=False)) if a != b), None)
    if start is None:
        return True
    a, b = text[start:], other[start:]
    if len(text) == len(other):
        return a[1:] == b[1:] or (a[:2] == b[1::-1] and a[2:] == b[2:])
    return a[1:] == b if len(text) > len(other) else a == b[1:]
