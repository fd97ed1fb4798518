"""Whether vertical motion matters to critical blocks: pairs with and without it."""

from __future__ import annotations

import numpy as np

from benchmarks.claims.claim import Claim, IntArray, cluster_interval, verdict_of
from benchmarks.claims.records import Points, residual_sd
from rbfrag.db.rows import CombinationTable
from rbfrag.plots.critical_strength import vertical_pairs

NEGLIGIBLE = 0.02
"""Mean change of y, relative, that counts as none."""


def vertical_is_irrelevant(
    without: CombinationTable, with_vertical: CombinationTable, *, seed: int
) -> list[Claim]:
    """Test that vertical motion does not change the critical values.

    Args:
        without: critical values without vertical motion.
        with_vertical: those with it.
        seed: of the draws.
    """
    pairs = vertical_pairs(without, with_vertical)
    if np.unique(pairs.event_id.astype(str)).size < 2:
        return []
    event, d = pairs.event_id.astype(str), pairs.ln_ratio
    clusters = int(np.unique(event).size)
    value, low, high = cluster_interval(event, lambda i: float(d[i].mean()), seed=seed)
    mean = Claim(
        "vertical motion does not change critical blocks on average",
        "mean of ln(y with / y without) of the same motion, polarity and p²; "
        f"{pairs.one_sided} pairs of which only one was found are left out",
        value,
        low,
        high,
        f"confirmed if the interval lies within ±{NEGLIGIBLE:g}, refuted if outside",
        verdict_of(low > -NEGLIGIBLE and high < NEGLIGIBLE, low > NEGLIGIBLE or high < -NEGLIGIBLE),
        int(d.size),
        clusters,
    )
    points = Points(without)
    about_line = residual_sd(points.ln_x["pgv"], points.ln_y)

    def share(i: IntArray) -> float:
        return float(np.mean(d[i] ** 2)) / about_line**2

    value, low, high = cluster_interval(event, share, seed=seed)
    scatter = Claim(
        "vertical motion is irrelevant beside the scatter of the fit",
        f"mean square of ln(y with / y without) over the variance of ln y about the line on PGV "
        f"(median change {100.0 * float(np.median(np.abs(np.expm1(d)))):.1f} %, 95 % of changes "
        f"below {100.0 * float(np.quantile(np.abs(np.expm1(d)), 0.95)):.0f} %)",
        value,
        low,
        high,
        "confirmed if the interval lies below .1, refuted if above",
        verdict_of(high < 0.1, low > 0.1),
        int(d.size),
        clusters,
    )
    return [mean, scatter]
