"""Validation of the inputs of a prediction, and the prediction where warnings apply.

Every check is written once and looks at single numbers or at arrays. No sentence holds a
semicolon, which separates the reasons of an array's element. Only functions of arrays load numpy.

Every command that takes tables of blocks answers the rows that it can, gives the others NaN and
the reason (:func:`block_reasons`), and counts them (:func:`describe_invalid`). An answer that needs
all rows, or a table of which none can be used, is rejected by :func:`reject`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple, NoReturn, cast

from rbfrag.errors import InputError
from rbfrag.fragility.completion import MOMENTS
from rbfrag.fragility.confidence import Quantiles
from rbfrag.fragility.domain import RATIOS
from rbfrag.fragility.measures import (
    AMPLIFIED,
    CREDIBLE,
    HIGHEST,
    LOWEST,
    TERMS,
    most_over_pga,
)
from rbfrag.fragility.method import ArrayNamespace, BlockParameters, arrays
from rbfrag.fragility.model import LEAST, Answer, FragilityModel
from rbfrag.results.diagnostic import Diagnostic
from rbfrag.results.numbers import exact_percent, percent
from rbfrag.solver.kinds import BY_MECHANICS
from rbfrag.vocabulary.quantities import INPUTS, INTENSITY, NUMBERS, QUANTITIES
from rbfrag.vocabulary.spectral import spectral_names

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from rbfrag.fragility.shaking import MeanModel


_UNITS = {"velocity_m_s": "m/s"}


def _unit(name: str) -> str:
    unit = QUANTITIES[name].unit if name in QUANTITIES else _UNITS.get(name, "")
    return "°" if unit == "deg" else unit


def _word(name: str) -> str:
    """Return the name of an input, or of a value that is derived the label."""
    if name == "velocity_m_s":
        return TERMS["sa"].title
    return name if name in INPUTS or name not in QUANTITIES else QUANTITIES[name].noun


def _prompt(name: str) -> str:
    return QUANTITIES[name].prompt if name in QUANTITIES else f"{name}, a number"


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
        text: what is wrong and what to do; where it depends on other values, a function of the
            value, or of None for many values.
        how: what answers there, in place of the model; empty where the model does.
        code: of the warning, one of :data:`rbfrag.results.diagnostic.CODES`; that of a reason
            against any answer is that of rejected rows.
    """

    holds: Any
    name: str
    value: Any
    text: str | Callable[[float | None], str]
    how: str = ""
    code: str = "rows_rejected"

    def about(self, value: float) -> str:
        """Return the sentence for one value."""
        if not isinstance(self.text, str):
            return self.text(value)
        if not self.name:
            return self.text
        unit = _unit(self.name)
        return f"{_word(self.name)} = {value:.6g}{' ' if unit else ''}{unit} {self.text}"

    def in_general(self) -> str:
        """Return the sentence for many values."""
        if not isinstance(self.text, str):
            return self.text(None)
        return f"{_word(self.name)} {self.text}" if self.name else self.text


_RATIO_NAMES = frozenset(ratio.name for ratio in RATIOS)

NOTABLE_SHARE = 0.05
"""From this share of an uncertain block, or of P, outside the fitted ranges on it is told."""


