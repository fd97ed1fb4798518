"""The text of a record's file, with troubles named by line."""

from __future__ import annotations

import codecs
import math
import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import MotionFileError

LARGEST_FILE_BYTES = 512 * 1024**2
MOST_DIGITS = 12
MOST_SHOWN = 40

_FORTRAN = re.compile(r"(?<!\d)(\d{1,3})[FE](\d{1,3})\.\d", re.IGNORECASE | re.ASCII)
_OF_INTEGERS = frozenset("0123456789- \t")
_BETWEEN_NUMBERS = re.compile(r"[\s,;]+")
_DECIMALS = re.compile(r"[+-]?\d*\.(\d+)([eE][+-]?\d+)?", re.ASCII)
_TAIL = 2000
_COMPARED, _DISTINCT, _FEWEST_DECIMALS = 30, 10, 3
"""So many numbers above the last, so many of them different, must agree in their decimals."""
_NUMBER = re.compile(r"[+-]?(?:\d+(?:\.\d*)?|\.\d+)([eE][+-]?\d+)?", re.ASCII)


def read_text(path: Path) -> str:
    """Return the text of a file: byte-order mark removed, newlines as ``\\n``.

    Raises:
        MotionFileError: there is no such file, it is a folder, empty, binary or too large.
    """
    try:
        if path.is_dir():
            raise MotionFileError(path, "this is a folder, not a file: name a file in it")
        size = path.stat().st_size
        if size > LARGEST_FILE_BYTES:
            raise MotionFileError(
                path, f"{size / 1024**2:.0f} MiB are too large for an accelerogram in text"
            )
        raw = path.read_bytes()
    except FileNotFoundError:
        raise MotionFileError(path, "there is no such file: check the path") from None
    except OSError as error:
        raise MotionFileError(path, f"the file cannot be read: {error.strerror}") from None
    except MotionFileError:
        raise
    except ValueError as error:
        # a name with a zero byte
        raise MotionFileError(path, f"the file cannot be read: {error}") from None
    return decoded(path, raw)


def decoded(path: Path, raw: bytes) -> str:
    """Return the text of a file's bytes: byte-order mark removed, newlines as ``\\n``.

    Raises:
        MotionFileError: they are none, or not text.
    """
    if not raw.removeprefix(codecs.BOM_UTF8).strip():
        raise MotionFileError(path, "the file is empty: export the record again")
    if b"\0" in raw:
        raise MotionFileError(
            path, "the file is binary, not text: export the record in one of the text formats"
        )
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        # every byte has a meaning in Latin-1, which older networks write
        text = raw.decode("latin-1")
    return text.replace("\r\n", "\n").replace("\r", "\n")


def cut_number(text: str) -> str:
    """Return the number within which a file ends, or an empty text.

    A file that ends without a newline may have been cut. Its last number shows so if all those
    before it are printed with one number of decimals, and it has fewer.

    Args:
        text: the text of a file.
    """
    if text.endswith("\n"):
        return ""
    words = _BETWEEN_NUMBERS.split(text[-_TAIL:])[1:]
    *others, last = words[-_COMPARED - 1 :] or [""]
    found = {_DECIMALS.fullmatch(word) for word in set(others)}
    if len(others) < _COMPARED or len(found) < _DISTINCT or None in found:
        return ""
    shapes = {(len(word[1]), len(word[2] or "")) for word in found if word}
    ((decimals, exponent),) = shapes if len(shapes) == 1 else {(0, 0)}
    if decimals < _FEWEST_DECIMALS:
        return ""
    end = _DECIMALS.match(last)
    whole = end is not None and len(end[1]) >= decimals and len(end[2] or "") >= exponent
    return "" if whole else last


def free_numbers(
    path: Path, lines: Sequence[str], first_line: int, what: str
) -> NDArray[np.float64]:
    """Return blank-separated numbers; a bad one is named with its line.

    Args:
        path: for messages.
        lines: the lines that hold the numbers.
        first_line: 1-based number of the first of them in the file.
        what: what the numbers are, for messages.
    """
    tokens = " ".join(lines).split()
    try:
        numbers = np.array(tokens, dtype=np.float64)
    except ValueError:
        numbers = np.array([np.nan])
    # numpy also reads 'nan', 'inf' and '1_000', which no instrument writes
    if not np.isfinite(numbers).all() or any("_" in token for token in tokens):
        return np.array(
            [
                finite_number(path, token, number, what)
                for number, line in enumerate(lines, first_line)
                for token in line.split()
            ]
        )
    return numbers


