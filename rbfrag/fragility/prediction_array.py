"""Predictions of many blocks or motions at once."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import InputError
from rbfrag.fragility.answers import PredictionArray
from rbfrag.fragility.checks import doubts, outside_domain, refusals, unstable
from rbfrag.fragility.functions import array_functions
from rbfrag.fragility.model import FragilityModel
from rbfrag.fragility.terms import toppling_velocity_m_s

FloatArray = NDArray[np.float64]


class _Reasons:
    """Sentences by element: one bit per sentence, so that a million elements cost little."""

    def __init__(self, shape: tuple[int, ...]) -> None:
        self._bits = np.zeros(shape, dtype=np.uint64)
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
        return np.asarray(lines[which.reshape(self._bits.shape)], dtype=object)


def predict_many(
    model: FragilityModel,
    given: Mapping[str, object],
    level: float,
    half_width: float,
    *,
    refuse_nan: bool,
) -> PredictionArray:
    """Return the answers for broadcast arrays; see :func:`rbfrag.fragility.prediction.predict`.

    Args:
        model: the model that answers.
        given: p2, kr and measures of the motion by name, numbers or arrays.
        level: confidence level of the interval.
        half_width: the normal quantile that belongs to it.
        refuse_nan: raise instead of answering NaN.

    Raises:
        InputError: arrays that are not numeric or do not broadcast, or, if asked, an
            element that cannot be used.
    """
    values = _broadcast(given)
    functions = array_functions()
    needed = ("p2", "kr", *model.term.inputs)
    shape = values["p2"].shape
    reasons = _Reasons(shape)
    missing = np.zeros(shape, dtype=bool)

    for refusal in refusals(values, needed):
        if refuse_nan and refusal.holds.any():
            place = tuple(int(i) for i in np.argwhere(refusal.holds)[0])
            raise InputError(f"element {place}: {refusal.about(float(refusal.value[place]))}")
        reasons.add(refusal.holds, refusal.in_general())
        missing |= refusal.holds

    falls = unstable(values).holds & ~missing
    still = (values[model.term.inputs[0]] == 0.0) & ~missing & ~falls
    # Elements that cannot be used run through the formulas too and are overwritten below.
    with np.errstate(all="ignore"):
        x = model.term.intensity_m_s(values)
        y = toppling_velocity_m_s(values["p2"], values["kr"], functions)
        values = {**values, "intensity_m_s": x, "y_m_s": y}
        z, error = model.score(x, y, functions)
        probability, low, high = (
            functions.normal_cdf(score)
            for score in (z, z - half_width * error, z + half_width * error)
        )
        ruled = missing | falls | still
        in_domain = ~missing
        for finding in outside_domain(model, values):
            holds = finding.holds & ~ruled
            in_domain &= ~holds
            reasons.add(holds, finding.in_general())
        for finding in doubts(model, values, functions):
            reasons.add(finding.holds & ~ruled, finding.in_general())
    for answer in (probability, low, high):
        answer[missing] = np.nan
        answer[falls] = 1.0
        answer[still] = 0.0
    reasons.add(falls, "unstable")
    reasons.add(still, "no shaking: P = 0 by definition, not by the model")
    return PredictionArray(
        probability=probability,
        ci_low=low,
        ci_high=high,
        in_domain=in_domain,
        reason=reasons.texts(),
        # Copies: the intensity may be the caller's own array.
        y_m_s=np.where(missing, np.nan, y),
        intensity_m_s=np.where(missing, np.nan, x),
        level=level,
        model=model.name,
        term=model.term.name,
        method=model.row.method,
    )


def _broadcast(given: Mapping[str, object]) -> dict[str, FloatArray]:
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
        return dict(zip(arrays, np.broadcast_arrays(*arrays.values()), strict=True))
    except ValueError:
        shapes = ", ".join(f"{name} {array.shape}" for name, array in arrays.items())
        raise InputError(
            f"the arrays do not fit together: {shapes}; give shapes that numpy can broadcast"
        ) from None
