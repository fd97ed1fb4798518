"""Survival probability of standing blocks: Poisson failures with uncertain age and rate.

    S(f) = E[exp(-f λ T)]

with λ the rate at which any of the blocks fails, T the age and f a factor on all hazard rates.
Everything is done on ln S, which stays finite where S itself is 0 for a computer.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq
from scipy.special import logsumexp

from rbfrag.errors import InputError
from rbfrag.fragility.uncertain import normal_steps
from rbfrag.solver.results import FloatArray

_AGES = 401
_REACH = 10.0
"""Points of the law of the age, and how far they reach in standard deviations of ln T: survival
of a high rate is decided in the far lower tail."""

_DOUBLINGS = 1000


@dataclass(frozen=True, eq=False)
class Age:
    """Age of standing blocks: a lognormal distribution with given mean and standard deviation.

    Lognormal rather than normal and cut at zero: an exposure age is a concentration over a
    production rate, whose errors multiply; and a normal law gives weight to rocks that have stood
    for no time at all, which is all that would be left of the survival of a high rate.

    Args:
        years: ages [a], shape (q,).
        weight: their weights, which sum to 1, shape (q,).
    """

    years: FloatArray
    weight: FloatArray

    @classmethod
    def of(cls, mean: float, sd: float = 0.0) -> Age:
        """Return the lognormal distribution of an age.

        Args:
            mean: mean age [a], above 0.
            sd: its standard deviation [a], 0 for an age that is known.

        Raises:
            InputError: the age is not above 0, or its standard deviation is below 0.
        """
        if not (math.isfinite(mean) and mean > 0.0):
            raise InputError(f"age = {mean:g} years: give the age of the blocks, above 0")
        if not (math.isfinite(sd) and sd >= 0.0):
            raise InputError(f"standard deviation of the age = {sd:g} years: give 0 or more")
        if sd == 0.0:
            return cls(np.array([mean]), np.ones(1))
        variance = math.log1p((sd / mean) ** 2)
        z, weight = normal_steps(_AGES, _REACH)
        return cls(mean * np.exp(math.sqrt(variance) * z - 0.5 * variance), weight)


@dataclass(frozen=True, eq=False)
class Standing:
    """Survival as a mixture over rates and ages.

    Args:
        failures: expected number of failures λT at the hazard as given, shape (n,).
        log_weight: logarithms of the weights, which sum to 1, shape (n,).
    """

    failures: FloatArray
    log_weight: FloatArray

    @classmethod
    def of(cls, annual_rate: ArrayLike, weight: ArrayLike, age: Age) -> Standing:
        """Return the survival for a discrete distribution of rates.

        Args:
            annual_rate: rates at which any block fails [1/a], shape (k,).
            weight: their probabilities, shape (k,).
        """
        failures = np.multiply.outer(np.asarray(annual_rate, dtype=np.float64), age.years)
        with np.errstate(divide="ignore"):
            log_weight = np.log(np.multiply.outer(np.asarray(weight), age.weight))
        return cls(failures.ravel(), log_weight.ravel())

    @classmethod
    def mixed(cls, parts: list[Standing], weight: ArrayLike) -> Standing:
        """Return the survival as a mixture over several hazards with given probabilities."""
        with np.errstate(divide="ignore"):
            logs = np.log(np.asarray(weight, dtype=np.float64))
        return cls(
            np.concatenate([part.failures for part in parts]),
            np.concatenate([part.log_weight + w for part, w in zip(parts, logs, strict=True)]),
        )

    def log_probability(self, factor: float = 1.0) -> float:
        """Return ln of the survival probability for all hazard rates times a factor."""
        return float(logsumexp(self.log_weight - factor * self.failures))

    @property
    def probability(self) -> float:
        """Probability that all blocks stand after the age."""
        return min(math.exp(self.log_probability()), 1.0)

    def factor(self, probability: float) -> float | None:
        """Return the factor on the hazard rates that gives a survival probability.

        None where no factor makes survival so improbable: nothing fails, or may fail, ever.
        """
        target = math.log(probability)
        never = self.log_weight[self.failures == 0.0]
        if never.size and logsumexp(never) >= target:
            return None
        # S(f) >= exp(-f E[λT]) by Jensen: the factor is at least -ln(probability)/E[λT]
        low = -target / float(np.exp(self.log_weight) @ self.failures)
        high = low
        for _ in range(_DOUBLINGS):
            if self.log_probability(high) <= target:
                break
            low, high = high, 2.0 * high
        if high == low:
            return high
        return float(
            brentq(lambda f: self.log_probability(f) - target, low, high, rtol=1e-12, xtol=1e-300)
        )


def weights_given_standing(parts: list[Standing], weight: ArrayLike) -> FloatArray:
    """Return the posterior weights of hazards given that all blocks stand (Bayes): w S/Σ w S.

    Args:
        weight: their weights before, which sum to 1, shape (n,).
    """
    with np.errstate(divide="ignore"):
        logs = np.log(np.asarray(weight, dtype=np.float64))
    logs = logs + np.array([part.log_probability() for part in parts])
    return np.asarray(np.exp(logs - logsumexp(logs)))
