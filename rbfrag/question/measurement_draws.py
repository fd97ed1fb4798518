"""Draws of a block with measurement errors: the points of a lattice.

Each field with a standard deviation has a column of a lattice (no seed): u_ij = frac(i Z_j/N) +
1/(2N). Each draw is a block of its own mode and kind. Draws that do not stand at rest are excluded,
because that the block stands is an observation.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from typing import Any, NamedTuple

from rbfrag.errors import InputError
from rbfrag.fragility.dependence import normal_quantile
from rbfrag.fragility.method import SINGLE, ArrayNamespace
from rbfrag.fragility.prediction import single
from rbfrag.question.classify import (
    Shape,
    classify_draw,
    has_shape,
    requested_kind,
    sectioned,
    shape_of,
)
from rbfrag.question.nominal import OF_SHAKING
from rbfrag.question.shape_validation import (
    IS_SHAPE,
    LOCKED,
    REJECTED,
    SHAPES,
    SLIPS,
    UNSTABLE,
    shape_among,
)  # fmt: skip
from rbfrag.results.diagnostic import Diagnostic
from rbfrag.results.numbers import percent
from rbfrag.solver.block.geometry import Block
from rbfrag.vocabulary.quantities import MEASURED, QUANTITIES, SCATTER, measured_by

STEPS = (
    1, 182667, 469891, 498753, 110745, 250185, 118627, 245333, 283199, 408519, 391023,
)  # fmt: skip
"""Z_j of a published generating vector, without 446979: it is 3 modulo 512, which correlates the
scores of the first and the sixth field by .42."""

GMM_SIGMA = 0.20
"""Default of ``gmm_sigma`` for a scenario: .17 between models (Al Atik and Youngs 2014) and a part
for the region."""

NOTED, WARNED, REJECTED_ABOVE = 0.01, 0.2, 0.8
"""Fractions of the draws that do not stand from which on it is noted, warned about, rejected."""

EXCLUDED = "{} of the measured range would not stand at rest and is excluded: the block stands"
FEW_STAND = "{} of the measured range would not stand at rest: check dip and friction"
SOME_SLIDE = "{} of the measured range slides: give displacement_m, the displacement limit"
SOME_MISSING = "{} of the measured range has no answer and is excluded"


def draw_count(sigmas: Sequence[str]) -> int:
    """Return N, the number of draws for these standard deviations."""
    if tuple(sigmas) == ("gmm_sigma",):
        return 64
    return 512 if len(sigmas) < 6 else 1024


@cache
def scores_of(count: int) -> tuple[float, ...]:
    """Return the standard normal scores of the midpoints of `count` equal parts, increasing."""
    low = [normal_quantile((i + 0.5) / count) for i in range(count // 2)]
    return (*low, *[0.0] * (count % 2), *(-z for z in reversed(low)))


def lattice(fields: int, count: int) -> list[list[tuple[float, float]]]:
    """Return u and its standard normal score of each draw, a list for each field."""
    z = scores_of(count)
    parts = ((i * step % count for i in range(count)) for step in STEPS[:fields])
    return [[((k + 0.5) / count, z[k]) for k in column] for column in parts]


def source_of(sigma: str) -> str:
    """Return the name of a source of uncertainty: the measured field, or the model of shaking."""
    return "gmm" if sigma == "gmm_sigma" else measured_by(sigma)


def split_sigmas(
    question: Mapping[str, Any], *, is_scenario: bool
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the inputs without standard deviations of measured fields, and these by name.

    Those in per cent are resolved, and those of 0 are omitted.

    Args:
        question: fields of block and shaking: numbers or arrays.
        is_scenario: whether a ground-motion model predicts the shaking.

    Raises:
        InputError: a standard deviation is invalid, lacks its field, or is combined with those of
            derived numbers.
    """
    inputs = {name: value for name, value in question.items() if name not in MEASURED}
    nominal = {name: question[name] for name in MEASURED if name in question}
    if is_scenario:
        nominal.setdefault("gmm_sigma", GMM_SIGMA)
    sigmas = {}
    for name, value in nominal.items():
        field = measured_by(name)
        if name == "gmm_sigma":
            if not is_scenario:
                raise InputError(
                    "gmm_sigma requires a scenario (magnitude and rjb_km): without it give the "
                    "standard deviations of the intensity measures",
                    fields=(name, "magnitude", "rjb_km"),
                )
        elif not has_shape(inputs):
            raise InputError(
                f"{name} requires the geometry of a block; for a block given by its parameters "
                "use the standard deviations of these, such as kr_sigma",
                fields=(name, "kr_sigma"),
            )
        elif field not in inputs and not (field == "beta_deg" and "height_m" in inputs):
            raise InputError(f"{name} requires {field}: give both", fields=(name, field))
        if isinstance(value, str):
            value = _relative(name, value) * inputs[field]
        if isinstance(value, int | float):
            value = single(name, value)
            if not 0.0 <= value < math.inf:
                raise InputError(
                    f"{name} = {value:g}: give {QUANTITIES[name].prompt}", fields=(name,)
                )
            if value == 0.0:
                continue
        sigmas[name] = value
    derived = [name for name in SCATTER if name in inputs and name != "restitution_sigma"]
    measured = [name for name in sigmas if name != "gmm_sigma"]
    if derived and measured:
        raise InputError(
            f"{derived[0]} cannot be combined with {measured[0]}: give the standard deviations of "
            "what was measured, or those of the derived numbers",
            fields=(derived[0], measured[0]),
        )
    return inputs, sigmas


