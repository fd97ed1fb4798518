"""Counts of the blocks of a rock mass by mode: states, yields, and failures under a motion."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbfrag.fragility.confidence import checked_level
from rbfrag.rockmasses.joint_sets import Realisations
from rbfrag.rockmasses.shaking import AT_REST, OPEN, OUTCOMES, ShakenMass
from rbfrag.solver.results import FloatArray
from rbfrag.solver.stability.modes import MODES, STABLE, STATES, TOPPLE, ModeName, StateName

YIELD_QUANTILES = (0.05, 0.16, 0.5, 0.84, 0.95)
"""Quantiles of the yield acceleration that are reported."""

_SIGNIFICANT = 3.0
"""A mode leads where its count exceeds the other's by so many standard errors."""

_SLOPE_BLOCKS = 400


@dataclass(frozen=True)
class StateCount:
    """States and yield accelerations of a set of blocks.

    Args:
        states: number of blocks by state.
        yield_quantiles_g: yield acceleration of the stable ones at :data:`YIELD_QUANTILES` [g];
            empty if there are none.
    """

    states: dict[StateName, int]
    yield_quantiles_g: dict[float, float]


@dataclass(frozen=True)
class ModeCount(StateCount):
    """Blocks of one mode.

    Args:
        share_error: standard error of the share from the finite number of realisations.
        drained: the same blocks, in whichever mode, where their water drains as they start to
            move; None without water.
    """

    count: int
    share: float
    share_error: float
    drained: StateCount | None


@dataclass(frozen=True)
class EqualCounts:
    """PGA at which equally many blocks of two modes have reached yield.

    Args:
        below: the mode with more blocks of lower yield below this PGA.
        above: the mode with more of them above it.
        pga_g: peak ground acceleration [g].
        standard_error_g: its standard error from the finite number of realisations [g].
        count: number of blocks of either mode with a yield below it.
    """

    below: ModeName
    above: ModeName
    pga_g: float
    standard_error_g: float
    count: float


def mode_counts(realisations: Realisations) -> dict[ModeName, ModeCount]:
    """Return the blocks by mode, in the order of the mode codes."""
    drained = realisations.drained
    counts: dict[ModeName, ModeCount] = {}
    for mode in MODES:
        of_mode = realisations.of_mode(mode)
        count = int(np.count_nonzero(of_mode))
        share = count / realisations.n_blocks
        counts[mode] = ModeCount(
            count=count,
            share=share,
            share_error=math.sqrt(share * (1.0 - share) / realisations.n_blocks),
            drained=None if drained is None else _state_count(drained, of_mode),
            **vars(_state_count(realisations, of_mode)),
        )
    return counts


def _state_count(realisations: Realisations, chosen: NDArray[np.bool_]) -> StateCount:
    """Return the states and yield accelerations of blocks, shape (n,)."""
    stability = realisations.stability
    by_state = np.bincount(stability.state_code[chosen], minlength=len(STATES)).tolist()
    stable = stability.yield_acceleration[chosen & (stability.state_code == STABLE)]
    values = np.quantile(stable, YIELD_QUANTILES).tolist() if stable.size else []
    return StateCount(
        dict(zip(STATES, by_state, strict=True)), dict(zip(YIELD_QUANTILES, values, strict=False))
    )


def sorted_yields(realisations: Realisations, mode: ModeName) -> FloatArray:
    """Return the sorted yield accelerations of a mode [g]; blocks unstable at rest count as 0.

    Locked blocks, which no horizontal acceleration moves, are left out.
    """
    k = realisations.stability.yield_acceleration[realisations.of_mode(mode)]
    return np.sort(np.maximum(k[k < math.inf], 0.0))


def cumulative_counts(
    realisations: Realisations, mode: ModeName, pga_g: FloatArray
) -> NDArray[np.int64]:
    """Return the number of blocks of a mode with a yield acceleration of at most PGA.

    These are counts of blocks, not shares of their mode: the curves of two modes may be compared.

    Args:
        pga_g: accelerations [g], shape (m,).
    """
    return np.searchsorted(sorted_yields(realisations, mode), pga_g, side="right").astype(np.int64)


