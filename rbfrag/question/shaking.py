"""Checks of intensity measures for values that suggest another unit."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from rbfrag.fragility.measures import CREDIBLE
from rbfrag.results.diagnostic import Diagnostic
from rbfrag.vocabulary.quantities import QUANTITIES, SHAKING


def doubts_about(measures: Mapping[str, Any]) -> Iterator[Diagnostic]:
    """Yield warnings about intensity measures beyond any recorded earthquake.

    Args:
        measures: values by the names of :func:`rbfrag.predict`, arrays or numbers; NaN is passed
            over.
    """
    for name, value in measures.items():
        if name not in CREDIBLE or name not in SHAKING:
            continue
        values = np.asarray(value, dtype=np.float64)
        values = values[np.isfinite(values)]
        _, most, text = CREDIBLE[name]
        if values.size and (largest := float(values.max())) > most:
            quantity = f"{name} = {largest:.4g} {QUANTITIES[name].unit}"
            yield Diagnostic(f"{quantity} is {text}", "suspicious_value")