def encoded(name: str, value: Any) -> Any:
    """Return a standard deviation of a measured field for all rows of a table, in which a fraction
    of the field is negative; other values as they are.
    """
    if name not in MEASURED:
        return value
    if isinstance(value, str):
        return -_relative(name, value)
    if not value >= 0.0:
        raise InputError(f"{name} = {value:g}: give {QUANTITIES[name].prompt}", fields=(name,))
    return value


def _relative(name: str, text: str) -> float:
    """Return the fraction in a text such as "5%"."""
    number = text.strip().removesuffix("%")
    try:
        if QUANTITIES[name].unit != "deg" and number != text.strip():
            return float(number.replace(",", ".")) / 100.0
    except ValueError:
        pass
    kinds = "in degrees" if QUANTITIES[name].unit == "deg" else "or a value in per cent, such as 5%"
    raise InputError(f"{name} = {text!r:.40}: give a number {kinds}", fields=(name,))


def drawn_values(
    inputs: Mapping[str, Any],
    sigmas: Mapping[str, Any],
    draws: Iterable[tuple[Any, Any]],
    ns: ArrayNamespace,
) -> dict[str, Any]:
    """Return the drawn fields of one draw (numbers) or of many (arrays).

    Lengths, density and cohesion are lognormal with the stated value as median, angles and water
    normal and truncated at the range of the field.

    Args:
        inputs: fields of the block, without planes in space.
        sigmas: standard deviations by name.
        draws: u and its standard normal score z of each of them.
        ns: functions of numbers or arrays.
    """
    values: dict[str, Any] = {}
    for (name, sigma), (u, z) in zip(sigmas.items(), draws, strict=True):
        field = measured_by(name)
        if field in ("base", "back"):
            # a plane turns in the section: gamma is the dip of the back less that of the base
            shift = sigma * z
            if field == "base":
                values["beta_deg"] = inputs["beta_deg"] + shift
            if "gamma_deg" in inputs:
                gamma_deg = values.get("gamma_deg", inputs["gamma_deg"])
                values["gamma_deg"] = gamma_deg + (shift if field == "back" else -shift)
        elif field == "amplification":
            values[field] = inputs.get(field, 1.0) * ns.exp(sigma * z)
        elif QUANTITIES[field].unit == "deg" or field == "water_m":
            value, limits = inputs.get(field, 0.0), QUANTITIES[field].range
            least = limits.least if limits.above is None else limits.above
            most = limits.most if limits.below is None else limits.below
            low = ns.ndtr((least - value) / sigma)
            beyond = 0.0 if most is None else ns.ndtr((value - most) / sigma)
            if ns is not SINGLE or low > 0.0 or beyond > 0.0:
                z = ns.ndtri(low + u * (1.0 - beyond - low))
            values[field] = value + sigma * z
        else:
            ratio = sigma / inputs[field]
            values[field] = inputs[field] * ns.exp(ns.sqrt(ns.log(1.0 + ratio * ratio)) * z)
    if "phi_deg" in values and "phi_residual_deg" in inputs:
        shifted = inputs["phi_residual_deg"] + values["phi_deg"] - inputs["phi_deg"]
        values["phi_residual_deg"] = ns.minimum(ns.maximum(shifted, 0.0), 89.99)
    return values


