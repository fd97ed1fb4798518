"""Random damage to the text of a record's file, reproducible from a seed and a number."""

from __future__ import annotations

import re
from collections.abc import Callable
from random import Random

NUMBER = re.compile(rb"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?")

VALUES = [
    b"0", b"-1", b"1", b"2", b"1e308", b"-1e308", b"1e999", b"1e-320", b"nan", b"-inf", b"NaN", b"",
    b"99999999999999999999", b"9" * 400, b"1_000", b"0x10", b"1,5", b"1d3", b"+-1", b".", b"-",
    b"true", b"null", b"\xd9\xa3", b"-999", b"1e5", b"0.0", b"00", b"*****",
]  # fmt: skip
"""What a number becomes."""

PIECES = [
    b"nan", b"-", b"+", b".", b"E", b"9", b"0", b" ", b"\n", b"\r", b"\r\n", b"\t", b",", b";",
    b"#", b":", b"/", b"/&", b"(", b")", b"=", b"inf", b"1e999", b"\xff", b"\xe2\x80\xa8", b"\x00",
    b"\x0c", b"\x1a", b"\x1c", b"_", b'"', b"[", b"]", b"{", b"}", b"null", b"|", b"*", b"g",
    b"cm/s2", b"NPTS=", b"DT=", b"# rbfrag accelerogram 1\n", b"End-of-data\n", b"{" * 5000,
]  # fmt: skip

Damage = Callable[[bytearray, Random], bytearray]


def damaged(content: bytes, random: Random) -> bytes:
    """Return content after one to four random edits.

    Args:
        content: a file.
        random: the only source of chance.
    """
    text = bytearray(content)
    for _ in range(random.randint(1, 4)):
        text = random.choice(EDITS)(text, random)
    return bytes(text)


def _at(text: bytearray, random: Random) -> int:
    # headers decide how the rest is read: half of all damage is done to the first 2000 bytes
    end = min(len(text), 2000) if random.random() < 0.5 else len(text)
    return random.randrange(max(end, 1))


def _flip(text: bytearray, random: Random) -> bytearray:
    if text:
        text[_at(text, random)] ^= random.randint(1, 255)
    return text


def _replace(text: bytearray, random: Random) -> bytearray:
    at, piece = _at(text, random), random.choice(PIECES)
    text[at : at + len(piece)] = piece
    return text


def _insert(text: bytearray, random: Random) -> bytearray:
    at = _at(text, random)
    text[at:at] = random.choice(PIECES)
    return text


def _delete(text: bytearray, random: Random) -> bytearray:
    at = _at(text, random)
    del text[at : at + random.randint(1, 200)]
    return text


def _cut(text: bytearray, random: Random) -> bytearray:
    del text[_at(text, random) :]
    return text


def _number(text: bytearray, random: Random) -> bytearray:
    at = _at(text, random)
    match = NUMBER.search(text, at)
    if match:
        value = random.choice(VALUES)
        if random.random() < 0.3:
            digits = bytearray(match[0])
            digits[random.randrange(len(digits))] = random.choice(b"0123456789.-")
            value = bytes(digits)
        if random.random() < 0.5:
            value = value.rjust(len(match[0]))[: max(len(match[0]), 1)]
        text[match.start() : match.end()] = value
    return text


def _lines(text: bytearray, random: Random) -> tuple[list[bytes], int]:
    at = _at(text, random)
    lines = bytes(text).splitlines(keepends=True)
    return lines, min(bytes(text).count(b"\n", 0, at), max(len(lines) - 1, 0))


def _drop_line(text: bytearray, random: Random) -> bytearray:
    lines, i = _lines(text, random)
    del lines[i : i + random.choice((1, 1, 1, 5))]
    return bytearray(b"".join(lines))


def _double_line(text: bytearray, random: Random) -> bytearray:
    lines, i = _lines(text, random)
    lines[i:i] = lines[i : i + random.choice((1, 1, 1, 5))]
    return bytearray(b"".join(lines))


def _swap_lines(text: bytearray, random: Random) -> bytearray:
    lines, i = _lines(text, random)
    if lines:
        j = random.randrange(len(lines))
        lines[i], lines[j] = lines[j], lines[i]
    return bytearray(b"".join(lines))


def _append_itself(text: bytearray, random: Random) -> bytearray:
    return text + text[_at(text, random) :]


EDITS: tuple[Damage, ...] = (
    _flip, _flip, _replace, _insert, _delete, _cut, _number, _number, _number, _drop_line,
    _double_line, _swap_lines, _append_itself,
)  # fmt: skip
