"""Shares of the blocks of a rock mass that a motion brings down, mode by mode."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rbfrag.rockmasses.exact_interval import exact_interval
from rbfrag.rockmasses.response import ShakenMass
from rbfrag.rockmasses.shaking import FATES, OPEN
from rbfrag.solver.stability.modes import MODES, ModeName

QUANTILES = (0.5, 0.95)
"""Quantiles of displacement that are reported."""


@dataclass(frozen=True)
class Share:
    """A counted share with the interval that the finite number of blocks leaves.

    Args:
        value: the share.
        low: lower end of its interval.
        high: upper end.
    """

    value: float
    low: float
    high: float


@dataclass(frozen=True)
class ModeFailures:
    """What became of the blocks of one mode, or of all, at one scale.

    Args:
        mode: the mode; None for all.
        count: number of blocks.
        fates: number of blocks by fate, in the order of
            :data:`~rbfrag.rockmasses.shaking.FATES`; they add up to `count`.
        moved: number of blocks that were set in motion.
        of_all: those that fail, as a share of the blocks of all modes.
        of_mode: the same as a share of the blocks of the mode; None without blocks.
        open_of_all: those of which it is open whether they fail, as a share of all.
        displacement_m: quantiles and the greatest of the displacements along the base of those
            blocks that were followed to the end and are not past recovery, those at rest
            included; None without any.
    """

    mode: ModeName | None
    count: int
    fates: Mapping[str, int]
    moved: int
    of_all: Share
    of_mode: Share | None
    open_of_all: float
    displacement_m: Mapping[str, float] | None

    @property
    def fails(self) -> int:
        """Number of blocks that fail by the motion; those that fail without it are not in it."""
        return self.fates["fails"]

    @property
    def open(self) -> int:
        """Number of blocks of which it is open whether they fail."""
        return sum(self.fates[name] for name in OPEN)


@dataclass(frozen=True)
class ScaleFailures:
    """What became of the blocks at one scale of the motion.

    Args:
        scale: factor on the motion.
        pga_g: its PGA [g].
        modes: by mode, for the modes that have blocks.
        total: all blocks.
    """

    scale: float
    pga_g: float
    modes: Mapping[ModeName, ModeFailures]
    total: ModeFailures


def failures(shaken: ShakenMass, level: float = 0.95) -> tuple[ScaleFailures, ...]:
    """Count what became of the blocks, scale by scale.

    Args:
        shaken: the fates of the blocks.
        level: confidence level of the intervals of the shares.

    Raises:
        InputError: the level is not between 0 and 1.
    """
    made = shaken.made
    found = []
    for i, scale in enumerate(shaken.shaking.scales):
        chosen: list[tuple[ModeName | None, NDArray[np.bool_]]] = [
            (mode, made.is_block & (made.stability.mode_code == code))
            for code, mode in enumerate(MODES)
        ]
        modes = {
            mode: _counted(shaken, i, mode, here, level)
            for mode, here in chosen
            if mode is not None and here.any()
        }
        total = _counted(shaken, i, None, made.is_block, level)
        found.append(ScaleFailures(scale, float(shaken.pga_g[i]), modes, total))
    return tuple(found)


def _counted(
    shaken: ShakenMass, i: int, mode: ModeName | None, here: NDArray[np.bool_], level: float
) -> ModeFailures:
    count = int(np.count_nonzero(here))
    by_code = np.bincount(shaken.code[i, here], minlength=len(FATES)).tolist()
    fates = dict(zip(FATES, by_code, strict=True))
    still = fates["at_rest"] + fates["unstable"] + fates["locked"]
    thrown_at_rest = int(
        np.count_nonzero(here & (shaken.code[i] == FATES.index("jump")) & ~shaken.moves[i])
    )
    n = shaken.made.n_blocks
    to_the_end = here & ~np.isin(shaken.code[i], [FATES.index(name) for name in OPEN])
    slid = shaken.displacement_m[i, to_the_end]
    slid = slid[np.isfinite(slid)]
    return ModeFailures(
        mode=mode,
        count=count,
        fates=fates,
        moved=count - still - thrown_at_rest,
        of_all=_share(fates["fails"], n, level),
        of_mode=_share(fates["fails"], count, level) if count else None,
        open_of_all=sum(fates[name] for name in OPEN) / n,
        displacement_m=_quantiles(slid) if slid.size else None,
    )


def _share(count: int, of: int, level: float) -> Share:
    return Share(count / of, *exact_interval(count, of, level))


def _quantiles(values: NDArray[np.float64]) -> dict[str, float]:
    numbers = np.quantile(values, QUANTILES).tolist()
    named = {f"q{100 * q:02.0f}": number for q, number in zip(QUANTILES, numbers, strict=True)}
    return {**named, "max": float(values.max())}
