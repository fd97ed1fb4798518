"""Standing blocks as evidence about hazard: `survival`."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rbfrag.errors import InputError
from rbfrag.fragility.dependence import Dependence
from rbfrag.fragility.joint import UNKNOWN, Placement, any_failure
from rbfrag.fragility.lookup import find_model
from rbfrag.fragility.model import FragilityModel
from rbfrag.fragility.predict import Model, predict
from rbfrag.fragility.prediction_array import PredictionArray
from rbfrag.hazards.annual_rate import FailureRate, Fragility, failure_rate, normal_steps
from rbfrag.hazards.answer import _tails
from rbfrag.hazards.curve import HazardCurve
from rbfrag.hazards.shaking import Shaking
from rbfrag.hazards.standing import Age, Standing, weights_given_standing
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2

FloatArray = NDArray[np.float64]
Joint = Callable[[FloatArray], FloatArray]

DRAWS = 128
"""Draws of the blocks' parameters where several uncertain blocks are given."""

_SIGMA_POINTS, _SIGMA_REACH = 15, 5.0
_TABLE_STEP = 0.02
_FEWEST_LEVELS = 64
_AT_ONCE = 400_000
_NOTABLE = 0.01
_ADDS_UP = 2e-3

ONE_BLOCK = "one block"
COPULA = "the model's copula"
INDEPENDENT = "independent"
DEPENDENT = "fully dependent"


@dataclass(frozen=True, eq=False)
class BranchSurvival:
    """What one hazard curve says of the blocks.

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


@dataclass(frozen=True, eq=False)
class SurvivalAnswer:
    """What blocks that stand say of seismic hazard.

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

    def as_dict(self) -> dict[str, Any]:
        """Return the answer under the keys of the JSON contract."""
        return {
            **vars(self),
            "factor_5_percent_ci": list(self.factor_5_percent_ci),
            "factor_50_percent_ci": list(self.factor_50_percent_ci),
            "branches": [branch.as_dict() for branch in self.branches],
            "site": self.site or None,
            "warnings": list(self.warnings),
        }


