"""Conversion of intensity measures from their horizontal component to a single component.

The fragility models are fitted on single components of any azimuth. A measure x of another
definition is converted by

    ln x_single = ln(x / ratio) + σ ε,   ε standard normal and common to all measures.

The dispersion σ is that of a single component about the geometric mean of two (Beyer and Bommer
2006), which RotD50 equals to within some percent; the ratios of RotD100 are those of Shahi and
Baker (2014), and that of the larger of two components is measured on the built-in data set.

Beyer, K. & Bommer, J. J. (2006): Relationships between median values and between aleatory
variabilities for different definitions of the horizontal component of motion. Bulletin of the
Seismological Society of America 96(4A), 1512-1522.

Shahi, S. K. & Baker, J. W. (2014): NGA-West2 models for ground motion directionality. Earthquake
Spectra 30(3), 1285-1300.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from rbfrag.errors import InputError
from rbfrag.fragility.measures import AMPLIFIED
from rbfrag.fragility.prediction import is_single, single
from rbfrag.results.diagnostic import Diagnostic
from rbfrag.vocabulary.spectral import period_of

COMPONENT_SIGMA = 0.161
"""Dispersion of a single component about RotD50 or the geometric mean, in ln: .07 in log10."""


@dataclass(frozen=True)
class Component:
    """One definition of the horizontal component.

    Args:
        name: name of the option's value.
        title: name for people.
        sigma: standard deviation of ln(single component/definition).
        amplitude: ratio of the definition to a single component, in the median.
        spectrum: (T, ratio) of SA(T), linear in ln T, where it differs from `amplitude`.
    """

    name: str
    title: str
    sigma: float = COMPONENT_SIGMA
    amplitude: float = 1.0
    spectrum: tuple[tuple[float, float], ...] = ()

    def spectral_ratio(self, period_s: float) -> float:
        """Return the ratio of SA at a period [s]; constant beyond the first and last period."""
        if not self.spectrum:
            return self.amplitude
        result = self.spectrum[0][1]
        for (start_s, low), (end_s, high) in pairwise(self.spectrum):
            x = math.log(period_s / start_s) / math.log(end_s / start_s)
            if x > 0.0:
                result = low + (high - low) * min(x, 1.0)
        return result

    def ratio(self, measure: str) -> float:
        """Return the ratio for an intensity measure, by its name in `predict`."""
        if (period_s := period_of(measure)) is not None:
            return self.spectral_ratio(period_s)
        if measure in ("pgv_m_s", "pgd_m"):
            return self.amplitude
        # PGA is SA(0.01 s); Arias intensity grows with the square of the acceleration
        return float(self.spectral_ratio(0.01) ** AMPLIFIED.get(measure, 0))

    def in_words(self, subject: str) -> Diagnostic:
        """Describe the component in a sentence, for example after "the curve is"."""
        if self.name == SINGLE_COMPONENT:
            return Diagnostic(f"{subject} of {self.title}, as the models are", "single_component")
        return Diagnostic(
            f"{subject} of {self.title}, converted to a single component ({self.source})",
            "component_converted",
        )

    @property
    def source(self) -> str:
        """The publications of the conversion."""
        ratios = "; Shahi and Baker 2014" if self.spectrum else ""
        return f"Beyer and Bommer 2006{ratios}"


SINGLE_COMPONENT = "single"

COMPONENTS: Mapping[str, Component] = {
    component.name: component
    for component in (
        Component(SINGLE_COMPONENT, "a single horizontal component", 0.0),
        Component("geometric_mean", "the geometric mean of two horizontal components"),
        Component("rotd50", "RotD50"),
        Component(
            "rotd100", "RotD100", amplitude=1.25,
            spectrum=((0.01, 1.19), (0.1, 1.19), (0.2, 1.21), (0.3, 1.22), (0.5, 1.23), (1.0, 1.24),
                      (3.0, 1.25), (5.0, 1.26), (10.0, 1.29)),
        ),
        Component("larger", "the larger of two horizontal components", amplitude=1.14),
    )
}  # fmt: skip
"""Definitions of the horizontal component by name."""

_NAMES = f"{', '.join([*COMPONENTS][:-1])} or {[*COMPONENTS][-1]}"

SINGLE_ASSUMED = Diagnostic(
    "the shaking is assumed to be of a single horizontal component; for RotD50, as hazard tools "
    "give it, use component='rotd50'",
    "single_component",
    fields=("component",),
)
"""Note of an answer whose question does not specify the component."""


def depends_on_component(p: Any) -> Any:
    """Return whether P is neither 0 nor 1, but for rounding, so that the component matters."""
    return (p > 0.0) & (p < 1.0 - 1e-12)


def component_named(name: str) -> Component:
    """Return the component definition with this name.

    Raises:
        InputError: there is none; the message names the nearest.
    """
    if name in COMPONENTS:
        return COMPONENTS[name]
    from difflib import get_close_matches

    near = get_close_matches(str(name).lower().replace(" ", "_"), COMPONENTS, 1)
    hint = f" (did you mean {near[0]!r}?)" if near else ""
    raise InputError(
        f"unknown component {str(name)[:40]!r}{hint}: it must be {_NAMES}", fields=("component",)
    )


def to_single_component(inputs: Mapping[str, Any], component: Any) -> dict[str, Any]:
    """Return the inputs with measures of a single component and its dispersion.

    Args:
        inputs: fields of block and shaking: numbers or arrays.
        component: a name, or an array of names, one for each element; empty for single.

    Raises:
        InputError: an unknown name.
    """
    ratio: Callable[[str], Any]
    if isinstance(component, str):
        definition = component_named(component)
        ratio, sigma = definition.ratio, definition.sigma
    else:
        ratio, sigma = _conversion_of_rows(component)
    result = dict(inputs)
    for name, value in inputs.items():
        if name not in AMPLIFIED:
            continue
        if is_single(value):
            result[name] = single(name, value) / ratio(name)
        else:
            result[name] = (value if hasattr(value, "shape") else _array(value)) / ratio(name)
    result["amplification_sigma"] = total_sigma(inputs.get("amplification_sigma", 0.0), sigma)
    if "pgv_m_s" in inputs and not {"pgv_sigma", "amplification_sigma"} & inputs.keys():
        result.setdefault("pgv_tau", 0.0)  # sites share the earthquake, not the direction
    return result


def total_sigma(sigma: Any, component_sigma: Any) -> Any:
    """Return the root of the sum of squares; an invalid standard deviation stays, to be rejected
    later.

    Args:
        sigma: standard deviation of ln amplification: a number, or an array.
        component_sigma: that of the component likewise.
    """
    if is_single(sigma) and is_single(component_sigma):
        value = single("amplification_sigma", sigma)
        return math.hypot(value, component_sigma) if value >= 0.0 else value
    import numpy as np

    values = _array(sigma)
    return np.where(values >= 0.0, np.hypot(values, component_sigma), values)


def _array(value: Any) -> Any:
    import numpy as np

    return np.asarray(value, dtype=np.float64)


def _conversion_of_rows(components: Any) -> tuple[Callable[[str], Any], Any]:
    """Return the ratios of a measure as a function of its name, and the dispersions."""
    import numpy as np

    names = np.array(components, dtype=object)
    texts = [
        SINGLE_COMPONENT if name is None or name == "" or name != name else str(name)
        for name in names.ravel().tolist()
    ]
    definitions = [component_named(text) for text in dict.fromkeys(texts)]
    index = {definition.name: i for i, definition in enumerate(definitions)}
    codes = np.array([index[text] for text in texts], dtype=np.intp).reshape(names.shape)

    def ratio(measure: str) -> Any:
        return np.array([definition.ratio(measure) for definition in definitions])[codes]

    return ratio, np.array([definition.sigma for definition in definitions])[codes]
