"""Annual rates of failure under hazard curves, with their uncertainty: `hazard`."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Any, Unpack

import numpy as np
from numpy.typing import ArrayLike

from rbfrag.errors import InputError, UnknownModelError
from rbfrag.fragility.confidence import quantiles_of
from rbfrag.fragility.validation import (
    FROM_MEAN,
    FROM_SUMS,
    describe_invalid,
    elements,
    reject_elements,
)
from rbfrag.hazards.branches import (
    Weights,
    branch_curves,
    curve_name,
    curve_warnings,
    first_curve_warnings,
    mixture_quantiles,
    reject_several_measures,
    weighted_quantiles,
)
from rbfrag.hazards.curve import (
    NOTABLE,
    CurveKeywords,
    HazardCurve,
    checked_years,
    describe_ends,
    is_truncated,
    probability_in,
    rate_bounds,
)
from rbfrag.hazards.curve_file import CurveLike
from rbfrag.hazards.hazard_answer import BranchRate, HazardAnswer
from rbfrag.hazards.joint_rate import JointRate, joint_at_sites
from rbfrag.hazards.rate_density import Indices, curve_mass
from rbfrag.hazards.rate_integration import (
    KernelBlocks,
    Rates,
    curve_contributions,
    half_width,
    interval_end,
    rates,
)
from rbfrag.hazards.shaking import (
    LAW_TAU,
    PGA_ALONE,
    SINGLE_CURVE,
    TAU,
    HazardLevel,
    RateKeywords,
    parts_by_model,
)
from rbfrag.question.drained_bound import is_wet, no_drained_bound, without_water
from rbfrag.question.fields import AnsweringFields
from rbfrag.question.keywords import LEVEL, parts_of
from rbfrag.results.diagnostic import Diagnostic, diagnostics
from rbfrag.results.numbers import percent, relative, return_period
from rbfrag.solver.quantity import finite_or_none
from rbfrag.solver.results import FloatArray
from rbfrag.vocabulary.quantities import ANSWERING, BLOCK, BLOCKS

QUANTILES = (0.05, 0.5, 0.95)
"""Quantiles of a rate over the branches of a logic tree and the model's own uncertainty."""

NUMERICAL_AIM = 1e-3
"""Relative error of quadrature of a block's rate above which a warning is issued."""

NEVER = 1e-9
"""Annual rate below which no such warning is given: such rates come from the last level alone."""


