"""The answers for many blocks, of which each kind has its own model."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from functools import partial
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rbfrag.errors import InputError, ModelError
from rbfrag.fragility.lookup import block_of, unused_measures
from rbfrag.fragility.measures import MEASURES
from rbfrag.fragility.model import AT_REST, FragilityModel
from rbfrag.fragility.prediction import Prediction, answer_given, with_remarks
from rbfrag.fragility.prediction_array import PredictionArray, ReasonPart, Reasons, flat, index_of
from rbfrag.fragility.unusable import block_reasons
from rbfrag.question.blocks import Blocks, Refused, one_block
from rbfrag.question.many import many_blocks
from rbfrag.question.shapes import PLANE_TEXTS
from rbfrag.results.diagnostic import Diagnostic, diagnostics
from rbfrag.solver.kinds import BY_MECHANICS

_COLUMNS = (
    "probability", "ci_low", "ci_high", "event_low", "event_high", "y_m_s", "intensity_m_s",
    "block_sd",
)  # fmt: skip


def ask_many(
    given: Mapping[str, Any],
    kind: str | Sequence[str | None] | None,
    mode: Sequence[str | None] | None,
    *,
    rows: bool,
    level: float,
    nan: Literal["propagate", "raise"],
    interval: bool,
    weights: ArrayLike | None,
    sites: float | None,
    find: Callable[[Mapping[str, Any], str | None], FragilityModel],
) -> Prediction | PredictionArray:
    """Return the answers for blocks that are described by shapes, or are of several kinds.

    Args:
        given: fields of block and shaking: numbers or arrays.
        kind: how they fail, for all or one each.
        mode: failure modes that are stated, one each.
        rows: the arrays are columns of a table.
        level: confidence level.
        nan: what becomes of elements that cannot be used.
        interval: whether an interval is asked for.
        weights: of draws of one block.
        sites: number of sites of one earthquake with such blocks.
        find: returns the model that answers for what is given, of a kind.

    Raises:
        InputError: nothing of it can be answered for, or, if asked, an element.
    """
    numbers = dict(given)
    each = {"kind": kind, "mode": mode}
    texts = {
        n: np.zeros(len(v)) for n, v in each.items() if v is not None and not isinstance(v, str)
    }
    planes = {
        name: np.array(numbers.pop(name), dtype=object) for name in PLANE_TEXTS if name in numbers
    }
    texts |= {name: np.zeros(text.shape) for name, text in planes.items()}
    values, shape = flat({**numbers, **texts})
    size = int(np.prod(shape))
    written = {name: np.broadcast_to(text, shape).ravel() for name, text in planes.items()}
    measures = {name: value for name, value in values.items() if name in MEASURES}
    block: dict[str, Any] = {n: v for n, v in values.items() if n not in {*measures, *texts}}
    blocks = many_blocks(
        {**block, **written}, size, kinds=kind, modes=mode, rows=rows, pga_g=measures.get("pga_g")
    )
    if not rows:
        _refuse_unread(blocks, block)
    if weights is not None:
        return _of_draws(blocks, given, level, weights, sites, size, find)
    refused, parts = list(blocks.refused), []
    for group in blocks.groups:
        places = group.places
        assert places is not None
        own = {**group.numbers, **{n: v if v.size == 1 else v[places] for n, v in measures.items()}}
        try:
            chosen = find(own, group.kind)
            own = chosen.method.block.filled(own) if rows else own
            own = {n: np.broadcast_to(v, places.shape) for n, v in own.items()}
            answer = answer_given(chosen, own, level, interval=interval, sites=sites)
        except (InputError, ModelError) as error:
            if len(blocks.groups) == 1:
                raise
            refused.append(Refused(places, str(error), {}))
            continue
        assert isinstance(answer, PredictionArray)
        parts.append((places, with_remarks(answer, unused_measures(chosen, own))))
    if nan == "raise":
        _refuse(refused, parts, blocks, shape)
    return _together(parts, refused, blocks, shape, level, index_of(numbers))


def blocks_of_arrays(given: Mapping[str, Any]) -> tuple[Blocks, int]:
    """Return blocks as answers read them, and their number.

    Args:
        given: fields of the blocks, with ``kind``, ``block`` and ``back_fracture``: numbers, or
            arrays of shape (m,); None for what is not stated.

    Raises:
        InputError: arrays of different lengths, or a field that the blocks do not read.
    """
    known = {name: value for name, value in given.items() if value is not None}
    kind = known.pop("kind", None)
    if "block" in known:
        return one_block(known, kind), 1
    each = {} if kind is None or isinstance(kind, str) else {"kind": np.zeros(len(kind))}
    planes = {
        name: np.array(known.pop(name), dtype=object) for name in PLANE_TEXTS if name in known
    }
    each_text = {name: np.zeros(text.shape) for name, text in planes.items()}
    values, shape = flat({**known, **each, **each_text})
    size = int(np.prod(shape))
    numbers: dict[str, Any] = {name: values[name] for name in known}
    numbers |= {name: np.broadcast_to(text, shape).ravel() for name, text in planes.items()}
    blocks = many_blocks(numbers, size, kinds=kind)
    if not each:  # of a table that states the kinds, others may read what these do not
        _refuse_unread(blocks, known)
    return blocks, size


def _refuse_unread(blocks: Blocks, names: Collection[str]) -> None:
    unread = [name for name in names if name not in blocks.read]
    if unread and blocks.groups:
        kinds = " or ".join(dict.fromkeys(str(group.kind) for group in blocks.groups))
        raise InputError(
            f"{unread[0]} cannot be combined with kind {kinds}: omit it", fields=(unread[0],)
        )


def block_reasons_of(blocks: Blocks, size: int) -> NDArray[np.object_]:
    """Return why blocks wait for no earthquake, shape (m,); empty texts for those that do."""
    reasons = np.full(size, "", dtype=object)
    for each in (*blocks.refused, *blocks.unstable):
        reasons[each.places] = each.texts()
    for group in blocks.groups:
        places = np.arange(size) if group.places is None else group.places
        own = {n: np.broadcast_to(v, places.shape) for n, v in group.numbers.items()}
        reasons[places] = block_reasons(block_of(own, group.kind), own)
    return reasons


def _refuse(
    refused: Sequence[Refused],
    parts: Sequence[tuple[NDArray[np.intp], PredictionArray]],
    blocks: Blocks,
    shape: tuple[int, ...],
) -> None:
    """Refuse the first element that has no answer, and one that falls at rest."""
    reasons: dict[int, str] = {}
    for each in refused:
        reasons |= dict(zip(each.places.tolist(), each.texts().tolist(), strict=True))
    for places, answer in parts:
        missing = np.flatnonzero(np.isnan(answer.probability) | (answer.reason == "unstable"))
        texts = answer.reason[missing].tolist()
        reasons |= dict(zip(places[missing].tolist(), texts, strict=True))
    for each in blocks.unstable:
        reasons |= dict.fromkeys(each.places.tolist(), "unstable")
    if reasons:
        first = min(reasons)
        where = tuple(int(i) for i in np.unravel_index(first, shape))
        raise InputError(f"element {where}: {reasons[first]}")


def _of_draws(
    blocks: Blocks,
    given: Mapping[str, Any],
    level: float,
    weights: ArrayLike,
    sites: float | None,
    size: int,
    find: Callable[[Mapping[str, Any], str | None], FragilityModel],
) -> Prediction | PredictionArray:
    """Return the one answer over draws of a block, all of which fail in one way."""
    whole = [group for group in blocks.groups if group.places is not None]
    if len(whole) != 1 or whole[0].places is None or whole[0].places.size != size:
        at_rest = sum(each.places.size for each in blocks.unstable)
        first = next((f": {each.texts()[0]}" for each in blocks.refused), "")
        kinds = " and ".join(str(group.kind) for group in whole) or "none"
        raise InputError(
            f"all draws of a block must have one kind, not {kinds}"
            + (f", {at_rest} are unstable at rest" if at_rest else "")
            + first
        )
    (group,) = whole
    own = {**group.numbers, **{name: given[name] for name in given if name in MEASURES}}
    chosen = find(own, group.kind)
    answer = answer_given(chosen, own, level, weights=weights, sites=sites)
    return with_remarks(answer, unused_measures(chosen, own))


def _together(
    parts: Sequence[tuple[NDArray[np.intp], PredictionArray]],
    refused: Sequence[Refused],
    blocks: Blocks,
    shape: tuple[int, ...],
    level: float,
    index: Any,
) -> PredictionArray:
    """Return the answers of several models as one, in the order of the blocks."""
    size = int(np.prod(shape))
    columns: dict[str, Any] = {}
    for name in _COLUMNS:
        known = [(at, value) for at, part in parts if (value := getattr(part, name)) is not None]
        if known or name != "block_sd":
            columns[name] = column = np.full(size, np.nan)
            for at, value in known:
                column[at] = value
    in_domain = np.zeros(size, dtype=np.bool_)
    reasons: list[ReasonPart] = []
    for at, part in parts:
        in_domain[at] = part.in_domain
        reasons += [(at[places], texts) for places, texts in part.reasons.parts]
    reasons += [(each.places, each.texts) for each in refused]
    ruled: list[ReasonPart] = [(at, partial(getattr, part, "how")) for at, part in parts]
    nothing = np.empty(0, dtype=np.intp)
    unstable = np.concatenate([nothing, *(each.places for each in blocks.unstable)])
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
    codes = {"kind_codes": blocks.kinds, "mode_codes": blocks.modes}
    grid: dict[str, Any] = {n: each.reshape(shape) for n, each in codes.items() if each is not None}
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
