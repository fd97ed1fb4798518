"""A block as people describe it: by its sides, angles, fractures or a file; what follows for it.

The command line and the service read the same options here, each in its own spelling.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

from rbfrag.errors import InputError
from rbfrag.solver.block.formulas import (
    Elementwise,
    N,
    frequency_parameter,
    shape_factor,
    tan_deg,
)
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.stability.modes import words_of_mode, yield_coefficient

if TYPE_CHECKING:
    from rbfrag.solver.kinds import KindFacts
    from rbfrag.solver.stability.single import Stability


class Form(NamedTuple):
    """A way to describe the shape of a block.

    Args:
        names: the options, all of which it needs.
        make: the constructor that takes them in this order.
    """

    names: tuple[str, ...]
    make: Callable[..., Block]


FORMS = (
    Form(("height", "width"), Block.rectangle),
    Form(("alpha1", "alpha3", "r3"), Block.from_angles),
    Form(("s1", "s2", "gamma"), Block.from_fractures),
)

TAKEN_TO_TOPPLE = (
    "no friction angle is given: the rectangle is taken to topple, backed by a slope; with phi its "
    "mode is checked"
)

NOT_BACKED = (
    "no plane backs the block: free-standing, it rocks on both corners and fails at weaker shaking "
    "than this model says; kind rocking answers for it as it stands (docs/theory/rocking.md)"
)

TAKEN_NOT_TO_SLIP = (
    "no friction angle is given: the corners of the free-standing rectangle are taken not to slip"
)


LEAST_M, MOST_M = 0.05, 60.0
"""Blocks smaller or larger than this are seldom meant: another unit may have been typed."""


@dataclass(frozen=True)
class DescribedBlock:
    """A block and what is known of its planes.

    Args:
        block: shape and size.
        conditions: keywords of :func:`rbfrag.stability`. ``phi_deg`` is missing only where a
            rectangle was given without it.
        file: the file that it was read from, or None.
        spell: how the options are called where it was described.
    """

    block: Block
    conditions: Mapping[str, Any] = field(default_factory=dict)
    file: str | None = None
    spell: Callable[[str], str] = str

    @property
    def origin(self) -> str:
        """The file for the beginning of a message, or nothing."""
        return "" if self.file is None else f"{self.file}: "

    @property
    def only_topples(self) -> bool:
        """Whether it is a rectangle of which no friction angle is known."""
        return "phi_deg" not in self.conditions

    def on_planes(self) -> tuple[Block, dict[str, Any]]:
        """Return the block and the keywords of `stability`.

        Raises:
            InputError: the friction angle is not known.
        """
        if self.only_topples:
            raise InputError(f"{self.spell('phi')} {_MISSING}")
        return self.block, dict(self.conditions)

    def without_kv(self) -> DescribedBlock:
        """Return the block as one that is to be shaken.

        Raises:
            InputError: a vertical acceleration is stated.
        """
        conditions = dict(self.conditions)
        if conditions.pop("kv", 0.0) != 0.0:
            raise InputError(
                f"{self.origin}kv does not belong in a block that is to be shaken: the vertical "
                "acceleration comes with the motion; leave the line out"
            )
        return DescribedBlock(self.block, conditions, self.file, self.spell)


_MISSING = "is missing: the mode of a block depends on dip and friction"


def describe(
    shape: Mapping[str, float | None],
    conditions: Mapping[str, Any],
    *,
    file: str | None = None,
    spell: Callable[[str], str] = str,
) -> DescribedBlock | None:
    """Return the block that options or a file describe; None where neither says anything.

    Args:
        shape: ``height``, ``width``, ``dip``; ``alpha1``, ``alpha3``, ``r3``; ``s1``, ``s2``,
            ``gamma``; what is not given is None or left out.
        conditions: keywords of :func:`rbfrag.stability` that were given, which go before those of
            the file; None for what was not.
        file: a block file instead of a shape; ``gamma`` may be given with it.
        spell: makes the option of a name, for messages.

    Raises:
        InputError: a shape that is described in two ways or in part; a base without its dip; a
            block without its friction, unless it is a rectangle.
    """
    given = {name: value for name, value in shape.items() if value is not None}
    known = {name: value for name, value in conditions.items() if value is not None}
    dip = given.pop("dip", None)
    begun = [form for form in FORMS if given.keys() & set(form.names)]
    if file is not None:
        from rbfrag.solver.block.file import read_block

        read = read_block(file, gamma_deg=given.get("gamma"))
        block, known = read.block, {**read.conditions, **known}
        is_rectangle = False
    elif not begun:
        if dip is None:
            return None
        raise InputError(f"{spell('dip')} goes with {spell('height')} and {spell('width')}")
    else:
        _refuse_part_of_a_shape(given, begun, spell)
        block = begun[0].make(*(given[name] for name in begun[0].names))
        is_rectangle = begun[0] is FORMS[0]
    if dip is not None:
        if not is_rectangle or "beta_deg" in known:
            raise InputError(
                f"{spell('dip')} does not go with {spell('beta')}: both are the dip of the base"
                if is_rectangle
                else f"{spell('dip')} goes with {spell('height')} and {spell('width')}: of other "
                f"blocks the dip of the base is {spell('beta')}"
            )
        known["beta_deg"] = dip
    elif is_rectangle:
        known.setdefault("beta_deg", 0.0)
    for name, option in (("beta_deg", "beta"), ("phi_deg", "phi")):
        if name not in known and not is_rectangle:
            where = "" if file is None else f"{file}: {name} or "
            raise InputError(f"{where}{spell(option)} {_MISSING}")
    return DescribedBlock(block, known, file, spell)


def _refuse_part_of_a_shape(
    given: Mapping[str, float], begun: list[Form], spell: Callable[[str], str]
) -> None:
    first = begun[0]
    if len(begun) > 1:
        one = next(name for name in first.names if name in given)
        other = next(name for name in begun[1].names if name in given)
        raise InputError(
            f"{spell(other)} does not go with {spell(one)}: a block is described once, by "
            + ", or by ".join(" ".join(map(spell, form.names)) for form in FORMS)
        )
    for name in first.names:
        if name not in given:
            raise InputError(
                f"{spell(name)} is missing: {', '.join(map(spell, first.names))} together are "
                "the shape of a block"
            )


def rectangle_numbers(
    height_m: N, width_m: N, dip_deg: N, functions: Elementwise[N]
) -> tuple[N, N]:
    """Return p² [1/s²] and k_r = tan(atan(width/height) - dip) of rectangles backed by a slope."""
    slenderness = width_m / height_m
    r3_m = 0.5 * height_m * functions.sqrt(1.0 + slenderness * slenderness)
    p2 = frequency_parameter(shape_factor(-slenderness, slenderness), r3_m)
    tan_dip = tan_deg(dip_deg, functions)
    # in units of the height: sin δ* and cos δ* up to a positive factor
    return p2, yield_coefficient(width_m, height_m, tan_dip, 1.0, functions)


def kind_of(described: DescribedBlock, kind: str) -> str:
    """Return how a block fails that is asked to fail in one way, backed or standing free.

    Args:
        described: the block.
        kind: how it fails where a plane backs it.
    """
    from rbfrag.solver.kinds import facts_of, kind_of_mode, stands_free_of

    model = facts_of(kind)
    backed = described.conditions.get("back_fracture", True)
    if model.mode is None or not stands_free_of(model, backed):
        return kind
    return kind_of_mode(model.mode, back_fracture=False).kind


def _instead(described: DescribedBlock, mode: str) -> str:
    """Return what to ask instead about a block of another mode."""
    spell = described.spell
    if mode == "slide":
        return f"; predict with {spell('displacement_m')} tells how likely it slides so many metres"
    if mode == "slump":
        return f"; predict with {spell('kind')} slumping tells how likely it slumps"
    return "; see  rbfrag block"


def numbers_of_kind(
    described: DescribedBlock, kind: str
) -> tuple[dict[str, float], tuple[str, ...]]:
    """Return what predictions read of a block, by name, and warnings.

    Args:
        described: the block.
        kind: how it is asked to fail.

    Raises:
        InputError: the block is of another mode, or no earthquake decides about it.
    """
    values, remarks = _numbers_and_remarks(described, kind)
    across_m = 2.0 * described.block.r3_m
    if not LEAST_M <= across_m <= MOST_M:
        remarks += (f"the block measures some {across_m:.2g} m: lengths are in m",)
    return values, remarks


def _numbers_and_remarks(
    described: DescribedBlock, kind: str
) -> tuple[dict[str, float], tuple[str, ...]]:
    from rbfrag.solver.kind import model_of_kind
    from rbfrag.solver.kinds import facts_of, stands_free_of
    from rbfrag.solver.stability.single import stability

    model = facts_of(kind)
    if not model.parameters:
        raise InputError(f"there is no fragility model of kind {kind}")
    described = described.without_kv()
    origin = described.origin
    topples = "kr" in model.parameters
    backed = described.conditions.get("back_fracture", True)
    unbacked = (NOT_BACKED,) if stands_free_of(model, backed) else ()
    # without friction a rectangle is taken to be of the model's mode, and the answer says so
    if described.only_topples and model.free_standing:
        beta_rad = math.radians(described.conditions["beta_deg"])
        values, remarks = model_of_kind(kind).numbers_of(described.block, beta_rad)
        return values, (TAKEN_NOT_TO_SLIP, *remarks)
    if described.only_topples and topples:
        return toppling_rectangle(described), (TAKEN_TO_TOPPLE, *unbacked)
    block, conditions = described.on_planes()
    if model.free_standing:
        conditions["back_fracture"] = False
    result = stability(block, **conditions)
    _refuse_other_blocks(described, result, model)
    if model.free_standing:
        if conditions.get("cohesion_pa"):
            raise InputError(f"{origin}cohesion_pa does not go with {kind}: leave it out")
        values, remarks = model_of_kind(kind).numbers_of(block, math.radians(result.beta_deg))
        return values, (*result.warnings, *remarks)
    if "ps2" in model.parameters:
        return _numbers_of_mechanism(block, kind, conditions, origin)
    values = {"p2": block.p2, "kr": result.yield_acceleration, "ky": result.yield_acceleration}
    values = {name: value for name, value in values.items() if name in model.parameters}
    if "ky" in values:
        if conditions.get("cohesion_pa"):
            raise InputError(
                f"{origin}cohesion_pa does not go with {kind}: the first slip breaks it"
            )
        values["beta_deg"] = result.beta_deg
    return values, (*result.warnings, *unbacked)


def _refuse_other_blocks(described: DescribedBlock, result: Stability, model: KindFacts) -> None:
    """Refuse a block of another mode than the model's, and one that no earthquake decides about."""
    origin, mode = described.origin, words_of_mode(result.mode)
    yields = f"(yield {result.yield_acceleration:.4g} g"
    if result.mode != model.mode:
        raise InputError(
            f"{origin}its mode is {mode} {yields}, {result.state}), and the {model.kind} model "
            f"says nothing about it{_instead(described, result.mode)}"
        )
    if result.state != "stable" or result.yield_acceleration <= 0.0:
        raise InputError(
            f"{origin}the block is {result.state} in {mode} {yields}): "
            + (
                "it fails without an earthquake"
                if result.state == "unstable"
                else "no earthquake decides about it"
            )
        )


