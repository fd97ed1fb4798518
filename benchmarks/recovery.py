"""Whether fits find the truth and say how sure they are:  python -m benchmarks.recovery

Outcomes and critical values are drawn from known models, with scatter that earthquakes share,
for as many earthquakes as the reference set has (100). Each method is fitted to each draw. The
table counts how often the 95 % intervals (the standard error by leaving earthquakes out times
Student's t for the degrees of freedom of that parameter) hold the truth.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from benchmarks.page import markdown, parser, report
from rbfrag.fragility.confidence import ParameterErrors, packed, quantiles_of
from rbfrag.fragility.fit.data import fit_data
from rbfrag.fragility.fit.likelihood import censored_line, from_olsen, maximise, most_likely
from rbfrag.fragility.fit.line import Bins, iterate
from rbfrag.fragility.fit.maximum_likelihood import outcome_rows, parameter_names
from rbfrag.fragility.fit.result import cr3, jackknife_steps, left_out
from rbfrag.fragility.measures import TERMS
from rbfrag.fragility.method import LinearPredictor, arrays
from rbfrag.fragility.methods import method_named
from tests.fragility.conftest import critical_values
from tests.fragility.outcome_draws import TRUTH, drawn_outcomes

EVENTS = 100
LEVEL = quantiles_of(0.95)
SHARED = 0.1

FloatArray = NDArray[np.float64]

Draw = tuple[FloatArray, FloatArray, FloatArray]
"""Estimate, truth, and the steps of leaving each earthquake out, of one draw."""


def outcomes(method: str, term: str, seed: int) -> Draw:
    """Fit one draw of outcomes."""
    truth = np.array(TRUTH[method, term])
    source = drawn_outcomes(
        method, term, TRUTH[method, term], events=EVENTS, motions=2, shared=SHARED, seed=seed
    )
    how, of = method_named(method), TERMS[term]
    rows = outcome_rows(fit_data(source, how, of), how, of, parameter_names(how, of)).data
    b = most_likely(rows)
    return b, truth, jackknife_steps(rows, b)


def lognormal(seed: int) -> Draw:
    """Fit one censored lognormal draw."""
    random = np.random.default_rng(seed)
    truth = np.array([-0.4, 0.95, np.log(0.29)])
    event = np.repeat(np.arange(EVENTS), 24)
    x = random.normal(-1.5, 1.0, event.size)
    noise = np.sqrt(0.2) * random.normal(size=EVENTS)[event]
    noise += np.sqrt(0.8) * random.normal(size=event.size)
    y = truth[0] + truth[1] * x + np.exp(truth[2]) * noise
    limit = truth[0] + truth[1] * x - 0.4
    is_found = y > limit
    rows, start = censored_line(
        np.column_stack([np.ones(x.size), x]),
        np.where(is_found, y, limit),
        is_found,
        event.astype(np.intp),
    )
    theta, _ = maximise(rows, start)
    b, jacobian = from_olsen(theta)
    return b, truth, jackknife_steps(rows, theta) @ jacobian.T


def straight_line(seed: int) -> Draw:
    """Fit the line of one heteroscedastic draw."""
    table = critical_values(events=EVENTS, motions=2, event_share=0.3, seed=seed)
    order = np.argsort(table.pgv_m_s)
    bins, y = Bins.equal_count(table.pgv_m_s[order]), table.y_m_s[order]
    events = np.unique(table.event_id[order].astype(str), return_inverse=True)[1].astype(np.intp)
    b = iterate(bins, y, np.ones(y.size), 1).parameters
    refits = left_out(events, lambda rest: iterate(bins, y, rest.astype(float), 1, b).parameters)
    return b[:2], np.array([0.002, 0.72]), (np.array(list(refits.values())) - b)[:, :2]


def main(arguments: Sequence[str] | None = None) -> None:
    """Count and report."""
    options = parser(__doc__)
    options.add_argument("--replications", type=int, default=500)
    chosen = options.parse_args(arguments)
    draws = {f"{method}-{term}": (method, term) for method, term in TRUTH}
    cells = []
    for name in ("wls-pgv", "lognormal", *draws):
        estimates, reach = [], []
        for seed in range(chosen.replications):
            if name in draws:
                b, truth, steps = outcomes(*draws[name], seed)
            else:
                b, truth, steps = (straight_line if name == "wls-pgv" else lognormal)(seed)
            covariance = cr3(steps)
            error = np.sqrt(np.diag(covariance))
            errors = ParameterErrors(packed(covariance.tolist()), tuple(map(tuple, steps.tolist())))
            estimates.append((b - truth) / error)
            # of each parameter alone
            reach.append(
                errors.half_width(LinearPredictor(0.0, tuple(np.eye(b.size))), LEVEL, arrays())
                / error
            )
        z = np.array(estimates)
        covered = (np.abs(z) <= np.array(reach)).mean(axis=0)
        cells.append([
            name,
            str(chosen.replications),
            ", ".join(f"{100 * share:.1f} %" for share in covered),
            ", ".join(f"{mean:+.2f}" for mean in z.mean(axis=0)),
            f"{np.abs(z).max():.1f}",
            f"{100 * (np.abs(z) > 3).mean():.2f} %",
        ])  # fmt: skip
        print(cells[-1], flush=True)
    head = ["method", "draws", "95 % intervals that hold the truth, by parameter",
            "mean error in standard errors", "worst", "beyond 3"]  # fmt: skip
    report("recovery", markdown((head, cells)), write=chosen.write)


if __name__ == "__main__":
    main()