def survival(
    curves: HazardCurve | Sequence[HazardCurve],
    p2: ArrayLike | None = None,
    kr: ArrayLike | None = None,
    *,
    age_years: float,
    age_sd_years: float = 0.0,
    weights: Sequence[float | None] | None = None,
    p2_sigma: ArrayLike = 0.0,
    kr_sigma: ArrayLike = 0.0,
    kind: str | None = None,
    fragility: Fragility | None = None,
    convert: str | None = None,
    convert_sigma: float | None = None,
    component: str | None = None,
    model: Model | None = None,
    level: float = 0.95,
    draws: int = DRAWS,
    seed: int = 0,
    db: str | PathLike[str] | None = None,
) -> SurvivalAnswer:
    """Return how likely blocks of one site are to stand after an age, if a hazard is right.

    S(f) = E[exp(-f T ∫ P(any fails | x) (-dλ))] over the age T and the blocks' own parameters,
    which are the same in all earthquakes; earthquakes come as a Poisson process. The factors are
    those f on all hazard rates at which S is 5 % and 50 %: a hazard whose rates lie above the
    first is at odds with blocks that stand. Weights of branches are updated by Bayes' rule.

    What several blocks do in one earthquake follows the copula that is stored with the model,
    their azimuths unknown; without one they are taken to fail all or none, which says least
    against the hazard, and both bounds are given.

    Args:
        curves: hazard curves of one site and one measure: a mean, quantiles, branches.
        p2: frequency parameters p² [1/s²] of the blocks, medians, scalar or shape (m,).
        kr: toppling yield acceleration coefficients, medians, scalar or shape (m,).
        age_years: how long the blocks have stood in this position [a], the mean of a lognormal
            law (:class:`rbfrag.hazards.standing.Age`).
        age_sd_years: its standard deviation [a].
        weights: weight of each curve as a branch of a logic tree, None for one that is no branch;
            they sum to 1.
        p2_sigma: standard deviations of ln p², independent of block to block, as `p2`.
        kr_sigma: the same of ln k_r.
        kind: how the blocks fail; None for toppling, backed by a slope.
        fragility: instead of blocks, a function from levels of the curves' measure, shape (n,), to
            probabilities of failure, shape (n,) or one row for each block, (m, n).
        convert: as in :func:`rbfrag.hazard`, like `convert_sigma`, `component` and `model`.
        convert_sigma: see there.
        component: see there.
        model: see there.
        level: confidence level of the interval.
        draws: number of draws where several uncertain blocks are given; one block is integrated
            by quadrature.
        seed: seed of these draws.
        db: as in :func:`rbfrag.predict`.

    Raises:
        InputError: curves of several measures or sites, weights that do not add up to 1, or a
            value that cannot be used.
        UnknownModelError: no model of that name.
        DatabaseError: the database cannot be read.
    """
    each = [curves] if isinstance(curves, HazardCurve) else list(curves)
    _refuse_unlike(each)
    weight = _checked_weights(weights, len(each))
    age = Age.of(age_years, age_sd_years)
    warnings: list[str] = []
    blocks: _Blocks | None = None
    if fragility is not None:
        if p2 is not None or kr is not None:
            raise InputError("fragility says all of the blocks: leave p2 and kr out")
        own = fragility
        rows = np.atleast_2d(own(each[0].levels)).shape[0]
        ask: Joint = lambda x: np.atleast_2d(own(x))[None, None]  # noqa: E731
        draw_weight, law = np.ones(1), None
    else:
        blocks = _Blocks.of(
            each[0], p2, kr, p2_sigma=p2_sigma, kr_sigma=kr_sigma, draws=draws, seed=seed,
            kind=kind, model=model, level=level, db=db,
            shaking=Shaking.of(
                each[0], convert=convert, convert_sigma=convert_sigma, component=component
            ),
        )  # fmt: skip
        ask, draw_weight, law = blocks.probabilities, blocks.weight, blocks.dependence
        rows = blocks.p2.shape[1]
        warnings += [word for curve in each for word in curve.warnings]
        warnings += blocks.warnings
    laws = _joint_laws(rows, law, blocks)

    def of_any(levels: FloatArray) -> FloatArray:
        """Return P(any fails) for laws x draws x bands, in rows."""
        p = ask(levels)
        joint = np.stack([together(p) for together in laws.values()])
        return joint.reshape(-1, levels.size)

    if blocks is not None or rows > 1:
        of_any = _tabled(of_any, each)
    rates = [failure_rate(curve, of_any) for curve in each]
    shape = (len(laws), draw_weight.size, -1)
    by_curve = [rate.annual_rate.reshape(shape) for rate in rates]

    def standing(law: int, band: int) -> list[Standing]:
        return [Standing.of(rate[law, :, band], draw_weight, age) for rate in by_curve]

    def whole(law: int, band: int) -> Standing:
        parts = standing(law, band)
        return Standing.mixed(parts, np.nan_to_num(weight)) if weight is not None else parts[0]

    bands = by_curve[0].shape[2]
    middle, least, most = (whole(0, band % bands) for band in (0, 2, 1))
    parts = standing(0, 0)
    given = _given_standing(parts, weight)
    mean_rate = [float(draw_weight @ rate[0, :, 0]) for rate in by_curve]
    branches = tuple(
        BranchSurvival(
            name=curve.statistic or curve.source,
            weight=None if weight is None or math.isnan(weight[i]) else float(weight[i]),
            weight_given_standing=given[i],
            annual_rate_any=mean_rate[i],
            **_numbers(parts[i]),
            standing=parts[i],
        )
        for i, curve in enumerate(each)
    )
    for curve, rate in zip(each, rates, strict=True):
        _warn_of_ends(curve, rate, shape, draw_weight, warnings)
        if blocks is not None:
            _warn_of_domain(blocks, rate, shape, warnings)
        if curve.statistic.startswith("quantile"):
            warnings.append(
                f"{curve.statistic} is no hazard of any one model: survival under it is no "
                "quantile of survival; branches with their weights say more"
            )
    names = list(laws)
    if rows > 1 and names[0] == DEPENDENT:
        warnings.append(
            "what the blocks share in one earthquake is not known here: they are taken to fail all "
            "or none, which says least against the hazard; bounds also has the independent case"
        )
    numbers = _numbers(middle)
    return SurvivalAnswer(
        **numbers,
        ci_low=least.probability,
        ci_high=most.probability,
        factor_5_percent_ci=(least.factor(0.05), most.factor(0.05)),
        factor_50_percent_ci=(least.factor(0.5), most.factor(0.5)),
        annual_rate_any=mean_rate[0] if weight is None else float(np.nan_to_num(weight) @ mean_rate),
        age_years=float(age_years),
        age_sd_years=float(age_sd_years),
        blocks=rows,
        hazard=branches[0].name if weight is None else "the weighted branches",
        joint_law=names[0],
        bounds=None
        if rows == 1
        else {
            name.replace(" ", "_"): _numbers(whole(names.index(name), 0))
            for name in (INDEPENDENT, DEPENDENT)
        },
        branches=branches,
        kind=None if blocks is None else blocks.model.kind,
        model=None if blocks is None else blocks.model.name,
        term=None if blocks is None else blocks.model.term.name,
        method=None if blocks is None else blocks.model.row.method,
        imt=each[0].imt,
        site=each[0].place,
        level=level,
        warnings=tuple(dict.fromkeys(warnings)),
    )


