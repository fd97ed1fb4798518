"""Confined blocks drawn at random, and the free block on springs of `tests.physics.penalty`."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from rbfrag.errors import InputError
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.respond import respond
from rbfrag.solver.results import Outcome, Response
from tests.physics.lost_contacts import DAMPING, ELASTIC_M, random_motion
from tests.physics.penalty import Simulated, simulate

FALLEN_RAD = 1.2
"""Rotation beyond which no block drawn here comes back."""


@dataclass(frozen=True, eq=False)
class ConfinedTopple:
    """A confined block that moves under a motion, and its answer."""

    block: Block
    beta_deg: float
    phi_deg: float
    phi_back_deg: float
    motion: GroundMotion
    answer: Response

    def on_springs(self) -> Simulated:
        """The same block on springs, until it has rested for a while or lies."""
        return simulate(
            self.block, beta_deg=self.beta_deg, phi_deg=self.phi_deg,
            phi_back_deg=self.phi_back_deg, time_s=self.motion.time_s,
            k_h=self.motion.acceleration_g, until_s=(self.answer.stopped_s or 3.0) + 1.0,
            damping=DAMPING,
        )  # fmt: skip

    def ends_as(self, springs: Simulated) -> bool:
        """Return whether both fall, or both do not."""
        falls = float(-springs.turned_rad.min()) > FALLEN_RAD
        return self.answer.outcome is (Outcome.TOPPLED if falls else Outcome.STABLE)

    def is_covered(self, springs: Simulated, part: float = 1.0) -> bool:
        """Return whether the peaks of a block that stays differ by a part of the error estimate."""
        peak, error = self.answer.peak_theta_rad, self.answer.error_estimate
        assert peak is not None
        assert error is not None
        give = ELASTIC_M / self.block.r3_m
        return abs(peak + float(springs.turned_rad.min())) <= part * error + give


def confined_topples(seed: int) -> Iterator[ConfinedTopple]:
    """Draw blocks and motions, and yield those that leave their first mechanism."""
    random = np.random.default_rng(seed)
    while True:
        motion = random_motion(random)
        alpha1, alpha3 = random.uniform(-65.0, -25.0), random.uniform(12.0, 28.0)
        block = Block.from_angles(alpha1, alpha3, float(np.exp(random.uniform(-1.2, 1.1))))
        beta, phi = random.uniform(0.0, 12.0), random.uniform(28.0, 40.0)
        back = phi if random.random() < 0.6 else random.uniform(20.0, 40.0)
        try:
            answer = respond(motion, block=block, beta_deg=beta, phi_deg=phi, phi_back_deg=back)
        except InputError:  # it falls at rest, or no acceleration moves it
            continue
        if answer.kind == "confined_toppling" and answer.mode_changes:
            yield ConfinedTopple(block, beta, phi, back, motion, answer)
