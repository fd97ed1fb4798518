"""Binary outcomes fitted by maximum likelihood, with errors clustered by earthquake.

The fit that is stored comes from statsmodels' GLM; the many fits of resamples and left-out
earthquakes start from it and use the short Newton iteration here, which the tests compare
with statsmodels and with an independent matrix computation.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import FitError
from rbfrag.fragility.fit.links import Link

FloatArray = NDArray[np.float64]

TOLERANCE = 1e-10
MOST_ITERATIONS = 60
_EDGE = 1e-12


@dataclass(frozen=True, eq=False)
class BinomialData:
    """Rows of a fit of outcomes.

    Args:
        columns: features, shape (n, k).
        outcome: 1 toppled, 0 safe, shape (n,).
        weights: weight of each row, shape (n,).
        event: number of each row's earthquake, shape (n,).
    """

    columns: FloatArray
    outcome: FloatArray
    weights: FloatArray
    event: NDArray[np.intp]

    def only(self, chosen: NDArray[np.bool_]) -> BinomialData:
        """Return some of the rows."""
        return BinomialData(
            self.columns[chosen], self.outcome[chosen], self.weights[chosen], self.event[chosen]
        )


def newton(
    data: BinomialData,
    link: Link,
    start: FloatArray,
    *,
    weights: FloatArray | None = None,
    tolerance: float = TOLERANCE,
) -> tuple[FloatArray, bool]:
    """Maximise the likelihood by Fisher scoring with halved steps.

    Args:
        data: the rows.
        link: from eta to probability.
        start: parameters to start from, shape (k,).
        weights: instead of those of `data`.
        tolerance: relative change of the log likelihood that ends the iteration.

    Returns:
        The parameters, and whether the iteration came to rest.
    """
    x, t = data.columns, data.outcome
    w = data.weights if weights is None else weights
    b = start
    value = _loss(x @ b, t, w, link)
    for _ in range(MOST_ITERATIONS):
        score, information = _derivatives(x, x @ b, t, w, link)
        step = np.linalg.lstsq(information, score, rcond=None)[0]
        length, previous = 1.0, value
        while True:
            trial = b + length * step
            value = _loss(x @ trial, t, w, link)
            if value <= previous or length < 1e-6:
                break
            length *= 0.5
        b = trial
        if abs(previous - value) <= tolerance * (abs(value) + 1e-300):
            return b, True
    return b, False


def jackknife_covariance(data: BinomialData, link: Link, parameters: FloatArray) -> FloatArray:
    """Return the covariance of the parameters from leaving out each earthquake (CR3).

    (G-1)/G · Σ_e d_e d_eᵀ over the :func:`jackknife_steps`. With unequal earthquakes CR1 is too
    small; this is not (Bell and McCaffrey 2002, Survey Methodology 28(2), 169-181).
    """
    return cr3(jackknife_steps(data, link, parameters))


def jackknife_steps(data: BinomialData, link: Link, parameters: FloatArray) -> FloatArray:
    """Return d_e = (H - H_e)⁻¹ s_e of each earthquake, shape (G, k).

    One Newton step from the fit to all data to the one without earthquake e.
    """
    x, t, w = data.columns, data.outcome, data.weights
    eta = x @ parameters
    _, information = _derivatives(x, eta, t, w, link)
    steps = []
    for event in np.unique(data.event):
        own = data.event == event
        score, part = _derivatives(x[own], eta[own], t[own], w[own], link)
        steps.append(np.linalg.lstsq(information - part, score, rcond=None)[0])
    return np.array(steps)


def cr3(steps: FloatArray) -> FloatArray:
    """Return (G-1)/G · Σ d dᵀ for the G rows d of `steps`."""
    g = steps.shape[0]
    return np.asarray((g - 1.0) / g * (steps.T @ steps))


def effective_freedom(steps: FloatArray) -> int:
    """Return the degrees of freedom of a variance Σ d², of the parameter that has fewest.

    The variance is a sum over G earthquakes, of which a few may make up most. It scatters like a
    chi-square number of 2V²/Var(V) degrees of freedom (Satterthwaite 1946, Biometrics Bulletin
    2(6), 110-114), with V = Σ d² and Var(V) = Σ d⁴ - V²/G from the steps themselves: G for normal
    steps. No more than G - 1, and no less than 4.

    Args:
        steps: the d of each earthquake, shape (G, k).
    """
    g = steps.shape[0]
    squares = steps * steps
    total = squares.sum(axis=0)
    spread = (squares * squares).sum(axis=0) - total * total / g
    with np.errstate(divide="ignore", invalid="ignore"):
        each = np.where(spread > 0.0, 2.0 * total * total / spread, np.inf)
    return int(np.clip(each.min(), min(4, g - 1), g - 1))


def maximum_likelihood(data: BinomialData, link: Link) -> FloatArray:
    """Return the parameters of greatest likelihood.

    Raises:
        FitError: the outcomes are all alike, or the features separate them.
    """
    refuse_one_class(data.outcome)
    parameters, settled = newton(data, link, _start(data, link), tolerance=1e-14)
    refuse_separation(data, parameters, settled)
    return parameters


def fit_by_statsmodels(data: BinomialData, link: Link) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Fit by statsmodels' GLM.

    Returns:
        The parameters, their covariance clustered by earthquake, H⁻¹ (Σ_e s_e s_eᵀ) H⁻¹ ·
        G/(G-1) · (n-1)/(n-k) with the observed information H and the score s_e of earthquake e
        (the correction CR1 for G earthquakes, n rows, k parameters), and the naive covariance.

    Raises:
        FitError: the outcomes are all alike, or the features separate them.
    """
    import statsmodels.api as sm
    from statsmodels.tools.sm_exceptions import DomainWarning, SpecificationWarning

    start = maximum_likelihood(data, link)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DomainWarning)
        # That weights go with clusters is shown by the tests.
        warnings.simplefilter("ignore", SpecificationWarning)
        model = sm.GLM(
            data.outcome,
            link.sign * data.columns,
            family=sm.families.Binomial(link.statsmodels()),
            var_weights=data.weights,
        )
        naive = model.fit(start_params=start, tol=1e-12, maxiter=100)
        result = model.fit(
            start_params=naive.params,
            tol=1e-12,
            maxiter=100,
            cov_type="cluster",
            cov_kwds={"groups": data.event},
        )
    return (
        np.asarray(result.params, dtype=np.float64),
        np.asarray(result.cov_params(), dtype=np.float64),
        np.asarray(naive.cov_params(), dtype=np.float64),
    )


