"""Fits by maximum likelihood: of simulated outcomes, and of critical values with censoring.

Outcomes, failed or not, are fitted by a generalised linear model on a grid that does not depend on
the outcome; every block that is read counts the same. Blocks that mechanics says cannot fail are
not fitted: P is 0. Critical values have a lognormal dispersion, some are censored, and one
likelihood serves all: a block that just fails has eta = 0 on average, with the scatter that the
method's formula states.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import FitError
from rbfrag.fragility.fit.data import FitData
from rbfrag.fragility.fit.likelihood import (
    Binomial,
    CensoredNormal,
    Standardised,
    censored_line,
    fit_by_statsmodels,
    from_olsen,
    maximise,
)
from rbfrag.fragility.fit.result import (
    Estimates,
    MethodResult,
    bootstrap,
    jackknife_steps,
    left_out,
    method_result,
    sandwich,
)
from rbfrag.fragility.measures import Term
from rbfrag.fragility.method import Form, Method, arrays
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.solver.results import FloatArray

OUTCOME_REPLICATES = 200
FEWEST_FAILURES = 20


@dataclass(frozen=True, eq=False)
class OutcomeRows:
    """The rows of a fit, and their indices in the grid.

    Args:
        data: features, outcomes, weights and earthquakes.
        place: flat index on the grid (n, m) of each row.
        bounded: whether mechanics forbids the block, on the grid.
        bounded_failed: known outcomes that failed although mechanics forbids it (vertical motion,
            which the bounds leave out).
    """

    data: Binomial
    place: NDArray[np.intp]
    bounded: NDArray[np.bool_]
    bounded_failed: int

    def on_grid(self, b: FloatArray) -> FloatArray:
        """Return P of every block of the grid, 0 for blocks without a row."""
        grid = np.zeros(self.bounded.shape)
        grid.flat[self.place] = self.data.probability(b)
        return grid

    def held_out(self, b: FloatArray) -> FloatArray:
        """Return P of every block, each earthquake predicted by the fit to the others."""
        rows, grid = self.data, np.zeros(self.bounded.shape)
        parameters = left_out(
            rows.event, lambda rest: maximise(rows.only(rest), b, tolerance=1e-9)[0]
        )
        for event, estimate in parameters.items():
            event_rows = rows.event == event
            grid.flat[self.place[event_rows]] = rows.only(event_rows).probability(estimate)
        return grid


LEAST = 0.02
"""Least coefficient of a feature that falls with the strength of the block."""

_MOST_ALIKE = 1e11
"""Condition number of the parameters' correlations from which on they are not told apart."""


def fit_outcomes(
    data: FitData,
    method: Method,
    term: Term,
    *,
    seed: int,
    resample: bool = True,
    estimate_m: bool = False,
) -> MethodResult:
    """Fit a method that uses outcomes."""
    # Maximum likelihood of sum w [f ln P + (1 - f) ln(1 - P)], P = link(eta(block, shaking; b)),
    # over all blocks of the outcome grid that mechanics allows to fail.
    form, names = method.forms[term.name], parameter_names(method, term, estimate_m=estimate_m)
    rows = outcome_rows(data, method, term, names)
    fitted = rows.data
    failures = int((fitted.outcome > 0.5).sum())
    if 0 < failures < FEWEST_FAILURES:
        raise FitError(
            f"{failures} outcomes on the grid toppled; a fit requires {FEWEST_FAILURES}: add "
            "stronger motions or more block sizes (p²)"
        )
    # Box constraint: a coefficient by which stronger blocks would fail more often is held at its
    # least, and the others are estimated again.
    estimated, held = [*range(len(names))], []
    while True:
        b, cr1, naive = _estimated(fitted, data, method)
        low = [j for j, i in enumerate(estimated) if names[i] in form.positive and b[j] < LEAST]
        if not low:
            break
        name = names[estimated.pop(low[0])]
        held.append(
            f"{name} is held at {LEAST:g}: by the estimate {b[low[0]]:.3g} stronger blocks would "
            "fail more often; add motions of other earthquakes"
        )
        fitted = fitted.holding(low[0], LEAST)
        rows = replace(rows, data=rows.data.holding(low[0], LEAST))
    # Outcomes of one earthquake are not independent: the covariance comes from the changes of b
    # when each earthquake in turn is omitted (CR3), the bootstrap draws whole earthquakes.
    steps = jackknife_steps(fitted, b)

    def resampled(times: FloatArray) -> FloatArray:
        drawn = times > 0.0
        return maximise(fitted.only(drawn), b, times=times[drawn], tolerance=1e-7)[0]

    samples = None
    if resample:
        samples = bootstrap(fitted.event, resampled, replicates=OUTCOME_REPLICATES, seed=seed)

    def of_all(values: FloatArray, held_at: float = 0.0) -> FloatArray:
        result = np.full((*values.shape[:-1], len(names)), held_at)
        result[..., estimated] = values
        return result

    estimates = Estimates(
        names, of_all(b, LEAST), of_all(steps),
        None if samples is None else of_all(samples, LEAST), seed,
        {"cr1_standard_errors": of_all(np.sqrt(np.diag(cr1))),
         "naive_standard_errors": of_all(np.sqrt(np.diag(naive)))},
    )  # fmt: skip
    # How far each critical value lies from the block with P = 1/2, as a check on the scale of eta.
    residual = None
    if data.observed.any():
        with np.errstate(invalid="ignore", divide="ignore"):
            median = median_y_m_s(form, method, estimates.values, data)
            residual = np.where(data.observed, np.log(data.y) - np.log(median), np.nan)
    more: dict[str, object] = {}
    if form.velocity is not None:
        more["fitted_events"] = [data.event_names[e] for e in np.unique(fitted.event)]
    if data.sensitive is not None:
        more["sensitive_share"] = float(np.nanmean(data.sensitive.ravel()[rows.place]))
    return method_result(
        data,
        estimates,
        rows.on_grid(b),
        rows.held_out(b),
        ln_residual=residual,
        details={
            "link": method.link.name,
            "n_outcomes": int(fitted.outcome.size),
            "n_toppled": failures,
            "n_bounded": int(rows.bounded.sum()),
            "n_bounded_toppled": rows.bounded_failed,
            **more,
        },
        warnings=[*held, *_warnings(data, rows, estimates)],
    )


