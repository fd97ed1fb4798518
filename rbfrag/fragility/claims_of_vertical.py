"""Whether vertical motion matters to critical blocks: pairs with and without it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rbfrag.db.rows import CombinationTable
from rbfrag.fragility.claims import Claim, FloatArray, IntArray, cluster_interval, verdict_of
from rbfrag.fragility.claims_of_records import Points, residual_sd

NEGLIGIBLE = 0.02
"""Mean change of y, relative, that counts as none."""


@dataclass(frozen=True, eq=False)
class VerticalPairs:
    """Critical values of the same motion, polarity and p², found with and without vertical motion.

    Args:
        ln_ratio: ln of the critical value with over that without, shape (n,).
        without: k_r/PGA without vertical motion, shape (n,).
        with_vertical: k_r/PGA with it, shape (n,).
        p2: frequency parameters [1/s²], shape (n,).
        event_id: earthquakes, shape (n,).
        one_sided: pairs of which only one was found, and that are left out.
    """

    ln_ratio: FloatArray
    without: FloatArray
    with_vertical: FloatArray
    p2: FloatArray
    event_id: NDArray[np.object_]
    one_sided: int


def vertical_pairs(without: CombinationTable, with_vertical: CombinationTable) -> VerticalPairs:
    """Return the pairs of two tables; what is in one of them alone has no pair."""
    place = {
        key: i
        for i, key in enumerate(
            zip(
                without.motion_id.tolist(),
                without.polarity.tolist(),
                without.p2.tolist(),
                strict=True,
            )
        )
    }
    keys = zip(
        with_vertical.motion_id.tolist(),
        with_vertical.polarity.tolist(),
        with_vertical.p2.tolist(),
        strict=True,
    )
    pairs = np.array(
        [(place[key], j) for j, key in enumerate(keys) if key in place], dtype=np.intp
    ).reshape(-1, 2)
    first, second = pairs[:, 0], pairs[:, 1]
    one, other = without.status[first] == "found", with_vertical.status[second] == "found"
    both = one & other
    a = without.kr_over_pga[first[both]]
    b = with_vertical.kr_over_pga[second[both]]
    return VerticalPairs(
        ln_ratio=np.log(b / a),
        without=a,
        with_vertical=b,
        p2=without.p2[first[both]],
        event_id=without.event_id[first[both]],
        one_sided=int(np.sum(one != other)),
    )


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
