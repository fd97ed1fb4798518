"""Earthquakes of a stochastic event set or of one scenario, with the ground motion at sites."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import InputError
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
