"""How often per year a block topples, with honest uncertainty: `hazard`."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rbfrag.errors import InputError
from rbfrag.fragility.lookup import find_model
from rbfrag.fragility.model import FragilityModel
from rbfrag.fragility.predict import Model, answer_given
from rbfrag.fragility.prediction_array import PredictionArray
from rbfrag.hazards.annual_rate import checked_years, failure_rate, normal_steps, probability_in
from rbfrag.hazards.conversions import CONVERSIONS, velocity_conversion
from rbfrag.hazards.conversions import component as component_named
from rbfrag.hazards.curve import ANSWERED, HazardCurve

FloatArray = NDArray[np.float64]

_SCATTER_POINTS = 25
_REACH = 6.0
"""Standard deviations of the scatter that are integrated over, to both sides."""
_STEP = 0.1
"""Greatest step of the measure's logarithm."""
_CHUNK = 512
_NOTABLE = 0.01


@dataclass(frozen=True, eq=False)
class HazardAnswer:
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
    warnings: tuple[str, ...]


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
    warnings = list(curve.warnings)
    name, factor, spread = _measure(curve, convert, convert_sigma, warnings)
    meaning = component_named("single" if component is None else component)
    if component is None:
        warnings.append(
            "the curve's horizontal component is taken as a single one, which the models are "
            "fitted on; hazard products often mean rotd50 or the geometric mean: say which"
        )
    else:
        warnings.append(
            f"the curve is of {meaning.title}; Beyer and Bommer (2006) relate it to one component"
            if meaning.name != "single"
            else "the curve is of a single component, as the models are"
        )
    scatter = math.hypot(meaning.scatter, spread)
    steps = max(_SCATTER_POINTS, 2 * math.ceil(_REACH * scatter / _STEP) + 1)
    xi, weight = normal_steps(1 if scatter == 0.0 else steps, _REACH)
    shift = factor / meaning.ratio * np.exp(scatter * xi)

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
    _tails(curve, rate, above, above_at_most, below, warnings)
    edges = parts[0][1].edges
    shaking = {name: factor / meaning.ratio * np.sqrt(edges[None, 1:] * edges[None, :-1])}
    outside = ~_predicted(p2s[:, None], krs[:, None], shaking, chosen, level).in_domain
    if one_class:
        outside = outside.mean(axis=0, keepdims=True)
    part = (outside * contribution).sum(axis=1) / np.maximum(rate, np.finfo(np.float64).tiny)
    if (part > _NOTABLE).any():
        warnings.append(
            f"up to {100.0 * float(part.max()):.3g} % of the rate comes from blocks and shaking "
            "outside the ranges that the model was fitted on"
        )
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
        warnings=tuple(warnings),
    )


def _measure(
    curve: HazardCurve, convert: str | None, sigma: float | None, warnings: list[str]
) -> tuple[str, float, float]:
    """Return predict's argument, the factor from the curve's unit, and the scatter about it."""
    if convert is None:
        if sigma is not None:
            raise InputError("--convert-sigma belongs to --convert: leave it out")
        if curve.known_as is None:
            raise InputError(_no_model(curve))
        return curve.known_as, 1.0, 0.0
    if curve.measure != "sa_g":
        raise InputError(
            f"{curve.source}: --convert {convert} is for spectral accelerations; the curve is of "
            f"{curve.imt}"
        )
    used = velocity_conversion(convert)
    if not curve.is_of(used.period_s):
        raise InputError(
            f"{curve.source}: {used.name} is for SA({used.period_s:g}), not for {curve.imt}: "
            f"choose the curve with --imt 'SA({used.period_s:g})'"
        )
    spread = used.scatter if sigma is None else sigma
    if not 0.0 < spread < math.inf:
        raise InputError(
            f"--convert-sigma = {spread:g}: give the standard deviation of ln PGV about the "
            "conversion, above zero; no conversion is without scatter"
        )
    warnings.append(
        f"PGV = {used.factor:.4g} m/s per g times {curve.imt} in the median ({used.source}); "
        f"ln PGV scatters about it by {spread:g}, which is integrated"
    )
    if curve.known_as is not None:
        warnings.append(
            f"there are models of {curve.imt} itself: without --convert nothing is converted"
        )
    return "pgv_m_s", used.factor, spread


def _no_model(curve: HazardCurve) -> str:
    also = [item.name for item in CONVERSIONS.values() if curve.is_of(item.period_s)]
    converted = f", or convert it to PGV with --convert {' or '.join(also)}" if also else ""
    return (
        f"{curve.source}: no model reads {curve.imt}: give a curve of one of {ANSWERED}{converted}"
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


def _tails(
    curve: HazardCurve,
    rate: FloatArray,
    above: FloatArray,
    above_at_most: FloatArray,
    below: FloatArray,
    warnings: list[str],
) -> None:
    unit = curve.measure.replace("sa_g", curve.imt + " in g")
    open_above = above_at_most - above > _NOTABLE * rate
    if open_above.any():
        worst = float((above_at_most - above)[open_above].max())
        warnings.append(
            f"the curve ends at {unit} = {curve.levels[-1]:g}: stronger shaking may add up to "
            f"{worst:.3g} failures a year to the answer"
        )
    if (below > _NOTABLE).any():
        warnings.append(
            f"the curve begins at {unit} = {curve.levels[0]:g}, where the probability of failure "
            f"is already {float(below.max()):.3g}: weaker shaking is not counted"
        )
