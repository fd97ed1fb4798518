"""A normal linear regression with left-censored points, by maximum likelihood.

In the parameters (beta/sigma, 1/sigma) the log likelihood is concave (Olsen 1978,
Econometrica 46(5), 1211-1215), so that Newton's method finds the one maximum.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rbfrag.fragility.fit.binomial import cr3

FloatArray = NDArray[np.float64]

TOLERANCE = 1e-10
MOST_ITERATIONS = 100


@dataclass(frozen=True, eq=False)
class CensoredData:
    """Points of a censored regression.

    Args:
        columns: regressors, shape (n, k).
        y: responses; for censored points the value they lie below, shape (n,).
        found: False for censored points, shape (n,).
        event: number of each point's earthquake, shape (n,).
    """

    columns: FloatArray
    y: FloatArray
    found: NDArray[np.bool_]
    event: NDArray[np.intp]

    def only(self, chosen: NDArray[np.bool_]) -> CensoredData:
        """Return some of the points."""
        return CensoredData(
            self.columns[chosen], self.y[chosen], self.found[chosen], self.event[chosen]
        )


def maximise(
    data: CensoredData, start: FloatArray | None = None, weights: FloatArray | None = None
) -> FloatArray:
    """Return beta_0 … beta_{k-1} and ln sigma at the maximum of the likelihood.

    Args:
        data: the points.
        start: parameters to start from; None starts from least squares of the found points.
        weights: how many times each point counts, shape (n,).
    """
    w = np.ones(data.y.size) if weights is None else weights
    if start is None:
        x, y = data.columns[data.found], data.y[data.found]
        beta = np.linalg.lstsq(x, y, rcond=None)[0]
        start = np.append(beta, np.log(max((y - x @ beta).std(), 1e-12)))
    theta = _to_olsen(start)
    value = _loss(theta, data, w)
    for _ in range(MOST_ITERATIONS):
        scores, information = _derivatives(theta, data, w)
        step = np.linalg.lstsq(information, scores.sum(axis=0), rcond=None)[0]
        length, previous = 1.0, value
        while True:
            trial = theta + length * step
            value = _loss(trial, data, w) if trial[-1] > 0.0 else np.inf
            if value <= previous or length < 1e-8:
                break
            length *= 0.5
        theta = trial
        if abs(previous - value) <= TOLERANCE * (1.0 + abs(value)):
            break
    return np.append(theta[:-1] / theta[-1], -np.log(theta[-1]))


def clustered_covariance(data: CensoredData, parameters: FloatArray) -> FloatArray:
    """Return the covariance of (beta, ln sigma), clustered by earthquake.

    The sandwich of observed information and scores summed by earthquake, with the correction
    CR1, G/(G-1)·(n-1)/(n-k), as :func:`rbfrag.fragility.fit.binomial.fit_by_statsmodels`.
    """
    theta = _to_olsen(parameters)
    scores, information = _derivatives(theta, data, np.ones(data.y.size))
    summed = np.column_stack([np.bincount(data.event, column) for column in scores.T])
    g, n, k = int(np.unique(data.event).size), data.y.size, theta.size
    bread = np.linalg.inv(information)
    middle = bread @ (summed.T @ summed) @ bread
    jacobian = _to_natural(theta)
    factor = g / (g - 1.0) * (n - 1.0) / (n - k)
    return np.asarray(factor * jacobian @ middle @ jacobian.T)


def jackknife_covariance(data: CensoredData, parameters: FloatArray) -> FloatArray:
    """Return the covariance of (beta, ln sigma) from leaving out each earthquake (CR3).

    As :func:`rbfrag.fragility.fit.binomial.jackknife_covariance`, with the observed information.
    """
    return cr3(jackknife_steps(data, parameters))


def jackknife_steps(data: CensoredData, parameters: FloatArray) -> FloatArray:
    """Return the step of (beta, ln sigma) to the fit without each earthquake, shape (G, k)."""
    theta = _to_olsen(parameters)
    ones = np.ones(data.y.size)
    _, information = _derivatives(theta, data, ones)
    steps = []
    for event in np.unique(data.event):
        own = data.event == event
        scores, part = _derivatives(theta, data.only(own), ones[own])
        steps.append(np.linalg.lstsq(information - part, scores.sum(axis=0), rcond=None)[0])
    return np.asarray(np.array(steps) @ _to_natural(theta).T)


def _to_natural(theta: FloatArray) -> FloatArray:
    k = theta.size
    jacobian = np.zeros((k, k))
    jacobian[:-1, :-1] = np.eye(k - 1) / theta[-1]
    jacobian[:-1, -1] = -theta[:-1] / theta[-1] ** 2
    jacobian[-1, -1] = -1.0 / theta[-1]
    return jacobian


def naive_covariance(data: CensoredData, parameters: FloatArray) -> FloatArray:
    """Return the inverse of the observed information in (beta, ln sigma)."""
    theta = _to_olsen(parameters)
    _, information = _derivatives(theta, data, np.ones(data.y.size))
    jacobian = _to_natural(theta)
    return np.asarray(jacobian @ np.linalg.inv(information) @ jacobian.T)


def log_density(data: CensoredData, parameters: FloatArray) -> FloatArray:
    """Return the log likelihood of each point (its density, or the probability to be below)."""
    theta = _to_olsen(parameters)
    return _log_likelihood(theta, data)


def _to_olsen(parameters: FloatArray) -> FloatArray:
    h = np.exp(-parameters[-1])
    return np.append(parameters[:-1] * h, h)


def _log_likelihood(theta: FloatArray, data: CensoredData) -> FloatArray:
    from scipy.special import log_ndtr

    u = theta[-1] * data.y - data.columns @ theta[:-1]
    density = np.log(theta[-1]) - 0.5 * u * u - 0.5 * np.log(2.0 * np.pi)
    return np.asarray(np.where(data.found, density, log_ndtr(u)))


def _loss(theta: FloatArray, data: CensoredData, w: FloatArray) -> float:
    return -float(w @ _log_likelihood(theta, data))


def _derivatives(
    theta: FloatArray, data: CensoredData, w: FloatArray
) -> tuple[FloatArray, FloatArray]:
    from scipy.special import log_ndtr

    h = theta[-1]
    u = h * data.y - data.columns @ theta[:-1]
    by_u = np.column_stack([-data.columns, data.y])  # du/dtheta
    mills = np.exp(-0.5 * u * u - 0.5 * np.log(2.0 * np.pi) - log_ndtr(u))
    first = np.where(data.found, -u, mills)
    second = np.where(data.found, 1.0, mills * (u + mills))
    scores = by_u * (w * first)[:, None]
    scores[:, -1] += np.where(data.found, w / h, 0.0)
    information = (by_u * (w * second)[:, None]).T @ by_u
    information[-1, -1] += float((w * data.found).sum()) / h**2
    return scores, information