def _partly_outside(model: FragilityModel, inputs: Mapping[str, Any], share: float | None) -> str:
    """Return the warning about a fraction outside the fitted ranges; None of many answers."""
    of = "P comes from" if model.scattered else "the block uncertainty lies"
    part, mostly = f"at least {exact_percent(NOTABLE_SHARE)}", ""
    if share is not None and model.uncertain:
        part = percent(share)
        if (main := cast("MeanModel", model).main_excursion(inputs)) is not None:
            name, edge = main
            side = "below" if edge == model.row.domain[name][0] else "above"
            is_pgv = name == "intensity_m_s" and model.term.inputs[0] == "pgv_m_s"
            name = "pgv_m_s" if is_pgv else name
            word = (name in QUANTITIES and QUANTITIES[name].symbol) or _word(name)
            mostly = f" (mostly {word} {side} {edge:.3g} {_unit(name)})".replace(" )", ")")
    return (
        f"{part} of {of} outside the fitted range{mostly}: the answer is in part an extrapolation"
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
    # models use the logarithms of these
    floored = {
        name: ns.maximum(value, LEAST) if name == block.strength or name in AMPLIFIED else value
        for name, value in inputs.items()
    }
    values = model.completed(floored, ns)
    for bound in block.rejects:
        holds = bound.holds(values) & _not(missing) & _not(at_rest)
        reject(holds, Remark(holds, bound.about, values.get(bound.about), bound.text))
        missing = missing | holds
    intensity = values["intensity_m_s"] * (inputs[term.inputs[0]] != 0.0)
    for name in ("y_m_s", "intensity_m_s", "displacement_m", "pgv_m_s"):
        if name in values:
            values[name] = ns.maximum(values[name], LEAST)
    above_zero = {
        name: ns.maximum(value, LEAST) for name, value in values.items() if name != MOMENTS
    }
    model.with_ratios(values, above_zero)
    no_shaking: Any = inputs[term.inputs[0]] == 0.0
    for name in {"pgv_m_s", "pga_g"} & {*term.inputs}:  # no motion has one peak without the other
        no_shaking = no_shaking | (inputs[name] == 0.0)
    no_shaking = no_shaking & _not(missing) & _not(at_rest)
    say(no_shaking, Remark(no_shaking, "", 0.0, NO_SHAKING, BY_MECHANICS, "no_shaking"))
    unanswered = missing | at_rest | no_shaking
    ruled = unanswered
    for bound in model.bounds(inputs):
        holds = bound.holds(values) & _not(ruled)
        # of many values one text, which names none
        text = bound.reason(values if nothing is False else {})
        say(holds, Remark(holds, "", 0.0, text, bound.how, "by_mechanics"))
        ruled = ruled | holds
    if ruled is True:  # a single block, which cannot fail or has no answer
        of_block = (0.0, 0.0) if model.uncertain else (None, None)
        answer = Answer(0.0, 0.0, 0.0, None, None, *of_block)
    else:
        answer = model.answer(values, quantiles, ns, floored)
    if answer.outside is not None:
        partly = (answer.outside >= NOTABLE_SHARE) & _not(ruled)
        warning = partial(_partly_outside, model, floored)
        say(partly, Remark(partly, "", answer.outside, warning, code="extrapolation"))
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


def _not(condition: Any) -> Any:
    return condition ^ True


def outside_domain(model: FragilityModel, values: Mapping[str, Any]) -> Iterator[Remark]:
    """Yield the variables outside their fitted range, and inconsistent intensity measures."""
    for ratio in model.ratios_of(values):
        low, high = ratio.limits(model.row.domain)
        value = values[ratio.name]
        outside = (value < low * (1.0 - 1e-9)) | (value > high * (1.0 + 1e-9))
        text = partial(ratio.contradiction, values, model.row.domain.get(ratio.name))
        yield Remark(outside, "", value, text, code="extrapolation")
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
    for name in (*CREDIBLE, *spectral_names(values)):
        if name in values:
            (low, high, text), value = CREDIBLE[name], values[name]
            strange = (value < low) | (value > high)
            yield Remark(strange, name, value, f"is {text}", code="suspicious_value")
    for name in spectral_names(values) if "pga_g" in values else ():
        most = most_over_pga(name)
        text = f"is more than {most:.2g} times PGA, as in no record: check both"
        strange = values[name] > most * values["pga_g"]
        yield Remark(strange, name, values[name], text, code="suspicious_value")


FROM_SUMS = " and are left out of all sums, which are lower bounds"
"""What becomes of such blocks where numbers of several are added."""

FROM_MEAN = " and are left out of the mean"
"""The same where the answer is a mean over blocks."""

FIRST = 6
"""So many of them are named."""

_MOST_CHARACTERS = 260


def block_reasons(
    block: BlockParameters, values: Mapping[str, NDArray[np.float64]]
) -> NDArray[np.object_]:
    """Return why blocks cannot fail in an earthquake, in the words of `predict`; empty where they
    can.

    Args:
        values: parameters of the block, options and standard deviations, if there are any, by the
            names of :func:`rbfrag.predict`, shape (m,) each; an option may be NaN for the block's
            own.
    """
    import numpy as np

    reasons = np.full(values[block.strength].shape, "", dtype=object)

    def say(finding: Remark) -> None:
        for i in np.flatnonzero(finding.holds & (reasons == "")).tolist():
            value = float(finding.value[i])
            reasons[i] = finding.in_general() if value != value else finding.about(value)

    names = [name for name in (*block.options, *block.sigmas) if name in values]
    with np.errstate(all="ignore"):
        filled = block.filled(values)
        for finding in rejections(filled, (*block.names, *names), (block.strength, *block.options)):
            say(finding)
        strength = filled[block.strength]
        unstable = "is not above zero: the block is unstable and fails without an earthquake"
        say(Remark(strength <= 0.0, block.strength, strength, unstable))
        adjusted = dict(filled)
        if block.adjust is not None:
            block.adjust(adjusted, arrays())
        for bound in block.rejects:
            if bound.about in names:
                say(Remark(bound.holds(adjusted), bound.about, filled[bound.about], bound.text))
    return reasons


def describe_invalid(
    count: int, total: int, labels: Sequence[str], reasons: Sequence[str], effect: str = ""
) -> tuple[Diagnostic, ...]:
    """Describe the rejected blocks; empty if there are none.

    Args:
        labels: where they stand, or the first.
        reasons: why they could not be used.
        effect: what becomes of them in numbers of several blocks; those of a mean have no row.
    """
    if not count:
        return ()
    number = f"{count:,} of {total:,} blocks could not be used{effect}"
    if effect == FROM_MEAN:
        return (Diagnostic(f"{number}: {in_list(labels, reasons)}", "rows_rejected"),)
    which = "it is" if count == 1 else "the first is"
    text = f"{number}; the reasons stand in the column reason; {which} {labels[0]}: {reasons[0]}"
    return (Diagnostic(text, "rows_rejected"),)


def reject(
    source: str, labels: Sequence[str], reasons: Sequence[str], total: int, why: str = ""
) -> NoReturn:
    """Reject a table in which some or all blocks are invalid.

    Args:
        source: what messages call them.
        labels: where those stand that cannot be used; if none can, of the first.
        reasons: why each cannot be used.
        why: why the others do not do; empty where there are no others.
    """
    if not why or len(labels) == total:
        listed = in_list(labels[:FIRST], reasons[:FIRST])
        if total == 1:
            raise InputError(f"{source}: invalid block: {listed}")
        more = f", the first {FIRST}" if total > FIRST else ""
        raise InputError(f"{source}: none of {total:,} blocks is valid{more}: {listed}")
    raise InputError(
        f"{source}: {len(labels):,} of {total:,} blocks are invalid, and {why}: "
        f"{in_list(labels, reasons)}: correct or remove these rows"
    )


def reject_elements(
    reasons: NDArray[np.object_], why: str = "", fields: Collection[str] = ()
) -> None:
    """Reject arrays with invalid elements; without `why` only if all are invalid.

    Args:
        reasons: of each element, empty where it can be used, shape (m,).
        why: why the others do not do.
        fields: fields in the reason that each interface prints in its own spelling.
    """
    wrong = elements(reasons)
    if reasons.size == 1 and wrong:
        raise InputError(reasons[0], fields=fields)
    if wrong and (why or len(wrong) == reasons.size):
        reject("blocks", wrong, [text for text in reasons.tolist() if text], reasons.size, why)


def elements(reasons: NDArray[np.object_]) -> list[str]:
    """Return the indices of invalid elements of an array."""
    import numpy as np

    return [f"element {i}" for i in np.flatnonzero(reasons != "").tolist()]


def in_list(labels: Iterable[str], reasons: Iterable[str]) -> str:
    """Describe blocks with their reasons in one phrase: grouped by reason, as many as fit.

    Args:
        labels: where each stands, as "line 3 (block A7)".
        reasons: why it cannot be used.
    """
    alike: dict[str, list[str]] = {}
    for place, reason in zip(labels, reasons, strict=True):
        alike.setdefault(reason, []).append(place)
    text, unlisted = "", sum(map(len, alike.values()))
    for reason, members in alike.items():
        more = f" and {len(members) - FIRST:,} more" if len(members) > FIRST else ""
        phrase = f"{', '.join(members[:FIRST])}{more}: {reason}"
        if text and len(text) + len(phrase) > _MOST_CHARACTERS:
            break
        text += f"{'; ' if text else ''}{phrase}"
        unlisted -= len(members)
    return text + (f"; and {unlisted:,} more" if unlisted else "")
