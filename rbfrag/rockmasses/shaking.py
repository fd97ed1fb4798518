"""What one recorded motion does to blocks of a rock mass: every block is run in its own mode."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import InputError
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.polarity import Polarity
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.excitation import Excitation, excitation
from rbfrag.solver.kind import BlockOnPlanes, RunEnd, Runner
from rbfrag.solver.kinds import model_of_mode
from rbfrag.solver.quantity import positive
from rbfrag.solver.results import Outcome
from rbfrag.solver.stability.modes import CONFINED_TOPPLE, MODES, SLIDE, SLUMP

FloatArray = NDArray[np.float64]

FATES = (
    "at_rest", "stays", "fails", "unstable", "locked",
    "undetermined", "contact_lost", "indeterminate", "jump",
)  # fmt: skip
"""What may become of a block, by its code:

``at_rest``: never moves; ``stays``: moves, and does not fail; ``fails``; ``unstable``: fails at
rest, whatever the motion; ``locked``: no horizontal acceleration moves it in its mode;
``undetermined``: closer to failure than the error of its run; ``contact_lost``, ``indeterminate``
and ``jump``: the model ended before the block did, for the reason of that outcome.
"""

AT_REST, STAYS, FAILS, UNSTABLE, LOCKED, UNDETERMINED = range(6)
NO_BLOCK = -1
"""Code of a realisation that is no block."""

OPEN = ("undetermined", "contact_lost", "indeterminate", "jump")
"""Fates that leave open whether the block fails."""

DISPLACEMENT_M = 0.05
"""Displacement beyond which a slide counts as failed when nothing else is said [m].

