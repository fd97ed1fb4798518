"""Delimited text: time and acceleration in two columns, or acceleration alone.

Columns are separated by comma, semicolon, tab or blanks. Above them stand ``#`` lines, or one
line with the names of the columns. The unit comes from there, or from the caller::

    # Time Series: Chi-Chi, Taiwan 1999 - TCU068-090
    # Time (s),Acceleration (g's)
    0.0,-6.67772E-4

Three further layouts are read: several components, each with a named column; accelerations alone
below a title and a line ``npts dt`` (eqsig); and accelerations alone, row by row in rows of equal
length without a header, where the caller gives interval and unit (OpenSees).
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from itertools import pairwise
from pathlib import Path

from rbfrag.errors import InputError, MotionFileError
from rbfrag.motions.direction import is_vertical_name
from rbfrag.motions.record_file import HeaderField, ParsedTrace, RecordFile, positive_number
from rbfrag.motions.text import read_text, sampling_interval
from rbfrag.motions.units import acceleration_unit

FORMAT = "delimited text"

COMMENT = "#"

INDEX = "dt_index.txt"
"""Beside lists of bare accelerations (FEMA P-695): lines of a file's name and its dt."""

LONGEST_HEADER_LINE = 500
"""Characters of a header line that are looked at."""

_NUMBER_LIKE = re.compile(
    r"[+-]?(?:(?:\d+(?:\.\d*)?|\.\d+)(?:[ed][+-]?\d+)?|nan|inf|infinity)", re.IGNORECASE
)
_FLOAT = re.compile(r"[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:e[+-]?\d{1,2})?", re.IGNORECASE | re.ASCII)
_DECIMAL_COMMA = re.compile(r"\s*[+-]?\d*,\d+(?:[eE][+-]?\d+)?\s*[;\s]\s*[+-]?\d*,\d+\S*\s*")


_QUANTITY_AND_UNIT = re.compile(r"^acc[a-z]*[\s_.:-]*|[(\[{].*$", re.IGNORECASE)
"""What stands around the direction in the name of a column: ``acc_NS(gal)``."""

_ACCELERATION = re.compile(r"(?<![A-Za-z])(?:acc|a(?![A-Za-z]))", re.IGNORECASE)
_OTHER_QUANTITY = re.compile(r"(?<![A-Za-z])(vel|displ?)[a-z]*", re.IGNORECASE)
_TIME = re.compile(r"(?<![A-Za-z])(?:time|t)(?![A-Za-z])", re.IGNORECASE)

_ACCELERATION_UNIT = re.compile(
    r"(?<![A-Za-z])(?:acc[^,;\t()\[\]]*|a\s*)[(\[]\s*([^)\]]+?)\s*[)\]]", re.IGNORECASE
)
_ACCELERATION_SUFFIX = re.compile(
    r"(?<![A-Za-z])acc[a-z]*(?:_|\s+in\s+)(g|gal|[cm]?m[_/]s(?:ec)?(?:\^|\*\*)?2)(?![A-Za-z0-9])",
    re.IGNORECASE,
)
_UNITS_WORD = re.compile(
    r"(?<![A-Za-z])units?\s*(?:of\s+acc[a-z]*\s*)?(?:[:=]|\bof\b|\bare\b|\bin\b)\s*([^\s,;()\[\]]+)",
    re.IGNORECASE,
)
_TIME_UNIT = re.compile(
    r"(?<![A-Za-z])(?:time[^,;\t()\[\]]*|t\s*)[(\[]\s*([^)\]]+?)\s*[)\]]", re.IGNORECASE
)
_BRACKETS = re.compile(r"[(\[{]\s*([^()\[\]{}]+?)\s*[)\]}]")
"""Whatever the columns are called, and in whatever language, their units may stand in brackets."""

_OTHER_TIMES = frozenset({"ms", "msec", "µs", "us", "min", "h", "hr"})
_SECONDS = frozenset({"s", "sec", "sec.", "secs", "second", "seconds"})

_TITLE = re.compile(
    r"#\s*(?:Time Series:\s*)?(?P<event>\S.*?\b(?:18|19|20)\d\d)\s+-\s+"
    r"(?P<station>\S+)-(?P<component>[A-Za-z0-9]+)[\s,;]*",
    re.IGNORECASE,
)

Header = Sequence[tuple[int, str]]
"""Lines above the data with their 1-based numbers."""


