"""Fitting methods; numpy and statsmodels are loaded on the first call."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rbfrag.fragility.fit.result import MethodResult


def outcomes(*data: Any, **options: Any) -> MethodResult:
    """Fit outcomes of the grid by maximum likelihood."""
    from rbfrag.fragility.fit.outcomes import fit_outcomes

    return fit_outcomes(*data, **options)


def line(*data: Any, **options: Any) -> MethodResult:
    """Fit critical values by a weighted straight line."""
    from rbfrag.fragility.fit.line import fit_wls

    return fit_wls(*data, **options)


def log_line(*data: Any, **options: Any) -> MethodResult:
    """Fit a line to the logarithms of critical values, with censoring."""
    from rbfrag.fragility.fit.critical import fit_lognormal

    return fit_lognormal(*data, **options)


def censored(*data: Any, **options: Any) -> MethodResult:
    """Fit a formula with normal dispersion to critical values, with censoring."""
    from rbfrag.fragility.fit.critical import fit_censored

    return fit_censored(*data, **options)
