"""Many blocks, by numbers or by shape: how each fails, and what answers read of it.

Each block that cannot be used keeps its reason, and one that fails at rest is known to fail.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import InputError
from rbfrag.fragility.lookup import block_of
from rbfrag.question.blocks import (
    Blocks,
    Group,
    Refused,
    kinds_by_numbers,
    read_by_some,
    requested_kind,
)
from rbfrag.question.shapes import (
    BOND,
    DENSITY_NOTE,
    DRAINED_NOTE,
    DRAINS_NOTHING,
    FRICTION_MISSING,
    LEAST_M,
    LENGTHS,
    MOST_M,
    NO_MODEL,
    RECTANGLE,
    SHAPES,
    SMALL_BLOCK,
    UNSTABLE_AT_REST,
    ModeShapes,
    check_lengths,
    check_ranges,
    check_size,
    numbers_of_shape,
    shape_among,
)
from rbfrag.results.diagnostic import Diagnostic
from rbfrag.solver.block.arrays import REASONS, BlockArray
from rbfrag.solver.block.formulas import array_elementwise, cot_gamma, tan_deg
from rbfrag.solver.kinds import KINDS, KindSpec, facts_of, kind_of_mode
from rbfrag.solver.stability.arrays import stability_arrays
from rbfrag.solver.stability.joint import (
    DRAINAGES,
    DRAINED,
    NO_DRAINAGE,
    NO_FRACTURE,
    ROCK_KG_M3,
    UNDRAINED,
    water_at,
)
from rbfrag.solver.stability.modes import MODES, words_of_mode
from rbfrag.solver.stability.residual_strength import AFTER_SLIP, ENDED, SLIPS_ON
from rbfrag.vocabulary.quantities import JOINT, NUMBERS, PLANES, SPACE

_IF_EMPTY = {"beta_deg": 0.0}
"""What an empty cell stands for beside the numbers of a block: a level base."""

_FACTS = tuple(KINDS.values())

Places = NDArray[np.intp]


def many_blocks(
    given: Mapping[str, NDArray[np.float64]],
    size: int,
    *,
    kinds: str | Sequence[str | None] | None = None,
    modes: Sequence[str | None] | None = None,
    rows: bool = False,
    pga_g: NDArray[np.float64] | None = None,
) -> Blocks:
    """Return blocks as answers read them, each with its kind.

    Args:
        given: fields that are stated, flat arrays of the number of blocks, or of one element for
            all; ``back_fracture`` is 0 where there is none.
        size: number of blocks.
        kinds: how they are asked to fail, one kind for all or one each; None or an empty text for
            what shape, mode or numbers say.
        modes: failure modes that are stated, empty for none.
        rows: they are rows of a table, which may state more than is needed: numbers go before a
            shape, and what is empty is not stated.
        pga_g: PGA at which it is said whether heels or toes give way [g], of the number of blocks
            or of one element; None for no such note.

    Raises:
        InputError: they are described twice or in part.
    """
    planes = given.keys() & set(SPACE)
    wrong: Mapping[int, str] = {}
    notes: tuple[Diagnostic, ...] = ()
    if planes:
        from rbfrag.question.sections import in_sections

        given, wrong, notes = in_sections(given, size)
    known, unread = (given, ()) if rows else read_by_some(given)
    sorting = _Sorted(known, size, rows, pga_g)
    for place, why in wrong.items():
        _Some(sorting, np.array([place])).refuse(True, "{why}", why=why)
    sorting.state_drainage()
    blocks = sorting.blocks(kinds, modes)
    blocks = blocks._replace(remarks=(*notes, *blocks.remarks), read=blocks.read | planes)
    if rows:
        return blocks
    others = given.keys() - known.keys()
    return blocks._replace(remarks=(*blocks.remarks, *unread), read=blocks.read | others)


class _Some:
    """Keeps why some of many blocks cannot be used, of those that no reason is known against."""

    def __init__(self, whole: _Sorted, places: Places) -> None:
        self.whole, self.places = whole, places

    def refuse(self, holds: Any, text: str, *_fields: str, **values: Any) -> None:
        # the row, or the element, is the subject of its reason
        self._keep(self.whole.refused, holds, text.removeprefix("the block "), values)

    def unstable(self, holds: Any, text: str, **values: Any) -> None:
        self._keep(self.whole.unstable, holds, text, values)

    def remark(self, holds: Any, text: Diagnostic, **values: Any) -> None:
        rows = np.flatnonzero(np.broadcast_to(holds, self.places.shape) & self._free())
        if not rows.size:
            return
        first = {n: np.broadcast_to(v, self.places.shape)[rows[0]] for n, v in values.items()}
        example = text.format(**first) if values else str(text)
        self.whole.remarks.setdefault(text, (example, []))[1].append(self.places[rows])

    def _free(self) -> NDArray[np.bool_]:
        return self.whole.free[self.places]

    def _keep(self, reasons: list[Refused], holds: Any, text: str, values: dict[str, Any]) -> None:
        here = np.flatnonzero(holds & self.whole.free[self.places])
        if here.size:
            self.whole.free[self.places[here]] = False
            own = {n: _at(v, here) if isinstance(v, np.ndarray) else v for n, v in values.items()}
            reasons.append(Refused(self.places[here], text, own))


class _Sorted:
    """Many blocks while they are sorted by kind."""

    def __init__(self, given: Mapping[str, Any], size: int, rows: bool, pga_g: Any) -> None:
        self.size, self.rows, self.pga_g = size, rows, pga_g
        backed = np.asarray(given.get("back_fracture", 1.0), dtype=np.float64)
        self.backed = np.broadcast_to(backed != 0.0, (size,))
        """Behind which blocks a plane is; where that is not given, one is."""
        words = np.ravel(np.array(given.get("drainage", UNDRAINED), dtype=object)).tolist()
        stated = np.array([word or UNDRAINED for word in words], dtype=object)
        self.drainage: NDArray[np.object_] = np.broadcast_to(stated, size)
        """What the water behind each block does while it moves; an empty word means undrained."""
        others = ("back_fracture", "drainage")
        self.given = {name: value for name, value in given.items() if name not in others}
        self.groups: list[Group] = []
        self.refused: list[Refused] = []
        self.unstable: list[Refused] = []
        self.free = np.ones(size, dtype=np.bool_)
        """Which blocks no reason is known against."""
        self.done = np.zeros(size, dtype=np.bool_)
        """Which blocks are sorted."""
        self.kinds = np.full(size, -1, dtype=np.int8)
        self.modes = np.full(size, -1, dtype=np.int8)
        self.remarks: dict[Diagnostic, tuple[str, list[Places]]] = {}
        """Warnings, each with its text for the first row of it and its rows."""
        self.read: set[str] = set()

    def blocks(
        self, kinds: str | Sequence[str | None] | None, modes: Sequence[str | None] | None
    ) -> Blocks:
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
            tuple(self.groups),
            tuple(_about_rows(warning, *rows) for warning, rows in self.remarks.items()),
            tuple(self.refused),
            tuple(self.unstable), self.kinds, self.modes,
            frozenset(self.read),
        )  # fmt: skip

    def state_drainage(self) -> None:
        """Reject words that are no drainage, and those of blocks without water."""
        listener = _Some(self, np.arange(self.size))
        for word in dict.fromkeys(self.drainage.tolist()):
            if word not in DRAINAGES:
                why = NO_DRAINAGE.format(f"{word}"[:40])
                listener.refuse(self.drainage == word, "{why}", "drainage", why=why)
        if "water_m" not in self.given and (self.drainage == DRAINED).any():
            raise InputError(DRAINS_NOTHING, fields=("drainage", "water_m"))

    def _state(
        self, kinds: str | Sequence[str | None] | None, modes: Sequence[str | None] | None
    ) -> None:
        """Enter the kinds that are asked for, one each or by the mode that is stated."""
        if isinstance(kinds, str):
            self.kinds[:] = _codes()[facts_of(kinds).kind]
            kinds = None
        if kinds is None and modes is None:
            return
        nothing = [""] * self.size
        whys: dict[tuple[str, str, int, bool], list[int]] = {}
        rows = zip(
            kinds or nothing, modes or nothing, self.kinds.tolist(), self.backed.tolist(),
            strict=True,
        )  # fmt: skip
        for i, (kind, mode, code, backed) in enumerate(rows):
            row = (str(kind or "").strip(), str(mode or "").strip(), code, backed)
            whys.setdefault(row, []).append(i)
        for (kind, mode, code, backed), places in whys.items():
            here = np.array(places)
            if kind and kind not in KINDS:
                text = f"kind = {kind[:40]!r} is unknown; use {', '.join(KINDS)}"
                _Some(self, here).refuse(True, "{why}", why=text)
                continue
            if kind:
                code = _codes()[kind]
            elif code < 0 and mode in MODES:
                code = _codes()[kind_of_mode(mode, back_fracture=backed).kind]
            self.kinds[here] = code
            if mode in MODES:
                self.modes[here] = MODES.index(mode)
            own = None if code < 0 else _FACTS[code]
            if mode and (own is None or own.mode != mode):
                model = "any" if own is None else f"the {own.kind}"
                text = (
                    f"the block's mode is {words_of_mode(mode[:40])}: {model} model does not apply"
                )
                _Some(self, here).refuse(True, "{why}", why=text)

    def _state_free(self, shapes: Sequence[tuple[str, ...]]) -> None:
        """Enter that blocks stand free of which a restitution is stated."""
        restitution = self.given.get("restitution")
        if restitution is None or not (shapes or {"p2", "kr"} & self.given.keys()):
            return
        facts = requested_kind(None, ("restitution",))
        assert facts is not None
        stated = ~np.isnan(restitution) if self.rows else True
        self.kinds[(self.kinds < 0) & stated] = _codes()[facts.kind]

    def _shapes(self) -> list[tuple[str, ...]]:
        """Return the shape that is stated; of a table those that its rows may have."""
        if self.rows:
            whole = [names for names in SHAPES if all(name in self.given for name in names)]
            begun = any(name in self.given for names in SHAPES for name in names)
            if begun and not whole and not kinds_by_numbers(self.given):
                shape_among(self.given)
            return whole
        without_back = () if self.backed.all() else ("back_fracture",)
        shape = shape_among({*self.given, *without_back})
        if shape is not None and (numbers := [name for name in NUMBERS if name in self.given]):
            raise InputError(
                f"{numbers[0]} cannot be combined with {shape[0]}: give one description of the "
                "block",
                fields=(numbers[0], *shape),
            )
        return [] if shape is None else [shape]

    def _complete(self) -> Any:
        """Return which blocks have all numbers of a kind."""
        complete = np.zeros(self.size, dtype=np.bool_)
        for facts in kinds_by_numbers(self.given):
            complete |= self._known(facts.parameters)
        return complete

    def _stated(self, name: str) -> Any:
        """Return the values of a field; what an empty cell of a table stands for."""
        values = self.given[name]
        if self.rows and name in _IF_EMPTY:
            return np.where(np.isnan(values), _IF_EMPTY[name], values)
        return values

    def _known_any(self, names: Collection[str]) -> Any:
        known = np.zeros(self.size, dtype=np.bool_)
        for name in names:
            if name in self.given:
                known |= ~np.isnan(self.given[name])
        return known

    def _known(self, names: Collection[str]) -> Any:
        known = np.ones(self.size, dtype=np.bool_)
        for name in names:
            known &= ~np.isnan(self.given[name])
        return known

    def _sort_numbers(self, places: Any) -> None:
        """Sort blocks that are given by numbers."""
        # a restitution has first_slip already
        names = [name for name in self.given if not name.startswith("restitution")]
        if (self.kinds < 0).any():
            for facts in kinds_by_numbers(names):
                kind = block_of([name for name in names if name in _numbers_of(facts)]).kind
                here = (self.kinds < 0) & self._known(facts.parameters)
                self.kinds[here] = _codes()[kind]
            self.kinds[self.kinds < 0] = _codes()[block_of(names).kind]
        of_these = self.kinds[places]
        for code in np.unique(of_these[self.free[places]]).tolist():
            facts = _FACTS[code]
            here = places[(of_these == code) & self.free[places]]
            if not facts.parameters:
                _Some(self, here).refuse(True, NO_MODEL, kind=facts.kind)
                continue
            self.modes[here] = MODES.index(facts.mode) if facts.mode else -1
            missing = [name for name in facts.parameters if name not in self.given]
            if missing:
                whole = " and ".join(facts.parameters)
                _Some(self, here).refuse(
                    True,
                    f"the block's mode is {words_of_mode(facts.mode or '')}, and {missing[0]} is "
                    f"missing: a block of kind {facts.kind} is given by {whole}",
                )
                continue
            numbers = {
                name: self._stated(name) for name in _numbers_of(facts) if name in self.given
            }
            self.read |= numbers.keys()
            if "p2" in numbers:
                check_size(_at(numbers["p2"], here), _Some(self, here))
            self.group(facts, here, {name: _at(value, here) for name, value in numbers.items()})

    def _sort_shapes(self, shape: tuple[str, ...], places: Places) -> None:
        """Sort blocks that are given by their shape."""
        planes = [name for name in (*PLANES, *JOINT, *BOND) if name in self.given]
        self.read |= {*shape, *planes, "back_fracture"}
        self.read |= {"drainage"} if "water_m" in planes else set()
        stated = {name: _at(self.given[name], places) for name in (*shape, *planes)}
        if shape != RECTANGLE:
            for name in ("beta_deg", "phi_deg"):
                if name not in stated:
                    raise InputError(f"{name}{FRICTION_MISSING[7:]}", fields=(name,))
        listener = _Some(self, places)
        # an empty cell gives nothing, nor does what has a default
        unsaid = (*JOINT, *BOND) if self.rows else ("joint_length_m", "phi_residual_deg")
        there = {n: np.nan_to_num(v, nan=1.0) if n in unsaid else v for n, v in stated.items()}
        check_ranges(there, listener, columns=self.rows)
        check_lengths(stated, listener)
        stated.setdefault("beta_deg", np.zeros(1))
        stated.setdefault("phi_deg", np.full(1, np.nan))
        stated.setdefault("phi_back_deg", stated["phi_deg"])
        if shape != RECTANGLE:
            listener.refuse(np.isnan(stated["phi_deg"]), FRICTION_MISSING)
        free_kinds, kinds = np.array([facts.free_standing for facts in _FACTS]), self.kinds[places]
        is_free = np.where(kinds < 0, ~self.backed[places], free_kinds[kinds])
        for free_standing in (False, True):
            own = (is_free == free_standing) & self.free[places]
            if own.any():
                here = np.flatnonzero(own)
                values = {name: _at(value, here) for name, value in stated.items()}
                self._sort_standing(shape, places[here], values, free_standing)

    def _sort_standing(
        self, shape: tuple[str, ...], places: Places, stated: dict[str, Any], free_standing: bool
    ) -> None:
        """Sort shapes that all are backed, or all stand free."""
        n = places.size
        blocks = getattr(BlockArray, SHAPES[shape])(*(stated[name] for name in shape))
        phi, back = stated["phi_deg"], stated["phi_back_deg"]
        taken = np.isnan(phi)
        # a friction angle that leaves a rectangle no choice: between that of its toe and 90°
        phi = np.where(taken, 0.5 * (blocks.alpha3_deg + 90.0), phi)
        back = np.where(np.isnan(back), phi, back)
        strength: dict[str, Any] = {}
        listener = _Some(self, places)
        for name in ("cohesion_pa", "water_m", "jrc", "joint_length_m"):
            if name in stated:
                strength[name] = np.nan_to_num(stated[name])
        if "jrc" in stated:
            # what is smooth needs no strength of its walls
            jcs = stated.get("jcs_mpa", np.full(1, np.nan))
            listener.refuse(
                (strength["jrc"] > 0.0) & np.isnan(jcs), "jcs_mpa is missing", "jcs_mpa"
            )
            strength["jcs_mpa"] = np.nan_to_num(jcs, nan=1.0)
        if free_standing and "water_m" in strength:
            listener.refuse(strength.pop("water_m") > 0.0, NO_FRACTURE, "water_m")
        elif "water_m" in strength:
            # the drained block is a dry one
            drained = self.drainage[places] == DRAINED
            listener.remark(drained & (strength["water_m"] > 0.0), DRAINED_NOTE)
            strength["water_m"] = np.where(drained, 0.0, strength["water_m"])
        if strength:
            density = stated.get("density_kg_m3", np.full(1, np.nan))
            needed: Any = False
            for name in ("cohesion_pa", "water_m", "jrc"):
                needed = needed | (strength.get(name, np.zeros(1)) > 0.0)
            listener.remark(np.isnan(density) & needed, DENSITY_NOTE)
            strength["density_kg_m3"] = np.where(np.isnan(density), ROCK_KG_M3, density)
        push = None
        if np.any(strength.get("water_m", 0.0) > 0.0):
            push = push_of_blocks(
                blocks, stated["beta_deg"], strength["water_m"], strength["density_kg_m3"]
            )
        on = {"beta_deg": stated["beta_deg"], "back_fracture": not free_standing}
        judged_all = stability_arrays(blocks, phi_deg=phi, phi_back_deg=back, **on, **strength)
        residual = stated.get("phi_residual_deg", np.full(1, np.nan))
        left = np.broadcast_to(~np.isnan(residual), (n,))
        if left.any():
            first = judged_all
            first_slip = {"k": first.yield_acceleration, "mode": first.mode}
            listener.unstable(
                left & (first.yield_acceleration <= 0.0), UNSTABLE_AT_REST, **first_slip
            )
            phi, back = (np.where(left, residual, each) for each in (phi, back))
            ended = strength.keys() & ENDED - {"jcs_mpa"}
            strength |= {name: np.where(left, 0.0, strength[name]) for name in ended}
            judged_all = stability_arrays(blocks, phi_deg=phi, phi_back_deg=back, **on, **strength)
            fails = left & (judged_all.yield_acceleration <= 0.0)
            listener.refuse(fails, SLIPS_ON, "phi_residual_deg", **first_slip)
            listener.remark(left, AFTER_SLIP)
        if "jrc" in strength:
            phi = judged_all.phi_deg
        codes = np.broadcast_to(judged_all.mode_code, (n,))
        reasons = np.broadcast_to(judged_all.reason_code, (n,))
        k = np.broadcast_to(judged_all.yield_acceleration, (n,))
        for code in np.unique(reasons[reasons > 0]).tolist():
            listener.refuse(reasons == code, REASONS[code])
        self.modes[places] = codes
        across_m = 2.0 * np.broadcast_to(blocks.r3_m, (n,))
        listener.remark(across_m < LEAST_M, SMALL_BLOCK, value=across_m)
        is_long = np.zeros(1, dtype=np.bool_)
        for name in shape:
            is_long = is_long | ((stated[name] > MOST_M) if name in LENGTHS else False)
        check_size(np.where(is_long, np.nan, np.broadcast_to(blocks.p2, (n,))), listener)
        displacement = np.full(1, np.nan)
        if "displacement_m" in self.given:
            self.read.add("displacement_m")
            displacement = _at(self.given["displacement_m"], places)
            listener.refuse(taken & ~np.isnan(displacement), FRICTION_MISSING)
        width = len(_FACTS) + 1
        pairs = codes.astype(np.intp) * width + self.kinds[places] + 1
        for pair in np.flatnonzero(np.bincount(pairs[self.free[places]])).tolist():
            code, requested = pair // width, pair % width - 1
            own = (pairs == pair) & self.free[places]
            if not own.any():
                continue
            here = np.flatnonzero(own)
            mode, of_these = MODES[code], places[here]
            facts = (
                kind_of_mode(mode, back_fracture=not free_standing)
                if requested < 0
                else _FACTS[requested]
            )
            self.kinds[of_these] = _FACTS.index(facts)
            judged = ModeShapes(
                blocks.at(here), mode, k[here], _at(stated["beta_deg"], here), _at(phi, here),
                _at(back, here), _at(taken, here), self.backed[of_these],
                _at(np.asarray(strength.get("cohesion_pa", np.zeros(1))) > 0.0, here),
                _at(np.asarray(strength.get("jrc", np.zeros(1))) > 0.0, here),
                None if push is None else tuple(_at(each, here) for each in push),
                None if self.pga_g is None else _at(self.pga_g, of_these),
            )  # fmt: skip
            names = [
                name for name in _numbers_of(facts)
                if name in self.given and name.endswith(("_sigma", "restitution"))
            ]  # fmt: skip
            self.read |= {*names}
            others = {name: _at(self.given[name], of_these) for name in names}
            with np.errstate(all="ignore"):
                numbers = numbers_of_shape(
                    facts, judged, _at(displacement, here), others, _Some(self, of_these)
                )
            self.group(facts, of_these, numbers)

    def group(self, facts: KindSpec, places: Places, numbers: Mapping[str, Any]) -> None:
        """Keep blocks of one kind, of those that no reason is known against."""
        usable = np.flatnonzero(self.free[places])
        if usable.size:
            if usable.size < places.size:
                numbers = {name: _at(np.asarray(v), usable) for name, v in numbers.items()}
            self.groups.append(Group(facts.kind, numbers, places[usable]))


def push_of_blocks(blocks: BlockArray, beta_deg: Any, water_m: Any, density_kg_m3: Any) -> Any:
    """Return the push of water on blocks, zeros on dry ones."""
    t1, t3, h, beta, water, density = np.broadcast_arrays(
        blocks.tan_alpha1, blocks.tan_alpha3, blocks.half_s1_m, beta_deg, water_m, density_kg_m3
    )
    functions = array_elementwise()
    with np.errstate(all="ignore"):
        wet, _ = water_at(
            water_m=water, density_kg_m3=density, half_s1_m=h, tan_alpha1=t1, tan_alpha3=t3,
            cot=cot_gamma(t1, t3), tan_beta=tan_deg(beta, functions), functions=functions,
        )  # fmt: skip
    along, normal, moment = (
        np.where(water > 0.0, each, 0.0) for each in (wet.along, wet.normal, wet.moment)
    )
    return along, normal, moment * h


def _about_rows(warning: Diagnostic, example: str, parts: Sequence[Places]) -> Diagnostic:
    """Return a warning about rows, with the values of the first."""
    rows = np.concatenate(parts)
    more = f" (and {rows.size - 1:,} more rows)" if example != warning and rows.size > 1 else ""
    return warning.replaced(text=example + more, rows=rows)


def _at(values: Any, places: Places) -> Any:
    """Return the values of some places; one that holds for all stays one."""
    return values if values.size == 1 else values[places]


@cache
def _codes() -> dict[str, int]:
    return {kind: code for code, kind in enumerate(KINDS)}


@cache
def _numbers_of(facts: KindSpec) -> tuple[str, ...]:
    """Return what a model of a kind reads of a block."""
    block = block_of(facts.parameters, facts.kind)
    return (*block.names, *block.options, *block.sigmas)
