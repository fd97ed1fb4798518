"""Result of a fitting method."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from rbfrag.fragility.fit.clusters import cr3
from rbfrag.fragility.fit.data import FEW_EVENTS, FitData
from rbfrag.fragility.fit.scores import nested_scatter, score_intervals, scores_of
from rbfrag.solver.results import FloatArray

_OF_REAL_BLOCKS = ("log_loss_held_out", "brier_held_out", "calibration_slope_held_out")

CLUSTERED = "clustered by earthquake, CR3 (each earthquake left out in turn)"


@dataclass(frozen=True, eq=False)
class MethodResult:
    """Result of a fitting method: parameters, scores and details.

    Args:
        coefficients: value of each parameter by name, in the order of the formula.
        steps: change of the parameters without each earthquake, shape (G, k).
        standard_errors: standard error of each parameter by name.
        scores: how well the model predicts, by name.
        details: everything else the report states, JSON-able.
        held_out: probability of each block of the grid by a fit without its earthquake,
            shape (n, m).
    """

    coefficients: dict[str, float]
    steps: FloatArray
    standard_errors: dict[str, float]
    scores: dict[str, float]
    details: dict[str, object]
    warnings: tuple[str, ...]
    held_out: FloatArray


@dataclass(frozen=True, eq=False)
class Estimates:
    """Parameters with their standard errors.

    Args:
        values: shape (k,).
        steps: change of the parameters without each earthquake, shape (G, k).
        samples: of a bootstrap by earthquake, shape (replicates, k).
        seed: seed of the bootstrap.
        other_errors: further standard errors by what the report calls them.
    """

    names: Sequence[str]
    values: FloatArray
    steps: FloatArray
    samples: FloatArray
    seed: int
    other_errors: Mapping[str, FloatArray] = field(default_factory=dict)

    @property
    def covariance(self) -> FloatArray:
        """Covariance clustered by earthquake, shape (k, k)."""
        return cr3(self.steps)

    @property
    def errors(self) -> FloatArray:
        """Standard errors, shape (k,)."""
        return np.sqrt(np.diag(self.covariance))

    def named(self, values: FloatArray) -> dict[str, float]:
        """Return values by parameter name."""
        return dict(zip(self.names, values.tolist(), strict=True))


def method_result(
    data: FitData,
    estimates: Estimates,
    in_sample: FloatArray,
    held_out: FloatArray,
    *,
    ln_residual: FloatArray | None = None,
    scores: Mapping[str, float] | None = None,
    details: Mapping[str, object] | None = None,
    warnings: Sequence[str] = (),
) -> MethodResult:
    """Return the result of a method with leave-one-earthquake-out standard errors.

    Args:
        in_sample: probabilities of the blocks of the grid, shape (n, m).
        held_out: the same by fits without the earthquake concerned.
        ln_residual: ln y less its median where known, shape (n,), to be split by earthquakes.
        scores: further scores.
        details: what else the report states.
    """
    judged, spread = data.judged, estimates.samples.std(axis=0, ddof=1)
    scored = scores_of(judged, in_sample, held_out)
    real = data.judged_real
    if real is not None and real.is_known.any():
        real_scores = scores_of(real, in_sample, held_out)
        scored |= {
            f"{name}_kr05": real_scores[name] for name in _OF_REAL_BLOCKS if name in real_scores
        }
    return MethodResult(
        coefficients=estimates.named(estimates.values),
        steps=estimates.steps,
        standard_errors=estimates.named(estimates.errors),
        scores={**(scores or {}), **scored},
        details={
            "judged_on": judged.source,
            "judged_outcomes": int(judged.is_known.sum()),
            "score_intervals": score_intervals(judged, held_out, seed=estimates.seed),
            "standard_error_kinds": dict.fromkeys(estimates.names, CLUSTERED),
            **{name: estimates.named(values) for name, values in estimates.other_errors.items()},
            "bootstrap": {
                "standard_errors": estimates.named(spread),
                "replicates": len(estimates.samples),
                "seed": estimates.seed,
            },
            "scatter_ln_y": None if ln_residual is None else scatter_of(data, ln_residual),
            **(details or {}),
        },
        warnings=(*few_events(len(estimates.steps)), *warnings),
        held_out=held_out,
    )


def scatter_of(data: FitData, ln_residual: FloatArray) -> dict[str, float] | None:
    """Return the between- and within-event dispersion of ln y, of finite residuals."""
    used = np.isfinite(ln_residual)
    scatter = nested_scatter(ln_residual[used], data.event[used], data.motion[used])
    return None if scatter is None else vars(scatter)


def few_events(events: int) -> list[str]:
    """Return the warning about a small number of earthquakes."""
    if events >= FEW_EVENTS:
        return []
    return [f"only {events} earthquakes: standard errors clustered by earthquake are too small"]
