"""Validation of block geometries, and the model inputs computed from them.

One code for a single shape and for arrays: an :class:`IssueCollector` raises the first reason of a
single shape, and keeps the reason of every element of an array. A single shape loads no numpy.
"""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

from rbfrag.errors import InputError
from rbfrag.results.diagnostic import Diagnostic
from rbfrag.solver.block.formulas import SCALAR, Elementwise, array_elementwise, tan_deg
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.kinds import NOT_BACKED, KindSpec, stands_free_of
from rbfrag.solver.stability.joint import (
    ASSUMED_DENSITY,
    IS_DRAINED,
    NO_EFFECT_OF_COHESION,
    ROUGH,
    STATE_RESIDUAL,
    STAYS_UNDRAINED,
    slips_on_base,
)
from rbfrag.solver.stability.modes import (
    ModeName,
    rocking_at_rest,
    two_contacts_at_rest,
    words_of_mode,
)
from rbfrag.solver.stability.validity import (
    HEEL_TIPS,
    TOE_SLIPS,
    heel_tips_g,
    idealisations,
    toe_slips_g,
)
from rbfrag.vocabulary.quantities import (
    JOINT,
    NUMBERS,
    PLANES,
    QUANTITIES,
    SPACE,
    column_of,
    word_of,
)

if TYPE_CHECKING:
    from rbfrag.solver.block.arrays import BlockArray

RECTANGLE = ("height_m", "width_m")

SHAPES = {
    RECTANGLE: "rectangle",
    ("alpha1_deg", "alpha3_deg", "r3_m"): "from_angles",
    ("s1_m", "s2_m", "gamma_deg"): "from_fractures",
}
"""The fields that state a shape, all of which it needs, and what makes a block of them."""

WAYS = ", or by ".join(" ".join(names) for names in SHAPES)

LEAST_DEG, LEAST_DIP_DEG = 1.6, 0.8
"""Friction angles and dips below this are questioned [deg]: radians may have been meant."""

LEAST_M, MOST_M, LEAST_P2 = 0.05, 30.0, 0.1
"""Blocks smaller or larger than this, or of a smaller p², are questioned: another unit may have
been meant."""

SMALL_P2 = Diagnostic(
    "Check the unit: p² = {value:.3g} s⁻² is a block of {size:.0f} m", "check_unit"
)
SMALL_BLOCK = Diagnostic("Check the unit: the block measures {value:.2g} m", "check_unit")

LENGTHS = ("height_m", "width_m", "s1_m", "s2_m", "r3_m")

DENSITY_NOTE = Diagnostic(ASSUMED_DENSITY, "density_assumed")
DRAINED_NOTE = Diagnostic(IS_DRAINED, "drained")
_UNDRAINED_NOTE = Diagnostic(STAYS_UNDRAINED, "undrained")
_COHESION_NOTE = Diagnostic(NO_EFFECT_OF_COHESION, "cohesion_without_effect")
_STANDS_FREE = Diagnostic(NOT_BACKED, "not_backed")

DRAINS_NOTHING = (
    "drainage requires water_m, the height of the water in the back fracture: give both or neither"
)

ANGLE_MISSING = " is missing: the failure mode depends on dip and friction"
FRICTION_MISSING = f"phi_deg{ANGLE_MISSING}"

UNSTABLE_AT_REST = (
    "the block is unstable at rest in {mode} (yield {k:.4g} g): it fails without an earthquake"
)

TOPPLES_AT_REST = (
    "the block is unstable at rest: its base dips by {beta:g} deg, and the angle of its toe, of a "
    "rectangle atan(width/height), is {alpha3:.4g} deg: it fails without an earthquake"
)

NO_MODEL = "there is no fragility model of kind {kind}"

_TAKEN_TO_TOPPLE = Diagnostic(
    "no friction angle is given: the rectangle is assumed to topple, backed by a rock face; "
    "phi_deg determines the failure mode",
    "friction_not_given",
    fields=("phi_deg",),
)

TAKEN_NOT_TO_SLIP = Diagnostic(
    "no friction angle is given: the corners of the free-standing rectangle are assumed not to "
    "slip",
    "friction_not_given",
)

_INSTEAD = {
    "slide": "; use kind sliding with displacement_m",
    "slump": "; use kind slumping",
    "confined_topple": "; use kind confined_toppling",
}


