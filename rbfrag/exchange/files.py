"""Files of other tools: text and XML read so that no document can do harm, text written whole."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from pathlib import Path
from xml.parsers import expat

from rbfrag.errors import InputError

MOST_TEXT_BYTES = 1 << 28
"""Larger files are refused: no curve or fragility model is 256 MB long."""


def source_text(path: str | os.PathLike[str], what: str) -> str:
    """Return the whole text of a file.

    Args:
        path: the file.
        what: what it should hold, for messages: "a hazard curve".

    Raises:
        InputError: the file cannot be read, is empty, too large or not text (UTF-8).
    """
    source = Path(path)
    try:
        if source.is_dir():
            raise InputError(f"{source} is a folder: name a file with {what} in it")
        size = source.stat().st_size
        if size > MOST_TEXT_BYTES:
            raise InputError(
                f"{source} has {size} bytes, more than {MOST_TEXT_BYTES}: this is not {what}"
            )
        text = source.read_bytes().decode("utf-8-sig")
    except FileNotFoundError:
        raise InputError(f"{source}: no such file; name a file with {what}") from None
    except UnicodeDecodeError as error:
        raise InputError(
            f"{source}: byte {error.start} is not UTF-8 text: this is not {what}"
        ) from None
    except OSError as error:
        raise InputError(f"{source}: cannot be read: {error.strerror or error}") from None
    if not text.strip():
        raise InputError(f"{source} is empty: name a file with {what}")
    return text


def output_path(path: str | os.PathLike[str], suffixes: tuple[str, ...], what: str) -> Path:
    """Return the path if such a file can be written there; ask before long work.

    Raises:
        InputError: another suffix, or a folder that cannot be written.
    """
    target = Path(path)
    if target.suffix.lower() not in suffixes:
        raise InputError(
            f"{target}: the suffix {target.suffix!r} is none of {', '.join(suffixes)}: name {what} "
            "with one of them"
        )
    if target.is_dir():
        raise InputError(f"{target} is a folder: name a file in it")
    if not target.parent.is_dir():
        raise InputError(f"{target}: there is no folder {target.parent}: make it first")
    if not os.access(target.parent, os.W_OK):
        raise InputError(f"{target}: the folder cannot be written: choose another")
    return target


def write_text(text: str, target: Path) -> None:
    """Write a text (UTF-8); an existing file is replaced at the end, not before.

    Raises:
        InputError: the disk refuses.
    """
    partial = target.with_name(f".{target.name}.{os.getpid()}.part")
    try:
        partial.write_text(text, encoding="utf-8", newline="\n")
        partial.replace(target)
    except OSError as error:
        raise InputError(f"{target} cannot be written: {error.strerror or error}") from None
    finally:
        partial.unlink(missing_ok=True)


Start = Callable[[str, Mapping[str, str], int], None]
End = Callable[[str, int], None]
Text = Callable[[str], None]

MOST_XML_BYTES = 1 << 31
"""Larger files are refused."""


def parse_xml(
    path: str | os.PathLike[str], what: str, *, start: Start, end: End, text: Text
) -> None:
    """Call back for every element of a file, in one pass and bounded memory.

    Args:
        path: the file.
        what: what it should be, for messages: "a ShakeMap grid".
        start: called with local name, attributes and line at a start tag.
        end: called with local name and line at an end tag.
        text: called with pieces of text between tags.

    Raises:
        InputError: the file cannot be read, is not well-formed, or has a DTD.
    """
    source = Path(path)
    parser = expat.ParserCreate(namespace_separator=" ")
    parser.buffer_text = True
    parser.buffer_size = 1 << 20

    def line() -> int:
        return parser.CurrentLineNumber

    def refuse(*_: object) -> None:
        raise InputError(
            f"{source}, line {line()}: the file has a document type definition, which is refused: "
            f"{what} has none"
        )

    parser.StartDoctypeDeclHandler = refuse
    parser.EntityDeclHandler = refuse
    parser.StartElementHandler = lambda name, attributes: start(_local(name), attributes, line())
    parser.EndElementHandler = lambda name: end(_local(name), line())
    parser.CharacterDataHandler = text
    try:
        if source.is_dir():
            raise InputError(f"{source} is a folder: name {what}")
        size = source.stat().st_size
        if size == 0:
            raise InputError(f"{source} is empty: name {what}")
        if size > MOST_XML_BYTES:
            raise InputError(f"{source} has {size} bytes, more than {MOST_XML_BYTES}: not {what}")
        with source.open("rb") as file:
            parser.ParseFile(file)
    except FileNotFoundError:
        raise InputError(f"{source}: no such file; name {what}") from None
    except OSError as error:
        raise InputError(f"{source}: cannot be read: {error.strerror or error}") from None
    except expat.ExpatError as error:
        raise InputError(
            f"{source}, line {error.lineno}: not well-formed XML: {expat.ErrorString(error.code)}"
        ) from None
    except (UnicodeDecodeError, LookupError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{source}: the XML cannot be decoded: {error}") from None


def _local(name: str) -> str:
    return name.rpartition(" ")[2]
