"""Intervals with a verdict: asked of the rules directly, and maps that were given up."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.certify.checking import Count, inner_values, verdict_on
from benchmarks.certify.made_up import MAKERS, noise, vertical_of
from rbfrag.solver.excitation import excitation
from rbfrag.solver.search import certified
from rbfrag.solver.search.critical import critical


@pytest.mark.parametrize("kind", sorted(MAKERS))
@pytest.mark.parametrize("with_vertical", [False, True])
def test_rules_are_right_about_any_interval(kind: str, with_vertical: bool) -> None:
    """The search asks about intervals it expects an answer for; the rules must stand any."""
    rng = np.random.default_rng(11)
    count = Count()
    for _ in range(3):
        motion = MAKERS[kind](rng)
        up = vertical_of(motion, rng) if with_vertical else None
        p2 = float(np.exp(rng.uniform(np.log(0.3), np.log(40.0))))
        excited = excitation(motion, up)
        top = critical(motion, p2=p2, vertical=up).k_up_over_pga or 0.1
        for _ in range(60):
            low = excited.pga_g * top * np.exp(rng.uniform(np.log(0.1), 0.05))
            high = low * (1.0 + np.exp(rng.uniform(np.log(1e-7), np.log(0.3))))
            answer = verdict_on(excited, p2, low, high)
            if answer is not None:
                kr = inner_values(excited, low, high, rng)
                assert count.check(excited, p2, low, high, answer, kr) == []
    assert count.intervals > 60
    assert 0 < count.topple < count.intervals
    assert count.blocks == 10 * count.intervals


def test_a_map_that_is_given_up_says_from_where(monkeypatch: pytest.MonkeyPatch) -> None:
    motion = noise(np.random.default_rng(3))
    complete = critical(motion, p2=3.0, full_map=True)
    assert complete.intervals.outcome[0] == "topples"
    assert not any("given up" in sentence for sentence in complete.warnings)
    monkeypatch.setattr(certified, "MAP_STEPS", 300)
    part = critical(motion, p2=3.0, full_map=True)
    assert part.certified
    assert part.kr_over_pga == complete.kr_over_pga
    assert part.intervals.k_lo[0] == pytest.approx(0.01, rel=1e-12)
    # what lies below it is undecided, but for the blocks that topple whatever the search finds
    open_ = [i for i, subject in enumerate(part.intervals.outcome) if subject == "undecided"]
    widths = part.intervals.k_hi - part.intervals.k_lo
    given_up = part.intervals.k_hi[max(open_, key=lambda i: widths[i])]
    assert 0.01 < given_up < part.lower  # type: ignore[operator]
    (message,) = (s for s in part.warnings if "given up at" in s)
    # what it left undecided just above belongs to the same interval
    # (the sentence has six digits)
    assert float(message.split("given up at ")[1].split(" PGA")[0]) <= float(f"{given_up:.6g}")
