"""Survival of standing blocks as a test of seismic hazard: `survival`."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Unpack

import numpy as np
from numpy.typing import ArrayLike

from rbfrag.errors import InputError
from rbfrag.fragility import describe
from rbfrag.hazards.branches import (
    Weights,
    branch_curves,
    curve_name,
    curve_warnings,
    first_curve_warnings,
)
from rbfrag.hazards.curve import NOTABLE, NOTABLE_FACTOR, CurveKeywords, HazardCurve, is_truncated
from rbfrag.hazards.curve_file import CurveLike
from rbfrag.hazards.joint_rate import DEPENDENT, INDEPENDENT
from rbfrag.hazards.shaking import HazardLevel, RateKeywords
from rbfrag.hazards.standing_blocks import (
    Age,
    AnyRate,
    Fragility,
    FragilityBlocks,
    ModelBlocks,
    Standing,
    StandingBlocks,
    weights_given_standing,
)
from rbfrag.question.keywords import LEVEL, parts_of
from rbfrag.results.diagnostic import Diagnostic
from rbfrag.results.numbers import (
    NEVER,
    SMALLEST,
    confidence,
    equals,
    exact_percent,
    interval,
    percent,
    return_period,
    two_digits,
    years,
)
from rbfrag.results.result import Result, TextLine, TextTable
from rbfrag.solver.kinds import by_model, mode_of_kind
from rbfrag.solver.quantity import finite_or_none
from rbfrag.vocabulary.quantities import ANSWERING, BLOCKS

DRAWS = 128
"""Draws of the blocks' parameters where several uncertain blocks are given."""

REJECTION_LEVEL = 0.05
"""Probability of survival below which a hazard curve is rejected."""

_TEXTS = ("curve_end", "block_text")
"""Texts of the terminal, which are no columns of a table."""

_NOT_IN_JSON = ("standing", "annual_rate_beyond", *_TEXTS)


@dataclass(frozen=True, eq=False)
class BranchSurvival:
    """Survival of the blocks under one hazard curve.

    Args:
        name: the branch or statistic that the curve is of, or where it comes from.
        weight: its weight before; None for a curve that is no branch.
        weight_given_standing: its weight after all blocks have stood.
        annual_rate_any: rate at which any block fails [1/a], the mean over uncertain blocks.
        probability_standing: probability that all blocks stand after the age.
        factor_5_percent: factor on the hazard rates at which that is 5 %; None where none is.
        factor_50_percent: the same for 50 %.
        standing: survival for any factor.
    """

    name: str
    weight: float | None
    weight_given_standing: float | None
    annual_rate_any: float
    probability_standing: float
    factor_5_percent: float | None
    factor_50_percent: float | None
    standing: Standing = field(repr=False)

    def as_dict(self) -> dict[str, Any]:
        """Return the numbers under the keys of the JSON contract."""
        return {name: value for name, value in vars(self).items() if name != "standing"}


