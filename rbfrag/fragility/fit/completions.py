"""Regressions of the spectral velocity on what may be known of the shaking.

A spectral predictor is fitted with the exact velocity of every motion. Where an answer does not
know it, a regression over the same motions completes it
(:mod:`rbfrag.fragility.completion`): ordinary least squares, each motion once, at six sizes, with
the changes without each earthquake.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rbfrag.db.rows import CombinationTable
from rbfrag.errors import FitError
from rbfrag.fragility.completion import (
    NODES_P2,
    Regression,
    is_exact,
    key_of,
    ln_over,
    regressors_of,
    used_inputs,
)
from rbfrag.fragility.measures import Term
from rbfrag.fragility.method import SpectralPredictor, arrays
from rbfrag.fragility.spectral_velocity import PGA_PERIOD_S
from rbfrag.solver.results import FloatArray
from rbfrag.vocabulary.spectral import SPECTRUM_PERIODS_S, period_of, spectral_name

PERIOD_SETS_S: tuple[tuple[float, ...], ...] = (
    (1.0,),
    (0.3, 1.0, 3.0),
    (0.2, 1.0),
    (0.1, 0.2, 0.5, 1.0, 2.0),
    (0.1, 0.2, 0.3, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 7.5, 10.0),
    (0.1, 0.15, 0.2, 0.25, 0.3, 0.4, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 7.5, 10.0),
)
"""Periods [s] of the spectra of which regressions are stored with a model."""

FEWEST_MOTIONS, FEWEST_EVENTS = 50, 10
"""With fewer motions or earthquakes no regression is made."""


class MotionTable(NamedTuple):
    """Motions with response spectra, columns of shape (n,).

    Args:
        measures: intensity measures by name, NaN where unknown, with the 21 ordinates.
        event: place of the earthquake among those of the fit; as many as these for others.
        recording: number of the recording.
        events: number of earthquakes of the fit.
    """

    measures: Mapping[str, FloatArray]
    event: NDArray[np.intp]
    recording: NDArray[np.int64]
    events: int

    @classmethod
    def of(
        cls,
        table: CombinationTable,
        spectra: FloatArray,
        recording: NDArray[np.int64],
        events: Sequence[str],
    ) -> MotionTable:
        """Return the motions of combinations, each once.

        Args:
            spectra: of each combination [g], shape (n, 21), NaN where it is not stored.
            recording: number of the recording of each, shape (n,).
            events: the earthquakes of the fit.
        """
        order = np.argsort(table.natural_key.astype(str), kind="stable")
        order = order[np.isfinite(spectra[order]).all(axis=1)]
        rows = order[np.sort(np.unique(table.motion_id[order], return_index=True)[1])]
        measures = {name: table.measure(name)[rows]
                    for name in ("pgv_m_s", "pga_g", "tm_s", "magnitude")}  # fmt: skip
        for period_s, column in zip(SPECTRUM_PERIODS_S, spectra[rows].T, strict=True):
            measures[spectral_name(period_s)] = column
        place = {name: i for i, name in enumerate(events)}
        event = [place.get(name, len(events)) for name in table.event_id[rows].astype(str)]
        return cls(measures, np.array(event, dtype=np.intp), recording[rows], len(events))

    def measure(self, name: str) -> FloatArray:
        """Return a measure; of an ordinate between those stored ln V is linear in ln T, and below
        0.03 s SA is PGA.
        """
        period_s = period_of(name)
        if name in self.measures or period_s is None:
            return self.measures[name]
        stored = (PGA_PERIOD_S, *SPECTRUM_PERIODS_S)
        at = np.log(stored)
        ln_v = np.log(
            [self.measures["pga_g"], *(self.measures[spectral_name(t)] for t in stored[1:])]
        )
        ln_v += at[:, None]
        i = int(np.clip(np.searchsorted(at, math.log(period_s)) - 1, 0, len(stored) - 2))
        x = min(max((math.log(period_s) - at[i]) / (at[i + 1] - at[i]), 0.0), 1.0)
        sa = np.exp((1.0 - x) * ln_v[i] + x * ln_v[i + 1]) / max(period_s, PGA_PERIOD_S)
        return np.asarray(sa)


def ordinates_by_motion(
    spectra: Mapping[int, Sequence[float]], motion_id: NDArray[np.int64]
) -> FloatArray:
    """Return the ordinates [g] of motions, shape (n, 21), NaN where they are not stored."""
    unknown = [np.nan] * len(SPECTRUM_PERIODS_S)
    return np.array([spectra.get(number, unknown) for number in motion_id.tolist()]).reshape(
        motion_id.size, len(unknown)
    )


def spectral_velocities(
    velocity: SpectralPredictor, spectra: FloatArray, p: FloatArray | float
) -> FloatArray:
    """Return the exact spectral velocity [m/s] of spectra, shape (n,).

    Args:
        spectra: ordinates [g], shape (n, 21).
        p: frequency parameter of the block [1/s].
    """
    ordinates = dict(zip(SPECTRUM_PERIODS_S, spectra.T, strict=True))
    return np.asarray(np.exp(velocity.ln_velocity(ordinates, p, arrays())))


def stored_inputs(term: Term, velocity: SpectralPredictor) -> Iterator[tuple[str, ...]]:
    """Yield the sets of measures of which a model stores regressions."""
    spectra = [tuple(map(spectral_name, periods)) for periods in PERIOD_SETS_S]
    spectra = [()] * bool(velocity.over) + spectra
    complete = {
        used_inputs(term, velocity, (*term.inputs, *more, *spectrum))
        for spectrum in spectra
        for count in range(len(velocity.optional) + 1)
        for more in combinations(velocity.optional, count)
        if not spectrum or not {"tm_s", "magnitude"}.intersection(more)
    }
    return iter(sorted(complete))


def regress(velocity: SpectralPredictor, used: Sequence[str], motions: MotionTable) -> Regression:
    """Return the regression of ln of a spectral velocity on the used measures.

    Raises:
        FitError: too few motions or earthquakes have them.
    """
    ns = arrays()
    measures = {name: motions.measure(name) for name in {*used, "pgv_m_s", "pga_g"}}
    complete = np.all(
        [np.isfinite(measures[name]) & (measures[name] > 0.0) for name in used], axis=0
    )
    event, recording = motions.event[complete], motions.recording[complete]
    if complete.sum() < FEWEST_MOTIONS or np.unique(event).size < FEWEST_EVENTS:
        raise FitError(
            f"a regression of the spectral velocity on {key_of(used)} requires "
            f"{FEWEST_MOTIONS} motions of {FEWEST_EVENTS} earthquakes with response spectra: "
            f"there are {int(complete.sum())} of {np.unique(event).size}"
        )
    spectra = np.column_stack([motions.measures[spectral_name(t)] for t in SPECTRUM_PERIODS_S])
    values = {name: value[complete] for name, value in measures.items()}
    lines, sigmas, shared, steps = [], [], [], []
    for p2 in NODES_P2:
        values["p"] = np.full(event.size, math.sqrt(p2))
        over = ln_over(velocity, values, ns)
        y = np.log(spectral_velocities(velocity, spectra[complete], values["p"])) - over
        columns = np.broadcast_arrays(*regressors_of(velocity, used, values, over, ns), y)[:-1]
        x = np.column_stack(columns)
        line, sigma, of_events = _least_squares(x, y, event, motions.events)
        residual = y - x @ line
        of_event = shared_fraction(residual, event)
        lines.append(line.tolist())
        sigmas.append(sigma)
        shared.append([of_event, max(of_event, shared_fraction(residual, recording))])
        # for an interval six digits are plenty, and a model has many of them
        steps.append([[float(f"{step:.6g}") for step in line] for line in of_events.tolist()])
    return Regression(lines, sigmas, shared, steps)


def _least_squares(
    x: FloatArray, y: FloatArray, event: NDArray[np.intp], events: int
) -> tuple[FloatArray, float, FloatArray]:
    """Return the coefficients of least squares, the standard deviation of the residual, and the
    change of both without each earthquake, shape (events, k + 1).
    """
    rows = np.column_stack([x, y])
    k = x.shape[1]
    products = np.zeros((events + 1, k + 1, k + 1))
    np.add.at(products, event, rows[:, :, None] * rows[:, None, :])
    count = np.bincount(event, minlength=events + 1)
    total = products.sum(axis=0)
    remaining = np.concatenate([total[None], total - products[:events]])
    n = np.concatenate([[event.size], event.size - count[:events]])
    lines = np.linalg.solve(remaining[:, :k, :k], remaining[:, :k, k:])[..., 0]
    squares = remaining[:, k, k] - (lines * remaining[:, :k, k]).sum(axis=1)
    results = np.column_stack([lines, np.sqrt(np.maximum(squares, 0.0) / n)])
    return lines[0], float(results[0, -1]), results[1:] - results[0]


def shared_fraction(residual: FloatArray, group: NDArray[np.integer]) -> float:
    """Return the fraction of the variance of residuals that the members of a group share, by a
    one-way analysis of variance with groups of unequal size (Searle, Casella and McCulloch 1992).
    """
    number = np.unique(group, return_inverse=True)[1]
    size = np.bincount(number).astype(np.float64)
    n, groups = residual.size, size.size
    if groups < 2 or groups == n:
        return 0.0
    mean = np.bincount(number, residual) / size
    between = (size * (mean - residual.mean()) ** 2).sum() / (groups - 1)
    within = ((residual - mean[number]) ** 2).sum() / (n - groups)
    shared = max((between - within) / ((n - (size @ size) / n) / (groups - 1)), 0.0)
    return float(shared / (shared + within)) if shared + within else 0.0


def regressions(
    term: Term, velocity: SpectralPredictor, motions: MotionTable
) -> dict[str, Regression]:
    """Return the regressions that are stored with a model, by the measures they read."""
    result = {}
    for used in stored_inputs(term, velocity):
        if not is_exact(used):
            try:
                result[key_of(used)] = regress(velocity, used, motions)
            except FitError:  # of few motions T_m or the magnitude is known
                continue
    return result
