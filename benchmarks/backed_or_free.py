"""Backed and free-standing blocks under the same motions:  python -m benchmarks.backed_or_free

How many blocks overturn at each strength: rectangles on level ground that rock about both corners
with Housner's restitution, and those that a slope backs, the mean of both polarities. The motions
are those that a campaign over --records (a folder with MANIFEST.csv) has, uncorrected ones
processed. --write renews the figure of docs/theory/rocking.md and keeps the table.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib import colormaps
from numpy.typing import NDArray

import rbfrag
from benchmarks.page import RECORDS_VARIABLE, ROOT, markdown, parser, report
from rbfrag.campaign.add_motions import add_motions
from rbfrag.db.engine import opened_database
from rbfrag.db.motions import load_motion, motion_rows
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.plots.canvas import (
    BLUE,
    light_grid,
    new_figure,
    open_corner,
    save_figure,
    written_numbers,
)
from rbfrag.solver import toppling_run
from rbfrag.solver.excitation import Excitation, excitation
from rbfrag.solver.integrator.rocking_kernel import TOPPLED, RockingRun
from rbfrag.solver.models.rocking import free_block
from rbfrag.solver.respond import block_of_numbers
from rbfrag.solver.results import DEFAULT_P2, POLARITIES
from rbfrag.solver.rocking_run import simulate

FloatArray = NDArray[np.float64]

PAGE = ROOT / "docs" / "theory" / "rocking.md"
FIGURE = ROOT / "docs" / "figures" / "backed-or-free.svg"

Y_OVER_PGV = np.geomspace(0.1, 8.0, 25)
"""Strengths y = k_r g/p over PGV."""

SHOWN = (6, 9, 11, 12, 13, 14, 15, 16, 17, 18, 19, 21)
"""Which of them the table has."""

RARE = 0.05
"""P of a backed block, as `rbfrag predict` says it, below which what free ones do is summed up."""

SCANNED_RECORD, SCANNED_P2 = "Coyote_Lake_1979_G02-050.csv", 30.0
SCANNED = np.linspace(0.4, 0.95, 2001)
"""Strengths k_r/PGA of the scan of one record."""


@dataclass(frozen=True, eq=False)
class Shares:
    """What overturns.

    Args:
        free_standing: 1 where a free block does, shape (motions, p², y/PGV).
        backed: mean of both polarities, shape (motions, p², y/PGV).
        predicted: P of the backed block by the shipped model, shape (motions, p², y/PGV).
        below_pga: where k_r is below PGA, shape (motions, p², y/PGV).
    """

    free_standing: FloatArray
    backed: FloatArray
    predicted: FloatArray
    below_pga: NDArray[np.bool_]

    def where_thought_safe(self) -> FloatArray:
        """Return the share of free blocks below PGA where P of a backed one is small, by p²."""
        safe = self.below_pga & (self.predicted < RARE)
        return np.array(
            [
                self.free_standing[:, i][safe[:, i]].mean()
                for i in range(self.free_standing.shape[1])
            ]
        )


def shares(
    motions: Sequence[GroundMotion],
    p2: Sequence[float] = DEFAULT_P2,
    y_over_pgv: Sequence[float] | FloatArray = Y_OVER_PGV,
) -> Shares:
    """Run all blocks under all motions."""
    pga = np.array([motion.pga_g for motion in motions])[:, None, None]
    pgv = np.array([motion.pgv_m_s for motion in motions])[:, None, None]
    sizes = np.asarray(p2)[:, None]
    kr = pgv * np.asarray(y_over_pgv) * np.sqrt(sizes) / STANDARD_GRAVITY_M_S2
    free_standing, backed = np.empty(kr.shape), np.empty(kr.shape)
    for m, motion in enumerate(motions):
        ways = [excitation(motion, None, polarity) for polarity in POLARITIES]
        for i, size in enumerate(p2):
            for j, strength in enumerate(kr[m, i].tolist()):
                # an even block on level ground needs one polarity
                free_standing[m, i, j] = rocks(ways[0], size, strength).outcome == TOPPLED
                backed[m, i, j] = np.mean(
                    [
                        toppling_run.simulate(way, p2=size, kr=strength).outcome == TOPPLED
                        for way in ways
                    ]
                )
    inputs = np.broadcast_arrays(sizes, kr, pgv, pga)
    names = ("p2", "kr", "pgv_m_s", "pga_g")
    flat = {name: values.ravel() for name, values in zip(names, inputs, strict=True)}
    predicted = rbfrag.predict(**flat).probability.reshape(kr.shape)
    return Shares(free_standing, backed, predicted, kr < pga)


def rocks(excited: Excitation, p2: float, kr: float) -> RockingRun:
    """Run the free-standing rectangle."""
    return simulate(excited, free_block(block_of_numbers(p2, kr, {})))


def stored_motions(folder: Path) -> list[GroundMotion]:
    """Return the horizontal motions as `rbfrag motions add` stores them."""
    with tempfile.TemporaryDirectory() as place:
        db = Path(place) / "motions.db"
        add_motions([folder], db=db, metadata=folder / "MANIFEST.csv")
        with opened_database(db) as engine, engine.begin() as connection:
            rows = [row for row in motion_rows(connection) if not row.is_vertical]
            return [load_motion(connection, row.id) for row in rows]


def table(fractions: Shares) -> str:
    """Return free | backed shares by p² and strength."""
    headers = ["p² [1/s²]", *(f"{Y_OVER_PGV[j]:.2f}" for j in SHOWN), "where P < 5 %"]
    free_standing, backed = fractions.free_standing.mean(axis=0), fractions.backed.mean(axis=0)
    safe = fractions.where_thought_safe()
    cells = [
        [
            f"{size:g}",
            *(f"{_short(free_standing[i, j])} / {_short(backed[i, j])}" for j in SHOWN),
            _short(safe[i]),
        ]
        for i, size in enumerate(DEFAULT_P2)
    ]
    return markdown((headers, cells))


def _short(share: float) -> str:
    return "0" if share == 0.0 else f"{share:.3f}" if share < 0.0095 else f"{share:.2f}"


@dataclass(frozen=True, eq=False)
class Scan:
    """What one record does to blocks of every strength.

    Args:
        falls: which overturn, shape (strengths,).
        peak: greatest rotation over the critical angle, shape (strengths,).
    """

    falls: NDArray[np.bool_]
    peak: FloatArray

    @classmethod
    def of(cls, motion: GroundMotion) -> Scan:
        """Run the blocks."""
        excited, kr = excitation(motion), SCANNED * motion.pga_g
        runs = [rocks(excited, SCANNED_P2, strength) for strength in kr.tolist()]
        peak = np.array([max(run.forward.x, run.backward.x) for run in runs]) / np.arctan(kr)
        return cls(np.array([run.outcome == TOPPLED for run in runs]), peak)

    @property
    def islands(self) -> int:
        """How many separate stretches of strengths overturn."""
        return int(np.sum(self.falls & ~np.append(False, self.falls[:-1])))


def draw(fractions: Shares, scan: Scan) -> None:
    """Draw the shares over the strength, and the scan."""
    figure = new_figure(9.4, 4.2)
    left_axes, right = figure.subplots(1, 2)
    for i, size in enumerate(DEFAULT_P2):
        colour = colormaps["viridis"](0.95 * i / (len(DEFAULT_P2) - 1))
        left_axes.plot(
            Y_OVER_PGV, fractions.free_standing[:, i].mean(axis=0), color=colour, label=f"{size:g}"
        )
        left_axes.plot(Y_OVER_PGV, fractions.backed[:, i].mean(axis=0), "--", color=colour, lw=1.0)
    left_axes.plot([], [], "--", color="black", lw=1.0, label="backed")
    left_axes.set_xscale("log")
    written_numbers(left_axes.xaxis, 1.0, 2.0, 5.0)
    left_axes.set_xlabel(r"$y/\mathrm{PGV}$")
    left_axes.set_ylabel("share that overturns")
    left_axes.legend(title="p² [1/s²], free-standing", fontsize=8, title_fontsize=8, frameon=False)
    for falls in (False, True):
        right.fill_between(
            SCANNED, 0.0, 1.0, where=scan.falls == falls, step="mid", lw=0.0, rasterized=True,
            color="#e8b4b0" if falls else "#dce9f5", label="overturns" if falls else "stays",
        )  # fmt: skip
    stays = np.where(scan.falls, np.nan, scan.peak)
    right.plot(SCANNED, stays, color=BLUE, lw=0.7, label="its peak", rasterized=True)
    right.set_xlabel(r"$k_r/\mathrm{PGA}$")
    right.set_ylabel("peak rotation over the critical angle")
    right.set_xlim(SCANNED[0], SCANNED[-1])
    right.set_ylim(0.0, 1.0)
    right.legend(loc="upper right", fontsize=8)
    for axes in (left_axes, right):
        open_corner(axes)
    light_grid(left_axes)
    save_figure(figure, FIGURE)


def main(arguments: Sequence[str] | None = None) -> None:
    chosen = parser(__doc__).parse_args(arguments)
    motions = stored_motions(Path(chosen.records or os.environ[RECORDS_VARIABLE]))
    fractions = shares(motions)
    text = f"{table(fractions)}\n\n{len(motions)} horizontal motions, free / backed."
    scanned = [motion for motion in motions if motion.source_file == SCANNED_RECORD]
    if scanned:
        scan = Scan.of(scanned[0])
        text += (
            f" {SCANNED_RECORD}, p² = {SCANNED_P2:g} 1/s², {SCANNED.size} strengths from "
            f"{SCANNED[0]:g} to {SCANNED[-1]:g} PGA: {scan.islands} separate islands overturn."
        )
        if chosen.write:
            draw(fractions, scan)
    report("backed-or-free", text, write=chosen.write, page=PAGE)


if __name__ == "__main__":
    main()
