"""How often per year an earthquake fails any, or k or more, of several blocks of one site."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from rbfrag.hazards.annual_rate import probability_in
from rbfrag.hazards.standing_blocks import COPULA, DEPENDENT, INDEPENDENT
from rbfrag.solver.results import FloatArray

if TYPE_CHECKING:
    from rbfrag.hazards.joint_thresholds import JointRates

NO_LAW = "bounds"
"""Joint law where only bounds are known."""

MOST_JOINT = 4096
"""Most blocks that the dependence is taken for."""

USUAL_COUNTS = (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000)
"""Numbers of failures whose rates are given where none are asked for."""


@dataclass(frozen=True, eq=False)
class CountRate:
    """Earthquakes in which so many blocks fail.

    Args:
        count: number of failures.
        annual_rate: annual rate of earthquakes with as many or more [1/a].
        numerical_error: standard error of the rate as a quadrature, relative to it.
        probability: probability of at least one such earthquake in the period.
    """

    count: int
    annual_rate: float
    numerical_error: float
    probability: float


@dataclass(frozen=True, eq=False)
class JointRate:
    """Earthquakes that fail several blocks of one site.

    Args:
        at_least: how often earthquakes fail some numbers of blocks or more, the first any; empty
            where only bounds are known.
        annual_rate_any_ci: both ends of the interval of the first rate from the parameters of the
            fragility.
        joint_law: how the blocks of one earthquake fail together.
        bounds: the rate and the probability under full dependence, where the block of the greatest
            P fails first, and if blocks fail independently at each level of the shaking.
    """

    at_least: tuple[CountRate, ...]
    annual_rate_any_ci: tuple[float, float] | None
    joint_law: str
    bounds: Mapping[str, Mapping[str, float]]

    @property
    def annual_rate_any(self) -> float | None:
        """Annual rate of earthquakes with at least one failure [1/a]; None without a law."""
        return self.at_least[0].annual_rate if self.at_least else None

    @property
    def probability_any(self) -> float | None:
        """Probability of at least one such earthquake in the period; None without a law."""
        return self.at_least[0].probability if self.at_least else None

    @classmethod
    def of(
        cls,
        any_bounds: Sequence[float],
        years: float,
        rates: JointRates | None = None,
        ends_of_any: tuple[float, float] | None = None,
    ) -> JointRate:
        """Return the rates of one site with their probabilities.

        Earthquakes are the Poisson process, not failures: the probability in T years is
        1 - exp(-λ_any T).

        Args:
            any_bounds: rates at which any fails under full dependence and if independent [1/a].
            years: the period [a].
            rates: what :func:`~rbfrag.hazards.joint_thresholds.joint_rates` gives, of any failure
                first; None where the law is not known.
            ends_of_any: both ends of the interval of the rate of any failure [1/a].
        """
        bounds = {
            name.replace(" ", "_"): {
                "annual_rate_any": float(rate),
                "probability_any": float(probability_in(years, rate)),
            }
            for name, rate in zip((DEPENDENT, INDEPENDENT), any_bounds, strict=True)
        }
        if rates is None:
            return cls((), None, NO_LAW, bounds)
        of_first = rates.rate[:, 0], rates.error, probability_in(years, rates.rate[:, 0])
        tiny = np.finfo(np.float64).tiny
        at_least = tuple(
            CountRate(count, rate, error / max(rate, tiny), probability)
            for count, rate, error, probability in zip(
                rates.counts, *(values.tolist() for values in of_first), strict=True
            )
        )
        return cls(at_least, ends_of_any, COPULA, bounds)

    @classmethod
    def mean(cls, parts: Sequence[JointRate], weights: FloatArray) -> JointRate:
        """Return the weighted mean over branches of a logic tree; all know the law, or none."""

        def meant(values: Iterable[Any]) -> float:
            return float(sum(w * value for w, value in zip(weights, values, strict=True)))

        bounds = {
            law: {name: meant(part.bounds[law][name] for part in parts) for name in numbers}
            for law, numbers in parts[0].bounds.items()
        }
        if parts[0].joint_law == NO_LAW:
            return cls((), None, NO_LAW, bounds)
        at_least = tuple(
            CountRate(
                first.count,
                *(
                    meant(getattr(part.at_least[i], name) for part in parts)
                    for name in ("annual_rate", "numerical_error", "probability")
                ),
            )
            for i, first in enumerate(parts[0].at_least)
        )
        low, high = (
            meant(part.annual_rate_any_ci[i] for part in parts if part.annual_rate_any_ci)
            for i in (0, 1)
        )
        return cls(at_least, (low, high), parts[0].joint_law, bounds)

    def as_dict(self) -> dict[str, object]:
        """Return the numbers under the keys of the JSON contract."""
        ends = self.annual_rate_any_ci
        return {
            "annual_rate_any": self.annual_rate_any,
            "annual_rate_any_ci": None if ends is None else list(ends),
            "probability_any": self.probability_any,
            "annual_rate_at_least": [dict(vars(one)) for one in self.at_least] or None,
            "joint_law": self.joint_law,
            "bounds": {name: dict(values) for name, values in self.bounds.items()},
        }
