"""Header numbers of accelerograms changed by a factor, and whether anybody would notice.

A change is silent if the file is read without rejection and without a warning that the sound file
lacks, although its samples are now read otherwise (interval, number, most of the values) or the
number is a duration, interval, scale or peak that the format states besides.
"""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from random import Random

import numpy as np

from benchmarks.damage import NUMBER
from rbfrag.errors import RbfragError
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.readers import read_motions
from tests.motions.test_header_check import MAKE, MISTAKES, file_text

HEADER_BYTES = 6000
"""So far down a file its numbers are changed; single samples among them do not count."""

FACTORS = (0.01, 0.1, 0.2, 0.5, 2.0, 5.0, 10.0, 100.0)

NUMBERS = re.compile(rb"[-+.\dE\s]*")

OTHER = "other"


@dataclass
class Silence:
    """What became of changed header numbers of one format."""

    changed: int = 0
    rejected: int = 0
    remarked: int = 0
    silent: Counter[str] = field(default_factory=Counter)
    lines: Counter[str] = field(default_factory=Counter)


def sound_files(name: str, files: list[bytes]) -> list[bytes]:
    """Return files of a format whose header numbers can be changed: shaking, if it can be made."""
    return [
        file_text(name_of_maker).encode()
        for name_of_maker in MAKE
        if name_of_maker.removesuffix(" series") == name
    ] or files


def change(
    name: str,
    content: bytes,
    path: Path,
    random: Random,
    units: str | None,
    dt_s: float | None,
    gain: float | None = None,
) -> tuple[str, str, str]:
    """Change one number of a header, and read the file.

    Returns:
        What became of it (``""`` for nothing, ``rejected``, ``remarked``, ``silent``), the kind of
        number, and its line.
    """
    numbers = list(NUMBER.finditer(content[:HEADER_BYTES]))
    if not numbers:
        return "", "", ""
    statements = _statements(name, content)
    of_samples = [match for match in numbers if match.start() in statements]
    # most numbers of a header say nothing of the samples
    match = random.choice(of_samples if of_samples and random.random() < 0.5 else numbers)
    kind = statements.get(match.start(), OTHER)
    other = _by_a_factor(match[0], random)
    if other is None:
        return "", "", ""
    start = match.start()
    if NUMBERS.fullmatch(content[content.rfind(b"\n", 0, start) + 1 : start]):
        # numbers in columns grow to the left, into the blanks before them
        blanks = len(content[:start]) - len(content[:start].rstrip(b" "))
        start -= max(0, min(len(other) - len(match[0]), blanks - 1))
    damaged = content[:start] + other + content[match.end() :]
    path.write_bytes(content)
    sound = read_motions(path, units=units, dt_s=dt_s, gain=gain)
    path.write_bytes(damaged)
    at = content.count(b"\n", 0, match.start())
    line = damaged.split(b"\n")[at].decode("latin-1").strip()
    try:
        motions = read_motions(path, units=units, dt_s=dt_s, gain=gain)
    except RbfragError:
        return "rejected", kind, line
    finally:
        path.unlink()
    if kind == OTHER and _alike(sound, motions):
        return "", kind, line
    remarks = {remark for motion in motions for remark in motion.remarks}
    remarks -= {remark for motion in sound for remark in motion.remarks}
    # the offset of a format that subtracts it is told in numbers
    remarks = {remark for remark in remarks if not remark.startswith("the mean of")}
    return ("remarked" if remarks else "silent"), kind, line


def _by_a_factor(number: bytes, random: Random) -> bytes | None:
    mantissa, exponent, power = number.partition(b"E")
    value, factor = float(mantissa), random.choice(FACTORS)
    text = f"{value * factor:.{len(mantissa.partition(b'.')[2])}f}"
    apart = abs(float(text) / value) if value else 1.0
    if not (apart >= 2.0 or 0.0 < apart <= 0.5):
        return None
    return text.encode() + exponent + power


def _statements(name: str, content: bytes) -> dict[int, str]:
    """Where the format's statements on its samples stand, and of what kind they are."""
    text = content[:HEADER_BYTES].decode("latin-1")
    statements = {}
    for statement, mistakes in MISTAKES.items():
        if statement.removesuffix(" series") == name:
            for kind, pattern, _ in mistakes:
                for match in re.finditer(pattern, text, re.IGNORECASE):
                    number = NUMBER.search(match[1].encode("latin-1"))
                    if number:
                        statements[match.start(1) + number.start()] = kind
    return statements


def _alike(sound: list[GroundMotion], motions: list[GroundMotion]) -> bool:
    """Whether motions were read alike, but for single samples and an offset."""
    if len(sound) != len(motions):
        return False
    for before, other in zip(sound, motions, strict=True):
        if before.npts != other.npts or before.dt_s != other.dt_s:
            return False
        steps, now = np.diff(before.acceleration_g), np.diff(other.acceleration_g)
        largest = np.abs(steps).max(initial=0.0)
        moving = np.abs(steps) > 1e-3 * largest
        if not moving.any():
            # equal samples: no step tells a factor
            differ = before.acceleration_g != other.acceleration_g
        else:
            differ = np.abs(steps - now)[moving] > 1e-6 * largest
        if np.mean(differ) > 0.5:
            return False
    return True


def table(silences: dict[str, Silence]) -> str:
    """Return what became of the changed numbers, a row a format, and the lines of silent ones."""
    rows = ["| format | header numbers changed | rejected | remarked | silent |",
            "| --- | --- | --- | --- | --- |"]  # fmt: skip
    for name, silence in silences.items():
        kinds = ", ".join(f"{number} {kind}" for kind, number in sorted(silence.silent.items()))
        rows.append(
            f"| {name} | {silence.changed} | {silence.rejected} | {silence.remarked} "
            f"| {kinds or 0} |"
        )
    silent = [
        f"{name}: {line[:100]}"
        for name, silence in silences.items()
        for line, _ in silence.lines.most_common(3)
    ]
    return "\n".join([*rows, *(["", "Silent, for example:", *silent] if silent else [])])
