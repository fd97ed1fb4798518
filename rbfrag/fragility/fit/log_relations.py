"""Relations of logarithms that a fit report states: the power law, and the rank of the terms."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from rbfrag.db.rows import CombinationTable
from rbfrag.fragility.fit.wls import clustered_line
from rbfrag.fragility.measures import SINGLE_TERMS, TERMS


@dataclass(frozen=True)
class PowerLaw:
    """k_r/PGA = C (ω_m/p)^(-M), fitted by least squares of the logarithms.

    Args:
        exponent_m: M.
        exponent_m_se: its standard error, clustered by earthquake.
        constant_c: C.
        n: number of critical values.
    """

    exponent_m: float
    exponent_m_se: float
    constant_c: float
    n: int


def power_law(table: CombinationTable) -> PowerLaw | None:
    """Fit equation (4.28): M is the slope of ln(k_r/PGA) on -ln(ω_m/p).

    Args:
        table: critical values; all that were found and have a mean period are used.

    Returns:
        None when there are too few points or earthquakes, or all ω_m/p are equal.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        x = -np.log(2.0 * math.pi / table.tm_s / np.sqrt(table.p2))
        y = np.log(table.kr_over_pga)
    used = (table.status == "found") & np.isfinite(x) & np.isfinite(y)
    _, events = np.unique(table.event_id[used].astype(str), return_inverse=True)
    if used.sum() < 3 or events.max() < 1 or np.ptp(x[used]) == 0.0:
        return None
    line, covariance, _ = clustered_line(
        x[used], y[used], np.ones(int(used.sum())), events.astype(np.intp)
    )
    return PowerLaw(
        exponent_m=float(line[1]),
        exponent_m_se=math.sqrt(covariance[1, 1]),
        constant_c=math.exp(line[0]),
        n=int(used.sum()),
    )


def log_correlations(table: CombinationTable) -> dict[str, float]:
    """Return the correlation of ln y with ln x for each single term, the strongest first.

    All terms are judged on the same points: those for which every term is defined. A term
    without variation is left out.
    """
    found = table.status == "found"
    columns = {
        name: np.asarray(
            TERMS[name].intensity_m_s({key: getattr(table, key) for key in TERMS[name].inputs}),
            dtype=np.float64,
        )
        for name in SINGLE_TERMS
    }
    with np.errstate(invalid="ignore"):
        used = found & (table.y_m_s > 0.0)
        for values in columns.values():
            used &= np.isfinite(values) & (values > 0.0)
    ln_y = np.log(table.y_m_s[used])
    if ln_y.size < 3 or np.ptp(ln_y) == 0.0:
        return {}
    result = {}
    for name, values in columns.items():
        ln_x = np.log(values[used])
        if np.ptp(ln_x) > 0.0:
            result[name] = float(np.corrcoef(ln_x, ln_y)[0, 1])
    return dict(sorted(result.items(), key=lambda item: -item[1]))
