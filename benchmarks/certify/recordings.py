"""Every real recording of a folder with its manifest: horizontal traces and their verticals."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.page import RECORDS_VARIABLE
from rbfrag.errors import InputError
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.metadata import read_metadata
from rbfrag.motions.readers import read_motions
from rbfrag.solver.critical_result import CriticalResult
from rbfrag.solver.excitation import Excitation, excitation
from rbfrag.solver.results import DEFAULT_P2, POLARITIES, Polarity
from rbfrag.solver.search.critical import critical

MAP_DEPTH = 1e-9
"""Width of k_r/PGA to which maps are made: as fine as the search goes, to be tried hardest."""


@dataclass(frozen=True, eq=False)
class Recording:
    """One horizontal trace as its file has it, and the vertical of the same recording."""

    name: str
    motion: GroundMotion
    vertical: GroundMotion | None


@dataclass(frozen=True, eq=False)
class Combination:
    """One critical search."""

    recording: Recording
    polarity: Polarity
    p2: float
    with_vertical: bool

    @property
    def vertical(self) -> GroundMotion | None:
        return self.recording.vertical if self.with_vertical else None

    @property
    def name(self) -> str:
        """What it is, for people."""
        vertical = ", vertical" if self.with_vertical else ""
        return f"{self.recording.name} {self.polarity} p2={self.p2:g}{vertical}"

    def search(self, motion: GroundMotion | None = None, **options: Any) -> CriticalResult:
        """Search the critical value of the recording, or of a motion in its place."""
        return critical(
            motion or self.recording.motion, p2=self.p2, vertical=self.vertical,
            polarity=self.polarity, **options,
        )  # fmt: skip

    def excited(self) -> Excitation:
        return excitation(self.recording.motion, self.vertical, self.polarity)


def recordings(folder: str | os.PathLike[str] | None = None) -> list[Recording]:
    """Read all horizontal traces that MANIFEST.csv lists, each waveform once.

    Args:
        folder: None for the one that RBFRAG_TEST_RECORDS names.
    """
    root = Path(folder or os.environ.get(RECORDS_VARIABLE) or ".")
    table = root / "MANIFEST.csv"
    if not table.is_file():
        raise SystemExit(f"there is no {table}: name the folder in {RECORDS_VARIABLE} or --records")
    metadata = read_metadata(table)
    horizontal: list[tuple[str, str, GroundMotion]] = []
    upward: dict[str, GroundMotion] = {}
    for path in sorted(p for p in root.rglob("*") if p.is_file()):
        about = metadata.file(path)
        if not about:
            continue
        try:
            motions = read_motions(path)
        except InputError:  # the file states no unit
            motions = read_motions(path, units=about[0].units)
        for row in about:
            motion = motions[row.trace_index or 0]
            name = f"{path.relative_to(root)}#{row.trace_index}"
            if row.is_vertical:
                upward[row.companion_group] = motion
            elif motion.npts > 1 and motion.acceleration_g.any():
                horizontal.append((name, row.companion_group, motion))
    once: dict[str, Recording] = {}
    for name, group, motion in horizontal:
        vertical = upward.get(group)
        if vertical is not None and vertical.dt_s != motion.dt_s:
            vertical = None
        once.setdefault(motion.sha256, Recording(name, motion, vertical))
    return list(once.values())


def choose(
    records: list[Recording], number: int, rng: np.random.Generator, *, with_vertical: bool
) -> list[Combination]:
    """Draw combinations of recording, polarity and p² without repeating one."""
    suitable = [r for r in records if r.vertical is not None] if with_vertical else records
    every = [
        Combination(recording, polarity, p2, with_vertical)
        for recording in suitable
        for polarity in POLARITIES
        for p2 in DEFAULT_P2
    ]
    return [every[i] for i in rng.permutation(len(every))[:number]]
