"""Aims of the models."""

from __future__ import annotations

import math

from benchmarks.model_acceptance import Mark


def test_a_mark_says_where_it_is_missed() -> None:
    mark = Mark("a", "slope", 0.93, 1.07, 1.0)
    assert mark.aim == "0.93 to 1.07"
    assert mark.cell == "1"
    assert Mark("a", "slope", 0.93, 1.07, 0.925).cell == "**0.925, missed**"
    assert Mark("a", "slope", 0.93, 1.07, math.nan).cell == "**nan, missed**"
    assert Mark("a", "gain", 0.02, math.inf, 0.03, also=("above 0", False)).cell != "0.03"
    assert Mark("a", "loss", -math.inf, 0.1, 0.1).aim == "≤ 0.1"