def recognises(head: str) -> bool:
    """Return whether the first rows are numbers, below comments or one line of names."""
    rows = [line for line in head.split("\n") if line.strip() and not line.startswith(COMMENT)]
    if rows and not _is_numeric(rows[0]):
        del rows[0]
    if not rows:
        return False
    if _has_decimal_commas(rows[0]):
        return True
    width = len(_fields(rows[0]))
    if width > 2 and (len(rows) < 2 or len(_fields(rows[1])) != width):
        return False
    return all(map(_is_numeric, rows[: 1 if width <= 2 else 2]))


def parse(file: RecordFile) -> Iterator[ParsedTrace]:
    """Yield the trace of a delimited text file, or those of its named columns."""
    lines = file.lines
    start = _first_data_line(lines)
    header = [
        (number, line[:LONGEST_HEADER_LINE])
        for number, line in enumerate(lines[:start], 1)
        if line.strip()
    ]
    rows = _rows(file, start)
    size = _size(rows)
    names = _column_names(header, len(rows[0][1]))
    if size:
        rows = rows[1:]
    elif len(rows[0][1]) > 2 and not names:
        yield _wrapped(file, header, rows)
        return
    for number, fields in rows:
        if len(fields) != len(rows[0][1]):
            raise file.error(
                f"{lines[number - 1].strip()[:60]!r} does not have {len(rows[0][1])} columns like "
                "the rows above: repair the line or export the record again",
                number,
            )
    numbers = [number for number, _ in rows]
    columns = [[fields[place] for _, fields in rows] for place in range(len(rows[0][1]))]
    if names:
        yield from _components(file, header, names, columns, numbers)
        return
    unit = _stated_unit(file, header)
    if size or len(columns) == 1:
        samples = file.numbers(columns[0], lambda: numbers, "acceleration")
        _reject_gaps(file, rows)
        dt, remark = (file.dt(size[1]), "") if size else _interval_of_list(file)
    else:
        samples = file.numbers(columns[1], lambda: numbers, "acceleration")
        dt, remark = _interval_of_times(file, columns[0], numbers)
    # what a title "# Northridge 1994 - VSP-360" says
    title = _TITLE.fullmatch(header[0][1].rstrip()) if header else None
    event, station, component = title.group("event", "station", "component") if title else ("",) * 3
    yield ParsedTrace(
        samples,
        dt,
        unit,
        file.count(size[0], "number of samples") if size else None,
        component,
        station=station,
        event=event,
        recording=f"{event} {station}" if event and station else "",
        remarks=(remark,) if remark else (),
    )


def _size(rows: list[tuple[int, list[str]]]) -> tuple[HeaderField, HeaderField] | None:
    """Return number of samples and interval of a line ``npts dt`` above a list, or None."""
    (line, fields), *below = rows
    if len(fields) != 2 or not fields[0].strip().isdigit() or not below or len(below[0][1]) != 1:
        return None
    return HeaderField(fields[0].strip(), line), HeaderField(fields[1].strip(), line)


def _column_names(header: Header, width: int) -> list[HeaderField]:
    """Return the names of a time column and of several more; empty where the header has none."""
    line, text = header[-1] if header else (0, "")
    names = [HeaderField(name.strip(), line) for name in _fields(text.lstrip(COMMENT))]
    return names if width > 2 and len(names) == width and _TIME.search(names[0].text) else []


def _components(
    file: RecordFile,
    header: Header,
    names: list[HeaderField],
    columns: list[list[str]],
    numbers: list[int],
) -> Iterator[ParsedTrace]:
    """Yield the named columns of acceleration, each in the unit of its name or of the header."""
    _check_columns(file, header[-1:])
    dt, remark = _interval_of_times(file, columns[0], numbers)
    for name, column in zip(names[1:], columns[1:], strict=True):
        spelling = next((text for _, text in _spellings([(name.line, name.text)])), None)
        component = _QUANTITY_AND_UNIT.sub("", name.text).strip() or name.text
        is_acceleration = _ACCELERATION.search(name.text) or (spelling and _is_unit(spelling))
        if not is_acceleration and is_vertical_name(component) is None:
            raise file.error(
                f"the column {name.text!r} is not an acceleration: keep the time and the "
                "components' accelerations",
                name.line,
            )
        yield ParsedTrace(
            file.numbers(column, lambda: numbers, "acceleration"),
            dt,
            HeaderField(spelling, name.line) if spelling else _stated_unit(file, header[:-1]),
            None,
            component,
            recording=file.path.name,
            remarks=(remark,) if remark else (),
        )


