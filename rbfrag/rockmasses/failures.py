"""Shares of the blocks of a rock mass that a motion brings down, mode by mode, and their report."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import InputError
from rbfrag.rockmasses.report import block_columns
from rbfrag.rockmasses.shaking import OPEN, OUTCOMES, ShakenMass
from rbfrag.solver.stability.modes import MODES, ModeName


def exact_interval(count: int, of: int, level: float) -> tuple[float, float]:
    """Return the interval of Clopper and Pearson for the share behind a count.

    It covers the true share with at least the stated probability, whatever the share is, because
    it is made of the tails of the binomial distribution itself.

    References:
        Clopper and Pearson (1934), Biometrika 26(4), 404-413.
    """
    from scipy.special import betaincinv

    tail = 0.5 * (1.0 - checked_level(level))
    low = float(betaincinv(count, of - count + 1, tail)) if count > 0 else 0.0
    high = float(betaincinv(count + 1, of - count, 1.0 - tail)) if count < of else 1.0
    return low, high


def checked_level(level: float) -> float:
    """Return a confidence level, or refuse what is none."""
    if not isinstance(level, int | float) or not 0.0 < level < 1.0:
        raise InputError(
            f"level = {level!r}: a confidence level lies between 0 and 1, such as 0.95"
        )
    return level


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
        outcomes: number of blocks by outcome, in the order of
            :data:`~rbfrag.rockmasses.shaking.OUTCOMES`; they add up to `count`.
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
    outcomes: Mapping[str, int]
    moved: int
    of_all: Share
    of_mode: Share | None
    open_of_all: float
    displacement_m: Mapping[str, float] | None

    @property
    def fails(self) -> int:
        """Number of blocks that fail by the motion; those that fail without it are not in it."""
        return self.outcomes["fails"]

    @property
    def open(self) -> int:
        """Number of blocks of which it is open whether they fail."""
        return sum(self.outcomes[name] for name in OPEN)


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
    """Count what became of the blocks, scale by scale."""
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
    by_code = np.bincount(shaken.code[i, here], minlength=len(OUTCOMES)).tolist()
    outcomes = dict(zip(OUTCOMES, by_code, strict=True))
    still = outcomes["at_rest"] + outcomes["unstable"] + outcomes["locked"]
    thrown_at_rest = int(
        np.count_nonzero(here & (shaken.code[i] == OUTCOMES.index("jump")) & ~shaken.moves[i])
    )
    n = shaken.made.n_blocks
    to_the_end = here & ~np.isin(shaken.code[i], [OUTCOMES.index(name) for name in OPEN])
    slid = shaken.displacement_m[i, to_the_end]
    slid = slid[np.isfinite(slid)]
    return ModeFailures(
        mode=mode,
        count=count,
        outcomes=outcomes,
        moved=count - still - thrown_at_rest,
        of_all=_share(outcomes["fails"], n, level),
        of_mode=_share(outcomes["fails"], count, level) if count else None,
        open_of_all=sum(outcomes[name] for name in OPEN) / n,
        displacement_m=_quantiles(slid) if slid.size else None,
    )


def _share(count: int, of: int, level: float) -> Share:
    return Share(count / of, *exact_interval(count, of, level))


def _quantiles(values: NDArray[np.float64]) -> dict[str, float]:
    numbers = np.quantile(values, QUANTILES).tolist()
    named = {f"q{100 * q:02.0f}": number for q, number in zip(QUANTILES, numbers, strict=True)}
    return {**named, "max": float(values.max())}


def failures_as_dict(
    shaken: ShakenMass, found: Sequence[ScaleFailures], level: float
) -> dict[str, Any]:
    """Return the answer under the keys of the JSON contract."""
    shaking = shaken.shaking
    return {
        "motion": shaking.motion.label,
        "vertical": None if shaking.vertical is None else shaking.vertical.label,
        "polarity": shaking.polarity,
        "displacement_limit_m": shaken.limits.displacement_m,
        "rotation_limit_deg": shaken.limits.rotation_deg,
        "level": level,
        "runs": shaken.runs,
        "scales": [
            {
                "scale": each.scale,
                "pga_g": each.pga_g,
                "pgv_m_s": each.scale * shaking.motion.pgv_m_s,
                "modes": {mode: _counts(counted) for mode, counted in each.modes.items()},
                "all": _counts(each.total),
            }
            for each in found
        ],
    }


def failure_warnings(shaken: ShakenMass) -> list[str]:
    """Return sentences about the motion, and about blocks with how many they are about."""
    made = shaken.made
    by_mode = {
        mode: int((made.is_block & (made.stability.mode_code == code)).sum())
        for code, mode in enumerate(MODES)
    }
    return [
        *shaken.warnings,
        *(
            f"{count} of {by_mode[mode]} blocks of mode {mode.replace('_', ' ')}: {text}"
            for (mode, text), count in shaken.about.items()
        ),
    ]


def _counts(counted: ModeFailures) -> dict[str, Any]:
    return {
        "count": counted.count,
        **counted.outcomes,
        "moved": counted.moved,
        "open": counted.open,
        "fails_of_all": _as_dict(counted.of_all),
        "fails_of_mode": None if counted.of_mode is None else _as_dict(counted.of_mode),
        "open_of_all": counted.open_of_all,
        "displacement_m": None if counted.displacement_m is None else dict(counted.displacement_m),
    }


def _as_dict(share: Share) -> dict[str, float]:
    return {"share": share.value, "ci_low": share.low, "ci_high": share.high}


def outcome_columns(shaken: ShakenMass) -> dict[str, NDArray[Any]]:
    """Return the columns of the block table, one row a realisation and scale."""
    columns = block_columns(shaken.made)
    reason = columns.pop("reason")
    scales = np.array(shaken.shaking.scales)
    m, n = shaken.code.shape
    names = np.array([*OUTCOMES, ""], dtype=object)
    return {
        **{name: np.tile(values, m) for name, values in columns.items()},
        "scale": np.repeat(scales, n),
        "pga_g": np.repeat(shaken.pga_g, n),
        "fate": names[shaken.code.reshape(-1)],
        "displacement_m": shaken.displacement_m.reshape(-1),
        "rotation_deg": np.degrees(shaken.rotation_rad.reshape(-1)),
        "reason": np.tile(reason, m),
    }
