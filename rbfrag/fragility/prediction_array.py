"""Predictions of many blocks or motions at once."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import InputError
from rbfrag.fragility import formulas
from rbfrag.fragility.answers import PredictionArray, Reasons
from rbfrag.fragility.checks import BOUNDS, doubts, not_lifted, outside_domain, refusals, unstable
from rbfrag.fragility.functions import array_functions
from rbfrag.fragility.measures import toppling_velocity_m_s
from rbfrag.fragility.model import FragilityModel
from rbfrag.fragility.prediction_values import NEUTRAL, derived, neutral_tm_s

FloatArray = NDArray[np.float64]

CHUNK = 1 << 17
"""Rows that are worked on at a time: what they need stays near the processor."""

COMPILED_FROM = 20_000
"""Rows from which on the compiled formulas are worth loading."""

NO_FLOOR = (0.0,) * (2 * formulas.FLOOR_NODES)

_COMPILED = "rbfrag.fragility.compiled_formulas"


def predict_many(
    model: FragilityModel,
    given: Mapping[str, object],
    level: float,
    half_width: float,
    *,
    refuse_nan: bool,
) -> PredictionArray:
    """Return the answers for broadcast arrays; see :func:`rbfrag.fragility.predict.predict`.

    Args:
        model: the model that answers.
        given: p2, kr and measures of the motion by name, numbers or arrays.
        level: confidence level of the interval.
        half_width: the quantile that belongs to it.
        refuse_nan: raise instead of answering NaN.

    Raises:
        InputError: arrays that are not numeric or do not broadcast, or, if asked, an
            element that cannot be used.
    """
    values, shape = _flat(given)
    size = int(np.prod(shape))
    probability, low, high, y, x = (np.empty(size) for _ in range(5))
    in_domain = np.ones(size, dtype=np.bool_)
    reasons = Reasons(shape)
    compiled = size >= COMPILED_FROM or _COMPILED in sys.modules

    def work(start: int) -> list[tuple[NDArray[np.intp], NDArray[np.object_]]]:
        part = slice(start, min(start + CHUNK, size))
        own = {name: v if v.size == 1 else v[part] for name, v in values.items()}
        with np.errstate(all="ignore"):
            intensity = np.asarray(model.term.intensity_m_s(own), dtype=np.float64)
        x[part] = intensity
        odd = _plain_part(
            model, own, intensity, half_width, y[part], probability[part], low[part], high[part],
            compiled=compiled,
        )  # fmt: skip
        if not odd.size:
            return []
        chosen = {n: v.repeat(odd.size) if v.size == 1 else v[odd] for n, v in own.items()}
        place = odd + start
        texts = _with_words(
            model, chosen, half_width, place, shape, refuse_nan=refuse_nan,
            out=(probability, low, high, y, x, in_domain),
        )  # fmt: skip
        return [(place, texts)]

    starts = range(0, size, CHUNK)
    if len(starts) > 1:
        with ThreadPoolExecutor(min(len(starts), os.cpu_count() or 1)) as pool:
            found = list(pool.map(work, starts))
    else:
        found = [work(start) for start in starts]
    for each in found:
        for place, texts in each:
            reasons.put(place, texts)
    return PredictionArray(
        probability=probability.reshape(shape),
        ci_low=low.reshape(shape),
        ci_high=high.reshape(shape),
        in_domain=in_domain.reshape(shape),
        reasons=reasons,
        y_m_s=y.reshape(shape),
        intensity_m_s=x.reshape(shape),
        level=level,
        model=model.name,
        term=model.term.name,
        method=model.row.method,
        notes=model.notes,
    )


def _plain_part(
    model: FragilityModel,
    values: Mapping[str, FloatArray],
    x: FloatArray,
    half_width: float,
    y: FloatArray,
    probability: FloatArray,
    low: FloatArray,
    high: FloatArray,
    *,
    compiled: bool,
) -> NDArray[np.intp]:
    """Fill the answers that need no words; return the positions of the others."""
    neutral = {**NEUTRAL, "tm_s": neutral_tm_s(model)}
    columns = [
        values["p2"],
        values["kr"],
        x,
        *(
            values.get(name, np.array([neutral[name]]))
            for name in ("pgv_m_s", "pga_g", "tm_s", "pgd_m")
        ),
    ]
    both = "pgv_m_s" in values and "pga_g" in values
    plain = np.zeros(y.size, dtype=np.bool_)
    if compiled:
        from rbfrag.fragility.compiled_formulas import plain_answers

        plain_answers(model.shape, model.link)(
            model.padded,
            model.packed_covariance,
            np.array(model.floor or NO_FLOOR),
            half_width,
            model.limits_with_both if both else model.limits,
            *columns,
            y,
            probability,
            low,
            high,
            plain,
        )
    return np.flatnonzero(~plain)


def _with_words(
    model: FragilityModel,
    values: dict[str, FloatArray],
    half_width: float,
    place: NDArray[np.intp],
    shape: tuple[int, ...],
    *,
    refuse_nan: bool,
    out: tuple[Any, ...],
) -> NDArray[np.object_]:
    """Answer elements of which there may be something to say; return what is said."""
    n = place.size
    functions = array_functions()
    said = _Sentences(n)
    missing = np.zeros(n, dtype=bool)
    for refusal in refusals(values, ("p2", "kr", *model.term.inputs)):
        if refuse_nan and refusal.holds.any():
            first = int(np.flatnonzero(refusal.holds)[0])
            where = tuple(int(i) for i in np.unravel_index(place[first], shape))
            raise InputError(f"element {where}: {refusal.about(float(refusal.value[first]))}")
        said.add(refusal.holds, refusal.in_general())
        missing |= refusal.holds

    falls = unstable(values).holds & ~missing
    still = (values[model.term.inputs[0]] == 0.0) & ~missing & ~falls
    ruled = missing | falls | still
    with np.errstate(all="ignore"):
        x = np.asarray(model.term.intensity_m_s(values), dtype=np.float64)
        y = np.maximum(
            toppling_velocity_m_s(values["p2"], values["kr"], functions), formulas.LEAST_Y_M_S
        )
        values = derived({**values, "intensity_m_s": x, "y_m_s": y})
        gate = not_lifted(model, values)
        kept = np.zeros(n, dtype=bool) if gate is None else gate.holds & ~ruled
        middle, low, high = (np.zeros(n) for _ in range(3))
        asked = np.flatnonzero(~ruled & ~kept)
        codes = _answer_each(model, values, half_width, asked, middle, low, high)
        certain = ruled | kept
        certain[asked[codes != formulas.FREE]] = True
        if gate is not None:
            said.add(kept, gate.in_general())
        for code, (name, text) in BOUNDS.items():
            holds = np.zeros(n, dtype=bool)
            holds[asked[codes == code]] = True
            said.add(holds, f"{name} {text}")
        in_domain = ~missing
        for finding in outside_domain(model, values):
            holds = finding.holds & ~certain
            in_domain &= ~holds
            said.add(holds, finding.in_general())
        for finding in doubts(model, values, functions):
            said.add(finding.holds & ~ruled, finding.in_general())
    for answer in (middle, low, high):
        answer[missing] = np.nan
        answer[falls] = 1.0
    said.add(falls, "unstable")
    said.add(still, "no shaking: P = 0 by definition, not by the model")
    y[missing] = x[missing] = np.nan
    for target, filled in zip(out, (middle, low, high, y, x, in_domain), strict=True):
        target[place] = filled
    return said.texts()


def _answer_each(
    model: FragilityModel,
    values: Mapping[str, FloatArray],
    half_width: float,
    asked: NDArray[np.intp],
    middle: FloatArray,
    low: FloatArray,
    high: FloatArray,
) -> NDArray[np.int64]:
    """Fill the answers at some positions; return the bound that holds at each."""
    n = asked.size
    y, p = values["y_m_s"][asked], np.sqrt(values["p2"][asked])
    x = np.maximum(values["intensity_m_s"][asked], formulas.LEAST_Y_M_S)
    pga, tm = (
        values[name][asked] if name in values else np.full(n, NEUTRAL[name])
        for name in ("pga_g", "tm_s")
    )
    pga = np.maximum(pga, formulas.LEAST_Y_M_S)
    codes = np.zeros(n, dtype=np.int64)
    if n >= COMPILED_FROM or _COMPILED in sys.modules:
        from rbfrag.fragility.compiled_formulas import answers, bounds

        three = np.empty((3, n))
        bounds(model.shape, y, p, x, pga, codes)
        answers(
            model.shape,
            model.link,
            np.array(model.padded),
            np.array(model.packed_covariance),
            np.array(model.floor or NO_FLOOR),
            half_width,
            y, p, x, pga, tm, *three,
        )  # fmt: skip
        middle[asked], low[asked], high[asked] = three
        return codes
    columns = zip(
        asked.tolist(), y.tolist(), p.tolist(), x.tolist(), pga.tolist(), tm.tolist(), strict=True
    )
    for number, (i, y_i, p_i, x_i, pga_i, tm_i) in enumerate(columns):
        codes[number] = formulas.bound(model.shape, y_i, p_i, x_i, pga_i)
        middle[i], low[i], high[i] = formulas.answer(
            model.shape,
            model.link,
            model.padded,
            model.packed_covariance,
            model.floor,
            half_width,
            y_i,
            p_i,
            x_i,
            pga_i,
            tm_i,
        )
    return codes


class _Sentences:
    """Sentences by element: one bit per sentence, so that a million elements cost little."""

    def __init__(self, n: int) -> None:
        self._bits = np.zeros(n, dtype=np.uint64)
        self._sentences: list[str] = []

    def add(self, where: NDArray[np.bool_], sentence: str) -> None:
        if where.any():
            self._bits[where] |= np.uint64(1 << len(self._sentences))
            self._sentences.append(sentence)

    def texts(self) -> NDArray[np.object_]:
        kinds, which = np.unique(self._bits, return_inverse=True)
        lines = np.empty(kinds.shape, dtype=object)
        for i, bits in enumerate(kinds.tolist()):
            lines[i] = "; ".join(s for k, s in enumerate(self._sentences) if bits >> k & 1)
        return np.asarray(lines[which], dtype=object)


def _flat(given: Mapping[str, object]) -> tuple[dict[str, FloatArray], tuple[int, ...]]:
    """Return flat arrays of the broadcast size, or of size 1, and the broadcast shape."""
    arrays: dict[str, FloatArray] = {}
    for name, value in given.items():
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
            f"the arrays do not fit together: {shapes}; give shapes that numpy can broadcast"
        ) from None
    flat = {
        name: array.reshape(1)
        if array.size == 1
        else np.ascontiguousarray(np.broadcast_to(array, shape)).reshape(-1)
        for name, array in arrays.items()
    }
    return flat, shape