def hazard(
    curve: CurveLike | Sequence[CurveLike],
    *numbers: ArrayLike | None,
    weights: Weights | None = None,
    joint: bool = False,
    at_least: Sequence[int] | None = None,
    years: float = 50.0,
    one_class: bool = False,
    count: ArrayLike | None = None,
    **question: Unpack[RateKeywords[ArrayLike | None]],
) -> HazardAnswer:
    """Return the annual rates of failure of blocks under a seismic hazard curve.

    λ_f = ∫ P(fails | im) (-dν), ν the hazard curve, as a sum over the nodes of a grid
    (:mod:`rbfrag.hazards.rate_integration`). The interval is that of the model's parameters, by the
    delta method on ln λ_f. The model is one of the curve's own measure: it includes the variability
    between records of the same intensity. Block uncertainty is integrated.

    Several blocks stand at one site and share its earthquakes: their rates add up to the failures
    expected a year, and, where asked for, `joint` has the rate of earthquakes in which any of them
    fails.

    A block that cannot be used, such as one of k_r <= 0 or NaN, has the rate NaN and its `reason`;
    it is left out of sums, which a warning says.

    Several curves are branches of one logic tree with `weights`: rates and probabilities are the
    weighted means, `quantiles` their distribution. Without weights the first curve answers.

    The keywords:

    - the fields of blocks, with ``kind``, ``block`` and ``back_fracture``, as
      :func:`rbfrag.predict` has them, each a number or of shape (m,); ``kind`` may be one for all
      or one each.
    - ``imt``: measure of the curve to take of a file that holds several, such as SA(0.5).
    - ``site``: its site, by number or name, likewise.
    - ``convert``: name of a published conversion from spectral acceleration to PGV, whose scatter
      is integrated.
    - ``convert_sigma``: standard deviation of ln PGV about the conversion; None for that of the
      motions of the shipped reference.
    - ``component``: horizontal component of the curve: single, geometric_mean, rotd50, rotd100 or
      larger; None for that of the curve file, or else single, with a note.
    - ``disaggregation``: the OpenQuake engine's disaggregation of a curve of PGA by magnitude
      (Mag-*.csv or Mag_Dist-*.csv), by which PGV is taken from it.
    - ``model``, ``level``, ``db``: as in :func:`rbfrag.predict`.

    Args:
        curve: hazard curve of PGV, PGA or the spectral acceleration at 1 s, or of one
            that `convert` is for, or its file (OpenQuake CSV, USGS NSHM JSON, two columns); or
            several of one site and measure.
        numbers: p2 [1/s²] and kr of the blocks, if they are not given by name.
        weights: weight of each curve as a branch of a logic tree, None for one that is no branch,
            or OpenQuake's file of realizations; they sum to 1.
        joint: whether earthquakes in which any of several blocks fails are counted, too.
        at_least: numbers of failures in one earthquake whose rates are wanted, from 1 to m; None
            for usual ones; they ask for `joint`.
        years: period for the probability [a].
        one_class: the blocks stand for one class, and the answer is the rate of a block drawn
            from it: one rate, by the mean of their fragilities.
        count: number of identical blocks of each, shape (m,); None for one each.
        question: the keywords above.

    Raises:
        InputError: no model reads the curve's measure, curves of several measures or sites, weights
            that do not add up to 1, or no block that can be used.
        UnknownFieldError: a keyword that is none.
        UnknownModelError: no model of that name.
        DatabaseError: the database cannot be read.
    """
    inputs, meaning, answering = parts_of(
        numbers, question, BLOCKS, CurveKeywords.__optional_keys__, ANSWERING
    )
    curves, weight = branch_curves(curve, weights, meaning)

    def answer(blocks: Mapping[str, Any]) -> HazardAnswer:
        return hazard_at_sites(
            [curves], None, blocks, meaning, answering, weight=weight, joint=joint,
            at_least=at_least, years=years, one_class=one_class, count=count,
        )  # fmt: skip

    result = answer(inputs)
    if not is_wet(inputs):
        return result
    wet = np.asarray(inputs["water_m"], dtype=np.float64) > 0.0
    return with_drained_rates(result, lambda: answer(without_water(inputs)), wet)


def with_drained_rates(
    answer: HazardAnswer, drained: Callable[[], HazardAnswer], wet: ArrayLike
) -> HazardAnswer:
    """Return the rates of blocks with their drained rates, where these can be computed.

    Args:
        drained: returns the rates of the same blocks without water pressure.
        wet: behind which blocks water stands, shape (m,) or one for all.
    """
    try:
        bound = drained()
    except InputError as error:
        return replace(answer, warnings=(*answer.warnings, no_drained_bound(error)))
    return replace(answer, drained=np.where(wet, bound.annual_rate, np.nan))


