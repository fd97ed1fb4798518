"""Fits of critical values with a lognormal dispersion; some values are censored.

One likelihood serves all: a block that just fails has eta = 0 on average, with the scatter that the
method's formula states.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from rbfrag.errors import FitError
from rbfrag.fragility.fit.clusters import bootstrap, jackknife_steps, left_out, sandwich
from rbfrag.fragility.fit.data import FitData
from rbfrag.fragility.fit.likelihood import (
    CensoredNormal,
    Standardised,
    censored_line,
    from_olsen,
    maximise,
)
from rbfrag.fragility.fit.outcomes import parameter_names
from rbfrag.fragility.fit.result import Estimates, MethodResult, method_result
from rbfrag.fragility.measures import Term
from rbfrag.fragility.method import Form, Method, arrays
from rbfrag.solver.results import FloatArray

REPLICATES = 400
_LN_SIGMA = "ln_sigma"


def fit_lognormal(
    data: FitData, method: Method, term: Term, *, seed: int, estimate_m: bool = False
) -> MethodResult:
    """Fit ln y* = a + b ln x (+ (M-1) ln p) with lognormal dispersion sigma.

    Combinations without a critical value above the search limit count as "below the limit".
    Covariance is clustered by earthquake; a bootstrap by earthquake is reported, too.

    Raises:
        FitError: the median does not rise with intensity, or there is no scatter.
    """
    form, names = method.forms[term.name], parameter_names(method, term, estimate_m=estimate_m)
    # ln y* = a + b ln x + (M - 1) ln p + sigma Z with Z standard normal. A critical value
    # contributes its density to the likelihood, a censored one the probability to lie below the
    # search limit.
    is_positive = (data.x > 0.0) & (data.y > 0.0)
    values = {name: value[is_positive] for name, value in data.values.items()}
    line, least = _line(form, names, values), None
    # An undecided interval contributes the probability to lie between its ends.
    if data.least_y_m_s is not None:
        lower = data.least_y_m_s[is_positive]
        ratio = np.where(np.isfinite(lower), lower / values["y_m_s"], 1.0)
        ends = {name: values[name] * ratio for name in ("y_m_s", "kr")}
        least = _line(form, names, {**values, **ends})[1]
    # In Olsen's parameters (coefficients/sigma, 1/sigma) the likelihood is concave (Olsen 1978):
    # Newton's method finds its one maximum, which is then transformed back, errors by the Jacobian.
    rows, start = censored_line(*line, data.observed[is_positive], data.event[is_positive], least)
    theta, _ = maximise(rows, start)
    # Olsen's parameters put the scatter last
    place = names.index(_LN_SIGMA)
    order = np.insert(np.arange(len(names) - 1), place, len(names) - 1)

    def natural(theta: FloatArray) -> FloatArray:
        return from_olsen(theta)[0][order]

    b, jacobian = natural(theta), from_olsen(theta)[1][order]
    if b[1] <= 0.0:
        raise FitError(
            f"the fitted critical velocity does not rise with {term.title} (exponent {b[1]:.4g}): "
            f"no fragility model in {term.symbol} can be fitted; use another term or more motions"
        )
    if b[place] < np.log(1e-9):
        raise FitError(
            "the critical values lie exactly on a power law: without dispersion no probability "
            "can be fitted; use recorded motions instead of scaled copies of one"
        )
    steps = jackknife_steps(rows, theta) @ jacobian.T
    cr1, naive = (np.sqrt(np.diag(jacobian @ c @ jacobian.T)) for c in sandwich(rows, theta))
    estimates = Estimates(
        names, b, steps,
        bootstrap(
            rows.event, lambda times: natural(maximise(rows, theta, times=times)[0]),
            replicates=REPLICATES, seed=seed,
        ),
        seed,
        {"cr1_standard_errors": cr1, "naive_standard_errors": naive},
    )  # fmt: skip
    # Predictions for an earthquake come from the fit to all others: scores are those of unseen
    # shaking.
    jackknife = left_out(rows.event, lambda rest: maximise(rows.only(rest), theta)[0])
    in_sample = probabilities(method, form, data, b)
    held_out, density = in_sample.copy(), rows.log_likelihood(theta)
    held_density = density.copy()
    for event, part in jackknife.items():
        fitted_rows = rows.event == event
        held_density[fitted_rows] = rows.only(fitted_rows).log_likelihood(part)
        event_rows = data.event == event
        held_out[event_rows] = probabilities(method, form, data, natural(part))[event_rows]
    residual = np.full(data.x.size, np.nan)
    line = rows.values["y"] - rows.values["columns"] @ (theta[:-1] / theta[-1])
    residual[is_positive] = np.where(rows.observed, line, np.nan)
    return method_result(
        data,
        estimates,
        in_sample,
        held_out,
        ln_residual=residual,
        scores={
            "log_density_in_sample": float(density.mean()),
            "log_density_held_out": float(held_density.mean()),
        },
        details={"sigma_ln": float(np.exp(b[place])), "exponent_m_estimated": estimate_m},
        warnings=[
            "this is the probability that the critical value is at least the block's: safe islands "
            "below it are not seen, and the model is over-confident about outcomes",
            *data.between_words("count as intervals"),
        ],
    )


def fit_censored(data: FitData, method: Method, term: Term, *, seed: int) -> MethodResult:
    """Fit a method whose formula gives eta and the dispersion, to observed and censored rows.

    The covariance is that of the fits that each leave an earthquake out.
    """
    form = method.forms[term.name]
    rows = censored_rows(data, form)
    b = most_likely(rows, np.array(form.start))
    jackknife = left_out(rows.event, lambda rest: most_likely(rows.only(rest), b))
    cr1, naive = (np.sqrt(np.diag(c)) for c in sandwich(rows, b))
    estimates = Estimates(
        form.parameters, b, np.array(list(jackknife.values())) - b,
        bootstrap(
            rows.event, lambda times: maximise(rows, b, times=times, tolerance=1e-7)[0],
            replicates=REPLICATES // 4, seed=seed,
        ),
        seed,
        {"cr1_standard_errors": cr1, "naive_standard_errors": naive},
    )  # fmt: skip
    in_sample = probabilities(method, form, data, b)
    held_out = in_sample.copy()
    for event, part in jackknife.items():
        event_rows = data.event == event
        held_out[event_rows] = probabilities(method, form, data, part)[event_rows]
    return method_result(data, estimates, in_sample, held_out)


def censored_rows(data: FitData, form: Form) -> CensoredNormal:
    """Return the likelihood of a formula over the rows of a fit."""

    def formula(b: FloatArray, values: Mapping[str, FloatArray]) -> Standardised:
        eta, slopes, log_sigma, sigma_slopes = form.eta(b.tolist(), values, arrays())
        return eta, log_sigma, slopes, sigma_slopes

    return CensoredNormal(formula, data.values, data.observed, data.event)


def most_likely(rows: CensoredNormal, start: FloatArray) -> FloatArray:
    """Return the maximum-likelihood parameters of the rows."""
    b, _ = maximise(rows, start, tolerance=1e-15)
    if not np.all(np.isfinite(b)) or np.abs(rows.derivatives(b)[0]).max() > 1e-4 * rows.event.size:
        raise FitError(
            "the likelihood of this model has no maximum on these data: add motions, or fit "
            "another term"
        )
    return b


def probabilities(method: Method, form: Form, data: FitData, b: FloatArray) -> FloatArray:
    """Return P of the blocks of the grid, 0 without shaking, shape (n, m)."""
    with np.errstate(divide="ignore", invalid="ignore"):
        eta = form.eta(b.tolist(), data.blocks, arrays()).eta
        p = np.asarray(method.link.probability(eta, arrays()), dtype=np.float64)
    return np.array(np.broadcast_to(np.nan_to_num(p, nan=0.0), data.failed.shape))


def _line(
    form: Form, names: tuple[str, ...], values: Mapping[str, FloatArray]
) -> tuple[FloatArray, FloatArray]:
    """Return regressors and response of a formula that is (columns · β - response)/σ."""
    eta, slopes, _, _ = form.eta([0.0] * len(names), values, arrays())
    columns = [s for name, s in zip(names, slopes, strict=True) if name != _LN_SIGMA]
    return np.column_stack([np.broadcast_to(c, eta.size) for c in columns]), -eta
