"""Classification of arrays of blocks: failure mode, kind and model inputs, from numbers or
geometry.

Each block that cannot be used keeps its reason, and one that fails at rest is known to fail.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import InputError
from rbfrag.fragility.model_selection import block_of
from rbfrag.question.classify import (
    Blocks,
    Group,
    InvalidBlocks,
    kinds_by_numbers,
    read_by_some,
    requested_kind,
)
from rbfrag.question.shape_validation import (
    ANGLE_MISSING,
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
    REJECTED,
    SHAPES,
    SMALL_BLOCK,
    UNSTABLE,
    UNSTABLE_AT_REST,
    ModeShapes,
    check_lengths,
    check_ranges,
    check_size,
    numbers_of_shape,
    reject_parameters,
    shape_among,
)
from rbfrag.results.diagnostic import Diagnostic
from rbfrag.solver.block.arrays import REASONS, BlockArray
from rbfrag.solver.block.formulas import array_elementwise, cot_gamma, tan_deg
from rbfrag.solver.kinds import KINDS, KindSpec, facts_of, kind_of_mode
from rbfrag.solver.stability.arrays import stability_arrays
from rbfrag.solver.stability.joint import (
    AFTER_SLIP,
    DRAINAGES,
    DRAINED,
    ENDED,
    NO_DRAINAGE,
    NO_FRACTURE,
    ROCK_KG_M3,
    SLIPS_ON,
    UNDRAINED,
    water_at,
)
from rbfrag.solver.stability.modes import MODES, words_of_mode
from rbfrag.vocabulary.quantities import JOINT, NUMBERS, PLANES, SPACE

_FACTS = tuple(KINDS.values())
_CODES = {kind: code for code, kind in enumerate(KINDS)}

Indices = NDArray[np.intp]


def classify_blocks(
    inputs: Mapping[str, NDArray[np.float64]],
    size: int,
    *,
    kinds: str | Sequence[str | None] | None = None,
    modes: Sequence[str | None] | None = None,
    rows: bool = False,
    draws: bool = False,
    pga_g: NDArray[np.float64] | None = None,
) -> Blocks:
    """Classify arrays of blocks: the kind of each and the inputs of its model.

    Args:
        inputs: fields that are stated, flat arrays of the number of blocks, or of one element for
            all; ``back_fracture`` is 0 where there is none.
        size: number of blocks.
        kinds: how they are asked to fail, one kind for all or one each; None or an empty text for
            what shape, mode or numbers say.
        modes: failure modes that are stated, empty for none.
        rows: they are rows of a table, which may state more than is needed: numbers go before a
            shape, and what is empty is not stated.
        draws: a block of another mode than that of its requested kind has the kind of its mode.
        pga_g: PGA at which it is said whether heels or toes give way [g], of the number of blocks
            or of one element; None for no such note.

    Raises:
        InputError: they are described twice or in part.
    """
    planes = inputs.keys() & set(SPACE)
    wrong: Mapping[int, str] = {}
    notes: tuple[Diagnostic, ...] = ()
    if planes:
        from rbfrag.question.sections import in_sections

        inputs, wrong, notes = in_sections(inputs, size)
    used_inputs, unread = (inputs, ()) if rows else read_by_some(inputs)
    sorting = _BlockClassifier(used_inputs, size, rows, draws, pga_g)
    for place, why in wrong.items():
        _ArrayIssues(sorting, np.array([place])).reject(True, "{why}", why=why)
    sorting.state_drainage()
    blocks = sorting.blocks(kinds, modes)
    blocks = blocks._replace(remarks=(*notes, *blocks.remarks), read=blocks.read | planes)
    if rows:
        return blocks
    unused = inputs.keys() - used_inputs.keys()
    return blocks._replace(remarks=(*blocks.remarks, *unread), read=blocks.read | unused)


TWO_DESCRIPTIONS = "the answer is that of {} in the row; its geometry ({}) is not used"


class _ArrayIssues:
    """Records why blocks of an array are rejected; the first reason of each block counts."""

    def __init__(self, classifier: _BlockClassifier, indices: Indices) -> None:
        self.classifier, self.indices = classifier, indices

    def reject(
        self, holds: Any, text: str, /, *_fields: str, state: str = REJECTED, **values: Any
    ) -> None:
        # the row, or the element, is the subject of its reason
        text = text.removeprefix("the block ")
        self._keep(self.classifier.rejected, holds, text, values, state)

    def unstable(self, holds: Any, text: str, /, **values: Any) -> None:
        self._keep(self.classifier.unstable, holds, text, values, UNSTABLE)

    def remark(self, holds: Any, text: Diagnostic, /, **values: Any) -> None:
        is_valid = self.classifier.is_valid[self.indices]
        rows = np.flatnonzero(np.broadcast_to(holds, self.indices.shape) & is_valid)
        if not rows.size:
            return
        first = {n: np.broadcast_to(v, self.indices.shape)[rows[0]] for n, v in values.items()}
        example = text.format(**first) if values else str(text)
        self.classifier.remarks.setdefault(text, (example, []))[1].append(self.indices[rows])

    def _keep(
        self,
        reasons: list[InvalidBlocks],
        holds: Any,
        text: str,
        values: dict[str, Any],
        state: str,
    ) -> None:
        rows = np.flatnonzero(holds & self.classifier.is_valid[self.indices])
        if rows.size:
            self.classifier.is_valid[self.indices[rows]] = False
            row_values = {
                n: _at(v, rows) if isinstance(v, np.ndarray) else v for n, v in values.items()
            }
            reasons.append(InvalidBlocks(self.indices[rows], text, row_values, state))


class _BlockClassifier:
    """Classification of arrays of blocks by kind."""

    def __init__(
        self, inputs: Mapping[str, Any], size: int, rows: bool, draws: bool, pga_g: Any
    ) -> None:
        self.size, self.rows, self.draws, self.pga_g = size, rows, draws, pga_g
        backed = np.asarray(inputs.get("back_fracture", 1.0), dtype=np.float64)
        self.backed = np.broadcast_to(backed != 0.0, (size,))
        """Behind which blocks a plane is; where that is not given, one is."""
        words = np.ravel(np.array(inputs.get("drainage", UNDRAINED), dtype=object)).tolist()
        drainages = np.array([word or UNDRAINED for word in words], dtype=object)
        self.drainage: NDArray[np.object_] = np.broadcast_to(drainages, size)
        """What the water behind each block does while it moves; an empty word means undrained."""
        excluded = ("back_fracture", "drainage")
        self.inputs = {name: value for name, value in inputs.items() if name not in excluded}
        self.groups: list[Group] = []
        self.rejected: list[InvalidBlocks] = []
        self.unstable: list[InvalidBlocks] = []
        self.is_valid = np.ones(size, dtype=np.bool_)
        """Which blocks no reason is known against."""
        self.is_classified = np.zeros(size, dtype=np.bool_)
        """Which blocks are sorted."""
        self.kinds = np.full(size, -1, dtype=np.int8)
        self.modes = np.full(size, -1, dtype=np.int8)
        self.remarks: dict[Diagnostic, tuple[str, list[Indices]]] = {}
        """Warnings, each with its text for the first row of it and its rows."""
        self.read: set[str] = set()

    def blocks(
        self, kinds: str | Sequence[str | None] | None, modes: Sequence[str | None] | None
    ) -> Blocks:
        self._state(kinds, modes)
        shapes = self._shapes()
        restitution = self.inputs.get("restitution")
        if restitution is not None and (shapes or {"p2", "kr"} & self.inputs.keys()):
            facts = requested_kind(None, ("restitution",))
            assert facts is not None
            has_restitution = ~np.isnan(restitution) if self.rows else True
            self.kinds[(self.kinds < 0) & has_restitution] = _CODES[facts.kind]
        remaining = np.ones(self.size, dtype=np.bool_)
        # toppling and rocking have the same parameters
        for names in dict.fromkeys(facts.parameters for facts in kinds_by_numbers(self.inputs)):
            has_numbers = self._has_all(names)
            remaining &= ~has_numbers
            for shape in shapes:
                both = np.flatnonzero(has_numbers & self._has_all(shape))
                text = TWO_DESCRIPTIONS.format(" and ".join(names), ", ".join(shape))
                _ArrayIssues(self, both).remark(True, Diagnostic(text, "two_descriptions"))
        for shape in shapes:
            selected = remaining & self._has_all(shape)
            remaining &= ~selected
            if selected.any():
                self._sort_shapes(shape, np.flatnonzero(selected))
            self.is_classified |= selected
        if shapes:  # of which part of a shape is empty, and no number is stated either
            selected = remaining
            for name in self.inputs.keys() & {*NUMBERS}:
                selected = selected & np.isnan(self.inputs[name])
            if selected.any():
                self._sort_shapes(shapes[0], np.flatnonzero(selected))
            self.is_classified |= selected
        if not self.is_classified.all():
            self._sort_numbers(np.flatnonzero(~self.is_classified))
        remarks = []
        for warning, (text, parts) in self.remarks.items():
            rows = np.concatenate(parts)
            if text != warning and rows.size > 1:
                text += f" (and {rows.size - 1:,} more rows)"
            remarks.append(warning.replaced(text=text, rows=rows))
        return Blocks(
            tuple(self.groups), tuple(remarks), tuple(self.rejected), tuple(self.unstable),
            self.kinds, self.modes, frozenset(self.read),
        )  # fmt: skip

    def state_drainage(self) -> None:
        """Reject unknown drainage conditions, and a drainage of blocks without water."""
        issues = _ArrayIssues(self, np.arange(self.size))
        for word in dict.fromkeys(self.drainage.tolist()):
            if word not in DRAINAGES:
                why = NO_DRAINAGE.format(f"{word}"[:40])
                issues.reject(self.drainage == word, "{why}", "drainage", why=why)
        if "water_m" not in self.inputs and (self.drainage == DRAINED).any():
            raise InputError(DRAINS_NOTHING, fields=("drainage", "water_m"))

    def _state(
        self, kinds: str | Sequence[str | None] | None, modes: Sequence[str | None] | None
    ) -> None:
        """Set the requested kinds, from the kind or the failure mode of each block."""
        if isinstance(kinds, str):
            self.kinds[:] = _CODES[facts_of(kinds).kind]
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
        for (kind, mode, code, backed), members in whys.items():
            indices = np.array(members)
            if kind and kind not in KINDS:
                text = f"kind = {kind[:40]!r} is unknown; use {', '.join(KINDS)}"
                _ArrayIssues(self, indices).reject(True, "{why}", why=text)
                continue
            if kind:
                code = _CODES[kind]
            elif code < 0 and mode in MODES:
                code = _CODES[kind_of_mode(mode, back_fracture=backed).kind]
            self.kinds[indices] = code
            if mode in MODES:
                self.modes[indices] = MODES.index(mode)
            facts = None if code < 0 else _FACTS[code]
            if mode and (facts is None or facts.mode != mode):
                model = "any" if facts is None else f"the {facts.kind}"
                text = (
                    f"the block's mode is {words_of_mode(mode[:40])}: {model} model does not apply"
                )
                _ArrayIssues(self, indices).reject(True, "{why}", why=text)

    def _shapes(self) -> list[tuple[str, ...]]:
        """Return the geometry that is given; for a table, all geometries its rows may have."""
        if self.rows:
            complete_shapes = [
                names for names in SHAPES if all(name in self.inputs for name in names)
            ]
            begun = any(name in self.inputs for names in SHAPES for name in names)
            if begun and not complete_shapes and not kinds_by_numbers(self.inputs):
                shape_among(self.inputs)
            return complete_shapes
        without_back = () if self.backed.all() else ("back_fracture",)
        shape = shape_among({*self.inputs, *without_back})
        if shape is None:
            return []
        reject_parameters(self.inputs, shape)
        return [shape]

    def _has_all(self, names: Collection[str]) -> Any:
        has_all = np.ones(self.size, dtype=np.bool_)
        for name in names:
            has_all &= ~np.isnan(self.inputs[name])
        return has_all

    def _sort_numbers(self, indices: Any) -> None:
        """Classify blocks given by their parameters."""
        # a restitution has first_slip already
        names = [name for name in self.inputs if not name.startswith("restitution")]
        if (self.kinds < 0).any():
            for facts in kinds_by_numbers(names):
                kind = block_of([name for name in names if name in _numbers_of(facts)]).kind
                selected = (self.kinds < 0) & self._has_all(facts.parameters)
                self.kinds[selected] = _CODES[kind]
            self.kinds[self.kinds < 0] = _CODES[block_of(names).kind]
        of_these = self.kinds[indices]
        for code in np.unique(of_these[self.is_valid[indices]]).tolist():
            facts = _FACTS[code]
            selected = indices[(of_these == code) & self.is_valid[indices]]
            if not facts.parameters:
                _ArrayIssues(self, selected).reject(True, NO_MODEL, kind=facts.kind)
                continue
            self.modes[selected] = MODES.index(facts.mode) if facts.mode else -1
            missing = [name for name in facts.parameters if name not in self.inputs]
            if missing:
                parameters = " and ".join(facts.parameters)
                _ArrayIssues(self, selected).reject(
                    True,
                    f"the block's mode is {words_of_mode(facts.mode or '')}, and {missing[0]} is "
                    f"missing: a block of kind {facts.kind} is given by {parameters}",
                )
                continue
            numbers = {n: self.inputs[n] for n in _numbers_of(facts) if n in self.inputs}
            if self.rows and "beta_deg" in numbers:  # an empty cell stands for a level base
                dip_deg = numbers["beta_deg"]
                numbers["beta_deg"] = np.where(np.isnan(dip_deg), 0.0, dip_deg)
            self.read |= numbers.keys()
            if "p2" in numbers:
                check_size(_at(numbers["p2"], selected), _ArrayIssues(self, selected))
            self.group(
                facts, selected, {name: _at(value, selected) for name, value in numbers.items()}
            )

    def _sort_shapes(self, shape: tuple[str, ...], indices: Indices) -> None:
        """Classify blocks given by their geometry."""
        planes = [name for name in (*PLANES, *JOINT, *BOND) if name in self.inputs]
        self.read |= {*shape, *planes, "back_fracture"}
        self.read |= {"drainage"} if "water_m" in planes else set()
        columns = {name: _at(self.inputs[name], indices) for name in (*shape, *planes)}
        if shape != RECTANGLE:
            for name in ("beta_deg", "phi_deg"):
                if name not in columns:
                    raise InputError(f"{name}{ANGLE_MISSING}", fields=(name,))
        issues = _ArrayIssues(self, indices)
        # an empty cell gives nothing, nor does what has a default
        unsaid = (*JOINT, *BOND) if self.rows else ("joint_length_m", "phi_residual_deg")
        there = {n: np.nan_to_num(v, nan=1.0) if n in unsaid else v for n, v in columns.items()}
        check_ranges(there, issues, columns=self.rows)
        check_lengths(columns, issues)
        columns.setdefault("beta_deg", np.zeros(1))
        columns.setdefault("phi_deg", np.full(1, np.nan))
        columns.setdefault("phi_back_deg", columns["phi_deg"])
        if shape != RECTANGLE:
            issues.reject(np.isnan(columns["phi_deg"]), FRICTION_MISSING)
        free_kinds, kinds = np.array([facts.free_standing for facts in _FACTS]), self.kinds[indices]
        is_free = np.where(kinds < 0, ~self.backed[indices], free_kinds[kinds])
        for free_standing in (False, True):
            selected = (is_free == free_standing) & self.is_valid[indices]
            if selected.any():
                rows = np.flatnonzero(selected)
                values = {name: _at(value, rows) for name, value in columns.items()}
                self._sort_standing(shape, indices[rows], values, free_standing)

    def _sort_standing(
        self, shape: tuple[str, ...], indices: Indices, columns: dict[str, Any], free_standing: bool
    ) -> None:
        """Classify geometries that are all backed or all free-standing."""
        n = indices.size
        blocks = getattr(BlockArray, SHAPES[shape])(*(columns[name] for name in shape))
        phi, back = columns["phi_deg"], columns["phi_back_deg"]
        taken = np.isnan(phi)
        # a friction angle that leaves a rectangle no choice: between that of its toe and 90°
        phi = np.where(taken, 0.5 * (blocks.alpha3_deg + 90.0), phi)
        back = np.where(np.isnan(back), phi, back)
        strength: dict[str, Any] = {}
        issues = _ArrayIssues(self, indices)
        for name in ("cohesion_pa", "water_m", "jrc", "joint_length_m"):
            if name in columns:
                strength[name] = np.nan_to_num(columns[name])
        if "jrc" in columns:
            # what is smooth needs no strength of its walls
            jcs = columns.get("jcs_mpa", np.full(1, np.nan))
            issues.reject((strength["jrc"] > 0.0) & np.isnan(jcs), "jcs_mpa is missing", "jcs_mpa")
            strength["jcs_mpa"] = np.nan_to_num(jcs, nan=1.0)
        if free_standing and "water_m" in strength:
            issues.reject(strength.pop("water_m") > 0.0, NO_FRACTURE, "water_m")
        elif "water_m" in strength:
            # the drained block is a dry one
            drained = self.drainage[indices] == DRAINED
            issues.remark(drained & (strength["water_m"] > 0.0), DRAINED_NOTE)
            strength["water_m"] = np.where(drained, 0.0, strength["water_m"])
        if strength:
            density = columns.get("density_kg_m3", np.full(1, np.nan))
            needed: Any = False
            for name in ("cohesion_pa", "water_m", "jrc"):
                needed = needed | (strength.get(name, np.zeros(1)) > 0.0)
            issues.remark(np.isnan(density) & needed, DENSITY_NOTE)
            strength["density_kg_m3"] = np.where(np.isnan(density), ROCK_KG_M3, density)
        push = None
        if np.any(strength.get("water_m", 0.0) > 0.0):
            push = push_of_blocks(
                blocks, columns["beta_deg"], strength["water_m"], strength["density_kg_m3"]
            )
        on = {"beta_deg": columns["beta_deg"], "back_fracture": not free_standing}
        judged_all = stability_arrays(blocks, phi_deg=phi, phi_back_deg=back, **on, **strength)
        residual = columns.get("phi_residual_deg", np.full(1, np.nan))
        has_residual = np.broadcast_to(~np.isnan(residual), (n,))
        if has_residual.any():
            first = judged_all
            first_slip: dict[str, Any] = {"k": first.yield_acceleration, "mode": first.mode}
            issues.unstable(
                has_residual & (first.yield_acceleration <= 0.0), UNSTABLE_AT_REST, **first_slip
            )
            phi, back = (np.where(has_residual, residual, value) for value in (phi, back))
            ended = strength.keys() & ENDED - {"jcs_mpa"}
            strength |= {name: np.where(has_residual, 0.0, strength[name]) for name in ended}
            judged_all = stability_arrays(blocks, phi_deg=phi, phi_back_deg=back, **on, **strength)
            fails = has_residual & (judged_all.yield_acceleration <= 0.0)
            issues.reject(fails, SLIPS_ON, "phi_residual_deg", **first_slip)
            issues.remark(has_residual, AFTER_SLIP)
        if "jrc" in strength:
            phi = judged_all.phi_deg
        codes = np.broadcast_to(judged_all.mode_code, (n,))
        reasons = np.broadcast_to(judged_all.reason_code, (n,))
        k = np.broadcast_to(judged_all.yield_acceleration, (n,))
        for code in np.unique(reasons[reasons > 0]).tolist():
            issues.reject(reasons == code, REASONS[code])
        self.modes[indices] = codes
        across_m = 2.0 * np.broadcast_to(blocks.r3_m, (n,))
        issues.remark(across_m < LEAST_M, SMALL_BLOCK, value=across_m)
        is_long = np.zeros(1, dtype=np.bool_)
        for name in shape:
            is_long = is_long | ((columns[name] > MOST_M) if name in LENGTHS else False)
        check_size(np.where(is_long, np.nan, np.broadcast_to(blocks.p2, (n,))), issues)
        displacement = np.full(1, np.nan)
        if "displacement_m" in self.inputs:
            self.read.add("displacement_m")
            displacement = _at(self.inputs["displacement_m"], indices)
            issues.reject(taken & ~np.isnan(displacement), FRICTION_MISSING)
        width = len(_FACTS) + 1
        pairs = codes.astype(np.intp) * width + self.kinds[indices] + 1
        for pair in np.flatnonzero(np.bincount(pairs[self.is_valid[indices]])).tolist():
            code, requested = pair // width, pair % width - 1
            selected = (pairs == pair) & self.is_valid[indices]
            if not selected.any():
                continue
            rows = np.flatnonzero(selected)
            mode, of_these = MODES[code], indices[rows]
            facts = (
                kind_of_mode(mode, back_fracture=not free_standing)
                if requested < 0 or (self.draws and _FACTS[requested].mode != mode)
                else _FACTS[requested]
            )
            self.kinds[of_these] = _FACTS.index(facts)
            judged = ModeShapes(
                blocks.at(rows), mode, k[rows], _at(columns["beta_deg"], rows), _at(phi, rows),
                _at(back, rows), _at(taken, rows), self.backed[of_these],
                _at(np.asarray(strength.get("cohesion_pa", np.zeros(1))) > 0.0, rows),
                _at(np.asarray(strength.get("jrc", np.zeros(1))) > 0.0, rows),
                None if push is None else tuple(_at(value, rows) for value in push),
                None if self.pga_g is None else _at(self.pga_g, of_these),
            )  # fmt: skip
            names = [
                name for name in _numbers_of(facts)
                if name in self.inputs and name.endswith(("_sigma", "restitution"))
            ]  # fmt: skip
            self.read |= {*names}
            options = {name: _at(self.inputs[name], of_these) for name in names}
            with np.errstate(all="ignore"):
                numbers = numbers_of_shape(
                    facts, judged, _at(displacement, rows), options, _ArrayIssues(self, of_these)
                )
            self.group(facts, of_these, numbers)

    def group(self, facts: KindSpec, indices: Indices, numbers: Mapping[str, Any]) -> None:
        """Add a group of one kind, without its rejected blocks."""
        valid_rows = np.flatnonzero(self.is_valid[indices])
        if valid_rows.size:
            if valid_rows.size < indices.size:
                numbers = {name: _at(np.asarray(v), valid_rows) for name, v in numbers.items()}
            self.groups.append(Group(facts.kind, numbers, indices[valid_rows]))


def push_of_blocks(blocks: BlockArray, beta_deg: Any, water_m: Any, density_kg_m3: Any) -> Any:
    """Return the water force on blocks, zero for dry blocks."""
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
        np.where(water > 0.0, component, 0.0) for component in (wet.along, wet.normal, wet.moment)
    )
    return along, normal, moment * h


def _at(values: Any, indices: Indices) -> Any:
    """Return the values at these indices; a single value holds for all."""
    return values if values.size == 1 else values[indices]


@cache
def _numbers_of(facts: KindSpec) -> tuple[str, ...]:
    """Return the fields that a model of this kind uses of a block."""
    block = block_of(facts.parameters, facts.kind)
    return (*block.names, *block.options, *block.sigmas)
