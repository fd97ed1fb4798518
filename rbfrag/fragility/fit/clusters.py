"""Errors clustered by earthquake: sandwich covariance, bootstrap and jackknife over earthquakes."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from rbfrag.fragility.fit.likelihood import Likelihood
from rbfrag.solver.results import FloatArray


def event_derivatives(rows: Likelihood, b: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the score and the information of each earthquake, shapes (G, k) and (G, k, k)."""
    parts = [rows.only(rows.event == e).derivatives(b) for e in np.unique(rows.event)]
    return np.array([score for score, _ in parts]), np.array([part for _, part in parts])


def jackknife_steps(rows: Likelihood, b: FloatArray) -> FloatArray:
    """Return the jackknife steps d_e = (H - H_e)⁻¹ s_e of each earthquake, shape (G, k).

    One Newton step from the fit to all data to the one without earthquake e.
    """
    scores, parts = event_derivatives(rows, b)
    _, information = rows.derivatives(b)
    return np.array([
        np.linalg.lstsq(information - part, score, rcond=None)[0]
        for score, part in zip(scores, parts, strict=True)
    ])  # fmt: skip


def cr3(steps: FloatArray) -> FloatArray:
    """Return the jackknife covariance (CR3), (G-1)/G · Σ d dᵀ for the G rows d of `steps`.

    With unequal earthquakes CR1 is too small; this is not (Bell and McCaffrey 2002, Survey
    Methodology 28(2), 169-181).
    """
    g = steps.shape[0]
    return np.asarray((g - 1.0) / g * (steps.T @ steps))


def sandwich(rows: Likelihood, b: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the covariance clustered by earthquake (CR1) and the inverse of the information.

    CR1 is H⁻¹ (Σ s_e s_eᵀ) H⁻¹ · G/(G-1) · (n-1)/(n-k).
    """
    scores, parts = event_derivatives(rows, b)
    bread = np.linalg.inv(parts.sum(axis=0))
    (g, k), n = scores.shape, rows.event.size
    factor = g / (g - 1.0) * (n - 1.0) / (n - k)
    return np.asarray(factor * bread @ (scores.T @ scores) @ bread), np.asarray(bread)


def bootstrap(
    event: NDArray[np.intp],
    fit: Callable[[FloatArray], FloatArray],
    *,
    replicates: int,
    seed: int,
    enough: Callable[[FloatArray], bool] | None = None,
) -> FloatArray:
    """Return parameters fitted to resampled earthquakes, shape (replicates, k).

    Whole earthquakes are drawn with replacement, because the points of one are not independent.

    Args:
        event: number of each row's earthquake, shape (n,).
        fit: returns the parameters from how many times each row counts, shape (n,).
        enough: whether a draw can be fitted; another is drawn if not.
    """
    random = np.random.default_rng(seed)
    events, number = np.unique(event, return_inverse=True)

    def drawn() -> FloatArray:
        count = events.size
        times = np.bincount(random.integers(count, size=count), minlength=count)
        return times[number].astype(np.float64)

    samples = []
    for _ in range(replicates):
        times = drawn()
        while enough is not None and not enough(times):
            times = drawn()
        samples.append(fit(times))
    return np.array(samples)


def left_out(
    event: NDArray[np.intp], fit: Callable[[NDArray[np.bool_]], FloatArray]
) -> dict[int, FloatArray]:
    """Return the parameters of the fit without each earthquake, by earthquake index.

    Args:
        event: number of each row's earthquake, shape (n,).
        fit: returns the parameters from the rows that stay, shape (n,).
    """
    return {int(e): fit(event != e) for e in np.unique(event)}
