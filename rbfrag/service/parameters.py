"""Parameters of the operations, in a query or a body, generated from the declared fields.

A parameter has the name of the command line's option without its dashes, and the same unit.
Values are read here as numbers and
texts; the packages below decide which can be used, with the same texts for every interface.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Annotated, Any, Literal, TypeVar

from pydantic import BaseModel, ConfigDict, Field, StrictFloat, WithJsonSchema

from rbfrag.errors import InputError
from rbfrag.question.keywords import LEVEL
from rbfrag.service.documents import with_fields
from rbfrag.vocabulary.quantities import (
    ANSWERING,
    AT_REST,
    BLOCK,
    COMMON,
    COMPONENT,
    INPUTS,
    INTENSITY,
    INVERSE,
    JOINT,
    MEASURED,
    OTHER_WORDS,
    PLANES,
    QUANTITIES,
    REQUEST,
    SHAKING,
    SHAPE,
    SPACE,
    inputs_from,
    name_of,
    parameter_of,
)
from rbfrag.vocabulary.quantity import Limits
from rbfrag.vocabulary.spectral import SpectralSet

T = TypeVar("T", bound=BaseModel)

Text = Annotated[str, Field(min_length=1, max_length=200)]
Positive = Annotated[float, Field(gt=0.0)]

PerCent = Annotated[str, Field(pattern=r"^[0-9.,]+ ?%$", max_length=20)]
"""A standard deviation as a fraction of its field: "5%"."""

Column = StrictFloat | Annotated[list[StrictFloat | None], Field(min_length=1, fail_fast=True)]
"""A number that stands for every element, or a list of one an element, null where there is none."""

COLUMNS = SpectralSet((*BLOCK, *MEASURED, *SHAKING, "cohesion_pa", "density_kg_m3"))
"""Fields of which many blocks have one each."""

_TEXTS = frozenset((*SPACE, *COMPONENT, "drainage"))
"""Texts of which many blocks have one each."""

_NOT_SENT = frozenset({"block", "db", "gmm"})
"""Fields that no request can state."""

_HOW = ("kind", *REQUEST, *INVERSE)
"""Fields that say how a question is answered."""

_DEFAULTS = {"level": LEVEL}


def _limited(of: Any, limits: Limits) -> Any:
    """Return a type whose schema has a range, which is not validated here."""
    keys = {
        "exclusiveMinimum": limits.above, "minimum": limits.least,
        "exclusiveMaximum": limits.below, "maximum": limits.most,
    }  # fmt: skip
    bounds = {word: limit for word, limit in keys.items() if limit is not None}
    return Annotated[of, WithJsonSchema({"type": "number", **bounds})]


def asking(
    *names: str, many: bool = False, examples: Mapping[str, float] | None = None
) -> Callable[[type[T]], type[T]]:
    """Return a decorator that adds the parameters of fields to a model.

    Args:
        names: the fields.
        many: whether lists may be given of blocks and measures.
        examples: values of parameters in the documentation.
    """
    words = {parameter_of(name): name for name in names if name not in _NOT_SENT}
    words |= {word: name for word, name in OTHER_WORDS.items() if name in names}
    definitions: dict[str, Any] = {}
    for word, name in words.items():
        type_, default = INPUTS[name].type, _DEFAULTS.get(name)
        of: Any = bool
        if type_ is dict:
            of = (dict[str, Column] if many else list[Text]) | None
            default = None
        elif type_ is bool:
            default = False
        elif type_ is str:
            of = Text | None
            if many and name in _TEXTS:
                of = Annotated[list[Text | None], Field(min_length=1)] | of
        elif many and name in COLUMNS:
            of = Column | None
        else:
            of = _limited(StrictFloat if many else float, QUANTITIES[name].range)
            of = of | None if default is None else of
        if name in MEASURED and QUANTITIES[name].unit not in ("", "deg"):
            of = of | PerCent
        shown = [examples[word]] if examples and word in examples else None
        field = Field(description=QUANTITIES[name].help(parameter_of), examples=shown)
        definitions[word] = (Annotated[of, field], default)
    return with_fields(definitions)


class Parameters(BaseModel):
    """Named values; unknown names are rejected."""

    model_config = ConfigDict(
        extra="forbid", allow_inf_nan=False, protected_namespaces=(), use_attribute_docstrings=True
    )

    def inputs(self) -> dict[str, Any]:
        """Return the values sent, by field.

        Raises:
            InputError: two words for one field.
        """
        words_set, fields = self.model_fields_set, INPUTS
        values = self.__dict__.items()
        return inputs_from(
            {word: v for word, v in values if word in words_set and name_of(word) in fields}
        )

    def question(self) -> tuple[dict[str, Any], dict[str, Any]]:
        """Return the inputs of block and shaking, by field, and the options of the answer."""
        inputs = self.inputs()
        how = {name: inputs.pop(name) for name in _HOW if name in inputs}
        return inputs, how


class Answered(Parameters):
    """Parameters of an operation that returns an answer."""

    text: bool = False
    """With the sentences and the labelled lines of the answer under ``text``."""


_SHAPE = (*SHAPE, *PLANES, *SPACE, *JOINT, "drainage", "back_fracture")
_BEFORE_SLIP = tuple(name for name in _SHAPE if name != "phi_residual_deg")
_AT_REST = (*_BEFORE_SLIP, "cohesion_pa", "density_kg_m3", *AT_REST)
_BLOCK = (*BLOCK, *COMMON)
_QUESTION = (*_BLOCK, *MEASURED, *SHAKING, *REQUEST, *INVERSE)


@asking(*_AT_REST, examples={"s1": 1.0, "s2": 0.6, "gamma": 25.0, "beta": 20.0, "phi": 40.0})
class BlockQuery(Answered):
    """Parameters of `/v1/block`."""


@asking("p2", "kr", *_AT_REST, examples={"p2": 3.0, "kr": 0.1})
class DrawingQuery(Parameters):
    """Parameters of `/v1/drawing`."""


@asking(*_QUESTION, examples={"p2": 3.0, "kr": 0.1, "pgv": 0.6})
class PredictQuery(Answered):
    """Parameters of `GET /v1/predict`."""


@asking(*MEASURED, *SHAKING, *REQUEST, "kind")
class TableQuery(Answered):
    """Parameters of `/v1/table`: default kind of the rows, measurement errors of rows without, and
    shaking if no column has any."""

    form: Literal["csv", "xlsx"] = "csv"
    """What the body is: csv (also cells pasted from a spreadsheet) or xlsx."""
    sheet: Text | None = None
    """Name of the sheet of a workbook. Default: the first."""
    ignore_columns: Text | None = None
    """Columns to ignore, separated by commas."""
    sensitivity: bool = False
    """Columns with P at usual errors of measurement."""


@asking(*_QUESTION, many=True)
class PredictRows(Answered):
    """Numbers, which apply to every element, and lists of equal length."""

    sensitivity: bool = False
    """With P at usual errors of measurement of each element."""

    model_config = ConfigDict(
        json_schema_extra={"examples": [{"p2": 3.0, "kr": [0.1, 0.2, 0.3], "pgv": [0.6, 0.6, 1.2]}]}
    )


class Reading(Parameters):
    """Metadata of an accelerogram that its file does not contain."""

    name: Text = "upload"
    """Name of the record in the answer."""
    text: bool = False
    """With the sentences and the labelled lines of the answer under ``text``."""
    trace: Annotated[int, Field(ge=0)] | None = None
    """Number of the trace in the file, from 0; where there are several."""
    units: Literal["g", "m/s2", "cm/s2", "mm/s2"] | None = None
    """Unit of acceleration of a text file that does not state it."""
    dt: Positive | None = None
    """Sampling interval [s] of a text file that holds accelerations only."""
    gain: Positive | None = None
    """Gain [counts/(m/s2)] of a miniSEED file."""


MOST_SIZES = 100
"""Most values of p² in one request for a spectrum."""

_NUMBER = r"([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?"


class SpectrumQuery(Reading):
    """Parameters of `/v1/spectrum`."""

    p2: Annotated[str, Field(pattern=f"^{_NUMBER}(,{_NUMBER})*$")] = "30,10,3,1,0.3,0.1"
    """Frequency parameters p² [1/s²], separated by commas."""
    polarity: Literal["forward", "reverse", "both"] = "forward"
    """forward: positive samples drive forward; reverse: negative ones; both."""
    kr: Positive | None = None
    """Uplift acceleration coefficient k_r of a block to compare, with one p2."""

    def sizes(self) -> list[float]:
        """Return the values of p² [1/s²]."""
        sizes = [float(text) for text in self.p2.split(",")]
        if len(sizes) > MOST_SIZES:
            raise InputError(f"p2 has {len(sizes)} values; the maximum per request is {MOST_SIZES}")
        return sizes


@asking("p2", "kr", *_SHAPE, examples={"p2": 3.0})
class CriticalQuery(Reading):
    """Parameters of `/v1/critical`."""

    reverse: bool = False
    """Positive samples drive backward: k_h(t) = -a(t)."""
    map: bool = False
    """Map the toppling and safe intervals of k_r/PGA down to 0.01, borders to 1e-4."""


@asking(*INTENSITY, *ANSWERING)
class RockmassQuery(Parameters):
    """Parameters of `/v1/rockmass`."""

    n: Annotated[int, Field(ge=1)] | None = None
    """Number of realisations. Default: that of the body, else 20000."""
    seed: Annotated[int, Field(ge=0)] | None = None
    """Seed of the random numbers. Default: that of the body, else 1."""


@asking(*_BLOCK, *ANSWERING, examples={"p2": 3.0, "kr": 0.1})
class HazardQuery(Parameters):
    """Parameters of `/v1/hazard`."""

    years: Positive = 50.0
    """Period of the probability [years]."""
    imt: Text | None = None
    """Intensity measure of the curve: PGV, PGA, SA(0.5)."""
    site: Text | None = None
    """Site of the file: its number from 1 on, or its name."""
    convert: Text | None = None
    """Published conversion of a spectral acceleration to PGV: newmark_hall_1982 (SA(1)) or
    bommer_alarcon_2006 (SA(0.5)); its scatter is integrated."""
    convert_sigma: Positive | None = None
    """Standard deviation of ln PGV about the conversion. Default: that of the reference's
    motions."""
    component: Text | None = None
    """Horizontal component of the curve: single, geometric_mean, rotd50, rotd100 or larger.
    Default: that of the curve file, else single."""