def fixed_width_numbers(
    path: Path, lines: Sequence[str], first_line: int, width: int, per_line: int, what: str
) -> NDArray[np.float64]:
    """Return numbers in columns of a fixed width, which may touch.

    Args:
        path: for messages.
        lines: the lines that hold the numbers; only the last may hold fewer than the others.
        first_line: 1-based number of the first of them in the file.
        width: characters a field, the number at its right end.
        per_line: fields a line.
        what: what the numbers are, for messages.

    Raises:
        MotionFileError: a line of another length, or a field that is no finite number.
    """
    rows = [line.rstrip() for line in lines]
    whole = width * per_line
    for at, row in enumerate(rows):
        # a character too many or too few would shift every field after it
        if len(row) != whole and (at < len(rows) - 1 or len(row) % width or len(row) > whole):
            raise MotionFileError(
                path,
                f"the line has {len(row)} characters, which are not {per_line} fields of {width}: "
                "repair the line or export the record again",
                line=first_line + at,
            )
    text = "".join(rows)
    if not text:
        return np.empty(0)
    try:
        numbers = np.frombuffer(text.encode("ascii"), dtype=f"S{width}").astype(np.float64)
    except ValueError:
        numbers = np.array([np.nan])
    if not np.isfinite(numbers).all() or "_" in text:
        # numpy knows fewer blanks than Python does: a field may be sound all the same
        return np.array(
            [
                finite_number(path, row[start : start + width].strip(), first_line + at, what)
                for at, row in enumerate(rows)
                for start in range(0, len(row), width)
            ]
        )
    return numbers


def table_numbers(
    path: Path, lines: Sequence[str], first_line: int, columns: int, what: str
) -> NDArray[np.float64]:
    """Return blank-separated columns of numbers, shape (rows, columns).

    Args:
        path: for messages.
        lines: the rows.
        first_line: 1-based number of the first of them in the file.
        columns: columns that each row must have.
        what: what the numbers are, for messages.
    """
    for number, line in enumerate(lines, first_line):
        found = len(line.split())
        if found != columns:
            raise MotionFileError(
                path,
                f"the line has {found} values, not {columns} as the header says: repair the line "
                "or export the record again",
                line=number,
            )
    return free_numbers(path, lines, first_line, what).reshape(-1, columns)


def holds_integers(line: str) -> bool:
    """Return whether a line holds integers and nothing else.

    Args:
        line: a line of a file.
    """
    return set(line) <= _OF_INTEGERS and any(character.isdigit() for character in line)


def without_blank_end(lines: Sequence[str]) -> Sequence[str]:
    """Return lines without the blank ones after the last that is not.

    Args:
        lines: some lines of a file.
    """
    end = len(lines)
    while end and not lines[end - 1].strip():
        end -= 1
    return lines[:end]


def field_layout(text: str, default: tuple[int, int] | None = None) -> tuple[int, int] | None:
    """Return fields a line and characters a field of a Fortran format such as ``(8F10.6)``.

    Args:
        text: a line that may have a format in it.
        default: what to return if it has none.
    """
    found = _FORTRAN.search(text)
    if not found:
        return default
    per_line, width = int(found[1]), int(found[2])
    return (per_line, width) if per_line and width else default


def sample_count(path: Path, text: str, line: int, what: str) -> int:
    """Return a count of samples that a header states, or refuse it with its line.

    Args:
        path: for messages.
        text: the count as the file has it.
        line: 1-based line number.
        what: the name of the count.

    Raises:
        MotionFileError: it is no whole number of at least 1.
    """
    digits = text.removesuffix(".")
    # int() refuses thousands of digits in words of its own
    if digits.isascii() and digits.isdigit() and len(digits) < MOST_DIGITS and int(digits) > 0:
        return int(digits)
    raise MotionFileError(path, f"{what} {_shown(text)} is not a count of samples", line=line)


def _shown(text: str) -> str:
    return repr(text if len(text) <= MOST_SHOWN else f"{text[:MOST_SHOWN]}…")


def finite_number(path: Path, text: str, line: int, what: str) -> float:
    """Return one number of a file, or refuse it with its line.

    Args:
        path: for messages.
        text: the number as the file has it.
        line: 1-based line number.
        what: what the number is.

    Raises:
        MotionFileError: it is no number, or not finite.
    """
    if _NUMBER.fullmatch(text):
        value = float(text)
        if math.isfinite(value):
            return value
        raise MotionFileError(path, f"{what} {_shown(text)} is too large", line=line)
    raise MotionFileError(
        path,
        f"{what} {_shown(text)} is not a finite number: repair the line or export the record again",
        line=line,
    )
