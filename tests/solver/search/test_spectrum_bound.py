"""The toppling spectrum as a bound: what the solver says of blocks near and above it."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.polarity import POLARITIES
from rbfrag.motions.readers import read_motions
from rbfrag.motions.sample_motions import reversal_pulse
from rbfrag.motions.toppling_spectrum import toppling_spectrum
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.solver.excitation import excitation
from rbfrag.solver.integrator.toppling_kernel import TOPPLED
from rbfrag.solver.toppling_run import runner
from tests.physics import linear_block
from tests.physics.pulses import rectangular_cycle
from tests.solver.excursions_from_rest import largest_failing
from tests.synthetic import shaking

P2 = (30.0, 3.0, 0.3)

MOTIONS = {
    **{f"shaking {seed}": GroundMotion(shaking(seed), 0.02) for seed in range(4)},
    "starts above zero": GroundMotion([0.2, 0.1, -0.3, 0.25, -0.1], 0.11),
    "ends away from zero": GroundMotion([0.0, 0.3, -0.2, 0.15], 0.07),
    "jumps": rectangular_cycle(0.35, 0.4),
    "reversal": reversal_pulse(0.3, 0.6, 0.8, 0.01),
}


@pytest.mark.parametrize("polarity", POLARITIES)
@pytest.mark.parametrize("name", MOTIONS)
def test_is_the_linear_bound_by_bisection(name: str, polarity: str) -> None:
    motion = MOTIONS[name]
    excited = excitation(motion, None, polarity)  # type: ignore[arg-type]
    for p2 in P2:
        x = toppling_spectrum(motion, p2, polarity)  # type: ignore[call-overload]
        k = linear_block.largest_failing(excited, p2)
        assert k * STANDARD_GRAVITY_M_S2 / math.sqrt(p2) == pytest.approx(x, rel=1e-9, abs=1e-13)


@pytest.mark.parametrize("seed", range(4))
def test_non_linear_bound_is_close(seed: int) -> None:
    motion = MOTIONS[f"shaking {seed}"]
    compared = 0
    for polarity in POLARITIES:
        for p2 in (30.0, 3.0, 0.1, 0.01):
            x = toppling_spectrum(motion, p2, polarity)
            k = largest_failing(excitation(motion, None, polarity), p2)
            apart = abs(math.log(k * STANDARD_GRAVITY_M_S2 / (math.sqrt(p2) * x)))
            assert apart <= (0.001 if k < 0.05 else 0.01)
            compared += 1
    assert compared == 8


def test_no_block_above_it_topples() -> None:
    rng = np.random.default_rng(7)
    toppled = 0
    for motion in MOTIONS.values():
        for polarity in POLARITIES:
            excited = excitation(motion, None, polarity)
            for p2 in np.exp(rng.uniform(math.log(0.1), math.log(30.0), 6)):
                run = runner(excited, p2=float(p2))
                top = math.sqrt(p2) * toppling_spectrum(motion, float(p2), polarity)
                top /= STANDARD_GRAVITY_M_S2
                for factor in np.exp(rng.uniform(math.log(1.02), math.log(1.6), 4)):
                    assert run(factor * top).outcome != TOPPLED
                toppled += run(0.97 * top).outcome == TOPPLED
    assert toppled > 30  # the bound is near: many blocks just below it do topple


def test_real_records(records_dir: Path) -> None:
    for file in sorted(records_dir.rglob("*.AT2"))[:3]:
        motion = read_motions(file)[0]
        for polarity in POLARITIES:
            excited = excitation(motion, None, polarity)
            for p2 in (10.0, 0.1):
                x = toppling_spectrum(motion, p2, polarity)
                k = linear_block.largest_failing(excited, p2)
                y = k * STANDARD_GRAVITY_M_S2 / math.sqrt(p2)
                assert y == pytest.approx(x, rel=1e-9)
