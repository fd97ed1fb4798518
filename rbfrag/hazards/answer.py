"""How often per year a block topples, with honest uncertainty: `hazard`."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rbfrag.errors import InputError
from rbfrag.fragility.unusable import (
    FROM_MEAN,
    FROM_SUMS,
    elements,
    refuse_elements,
    unusable_in_words,
)
from rbfrag.frames import Tabular
from rbfrag.hazards.annual_rate import checked_years, failure_rate, probability_in
from rbfrag.hazards.branches import (
    Weights,
    branch_curves,
    curve_name,
    quantile_warning,
    weighted_quantiles,
)
from rbfrag.hazards.curve import CurveKeywords, HazardCurve
from rbfrag.hazards.curve_file import CurveLike
from rbfrag.hazards.joint_rate import MOST_JOINT, USUAL_COUNTS, JointRate
from rbfrag.hazards.joint_thresholds import JointThresholds
from rbfrag.hazards.model_blocks import (
    ModelBlocks,
    ModelPart,
    ProbabilityTable,
    RateKeywords,
    parts_by_model,
)
from rbfrag.hazards.shaking import NOTABLE, LevelShaking, ends_in_words
from rbfrag.question.blocks import taken_as_medians
from rbfrag.question.fields import AnsweringFields, BlockFields
from rbfrag.question.keywords import LEVEL, BlockKeywords, parts_of
from rbfrag.solver.kinds import mode_of_kind
from rbfrag.solver.results import FloatArray

QUANTILES = (0.05, 0.16, 0.5, 0.84, 0.95)
"""Quantiles of the rates over the branches of a logic tree."""

NUMERICAL_AIM = 1e-3
"""Relative error of quadrature of a block's rate above which a warning tells of it."""

NEVER = 1e-9
"""Annual rate below which no such warning is given: such rates come from the last level alone."""

_CHUNK = MOST_JOINT


@dataclass(frozen=True, eq=False)
class BranchRate:
    """What one hazard curve of several says.

    Args:
        name: the branch or statistic that the curve is of, or where it comes from.
        weight: its weight; None for a curve that is no branch.
        annual_rate: rates of the blocks [1/a], shape (m,).
        annual_rate_any: rate of earthquakes with at least one failure [1/a]; None where only its
            bounds are known.
    """

    name: str
    weight: float | None
    annual_rate: FloatArray
    annual_rate_any: float | None

    def as_dict(self) -> dict[str, object]:
        """Return the numbers under the keys of the JSON contract."""
        return {
            "name": self.name,
            "weight": self.weight,
            "annual_rate_any": self.annual_rate_any,
            "expected_failures_per_year": float(np.nansum(self.annual_rate)),
        }


@dataclass(frozen=True, eq=False, repr=False)
class HazardAnswer(Tabular):
    """Annual rates of toppling of m blocks at one site.

    Args:
        annual_rate: mean number of failures a year [1/a], shape (m,); NaN for a block that
            cannot be used.
        ci_low: lower end of the interval from the uncertain parameters of the model.
        ci_high: upper end of it.
        numerical_error: how far quadrature may be off, relative to the rates, shape (m,).
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
        curve_kind: what of a logic tree the curve is (mean, quantile-0.84, rlz-001), the weighted
            branches, or None where that is not stated.
        branches: what each of several curves says; empty for one.
        quantiles: quantiles of the rates over branches with weights, by their probability,
            `annual_rate` of shape (m,), and `annual_rate_any`; empty without weights.
        warnings: what to know about the answer.
        reason: why a block cannot be used, shape (m,); empty text elsewhere.
        kinds: how each block fails, shape (m,); empty text where it cannot be used.
    """

    annual_rate: FloatArray
    ci_low: FloatArray
    ci_high: FloatArray
    numerical_error: FloatArray
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
    curve_kind: str | None
    branches: tuple[BranchRate, ...]
    quantiles: Mapping[float, Mapping[str, Any]]
    warnings: tuple[str, ...]
    reason: NDArray[np.object_]
    kinds: NDArray[np.object_]

    @property
    def modes(self) -> NDArray[np.object_]:
        """Failure mode of each block, shape (m,)."""
        return np.array([mode_of_kind(kind) for kind in self.kinds], dtype=object)

    @property
    def annual_rate_any(self) -> float | None:
        """Annual rate of earthquakes with at least one failure [1/a].

        None for several blocks whose dependence is not known: `joint` has its bounds.
        """
        if self.joint is not None:
            return self.joint.annual_rate_any
        return float(np.nansum(self.annual_rate))  # of the one that can be used

    @property
    def expected_failures_per_year(self) -> float:
        """Mean number of failures a year of all blocks [1/a], the sum of the rates known."""
        return float(np.nansum(self.annual_rate))


