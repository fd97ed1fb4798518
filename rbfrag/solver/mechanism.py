"""Kinds with a mechanism of one degree of freedom: their response, and the mechanism of one block
at rest.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from rbfrag.errors import InputError
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.excitation import Excitation
from rbfrag.solver.integrator.one_freedom.equation import Mechanism
from rbfrag.solver.kind import Kind, RunEnd, Runner, Shaking, SupportedBlock
from rbfrag.solver.results import Response
from rbfrag.solver.simulation import Simulation, end_of, response_of, simulate_block
from rbfrag.solver.stability.modes import words_of_mode
from rbfrag.solver.stability.single import require_stable, stability


def driven_up_below(supported_block: SupportedBlock) -> float:
    """Return the k_h/(1 + k_v) below which the entire block slides up its back plane.

    -tan(γ + β + φ_back); minus infinity for a block that no pulse drives up it.
    """
    if supported_block.block is None or not supported_block.back_fracture:
        return -math.inf
    steepness = (
        math.radians(supported_block.block.gamma_deg)
        + supported_block.beta_rad
        + supported_block.phi_back_rad
    )
    return -math.tan(steepness) if steepness < 0.5 * math.pi else -math.inf


class MechanismKind(Kind):
    """A kind defined by a mechanism, which the engine for one degree of freedom integrates.

    Attributes:
        yield_name: symbol of its yield acceleration.
    """

    yield_name = "k"
    carries_state = True

    def mechanism(self, supported_block: SupportedBlock) -> Mechanism:
        """Return the mechanism of a block."""
        raise NotImplementedError

    def respond(self, supported_block: SupportedBlock, shaking: Shaking) -> Response:
        """Return the response of the block.

        Raises:
            InputError: the base has cohesion.
        """
        mechanism = self._without_cohesion(supported_block)
        excited = shaking.excitation
        simulation = simulate_block(
            mechanism, supported_block, excited, history=shaking.history, start=shaking.start,
            stepwise=shaking.stepwise,
        )  # fmt: skip
        return response_of(self.kind, simulation, shaking)

    def runner(self, supported_block: SupportedBlock) -> Runner:
        """Return a function that gives the end of the block's run under an excitation."""
        mechanism = self._without_cohesion(supported_block)

        def run(excited: Excitation) -> RunEnd:
            return end_of(
                simulate_block(mechanism, supported_block, excited), self.mode, mechanism.warnings
            )

        return run

    def _without_cohesion(self, supported_block: SupportedBlock) -> Mechanism:
        if supported_block.cohesive:
            raise InputError(
                f"cohesion_pa cannot be combined with {self.kind} in time: cohesion is lost at "
                "the first slip, which the model does not describe; see rbfrag block for its "
                "effect on the yield"
            )
        return self.mechanism(supported_block)


@dataclass(frozen=True, eq=False)
class ShakenMechanism:
    """A stable block with a rotational mechanism.

    Args:
        mechanism: its motion.
        yield_name: symbol of the yield acceleration.
        yield_g: acceleration that starts it where 1 + k_v = 1 [g].
        p2: frequency parameter p_s² at rest [1/s²].
        remarks: what is known about the block that an answer should say.
    """

    kind: str
    mechanism: Mechanism
    yield_name: str
    yield_g: float
    p2: float
    remarks: tuple[str, ...]
    supported_block: SupportedBlock

    def run(self, excited: Excitation, *, stepwise: bool = True) -> Simulation:
        """Simulate the block under an excitation; `stepwise` as of :func:`simulate_block`."""
        return simulate_block(self.mechanism, self.supported_block, excited, stepwise=stepwise)


def shaken_mechanism(
    model: Kind,
    block: Block,
    *,
    beta_deg: float,
    phi_deg: float,
    phi_back_deg: float | None = None,
    **water: Any,
) -> ShakenMechanism:
    """Return the mechanism of a block whose failure mode is that of the kind.

    Args:
        model: that of a kind that rotates, whose records are scaled.
        block: shape and size.
        beta_deg: dip of the base, out of the slope positive [deg].
        phi_deg: friction angle of the base [deg].
        phi_back_deg: friction angle of the back plane [deg]; None for that of the base.
        water: ``water_m``, ``drainage`` and ``density_kg_m3`` of :func:`stability`.

    Raises:
        InputError: another kind; a block of another mode, or one that no earthquake decides about.
    """
    if not isinstance(model, MechanismKind):
        raise InputError(f"records are not scaled for kind {model.kind!r}")
    judged = stability(
        block, beta_deg=beta_deg, phi_deg=phi_deg, phi_back_deg=phi_back_deg, **water
    )
    require_stable(judged)
    if judged.mode != model.mode:
        raise InputError(
            f"the block is not of kind {model.kind}: its mode is {words_of_mode(judged.mode)} "
            f"(yield {judged.yield_acceleration:.4g} g, {judged.state})"
        )
    supported_block = SupportedBlock.of(block, judged, judged.mode, {})
    mechanism = model.mechanism(supported_block)
    equation = mechanism.first.forward
    return ShakenMechanism(
        kind=model.kind,
        mechanism=mechanism,
        yield_name=model.yield_name,
        yield_g=equation.threshold(0.0),
        p2=equation.driving(0.0) / equation.inertia(0.0),
        remarks=judged.warnings,
        supported_block=supported_block,
    )
