"""The geometries of the dissertation's Table 3.2 against statics and against a block on springs.

α1 and α3 from -80 to 80 degrees in steps of 10, α1 < α3 (136 pairs); φ 35 and 55; β -10, 0 and 20
degrees; scale 1 and 2, taken as r3 [m]: 1,632 models, the back plane as rough as the base.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import product

import pytest

from rbfrag.solver.block.geometry import Block
from rbfrag.solver.stability.single import Stability, stability
from tests.physics import equilibrium as statics
from tests.physics.penalty import yield_on_ramp
from tests.physics.test_stability_equilibrium import is_unique

MOST_G = 2.5
"""End of the ramps."""


@dataclass(frozen=True)
class Model:
    """One of the 1,632; angles in degrees, r3 in metres."""

    alpha1: float
    alpha3: float
    phi: float
    beta: float
    r3: float

    @property
    def stability(self) -> Stability:
        return stability(self.block, beta_deg=self.beta, phi_deg=self.phi)

    @property
    def block(self) -> Block:
        return Block.from_angles(self.alpha1, self.alpha3, self.r3)

    @property
    def case(self) -> statics.Case:
        angles = (self.alpha1, self.alpha3, self.r3, self.beta, self.phi, self.phi)
        return statics.parallelogram(*angles)

    @property
    def decided(self) -> bool:
        """True if statics alone has one answer: no wedge or hang-up holds more than the mode."""
        return is_unique(self.case, self.stability.mode)

    def limit_g(self) -> float:
        """The greatest k that any contact forces hold; infinite where they hold every k."""
        limit = statics.limit_of_equilibrium(self.case)
        return math.inf if limit is None else limit.k

    def ramp_g(self) -> float | None:
        return yield_on_ramp(self.block, beta_deg=self.beta, phi_deg=self.phi, most_g=MOST_G)


ANGLES = range(-80, 81, 10)
TABLE_3_2 = tuple(
    Model(a1, a3, phi, beta, scale)
    for a1, a3, phi, beta, scale in product(ANGLES, ANGLES, (35, 55), (-10, 0, 20), (1, 2))
    if a1 < a3
)


def test_the_table_has_1632_models() -> None:
    assert len(TABLE_3_2) == 1632


@pytest.mark.parametrize("model", TABLE_3_2[7::31], ids=str)
def test_limit_analysis_holds_the_yield_and_no_more_where_it_is_decided(model: Model) -> None:
    k, limit = model.stability.yield_acceleration, model.limit_g()
    if math.isfinite(k):
        assert limit > k - 1e-10
        assert not model.decided or abs(limit - k) < 1e-10
    else:
        assert k > 0.0
        assert limit == math.inf


@pytest.mark.parametrize("model", TABLE_3_2[5::151], ids=str)
def test_a_block_on_springs_starts_to_move_at_the_yield(model: Model) -> None:
    k, started = model.stability.yield_acceleration, model.ramp_g()
    if k > MOST_G - 0.05:
        assert started is None
    elif k > 0.0:
        assert started == pytest.approx(k, abs=5e-3)
    else:
        assert started < 0.01
