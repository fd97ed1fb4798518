"""How models are fitted; numpy and statsmodels are loaded by the first call of one of these."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rbfrag.fragility.fit.result import MethodResult


def outcomes(*data: Any, **options: Any) -> MethodResult:
    """Fit what blocks of the grid did, by maximum likelihood."""
    from rbfrag.fragility.fit.outcomes import fit_outcomes

    return fit_outcomes(*data, **options)


def line(*data: Any, **options: Any) -> MethodResult:
    """Fit critical values by a weighted straight line."""
    from rbfrag.fragility.fit.line import fit_wls

    return fit_wls(*data, **options)


def log_line(*data: Any, **options: Any) -> MethodResult:
    """Fit logarithms of critical values by a line, censored ones by their limits."""
    from rbfrag.fragility.fit.critical import fit_lognormal

    return fit_lognormal(*data, **options)


def censored(*data: Any, **options: Any) -> MethodResult:
    """Fit points of failure by a formula with normal scatter, censored ones by their limits."""
    from rbfrag.fragility.fit.critical import fit_censored

    return fit_censored(*data, **options)