def hazard(
    curve: CurveLike | Sequence[CurveLike],
    *numbers: ArrayLike | None,
    weights: Weights | None = None,
    at_least: Sequence[int] | None = None,
    years: float = 50.0,
    one_class: bool = False,
    **question: Unpack[RateKeywords[ArrayLike | None]],
) -> HazardAnswer:
    """Return how often per year blocks fail under a seismic hazard curve.

    λ_f = ∫ P(fails | x) (-dλ), see :func:`rbfrag.hazards.annual_rate.failure_rate`. The
    ends of the interval are the integrals of the ends of the fragility's own interval; since
    these are taken at every level at once, the interval is at least as wide as one from the
    joint distribution of the parameters. The model is one of the curve's own measure: what else
    shaking of that level may be is scatter in its P.

    Several blocks stand at one site and share its earthquakes: their rates add up to the failures
    expected a year, and `joint` has the rate of earthquakes in which any of them fails.

    A block that cannot be used, such as one of k_r <= 0 or NaN, has the rate NaN and its `reason`;
    it is left out of sums, which a warning says.

    Several curves are branches of one logic tree with `weights`: rates and probabilities are the
    weighted means, `quantiles` their distribution. Without weights the first curve answers.

    The keywords:

    - the fields of blocks, with ``kind``, ``block`` and ``back_fracture``, as
      :func:`rbfrag.predict` has them, each a number or of shape (m,); ``kind`` may be one for all
      or one each.
    - ``imt``: measure of the curve to take of a file that holds several, such as SA(1.0).
    - ``site``: its site, by number or name, likewise.
    - ``convert``: name of a published conversion from spectral acceleration to PGV, whose scatter
      is integrated.
    - ``convert_sigma``: standard deviation of ln PGV about the conversion; None for that of the
      motions of the shipped reference.
    - ``component``: what the curve's horizontal component means: single, geometric_mean, rotd50 or
      larger; None for single, with a warning.
    - ``model``, ``level``, ``db``: as in :func:`rbfrag.predict`.

    Args:
        curve: hazard curve of PGV, PGA or the spectral acceleration at 1 s, or of one
            that `convert` is for, or its file (OpenQuake CSV, USGS NSHM JSON, two columns); or
            several of one site and measure.
        numbers: p2 [1/s²] and kr of the blocks, if they are not given by name.
        weights: weight of each curve as a branch of a logic tree, None for one that is no branch,
            or OpenQuake's file of realizations; they sum to 1.
        at_least: numbers of failures in one earthquake whose rates are wanted, from 1 to m; None
            for usual ones.
        years: period for the probability [a].
        one_class: the blocks stand for one class, and the answer is the rate of a block drawn
            from it: one rate, by the mean of their fragilities.
        question: the keywords above.

    Raises:
        InputError: no model reads the curve's measure, curves of several measures or sites, weights
            that do not add up to 1, or no block that can be used.
        UnknownFieldError: a keyword that is none.
        UnknownModelError: no model of that name.
        DatabaseError: the database cannot be read.
    """
    given, meaning, answering = parts_of(
        numbers, question, BlockKeywords, CurveKeywords, AnsweringFields
    )
    level = answering.get("level", LEVEL)
    curves, weight = branch_curves(curve, weights, meaning)
    checked_years(years)
    reading = LevelShaking.of(curves[0], **meaning)
    given, medians = taken_as_medians(given)
    own, remarks, reason = parts_by_model(given, reading.name, answering)
    refuse_elements(reason, fields=BlockFields.__optional_keys__)
    sound = np.asarray(reason == "", dtype=bool)
    size = int(sound.sum())
    counts = _checked_counts(at_least, size)
    unusable = unusable_in_words(
        sound.size - size, sound.size, elements(reason), reason[~sound].tolist(),
        FROM_MEAN if one_class else FROM_SUMS,
    )  # fmt: skip
    warnings = [*remarks, *medians, *unusable, *reading.warnings]
    for one in curves:
        warnings.extend(one.warnings)
        warnings.extend(quantile_warning(one, "a rate"))
    models = [each.model for each in own]
    kinds = np.full(sound.shape, "", dtype=object)
    for of_model in own:
        kinds[of_model.places] = of_model.model.row.kind
    warnings.extend(one.form.advice for one in models if one.form.advice)
    blocks = _SiteBlocks.of(own, reading, level, curves, counts, one_class=one_class)
    each = [blocks.under(one, years) for one in curves]
    parts = (
        each[:1]
        if weight is None
        else [part for part, w in zip(each, weight, strict=True) if not np.isnan(w)]
    )
    shares = np.ones(1) if weight is None else weight[~np.isnan(weight)]
    for part in parts:
        warnings.extend(part.warnings)
    mean = {name: _mean(parts, shares, name) for name in _RATES}
    probability = sum(
        w * probability_in(years, part.annual_rate) for w, part in zip(shares, parts, strict=True)
    )
    widest = max(parts, key=lambda part: part.edges.size)
    contribution = _contribution(parts, shares, widest.edges)
    warnings.extend(blocks.domain_warnings(widest.edges, contribution, mean["annual_rate"]))
    joints = [part.joint for part in parts if part.joint is not None]
    if joints:
        warnings.append(
            f"annual_rate_any: all {size} blocks are taken as those of one site, of unknown azimuth"
        )
    if joints and blocks.thresholds is None:
        why = (
            "what the blocks share in one earthquake is not known to this model"
            if any(one.dependence is None for one in models)
            else "what blocks of several models share in one earthquake is not known"
            if len(models) > 1
            else f"what more than {MOST_JOINT} blocks share in one earthquake is not computed"
        )
        warnings.append(
            f"{why}: bounds has annual_rate_any under full dependence and if they fail "
            "independently"
        )
    worst = float(mean["numerical_error"][mean["annual_rate"] > NEVER].max(initial=0.0))
    if worst > NUMERICAL_AIM:
        warnings.append(
            f"quadrature of a rate may be off by {100.0 * worst:.2g} %: its P changes abruptly "
            "between levels of the curve"
        )

    def among_all(values: FloatArray) -> FloatArray:
        """Return values of the blocks that can be used among those of all."""
        if one_class or sound.all():
            return values
        whole = np.full((sound.size, *values.shape[1:]), np.nan)
        whole[sound] = values
        return whole

    return HazardAnswer(
        **{name: among_all(values) for name, values in mean.items()},
        probability=among_all(np.asarray(probability)),
        years=years,
        level=level,
        model=_listed(one.name for one in models),
        term=_listed(one.term.name for one in models),
        method=_listed(one.row.method for one in models),
        edges=widest.edges,
        contribution=among_all(contribution),
        measure=curves[0].measure,
        joint=JointRate.mean(joints, shares) if joints else None,
        curve_kind="weighted branches" if weight is not None else curves[0].statistic or None,
        branches=_branches(curves, each, weight, among_all),
        quantiles=_quantiles(parts, shares, among_all) if weight is not None else {},
        warnings=tuple(dict.fromkeys(warnings)),
        reason=np.full(1, "", dtype=object) if one_class else reason,
        kinds=np.array([_listed(kinds)], dtype=object) if one_class else kinds,
    )


