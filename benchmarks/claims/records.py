"""What Gibson's dissertation claims of critical blocks under records, tested."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from benchmarks.claims.claim import LEVEL, Claim, FloatArray, IntArray, cluster_interval, verdict_of
from rbfrag.db.rows import CombinationTable
from rbfrag.errors import FitError
from rbfrag.fragility.fit.fitting import fit
from rbfrag.fragility.measures import TERMS
from rbfrag.plots.critical_strength import pulse_line, vertical_pairs

FEWEST_EVENTS = 5

LARGE_BLOCKS_P2 = 1.0
SMALL_BLOCKS_P2 = 3.0

EDGE = 0.1
"""So near 1 is what counts as 1:1 of an upper edge."""

BINS = 12
"""Bins of the frequency ratio, of equal width in its logarithm."""

_PERMUTATIONS = 2000


class Points:
    """The found critical values for which some terms are defined, with logarithms.

    Args:
        table: the critical values.
        names: of the terms; a motion whose PGD is in doubt has no `pgd_tm`.

    Raises:
        FitError: fewer than five earthquakes.
    """

    def __init__(self, table: CombinationTable, names: Sequence[str] = ("pgv", "pga_tm")) -> None:
        terms = {
            name: np.asarray(
                TERMS[name].intensity_m_s({key: table.measure(key) for key in TERMS[name].inputs}),
                dtype=np.float64,
            )
            for name in names
        }
        used = (table.status == "found") & np.isfinite(table.y_m_s)
        for values in terms.values():
            used &= np.isfinite(values) & (np.nan_to_num(values) > 0.0)
        self.used: NDArray[np.bool_] = used
        self.event = table.event_id[used].astype(str)
        self.motion_id = table.motion_id[used]
        self.p2 = table.p2[used]
        self.ln_y: FloatArray = np.log(table.y_m_s[used])
        self.ln_x = {name: np.log(values[used]) for name, values in terms.items()}
        self.kr_over_pga = table.kr_over_pga[used]
        self.frequency_ratio: FloatArray = 2.0 * np.pi / (table.tm_s[used] * np.sqrt(self.p2))
        self.clusters = int(np.unique(self.event).size)
        if self.clusters < FEWEST_EVENTS:
            raise FitError(
                f"{self.clusters} earthquakes have critical values: claims are tested on "
                f"{FEWEST_EVENTS} or more; add motions of others and run  rbfrag simulate"
            )

    @property
    def n(self) -> int:
        """How many there are."""
        return int(self.ln_y.size)


def line(x: FloatArray, y: FloatArray) -> tuple[float, float]:
    """Return intercept and slope of the least-squares line."""
    dx = x - x.mean()
    slope = float(dx @ (y - y.mean()) / (dx @ dx))
    return float(y.mean() - slope * x.mean()), slope


def residual_sd(x: FloatArray, y: FloatArray) -> float:
    """Return the standard deviation about the least-squares line."""
    intercept, slope = line(x, y)
    return float(np.std(y - intercept - slope * x))


def one_to_one(table: CombinationTable, *, seed: int) -> list[Claim]:
    """Test that the critical velocity equals PGV "virtually 1:1", read as mean and as edge."""
    points = Points(table)
    report = fit(table, term="pgv", method="wls", seed=seed)
    slope, error = report.coefficients["c1"], report.standard_errors["c1"]
    reach = float(stdtrit(points.clusters - 1, 0.975)) * error
    ratio = points.ln_y - points.ln_x["pgv"]
    x, y = np.exp(points.ln_x["pgv"]), np.exp(points.ln_y)
    # of both polarities of a motion and size the one that topples the stronger block
    order = np.lexsort((points.ln_y, points.p2, points.motion_id))
    same = (np.diff(points.motion_id[order]) == 0) & (np.diff(points.p2[order]) == 0.0)
    larger = order[np.append(~same, True)]
    claim = "critical velocity y and PGV are virtually 1:1"
    rule = "confirmed if the interval holds 1, refuted if not"
    edge = cluster_interval(
        points.event, lambda i: math.exp(float(np.quantile(ratio[i], 0.975))), seed=seed
    )
    drawn = cluster_interval(
        points.event[larger], lambda i: line(x[larger[i]], y[larger[i]])[1], seed=seed
    )
    words = "slope of the straight line of y on PGV"
    held = [
        (f"{claim}, as the mean", f"{words}, weighted",
         (slope, slope - reach, slope + reach), report.n),
        (f"{claim}, as the mean of the larger polarity", words, drawn, int(larger.size)),
        (f"{claim}, as the upper edge", "97.5 % quantile of y/PGV", edge, points.n),
    ]  # fmt: skip
    claims = []
    for claimed, statistic, (value, low, high), n in held:
        within = low > 1.0 - EDGE and high < 1.0 + EDGE
        holds = within if claimed.endswith("edge") else low <= 1.0 <= high
        criterion = f"confirmed if the interval lies within {EDGE:g} of 1, refuted if not"
        claims.append(
            Claim(
                claimed,
                statistic,
                value,
                low,
                high,
                criterion if claimed.endswith("edge") else rule,
                verdict_of(holds, not holds),
                n,
                points.clusters,
            )
        )
    return claims


def rank_of_terms(table: CombinationTable, *, seed: int) -> list[Claim]:
    """Test that PGV predicts better than PGA·Tm, and that better than PGD/Tm."""
    claims = []
    for better, worse in (("pgv", "pga_tm"), ("pga_tm", "pgd_tm")):
        points = Points(table, (better, worse))

        def gain(
            i: IntArray, better: str = better, worse: str = worse, points: Points = points
        ) -> float:
            return residual_sd(points.ln_x[worse][i], points.ln_y[i]) - residual_sd(
                points.ln_x[better][i], points.ln_y[i]
            )

        value, low, high = cluster_interval(points.event, gain, seed=seed)
        claims.append(
            Claim(
                f"{TERMS[better].symbol} ranks above {TERMS[worse].symbol}",
                "scatter of ln y about the line on the second, less that on the first",
                value,
                low,
                high,
                "confirmed if the interval lies above 0, refuted if below",
                verdict_of(low > 0.0, high < 0.0),
                points.n,
                points.clusters,
            )
        )
    return claims


def motion_set(table: CombinationTable, set_of_motion: dict[int, str], *, seed: int) -> list[Claim]:
    """Test that it does not matter from which set the motions come.

    Args:
        table: the critical values.
        set_of_motion: name of the set of each motion, by id; others are left out.
        seed: of draws and permutations.
    """
    points = Points(table)
    in_a_set = np.array([int(m) in set_of_motion for m in points.motion_id])
    label = np.array([set_of_motion.get(int(m), "") for m in points.motion_id])[in_a_set]
    event = points.event[in_a_set]
    x, y = points.ln_x["pgv"][in_a_set], points.ln_y[in_a_set]
    if np.unique(label).size < 2:
        return []
    intercept, slope = line(x, y)
    residual = y - intercept - slope * x

    def share(names: NDArray[np.str_], values: FloatArray) -> float:
        _, number = np.unique(names, return_inverse=True)
        count = np.bincount(number)
        mean = np.bincount(number, values) / count
        centred = values - values.mean()
        return float((count * (mean - values.mean()) ** 2).sum() / (centred @ centred))

    value, low, high = cluster_interval(event, lambda i: share(label[i], residual[i]), seed=seed)
    # by chance: the sets dealt out anew to whole earthquakes
    events, number = np.unique(event, return_inverse=True)
    of_event = np.array([_most_frequent(label[number == i]) for i in range(events.size)])
    rng = np.random.default_rng(seed)
    actual = share(of_event[number], residual)
    chance = np.array(
        [share(rng.permutation(of_event)[number], residual) for _ in range(_PERMUTATIONS)]
    )
    p = float((1 + np.sum(chance >= actual)) / (1 + _PERMUTATIONS))
    return [
        Claim(
            "the set that motions come from does not matter",
            f"share of the variance of ln y about the line on PGV that {np.unique(label).size} "
            f"sets explain; by chance {np.median(chance):.3f}, p = {p:.3f}",
            value,
            low,
            high,
            "refuted if p < .05, when sets are dealt out anew to whole earthquakes (each in the "
            "set of most of its motions); otherwise confirmed",
            verdict_of(p >= 0.05, p < 0.05),
            int(in_a_set.sum()),
            int(events.size),
        )
    ]


def _most_frequent(names: NDArray[np.str_]) -> str:
    """Return the name that occurs most often, of equals the first in the alphabet."""
    unique_names, count = np.unique(names, return_counts=True)
    return str(unique_names[np.argmax(count)])


def pulses_as_bounds(table: CombinationTable, *, seed: int) -> list[Claim]:
    """Test the lines of single pulses as bounds of k_r/PGA against ω_m/p."""
    points = Points(table)
    statement = (
        ("rectangular", "is an upper bound", 0.0),
        ("half-sine", "lies near mean + 2 standard deviations", 0.0228),
        ("triangular", "bounds the bulk", 0.5),
    )
    claims = []
    for name, words, expected in statement:
        above = points.kr_over_pga > pulse_line(name, points.frequency_ratio)

        def share(i: IntArray, above: NDArray[np.bool_] = above) -> float:
            return float(above[i].mean())

        value, low, high = cluster_interval(points.event, share, seed=seed)
        if expected == 0.0:
            rule, holds = "confirmed if no critical value lies above", value == 0.0
            if holds:
                # draws of what never happened say nothing: exact for whole earthquakes
                high = 1.0 - (1.0 - LEVEL) ** (1.0 / points.clusters)
        elif expected == 0.5:
            rule, holds = "confirmed if the interval lies below half", high < expected
        else:
            rule = f"confirmed if the interval holds {100.0 * expected:g} %, refuted if not"
            holds = low <= expected <= high
        claims.append(
            Claim(
                f"the line of the {name} pulse {words}",
                "share of critical values above it",
                value,
                low,
                high,
                rule,
                verdict_of(holds, not holds),
                points.n,
                points.clusters,
            )
        )
    logarithm = np.log(points.frequency_ratio)
    edges = np.linspace(logarithm.min(), logarithm.max(), BINS + 1)
    number = np.clip(np.searchsorted(edges, logarithm, side="right") - 1, 0, BINS - 1)
    lines = np.array([pulse_line(name, points.frequency_ratio) for name, _, _ in statement])

    def nearest(i: IntArray) -> float:
        nearer = []
        for motion in np.unique(number[i]):
            of_motion = i[number[i] == motion]
            off = np.abs(
                np.log(lines[:, of_motion].mean(axis=1) / points.kr_over_pga[of_motion].mean())
            )
            nearer.append(off.argmin() == len(statement) - 1)
        return float(np.mean(nearer))

    value, low, high = cluster_interval(points.event, nearest, seed=seed)
    claims.append(
        Claim(
            "the line of the triangular pulse is closer to the mean than those of other pulses",
            f"share of {BINS} bins of ω_m/p in which it is",
            value,
            low,
            high,
            "confirmed if the interval lies above half, refuted if below",
            verdict_of(low > 0.5, high < 0.5),
            points.n,
            points.clusters,
        )
    )
    return claims


def exponent_one(table: CombinationTable, *, seed: int) -> list[Claim]:
    """Test that k_r/PGA is inversely proportional to ω_m/p (M = 1), for large and small blocks."""
    points = Points(table)
    claims = []
    for words, chosen in (
        (f"p² ≤ {LARGE_BLOCKS_P2:g} 1/s²", points.p2 <= LARGE_BLOCKS_P2),
        (f"p² ≥ {SMALL_BLOCKS_P2:g} 1/s²", points.p2 >= SMALL_BLOCKS_P2),
    ):
        if not chosen.any():
            continue
        x, y = -np.log(points.frequency_ratio[chosen]), np.log(points.kr_over_pga[chosen])

        def slope(i: IntArray, x: FloatArray = x, y: FloatArray = y) -> float:
            return line(x[i], y[i])[1]

        value, low, high = cluster_interval(points.event[chosen], slope, seed=seed)
        claims.append(
            Claim(
                f"the exponent M is 1 ({words})",
                "slope of ln(k_r/PGA) on −ln(ω_m/p)",
                value,
                low,
                high,
                "confirmed if the interval holds 1, refuted if not",
                verdict_of(low <= 1.0 <= high, not low <= 1.0 <= high),
                int(chosen.sum()),
                int(np.unique(points.event[chosen]).size),
            )
        )
    return claims


def variance_linear(table: CombinationTable, *, seed: int) -> list[Claim]:
    """Test that the variance of y about its line grows in proportion to PGV."""
    points = Points(table)
    x, y = np.exp(points.ln_x["pgv"]), np.exp(points.ln_y)
    weights = 1.0 / x**2
    mean_x, mean_y = np.average(x, weights=weights), np.average(y, weights=weights)
    slope = np.sum(weights * (x - mean_x) * (y - mean_y)) / np.sum(weights * (x - mean_x) ** 2)
    squared = (y - mean_y - slope * (x - mean_x)) ** 2
    ln_x = points.ln_x["pgv"]

    def power(i: IntArray) -> float:
        # by bins of equal number, so that a residual near zero has no weight of its own
        order = i[np.argsort(ln_x[i], kind="stable")]
        bins = np.array_split(order, 20)
        return line(
            np.array([ln_x[b].mean() for b in bins]),
            np.log(np.array([squared[b].mean() for b in bins])),
        )[1]

    value, low, high = cluster_interval(points.event, power, seed=seed)
    return [
        Claim(
            "the variance of y grows in proportion to PGV",
            "power of PGV that the squared residuals grow with",
            value,
            low,
            high,
            "confirmed if the interval holds 1, refuted if not",
            verdict_of(low <= 1.0 <= high, not low <= 1.0 <= high),
            points.n,
            points.clusters,
        )
    ]


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
