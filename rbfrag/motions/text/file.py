"""Text of a record file, its lines and single numbers."""

from __future__ import annotations

import codecs
import math
import re
from collections.abc import Sequence
from pathlib import Path

from rbfrag.errors import MotionFileError
from rbfrag.files import NO_FILE, bounded_bytes, encoding_of, is_endless, packed_as

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
    """Return the text of a file: byte-order mark removed, newlines as ``\\n``."""
    return decoded(path, read_bytes(path))


def read_bytes(path: Path) -> bytes:
    """Return the content of a file of bounded size."""
    try:
        if path.is_dir():
            raise MotionFileError(path, "this is a folder: give a file")
        if is_endless(path):
            raise MotionFileError(path, f"this is {NO_FILE}: save the record to a file")
        raw = bounded_bytes(path, LARGEST_FILE_BYTES)
        if raw is None:
            largest = LARGEST_FILE_BYTES / 1024**2
            raise MotionFileError(
                path, f"more than {largest:.0f} MiB are too large for an accelerogram"
            )
        return raw
    except FileNotFoundError:
        raise MotionFileError(path, "there is no such file: check the path") from None
    except OSError as error:
        raise MotionFileError(path, f"the file cannot be read: {error.strerror}") from None
    except MotionFileError:
        raise
    except ValueError as error:
        # a name with a zero byte
        raise MotionFileError(path, f"the file cannot be read: {error}") from None


def decoded(path: Path, raw: bytes) -> str:
    """Return the text of a file's bytes: byte-order mark removed, newlines as ``\\n``."""
    if not raw.removeprefix(codecs.BOM_UTF8).strip():
        raise MotionFileError(path, "the file is empty: export the record again")
    packed = packed_as(raw[:6])
    if packed is not None:
        raise MotionFileError(path, f"it is a {packed} file: unpack it, and give a record")
    encoding = encoding_of(raw)
    if b"\0" in raw and encoding != "utf-16":
        raise MotionFileError(
            path,
            "the file is binary and not miniSEED: export the record in one of the text formats",
        )
    try:
        text = raw.decode(encoding)
    except UnicodeDecodeError:
        # every byte has a meaning in Latin-1, which older networks write
        text = raw.decode("latin-1")
    return text.replace("\r\n", "\n").replace("\r", "\n")


def cut_number(text: str) -> str:
    """Return the number at which a truncated file ends, or an empty text.

    A file that ends without a newline may have been cut. Its last number shows so if all those
    before it are printed with one number of decimals, and it has fewer.
    """
    if text.endswith("\n"):
        return ""
    words = _BETWEEN_NUMBERS.split(text[-_TAIL:])[1:]
    *earlier, last = words[-_COMPARED - 1 :] or [""]
    matches = {_DECIMALS.fullmatch(word) for word in set(earlier)}
    if len(earlier) < _COMPARED or len(matches) < _DISTINCT or None in matches:
        return ""
    shapes = {(len(word[1]), len(word[2] or "")) for word in matches if word}
    ((decimals, exponent),) = shapes if len(shapes) == 1 else {(0, 0)}
    if decimals < _FEWEST_DECIMALS:
        return ""
    end = _DECIMALS.match(last)
    is_complete = end is not None and len(end[1]) >= decimals and len(end[2] or "") >= exponent
    return "" if is_complete else last


def holds_integers(line: str) -> bool:
    """Return whether a line consists of integers."""
    return set(line) <= _OF_INTEGERS and any(character.isdigit() for character in line)


def without_blank_end(lines: Sequence[str]) -> Sequence[str]:
    """Return lines without trailing blank ones."""
    end = len(lines)
    while end and not lines[end - 1].strip():
        end -= 1
    return lines[:end]


def field_layout(text: str) -> tuple[int, int] | None:
    """Return fields a line and characters a field of a Fortran format such as ``(8F10.6)``."""
    match = _FORTRAN.search(text)
    if not match:
        return None
    per_line, width = int(match[1]), int(match[2])
    return (per_line, width) if per_line and width else None


def finite_number(path: Path, text: str, line: int, description: str) -> float:
    """Return one number of a file, or reject it with its line, from 1."""
    if _NUMBER.fullmatch(text):
        value = float(text)
        if math.isfinite(value):
            return value
        raise MotionFileError(path, f"{description} {shown(text)} is too large", line=line)
    raise MotionFileError(
        path,
        f"{description} {shown(text)} is not a finite number: repair the line or export the "
        "record again",
        line=line,
    )


def shown(text: str) -> str:
    """Return a text quoted for messages."""
    return repr(text if len(text) <= MOST_SHOWN else f"{text[:MOST_SHOWN]}…")
