"""Rotated horizontals, RotD50 and RotD100, against the plain rotation and an independent code."""

from __future__ import annotations

import math
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from rbfrag.errors import InputError, MotionFileError
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.polarity import driving_acceleration_g
from rbfrag.motions.readers import export_motions, read_horizontals
from rbfrag.motions.rotation import rotate, rotate_into_slope, rotd
from rbfrag.vocabulary.spectral import SPECTRUM_PERIODS_S

G = 9.80665


def component(seed: int, azimuth: float | None, n: int = 1200, **labels: Any) -> GroundMotion:
    """Noise under an envelope, at rest at its ends."""
    rng = np.random.default_rng(seed)
    t = np.linspace(0.0, 1.0, n)
    noise = np.convolve(rng.normal(size=n), np.hanning(9), "same")
    name = "H" if azimuth is None else f"{azimuth:g}"
    return GroundMotion(
        0.1 * noise * np.sin(math.pi * t) ** 2, 0.01, component=name, orientation_deg=azimuth,
        is_vertical=False, recording="R", station="S", **labels,
    )  # fmt: skip


NORTH, EAST = component(1, 0.0), component(2, 90.0)


@pytest.mark.parametrize("azimuth", [0.0, 33.3, 90.0, 120.3, 179.999, 1.0 / 3.0, 300.0])
@pytest.mark.parametrize("axes", [(0.0, 90.0), (228.0, 318.0), (12.7, 102.7), (0.0, 60.0)])
def test_half_a_turn_is_the_other_polarity_bit_for_bit(
    azimuth: float, axes: tuple[float, float]
) -> None:
    pair = component(1, axes[0]), component(2, axes[1])
    forward, turned = rotate(*pair, azimuth), rotate(*pair, azimuth + 180.0)
    for item, other in ((forward, turned), (turned, forward)):
        reverse = driving_acceleration_g(item.acceleration_g, "reverse")
        assert reverse.tobytes() == other.acceleration_g.tobytes()
    slope = rotate_into_slope(*pair, azimuth)
    assert slope.acceleration_g.tobytes() == turned.acceleration_g.tobytes()
    assert "into the slope that dips toward" in slope.remarks[-1]


@pytest.mark.parametrize("azimuth", np.random.default_rng(0).uniform(-720.0, 720.0, 20).tolist())
def test_energy_is_conserved(azimuth: float) -> None:
    first, other = rotate(NORTH, EAST, azimuth), rotate(NORTH, EAST, azimuth + 90.0)
    before = np.square(NORTH.acceleration_g) + np.square(EAST.acceleration_g)
    after = np.square(first.acceleration_g) + np.square(other.acceleration_g)
    assert np.sum(after) == pytest.approx(np.sum(before), rel=1e-12)
    np.testing.assert_allclose(after, before, rtol=1e-12)
    arias = sum(m.measures.arias_m_s for m in (first, other))
    assert arias == pytest.approx(sum(m.measures.arias_m_s for m in (NORTH, EAST)), rel=1e-12)


def test_the_axes_themselves_come_back_bit_for_bit() -> None:
    for motion in (NORTH, EAST):
        back = rotate(NORTH, EAST, motion.orientation_deg or 0.0)
        assert back.acceleration_g.tobytes() == (motion.acceleration_g + 0.0).tobytes()


@pytest.mark.parametrize("angle", [30.0, 60.0, 89.0, 91.0, 150.0, 210.0, 330.0])
def test_oblique_axes_are_solved_for(angle: float) -> None:
    ground = np.array([NORTH.acceleration_g, EAST.acceleration_g])
    oblique = [
        replace(NORTH, acceleration_g=np.array([math.cos(a), math.sin(a)]) @ ground,
                orientation_deg=math.degrees(a) % 360.0)
        for a in (math.radians(20.0), math.radians(20.0 + angle))
    ]  # fmt: skip
    east = rotate(oblique[0], oblique[1], 90.0)
    np.testing.assert_allclose(east.acceleration_g, EAST.acceleration_g, atol=1e-15)
    of_oblique, of_axes = rotd(oblique[0], oblique[1]), rotd(NORTH, EAST)
    assert of_oblique is not None
    assert of_axes is not None
    # the 180 directions begin at another azimuth
    for item, same in zip(of_oblique, of_axes, strict=True):
        np.testing.assert_allclose(item.sa_g, same.sa_g, rtol=1e-3)


def newmark_histories(a: NDArray[np.float64], dt: float, period: float) -> NDArray[np.float64]:
    """ω² u of oscillators by Newmark's average acceleration, fine steps, with free vibration."""
    omega, fine = 2.0 * math.pi / period, max(8, math.ceil(120.0 * dt / period))
    rest = np.zeros((2, math.ceil(0.6 * period / dt)))
    a = np.hstack([a, rest])
    t = np.arange(a.shape[1]) * dt
    grid = np.arange((a.shape[1] - 1) * fine + 1) * (dt / fine)
    p = -np.array([np.interp(grid, t, row) for row in a])
    h = dt / fine
    u = v = np.zeros(2)
    acc = p[:, 0]
    stiffness = 4.0 / h**2 + 2.0 * 0.05 * omega * 2.0 / h + omega**2
    history = np.zeros_like(p)
    for i in range(1, p.shape[1]):
        load = p[:, i] + (4.0 / h**2 * u + 4.0 / h * v + acc) + 0.1 * omega * (2.0 / h * u + v)
        new = load / stiffness
        acc = 4.0 / h**2 * (new - u) - 4.0 / h * v - acc
        v = 2.0 / h * (new - u) - v
        u = new
        history[:, i] = u
    return omega**2 * history


