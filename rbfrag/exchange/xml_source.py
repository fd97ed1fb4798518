"""Safe reading of XML files from other tools.

Document type definitions are rejected: entity bombs and references to other files need one, and
none of the formats here has one.
"""

from __future__ import annotations

import os
from collections.abc import Generator, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from xml.parsers import expat

from rbfrag.errors import InputError
from rbfrag.files import reading

MOST_BYTES = 1 << 31
"""Larger files are rejected."""

DEEPEST = 100
"""Documents that are read whole are rejected beyond this depth."""

_READ_AT_ONCE = 1 << 16

Event = tuple[str, str, Mapping[str, str], int]
"""Kind ("start", "text" or "end"), name of the tag or part of a text, attributes, and line."""


def xml_events(path: str | os.PathLike[str], description: str) -> Generator[Event]:
    """Yield the tags and texts of a file, in a single pass and bounded memory.

    Names are local names. The pull parsers of the standard library know neither the line of a tag
    nor that of a document type definition, both of which messages name.

    Args:
        description: what messages call the file.
    """
    source = Path(path)
    parser = expat.ParserCreate(namespace_separator=" ")
    parser.buffer_text = True
    parser.buffer_size = 1 << 20
    events: list[Event] = []

    def add(kind: str, text: str, attributes: Mapping[str, str]) -> None:
        events.append((kind, text, attributes, parser.CurrentLineNumber))

    def reject(*_: object) -> None:
        raise InputError(
            f"{source}, line {parser.CurrentLineNumber}: the file has a document type definition, "
            f"which is not supported in {description}"
        )

    parser.StartDoctypeDeclHandler = reject
    parser.EntityDeclHandler = reject
    parser.StartElementHandler = lambda name, attributes: add("start", _local(name), attributes)
    parser.EndElementHandler = lambda name: add("end", _local(name), {})
    parser.CharacterDataHandler = lambda text: add("text", text, {})
    try:
        with reading(source, description), source.open("rb") as file:
            size = source.stat().st_size
            if size == 0:
                raise InputError(f"{source} is empty: give {description}")
            if size > MOST_BYTES:
                raise InputError(
                    f"{source} has {size} bytes, more than {MOST_BYTES}: not {description}"
                )
            part = None
            while part != b"":
                part = file.read(_READ_AT_ONCE)
                try:
                    parser.Parse(part, part == b"")
                finally:  # what stands above a fault is read before it is reported
                    yield from events
                    events.clear()
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
    for kind, text, attributes, line in xml_events(path, description):
        if kind == "text":
            texts[-1].append(text)
        elif kind == "end":
            # joined at once: text between a million comments comes in as many parts
            open_nodes.pop().text = "".join(texts.pop())
        elif len(open_nodes) > DEEPEST:
            raise InputError(f"{path}, line {line}: elements nested too deeply: not {description}")
        else:
            node = Node(text, attributes, line)
            open_nodes[-1].children.append(node)
            open_nodes.append(node)
            texts.append([])
    return document


def _local(name: str) -> str:
    return name.rpartition(" ")[2]
