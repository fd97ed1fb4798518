"""Levels of a hazard curve as a model uses them: measure, factor, dispersion, and blocks by model.

A model of PGA averages over the PGV that goes with a PGA in the reference, whose earthquakes are
stronger than those that most often make such a PGA. PGV and SA need no magnitude.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, Unpack

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import InputError, UnknownModelError
from rbfrag.fragility.model import FragilityModel
from rbfrag.fragility.uncertain import scatter_steps
from rbfrag.hazards.curve import ANSWERED, CurveKeywords, HazardCurve
from rbfrag.motions.units import STANDARD_GRAVITY_M_S2
from rbfrag.question.components import SINGLE_COMPONENT, Component, component_named
from rbfrag.question.fields import AnsweringFields, BlockKeywords, V
from rbfrag.question.keywords import model_for
from rbfrag.question.predict_arrays import block_reasons_of, blocks_of_arrays
from rbfrag.results.diagnostic import Diagnostic
from rbfrag.solver.results import FloatArray
from rbfrag.vocabulary.spectral import SpectralMapping, period_of, spectral_names

TAU = SpectralMapping({"pgv_m_s": 0.15}, lambda _: 0.15, "sa_g")
"""Standard deviation of ln rate between the measures that may be asked for."""

LAW_TAU = 0.25
"""The same where PGV is taken from PGA and magnitude."""

PGA_ALONE = Diagnostic(
    "a rate from PGA alone is biased: the model averages over the PGV of the strong earthquakes "
    "that it is fitted to, and smaller earthquakes have less PGV at the same PGA",
    "pga_alone",
)

_CONSTANT, _SLOPE, _BY_MAGNITUDE, _SCATTER, _SATURATION = -0.623, 0.873, 0.472, 0.434, 7.6


def by_preference(names: Collection[str]) -> list[str]:
    """Return the measures whose rates are known, the best predictor of toppling first: PGV, SA by
    the distance of its period from 1 s, PGA.
    """
    spectral = spectral_names(names)
    spectral.sort(key=lambda name: abs(math.log(period_of(name) or 1.0)))
    return [name for name in ("pgv_m_s", *spectral, "pga_g") if name in names]


def velocity_of(pga_g: FloatArray, magnitude: FloatArray) -> FloatArray:
    """Return the median PGV [m/s] of a single component at a PGA [g] and magnitude.

    ln PGV = -.623 + .873 ln PGA + .472 (min(M, 7.6) - 6), of the motions of the shipped reference.
    """
    with np.errstate(divide="ignore"):
        log = _CONSTANT + _SLOPE * np.log(pga_g)
    return np.asarray(np.exp(log + _BY_MAGNITUDE * (np.minimum(magnitude, _SATURATION) - 6.0)))


def component_of_velocity(component: Component) -> Component:
    """Return the component of PGV by :func:`velocity_of`, where PGA is of a given component."""
    return replace(
        component,
        amplitude=component.ratio("pga_g") ** _SLOPE,
        sigma=math.hypot(_SCATTER, _SLOPE * component.sigma),
    )


def factors_between(tau: float) -> tuple[float, float]:
    """Return the 95 % range of the ratio to rates by other intensity measures: exp(±1.96 tau)."""
    return math.exp(-1.96 * tau), math.exp(1.96 * tau)


def between_measures(tau: float | None) -> dict[str, float] | None:
    """Return the spread between measures under the keys of the JSON contract."""
    if tau is None:
        return None
    low, high = factors_between(tau)
    return {"tau": tau, "factor_low": low, "factor_high": high}


def between_measures_text(tau: float) -> str:
    """Return the text on the factors by which another intensity measure may change a rate."""
    low, high = factors_between(tau)
    return f"Not included in the interval: choice of intensity measure, rate × {low:.2f}–{high:.2f}"


@dataclass(frozen=True)
class VelocityConversion:
    """PGV [m/s] = `factor` · SA(`period_s`) [g] in the median.

    Args:
        name: name in options.
        period_s: oscillator period [s].
        factor: PGV over spectral acceleration [m/s per g].
        scatter: standard deviation of ln(PGV/converted) that is taken where none is given: that
            of the 749 horizontal motions of the shipped reference. The publications give a
            factor for the median, and no scatter that goes with these motions.
        source: where it is published.
    """

    name: str
    period_s: float
    factor: float
    scatter: float
    source: str


CONVERSIONS: Mapping[str, VelocityConversion] = {
    item.name: item
    for item in (
        VelocityConversion(
            "newmark_hall_1982",
            1.0,
            STANDARD_GRAVITY_M_S2 / (2.0 * math.pi * 1.65),
            0.48,
            "Newmark and Hall (1982), SA(1 s)/PGV = 2π·1.65/g at 5 % damping",
        ),
        VelocityConversion(
            "bommer_alarcon_2006",
            0.5,
            STANDARD_GRAVITY_M_S2 / 20.0,
            0.47,
            "Bommer and Alarcón (2006), PGV [cm/s] = SA(0.5 s) [cm/s²]/20",
        ),
    )
}
"""The conversions by name."""


def velocity_conversion(name: str) -> VelocityConversion:
    """Return the conversion of that name."""
    if name not in CONVERSIONS:
        raise InputError(f"unknown conversion {name!r}: it must be {' or '.join(CONVERSIONS)}")
    return CONVERSIONS[name]


_SCATTER_POINTS = 25
_REACH = 6.0
"""Standard deviations of the scatter that are integrated over, to both sides."""


@dataclass(frozen=True, eq=False)
class HazardLevel:
    """Levels of a curve as a measure of a model: level · shift, with weights.

    Args:
        name: what `predict` calls the measure.
        shift: factors, shape (s,).
        weight: their weights, which sum to 1, shape (s,).
        median: the factor without scatter.
        warnings: what was assumed.
        magnitudes_from_g: as of the curve.
    """

    name: str
    shift: FloatArray
    weight: FloatArray
    median: float
    warnings: tuple[str, ...]
    magnitudes_from_g: float | None = None

    @classmethod
    def of(cls, curve: HazardCurve, **meaning: Unpack[CurveKeywords]) -> HazardLevel:
        """Return the interpretation of a curve's levels; arguments as for :func:`rbfrag.hazard`."""
        if curve.magnitudes_from_g is not None:
            single = cls.about(
                "pgv_m_s", component_named(SINGLE_COMPONENT), warnings=curve.warnings
            )
            return replace(single, magnitudes_from_g=curve.magnitudes_from_g)
        warnings = list(curve.warnings)
        name, factor, spread = _measure(
            curve, meaning.get("convert"), meaning.get("convert_sigma"), warnings
        )
        component = component_of(curve, meaning.get("component"))
        if component is None:
            warnings.append(SINGLE_CURVE)
            component = component_named(SINGLE_COMPONENT)
        elif component.name != SINGLE_COMPONENT:
            warnings.append(component.in_words("the curve is"))
        ratio = None if curve.period_s is None else component.spectral_ratio(curve.period_s)
        return cls.about(name, component, factor, spread, tuple(warnings), ratio)

    @classmethod
    def about(
        cls,
        name: str,
        component: Component,
        factor: float = 1.0,
        spread: float = 0.0,
        warnings: tuple[str, ...] = (),
        ratio: float | None = None,
    ) -> HazardLevel:
        """Return the interpretation of a measure of a given component.

        Args:
            factor: what it is multiplied by.
            spread: standard deviation of the logarithm of the result, in addition to that of
                the component.
            ratio: ratio of the component, where the levels are of another measure; None for that
                of `name`.
        """
        scatter = math.hypot(component.sigma, spread)
        xi, weight = scatter_steps(scatter, _REACH, _SCATTER_POINTS)
        median = factor / (component.ratio(name) if ratio is None else ratio)
        return cls(name, median * np.exp(scatter * xi), weight, median, warnings)