@dataclass(frozen=True, eq=False, repr=False)
class SurvivalAnswer(Result):
    """Test of seismic hazard by the survival of standing blocks.

    Args:
        probability_standing: probability that all blocks stand after the age, if the hazard is
            right: over the branches with their weights, or of the first curve without weights.
        ci_low: lower end of its interval from the uncertain parameters of the model.
        ci_high: upper end of it.
        factor_5_percent: factor on the hazard rates at which all stand with 5 %; None where no
            factor makes that so improbable.
        factor_5_percent_ci: both ends of its interval.
        factor_50_percent: the same for 50 %.
        factor_50_percent_ci: both ends of its interval.
        annual_rate_any: rate at which any block fails [1/a].
        age_years: mean age [a].
        age_sd_years: standard deviation of the age [a].
        blocks: number of blocks.
        hazard: the curve or the branches that these numbers are of.
        joint_law: how the blocks of one earthquake fail together.
        bounds: for several blocks, the same three numbers if they fail independently and if they
            fail all or none; None for one block.
        branches: every curve's own answer, with weights.
        kind: how the blocks fail.
        model: name of the model that answered; None for a fragility of the caller's.
        term: its intensity term.
        method: how it was fitted.
        imt: measure of the curves.
        site: site of the curves, or empty.
        level: confidence level of the interval.
        warnings: what to know about the answer.
        standing: survival for any factor.
        annual_rate_beyond: the most that shaking beyond the levels of the curve may add to the
            rate [1/a]; infinite where a block fails below the first level, since a curve gives no
            rate of weaker shaking.
        curve_end: the level beyond which that is, "the hazard curve ends at PGV = 0.5 m/s".
        block_text: description of the block; empty for several.
    """

    probability_standing: float
    ci_low: float
    ci_high: float
    factor_5_percent: float | None
    factor_5_percent_ci: tuple[float | None, float | None]
    factor_50_percent: float | None
    factor_50_percent_ci: tuple[float | None, float | None]
    annual_rate_any: float
    age_years: float
    age_sd_years: float
    blocks: int
    hazard: str
    joint_law: str
    bounds: Mapping[str, Mapping[str, float | None]] | None
    branches: tuple[BranchSurvival, ...]
    kind: str | None
    model: str | None
    term: str | None
    method: str | None
    imt: str
    site: str
    level: float
    warnings: tuple[str, ...]
    standing: Standing = field(repr=False)
    annual_rate_beyond: float = 0.0
    curve_end: str = ""
    block_text: str = ""

    @property
    def mode(self) -> str:
        """Failure mode of the blocks; empty for a user-supplied fragility function."""
        return mode_of_kind(self.kind or "")

    @property
    def _is_truncated(self) -> bool:
        """True where the curve leaves open the rate, or P, by more than the factor of a range."""
        rate, bound = self.annual_rate_any, self.annual_rate_any + self.annual_rate_beyond
        rate_is_range = bool(is_truncated(np.array(rate), np.array(bound)))
        # P depends exponentially on the rate: twice the rate may leave a hundredth of P
        return rate_is_range or self._factor_beyond < 1.0 / NOTABLE_FACTOR

    @property
    def _factor_beyond(self) -> float:
        """Smallest factor on P by shaking beyond the levels: exp(-rate beyond · mean age).

        P is the mean of exp(-rate · age) over ages. The mean of its product with exp(-rate beyond ·
        age) is at least the product of the means (Chebyshev), and the mean of the latter at least
        its value at the mean age (Jensen).
        """
        return math.exp(-self.annual_rate_beyond * self.age_years)

    def sentences(self) -> Iterator[str]:
        """Yield the probability of survival, the return period, and the test of the curve."""
        blocks = "" if self.blocks == 1 else f"all {self.blocks} blocks "
        sd = f" ± {self.age_sd_years:,.6g}" if self.age_sd_years else ""
        event = f"P({blocks}still standing after {self.age_years:,.6g}{sd} years)"
        value = percent(self.probability_standing)
        failure = "a failure" if blocks else "failure"
        rate = self.annual_rate_any
        if self._is_truncated:
            least = self.probability_standing * self._factor_beyond
            ends = interval(least, self.probability_standing)
            is_range = least >= SMALLEST or value[0] == "<"
            p = equals(event, ends) if is_range else f"{event} at most {value}"
            yield f"{p}: {self.curve_end}"
            bound = rate + self.annual_rate_beyond
            period = f"between {years(bound)} and {return_period(rate)}"
            if math.isinf(bound):
                period = f"at most {return_period(rate)}"
            elif not rate > NEVER:
                period = f"at least {return_period(bound)}"
            yield f"Return period of {failure} {period}"
        else:
            ends = interval(self.ci_low, self.ci_high)
            level = f"   ({confidence(self.level, ends)})" if ends != value else ""
            yield f"{equals(event, value)}{level}"
            yield f"Return period of {failure} {return_period(rate)}"
        curve = "The hazard curve"
        if len(self.branches) > 1:  # of the first curve, or of weighted branches
            first = "hazard curve" if self.branches[0].name == self.hazard else "hazard of"
            curve = f"The {first} {self.hazard}"
        yield f"{curve} {self._test()}"

    def _test(self) -> str:
        """Return the outcome of the test at the 5 % level; undecided if the interval has 5 %."""
        level = f"at the {exact_percent(REJECTION_LEVEL)} level"
        least = self.ci_low * self._factor_beyond
        if least < REJECTION_LEVEL < self.ci_high:
            if self.ci_low >= REJECTION_LEVEL:
                begins = math.isinf(self.annual_rate_beyond)
                reason = "it begins too late" if begins else "it ends too early"
            else:
                reason = "the interval of P includes 5 %"
            return f"is neither rejected nor accepted {level}: {reason}{self._factor()}"
        if self.ci_high <= REJECTION_LEVEL and self.factor_5_percent is not None:
            factor = two_digits(self.factor_5_percent)
            limit = f"at most {factor}" if self._is_truncated else f"{factor} or less"
            return (
                f"is rejected {level}: consistent only if all its rates are multiplied by {limit}"
            )
        return f"is not rejected {level}{self._factor()}"

    def _factor(self) -> str:
        if self.factor_5_percent is None:
            return ""
        at_most = "at most " if self._is_truncated else ""
        factor = f"{at_most}{two_digits(self.factor_5_percent)}"
        return f"; P would be 5 % with all its rates multiplied by {factor}"

    def lines(self) -> Iterator[TextLine]:
        """Yield the hazard curve, the block, the dependence of several and the model."""
        yield TextLine("Curve", ", ".join(filter(None, (self.imt, self.site))))
        if self.block_text:
            yield TextLine("Block", self.block_text)
        if self.blocks > 1:
            yield TextLine("Failures", f"joint failures by {self.joint_law}")
        if self.model is None:
            yield TextLine("Model", "user-supplied fragility function")
        else:
            yield TextLine("Model", describe.named_model(vars(self)))

    def tables(self, *, verbose: bool = False) -> Iterator[TextTable]:
        """Yield the factors on the rates with their intervals, bounds, and branches.

        Where the curve ends too early they are upper bounds, without intervals.
        """
        intervals = {
            "probability_standing": (self.ci_low, self.ci_high),
            "factor_5_percent": self.factor_5_percent_ci,
            "factor_50_percent": self.factor_50_percent_ci,
        }
        rows: list[dict[str, Any]] = [
            {"": name, "value": getattr(self, name), "ci_low": low, "ci_high": high}
            for name, (low, high) in intervals.items()
        ]
        if self._is_truncated:
            rows = [{"": name, "at most": getattr(self, name)} for name in intervals]
        yield TextTable.of_rows(rows, verbose=verbose)
        if self.bounds is not None:
            yield TextTable.of_rows(
                [{"bound": law.replace("_", " "), **values} for law, values in self.bounds.items()],
                verbose=verbose,
            )
        if len(self.branches) > 1:
            branches = [branch.as_dict() for branch in self.branches]
            yield TextTable.of_rows(branches, verbose=verbose)
        if verbose:
            yield TextTable.of_values(self.as_dict())

    def as_dict(self) -> dict[str, Any]:
        """Return the answer under the keys of the JSON contract."""
        return {
            **{name: value for name, value in vars(self).items() if name not in _NOT_IN_JSON},
            "factor_5_percent_ci": list(self.factor_5_percent_ci),
            "factor_50_percent_ci": list(self.factor_50_percent_ci),
            "how": "fragility of the caller's" if self.model is None else by_model(self.model),
            "branches": [branch.as_dict() for branch in self.branches],
            "site": self.site or None,
            "warnings": list(self.warnings),
        }

    def table_columns(self) -> Mapping[str, Any]:
        """Return the columns of the table of one row."""
        columns = super().table_columns()
        return {name: value for name, value in columns.items() if name not in _TEXTS}


