"""The blocks of a rock mass under one motion: which of them move, and what becomes of all."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import InputError
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.polarity import Polarity
from rbfrag.motions.quality import quality_flags
from rbfrag.rockmasses.joint_sets import Realisations
from rbfrag.rockmasses.shaking import (
    AT_REST,
    FATES,
    LOCKED,
    NO_BLOCK,
    UNSTABLE,
    BlockOutcomes,
    BlocksToRun,
    FailureLimits,
    Shaking,
)
from rbfrag.solver.stability import modes as mechanism
from rbfrag.solver.stability.modes import MODES, SLIDE, TOPPLE, ModeName

FloatArray = NDArray[np.float64]

CHUNK = 250
"""Blocks handed out at a time: a second or less of work."""

MOST_FATES = 50_000_000
"""Realisations times scales that are kept in memory at most."""


@dataclass(frozen=True, eq=False)
class ShakenMass:
    """What became of the realisations of a rock mass; arrays have shape (scales, n).

    Args:
        made: the realisations.
        shaking: the motion and its scales.
        limits: what counts as failure.
        pga_g: PGA of the motion at each scale [g], shape (scales,).
        code: places in :data:`~rbfrag.rockmasses.shaking.FATES`, -1 for no block.
        moves: which block was set in motion at which scale.
        displacement_m: greatest displacement along the base, of the block or, where it turns, of
            its contact on the base; NaN where there is none to tell.
        rotation_rad: greatest rotation; NaN for sliding, and where there is none to tell.
        runs: number of simulations.
        about: how many blocks of a mode a sentence is about.
        warnings: sentences about the motion.
    """

    made: Realisations
    shaking: Shaking
    limits: FailureLimits
    pga_g: FloatArray
    code: NDArray[np.int8]
    moves: NDArray[np.bool_]
    displacement_m: FloatArray
    rotation_rad: FloatArray
    runs: int
    about: Mapping[tuple[ModeName, str], int]
    warnings: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class ShakingPlan:
    """What is known of the blocks without running any, and which ones have to be run.

    Args:
        made: the realisations.
        shaking: the motion and its scales.
        limits: what counts as failure.
        code: fates as far as they are known, shape (scales, n); ``at_rest`` where a block is to
            be run.
        moves: which block is to be run at which scale, shape (scales, n).
        pga_g: PGA at each scale [g].
        warnings: sentences about the motion.
    """

    made: Realisations
    shaking: Shaking
    limits: FailureLimits
    code: NDArray[np.int8]
    moves: NDArray[np.bool_]
    pga_g: FloatArray
    warnings: tuple[str, ...]

    @property
    def places(self) -> NDArray[np.intp]:
        """Places of the blocks that are to be run at any scale."""
        return np.flatnonzero(self.moves.any(axis=0))

    def work(self, chunk: int = CHUNK) -> Iterator[BlocksToRun]:
        """Yield the blocks that are to be run, some at a time.

        Args:
            chunk: how many at a time.
        """
        made, places = self.made, self.places
        for start in range(0, places.size, chunk):
            at = places[start : start + chunk]
            yield BlocksToRun(
                place=at,
                mode_code=made.stability.mode_code[at],
                yield_g=made.stability.yield_acceleration[at],
                s1_m=made.s1_m[at],
                s2_m=made.s2_m[at],
                gamma_deg=made.gamma_deg[at],
                beta_deg=made.beta_deg[at],
                phi_deg=made.phi_deg[at],
                phi_back_deg=made.phi_back_deg[at],
                back_fracture=made.rock_mass.back_fracture,
                moves=self.moves[:, at],
                shaking=self.shaking,
                limits=self.limits,
            )

    def gathered(self, answers: Iterable[BlockOutcomes]) -> ShakenMass:
        """Return the fates of all blocks; the order of the answers does not matter.

        Args:
            answers: to all of :meth:`work`.
        """
        code = self.code.copy()
        still = (self.code == AT_REST) | (self.code == LOCKED)
        mode_code = self.made.stability.mode_code
        displacement_m = np.where(still & (mode_code != TOPPLE), 0.0, np.nan)
        rotation_rad = np.where(still & (mode_code != SLIDE), 0.0, np.nan)
        about: dict[tuple[int, str], int] = {}
        runs = 0
        for answer in answers:
            code[:, answer.place] = np.where(
                self.moves[:, answer.place], answer.code, code[:, answer.place]
            )
            displacement_m[:, answer.place] = answer.displacement_m
            rotation_rad[:, answer.place] = answer.rotation_rad
            runs += answer.runs
            for key, count in answer.about.items():
                about[key] = about.get(key, 0) + count
        return ShakenMass(
            made=self.made,
            shaking=self.shaking,
            limits=self.limits,
            pga_g=self.pga_g,
            code=code,
            moves=self.moves,
            displacement_m=displacement_m,
            rotation_rad=rotation_rad,
            runs=runs,
            about={(MODES[mode], text): count for (mode, text), count in sorted(about.items())},
            warnings=self.warnings,
        )


def plan_shaking(
    made: Realisations,
    motion: GroundMotion,
    *,
    scales: Sequence[float] = (1.0,),
    vertical: GroundMotion | None = None,
    polarity: Polarity = "forward",
    limits: FailureLimits | None = None,
) -> ShakingPlan:
    """Find the blocks that a motion moves, which are those that have to be run.

    A block stays at rest where k_h never exceeds (1 + k_v) times its yield; that is seen at the
    samples, because k_h/(1 + k_v) is monotone between them.

    Args:
        made: blocks of a rock mass.
        motion: horizontal ground motion.
        scales: factors on the motion; each is taken once, in rising order.
        vertical: vertical motion of the same recording, upward positive; scaled likewise.
        polarity: ``forward`` or ``reverse``.
        limits: what counts as failure; None for the usual.

    Raises:
        InputError: a scale that is not above zero, none at all or too many for the realisations,
            components that do not go together, or a rock mass that states a vertical acceleration.
    """
    if np.any(made.kv != 0.0):
        raise InputError(
            "block.kv does not belong in a rock mass that is to be shaken: the vertical "
            "acceleration comes with the motion; leave the key out"
        )
    wrong = [scale for scale in scales if not (math.isfinite(scale) and scale > 0.0)]
    if wrong or not len(scales):
        said = f"scale {wrong[0]:g}" if wrong else "no scale"
        raise InputError(f"{said}: give factors on the motion above 0, such as 0.5,1,2")
    shaking = Shaking(motion, tuple(sorted(set(map(float, scales)))), vertical, polarity)
    if made.n * len(shaking.scales) > MOST_FATES:
        raise InputError(
            f"{made.n} realisations at {len(shaking.scales)} scales are more than {MOST_FATES} "
            "blocks to keep: ask for fewer of either"
        )
    found = made.stability
    k = found.yield_acceleration
    stable = made.is_block & (found.state_code == mechanism.STABLE) & (k > 0.0) & np.isfinite(k)
    locked = made.is_block & (found.state_code == mechanism.LOCKED)
    drives = shaking.drives()
    code = np.full((len(drives), made.n), AT_REST, dtype=np.int8)
    moves = np.zeros(code.shape, dtype=np.bool_)
    for i, drive in enumerate(drives):
        moves[i] = stable & (k < drive.max_q)
        code[i, made.is_block & ~stable] = UNSTABLE
        code[i, locked] = LOCKED
        if drive.jump_node < drive.w.size:
            code[i, (stable & ~moves[i]) | locked] = FATES.index("jump")
        code[i, ~made.is_block] = NO_BLOCK
    return ShakingPlan(
        made=made,
        shaking=shaking,
        limits=FailureLimits() if limits is None else limits,
        code=code,
        moves=moves,
        pga_g=np.array([drive.pga_g for drive in drives]),
        warnings=_about_motion(motion, vertical, drives[0].warnings),
    )


def _about_motion(
    motion: GroundMotion, vertical: GroundMotion | None, together: tuple[str, ...]
) -> tuple[str, ...]:
    said = [*motion.remarks, *(flag.sentence for flag in quality_flags(motion)), *together]
    if vertical is not None:
        said += [f"vertical: {flag.sentence}" for flag in quality_flags(vertical)]
    return tuple(said)
