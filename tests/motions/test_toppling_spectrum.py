"""The toppling spectrum against closed forms, direct sums and its own mathematics."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from rbfrag.errors import InputError
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.polarity import Polarity
from rbfrag.motions.toppling_spectrum import toppling_spectrum
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from tests.physics.pulses import rectangle, rectangular_cycle, sine_lobes, triangle

P2 = np.geomspace(1e-4, 1e4, 17)

POLARITIES = st.sampled_from(("forward", "reverse"))
SIZES = st.floats(1e-4, 1e4)
SAMPLES = st.lists(st.floats(-2.0, 2.0, width=32), min_size=1, max_size=40)


@st.composite
def motions(draw: st.DrawFn) -> GroundMotion:
    """Samples of any kind; some motions are given by nodes, with jumps."""
    samples = np.array(draw(SAMPLES))
    if draw(st.booleans()):
        return GroundMotion(samples, draw(st.floats(1e-3, 1.0)))
    steps = draw(
        st.lists(
            st.sampled_from((0.0, 0.003, 0.1, 0.77)),
            min_size=samples.size - 1,
            max_size=samples.size - 1,
        )
    )
    return GroundMotion.from_nodes(np.cumsum([0.0, *steps]), samples)


def direct(
    motion: GroundMotion, p: float, polarity: Polarity, per_interval: int = 40
) -> NDArray[np.float64]:
    """g H(t) [m/s] at many instants, by Gauss quadrature over all that follows each of them."""
    sign = 1.0 if polarity == "forward" else -1.0
    u, weight = np.polynomial.legendre.leggauss(24)
    u, weight = 0.5 * (1.0 + u), 0.5 * weight
    t, a = motion.time_s, sign * motion.acceleration_g
    values = [0.0]
    for i in range(motion.npts - 1):
        if t[i + 1] == t[i]:
            continue
        for share in np.linspace(0.0, 1.0, per_interval, endpoint=False):
            start = t[i] + share * (t[i + 1] - t[i])
            first = a[i] + share * (a[i + 1] - a[i])
            total = 0.0
            for j in range(i, motion.npts - 1):
                start_node, before = (start, first) if j == i else (t[j], a[j])
                length = t[j + 1] - start_node
                # pieces short enough for the exponential to be a polynomial to rounding
                pieces = max(1, math.ceil(0.5 * p * length))
                for k in range(pieces):
                    s = start_node + length * (k + u) / pieces
                    inside = before + (a[j + 1] - before) * (k + u) / pieces
                    fading = np.exp(-p * (s - start))
                    total += length / pieces * float(np.sum(weight * inside * fading))
            values.append(total)
    return STANDARD_GRAVITY_M_S2 * np.array(values)


# closed forms of section 6: critical angle over the amplitude, f = p times the lobe


def half_sine_form(f: float) -> float:
    x = math.pi / f
    low, high = 0.0, 0.5 * math.pi
    for _ in range(200):
        middle = 0.5 * (low + high)
        difference = x * math.sin(middle) - math.cos(middle)
        low, high = (
            (middle, high) if difference < math.exp(-(math.pi - middle) / x) else (low, middle)
        )
    return math.sin(low)


PULSES: dict[str, tuple[Callable[[float, float], GroundMotion], Callable[[float], float]]] = {
    "rectangle": (rectangle, lambda f: -math.expm1(-f)),
    "triangle": (triangle, lambda f: 1.0 - 2.0 / f * math.log(2.0 - math.exp(-0.5 * f))),
    "rectangular cycle": (rectangular_cycle, lambda f: math.expm1(-f) ** 2),
}


@pytest.mark.parametrize("f", [1e-3, 0.1, 0.5, 1.0, 2.0, 5.0, 50.0])
@pytest.mark.parametrize("name", PULSES)
def test_pulse_of_straight_lines(name: str, f: float) -> None:
    make, closed_form = PULSES[name]
    amplitude_g, p2 = 0.37, 7.3
    p = math.sqrt(p2)
    angle = p * toppling_spectrum(make(f / p, amplitude_g), p2) / STANDARD_GRAVITY_M_S2
    assert angle / amplitude_g == pytest.approx(closed_form(f), rel=1e-12)


@pytest.mark.parametrize("f", [0.1, 0.5, 1.0, 2.0, 5.0])
def test_half_sine(f: float) -> None:
    p2 = 7.3
    p = math.sqrt(p2)
    motion = sine_lobes(f / p, (1.0,), 4000)
    angle = p * toppling_spectrum(motion, p2) / STANDARD_GRAVITY_M_S2
    assert angle == pytest.approx(half_sine_form(f), rel=2e-7)


def test_half_sine_to_the_printed_digits() -> None:
    p2 = 1.0
    for f, printed in ((0.1, 0.06062997), (1.0, 0.42299562), (5.0, 0.86223461)):
        angle = toppling_spectrum(sine_lobes(f, (1.0,), 4000), p2) / STANDARD_GRAVITY_M_S2
        assert angle == pytest.approx(printed, abs=1e-7)


@given(motions(), st.floats(0.01, 300.0), POLARITIES)
def test_is_the_greatest_of_the_direct_integrals(
    motion: GroundMotion, p2: float, polarity: Polarity
) -> None:
    few = GroundMotion.from_nodes(motion.time_s[:6], motion.acceleration_g[:6])
    sampled = direct(few, math.sqrt(p2), polarity)
    x = toppling_spectrum(few, p2, polarity)
    scale = STANDARD_GRAVITY_M_S2 * float(np.abs(few.acceleration_g).max()) * few.duration_s
    # no sampled instant lies above it, and with 40 in an interval one lies close
    assert sampled.max() <= x + 1e-12 * scale
    assert x <= sampled.max() + 2e-3 * scale


def test_maximum_inside_an_interval() -> None:
    # a rises from -1 to 1 g in a second: G = a inside it, where no sample is
    motion = GroundMotion([-1.0, 1.0], 1.0)
    for p in (0.03, 1.0, 7.0):
        x = toppling_spectrum(motion, p * p)
        fine = direct(motion, p, "forward", per_interval=20000)
        assert x == pytest.approx(fine.max(), rel=1e-8)
        assert x > 1.1 * max(direct(motion, p, "forward", per_interval=1).max(), 0.0)


@given(motions(), SIZES, POLARITIES, st.floats(1e-3, 1e3))
def test_scales_with_the_motion(
    motion: GroundMotion, p2: float, polarity: Polarity, factor: float
) -> None:
    x = toppling_spectrum(motion, p2, polarity)
    assert toppling_spectrum(motion.scaled(4.0), p2, polarity) == 4.0 * x
    other = toppling_spectrum(motion.scaled(factor), p2, polarity)
    assert other == pytest.approx(factor * x, rel=1e-9, abs=1e-12 * factor)


@given(motions(), SIZES)
def test_reversal_is_the_negated_motion(motion: GroundMotion, p2: float) -> None:
    assert toppling_spectrum(motion, p2, "reverse") == toppling_spectrum(motion.scaled(-1.0), p2)


@given(SAMPLES, st.floats(1e-3, 1.0), SIZES, st.integers(1, 30), st.integers(1, 30))
def test_rest_before_and_after_changes_nothing(
    samples: list[float], dt_s: float, p2: float, before: int, after: int
) -> None:
    ends_at_rest = np.array([0.0, *samples, 0.0])
    padded = np.pad(ends_at_rest, (before, after))
    x = toppling_spectrum(GroundMotion(ends_at_rest, dt_s), p2)
    assert toppling_spectrum(GroundMotion(padded, dt_s), p2) == x


@given(motions(), SIZES, st.floats(-1e3, 1e3))
def test_time_may_be_shifted(motion: GroundMotion, p2: float, shift_s: float) -> None:
    moved = GroundMotion.from_nodes(motion.time_s + shift_s, motion.acceleration_g)
    x = toppling_spectrum(motion, p2)
    assert toppling_spectrum(moved, p2) == pytest.approx(x, rel=1e-7, abs=1e-10)


@given(motions(), POLARITIES)
def test_critical_angle_never_falls_with_p(motion: GroundMotion, polarity: Polarity) -> None:
    # the average that a large block takes of a is an average of those that a small one takes
    angle = np.sqrt(P2) * toppling_spectrum(motion, P2, polarity)
    assert (angle[1:] >= angle[:-1] * (1.0 - 1e-9) - 1e-12).all()


@given(motions(), SIZES, POLARITIES)
def test_bounds(motion: GroundMotion, p2: float, polarity: Polarity) -> None:
    x = toppling_spectrum(motion, p2, polarity)
    sign = 1.0 if polarity == "forward" else -1.0
    assert 0.0 <= x <= 2.0 * motion.pgv_m_s * (1.0 + 1e-9) + 1e-12
    highest = STANDARD_GRAVITY_M_S2 * max(float((sign * motion.acceleration_g).max()), 0.0)
    assert math.sqrt(p2) * x <= highest * (1.0 + 1e-9)


@pytest.mark.parametrize("polarity", ["forward", "reverse"])
def test_limits(polarity: Polarity) -> None:
    rng = np.random.default_rng(5)
    motion = GroundMotion(np.append(rng.normal(size=300), 0.0), 0.01)
    sign = 1.0 if polarity == "forward" else -1.0
    # p to 0: what the velocity still gains; its least value lies where a = 0
    fine = np.linspace(0.0, motion.duration_s, 300 * 1000 + 1)
    a = sign * STANDARD_GRAVITY_M_S2 * np.interp(fine, motion.time_s, motion.acceleration_g)
    v = np.append(0.0, np.cumsum(0.5 * (a[1:] + a[:-1]) * np.diff(fine)))
    assert toppling_spectrum(motion, 1e-20, polarity) == pytest.approx(v[-1] - v.min(), rel=1e-5)
    # p to infinity: the peak acceleration of this sign
    p2 = 1e18
    angle = math.sqrt(p2) * toppling_spectrum(motion, p2, polarity) / STANDARD_GRAVITY_M_S2
    assert angle == pytest.approx((sign * motion.acceleration_g).max(), rel=1e-6)


def test_extreme_sizes_stay_finite() -> None:
    motion = GroundMotion([0.0, 0.3, -0.2, 0.1], 0.01)
    x = toppling_spectrum(motion, [5e-324, 1e-300, 1e300, 1.7e308])
    assert np.isfinite(x).all()
    assert x[0] == pytest.approx(x[1], rel=1e-12)
    assert x[3] == pytest.approx(0.3 * STANDARD_GRAVITY_M_S2 / math.sqrt(1.7e308), rel=1e-12)


def test_weights_agree_where_series_and_closed_form_meet() -> None:
    motion = triangle(2.0, 0.4)  # intervals of 1 s: p h = p
    below, above = toppling_spectrum(motion, [0.25 * (1.0 - 1e-15), 0.25 * (1.0 + 1e-15)])
    assert above == pytest.approx(below, rel=3e-15)


def test_shape_follows_p2() -> None:
    motion = rectangle(0.5, 0.3)
    grid = toppling_spectrum(motion, [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]])
    assert np.shape(grid) == (2, 3)
    assert np.shape(toppling_spectrum(motion, [])) == (0,)
    alone = toppling_spectrum(motion, 5.0)
    assert isinstance(alone, float)
    assert alone == grid[1, 1]


def test_nothing_drives() -> None:
    assert toppling_spectrum(GroundMotion([0.0, 0.0, 0.0], 0.01), 3.0) == 0.0
    assert toppling_spectrum(GroundMotion([0.4], 0.01), 3.0) == 0.0
    assert toppling_spectrum(GroundMotion([0.0, -0.2, 0.0], 0.01), 3.0) == 0.0


@pytest.mark.parametrize("bad", [0.0, -1.0, math.nan, math.inf, "three", [1.0, math.nan]])
def test_bad_p2_is_rejected(bad: object) -> None:
    with pytest.raises(InputError, match="p2"):
        toppling_spectrum(rectangle(0.5, 0.3), bad)  # type: ignore[call-overload]


def test_bad_polarity_is_rejected() -> None:
    with pytest.raises(InputError, match="polarity"):
        toppling_spectrum(rectangle(0.5, 0.3), 1.0, "both")  # type: ignore[arg-type]


def test_too_large_to_compute_is_rejected() -> None:
    with pytest.raises(InputError, match="too large"):
        toppling_spectrum(GroundMotion([0.0, 1e308, 1e308], 1e3), 1e-10)
