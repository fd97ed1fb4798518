"""Completion of a spectral velocity: its distribution where not all of the spectrum is known.

ln of the velocity (X or A of :mod:`rbfrag.fragility.spectral_velocity`), over PGV or PGA g, is
normal about a linear regression on what is known of the shaking: ζ = ln[PGV/(PGA g)] and ζ², the
velocity of the interpolated ordinates, ln T_m, the magnitude. The regression is that of the fitted
motions at six sizes p²; between them its coefficients and its scatter σ are linear in ln p. P is
then averaged in closed form:

    P = Φ(η/√(1 + (h b_X σ)²))

A spectrum with all the periods of :data:`SPECTRUM_PERIODS_S` is known: σ = 0. No library is loaded.
"""

from __future__ import annotations

import json
import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from operator import mul
from typing import Any, NamedTuple

from rbfrag.fragility.measures import Term
from rbfrag.fragility.method import ArrayNamespace, SpectralPredictor, Values, ln_size
from rbfrag.fragility.spectral_velocity import LONGEST_S, PGA_PERIOD_S
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.vocabulary.spectral import SPECTRUM_PERIODS_S, period_of, spectral_name

NODES_P2 = (30.0, 10.0, 3.0, 1.0, 0.3, 0.1)
"""Sizes p² [1/s²] of the regressions."""

MOMENTS = "completion"
"""Name of the moments among completed values."""

UNCERTAIN_VELOCITY = "spectral_velocity"
"""Name of the velocity of interpolated ordinates [m/s] among inputs where the ordinates scatter."""

_NODES_LN_P = tuple(0.5 * math.log(p2) for p2 in NODES_P2)
_SPECTRUM = tuple(spectral_name(period_s) for period_s in SPECTRUM_PERIODS_S)
_MIDDLE_MAGNITUDE = 6.5
_LEAST_M_S = 1e-290  # has a logarithm


def used_inputs(
    term: Term, velocity: SpectralPredictor | None, names: Collection[str]
) -> tuple[str, ...]:
    """Return the names of the given measures that a model uses, in a fixed order.

    Args:
        term: its intensity term.
        velocity: the spectral velocity that it reads, if it does.
        names: what is given.
    """
    if velocity is None:
        return term.inputs
    optional = [name for name in velocity.optional if name in names]
    if "pgv_m_s" in optional and "magnitude" in optional:
        optional.remove("magnitude")
    periods = {name: period for name in names if (period := period_of(name)) is not None}
    # between PGA and the shortest stored period the fitted motions have no ordinates of their own
    shortest = SPECTRUM_PERIODS_S[0] if "pga_g" in term.inputs else 0.0
    spectrum = [name for name in sorted(periods, key=periods.__getitem__)
                if shortest <= periods[name] <= LONGEST_S]  # fmt: skip
    if periods.keys() >= {*_SPECTRUM}:
        return (*term.inputs, *_SPECTRUM)
    return (*term.inputs, *optional, *spectrum)


def is_exact(used: Collection[str]) -> bool:
    """Return whether the measures are the whole spectrum, which needs no regression."""
    return {*_SPECTRUM} <= {*used}


def ordinates_of(used: Collection[str], values: Values) -> dict[float, Any]:
    """Return the spectral ordinates among values by period; PGA is one where it is used.

    Below 0.03 s the acceleration is that at 0.03 s: of several the longest period counts.
    """
    periods = {name: period for name in used if (period := period_of(name)) is not None}
    ordinates = {
        max(period, PGA_PERIOD_S): values[name]
        for name, period in sorted(periods.items(), key=lambda item: item[1])
    }
    if "pga_g" in used:
        ordinates.setdefault(PGA_PERIOD_S, values["pga_g"])
    return ordinates


class Regression(NamedTuple):
    """Regression of ln of a spectral velocity at the sizes :data:`NODES_P2`.

    Args:
        coefficients: intercept and slopes, a line for each size.
        sigma: standard deviation of the residual at each size.
        shared: fractions of its variance that the motions of an earthquake, and those of a
            recording, have in common, at each size.
        steps: change of coefficients and sigma without each earthquake, by size.
    """

    coefficients: Sequence[Sequence[float]]
    sigma: Sequence[float]
    shared: Sequence[Sequence[float]]
    steps: Sequence[Sequence[Sequence[float]]] = ()

    def moved(self, step: Sequence[float]) -> Regression:
        """Return the regression with a step added to coefficients and sigma, size after size."""
        size = len(self.coefficients[0]) + 1
        lines = [
            [value + d for value, d in zip((*line, sigma), step[start:], strict=False)]
            for start, line, sigma in zip(
                range(0, size * len(self.sigma), size), self.coefficients, self.sigma, strict=True
            )
        ]
        return self._replace(
            coefficients=[line[:-1] for line in lines], sigma=[line[-1] for line in lines]
        )


class Moments(NamedTuple):
    """Scatter of the logarithm of a completed velocity.

    Args:
        sigma: standard deviation.
        regressors: what the coefficients multiply.
        weights: weights of the sizes in coefficients and sigma.
    """

    sigma: Any
    regressors: tuple[Any, ...]
    weights: tuple[Any, ...]


