"""Ground motion of a scenario earthquake from magnitude, distance and Vs30, with topographic
amplification.

What is said so becomes measures with their scatter before a question is asked. A single site loads
no library.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from typing import Any, NamedTuple

from rbfrag.errors import InputError
from rbfrag.fragility import describe
from rbfrag.fragility.completion import used_inputs
from rbfrag.fragility.measures import AMPLIFIED, SCATTERED, SIGMAS, TERMS
from rbfrag.fragility.method import SINGLE, ArrayNamespace, arrays
from rbfrag.fragility.model import FragilityModel, Model
from rbfrag.fragility.model_selection import stored_row
from rbfrag.fragility.prediction import is_single, single
from rbfrag.question.bssa14 import MEASURES, Ordinate, bssa14
from rbfrag.question.components import COMPONENT_SIGMA, to_single_component, total_sigma
from rbfrag.results.diagnostic import Diagnostic
from rbfrag.results.result import Result, TextLine, TextTable
from rbfrag.vocabulary.quantities import INTENSITY, MECHANISMS, QUANTITIES
from rbfrag.vocabulary.spectral import spectral_names

SITE = ("rjb_km", "vs30_m_s")
"""Fields that make a question one of a scenario."""

GROUND = ("magnitude", *SITE)

# that 400 km is the limit of the paper is from memory
_RANGES = {"magnitude": (3.0, 8.5), "rjb_km": (0.0, 400.0), "vs30_m_s": (150.0, 1500.0)}
_MOST_OF_NORMAL = 7.0

ANOTHER_MODEL = Diagnostic(
    "P varies by a factor of up to 3 with the ground-motion model: repeat with others "
    "(gmm='FILE') and average the probabilities, not the medians",
    "single_gmm",
    fields=("gmm",),
)


class Source(NamedTuple):
    """Mechanism and ground-motion model of the scenario earthquake.

    Args:
        mechanism: how the fault moves; None where that is not said.
        gmm: table of medians and sigmas of another ground-motion model.
    """

    mechanism: str | Sequence[str | None] | None = None
    gmm: str | PathLike[str] | None = None


def describe_source(source: Source) -> dict[str, str]:
    """Return the names of the ground-motion model and, if it depends on it, of the mechanism."""
    if source.gmm is not None:
        from pathlib import Path

        return {"gmm": Path(source.gmm).name}
    mechanism = source.mechanism or MECHANISMS[0]
    if mechanism == MECHANISMS[0]:
        mechanism = f"mechanism {mechanism}"
    return {"gmm": "BSSA14", "mechanism": str(mechanism)}


def shaken(
    inputs: Mapping[str, Any],
    source: Source,
    model: Model | None = None,
    db: str | PathLike[str] | None = None,
    component: Any = None,
) -> tuple[dict[str, Any], tuple[Diagnostic, ...]]:
    """Replace a scenario by its intensity measures and their dispersion, with warnings.

    Args:
        inputs: the question, in which magnitude, distance and ground may stand for measures.
        source: what else is said of the earthquake.
        model: the model that is asked for, which reads its measures; None for PGV, PGA and the
            response spectrum.
        db: its database.
        component: horizontal component of the measures, by name; None for single.

    Raises:
        InputError: a scenario that is given in part or together with measures, or out of range, or
            with a component, which is RotD50.
    """
    question, remarks = dict(inputs), tuple[Diagnostic, ...]()
    if source != Source() or not question.keys().isdisjoint(SITE):
        if component is not None:
            raise InputError(
                "component cannot be combined with a scenario, whose ground-motion model "
                "predicts RotD50",
                fields=("component",),
            )
        measures = scenario(inputs, source, _read(model, db, source))
        remarks = (ANOTHER_MODEL,)
        question = {name: value for name, value in inputs.items() if name not in SITE}
        ns = _numbers(inputs)
        for name, im in measures.items():
            question[name], question[SIGMAS[name]] = im.median, im.sigma(ns)
        if "pgv_m_s" in measures:
            question["pgv_tau"] = measures["pgv_m_s"].tau
        sigma = inputs.get("amplification_sigma", 0.0)
        question["amplification_sigma"] = total_sigma(sigma, COMPONENT_SIGMA)
    elif component is not None:
        question = to_single_component(question, component)
    factor = question.pop("amplification", None)
    if factor is not None:
        if is_single(factor) and not 0.0 < single("amplification", factor) < math.inf:
            raise InputError(
                f"amplification = {factor:g}: give a factor above 0", fields=("amplification",)
            )
        for name in filter(AMPLIFIED.__contains__, [*question]):
            question[name] = question[name] * factor ** AMPLIFIED[name]
    return question, remarks


def scenario(
    inputs: Mapping[str, Any], source: Source, names: Collection[str] = MEASURES
) -> dict[str, Ordinate]:
    """Return intensity measures of a scenario (RotD50), by name, without amplification.

    Args:
        inputs: ``magnitude``, ``rjb_km`` [km] and ``vs30_m_s`` [m/s]: numbers, or arrays.
        source: what else is said of the earthquake.
        names: the measures that are wanted.

    Raises:
        InputError: something is missing, given twice, or outside the range of the model.
    """
    clashing = [n for n in inputs if (n in INTENSITY or n in SCATTERED) and n != "magnitude"]
    if clashing:
        raise InputError(
            f"{clashing[0]} cannot be combined with a scenario (magnitude and rjb_km): omit one of "
            "them",
            fields=(clashing[0],),
        )
    if source.gmm is not None:
        # Kept apart: a single site without a table loads no numpy.
        from rbfrag.question.gmm_table import of_table

        return of_table(source.gmm, inputs.get("rjb_km"), names)
    missing = [name for name in GROUND if name not in inputs]
    if missing:
        raise InputError(
            f"{missing[0]} is missing: a scenario is given by {', '.join(GROUND)} and mechanism",
            fields=(*GROUND, "mechanism"),
        )
    mechanism = _mechanism_index(source.mechanism)
    ns = _numbers(inputs) if isinstance(mechanism, int) else arrays()
    values = {name: _checked(name, inputs[name], mechanism, ns) for name in GROUND}
    return {
        name: bssa14(name, values["magnitude"], values["rjb_km"], values["vs30_m_s"], mechanism, ns)
        for name in names
        if name in MEASURES
    }


def _mechanism_index(mechanism: str | Sequence[str | None] | None) -> Any:
    """Return the index of each mechanism in the ground-motion model."""
    if isinstance(mechanism, Sequence) and not isinstance(mechanism, str):
        import numpy as np

        return np.array([_mechanism_index(name) for name in mechanism], dtype=np.intp)
    name = mechanism or MECHANISMS[0]
    if name not in MECHANISMS:
        raise InputError(
            f"mechanism = {name[:40]!r}: it must be {' or '.join(MECHANISMS)}",
            fields=("mechanism",),
        )
    return MECHANISMS.index(name)


@dataclass(frozen=True, eq=False, repr=False)
class ScenarioShaking(Result):
    """Intensity measures at one site in an earthquake scenario, of the component RotD50.

    Args:
        measures: by name the ``median``, its percentiles ``p16`` and ``p84``, the standard
            deviation of ln ``sigma`` and its between- and within-event parts ``tau`` and ``phi``.
        inputs: the numbers of the scenario.
        source: mechanism and ground-motion model.
        warnings: what to know about the answer.
    """

    measures: Mapping[str, Mapping[str, float]]
    inputs: Mapping[str, Any]
    source: Source
    warnings: tuple[str, ...] = ()

    def sentences(self) -> Iterator[str]:
        """Yield the median of the first intensity measure with its percentiles."""
        name, values = next(iter(self.measures.items()))
        unit = QUANTITIES[name].unit
        yield (
            f"Median {describe.measures([name])} {values['median']:.2g} {unit}   "
            f"(16th–84th percentile {values['p16']:.2g}–{values['p84']:.2g} {unit})"
        )

    def lines(self) -> Iterator[TextLine]:
        """Yield the scenario, the ground-motion model and its component."""
        texts = {"magnitude": "M {:g}", "rjb_km": "R_JB {:g} km", "vs30_m_s": "Vs30 {:g} m/s",
                 "amplification": "amplification {:g}"}  # fmt: skip
        parts = [text.format(self.inputs[n]) for n, text in texts.items() if n in self.inputs]
        if self.source.mechanism is not None:
            parts.append(str(self.source.mechanism))
        yield TextLine("Scenario", ", ".join(parts))
        gmm = "BSSA14 (Boore et al. 2014)" if self.source.gmm is None else str(self.source.gmm)
        yield TextLine("Model", f"{gmm}, component RotD50")

    def tables(self, *, verbose: bool = False) -> Iterator[TextTable]:
        """Yield the intensity measures with their percentiles and σ_ln."""
        rows: list[dict[str, object]] = [
            {"measure": describe.measures([name]), **values, "unit": QUANTITIES[name].unit}
            for name, values in self.measures.items()
        ]
        yield TextTable.of_rows(rows, verbose=verbose)

    def as_dict(self) -> dict[str, Any]:
        """Return the measures under the keys of the JSON contract."""
        return {name: dict(values) for name, values in self.measures.items()}


def scenario_shaking(inputs: Mapping[str, Any], source: Source) -> ScenarioShaking:
    """Return the ground motion at one site in a scenario earthquake.

    Args:
        inputs: as for :func:`scenario`, with ``amplification`` and ``amplification_sigma``.
        source: what else is said of the earthquake.
    """
    site = {name: value for name, value in inputs.items() if not name.startswith("amplif")}
    names = MEASURES
    if source.gmm is not None:
        from rbfrag.question.gmm_table import read_gmm_table

        columns = read_gmm_table(source.gmm)
        names = tuple(n for n in (*SIGMAS, *spectral_names(columns)) if n in columns)
    result = {}
    for name, im in scenario(site, source, names).items():
        median = im.median * inputs.get("amplification", 1.0)
        phi = math.hypot(im.phi, inputs.get("amplification_sigma", 0.0))
        sigma = math.hypot(im.tau, phi)
        low, high = (median * math.exp(end * sigma) for end in (-1.0, 1.0))
        result[name] = {
            "median": median, "p16": low, "p84": high, "sigma": sigma, "tau": im.tau, "phi": phi,
        }  # fmt: skip
    return ScenarioShaking(result, inputs, source)


def _numbers(inputs: Mapping[str, Any]) -> ArrayNamespace:
    names = (*GROUND, "amplification", "amplification_sigma")
    return SINGLE if all(is_single(inputs[n]) for n in names if n in inputs) else arrays()


def _read(model: Model | None, db: str | PathLike[str] | None, source: Source) -> Collection[str]:
    """Return the measures that answer a scenario: all, or those of the model that is asked for."""
    measures: Collection[str] = MEASURES
    if source.gmm is not None:
        from rbfrag.question.gmm_table import read_gmm_table

        measures = [name for name in read_gmm_table(source.gmm) if name in SIGMAS]
    if model is None:
        return measures
    row = stored_row(model, db) if isinstance(model, str) else model
    row = row.row if isinstance(row, FragilityModel) else row
    velocity = FragilityModel.from_row(row).form.velocity
    return used_inputs(TERMS[row.term], velocity, measures)


def _checked(name: str, value: Any, mechanism: Any, ns: ArrayNamespace) -> Any:
    low, high = _RANGES[name]
    # of several mechanisms the range that all have
    is_normal = mechanism == MECHANISMS.index("normal")
    if name == "magnitude" and (is_normal if isinstance(is_normal, bool) else is_normal.any()):
        high = _MOST_OF_NORMAL
    if ns is SINGLE:
        value = worst = single(name, value)
        outside = not low <= value <= high
    else:
        import numpy as np

        value = np.asarray(value, dtype=np.float64)  # what is NaN says why by itself
        out = np.atleast_1d((value < low) | (value > high))
        outside, worst = bool(out.any()), np.atleast_1d(value)[int(np.argmax(out))]
    if outside:
        raise InputError(
            f"{name} = {worst:g} is outside the range of the ground-motion model (Boore et al. "
            f"2014), {low:g} to {high:g}{' of normal faults' if high == _MOST_OF_NORMAL else ''}: "
            "use another model (gmm)",
            fields=(name, "gmm"),
        )
    return value
