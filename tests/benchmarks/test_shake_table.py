"""The study of the shake table: folds by base record, scores by hand, the package's own blocks."""

from __future__ import annotations

import csv
import math
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import rbfrag
from benchmarks import shake_table_runs as simulated
from benchmarks.shake_table import (
    MEDIAN_RAD,
    SHIPPED_MODELS,
    SIGMA_LN,
    Candidates,
    best_of,
    by_verdict,
    distributions,
    folds,
    held_out,
    logistic,
    main,
    score,
    shipped_fragility,
    weighted,
)
from benchmarks.shake_table_runs import ALPHA_RAD, P2, RESTITUTION, overturned, read, run_blocks
from rbfrag.errors import InputError
from rbfrag.motions.ground_motion import GroundMotion

FloatArray = NDArray[np.float64]

RECORDS, SCALES = 12, (0.04, 0.1, 0.25)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Short noise at three levels for each of some records; outcomes drawn by PGV."""
    where = tmp_path_factory.mktemp("table")
    rng = np.random.default_rng(4)
    time = np.arange(500) / 200.0
    rows, traces = [], {}
    for record in range(RECORDS):
        noise = np.convolve(rng.normal(size=time.size), np.hanning(25), "same")
        noise *= np.sin(np.pi * time / time[-1]) ** 2 / np.abs(noise).max()
        for k, scale in enumerate(SCALES):
            number = 10 * record + k
            traces[f"test{number:03d}"] = (scale * noise).astype(np.float32)
            falls = (rng.random(2) < (0.1, 0.5, 0.85)[k]).astype(int)
            ratio = 0.08 * math.exp(0.3 * rng.normal())
            rows.append([number, f"R{record}", scale, ratio, *falls, 1])
    rows.append([999, "R0", 0.1, 0.08, 0, 0, 0])  # without a trace: not used
    with (where / "tests.csv").open("w", newline="") as file:
        lines = csv.writer(file)
        lines.writerow(["test", "base_record", "pga_g", "pgv_over_pga_s", "sp1_overturned",
                        "sp2_overturned", "has_trace"])  # fmt: skip
        lines.writerows(rows)
    np.savez(where / "table_acceleration_g_200hz.npz", **traces)
    return where


def test_tables_come_out_and_outcomes_are_kept(
    folder: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    request = [str(folder), "--work", str(tmp_path / "kept"), "--workers", "1"]
    # outcomes drawn by PGV alone meet no target of real blocks
    with pytest.raises(SystemExit):
        main(request)
    first = capsys.readouterr()
    assert "36 of 36 motions" in first.err
    assert "36 tests of 12 base records, 10 folds" in first.out
    for name in (
        "(a) PGA",
        "(b) PGV, PGA",
        "(c) X(p), PGA",
        "(d) backed",
        "(e) rocking",
        "(f) share",
        "(g) shipped",
    ):
        (line,) = [line for line in first.out.splitlines() if line.startswith(f"| {name}")][:1]
        assert line.count("±") == 6
        assert "nan" not in line
    assert "(missed)" in first.out

    def reject(_: FloatArray) -> None:
        raise AssertionError("outcomes are simulated again")

    monkeypatch.setattr(simulated, "run_blocks", reject)
    with pytest.raises(SystemExit):
        main(request)
    assert capsys.readouterr().out == first.out


def test_the_shipped_fragility_is_asked_for_each_block(folder: Path) -> None:
    trials = read(folder)
    model = SHIPPED_MODELS["rocking-pga with PGV"]
    probabilities = shipped_fragility(trials, *model, [0.75, None])
    number, test = MEDIAN_RAD.size + 7, 5
    assert probabilities.p.shape == (2 * MEDIAN_RAD.size, len(trials.motions))
    motion, alpha = trials.motions[test], MEDIAN_RAD[7]
    for k, e in ((7, 0.75), (number, None)):
        assert probabilities.settings[k][0] == alpha
        answer = rbfrag.predict(
            kind="rocking", p2=P2, kr=math.tan(alpha), restitution=e,
            pgv_m_s=motion.pgv_m_s, pga_g=motion.pga_g, model=model[0],
        )  # fmt: skip
        assert probabilities.p[k, test] == pytest.approx(answer.probability, rel=1e-12)
    assert probabilities.settings[7][2] == 0.75
    assert math.isnan(probabilities.settings[number][2])


def test_files_are_read_as_they_say(folder: Path, tmp_path: Path) -> None:
    trials = read(folder)
    assert len(trials.motions) == len(SCALES) * RECORDS
    assert np.array_equal(np.bincount(trials.base), [len(SCALES)] * RECORDS)
    with (folder / "tests.csv").open() as file:
        row = list(csv.DictReader(file))[4]
    assert trials.pgv_m_s[4] == pytest.approx(
        float(row["pga_g"]) * float(row["pgv_over_pga_s"]) * 9.80665, rel=1e-12
    )
    assert trials.overturned[1, 4] == float(row["sp2_overturned"])
    assert trials.motions[4].dt_s == 0.01
    with pytest.raises(InputError, match=r"no file tests\.csv"):
        read(tmp_path)


def test_folds_never_share_a_base_record() -> None:
    base = np.repeat(np.arange(30), np.arange(30) % 9 + 1)
    for seed in range(5):
        fold = folds(base, seed)
        assert np.unique(fold).size == 10
        for record in range(30):
            assert np.unique(fold[base == record]).size == 1
        assert np.bincount([fold[base == record][0] for record in range(30)]).tolist() == [3] * 10
    assert not np.array_equal(folds(base, 1), folds(base, 2))


def test_a_prediction_sees_no_test_of_its_base_record() -> None:
    base = np.repeat(np.arange(12), 3)
    fits: list[NDArray[np.bool_]] = []

    def spy(failed: FloatArray, fitted: NDArray[np.bool_]) -> FloatArray:
        fits.append(fitted)
        return np.full(failed.size, float(len(fits)))

    p = held_out(spy, np.zeros(36), folds(base, 1))
    assert len(fits) == 10
    for k, fitted in enumerate(fits, start=1):
        assert not set(base[fitted]) & set(base[p == k])
        assert set(base[fitted]) | set(base[p == k]) == set(range(12))


def test_scores_are_those_by_hand() -> None:
    p, failed, base = (
        np.array([0.8, 0.3, 0.6, 1.0]),
        np.array([1.0, 0, 0, 1]),
        np.array([0, 0, 1, 1]),
    )
    result = score(p, failed, base)
    a, b = -math.log(0.8) - math.log(0.7), -math.log(0.4) - math.log(0.9999)
    assert result.log_loss[0] == pytest.approx((a + b) / 4, rel=1e-12)
    # two records, whose sums differ from the mean's by the same amount: s² = 2/1 · 2 d²
    assert result.log_loss[1] == pytest.approx(2.0 * abs(0.5 * (a - b)) / 4, rel=1e-12)
    assert result.brier[0] == pytest.approx((0.04 + 0.09 + 0.36) / 4, rel=1e-12)
    assert result.brier[1] == pytest.approx(2.0 * 0.5 * (0.36 - 0.13) / 4, rel=1e-12)
    assert result.right == pytest.approx((0.75, 2.0 * 0.5 / 4), rel=1e-12)


def test_the_chosen_candidate_is_that_of_the_fitted_tests() -> None:
    candidates = Candidates(np.array([[0.9, 0.1, 0.2], [0.2, 0.8, 0.7]]), np.empty((2, 0)))
    failed = np.array([1.0, 0.0, 1.0])
    fitted = np.array([True, True, False])
    losses = candidates.losses(failed, fitted)
    assert losses == pytest.approx([-2 * math.log(0.9), -2 * math.log(0.2)], rel=1e-12)
    assert best_of(candidates)(failed, fitted)[2] == 0.2
    assert best_of(candidates)(failed, ~fitted)[2] == 0.7
    share = 0.81 / (0.81 + 0.04)
    assert weighted(candidates)(failed, fitted)[2] == pytest.approx(
        share * 0.2 + (1 - share) * 0.7, rel=1e-12
    )


def test_a_verdict_is_as_sure_as_the_fitted_tests_make_it() -> None:
    verdicts = Candidates(np.array([[1.0, 1, 1, 0, 0, 1], [0, 0, 1, 0, 1, 1]]), np.empty((2, 0)))
    failed = np.array([1.0, 1, 0, 0, 0, 1])
    p = by_verdict(verdicts)(failed, np.array([True] * 5 + [False]))
    assert p == pytest.approx([2.5 / 4] * 3 + [0.5 / 3] * 2 + [2.5 / 4])


def test_logistic_regression_meets_its_score_equations() -> None:
    rng = np.random.default_rng(2)
    x = np.exp(rng.normal(size=300))
    failed = (rng.random(300) < 1 / (1 + x**-2.0)).astype(float)
    fitted = np.arange(300) < 250
    p = logistic(x)(failed, fitted)
    assert (failed - p)[fitted].sum() == pytest.approx(0.0, abs=1e-6)
    assert ((failed - p) * np.log(x))[fitted].sum() == pytest.approx(0.0, abs=1e-6)
    slope = (np.log(p[1] / (1 - p[1])) - np.log(p[0] / (1 - p[0]))) / np.log(x[1] / x[0])
    assert 1.2 < slope < 2.8


def test_shares_are_those_of_the_distribution() -> None:
    shape = (1, 3, ALPHA_RAD.size, RESTITUTION.size)
    free_standing = np.zeros(shape)
    free_standing[:, 0], free_standing[:, 1] = (
        1.0,
        1.0,
    )  # even blocks fall, uneven ones of one sense
    assert distributions(free_standing).p == pytest.approx(0.01 + 0.98 * 0.75, rel=1e-12)
    slender = np.zeros(shape)
    slender[0, :, :9, 1] = 1.0
    result = distributions(slender)
    k = 1000
    median, sigma, e = result.settings[k]
    assert median in MEDIAN_RAD
    assert sigma in SIGMA_LN
    of_alpha = [math.exp(-(math.log(a / median) ** 2) / (2 * sigma**2)) for a in ALPHA_RAD]
    of_e = [math.exp(-((r - e) ** 2) / (2 * 0.05**2)) for r in RESTITUTION]
    share = sum(of_alpha[:9]) / sum(of_alpha) * of_e[1] / sum(of_e)
    assert 0.0 < share < 1.0
    assert result.p[k, 0] == pytest.approx(0.01 + 0.98 * share, rel=1e-9)


def test_blocks_are_those_of_respond(folder: Path) -> None:
    motion = read(folder).motions[2]
    codes, backed = run_blocks(motion.acceleration_g)
    free_standing = overturned(codes)
    assert 0.0 < free_standing[0].mean() < 1.0
    for i in range(0, ALPHA_RAD.size, 3):
        kr = math.tan(ALPHA_RAD[i])
        for j in (0, 3):
            answer = rbfrag.respond(
                motion, kind="rocking", p2=P2, kr=kr, restitution=RESTITUTION[j]
            )
            assert (answer.outcome == "toppled") == (free_standing[0, i, j] == 1.0)
        for k, way in enumerate(("forward", "reverse")):
            answer = rbfrag.respond(motion, kind="toppling", p2=P2, kr=kr, polarity=way)
            assert (answer.outcome == "toppled") == (overturned(backed)[k, i] == 1.0)
    turned, turned_backed = run_blocks(-motion.acceleration_g)
    assert np.array_equal(turned[[0, 2, 1]], codes)
    assert np.array_equal(turned_backed[::-1], backed)


def test_measured_overturns_go_with_the_simulated_share(shaketable_dir: Path) -> None:
    trials = read(shaketable_dir)
    assert (len(trials.motions), np.unique(trials.base).size) == (250, 30)
    assert trials.overturned.mean(axis=1) == pytest.approx([0.416, 0.344], abs=1e-9)
    indices = np.arange(0, 250, 25)
    free_standing = overturned(
        np.array([run_blocks(trials.motions[k].acceleration_g)[0] for k in indices])
    )
    # one distribution for both specimens, beside the base rate's Brier score of .24 and .23
    share = distributions(free_standing)
    median = MEDIAN_RAD[np.abs(np.log(MEDIAN_RAD / 0.075)).argmin()]
    chosen = np.flatnonzero(np.isclose(share.settings, (median, 0.2, 0.92)).all(axis=1))
    for failed in trials.overturned[:, indices]:
        assert ((share.p[chosen[0]] - failed) ** 2).mean() < 0.12


def test_the_filter_passes_the_band_and_shifts_nothing() -> None:
    time = np.arange(0.0, 40.0, 1.0 / 200.0)
    inside = np.sin(2 * np.pi * 3.0 * time)
    passed = simulated.filtered(inside)
    middle = slice(1000, 3000)
    assert isinstance(passed, GroundMotion)
    assert passed.acceleration_g[middle] == pytest.approx(inside[::2][middle], abs=1e-3)
    for outside_hz in (0.05, 80.0):
        outside = simulated.filtered(np.sin(2 * np.pi * outside_hz * time))
        assert np.abs(outside.acceleration_g[middle]).max() < 0.02
