"""Published regressions by hand, and a comparison in which the better model must win."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.slide_comparison import (
    PUBLISHED,
    Published,
    Scored,
    Slides,
    clustered_mean,
    held_out,
    larger_of_two,
)
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from tests.fragility.kind_draws import TRUE, drawn

V = {
    "ky": np.array([0.5]),
    "pga_g": np.array([1.0]),
    "pgv_m_s": np.array([1.0]),
    "arias_m_s": np.array([1.0]),
    "magnitude": np.array([6.0]),
}
"""r = 1/2 and all logarithms 0 but that of PGV in cm/s, of r and of k_y."""

HALF = np.log(0.5)
BY_HAND = {
    ("Jibson (2007), eq. 6", 1): 0.215 * np.log(10.0) + (2.341 - 1.438) * HALF,
    ("Jibson (2007), eq. 7", 2): (-2.71 + 6 * 0.424) * np.log(10.0) + (2.335 - 1.478) * HALF,
    ("Jibson (2007), eq. 9", 1): -3.23 * np.log(10.0) - 3.481 * HALF,
    ("Jibson (2007), eq. 10", 2): -1.474 * np.log(10.0) - 3.833 * HALF,
    ("Saygili & Rathje (2008)", 1): 5.52 - 2.215 - 5.0975 + 5.32625 - 1.79625,
    ("Saygili & Rathje (2008)", 2): -1.56 - 2.29 - 5.21 + 5.59375 - 1.90625 + 1.55 * np.log(100.0),
    ("Saygili & Rathje (2008)", 3): -0.74 - 2.465 - 4.9775 + 5.46875 - 1.8825
    + 1.04 * np.log(100.0),
    ("Rathje & Saygili (2009)", 2): 4.89 - 2.425 - 4.91 + 5.31125 - 1.81625,
}  # fmt: skip
"""ln D [cm]."""


@pytest.mark.parametrize("published", PUBLISHED, ids=lambda p: f"{p.name} {len(p.predictors)}")
def test_medians_are_those_computed_by_hand(published: Published) -> None:
    expected = BY_HAND[published.name, len(published.predictors)]
    assert published.median(V)[0] - np.log(0.01) == pytest.approx(expected, abs=1e-9)
    assert 0.4 < published.sigma(V)[0] < 1.6


@pytest.mark.parametrize("published", PUBLISHED, ids=lambda p: f"{p.name} {len(p.predictors)}")
def test_stronger_blocks_slide_less_and_only_what_is_named_is_read(published: Published) -> None:
    named = {name: V[name] for name in ("ky", *published.predictors)}
    if "pga_g" not in named:
        named["pga_g"] = np.array([np.nan])
    strong = {**named, "ky": np.array([0.6])}
    assert published.median(strong)[0] < published.median(named)[0]


def slides_of(n: int = 3000) -> Slides:
    source = drawn("sliding", "pgv_pga", n)
    table = source.table
    magnitude = np.where(table.event_id == "event-00", 6.5, np.nan)
    measures = {**table.measures, "magnitude": magnitude}
    return Slides.of_source(replace(source, table=replace(table, measures=measures)))


def test_our_form_finds_what_made_the_data_and_beats_one_that_did_not() -> None:
    slides = slides_of()
    assert np.isnan(slides.values["magnitude"]).any()
    assert np.nanmax(slides.values["magnitude"]) == 6.5
    median, sigma = held_out(("pga_g", "pgv_m_s"), slides)
    c, b1, b2, s0, s1 = TRUE["sliding", "pgv_pga"]
    v = slides.values
    r, size = v["ky"] / v["pga_g"], v["pgv_m_s"] ** 2 / (v["ky"] * STANDARD_GRAVITY_M_S2)
    assert median == pytest.approx(c + b1 * np.log(size) + b2 * np.log(1 - r), abs=0.3)
    assert sigma == pytest.approx(np.exp(s0 + s1 * r), rel=0.15)
    ours = Scored.of(median, sigma, slides)
    theirs = Scored.of(median + 0.7, sigma, slides)
    gain, error = clustered_mean(theirs.losses - ours.losses, slides.event)
    assert gain > 4.0 * error > 0.0
    assert float(ours.cells()[2]) == pytest.approx(1.0, abs=0.15)
    alone, _ = held_out(("pga_g",), slides)
    assert Scored.of(alone, sigma, slides).residual.std() > ours.residual.std()


def test_the_error_of_a_mean_is_that_of_whole_earthquakes() -> None:
    rng = np.random.default_rng(5)
    event = np.repeat(np.arange(50), 20)
    values = rng.normal(size=50)[event][:, None] * np.ones((1, 4))
    _, error = clustered_mean(values, event)
    assert error == pytest.approx(1.0 / np.sqrt(50), rel=0.25)


def test_the_larger_of_two_polarities_is_one_row_a_motion() -> None:
    source_drawn = drawn("sliding", "pgv_pga", 40)
    assert source_drawn.displacement_m is not None
    back = replace(
        source_drawn,
        table=replace(source_drawn.table, polarity=np.full(40, "reverse", dtype=object)),
        displacement_m=source_drawn.displacement_m[::-1],
    )
    order = np.random.default_rng(1).permutation(80)
    twice = source_drawn.table.only(np.tile(np.arange(40), 2))
    polarity = np.concatenate([source_drawn.table.polarity, back.table.polarity])
    both = replace(
        source_drawn,
        table=replace(twice, polarity=polarity),
        xp_m_s=np.tile(source_drawn.xp_m_s, 2),
        k_over_pga=np.tile(source_drawn.k_over_pga, (2, 1)),
        failed=np.tile(source_drawn.failed, (2, 1)),
        displacement_m=np.concatenate(
            [source_drawn.displacement_m, source_drawn.displacement_m[::-1]]
        ),
    ).only(order)
    larger = larger_of_two(both)
    assert larger.displacement_m is not None
    sorted_rows = np.argsort(larger.table.motion_id)
    further = np.maximum(source_drawn.displacement_m, source_drawn.displacement_m[::-1])
    assert np.array_equal(larger.displacement_m[sorted_rows], further)
    assert set(larger.table.polarity) == {"forward"}
