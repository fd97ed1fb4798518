"""The pulse lines: printed values, the spectra of the same pulses, and their limits."""

from __future__ import annotations

import math

import numpy as np
import pytest

from rbfrag.motions.toppling_spectrum import toppling_spectrum
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.plots.critical_strength import PULSES, half_sine_pulse, pulse_line, triangular_pulse
from tests.physics.pulses import rectangle, sine_lobes, triangle

F = (0.1, 0.5, 1.0, 2.0, 5.0)


def test_printed_values() -> None:
    # section 6 of the theory, verified to 1e-12 and 2e-7 there
    np.testing.assert_allclose(
        half_sine_pulse(F), [0.06062997, 0.25448280, 0.42299562, 0.62812122, 0.86223461], atol=5e-9
    )
    np.testing.assert_allclose(
        triangular_pulse(F), [0.04762805, 0.20066664, 0.33640687, 0.51011987, 0.73950454], atol=5e-9
    )


@pytest.mark.parametrize("f", F)
@pytest.mark.parametrize("name", PULSES)
def test_are_the_spectra_of_the_pulses(name: str, f: float) -> None:
    p2 = 2.0
    duration_s = f / math.sqrt(p2)
    pulse = {
        "rectangular": lambda: rectangle(duration_s, 0.3),
        "half-sine": lambda: sine_lobes(duration_s, (0.3,), 4000),
        "triangular": lambda: triangle(duration_s, 0.3),
    }[name]()
    angle = math.sqrt(p2) * toppling_spectrum(pulse, p2) / STANDARD_GRAVITY_M_S2
    line = float(pulse_line(name, math.pi / f))
    assert line == pytest.approx(angle / 0.3, rel=1e-12 if name != "half-sine" else 3e-7)


def test_limits_and_order() -> None:
    x = np.geomspace(1e-3, 1e9, 200)
    lines = {name: pulse_line(name, x) for name in PULSES}
    for line in lines.values():
        assert (np.diff(line) <= 1e-15).all()
        assert line[0] == pytest.approx(1.0, abs=2e-3)
    assert (lines["rectangular"] >= lines["half-sine"]).all()
    assert (lines["half-sine"] >= lines["triangular"]).all()
    # slender limit: the velocity of the pulse, g times its area
    for name, area in (("rectangular", math.pi), ("half-sine", 2.0), ("triangular", math.pi / 2)):
        assert lines[name][-1] * x[-1] == pytest.approx(area, rel=1e-6)
