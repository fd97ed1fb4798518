"""Safe reading of XML files from other tools.

Document type definitions are rejected: entity bombs and references to other files need one, and
none of the formats here has one.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from xml.parsers import expat

from rbfrag.errors import InputError
from rbfrag.files import reading

Start = Callable[[str, Mapping[str, str], int], None]
End = Callable[[str, int], None]
Text = Callable[[str], None]

MOST_BYTES = 1 << 31
"""Larger files are rejected."""

DEEPEST = 100
"""Documents that are read whole are rejected beyond this depth."""


def parse_xml(
    path: str | os.PathLike[str], description: str, *, start: Start, end: End, text: Text
) -> None:
    """Call back for every element of a file, in a single pass and bounded memory.

    `start` gets local name, attributes and line of a start tag, `end` local name and line of an
    end tag, `text` parts of the text between tags. `description` is what messages call the file.
    """
    source = Path(path)
    parser = expat.ParserCreate(namespace_separator=" ")
    parser.buffer_text = True
    parser.buffer_size = 1 << 20

    def line() -> int:
        return parser.CurrentLineNumber

    def reject(*_: object) -> None:
        raise InputError(
            f"{source}, line {line()}: the file has a document type definition, which is not "
            f"supported in {description}"
        )

    parser.StartDoctypeDeclHandler = reject
    parser.EntityDeclHandler = reject
    parser.StartElementHandler = lambda name, attributes: start(_local(name), attributes, line())
    parser.EndElementHandler = lambda name: end(_local(name), line())
    parser.CharacterDataHandler = text
    try:
        with reading(source, description), source.open("rb") as file:
            size = source.stat().st_size
            if size == 0:
                raise InputError(f"{source} is empty: give {description}")
            if size > MOST_BYTES:
                raise InputError(
                    f"{source} has {size} bytes, more than {MOST_BYTES}: not {description}"
                )
            parser.ParseFile(file)
    except expat.ExpatError as error:
        raise InputError(
            f"{source}, line {error.lineno}: not well-formed XML: {expat.ErrorString(error.code)}"
        ) from None
    except (LookupError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{source}: the XML cannot be decoded: {error}") from None


@dataclass
class Node:
    """An element of a document: local name, attributes, line of its start tag, and content."""

    name: str
    attributes: Mapping[str, str]
    line: int
    text: str = ""
    children: list[Node] = field(default_factory=list)

    def of(self, *names: str) -> Iterator[Node]:
        """Yield the elements of some names, at any depth, in the order of the document."""
        for child in self.children:
            if child.name in names:
                yield child
            yield from child.of(*names)


def read_xml(path: str | os.PathLike[str], description: str) -> Node:
    """Return a complete document as one node above its root."""
    document = Node("", {}, 0)
    open_nodes, texts = [document], [[""]]

    def start(name: str, attributes: Mapping[str, str], line: int) -> None:
        if len(open_nodes) > DEEPEST:
            raise InputError(f"{path}, line {line}: elements nested too deeply: not {description}")
        node = Node(name, attributes, line)
        open_nodes[-1].children.append(node)
        open_nodes.append(node)
        texts.append([])

    def end(_name: str, _line: int) -> None:
        # joined at once: text between a million comments comes in as many parts
        open_nodes.pop().text = "".join(texts.pop())

    parse_xml(path, description, start=start, end=end, text=lambda part: texts[-1].append(part))
    return document


def _local(name: str) -> str:
    return name.rpartition(" ")[2]
