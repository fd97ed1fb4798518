"""The filter has its textbook gain and no phase; drifts vanish; which records are filtered."""

from __future__ import annotations

import math
from dataclasses import replace
from datetime import datetime
from pathlib import Path

import numpy as np
import pytest

from rbfrag.errors import InputError
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.processing import HighPass, counts_as_uncorrected, processed
from rbfrag.motions.quality import quality_flags
from rbfrag.motions.readers import read_motions
from tests.motions import written_by_networks as written
from tests.motions.test_quality import ordinary
from tests.motions.test_real_records import STATES_NO_UNIT, manifest

DT_S = 0.01
PADDING = 2000


def gain(frequency_hz: float, corner_hz: float, order: int, dt_s: float) -> float:
    """|H|² of a Butterworth high-pass by the bilinear transform: twice run, no phase."""
    ratio = math.tan(math.pi * corner_hz * dt_s) / math.tan(math.pi * frequency_hz * dt_s)
    return 1.0 / (1.0 + ratio ** (2 * order))


@pytest.mark.parametrize(("corner_hz", "order"), [(0.1, 2), (0.25, 4), (0.05, 1)])
@pytest.mark.parametrize("frequency_hz", [0.05, 0.1, 0.2, 1.0])
def test_gain_and_phase(corner_hz: float, order: int, frequency_hz: float) -> None:
    t = np.arange(60_000) * DT_S
    envelope = np.exp(-(((t - 300.0) / 60.0) ** 2))
    wave = envelope * np.sin(2.0 * np.pi * frequency_hz * t)
    result = processed(GroundMotion(wave, DT_S), HighPass(corner_hz=corner_hz, order=order))
    back = result.acceleration_g[PADDING:-PADDING]
    # the wave is a line of 1/60 Hz width: its gain is that of its middle up to curvature
    amplitude = np.dot(back, wave) / np.dot(wave, wave)
    expected = gain(frequency_hz, corner_hz, order, DT_S)
    assert amplitude == pytest.approx(expected, abs=0.02 * max(expected, 0.05))
    quadrature = envelope * np.cos(2.0 * np.pi * frequency_hz * t)
    assert abs(np.dot(back, quadrature) / np.dot(wave, wave)) < 1e-6


def test_record_read_backward_gives_the_answer_backward() -> None:
    samples = np.random.default_rng(3).normal(size=3000) * np.hanning(3000)
    forth = processed(GroundMotion(samples, DT_S)).acceleration_g
    back = processed(GroundMotion(samples[::-1], DT_S)).acceleration_g
    assert np.max(np.abs(forth - back[::-1])) < 1e-6 * np.max(np.abs(forth))


def test_offset_and_drift_leave_no_final_velocity() -> None:
    good = GroundMotion(ordinary(npts=6001), DT_S)
    t = good.time_s
    bad = replace(good, acceleration_g=good.acceleration_g + 0.002 + 2e-5 * t)
    assert abs(bad.measures.final_velocity_m_s) > good.pgv_m_s
    result = processed(bad)
    assert quality_flags(result) == ()
    assert abs(result.measures.final_velocity_m_s) < 1e-4 * result.pgv_m_s
    assert abs(result.measures.final_displacement_m) < 0.01 * result.pgd_m
    assert result.pga_g == pytest.approx(good.pga_g, rel=0.01)
    assert result.pgv_m_s == pytest.approx(good.pgv_m_s, rel=0.05)


def test_zeros_stay_in_the_record_and_every_parameter_is_kept() -> None:
    motion = GroundMotion(
        ordinary(), DT_S, is_corrected=False, start_time=datetime(2020, 1, 1, 0, 0, 20)
    )
    result = processed(motion, HighPass(taper_s=1.0))
    assert result.npts == motion.npts + 2 * PADDING
    assert result.start_time == datetime(2020, 1, 1)
    assert result.source_sha256 == motion.sha256 != result.sha256
    assert result.is_corrected
    assert result.processing_applied == {
        "mean_removed": True,
        "filter": "butterworth high-pass",
        "passes": "forward and backward",
        "taper_s": 1.0,
        "padding_s": 20.0,
        "corner_hz": 0.1,
        "order": 2,
        "padding_samples": PADDING,
    }


def test_taper_is_a_cosine_at_both_ends() -> None:
    spikes = np.zeros(400)
    spikes[[20, 200, 379]] = 1.0
    result = processed(GroundMotion(spikes, DT_S), HighPass(taper_s=0.4, corner_hz=1e-3))
    first, middle, last = result.acceleration_g[PADDING + np.array([20, 200, 379])]
    assert first / middle == pytest.approx(0.5, abs=0.01)
    assert last / middle == pytest.approx(0.5, abs=0.01)


