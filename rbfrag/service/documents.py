"""Response documents for OpenAPI, with the types declared by the answers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import fields
from functools import cached_property, reduce
from inspect import getattr_static
from operator import or_
from types import SimpleNamespace, UnionType
from typing import Annotated, Any, TypeVar, get_args, get_origin, get_type_hints

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, create_model

from rbfrag.db.model_file import ModelRow
from rbfrag.exchange.table_answers import TableAnswer
from rbfrag.fragility.prediction import OF_EACH_MODEL, Prediction
from rbfrag.fragility.prediction_array import OF_ARRAYS, PredictionArray
from rbfrag.motions.toppling_spectrum import TopplingSpectrum
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.critical_result import STRENGTH_VALUES, CriticalResult
from rbfrag.solver.stability.joint import JointStrength
from rbfrag.solver.stability.single import KEYS, Cohesion, Stability
from rbfrag.vocabulary.results import RESULTS

T = TypeVar("T", bound=BaseModel)

_LISTS = {np.float64: list[float | None], np.bool_: list[bool], np.object_: list[str]}
"""What JSON has for arrays of a type: NaN is null."""

_NOT_LOADED = {"pd": SimpleNamespace(Index=Any)}
"""What annotations name that a type checker alone imports."""


def with_fields(definitions: dict[str, Any]) -> Callable[[type[T]], type[T]]:
    """Return a decorator that adds fields, each a type and a default, to a model."""

    def extended(model: type[T]) -> type[T]:
        further = {
            name: definition
            for name, definition in definitions.items()
            if name not in model.model_fields
        }
        # under its own name and module, so that other processes find it
        return create_model(
            model.__name__, __base__=model, __doc__=model.__doc__, __module__=model.__module__,
            **further,
        )  # fmt: skip

    return extended


def keys_of(
    *answers: type, names: Sequence[str] = (), omitted: Sequence[str] = ()
) -> Callable[[type[T]], type[T]]:
    """Return a decorator that adds the values of answers to a document.

    Args:
        answers: dataclasses.
        names: fields and properties of the document; all fields by default.
        omitted: fields that the document does not have.
    """
    names = names or [field.name for answer in answers for field in fields(answer)]
    names = [name for name in names if name not in omitted]
    types: dict[str, Any] = {}
    for answer in answers:
        types |= get_type_hints(answer, localns=_NOT_LOADED)
        for name in names:
            member = getattr_static(answer, name, None)
            if isinstance(member, property | cached_property):
                getter = member.fget if isinstance(member, property) else member.func
                types[name] = get_type_hints(getter)["return"]
    return with_fields({name: (_in_json(types[name]), ...) for name in names})


def _in_json(of: Any) -> Any:
    """Return the JSON type for a type that contains arrays."""
    if get_origin(of) is UnionType:
        return reduce(or_, map(_in_json, get_args(of)))
    return _LISTS[get_args(get_args(of)[1])[0]] if get_origin(of) is np.ndarray else of


def _describe(schema: dict[str, Any]) -> None:
    """Add the labels and units of the vocabulary to the keys of a document."""
    for name, of in schema.get("properties", {}).items():
        if about := RESULTS.get(name):
            unit = f" [{about.unit}]" if about.unit else ""
            of.setdefault("description", f"{about.label}{unit}")


class _Document(BaseModel):
    model_config = ConfigDict(
        extra="forbid", allow_inf_nan=False, protected_namespaces=(), json_schema_extra=_describe
    )


Pair = Annotated[list[float], Field(min_length=2, max_length=2)]
"""Two numbers that belong together."""


class Problem(_Document):
    """Problem details (RFC 9457); `traces` are those of a file of which one must be selected."""

    type: str
    title: str
    status: int = Field(description="HTTP status")
    detail: str
    traces: list[str] | None = None


class DiagnosticDocument(_Document):
    """A warning about a table; `rows` are the first affected rows, from 0; none for all."""

    code: str
    severity: str
    text: str
    fields: list[str]
    rows: list[int]
    row_count: int


class LineDocument(_Document):
    """A labelled line of an answer."""

    label: str
    text: str


class TextDocument(_Document):
    """The text of an answer: its sentences, the first with the main result, and lines."""

    sentences: list[str]
    lines: list[LineDocument]


class _Answer(_Document):
    """An answer; `diagnostics` are its warnings with codes, `text` is included on request."""

    diagnostics: list[DiagnosticDocument]
    text: TextDocument | None = None


class SourceDocument(_Document):
    """A source of uncertainty, and its fraction of the variance of the probit of P."""

    source: str
    fraction: float


class SensitivityDocument(_Document):
    """P where a field is off by a usual error, a number of degrees or a fraction of a length."""

    field: str
    step: float
    low: float
    high: float


@keys_of(Prediction, names=OF_EACH_MODEL)
class ModelAnswer(_Document):
    """The answer of one model whose measures are available."""

    recommended: bool
    ci_low: float | None
    ci_high: float | None


@keys_of(Prediction, omitted=("inputs", "alternatives", "drawn"))
class PredictAnswer(_Answer):
    """Probability of failure of a block; the same JSON as `rbfrag predict`.

    `probability` is the mean over all earthquakes and sites with these intensity measures, `ci_low`
    and `ci_high` its confidence interval. `event_low` and `event_high` are the prediction interval
    of the fraction of such blocks that fails at `sites` of one earthquake; null where no sites are
    asked for and where that is unknown. `block_sd` is the standard deviation of P over what an
    uncertain block may be; null where it is certain. `drained` is the answer without water
    pressure, with the yield acceleration; null for a dry block.

    With standard deviations of measured fields `ci_low` and `ci_high` include their errors, by
    source in `uncertainty`, and are null if much of the measured range has no answer. `as_stated`
    is the answer without them, null for a block that is unstable as stated. `sensitivity` has P at
    usual errors of each measured field.
    """

    ci_low: float | None
    ci_high: float | None
    uncertainty: list[SourceDocument]
    sensitivity: list[SensitivityDocument]

    mode: str
    answers: list[ModelAnswer]
    sites: int | None = None


@keys_of(PredictionArray, names=OF_ARRAYS)
class PredictArrays(_Answer):
    """Probabilities of many blocks or motions; null where the input is rejected.

    `drained` has `probability`, `ci_low` and `ci_high` without water pressure, null for dry blocks;
    `as_stated` the same without errors of measurement, null without these; `sensitivity`, on
    request, P at usual errors of each field, and `uncertainty` the fractions of its sources.
    """

    drained: dict[str, list[float | None]] | None
    as_stated: dict[str, list[float | None]] | None
    sensitivity: dict[str, list[float | None]] | None
    uncertainty: dict[str, list[float | None]] | None


@keys_of(TableAnswer, omitted=("blocks",))
class TableAnswers(_Answer):
    """A table of blocks with its answers; the same JSON as `rbfrag predict --blocks`.

    `table` is the CSV file that is written, with the notes below it.
    """

    warnings: list[str]
    table: str


@keys_of(Cohesion)
class CohesionAnswer(_Document):
    """Contribution of the cohesion of the base."""

    ky: float | None
    ky_equivalent: float | None


@keys_of(JointStrength)
class JointAnswer(_Document):
    """Friction of the base from roughness, at the normal stress of its yield."""


@keys_of(Stability, Block, names=KEYS)
class BlockAnswer(_Answer):
    """Failure mode of a block; the same JSON as `rbfrag block`; null where it does not apply."""

    ky: float | None
    yield_acceleration: float | None
    cohesion: CohesionAnswer | None
    joint: JointAnswer | None


class DrawingAnswer(_Document):
    """A block to scale; points are (out of the slope, up) from the centroid [m].

    `kind` is how it fails, `numbers` what predictions of that kind read of it, null where no
    earthquake decides about it or no model answers; `reason` says which. A rectangle whose
    friction is unknown is assumed to be rough: its `ky` means nothing.
    """

    kind: str
    numbers: dict[str, float] | None
    reason: str
    block: BlockAnswer
    rectangle_r3_m: float
    outline_m: list[Pair]
    contacts_m: dict[str, Pair]
    planes_m: list[Pair]
    rock_m: list[Pair]
    resultant_m: Pair


class LossByInputs(_Document):
    """Log losses of a model with these measures."""

    reads: list[str]
    log_loss: float | None
    log_loss_kr05: float | None


@keys_of(ModelRow, names=("name", "kind", "term", "method", "is_default", "created"))
class ModelListed(_Document):
    """A stored model; the same JSON as `rbfrag models list`.

    `reads` names the measures of the shaking that it needs. `log_loss` is that of outcomes of
    earthquakes left out, the smaller the better among models of a kind; `log_loss_kr05` that of
    those of blocks of k_r >= 0.05 alone, null of blocks that are not known by it;
    `losses_by_inputs` has both by the measures that are given, where they differ;
    `sensitive_share` is the share of the simulated outcomes behind it that a change of the motion
    by a millionth changes; null of kinds of which that is not asked.
    """

    reads: list[str]
    n: int | None
    log_loss: float | None
    log_loss_kr05: float | None
    losses_by_inputs: list[LossByInputs]
    events: int | None
    sensitive_share: float | None
    domain: dict[str, Pair]


class Health(_Document):
    """Status of the service."""

    status: str
    version: str


@keys_of(TopplingSpectrum)
class SpectrumAnswer(_Answer):
    """The toppling spectrum of a motion in one polarity; the same JSON as `rbfrag spectrum`."""

    may_topple: bool | None


class MapRow(_Document):
    """An interval of k_r/PGA with one outcome."""

    k_lo: float
    k_hi: float
    outcome: str


@keys_of(CriticalResult, names=(*STRENGTH_VALUES, "polarity", "pga_g", "warnings"))
class CriticalAnswer(_Answer):
    """The largest k_r/PGA that topples; the same JSON as `rbfrag critical`."""

    map: list[MapRow] | None = None


class RockmassAnswer(_Answer):
    """Blocks by mode; the same JSON as `rbfrag rockmass`."""

    realisations: int
    blocks: int
    seed: int
    impossible: dict[str, int]
    variables: dict[str, str]
    back_fracture: bool
    drainage: str | None
    modes: dict[str, dict[str, Any]]
    crossings: list[dict[str, Any]]
    scenario: dict[str, Any] | None
    shaking: dict[str, Any] | None
    warnings: list[str]


class Contribution(_Document):
    """Contribution of an interval of the shaking to a rate [1/yr]."""

    from_: float = Field(alias="from")
    to: float
    annual_rate: float


class SiteRate(_Document):
    """The annual rate of failure at one of several sites [1/yr]."""

    site: str | None
    block_id: str | None
    annual_rate: float
    annual_rate_upper_bound: float | None
    ci_low: float
    ci_high: float
    numerical_error: float
    probability: float
    drained: dict[str, float] | None
    reason: str


class HazardDocument(_Answer):
    """Annual rates of failure [1/yr]; the same JSON as `rbfrag hazard`.

    A curve of one site has the rate and its `contributions`; curves of several sites have a row of
    `blocks` for each and the expected failures of all. `between_measures` is the dispersion of
    rates between intensity measures; null where it is unknown.
    """

    years: float
    level: float
    how: str
    model: str
    term: str
    method: str
    imt: str
    curve_kind: str | None
    between_measures: dict[str, float] | None
    warnings: list[str]
    site: str | None = None
    annual_rate: float | None = None
    annual_rate_upper_bound: float | None = None
    ci_low: float | None = None
    ci_high: float | None = None
    numerical_error: float | None = None
    probability: float | None = None
    drained: dict[str, float] | None = None
    contributions: list[Contribution] | None = None
    annual_rate_any: float | None = None
    expected_failures_per_year: float | None = None
    expected_failures_upper_bound: float | None = None
    expected_failures_low: float | None = None
    expected_failures_high: float | None = None
    blocks: list[SiteRate] | None = None