@dataclass(frozen=True)
class Completion:
    """A spectral velocity from what is given of the shaking.

    Args:
        used: names of the measures that are used.
        regression: None where the spectrum is exact.
    """

    velocity: SpectralPredictor
    used: tuple[str, ...]
    regression: Regression | None

    @cached_property
    def columns(self) -> list[tuple[float, ...]]:
        """Each coefficient of the regression, and σ last, at all sizes."""
        assert self.regression is not None
        columns = zip(*self.regression.coefficients, strict=True)
        return [*columns, tuple(self.regression.sigma)]

    def velocities(self, values: Values, ns: ArrayNamespace) -> dict[str, Any]:
        """Return the median velocity [m/s] and, if it is not exact, its :class:`Moments`."""
        if self.regression is None:
            return {"velocity_m_s": ns.exp(ln_interpolated(self.velocity, self.used, values, ns))}
        over = ln_over(self.velocity, values, ns)
        regressors = regressors_of(self.velocity, self.used, values, over, ns)
        weights = node_weights(values, ns)
        *slopes, sigma = [sum(map(mul, weights, column)) for column in self.columns]
        if self.velocity.over == "pga_g" and "pgv_m_s" in self.used:
            # beyond the top of the parabola the velocity would fall as PGV rises
            falls = slopes[2] < 0.0
            top = -slopes[1] / (2.0 * (slopes[2] - (1.0 - falls)))
            zeta = regressors[1] - falls * ns.maximum(regressors[1] - top, 0.0)
            regressors = (1.0, zeta, zeta * zeta, *regressors[3:])
        median = ns.maximum(ns.exp(sum(map(mul, slopes, regressors)) + over), _LEAST_M_S)
        return {"velocity_m_s": median, MOMENTS: Moments(sigma, regressors, weights)}

    def scatter(self, values: Values, ns: ArrayNamespace) -> tuple[Any, Any, Any]:
        """Return σ and the fractions of σ² that an earthquake and a recording share."""
        assert self.regression is not None
        weights = node_weights(values, ns)
        columns = (self.regression.sigma, *zip(*self.regression.shared, strict=True))
        sigma, of_event, of_site = (sum(map(mul, weights, column)) for column in columns)
        return sigma, of_event, of_site


def ln_over(velocity: SpectralPredictor, values: Values, ns: ArrayNamespace) -> Any:
    """Return ln of what a velocity is regressed on as a ratio to [m/s]; 0 for nothing."""
    if not velocity.over:
        return 0.0
    value = values[velocity.over]
    return ns.log(value * STANDARD_GRAVITY_M_S2 if velocity.over == "pga_g" else value)


def ln_interpolated(
    velocity: SpectralPredictor, used: Collection[str], values: Values, ns: ArrayNamespace
) -> Any:
    """Return ln of the velocity [m/s] of the interpolated ordinates, or as it is given."""
    if UNCERTAIN_VELOCITY in values:
        return ns.log(values[UNCERTAIN_VELOCITY])
    return velocity.ln_velocity(ordinates_of(used, values), values["p"], ns)


def regressors_of(
    velocity: SpectralPredictor, used: Collection[str], values: Values, over: Any,
    ns: ArrayNamespace,
) -> tuple[Any, ...]:  # fmt: skip
    """Return what the coefficients of a regression multiply, 1 first.

    Args:
        over: as :func:`ln_over` returns it.
    """
    result: list[Any] = [1.0]
    if velocity.over and "pgv_m_s" in used:
        zeta = ns.log(values["pgv_m_s"] / (values["pga_g"] * STANDARD_GRAVITY_M_S2))
        result += [zeta, zeta * zeta]
    if any(period_of(name) is not None for name in used):
        result.append(ln_interpolated(velocity, used, values, ns) - over)
    if "tm_s" in used:
        result.append(ns.log(values["tm_s"]))
    if "magnitude" in used:
        result.append(ns.minimum(values["magnitude"], _MIDDLE_MAGNITUDE) - _MIDDLE_MAGNITUDE)
    return tuple(result)


def node_weights(values: Values, ns: ArrayNamespace) -> tuple[Any, ...]:
    """Return the weights of the sizes :data:`NODES_P2` at the block's size, linear in ln p."""
    l = ln_size(values, ns)  # noqa: E741  as in the formulas
    passed = [
        ns.minimum(ns.maximum((node - l) / (node - following), 0.0), 1.0)
        for node, following in pairwise(_NODES_LN_P)
    ]
    return tuple(lower - upper for lower, upper in pairwise((1.0, *passed, 0.0)))


def encode_regressions(regressions: Mapping[str, Regression]) -> str:
    """Return regressions by their inputs as JSON Lines, so that one is read without the others."""
    return "\n".join(
        json.dumps({"inputs": inputs, **regression._asdict()}, separators=(",", ":"))
        for inputs, regression in regressions.items()
    )


def decode_regression(text: str | None, used: Sequence[str]) -> Regression | None:
    """Return the stored regression for the used measures; None if there is none."""
    start = json.dumps({"inputs": key_of(used)}, separators=(",", ":"))[:-1] + ","
    for line in (text or "").splitlines():
        if line.startswith(start):
            stored = json.loads(line)
            return Regression(**{name: stored[name] for name in Regression._fields})
    return None


def key_of(used: Sequence[str]) -> str:
    """Return the name of a set of measures."""
    return " ".join(used)
