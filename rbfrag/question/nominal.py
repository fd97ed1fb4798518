"""Predictions for stated values of block and shaking, without errors of measurement.

For a single block neither numpy nor any other library is loaded.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from os import PathLike
from typing import TYPE_CHECKING, Any, Literal

from rbfrag.errors import InputError
from rbfrag.fragility.measures import MEASURES
from rbfrag.fragility.model import AT_REST
from rbfrag.fragility.model_selection import find_model, unused_measures
from rbfrag.fragility.prediction import (
    Prediction,
    add_warnings,
    answer_given,
    is_single,
    with_values,
)
from rbfrag.question.classify import Blocks, classify_block, has_shape, read_by_some
from rbfrag.question.components import SINGLE_ASSUMED, SINGLE_COMPONENT, depends_on_component
from rbfrag.question.shape_validation import size_questions
from rbfrag.results.diagnostic import Diagnostic, diagnostics
from rbfrag.solver.kinds import BY_MECHANICS, facts_of
from rbfrag.vocabulary import quantities
from rbfrag.vocabulary.quantities import (
    SCENARIO,
    SHAKING,
)
from rbfrag.vocabulary.spectral import SpectralSet

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from rbfrag.fragility.model import FragilityModel, Model
    from rbfrag.fragility.prediction_array import PredictionArray


MEASURED = frozenset(quantities.MEASURED)
"""Standard deviations of measured fields."""
ONE_FOR_ALL = frozenset({"block", "back_fracture"})
"""Fields that hold one thing for all blocks."""


OF_SHAKING = SpectralSet({*SHAKING, *MEASURES})
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


def ask_stated(
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
    draws: bool = False,
) -> Prediction | PredictionArray:
    """Return the prediction for blocks without measurement errors; see :func:`predict`.

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
        draws: they are draws of blocks, each of which is answered by its own mode.
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
        answer = ask_stated(
            inputs, kind=kind, mode=mode, rotation_deg=rotation_deg, sites=sites, model=model,
            level=level, db=db, nan=nan, interval=interval, weights=weights, component=component,
            rows=rows, draws=draws,
        )  # fmt: skip
        if is_scenario:  # measures that the question does not name
            remaining = [w for w in diagnostics(answer.warnings) if w.code != "unused_measures"]
            answer = with_values(answer, warnings=tuple(remaining))
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
        if all(name in ONE_FOR_ALL or is_single(value) for name, value in inputs.items()):
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

    def find(values: Mapping[str, Any], of: str | None) -> FragilityModel:
        try:
            return find_model(model, values, db, kind=of, rotation_deg=rotation_deg)
        except InputError:
            if not draws:
                raise
            return find_model(None, values, db, kind=of)  # a draw of another kind

    answer = ask_many(
        inputs, kind, mode, rows=rows, draws=draws, level=level, **how, find=find
    )  # fmt: skip
    return add_warnings(answer, (), _assumed(component, answer))


def _assumed(component: Any, answer: Prediction | PredictionArray) -> tuple[Diagnostic, ...]:
    """Return the note that a single component is assumed, where P depends on the shaking."""
    if component is not None:
        return ()
    p: Any = answer.probability
    depends = depends_on_component(p) if type(p) is float else depends_on_component(p).any()
    return (SINGLE_ASSUMED,) if depends else ()
