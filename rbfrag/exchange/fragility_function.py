"""Fragility functions of other tools: lognormal, or probabilities at levels of a measure."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import groupby

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import ndtr

from rbfrag.errors import InputError
from rbfrag.hazards.curve import IntensityType
from rbfrag.results.diagnostic import Diagnostic
from rbfrag.solver.results import FloatArray

JUMP = 1e-5
"""Ratio, less 1, of the two levels that a jump of P stands between: all that six digits tell."""

_ROUNDS, _TRIED = 4, 12


@dataclass(frozen=True, eq=False)
class FragilityFunction:
    """Fragility function of one limit state of one asset.

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
        grid_error: largest error of linear interpolation between the levels, relative to P, if
            known.
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
        """True if the function is a lognormal distribution."""
        return self.median is not None

    def at(self, level: ArrayLike) -> FloatArray:
        """Return probabilities at levels, interpolated as the other tool does.

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
            f"{where}: {levels.size} levels and {probability.size} probabilities: give at least "
            "two of each, in equal numbers"
        )
    if not (np.isfinite(levels).all() and (levels >= 0.0).all() and (np.diff(levels) > 0).all()):
        raise InputError(f"{where}: the levels must increase from zero or above")
    if not ((probability >= 0.0) & (probability <= 1.0)).all():
        raise InputError(f"{where}: a probability lies outside 0 to 1")
    if (np.diff(probability) < 0.0).any():
        raise InputError(f"{where}: the probability decreases with increasing level")
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
    for value, label in ((median, "median"), (beta, "standard deviation of the logarithm")):
        if not (np.isfinite(value) and value > 0.0):
            raise InputError(f"{where}: the {label} is {value:g}: it must be above zero")
    return FragilityFunction(name, limit_state, kind, median, beta, no_damage_limit=no_damage_limit)


def chords(
    x: FloatArray, p: FloatArray, levels: int, floor: float
) -> Iterator[tuple[FloatArray, FloatArray, float]]:
    """Yield levels of discrete functions, probabilities at them, and their largest relative error.

    Each chord is the longest whose error stays within ε max(P, floor); the least ε for which the
    levels suffice is sought. P is 0 below the first level, which a pair of levels shows.

    Args:
        x: levels, rising, of m assets, shape (m, n).
        p: probabilities at them of s limit states, never falling, shape (m, s, n).
        levels: greatest number of levels.
        floor: the least P to which errors are relative.
    """
    if levels < 10:
        raise InputError(f"levels = {levels}: a discrete fragility function requires at least 10")
    every = np.arange(len(x))
    low, high = np.full(len(x), 1e-7), np.full(len(x), 1.0 / floor)
    for _ in range(_ROUNDS):
        error = np.geomspace(low, high, _TRIED, axis=1)
        starts = _longest(x, p, error, floor)
        # with the last level and the one where P is still 0
        enough = np.argmax(starts.sum(axis=0) + 2 <= levels, axis=1)
        low, high = error[every, np.maximum(enough - 1, 0)], error[every, enough]
    for i in every:
        at = np.append(np.flatnonzero(starts[:, i, enough[i]]), x.shape[1] - 1)
        shown = np.concatenate([x[i, :1] * (1.0 - JUMP), x[i, at]])
        yield shown, np.pad(p[i][:, at], ((0, 0), (1, 0))), float(high[i])


def _longest(x: FloatArray, p: FloatArray, error: FloatArray, floor: float) -> NDArray[np.bool_]:
    """Return the levels at which chords begin, shape (n - 1, m, e), for errors of shape (m, e)."""
    starts = np.zeros((x.shape[1] - 1, *error.shape), dtype=bool)
    starts[0] = True
    steepest = np.full(p.shape[:2] + error.shape[1:], np.inf)
    gentlest = -steepest
    x0, p0 = x[:, 0, None], p[:, :, 0, None]
    for k in range(1, x.shape[1]):
        at, value = x[:, k, None], p[:, :, k, None]
        slope = (value - p0) / (at - x0)[:, None]
        ends = ((slope > steepest) | (slope < gentlest)).any(axis=1)
        starts[k - 1] |= ends
        x0, off = np.where(ends, x[:, k - 1, None], x0), np.expand_dims(ends, 1)
        p0 = np.where(off, p[:, :, k - 1, None], p0)
        run = (at - x0)[:, None]
        slope, play = (value - p0) / run, error[:, None] * np.maximum(value, floor) / run
        steepest = np.minimum(np.where(off, np.inf, steepest), slope + play)
        gentlest = np.maximum(np.where(off, -np.inf, gentlest), slope - play)
    return starts


def renamed(
    functions: Sequence[FragilityFunction], rejected: str, by: str, why: str
) -> tuple[list[FragilityFunction], list[Diagnostic]]:
    """Return the functions with invalid characters of their names replaced, and a warning.

    Args:
        rejected: characters that a name cannot have.
        by: what stands for each of them.
        why: what is wrong with them.
    """
    to = str.maketrans(dict.fromkeys(rejected, by))
    named = [replace(function, name=function.name.strip().translate(to)) for function in functions]
    before = list(dict.fromkeys(function.name for function in functions))
    changed = [name for name in before if name.strip() != name.strip().translate(to)]
    if not changed:
        return named, []
    text = (
        f"{len(changed)} of {len(before)} IDs have {by!r} for what {why}: {changed[0]!r} is "
        f"written as {changed[0].strip().translate(to)!r}; name it so in the exposure"
    )
    return named, [Diagnostic(text, "renamed")]


def assets_of(functions: Sequence[FragilityFunction]) -> dict[str, list[FragilityFunction]]:
    """Return the functions grouped by asset; reject duplicate or inconsistent limit states."""
    if not functions:
        raise InputError("no fragility function to write")
    assets: dict[str, list[FragilityFunction]] = {}
    for name, group in groupby(functions, key=lambda function: function.name):
        limit_states = list(group)
        if name in assets or len({function.limit_state for function in limit_states}) < len(
            limit_states
        ):
            raise InputError(f"block {name!r} occurs twice: give every block its own block_id")
        assets[name] = limit_states
    first, states = (
        functions[0].name,
        [function.limit_state for function in assets[functions[0].name]],
    )
    for name, limit_states in assets.items():
        if [function.limit_state for function in limit_states] != states:
            raise InputError(f"block {name!r} has other limit states than {first!r}")
    return assets