def hazard_at_sites(
    sites: Sequence[Sequence[HazardCurve]],
    site: Indices | None,
    inputs: Mapping[str, Any],
    meaning: CurveKeywords,
    answering: AnsweringFields,
    *,
    weight: FloatArray | None = None,
    joint: bool = False,
    at_least: Sequence[int] | None = None,
    years: float = 50.0,
    one_class: bool = False,
    count: ArrayLike | None = None,
) -> HazardAnswer:
    """Return the annual rates of failure of blocks at several sites; see :func:`hazard`.

    Args:
        sites: curves of one measure of each site, as many of each.
        site: index of each block's site, shape (m,); None for one site.
        inputs: fields of the blocks, numbers or of shape (m,).
        meaning: what the levels of the curves are.
        answering: model, level and database.
        weight: weights of the curves of a site, NaN for one that is no branch; None where none is.
        count: number of identical blocks of each row, shape (m,); None for one each.
    """
    level, first = answering.get("level", LEVEL), [curves[0] for curves in sites]
    checked_years(years)
    reject_several_measures(curve for curves in sites for curve in curves)
    reading = HazardLevel.of(first[0], **meaning)
    by_law = reading.magnitudes_from_g is not None
    pga_alone = (PGA_ALONE,) if reading.name == "pga_g" else ()
    if pga_alone and answering.get("model") is None:
        named: list[str] = []
        with suppress(InputError, UnknownModelError):
            named = [part.model.name for part in parts_by_model(inputs, reading, answering)[0]]
        by_model = f", or accept the bias with model {named[0]}" if named else ""
        raise InputError(
            f"{first[0].source}: {pga_alone[0].partition(':')[0]}; give a curve of PGV or SA, "
            f"or the disaggregation by magnitude{by_model}",
            fields=("model", "disaggregation"),
        )
    parts, remarks, reason = parts_by_model(inputs, reading, answering)
    reject_elements(reason, fields=BLOCK)
    sound = np.asarray(reason == "", dtype=bool)
    where = np.zeros(sound.size, dtype=np.intp) if site is None else site
    branch_weight = np.zeros(len(sites[0]))
    branch_weight[0] = 1.0
    if len(sites[0]) == 1:
        weight = None  # one realization has no spread
    if weight is not None:
        branch_weight = np.nan_to_num(weight)
    # Rate density of the intensity measure on a grid in ln im, per site and branch: -dν, smoothed
    # by the scatter between the curve's definition and the model's.
    mass = curve_mass(list(zip(*sites, strict=True)), branch_weight, reading)

    # λ = Σ P(u_i) (-dν(u_i)), for all blocks of one model at once; uncertain blocks are averaged
    # over the quadrature points of their own parameters.
    blocks: list[tuple[Indices, KernelBlocks]] = []
    for part in parts:
        indices = where[part.indices]
        for rows, group in KernelBlocks.of(part.model, reading.median, part.numbers, indices):
            blocks.append((part.indices[rows], group))
    group_rates = [(indices, group, rates(group, mass, level)) for indices, group in blocks]
    number = np.ones(sound.size) if count is None else np.asarray(count, dtype=np.float64)
    result = _join_rates(group_rates, sound.size, len(mass.branches))
    total = _total_half(group_rates, number, level)
    if one_class:
        result, where = _of_class(result, total), np.zeros(1, dtype=np.intp)
        number = np.ones(1)
    # Rates of single blocks do not add up to the rate of any failure: blocks of a site share the
    # earthquake.
    joints: tuple[JointRate | None, ...] = (None,) * len(sites)
    of_joints: tuple[str, ...] = ()
    if (joint or at_least is not None) and not one_class:
        joints, of_joints = joint_at_sites(group_rates, mass, at_least, years, level, number)
    # lower and upper bounds of the rates from shaking above the last level of the curves
    assert mass.ends is not None
    below, at_last, at_end = result.ends
    last, is_open = mass.ends.rate[where], mass.ends.open[mass.ends.group[where]]
    above, above_at_most = last * at_last, last * np.where(is_open, 1.0, at_end)
    notes = reading.warnings
    if SINGLE_CURVE in notes and sound.size == 1:
        # a single component is assumed, which RotD50 may give another period than
        rotd50: CurveKeywords = {**meaning, "component": "rotd50"}
        as_rotd50 = HazardLevel.of(first[0], **rotd50)
        rotd50_mass = curve_mass(list(zip(*sites, strict=True)), branch_weight, as_rotd50)
        block = replace(blocks[0][1], median=as_rotd50.median)
        period = return_period(float(rates(block, rotd50_mass, LEVEL).rate[0]))
        notes = tuple(text for text in notes if text != SINGLE_CURVE)
        bound = rate_bounds(result.rate, above, above_at_most, below)
        if period == return_period(float(result.rate[0])):
            pass
        elif is_truncated(result.rate, bound)[0]:
            # the answer is a range, which a return period without one would contradict
            notes += (SINGLE_CURVE,)
        else:
            text = (
                "the hazard curve is assumed to be of a single horizontal component; as RotD50 "
                f"the return period would be {period}"
            )
            notes += (SINGLE_CURVE.replaced(text=text),)
    texts = [
        *remarks,
        *describe_invalid(
            int((~sound).sum()), sound.size, elements(reason), reason[~sound].tolist(),
            FROM_MEAN if one_class else FROM_SUMS,
        ),
        *notes, *pga_alone,
        *first_curve_warnings(sites[0], weight),
        *(note for curves in sites for curve in curves for note in curve_warnings(curve, "a rate")),
        *(note for part in parts for note in part.model.notes),
        *describe_ends(first, where, result.rate, above, above_at_most, below),
        *_describe_numbers(result), *of_joints,
    ]  # fmt: skip
    edges, contribution = np.empty(0), np.empty((0, 0))
    if result.rate.size == 1:
        edges, contribution = curve_contributions(
            sites[0], branch_weight, reading, [group for _, group in blocks]
        )
    total_rate = float(np.nansum(number * result.rate))
    probability = probability_in(years, result.rate)
    if len(mass.branches):
        probability = np.asarray(branch_weight @ probability_in(years, result.branches))
    low = high = np.full(result.rate.shape, np.nan)
    quantiles: dict[float, FloatArray] = {}
    if weight is not None:
        # quantiles over the branches, without and with parameter uncertainty
        used = ~np.isnan(weight)
        branch_rates, shares = result.branches[used], weight[used]
        with np.errstate(divide="ignore", invalid="ignore"):
            log_sd = np.divide(result.half, result.rate) / quantiles_of(level).normal
        low, high = weighted_quantiles(branch_rates, shares, (QUANTILES[0], QUANTILES[-1]))
        mixed = mixture_quantiles(branch_rates, shares, np.nan_to_num(log_sd), QUANTILES)
        quantiles = dict(zip(QUANTILES, mixed, strict=True))
    weights = [None] * len(sites[0]) if weight is None else map(finite_or_none, weight.tolist())
    branches = [
        BranchRate(curve_name(curve), w, rates_of, float(np.nansum(number * rates_of)))
        for curve, w, rates_of in zip(sites[0], weights, result.branches, strict=False)
    ]
    kinds = np.full(sound.size, "", dtype=object)
    for part in parts:
        kinds[part.indices] = part.model.row.kind
    models = [part.model for part in parts]
    return HazardAnswer(
        annual_rate=result.rate,
        ci_low=interval_end(result.rate, result.half, -1.0),
        ci_high=interval_end(result.rate, result.half, 1.0),
        logic_tree_low=low,
        logic_tree_high=high,
        numerical_error=result.error,
        probability=probability,
        years=years,
        level=level,
        model=_listed(model.name for model in models),
        term=_listed(model.term.name for model in models),
        method=_listed(model.row.method for model in models),
        site=where,
        curves=tuple(first),
        edges=edges,
        contribution=contribution,
        above=above,
        above_at_most=above_at_most,
        below=below,
        measure=first[0].measure,
        joints=joints,
        curve_kind="weighted branches" if weight is not None else first[0].statistic or None,
        branches=tuple(branches),
        quantiles=quantiles,
        total_low=float(interval_end(np.array(total_rate), total, -1.0)),
        total_high=float(interval_end(np.array(total_rate), total, 1.0)),
        warnings=merge_similar_warnings(texts),
        reason=np.full(1, "", dtype=object) if one_class else reason,
        kinds=np.array([_listed(kinds)], dtype=object) if one_class else kinds,
        count=number,
        tau=LAW_TAU if by_law else None if meaning.get("convert") else TAU.get(reading.name),
    )


