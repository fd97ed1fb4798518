"""Descriptions of blocks, shaking, models and data, as the lines of answers print them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from rbfrag.results.numbers import equals, exact_percent, interval, with_interval
from rbfrag.vocabulary.quantities import (
    INTENSITY,
    JOINT,
    MEASURED,
    MEASURES,
    NUMBERS,
    PLANES,
    QUANTITIES,
    SHAPE,
    SPACE,
    measured_by,
    word_of,
)
from rbfrag.vocabulary.spectral import spectral_names

if TYPE_CHECKING:
    from rbfrag.db.model_file import ModelRow

_MOST_TOGETHER, _LEAST_SHARE = 0.3, 0.01
"""Fraction of several sources together from which on none is listed, and the smallest listed."""

_LONGEST_LABEL = 30
"""Letters of a label; a longer one gives way to the word of the field."""


def shaking(uncertain: Mapping[str, Any], inputs: Mapping[str, Any]) -> str:
    """Describe the intensity measures: "PGV 0.9 m/s, PGA 0.6 g"; medians where they have a
    dispersion, over which P is averaged.

    A scenario is described with its mechanism and ground-motion model (``gmm``, by which it is
    known). The median is that of the model, RotD50, and σ_ln includes the dispersion of a single
    component about it.

    Args:
        uncertain: median and dispersion ``sigma`` of each uncertain measure, by name.
        inputs: measures and the scenario, by the names of :func:`rbfrag.predict`.
    """
    spectrum = spectral_names(name for name in inputs if name not in uncertain)
    named = (*INTENSITY, *_few(spectrum), "rjb_km", "vs30_m_s")
    parts = [
        f"{_measure(name)} {inputs[name]:.4g} {QUANTITIES[name].unit}".rstrip()
        for name in named
        if isinstance(inputs.get(name), int | float) and name not in uncertain
    ]
    if len(spectrum) > _MOST_ORDINATES:
        parts.append(f"SA at {len(spectrum)} periods")
    if not uncertain:
        return ", ".join(parts)
    gmm = inputs.get("gmm")
    of_median, of_sigma = ("", "") if gmm is None else (" (RotD50)", " of a single component")
    of_spectrum = spectral_names(uncertain)
    listed = [name for name in uncertain if name not in of_spectrum] + _few(of_spectrum)
    medians = ", ".join(
        f"median {_measure(name)} {uncertain[name]['median']:.2g} {QUANTITIES[name].unit}"
        f"{of_median}, σ_ln {uncertain[name]['sigma']:.2g}{of_sigma}"
        for name in listed
    )
    if len(of_spectrum) > _MOST_ORDINATES:
        medians = f"{medians}, SA at {len(of_spectrum)} periods"
    distribution = "this distribution" if len(uncertain) == 1 else "these distributions"
    mean = f"P is the mean over {distribution}"
    if gmm is None:
        return f"{', '.join((*parts, medians))}; {mean}"
    if mechanism := inputs.get("mechanism"):
        parts.insert("magnitude" in inputs, mechanism)
    if "amplification" in inputs:
        parts.append(f"amplification {inputs['amplification']:g}")
    return f"{', '.join(parts)} ({gmm}): {medians}; {mean}"


_MOST_ORDINATES = 3
"""Of more spectral ordinates their number is given."""


def _few(spectrum: list[str]) -> list[str]:
    """Return the ordinates if they are few, else none."""
    return spectrum if len(spectrum) <= _MOST_ORDINATES else []


def drained_bound(bound: Mapping[str, float | None]) -> str:
    """Describe the drained prediction: "k_r = 0.3, P = 8.4 % (6.4–11 %), without …"."""
    yields = [
        f"{QUANTITIES[name].symbol} = {value:.3g}, "
        for name, value in bound.items()
        if name in NUMBERS and value is not None
    ]
    p, low, high = (float(bound[name] or 0.0) for name in ("probability", "ci_low", "ci_high"))
    return f"{''.join(yields)}{equals('P', with_interval(p, low, high))}, without water pressure"


def measured(name: str, error: float, *, relative: bool = False) -> str:
    """Describe a field with an error of its measurement: "base dip ±2°", "width ±5 %"."""
    if name in SPACE:
        return f"{name} ±{error:.3g}°"
    quantity = QUANTITIES[name]
    noun, _, place = quantity.noun.partition(" of the ")
    label = f"{place} {noun}" if place and " " not in place else quantity.noun
    label = label if len(label) <= _LONGEST_LABEL else quantity.symbol or word_of(name)
    if relative:
        return f"{label} ±{exact_percent(float(f'{error:.3g}'))}"
    return f"{label} ±{error:.3g} {quantity.unit}".replace(" deg", "°").rstrip()


def sources(fractions: Sequence[Mapping[str, Any]], inputs: Mapping[str, Any]) -> str:
    """Describe the sources of an interval: "base dip ±2° 70 %, fragility 3 %"; empty where most of
    it comes from several together.

    Args:
        fractions: source and fraction of the variance.
        inputs: the standard deviations by name, among others.
    """
    shares = {row["source"]: row["fraction"] for row in fractions}
    if not shares or shares.pop("together") >= _MOST_TOGETHER:
        return ""
    errors = {measured_by(name): inputs[name] for name in MEASURED if name in inputs}
    labels = {"gmm": f"ground-motion model σ_ln {inputs.get('gmm_sigma', 0.0):.2g}"}
    return ", ".join(
        f"{labels.get(name) or (measured(name, errors[name]) if name in errors else name)} "
        f"{exact_percent(round(share, 2))}"
        for name, share in shares.items()
        if share >= _LEAST_SHARE
    )


def sensitivity(rows: Sequence[Mapping[str, Any]]) -> str:
    """Describe P at usual measurement errors: "base dip ±2°: 1.3–47 %; width ±5 %: 9.4–23 %"."""
    return "; ".join(
        f"{measured(row['field'], row['step'], relative=row['step'] < 1.0)}: "
        f"{interval(row['low'], row['high'])}"
        for row in rows
    )


def solution(about: Mapping[str, Any]) -> str:
    """Describe the value at which P is the target: "width 0.477 m (stated 0.4 m)"."""
    name = about["field"]
    label, value = labelled_value(name, about["value"])
    text = f"{label} {value} (stated {labelled_value(name, about['stated'])[1]})"
    if about["added_kr"] is None:
        return text
    force = f"a horizontal force of {about['added_kr']:.3f} of the weight (first estimate)"
    return f"{text}: {force}"


def at_sites(number: float) -> str:
    """Describe what the prediction interval of a single earthquake refers to."""
    return f"{number:,g} site{'s' if number > 1 else ''} of one earthquake"


def block(method: str, inputs: Mapping[str, Any], *, support: bool = True) -> str:
    """Describe the parameters and the support of a block: "p² = 7.21 s⁻², k_r = 0.2; rock …".

    Args:
        method: the one that the model which answers is fitted by.
        inputs: what the question gives, by the names of :func:`rbfrag.predict`.
        support: whether the support is described.
    """
    from rbfrag.fragility.methods import method_named

    model_block = method_named(method).block
    values = {
        name: inputs.get(name)
        for name in (model_block.size, model_block.strength)
        if name is not None
    }
    if not all(isinstance(value, (int, float)) for value in values.values()):
        return ""
    numbers = [
        f"{QUANTITIES[name].symbol} = {value:.3g}{' s⁻²' if name == model_block.size else ''}"
        for name, value in values.items()
    ]
    limit_m = inputs.get("displacement_m")
    if isinstance(limit_m, (int, float)):
        numbers.append(f"displacement limit {limit_m:g} m")
    described = ": ".join(filter(None, (_shape(inputs), ", ".join(numbers))))
    return "; ".join(filter(None, (described, model_block.support if support else "")))


def _shape(inputs: Mapping[str, Any]) -> str:
    """Describe dimensions and planes: "rectangle 2 m × 0.4 m, dip of the base 5°"; empty if none
    are given.
    """
    values = {name: value for name, value in inputs.items() if isinstance(value, int | float)}
    parts = [f"{name} {inputs[name]}" for name in SPACE if inputs.get(name)]
    if values.keys() >= {"height_m", "width_m"}:
        parts.append(f"rectangle {values.pop('height_m'):g} m × {values.pop('width_m'):g} m")
    names = (name for name in (*SHAPE, *PLANES, *JOINT) if name in values)
    parts += [" ".join(labelled_value(name, values[name])) for name in names]
    return ", ".join(parts)


def labelled_value(name: str, value: float, digits: int = 4) -> tuple[str, str]:
    """Return the label of a field, and its value with the unit: ("dip of the base", "5°")."""
    quantity = QUANTITIES[name]
    label = quantity.noun if len(quantity.noun) <= _LONGEST_LABEL else word_of(name)
    if name in NUMBERS:
        label = quantity.symbol
    text = f"{value:.{digits}g} {quantity.unit}".rstrip()
    return label, text.replace(" deg", "°")


def labelled_values(numbers: Mapping[str, float], digits: int) -> str:
    """Describe the parameters of a block with their names and units: "p² = 3 1/s², k_r = 0.1"."""
    pairs = (labelled_value(name, value, digits) for name, value in numbers.items())
    return ", ".join(f"{label} = {value}" for label, value in pairs)


def model(document: Mapping[str, Any]) -> str:
    """Describe the model of a prediction: its predictors, and what distinguishes it."""
    from rbfrag.db.model_file import COMPARED
    from rbfrag.fragility.measures import TERMS
    from rbfrag.fragility.method import TOPPLING_BLOCK
    from rbfrag.fragility.methods import method_named

    term = TERMS.get(document["term"])
    if term is None or "," in document["method"]:  # several models
        return str(document["model"])
    read = map(_measure, term.inputs) if term.inputs else ["SA(T)"]
    method = method_named(document["method"])
    kind = "" if method.block is TOPPLING_BLOCK else method.block.kind.replace("_", " ")
    method_name = method.name if method.name in COMPARED else ""
    return ", ".join(filter(None, (*read, kind, method_name)))


def named_model(document: Mapping[str, Any]) -> str:
    """Return the name of a model and its description: "toppling-pgv (PGV)"."""
    title = model(document)
    return title if title == document["model"] else f"{document['model']} ({title})"


def stored_model(row: ModelRow) -> str:
    """Describe a stored model."""
    return model({"model": row.name, "term": row.term, "method": row.method})


def measures(names: Sequence[str]) -> str:
    """Describe intensity measures: "PGV and SA(1 s)"."""
    *leading, last = map(_measure, names)
    return " and ".join(filter(None, (", ".join(leading), last)))


def _measure(name: str) -> str:
    title = MEASURES[name].title if name in MEASURES else ""
    return title or QUANTITIES[name].symbol


def fitted_data(diagnostics: Mapping[str, Any]) -> str:
    """Describe the data of a fit: outcomes or critical values; empty if not stored."""
    outcomes, events = diagnostics.get("n_outcomes"), diagnostics.get("events")
    if not ((number := outcomes or diagnostics.get("n")) and events):
        return ""
    data = "outcomes" if outcomes else "critical values"
    recorded = diagnostics.get("recorded_events") != 0
    of = "earthquakes" if recorded else "synthetic pulses, which are not earthquakes"
    return f"fitted on {number:,} {data} of {events:,} {of}"


def fitted_number(diagnostics: Mapping[str, Any]) -> int | None:
    """Return the number of critical values, or else of outcomes, that a model was fitted to."""
    critical, outcomes = (diagnostics.get(name) for name in ("n", "n_outcomes"))
    number = critical or outcomes or critical
    return None if number is None else int(number)