STATES = UNSTABLE, LOCKED, SLIPS, NOT_UNIQUE, REJECTED = (
    "unstable", "locked", "slides", "not_unique", "rejected",
)  # fmt: skip
"""Why a block has no model inputs: it is unstable or locked at rest, slides without a displacement
limit, moves in no unique way, or is rejected for another reason."""


class IssueCollector(Protocol):
    """Collects errors and warnings about blocks."""

    def reject(
        self, holds: Any, text: str, /, *fields: str, state: str = REJECTED, **values: Any
    ) -> None:
        """Reject blocks with a reason.

        Args:
            holds: whether, or which.
            text: the reason, with the names of values in braces.
            fields: fields that each interface prints in its own spelling.
            state: which of :data:`STATES` they are in.
            values: the values, numbers or arrays.
        """

    def unstable(self, holds: Any, text: str, /, **values: Any) -> None:
        """Mark blocks that are unstable at rest; arguments as for `reject`."""

    def remark(self, holds: Any, text: Diagnostic, /, **values: Any) -> None:
        """Add a warning where a condition holds; the text may contain values."""


class ModeShapes(NamedTuple):
    """Geometries with one failure mode: numbers, or arrays of shape (m,).

    Args:
        body: the shapes.
        mode: their mode.
        k: their yields [g].
        beta_deg: dips of the bases [deg].
        phi_deg: friction angles of the bases [deg].
        phi_back_deg: those of the back planes [deg].
        taken: whether the friction is not known, and they are taken not to slide.
        backed: whether, or behind which of them, a plane is.
        bonded: whether, or which of, their bases have cohesion.
        rough: whether, or which of, their bases are rough.
        push: of water, as :class:`rbfrag.solver.stability.single.Stability` has it; zeros of dry
            ones among several.
        pga_g: PGA at which it is said whether heel or toe give way [g]; None for no such note.
    """

    body: Block | BlockArray
    mode: ModeName
    k: Any
    beta_deg: Any
    phi_deg: Any
    phi_back_deg: Any
    taken: Any
    backed: Any
    bonded: Any = False
    rough: Any = False
    push: Any = None
    pga_g: Any = None

    @property
    def wet(self) -> Any:
        """True where water exerts a force on the block."""
        if self.push is None:
            return False
        along, off, _ = self.push
        return (along != 0.0) | (off != 0.0)


def shape_among(fields: Collection[str]) -> tuple[str, ...] | None:
    """Return the fields of the geometry that is given: () for a block, None without one.

    Raises:
        InputError: two shapes, a part of one, or planes without a shape.
    """
    begun = [names for names in SHAPES if any(name in fields for name in names)]
    if "block" in fields:
        # of a file or an outline the angle of the back plane may be stated
        if sides := [name for names in begun for name in names if name in fields]:
            raise InputError(
                f"{sides[0]} cannot be combined with block: give one description of the block",
                fields=(sides[0],),
            )
        return ()
    if not begun:
        if planes := [name for name in PLANES_OF_A_SHAPE if name in fields]:
            raise InputError(
                f"{planes[0]} requires the geometry of a block: give {WAYS}",
                fields=SIDES_AND_PLANES,
            )
        return None
    first = begun[0]
    if len(begun) > 1:
        field, other = (next(name for name in names if name in fields) for names in begun[:2])
        raise InputError(
            f"{other} cannot be combined with {field}: give one description of the block, {WAYS}",
            fields=SIDES_AND_PLANES,
        )
    if missing := [name for name in first if name not in fields]:
        raise InputError(
            f"{missing[0]} is missing: {', '.join(first)} together are the geometry of a block",
            fields=first,
        )
    return first


BOND = ("cohesion_pa", "density_kg_m3")

PLANE_TEXTS = (*SPACE, "drainage")
"""Fields of planes that are words; of many blocks arrays of them."""

PLANES_OF_A_SHAPE = (*PLANES[1:], "back_fracture", "kv", *BOND, *JOINT, "drainage")
"""Fields that describe a block only together with its shape; the dip stands with numbers too."""

SIDES_AND_PLANES = (*(name for names in SHAPES for name in names), *PLANES_OF_A_SHAPE)

OF_A_SHAPE = ("block", *SPACE, *SIDES_AND_PLANES)
"""Fields that describe a block by its shape and its planes."""

