"""The study of models of free-standing blocks: nested forms, and what counts as missed."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.rocking_models import SHIPPED, STUDIES, Scores, line, missed
from rbfrag.fragility.measures import TERMS
from rbfrag.fragility.method import SINGLE


def test_the_first_terms_are_the_shipped_form_with_zeros() -> None:
    given = {"p2": 3.0, "kr": 0.2, "restitution": 0.8, "pgv_m_s": 0.5, "pga_g": 0.6}
    values = SHIPPED.block.completed(given, TERMS["pgv_pga"], SINGLE)
    whole = SHIPPED.forms["pgv_pga"]
    b = [5.0, -2.0, 4.0, -8.0, -1.0]
    for study, count in ((STUDIES[1], 3), (STUDIES[2], 5)):
        short = study.form.eta(b[:count], values, SINGLE)
        full, h = whole.unscaled([*b[:count], *[0.0] * (5 - count)], values, SINGLE)
        assert h != 1.0
        assert short.eta == full.eta
        assert short.slopes == full.slopes[:count]
        assert study.form.parameters == whole.parameters[:count]


def scores(**changes: object) -> Scores:
    good = {
        "coefficients": np.ones(3), "errors": np.ones(3), "log_loss": (0.22, 0.01), "brier": 0.07,
        "slope": 1.0, "loss_by_size": (0.2,) * 6, "slope_by_size": (1.0,) * 6,
        "loss_by_factor": (0.2,) * 4,
    }  # fmt: skip
    return Scores(**{**good, **changes})  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({}, []),
        ({"log_loss": (0.2231, 0.01)}, ["log loss"]),
        ({"slope": 1.06}, ["slope"]),
        ({"slope_by_size": (1.0,) * 5 + (0.74,)}, ["slope of a size"]),
    ],
)
def test_what_is_missed_is_named(changes: dict[str, object], words: list[str]) -> None:
    study = STUDIES[2]
    assert missed(study, scores(**changes)) == words
    assert missed(STUDIES[0], scores(**changes)) == []
    assert "(≤ 0.223)" in line(study, scores())[1]
