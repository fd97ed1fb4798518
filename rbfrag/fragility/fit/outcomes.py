"""Fits of simulated outcomes, failed or not.

A generalised linear model of binary outcomes on a grid that does not depend on the outcome; every
block that is read counts the same. Blocks that mechanics says cannot fail are not fitted: P is 0.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import FitError
from rbfrag.fragility.fit.clusters import bootstrap, jackknife_steps, left_out
from rbfrag.fragility.fit.data import FitData
from rbfrag.fragility.fit.likelihood import Binomial, fit_by_statsmodels, maximise
from rbfrag.fragility.fit.result import Estimates, MethodResult, method_result
from rbfrag.fragility.measures import Term
from rbfrag.fragility.method import Form, Method, arrays
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.solver.results import FloatArray

REPLICATES = 200
FEWEST_FAILURES = 20


@dataclass(frozen=True, eq=False)
class OutcomeRows:
    """The rows of a fit, and their indices in the grid.

    Args:
        data: features, outcomes, weights and earthquakes; blocks that are judged and not fitted
            have the weight 0.
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


_MOST_ALIKE = 1e11
"""Condition number of the parameters' correlations from which on they are not told apart."""


def fit_outcomes(
    data: FitData, method: Method, term: Term, *, seed: int, estimate_m: bool = False
) -> MethodResult:
    """Fit a method that uses outcomes."""
    # Maximum likelihood of sum w [f ln P + (1 - f) ln(1 - P)], P = link(eta(block, shaking; b)),
    # over all blocks of the outcome grid that mechanics allows to fail.
    form, names = method.forms[term.name], parameter_names(method, term, estimate_m=estimate_m)
    rows = outcome_rows(data, method, term, names)
    fitted = rows.data.only(rows.data.weights > 0.0)
    failures = int((fitted.outcome > 0.5).sum())
    if 0 < failures < FEWEST_FAILURES:
        raise FitError(
            f"{failures} outcomes on the grid toppled; a fit requires {FEWEST_FAILURES}: add "
            "stronger motions or more block sizes (p²)"
        )
    with np.errstate(invalid="ignore"), warnings.catch_warnings():
        warnings.filterwarnings("ignore", "The design matrix is rank-deficient")
        try:
            b, cr1, naive = fit_by_statsmodels(fitted)
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
            f"the blocks and {len(data.event_names)} earthquakes do not identify the {len(names)} "
            f"parameters of method {method.name}: simulate more block sizes (p²) or earthquakes, "
            "or fit a method of fewer parameters, such as logistic"
        )
    # Outcomes of one earthquake are not independent: the covariance comes from the changes of b
    # when each earthquake in turn is omitted (CR3), the bootstrap draws whole earthquakes.
    steps = jackknife_steps(fitted, b)

    def resampled(times: FloatArray) -> FloatArray:
        drawn = times > 0.0
        return maximise(fitted.only(drawn), b, times=times[drawn], tolerance=1e-7)[0]

    samples = bootstrap(fitted.event, resampled, replicates=REPLICATES, seed=seed)
    estimates = Estimates(
        names, b, steps, samples, seed,
        {"cr1_standard_errors": np.sqrt(np.diag(cr1)),
         "naive_standard_errors": np.sqrt(np.diag(naive))},
    )  # fmt: skip
    # How far each critical value lies from the block with P = 1/2, as a check on the scale of eta.
    residual = None
    if data.observed.any():
        with np.errstate(invalid="ignore", divide="ignore"):
            median = median_y_m_s(form, method, b, data)
            residual = np.where(data.observed, np.log(data.y) - np.log(median), np.nan)
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
            **sensitive_share(data, rows),
        },
        warnings=_warnings(data, rows, estimates),
    )


def sensitive_share(data: FitData, rows: OutcomeRows) -> dict[str, float]:
    """Return the fraction of the fitted outcomes that are numerically sensitive."""
    if data.sensitive is None:
        return {}
    return {"sensitive_share": float(np.nanmean(data.sensitive.ravel()[rows.place]))}


def parameter_names(method: Method, term: Term, *, estimate_m: bool = False) -> tuple[str, ...]:
    """Return the names of the fitted parameters, in the order of the formula."""
    names = method.forms[term.name].parameters
    return tuple(name for name in names if estimate_m or name != method.exponent)


def outcome_rows(data: FitData, method: Method, term: Term, names: tuple[str, ...]) -> OutcomeRows:
    """Return the known outcomes with their features."""
    form, shape = method.forms[term.name], data.failed.shape
    positive = (data.grid("intensity_m_s") > 0.0) & (data.grid("pga_g") > 0.0)
    is_known = positive & (data.read | data.scored) & np.isfinite(data.failed)
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
    failed, read = data.failed.ravel()[place], data.read.ravel()[place].astype(np.float64)
    rows = Binomial(
        method.link, np.ascontiguousarray(columns), failed, read, data.event[place // shape[1]]
    )
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
    if (estimates.samples.std(axis=0, ddof=1) > 2.0 * estimates.errors).any():
        result.append(
            "the bootstrap by earthquake scatters more than twice as much as the clustered errors "
            "say: a few earthquakes decide this fit"
        )
    return result
