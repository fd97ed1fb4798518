"""The probability that a block topples: `predict`.

For single numbers neither numpy nor any other library is loaded.
"""

from __future__ import annotations

from collections.abc import Mapping
from os import PathLike
from typing import TYPE_CHECKING, Literal, overload

from rbfrag.db.rows import ModelRow
from rbfrag.errors import InputError
from rbfrag.fragility.answers import Prediction, PredictionArray
from rbfrag.fragility.checks import doubts, outside_domain, refusals, unstable
from rbfrag.fragility.functions import SCALAR, normal_half_width
from rbfrag.fragility.model import FragilityModel
from rbfrag.fragility.model_lookup import find_model
from rbfrag.fragility.terms import toppling_velocity_m_s

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    Given = Mapping[str, float] | Mapping[str, ArrayLike]

Model = ModelRow | FragilityModel | str


@overload
def predict(
    p2: float,
    kr: float,
    *,
    pgv_m_s: float | None = ...,
    pga_g: float | None = ...,
    tm_s: float | None = ...,
    pgd_m: float | None = ...,
    model: Model | None = ...,
    level: float = ...,
    db: str | PathLike[str] | None = ...,
    nan: Literal["propagate", "raise"] = ...,
) -> Prediction: ...


@overload
def predict(
    p2: ArrayLike,
    kr: ArrayLike,
    *,
    pgv_m_s: ArrayLike | None = ...,
    pga_g: ArrayLike | None = ...,
    tm_s: ArrayLike | None = ...,
    pgd_m: ArrayLike | None = ...,
    model: Model | None = ...,
    level: float = ...,
    db: str | PathLike[str] | None = ...,
    nan: Literal["propagate", "raise"] = ...,
) -> Prediction | PredictionArray: ...


def predict(
    p2: ArrayLike,
    kr: ArrayLike,
    *,
    pgv_m_s: ArrayLike | None = None,
    pga_g: ArrayLike | None = None,
    tm_s: ArrayLike | None = None,
    pgd_m: ArrayLike | None = None,
    model: Model | None = None,
    level: float = 0.95,
    db: str | PathLike[str] | None = None,
    nan: Literal["propagate", "raise"] = "propagate",
) -> Prediction | PredictionArray:
    """Return the probability that a block topples, with its confidence interval.

    P = Φ(z), z = (c0 + c1 x - y)/sqrt(v(x)), y = k_r g/p (equations 4.28-4.31 of the
    dissertation with M = 1). The interval is Φ(z ± q s), s being the standard error of z by
    the delta method from the covariance of all parameters; it always lies within 0 and 1.
    Without shaking (x = 0) P is 0, whatever the model says.

    Args:
        p2: frequency parameter p² of the block [1/s²], scalar or array.
        kr: its yield acceleration coefficient for toppling at rest [-].
        pgv_m_s: peak ground velocity of the horizontal component [m/s].
        pga_g: peak ground acceleration [g].
        tm_s: mean period [s].
        pgd_m: peak ground displacement [m].
        model: a model, the name of a stored one, or None for the database's default; when
            the default needs other measures than are given, the best model that they
            suffice for answers (pgv, then pga_tm, then pgd_tm).
        level: confidence level of the interval, between 0 and 1.
        db: database of the model: a path or SQLAlchemy URL; None for ``RBFRAG_DB``, or else
            ``rbfrag.db`` in the current folder.
        nan: in arrays, ``propagate`` answers NaN with its reason where the input cannot be
            used, ``raise`` refuses such arrays.

    Returns:
        :class:`Prediction` when every argument is a single number, otherwise
        :class:`PredictionArray` of the broadcast shape. In arrays a block with k_r <= 0
        falls at rest: P = 1 with the reason ``unstable``.

    Raises:
        InputError: a value that cannot be used, or measures the model cannot work with.
        UnknownModelError: no model of that name.
        DatabaseError: the database cannot be read.
    """
    if nan not in ("propagate", "raise"):
        raise InputError(f"nan = {nan!r}: use 'propagate' or 'raise'")
    half_width = normal_half_width(level)
    offered = {
        "p2": p2,
        "kr": kr,
        "pgv_m_s": pgv_m_s,
        "pga_g": pga_g,
        "tm_s": tm_s,
        "pgd_m": pgd_m,
    }
    given = {name: value for name, value in offered.items() if value is not None}
    for name in ("p2", "kr"):
        if name not in given:
            raise InputError(f"{name} is missing: a block is given by p2 [1/s²] and kr [-]")
    chosen = find_model(model, given, db)
    if all(_is_single(value) for value in given.values()):
        singles = {name: _single(name, value) for name, value in given.items()}
        return _predict_one(chosen, singles, level, half_width)
    # Kept apart so that single numbers do not load numpy.
    from rbfrag.fragility.prediction_array import predict_many

    return predict_many(chosen, given, level, half_width, refuse_nan=nan == "raise")


def _is_single(value: object) -> bool:
    if isinstance(value, int | float | str | bytes):
        return True
    shape = getattr(value, "shape", None)
    if shape is not None:
        return len(shape) == 0
    return not hasattr(value, "__len__") and not hasattr(value, "__iter__")


def _single(name: str, value: object) -> float:
    if isinstance(value, bool | str | bytes):
        raise InputError(f"{name} = {value!r} is not a number: give a number or an array")
    try:
        return float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError):
        raise InputError(f"{name} = {value!r} is not a number: give a number or an array") from None


def _predict_one(
    model: FragilityModel, values: dict[str, float], level: float, half_width: float
) -> Prediction:
    for refusal in refusals(values, values):
        if refusal.holds:
            raise InputError(refusal.about(refusal.value))
    falls = unstable(values)
    if falls.holds:
        raise InputError(falls.about(falls.value))

    x = model.term.intensity_m_s(values)
    y = toppling_velocity_m_s(values["p2"], values["kr"], SCALAR)
    if values[model.term.inputs[0]] == 0.0:
        probability = low = high = 0.0
        in_domain, warnings = True, ["no shaking: P = 0 by definition, not by the model"]
    else:
        values = {**values, "intensity_m_s": x, "y_m_s": y}
        z, error = model.score(x, y, SCALAR)
        probability, low, high = (
            SCALAR.normal_cdf(score)
            for score in (z, z - half_width * error, z + half_width * error)
        )
        warnings = [f.about(f.value) for f in outside_domain(model, values) if f.holds]
        in_domain = not warnings
        warnings += [f.about(f.value) for f in doubts(model, values, SCALAR) if f.holds]
    return Prediction(
        probability=probability,
        ci_low=low,
        ci_high=high,
        level=level,
        model=model.name,
        term=model.term.name,
        method=model.row.method,
        y_m_s=y,
        intensity_m_s=x,
        in_domain=in_domain,
        warnings=tuple(warnings),
    )
