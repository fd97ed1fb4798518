"""A block as people describe it: by its sides, angles, fractures or a file; what follows for it.

The command line and the service read the same options here, each in its own spelling.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from rbfrag.errors import InputError
from rbfrag.solver.block.formulas import tan_deg
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.stability.modes import yield_coefficient


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
