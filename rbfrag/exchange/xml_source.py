"""XML that another tool wrote, read so that no document can do harm.

Document type definitions are refused: entity bombs and references to other files need one, and
none of the formats here has one.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from pathlib import Path
from xml.parsers import expat

from rbfrag.errors import InputError
from rbfrag.files import reading

Start = Callable[[str, Mapping[str, str], int], None]
End = Callable[[str, int], None]
Text = Callable[[str], None]

MOST_BYTES = 1 << 31
"""Larger files are refused."""


def parse_xml(
    path: str | os.PathLike[str], what: str, *, start: Start, end: End, text: Text
) -> None:
    """Call back for every element of a file, in one pass and bounded memory.

    `start` gets local name, attributes and line of a start tag, `end` local name and line of an
    end tag, `text` parts of the text between tags. `what` is what messages call the file.
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
        with reading(source, what), source.open("rb") as file:
            size = source.stat().st_size
            if size == 0:
                raise InputError(f"{source} is empty: name {what}")
            if size > MOST_BYTES:
                raise InputError(f"{source} has {size} bytes, more than {MOST_BYTES}: not {what}")
            parser.ParseFile(file)
    except expat.ExpatError as error:
        raise InputError(
            f"{source}, line {error.lineno}: not well-formed XML: {expat.ErrorString(error.code)}"
        ) from None
    except (LookupError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{source}: the XML cannot be decoded: {error}") from None


def _local(name: str) -> str:
    return name.rpartition(" ")[2]