def _numbers(standing: Standing) -> dict[str, Any]:
    return {
        "probability_standing": standing.probability,
        "factor_5_percent": standing.factor(0.05),
        "factor_50_percent": standing.factor(0.5),
    }


def _refuse_unlike(curves: list[HazardCurve]) -> None:
    if not curves:
        raise InputError("there is no hazard curve: give one or more")
    measures = list(dict.fromkeys(curve.imt for curve in curves))
    if len(measures) > 1:
        raise InputError(
            f"the curves are of {', '.join(measures)}: give curves of one measure, or choose it "
            "with --imt"
        )
    places = list(dict.fromkeys(curve.place for curve in curves if curve.place))
    if len(places) > 1:
        raise InputError(
            f"the curves are of {len(places)} sites ({places[0]}; {places[1]}; …): the blocks "
            "stand at one: choose it with --site"
        )


def _checked_weights(weights: Sequence[float | None] | None, n: int) -> FloatArray | None:
    """Return weights that sum to 1, NaN for curves without; None where none is given."""
    if weights is None or all(one is None for one in weights):
        return None
    if len(weights) != n:
        raise InputError(f"{len(weights)} weights for {n} curves: give one for each")
    values = np.array([math.nan if one is None else one for one in weights], dtype=np.float64)
    given = values[~np.isnan(values)]
    if not ((given >= 0.0) & (given <= 1.0)).all():
        raise InputError(f"weights {', '.join(f'{one:g}' for one in given)}: each is from 0 to 1")
    if abs(given.sum() - 1.0) > _ADDS_UP:
        raise InputError(
            f"the weights of {given.size} branches add up to {given.sum():.6g}, not 1: give the "
            "curves and weights of all branches"
        )
    return values / given.sum()


def _given_standing(parts: list[Standing], weight: FloatArray | None) -> list[float | None]:
    if weight is None:
        return [None] * len(parts)
    after = weights_given_standing(parts, np.nan_to_num(weight))
    return [None if math.isnan(w) else float(a) for w, a in zip(weight, after, strict=True)]


def _joint_laws(n: int, law: Dependence | None, blocks: _Blocks | None) -> dict[str, Joint]:
    """Return functions from P of blocks, shape (k, b, m, n), to that of any, (k, b, n).

    The first of them answers.
    """
    if n == 1:
        return {ONE_BLOCK: lambda p: p[:, :, 0]}
    bounds: dict[str, Joint] = {
        DEPENDENT: lambda p: p.max(axis=2),
        INDEPENDENT: lambda p: 1.0 - (1.0 - p).prod(axis=2),
    }
    if law is None or blocks is None:
        return bounds
    where = blocks.placement()
    copula: Joint = lambda p: any_failure(np.moveaxis(p, 2, -1), where, law)  # noqa: E731
    return {COPULA: copula, **bounds}


