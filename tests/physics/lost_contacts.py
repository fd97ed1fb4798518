"""Blocks drawn at random that lose a contact, and how far an answer is from the free block on
springs of `tests.physics.penalty`.

Its contacts take all of an impact but a twentieth of the speed: rigid bodies without rebound are
its limit but for what rigid contact leaves open.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import InputError
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.free_motion import CLIMBS
from rbfrag.solver.respond import respond
from rbfrag.solver.results import Response
from tests.physics.penalty import STEP_S, STIFFNESS, Simulated, simulate

DT_S = 0.005
DAMPING = 0.7

SORTS = ("falls on its base", "driven up its back plane", "slides and leans", "slumps")

ELASTIC_M = 2e-6
"""What springs give under the loads of a block of metres [m]."""


@dataclass(frozen=True, eq=False)
class LostContact:
    """A block that is followed past the end of its mechanism, and its answer."""

    block: Block
    beta_deg: float
    phi_deg: float
    phi_back_deg: float
    motion: GroundMotion
    answer: Response

    @property
    def sort(self) -> str:
        """Return which of `SORTS` it is."""
        if any("whole base" in text for text in self.answer.warnings):
            return SORTS[0]
        if any(change.motion == CLIMBS for change in self.answer.mode_changes):
            return SORTS[1]
        return SORTS[2] if self.answer.kind == "sliding" else SORTS[3]

    def on_springs(self, stiffness: float = STIFFNESS) -> Simulated:
        """The same block on springs, until it has rested for a while."""
        return simulate(
            self.block, beta_deg=self.beta_deg, phi_deg=self.phi_deg,
            phi_back_deg=self.phi_back_deg, time_s=self.motion.time_s,
            k_h=self.motion.acceleration_g, until_s=(self.answer.stopped_s or 0.0) + 0.4,
            damping=DAMPING, stiffness=stiffness, step_s=STEP_S * math.sqrt(STIFFNESS / stiffness),
        )  # fmt: skip

    @property
    def greatest(self) -> float:
        """Rotation [rad], of a slide displacement [m]: the peak whose error is told."""
        answer = self.answer
        slumps = answer.kind == "slumping"
        peak = answer.peak_theta_rad if slumps else answer.peak_displacement_m
        assert peak is not None
        return peak

    def differences(self, springs: Simulated) -> tuple[float, float]:
        """Greatest value and last one less those of the springs, as the error is told of them."""
        last, theirs = self.answer.displacement_m, springs.heel_m
        if self.answer.kind == "slumping":
            last, theirs = self.answer.final_theta_rad, springs.turned_rad
        assert last is not None
        return self.greatest - float(theirs.max()), last - float(theirs[-1])

    def is_covered(self, springs: Simulated, error: float) -> bool:
        """Return whether both differences are within an error and the give of the springs."""
        size = self.block.r3_m if self.answer.kind == "slumping" else 1.0
        return max(map(abs, self.differences(springs))) <= error + ELASTIC_M / size


def random_motion(random: np.random.Generator) -> GroundMotion:
    """One to four pulses of one, two or three half sines."""
    time_s = np.arange(0.0, 2.5 + 0.5 * DT_S, DT_S)
    acceleration_g: NDArray[np.float64] = np.zeros_like(time_s)
    for _ in range(random.integers(1, 5)):
        start_s, length_s = random.uniform(0.1, 1.3), random.uniform(0.1, 0.5)
        peak_g = random.uniform(0.4, 1.4) * random.choice([1.0, 1.0, -1.0])
        phase = np.pi * (time_s - start_s) / length_s
        inside = (phase >= 0.0) & (phase <= np.pi)
        acceleration_g[inside] += peak_g * np.sin(random.integers(1, 4) * phase[inside])
    return GroundMotion(acceleration_g, DT_S)


def lost_contacts(
    seed: int, motions: Iterator[GroundMotion] | None = None
) -> Iterator[LostContact]:
    """Draw blocks and motions, and yield those that lose a contact and come to rest again.

    Args:
        motions: those that shake them, one block each; None for random pulses.
    """
    random = np.random.default_rng(seed)
    while True:
        motion = random_motion(random) if motions is None else next(motions)
        alpha1, alpha3 = random.uniform(12.0, 45.0), random.uniform(50.0, 78.0)
        block = Block.from_angles(alpha1, alpha3, float(np.exp(random.uniform(-1.2, 1.1))))
        beta, phi = random.uniform(0.0, 20.0), random.uniform(25.0, 42.0)
        back = phi if random.random() < 0.6 else random.uniform(20.0, 42.0)
        try:
            answer = respond(motion, block=block, beta_deg=beta, phi_deg=phi, phi_back_deg=back)
        except InputError:  # it falls at rest, or no acceleration moves it
            continue
        if answer.kind not in ("sliding", "slumping") or not answer.mode_changes:
            continue
        # slides that stand on their base at rest are drawn by `tipping_slides`
        if answer.kind == "sliding" and alpha1 <= beta:
            continue
        if answer.displacement_m is not None:
            yield LostContact(block, beta, phi, back, motion, answer)


def tipping_slides(seed: int, motions: Iterator[GroundMotion]) -> Iterator[LostContact]:
    """Draw slides that stand on their base at rest, and yield those that pulses tip back.

    Args:
        motions: those that shake them, one block each.
    """
    random = np.random.default_rng(seed)
    while True:
        motion = next(motions)
        beta, phi = random.uniform(5.0, 25.0), random.uniform(28.0, 40.0)
        alpha1, alpha3 = random.uniform(-0.8 * phi, beta), random.uniform(50.0, 78.0)
        block = Block.from_angles(alpha1, alpha3, float(np.exp(random.uniform(-1.2, 1.1))))
        try:
            answer = respond(motion, block=block, beta_deg=beta, phi_deg=phi)
        except InputError:
            continue
        if answer.kind != "sliding" or not answer.mode_changes or answer.displacement_m is None:
            continue
        # a millimetre of slip is beyond the give of the springs
        if (answer.peak_displacement_m or 0.0) > 1e-3:
            yield LostContact(block, beta, phi, phi, motion, answer)


def of_each_sort(seed: int, counts: dict[str, int]) -> list[LostContact]:
    """Draw until there are as many as asked for of each sort."""
    remaining = dict(counts)
    drawn = []
    for item in lost_contacts(seed):
        if remaining.get(item.sort, 0):
            remaining[item.sort] -= 1
            drawn.append(item)
        if not any(remaining.values()):
            break
    return drawn
