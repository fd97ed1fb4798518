"""Conditional fragility: classes and shares by hand, intervals by closed forms and coverage."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import stats

from rbfrag.db.shock_pairs import NOT_RUN, Pairing, ShockEnd, ShockPairRecord, StoredShockPair
from rbfrag.fragility.conditional import conditional_shares, share_of_events


def stored(
    event: str,
    pga_g: float,
    pairing: Pairing,
    critical_rad: float | None,
    ends: tuple[ShockEnd, ShockEnd, ShockEnd],
) -> StoredShockPair:
    """A block of yield acceleration 0.1 g as a campaign stores it."""
    record = ShockPairRecord(
        "", 1, 2, pairing, "forward", "slumping", {}, 0.1, critical_rad, "0", *ends
    )
    return StoredShockPair(0, None, event, pga_g, record)


def slide(
    first_m: float,
    second_m: float,
    *,
    pga_g: float = 0.3,
    event: str = "a",
    outcome: str = "stable",
) -> StoredShockPair:
    """A block of k_y 0.1 that each shock slides so far."""

    def end(slip_m: float, word: str = "stable") -> ShockEnd:
        return ShockEnd(word, slip_m if word == "stable" else None, None, None)

    after = end(first_m + second_m, outcome)
    return stored(event, pga_g, "drawn", None, (end(first_m), after, end(second_m, outcome)))


def slump(first: float, second: float, intact: float, outcome: str = "stable") -> StoredShockPair:
    """A block of k_s 0.1 whose peaks are stated; it is left at half of the first one."""
    after_first, after_second, alone = (
        ShockEnd(outcome if part == 1 else "stable", 0.0, 0.5 * peak, peak)
        for part, peak in enumerate((first, second, intact))
    )
    return stored("a", 0.5, "station", 0.4, (after_first, after_second, alone))


def test_survivors_are_counted_by_state_and_shaking() -> None:
    rows = [
        slide(0.0, 0.06), slide(0.0, 0.02, event="b"),
        slide(0.02, 0.04), slide(0.02, 0.06, event="b"), slide(0.01, 0.01), slide(0.025, 0.01),
        slide(0.03, 0.03, event="b"),
        slide(0.03, 0.03, pga_g=0.5),
        slide(0.02, 0.0, outcome="jump"),
        slide(0.05, 0.03),  # fails in the first
    ]  # fmt: skip
    shares = conditional_shares(rows, "displacement_m", (0.05,))
    counted = [
        (s.state_to, s.pga_over_yield_to, s.blocks, s.fails, s.intact_fails, s.ratio, s.unknown)
        for s in shares
    ]
    assert counted == [
        (0.0, 4.0, 2, 1, 1, 1.0, 0),
        (0.5, 4.0, 4, 2, 1, 2.0, 1),
        (1.0, 4.0, 1, 1, 0, None, 0),
        (1.0, None, 1, 1, 0, None, 0),
    ]
    assert [s.earthquakes for s in shares] == [2, 2, 1, 1]
    assert {s.displacement_m for s in shares} == {0.05}
    assert {s.rotation_deg for s in shares} == {None}


def test_a_slump_fails_by_its_rotation_from_its_first_place_or_past_recovery() -> None:
    limit = math.radians(2.0)
    rows = [
        slump(0.02, 0.04, 0.03),
        slump(0.02, 0.03, 0.04),
        slump(0.02, 0.04, 0.0, "contact_lost"),  # past the limit, whatever came then
        slump(0.02, 0.03, 0.0, "contact_lost"),
        slump(0.02, 0.0, 0.0, "toppled"),
        slump(0.04, 0.05, 0.0),
    ]
    by_rotation, by_recovery = (
        conditional_shares(rows, "peak_rad", (item,)) for item in (limit, None)
    )
    (share,) = by_rotation
    assert (share.blocks, share.fails, share.intact_fails, share.unknown) == (4, 3, 1, 1)
    assert (share.rotation_deg, share.of_station) == (2.0, 4)
    (share,) = by_recovery
    assert (share.blocks, share.fails, share.intact_fails, share.unknown) == (4, 1, 0, 2)
    assert share.rotation_deg is None


def test_a_block_that_the_first_shock_leaves_nowhere_known_is_no_survivor() -> None:
    jump = ShockEnd("jump", None, None, None)
    row = stored("a", 0.3, "drawn", None, (jump, NOT_RUN, ShockEnd("stable", 0.1, None, None)))
    assert conditional_shares([row], "displacement_m", (0.05,)) == ()


def test_with_one_block_an_earthquake_the_error_is_binomial() -> None:
    n, count = 40, 12
    fails = np.arange(n) < count
    share = share_of_events(fails, np.arange(n))
    p = count / n
    error = 1.0 / math.sqrt((n - 1.0) * p * (1.0 - p))
    squares = (fails - p) ** 2
    freedom = 2.0 * squares.sum() ** 2 / ((squares**2).sum() - squares.sum() ** 2 / n)
    half = stats.t.ppf(0.975, min(max(freedom, 2.0), n - 1.0)) * error
    eta = math.log(p / (1.0 - p))
    for end, side in ((share.ci_low, -1.0), (share.ci_high, 1.0)):
        assert math.log(end / (1.0 - end)) == pytest.approx(eta + side * half, rel=1e-6)
    assert (share.fails, share.probability) == (count, p)


def test_blocks_of_one_earthquake_are_no_more_data_than_one() -> None:
    fails = np.arange(40) < 12
    once = share_of_events(fails, np.arange(40))
    tenfold = share_of_events(np.repeat(fails, 10), np.repeat(np.arange(40), 10))
    assert tenfold.ci_low == pytest.approx(once.ci_low, rel=1e-12)
    assert tenfold.ci_high == pytest.approx(once.ci_high, rel=1e-12)


@pytest.mark.parametrize("all_fail", [False, True])
def test_where_no_or_every_block_fails_the_interval_is_the_exact_one(all_fail: bool) -> None:
    share = share_of_events(np.full(30, all_fail), np.repeat(np.arange(6), 5))
    exact = stats.binomtest(6 * all_fail, 6).proportion_ci(0.95, "exact")
    assert (share.ci_low, share.ci_high) == pytest.approx((exact.low, exact.high), rel=1e-12)
    single = share_of_events(np.array([True, False]), np.zeros(2, dtype=int))
    assert (single.ci_low, single.ci_high) == (0.0, 1.0)


def test_the_interval_covers_the_share_behind_blocks_that_fail_together() -> None:
    # earthquakes whose shares scatter: beta of mean 0.4
    random = np.random.default_rng(5)
    events, separate, covered, sets = 25, 8, 0, 600
    for _ in range(sets):
        shares = random.beta(0.8, 1.2, size=events)
        fails = random.random((events, separate)) < shares[:, None]
        share = share_of_events(fails.ravel(), np.repeat(np.arange(events), separate))
        covered += share.ci_low <= 0.4 <= share.ci_high
    assert 0.92 < covered / sets < 0.985


def test_one_that_rests_beyond_the_rotation_of_balance_is_of_the_last_class() -> None:
    (share,) = conditional_shares([slump(1.2, 1.3, 0.1)], "peak_rad", (None,))
    assert (share.state_from, share.state_to, share.blocks) == (0.5, 1.0, 1)