SINGLE_CURVE = Diagnostic(
    "the hazard curve is assumed to be of a single horizontal component; hazard tools mostly give "
    "RotD50: use component='rotd50'",
    "single_component",
    fields=("component",),
)
"""Note of a rate whose curve does not specify the component."""


def component_of(curve: HazardCurve, name: str | None) -> Component | None:
    """Return the horizontal component of a curve; None where neither user nor file gives it."""
    name = curve.component or None if name is None else name
    return None if name is None else component_named(name)


def _measure(
    curve: HazardCurve, convert: str | None, sigma: float | None, warnings: list[str]
) -> tuple[str, float, float]:
    """Return the name in `predict`, the factor from the unit of the curve, and the dispersion."""
    # A curve of SA can serve models of PGV by a published conversion PGV = factor · SA(T), whose
    # scatter is integrated like that of the component.
    if convert is None:
        if sigma is not None:
            both = ("convert_sigma", "convert")
            raise InputError("convert_sigma requires convert: omit it", fields=both)
        if curve.known_as is None:
            raise InputError(
                f"{curve.source}: no model uses {curve.imt}: give a curve of one of {ANSWERED}",
                fields=("imt",),
            )
        return curve.known_as, 1.0, 0.0
    if curve.measure != "sa_g":
        raise InputError(
            f"{curve.source}: convert = {convert} is for spectral accelerations; the curve is of "
            f"{curve.imt}",
            fields=("convert",),
        )
    used = velocity_conversion(convert)
    if not curve.is_of(used.period_s):
        raise InputError(
            f"{curve.source}: {used.name} is for SA({used.period_s:g}), not for {curve.imt}: "
            f"choose the curve with imt 'SA({used.period_s:g})'",
            fields=("imt",),
        )
    spread = used.scatter if sigma is None else sigma
    if not 0.0 < spread < math.inf:
        raise InputError(
            f"convert_sigma = {spread:g}: give the standard deviation of ln PGV about the "
            "conversion, above zero",
            fields=("convert_sigma",),
        )
    warnings.append(
        Diagnostic(
            f"PGV is predicted from {curve.imt}: median {used.factor:.4g} m/s per g, σ_ln "
            f"{spread:g}, integrated ({used.source})",
            "spectral_conversion",
        )
    )
    if curve.known_as is not None:
        text = f"{curve.imt} need not be converted: there are models of it"
        warnings.append(Diagnostic(text, "conversion_not_needed"))
    return "pgv_m_s", used.factor, spread


