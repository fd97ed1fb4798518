"""Probability of failure of blocks under given shaking: `predict`, for every kind of failure.

For a single block neither numpy nor any other library is loaded.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from os import PathLike
from textwrap import wrap
from typing import TYPE_CHECKING, Any, Literal, Unpack, overload

from rbfrag.errors import InputError, UnknownFieldError
from rbfrag.fragility.measures import MEASURES, spectral
from rbfrag.fragility.model import AT_REST
from rbfrag.fragility.model_selection import find_model, unused_measures
from rbfrag.fragility.prediction import (
    A,
    Prediction,
    add_warnings,
    answer_given,
    is_single,
    with_values,
)
from rbfrag.question.classify import Blocks, classify_block, has_shape, read_by_some
from rbfrag.question.components import SINGLE_ASSUMED, SINGLE_COMPONENT
from rbfrag.question.shape_validation import size_questions
from rbfrag.results.diagnostic import Diagnostic
from rbfrag.solver.kinds import BY_MECHANICS, FREE_STANDING, facts_of
from rbfrag.vocabulary.quantities import (
    ARRAYS,
    INPUTS,
    QUANTITIES,
    QUESTION,
    REQUEST,
    SCENARIO,
    SHAKING,
)

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from rbfrag.fragility.model import Model
    from rbfrag.fragility.prediction_array import PredictionArray
    from rbfrag.question.fields import QuestionFields


_KEYWORDS, _OPTIONS = frozenset(QUESTION), frozenset((*REQUEST, *ARRAYS))
_SINGLE = frozenset({"block", "back_fracture"})
"""Fields that hold one thing for all blocks."""


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

    P = F(eta), with eta and F of the model's method (docs/theory/fragility.md), is the share of
    such blocks that fail over all earthquakes and sites with these measures. The interval
    F(eta ± t s) says how well that is known, s being the standard error of eta from the fits that
    each leave an earthquake out and t Student's quantile for as many earthquakes as tell of this
    block. With ``sites`` a range says what share of like blocks fails at so many sites of one
    earthquake. Without shaking, and where mechanics forbids failure
    (k >= PGA, say), P is 0 whatever the model says.

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
    for name, value in question.items():
        if name in _OPTIONS:
            options[name] = value
        elif value is None:
            continue
        elif name == "kind":
            kind = value
        elif name == "sa_g":
            fields |= spectral(value)
        elif name == "motion":
            motion = value
        elif name == "polarity":
            polarity = value
        else:
            fields[name] = value

    def answer(inputs: Mapping[str, Any]) -> Prediction | PredictionArray:
        if motion is not None:
            return _answer_motion(inputs, motion, kind, polarity, options)
        return ask(inputs, kind=kind, **options)

    result = with_drained_bound(answer, fields, kind)
    return result if isinstance(result, Prediction) else result.with_rejected_elements()


def with_drained_bound(
    answer: Callable[[Mapping[str, Any]], A], question: Mapping[str, Any], kind: Any = None
) -> A:
    """Return the prediction; where water stands behind a block, add the one without water pressure.

    The drained bound is the answer to the same question without ``water_m``. It is missing where
    that question has none, as of a block that slides when dry without a displacement limit.

    Args:
        answer: answers a question.
        question: the question: fields of block and shaking.
        kind: how the blocks are asked to fail.
    """
    result = answer(question)
    if not is_wet(question):
        return result
    dry = without_water(question)
    try:
        bound = answer(dry)
    except InputError as error:
        return add_warnings(result, (), (no_drained_bound(error),))
    if isinstance(bound, Prediction):
        (group,) = described(dry, kind).groups
        return with_values(result, drained=_bound_values(bound, group.numbers))
    import numpy as np

    wet = np.asarray(question["water_m"], dtype=np.float64) > 0.0
    answered = np.broadcast_to(wet, bound.probability.shape) & ~np.isnan(result.probability)
    drained = {n: np.where(answered, getattr(bound, n), np.nan) for n in OF_BOUND}
    lost = np.flatnonzero(answered & np.isnan(bound.probability))
    if lost.size:
        note = no_drained_bound(bound.reason.ravel()[lost[0]]).replaced(rows=lost)
        result = add_warnings(result, (), (note,))
    return with_values(result, drained=drained)


def without_water(question: Mapping[str, Any]) -> dict[str, Any]:
    """Return the inputs without water behind the blocks; arrays keep their length."""
    dry = {n: value for n, value in question.items() if n not in ("water_m", "drainage")}
    water: Any = question.get("water_m")
    if water is not None and not isinstance(water, int | float):
        import numpy as np

        dry["water_m"] = np.zeros(np.shape(water))
    return dry


def no_drained_bound(reason: object) -> Diagnostic:
    """Return the note that there is no prediction without water, with the reason."""
    fields = reason.fields if isinstance(reason, InputError) else ()
    return Diagnostic(f"no drained bound: {reason}", "no_drained_bound", fields=fields)


def is_wet(question: Mapping[str, Any]) -> bool:
    """Return whether water stands behind any block."""
    water: Any = question.get("water_m")
    if water is None or isinstance(water, int | float):
        return bool(water is not None and water > 0.0)
    import numpy as np

    return bool((np.asarray(water, dtype=np.float64) > 0.0).any())


OF_BOUND = ("probability", "ci_low", "ci_high")


def _bound_values(bound: Prediction, numbers: Mapping[str, Any]) -> dict[str, float | None]:
    """Return the values of the drained bound, including the yield acceleration.

    Args:
        bound: the answer without water.
        numbers: of the dry block; empty for one that is unstable at rest.
    """
    (name,) = {"kr", "ky", "ks", "kct"} & {*facts_of(bound.kind).parameters}
    return {n: getattr(bound, n) for n in OF_BOUND} | {name: numbers.get(name)}


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


def by_field_name(question: Mapping[str, Any], fields: Collection[str]) -> dict[str, Any]:
    """Translate keywords, option names and column names to field names.

    Args:
        question: values by keyword, option word or name of a column.
        fields: fields that the answer takes.

    Raises:
        UnknownFieldError: a name of no such field, with the one that may be meant.
        InputError: one field by two names.
    """
    from rbfrag.question.table import field_of

    result: dict[str, Any] = {}
    names: dict[str, str] = {}
    for name, value in question.items():
        field = name
        if name not in fields:
            match = field_of(name)
            if match is None or match.field not in fields or match.unit is not None:
                raise unknown_field(name, fields)
            field = match.field
            if match.column == "no_back" and value is not None:
                value = not value
            elif match.column == "free_standing":
                value = FREE_STANDING if value else None
        if field in result:
            both = (names[field], name)
            raise InputError(f"{name} and {names[field]} are the same field: give one", fields=both)
        result[field], names[field] = value, name
    return result


def unknown_field(name: str, fields: Collection[str]) -> UnknownFieldError:
    """Return the error for a name that is not a field, with a suggestion."""
    from difflib import get_close_matches

    from rbfrag.question.table import field_of

    match = field_of(name)
    near = [match.field] if match else get_close_matches(name, fields, 1)
    near = [field for field in near if field in fields]
    hint = f"; did you mean {near[0]!r}?" if near else "; see help(rbfrag.predict)"
    return UnknownFieldError(f"unknown field {name[:60]!r}{hint}")


OF_SHAKING = frozenset({*SHAKING, *MEASURES})
"""Fields that say nothing of the block."""


def described(inputs: Mapping[str, Any], kind: str | None) -> Blocks:
    """Classify the single block of a question, without its intensity measures.

    A block that fails at rest has no numbers; ``at_rest`` has the reason.
    """
    block = {n: value for n, value in inputs.items() if n not in OF_SHAKING}
    return classify_block(block, kind, inputs.get("pga_g"), at_rest=True)


def ask_at_rest(
    measures: Mapping[str, Any],
    blocks: Blocks,
    *,
    model: Model | None = None,
    level: float = 0.95,
    db: str | PathLike[str] | None = None,
    rotation_deg: float | None = None,
    **scenario: Any,
) -> Prediction:
    """Return P = 1 for a block that is unstable without an earthquake, with the reason.

    Args:
        measures: the shaking, which must suffice for a model as it does for any block.
        blocks: the block; ``at_rest`` has the reason.
        model: the model that is asked for; the answer names it, and does not use it.
        level: confidence level.
        db: database of the model.
        rotation_deg: rotation that counts as failure [deg].
        scenario: ``mechanism`` and ``gmm`` of a scenario, and what else the block does not need.
    """
    (group,) = blocks.groups
    assert group.kind is not None
    if scenario.get("mechanism") or scenario.get("gmm") or not SCENARIO.isdisjoint(measures):
        from rbfrag.question.scenario import Source, shaken

        source = Source(scenario.get("mechanism"), scenario.get("gmm"))
        measures, _ = shaken(measures, source, model, db)
    names = (*facts_of(group.kind).parameters, *measures)
    chosen = find_model(model, names, db, kind=group.kind, rotation_deg=rotation_deg)
    text = f"{blocks.at_rest} ({AT_REST})"
    warning = Diagnostic(text, "unstable_at_rest")
    return Prediction(
        group.kind, 1.0, 1.0, 1.0, None, None, level, chosen.row.name, chosen.term.name,
        chosen.method.name, group.kind, None, 0.0, True, (warning,), data=chosen.data,
        how=BY_MECHANICS, inputs=measures,
    )  # fmt: skip


def _answer_motion(
    inputs: Mapping[str, Any], motion: Any, kind: str | None, polarity: Any, options: dict[str, Any]
) -> Prediction:
    from rbfrag.fragility.prediction_motion import predict_motion

    for name in ("mechanism", "gmm", "component"):
        if options.pop(name, None) is not None:
            raise InputError(
                f"{name} cannot be combined with a motion: omit it",
                fields=(name,),
            )
    defaults: dict[str, Any] = {"rotation_deg": None, "model": None, "level": 0.95, "db": None}
    of_arrays = ("nan", "interval")
    options = defaults | {name: value for name, value in options.items() if name not in of_arrays}
    measures = {name: value for name, value in inputs.items() if name in OF_SHAKING}
    blocks = described(inputs, kind)
    group = blocks.groups[0]
    if blocks.at_rest:
        of_record = {"xp_m_s": 0.0, "pga_g": 0.0}
        return add_warnings(ask_at_rest(of_record, blocks, **options), blocks.remarks)
    answer = predict_motion(
        {**group.numbers, **measures}, motion, kind=group.kind, polarity=polarity, **options
    )
    return add_warnings(answer, blocks.remarks)


def ask(
    inputs: Mapping[str, Any],
    *,
    kind: Any = None,
    mode: Any = None,
    rotation_deg: float | None = None,
    sites: float | None = None,
    model: Model | None = None,
    level: float = 0.95,
    db: str | PathLike[str] | None = None,
    nan: Literal["propagate", "raise"] = "propagate",
    interval: bool = True,
    weights: ArrayLike | None = None,
    mechanism: str | Sequence[str | None] | None = None,
    gmm: str | PathLike[str] | None = None,
    component: str | Sequence[str | None] | None = None,
    rows: bool = False,
) -> Prediction | PredictionArray:
    """Return the prediction for blocks and intensity measures by field; see :func:`predict`.

    Args:
        inputs: fields of block and shaking: numbers, or arrays that numpy can broadcast.
        kind: how they fail, for all or one each; None or an empty text for what they say.
        mode: failure modes that are stated, one each and empty for none; None for none at all.
        rotation_deg: rotation that counts as failure [deg].
        sites: number of sites of one earthquake with such blocks.
        model: a model, the name of a stored one, or None.
        level: confidence level.
        db: database of the model.
        nan: what becomes of elements that cannot be used.
        interval: whether an interval is asked for.
        weights: of draws of one block.
        mechanism: how the fault of a scenario moves.
        gmm: table of medians and sigmas of a ground-motion model.
        component: horizontal component of the measures, for all or one each; None for single, with
            a note.
        rows: the arrays are columns of a table, which may state more than is needed.
    """
    if nan not in ("propagate", "raise"):
        raise InputError(f"nan = {nan!r}: use 'propagate' or 'raise'")
    is_single_component = isinstance(component, str) and component == SINGLE_COMPONENT
    converts = component is not None and not is_single_component
    if mechanism is not None or gmm is not None or converts or not SCENARIO.isdisjoint(inputs):
        # Kept apart: most questions state measures.
        from rbfrag.question.scenario import SITE, Source, shaken

        source = Source(mechanism, gmm)
        is_scenario = source != Source() or not inputs.keys().isdisjoint(SITE)
        inputs, remarks = shaken(inputs, source, model, db, component)
        if component is not None or is_scenario:
            component = SINGLE_COMPONENT
        answer = ask(
            inputs, kind=kind, mode=mode, rotation_deg=rotation_deg, sites=sites, model=model,
            level=level, db=db, nan=nan, interval=interval, weights=weights, component=component,
            rows=rows,
        )  # fmt: skip
        return add_warnings(answer, remarks)
    how: dict[str, Any] = {"nan": nan, "interval": interval, "weights": weights, "sites": sites}
    if (kind is None or isinstance(kind, str)) and mode is None and not rows:
        if not has_shape(inputs):
            inputs, unread = read_by_some(inputs)
            chosen = find_model(model, inputs, db, kind=kind, rotation_deg=rotation_deg)
            answer = answer_given(chosen, inputs, level, **how)
            size = size_questions(inputs.get("p2"), getattr(answer.probability, "shape", ()))
            remarks = (*unread, *size, *unused_measures(chosen, inputs))
            return add_warnings(answer, remarks, _assumed(component, answer))
        if all(name in _SINGLE or is_single(value) for name, value in inputs.items()):
            blocks = described(inputs, kind)
            (group,) = blocks.groups
            values = {**group.numbers, **{n: inputs[n] for n in inputs if n in MEASURES}}
            if blocks.at_rest:
                at_rest = ask_at_rest(
                    values, blocks, model=model, level=level, db=db, rotation_deg=rotation_deg
                )
                return add_warnings(at_rest, blocks.remarks)
            chosen = find_model(model, values, db, kind=group.kind, rotation_deg=rotation_deg)
            answer = answer_given(chosen, values, level, **how)
            assert isinstance(answer, Prediction)
            remarks = (*blocks.remarks, *unused_measures(chosen, values))
            return add_warnings(answer, remarks, _assumed(component, answer))
    if "block" in inputs:
        raise InputError("block must be a single block: give several blocks as arrays of fields")
    # Kept apart so that a single block does not load numpy.
    from rbfrag.question.predict_arrays import ask_many

    answer = ask_many(
        inputs, kind, mode, rows=rows, level=level, **how,
        find=lambda values, of: find_model(model, values, db, kind=of, rotation_deg=rotation_deg),
    )  # fmt: skip
    return add_warnings(answer, (), _assumed(component, answer))


def _assumed(component: Any, answer: Prediction | PredictionArray) -> tuple[Diagnostic, ...]:
    """Return the note that a single component is assumed, where P depends on the shaking."""
    if component is not None:
        return ()
    p: Any = answer.probability
    depends = 0.0 < p < 1.0 if type(p) is float else ((p > 0.0) & (p < 1.0)).any()
    return (SINGLE_ASSUMED,) if depends else ()
