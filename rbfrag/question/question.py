"""Probability of failure of blocks under given shaking: `predict`, for every kind of failure.

For a single block neither numpy nor any other library is loaded.
"""

from __future__ import annotations

from collections.abc import Mapping
from textwrap import wrap
from typing import TYPE_CHECKING, Any, Unpack, overload

from rbfrag.errors import InputError
from rbfrag.fragility.prediction import Prediction, add_warnings, is_single
from rbfrag.question.drained_bound import with_drained_bound
from rbfrag.question.keywords import by_field_name
from rbfrag.question.nominal import (
    MEASURED,
    OF_SHAKING,
    ONE_FOR_ALL,
    ask_at_rest,
    ask_stated,
    described,
)
from rbfrag.vocabulary.quantities import ARRAYS, INPUTS, INVERSE, QUANTITIES, QUESTION, REQUEST
from rbfrag.vocabulary.spectral import BY_PERIOD, spectral_inputs

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from rbfrag.fragility.prediction_array import PredictionArray
    from rbfrag.question.fields import QuestionFields


_KEYWORDS, _OPTIONS = frozenset(QUESTION), frozenset((*REQUEST, *ARRAYS))


@overload
def predict(
    p2: float | None = ...,
    kr: float | None = ...,
    /,
    **question: Unpack[QuestionFields[float | None]],
) -> Prediction: ...


@overload
def predict(
    p2: ArrayLike | None = ...,
    kr: ArrayLike | None = ...,
    /,
    **question: Unpack[QuestionFields[ArrayLike | None]],
) -> Prediction | PredictionArray: ...


def predict(p2: Any = None, kr: Any = None, /, **question: Any) -> Prediction | PredictionArray:
    """Return the probability that a block fails, with its confidence interval.

    P = F(eta), with eta and F of the model's method (docs/theory/fragility.md), is the fraction of
    such blocks that fail over all earthquakes and sites with these measures. Its interval is
    F(eta ± t s): s is the standard error of eta from fits that leave one earthquake out each, t the
    Student t quantile with the effective (Satterthwaite) degrees of freedom. With ``sites`` the
    prediction interval of a single earthquake is the range of the fraction that fails at so many
    sites. Without shaking, and where mechanics excludes failure (k >= PGA), P is 0.

    A block is given by p2 and kr (it topples, or rocks if `kind` says so), by ky and displacement_m
    (it slides further than that), by ks and ps2 (it slumps), by kct and
    pct2 (it topples confined), or by its shape, dip and friction, which tell how it fails; each is
    a number or an array. What is given with a standard deviation is the median of what the block
    may be: P is then the mean over all that, with its interval, and ``block_sd`` how much P differs
    among them. Strength and size are lognormal, a restitution
    is normal, cut off at 0 and 1, and all are independent.

    The keywords:

    KEYWORDS

    Args:
        p2: frequency parameter p² of the block [1/s²].
        kr: its yield acceleration coefficient for toppling at rest [-].
        question: the fields of block and shaking, and what is asked of them, by keyword.

    Returns:
        :class:`Prediction` when every argument is a single number (with `motion` and both
        polarities :class:`MotionPrediction`), otherwise
        :class:`~rbfrag.fragility.prediction_array.PredictionArray` of the broadcast shape. In
        arrays a block that fails at rest has P = 1 and the reason ``unstable``.

    Raises:
        InputError: a value that cannot be used, measures the model cannot work with, or a shape
            that is described in part, slides without a displacement or is of another kind.
        UnknownFieldError: a keyword that is none.
        UnknownModelError: no model of that name.
        DatabaseError: the database cannot be read.
    """
    if not question.keys() <= _KEYWORDS:
        question = by_field_name(question, _KEYWORDS)
    fields: dict[str, Any] = {} if p2 is None else {"p2": p2}
    if kr is not None:
        fields["kr"] = kr
    if not question.keys().isdisjoint(fields):
        raise InputError("p2 and kr are given twice, by position and by name: give each once")
    options: dict[str, Any] = {}
    kind, polarity, motion = None, "both", None
    inverse: dict[str, Any] = {}
    for name, value in question.items():
        if name in _OPTIONS:
            options[name] = value
        elif value is None:
            continue
        elif name == "kind":
            kind = value
        elif name in BY_PERIOD:
            fields |= spectral_inputs(name, value)
        elif name == "motion":
            motion = value
        elif name == "polarity":
            polarity = value
        elif name in INVERSE:
            inverse[name] = value
        else:
            fields[name] = value

    def answer(inputs: Mapping[str, Any], **more: float) -> Any:
        if motion is not None:
            return _answer_motion(inputs, motion, kind, polarity, options, **more)
        return ask(inputs, kind=kind, **options, **more)

    if inverse:
        from rbfrag.question.inverse import solve

        return solve(answer, fields, kind, **inverse)
    result = with_drained_bound(answer, fields, kind)
    return result if isinstance(result, Prediction) else result.with_rejected_elements()