def refuse_one_class(outcome: FloatArray) -> None:
    """Refuse outcomes that are all alike."""
    toppled = int((outcome > 0.5).sum())
    if toppled in (0, outcome.size):
        raise FitError(
            f"of {outcome.size} outcomes on the grid {toppled} toppled: a probability cannot be "
            "fitted to outcomes that are all alike; add motions or block sizes (p²)"
        )


def refuse_separation(data: BinomialData, parameters: FloatArray, settled: bool) -> None:
    """Refuse features that tell toppled from safe without error: the likelihood has no maximum."""
    eta = data.columns @ parameters
    toppled = data.outcome > 0.5
    if eta[toppled].min() > eta[~toppled].max() or not settled or np.abs(parameters).max() > 1e3:
        raise FitError(
            "the outcomes are separated without error by the intensity (toppled above, safe below, "
            "nothing between): the slope of a fit has no finite value; use recorded motions "
            "instead of scaled copies, or more of them"
        )


def _start(data: BinomialData, link: Link) -> FloatArray:
    middle = link.eta(np.where(data.outcome > 0.5, 0.9, 0.1))
    root = np.sqrt(data.weights)
    return np.asarray(
        np.linalg.lstsq(data.columns * root[:, None], middle * root, rcond=None)[0],
        dtype=np.float64,
    )


def _loss(eta: FloatArray, t: FloatArray, w: FloatArray, link: Link) -> float:
    p = np.clip(link.probability(eta), 1e-300, 1.0 - 1e-16)
    return float(-(w * np.where(t > 0.5, np.log(p), np.log1p(-p))).sum())


def _derivatives(
    x: FloatArray, eta: FloatArray, t: FloatArray, w: FloatArray, link: Link
) -> tuple[FloatArray, FloatArray]:
    p = np.clip(link.probability(eta), _EDGE, 1.0 - _EDGE)
    slope = link.slope(eta)
    per_eta = w * slope / (p * (1.0 - p))
    return x.T @ (per_eta * (t - p)), (x * (per_eta * slope)[:, None]).T @ x