def crossings(realisations: Realisations) -> list[EqualCounts]:
    """Return the PGA at which the cumulative counts of two modes cross, in increasing order.

    A crossing lies between two ranges of PGA in which one mode and then the other leads by more
    than three standard errors of the difference; closer races are chance. Its own standard error
    is that of the difference of the counts, over the slope of the difference.
    """
    yields = {mode: sorted_yields(realisations, mode) for mode in MODES}
    result = []
    for first, second in combinations(MODES, 2):
        if not (yields[first].size and yields[second].size):
            continue
        k = np.unique(np.concatenate([yields[first], yields[second]]))
        count_a, count_b = (
            np.searchsorted(yields[mode], k, side="right") for mode in (first, second)
        )
        lead, total = count_a - count_b, count_a + count_b
        clear = np.flatnonzero(np.abs(lead) > _SIGNIFICANT * np.sqrt(total))
        for i in np.flatnonzero(np.diff(np.sign(lead[clear]))):
            start, end = int(clear[i]), int(clear[i + 1])
            # Between the two, chance lets the difference change sign more than once.
            steps = np.arange(start + 1, end + 1)
            turned = steps[np.sign(lead[steps]) != np.sign(lead[steps - 1])]
            middle = int(turned[turned.size // 2])
            half = max(1, min(_SLOPE_BLOCKS, k.size // 10))
            low, high = max(middle - half, 0), min(middle + half, k.size - 1)
            slope = abs(float(lead[high] - lead[low])) / float(k[high] - k[low])
            below, above = (first, second) if lead[start] > 0 else (second, first)
            result.append(
                EqualCounts(
                    below=below,
                    above=above,
                    pga_g=float(k[middle]),
                    standard_error_g=math.sqrt(float(total[middle])) / slope
                    if slope > 0.0
                    else math.inf,
                    count=0.5 * float(total[middle]),
                )
            )
    return sorted(result, key=lambda crossing: crossing.pga_g)


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

    count: int
    outcomes: Mapping[str, int]
    moved: int
    of_all: CountedShare
    of_mode: CountedShare | None
    open_of_all: float
    displacement_m: dict[str, float] | None

    def as_dict(self) -> dict[str, Any]:
        """Return the failures under the keys of the JSON contract."""
        return {
            "count": self.count,
            **self.outcomes,
            "moved": self.moved,
            "open": self.open,
            "fails_of_all": self.of_all.as_dict(),
            "fails_of_mode": None if self.of_mode is None else self.of_mode.as_dict(),
            "open_of_all": self.open_of_all,
            "displacement_m": self.displacement_m,
        }

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
                mode: _count(shaken, i, blocks, level)
                for mode, blocks in chosen.items()
                if blocks.any()
            },
            _count(shaken, i, realisations.is_block, level),
        )
        for i, scale in enumerate(shaken.shaking.scales)
    )


def _count(shaken: ShakenMass, i: int, chosen: NDArray[np.bool_], level: float) -> ModeFailures:
    count = int(np.count_nonzero(chosen))
    code = shaken.code[i]
    by_code = np.bincount(code[chosen], minlength=len(OUTCOMES)).tolist()
    outcomes = dict(zip(OUTCOMES, by_code, strict=True))
    blocks = shaken.realisations.n_blocks
    to_the_end = chosen & ~np.isin(code, [OUTCOMES.index(name) for name in OPEN])
    # the toe of a topple that holds has no displacement to tell
    slides = shaken.realisations.in_time.stability.mode_code != TOPPLE
    slid = shaken.displacement_m[i, to_the_end & slides]
    slid = slid[np.isfinite(slid)]
    displacements: dict[str, float] = {}
    if slid.size:
        numbers = np.quantile(slid, QUANTILES).tolist()
        displacements = {f"q{100 * q:02.0f}": n for q, n in zip(QUANTILES, numbers, strict=True)}
        displacements["max"] = float(slid.max())
    return ModeFailures(
        count=count,
        outcomes=outcomes,
        moved=int(np.count_nonzero(chosen & shaken.moves[i] & (code != AT_REST))),
        of_all=CountedShare.of(outcomes["fails"], blocks, level),
        of_mode=CountedShare.of(outcomes["fails"], count, level) if count else None,
        open_of_all=sum(outcomes[name] for name in OPEN) / blocks,
        displacement_m=displacements or None,
    )
