"""Reading of files with clear error messages, and atomic writing."""

from __future__ import annotations

import codecs
import csv
import io
import json
import os
import re
import secrets
import tomllib
from collections import Counter
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from rbfrag.errors import InputError

MOST_BYTES = 1 << 28
"""Larger texts are rejected: no curve, model or description is 256 MB long."""

LONGEST_FILE_NAME = 240
"""Bytes: file systems take 255, of which the name of the unfinished file needs some more."""

_DOTTED = re.compile(r"(?:^|[\[{,])[^.,=\n\[\]{}#]*(?:\.[^.,=\n\[\]{}#]*){20}", re.MULTILINE)
"""A key of more than 20 parts; the parser's time grows with the square of their number."""


_ARCHIVES = (
    (b"PK\x03\x04", "zip"), (b"\x1f\x8b", "gzip"), (b"7z\xbc\xaf", "7z"), (b"Rar!", "rar"),
    (b"BZh", "bzip2"), (b"\xfd7zXZ", "xz"),
)  # fmt: skip
"""How packed files begin."""

WORKBOOKS = (".xlsx", ".ods")
"""What workbooks end in: these are zip files."""


def encoding_of(start: bytes) -> str:
    """Return the encoding of a text from its first bytes: UTF-16 with a mark, or UTF-8."""
    marked = start.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
    return "utf-16" if marked else "utf-8-sig"


def packed_as(start: bytes) -> str | None:
    """Return the format of a packed file from its first bytes; None for another file."""
    return next((name for magic, name in _ARCHIVES if start.startswith(magic)), None)


def as_path(value: object, name: str, description: str) -> Path:
    """Return the path of an argument.

    Args:
        value: a text or a path.
        name: of the argument, for the message.
        description: what the file holds, for the message.

    Raises:
        InputError: something else.
    """
    if isinstance(value, str | os.PathLike):
        return Path(value)
    raise InputError(
        f"{name} is of type {type(value).__name__}: give the path of {description}, as text or Path"
    )


NO_FILE = "a device, pipe or socket, which may have no end"


def is_endless(source: Path) -> bool:
    """Return whether an existing path is neither a file nor a folder."""
    return source.exists() and not source.is_file() and not source.is_dir()


def bounded_bytes(source: Path, most_bytes: int) -> bytes | None:
    """Return the content of a file; None if it is larger than the limit, whatever its reported
    size.
    """
    if source.stat().st_size > most_bytes:
        return None
    with source.open("rb") as file:
        content = file.read(most_bytes + 1)
    return content if len(content) <= most_bytes else None


@contextmanager
def reading(source: Path, description: str) -> Iterator[None]:
    """Convert errors in reading a file to messages.

    Args:
        source: the file.
        description: what it should hold, for messages: "a hazard curve".

    Raises:
        InputError: there is no such file, or it cannot be read or is packed or not text (UTF-8).
    """
    try:
        if source.is_dir():
            raise InputError(f"{source} is a folder: give a file with {description}")
        if is_endless(source):
            raise InputError(f"{source} is {NO_FILE}: save {description} to a file first")
        with source.open("rb") as file:
            packed = packed_as(file.read(6))
        workbook = source.suffix.lower() in WORKBOOKS
        if packed is not None and not (workbook and packed == "zip"):
            raise InputError(f"{source} is a {packed} file: unpack it first and give {description}")
        yield
    except FileNotFoundError:
        raise InputError(f"{source}: no such file; give a file with {description}") from None
    except UnicodeDecodeError as error:
        raise InputError(
            f"{source}: not a text file (byte {error.start} is not {error.encoding.upper()}): "
            f"save {description} as UTF-8 (in Excel: CSV UTF-8)"
        ) from None
    except OSError as error:
        raise InputError(f"{source}: cannot be read: {error.strerror or error}") from None


def source_text(
    path: str | os.PathLike[str], description: str, most_bytes: int = MOST_BYTES
) -> str:
    """Return the whole text of a file, with newlines as ``\\n``.

    Args:
        path: the file.
        description: as for :func:`reading`.
        most_bytes: larger files are rejected.

    Raises:
        InputError: the file cannot be read, is empty, too large or not text (UTF-8).
    """
    source = as_path(path, "path", f"a file with {description}")
    with reading(source, description):
        content = bounded_bytes(source, most_bytes)
        if content is None:
            raise InputError(
                f"{source} is larger than {most_bytes} bytes: too large for {description}"
            )
        text = content.decode(encoding_of(content))
    text = text.replace("\r\n", "\n").replace("\r", "\n")
    if not text.strip():
        raise InputError(f"{source} is empty: give a file with {description}")
    return text