def _listed(names: Iterable[str]) -> str:
    return ", ".join(dict.fromkeys(names))


_RATES = ("annual_rate", "ci_low", "ci_high", "numerical_error", "above", "above_at_most")


@dataclass(frozen=True, eq=False)
class _Rates:
    """What one curve says of the blocks of its site; attributes as those of `HazardAnswer`."""

    annual_rate: FloatArray
    ci_low: FloatArray
    ci_high: FloatArray
    numerical_error: FloatArray
    above: FloatArray
    above_at_most: FloatArray
    edges: FloatArray
    contribution: FloatArray
    joint: JointRate | None
    warnings: list[str]


@dataclass(frozen=True, eq=False)
class _SiteBlocks:
    """The blocks of a site, tabled for the curves of it.

    Args:
        tables: P and both ends by bands x blocks of each part; of a class the mean of all blocks.
        order: where the blocks stand in the parts one after the other.
        any_of: P that any fails under full dependence and if independent, laws in rows; None for
            one block or a class.
        thresholds: levels at which blocks fail by the model's copula; None where it is not known.
    """

    blocks: list[ModelBlocks]
    tables: list[ProbabilityTable]
    order: NDArray[np.intp]
    any_of: ProbabilityTable | None
    thresholds: JointThresholds | None

    @classmethod
    def of(
        cls,
        parts: Sequence[ModelPart],
        reading: LevelShaking,
        level: float,
        curves: list[HazardCurve],
        counts: Sequence[int],
        *,
        one_class: bool,
    ) -> _SiteBlocks:
        """Return the blocks of some models; the arguments are those of `hazard`."""
        blocks, places = [], []
        for part in parts:
            length = part.places.size if one_class else _CHUNK
            for start in range(0, part.places.size, length):
                some = slice(start, start + length)
                numbers = {name: each[some] for name, each in part.numbers.items()}
                places.append(part.places[some])
                blocks.append(
                    ModelBlocks.certain(numbers, shaking=reading, model=part.model, level=level)
                )
        order = np.argsort(np.concatenate(places))
        tables = [some.tabled(curves, mean=one_class) for some in blocks]
        if one_class and len(tables) > 1:
            shares = np.array([some.count for some in blocks]) / order.size
            mean = sum(share * one.values for share, one in zip(shares, tables, strict=True))
            tables = [ProbabilityTable(tables[0].low, tables[0].step, np.asarray(mean))]
        if one_class or order.size < 2:
            return cls(blocks, tables, order, None, None)
        size = tables[0].values.shape[-1]
        greatest, none = np.zeros((1, 1, size)), np.ones((1, 1, size))
        for table in tables:
            p = table.values[:, :1]
            greatest = np.maximum(greatest, p.max(axis=2))
            none = none * (1.0 - p).prod(axis=2)
        first = tables[0]
        any_of = ProbabilityTable(first.low, first.step, np.stack([greatest, 1.0 - none]))
        thresholds, law = None, parts[0].model.dependence
        placement = blocks[0].placement()
        one_model = len(parts) == 1 and order.size <= MOST_JOINT
        if one_model and law is not None and placement is not None:
            thresholds = JointThresholds.of(first, placement, law, counts)
        return cls(blocks, tables, order, any_of, thresholds)

    def under(self, curve: HazardCurve, years: float) -> _Rates:
        """Return the rates under a curve."""
        failures = [failure_rate(curve, table.fine, table.coarse) for table in self.tables]

        def joined(name: str, row: int = 0) -> FloatArray:
            """Return one value of all blocks; of the rates, the rows are P and its two ends."""
            parts = (getattr(one, name) for one in failures)
            rows = np.concatenate([part.reshape(3, -1, *part.shape[1:])[row] for part in parts])
            return rows[self.order] if rows.shape[0] == self.order.size else rows

        rate, low, high = (joined("annual_rate", row) for row in range(3))
        ends = joined("above"), joined("above_at_most")
        warnings = [*ends_in_words(curve, rate, *ends, joined("below"))]
        edges, contribution = failures[0].edges, joined("contribution")
        joint = None
        if self.any_of is not None:
            any_bounds = failure_rate(curve, self.any_of.fine, self.any_of.coarse)
            joint = JointRate.of(any_bounds, rate, self.thresholds, curve, years)
            warnings.extend(joint.warnings)
        return _Rates(
            rate, low, high, joined("numerical_error"), *ends, edges, contribution, joint, warnings
        )

    def domain_warnings(
        self, edges: FloatArray, contribution: FloatArray, rate: FloatArray
    ) -> Iterator[str]:
        """Yield what is to be said of rates that come from outside the model's domain."""
        middle = np.sqrt(edges[1:] * edges[:-1])
        outside = np.concatenate([some.outside(middle) for some in self.blocks])[self.order]
        if contribution.shape[0] == 1:  # a class
            outside = outside.mean(axis=0, keepdims=True)
        part = (outside * contribution).sum(axis=1) / np.maximum(rate, np.finfo(np.float64).tiny)
        if (part > NOTABLE).any():
            yield (
                f"up to {100.0 * float(part.max()):.3g} % of the rate comes from blocks and "
                "shaking outside the ranges that the model was fitted on"
            )


