"""Checks of intensity measures for values that suggest another unit."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from rbfrag.fragility.measures import CREDIBLE
from rbfrag.results.diagnostic import Diagnostic
from rbfrag.vocabulary.quantities import QUANTITIES, SHAKING

MOST_A_YEAR = 100.0
"""Rates of exceedance above this are of another unit, or of no earthquakes [1/a]."""


def doubts_about(measures: Mapping[str, Any]) -> Iterator[Diagnostic]:
    """Yield warnings about intensity measures beyond any recorded earthquake.

    Args:
        measures: values by the names of :func:`rbfrag.predict`, arrays or numbers; NaN is passed
            over.
    """
    for name in measures.keys() & CREDIBLE.keys() & {*SHAKING}:
        values = np.asarray(measures[name], dtype=np.float64)
        values = values[np.isfinite(values)]
        _, most, text = CREDIBLE[name]
        if values.size and (largest := float(values.max())) > most:
            value = f"{name} = {largest:.4g} {QUANTITIES[name].unit}"
            yield Diagnostic(f"{value} is {text}", "suspicious_value")


def doubts_about_rates(annual_rate: Any) -> Iterator[Diagnostic]:
    """Yield warnings about implausible exceedance rates.

    Args:
        annual_rate: rates [1/a], finite, shape (n,).
    """
    largest = float(np.max(annual_rate, initial=0.0))
    if largest > MOST_A_YEAR:
        yield Diagnostic(
            f"the curve has a rate of {largest:.4g} /yr: are these annual rates of exceedance?",
            "suspicious_value",
        )