A choice, not a law: studies of landslides have taken 5 to 10 cm as the displacement that leads to
cracks and general failure (Jibson 1993, Transportation Research Record 1411, 9-17).
"""


@dataclass(frozen=True)
class FailureLimits:
    """What counts as failure, besides a block that is past recovery.

    Args:
        displacement_m: a sliding block fails where it slides further than this [m].
        rotation_deg: a block that slumps, or topples against its back plane, fails where it turns
            by more than this [deg]; None where only one past recovery has failed.

    Raises:
        InputError: a limit that is not above zero.
    """

    displacement_m: float = DISPLACEMENT_M
    rotation_deg: float | None = None

    def __post_init__(self) -> None:
        positive(self.displacement_m, "displacement", "m")
        if self.rotation_deg is not None:
            positive(self.rotation_deg, "rotation", "degrees")

    def code(self, mode_code: int, fate: RunEnd) -> int:
        """Return the code in :data:`FATES` of a block that was run.

        Args:
            mode_code: its mode.
            fate: the end of its run.
        """
        if fate.outcome is Outcome.TOPPLED:
            return FAILS
        peak = limit = None
        if mode_code == SLIDE:
            peak, limit = fate.peak_displacement_m, self.displacement_m
        elif mode_code in (SLUMP, CONFINED_TOPPLE) and self.rotation_deg is not None:
            peak, limit = fate.peak_rad, math.radians(self.rotation_deg)
        if peak is not None and limit is not None:
            # What has happened before a model ends has happened.
            if peak - fate.error > limit:
                return FAILS
            if peak + fate.error > limit:
                return UNDETERMINED
        if fate.outcome is Outcome.STABLE:
            return STAYS if fate.moved else AT_REST
        return FATES.index(fate.outcome.value)


@dataclass(frozen=True, eq=False)
class Shaking:
    """One recorded motion at several scales.

    Args:
        motion: horizontal ground motion.
        scales: factors on it, and on the vertical one, rising.
        vertical: vertical motion of the same recording, upward positive.
        polarity: ``forward`` (positive samples drive out of the slope) or ``reverse``.
    """

    motion: GroundMotion
    scales: tuple[float, ...]
    vertical: GroundMotion | None = None
    polarity: Polarity = "forward"

    def drives(self) -> list[Excitation]:
        """Return the excitation at each scale."""
        unscaled = excitation(self.motion, self.vertical, self.polarity)
        return [unscaled.scaled(scale) for scale in self.scales]


@dataclass(frozen=True, eq=False)
class BlocksToRun:
    """Some stable blocks of a rock mass and the scales at which they move; shapes (k,) and (m, k).

    Args:
        place: places of the blocks among the realisations.
        mode_code: their modes.
        yield_g: their yield accelerations [g].
        s1_m: thickness normal to the base [m].
        s2_m: thickness normal to the back [m].
        gamma_deg: dip of the back less dip of the base [deg].
        beta_deg: dip of the base [deg].
        phi_deg: friction angle of the base [deg].
        phi_back_deg: friction angle of the back [deg].
        back_fracture: whether there is a plane behind them.
        moves: at which scale which of them moves.
        shaking: the motion.
        limits: what counts as failure.
    """

    place: NDArray[np.intp]
    mode_code: NDArray[np.int8]
    yield_g: FloatArray
    s1_m: FloatArray
    s2_m: FloatArray
    gamma_deg: FloatArray
    beta_deg: FloatArray
    phi_deg: FloatArray
    phi_back_deg: FloatArray
    back_fracture: bool
    moves: NDArray[np.bool_]
    shaking: Shaking
    limits: FailureLimits


@dataclass(frozen=True, eq=False)
class BlockFates:
    """What became of them, shapes (m, k).

    Args:
        place: as asked.
        code: places in :data:`FATES`; ``at_rest`` where a block was not run.
        displacement_m: greatest displacement along the base; NaN where there is none to tell.
        rotation_rad: greatest rotation; NaN likewise.
        about: sentences on what a model takes for granted, and how many of the blocks each is
            about, by mode code and sentence.
        runs: number of simulations.
    """

    place: NDArray[np.intp]
    code: NDArray[np.int8]
    displacement_m: FloatArray
    rotation_rad: FloatArray
    about: dict[tuple[int, str], int]
    runs: int


def run_blocks(work: BlocksToRun) -> BlockFates:
    """Run blocks, one after another, each at the scales at which it moves.

    Args:
        work: the blocks.

    Raises:
        InputError: a block that cannot be run; it is numbered.
    """
    drives = work.shaking.drives()
    code = np.full(work.moves.shape, AT_REST, dtype=np.int8)
    displacement_m = np.where(work.mode_code == MODES.index("topple"), np.nan, 0.0)
    displacement_m = np.broadcast_to(displacement_m, code.shape).copy()
    rotation_rad = np.where(work.mode_code == SLIDE, np.nan, 0.0)
    rotation_rad = np.broadcast_to(rotation_rad, code.shape).copy()
    about: dict[tuple[int, str], int] = {}
    for j in range(work.place.size):
        mode_code = int(work.mode_code[j])
        try:
            run = _runner(work, j)
            fates = [(i, run(drive)) for i, drive in enumerate(drives) if work.moves[i, j]]
        except InputError as error:
            raise InputError(f"block {int(work.place[j]) + 1}: {error}") from None
        for i, fate in fates:
            code[i, j] = work.limits.code(mode_code, fate)
            displacement_m[i, j] = _or_nan(fate.peak_displacement_m)
            rotation_rad[i, j] = _or_nan(fate.peak_rad)
        for sentence in fates[0][1].about_block if fates else ():
            about[mode_code, sentence] = about.get((mode_code, sentence), 0) + 1
    return BlockFates(
        place=work.place,
        code=code,
        displacement_m=displacement_m,
        rotation_rad=rotation_rad,
        about=about,
        runs=int(np.count_nonzero(work.moves)),
    )


def _runner(work: BlocksToRun, j: int) -> Runner:
    """Return the runner of the model that the block's mode calls for."""
    site = BlockOnPlanes(
        block=Block.from_fractures(
            float(work.s1_m[j]), float(work.s2_m[j]), float(work.gamma_deg[j])
        ),
        beta_rad=math.radians(work.beta_deg[j]),
        phi_rad=math.radians(work.phi_deg[j]),
        phi_back_rad=math.radians(work.phi_back_deg[j]),
        back_fracture=work.back_fracture,
        cohesive=False,
        yield_g=float(work.yield_g[j]),
        settings={},
    )
    return model_of_mode(MODES[work.mode_code[j]]).runner(site)


def _or_nan(value: float | None) -> float:
    return math.nan if value is None else value
