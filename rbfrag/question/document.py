"""Prediction for one block, with those of all suitable models."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from os import PathLike
from typing import TYPE_CHECKING, Any

from rbfrag.errors import InputError
from rbfrag.fragility.measures import AMPLIFIED, MEASURES
from rbfrag.fragility.model_selection import find_model, suited_models, unused_measures
from rbfrag.fragility.prediction import Prediction, add_warnings, answer_given, with_values
from rbfrag.question.classify import has_shape
from rbfrag.question.components import (
    SINGLE_ASSUMED,
    depends_on_component,
    to_single_component,
)
from rbfrag.question.drained_bound import with_drained_bound
from rbfrag.question.nominal import MEASURED, OF_SHAKING, ask_at_rest, described
from rbfrag.results.diagnostic import Diagnostic, diagnostics
from rbfrag.vocabulary.quantities import SCENARIO

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from rbfrag.fragility.model import FragilityModel
    from rbfrag.fragility.prediction_motion import Polarity
    from rbfrag.motions.readers import MotionLike


def answer_block(inputs: Mapping[str, Any], *, kind: str | None = None, **how: Any) -> Prediction:
    """Return the prediction for one block, given by its geometry or its numbers.

    Args:
        inputs: fields of block and shaking.
        kind: how the block fails; None for what it is given by.
        how: as for :func:`answer_numbers`.

    Raises:
        InputError: as of :func:`answer_numbers`, and a block that is described in part.
    """
    warnings = how.pop("remarks", ())
    target, solve_for = how.pop("target_probability", None), how.pop("solve_for", None)

    def answer_stated(question: Mapping[str, Any]) -> Prediction:
        return _answer_described(question, kind=kind, **how)

    def answer(question: Mapping[str, Any], **more: float) -> Prediction:
        is_scenario = how.get("gmm") is not None or "rjb_km" in question
        if MEASURED.isdisjoint(question) and not is_scenario and not has_shape(question):
            return answer_stated(question)
        from rbfrag.question.measurement import answering, answering_motion, with_measurement_errors

        motion = how.get("motion")
        draws = answering if motion is None else answering_motion(motion, how.get("polarity"))
        about = {**how, "sensitivity": True}
        return with_measurement_errors(answer_stated, question, kind, about, draws, **more)

    if target is not None or solve_for is not None:
        from rbfrag.question.inverse import solve

        result = solve(answer, inputs, kind, target, solve_for)
    else:
        result = with_drained_bound(answer, inputs, kind)
    return with_values(result, warnings=diagnostics(warnings, result.warnings))


def _answer_described(inputs: Mapping[str, Any], *, kind: str | None, **how: Any) -> Prediction:
    blocks = described(inputs, kind)
    (group,) = blocks.groups
    measures = {name: value for name, value in inputs.items() if name in OF_SHAKING}
    if not blocks.at_rest:
        numbers = {**group.numbers, **measures}
        answer = answer_numbers(numbers, kind=group.kind, remarks=blocks.remarks, **how)
        return with_values(answer, inputs={**inputs, **answer.inputs})
    # what is wrong with the shaking is found as for a block that stands
    motion = how.pop("motion", None)
    shaking = measures | ({} if motion is None else {"xp_m_s": 0.0, "pga_g": 0.0})
    names = ("kind", "model", "level", "db", "mechanism", "gmm", "rotation_deg", "sites")
    options = {name: how[name] for name in names if how.get(name) is not None}
    answer = add_warnings(ask_at_rest(shaking, blocks, **options), blocks.remarks)
    sites = None if how.get("sites") is None else int(how["sites"])
    return with_values(answer, alternatives=(answer,), inputs=measures, sites=sites)


def answer_numbers(
    question: Mapping[str, ArrayLike],
    *,
    kind: str | None = None,
    rotation_deg: float | None = None,
    sites: float | None = None,
    motion: MotionLike | None = None,
    polarity: Polarity = "both",
    model: str | None = None,
    level: float = 0.95,
    db: str | PathLike[str] | None = None,
    remarks: Sequence[str] = (),
    weights: ArrayLike | None = None,
    mechanism: str | None = None,
    gmm: str | PathLike[str] | None = None,
    component: str | None = None,
) -> Prediction:
    """Return the prediction of the best model, with those of all suitable models.

    Args:
        question: block and what is known of the motion, by the names of :func:`predict`.
        kind: how the block fails; None for what it is given by.
        rotation_deg: rotation that counts as failure, where models of several are fitted [deg].
        sites: number of sites of one earthquake with such blocks; None for one block.
        motion: the accelerogram itself.
        polarity: forward, reverse or both; with `motion` only.
        model: name of a stored model; None for the best for each term that the measures
            suffice for.
        level: confidence level of the interval.
        db: database of the models, as for :func:`predict`.
        remarks: warnings about the block, which go before those of the answer.
        weights: of draws of the block, which the arrays are then.
        mechanism: how the fault of a scenario moves.
        gmm: table of medians and sigmas of a ground-motion model.
        component: horizontal component of the measures; None for single, with a note.

    Raises:
        InputError: a value that cannot be used, or measures no model can work with.
        UnknownModelError: no model of that name.
        DatabaseError: the database cannot be read.
    """
    is_component_assumed = component is None and motion is None
    source, inputs, is_scenario = (mechanism, gmm, component), question, False
    if source != (None, None, None) or not SCENARIO.isdisjoint(question):
        if motion is not None:
            raise InputError(
                "the motion is the shaking at the site: omit rjb_km, vs30_m_s, amplification, "
                "mechanism, gmm and component",
                fields=(*SCENARIO, "mechanism", "gmm", "component"),
            )
        from rbfrag.question.scenario import SITE, Source, describe_source, shaken

        if source[:2] != (None, None) or not question.keys().isdisjoint(SITE):
            is_component_assumed, is_scenario = False, True
            inputs = {**inputs, **describe_source(Source(mechanism, gmm))}
        question, further = shaken(question, Source(mechanism, gmm), model, db, component)
        remarks = (*remarks, *further)
    answers: list[Prediction] = []
    unused: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    if motion is not None:
        # Kept apart: a motion needs numpy.
        from rbfrag.fragility.prediction_motion import predict_motion

        answers = [
            predict_motion(
                question, motion, kind=kind, rotation_deg=rotation_deg, polarity=polarity,
                model=model, level=level, db=db, sites=sites,
            )
        ]  # fmt: skip
    else:
        options: dict[str, Any] = {"kind": kind, "rotation_deg": rotation_deg}
        try:
            models = (
                suited_models(question, db, **options)
                if model is None
                else [find_model(model, question, db, **options)]
            )
        except InputError as error:
            # fields of the question, which each interface prints in its own spelling
            error.fields = error.fields or tuple(MEASURES)
            raise
        for suited_model in models:
            answer = answer_given(suited_model, question, level, weights=weights, sites=sites)
            assert isinstance(answer, Prediction)
            answers.append(answer)
        unused = () if is_scenario else unused_measures(models[0], question)
        if is_component_assumed and depends_on_component(answers[0].probability):
            notes = (_as_rotd50(models[0], question, weights, answers[0].probability),)
    return with_values(
        answers[0],
        warnings=diagnostics(remarks, unused, answers[0].warnings, notes),
        alternatives=tuple(answers),
        inputs=inputs,
        sites=None if sites is None else int(sites),
    )


def _as_rotd50(
    model: FragilityModel,
    inputs: Mapping[str, ArrayLike],
    weights: ArrayLike | None,
    probability: float,
) -> Diagnostic:
    """Return the note that a single component is assumed, with P for RotD50 if it differs."""
    from rbfrag.fragility import describe
    from rbfrag.results.numbers import percent

    rotd50 = answer_given(model, to_single_component(inputs, "rotd50"), 0.95, weights=weights)
    assert isinstance(rotd50, Prediction)
    would_be = percent(rotd50.probability)
    if would_be == percent(probability):
        would_be = "the same"
    names = [name for name in model.term.inputs if name in AMPLIFIED]
    are = "is" if len(names) == 1 else "are"
    return Diagnostic(
        f"{describe.measures(names)} {are} assumed to be of a single horizontal component; as "
        f"RotD50 P would be {would_be}",
        SINGLE_ASSUMED.code,
        fields=SINGLE_ASSUMED.fields,
    )