def _checked_counts(at_least: Sequence[int] | None, n: int) -> list[int]:
    if at_least is None:
        return [count for count in USUAL_COUNTS if count <= n]
    for count in at_least:
        if isinstance(count, bool) or not 1 <= count <= n:
            raise InputError(f"at least {count} failures of {n} blocks: give numbers from 1 to {n}")
    return [1, *at_least]


def _mean(parts: Sequence[_Rates], shares: FloatArray, name: str) -> FloatArray:
    values = (getattr(part, name) for part in parts)
    return np.asarray(sum(w * value for w, value in zip(shares, values, strict=True)))


def _contribution(parts: Sequence[_Rates], shares: FloatArray, edges: FloatArray) -> FloatArray:
    """Return the mean contribution between the edges of one of the branches."""
    total = np.zeros((parts[0].contribution.shape[0], edges.size - 1))
    for w, part in zip(shares, parts, strict=True):
        if part.edges.size == edges.size:
            total += w * part.contribution
            continue
        below = np.concatenate([np.zeros((total.shape[0], 1)), part.contribution.cumsum(axis=1)], 1)
        for row, one in enumerate(below):
            total[row] += w * np.diff(np.interp(np.log(edges), np.log(part.edges), one))
    return total


def _branches(
    curves: Sequence[HazardCurve],
    each: Sequence[_Rates],
    weight: FloatArray | None,
    among_all: Callable[[FloatArray], FloatArray],
) -> tuple[BranchRate, ...]:
    if len(curves) == 1:
        return ()
    return tuple(
        BranchRate(
            curve_name(curve),
            None if weight is None or np.isnan(weight[i]) else float(weight[i]),
            among_all(rates.annual_rate),
            float(rates.annual_rate[0]) if rates.joint is None else rates.joint.annual_rate_any,
        )
        for i, (curve, rates) in enumerate(zip(curves, each, strict=True))
    )


def _quantiles(
    parts: Sequence[_Rates], shares: FloatArray, among_all: Callable[[FloatArray], FloatArray]
) -> dict[float, dict[str, Any]]:
    rates = weighted_quantiles(np.stack([part.annual_rate for part in parts]), shares, QUANTILES)
    result: dict[float, dict[str, Any]] = {
        q: {"annual_rate": among_all(row)} for q, row in zip(QUANTILES, rates, strict=True)
    }
    any_rates = [None if part.joint is None else part.joint.annual_rate_any for part in parts]
    if all(one is not None for one in any_rates):
        of_any = weighted_quantiles(np.array(any_rates, dtype=np.float64), shares, QUANTILES)
        for q, value in zip(QUANTILES, of_any.tolist(), strict=True):
            result[q]["annual_rate_any"] = value
    return result