@pytest.mark.parametrize(
    ("motion", "settings", "words"),
    [
        (GroundMotion(np.ones(50), 5.0), {}, "corner of 0.1 Hz"),
        (GroundMotion(np.ones(50), 1e-7), {}, "200000000 samples"),
        (GroundMotion(np.ones(50), 1e-320), {}, "inf samples"),
        (GroundMotion(np.full(50, 1e200), 0.01), {}, "check units"),
        (GroundMotion(np.ones(50), 0.01), {"taper_s": 1.0}, "taper of 1 s"),
        (GroundMotion(np.ones(3), 0.01), {"padding_s": 0.0}, "too few"),
        (GroundMotion.from_nodes([0.0, 1.0], [0.0, 1.0]), {}, "equally spaced"),
        (processed(GroundMotion(ordinary(), DT_S)), {}, "already processed"),
    ],
)
def test_rejected(motion: GroundMotion, settings: dict[str, float], words: str) -> None:
    with pytest.raises(InputError, match=words):
        processed(motion, HighPass(**settings))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "settings",
    [{"corner_hz": 0.0}, {"corner_hz": math.nan}, {"order": 0}, {"order": 9},
     {"padding_s": -1.0}, {"taper_s": math.inf}],
)  # fmt: skip
def test_settings_rejected(settings: dict[str, float]) -> None:
    with pytest.raises(InputError, match=next(iter(settings))):
        HighPass(**settings)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("is_corrected", "column", "confirmed", "answer"),
    [
        (None, "", "", False),
        (True, "", "", False),
        (False, "", "", True),
        (None, "offset removed, unfiltered", "", True),
        (None, "Raw", "", True),
        (None, "Uncorrected; mean must be removed", "", True),
        (None, "baseline (tilt) corrected, uncorrected displacement", "", False),
        (None, "Baseline-Corrected", "", False),
        (False, "V1 uncorrected", "", True),
        (True, "corrected (Vol 2)", "", False),
        (None, "", "uncorrected", True),
        (False, "corrected by hand", "corrected", False),
        (False, "", "corrected", False),
    ],
)
def test_the_leading_words_say_whether_it_is_corrected(
    is_corrected: bool | None, column: str, confirmed: str, answer: bool
) -> None:
    motion = GroundMotion(np.ones(3), DT_S, is_corrected=is_corrected)
    assert counts_as_uncorrected(motion, column, confirmed) is answer


@pytest.mark.parametrize(
    ("is_corrected", "column", "confirmed", "reason"),
    [
        (None, "uncorected", "", "begin with one of corrected"),
        (None, "drawn anew", "", "begin with one of corrected"),
        (None, "correctedness", "", "begin with one of corrected"),
        (None, "V3", "", "spectra"),
        (True, "uncorrected (Vol 1)", "", "by its header or format the record is corrected"),
        (False, "corrected", "", "by its header or format the record is uncorrected"),
        (None, "corrected", "raw", "correct one of them"),
        (None, "", "by hand", "begin with one of corrected"),
    ],
)
def test_other_words_and_contradictions_are_rejected(
    is_corrected: bool | None, column: str, confirmed: str, reason: str
) -> None:
    motion = GroundMotion(np.ones(3), DT_S, is_corrected=is_corrected)
    with pytest.raises(InputError, match=reason):
        counts_as_uncorrected(motion, column, confirmed)


@pytest.mark.parametrize(("first_word", "corrected"), [("Corrected", True), ("Uncorrected", False)])
def test_cosmos_says_it_in_its_first_word(tmp_path: Path, first_word: str, corrected: bool) -> None:
    text = written.cosmos(["1.0"] * 12, DT_S).replace("Corrected", first_word, 1)
    (tmp_path / "record").write_text(text)
    assert read_motions(tmp_path / "record")[0].is_corrected is corrected


def test_smc_says_it_in_its_first_line(tmp_path: Path) -> None:
    for kind, corrected in (("2 CORRECTED", True), ("1 UNCORRECTED", False), ("4", None)):
        text = written.usgs_smc(["1.0"] * 12, 100.0, kind=f"{kind} ACCELEROGRAM")
        (tmp_path / "record").write_text(text)
        assert read_motions(tmp_path / "record")[0].is_corrected is corrected


def test_esm_says_it_in_its_header(tmp_path: Path) -> None:
    for words, corrected in (("REMOVED", True), ("NOT REMOVED", False)):
        text = written.esm_asc(["1.0"] * 12, DT_S).replace(
            "USER5", f"BASELINE_CORRECTION: BASELINE {words}\nUSER5"
        )
        (tmp_path / "record").write_text(text)
        assert read_motions(tmp_path / "record")[0].is_corrected is corrected


def test_real_files_agree_with_their_manifest(records_dir: Path) -> None:
    plain = {"slammer_csv", "geer_chihshang_2022_acc", "fema_p695_far_field"}
    rows = {row["file"]: row for row in manifest(records_dir) if row["set"] not in plain}
    count = 0
    for row in rows.values():
        units = row["file_units"] if row["set"] in STATES_NO_UNIT else None
        for motion in read_motions(records_dir / row["file"], units=units):
            by_table = counts_as_uncorrected(motion, row["processing"])
            assert counts_as_uncorrected(motion) is by_table, row["file"]
            count += by_table
    assert count == 123
