"""The average over the blocks is that of single predictions, and says what it leaves out."""

from __future__ import annotations

import math
import statistics
from pathlib import Path

import numpy as np
import pytest

from rbfrag.errors import DatabaseNotFoundError, InputError
from rbfrag.fragility.model import FragilityModel
from rbfrag.question.question import predict
from rbfrag.results.numbers import percent
from rbfrag.rockmasses.counts import EqualCounts, crossings, mode_counts
from rbfrag.rockmasses.joint_sets import Realisations, RockMass
from rbfrag.rockmasses.report import as_dict, block_columns
from rbfrag.rockmasses.scenario import LOCKED, UNCOVERED, scenario

UNIFORM = {"distribution": "uniform"}
WILD: dict[str, object] = {
    "base.dip_deg": {**UNIFORM, "low": -20.0, "high": 35.0},
    "base.spacing_m": {"distribution": "normal", "mean": 1.0, "sd": 0.5},
    "back.dip_deg": {**UNIFORM, "low": 60.0, "high": 175.0},
    "back.spacing_m": {"distribution": "lognormal", "median": 0.5, "sd_ln": 0.5},
    "friction.phi_deg": {**UNIFORM, "low": 15.0, "high": 50.0},
}
SLOPE: dict[str, object] = {**WILD, "base.dip_deg": 5.0, "back.dip_deg": 45.0}


@pytest.fixture(scope="module")
def realisations() -> Realisations:
    return RockMass.of(WILD).realise(1_500, 4)


def test_average_is_that_of_single_predictions(
    realisations: Realisations, model: FragilityModel
) -> None:
    answer = scenario(realisations, {"pgv_m_s": 0.4}, model=model, level=0.9)
    singles: dict[str, list[tuple[float, float, float]]] = {}
    for i in range(realisations.n):
        result = realisations.stability
        mode, state = str(result.mode[i]), str(result.state[i])
        inputs: tuple[float, float, float] | None = None
        if not realisations.is_block[i]:
            pass
        elif state == "unstable":
            inputs = (1.0, 1.0, 1.0)
            assert answer.reason[i] == "unstable"
        elif mode == "topple":
            item = predict(
                result.p2[i], result.yield_acceleration[i], pgv_m_s=0.4, model=model, level=0.9
            )
            inputs = (item.probability, item.ci_low, item.ci_high)
            assert answer.in_domain[i] == item.in_domain
        else:
            assert answer.reason[i] == (LOCKED if state == "locked" else UNCOVERED)
        if inputs is None:
            assert math.isnan(answer.probability[i])
        else:
            assert answer.probability[i] == pytest.approx(inputs[0], rel=1e-12)
            singles.setdefault(mode, []).append(inputs)
    everything = [item for several in singles.values() for item in several]
    modes = {mode.mode: mode for mode in answer.modes}
    for several, average in [(everything, answer.covered)] + [
        (several, modes[mode].covered)  # type: ignore[index]
        for mode, several in singles.items()
    ]:
        p, low, high = zip(*several, strict=True)
        assert average.count == len(several) > 1
        assert average.probability == pytest.approx(statistics.fmean(p), rel=1e-12)
        error = statistics.stdev(p) / math.sqrt(len(p))
        assert average.standard_error == pytest.approx(error, rel=1e-9, abs=1e-15)
        assert average.ci_low == pytest.approx(statistics.fmean(low), rel=1e-12)
        assert average.ci_high == pytest.approx(statistics.fmean(high), rel=1e-12)
    assert 0.05 < answer.covered.probability < 0.95  # type: ignore[operator]
    assert {"topple", "slide", "confined_topple"} <= set(singles)


def test_shares_of_covered_and_uncovered_add_up(
    realisations: Realisations, model: FragilityModel
) -> None:
    answer = scenario(realisations, {"pgv_m_s": 0.4}, model=model)
    assert sum(mode.count for mode in answer.modes) == realisations.n_blocks
    assert sum(answer.uncovered_share.values()) + answer.covered_share == pytest.approx(1.0)
    assert set(answer.uncovered_share) == {"slide", "slump", "confined_topple"}
    assert [mode.mode for mode in answer.modes if mode.has_model] == ["topple"]
    for mode, share in answer.uncovered_share.items():
        (text,) = [t for t in answer.warnings if t.startswith(f"{mode.replace('_', ' ')}:")]
        assert f"{percent(share)} of the blocks have no answer" in text
        assert "displacement_m" in text


def test_the_sampling_error_is_that_of_repeated_samples(model: FragilityModel) -> None:
    mass = RockMass.of({**WILD, "base.dip_deg": 2.0, "back.dip_deg": 88.0})
    answers = [
        scenario(mass.realise(300, seed), {"pgv_m_s": 1.2}, model=model).covered
        for seed in range(60)
    ]
    assert 0.05 < np.mean([a.probability for a in answers]) < 0.95  # type: ignore[arg-type]
    spread = np.std([a.probability for a in answers], ddof=1)  # type: ignore[arg-type]
    assert np.mean([a.standard_error for a in answers]) == pytest.approx(spread, rel=0.3)  # type: ignore[arg-type]