def _join_rates(
    group_rates: Sequence[tuple[Indices, KernelBlocks, Rates]], size: int, branches: int
) -> Rates:
    """Return the rates of all blocks; NaN where a block is rejected.

    Without gradients, of which each model has its own; error and outside are parts of the rates.
    """
    rows = np.full((7 + branches, size), np.nan)
    for indices, _, part in group_rates:
        scale = np.maximum(part.rate, np.finfo(np.float64).tiny)
        rows[:, indices] = [
            part.rate, part.half, part.error / scale, part.outside / scale, *part.ends,
            *part.branches,
        ]  # fmt: skip
    return Rates(rows[0], rows[1], rows[:0], rows[2], rows[3], rows[7:], rows[4:7])


def _of_class(result: Rates, half: float) -> Rates:
    """Return the mean rate of a class of blocks.

    Args:
        half: what the interval of the sum of all rates reaches to on either side.
    """
    used = ~np.isnan(result.rate)
    rate, tiny = result.rate[used], np.finfo(np.float64).tiny
    share = rate / max(float(rate.sum()), tiny)
    mean, branches, ends = (
        values[..., used].mean(axis=-1, keepdims=True)
        for values in (result.rate, result.branches, result.ends)
    )
    error, outside = (np.array([share @ values[used]]) for values in (result.error, result.outside))
    return Rates(
        mean, np.array([half / rate.size]), result.gradient, error, outside, branches, ends
    )


