"""The probability that a block topples: `predict`.

For single numbers neither numpy nor any other library is loaded.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from os import PathLike
from typing import TYPE_CHECKING, Literal, overload

from rbfrag.db.rows import ModelRow
from rbfrag.errors import InputError
from rbfrag.fragility import formulas
from rbfrag.fragility.answers import Prediction, PredictionArray
from rbfrag.fragility.lookup import find_model
from rbfrag.fragility.model import FragilityModel
from rbfrag.fragility.prediction_values import neutral_tm_s, pgv_over_pga_s
from rbfrag.fragility.quantiles import student_half_width
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from rbfrag.motions.ground_motion import GroundMotion

    Given = Mapping[str, float] | Mapping[str, ArrayLike]

Model = ModelRow | FragilityModel | str
Polarity = Literal["forward", "reverse", "both"]

_SINGLE_TYPES = (float, int, str, bytes)

MEASURES = ("pgv_m_s", "pga_g", "tm_s", "pgd_m")
"""What may be known of a motion."""


@overload
def predict(
    p2: float,
    kr: float,
    *,
    pgv_m_s: float | None = ...,
    pga_g: float | None = ...,
    tm_s: float | None = ...,
    pgd_m: float | None = ...,
    motion: GroundMotion | None = ...,
    polarity: Polarity = ...,
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
    motion: GroundMotion | None = ...,
    polarity: Polarity = ...,
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
    motion: GroundMotion | None = None,
    polarity: Polarity = "both",
    model: Model | None = None,
    level: float = 0.95,
    db: str | PathLike[str] | None = None,
    nan: Literal["propagate", "raise"] = "propagate",
) -> Prediction | PredictionArray:
    """Return the probability that a block topples, with its confidence interval.

    P = F(eta), with eta and F of the model's method (docs/theory/fragility.md). The interval is
    F(eta ± t s), s being the standard error of eta by the delta method from the covariance of
    all parameters and t Student's quantile for as many earthquakes as were fitted; it is never
    narrower than that of a model which knows more. Without shaking, and where mechanics
    forbids toppling (k_r >= PGA, say), P is 0 whatever the model says.

    Args:
        p2: frequency parameter p² of the block [1/s²], scalar or array.
        kr: its yield acceleration coefficient for toppling at rest [-].
        pgv_m_s: peak ground velocity of the horizontal component [m/s].
        pga_g: peak ground acceleration [g].
        tm_s: mean period [s].
        pgd_m: peak ground displacement [m].
        motion: the accelerogram itself, instead of its measures; its toppling spectrum answers.
        polarity: ``forward`` or ``reverse`` where it is known how the motion points at the slope;
            ``both`` gives the mean of the two, which stand beside it (motion only).
        model: a model, the name of a stored one, or None for the best one that what is given
            suffices for: the database's default where it suffices for no less than any other.
        level: confidence level of the interval, between 0 and 1.
        db: database of the model: a path or SQLAlchemy URL; None for ``RBFRAG_DB``, or else
            ``rbfrag.db`` in the current folder, or else the reference that is shipped.
        nan: in arrays, ``propagate`` answers NaN with its reason where the input cannot be
            used, ``raise`` refuses such arrays.

    Returns:
        :class:`Prediction` when every argument is a single number (with `motion` and unknown
        polarity its kind :class:`MotionPrediction`), otherwise :class:`PredictionArray` of the
        broadcast shape. In arrays a block with k_r <= 0 falls at rest: P = 1 with the reason
        ``unstable``.

    Raises:
        InputError: a value that cannot be used, or measures the model cannot work with.
        UnknownModelError: no model of that name.
        DatabaseError: the database cannot be read.
    """
    if nan not in ("propagate", "raise"):
        raise InputError(f"nan = {nan!r}: use 'propagate' or 'raise'")
    given: dict[str, ArrayLike] = {}
    if p2 is not None:
        given["p2"] = p2
    if kr is not None:
        given["kr"] = kr
    if pgv_m_s is not None:
        given["pgv_m_s"] = pgv_m_s
    if pga_g is not None:
        given["pga_g"] = pga_g
    if tm_s is not None:
        given["tm_s"] = tm_s
    if pgd_m is not None:
        given["pgd_m"] = pgd_m
    if "p2" not in given or "kr" not in given:
        missing = "p2" if "p2" not in given else "kr"
        raise InputError(f"{missing} is missing: a block is given by p2 [1/s²] and kr [-]")
    if motion is not None:
        # Kept apart: a motion needs numpy.
        from rbfrag.fragility.prediction_motion import predict_motion

        return predict_motion(
            given, motion, polarity=polarity, model=model, level=level, db=db, nan=nan
        )
    chosen = find_model(model, given, db)
    return answer_given(chosen, given, level, nan=nan)


def answer_given(
    model: FragilityModel,
    given: Mapping[str, ArrayLike],
    level: float,
    *,
    nan: Literal["propagate", "raise"] = "propagate",
) -> Prediction | PredictionArray:
    """Return the answer of one model for values by name; see :func:`predict`."""
    half_width = half_width_of(model, level)
    singles: dict[str, float] = {}
    for name, value in given.items():
        if not is_single(value):
            break
        singles[name] = single(name, value)
    else:
        return _predict_one(model, singles, level, half_width)
    # Kept apart so that single numbers do not load numpy.
    from rbfrag.fragility.prediction_array import predict_many

    return predict_many(model, given, level, half_width, refuse_nan=nan == "raise")


def half_width_of(model: FragilityModel, level: float) -> float:
    """Return the quantile that the interval of a model reaches to.

    Raises:
        InputError: the level is not between 0 and 1.
    """
    try:
        return student_half_width(level, model.degrees_of_freedom)
    except TypeError:  # not even hashable
        raise InputError(
            f"level = {level!r}: a confidence level lies between 0 and 1, such as 0.95"
        ) from None


def is_single(value: object) -> bool:
    """Return whether a value is one number (or something else that is no array)."""
    if isinstance(value, _SINGLE_TYPES):
        return True
    shape = getattr(value, "shape", None)
    if shape is not None:
        return len(shape) == 0
    return not hasattr(value, "__len__") and not hasattr(value, "__iter__")


def single(name: str, value: object) -> float:
    """Return a value as a float.

    Raises:
        InputError: it is no number.
    """
    if type(value) is float:
        return value
    if isinstance(value, bool | str | bytes):
        raise InputError(f"{name} = {value!r} is not a number: give a number or an array")
    try:
        return float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError):
        raise InputError(f"{name} = {value!r} is not a number: give a number or an array") from None


def _predict_one(
    model: FragilityModel, values: dict[str, float], level: float, half_width: float
) -> Prediction:
    p2, kr = values["p2"], values["kr"]
    pgv, pga = values.get("pgv_m_s"), values.get("pga_g")
    tm = values.get("tm_s")
    both = pgv is not None and pga is not None
    if p2 > 0.0:
        try:
            x: float = model.term.formula(*[values[name] for name in model.term.inputs])
        except ArithmeticError:  # Tm = 0, which the words below refuse
            x = math.nan
        p = math.sqrt(p2)
        y = kr * STANDARD_GRAVITY_M_S2 / p
        if formulas.is_plain(
            model.shape,
            model.padded,
            model.limits_with_both if both else model.limits,
            p2,
            p,
            kr,
            y,
            x,
            1.0 if pgv is None else pgv,
            5.0 if pga is None else pga,
            neutral_tm_s(model) if tm is None else tm,
            values.get("pgd_m", 1.0),
        ):
            probability, low, high = formulas.answer(
                model.shape,
                model.link,
                model.padded,
                model.packed_covariance,
                model.floor,
                half_width,
                y,
                p,
                x,
                5.0 if pga is None else pga,
                1.0 if tm is None else tm,
            )
            return Prediction(
                probability,
                low,
                high,
                level,
                model.name,
                model.term.name,
                model.row.method,
                y,
                x,
                True,
                model.notes,
                pgv_over_pga_s(pgv, pga) if both else None,
            )
    from rbfrag.fragility.prediction_words import predict_with_words

    return predict_with_words(model, values, level, half_width)