def _describe_keywords() -> str:
    """Return the list of keywords for the documentation."""
    lines = []
    for name in QUESTION:
        help = QUANTITIES[name].help("``{}``".format)
        if INPUTS[name].type is bool:
            help = f"False for {help[:1].lower()}{help[1:]}"
        text = f"- ``{name}``: {help}"
        lines += wrap(text, 92, initial_indent="    ", subsequent_indent="      ")
    return "\n".join(lines)


if predict.__doc__:  # python -OO leaves none
    predict.__doc__ = predict.__doc__.replace("    KEYWORDS", _describe_keywords())


def _answer_motion(
    inputs: Mapping[str, Any],
    motion: Any,
    kind: str | None,
    polarity: Any,
    options: dict[str, Any],
    **more: float,
) -> Prediction:
    from rbfrag.fragility.prediction_motion import predict_motion

    for name in ("mechanism", "gmm", "component"):
        if options.pop(name, None) is not None:
            raise InputError(
                f"{name} cannot be combined with a motion: omit it",
                fields=(name,),
            )
    defaults: dict[str, Any] = {"rotation_deg": None, "model": None, "level": 0.95, "db": None}
    of_arrays = ("nan", "interval", "sensitivity")
    options = dict(options)
    about = {"sensitivity": options.get("sensitivity")}
    options = defaults | {name: value for name, value in options.items() if name not in of_arrays}

    def answer(nominal: Mapping[str, Any]) -> Prediction:
        measures = {name: value for name, value in nominal.items() if name in OF_SHAKING}
        blocks = described(nominal, kind)
        group = blocks.groups[0]
        if blocks.at_rest:
            of_record = {"xp_m_s": 0.0, "pga_g": 0.0}
            return add_warnings(ask_at_rest(of_record, blocks, **options), blocks.remarks)
        numbers = {**group.numbers, **measures}
        result = predict_motion(numbers, motion, kind=group.kind, polarity=polarity, **options)
        return add_warnings(result, blocks.remarks)

    if MEASURED.isdisjoint(inputs) and not about["sensitivity"]:
        return answer(inputs)
    from rbfrag.question.measurement import answering_motion, with_measurement_errors

    draws = answering_motion(motion, polarity)
    return with_measurement_errors(answer, inputs, kind, options | about, draws, **more)


def ask(
    inputs: Mapping[str, Any], *, kind: Any = None, added_kr: float = 0.0, **how: Any
) -> Prediction | PredictionArray:
    """Return the prediction for blocks and shaking, with their measurement errors.

    Arguments as for :func:`ask_stated`; `inputs` may have standard deviations of measured fields,
    ``sensitivity`` asks for P at usual errors, and `added_kr` is added to k_r of each draw.
    """
    is_scenario = how.get("gmm") is not None or "rjb_km" in inputs
    sensitivity = how.pop("sensitivity", False)
    if MEASURED.isdisjoint(inputs) and not sensitivity:
        if not is_scenario or how.get("weights") is not None:
            return ask_stated(inputs, kind=kind, **how)
    elif how.get("weights") is not None:
        text = "standard deviations cannot be combined with draws, which give the dispersion"
        raise InputError(text, fields=tuple(MEASURED.intersection(inputs)))

    def answer(nominal: Mapping[str, Any]) -> Any:
        return ask_stated(nominal, kind=kind, **how)

    if not how.get("rows") and all(n in ONE_FOR_ALL or is_single(v) for n, v in inputs.items()):
        from rbfrag.question.measurement import with_measurement_errors

        about = {**how, "sensitivity": sensitivity}
        return with_measurement_errors(answer, inputs, kind, about, added_kr=added_kr)
    from rbfrag.question.measurement_arrays import with_errors_of_arrays

    return with_errors_of_arrays(answer, inputs, kind, how, sensitivity=sensitivity)
