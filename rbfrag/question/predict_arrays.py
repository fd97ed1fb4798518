"""Predictions for arrays of blocks; each kind of failure has its own model."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from functools import partial
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rbfrag.errors import InputError, ModelError
from rbfrag.fragility.measures import MEASURES
from rbfrag.fragility.model import AT_REST, FragilityModel
from rbfrag.fragility.model_selection import block_of, unused_measures
from rbfrag.fragility.prediction import Prediction, add_warnings, answer_given
from rbfrag.fragility.prediction_array import PredictionArray, ReasonPart, Reasons, flat, index_of
from rbfrag.fragility.validation import block_reasons
from rbfrag.question.classify import Blocks, InvalidBlocks, classify_block
from rbfrag.question.classify_arrays import classify_blocks
from rbfrag.question.shape_validation import PLANE_TEXTS, STATES
from rbfrag.results.diagnostic import Diagnostic, diagnostics
from rbfrag.solver.kinds import BY_MECHANICS

_COLUMNS = (
    "probability", "ci_low", "ci_high", "event_low", "event_high", "y_m_s", "intensity_m_s",
    "block_sd",
)  # fmt: skip


def ask_many(
    inputs: Mapping[str, Any],
    kind: str | Sequence[str | None] | None,
    mode: Sequence[str | None] | None,
    *,
    rows: bool,
    draws: bool,
    level: float,
    nan: Literal["propagate", "raise"],
    interval: bool,
    weights: ArrayLike | None,
    sites: float | None,
    find: Callable[[Mapping[str, Any], str | None], FragilityModel],
) -> Prediction | PredictionArray:
    """Return the predictions for blocks given by their geometry, or of several kinds.

    Args:
        inputs: fields of block and shaking: numbers or arrays.
        kind: how they fail, for all or one each.
        mode: failure modes that are stated, one each.
        rows: the arrays are columns of a table.
        draws: each block is answered by its own mode, whatever kind is asked for.
        level: confidence level.
        nan: what becomes of elements that cannot be used.
        interval: whether an interval is asked for.
        weights: of draws of one block.
        sites: number of sites of one earthquake with such blocks.
        find: returns the model that answers for what is given, of a kind.

    Raises:
        InputError: nothing of it can be answered for, or, if asked, an element.
    """
    values, planes, shape = _flatten(inputs, kind=kind, mode=mode)
    size = int(np.prod(shape))
    measures = {name: value for name, value in values.items() if name in MEASURES}
    block = {name: value for name, value in values.items() if name not in MEASURES}
    blocks = classify_blocks(
        {**block, **planes}, size, kinds=kind, modes=mode, rows=rows, draws=draws,
        pga_g=None if draws else measures.get("pga_g"),
    )  # fmt: skip
    if not rows and not draws:
        _reject_unread(blocks, block)
    if weights is not None:
        return _of_draws(blocks, inputs, level, weights, sites, size, find)
    rejected, parts = list(blocks.rejected), []
    for group in blocks.groups:
        indices = group.indices
        assert indices is not None
        group_inputs = {
            **group.numbers,
            **{n: v if v.size == 1 else v[indices] for n, v in measures.items()},
        }
        try:
            chosen = find(group_inputs, group.kind)
            group_inputs = chosen.method.block.filled(group_inputs) if rows else group_inputs
            group_inputs = {n: np.broadcast_to(v, indices.shape) for n, v in group_inputs.items()}
            answer = answer_given(chosen, group_inputs, level, interval=interval, sites=sites)
        except (InputError, ModelError) as error:
            if len(blocks.groups) == 1:
                raise
            rejected.append(InvalidBlocks(indices, str(error), {}))
            continue
        assert isinstance(answer, PredictionArray)
        parts.append((indices, add_warnings(answer, unused_measures(chosen, group_inputs))))
    if nan == "raise":
        _reject(rejected, parts, blocks, shape)
    index = index_of({name: value for name, value in inputs.items() if name not in planes})
    return _together(parts, rejected, blocks, shape, level, index)


def _flatten(
    inputs: Mapping[str, Any], **labels: str | Sequence[str | None] | None
) -> tuple[dict[str, Any], dict[str, NDArray[Any]], tuple[int, ...]]:
    """Return the numbers and the texts of blocks as flat arrays, and their common shape.

    Args:
        inputs: fields: numbers, texts, or arrays of either.
        labels: kinds and modes, sequences of which have the length of the arrays.

    Raises:
        InputError: shapes that are not compatible, or a field that is not a number.
    """
    planes = {name: np.array(inputs[name], dtype=object) for name in PLANE_TEXTS if name in inputs}
    numbers = {name: value for name, value in inputs.items() if name not in planes}
    sizes = {n: len(v) for n, v in labels.items() if v is not None and not isinstance(v, str)}
    shapes = sizes | {name: text.shape for name, text in planes.items()}
    values, shape = flat({**numbers, **{name: np.zeros(shapes[name]) for name in shapes}})
    texts = {name: np.broadcast_to(text, shape).ravel() for name, text in planes.items()}
    return {name: values[name] for name in numbers}, texts, shape


def blocks_of_arrays(inputs: Mapping[str, Any]) -> tuple[Blocks, int]:
    """Return classified blocks, and their number.

    Args:
        inputs: fields of the blocks, with ``kind``, ``block`` and ``back_fracture``: numbers, or
            arrays of shape (m,); None for what is not stated.

    Raises:
        InputError: arrays of different lengths, or a field that the blocks do not read.
    """
    block_fields = {name: value for name, value in inputs.items() if value is not None}
    kind = block_fields.pop("kind", None)
    if "block" in block_fields:
        return classify_block(block_fields, kind), 1
    numbers, planes, shape = _flatten(block_fields, kind=kind)
    size = int(np.prod(shape))
    blocks = classify_blocks({**numbers, **planes}, size, kinds=kind)
    if kind is None or isinstance(kind, str):
        # of a table that states the kinds, others may read what these do not
        _reject_unread(blocks, numbers)
    return blocks, size


def _reject_unread(blocks: Blocks, names: Collection[str]) -> None:
    unread = [name for name in names if name not in blocks.read]
    if unread and blocks.groups:
        kinds = " or ".join(dict.fromkeys(str(group.kind) for group in blocks.groups))
        raise InputError(
            f"{unread[0]} cannot be combined with kind {kinds}: omit it", fields=(unread[0],)
        )


def block_reasons_of(blocks: Blocks, size: int) -> NDArray[np.object_]:
    """Return why blocks cannot fail in an earthquake, shape (m,); an empty text where they can."""
    reasons = np.full(size, "", dtype=object)
    for invalid in (*blocks.rejected, *blocks.unstable):
        reasons[invalid.indices] = invalid.texts()
    for group in blocks.groups:
        indices = np.arange(size) if group.indices is None else group.indices
        numbers = {n: np.broadcast_to(v, indices.shape) for n, v in group.numbers.items()}
        reasons[indices] = block_reasons(block_of(numbers, group.kind), numbers)
    return reasons


def _reject(
    rejected: Sequence[InvalidBlocks],
    parts: Sequence[tuple[NDArray[np.intp], PredictionArray]],
    blocks: Blocks,
    shape: tuple[int, ...],
) -> None:
    """Reject the first element without a prediction, or that is unstable at rest."""
    reasons: dict[int, str] = {}
    for invalid in rejected:
        reasons |= dict(zip(invalid.indices.tolist(), invalid.texts().tolist(), strict=True))
    for indices, answer in parts:
        missing = np.flatnonzero(np.isnan(answer.probability) | (answer.reason == "unstable"))
        texts = answer.reason[missing].tolist()
        reasons |= dict(zip(indices[missing].tolist(), texts, strict=True))
    for invalid in blocks.unstable:
        reasons |= dict.fromkeys(invalid.indices.tolist(), "unstable")
    if reasons:
        first = min(reasons)
        where = tuple(int(i) for i in np.unravel_index(first, shape))
        raise InputError(f"element {where}: {reasons[first]}")


def _of_draws(
    blocks: Blocks,
    inputs: Mapping[str, Any],
    level: float,
    weights: ArrayLike,
    sites: float | None,
    size: int,
    find: Callable[[Mapping[str, Any], str | None], FragilityModel],
) -> Prediction | PredictionArray:
    """Return one prediction averaged over draws of a block, all of one kind."""
    groups = [group for group in blocks.groups if group.indices is not None]
    if len(groups) != 1 or groups[0].indices is None or groups[0].indices.size != size:
        at_rest = sum(invalid.indices.size for invalid in blocks.unstable)
        first = next((f": {invalid.texts()[0]}" for invalid in blocks.rejected), "")
        kinds = " and ".join(str(group.kind) for group in groups) or "none"
        raise InputError(
            f"all draws of a block must have one kind, not {kinds}"
            + (f", {at_rest} are unstable at rest" if at_rest else "")
            + first
        )
    (group,) = groups
    group_inputs = {**group.numbers, **{name: inputs[name] for name in inputs if name in MEASURES}}
    chosen = find(group_inputs, group.kind)
    answer = answer_given(chosen, group_inputs, level, weights=weights, sites=sites)
    return add_warnings(answer, unused_measures(chosen, group_inputs))


def _together(
    parts: Sequence[tuple[NDArray[np.intp], PredictionArray]],
    rejected: Sequence[InvalidBlocks],
    blocks: Blocks,
    shape: tuple[int, ...],
    level: float,
    index: Any,
) -> PredictionArray:
    """Combine the predictions of several models in the order of the blocks."""
    size = int(np.prod(shape))
    columns: dict[str, Any] = {}
    for name in _COLUMNS:
        chunks = [(at, value) for at, part in parts if (value := getattr(part, name)) is not None]
        if chunks or name != "block_sd":
            columns[name] = column = np.full(size, np.nan)
            for at, value in chunks:
                column[at] = value
    in_domain = np.zeros(size, dtype=np.bool_)
    reasons: list[ReasonPart] = []
    for at, part in parts:
        in_domain[at] = part.in_domain
        reasons += [(at[indices], texts) for indices, texts in part.reasons.parts]
    reasons += [(entry.indices, entry.texts) for entry in rejected]
    ruled: list[ReasonPart] = [(at, partial(getattr, part, "how")) for at, part in parts]
    nothing = np.empty(0, dtype=np.intp)
    unstable = np.concatenate([nothing, *(entry.indices for entry in blocks.unstable)])
    at_rest: tuple[Diagnostic, ...] = ()
    if unstable.size:
        at_rest = (Diagnostic(AT_REST, "unstable_at_rest", rows=unstable),)
        for name in ("probability", "ci_low", "ci_high"):
            columns[name][unstable] = 1.0
        if "block_sd" in columns:
            columns["block_sd"][unstable] = 0.0
        in_domain[unstable] = True
        reasons.append((unstable, np.full(unstable.size, "unstable", dtype=object)))
        ruled.append((unstable, np.full(unstable.size, BY_MECHANICS, dtype=object)))
    answers = [part for _, part in parts]

    def named(name: str) -> str:
        return ", ".join(dict.fromkeys(getattr(part, name) for part in answers))

    def in_order(warning: Diagnostic, at: NDArray[np.intp]) -> Diagnostic:
        if len(warning.rows):
            return warning.replaced(rows=at[np.asarray(warning.rows)])
        return warning.replaced(rows=at) if at.size < size else warning

    warnings = (in_order(w, at) for at, part in parts for w in diagnostics(part.warnings))
    states = np.zeros(size, dtype=np.int8)
    for entry in (*rejected, *blocks.unstable):
        states[entry.indices] = 1 + STATES.index(entry.state)
    codes = {"kind_codes": blocks.kinds, "mode_codes": blocks.modes, "state_codes": states}
    grid: dict[str, Any] = {
        n: entry.reshape(shape) for n, entry in codes.items() if entry is not None
    }
    return PredictionArray(
        kind=named("kind"),
        in_domain=in_domain.reshape(shape),
        reasons=Reasons(shape, reasons),
        level=level,
        model=named("model"),
        term=named("term"),
        method=named("method"),
        warnings=diagnostics(blocks.remarks, at_rest, warnings),
        data=next((part.data for part in answers if part.data), None),
        index=index if index is not None and shape == (len(index),) else None,
        **{name: column.reshape(shape) for name, column in columns.items()},
        read=blocks.read,
        ruled=Reasons(shape, ruled),
        **grid,
    )
