"""The share of outcomes that are not known, as answers read it."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from rbfrag.errors import ModelError
from rbfrag.fragility.fit.censoring import NODES, unknown_shares
from rbfrag.fragility.unknown_outcomes import UnknownOutcomes, in_words

CURVES = {
    "variable": "k_over_pga",
    "edges": [0.2],
    "first": math.log(0.1),
    "step": math.log(2.0),
    "shares": [[0.4, 0.2, 0.0], [0.8, 0.6, 0.1]],
}


def stored(**changes: Any) -> UnknownOutcomes:
    curves = {"unknown_outcomes": {**CURVES, **changes}}
    found = UnknownOutcomes.stored(curves, "ks", "m")
    assert found is not None
    return found


def test_shares_lie_on_straight_lines_between_nodes_and_stay_beyond() -> None:
    unknown = stored()
    for ks, ratio, share in (
        (0.1, 0.1, 0.4),
        (0.1, 0.2, 0.2),
        (0.1, 0.1 * math.sqrt(2.0), 0.3),
        (0.1, 0.01, 0.4),
        (0.1, 1.3, 0.0),
        (0.2, 0.1 * math.sqrt(2.0), 0.7),
    ):
        assert unknown.share({"ks": ks, "pga_g": ks / ratio}) == pytest.approx(share)


def test_arrays_and_numbers_agree() -> None:
    rng = np.random.default_rng(2)
    values = {"ks": rng.uniform(0.05, 0.4, 300), "pga_g": np.exp(rng.uniform(-3.0, 1.5, 300))}
    for variable in ("k_over_pga", "y_over_intensity"):
        unknown = stored(variable=variable)
        given = {**values, "y_m_s": 2.0 * values["ks"], "intensity_m_s": 3.0 * values["pga_g"]}
        alone = [unknown.share({n: float(v[i]) for n, v in given.items()}) for i in range(300)]
        assert unknown.array(given) == pytest.approx(alone, rel=1e-12)
    holey = unknown.array({**given, "y_m_s": np.full(300, np.nan)})
    assert np.isnan(holey).all()


def test_what_a_fit_stores_comes_back_at_its_nodes() -> None:
    ratio = np.tile(np.geomspace(0.02, 0.95, NODES), (60, 1))
    strength = np.repeat([0.1, 0.3], 30)
    known = np.random.default_rng(0).uniform(size=ratio.shape) < ratio
    unknown = stored(**unknown_shares("k_over_pga", ratio, strength, known))
    for ks in (0.1, 0.3):
        expected = 1.0 - known[strength == ks].mean(axis=0)
        found = [unknown.share({"ks": ks, "pga_g": ks / r}) for r in ratio[0]]
        assert found == pytest.approx(expected, abs=1e-4)


def test_torn_curves_are_refused_and_no_curves_are_none() -> None:
    assert UnknownOutcomes.stored({}, "ks", "m") is None
    for changes in ({"edges": []}, {"shares": [[0.1], [0.2, 0.3]]}, {"shares": [[], []]},
                    {"step": None}, {"edges": None}):  # fmt: skip
        with pytest.raises(ModelError, match="'m' holds curves of unknown outcomes"):
            stored(**changes)


def test_the_sentence_says_the_share() -> None:
    assert in_words(0.414).startswith("41 % of the outcomes")
