"""Classification of a single block: failure mode, kind and model inputs, from numbers or geometry.

One block is rejected with the reason; of many, each that cannot be used keeps its own, and one that
falls at rest is known to fail. A single block loads no numpy.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

from rbfrag.errors import InputError
from rbfrag.fragility.model_selection import block_of, check_numbers
from rbfrag.question.shape_validation import (
    BOND,
    DENSITY_NOTE,
    DRAINED_NOTE,
    DRAINS_NOTHING,
    FRICTION_MISSING,
    IS_PLANE,
    IS_SHAPE,
    LEAST_M,
    NO_MODEL,
    OF_A_SHAPE,
    SHAPES,
    SIDES_AND_PLANES,
    SMALL_BLOCK,
    WAYS,
    ModeShapes,
    check_lengths,
    check_ranges,
    check_size,
    numbers_of_shape,
    shape_among,
    size_questions,
)
from rbfrag.results.diagnostic import Diagnostic
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.kinds import FREE_STANDING, KINDS, KindSpec, facts_of, kind_of_mode
from rbfrag.solver.quantity import number
from rbfrag.solver.stability.joint import ROCK_KG_M3, is_drained
from rbfrag.vocabulary.quantities import (
    BLOCK,
    COMMON,
    JOINT,
    NUMBERS,
    PLANES,
    SCATTER,
    SHAKING,
    SHAPE,
    SPACE,
    column_of,
)

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

"""Fields that say of a block what its shape would."""


class Group(NamedTuple):
    """Blocks of one kind, with the inputs of its model.

    Args:
        kind: the kind; None for what the numbers say.
        numbers: what predictions read of them, by field: numbers, or arrays.
        indices: where they stand among all blocks, shape (m,); None for all of them.
    """

    kind: str | None
    numbers: Mapping[str, Any]
    indices: NDArray[np.intp] | None = None


class InvalidBlocks(NamedTuple):
    """Blocks rejected for one reason.

    Args:
        places: where they stand among all blocks, shape (m,).
        text: the reason, with the names of values in braces.
        values: these values, numbers or arrays of shape (m,).
    """

    indices: NDArray[np.intp]
    text: str
    values: Mapping[str, Any]

    def texts(self) -> NDArray[np.object_]:
        """Return the reason for each block."""
        import numpy as np

        texts = np.empty(self.indices.size, dtype=object)
        if not self.values:
            texts[:] = self.text
            return texts
        columns = [np.broadcast_to(column, texts.shape).tolist() for column in self.values.values()]
        names = tuple(self.values)
        texts[:] = [
            self.text.format(**dict(zip(names, row, strict=True)))
            for row in zip(*columns, strict=True)
        ]
        return texts


class Blocks(NamedTuple):
    """Classified blocks: groups by kind, rejected blocks and blocks unstable at rest.

    Args:
        groups: those that a model may answer for.
        remarks: warnings about all of them.
        rejected: those that cannot be used.
        unstable: those that fall at rest.
        kinds: kind of each, a place in ``KINDS``, -1 for none; None where all are of one group.
        modes: failure mode of each, a place in :data:`MODES`, -1 where that is not known.
        read: the fields that were read.
        at_rest: why a single block fails without an earthquake; empty where it stands.
    """

    groups: tuple[Group, ...]
    remarks: tuple[Diagnostic, ...] = ()
    rejected: tuple[InvalidBlocks, ...] = ()
    unstable: tuple[InvalidBlocks, ...] = ()
    kinds: NDArray[np.int8] | None = None
    modes: NDArray[np.int8] | None = None
    read: frozenset[str] = frozenset()
    at_rest: str = ""


def has_shape(names: Collection[str]) -> bool:
    """Return whether field names describe a block by its geometry."""
    return any(name in names for name in OF_A_SHAPE)


def kinds_by_numbers(names: Collection[str]) -> list[KindSpec]:
    """Return the kinds whose parameters are all among the field names."""
    return [
        facts
        for facts in KINDS.values()
        if facts.parameters and all(name in names for name in facts.parameters)
    ]


def numbers_in(columns: Mapping[str, Any]) -> dict[str, Any]:
    """Return the model inputs of blocks, by field, from the columns of a written table."""
    return {
        name: columns[column_of(name)]
        for name in BLOCK
        if name not in OF_A_SHAPE and column_of(name) in columns
    }


def taken_as_medians(inputs: Mapping[str, Any]) -> tuple[dict[str, Any], tuple[Diagnostic, ...]]:
    """Return fields without standard deviations, and a warning where there are any.

    Args:
        inputs: fields of blocks, numbers or arrays.
    """
    sigmas = [name for name in inputs if name.endswith("_sigma")]
    ignored = [name for name in sigmas if any(_listed_numbers(inputs[name]))]
    medians = {name: value for name, value in inputs.items() if name not in sigmas}
    if not ignored:
        return medians, ()
    text = (
        f"{' and '.join(ignored)} of the blocks are not integrated here: each block is assumed to "
        "be its median (predict, survival and losses integrate)"
    )
    return medians, (Diagnostic(text, "medians_assumed", fields=tuple(ignored)),)


def _listed_numbers(value: Any) -> list[float]:
    numbers = value.ravel().tolist() if hasattr(value, "ravel") else value
    return [item for item in (numbers if isinstance(numbers, list) else [numbers]) if item == item]


FREE_NEEDS_NONE = (
    "; for a free-standing rectangular block no friction angle is required with "
    f"kind={FREE_STANDING!r}"
)


class Shape(NamedTuple):
    """Geometry of a block, and the planes that bound it.

    Args:
        block: shape and size.
        planes: keywords of :func:`rbfrag.stability`; ``phi_deg`` is missing where the friction of a
            rectangle is not known.
        is_rectangle: whether it is one.
        remarks: what is odd about its angles.
    """

    block: Block
    planes: dict[str, Any]
    is_rectangle: bool
    remarks: tuple[Diagnostic, ...] = ()

    def require_friction(self) -> Shape:
        """Return the geometry; reject a block without a friction angle."""
        if "phi_deg" in self.planes:
            return self
        stands_free = self.is_rectangle and not self.planes.get("back_fracture", True)
        text = f"{FRICTION_MISSING}{FREE_NEEDS_NONE if stands_free else ''}"
        raise InputError(text, fields=("phi_deg", "kind"))

    def rough(self) -> dict[str, Any]:
        """Return the planes; a missing friction angle is set so high that a rectangle can only
        topple.
        """
        from rbfrag.solver.stability.single import rough_deg

        return {"phi_deg": rough_deg(self.block), **self.planes}


def shape_of(inputs: Mapping[str, Any]) -> Shape | None:
    """Return the block whose geometry is given; None without a geometry.

    Args:
        inputs: fields of one block; those that are no shape and no plane are left aside.

    Raises:
        InputError: two shapes or a part of one, planes without one, a value out of its range, or a
            block without its dip or friction, unless it is a rectangle.
    """
    inputs, off_section = sectioned(inputs)
    names = shape_among(inputs)
    if names is None:
        return None
    sides = {name: number(inputs[name], name, "a number") for name in names}
    planes = {name: value for name, value in inputs.items() if name in IS_PLANE}
    plane_values = {
        name: number(planes[name], name, "a number") for name in PLANES if name in planes
    }
    issues = _ScalarIssues()
    check_ranges({**sides, **plane_values}, issues)
    check_lengths(sides, issues)
    block = getattr(Block, SHAPES[names])(*sides.values()) if names else inputs["block"]
    if not isinstance(block, Block):
        raise InputError(
            f"block = {block!r:.60}: use Block.rectangle, .from_angles, .from_fractures or "
            ".from_polygon"
        )
    is_rectangle = block.is_parallelogram and block.tan_alpha1 == -block.tan_alpha3
    if is_rectangle:
        planes.setdefault("beta_deg", 0.0)
    for name in ("beta_deg", "phi_deg"):
        if name not in planes and not is_rectangle:
            raise InputError(f"{name}{FRICTION_MISSING[7:]}", fields=(name,))
    bond = bond_of(planes)
    if planes.get("drainage") and "water_m" not in planes:
        raise InputError(DRAINS_NOTHING, fields=("drainage", "water_m"))
    wet = bond.get("water_m") and not is_drained(planes.get("drainage"))
    needed = wet or any(bond.get(name) for name in ("cohesion_pa", "jrc"))
    if needed and "density_kg_m3" not in bond:
        bond["density_kg_m3"] = ROCK_KG_M3
        issues.remarks.append(DENSITY_NOTE)
    remarks = (*off_section, *issues.remarks)
    return Shape(block, {**planes, **plane_values, **bond}, is_rectangle, remarks)


def sectioned(inputs: Mapping[str, Any]) -> tuple[Mapping[str, Any], tuple[Diagnostic, ...]]:
    """Replace planes in space by the angles of the section, with warnings about it."""
    if inputs.keys().isdisjoint(SPACE):
        return inputs, ()
    from rbfrag.question.sections import in_section

    return in_section(inputs)


def bond_of(inputs: Mapping[str, Any]) -> dict[str, Any]:
    """Return the joint properties that are given; reject values outside their range."""
    names = (*BOND, *JOINT)
    bond = {name: number(inputs[name], name, "a number") for name in names if name in inputs}
    check_ranges(bond, _ScalarIssues())
    return bond


def on_planes(inputs: Mapping[str, Any]) -> Shape:
    """Return the block whose geometry is given, with its dip and friction.

    Raises:
        InputError: as of :func:`shape_of`, no shape, or one without its friction.
    """
    shape = shape_of(inputs)
    if shape is None:
        raise InputError(f"no block is given: give {WAYS}", fields=SIDES_AND_PLANES)
    return shape.require_friction()


def without_kv(inputs: Mapping[str, Any]) -> dict[str, Any]:
    """Return the fields of a block subjected to shaking.

    Raises:
        InputError: a vertical acceleration is stated.
    """
    if inputs.get("kv", 0.0) != 0.0:
        raise InputError(
            "kv is not supported for a block subjected to shaking: the motion has the vertical "
            "acceleration; omit kv",
            fields=("kv",),
        )
    return {name: value for name, value in inputs.items() if name != "kv"}


class _FailsAtRest(Exception):
    """A single block fails without an earthquake; the text is the reason."""


class _ScalarIssues:
    """Raises the first reason to reject a single block, together with warnings about its angles."""

    def __init__(self, suspicious: Collection[str] = ()) -> None:
        self.remarks: list[Diagnostic] = []
        self._suspicious = suspicious

    def reject(self, holds: Any, text: str, *fields: str, **values: Any) -> None:
        if holds:
            text = "; ".join((text.format(**values), *self._suspicious))
            raise InputError(text, fields=(*fields, *PLANES))

    def unstable(self, holds: Any, text: str, **values: Any) -> None:
        if holds:
            raise _FailsAtRest(text.format(**values))

    def remark(self, holds: Any, text: Diagnostic, **values: Any) -> None:
        if holds:
            self.remarks.append(text.replaced(text=text.format(**values)) if values else text)


_READ = frozenset((
    *NUMBERS, "displacement_m", "restitution", *SHAPE, *PLANES, *JOINT, *SCATTER, *SHAKING, *COMMON,
))  # fmt: skip
"""Fields that shapes, models or the choice of one read."""


def read_by_some(inputs: Mapping[str, Any]) -> tuple[Mapping[str, Any], tuple[Diagnostic, ...]]:
    """Return the fields that a model or a geometry uses, and warnings about the others."""
    if inputs.keys() <= _READ:
        return inputs, ()
    from rbfrag.fragility.methods import methods

    blocks = [method.block for method in methods()]
    used_names = {*_READ, *(n for b in blocks for n in (*b.names, *b.options, *b.sigmas))}
    remarks = (
        Diagnostic(f"{name} is ignored: no model uses it", "unused_input", fields=(name,))
        for name in inputs
        if name not in used_names
    )
    return {name: value for name, value in inputs.items() if name in used_names}, tuple(remarks)


def classify_block(
    inputs: Mapping[str, Any],
    kind: str | None = None,
    pga_g: float | None = None,
    *,
    at_rest: bool = False,
) -> Blocks:
    """Classify a single block: its kind and the inputs of its model.

    Args:
        inputs: fields of it that are stated; ``block`` may be a :class:`Block`.
        kind: how it is asked to fail; None for what its shape or its numbers say.
        pga_g: PGA at which it is said whether the toe of a block that topples holds [g].
        at_rest: accept a block that fails without an earthquake; ``at_rest`` has the reason.

    Raises:
        InputError: it is described twice or in part, is of another kind than is requested, slides
            without a displacement, or no earthquake decides about it.
    """
    inputs, off_section = sectioned(without_kv(inputs))
    inputs, unread = read_by_some(inputs)
    shape = shape_of(inputs)
    if shape is None:
        block = block_of(inputs, kind)
        if kind in (None, block.kind):  # what another kind reads the choice of its model says
            check_numbers(block.kind, block, inputs)
        return Blocks((Group(kind, inputs),), (*unread, *size_questions(inputs.get("p2"))))
    from rbfrag.solver.stability.residual_strength import after_first_slip
    from rbfrag.solver.stability.single import judged, push_of

    if numbers := [name for name in NUMBERS if name in inputs]:
        raise InputError(
            f"{numbers[0]} cannot be combined with {(shape_among(inputs) or ('a geometry',))[0]}: "
            "give one description of the block",
            fields=(numbers[0], *SIDES_AND_PLANES),
        )
    options = {name: value for name, value in inputs.items() if name not in IS_SHAPE}
    displacement_m = options.pop("displacement_m", None)
    requested = requested_kind(kind, options)
    backed = shape.planes.get("back_fracture", True)
    taken = "phi_deg" not in shape.planes
    if taken and (displacement_m is not None or (requested and requested.mode != "topple")):
        shape.require_friction()
    planes = shape.rough()
    if requested is not None and requested.free_standing:
        planes["back_fracture"] = False
    before_slip = {name: planes[name] for name in planes if name != "phi_residual_deg"}
    finding, on, _ = judged(shape.block, **before_slip)
    issues = _ScalarIssues(shape.remarks)
    if finding.k > 0.0:
        planes, after = after_first_slip(shape.block, planes)
        if after:
            issues.remarks += after
            finding, on, _ = judged(shape.block, **planes)
    push = push_of(shape.block, on)
    if planes.get("water_m") and push is None:
        issues.remarks.append(DRAINED_NOTE)
    facts = requested or kind_of_mode(finding.mode, back_fracture=backed)
    judged_shape = ModeShapes(
        shape.block, finding.mode, finding.k, finding.beta_deg, finding.phi_deg,
        finding.phi_back_deg, taken, backed, bool(planes.get("cohesion_pa")),
        bool(planes.get("jrc")), push, pga_g,
    )  # fmt: skip
    limit_m = math.nan if displacement_m is None else displacement_m
    across_m = 2.0 * shape.block.r3_m
    if all(remark.code != "check_unit" for remark in shape.remarks):
        issues.remark(across_m < LEAST_M, SMALL_BLOCK, value=across_m)
        check_size(shape.block.p2, issues)
    at_rest_reason = ""
    try:
        numbers_read = numbers_of_shape(facts, judged_shape, limit_m, options, issues)
    except _FailsAtRest as reason:
        if not at_rest:
            raise InputError("; ".join((str(reason), *shape.remarks)), fields=PLANES) from None
        numbers_read, at_rest_reason = {}, str(reason)
    remarks = (*off_section, *issues.remarks, *shape.remarks, *unread)
    return Blocks((Group(facts.kind, numbers_read),), remarks, at_rest=at_rest_reason)


def requested_kind(kind: str | None, names: Collection[str]) -> KindSpec | None:
    """Return the requested kind of failure; None to decide by the failure mode."""
    if kind is None and "restitution" in names:
        return next(facts for facts in KINDS.values() if facts.free_standing)
    if kind is None:
        return None
    facts = facts_of(kind)
    if not facts.parameters:
        raise InputError(NO_MODEL.format(kind=kind))
    return facts