@pytest.mark.parametrize("axes", [(0.0, 90.0), (None, None)])
def test_rotd_against_newmark(axes: tuple[float | None, float | None]) -> None:
    pair = component(3, axes[0], 400), component(4, axes[1], 400)
    both = rotd(*pair)
    assert both is not None
    angles = np.radians(np.arange(180.0))
    directions = np.column_stack([np.cos(angles), np.sin(angles)])
    a = np.array([motion.acceleration_g for motion in pair])
    fine = np.array([np.interp(np.arange(3991) / 1000.0, np.arange(400) * 0.01, row) for row in a])
    velocity = G * np.hstack(
        [np.zeros((2, 1)), np.cumsum(0.5 * 0.001 * (fine[:, 1:] + fine[:, :-1]), axis=1)]
    )
    for peaks in both:
        chosen = {50: np.median, 100: np.max}[peaks.percentile]

        def expected(histories: NDArray[np.float64], chosen: Any = chosen) -> Any:
            return chosen(np.max(np.abs(directions @ histories), axis=1))

        assert peaks.pga_g == pytest.approx(expected(a), rel=1e-12)
        assert peaks.pgv_m_s == pytest.approx(expected(velocity), rel=1e-3)
        for period, sa_g in zip(SPECTRUM_PERIODS_S, peaks.sa_g, strict=True):
            if period in (0.1, 0.3, 1.0, 3.0):
                truth = expected(newmark_histories(a, 0.01, period))
                assert sa_g == pytest.approx(truth, rel=1e-3)


def test_peaks_of_each_direction_are_those_of_the_rotated_component() -> None:
    pair = component(5, 0.0, 300), component(6, 90.0, 300)
    both = rotd(*pair)
    assert both is not None
    turned = [rotate(*pair, float(azimuth)) for azimuth in range(180)]
    for peaks in both:
        chosen: Any = {50: np.median, 100: np.max}[peaks.percentile]
        assert peaks.pgv_m_s == pytest.approx(chosen([m.pgv_m_s for m in turned]), rel=2e-5)
        for number in (0, 20):
            period = SPECTRUM_PERIODS_S[number]
            sa_g = [motion.spectral_acceleration(period) for motion in turned]
            assert peaks.sa_g[number] == pytest.approx(chosen(sa_g), rel=2e-5)


def test_a_polarised_recording() -> None:
    flat = rotd(NORTH, replace(EAST, acceleration_g=np.zeros(NORTH.npts)))
    assert flat is not None
    median, largest = flat
    assert largest.pga_g == NORTH.pga_g
    assert median.pga_g == pytest.approx(NORTH.pga_g * math.cos(math.radians(45.0)), rel=1e-2)
    np.testing.assert_allclose(largest.sa_g, NORTH.spectrum_g, rtol=2e-5)
    rest = replace(NORTH, acceleration_g=np.zeros(NORTH.npts))
    still = rotd(rest, rest.__class__(np.zeros(rest.npts), 0.01))
    assert still is not None
    assert {still[0].pga_g, still[0].pgv_m_s, *still[0].sa_g} == {0.0}


def test_the_shorter_component_is_followed_by_rest() -> None:
    short = replace(EAST, acceleration_g=EAST.acceleration_g[:1190])
    padded = replace(EAST, acceleration_g=np.append(short.acceleration_g, np.zeros(10)))
    rotated = rotate(NORTH, short, 50.0).acceleration_g
    np.testing.assert_array_equal(rotated, rotate(NORTH, padded, 50.0).acceleration_g)
    assert rotd(NORTH, short) == rotd(NORTH, padded)
    assert rotate(short, NORTH, 50.0).npts == NORTH.npts


LATE = datetime(2020, 1, 1, 0, 0, 1)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"orientation_deg": None}, "the azimuth of 90 is unknown: give it as component"),
        ({"orientation_deg": 200.0}, r"axes 0° and 200° are 20° apart: at least 30°"),
        ({"orientation_deg": 0.0}, "are 0° apart"),
        ({"dt_s": 0.005}, "dt = 0.005 s"),
        ({"acceleration_g": np.zeros(600)}, "they have 1200 and 600 samples"),
        ({"start_time": LATE}, "starts 1 s after"),
        ({"is_vertical": True}, "90 is vertical"),
        ({"processing_applied": {"filter": "x"}}, "processed differently"),
        ({"processing_applied": {"rotated": {}}}, "was rotated before"),
    ],
)
def test_components_that_do_not_match(changes: dict[str, Any], message: str) -> None:
    first = replace(NORTH, start_time=datetime(2020, 1, 1))
    with pytest.raises(InputError, match=message):
        rotate(first, replace(EAST, **changes), 10.0)
    if changes != {"orientation_deg": None}:
        assert rotd(first, replace(EAST, **changes)) is None


def test_an_azimuth_that_is_no_number() -> None:
    with pytest.raises(InputError, match="azimuth nan"):
        rotate(NORTH, EAST, math.nan)


def test_the_two_horizontals_of_a_file(tmp_path: Path) -> None:
    up = replace(NORTH.scaled(0.5), component="UP", is_vertical=True, orientation_deg=None)
    export_motions([NORTH, up, EAST], tmp_path / "r.csv")
    for text in ("r.csv", "r.csv#0"):
        assert [m.component for m in read_horizontals(tmp_path / text)] == ["0", "90"]
    assert [m.component for m in read_horizontals(tmp_path / "r.csv#2")] == ["90", "0"]
    for text in ("r.csv#1", "r.csv#3"):
        with pytest.raises(MotionFileError, match="two horizontal components of one recording"):
            read_horizontals(tmp_path / text)
    export_motions([NORTH], tmp_path / "n.csv")
    with pytest.raises(MotionFileError, match="it has #0 0"):
        read_horizontals(tmp_path / "n.csv")
