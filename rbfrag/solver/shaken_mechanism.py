"""A block's mechanism with what a search needs to know of it: its yield and its frequency."""

from __future__ import annotations

import math
from dataclasses import dataclass

from rbfrag.errors import InputError
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.integrator.one_freedom.equation import Mechanism
from rbfrag.solver.kind import BlockOnPlanes, MechanismModel
from rbfrag.solver.kinds import model_of_kind
from rbfrag.solver.stability.modes import ModeName
from rbfrag.solver.stability.single import stability

KINDS = ("slumping", "confined_toppling")
"""Kinds whose blocks are searched by scaling the record: shape, friction and dip fix their motion,
not two numbers."""


@dataclass(frozen=True, eq=False)
class ShakenMechanism:
    """A stable block that slumps, or topples confined.

    Args:
        kind: ``slumping`` or ``confined_toppling``.
        mechanism: its motion.
        yield_g: acceleration that starts it where 1 + k_v = 1 [g].
        p2: frequency parameter p_s² at rest [1/s²].
        leaves_g: k_h at which a contact opens as the motion starts [g]; infinite where none does.
        remarks: what is known about the block that an answer should say.
    """

    kind: str
    mechanism: Mechanism
    yield_g: float
    p2: float
    leaves_g: float
    remarks: tuple[str, ...]


def shaken_mechanism(
    block: Block,
    *,
    kind: str,
    beta_deg: float,
    phi_deg: float,
    phi_back_deg: float | None = None,
) -> ShakenMechanism:
    """Return the mechanism of a block whose failure mode is that of the kind.

    Args:
        block: shape and size.
        kind: one of :data:`KINDS`.
        beta_deg: dip of the base, out of the slope positive [deg].
        phi_deg: friction angle of the base [deg].
        phi_back_deg: friction angle of the back plane [deg]; None for that of the base.

    Raises:
        InputError: another kind; a block of another mode, or one that no earthquake decides about.
    """
    if kind not in KINDS:
        raise InputError(f"kind {kind!r}: records are scaled for {' and '.join(KINDS)}")
    model = model_of_kind(kind)
    assert isinstance(model, MechanismModel)
    found = stability(block, beta_deg=beta_deg, phi_deg=phi_deg, phi_back_deg=phi_back_deg)
    if found.mode != model.mode:
        raise InputError(
            f"the block is not of kind {kind}: its mode is {_words(found.mode)} (yield "
            f"{found.yield_acceleration:.4g} g, {found.state})"
        )
    if found.state != "stable" or not 0.0 < found.yield_acceleration < math.inf:
        raise InputError(
            f"the block is {found.state} in its mode, {_words(found.mode)} (yield "
            f"{found.yield_acceleration:.4g} g): no earthquake decides about it"
        )
    site = BlockOnPlanes(
        block=block,
        beta_rad=math.radians(found.beta_deg),
        phi_rad=math.radians(found.phi_deg),
        phi_back_rad=math.radians(found.phi_back_deg),
        back_fracture=True,
        cohesive=False,
        yield_g=found.yield_acceleration,
        settings={},
    )
    mechanism = model.mechanism(site)
    equation = mechanism.first.forward
    return ShakenMechanism(
        kind=kind,
        mechanism=mechanism,
        yield_g=equation.threshold(0.0),
        p2=equation.drive(0.0) / equation.inertia(0.0),
        leaves_g=_leaves_g(mechanism),
        remarks=found.warnings,
    )


def _leaves_g(mechanism: Mechanism) -> float:
    """Return the least k_h above the yield at which a contact opens at rest."""
    found = math.inf
    for condition in mechanism.first.forward.conditions:
        per_k_h, per_w = condition.per_k_h(0.0), condition.per_w(0.0)
        if per_k_h < 0.0:
            found = min(found, -per_w / per_k_h)
    return found


def _words(mode: ModeName) -> str:
    return mode.replace("_", " ")