class Draw(NamedTuple):
    """One block of the draws.

    Args:
        state: why it has no numbers; empty where a model answers.
        kind: its kind.
        numbers: inputs of its model.
        factor: of the shaking.
        shape: its geometry; None without one.
    """

    state: str
    kind: str | None
    numbers: Mapping[str, Any]
    factor: float = 1.0
    shape: Shape | None = None


class DrawnBlock:
    """A block given by its geometry, of which fields are replaced.

    Args:
        inputs: its fields.
        kind: how it is asked to fail; None for what the geometry says.
    """

    def __init__(self, inputs: Mapping[str, Any], kind: str | None) -> None:
        block = {name: value for name, value in inputs.items() if name not in OF_SHAKING}
        self.fields, _ = sectioned(block)
        shape = shape_of(self.fields)
        assert shape is not None
        self.shape, names = shape, shape_among(self.fields)
        self._sides = {name: self.fields[name] for name in names or ()}
        self._make = getattr(Block, SHAPES[names]) if names else None
        self._options = {name: v for name, v in self.fields.items() if name not in IS_SHAPE}
        limit_m = self._options.pop("displacement_m", None)
        self._limit_m = math.nan if limit_m is None else limit_m
        self._requested = requested_kind(kind, self._options)

    def draw(self, values: Mapping[str, Any]) -> Draw:
        """Return the block with other values of fields."""
        block, planes = self.shape.block, {**self.shape.planes}
        sides = self._sides
        if self._make is not None and not values.keys().isdisjoint(sides):
            try:
                block = self._make(**{**sides, **{n: values[n] for n in sides if n in values}})
            except InputError:
                return Draw(REJECTED, None, {})
        planes |= {n: v for n, v in values.items() if n not in sides and n != "amplification"}
        shape = Shape(block, planes, self.shape.is_rectangle)
        draw = classify_draw(shape, self._requested, self._limit_m, self._options)
        return Draw(*draw, values.get("amplification", 1.0), shape)


def check_draws(states: Mapping[str, int]) -> tuple[Diagnostic, ...]:
    """Return the notes about draws that are left out, from the number of draws in each state.

    Raises:
        InputError: draws slide without a displacement limit, too many do not stand, or none has an
            answer.
    """
    count = sum(states.values())
    slide, fall, answered = (
        sum(states.get(state, 0) for state in group) / count
        for group in ((SLIPS,), (UNSTABLE,), ("", LOCKED))
    )
    if slide:
        raise InputError(SOME_SLIDE.format(percent(slide)), fields=("displacement_m",))
    if fall > REJECTED_ABOVE:
        raise InputError(FEW_STAND.format(percent(fall)), fields=("beta_deg", "phi_deg"))
    missing = 1.0 - fall - answered
    if not answered:
        raise InputError(SOME_MISSING.format(percent(missing)))
    notes = []
    if fall > NOTED:
        code = "excluded_draws" if fall <= WARNED else "check_stability"
        notes.append(Diagnostic((EXCLUDED if fall <= WARNED else FEW_STAND).format(percent(fall)),
                                code, fields=("beta_deg", "phi_deg")))  # fmt: skip
    if missing > 1e-9:
        notes.append(Diagnostic(SOME_MISSING.format(percent(missing)), "no_answer"))
    return tuple(notes)
