"""Claims: intervals that cover, and verdicts that follow what was built into the data."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import count

import numpy as np
import pytest

from benchmarks.claims.claim import cluster_interval
from benchmarks.claims.pulses import PULSES, pulses_scatter_like_records
from benchmarks.claims.records import (
    exponent_one,
    motion_set,
    one_to_one,
    pulses_as_bounds,
    rank_of_terms,
    variance_linear,
    vertical_is_irrelevant,
)
from rbfrag.db.rows import CombinationTable
from rbfrag.errors import FitError
from rbfrag.plots.critical_strength import pulse_line, vertical_pairs
from rbfrag.solver.results import NUMERICS_VERSION
from tests.synthetic import unknown_measures

G = 9.80665
P2 = np.array([30.0, 3.0, 1.0, 0.1])


def table(seed: int = 1, *, slope: float = 0.72, scatter: float = 0.2) -> CombinationTable:
    """24 earthquakes of four motions: y = slope·PGV, k_r from it, PGA and PGD with more scatter."""
    rng = np.random.default_rng(seed)
    motions, events = 96, 24
    motion = np.repeat(np.arange(motions), P2.size)
    n = motion.size
    event = motion % events
    pgv = np.exp(rng.uniform(-3.0, 0.0, motions))[motion]
    tm = np.exp(rng.uniform(-1.5, 0.3, motions))[motion]
    p2 = np.tile(P2, motions)
    shared = 0.5 * scatter * rng.normal(size=events)[event]
    y = slope * pgv * np.exp(shared + scatter * rng.normal(size=n))
    kr = y * np.sqrt(p2) / G
    pga = pgv * 2.0 * np.pi / (G * tm) * np.exp(0.3 * rng.normal(size=motions)[motion])
    pgd = pgv * tm / (2.0 * np.pi) * np.exp(0.9 * rng.normal(size=motions)[motion])
    number: Iterator[int] = count()
    return CombinationTable(
        combination_id=np.arange(n),
        motion_id=motion,
        event_id=np.array([f"event-{e}" for e in event], dtype=object),
        event_guessed=np.zeros(n, dtype=bool),
        polarity=np.full(n, "forward", dtype=object),
        p2=p2,
        status=np.full(n, "found", dtype=object),
        search_limit=np.full(n, 0.01),
        kr_over_pga=kr / pga,
        upper=np.full(len(p2), np.nan),
        kr=kr,
        y_m_s=y,
        pga_g=pga,
        pgv_m_s=pgv,
        pgd_m=pgd,
        tm_s=tm,
        natural_key=np.array([str(next(number)) for _ in range(n)], dtype=object),
        block=np.full(n, None, dtype=object),
        yield_g=np.full(n, np.nan),
        numerics_version=np.full(n, NUMERICS_VERSION, dtype=object),
        measures=unknown_measures(n),
    )


class TestInterval:
    def test_is_that_of_cluster_means(self) -> None:
        # points of a cluster are equal: the mean has the error of as many points as clusters
        rng = np.random.default_rng(3)
        values = np.repeat(rng.normal(size=200), 7)
        cluster = np.repeat(np.arange(200), 7)
        middle, low, high = cluster_interval(
            cluster, lambda i: float(values[i].mean()), seed=1, replications=2000
        )
        expected = 2.0 * 1.96 * values.std() / np.sqrt(200)
        assert middle == pytest.approx(values.mean())
        assert high - low == pytest.approx(expected, rel=0.1)

    def test_follows_its_seed(self) -> None:
        values = np.random.default_rng(0).normal(size=50)

        def ends(seed: int) -> tuple[float, float, float]:
            return cluster_interval(np.arange(50), lambda i: float(values[i].mean()), seed=seed)

        assert ends(5) == ends(5)
        assert ends(5) != ends(6)


def test_one_to_one() -> None:
    slope, larger, edge = one_to_one(table(slope=0.72), seed=1)
    assert slope.verdict == larger.verdict == "refuted"
    # a straight line through lognormal scatter follows the mean, which lies above the median
    assert slope.low < 0.72 * np.exp(0.5 * (0.2**2 + 0.1**2)) < slope.high
    # the motions have one polarity each; 97.5 % of a lognormal scatter lie below 1.96 deviations
    assert larger.n == slope.n
    assert edge.low < 0.72 * np.exp(1.96 * np.hypot(0.2, 0.1)) < edge.high
    assert edge.verdict == "refuted"
    doubled = one_to_one(table(slope=1.0, scatter=0.02), seed=1)
    assert [claim.verdict for claim in doubled] == ["confirmed"] * 3


def test_rank_of_terms() -> None:
    data = table()
    assert [c.verdict for c in rank_of_terms(data, seed=1)] == ["confirmed"] * 2
    turned = replace(data, pgv_m_s=data.pgd_m, pgd_m=data.pgv_m_s * data.tm_s / (2.0 * np.pi))
    assert rank_of_terms(turned, seed=1)[0].verdict == "refuted"


def test_doubtful_displacements_cost_only_the_claim_about_them() -> None:
    data = table()
    doubtful = replace(data, pgd_m=np.where(data.motion_id < 10, np.nan, data.pgd_m))
    by_pgv, by_pgd = rank_of_terms(doubtful, seed=1)
    assert (by_pgv.n, by_pgd.n) == (data.p2.size, data.p2.size - 10 * P2.size)
    assert by_pgv == rank_of_terms(data, seed=1)[0]
    for claims in (one_to_one, exponent_one, variance_linear, pulses_as_bounds):
        assert claims(doubtful, seed=1) == claims(data, seed=1)


def test_exponent() -> None:
    large, small = exponent_one(table(seed=2), seed=1)
    assert large.verdict == small.verdict == "confirmed"
    data = table()
    bent = replace(data, kr_over_pga=data.kr_over_pga**0.8)
    assert [c.verdict for c in exponent_one(bent, seed=1)] == ["refuted"] * 2


def test_variance() -> None:
    # lognormal scatter: the standard deviation grows with PGV, the variance with its square
    (claim,) = variance_linear(table(), seed=1)
    assert claim.verdict == "refuted"
    assert claim.low < 2.0 < claim.high
    data = table()
    rng = np.random.default_rng(2)
    noise = 0.05 * np.sqrt(data.pgv_m_s) * rng.normal(size=data.p2.size)
    linear = replace(data, y_m_s=np.abs(0.72 * data.pgv_m_s + noise) + 1e-6)
    assert variance_linear(linear, seed=1)[0].verdict == "confirmed"


def test_motion_set() -> None:
    data = table()
    sets = {motion: "ab"[motion % 24 % 2] for motion in range(96)}
    (same,) = motion_set(data, sets, seed=1)
    assert same.verdict == "confirmed"
    off = np.where(data.motion_id % 24 % 2 == 0, 1.25, 0.8)
    (other,) = motion_set(replace(data, y_m_s=data.y_m_s * off), sets, seed=1)
    assert other.verdict == "refuted"
    assert other.value > same.value
    assert motion_set(data, dict.fromkeys(range(96), "a"), seed=1) == []


def test_motion_set_does_not_depend_on_the_order_of_rows() -> None:
    # an earthquake whose motions lie in two sets counts with the set of most of them
    data = table()
    sets = {
        motion: "abc"[motion // 24 % 3 if motion % 24 < 9 else motion % 3] for motion in range(96)
    }
    order = np.random.default_rng(5).permutation(data.p2.size)
    turned = data.only(order)
    (claim,), (there,) = motion_set(data, sets, seed=1), motion_set(turned, sets, seed=1)
    assert claim.statistic == there.statistic
    assert claim.value == pytest.approx(there.value)


def test_pulses_as_bounds() -> None:
    data = table()
    ratio = 2.0 * np.pi / (data.tm_s * np.sqrt(data.p2))
    below = replace(data, kr_over_pga=0.999 * pulse_line("rectangular", ratio))
    rectangular, half_sine, triangular, nearer = pulses_as_bounds(below, seed=1)
    assert rectangular.verdict == "confirmed"
    assert 0.0 < rectangular.high < 0.2  # 24 earthquakes cannot exclude more
    assert half_sine.value == triangular.value == 1.0
    assert (triangular.verdict, nearer.verdict, nearer.value) == ("refuted", "refuted", 0.0)
    random = np.random.default_rng(0).normal(size=data.p2.size)
    about = replace(data, kr_over_pga=pulse_line("triangular", ratio) * np.exp(0.1 * random - 0.1))
    assert [claim.verdict for claim in pulses_as_bounds(about, seed=1)[2:]] == ["confirmed"] * 2


def test_vertical_pairs_are_matched_not_aligned() -> None:
    without = table()
    order = np.random.default_rng(0).permutation(without.p2.size)[:-20]
    shaken = without.only(order)
    shaken = replace(shaken, kr_over_pga=1.03 * shaken.kr_over_pga)
    pairs = vertical_pairs(without, shaken)
    assert pairs.ln_ratio.size == order.size
    np.testing.assert_allclose(pairs.ln_ratio, np.log(1.03))
    half = replace(shaken, status=np.where(np.arange(order.size) < 5, "below_limit", "found"))
    assert vertical_pairs(without, half).one_sided == 5


def test_vertical_verdicts() -> None:
    without = table()
    n = without.p2.size
    random = np.random.default_rng(4).normal(size=n)

    def shaken(factor: np.ndarray) -> CombinationTable:
        return replace(without, kr_over_pga=without.kr_over_pga * factor)

    little = vertical_is_irrelevant(without, shaken(np.exp(0.02 * random)), seed=1)
    assert [c.verdict for c in little] == ["confirmed", "confirmed"]
    lost = np.where(np.arange(n) < 7, "below_limit", "found").astype(object)
    claims = vertical_is_irrelevant(without, replace(without, status=lost), seed=1)
    assert "7 pairs of which only one was found" in claims[0].statistic
    assert claims[0].n == n - 7
    stronger = vertical_is_irrelevant(without, shaken(np.exp(0.1 + 0.2 * random)), seed=1)
    assert [c.verdict for c in stronger] == ["refuted", "refuted"]


def test_pulses_beside_records() -> None:
    claims = pulses_scatter_like_records(table(slope=0.77, scatter=0.28), seed=1, periods=2)
    assert {claim.claim.split(" scatter")[0] for claim in claims} == {
        "single pulses",
        "full cycles",
    }
    for claim in claims:
        assert 0.0 <= claim.low <= claim.value <= claim.high <= 1.0
        assert claim.clusters == 6
    narrow = pulses_scatter_like_records(table(slope=3.0, scatter=0.05), seed=1, periods=2)
    assert [claim.verdict for claim in narrow] == ["refuted"] * 2


@pytest.mark.parametrize("name", PULSES)
def test_pulses_have_their_amplitude_and_length(name: str) -> None:
    motion = PULSES[name](0.4, 0.8)
    assert motion.pga_g == pytest.approx(0.4)
    assert motion.duration_s == pytest.approx(0.8 if name.endswith("cycle") else 0.4)


def test_too_few_earthquakes_are_rejected() -> None:
    data = table()
    few = replace(data, event_id=np.where(data.motion_id % 2 == 0, "a", "b").astype(object))
    with pytest.raises(FitError, match="2 earthquakes"):
        rank_of_terms(few, seed=1)
