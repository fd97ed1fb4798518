"""Fraction of the blocks of a rock mass that fail in a motion, by mode, and its report."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbfrag.fragility.confidence import checked_level
from rbfrag.results.diagnostic import Diagnostic
from rbfrag.rockmasses.report import block_columns
from rbfrag.rockmasses.shaking import AT_REST, OPEN, OUTCOMES, ShakenMass
from rbfrag.solver.kinds import BY_MECHANICS, FOLLOWED
from rbfrag.solver.stability.modes import MODES, TOPPLE, ModeName, words_of_mode


def exact_interval(count: int, of: int, level: float) -> tuple[float, float]:
    """Return the Clopper–Pearson confidence interval of a binomial fraction.

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


QUANTILES = (0.5, 0.95)
"""Quantiles of displacement that are reported."""


@dataclass(frozen=True)
class CountedShare:
    """Counted fraction with the confidence interval for a finite number of blocks."""

    value: float
    low: float
    high: float

    @classmethod
    def of(cls, count: int, total: int, level: float) -> CountedShare:
        """Return the fraction of a count in a total."""
        return cls(count / total, *exact_interval(count, total, level))

    def as_dict(self) -> dict[str, float]:
        """Return the fraction under the keys of the JSON contract."""
        return {"share": self.value, "ci_low": self.low, "ci_high": self.high}


@dataclass(frozen=True)
class ModeFailures:
    """Failures of the blocks of one mode, or of all, at one scale.

    Args:
        mode: the mode; None for all.
        outcomes: number of blocks by outcome, in the order of
            :data:`~rbfrag.rockmasses.shaking.OUTCOMES`; they add up to `count`.
        moved: number of blocks that were set in motion.
        of_all: those that fail, as a share of the blocks of all modes.
        of_mode: the same as a share of the blocks of the mode; None without blocks.
        open_of_all: those of which it is open whether they fail, as a share of all.
        displacement_m: quantiles and the greatest of the displacements along the base of those
            blocks that were followed to the end and are not past recovery, those at rest
            included; None without any. Topples are not among them.
    """

    mode: ModeName | None
    count: int
    outcomes: Mapping[str, int]
    moved: int
    of_all: CountedShare
    of_mode: CountedShare | None
    open_of_all: float
    displacement_m: dict[str, float] | None

    @property
    def fails(self) -> int:
        """Number of blocks that fail by the motion, without those unstable at rest."""
        return self.outcomes["fails"]

    @property
    def open(self) -> int:
        """Number of blocks with an undetermined outcome."""
        return sum(self.outcomes[name] for name in OPEN)


@dataclass(frozen=True)
class ScaleFailures:
    """Failures of the blocks at one scale of the motion.

    Args:
        scale: factor on the motion.
        pga_g: its PGA [g].
        modes: by mode, for the modes that have blocks.
    """

    scale: float
    pga_g: float
    modes: Mapping[ModeName, ModeFailures]
    total: ModeFailures


def failures(shaken: ShakenMass, level: float = 0.95) -> tuple[ScaleFailures, ...]:
    """Count the failures of the blocks, scale by scale."""
    realisations = shaken.realisations
    chosen = {mode: realisations.of_mode(mode) for mode in MODES}
    return tuple(
        ScaleFailures(
            scale,
            float(shaken.pga_g[i]),
            {
                mode: _count(shaken, i, mode, blocks, level)
                for mode, blocks in chosen.items()
                if blocks.any()
            },
            _count(shaken, i, None, realisations.is_block, level),
        )
        for i, scale in enumerate(shaken.shaking.scales)
    )


