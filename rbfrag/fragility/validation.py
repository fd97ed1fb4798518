"""Validation of the inputs of a prediction, and the prediction where warnings apply.

Every check is written once and looks at single numbers or at arrays. No sentence holds a
semicolon, which separates the reasons of an array's element.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

from rbfrag.fragility.confidence import Quantiles
from rbfrag.fragility.domain import RATIOS, Ratio
from rbfrag.fragility.measures import AMPLIFIED, CREDIBLE, HIGHEST, LOWEST
from rbfrag.fragility.method import ArrayNamespace
from rbfrag.fragility.model import LEAST, Answer, FragilityModel
from rbfrag.results.numbers import exact_percent
from rbfrag.solver.kinds import BY_MECHANICS
from rbfrag.vocabulary.quantities import INPUTS, INTENSITY, NUMBERS, QUANTITIES


def _unit(name: str) -> str:
    unit = QUANTITIES[name].unit if name in QUANTITIES else ""
    return "°" if unit == "deg" else unit


def _word(name: str) -> str:
    """Return the name of an input, or of a value that is derived the label."""
    return name if name in INPUTS or name not in QUANTITIES else QUANTITIES[name].noun


def _prompt(name: str) -> str:
    return QUANTITIES[name].prompt if name in QUANTITIES else f"{name}, a number"


_FLOORED = tuple(name for name in AMPLIFIED if name not in ("pgv_m_s", "pgd_m"))
"""Measures whose logarithms models use; PGV and PGD are intensities, which have a floor too."""

_ABOVE_ZERO = {
    name: "earthquake" if name in INTENSITY else "block"
    for name in (*NUMBERS, "displacement_m", *INTENSITY)
    if QUANTITIES[name].range.above == 0.0
}


@dataclass(frozen=True)
class Remark:
    """Diagnostic about one input of a prediction.

    Args:
        holds: whether (where) it is so.
        name: the value concerned.
        text: what is wrong and what to do.
        how: what answers there, in place of the model; empty where the model does.
        code: of the warning, one of :data:`rbfrag.results.diagnostic.CODES`; that of a reason
            against any answer is that of rejected rows.
    """

    holds: Any
    name: str
    value: Any
    text: str
    how: str = ""
    code: str = "rows_rejected"

    def about(self, value: float) -> str:
        """Return the sentence for one value."""
        if not self.name:
            return self.text
        unit = _unit(self.name)
        return f"{_word(self.name)} = {value:.6g}{' ' if unit else ''}{unit} {self.text}"

    def in_general(self) -> str:
        """Return the sentence for many values."""
        return f"{_word(self.name)} {self.text}" if self.name else self.text


@dataclass(frozen=True, kw_only=True)
class Contradiction(Remark):
    """Intensity measures that are inconsistent: their combination occurs in no fitted motion.

    Args:
        ratio: what is out of its range.
        fitted: least and greatest ratio of the fitted motions; None where the model says nothing
            of it.
    """

    ratio: Ratio
    values: Mapping[str, Any]
    fitted: tuple[float, float] | None

    def about(self, value: float) -> str:
        """Return the sentence for one value."""
        return self.ratio.contradiction(self.values, value, self.fitted)

    def in_general(self) -> str:
        """Return the sentence for many values."""
        return self.ratio.in_general(self.fitted)


_RATIO_NAMES = frozenset(ratio.name for ratio in RATIOS)

NOTABLE_SHARE = 0.05
"""From this share of an uncertain block, or of P, outside the fitted ranges on it is told."""

PARTLY_OUTSIDE = (
    f"at least {exact_percent(NOTABLE_SHARE)} of P, or of the block uncertainty, comes from "
    "outside the fitted range: the answer is in part an extrapolation"
)

NO_SHAKING = "no shaking"


def rejections(
    values: Mapping[str, Any], needed: Collection[str], signed: Collection[str] = ()
) -> Iterator[Remark]:
    """Yield the reasons that make a prediction impossible; `signed` names values that may be
    negative.
    """
    for name in needed:
        value = values[name]
        prompt = _prompt(name)
        yield Remark(value != value, name, value, f"is not a number: give {prompt}")
        if name in _ABOVE_ZERO:
            yield Remark(value <= 0.0, name, value, f"is not above zero: give {prompt}")
            low = (value > 0.0) & (value < LOWEST)
            of = _ABOVE_ZERO[name]
            yield Remark(low, name, value, f"is too small for any {of}: give {prompt}")
        elif name not in signed:
            yield Remark(value < 0.0, name, value, f"is negative: give {prompt}")
        large = (value > HIGHEST) | (value == -math.inf)
        yield Remark(large, name, value, f"is beyond any block or earthquake: give {prompt}")


class Judgement(NamedTuple):
    """Prediction with the diagnostics of its inputs.

    Args:
        answer: what the model says.
        values: the completed values.
        intensity_m_s: the intensity term as it is [m/s].
        missing: where no answer is possible.
        in_domain: whether block and motion lie in the ranges that were fitted.
        ruled: where the answer is not the model's.
    """

    answer: Answer
    values: dict[str, Any]
    intensity_m_s: Any
    missing: Any
    in_domain: Any
    ruled: Any


def answer_with_findings(
    model: FragilityModel,
    inputs: Mapping[str, Any],
    needed: Collection[str],
    quantiles: Quantiles | None,
    ns: ArrayNamespace,
    *,
    say: Callable[[Any, Remark], None],
    reject: Callable[[Any, Remark], None],
    unstable: Callable[[Any, Remark], None],
    nothing: Any,
) -> Judgement:
    """Return the prediction for inputs that may need warnings.

    Args:
        inputs: what is given, by name: numbers, or arrays of one shape.
        needed: names of the values without which there is no answer.
        quantiles: of the confidence level; None for no interval.
        say: called with where a sentence holds, and the finding.
        reject: the same for what makes an answer impossible.
        unstable: the same where a block fails without an earthquake.
        nothing: False, or an array of it in the shape of the values.
    """
    block, term = model.method.block, model.term
    missing = nothing
    for finding in rejections(inputs, needed, (block.strength, *block.options)):
        reject(finding.holds, finding)
        missing = missing | finding.holds
    strength = inputs[block.strength]
    prompt = _prompt(block.strength)
    at_rest = (strength <= 0.0) & _not(missing)
    unstable(
        at_rest, Remark(at_rest, block.strength, strength, f"is not above zero: give {prompt}")
    )
    floored = dict(inputs)
    for name in (block.strength, *_FLOORED):
        if name in floored:
            floored[name] = ns.maximum(floored[name], LEAST)
    values = block.completed(floored, term, ns)
    for bound in block.rejects:
        holds = bound.holds(values) & _not(missing) & _not(at_rest)
        reject(holds, Remark(holds, bound.about, values.get(bound.about), bound.text))
        missing = missing | holds
    intensity = values["intensity_m_s"]
    for name in ("y_m_s", "intensity_m_s", "displacement_m", "pgv_m_s"):
        if name in values:
            values[name] = ns.maximum(values[name], LEAST)
    above_zero = {name: ns.maximum(value, LEAST) for name, value in values.items()}
    model.with_ratios(values, above_zero)
    no_shaking = (inputs[term.inputs[0]] == 0.0) & _not(missing) & _not(at_rest)
    say(no_shaking, Remark(no_shaking, "", 0.0, NO_SHAKING, BY_MECHANICS, "no_shaking"))
    unanswered = missing | at_rest | no_shaking
    ruled = unanswered
    for bound in model.bounds(inputs):
        holds = bound.holds(values) & _not(ruled)
        # of many values one text, which names none
        text = bound.reason(values if nothing is False else {})
        say(holds, Remark(holds, "", 0.0, text, bound.how, "by_mechanics"))
        ruled = ruled | holds
    answer = _never(model) if ruled is True else model.answer(values, quantiles, ns, floored)
    if answer.outside is not None:
        partly = (answer.outside >= NOTABLE_SHARE) & _not(ruled)
        say(partly, Remark(partly, "", answer.outside, PARTLY_OUTSIDE, code="extrapolation"))
    in_domain = _not(missing)
    if model.scattered and answer.outside is not None:
        in_domain = in_domain & _not(partly)
    for finding in () if model.scattered else outside_domain(model, values):
        holds = finding.holds & _not(ruled)
        say(holds, finding)
        in_domain = in_domain & _not(holds)
    if model.spread is not None and not model.scattered:
        together = _not(model.spread.holds(above_zero, ns)) & in_domain & _not(ruled)
        say(together, Remark(together, "", 0.0, model.spread.sentence, code="extrapolation"))
        in_domain = in_domain & _not(together)
    for finding in doubts(model, values, ns):
        say(finding.holds & _not(unanswered), finding)
    return Judgement(answer, values, intensity, missing, in_domain, ruled)


def _never(model: FragilityModel) -> Answer:
    """Return P = 0 where mechanics rules out the failure of a single block."""
    of_block = (0.0, 0.0) if model.uncertain else (None, None)
    return Answer(0.0, 0.0, 0.0, None, None, *of_block)


def _not(condition: Any) -> Any:
    return condition ^ True


def outside_domain(model: FragilityModel, values: Mapping[str, Any]) -> Iterator[Remark]:
    """Yield the variables outside their fitted range, and inconsistent intensity measures."""
    for ratio in model.ratios_of(values):
        low, high = ratio.limits(model.row.domain)
        value = values[ratio.name]
        outside = (value < low * (1.0 - 1e-9)) | (value > high * (1.0 + 1e-9))
        fitted = model.row.domain.get(ratio.name)
        yield Contradiction(
            outside, "", value, "", "", "extrapolation", ratio=ratio, values=values, fitted=fitted
        )
    for name, (low, high) in model.row.domain.items():
        if name not in values or name in _RATIO_NAMES:
            continue
        value = values[name]
        unit = _unit(name)
        # A p² computed from a shape may miss the edge by rounding.
        below, above = value < low * (1.0 - 1e-9), value > high * (1.0 + 1e-9)
        for holds, edge in ((below, low), (above, high)):
            yield Remark(
                holds,
                name,
                value,
                f"is outside the fitted range {low:.4g} to {high:.4g} {unit} (nearest edge "
                f"{edge:.4g}): the answer is an extrapolation",
                code="extrapolation",
            )


def doubts(
    model: FragilityModel, values: Mapping[str, Any], ns: ArrayNamespace
) -> Iterator[Remark]:
    """Yield where the model becomes unphysical, and suspicious values."""
    if model.method.doubts is not None:
        for holds, name, text in model.method.doubts(model.parameters, values, ns):
            yield Remark(holds, name, values[name], text, code="extrapolation")
    for name, (low, high, text) in CREDIBLE.items():
        if name in values:
            value = values[name]
            strange = (value < low) | (value > high)
            yield Remark(strange, name, value, f"is {text}", code="suspicious_value")