def test_doubts_about_the_blocks_are_told_with_their_number(model: FragilityModel) -> None:
    mass = RockMass.of({**WILD, "block.size_factor": {**UNIFORM, "low": 0.02, "high": 2.0}})
    result = mass.realise(800, 1)
    answer = scenario(result, {"pgv_m_s": 0.4}, model=model)
    inputs = np.array([reason != UNCOVERED for reason in answer.reason])
    small = int(np.sum(["p2 is outside the fitted range" in r for r in answer.reason[inputs]]))
    assert small > 0
    assert any(
        text.startswith(f"{small} of ") and "p2 is outside" in text for text in answer.warnings
    )
    (topple,) = [mode for mode in answer.modes if mode.mode == "topple"]
    assert topple.in_domain == int(answer.in_domain.sum()) < topple.count


def test_no_model_is_looked_up_where_no_block_needs_one(tmp_path: Path) -> None:
    place = tmp_path / "none.db"
    slumps = RockMass.of({**SLOPE, "friction.phi_deg": 1.0}).realise(200, 1)
    answer = scenario(slumps, {"pgv_m_s": 0.4}, db=place)
    assert answer.model is None
    with pytest.raises(DatabaseNotFoundError):
        scenario(RockMass.of(WILD).realise(200, 1), {"pgv_m_s": 0.4}, db=place)
    assert not place.exists()


@pytest.mark.parametrize(
    ("measures", "words"),
    [
        ({}, "requires an intensity measure"),
        ({"pgv_m_s": math.nan}, "pgv_m_s = nan m/s is not a number"),
        ({"pgv_m_s": -1.0}, "pgv_m_s = -1 m/s is negative"),
        ({"pgd_m": 0.1, "tm_s": 0.0}, "tm_s = 0 s is not above zero"),
        ({"pga_g": 0.4}, "pgv_m_s"),
    ],
)
def test_rejections(
    realisations: Realisations, model: FragilityModel, measures: dict[str, float], words: str
) -> None:
    with pytest.raises(InputError, match=words):
        scenario(realisations, measures, model=model)


def test_a_level_that_is_none_is_rejected(
    realisations: Realisations, model: FragilityModel
) -> None:
    with pytest.raises(InputError, match=r"level = 1\.0"):
        scenario(realisations, {"pgv_m_s": 0.4}, model=model, level=1.0)


def test_vertical_acceleration_of_the_file_is_rejected(model: FragilityModel) -> None:
    result = RockMass.of({**WILD, "block.kv": 0.1}).realise(100, 1)
    with pytest.raises(InputError, match=r"block\.kv is not supported"):
        scenario(result, {"pgv_m_s": 0.4}, model=model)


def test_no_shaking_topples_what_is_unstable_and_nothing_else(
    realisations: Realisations, model: FragilityModel
) -> None:
    answer = scenario(realisations, {"pgv_m_s": 0.0}, model=model)
    falls = realisations.is_block & (realisations.stability.state == "unstable")
    covered = np.isfinite(answer.probability)
    assert np.array_equal(answer.probability[covered] == 1.0, falls[covered])
    assert set(answer.probability[covered]) == {0.0, 1.0}


def test_the_block_table_has_every_realisation(
    realisations: Realisations, model: FragilityModel
) -> None:
    answer = scenario(realisations, {"pgv_m_s": 0.4}, model=model)
    plain, full = block_columns(realisations), block_columns(realisations, answer)
    assert list(plain)[:5] == ["block_id", "p2_1_s2", "kr", "mode", "weight"]
    assert list(full)[-8:] == [
        "probability",
        "ci_low",
        "ci_high",
        "event_low",
        "event_high",
        "in_domain",
        "how",
        "reason",
    ]
    assert {column.shape for column in full.values()} == {(realisations.n,)}
    assert plain["weight"].sum() == realisations.n_blocks < realisations.n
    bad = ~realisations.is_block
    assert set(plain["mode"][bad]) == {""}
    assert np.isnan(plain["p2_1_s2"][bad]).all()
    assert "" not in plain["reason"][bad]
    topples = plain["mode"] == "topple"
    assert np.array_equal(np.isfinite(plain["kr"]), topples)
    assert np.array_equal(plain["kr"][topples], plain["yield_g"][topples])


def test_the_report_is_plain_and_doubts_many_impossible_blocks(
    realisations: Realisations, model: FragilityModel
) -> None:
    document = as_dict(
        realisations,
        mode_counts(realisations),
        crossings(realisations),
        scenario(realisations, {"pgv_m_s": 0.4}, model=model),
    )
    assert document["realisations"] == 1_500
    assert document["blocks"] + sum(document["impossible"].values()) == 1_500
    assert set(document["modes"]["topple"]["yield_g"]) == {"q05", "q16", "q50", "q84", "q95"}
    assert "realisations are no block and are left out" in document["warnings"][0]
    assert document["scenario"]["covered_only"]["covered"] < document["blocks"]


def test_an_error_that_cannot_be_told_is_null_in_the_report(realisations: Realisations) -> None:
    crossing = EqualCounts("slump", "slide", 0.3, math.inf, 10.0)
    (document,) = as_dict(realisations, mode_counts(realisations), [crossing])["crossings"]
    assert document["standard_error_g"] is None
    assert document["pga_g"] == 0.3