def survival(
    curves: CurveLike | Sequence[CurveLike],
    *numbers: ArrayLike | None,
    age_years: float,
    age_sd_years: float = 0.0,
    weights: Weights | None = None,
    fragility: Fragility | None = None,
    draws: int = DRAWS,
    seed: int = 0,
    **question: Unpack[RateKeywords[ArrayLike | None]],
) -> SurvivalAnswer:
    """Return the survival probability of blocks of one site after an age, given the seismic hazard.

    S(f) = E[exp(-f T ∫ P(any fails | x) (-dλ))] over the age T and the blocks' own parameters,
    which are the same in all earthquakes; earthquakes come as a Poisson process. The factors are
    those f on all hazard rates at which S is 5 % and 50 %: a hazard whose rates lie above the
    first is at odds with blocks that stand. Weights of branches are updated by Bayes' rule.

    What several blocks do in one earthquake follows the copula that is stored with the model,
    their azimuths unknown; without one they are taken to fail all or none, which says least
    against the hazard, and both bounds are given.

    Args:
        curves: hazard curves of one site and one measure, or their files: a mean, quantiles,
            branches.
        numbers: p2 [1/s²] and kr of the blocks, medians, if they are not given by name.
        age_years: how long the blocks have stood in this position [a], the mean of a lognormal
            law (:class:`rbfrag.hazards.standing_blocks.Age`).
        age_sd_years: its standard deviation [a].
        weights: as in :func:`rbfrag.hazard`.
        fragility: instead of blocks, a function from levels of the curves' measure, shape (n,), to
            probabilities of failure, shape (n,) or one row for each block, (m, n).
        draws: number of draws where several uncertain blocks are given; one block is integrated
            by quadrature.
        seed: seed of these draws.
        question: the keywords of :func:`rbfrag.hazard`, with the standard deviations of blocks,
            which are independent from block to block; the blocks are of one kind, and ``kind`` is
            required.

    Raises:
        InputError: curves of several measures or sites, weights that do not add up to 1, blocks of
            several kinds, or a value that cannot be used.
        UnknownFieldError: a keyword that is none.
        UnknownModelError: no model of that name.
        DatabaseError: the database cannot be read.
    """
    inputs, meaning, answering = parts_of(
        numbers, question, BLOCKS, CurveKeywords.__optional_keys__, ANSWERING
    )
    site_curves, weight = branch_curves(curves, weights, meaning)
    # ln S is computed, since S itself underflows for hazards that blocks clearly contradict.
    age = Age.of(age_years, age_sd_years)
    model_blocks: ModelBlocks | None = None
    blocks: StandingBlocks
    if fragility is None:
        require_kind(inputs)
        shaking = HazardLevel.of(site_curves[0], **meaning)
        model_blocks = blocks = ModelBlocks.of(
            inputs, shaking, draws=draws, seed=seed, answering=answering
        )
    elif not inputs:
        count = np.atleast_2d(fragility(site_curves[0].levels)).shape[0]
        blocks = FragilityBlocks(fragility, count)
    else:
        raise InputError("fragility describes the blocks: omit p2 and kr")
    rates = [blocks.rate(curve) for curve in site_curves]
    branch_weight = None if weight is None else np.nan_to_num(weight)

    def under_each(law: int = 0, band: int = 0) -> list[Standing]:
        """Return the survival under each curve, by dependence model and end of the interval."""
        return [Standing.of(rate.annual_rate[law, :, band], blocks.weight, age) for rate in rates]

    def over_branches(law: int = 0, band: int = 0) -> Standing:
        """Return the survival over all branches, or under the first curve without weights."""
        parts = under_each(law, band)
        return parts[0] if branch_weight is None else Standing.mixed(parts, branch_weight)

    bands = rates[0].annual_rate.shape[2]
    middle, least, most = (over_branches(band=band % bands) for band in (0, 2, 1))
    law_index = {
        name: blocks.laws.index(name) for name in (INDEPENDENT, DEPENDENT) if blocks.count > 1
    }
    # the most that shaking beyond the levels of a curve that answers adds to the rate
    used = list(zip(site_curves, rates, strict=True))[: 1 if branch_weight is None else None]
    curve, rate = max(used, key=lambda pair: pair[1].beyond)
    beyond, end = rate.beyond, f"the hazard curve ends at {curve.level_text(-1)}"
    for curve, rate in used:
        if rate.below > NOTABLE:
            beyond, end = math.inf, f"the hazard curve begins at {curve.level_text(0)}"
            break
    parts = under_each()
    before: tuple[float | None, ...] = (None,) * len(parts)
    after = before
    if weight is not None and branch_weight is not None:
        posterior = weights_given_standing(parts, branch_weight)
        before, after = (
            tuple(map(finite_or_none, np.where(np.isnan(weight), np.nan, values).tolist()))
            for values in (weight, posterior)
        )
    branches = tuple(
        BranchSurvival(
            name=curve_name(curve), weight=before[i], weight_given_standing=after[i],
            annual_rate_any=rates[i].mean, **_numbers(parts[i]), standing=parts[i],
        )
        for i, curve in enumerate(site_curves)
    )  # fmt: skip
    means = [rate.mean for rate in rates]
    return SurvivalAnswer(
        **_numbers(middle),
        ci_low=least.probability,
        ci_high=most.probability,
        factor_5_percent_ci=(least.factor(0.05), most.factor(0.05)),
        factor_50_percent_ci=(least.factor(0.5), most.factor(0.5)),
        annual_rate_any=means[0] if branch_weight is None else float(branch_weight @ means),
        age_years=float(age_years),
        age_sd_years=float(age_sd_years),
        blocks=blocks.count,
        hazard=curve_name(site_curves[0]) if weight is None else "the weighted branches",
        joint_law=blocks.laws[0],
        bounds={
            name.replace(" ", "_"): _numbers(over_branches(law)) for name, law in law_index.items()
        }
        or None,
        branches=branches,
        kind=None if model_blocks is None else model_blocks.model.kind,
        model=None if model_blocks is None else model_blocks.model.name,
        term=None if model_blocks is None else model_blocks.model.term.name,
        method=None if model_blocks is None else model_blocks.model.row.method,
        imt=site_curves[0].imt,
        site=site_curves[0].place,
        level=answering.get("level", LEVEL),
        warnings=tuple(
            dict.fromkeys(
                (*first_curve_warnings(site_curves, weight), *_warnings(site_curves, rates, blocks))
            )
        ),
        standing=middle,
        annual_rate_beyond=beyond,
        curve_end=end,
    )