class RateKeywords(BlockKeywords[V], CurveKeywords, AnsweringFields, total=False):
    """Keywords of blocks, hazard curves and models for annual rates."""


class ModelPart(NamedTuple):
    """Blocks of one model.

    Args:
        indices: where they stand among all, shape (m,).
        numbers: what the model reads of them, by field, shape (m,) each.
    """

    indices: NDArray[np.intp]
    numbers: Mapping[str, FloatArray]
    model: FragilityModel


def parts_by_model(
    inputs: Mapping[str, Any], shaking: HazardLevel, answering: AnsweringFields
) -> tuple[list[ModelPart], tuple[str, ...], NDArray[np.object_]]:
    """Return the blocks grouped by model.

    Returns:
        The parts, warnings about the blocks, and of each why it cannot be used, empty for
        those that can.

    Raises:
        InputError: blocks that are described twice or in part, or are of one kind without a model.
        UnknownModelError: no model of that name, or of the one kind that there is.
    """
    blocks, size = blocks_of_arrays(inputs)
    reason = block_reasons_of(blocks, size)
    parts = []
    for group in blocks.groups:
        indices = np.arange(size) if group.indices is None else group.indices
        try:
            chosen = model_for(answering, (*group.numbers, shaking.name), group.kind)
        except (InputError, UnknownModelError) as error:
            if len(blocks.groups) == 1:
                raise
            reason[indices] = np.where(reason[indices] == "", str(error), reason[indices])
            continue
        accepted = np.flatnonzero(reason[indices] == "")
        if accepted.size:
            values = {
                n: np.broadcast_to(v, indices.shape)[accepted] for n, v in group.numbers.items()
            }
            # a block may fail at a PGA below the range of the disaggregation
            start = shaking.magnitudes_from_g
            weakest = float(values[chosen.method.block.strength].min())
            if start is not None and start > weakest:
                raise InputError(
                    "Disaggregation levels must start at or below k_r: they, or those of the "
                    f"curve, start at {start:.3g} g, and a block fails from {weakest:.3g} g on: "
                    "disaggregate at higher probabilities, too (poes_disagg)",
                    fields=("disaggregation",),
                )
            parts.append(ModelPart(indices[accepted], values, chosen))
    return parts, blocks.remarks, reason