def _numbers_of_mechanism(
    block: Block, kind: str, conditions: dict[str, Any], origin: str
) -> tuple[dict[str, float], tuple[str, ...]]:
    """Return the numbers of a block whose frequency depends on friction and dip, and warnings."""
    from rbfrag.solver.mechanism import shaken_mechanism

    for name, nothing in (("cohesion_pa", 0.0), ("back_fracture", True)):
        if conditions.pop(name, nothing) != nothing:
            raise InputError(f"{origin}{name} does not go with {kind}: leave it out")
    conditions.pop("density_kg_m3", None)
    try:
        shaken = shaken_mechanism(block, kind=kind, **conditions)
    except InputError as error:
        raise InputError(f"{origin}{error}") from None
    values = {"ks": shaken.yield_g, "ps2": shaken.p2}
    # a contact may open at some k_h, from where on the model does not hold
    if math.isfinite(shaken.leaves_g):
        values["leaves_g"] = shaken.leaves_g
    return values, shaken.remarks


def toppling_rectangle(described: DescribedBlock) -> dict[str, float]:
    """Return ``p2`` [1/s²] and ``kr`` of a rectangle that is taken to topple.

    Raises:
        InputError: it overturns at rest.
    """
    from rbfrag.solver.block.formulas import SCALAR
    from rbfrag.solver.quantity import angle

    block = described.block
    dip = tan_deg(angle(described.conditions["beta_deg"], "beta_deg", -90.0, 90.0), SCALAR)
    kr = yield_coefficient(block.tan_alpha3, 1.0, dip, 1.0, SCALAR)
    if not 0.0 < kr < math.inf:
        raise InputError(
            f"the rectangle topples at rest: its base dips by {described.conditions['beta_deg']:g} "
            f"deg, and atan(width/height) is {block.alpha3_deg:.4g} deg"
        )
    return {"p2": block.p2, "kr": kr}
