"""Least widths of intervals: motions whose intensity is not known have no part in them."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
import pytest

from rbfrag.fragility.fit.fitting import fit, fit_source
from rbfrag.fragility.interval_floor import Sample, interval_floor, of_motions
from rbfrag.fragility.measures import TERMS
from rbfrag.fragility.methods import method_named
from tests.fragility.outcome_draws import drawn_outcomes


@pytest.mark.parametrize("unknown", ["pgd_tm", "xp"])
def test_what_is_not_known_of_a_motion_widens_nothing(unknown) -> None:
    source = drawn_outcomes("record", "xp", (4.0, 3.0, 1.3))
    table = source.table
    random = np.random.default_rng(3)
    pgd = (
        table.pgv_m_s
        * table.tm_s
        / (2.0 * np.pi)
        * np.exp(random.normal(0.0, 0.5, 47 * 3))[table.motion_id - 1]
    )
    source = replace(source, table=replace(table, pgd_m=pgd))
    model = fit_source(
        source, TERMS["pgd_tm"], method_named("logistic"), compared=False
    ).report.model
    richer = fit_source(source, TERMS["xp"], method_named("record"), compared=False).report.model
    whole = of_motions(source)
    # doubtful records drift: their blocks would stand at the far end of the tables
    lost = np.isin(np.arange(whole.y.size) // (whole.y.size // table.p2.size), np.arange(30))
    intensity = {**whole.intensity_m_s}
    intensity[unknown] = np.where(lost, np.nan, intensity[unknown])
    some = replace(whole, intensity_m_s=intensity)
    left = Sample(
        **{
            f.name: getattr(whole, f.name)[~lost]
            for f in fields(whole)
            if f.name != "intensity_m_s"
        },
        intensity_m_s={name: x[~lost] for name, x in whole.intensity_m_s.items()},
    )
    expected = interval_floor(model, [richer], left)
    assert max(expected) > 0.0
    if unknown == "pgd_tm":
        assert interval_floor(model, [richer], some) == expected
    else:  # such a motion is in the table still, with no width to hand on
        found = np.array(interval_floor(model, [richer], some))
        assert np.all(found <= np.array(expected) + 1e-12)


def test_a_fit_with_doubtful_displacements_takes_no_invalid_step() -> None:
    source = drawn_outcomes("record", "xp", (4.0, 3.0, 1.3))
    pgd = source.table.pgv_m_s * source.table.tm_s / (2.0 * np.pi)
    doubtful = np.where(source.table.motion_id <= 9, np.nan, pgd)
    source = replace(source, table=replace(source.table, pgd_m=doubtful))
    with np.errstate(invalid="raise"):
        report = fit(source, term="pgd_tm", method="logistic")
    assert max(max(table) for table in report.model.floor) < 1.0
