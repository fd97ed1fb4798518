"""Earthquakes of an event set or of one scenario, and the uncertainty of means over them.

An event set is stochastic; the sources of uncertainty of its means are not combined.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from rbfrag.errors import InputError
from rbfrag.fragility.confidence import quantiles_of
from rbfrag.hazards.branches import mixture_quantiles, weighted_quantiles
from rbfrag.hazards.rate_integration import interval_end
from rbfrag.solver.results import FloatArray

IntArray = NDArray[np.int64]


@dataclass(frozen=True)
class Duration:
    """Duration of each realization of the logic tree.

    Args:
        investigation_time: length of one stochastic event set [a].
        ses: number of such sets of each realization (ses_per_logic_tree_path).
    """

    investigation_time: float
    ses: int

    def __post_init__(self) -> None:
        if not 0.0 < self.investigation_time < np.inf:
            raise InputError(
                f"investigation_time = {self.investigation_time:g}: give years above zero"
            )
        if self.ses < 1:
            raise InputError(f"ses_per_logic_tree_path = {self.ses}: give a number above zero")

    @property
    def years(self) -> float:
        """Years of each realization."""
        return self.investigation_time * self.ses


@dataclass(frozen=True, eq=False)
class EventSet:
    """Earthquakes, and ground motion by event and site.

    What has no row was not shaken.

    Args:
        event_id: numbers of the n events, none below zero, shape (n,).
        realization: numbers of their realizations of the logic tree, shape (n,).
        year: years that they happen in, shape (n,).
        weight: what an event counts: its annual rate [1/a], or, of a scenario, the probability of
            this realisation of the ground motion, shape (n,).
        site_ids: names of the sites.
        event: index of the event of each of the r rows, rising, shape (r,).
        site: index of the site of each row, shape (r,).
        measures: values by the names of :func:`rbfrag.predict`, shape (r,) each.
        duration: of each realization; None for a scenario.
        realization_weights: weights of the realizations, which sum to 1, by their numbers.
        warnings: what was noticed on reading.
        coordinates: longitudes and latitudes of the sites [deg], shape (sites, 2); None: not known.
    """

    event_id: IntArray
    realization: IntArray
    year: IntArray
    weight: FloatArray
    site_ids: tuple[str, ...]
    event: IntArray
    site: IntArray
    measures: Mapping[str, FloatArray]
    duration: Duration | None
    realization_weights: Mapping[int, float]
    warnings: tuple[str, ...] = ()
    coordinates: FloatArray | None = None

    @property
    def branch(self) -> IntArray:
        """Index of the realization of each event in `realization_weights`, shape (n,)."""
        numbers = np.array(list(self.realization_weights))
        order = np.argsort(numbers)
        return np.asarray(order[np.searchsorted(numbers[order], self.realization)])

    @property
    def is_scenario(self) -> bool:
        """True if the events are realizations of one scenario, which has no rate."""
        return self.duration is None

    @property
    def effective_years(self) -> float | None:
        """Length of one catalogue of equal sampling uncertainty [a]; None for a scenario.

        T/Σw² of realizations of T years with the weights w.
        """
        if self.duration is None:
            return None
        return self.duration.years / sum(w * w for w in self.realization_weights.values())


def event_weights(
    realization: IntArray, weights: Mapping[int, float], duration: Duration | None
) -> FloatArray:
    """Return the weight of each event.

    With a duration its annual rate [1/a], weight(realization)/(investigation time × number of
    sets), which is right for one realization, for all of them and for samples alike. Without one
    the weight of the realization over the number of its events, which sum to 1.

    Args:
        realization: realization of each event, shape (n,).
        duration: of each realization; None for a scenario.
    """
    event_weight = np.array([weights[number] for number in realization.tolist()])
    if duration is not None:
        return event_weight / duration.years
    numbers, counts = np.unique(realization, return_counts=True)
    of_its = dict(zip(numbers.tolist(), counts.tolist(), strict=True))
    share = event_weight / np.array([of_its[number] for number in realization.tolist()])
    return np.asarray(share / share.sum())


Ends = tuple[float, float]

LOGIC_TREE_LEVEL = 0.9
"""Fraction of the weights between the ends of an interval of the logic tree."""

QUANTILES = (0.05, 0.5, 0.95)
"""Quantiles over branches, and over these and the parameters of the model together."""

SOURCES = {
    "event_set_sampling": "event-set sampling",
    "fragility": "fragility",
    "logic_tree": "logic tree",
}
"""Sources of uncertainty: as keys begin, and in words."""

_SEPARABLE = 0.5
"""Part of the variance between realizations that event-set sampling may make for the rest to be
that of the logic tree."""


@dataclass(frozen=True)
class MeanUncertainty:
    """Uncertainty of a mean of an event set, by source.

    Args:
        event_set_sampling: interval from the number of events: another event set as long gives
            another mean.
        fragility: interval from the parameters of the fragility model; None where it is not
            computed, as of models of several measures.
        logic_tree: 5th and 95th percentile over the realizations, by their weights; None of one
            realization, and where event-set sampling makes most of the differences between them:
            hazard curves show these better.
        combined: quantiles of logic tree and fragility together at 5, 50 and 95 %; None likewise.
        level: confidence level of the first two.
    """

    event_set_sampling: Ends
    fragility: Ends | None
    logic_tree: Ends | None
    combined: tuple[float, float, float] | None
    level: float

    @classmethod
    def of(
        cls,
        events: EventSet,
        values: FloatArray,
        half: float,
        level: float,
        *,
        are_probabilities: bool = False,
    ) -> MeanUncertainty:
        """Return the uncertainty of a weighted sum of values over the events.

        Args:
            values: of each event, shape (n,).
            half: half width of the interval from the parameters; NaN where it is unknown.
            level: confidence level of the intervals.
            are_probabilities: the values are at most 1, as is the mean of a scenario.
        """
        parts = events.weight * values
        mean, squares = float(parts.sum()), float((parts**2).sum())
        if are_probabilities:
            sampling = reached_interval(events, mean, squares, level)
        elif events.is_scenario:
            spread = float(((events.weight * (values - mean)) ** 2).sum())
            reach = quantiles_of(level).normal * float(np.sqrt(spread))
            sampling = max(mean - reach, 0.0), mean + reach
        else:
            sampling = rate_interval(mean, squares, float(parts.max(initial=0.0)), level)
        fragility = None
        if half == half:
            low, high = (float(interval_end(np.array(mean), half, side)) for side in (-1.0, 1.0))
            fragility = low, min(high, 1.0) if are_probabilities and events.is_scenario else high
        sums = np.zeros((2, len(events.realization_weights)))
        for power in (1, 2):
            np.add.at(sums[power - 1], events.branch, parts**power)
        ends = branch_ends(events, sums)
        if ends is None:
            return cls(sampling, fragility, None, None, level)
        rates, weight = _branch_rates(events, sums)[::2]
        log_sd = np.zeros(1)
        if half == half and mean > 0.0:
            log_sd[0] = half / mean / quantiles_of(level).normal
        mixed = mixture_quantiles(rates[:, None], weight, log_sd, QUANTILES)[:, 0].tolist()
        return cls(sampling, fragility, ends, (mixed[0], mixed[1], mixed[2]), level)

    def intervals(self) -> Iterator[tuple[str, float, Ends]]:
        """Yield each source that is quantified, the level of its interval, and its ends."""
        for name, source in SOURCES.items():
            if (ends := getattr(self, name)) is not None:
                yield source, LOGIC_TREE_LEVEL if name == "logic_tree" else self.level, ends
        if self.combined is not None:
            yield "fragility and logic tree", LOGIC_TREE_LEVEL, self.combined[::2]

    def as_dicts(self, quantity: str) -> list[dict[str, Any]]:
        """Return the intervals under the keys of the JSON contract.

        Args:
            quantity: key of the mean.
        """
        return [
            {"quantity": quantity, "source": source, "level": level, "low": low, "high": high}
            for source, level, (low, high) in self.intervals()
        ]


def ends_by_name(uncertainty: object) -> dict[str, float | None]:
    """Return the ends of the intervals by source as name_low and name_high.

    Args:
        uncertainty: has an interval, or None, under each name of :data:`SOURCES`.
    """
    return {
        f"{name}_{side}": None if ends is None else ends[i]
        for name, ends in ((name, getattr(uncertainty, name)) for name in SOURCES)
        for i, side in enumerate(("low", "high"))
    }


TOLERANCE = 1e-5
"""Fraction of the probability of any failure, of the expected failures and of the expected loss of
an event that blocks without samples add at most."""


def reached_interval(events: EventSet, rate: float, squares: float, level: float) -> Ends:
    """Return both ends of the interval, by event-set sampling, of how often something is reached.

    Args:
        rate: rate of events that reach it [1/yr]; of a scenario its probability.
        squares: sum of the squared parts of it.
        level: confidence level.

    Blocks that are not sampled can only raise the rate: the numerical error, `TOLERANCE` of it, is
    added to the upper end.
    """
    if events.is_scenario:
        alike = float((events.weight**2).sum())
        low, high = share_interval(rate, squares - rate * rate * alike, alike, level)
        return low, min(high * (1.0 + TOLERANCE), 1.0)
    low, high = rate_interval(rate, squares, float(events.weight.max()), level)
    return low, high * (1.0 + TOLERANCE)


def branch_ends(events: EventSet, sums: FloatArray) -> Ends | None:
    """Return the 5 and 95 % quantiles of the means over the realizations, by their weights.

    None of a scenario and of one realization, and where event-set sampling makes more than half of
    the variance between them: they cannot be distinguished then.

    Args:
        sums: sum over the events of each realization of weight times value, and of its square,
            2 x realizations.
    """
    rates, variance, weight = _branch_rates(events, sums)
    if events.is_scenario or weight.size < 2:
        return None
    raw = float(weight @ (rates - weight @ rates) ** 2)
    if float((weight * (1.0 - weight)) @ variance) > _SEPARABLE * raw:
        return None
    low, high = weighted_quantiles(rates[:, None], weight, QUANTILES[::2])[:, 0].tolist()
    return low, high


def _branch_rates(events: EventSet, sums: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the mean of each realization, its sampling variance, and the weights."""
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
    """Return both ends of the interval of a mean probability over realizations.

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