IS_PLANE = frozenset({"beta_deg", *PLANES_OF_A_SHAPE})
IS_SHAPE = frozenset({"beta_deg", *OF_A_SHAPE})


def reject_parameters(fields: Collection[str], shape: tuple[str, ...]) -> None:
    """Reject the parameters of a kind in addition to a geometry, () for that of a block."""
    if numbers := [name for name in NUMBERS if name in fields]:
        raise InputError(
            f"{numbers[0]} cannot be combined with {(shape or ('a geometry',))[0]}: give one "
            "description of the block",
            fields=(numbers[0], *SIDES_AND_PLANES),
        )


def check_ranges(
    values: Mapping[str, Any], issues: IssueCollector, *, columns: bool = False
) -> None:
    """Reject values outside the ranges of their fields, and warn of unusual angles.

    Args:
        values: values by field; NaN where a friction angle or a displacement is not stated.
        issues: hears of it.
        columns: call fields as the columns of tables that are written.
    """
    for name, value in values.items():
        is_friction = name in ("phi_deg", "phi_back_deg")
        if is_friction or name == "beta_deg":
            least = LEAST_DEG if is_friction else LEAST_DIP_DEG
            small = (abs(value) > 0.0) & (abs(value) < least) & (value % 0.25 != 0.0)
            text = (
                f"{name} = {{value:g}}° is unusually small: is it in radians? Angles are in degrees"
            )
            issues.remark(small, Diagnostic(text, "check_unit", fields=(name,)), value=value)
        in_range = QUANTITIES[name].range.holds(value)
        if in_range is True:  # a single number: no text is needed
            continue
        about, unknown = QUANTITIES[name], value != value
        shown = column_of(name) if columns else name
        if not is_friction and name != "displacement_m":
            why = "is empty" if columns else "is not a number"
            level = ": enter 0 for a level base" if columns and name == "beta_deg" else ""
            issues.reject(unknown, f"{shown} {why}{level}", name)
        allowed = f"{about.range.words} {about.unit}".rstrip()
        if about.unit == "deg":
            allowed = re.sub(r"(\d+)", r"\1°", about.range.words)
        wrong = f"{shown} must be {allowed}, not {{value:.10g}}"
        issues.reject(in_range ^ True ^ unknown, wrong, name, value=value)


def check_lengths(lengths: Mapping[str, Any], issues: IssueCollector) -> None:
    """Warn of lengths that suggest centimetres.

    Args:
        lengths: values by field [m].
        issues: hears of it.
    """
    for name in LENGTHS:
        if name in lengths:
            text = Diagnostic(
                f"Check the unit: {word_of(name)} {{value:g}} m (in cm?)", "check_unit"
            )
            issues.remark(lengths[name] > MOST_M, text, value=lengths[name])


def check_size(p2: Any, issues: IssueCollector) -> None:
    """Warn of a p² [1/s²] outside the range of known blocks."""
    small = (p2 > 0.0) & (p2 < LEAST_P2)
    issues.remark(small, SMALL_P2, value=p2, size=15.0 / (p2 + (small ^ True)))


def size_questions(p2: Any, shape: tuple[int, ...] = ()) -> tuple[Diagnostic, ...]:
    """Return the warning about p² [1/s²] of blocks given by their parameters.

    Args:
        p2: a number, an array, or None.
        shape: of the answer.
    """
    rows: Any = ()
    if p2 is None or (isinstance(p2, int | float) and not 0.0 < p2 < LEAST_P2):
        return ()
    if not isinstance(p2, int | float):
        import numpy as np

        values = np.asarray(p2, dtype=np.float64)
        values = np.broadcast_to(values, shape or values.shape)  # draws have one answer
        small = np.flatnonzero((values > 0.0) & (values < LEAST_P2))
        if not small.size:
            return ()
        p2 = float(values.flat[small[0]])
        rows = small if shape else ()
    return (SMALL_P2.replaced(text=SMALL_P2.format(value=p2, size=15.0 / p2), rows=rows),)


