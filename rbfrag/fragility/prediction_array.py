"""Predictions of many blocks or motions at once."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import InputError
from rbfrag.fragility.confidence import Quantiles
from rbfrag.fragility.measures import ABOUT_SCATTER, most_over_pga
from rbfrag.fragility.method import ArrayNamespace, arrays
from rbfrag.fragility.model import AT_REST, Answer, FragilityModel
from rbfrag.fragility.validation import (
    NOTABLE_SHARE,
    Remark,
    answer_with_findings,
    describe_invalid,
)
from rbfrag.results.diagnostic import Diagnostic, diagnostics, texts_by_row
from rbfrag.results.numbers import count_of, interval
from rbfrag.results.result import Result, TextLine
from rbfrag.solver.kinds import BY_MECHANICS, KINDS, mode_of_kind
from rbfrag.solver.results import FloatArray
from rbfrag.solver.stability.modes import MODES
from rbfrag.vocabulary.spectral import spectral_names

if TYPE_CHECKING:
    import pandas as pd

T = TypeVar("T")

Texts = NDArray[np.object_]
ReasonPart = tuple[NDArray[np.intp], Texts | Callable[[], Texts]]

Columns = dict[str, NDArray[Any]]
"""Flat arrays to be filled, by name."""

OF_ARRAYS = (
    "probability", "ci_low", "ci_high", "event_low", "event_high", "block_sd", "in_domain", "how",
    "reason", "kind", "kinds", "modes", "level", "model", "term", "method", "data", "warnings",
    "drained", "as_stated", "sensitivity", "uncertainty",
)  # fmt: skip
"""Keys of the JSON document."""

_BY_NAME = ("drained", "as_stated", "sensitivity", "uncertainty")
"""Keys with several columns each."""

CHUNK = 1 << 14
"""Rows that are worked on at a time: what they need stays near the processor."""


class Reasons:
    """Reasons by element, stored as flat indices and texts; texts are generated on demand."""

    def __init__(self, shape: tuple[int, ...], parts: Sequence[ReasonPart]) -> None:
        """Store the reasons of some elements, as texts or as functions that generate them."""
        self.shape, self.parts = shape, parts

    def array(self) -> NDArray[np.object_]:
        """Return the text of every element; empty without a reason."""
        result = np.full(self.shape, "", dtype=object)
        for indices, texts in self.parts:
            result.flat[indices] = texts() if callable(texts) else texts
        return result

    def text_at(self, index: int) -> str:
        """Return the text of one element, by its index in the flat array."""
        text = ""
        for indices, texts in self.parts:
            if (hits := np.flatnonzero(indices == index)).size:
                text = (texts() if callable(texts) else texts)[hits[-1]]
        return text


@dataclass(frozen=True, eq=False, repr=False)
class PredictionArray(Result):
    """Failure probabilities of many blocks or motions; all arrays have the broadcast shape.

    Args:
        kind: how the blocks fail.
        probability: P; NaN where the input cannot be used.
        ci_low: lower end of the confidence interval of P; NaN where none was asked for.
        ci_high: upper end of it.
        event_low: lower end of the share of like blocks that fails at the sites asked for in one
            earthquake; NaN where none are and where the model does not know it.
        event_high: upper end of it.
        in_domain: True where block and motion lie in the ranges that were fitted.
        reasons: why an answer is missing, ruled or to be doubted; read them by :attr:`reason`.
        y_m_s: velocity k g/p of the blocks [m/s]; NaN where they have no size.
        intensity_m_s: intensity term of the motions [m/s].
        level: confidence level of the interval.
        model: name of the model that answered.
        term: its intensity term.
        method: how it was fitted.
        warnings: what to know about the answer.
        block_sd: standard deviation of P over what each uncertain block may be; None where all are
            certain.
        data: the database that the model is of; None of a model that was given itself.
        index: labels of the rows, of the pandas Series that were given; None without one.
        kind_codes: kind of each element, a place among all kinds, -1 for none; None where all are
            of one kind.
        mode_codes: failure mode of each, a place among all modes, -1 where it is not known.
        state_codes: why elements have no answer, 1 and the place among
            :data:`rbfrag.question.shape_validation.STATES`, 0 for others; None for none.
        read: fields of the blocks that the answer depends on, where some stated more.
        ruled: what answered in place of a model; read it by :attr:`how`.
        drained: ``probability``, ``ci_low`` and ``ci_high`` of the blocks without water pressure,
            NaN for dry blocks; None where all are dry.
        as_stated: with standard deviations of measured fields the same of the values as they are
            stated, NaN for blocks that are unstable as stated; None without.
        sensitivity: on request P at usual errors of each measured field, by the name of the field
            with ``_low`` and ``_high``; None where it is not asked for.
        uncertainty: with it, fractions of the variance of the probit of P by source, NaN for blocks
            without errors of measurement; None without.
    """

    kind: str
    probability: FloatArray
    ci_low: FloatArray
    ci_high: FloatArray
    event_low: FloatArray
    event_high: FloatArray
    in_domain: NDArray[np.bool_]
    reasons: Reasons
    y_m_s: FloatArray
    intensity_m_s: FloatArray
    level: float
    model: str
    term: str
    method: str
    warnings: tuple[str, ...] = ()
    block_sd: FloatArray | None = None
    data: str | None = None
    index: pd.Index | None = None
    kind_codes: NDArray[np.int8] | None = None
    mode_codes: NDArray[np.int8] | None = None
    state_codes: NDArray[np.int8] | None = None
    read: frozenset[str] = frozenset()
    ruled: Reasons | None = None
    drained: Mapping[str, FloatArray] | None = None
    as_stated: Mapping[str, FloatArray] | None = None
    sensitivity: Mapping[str, FloatArray] | None = None
    uncertainty: Mapping[str, FloatArray] | None = None

    @property
    def how(self) -> NDArray[np.object_]:
        """Source of each probability: ``by mechanics`` or ``model NAME``; empty without a
        probability.
        """
        names = np.full(self.probability.shape, f"model {self.model}", dtype=object)
        ruled = names if self.ruled is None else self.ruled.array()
        return np.where(np.isnan(self.probability), "", np.where(ruled == "", names, ruled))

    @property
    def kinds(self) -> NDArray[np.object_]:
        """Kind of failure of each block; empty if unknown."""
        if self.kind_codes is None:
            return np.full(self.probability.shape, self.kind, dtype=object)
        return np.array([*KINDS, ""], dtype=object)[self.kind_codes]

    @property
    def modes(self) -> NDArray[np.object_]:
        """Failure mode of each block; empty if unknown."""
        if self.mode_codes is None:
            return np.full(self.probability.shape, mode_of_kind(self.kind), dtype=object)
        return np.array([*MODES, ""], dtype=object)[self.mode_codes]

    @cached_property
    def reason(self) -> NDArray[np.object_]:
        """Reason why a probability is missing, fixed by mechanics or doubtful; otherwise empty."""
        return self.reasons.array()

    def with_rejected_elements(self) -> PredictionArray:
        """Add a warning where elements have no probability."""
        missing = np.isnan(self.probability)
        count = int(np.count_nonzero(missing))
        if not count:
            return self
        first = int(np.argmax(missing.ravel()))
        reason = self.reasons.text_at(first)
        warnings = describe_invalid(count, missing.size, [f"element {first}"], [reason])
        return replace(self, warnings=(*self.warnings, *warnings))

    def sentences(self) -> Iterator[str]:
        """Yield the range of the probabilities: "P(toppling) = 0.1–47 % of 12 blocks"."""
        p = self.probability[~np.isnan(self.probability)]
        missing = self.probability.size - p.size
        text = "No probability"
        if p.size:
            state = self.kind.replace("_", " ") if self.kind in KINDS else "failure"
            ends = interval(float(p.min()), float(p.max()))
            text = f"P({state}) {ends if ends[0] in '<>' else f'= {ends}'}"
        without = f"; {missing:,} without answer" if missing else ""
        yield f"{text} of {count_of(p.size or missing, 'block')}{without if p.size else ''}"

    def lines(self) -> Iterator[TextLine]:
        """Yield the models and the number of elements within their fitted ranges."""
        inside = f"{np.count_nonzero(self.in_domain):,} of {self.in_domain.size:,}"
        yield TextLine("Model", f"{self.model}, {self.data}; {inside} within the fitted range")

    def as_dict(self) -> dict[str, Any]:
        """Return the predictions under the keys of the JSON contract; NaN becomes null."""
        values = {name: getattr(self, name) for name in OF_ARRAYS}
        values["warnings"] = [*self.warnings]
        for name in _BY_NAME:
            if (columns := values[name]) is not None:
                values[name] = {n: column.tolist() for n, column in columns.items()}
        return {n: v.tolist() if hasattr(v, "tolist") else v for n, v in values.items()}

    def table_columns(self) -> dict[str, Any]:
        """Return the columns by name; arrays are flat."""
        columns = super().table_columns()
        kinds = {"kind": self.kinds.ravel(), "mode": self.modes.ravel()}
        readable = {n: column for n, column in columns.items() if not n.endswith("_codes")}
        more = {
            f"{bound}_{n}": column.ravel()
            for bound in _BY_NAME
            for n, column in (getattr(self, bound) or {}).items()
        }
        last = {"how": self.how.ravel(), "reason": self.reason.ravel()}
        return {**readable, **kinds, **more, **last}

    def to_frame(self) -> pd.DataFrame:
        """Return the predictions as a pandas DataFrame, with the index of the input Series."""
        frame = super().to_frame()
        return frame if self.index is None else frame.set_axis(self.index)


def predict_many(
    model: FragilityModel,
    inputs: Mapping[str, object],
    quantiles: Quantiles,
    *,
    interval: bool,
    reject_nan: bool,
) -> PredictionArray:
    """Return the predictions for broadcast arrays; see :func:`rbfrag.question.question.predict`.

    Args:
        inputs: block and measures of the motion by name, numbers or arrays.
        quantiles: of the confidence level.
        interval: whether an interval is asked for.
        reject_nan: raise instead of answering NaN.

    Raises:
        InputError: arrays that are not numeric or do not broadcast, or, if asked, an
            element that cannot be used.
    """
    index = index_of(inputs)
    values, shape = flat(inputs)
    size = int(np.prod(shape))
    ns = arrays()
    names = ("probability", "low", "high", "y_m_s", "intensity_m_s")
    out: Columns = dict(zip(names, np.empty((5, size)), strict=True))
    out["in_domain"] = np.ones(size, dtype=np.bool_)
    if model.of_uncertain_block:
        out["block_sd"] = np.empty(size)
    reach = quantiles if interval else None
    if not interval:
        out["low"][:] = out["high"][:] = np.nan

    def answer(start: int) -> NDArray[np.intp]:
        part = slice(start, min(start + CHUNK, size))
        part_inputs = {name: v if v.size == 1 else v[part] for name, v in values.items()}
        with np.errstate(all="ignore"):
            return _answer_part(model, part_inputs, reach, part, out, ns) + start

    # gathered: the words cost as much for a few elements as for thousands
    flagged = np.concatenate([np.empty(0, dtype=np.intp), *_in_chunks(answer, size)])

    def explain(start: int) -> tuple[NDArray[np.intp], Texts, Texts, list[Diagnostic]]:
        indices = flagged[start : start + CHUNK]
        chunk_inputs = {
            n: v.repeat(indices.size) if v.size == 1 else v[indices] for n, v in values.items()
        }
        with np.errstate(all="ignore"):
            return indices, *_answer_with_diagnostics(
                model, chunk_inputs, reach, indices, shape, out, reject_nan=reject_nan
            )

    explained = _in_chunks(explain, flagged.size)
    out = {name: column.reshape(shape) for name, column in out.items()}
    return PredictionArray(
        kind=model.kind,
        probability=out["probability"],
        ci_low=out["low"],
        ci_high=out["high"],
        event_low=np.full(shape, np.nan),
        event_high=np.full(shape, np.nan),
        in_domain=out["in_domain"],
        reasons=Reasons(shape, [(indices, texts) for indices, texts, *_ in explained]),
        y_m_s=out["y_m_s"],
        intensity_m_s=out["intensity_m_s"],
        level=quantiles.level,
        model=model.name,
        term=model.term.name,
        method=model.method.name,
        warnings=diagnostics(model.notes, *(warnings for *_, warnings in explained)),
        block_sd=out.get("block_sd"),
        data=model.data,
        index=index if shape == (0 if index is None else len(index),) else None,
        ruled=Reasons(shape, [(indices, how) for indices, _, how, _ in explained]),
    )


def index_of(inputs: Mapping[str, Any]) -> pd.Index | None:
    """Return the index of pandas Series inputs; None without Series.

    Raises:
        InputError: Series of different indices: pandas would join them by their labels.
    """
    series = {name: value for name, value in inputs.items() if hasattr(value, "iloc")}
    if not series:
        return None
    first, *rest = series
    for name in rest:
        if not series[name].index.equals(series[first].index):
            raise InputError(
                f"{first} and {name} are Series of different index: join them first, or give "
                "arrays (to_numpy()), which are matched by position"
            )
    index: pd.Index = series[first].index
    return index


def _in_chunks(work: Callable[[int], T], size: int) -> list[T]:
    """Return the results of a function for the start of every chunk, with one thread per core."""
    chunks = range(0, size, CHUNK)
    workers = min(len(chunks), os.cpu_count() or 1)
    if workers <= 1:
        return [work(start) for start in chunks]
    with ThreadPoolExecutor(workers) as pool:
        return list(pool.map(work, chunks))


def _answer_part(
    model: FragilityModel,
    inputs: Mapping[str, FloatArray],
    quantiles: Quantiles | None,
    part: slice,
    out: Columns,
    ns: ArrayNamespace,
) -> NDArray[np.intp]:
    """Fill the predictions of a part; return the indices that need warnings."""
    method, block = model.method, model.method.block
    values = model.with_ratios(model.completed(inputs, ns))
    clear = np.ones(part.stop - part.start, dtype=np.bool_)
    for name, least, most in model.clear_ranges(values):
        clear &= values[name] >= least
        clear &= values[name] <= most
    bounds = (*model.bounds(values), *block.rejects)
    flags = [bound.holds(values) for bound in bounds]
    if method.doubts is not None:
        flags += [holds for holds, _, _ in method.doubts(model.parameters, values, ns)]
    if "pga_g" in values:
        spectrum = spectral_names(model.term.inputs)
        flags += [values[name] > most_over_pga(name) * values["pga_g"] for name in spectrum]
    for holds in flags:
        clear &= np.logical_not(holds)
    if model.spread is not None:
        clear &= model.spread.holds(values, ns)
    answer = model.answer(values, quantiles, ns, inputs)
    if answer.outside is not None:
        clear &= answer.outside < NOTABLE_SHARE
    for name, value in _answered(out, answer):
        out[name][part] = value
    out["y_m_s"][part] = values.get("y_m_s", np.nan)
    out["intensity_m_s"][part] = values["intensity_m_s"]
    return np.flatnonzero(~clear)


def _answer_with_diagnostics(
    model: FragilityModel,
    inputs: dict[str, FloatArray],
    quantiles: Quantiles | None,
    indices: NDArray[np.intp],
    shape: tuple[int, ...],
    out: Columns,
    *,
    reject_nan: bool,
) -> tuple[Texts, Texts, list[Diagnostic]]:
    """Fill the elements that need explanation; return their reasons, sources and warnings."""
    reasons: list[tuple[str, NDArray[np.bool_]]] = []
    ruled: list[tuple[str, NDArray[np.bool_]]] = []
    warnings: list[Diagnostic] = []
    at_rest = np.zeros(indices.size, dtype=np.bool_)

    def say(holds: NDArray[np.bool_], finding: Remark) -> None:
        if not holds.any():
            return
        text = finding.in_general()
        reasons.append((text, holds))
        warnings.append(Diagnostic(text, finding.code, rows=indices[holds]))
        if finding.how:
            ruled.append((finding.how, holds))

    def reject(holds: NDArray[np.bool_], finding: Remark) -> None:
        if reject_nan and holds.any():
            first = int(np.flatnonzero(holds)[0])
            where = tuple(int(i) for i in np.unravel_index(indices[first], shape))
            text = f"element {where}: {finding.about(float(finding.value[first]))}"
            raise InputError(text, fields=(finding.name,))
        if holds.any():
            reasons.append((finding.in_general(), holds))

    def unstable(holds: NDArray[np.bool_], _: Remark) -> None:
        at_rest[:] = holds
        if holds.any():
            reasons.append(("unstable", holds))
            ruled.append((BY_MECHANICS, holds))
            warnings.append(Diagnostic(AT_REST, "unstable_at_rest", rows=indices[holds]))

    block = model.method.block
    optional = [name for name in (*block.options, *block.sigmas, *ABOUT_SCATTER) if name in inputs]
    needed = [*block.names, *model.term.inputs, *optional]
    judgement = answer_with_findings(
        model, inputs, needed, quantiles, arrays(),
        say=say, reject=reject, unstable=unstable,
        nothing=np.zeros(indices.size, dtype=np.bool_),
    )  # fmt: skip
    for name, answer in _answered(out, judgement.answer):
        values = np.where(judgement.ruled, 0.0, answer)
        values[at_rest] = 0.0 if name == "block_sd" else 1.0
        values[judgement.missing] = np.nan
        out[name][indices] = values
    y = judgement.values.get("y_m_s", np.nan)
    for name, value in (("y_m_s", y), ("intensity_m_s", judgement.intensity_m_s)):
        out[name][indices] = np.where(judgement.missing, np.nan, value)
    out["in_domain"][indices] = judgement.in_domain
    size = indices.size
    return texts_by_row(reasons, size, "; "), texts_by_row(ruled, size, "; "), warnings


def _answered(out: Columns, answer: Answer) -> list[tuple[str, Any]]:
    """Return the names of the columns that a model fills, each with its values."""
    pairs = zip(Answer._fields, answer, strict=True)
    return [(name, value) for name, value in pairs if name in out and value is not None]


def flat(inputs: Mapping[str, object]) -> tuple[dict[str, FloatArray], tuple[int, ...]]:
    """Return flat arrays of the broadcast size, or of size 1, and the broadcast shape."""
    arrays: dict[str, FloatArray] = {}
    for name, value in inputs.items():
        try:
            if isinstance(value, np.ma.MaskedArray):
                # Under a mask lies a number that means nothing.
                value = np.ma.filled(value.astype(np.float64), np.nan)
            arrays[name] = np.asarray(value, dtype=np.float64)
        except (TypeError, ValueError, OverflowError) as error:
            raise InputError(f"{name} is not an array of numbers: {error}") from None
    try:
        shape = np.broadcast_shapes(*(array.shape for array in arrays.values()))
    except ValueError:
        shapes = ", ".join(f"{name} {array.shape}" for name, array in arrays.items())
        raise InputError(
            f"the shapes of the arrays are not compatible: {shapes}; give shapes that numpy can "
            "broadcast"
        ) from None
    flat = {
        name: array.reshape(1)
        if array.size == 1
        else np.ascontiguousarray(np.broadcast_to(array, shape)).reshape(-1)
        for name, array in arrays.items()
    }
    return flat, shape
