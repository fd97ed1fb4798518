"""Blocks that stand at one site: how probable it is that any fails at a level of shaking."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from os import PathLike
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rbfrag.errors import InputError
from rbfrag.fragility.joint import UNKNOWN, Placement, any_failure
from rbfrag.fragility.lookup import find_model
from rbfrag.fragility.model import FragilityModel
from rbfrag.fragility.predict import Model, answer_given
from rbfrag.fragility.prediction_array import PredictionArray
from rbfrag.fragility.uncertain import normal_steps
from rbfrag.hazards.annual_rate import Fragility, failure_rate
from rbfrag.hazards.curve import HazardCurve
from rbfrag.hazards.shaking import Shaking, warn_of_ends
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2

FloatArray = NDArray[np.float64]
Joint = Callable[[FloatArray], FloatArray]

ONE_BLOCK = "one block"
COPULA = "the model's copula"
INDEPENDENT = "independent"
DEPENDENT = "fully dependent"

_SIGMA_POINTS, _SIGMA_REACH = 15, 5.0
_TABLE_STEP = 0.02
COARSE_STEP = 0.04
"""Step of ln x of a table of joint probabilities where its cost counts; rates are good to 0.1 %."""
_FEWEST_LEVELS = 64
_AT_ONCE = 400_000


@dataclass(frozen=True, eq=False)
class StandingBlocks:
    """The blocks of one site.

    Args:
        count: number of blocks m.
        weight: weights of the k draws of their parameters, which sum to 1, shape (k,).
        laws: names of the laws by which they fail together; the first answers.
        any_fails: from levels, shape (n,), to the probability that any fails, laws x draws x bands
            in rows; the bands are P and the two ends of its interval, or P alone.
        of_model: the blocks as the model knows them; None for a fragility of the caller's.
    """

    count: int
    weight: FloatArray
    laws: tuple[str, ...]
    any_fails: Fragility
    of_model: ModelBlocks | None = None

    @classmethod
    def of_fragility(cls, fragility: Fragility, levels: FloatArray) -> StandingBlocks:
        """Return blocks of which the caller gives P at each level, a row for each block."""
        count = np.atleast_2d(fragility(levels)).shape[0]
        laws = _joint_laws(count, None)

        def any_fails(x: FloatArray) -> FloatArray:
            return _by_law(laws, np.atleast_2d(fragility(x))[None, None])

        return cls(count, np.ones(1), tuple(laws), any_fails)

    @classmethod
    def of_blocks(
        cls, blocks: ModelBlocks, curves: list[HazardCurve], step: float = _TABLE_STEP
    ) -> StandingBlocks:
        """Return blocks that a model answers for, tabled in steps of ln x over some curves."""
        count = blocks.p2.shape[1]
        laws = _joint_laws(count, blocks)
        any_fails = _tabled(lambda x: _by_law(laws, blocks.probabilities(x)), curves, step)
        return cls(count, blocks.weight, tuple(laws), any_fails, blocks)

    @classmethod
    def of_parts(cls, parts: list[ModelBlocks], curves: list[HazardCurve]) -> StandingBlocks:
        """Return many blocks whose parameters are known, in parts, by the bounds alone."""

        def any_fails(levels: FloatArray) -> FloatArray:
            greatest, none = np.zeros((3, levels.size)), np.ones((3, levels.size))
            for part in parts:
                p = part.probabilities(levels)[0]
                greatest = np.maximum(greatest, p.max(axis=1))
                none *= (1.0 - p).prod(axis=1)
            return np.concatenate([greatest, 1.0 - none])

        count = sum(part.p2.shape[1] for part in parts)
        return cls(
            count, np.ones(1), (DEPENDENT, INDEPENDENT), _tabled(any_fails, curves, COARSE_STEP)
        )

    def rate(self, curve: HazardCurve) -> AnyRate:
        """Return how often any of them fails under a curve."""
        failures = failure_rate(curve, self.any_fails)
        shape = (len(self.laws), self.weight.size, -1)

        def mean(values: FloatArray) -> FloatArray:
            """Return the mean over the draws of what answers, shape (1, ...)."""
            rows = values.reshape(*shape, *values.shape[1:])
            return np.asarray(np.tensordot(self.weight, rows[0, :, 0], axes=1))[None]

        warnings: list[str] = []
        warn_of_ends(
            curve, mean(failures.annual_rate), mean(failures.above), mean(failures.above_at_most),
            mean(failures.below), warnings,
        )  # fmt: skip
        outside = 0.0
        if self.of_model is not None:
            part = mean(failures.contribution)[0]
            share = self.of_model.share_outside(np.sqrt(failures.edges[1:] * failures.edges[:-1]))
            outside = float(part @ share) / max(float(part.sum()), np.finfo(np.float64).tiny)
        rate = failures.annual_rate.reshape(shape)
        return AnyRate(rate, float(mean(failures.annual_rate)[0]), outside, tuple(warnings))


@dataclass(frozen=True, eq=False)
class AnyRate:
    """How often any of some blocks fails under one hazard curve.

    Args:
        annual_rate: rates [1/a], laws x draws x bands.
        mean: the mean over the draws of the first of each [1/a].
        outside: part of it from outside the ranges that the model was fitted on.
        warnings: what the ends of the curve leave open.
    """

    annual_rate: FloatArray
    mean: float
    outside: float
    warnings: tuple[str, ...]


def _by_law(laws: Mapping[str, Joint], p: FloatArray) -> FloatArray:
    """Return P of any by each law, of P of shape (k, b, m, n), in rows."""
    return np.stack([law(p) for law in laws.values()]).reshape(-1, p.shape[-1])


def _joint_laws(n: int, blocks: ModelBlocks | None) -> dict[str, Joint]:
    """Return functions from P of n blocks, shape (k, b, n, levels), to that of any.

    The first of them answers: the model's copula, else that all fail or none, which says least
    against a hazard.
    """
    if n == 1:
        return {ONE_BLOCK: lambda p: p[:, :, 0]}
    bounds: dict[str, Joint] = {
        DEPENDENT: lambda p: p.max(axis=2),
        INDEPENDENT: lambda p: 1.0 - (1.0 - p).prod(axis=2),
    }
    law = None if blocks is None else blocks.model.dependence
    if blocks is None or law is None:
        return bounds
    where, known = blocks.placement(), law
    return {COPULA: lambda p: any_failure(np.moveaxis(p, 2, -1), where, known), **bounds}


def _tabled(fragility: Fragility, curves: list[HazardCurve], step: float) -> Fragility:
    """Return a fragility of many rows by monotone cubics over the levels of some curves.

    Mixtures and joint probabilities cost too much at every node of the integral.
    """
    low = math.log(min(curve.levels[0] for curve in curves))
    ends = (c.levels[-1] if c.end_level is None else c.end_level for c in curves)
    high = math.log(max(ends))
    smooth = _cubics(low, high, fragility, step)
    return lambda levels: smooth(np.clip(np.log(levels), low, high))


def _cubics(low: float, high: float, fragility: Fragility, step: float = _TABLE_STEP) -> Fragility:
    """Return a function of ln x between two ends for one of x, by cubics over equal steps.

    Its last axis is that of the levels; probabilities of models are smooth in it.
    """
    from scipy.interpolate import PchipInterpolator

    u = np.linspace(low, high, max(_FEWEST_LEVELS, math.ceil((high - low) / step)))
    table = fragility(np.exp(u))
    table[table < 1e-100] = 0.0  # the cubics divide by differences
    return cast("Fragility", PchipInterpolator(u, table, axis=-1))


@dataclass(frozen=True, eq=False)
class ModelBlocks:
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
    ) -> ModelBlocks:
        """Return the blocks of medians and sigmas; arguments as for :func:`rbfrag.survival`."""
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

    @classmethod
    def certain(
        cls,
        p2: FloatArray,
        kr: FloatArray,
        *,
        shaking: Shaking,
        model: FragilityModel,
        level: float,
    ) -> ModelBlocks:
        """Return blocks whose parameters are known, shape (m,) each."""
        return cls(p2[None], kr[None], np.ones(1), (p2, kr), shaking, model, level)

    def parts(self, size: int) -> list[ModelBlocks]:
        """Return the same blocks, so many at once, where their parameters are known."""
        p2, kr = self.medians
        return [
            ModelBlocks.certain(
                p2[i : i + size], kr[i : i + size], shaking=self.shaking, model=self.model,
                level=self.level,
            )
            for i in range(0, p2.size, size)
        ]  # fmt: skip

    @property
    def warnings(self) -> tuple[str, ...]:
        """What the model and the curve's meaning take for granted."""
        block = self.model.method.block
        presumed = (block.presumes,) if self.model.kind == block.kind and block.presumes else ()
        advice = (self.model.term.advice,) if self.model.term.advice else ()
        return (*self.shaking.warnings, *advice, *presumed, *self.model.notes)

    def placement(self) -> Placement:
        """Return the blocks as those of one site with unknown azimuths."""
        p2, kr = self.medians
        p = np.sqrt(p2)
        return Placement.of(np.log(p), np.log(kr * STANDARD_GRAVITY_M_S2 / p), polarity=UNKNOWN)

    def probabilities(self, levels: FloatArray) -> FloatArray:
        """Return P and the ends of its interval, draws x 3 x blocks x levels.

        Scatter of the shaking is integrated over a table of P: the model answers once at each of
        its levels, not once for each point of the scatter.
        """
        shift = self.shaking.shift
        if shift.size == 1:
            return self._at(levels * shift)
        u = np.log(levels)
        smooth = _cubics(u[0] + math.log(shift[0]), u[-1] + math.log(shift[-1]), self._at)
        points = zip(self.shaking.weight, np.log(shift), strict=True)
        total: FloatArray = sum(w * smooth(u + by) for w, by in points)
        return total

    def _at(self, values: FloatArray) -> FloatArray:
        """Return P and the ends of its interval at values of the model's measure."""
        shaking = {self.shaking.name: values}
        k, m = self.p2.shape
        rows = max(1, _AT_ONCE // (m * values.size))
        parts = []
        for start in range(0, k, rows):
            some = slice(start, start + rows)
            answer = self._predicted(self.p2[some, :, None], self.kr[some, :, None], shaking)
            parts.append(np.stack([answer.probability, answer.ci_low, answer.ci_high], axis=1))
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
        answer = answer_given(self.model, {"p2": p2, "kr": kr, **shaking}, self.level)
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
