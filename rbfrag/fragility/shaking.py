"""Uncertain shaking: P is averaged over the distribution of the intensity measures.

The logarithms of the measures are normal about those of what is stated, with its standard
deviations; those of several correlate as total residuals do, and a scatter that all share (of an
amplification, of a component) is added. P is the sum over 41 points, .3 standard deviations apart:
P has a kink where mechanics forbids failure, for which Gauss-Hermite is worse by far. One variable
and a certain block are integrated here, without a library: one measure, or several that all move as
exp(power σ x), x being what they share. All else is in :mod:`rbfrag.fragility.uncertain`.

Spectral ordinates that scatter by themselves are one variable: the spectral velocity of the
interpolated ordinates, with the moments of :mod:`rbfrag.fragility.velocity_moments`.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, fields, replace
from typing import Any, Self

from rbfrag.errors import InputError
from rbfrag.fragility.completion import UNCERTAIN_VELOCITY
from rbfrag.fragility.confidence import Quantiles
from rbfrag.fragility.correlation import correlation
from rbfrag.fragility.measures import ABOUT_SCATTER, AMPLIFIED, SCATTERED, SIGMAS, Term
from rbfrag.fragility.method import SINGLE, ArrayNamespace, LinearPredictor, MechanicalBound
from rbfrag.fragility.model import Answer, FragilityModel
from rbfrag.vocabulary.spectral import period_of

POINTS = tuple(0.3 * i for i in range(-20, 21))
"""The points of a standard normal variable: steps of .3 to 6 on either side."""

_DENSITY = [math.exp(-0.5 * x * x) for x in POINTS]
WEIGHTS = tuple(density / sum(_DENSITY) for density in _DENSITY)
"""Their weights, which sum to 1: P is right to 1e-4 for standard deviations up to 1."""


@dataclass(frozen=True)
class Scatter:
    """Intensity measures of a model that have a dispersion.

    Args:
        names: the measures that scatter.
        common: what a scatter that all share is stated as; None where there is none.
        single: whether one variable moves all of them: there is one, or only what all share.
    """

    names: tuple[str, ...]
    common: str | None = None
    single: bool = True

    @classmethod
    def of(cls, term: Term, inputs: Mapping[str, Any]) -> tuple[Scatter | None, dict[str, Any]]:
        """Return the dispersion in the inputs, and the inputs without zero dispersions.

        Raises:
            InputError: a standard deviation is negative or no number.
        """
        rest = dict(inputs)
        for name in ABOUT_SCATTER.intersection(inputs):
            value = inputs[name]
            if isinstance(value, float | int) and not 0.0 <= value < math.inf:
                raise InputError(
                    f"{name} = {value:g}: give a standard deviation of 0 or more", fields=(name,)
                )
            nothing = value == 0.0
            read = SCATTERED.get(name, term.inputs[0]) in term.inputs
            if (
                name == "pgv_tau"
                or not read
                or (nothing is True or getattr(nothing, "all", bool)())
            ):
                del rest[name]
        scattered = {SCATTERED[name] for name in rest if name in SCATTERED}
        common = "amplification_sigma" if "amplification_sigma" in rest else None
        moved = [name for name in term.inputs if name in (AMPLIFIED if common else scattered)]
        scatter = cls(tuple(moved), common, len(moved) == 1 or not scattered) if moved else None
        return scatter, rest

    def in_numbers(self, inputs: Mapping[str, float], tau: Any) -> dict[str, dict[str, float]]:
        """Return the median, sigma and, if given, tau of each uncertain intensity measure."""
        result = {}
        for name in self.names:
            sigma = math.hypot(self.deviation(name, inputs), self.shared(name, inputs))
            result[name] = {"median": inputs[name], "sigma": sigma}
        if tau is not None and "pgv_m_s" in result:
            result["pgv_m_s"]["tau"] = float(tau)
        return result

    def deviation(self, name: str, inputs: Mapping[str, Any]) -> Any:
        """Return the log standard deviation of one intensity measure alone."""
        return inputs.get(SIGMAS.get(name, f"{name}_sigma"), 0.0)

    def shared(self, name: str, inputs: Mapping[str, Any]) -> Any:
        """Return the log standard deviation that all intensity measures share."""
        return 0.0 if self.common is None else AMPLIFIED.get(name, 1) * inputs[self.common]

    def correlation(self, name: str, other: str, inputs: Mapping[str, Any]) -> Any:
        """Return the correlation of what two intensity measures scatter by each alone."""
        coefficient = inputs.get(f"{name} {other}", inputs.get(f"{other} {name}"))
        return correlation(name, other) if coefficient is None else coefficient


def with_uncertain_velocity(
    model: FragilityModel, scatter: Scatter, inputs: Mapping[str, Any]
) -> tuple[Scatter, dict[str, Any]]:
    """Return the scatter and the inputs with one spectral velocity in place of uncertain ordinates.

    Args:
        model: the model that answers, completed for the inputs.
        scatter: what scatters.
        inputs: the question, with standard deviations.
    """
    ordinates = [name for name in scatter.names if period_of(name) is not None]
    if not any(SIGMAS[name] in inputs for name in ordinates):
        return scatter, dict(inputs)
    from rbfrag.fragility.velocity_moments import correlated_moments

    names = [name for name in scatter.names if name not in ordinates]
    single = len(names) == 0 or scatter.single
    moved = replace(scatter, names=(*names, UNCERTAIN_VELOCITY), single=single)
    return moved, {**inputs, **correlated_moments(model, names, inputs)}


@dataclass(frozen=True)
class MeanModel(FragilityModel):
    """A fitted model whose probability is averaged over uncertain inputs."""

    @classmethod
    def over(cls, model: FragilityModel, **about: Any) -> Self:
        """Return a model that averages over uncertain block or shaking; None means certain."""
        attributes = {
            attribute.name: getattr(model, attribute.name) for attribute in fields(FragilityModel)
        }
        return cls(
            **attributes, **{name: value for name, value in about.items() if value is not None}
        )

    @property
    def uncertain(self) -> bool:
        """True if the model integrates over uncertain inputs."""
        return True

    def bounds(self, names: Any) -> tuple[MechanicalBound, ...]:
        """Return no bounds: they are applied at each integration point."""
        del names
        return ()

    @abstractmethod
    def main_excursion(self, inputs: Mapping[str, float]) -> tuple[str, float] | None:
        """Return the variable and the edge of its fitted range that most of P lies beyond.

        None where each variable is within its range, and only their combination is not.

        Args:
            inputs: the question, single numbers.
        """


@dataclass(frozen=True)
class ShakenModel(MeanModel):
    """A fitted model for one uncertain intensity measure and one certain block."""

    scatter: Scatter = field(kw_only=True)

    @property
    def scattered(self) -> bool:
        """True: the shaking is uncertain."""
        return True

    def answer(
        self,
        values: Mapping[str, Any],
        quantiles: Quantiles | None,
        ns: ArrayNamespace,
        inputs: Mapping[str, Any],
    ) -> Answer:
        """Return the prediction averaged over the shaking; see :class:`FragilityModel`."""
        link, middle, outside = self.method.link, 0.0, 0.0
        totals: list[float] = []
        for weight, values in self._points(inputs, ns):
            unscaled, h = self.linear_predictor(values, ns)
            p = weight * link.probability(unscaled.eta * h, ns)
            middle += p
            outside += p * self.lies_outside(values, ns)
            if quantiles is not None:
                share = weight * h * link.density(unscaled.eta * h, ns)
                slopes = [share * slope for slope in unscaled.all_slopes]
                totals = [a + b for a, b in zip(totals, slopes, strict=True)] if totals else slopes
        answer = Answer(
            middle, middle, middle, None, None, None, outside / middle if middle else 0.0
        )
        if quantiles is None:
            return answer._replace(low=None, high=None)
        if not 0.0 < middle < 1.0 or not totals:
            return answer
        # d(mean P) by each parameter over F' at the mean: slopes of the eta that has the mean P
        at_mean = link.quantile(middle, ns)
        density = link.density(at_mean, ns)
        mean = LinearPredictor(None, tuple(total / density for total in totals))
        reach = self.errors.half_width(mean, quantiles, ns)
        low, high = (link.probability(at_mean + end * reach, ns) for end in (-1.0, 1.0))
        return answer._replace(low=low, high=high)

    def _points(
        self, inputs: Mapping[str, Any], ns: ArrayNamespace
    ) -> Iterator[tuple[float, dict[str, Any]]]:
        """Yield weight and completed values of the points at which the block can fail."""
        scatter = self.scatter
        sigmas = {
            name: math.hypot(scatter.deviation(name, inputs), scatter.shared(name, inputs))
            for name in scatter.names
        }
        for x, weight in zip(POINTS, WEIGHTS, strict=True):
            at = {**inputs, **{n: inputs[n] * math.exp(sigma * x) for n, sigma in sigmas.items()}}
            values = self.completed(at, ns)
            if not any(bound.holds(values) for bound in FragilityModel.bounds(self, values)):
                yield weight, values

    def main_excursion(self, inputs: Mapping[str, float]) -> tuple[str, float] | None:
        """Return the variable and edge beyond which most of P lies; see :class:`MeanModel`."""
        beyond: Counter[tuple[str, float]] = Counter()
        for weight, values in self._points(inputs, SINGLE):
            unscaled, h = self.linear_predictor(values, SINGLE)
            p = weight * self.method.link.probability(unscaled.eta * h, SINGLE)
            beyond.update({(n, edge): p for n, edge, holds in self.excursions(values) if holds})
        return max(beyond, key=beyond.__getitem__, default=None)