def _tabled(fragility: Fragility, curves: list[HazardCurve]) -> Fragility:
    """Return a fragility of many rows by monotone cubics between levels 2 % apart or closer.

    Mixtures and joint probabilities are smooth, and cost too much at every node of the integral.
    """
    from scipy.interpolate import PchipInterpolator

    low = math.log(min(curve.levels[0] for curve in curves))
    ends = (c.levels[-1] if c.end_level is None else c.end_level for c in curves)
    high = math.log(max(ends))
    u = np.linspace(low, high, max(_FEWEST_LEVELS, math.ceil((high - low) / _TABLE_STEP)))
    table = fragility(np.exp(u))
    table[table < 1e-100] = 0.0  # the cubics divide by differences
    smooth = PchipInterpolator(u, table, axis=1)
    return lambda levels: np.asarray(smooth(np.clip(np.log(levels), low, high)))


@dataclass(frozen=True, eq=False)
class _Blocks:
    """Blocks, as certain or uncertain as they are, and the model that answers for them.

    Args:
        p2: p² [1/s²], draws x blocks.
        kr: k_r, draws x blocks.
        weight: weights of the draws, which sum to 1, shape (k,).
        medians: p² and k_r of the medians, shape (m,) each.
        shaking: what the curve's levels are to the model.
        model: the model.
        level: confidence level.
    """

    p2: FloatArray
    kr: FloatArray
    weight: FloatArray
    medians: tuple[FloatArray, FloatArray]
    shaking: Shaking
    model: FragilityModel
    level: float

    @classmethod
    def of(
        cls,
        curve: HazardCurve,
        p2: ArrayLike | None,
        kr: ArrayLike | None,
        *,
        p2_sigma: ArrayLike,
        kr_sigma: ArrayLike,
        draws: int,
        seed: int,
        kind: str | None,
        model: Model | None,
        level: float,
        db: str | PathLike[str] | None,
        shaking: Shaking,
    ) -> _Blocks:
        if p2 is None or kr is None:
            raise InputError("give p2 and kr of the blocks, or a fragility of the curve's measure")
        columns = {"p2": p2, "kr": kr, "p2_sigma": p2_sigma, "kr_sigma": kr_sigma}
        values = np.broadcast_arrays(
            *(np.atleast_1d(np.asarray(one, dtype=np.float64)) for one in columns.values())
        )
        for name, value in zip(columns, values, strict=True):
            least = 0.0 if name.endswith("sigma") else np.nextafter(0.0, 1.0)
            wrong = ~(np.isfinite(value) & (value >= least))
            if wrong.any():
                raise InputError(
                    f"{name} = {value[wrong][0]:g}: give "
                    + ("0 or more" if least == 0.0 else "a finite number above 0")
                )
        medians = (values[0], values[1])
        z, weight = _standard_draws(values[2], values[3], draws, seed)
        drawn = [m * np.exp(s * part) for m, s, part in zip(medians, values[2:], z, strict=True)]
        chosen = find_model(model, ("p2", "kr", shaking.name), db, kind=kind)
        return cls(drawn[0], drawn[1], weight, medians, shaking, chosen, level)

    @property
    def dependence(self) -> Dependence | None:
        """The copula that is stored with the model, if there is one."""
        stored = self.model.row.dependence
        names = Dependence.__dataclass_fields__
        if stored is None or not set(names) <= set(stored):
            return None
        return Dependence(**{name: float(stored[name]) for name in names})

    @property
    def warnings(self) -> tuple[str, ...]:
        """What the model and the curve's meaning take for granted."""
        block = self.model.method.block
        presumed = (block.presumes,) if self.model.kind == block.kind and block.presumes else ()
        return (*self.shaking.warnings, *presumed)

    def placement(self) -> Placement:
        """Return the blocks as those of one site with unknown azimuths."""
        p2, kr = self.medians
        p = np.sqrt(p2)
        return Placement.of(np.log(p), np.log(kr * STANDARD_GRAVITY_M_S2 / p), polarity=UNKNOWN)

    def probabilities(self, levels: FloatArray) -> FloatArray:
        """Return P and the ends of its interval, draws x 3 x blocks x levels."""
        shaking = {self.shaking.name: (levels[:, None] * self.shaking.shift).reshape(1, 1, -1)}
        k, m = self.p2.shape
        rows = max(1, _AT_ONCE // (m * levels.size * self.shaking.shift.size))
        parts = []
        for start in range(0, k, rows):
            some = slice(start, start + rows)
            answer = self._predicted(self.p2[some, :, None], self.kr[some, :, None], shaking)
            bands = np.stack([answer.probability, answer.ci_low, answer.ci_high], axis=1)
            parts.append(bands.reshape(*bands.shape[:3], levels.size, -1) @ self.shaking.weight)
        return np.concatenate(parts)

    def share_outside(self, levels: FloatArray) -> FloatArray:
        """Return which part of the median blocks' P is outside the model's domain, shape (n,)."""
        p2, kr = self.medians
        shaking = {self.shaking.name: levels[None, :] * self.shaking.median}
        answer = self._predicted(p2[:, None], kr[:, None], shaking)
        p = np.maximum(answer.probability, np.finfo(np.float64).tiny)
        share: FloatArray = (p * ~answer.in_domain).sum(axis=0) / p.sum(axis=0)
        return share

    def _predicted(
        self, p2: FloatArray, kr: FloatArray, shaking: Mapping[str, Any]
    ) -> PredictionArray:
        answer = predict(p2, kr, **shaking, model=self.model, level=self.level)
        assert isinstance(answer, PredictionArray)
        return answer


def _standard_draws(
    p2_sigma: FloatArray, kr_sigma: FloatArray, draws: int, seed: int
) -> tuple[tuple[FloatArray, FloatArray], FloatArray]:
    """Return standard normal values of ln p² and ln k_r, draws x blocks each, and weights.

    One block: a product of steps, exact for smooth integrands. Several: scrambled Sobol points
    (Owen 1998), normal by their quantiles.
    """
    m = p2_sigma.size
    if not (p2_sigma.any() or kr_sigma.any()):
        return (np.zeros((1, m)), np.zeros((1, m))), np.ones(1)
    if m == 1:
        x, wx = normal_steps(_SIGMA_POINTS if p2_sigma.any() else 1, _SIGMA_REACH)
        y, wy = normal_steps(_SIGMA_POINTS if kr_sigma.any() else 1, _SIGMA_REACH)
        a, b = np.meshgrid(x, y, indexing="ij")
        return (a.reshape(-1, 1), b.reshape(-1, 1)), np.outer(wx, wy).ravel()
    if isinstance(draws, bool) or not 1 <= draws <= 2**16:
        raise InputError(f"draws = {draws}: give a number from 1 to 65536")
    from scipy.special import ndtri
    from scipy.stats.qmc import Sobol

    points = Sobol(2 * m, rng=np.random.default_rng(seed)).random(1 << (draws - 1).bit_length())
    z = ndtri(points[:draws])
    return (z[:, :m], z[:, m:]), np.full(draws, 1.0 / draws)


def _warn_of_ends(
    curve: HazardCurve,
    rate: FailureRate,
    shape: tuple[int, ...],
    weight: FloatArray,
    warnings: list[str],
) -> None:
    def mean(values: FloatArray) -> FloatArray:
        """Return the mean over the draws of what answers."""
        return np.atleast_1d(weight @ values.reshape(shape)[0, :, 0])

    parts = (rate.annual_rate, rate.above, rate.above_at_most, rate.below)
    _tails(curve, *(mean(part) for part in parts), warnings)


def _warn_of_domain(
    blocks: _Blocks, rate: FailureRate, shape: tuple[int, ...], warnings: list[str]
) -> None:
    contribution = blocks.weight @ rate.contribution.reshape(*shape, rate.edges.size - 1)[0, :, 0]
    outside = blocks.share_outside(np.sqrt(rate.edges[1:] * rate.edges[:-1]))
    total = contribution.sum()
    if total > 0.0 and (part := float(contribution @ outside / total)) > _NOTABLE:
        warnings.append(
            f"{100.0 * part:.3g} % of the rate comes from blocks and shaking outside the ranges "
            "that the model was fitted on"
        )
