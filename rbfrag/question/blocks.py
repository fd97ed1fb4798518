"""Blocks by numbers or by shape: how each fails, and what answers read of it.

One block is refused with the reason; of many, each that cannot be used keeps its own, and one that
falls at rest is known to fail. A single block loads no numpy.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from functools import cache
from typing import TYPE_CHECKING, Any, NamedTuple

from rbfrag.errors import InputError
from rbfrag.fragility.lookup import block_of
from rbfrag.fragility.measures import HIGHEST
from rbfrag.question.fields import BlockFields, column_of
from rbfrag.solver.block.formulas import SCALAR, tan_deg
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.described import (
    NOT_BACKED,
    TAKEN_NOT_TO_SLIP,
    TAKEN_TO_TOPPLE,
    DescribedBlock,
    toppling_rectangle,
)
from rbfrag.solver.kinds import KINDS, KindFacts, facts_of, kind_of_mode, stands_free_of
from rbfrag.solver.quantity import angle
from rbfrag.solver.stability.at_rest import rocking_at_rest, slump_at_rest
from rbfrag.solver.stability.modes import MODES, words_of_mode

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from rbfrag.solver.stability.single import Stability

SHAPES = {
    ("height_m", "width_m"): "rectangle",
    ("alpha1_deg", "alpha3_deg", "r3_m"): "from_angles",
    ("s1_m", "s2_m", "gamma_deg"): "from_fractures",
}
"""The fields that state a shape, all of which it needs, and what makes a block of them."""

RECTANGLE = ("height_m", "width_m")

NUMBERS = ("p2", "kr", "ky", "ks", "ps2", "leaves_g")
"""Fields that say of a block what its shape would."""

_PLANES = ("phi_deg", "phi_back_deg", "back_fracture", "kv", "cohesion_pa", "density_kg_m3")
OF_A_SHAPE = ("block", *(name for names in SHAPES for name in names), *_PLANES)
"""Fields that describe a block by its shape and its planes; the dip stands with numbers too."""

_IF_EMPTY = {"beta_deg": 0.0, "leaves_g": HIGHEST}
"""What an option stands for that is not stated: a level base, and a back plane never left."""

WAYS = ", or by ".join(" ".join(names) for names in SHAPES)

_RANGES = {
    **dict.fromkeys(("height_m", "width_m", "r3_m", "s1_m", "s2_m"), (0.0, math.inf, "above 0")),
    **dict.fromkeys(
        ("alpha1_deg", "alpha3_deg", "beta_deg"), (-90.0, 90.0, "between -90 and 90")
    ),
    "gamma_deg": (0.0, 180.0, "between 0 and 180"),
    **dict.fromkeys(
        ("phi_deg", "phi_back_deg"), (-math.ulp(0.0), 90.0, "from 0 to below 90")
    ),
}  # fmt: skip

FRICTION_MISSING = "phi_deg is missing: the mode of a block depends on dip and friction"

_ANGLES = ("phi_deg", "phi_back_deg")
LEAST_DEG = 1.6
"""Friction angles below this are seldom meant [deg]: it may be one in radians."""

_RADIANS = "{name} is less than a rock's: angles are in degrees, is it in radians?"

LEAST_M, MOST_M = 0.05, 60.0
"""Blocks smaller or larger than this are seldom meant: another unit may have been typed."""


class Group(NamedTuple):
    """Blocks of one kind.

    Args:
        kind: the kind; None for what the numbers say.
        numbers: what predictions read of them, by field: numbers, or arrays.
        places: where they stand among all blocks, shape (m,); None for all of them.
    """

    kind: str | None
    numbers: Mapping[str, Any]
    places: NDArray[np.intp] | None = None


class Refused(NamedTuple):
    """Blocks that cannot be used for one reason.

    Args:
        places: where they stand among all blocks, shape (m,).
        text: the reason, with the names of values in braces.
        values: these values, numbers or arrays of shape (m,).
    """

    places: NDArray[np.intp]
    text: str
    values: Mapping[str, Any]

    def texts(self) -> NDArray[np.object_]:
        """Return the reason of each."""
        import numpy as np

        texts = np.empty(self.places.size, dtype=object)
        if not self.values:
            texts[:] = self.text
            return texts
        columns = [np.broadcast_to(each, texts.shape).tolist() for each in self.values.values()]
        names = tuple(self.values)
        texts[:] = [
            self.text.format(**dict(zip(names, row, strict=True)))
            for row in zip(*columns, strict=True)
        ]
        return texts


class Blocks(NamedTuple):
    """Blocks by kind.

    Args:
        groups: those that a model may answer for.
        remarks: what is to be said of all of them.
        refused: those that cannot be used.
        unstable: those that fall at rest.
        kinds: kind of each, a place in ``KINDS``, -1 for none; None where all are of one group.
        modes: failure mode of each, a place in :data:`MODES`, -1 where that is not known.
        read: the fields that were read.
    """

    groups: tuple[Group, ...]
    remarks: tuple[str, ...] = ()
    refused: tuple[Refused, ...] = ()
    unstable: tuple[Refused, ...] = ()
    kinds: NDArray[np.int8] | None = None
    modes: NDArray[np.int8] | None = None
    read: frozenset[str] = frozenset()


def has_shape(given: Collection[str]) -> bool:
    """Return whether names of fields describe a block by its shape."""
    return any(name in given for name in OF_A_SHAPE)


def kinds_by_numbers(given: Collection[str]) -> list[KindFacts]:
    """Return the kinds of which names of fields have all numbers."""
    return [
        facts
        for facts in KINDS.values()
        if facts.parameters and all(name in given for name in facts.parameters)
    ]


def missing_number(
    given: Collection[str], kind: str | None = None
) -> tuple[str, tuple[str, ...]] | None:
    """Return the first number that a block by numbers lacks, and all of its kind; None for none.

    Args:
        given: names of the numbers.
        kind: how the block is asked to fail; None for what the numbers say.
    """
    block = block_of(given, kind)
    missing = [name for name in block.names if name not in given]
    return (missing[0], block.names) if missing and kind in (None, block.kind) else None


def refuse_foreign(given: Collection[str], kind: str | None = None) -> None:
    """Refuse numbers that a block of a kind has not.

    Args:
        given: names of the numbers.
        kind: how the block fails; None for what the numbers say.
    """
    block = block_of(given, kind)
    known = (*block.names, *block.options, *block.sigmas)
    if foreign := [name for name in given if name not in known]:
        raise InputError(
            f"{foreign[0]} does not go with kind {kind or block.kind}: leave it out",
            fields=(foreign[0],),
        )


def numbers_in(columns: Mapping[str, Any]) -> dict[str, Any]:
    """Return what answers read of blocks, by field, from columns of a table that was written."""
    return {
        name: columns[column_of(name)]
        for name in BlockFields.__optional_keys__
        if name not in OF_A_SHAPE and column_of(name) in columns
    }


def taken_as_medians(given: Mapping[str, Any]) -> tuple[dict[str, Any], tuple[str, ...]]:
    """Return fields without standard deviations, and what is said where there are any.

    Args:
        given: fields of blocks, numbers or arrays.
    """
    sigmas = [name for name in given if name.endswith("_sigma")]
    stated = [name for name in sigmas if any(_listed_numbers(given[name]))]
    others = {name: value for name, value in given.items() if name not in sigmas}
    if not stated:
        return others, ()
    return others, (
        f"{' and '.join(stated)} of the blocks are not integrated here: each block is taken as its "
        "median (predict, survival and losses integrate)",
    )


def _listed_numbers(value: Any) -> list[float]:
    numbers = value.ravel().tolist() if hasattr(value, "ravel") else value
    return [each for each in (numbers if isinstance(numbers, list) else [numbers]) if each == each]


def shape_among(given: Collection[str]) -> tuple[str, ...] | None:
    """Return the fields of the shape that is stated; None where none is.

    Raises:
        InputError: two shapes, a part of one, or planes without a shape.
    """
    begun = [names for names in SHAPES if any(name in given for name in names)]
    if "block" in given:
        # of a file or an outline the angle of the back plane may be stated
        if others := [name for names in begun for name in names if name in given]:
            raise InputError(
                f"{others[0]} does not go with block: a block is described once",
                fields=(others[0],),
            )
        return ()
    if not begun:
        if planes := [name for name in _PLANES if name in given]:
            raise InputError(
                f"{planes[0]} goes with the shape of a block, by {WAYS}",
                fields=(planes[0], *OF_A_SHAPE),
            )
        return None
    first = begun[0]
    if len(begun) > 1:
        one, other = (next(name for name in names if name in given) for names in begun[:2])
        raise InputError(
            f"{other} does not go with {one}: a block is described once, by {WAYS}",
            fields=OF_A_SHAPE,
        )
    if missing := [name for name in first if name not in given]:
        raise InputError(
            f"{missing[0]} is missing: {', '.join(first)} together are the shape of a block",
            fields=first,
        )
    return first


def one_block(given: Mapping[str, Any], kind: str | None = None) -> Blocks:
    """Return a single block as answers read it.

    Args:
        given: fields of it that are stated; ``block`` may be a :class:`Block`.
        kind: how it is asked to fail; None for what its shape or its numbers say.

    Raises:
        InputError: it is described twice or in part, is of another kind than is requested, slides
            without a displacement, or no earthquake decides about it.
    """
    shape = shape_among(given)
    if shape is None:
        return Blocks((Group(kind, given),))
    if numbers := [name for name in NUMBERS if name in given]:
        raise InputError(
            f"{numbers[0]} does not go with {shape[0] if shape else 'a shape'}: a block is "
            "described once",
            fields=(numbers[0], *shape),
        )
    others = {name: value for name, value in given.items() if name not in OF_A_SHAPE}
    planes = {name: given[name] for name in _PLANES if name in given}
    block = given["block"] if not shape else getattr(Block, SHAPES[shape])(*map(given.get, shape))
    if not isinstance(block, Block):
        raise InputError(f"block = {block!r:.60}: make one with Block.rectangle or its siblings")
    if planes.pop("kv", 0.0) != 0.0:
        raise InputError(
            "kv does not belong in a block that is to be shaken: the vertical acceleration comes "
            "with the motion; leave it out"
        )
    rectangle = shape == RECTANGLE or (not shape and _is_rectangle(block))
    if "beta_deg" not in given and not rectangle:
        raise InputError(f"beta_deg{FRICTION_MISSING[7:]}", fields=("beta_deg",))
    beta_deg = others.pop("beta_deg", 0.0)
    requested = _requested(kind, others)
    if "phi_deg" in planes:
        facts, values, remarks = _of_mode(block, beta_deg, planes, requested, others)
    elif rectangle and "displacement_m" not in others:
        facts, values, remarks = _without_friction(block, beta_deg, planes, requested)
    else:
        raise InputError(FRICTION_MISSING, fields=("phi_deg",))
    remarks += tuple(
        _RADIANS.format(name=n) for n in _ANGLES if 0.0 < given.get(n, 0.0) < LEAST_DEG
    )
    across_m = 2.0 * block.r3_m
    if not LEAST_M <= across_m <= MOST_M:
        remarks += (f"the block measures some {across_m:.2g} m: lengths are in m",)
    if others.pop("displacement_m", None) is not None and "ky" in values:
        values["displacement_m"] = given["displacement_m"]
    elif "displacement_m" in given:
        remarks += (_not_read("displacement_m", facts),)
    return Blocks((Group(facts.kind, {**values, **others}),), remarks)


def _is_rectangle(block: Block) -> bool:
    return block.is_parallelogram and block.tan_alpha1 == -block.tan_alpha3


def described_block(
    described: DescribedBlock, given: Mapping[str, Any], kind: str | None = None
) -> Blocks:
    """Return a block that options or a file describe as answers read it.

    Args:
        described: the block.
        given: what else is stated of it, by field.
        kind: how it is asked to fail; None for what it says.

    Raises:
        InputError: as of :func:`one_block`; the message names the file.
    """
    try:
        return one_block({"block": described.block, **described.conditions, **given}, kind)
    except InputError as error:
        raise InputError(f"{described.origin}{error}", fields=error.fields) from None


def toppling_block(
    described: DescribedBlock, given: Mapping[str, Any], kind: str | None = None
) -> Blocks:
    """Return a block as answers read it that know of blocks that topple or rock only.

    Args:
        described: the block.
        given: what else is stated of it, by field.
        kind: how it is asked to fail; None for toppling, or rocking where nothing backs it.

    Raises:
        InputError: as of :func:`one_block`.
    """
    backed = described.conditions.get("back_fracture", True)
    return described_block(
        described, given, kind or kind_of_mode("topple", back_fracture=backed).kind
    )


def _not_read(name: str, facts: KindFacts) -> str:
    return f"{name} is not read: the block is of kind {facts.kind}"


def _requested(kind: str | None, given: Collection[str]) -> KindFacts | None:
    """Return the kind that a question about a shape asks for; None where its mode tells."""
    if kind is None and "restitution" in given:
        return next(facts for facts in KINDS.values() if facts.free_standing)
    if kind is None:
        return None
    facts = facts_of(kind)
    if not facts.parameters:
        raise InputError(NO_MODEL.format(kind=kind))
    return facts


NO_MODEL = "there is no fragility model of kind {kind}"

OTHER_MODE = (
    "its mode is {mode} (yield {k:.4g} g), and the {kind} model says nothing about it{instead}"
)

_INSTEAD = {
    "slide": "; with displacement_m, kind sliding tells how likely it slides so many metres",
    "slump": "; kind slumping tells how likely it slumps",
}

UNSTABLE_AT_REST = (
    "the block is unstable in {mode} (yield {k:.4g} g): it fails without an earthquake"
)

LOCKED_AT_REST = "the block is locked in {mode}: no earthquake decides about it"

NO_MODEL_OF_MODE = "its mode is {mode} (yield {k:.4g} g), of which there is no fragility model"

SLIDES = "slides (yield {k:.2g} g): state displacement_m, the displacement that is too far"

COHESIVE = (
    "cohesion_pa does not go with {kind}: the first motion breaks a bond, which the model does not "
    "describe"
)


def _of_mode(
    block: Block,
    beta_deg: float,
    planes: dict[str, Any],
    requested: KindFacts | None,
    others: Mapping[str, Any],
) -> tuple[KindFacts, dict[str, float], tuple[str, ...]]:
    """Return the kind of a block by its mode, its numbers and warnings."""
    from rbfrag.solver.stability.single import stability

    backed = planes.get("back_fracture", True)
    if requested is not None and requested.free_standing:
        planes = {**planes, "back_fracture": False}
    result = stability(block, beta_deg=beta_deg, **planes)
    facts = requested or kind_of_mode(result.mode, back_fracture=backed)
    k, mode = result.yield_acceleration, words_of_mode(result.mode)
    words = {"k": k, "mode": mode, "kind": facts.kind}
    if k <= 0.0:
        raise InputError(UNSTABLE_AT_REST.format(**words))
    if facts.mode != result.mode:
        raise InputError(
            OTHER_MODE.format(**words, instead=_INSTEAD.get(result.mode, "")),
            fields=("displacement_m",),
        )
    if not facts.parameters:
        raise InputError(NO_MODEL_OF_MODE.format(**words))
    if k == math.inf:
        raise InputError(LOCKED_AT_REST.format(**words))
    if "ky" in facts.parameters and "displacement_m" not in others:
        raise InputError(f"the block {SLIDES.format(k=k)}", fields=("displacement_m",))
    bonded = bool(planes.get("cohesion_pa"))
    if bonded and (facts.free_standing or "p2" not in facts.parameters):
        raise InputError(COHESIVE.format(**words))
    warnings = result.warnings
    if facts.free_standing:
        values, remarks = _of_free_standing(block, result.beta_deg)
        return facts, values, (*warnings, *remarks)
    if "ps2" in facts.parameters:
        return facts, _of_slump(block, result), warnings
    if "ky" in facts.parameters:
        return facts, {"ky": k, "beta_deg": result.beta_deg}, warnings
    if stands_free_of(facts, backed):
        warnings += (NOT_BACKED,)
    return facts, {"p2": block.p2, "kr": k}, warnings


def _without_friction(
    block: Block, beta_deg: Any, planes: Mapping[str, Any], requested: KindFacts | None
) -> tuple[KindFacts, dict[str, float], tuple[str, ...]]:
    """Return the numbers of a rectangle that is taken to topple, or to rock without slipping."""
    backed = planes.get("back_fracture", True)
    facts = requested or kind_of_mode("topple", back_fracture=backed)
    if facts.mode != "topple":
        raise InputError(FRICTION_MISSING, fields=("phi_deg",))
    beta_deg = angle(beta_deg, "beta_deg", -90.0, 90.0)
    if facts.free_standing:
        values, remarks = _of_free_standing(block, beta_deg)
        return facts, values, (TAKEN_NOT_TO_SLIP, *remarks)
    unbacked = (NOT_BACKED,) if stands_free_of(facts, backed) else ()
    values = toppling_rectangle(DescribedBlock(block, {"beta_deg": beta_deg}))
    return facts, values, (TAKEN_TO_TOPPLE, *unbacked)


def _of_free_standing(block: Block, beta_deg: float) -> tuple[dict[str, float], tuple[str, ...]]:
    forward, backward, p2, restitution, least = rocking_at_rest(
        tan_alpha1=block.tan_alpha1, tan_alpha3=block.tan_alpha3, half_s1_m=-block.toe[1],
        inertia_m2=block.inertia_m2, tan_beta=tan_deg(beta_deg, SCALAR), functions=SCALAR,
    )  # fmt: skip
    balances = (
        ("forward over its toe", "alpha3 - beta", block.alpha3_deg - beta_deg, forward),
        ("backward over its heel", "beta - alpha1", beta_deg - block.alpha1_deg, backward),
    )
    for falls, name, balance_deg, kr in balances:
        if kr <= 0.0:
            raise InputError(
                f"the block falls {falls} at rest: {name} = {balance_deg:.6g} degrees is not above "
                "zero, and no earthquake decides about it"
            )
    if least <= 0.0:
        raise InputError(STEEP)
    values = {"p2": p2, "kr": min(forward, backward), "restitution": restitution}
    if math.isclose(math.atan(forward), math.atan(backward), rel_tol=1e-6):
        return values, ()
    sense = "forward" if forward <= backward else "backward"
    return values, (
        "the block does not stand alike on both corners: the answer is that of the symmetric block "
        f"of its weaker sense, {sense}; respond runs it as it stands",
    )


STEEP = (
    "a block rocks about a corner whose critical angle is below 90 degrees: alpha3 - beta and "
    "beta - alpha1 are to be less"
)


def _of_slump(block: Block, result: Stability) -> dict[str, float]:
    if block.lowest_on_back != block.heel:
        raise InputError(
            "slumping in time is known for blocks whose heel lies on the back plane: the corner at "
            "the heel of this outline is missing"
        )
    if block.is_parallelogram:
        ps2, leaves_g = slump_at_rest(
            alpha1_deg=block.alpha1_deg, alpha3_deg=block.alpha3_deg, gamma_deg=block.gamma_deg,
            r1_m=block.r1_m, r3_m=block.r3_m, beta_deg=result.beta_deg, phi_deg=result.phi_deg,
            phi_back_deg=result.phi_back_deg, functions=SCALAR, trigonometry=math,
        )  # fmt: skip
        values = {"ks": result.yield_acceleration, "ps2": ps2}
    else:  # its centroid does not lie between heel and toe
        from rbfrag.solver.mechanism import shaken_mechanism

        shaken = shaken_mechanism(
            block, kind=kind_of_mode(result.mode).kind, beta_deg=result.beta_deg,
            phi_deg=result.phi_deg, phi_back_deg=result.phi_back_deg,
        )  # fmt: skip
        leaves_g, values = shaken.leaves_g, {"ks": shaken.yield_g, "ps2": shaken.p2}
    # a contact may open at some k_h, from where on the model does not hold
    return {**values, "leaves_g": leaves_g} if math.isfinite(leaves_g) else values


def many_blocks(
    given: Mapping[str, NDArray[np.float64]],
    size: int,
    *,
    kinds: str | Sequence[str | None] | None = None,
    modes: Sequence[str | None] | None = None,
    rows: bool = False,
) -> Blocks:
    """Return blocks as answers read them, each with its kind.

    Args:
        given: fields that are stated, flat arrays of the number of blocks, or of one element for
            all; ``back_fracture``, a truth value, is said of all.
        size: number of blocks.
        kinds: how they are asked to fail, one kind for all or one each; None or an empty text for
            what shape, mode or numbers say.
        modes: failure modes that are stated, empty for none.
        rows: they are rows of a table, which may state more than is needed: numbers go before a
            shape, and what is empty is not stated.

    Raises:
        InputError: they are described twice or in part.
    """
    return _Sorted(given, size, rows).blocks(kinds, modes)


class _Sorted:
    """Many blocks while they are sorted by kind."""

    def __init__(self, given: Mapping[str, Any], size: int, rows: bool) -> None:
        import numpy as np

        self.np, self.size, self.rows = np, size, rows
        self.backed = bool(given.get("back_fracture", True))
        self.given = {name: value for name, value in given.items() if name != "back_fracture"}
        self.groups: list[Group] = []
        self.refused: list[Refused] = []
        self.unstable: list[Refused] = []
        self.free = np.ones(size, dtype=np.bool_)
        """Which blocks no reason is known against."""
        self.done = np.zeros(size, dtype=np.bool_)
        """Which blocks are sorted."""
        self.kinds = np.full(size, -1, dtype=np.int8)
        self.modes = np.full(size, -1, dtype=np.int8)
        self.remarks: dict[str, None] = {}
        self.read: set[str] = set()

    def blocks(
        self, kinds: str | Sequence[str | None] | None, modes: Sequence[str | None] | None
    ) -> Blocks:
        np = self.np
        self._state(kinds, modes)
        shapes = self._shapes()
        self._state_free(shapes)
        left = ~self._complete()
        for shape in shapes:
            own = left & self._known(shape)
            left &= ~own
            if own.any():
                self._sort_shapes(shape, np.flatnonzero(own))
            self.done |= own
        if shapes:  # of which part of a shape is empty, and no number is stated either
            own = left & ~self._known_any(NUMBERS)
            if own.any():
                self._sort_shapes(shapes[0], np.flatnonzero(own))
            self.done |= own
        if not self.done.all():
            self._sort_numbers(np.flatnonzero(~self.done))
        return Blocks(
            tuple(self.groups), tuple(self.remarks), tuple(self.refused),
            tuple(self.unstable), self.kinds, self.modes,
            frozenset(self.read),
        )  # fmt: skip

    def _state(
        self, kinds: str | Sequence[str | None] | None, modes: Sequence[str | None] | None
    ) -> None:
        """Enter the kinds that are asked for, one each or by the mode that is stated."""
        np = self.np
        if isinstance(kinds, str):
            self.kinds[:] = _codes()[facts_of(kinds).kind]
            kinds = None
        if kinds is None and modes is None:
            return
        nothing = [""] * self.size
        whys: dict[tuple[str, str, int], list[int]] = {}
        pairs = zip(kinds or nothing, modes or nothing, self.kinds.tolist(), strict=True)
        for i, (kind, mode, code) in enumerate(pairs):
            pair = (str(kind or "").strip(), str(mode or "").strip(), code)
            whys.setdefault(pair, []).append(i)
        for (kind, mode, code), places in whys.items():
            here = np.array(places)
            if kind and kind not in KINDS:
                text = f"kind = {kind[:40]!r} is none of {', '.join(KINDS)}"
                self.refuse(here, text.replace("{", "{{").replace("}", "}}"))
                continue
            if kind:
                code = _codes()[kind]
            elif code < 0 and mode in MODES:
                code = _codes()[kind_of_mode(mode, back_fracture=self.backed).kind]
            self.kinds[here] = code
            if mode in MODES:
                self.modes[here] = MODES.index(mode)
            own = None if code < 0 else tuple(KINDS.values())[code]
            if mode and (own is None or own.mode != mode):
                shown = words_of_mode(mode[:40]).replace("{", "{{").replace("}", "}}")
                model = "any" if own is None else f"the {own.kind}"
                self.refuse(
                    here, f"the block's mode is {shown}: {model} model says nothing about it"
                )

    def _state_free(self, shapes: Sequence[tuple[str, ...]]) -> None:
        """Enter that blocks stand free of which a restitution is stated."""
        restitution = self.given.get("restitution")
        if restitution is None or not (shapes or {"p2", "kr"} & self.given.keys()):
            return
        facts = _requested(None, ("restitution",))
        assert facts is not None
        stated = ~self.np.isnan(restitution) if self.rows else True
        self.kinds[(self.kinds < 0) & stated] = _codes()[facts.kind]

    def _shapes(self) -> list[tuple[str, ...]]:
        """Return the shape that is stated; of a table those that its rows may have."""
        if self.rows:
            whole = [names for names in SHAPES if all(name in self.given for name in names)]
            begun = any(name in self.given for names in SHAPES for name in names)
            if begun and not whole and not kinds_by_numbers(self.given):
                shape_among(self.given)
            return whole
        shape = shape_among({*self.given, *(() if self.backed else ("back_fracture",))})
        if shape is not None and (numbers := [name for name in NUMBERS if name in self.given]):
            raise InputError(
                f"{numbers[0]} does not go with {shape[0]}: a block is described once",
                fields=(numbers[0], *shape),
            )
        return [] if shape is None else [shape]

    def _complete(self) -> Any:
        """Return which blocks have all numbers of a kind."""
        complete = self.np.zeros(self.size, dtype=self.np.bool_)
        for facts in kinds_by_numbers(self.given):
            complete |= self._known(facts.parameters)
        return complete

    def _stated(self, name: str) -> Any:
        """Return the values of a field; what an empty cell of a table stands for."""
        values = self.given[name]
        if self.rows and name in _IF_EMPTY:
            return self.np.where(self.np.isnan(values), _IF_EMPTY[name], values)
        return values

    def _known_any(self, names: Collection[str]) -> Any:
        known = self.np.zeros(self.size, dtype=self.np.bool_)
        for name in names:
            if name in self.given:
                known |= ~self.np.isnan(self.given[name])
        return known

    def _known(self, names: Collection[str]) -> Any:
        known = self.np.ones(self.size, dtype=self.np.bool_)
        for name in names:
            known &= ~self.np.isnan(self.given[name])
        return known

    def _sort_numbers(self, places: Any) -> None:
        """Sort blocks that are given by numbers."""
        np = self.np
        # a restitution has told already
        names = [name for name in self.given if not name.startswith("restitution")]
        if (self.kinds < 0).any():
            for facts in kinds_by_numbers(names):
                kind = block_of([name for name in names if name in _numbers_of(facts)]).kind
                here = (self.kinds < 0) & self._known(facts.parameters)
                self.kinds[here] = _codes()[kind]
            self.kinds[self.kinds < 0] = _codes()[block_of(names).kind]
        of_these = self.kinds[places]
        for code in np.unique(of_these[self.free[places]]).tolist():
            facts = tuple(KINDS.values())[code]
            here = places[(of_these == code) & self.free[places]]
            if not facts.parameters:
                self.refuse(here, NO_MODEL, kind=facts.kind)
                continue
            self.modes[here] = MODES.index(facts.mode) if facts.mode else -1
            missing = [name for name in facts.parameters if name not in self.given]
            if missing:
                whole = " and ".join(facts.parameters)
                self.refuse(
                    here,
                    f"the block's mode is {words_of_mode(facts.mode or '')}, and {missing[0]} is "
                    f"missing: a block of kind {facts.kind} is given by {whole}",
                )
                continue
            numbers = {
                name: self._stated(name) for name in _numbers_of(facts) if name in self.given
            }
            self.read |= numbers.keys()
            self.group(facts, here, {name: _at(value, here) for name, value in numbers.items()})

    def _sort_shapes(self, shape: tuple[str, ...], places: Any) -> None:
        """Sort blocks that are given by their shape."""
        np = self.np
        planes = [name for name in ("beta_deg", "phi_deg", "phi_back_deg") if name in self.given]
        self.read |= {*shape, *planes}
        stated = {name: _at(self.given[name], places) for name in (*shape, *planes)}
        rectangles = shape == RECTANGLE
        if not rectangles:
            for name in ("beta_deg", "phi_deg"):
                if name not in stated:
                    raise InputError(f"{name}{FRICTION_MISSING[7:]}", fields=(name,))
        stated.setdefault("beta_deg", np.zeros(1))
        stated.setdefault("phi_deg", np.full(1, np.nan))
        stated.setdefault("phi_back_deg", np.full(1, np.nan))
        may_be_empty = {"phi_back_deg", *(("phi_deg",) if rectangles else ())}
        if rectangles and self.rows:
            stated["beta_deg"] = np.where(np.isnan(stated["beta_deg"]), 0.0, stated["beta_deg"])
        for name, values in stated.items():
            low, high, wanted = _RANGES[name]
            wrong = ~((values > low) & (values < high))
            if name in may_be_empty:
                wrong &= ~np.isnan(values)
            if wrong.any():
                wrong, values = (np.broadcast_to(each, places.shape) for each in (wrong, values))
                empty = wrong & np.isnan(values)
                name = column_of(name) if self.rows else name
                self.refuse(places[empty], f"{name} is empty")
                wrong = wrong & ~empty
                self.refuse(
                    places[wrong], name + " = {value:g} is not " + wanted, value=values[wrong]
                )
        standing = [facts.free_standing for facts in KINDS.values()]
        is_free = np.array([*standing, not self.backed])[self.kinds[places]]
        for free_standing in (False, True):
            own = np.flatnonzero((is_free == free_standing) & self.free[places])
            if own.size:
                values = {name: _at(value, own) for name, value in stated.items()}
                self._sort_standing(shape, places[own], values, free_standing)

    def _sort_standing(
        self, shape: tuple[str, ...], places: Any, stated: dict[str, Any], free_standing: bool
    ) -> None:
        """Sort shapes that all are backed, or all stand free."""
        from rbfrag.solver.block.arrays import REASONS, BlockArray
        from rbfrag.solver.stability.arrays import stability_arrays

        np, n = self.np, places.size
        blocks = getattr(BlockArray, SHAPES[shape])(*(stated[name] for name in shape))
        phi, back = stated["phi_deg"], stated["phi_back_deg"]
        taken = np.broadcast_to(np.isnan(phi), (n,))
        # a friction angle that leaves a rectangle no choice: between that of its toe and 90°
        phi = np.where(np.isnan(phi), 0.5 * (blocks.alpha3_deg + 90.0), phi)
        back = np.where(np.isnan(back), phi, back)
        judged = stability_arrays(
            blocks, beta_deg=stated["beta_deg"], phi_deg=phi, phi_back_deg=back,
            back_fracture=not free_standing,
        )  # fmt: skip
        codes, k = (
            np.broadcast_to(each, (n,)) for each in (judged.mode_code, judged.yield_acceleration)
        )
        reasons = np.broadcast_to(judged.reason_code, (n,))
        for code in np.unique(reasons[reasons > 0]).tolist():
            self.refuse(places[reasons == code], REASONS[code])
        self.modes[places] = np.where(reasons == 0, codes, -1)
        for name in _ANGLES:
            if ((stated[name] > 0.0) & (stated[name] < LEAST_DEG)).any():
                self.remarks[_RADIANS.format(name=name)] = None
        across_m = 2.0 * np.broadcast_to(blocks.r3_m, (n,))
        unusual = int(np.count_nonzero((across_m < LEAST_M) | (across_m > MOST_M)))
        if unusual:
            self.remarks[
                f"{unusual:,} of {n:,} blocks measure less than {LEAST_M:g} m or more than "
                f"{MOST_M:g} m: lengths are in m"
            ] = None
        displacement = self.given.get("displacement_m")
        if displacement is not None:
            self.read.add("displacement_m")
            displacement = np.broadcast_to(_at(displacement, places), (n,))
            unsaid = taken & ~np.isnan(displacement)
            self.refuse(places[unsaid], FRICTION_MISSING)
        requested = self.kinds[places]
        for code in np.unique(codes[reasons == 0]).tolist():
            of_mode = (codes == code) & (reasons == 0)
            for kind_code in np.unique(requested[of_mode]).tolist():
                here = np.flatnonzero(of_mode & (requested == kind_code) & self.free[places])
                if not here.size:
                    continue
                facts = (
                    kind_of_mode(MODES[code], back_fracture=not free_standing)
                    if kind_code < 0
                    else tuple(KINDS.values())[kind_code]
                )
                self.kinds[places[here]] = _codes()[facts.kind]
                self._sort_mode(
                    facts,
                    code,
                    here,
                    _Judged(places, blocks, stated, k, taken, displacement, phi, back),
                )

    def _sort_mode(self, facts: KindFacts, code: int, here: Any, judged: _Judged) -> None:
        """Sort shapes of one mode that are asked to fail in one way."""
        np = self.np
        k, places = judged.k[here], judged.places[here]
        mode = MODES[code]
        words: dict[str, Any] = {"mode": words_of_mode(mode), "kind": facts.kind}
        falls = k <= 0.0
        if falls.any():
            at_rest = {**words, "k": k[falls]}
            self.unstable.append(Refused(places[falls], UNSTABLE_AT_REST, at_rest))
            self.free[places[falls]] = False
        if facts.mode != mode:
            instead = _INSTEAD.get(mode, "")
            # what nobody knows the friction of is not known to topple
            taken = judged.taken[here]
            self.refuse(places[taken], FRICTION_MISSING)
            self.refuse(places, OTHER_MODE, k=k, **words, instead=instead)
            return
        if not facts.parameters:
            self.refuse(places, NO_MODEL_OF_MODE, k=k, **words)
            return
        self.refuse(places[k == np.inf], LOCKED_AT_REST, **words)
        if "ky" in facts.parameters:
            lacks = (
                np.ones(k.shape, dtype=np.bool_)
                if judged.displacement is None
                else np.isnan(judged.displacement[here])
            )
            self.refuse(places[lacks], SLIDES, k=k[lacks])
        if facts.mode == "topple" and judged.taken[here].any():
            self.remarks[TAKEN_NOT_TO_SLIP if facts.free_standing else TAKEN_TO_TOPPLE] = None
        if stands_free_of(facts, self.backed):
            self.remarks[NOT_BACKED] = None
        here = here[self.free[places]]
        if here.size:
            self.group(facts, judged.places[here], self._numbers(facts, here, judged))

    def _numbers(self, facts: KindFacts, here: Any, judged: _Judged) -> dict[str, Any]:
        """Return what predictions read of shapes of one kind."""
        from rbfrag.solver.block.formulas import array_elementwise

        np, k, places = self.np, judged.k[here], judged.places[here]
        sigmas = {
            name: _at(self.given[name], places)
            for name in _numbers_of(facts)
            if name.endswith("_sigma") and name in self.given
        }
        self.read |= sigmas.keys()
        t1, t3, h = (
            _at(each, here)
            for each in (
                judged.blocks.tan_alpha1,
                judged.blocks.tan_alpha3,
                judged.blocks.half_s1_m,
            )
        )
        beta_deg = _at(judged.stated["beta_deg"], here)
        if "ky" in facts.parameters:
            return {
                "ky": k,
                "beta_deg": beta_deg,
                "displacement_m": judged.displacement[here],
                **sigmas,
            }
        if "ps2" in facts.parameters:
            with np.errstate(all="ignore"):
                ps2, leaves_g = slump_at_rest(
                    alpha1_deg=np.degrees(np.arctan(t1)), alpha3_deg=np.degrees(np.arctan(t3)),
                    gamma_deg=np.degrees(np.arctan2(1.0, 0.5 * (t1 + t3))),
                    r1_m=h * np.sqrt(1.0 + t1 * t1), r3_m=h * np.sqrt(1.0 + t3 * t3),
                    beta_deg=beta_deg, phi_deg=_at(judged.phi, here),
                    phi_back_deg=_at(judged.back, here),
                    functions=array_elementwise(), trigonometry=np,
                )  # fmt: skip
            leaves_g = np.minimum(leaves_g, HIGHEST)
            return {"ks": k, "ps2": ps2, "leaves_g": leaves_g, **sigmas}
        if not facts.free_standing:
            return {"p2": _at(judged.blocks.p2, here), "kr": k, **sigmas}
        with np.errstate(all="ignore"):
            forward, backward, p2, own, least = rocking_at_rest(
                tan_alpha1=t1, tan_alpha3=t3, half_s1_m=h,
                inertia_m2=h * h * (2.0 + t1 * t1 + t3 * t3) / 6.0,
                tan_beta=tan_deg(beta_deg, array_elementwise()), functions=array_elementwise(),
            )  # fmt: skip
        self.refuse(places[np.broadcast_to(least <= 0.0, places.shape)], STEEP)
        restitution = own
        if "restitution" in self.given:
            self.read.add("restitution")
            stated = _at(self.given["restitution"], places)
            restitution = np.where(np.isnan(stated), own, stated)
        return {"p2": p2, "kr": np.minimum(forward, backward), "restitution": restitution, **sigmas}

    def refuse(self, places: Any, text: str, **values: Any) -> None:
        """Keep why blocks cannot be used, of those that no reason is known against."""
        if not places.size:
            return
        usable = self.free[places]
        if not usable.any():
            return
        self.free[places] = False
        own = {
            name: value[usable] if hasattr(value, "shape") and value.shape else value
            for name, value in values.items()
        }
        self.refused.append(Refused(places[usable], text, own))

    def group(self, facts: KindFacts, places: Any, numbers: Mapping[str, Any]) -> None:
        """Keep blocks of one kind, of those that no reason is known against."""
        usable = self.free[places]
        if not usable.any():
            return
        if not usable.all():
            chosen = self.np.flatnonzero(usable)
            numbers = {name: _at(value, chosen) for name, value in numbers.items()}
            places = places[chosen]
        self.groups.append(Group(facts.kind, numbers, places))


class _Judged(NamedTuple):
    """Shapes of which the mode is known; arrays of shape (n,), or of one element.

    Args:
        places: where they stand among all blocks.
        blocks: their shapes.
        stated: their fields.
        k: yields [g].
        taken: which have no friction angle, and are taken to topple.
        displacement: displacements that are too far [m]; None where none is stated.
        phi: friction angles [deg].
        back: those of the back planes [deg].
    """

    places: Any
    blocks: Any
    stated: Mapping[str, Any]
    k: Any
    taken: Any
    displacement: Any
    phi: Any
    back: Any


def _at(values: Any, places: Any) -> Any:
    """Return the values of some places; one that holds for all stays one."""
    return values if values.size == 1 else values[places]


@cache
def _codes() -> dict[str, int]:
    return {kind: code for code, kind in enumerate(KINDS)}


@cache
def _numbers_of(facts: KindFacts) -> tuple[str, ...]:
    """Return what a model of a kind reads of a block."""
    block = block_of(facts.parameters, facts.kind)
    return (*block.names, *block.options, *block.sigmas)
