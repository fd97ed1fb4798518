"""What is not known of a rate of an event set, in three numbers that are never added up."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2

from rbfrag.fragility.intervals import quantiles_of
from rbfrag.hazards.branches import mixture_quantiles, weighted_quantiles
from rbfrag.hazards.event_set import EventSet
from rbfrag.hazards.kernel import interval_end
from rbfrag.solver.results import FloatArray

Ends = tuple[float, float]

QUANTILES = (0.05, 0.5, 0.95)
"""Quantiles over branches, and over these and the parameters of the model together."""

_SEPARABLE = 0.5
"""Part of the scatter between realizations that counting may make for it to be one of branches."""


@dataclass(frozen=True)
class MeanUncertainty:
    """What is not known of a mean of an event set.

    Args:
        counting: interval from the number of events: another event set as long gives another mean.
        knowledge: interval from the parameters of the model that the data leave open; None where
            it is not computed, as of models of several measures.
        branches: means that 5 and 95 % of the realizations of the logic tree do not exceed, by
            their weights; None of one realization, and where counting alone makes most of what
            they differ by: curves tell that better.
        together: quantiles of branches and parameters at 5, 50 and 95 %; None likewise.
    """

    counting: Ends
    knowledge: Ends | None
    branches: Ends | None
    together: tuple[float, float, float] | None

    @classmethod
    def of(cls, events: EventSet, values: FloatArray, half: float, level: float) -> MeanUncertainty:
        """Return what is not known of the weighted sum of some values.

        Args:
            values: of each event, shape (n,).
            half: what the interval from the parameters reaches to; NaN where it is not known.
            level: confidence level of the intervals.
        """
        parts = events.weight * values
        mean, squares = float(parts.sum()), float((parts**2).sum())
        if events.is_scenario:
            spread = float(((events.weight * (values - mean)) ** 2).sum())
            reach = quantiles_of(level).normal * float(np.sqrt(spread))
            counting = max(mean - reach, 0.0), mean + reach
        else:
            counting = rate_interval(mean, squares, float(parts.max(initial=0.0)), level)
        knowledge = None
        if half == half:
            low, high = (float(interval_end(np.array(mean), half, side)) for side in (-1.0, 1.0))
            knowledge = low, high
        sums = np.zeros((2, len(events.realization_weights)))
        for power in (1, 2):
            np.add.at(sums[power - 1], events.branch, parts**power)
        ends = branch_ends(events, sums)
        if ends is None:
            return cls(counting, knowledge, None, None)
        rates, weight = _branch_rates(events, sums)[::2]
        log_sd = np.zeros(1)
        if half == half and mean > 0.0:
            log_sd[0] = half / mean / quantiles_of(level).normal
        mixed = mixture_quantiles(rates[:, None], weight, log_sd, QUANTILES)[:, 0].tolist()
        return cls(counting, knowledge, ends, (mixed[0], mixed[1], mixed[2]))

    def as_dict(self) -> dict[str, float | None]:
        """Return the numbers under the keys of the JSON contract."""
        names = (f"p{round(100.0 * q):02d}" for q in QUANTILES)
        together = self.together or (None, None, None)
        return {
            **ends_by_name(
                counting=self.counting, knowledge=self.knowledge, branches=self.branches
            ),
            **dict(zip(names, together, strict=True)),
        }


def ends_by_name(**intervals: Ends | None) -> dict[str, float | None]:
    """Return the ends of intervals as name_low and name_high."""
    return {
        f"{name}_{side}": None if ends is None else ends[i]
        for name, ends in intervals.items()
        for i, side in enumerate(("low", "high"))
    }


def branch_ends(events: EventSet, sums: FloatArray) -> Ends | None:
    """Return the means that 5 and 95 % of the realizations do not exceed, by their weights.

    None of a scenario and of one realization, and where counting makes more than half of the
    variance between them: they cannot be told apart then.

    Args:
        sums: sum over the events of each realization of weight times value, and of its square,
            2 x realizations.
    """
    rates, counting, weight = _branch_rates(events, sums)
    if events.is_scenario or weight.size < 2:
        return None
    raw = float(weight @ (rates - weight @ rates) ** 2)
    if float((weight * (1.0 - weight)) @ counting) > _SEPARABLE * raw:
        return None
    low, high = weighted_quantiles(rates[:, None], weight, QUANTILES[::2])[:, 0].tolist()
    return low, high


def _branch_rates(events: EventSet, sums: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the mean of each realization, its variance from counting, and the weights."""
    weight = np.array(list(events.realization_weights.values()), dtype=np.float64)
    share = np.maximum(weight, np.finfo(np.float64).tiny)
    return sums[0] / share, sums[1] / share**2, weight


def rate_interval(rate: float, squares: float, widest: float, level: float) -> Ends:
    """Return both ends of the interval of a weighted sum of Poisson counts.

    Fay and Feuer (1997): the gamma interval, which is the exact one (Garwood 1936) where all
    weights are equal. Confidence intervals for directly standardized rates: a method based on the
    gamma distribution. Statistics in Medicine 16, 791-801.

    Args:
        rate: the sum of weights.
        squares: sum of their squares, the variance.
        widest: greatest weight that one more count may have.
    """
    tail = 0.5 * (1.0 - level)
    low = 0.0
    if rate > 0.0:
        low = squares / (2.0 * rate) * float(chi2.ppf(tail, 2.0 * rate * rate / squares))
    more, wider = rate + widest, squares + widest * widest
    if not more > 0.0:
        return 0.0, 0.0
    high = wider / (2.0 * more) * float(chi2.ppf(1.0 - tail, 2.0 * more * more / wider))
    return low, high


def share_interval(share: float, variance: float, least: float, level: float) -> Ends:
    """Return both ends of the interval of a mean probability over realisations.

    Wilson (1927), with as many realisations as give the variance. Probable inference, the law of
    succession, and statistical inference. Journal of the American Statistical Association 22(158),
    209-212.

    Args:
        least: sum of the squared weights of the realisations, one over their number.
    """
    z = quantiles_of(level).normal
    alone = share * (1.0 - share)
    n = alone / variance if variance > 1e-12 * alone > 0.0 else 1.0 / least
    middle, width = share + 0.5 * z * z / n, z * math.sqrt(alone / n + 0.25 * (z / n) ** 2)
    low, high = ((middle + side * width) / (1.0 + z * z / n) for side in (-1.0, 1.0))
    return max(low, 0.0), min(high, 1.0)
