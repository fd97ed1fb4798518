"""Residual strength: the contributions that end with the first slip of a block, and those that
remain.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from rbfrag.errors import InputError
from rbfrag.results.diagnostic import Diagnostic
from rbfrag.solver.kinds import KindSpec, facts_of, kind_of_mode
from rbfrag.solver.stability.modes import words_of_mode

if TYPE_CHECKING:
    from rbfrag.solver.block.geometry import Block

# the fields of `joint.OnJoint`, which single numbers do not load
JOINT = ("water_m", "drainage", "jrc", "jcs_mpa", "joint_length_m", "phi_residual_deg")
"""Inputs of a joint besides bond and friction."""

ENDED = frozenset(
    {"jrc", "jcs_mpa", "joint_length_m", "phi_residual_deg", "cohesion_pa", "phi_back_deg"}
)
"""Keywords of planes that the first slip ends, or that the residual friction takes the place of."""

STATE_RESIDUAL = "give phi_residual_deg, the friction angle that is left, for the answer after it"

_ENDS = (
    " ends with the first slip (yield {k:.4g} g, {mode}), and no displacement or probability "
    f"follows from it: {STATE_RESIDUAL}"
)
ROUGH = f"jrc cannot be combined with a probability or a time history of {{kind}}: roughness{_ENDS}"

SLIPS_ON = (
    "after its first slip (yield {k:.4g} g, {mode}) the block does not stand on phi_residual_deg: "
    "it fails where the motion exceeds that yield, and no model is needed"
)

AFTER_SLIP = Diagnostic(
    "the answer is that of the block after its first slip, without bond or roughness, on "
    "phi_residual_deg; before it the yield of the block is another one (rbfrag block prints it), "
    "and a motion below that does nothing",
    "after_first_slip",
    fields=("phi_residual_deg",),
)


def slips_on_base(facts: KindSpec) -> bool:
    """Return whether blocks of a kind slip on their base; a topple turns about its toe."""
    return facts.free_standing or "p2" not in facts.parameters


def after_first_slip(
    block: Block, planes: Mapping[str, Any]
) -> tuple[dict[str, Any], tuple[Diagnostic, ...]]:
    """Return the planes after the first slip, and the warnings about them.

    Args:
        planes: keywords of `stability`, and perhaps ``phi_residual_deg``, else left as they are.

    Raises:
        InputError: no earthquake decides about the block, or it does not stand on what is left.
    """
    from rbfrag.solver.stability.single import require_stable, stability

    keywords = dict(planes)
    residual_deg = keywords.pop("phi_residual_deg", None)
    if residual_deg is None:
        return keywords, ()
    first = stability(block, **keywords)
    require_stable(first)
    remaining = {name: value for name, value in keywords.items() if name not in ENDED}
    remaining["phi_deg"] = residual_deg
    if stability(block, **remaining).yield_acceleration <= 0.0:
        finding = {"k": first.yield_acceleration, "mode": words_of_mode(first.mode)}
        raise InputError(SLIPS_ON.format(**finding), fields=("phi_residual_deg",))
    return remaining, (AFTER_SLIP,)


def reject_before_slip(block: Block, planes: Mapping[str, Any], kind: str | None) -> None:
    """Reject a simulation in time with contributions that end at the first slip.

    Args:
        planes: keywords of `stability`.
        kind: kind of the block; None for that of its mode.

    Raises:
        InputError: a base that it slips on is rough.
    """
    if not planes.get("jrc"):
        return
    from rbfrag.solver.stability.single import stability

    judged = stability(block, **planes)
    backed = planes.get("back_fracture", True)
    facts = facts_of(kind) if kind else kind_of_mode(judged.mode, back_fracture=backed)
    if slips_on_base(facts):
        finding = {"k": judged.yield_acceleration, "mode": words_of_mode(judged.mode)}
        text = ROUGH.format(kind=facts.kind, **finding)
        raise InputError(text, fields=("jrc", "phi_residual_deg"))