def _total_half(
    group_rates: Sequence[tuple[Indices, KernelBlocks, Rates]], count: FloatArray, level: float
) -> float:
    """Return the half-width of the confidence interval of the total rate.

    Blocks of one model have its parameters in common; those of several are independent.
    """
    gradients: dict[str, tuple[Any, Any]] = {}
    for indices, blocks, part_rates in group_rates:
        model = blocks.model
        _, before = gradients.get(model.name, (None, 0.0))
        gradients[model.name] = model.errors, before + part_rates.gradient @ count[indices]
    halves = [
        float(half_width(errors, gradient[:, None], level)[0])
        for errors, gradient in gradients.values()
    ]
    return float(np.sqrt(np.square(halves).sum()))


def _listed(names: Iterable[str]) -> str:
    return ", ".join(filter(None, dict.fromkeys(names)))


def _describe_numbers(result: Rates) -> Iterator[str]:
    worst = np.nan_to_num(result.error[result.rate > NEVER]).max(initial=0.0)
    if worst > NUMERICAL_AIM:
        yield Diagnostic(
            f"the numerical error of a rate is up to {relative(worst)}: the fragility changes "
            "abruptly between levels of the curve",
            "quadrature_error",
        )
    outside = np.nan_to_num(result.outside)
    if (outside > NOTABLE).any():
        of = "" if outside.size == 1 else f" of {int((outside > NOTABLE).sum()):,} blocks"
        yield Diagnostic(
            f"up to {percent(outside.max())} of the rate{of} comes from blocks and shaking outside "
            "the fitted range",
            "extrapolation",
        )


_NUMBER = re.compile(r"[+-]?\d[\d.,]*(?:e[+-]?\d+)?")


def merge_similar_warnings(texts: Iterable[str]) -> tuple[str, ...]:
    """Return the warnings grouped: texts that differ only in their numbers are counted together.

    What is said of each of thousands of sites is said once, with the first as an example.
    """
    kinds: dict[str, dict[str, None]] = {}
    for text in texts:
        kinds.setdefault(_NUMBER.sub("#", text), {})[text] = None
    firsts = [(diagnostics(alike)[0], len(alike) - 1) for alike in kinds.values()]
    return tuple(
        first.replaced(text=f"{first} (and {more:,} more of the kind)") if more else first
        for first, more in firsts
    )
