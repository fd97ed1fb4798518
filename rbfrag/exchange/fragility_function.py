"""A fragility as other tools write it: lognormal, or probabilities at levels of a measure."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ndtr

from rbfrag.errors import InputError
from rbfrag.hazards.measure_type import IntensityType
from rbfrag.solver.results import FloatArray


@dataclass(frozen=True, eq=False)
class FragilityFunction:
    """One limit state of one asset.

    Levels are in the unit of `kind.measure`: g or m/s.

    Args:
        name: identifier of the asset.
        limit_state: name of the limit state.
        kind: what the levels measure.
        median: median of a lognormal function, or None.
        beta: standard deviation of its logarithm, or None.
        levels: levels of a discrete function, rising, shape (n,), or None.
        probability: probabilities at them, never falling, shape (n,), or None.
        no_damage_limit: level below which the probability is zero, or None.
        grid_error: largest error of linear interpolation between the levels, if known.
    """

    name: str
    limit_state: str
    kind: IntensityType
    median: float | None = None
    beta: float | None = None
    levels: FloatArray | None = None
    probability: FloatArray | None = None
    no_damage_limit: float | None = None
    grid_error: float | None = None

    @property
    def is_lognormal(self) -> bool:
        """Whether the function is a lognormal distribution."""
        return self.median is not None

    def at(self, level: ArrayLike) -> FloatArray:
        """Return probabilities at levels, as the other tool would.

        Discrete functions are interpolated linearly; beyond their ends the probability stays,
        and below `no_damage_limit` it is zero.
        """
        x = np.asarray(level, dtype=np.float64)
        if self.median is not None and self.beta is not None:
            with np.errstate(divide="ignore"):
                p = ndtr(np.log(x / self.median) / self.beta)
        else:
            assert self.levels is not None
            assert self.probability is not None
            p = np.interp(x, self.levels, self.probability)
        if self.no_damage_limit is not None:
            p = np.where(x < self.no_damage_limit, 0.0, p)
        return np.asarray(p, dtype=np.float64)


def discrete_function(
    name: str,
    limit_state: str,
    kind: IntensityType,
    levels: FloatArray,
    probability: FloatArray,
    where: str,
    no_damage_limit: float | None = None,
) -> FragilityFunction:
    """Return a checked function of probabilities at levels."""
    if levels.size < 2 or levels.size != probability.size:
        raise InputError(
            f"{where}: {levels.size} levels and {probability.size} probabilities: at least two of "
            "each, as many of one as of the other, are wanted"
        )
    if not (np.isfinite(levels).all() and (levels >= 0.0).all() and (np.diff(levels) > 0).all()):
        raise InputError(f"{where}: the levels must rise from zero or above")
    if not ((probability >= 0.0) & (probability <= 1.0)).all():
        raise InputError(f"{where}: a probability lies outside 0 to 1")
    if (np.diff(probability) < 0.0).any():
        raise InputError(f"{where}: the probability falls with rising level")
    return FragilityFunction(
        name, limit_state, kind, None, None, levels, probability, no_damage_limit
    )


def lognormal_function(
    name: str,
    limit_state: str,
    kind: IntensityType,
    median: float,
    beta: float,
    where: str,
    no_damage_limit: float | None = None,
) -> FragilityFunction:
    """Return a checked lognormal function."""
    for value, what in ((median, "median"), (beta, "standard deviation of the logarithm")):
        if not (np.isfinite(value) and value > 0.0):
            raise InputError(f"{where}: the {what} is {value:g}: it must be above zero")
    return FragilityFunction(name, limit_state, kind, median, beta, no_damage_limit=no_damage_limit)
