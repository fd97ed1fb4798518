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
    ANGLE_MISSING,
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
    REJECTED,
    SHAPES,
    SIDES_AND_PLANES,
    SMALL_BLOCK,
    UNSTABLE,
    WAYS,
    IssueCollector,
    ModeShapes,
    check_lengths,
    check_ranges,
    check_size,
    numbers_of_shape,
    reject_parameters,
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
from rbfrag.vocabulary.spectral import SpectralSet

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


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
        state: which of ``STATES`` of :mod:`rbfrag.question.shape_validation` they are in.
    """

    indices: NDArray[np.intp]
    text: str
    values: Mapping[str, Any]
    state: str = REJECTED

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


_SHAPE_FIELDS = frozenset(OF_A_SHAPE)


def has_shape(names: Collection[str]) -> bool:
    """Return whether field names describe a block by its geometry."""
    return not _SHAPE_FIELDS.isdisjoint(names)


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
        text = FRICTION_MISSING
        if self.is_rectangle and not self.planes.get("back_fracture", True):
            text += (
                "; for a free-standing rectangular block no friction angle is required with "
                f"kind={FREE_STANDING!r}"
            )
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
    values = {
        name: number(inputs[name], name, "a number")
        for name in (*names, *PLANES, *BOND, *JOINT)
        if name in inputs
    }
    issues = _ScalarIssues()
    check_ranges(values, issues)
    check_lengths(values, issues)
    sides = (values[name] for name in names)
    block = getattr(Block, SHAPES[names])(*sides) if names else inputs["block"]
    if not isinstance(block, Block):
        raise InputError(
            f"block = {block!r:.60}: use Block.rectangle, .from_angles, .from_fractures or "
            ".from_polygon"
        )
    is_rectangle = block.is_parallelogram and block.tan_alpha1 == -block.tan_alpha3
    planes = {name: values.get(name, value) for name, value in inputs.items() if name in IS_PLANE}
    if is_rectangle:
        planes.setdefault("beta_deg", 0.0)
    for name in ("beta_deg", "phi_deg"):
        if name not in planes and not is_rectangle:
            raise InputError(f"{name}{ANGLE_MISSING}", fields=(name,))
    if planes.get("drainage") and "water_m" not in planes:
        raise InputError(DRAINS_NOTHING, fields=("drainage", "water_m"))
    wet = planes.get("water_m") and not is_drained(planes.get("drainage"))
    needed = wet or any(planes.get(name) for name in ("cohesion_pa", "jrc"))
    if needed and "density_kg_m3" not in planes:
        planes["density_kg_m3"] = ROCK_KG_M3
        issues.remarks.append(DENSITY_NOTE)
    return Shape(block, planes, is_rectangle, (*off_section, *issues.remarks))


def sectioned(inputs: Mapping[str, Any]) -> tuple[Mapping[str, Any], tuple[Diagnostic, ...]]:
    """Replace planes in space by the angles of the section, with warnings about it."""
    if inputs.keys().isdisjoint(SPACE):
        return inputs, ()
    from rbfrag.question.sections import in_section

    return in_section(inputs)


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


class _ScalarIssues:
    """Raises the first reason to reject a single block, together with warnings about its angles.

    Args:
        suspicious: these warnings.
        keeps_remarks: False where the warnings are not needed.
    """

    def __init__(self, suspicious: Collection[str] = (), *, keeps_remarks: bool = True) -> None:
        self.remarks: list[Diagnostic] = []
        self.state = self.reason = ""
        """Which of ``STATES`` a rejected block is in, and why, without the other warnings."""
        self._suspicious, self._keeps_remarks = suspicious, keeps_remarks

    def reject(
        self, holds: Any, text: str, /, *fields: str, state: str = REJECTED, **values: Any
    ) -> None:
        if holds:
            self.state, self.reason = state, text.format(**values)
            text = "; ".join((self.reason, *self._suspicious))
            raise InputError(text, fields=(*fields, *PLANES))

    def unstable(self, holds: Any, text: str, /, **values: Any) -> None:
        self.reject(holds, text, state=UNSTABLE, **values)

    def remark(self, holds: Any, text: Diagnostic, /, **values: Any) -> None:
        if holds and self._keeps_remarks:
            self.remarks.append(text.replaced(text=text.format(**values)) if values else text)


_READ = SpectralSet((
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
    reject_parameters(inputs, shape_among(inputs) or ())
    options = {name: value for name, value in inputs.items() if name not in IS_SHAPE}
    displacement_m = options.pop("displacement_m", None)
    requested = requested_kind(kind, options)
    taken = "phi_deg" not in shape.planes
    if taken and (displacement_m is not None or (requested and requested.mode != "topple")):
        shape.require_friction()
    issues = _ScalarIssues(shape.remarks)
    facts, judged_shape = _judge(shape, requested, pga_g, issues)
    limit_m = math.nan if displacement_m is None else displacement_m
    across_m = 2.0 * shape.block.r3_m
    if all(remark.code != "check_unit" for remark in shape.remarks):
        issues.remark(across_m < LEAST_M, SMALL_BLOCK, value=across_m)
        check_size(shape.block.p2, issues)
    at_rest_reason = ""
    try:
        numbers_read = numbers_of_shape(facts, judged_shape, limit_m, options, issues)
    except InputError:
        if issues.state != UNSTABLE or not at_rest:
            raise
        numbers_read, at_rest_reason = {}, issues.reason
    remarks = (*off_section, *issues.remarks, *shape.remarks, *unread)
    return Blocks((Group(facts.kind, numbers_read),), remarks, at_rest=at_rest_reason)


def _judge(
    shape: Shape, requested: KindSpec | None, pga_g: float | None, issues: IssueCollector
) -> tuple[KindSpec, ModeShapes]:
    """Return the kind that answers for a geometry, and the geometry with its failure mode."""
    from rbfrag.solver.stability.single import after_first_slip, assess_stability, push_of

    planes = shape.rough()
    if requested is not None and requested.free_standing:
        planes["back_fracture"] = False
    before_slip = {name: planes[name] for name in planes if name != "phi_residual_deg"}
    finding, on, _ = assess_stability(shape.block, **before_slip)
    if finding.k > 0.0 and "phi_residual_deg" in planes:
        planes, after = after_first_slip(shape.block, planes)
        for remark in after:
            issues.remark(True, remark)
        finding, on, _ = assess_stability(shape.block, **planes)
    push = push_of(shape.block, on)
    if planes.get("water_m") and push is None:
        issues.remark(True, DRAINED_NOTE)
    backed = shape.planes.get("back_fracture", True)
    return requested or kind_of_mode(finding.mode, back_fracture=backed), ModeShapes(
        shape.block, finding.mode, finding.k, finding.beta_deg, finding.phi_deg,
        finding.phi_back_deg, "phi_deg" not in shape.planes, backed,
        bool(planes.get("cohesion_pa")), bool(planes.get("jrc")), push, pga_g,
    )  # fmt: skip


def classify_draw(
    shape: Shape, requested: KindSpec | None, limit_m: float, options: Mapping[str, Any]
) -> tuple[str, str | None, dict[str, Any]]:
    """Return the state, the kind and the model inputs of a draw of an uncertain geometry.

    A draw of another mode than that of the requested kind has the kind of its own mode.
    """
    issues = _ScalarIssues(keeps_remarks=False)
    try:
        facts, judged_shape = _judge(shape, requested, None, issues)
        if facts.mode != judged_shape.mode:
            facts = kind_of_mode(
                judged_shape.mode, back_fracture=judged_shape.backed and not facts.free_standing
            )
        return "", facts.kind, numbers_of_shape(facts, judged_shape, limit_m, options, issues)
    except InputError:
        return issues.state or REJECTED, None, {}


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
