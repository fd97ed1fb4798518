"""Kinds of failure: one line of static facts each, for which no model is loaded.

What a kind does is in its model, `rbfrag/solver/models/<kind>.py`; see
:func:`rbfrag.solver.models.model_of_kind`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from rbfrag.errors import InputError

if TYPE_CHECKING:
    from rbfrag.solver.stability.modes import ModeName

PLANES = ("beta_deg", "phi_deg", "phi_back_deg", "water_m", "drainage", "density_kg_m3")
"""Options that describe the planes of a block, and the water in its back fracture."""


@dataclass(frozen=True)
class KindSpec:
    """Static facts of a kind of failure.

    Args:
        mode: failure mode of its blocks; None where no geometry chooses it.
        verb: failure of its blocks in a sentence.
        parameters: what describes its block in predictions, and in `rbfrag.respond` without a
            shape; () where no fragility is fitted.
        free_standing: whether its blocks have no plane behind them.
        settings: options of `rbfrag.respond` that it understands.
        search_needs: the option without which there is no search for a critical value; empty of
            kinds that have none.
        search_options: options of `rbfrag.critical` that it understands.
        no_search: why it has no critical value; empty where there is none yet.
    """

    kind: str
    mode: ModeName | None = None
    verb: str = "fails"
    parameters: tuple[str, ...] = ()
    free_standing: bool = False
    settings: tuple[str, ...] = ()
    search_needs: str = ""
    search_options: tuple[str, ...] = ()
    no_search: str = ""

    @property
    def searchable(self) -> bool:
        """True if the kind has a critical value."""
        return bool(self.search_needs)


_SCALED = ("block", *PLANES, "rotation_deg", "scan_ratio", "bracket")

KINDS = {
    facts.kind: facts
    for facts in (
        KindSpec(
            "confined_toppling", "confined_topple", "topples", ("kct", "pct2"), False, (), "block",
            _SCALED,
        ),
        KindSpec(
            "rocking", "topple", "overturns", ("p2", "kr"), True, ("restitution",),
            no_search="the k_r that overturn under one record form up to 122 islands, so that no "
            "value is certified as the last: compute the response of one block",
        ),
        KindSpec(
            "sliding", "slide", "slides too far", ("ky", "displacement_m"), False,
            ("two_way", "horizontal"), "displacement_m",
            ("displacement_m", "tolerance", "block", *PLANES),
        ),
        KindSpec("slumping", "slump", "slumps", ("ks", "ps2"), False, (), "block", _SCALED),
        KindSpec(
            "toppling", "topple", "topples", ("p2", "kr"), False, (),
            "p2", ("p2", "full_map", "map_depth", "block", *PLANES),
        ),
    )
}  # fmt: skip
"""All kinds by name, in alphabetical order."""


FREE_STANDING = next(facts.kind for facts in KINDS.values() if facts.free_standing)
"""The kind of blocks without a rock face behind them."""


def facts_of(kind: str) -> KindSpec:
    """Return the facts of a kind by name."""
    if kind not in KINDS:
        raise InputError(
            f"unknown kind {kind!r}: use one of {', '.join(sorted(KINDS))} "
            "(rocking is free-standing, toppling backed by a slope)"
        )
    return KINDS[kind]


def mode_of_kind(kind: str) -> str:
    """Return the failure mode of a kind's blocks; empty for no kind, or one without a mode."""
    facts = KINDS.get(kind)
    return "" if facts is None else facts.mode or ""


def kind_of_mode(mode: ModeName, *, back_fracture: bool = True) -> KindSpec:
    """Return the kind of blocks that fail in this mode.

    Args:
        mode: the failure mode.
        back_fracture: whether there is a plane behind the block, which decides where the mode has
            a kind of each sort.
    """
    of_mode = [facts for facts in KINDS.values() if facts.mode == mode]
    # False comes first: the kind that fits, or the only one there is
    return min(of_mode, key=lambda facts: facts.free_standing == back_fracture)


def stands_free_of(facts: KindSpec, back_fracture: bool) -> bool:
    """Return whether a free-standing block is used with a kind of backed blocks.

    Args:
        back_fracture: whether there is a plane behind the block.
    """
    if back_fracture or facts.free_standing or facts.mode is None:
        return False
    return kind_of_mode(facts.mode, back_fracture=False).free_standing


NOT_BACKED = (
    "no plane backs the block: free-standing, it rocks on both corners and fails at weaker shaking "
    "than this model says; kind='rocking' answers for it as it stands (docs/theory/rocking.md)"
)
"""What is said of a block that :func:`stands_free_of` is true of."""

BY_MECHANICS, FOLLOWED = "by mechanics", "followed in time"
"""How it is answered whether a block fails: without a run, and by one."""


def by_model(names: str) -> str:
    """Return the text for an answer by the models of these names."""
    return f"model {names}"