def csv_rows(text: str, where: object = "") -> Iterator[tuple[int, list[str]]]:
    """Yield the rows of CSV, the empty ones too, each with the number of its last line.

    Args:
        text: the CSV, with newlines as :func:`source_text` leaves them.
        where: what messages name before the line, such as the file; empty for nothing.

    Raises:
        InputError: it is no CSV, by a cell that does not end or is too long; with its line.
    """
    reader = csv.reader(io.StringIO(text))
    try:
        for row in reader:
            yield reader.line_num, row
    except csv.Error as error:
        place = f"{where}, line" if where else "line"
        raise InputError(f"{place} {reader.line_num}: not a CSV file: {error}") from None


def toml_document(text: str, source: str | os.PathLike[str] | None = None) -> dict[str, Any]:
    """Return the content of a TOML document.

    Raises:
        InputError: it is not TOML, nested too deeply, or holds a key or number out of all bounds;
            the message names the source.
    """
    named = "" if source is None else f"{os.fspath(source)}: "
    if _DOTTED.search(text):
        raise InputError(f"{named}unsupported TOML: a key of more than 20 parts")
    try:
        document = tomllib.loads(text)
        _reject_large([document])
    except RecursionError:
        raise InputError(f"{named}unsupported TOML: tables nested too deeply") from None
    # in addition to its own error, the parser raises that of an integer of thousands of digits
    except ValueError as error:
        raise InputError(f"{named}not valid TOML: {error}") from None
    return document


def _reject_large(values: Iterable[object]) -> None:
    """Reject an integer too large for a float, at any depth."""
    for value in values:
        if isinstance(value, dict | list):
            _reject_large(value.values() if isinstance(value, dict) else value)
        elif isinstance(value, int) and not isinstance(value, bool) and not is_number(value):
            raise ValueError("an integer of more than 308 digits")


def json_document(text: str) -> Any:
    """Return the content of a JSON document.

    Raises:
        InputError: it is not JSON, nested too deeply, or has a key twice in one object.
    """
    try:
        return json.loads(text, object_pairs_hook=unique_keys)
    except RecursionError:
        raise InputError("unsupported JSON: objects or arrays nested too deeply") from None
    except InputError:
        raise
    except ValueError as error:
        raise InputError(f"not JSON: {error}") from None


def unique_keys(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """Return a JSON object with unique keys, for `object_pairs_hook`.

    Raises:
        InputError: a key occurs twice.
    """
    document = dict(pairs)
    if len(document) < len(pairs):
        # in one pass: a hostile object may hold a million names
        double = Counter(name for name, _ in pairs).most_common(1)[0][0]
        raise InputError(f"the key {double[:40]!r} occurs twice in a JSON object: keep one of them")
    return document


def is_number(value: object) -> bool:
    """Return whether a value of a document is a number in the range of floats."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    try:
        float(value)
    except OverflowError:
        return False
    return True


def is_numeral(text: str) -> bool:
    """Return whether a text is a number."""
    try:
        float(text)
    except ValueError:
        return False
    return True


def output_path(path: str | os.PathLike[str], suffixes: tuple[str, ...], label: str) -> Path:
    """Return the path if the file can be written there; for use before long work.

    Args:
        path: file to write.
        suffixes: what its name may end in.
        label: what messages call it: "table", "plot file".

    Raises:
        InputError: another suffix, or a folder that cannot be written.
    """
    target = Path(path)
    if target.suffix.lower() not in suffixes:
        raise InputError(
            f"{label} {target}: unsupported suffix {target.suffix!r}; use {', '.join(suffixes)}"
        )
    if len(os.fsencode(target.name)) > LONGEST_FILE_NAME:
        raise InputError(
            f"{label} {target}: the name is longer than {LONGEST_FILE_NAME} bytes: shorten it"
        )
    if target.is_dir():
        raise InputError(f"{label} {target} is a folder: give a file name")
    if not target.parent.is_dir():
        raise InputError(f"{label} {target}: create the folder {target.parent} first")
    if not os.access(target.parent, os.W_OK):
        raise InputError(f"{label} {target}: the folder is not writable: choose another")
    return target


@contextmanager
def written_whole(target: Path, label: str = "file") -> Iterator[Path]:
    """Yield a temporary path that replaces the target on success, or is deleted.

    Args:
        target: file to write; an existing file is replaced at the end, not before.
        label: what messages call it.

    Raises:
        InputError: the disk rejects.
    """
    partial = target.with_name(f".{target.stem}.{secrets.token_hex(4)}.part{target.suffix}")
    try:
        yield partial
        partial.replace(target)
    except OSError as error:
        reason = error.strerror or str(error)
        raise InputError(
            f"{label} {target} cannot be written: {reason}; choose a writable folder"
        ) from None
    finally:
        partial.unlink(missing_ok=True)


def write_text(text: str, target: Path) -> None:
    """Write a text (UTF-8) atomically.

    Raises:
        InputError: the disk rejects.
    """
    with written_whole(target) as partial:
        partial.write_text(text, encoding="utf-8", newline="\n")


def number_at(text: str, where: str) -> float:
    """Return the number in a text; `where` locates it in messages."""
    try:
        return float(text)
    except ValueError:
        raise InputError(f"{where}: {text!r} is not a number") from None