def _wrapped(file: RecordFile, header: Header, rows: list[tuple[int, list[str]]]) -> ParsedTrace:
    """Return accelerations printed row by row; interval and unit are the caller's."""
    (first, fields), *_, (last, _) = rows
    width = len(fields)
    if header or file.dt_s is None or file.units is None or _counts_up([row[0] for _, row in rows]):
        raise file.error(
            f"{width} columns without names: keep two, the time and one component's acceleration; "
            "where the rows hold one component's values in turn, give its interval and unit "
            "(dt_s, units)",
            first,
            fields=("dt_s", "units"),
        )
    _reject_gaps(file, rows)
    for number, row in rows:
        if len(row) != width and (number < last or len(row) > width):
            raise file.error(
                f"the line has {len(row)} values, not {width} as the first: repair the line or "
                "export the record again",
                number,
            )
    tokens = [field for _, row in rows for field in row]
    samples = file.numbers(
        tokens, lambda: [number for number, row in rows for _ in row], "acceleration"
    )
    remark = f"{width} values a row were read row by row, with the dt and unit that were given"
    return ParsedTrace(samples, file.dt_s, None, None, "", recording="", remarks=(remark,))


def _counts_up(column: list[str]) -> bool:
    """Return whether a column is one of times or of row numbers, not of accelerations."""
    numbers = [float(field) for field in column if _is_number(field)]
    steps = [later - earlier for earlier, later in pairwise(numbers)]
    if len(steps) < 2 or min(steps) <= 0.0:
        return False
    return len(steps) > 3 or max(steps) <= 1.001 * min(steps)


def _interval_of_times(
    file: RecordFile, column: list[str], numbers: list[int]
) -> tuple[float, str]:
    """Return the sampling interval of a column of times, and a sentence on where they start."""
    times = file.numbers(column, lambda: numbers, "time")
    tokens = [token.strip() for token in column]
    dt = sampling_interval(file.path, tokens, times, numbers, file.dt_s)
    first_s = float(times[0])
    return dt, f"times in the file start at {first_s:g} s; here they start at 0" if first_s else ""


def _mark(row: str) -> str | None:
    return next((mark for mark in (";", ",") if mark in row), None)


def _fields(row: str) -> list[str]:
    return row.split(_mark(row))


def _numeric(row: str) -> list[bool]:
    # decimal commas are rejected in words of their own, once it is clear that these are numbers
    decimal = "," if _mark(row) == ";" else "."
    return [
        bool(_NUMBER_LIKE.fullmatch(field.strip().replace(decimal, "."))) for field in _fields(row)
    ]


def _is_number(field: str) -> bool:
    return bool(_FLOAT.fullmatch(field.strip()))


def _has_decimal_commas(row: str) -> bool:
    return len(row) < LONGEST_HEADER_LINE and bool(_DECIMAL_COMMA.fullmatch(row))


def _is_numeric(row: str) -> bool:
    return all(_numeric(row))


def _first_data_line(lines: list[str]) -> int:
    """Index of the first row; a row with any number in it is data, not names."""
    named = False
    for at, line in enumerate(lines):
        if not line.strip() or line.startswith(COMMENT):
            continue
        if named or any(_numeric(line)) or _has_decimal_commas(line):
            return at
        named = True
    return len(lines)


def _rows(file: RecordFile, start: int) -> list[tuple[int, list[str]]]:
    """Return line number and fields of every row."""
    lines = file.lines
    numbered = [(n, line) for n, line in enumerate(lines[start:], start + 1) if line.strip()]
    if not numbered:
        raise file.error("no values follow the header: export the record again")
    first, top = numbered[0]
    mark = _mark(top)
    if _has_decimal_commas(top) or (mark == ";" and "," in top):
        raise file.error(
            f"{top.strip()!r} has decimal commas: write decimal points, as in 0.005", first
        )
    return [(number, line.split(mark)) for number, line in numbered]


def _interval_of_list(file: RecordFile) -> tuple[float, str]:
    """Sampling interval of a list of accelerations, and a sentence on where it comes from."""
    path, dt_s = file.path, file.dt_s
    indexed = _indexed_interval(path)
    if indexed is None and dt_s is None:
        raise file.error(
            "the file has one column and no sampling interval: give it in seconds, as in  dt_s "
            f"0.005, or in a file {INDEX} in the same folder, as in  {path.name} 0.005",
            fields=("dt_s",),
        )
    if indexed is None:
        assert dt_s is not None
        return dt_s, f"the file has no dt; {dt_s:g} s is what was stated when it was read"
    if dt_s is not None and dt_s != indexed[0]:
        raise file.error(
            f"{indexed[1]} next to the file has dt = {indexed[0]:g} s, not {dt_s:g}: omit dt_s, "
            "or correct one of them",
            fields=("dt_s",),
        )
    return indexed[0], f"the file has no dt; {indexed[0]:g} s is from {indexed[1]}"