def numbers_of_shape(
    facts: KindSpec,
    shapes: ModeShapes,
    displacement_m: Any,
    options: Mapping[str, Any],
    issues: IssueCollector,
) -> dict[str, Any]:
    """Return the model inputs of blocks with one failure mode, by field.

    Args:
        facts: the kind that answers.
        shapes: the shapes.
        displacement_m: displacements that are too far [m], NaN where none is stated.
        options: restitutions and standard deviations that are stated, by field.
        issues: hears why shapes cannot be answered for.
    """
    check_ranges({"displacement_m": displacement_m}, issues)
    k, mode = shapes.k, shapes.mode
    words: dict[str, Any] = {"k": k, "mode": words_of_mode(mode), "kind": facts.kind}
    angles = {"beta": shapes.beta_deg, "alpha1": shapes.body.alpha1_deg}
    angles["alpha3"] = shapes.body.alpha3_deg
    forward_at_rest = TOPPLES_AT_REST if mode == "topple" else UNSTABLE_AT_REST
    issues.unstable(k <= 0.0, forward_at_rest, **words, **angles)
    if facts.mode != mode:
        issues.reject(shapes.taken, FRICTION_MISSING, "phi_deg")
        issues.reject(
            True,
            "the {kind} model does not apply: the failure mode is {mode} (yield {k:.4g} g)"
            + _INSTEAD.get(mode, ""),
            "displacement_m",
            **words,
        )
        return {}
    if not facts.parameters:
        issues.reject(
            True, "there is no fragility model for its failure mode, {mode} (yield {k:.4g} g)",
            **words,
        )  # fmt: skip
        return {}
    issues.reject(
        k == math.inf, "the block is locked in {mode}: it cannot fail in this mode", state=LOCKED,
        **words,
    )  # fmt: skip
    issues.remark(shapes.wet, _UNDRAINED_NOTE)
    single = isinstance(shapes.body, Block)
    functions: Elementwise[Any] = SCALAR if single else array_elementwise()
    for holds, warning, values in idealisations(
        shapes.body, mode, k, shapes.beta_deg, shapes.phi_deg, shapes.phi_back_deg,
        False if facts.free_standing else shapes.backed, functions,
    ):  # fmt: skip
        issues.remark(holds & (shapes.taken ^ True), warning, **values)
    if mode == "topple" and not facts.free_standing:
        issues.remark(shapes.bonded, _COHESION_NOTE)
    if slips_on_base(facts):
        text = (
            "cohesion_pa cannot be combined with {kind}: cohesion is lost at the first slip, which "
            f"the model does not describe: {STATE_RESIDUAL}"
        )
        issues.reject(shapes.bonded, text, "cohesion_pa", "phi_residual_deg", **words)
        issues.reject(shapes.rough, ROUGH, "jrc", "phi_residual_deg", **words)
    if shapes.pga_g is not None and mode in ("slide", "topple") and not facts.free_standing:
        _say_what_gives_way(shapes, issues)
    if "ky" in facts.parameters:
        issues.reject(
            displacement_m != displacement_m,
            "the block slides (yield {k:.2g} g): give displacement_m, the displacement limit",
            "displacement_m",
            state=SLIPS,
            k=k,
        )
        dip_deg = dip_of_factor(shapes)
        return {"ky": k, "beta_deg": dip_deg, "displacement_m": displacement_m, **options}
    ignored = f"displacement_m is ignored: the block is of kind {facts.kind}"
    note = Diagnostic(ignored, "unused_input", fields=("displacement_m",))
    issues.remark(displacement_m == displacement_m, note)
    if facts.search_needs == "block":  # shape, friction and dip decide how it moves
        p2 = p2_at_rest(shapes, functions)
        issues.reject(
            p2 != p2,
            "the motion of a rigid block with this geometry and friction is not unique: only its "
            "yield acceleration is defined",
            state=NOT_UNIQUE,
        )
        return {**dict(zip(facts.parameters, (k, p2), strict=True)), **options}
    issues.remark(shapes.taken, TAKEN_NOT_TO_SLIP if facts.free_standing else _TAKEN_TO_TOPPLE)
    issues.remark((shapes.backed ^ True) & stands_free_of(facts, False), _STANDS_FREE)
    if not facts.free_standing:
        return {"p2": shapes.body.p2, "kr": k, **options}
    forward, backward, p2, default_restitution, least = rocking_at_rest(
        shapes.body, tan_deg(shapes.beta_deg, functions), functions
    )
    issues.unstable(forward <= 0.0, TOPPLES_AT_REST, **angles)
    issues.unstable(
        backward <= 0.0,
        "the block is unstable at rest, backward over its heel: its base dips by {beta:g} deg, and "
        "the angle of its heel is {alpha1:.4g} deg: it fails without an earthquake",
        **angles,
    )
    issues.reject(
        least <= 0.0,
        "a block rocks about a corner whose critical angle is below 90 degrees: alpha3 - beta and "
        "beta - alpha1 must be smaller",
    )
    weaker = forward <= backward
    kr = functions.where(weaker, forward, backward)
    uneven = abs(forward - backward) > 1e-6 * (1.0 + forward * backward) * abs(forward)
    for holds, sense in ((weaker, "forward"), (weaker ^ True, "backward")):
        text = (
            "the block is not symmetric about the vertical: the answer is that of the symmetric "
            f"block of its weaker sense, {sense} (conservative); respond simulates the block itself"
        )
        issues.remark(uneven & holds, Diagnostic(text, "not_symmetric"))
    restitution = options.get("restitution", default_restitution)
    restitution = functions.where(restitution == restitution, restitution, default_restitution)
    return {**options, "p2": p2, "kr": kr, "restitution": restitution}