def _estimated(
    rows: Binomial, data: FitData, method: Method
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return parameters and covariances; see :func:`fit_by_statsmodels`."""
    size = rows.columns.shape[1]
    with np.errstate(invalid="ignore"), warnings.catch_warnings():
        warnings.filterwarnings("ignore", "The design matrix is rank-deficient")
        try:
            b, cr1, naive = fit_by_statsmodels(rows)
            variances = np.concatenate([np.diag(cr1), np.diag(naive)])
        except np.linalg.LinAlgError:
            variances = np.array([np.nan])
    # a parameter that these blocks leave open has no variance that is one, or parameters vary
    # together: rounding decides whether the matrix is singular
    apart = bool((np.isfinite(variances) & (variances > 0.0)).all())
    if apart:
        sd = np.sqrt(np.diag(naive))
        apart = float(np.linalg.cond(naive / np.outer(sd, sd))) < _MOST_ALIKE
    if not apart:
        raise FitError(
            f"the blocks and {len(data.event_names)} earthquakes do not identify the {size} "
            f"parameters of method {method.name}: simulate more block sizes (p²) or earthquakes, "
            "or fit a method of fewer parameters, such as logistic"
        )
    return b, cr1, naive


def parameter_names(method: Method, term: Term, *, estimate_m: bool = False) -> tuple[str, ...]:
    """Return the names of the fitted parameters, in the order of the formula."""
    names = method.forms[term.name].parameters
    return tuple(name for name in names if estimate_m or name != method.exponent)


def outcome_rows(data: FitData, method: Method, term: Term, names: tuple[str, ...]) -> OutcomeRows:
    """Return the known outcomes with their features."""
    form, shape = method.forms[term.name], data.failed.shape
    positive = (data.grid("intensity_m_s") > 0.0) & (data.grid("pga_g") > 0.0)
    is_known = positive & data.read & np.isfinite(data.failed)
    bounded = np.zeros(shape, dtype=np.bool_)
    for bound in form.bounds:
        bounded |= np.broadcast_to(bound.holds(data.blocks), shape)
    bounded &= is_known
    place = np.flatnonzero(is_known & ~bounded)
    values = {name: data.grid(name).ravel()[place] for name in data.blocks}
    features = form.eta([0.0] * len(names), values, arrays()).slopes
    columns = np.column_stack([np.broadcast_to(f, place.size) for f in features])
    finite = np.isfinite(columns).all(axis=1)
    place, columns = place[finite], columns[finite]
    failed, event = data.failed.ravel()[place], data.event[place // shape[1]]
    rows = Binomial(method.link, np.ascontiguousarray(columns), failed, np.ones(failed.size), event)
    return OutcomeRows(rows, place, bounded, int((data.failed[bounded] > 0.5).sum()))


def median_y_m_s(form: Form, method: Method, b: FloatArray, data: FitData) -> FloatArray:
    """Return the toppling velocity at which P = 1/2 for each row [m/s]; NaN if there is none."""
    from scipy.optimize.elementwise import find_root

    def excess(ln_y: FloatArray, *columns: FloatArray) -> FloatArray:
        values = dict(zip(data.values, columns, strict=True))
        values["y_m_s"] = y = np.exp(ln_y)
        values["kr"] = y * values["p"] / STANDARD_GRAVITY_M_S2
        eta = form.eta(b.tolist(), values, arrays()).eta
        p = method.link.probability(np.clip(eta, -700.0, 700.0), arrays())
        for bound in form.bounds:
            p = np.where(bound.holds(values), 0.0, p)
        return np.asarray(p - 0.5)

    root = find_root(excess, (-30.0, 10.0), args=tuple(data.values.values()))
    return np.asarray(np.exp(root.x))


def _warnings(data: FitData, rows: OutcomeRows, estimates: Estimates) -> list[str]:
    result = []
    if rows.bounded_failed:
        result.append(
            f"{rows.bounded_failed} of {int(rows.bounded.sum())} blocks that cannot topple "
            "without vertical motion did: the model gives them P = 0"
        )
    unknown = int((data.read & ~np.isfinite(data.failed)).sum())
    if unknown:
        result.append(
            f"{unknown} of {int(data.read.sum())} blocks of the grid have no outcome (not stored, "
            "or closer to critical than the error of a run): they are left out"
        )
    samples = estimates.samples
    if samples is not None and (samples.std(axis=0, ddof=1) > 2.0 * estimates.errors).any():
        result.append(
            "the bootstrap by earthquake scatters more than twice as much as the clustered errors "
            "say: a few earthquakes decide this fit"
        )
    return result


REPLICATES = 400
_LN_SIGMA = "ln_sigma"


def fit_lognormal(
    data: FitData,
    method: Method,
    term: Term,
    *,
    seed: int,
    resample: bool = True,
    estimate_m: bool = False,
) -> MethodResult:
    """Fit ln y* = a + b ln x (+ (M-1) ln p) with lognormal dispersion sigma.

    Combinations without a critical value above the search limit count as "below the limit".
    Covariance is clustered by earthquake; a bootstrap by earthquake is reported on request.

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
    samples = None
    if resample:
        samples = bootstrap(
            rows.event, lambda times: natural(maximise(rows, theta, times=times)[0]),
            replicates=REPLICATES, seed=seed,
        )  # fmt: skip
    estimates = Estimates(
        names, b, steps, samples, seed,
        {"cr1_standard_errors": cr1, "naive_standard_errors": naive},
    )  # fmt: skip
    # Predictions for an earthquake come from the fit to all others: scores are those of unseen
    # shaking.
    jackknife = left_out(rows.event, lambda rest: maximise(rows.only(rest), theta)[0])
    in_sample = probabilities(method, form, data, b)
    density = rows.log_likelihood(theta)
    held_density = density.copy()
    for event, part in jackknife.items():
        fitted_rows = rows.event == event
        held_density[fitted_rows] = rows.only(fitted_rows).log_likelihood(part)
    by_event = {event: natural(part) for event, part in jackknife.items()}
    residual = np.full(data.x.size, np.nan)
    line = rows.values["y"] - rows.values["columns"] @ (theta[:-1] / theta[-1])
    residual[is_positive] = np.where(rows.observed, line, np.nan)
    return method_result(
        data,
        estimates,
        in_sample,
        held_out_probabilities(method, form, data, in_sample, by_event),
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


def fit_censored(
    data: FitData, method: Method, term: Term, *, seed: int, resample: bool = True
) -> MethodResult:
    """Fit a method whose formula gives eta and the dispersion, to observed and censored rows.

    The covariance is that of the fits that each leave an earthquake out.
    """
    form = method.forms[term.name]
    rows = censored_rows(data, form)
    b = most_likely(rows, np.array(form.start))
    jackknife = left_out(rows.event, lambda rest: most_likely(rows.only(rest), b))
    cr1, naive = (np.sqrt(np.diag(c)) for c in sandwich(rows, b))
    steps, samples = np.array(list(jackknife.values())) - b, None
    if resample:
        samples = bootstrap(
            rows.event, lambda times: maximise(rows, b, times=times, tolerance=1e-7)[0],
            replicates=REPLICATES // 4, seed=seed,
        )  # fmt: skip
    estimates = Estimates(
        form.parameters, b, steps, samples, seed,
        {"cr1_standard_errors": cr1, "naive_standard_errors": naive},
    )  # fmt: skip
    in_sample = probabilities(method, form, data, b)
    return method_result(
        data, estimates, in_sample, held_out_probabilities(method, form, data, in_sample, jackknife)
    )


def censored_rows(data: FitData, form: Form) -> CensoredNormal:
    """Return the likelihood of a formula over the rows of a fit."""

    def formula(b: FloatArray, values: Mapping[str, FloatArray]) -> Standardised:
        predictor = form.eta(b.tolist(), values, arrays())
        return predictor.eta, predictor.log_sigma, predictor.slopes, predictor.sigma_slopes

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


def held_out_probabilities(
    method: Method,
    form: Form,
    data: FitData,
    in_sample: FloatArray,
    parameters: Mapping[int, FloatArray],
) -> FloatArray:
    """Return P of the blocks of the grid, each earthquake predicted by the fit to all others.

    Args:
        in_sample: P by the fit to all, for earthquakes that have no share in it.
        parameters: of the fit without each earthquake.
    """
    held_out = in_sample.copy()
    for event, b in parameters.items():
        rows = data.event == event
        held_out[rows] = probabilities(method, form, data, b)[rows]
    return held_out


def _line(
    form: Form, names: tuple[str, ...], values: Mapping[str, FloatArray]
) -> tuple[FloatArray, FloatArray]:
    """Return regressors and response of a formula that is (columns · β - response)/σ."""
    eta, slopes, *_ = form.eta([0.0] * len(names), values, arrays())
    columns = [s for name, s in zip(names, slopes, strict=True) if name != _LN_SIGMA]
    return np.column_stack([np.broadcast_to(c, eta.size) for c in columns]), -eta
