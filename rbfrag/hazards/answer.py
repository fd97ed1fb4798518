"""How often per year a block topples, with honest uncertainty: `hazard`."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rbfrag.fragility.lookup import find_model
from rbfrag.fragility.model import FragilityModel
from rbfrag.fragility.predict import Model, answer_given
from rbfrag.fragility.prediction_array import PredictionArray
from rbfrag.frames import Tabular
from rbfrag.hazards.annual_rate import checked_years, failure_rate, probability_in
from rbfrag.hazards.curve import HazardCurve
from rbfrag.hazards.joint_rate import JointRate
from rbfrag.hazards.shaking import NOTABLE, Shaking, warn_of_ends
from rbfrag.hazards.standing_blocks import ModelBlocks

FloatArray = NDArray[np.float64]

_CHUNK = 512


@dataclass(frozen=True, eq=False, repr=False)
class HazardAnswer(Tabular):
    """Annual rates of toppling of m blocks at one site.

    Args:
        annual_rate: mean number of failures a year [1/a], shape (m,); NaN for a block that
            cannot be used.
        ci_low: lower end of the interval from the uncertain parameters of the model.
        ci_high: upper end of it.
        probability: probability of at least one failure in `years`, shape (m,).
        years: the period [a].
        level: confidence level of the interval.
        model: name of the model that answered.
        term: its intensity term.
        method: how it was fitted.
        edges: levels of the curve's measure between which contributions are given, (k + 1,).
        contribution: part of each rate from each interval [1/a], shape (m, k).
        above: part from beyond the last level, at least [1/a], shape (m,).
        above_at_most: the same at most.
        measure: measure of `edges`: ``pga_g``, ``pgv_m_s`` or ``sa_g``.
        joint: earthquakes with at least one failure among several blocks; None for one block.
        warnings: what to know about the answer.
    """

    annual_rate: FloatArray
    ci_low: FloatArray
    ci_high: FloatArray
    probability: FloatArray
    years: float
    level: float
    model: str
    term: str
    method: str
    edges: FloatArray
    contribution: FloatArray
    above: FloatArray
    above_at_most: FloatArray
    measure: str
    joint: JointRate | None
    warnings: tuple[str, ...]

    @property
    def annual_rate_any(self) -> float | None:
        """Annual rate of earthquakes with at least one failure [1/a].

        None for several blocks whose dependence is not known: `joint` has its bounds.
        """
        return float(self.annual_rate[0]) if self.joint is None else self.joint.annual_rate_any

    @property
    def expected_failures_per_year(self) -> float:
        """Mean number of failures a year of all blocks [1/a], the sum of their rates."""
        return float(self.annual_rate.sum())


def hazard(
    curve: HazardCurve,
    p2: ArrayLike,
    kr: ArrayLike,
    *,
    convert: str | None = None,
    convert_sigma: float | None = None,
    component: str | None = None,
    years: float = 50.0,
    model: Model | None = None,
    level: float = 0.95,
    db: str | PathLike[str] | None = None,
    one_class: bool = False,
) -> HazardAnswer:
    """Return how often per year blocks topple under a seismic hazard curve.

    λ_f = ∫ P(topples | x) (-dλ), see :func:`rbfrag.hazards.annual_rate.failure_rate`. The
    ends of the interval are the integrals of the ends of the fragility's own interval; since
    these are taken at every level at once, the interval is at least as wide as one from the
    joint distribution of the parameters. The model is one of the curve's own measure: what else
    shaking of that level may be is scatter in its P.

    Several blocks stand at one site and share its earthquakes: their rates add up to the failures
    expected a year, and `joint` has the rate of earthquakes in which any of them fails.

    Args:
        curve: hazard curve of PGV, PGA or a spectral acceleration at 0.3, 1, 2 or 3 s, or of one
            that `convert` is for.
        p2: frequency parameters p² [1/s²], scalar or shape (m,).
        kr: toppling yield acceleration coefficients, scalar or shape (m,).
        convert: name of a published conversion from spectral acceleration to PGV, whose scatter
            is integrated.
        convert_sigma: standard deviation of ln PGV about the conversion; None for that of the
            motions of the shipped reference.
        component: what the curve's horizontal component means: single, geometric_mean,
            rotd50 or larger; None for single, with a warning.
        years: period for the probability [a].
        model: as in :func:`rbfrag.predict`.
        level: confidence level of the interval.
        db: as in :func:`rbfrag.predict`.
        one_class: the blocks stand for one class, and the answer is the rate of a block drawn
            from it: one rate, by the mean of their fragilities.

    Raises:
        InputError: no model reads the curve's measure, or a value that cannot be used.
        UnknownModelError: no model of that name.
        DatabaseError: the database cannot be read.
    """
    p2s, krs = (np.ravel(values) for values in np.broadcast_arrays(p2, kr))
    checked_years(years)
    reading = Shaking.of(curve, convert=convert, convert_sigma=convert_sigma, component=component)
    name, shift, weight = reading.name, reading.shift, reading.weight
    warnings = list(reading.warnings)
    chosen = find_model(model, ("p2", "kr", name), db)
    if chosen.term.advice:
        warnings.append(chosen.term.advice)
    parts = []
    for start in range(0, 0 if one_class else p2s.size, _CHUNK):
        some = slice(start, start + _CHUNK)

        def bands(levels: FloatArray, some: slice = some) -> FloatArray:
            """Return P and the two ends of its interval for blocks x levels, stacked."""
            shaking = {name: (levels[:, None] * shift).reshape(1, -1)}
            answer = _predicted(p2s[some, None], krs[some, None], shaking, chosen, level)
            stacked = np.concatenate([answer.probability, answer.ci_low, answer.ci_high])
            averaged: FloatArray = stacked.reshape(-1, levels.size, shift.size) @ weight
            return averaged

        parts.append((p2s[some].size, failure_rate(curve, bands)))
    if one_class:
        mean = _mean_bands(curve, p2s, krs, name, shift, chosen, level)
        parts.append((1, failure_rate(curve, lambda levels: mean(levels) @ weight)))

    def joined(name: str, row: int = 0) -> FloatArray:
        """Return one value of all blocks; of the rates, the rows are P and its two ends."""
        values = [getattr(part, name)[row * m : (row + 1) * m] for m, part in parts]
        return np.concatenate(values)

    rate, low, high = (joined("annual_rate", row) for row in range(3))
    contribution, below = joined("contribution"), joined("below")
    above, above_at_most = joined("above"), joined("above_at_most")
    warn_of_ends(curve, rate, above, above_at_most, below, warnings)
    edges = parts[0][1].edges
    shaking = {name: reading.median * np.sqrt(edges[None, 1:] * edges[None, :-1])}
    outside = ~_predicted(p2s[:, None], krs[:, None], shaking, chosen, level).in_domain
    if one_class:
        outside = outside.mean(axis=0, keepdims=True)
    part = (outside * contribution).sum(axis=1) / np.maximum(rate, np.finfo(np.float64).tiny)
    if (part > NOTABLE).any():
        warnings.append(
            f"up to {100.0 * float(part.max()):.3g} % of the rate comes from blocks and shaking "
            "outside the ranges that the model was fitted on"
        )
    joint = None
    if p2s.size > 1 and not one_class:
        blocks = ModelBlocks.certain(p2s, krs, shaking=reading, model=chosen, level=level)
        joint = JointRate.of(blocks, curve, years)
        warnings.extend(joint.warnings)
    return HazardAnswer(
        annual_rate=rate,
        ci_low=low,
        ci_high=high,
        probability=probability_in(years, rate),
        years=years,
        level=level,
        model=chosen.name,
        term=chosen.term.name,
        method=chosen.row.method,
        edges=edges,
        contribution=contribution,
        above=above,
        above_at_most=above_at_most,
        measure=curve.measure,
        joint=joint,
        warnings=tuple(warnings),
    )


def _mean_bands(
    curve: HazardCurve,
    p2: FloatArray,
    kr: FloatArray,
    name: str,
    shift: FloatArray,
    model: FragilityModel,
    level: float,
) -> Callable[[FloatArray], FloatArray]:
    """Return a function for P and its two ends, (3, levels, shifts), meaned over the blocks.

    The means are tabled on steps of 1 % and interpolated by monotone cubics: a mean over blocks
    is smooth, and thousands of blocks at every node of the integral would take minutes.
    """
    from scipy.interpolate import PchipInterpolator

    end = curve.levels[-1] if curve.end_level is None else curve.end_level
    low, high = math.log(curve.levels[0] * shift.min()), math.log(end * shift.max())
    u = np.linspace(low, high, max(64, math.ceil((high - low) / 0.01)))
    total = np.zeros((3, u.size))
    for start in range(0, p2.size, _CHUNK):
        some = slice(start, start + _CHUNK)
        shaking = {name: np.exp(u)[None, :]}
        answer = _predicted(p2[some, None], kr[some, None], shaking, model, level)
        bands_of = (answer.probability, answer.ci_low, answer.ci_high)
        total += np.array([values.sum(axis=0) for values in bands_of])
    total[total < 1e-100] = 0.0  # the cubics divide by differences
    smooth = PchipInterpolator(u, total / p2.size, axis=1)

    def bands(levels: FloatArray) -> FloatArray:
        x = np.clip(np.log(levels[:, None] * shift), low, high)
        return np.asarray(smooth(x), dtype=np.float64)

    return bands


def _predicted(
    p2: FloatArray, kr: FloatArray, shaking: dict[str, Any], model: FragilityModel, level: float
) -> PredictionArray:
    answer = answer_given(model, {"p2": p2, "kr": kr, **shaking}, level)
    assert isinstance(answer, PredictionArray)
    return answer
