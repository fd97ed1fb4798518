"""Intervals and ranges hold the truth as often as they say, and those of a wrong model do not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from scipy.special import ndtr, ndtri

from benchmarks.coverage import INTERVALS, coverage, range_coverage
from benchmarks.joint_failures import Study
from rbfrag.db.location import REFERENCE
from rbfrag.fragility.dependence import Dependence
from rbfrag.fragility.joint import Placement
from rbfrag.fragility.joint_sampling import JointSampler

LAW = Dependence(0.07, 0.18, 0.19, 0.56, 1.6, 3.8, 8.9, 1.40)


@pytest.fixture(scope="module", params=["toppling-pgv_pga:exact", "record-xp"])
def study(request: pytest.FixtureRequest) -> Study:
    return Study.of(REFERENCE, request.param)


def test_intervals_hold_the_truth_as_often_as_they_say(study: Study) -> None:
    law = next(iter(study.laws.values()))
    right = coverage(study, law, sets=100, seed=0)
    assert right.holds
    share = dict(zip(INTERVALS, right.share.tolist(), strict=True))
    assert share["naive"] < 0.8
    assert share["CR1, normal"] < share["CR3, t with G-1"] < share["CR3, t with nu(x)"]
    assert right.error.max() < 0.04
    assert not coverage(study, law, sets=20, seed=1, steeper=1.5).holds


def test_ranges_hold_what_fell_in_earthquakes_left_out(study: Study) -> None:
    result = range_coverage(study.blocks, study.laws)
    assert result.holds
    assert min(result.numbers) > 150
    # not what earthquakes do whose P is that of a steeper model
    p = ndtr(1.5 * ndtri(study.blocks["probability"]))
    drawn = (np.random.default_rng(0).random(p.size) < p).astype(float)
    assert not range_coverage(study.blocks.assign(failed=drawn), study.laws).holds


def blocks_of(law: Dependence, steeper: float, seed: int) -> pd.DataFrame:
    """Return like blocks at twelve sites of each earthquake, with what a law draws for them."""
    generator = np.random.default_rng(seed)
    axes = np.arange(40), np.arange(12), (0, 1), (-1, 1), (0.07, 0.15, 0.27, 0.42, 0.58, 0.85)
    event, site, component, side, p = (axis.ravel() for axis in np.meshgrid(*axes, indexing="ij"))
    p = ndtr(ndtri(p) + generator.normal(0.0, 0.05, p.size))
    where = Placement.of(
        0.0, -ndtri(p), earthquake=event, site=site, component=component, polarity=side
    )
    true = ndtr(steeper * ndtri(p))
    failed = JointSampler(law, where).failures(true, 1, generator)[0]
    return pd.DataFrame({
        "probability": p, "failed": failed.astype(float), "earthquake": event.astype(str),
        "site": site, "component": component, "polarity": side, "p2": 1.0,
    })  # fmt: skip


@pytest.mark.parametrize("seed", range(3))
def test_ranges_hold_what_their_law_draws_and_not_what_others_do(seed: int) -> None:
    laws = {str(event): LAW for event in range(40)}
    right = range_coverage(blocks_of(LAW, 1.0, seed), laws)
    assert right.holds
    assert right.numbers[0] == 40 * 6
    assert right.sites > 11.9
    assert not range_coverage(blocks_of(LAW, 1.5, seed), laws).holds
    # without the earthquake's part the range of many sites is too narrow
    alone = replace(LAW, rho_e=0.0, rho_o=LAW.rho_o + LAW.rho_e)
    assert not range_coverage(blocks_of(LAW, 1.0, seed), dict.fromkeys(laws, alone)).holds