def _say_what_gives_way(shapes: ModeShapes, issues: IssueCollector) -> None:
    """Warn of the PGA at which the heel of a slide lifts or the toe of a topple slips."""
    about, threshold_g = (
        (HEEL_TIPS, heel_tips_g) if shapes.mode == "slide" else (TOE_SLIPS, toe_slips_g)
    )
    at_g = threshold_g(shapes.body, shapes.beta_deg, shapes.phi_deg, shapes.push)
    exceeded = (shapes.pga_g > at_g) & (shapes.pga_g > shapes.k) & (shapes.taken ^ True)
    issues.remark(exceeded, about, threshold=at_g)


def dip_of_factor(shapes: ModeShapes) -> Any:
    """Return the dip [deg] for the displacement factor of sliding blocks with water.

    Models derive cos(φ - b)/cos φ from k_y and a dip b with φ = b + atan k_y. Water lessens k_y and
    leaves the factor F as it is: b = acos(cos(atan k_y)/F) - atan k_y. Where F is less than any of
    that k_y, b is that of the least, which is conservative.
    """
    if shapes.wet is False or shapes.k is None:
        return shapes.beta_deg
    trigonometry: Any = math
    functions: Elementwise[Any] = SCALAR
    if not isinstance(shapes.body, Block):
        import numpy as np

        trigonometry, functions = np, array_elementwise()
    arccos, arctan = (
        (math.acos, math.atan)
        if trigonometry is math
        else (trigonometry.arccos, trigonometry.arctan)
    )
    phi, beta = (trigonometry.radians(angle) for angle in (shapes.phi_deg, shapes.beta_deg))
    steep = functions.where(abs(shapes.k) < math.inf, arctan(shapes.k), 0.0)
    cosine = trigonometry.cos(steep) * trigonometry.cos(phi) / trigonometry.cos(phi - beta)
    dip = trigonometry.degrees(arccos(functions.where(cosine < 1.0, cosine, 1.0)) - steep)
    return functions.where(shapes.wet, dip, shapes.beta_deg)


def p2_at_rest(shapes: ModeShapes, functions: Elementwise[Any]) -> Any:
    """Return p_s² of slumps or p_ct² of confined topples [1/s²]; NaN where the motion is not
    unique.
    """
    body = shapes.body
    slumps = shapes.mode == "slump"
    trigonometry: Any = math
    if not isinstance(body, Block):
        import numpy as np

        trigonometry = np
    elif slumps and body.lowest_on_back != body.heel:
        raise InputError(
            "slumping in time requires a block whose heel lies on the back plane: this outline "
            "has no corner at the heel"
        )
    elif not body.is_parallelogram:  # its centroid does not lie between heel and toe
        from rbfrag.solver.models import model_of_mode
        from rbfrag.solver.simulation import shaken_mechanism

        p2 = shaken_mechanism(
            model_of_mode(shapes.mode), body, beta_deg=shapes.beta_deg, phi_deg=shapes.phi_deg,
            phi_back_deg=shapes.phi_back_deg,
        ).p2  # fmt: skip
        return p2 if p2 > 0.0 else math.nan
    return two_contacts_at_rest(
        body, confined=not slumps, beta_deg=shapes.beta_deg,
        phis_deg=(shapes.phi_deg, shapes.phi_back_deg), functions=functions,
        trigonometry=trigonometry,
    )  # fmt: skip
