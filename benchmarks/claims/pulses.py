"""Whether simple pulses scatter about the fit as records do."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

import numpy as np

from benchmarks.claims.claim import Claim, FloatArray, cluster_interval, verdict_of
from benchmarks.claims.records import Points, line
from rbfrag.db.rows import CombinationTable
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.polarity import POLARITIES
from rbfrag.solver.search.critical import critical
from tests.physics.pulses import rectangle, rectangular_cycle, sine_lobes, triangle

PERIODS = 12
"""Periods from the least to the greatest mean period of the records, equally spaced in ln T."""

BAND = 0.95
"""Share of the records that lies between the two quantiles that pulses are compared with."""

LEAST_SHARE = 0.9

_SAMPLES_PER_LOBE = 200


def _triangular_cycle(amplitude_g: float, period_s: float) -> GroundMotion:
    quarter = 0.25 * period_s
    return GroundMotion.from_nodes(
        [0.0, quarter, 3.0 * quarter, 4.0 * quarter], [0.0, amplitude_g, -amplitude_g, 0.0]
    )


PULSES: Mapping[str, Callable[[float, float], GroundMotion]] = {
    "rectangular pulse": lambda a, t: rectangle(0.5 * t, a),
    "half-sine pulse": lambda a, t: sine_lobes(0.5 * t, (a,), _SAMPLES_PER_LOBE),
    "triangular pulse": lambda a, t: triangle(0.5 * t, a),
    "rectangular cycle": lambda a, t: rectangular_cycle(0.5 * t, a),
    "sine cycle": lambda a, t: sine_lobes(0.5 * t, (a, -a), _SAMPLES_PER_LOBE),
    "triangular cycle": _triangular_cycle,
}
"""Pulses by name, of an amplitude [g] and a period [s]; a pulse is half a period long."""

GROUPS = (("single pulses", "pulse"), ("full cycles", "cycle"))


def pulses_scatter_like_records(
    table: CombinationTable, *, seed: int, periods: int = PERIODS
) -> list[Claim]:
    """Test that single pulses, and full cycles, lie about the line on PGV as the records do.

    Every pulse has the records' median PGA; its period takes the range of their mean periods.

    Args:
        table: critical values of records.
        seed: of the draws.
        periods: number of periods.
    """
    points = Points(table)
    intercept, slope = line(points.ln_x["pgv"], points.ln_y)
    residual = points.ln_y - intercept - slope * points.ln_x["pgv"]
    tail = 0.5 * (1.0 - BAND)
    bottom, top = np.quantile(residual, (tail, 1.0 - tail))
    tm = table.tm_s[points.used]
    amplitude_g = float(np.median(table.pga_g[points.used]))
    sizes = sorted(set(points.p2.tolist()))
    claims = []
    for words, ending in GROUPS:
        residuals_of_records, pulse = [], []
        for name, make in PULSES.items():
            if not name.endswith(ending):
                continue
            for period_s in np.geomspace(float(tm.min()), float(tm.max()), periods).tolist():
                motion = make(amplitude_g, period_s)
                residuals = _residuals(motion, sizes, intercept, slope)
                residuals_of_records += residuals
                pulse += [f"{name} {period_s:g}"] * len(residuals)
        off: FloatArray = np.array(residuals_of_records)
        inside = (off >= bottom) & (off <= top)
        value, low, high = cluster_interval(
            np.array(pulse),
            lambda i, inside=inside: float(inside[i].mean()),  # type: ignore[misc]
            seed=seed,
        )
        claims.append(
            Claim(
                f"{words} scatter about the fit as records do",
                f"share of them within the central {100.0 * BAND:g} % of the records; mean offset "
                f"{off.mean():+.2f}, scatter {off.std():.2f} in ln y (records "
                f"{residual.std():.2f})",
                value,
                low,
                high,
                f"confirmed if the interval lies above {LEAST_SHARE:g}, refuted if below",
                verdict_of(low > LEAST_SHARE, high < LEAST_SHARE),
                int(off.size),
                len(set(pulse)),
            )
        )
    return claims


def _residuals(
    motion: GroundMotion, sizes: list[float], intercept: float, slope: float
) -> list[float]:
    residuals = []
    for polarity in POLARITIES:
        for p2 in sizes:
            result = critical(motion, p2=p2, polarity=polarity)
            if result.y_m_s is not None:
                expected = intercept + slope * math.log(motion.pgv_m_s)
                residuals.append(math.log(result.y_m_s) - expected)
    return residuals