def _reject_gaps(file: RecordFile, rows: list[tuple[int, list[str]]]) -> None:
    # without times an empty line may be a missing sample
    for (above, _), (number, _) in pairwise(rows):
        if number != above + 1:
            raise file.error(
                "empty line among the accelerations, possibly a missing sample: remove it, or "
                "add a time column",
                above + 1,
            )


def _indexed_interval(path: Path) -> tuple[float, str] | None:
    """Return the dt [s] of a file from the index in its folder, and where it does so, or None."""
    index = path.parent / INDEX
    if not index.is_file():
        return None
    entry: tuple[float, str] | None = None
    for number, line in enumerate(read_text(index).split("\n"), 1):
        fields = line.split()
        if len(fields) != 2 or fields[0] != path.name:
            continue
        dt = positive_number(index, HeaderField(fields[1], number), "dt")
        if entry is not None and entry[0] != dt:
            raise MotionFileError(
                index,
                f"{path.name} has dt = {dt:g} s here, but {entry[0]:g} s in {entry[1]}: "
                "keep one line",
                line=number,
            )
        entry = entry or (dt, f"{INDEX}, line {number}")
    return entry


def _stated_unit(file: RecordFile, header: Header) -> HeaderField | None:
    """Return the unit of acceleration in the header, given once or consistently several times."""
    _check_columns(file, header)
    candidates = [HeaderField(spelling, number) for number, spelling in _spellings(header)]
    units = [field for field in candidates if _is_unit(field.text)]
    for field in units[1:]:
        if acceleration_unit(field.text) != acceleration_unit(units[0].text):
            raise file.error(
                f"the header has {field.text} here, but {units[0].text} on line {units[0].line}: "
                "correct it",
                field.line,
            )
    if not candidates:
        file.require_units()
    return next(iter(units or candidates), None)


def _spellings(header: Header) -> Iterator[tuple[int, str]]:
    for number, line in header:
        names_columns = bool(_TIME.search(line))
        for match in _ACCELERATION_UNIT.finditer(line):
            # a title may well have brackets: "Accelerogram (corrected)"
            if names_columns or _is_unit(match[1]):
                yield number, match[1]
        for match in _BRACKETS.finditer(line):
            if _is_unit(match[1]):
                yield number, match[1]
        for match in _ACCELERATION_SUFFIX.finditer(line):
            yield number, match[1].replace("_", "/")
        for match in _UNITS_WORD.finditer(line):
            yield number, match[1]


def _is_unit(text: str) -> bool:
    try:
        acceleration_unit(text)
    except InputError:
        return False
    return True


def _check_columns(file: RecordFile, header: Header) -> None:
    for number, line in header:
        time = _TIME.search(line)
        if not time:
            _check_units(file, number, [match[1] for match in _BRACKETS.finditer(line)])
            continue
        if (unit := _TIME_UNIT.search(line)) and unit[1].lower() not in _SECONDS:
            raise file.error(f"the times are in {unit[1]!r}: convert them to seconds", number)
        acceleration = _ACCELERATION.search(line)
        other = _OTHER_QUANTITY.search(line)
        if other and not acceleration:
            raise file.error(f"the header names {other[0]!r}: an acceleration is required", number)
        # a title such as "Accelerations, time series" is no list of columns
        if acceleration and acceleration.start() < time.start() and _TIME_UNIT.search(line):
            raise file.error("the acceleration precedes the time: swap the columns", number)


def _check_units(file: RecordFile, number: int, units: list[str]) -> None:
    """Reject columns whose units contradict their order: other times, or a swap."""
    at = next((place for place, unit in enumerate(units) if _is_unit(unit)), None)
    if at is None:
        return
    for place, unit in enumerate(units):
        if unit.lower() in _OTHER_TIMES:
            raise file.error(f"the times are in {unit!r}: convert them to seconds", number)
        if unit.lower() in _SECONDS and place > at:
            raise file.error("the acceleration precedes the time: swap the columns", number)