def _count(
    shaken: ShakenMass, i: int, mode: ModeName | None, chosen: NDArray[np.bool_], level: float
) -> ModeFailures:
    count = int(np.count_nonzero(chosen))
    code = shaken.code[i]
    by_code = np.bincount(code[chosen], minlength=len(OUTCOMES)).tolist()
    outcomes = dict(zip(OUTCOMES, by_code, strict=True))
    n = shaken.realisations.n_blocks
    to_the_end = chosen & ~np.isin(code, [OUTCOMES.index(name) for name in OPEN])
    # the toe of a topple that holds has no displacement to tell
    slides = shaken.realisations.in_time.stability.mode_code != TOPPLE
    slid = shaken.displacement_m[i, to_the_end & slides]
    slid = slid[np.isfinite(slid)]
    return ModeFailures(
        mode=mode,
        count=count,
        outcomes=outcomes,
        moved=int(np.count_nonzero(chosen & shaken.moves[i] & (code != AT_REST))),
        of_all=CountedShare.of(outcomes["fails"], n, level),
        of_mode=CountedShare.of(outcomes["fails"], count, level) if count else None,
        open_of_all=sum(outcomes[name] for name in OPEN) / n,
        displacement_m=_quantiles(slid) if slid.size else None,
    )


def _quantiles(values: NDArray[np.float64]) -> dict[str, float]:
    numbers = np.quantile(values, QUANTILES).tolist()
    named = {f"q{100 * q:02.0f}": number for q, number in zip(QUANTILES, numbers, strict=True)}
    return {**named, "max": float(values.max())}


def failures_as_dict(
    shaken: ShakenMass, scales: Sequence[ScaleFailures], level: float
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
                "scale": result.scale,
                "pga_g": result.pga_g,
                "pgv_m_s": result.scale * shaking.motion.pgv_m_s,
                "modes": {mode: _counts(of_mode) for mode, of_mode in result.modes.items()},
                "all": _counts(result.total),
                "final_modes": final_modes(shaken, i),
            }
            for i, result in enumerate(scales)
        ],
    }


def final_modes(shaken: ShakenMass, i: int) -> dict[ModeName, dict[str, int]]:
    """Return the number of blocks by initial and final mode at one scale; ``none``: never moved."""
    names = (*MODES, "none")
    table = {}
    for mode in MODES:
        blocks = shaken.realisations.of_mode(mode)
        if blocks.any():
            counts = np.bincount(shaken.final_code[i, blocks] % len(names), minlength=len(names))
            table[mode] = dict(zip(names, counts.tolist(), strict=True))
    return table


def failure_warnings(shaken: ShakenMass) -> list[str]:
    """Return warnings about the motion, and about blocks with their number."""
    by_mode = {mode: int(shaken.realisations.of_mode(mode).sum()) for mode in MODES}
    return [
        *shaken.warnings,
        *(
            Diagnostic(
                f"{count} of {by_mode[mode]} blocks of mode {words_of_mode(mode)}: {text}",
                "model_limits",
            )
            for (mode, text), count in shaken.about.items()
        ),
    ]


def _counts(failures: ModeFailures) -> dict[str, Any]:
    return {
        "count": failures.count,
        **failures.outcomes,
        "moved": failures.moved,
        "open": failures.open,
        "fails_of_all": failures.of_all.as_dict(),
        "fails_of_mode": None if failures.of_mode is None else failures.of_mode.as_dict(),
        "open_of_all": failures.open_of_all,
        "displacement_m": failures.displacement_m,
    }


def outcome_columns(shaken: ShakenMass) -> dict[str, NDArray[Any]]:
    """Return the columns of the block table, one row per realisation and scale."""
    columns = block_columns(shaken.realisations)
    reason = columns.pop("reason")
    scales = np.array(shaken.shaking.scales)
    m, n = shaken.code.shape
    names = np.array([*OUTCOMES, ""], dtype=object)
    run = np.isin(names.astype(str), ("stays", "fails", *OPEN)) & (names != "bond_breaks")
    ways = np.where(run, FOLLOWED, np.where(names == "", "", BY_MECHANICS)).astype(object)
    return {
        **{name: np.tile(values, m) for name, values in columns.items()},
        "scale": np.repeat(scales, n),
        "pga_g": np.repeat(shaken.pga_g, n),
        "outcome": names[shaken.code.reshape(-1)],
        "final_mode": np.array([*MODES, ""], dtype=object)[shaken.final_code.reshape(-1)],
        "how": ways[shaken.code.reshape(-1)],
        "displacement_m": shaken.displacement_m.reshape(-1),
        "rotation_deg": np.degrees(shaken.rotation_rad.reshape(-1)),
        "reason": np.tile(reason, m),
    }