def require_kind(inputs: Mapping[str, Any]) -> None:
    """Require that standing blocks are specified as free-standing or not.

    Most blocks that are studied are, and a backed block fails far more rarely.

    Args:
        inputs: fields of the blocks, with ``kind``.
    """
    kinds = inputs.get("kind")
    has_kind = all(kinds) if isinstance(kinds, Sequence) else kinds is not None
    if not has_kind and {"restitution", "ky", "ks", "kct"}.isdisjoint(inputs):
        raise InputError(KIND_MISSING, fields=("kind",))


KIND_MISSING = (
    "kind is missing: give rocking (free-standing, overturns) or toppling (backed by rock)"
)


def _warnings(
    curves: list[HazardCurve], rates: list[AnyRate], blocks: StandingBlocks
) -> Iterator[str]:
    for curve in curves:
        yield from curve_warnings(curve, "survival")
    yield from blocks.warnings
    for rate in rates:
        yield from rate.warnings
    outside = max(rate.outside for rate in rates)
    if outside > NOTABLE:
        yield Diagnostic(
            f"up to {percent(outside)} of the rate comes from blocks and shaking outside the "
            "fitted range",
            "extrapolation",
        )
    if blocks.laws[0] == DEPENDENT:
        yield Diagnostic(
            "the dependence between the blocks is unknown: full dependence is assumed, the weakest "
            "evidence against the hazard; bounds also has independence",
            "unknown_dependence",
        )


def _numbers(standing: Standing) -> dict[str, Any]:
    return {
        "probability_standing": standing.probability,
        "factor_5_percent": standing.factor(0.05),
        "factor_50_percent": standing.factor(0.5),
    }
