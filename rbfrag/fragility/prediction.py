"""Probability that a block fails, predicted by one model.

For single numbers neither numpy nor any other library is loaded.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal, TypeVar

from rbfrag.errors import InputError
from rbfrag.fragility import describe
from rbfrag.fragility.confidence import Quantiles, checked_level, quantiles_of
from rbfrag.fragility.dependence import Loadings
from rbfrag.fragility.measures import ABOUT_SCATTER, most_over_pga
from rbfrag.fragility.method import SINGLE, arrays
from rbfrag.fragility.model import AT_REST, NO_EVENT_RANGE, FragilityModel
from rbfrag.fragility.model_selection import check_numbers
from rbfrag.results.diagnostic import Diagnostic, diagnostics
from rbfrag.results.numbers import TINY, confidence, equals, exact_percent, interval, percent
from rbfrag.results.result import Result, TextLine, TextTable
from rbfrag.solver.kinds import BY_MECHANICS, by_model, mode_of_kind

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from rbfrag.fragility.prediction_array import PredictionArray
    from rbfrag.fragility.validation import Judgement, Remark

_SINGLE_TYPES = (float, int, str, bytes)
MOST_SITES = 10_000


OF_EACH_MODEL = (
    "model", "term", "method", "probability", "ci_low", "ci_high", "event_low", "event_high",
    "in_domain", "how",
)  # fmt: skip
"""Keys of the answer of each suited model."""

OF_POLARITY = ("probability", "ci_low", "ci_high", "intensity_m_s")
"""Keys that are shown of each polarity."""

ERRORS_APART = "beta_sigma_deg='2' etc. put the errors of measurement into the interval"

_OPTIONAL = ("y_m_s", "median_displacement_m", "block_sd", "event_low", "event_high")
"""Keys that a terminal does not show where they do not apply."""


@dataclass(frozen=True)
class Prediction(Result):
    """Probability that one block fails in one motion.

    Args:
        kind: how the block fails.
        probability: P, between 0 and 1.
        ci_low: lower end of the confidence interval of P: how well the share of such blocks that
            fail over all earthquakes and sites is known.
        ci_high: upper end of it.
        event_low: lower end of the share of like blocks, facing all sides, that fails at the sites
            asked for in one earthquake; None where none are, and
            where the model does not know what its blocks share.
        event_high: upper end of it.
        level: confidence level of the interval, and probability of that range.
        model: name of the model that answered.
        term: its intensity term.
        method: how it was fitted.
        failure: what the probability is one of, in words.
        y_m_s: velocity k g/p of the block [m/s]; None where it has no size.
        intensity_m_s: the intensity term of the motion [m/s].
        in_domain: True when block and motion lie in the ranges that were fitted.
        warnings: sentences about suspicious input or an answer to be doubted.
        pgv_over_pga_s: PGV over PGA [s] where both are known, else None: what tells long from
            short pulses where Tm is not known.
        median_displacement_m: the displacement that is exceeded with P = 1/2 [m]; None where the
            kind has none, where the block does not move and where it is uncertain.
        block_sd: standard deviation of P over what an uncertain block may be; None where it is
            certain.
        data: the database that the model is of; None of a model that was given itself.
        how: what answered: ``by mechanics`` and ``by the spectrum bound``, which forbid failure, or
            ``model NAME``.
        shaking: where the shaking is uncertain, the median of each measure that scatters, the
            standard deviation ``sigma`` of its logarithm, and ``tau``, the part of it that all
            sites of an earthquake share, where that is known; else None.
        drained: of a block with water behind it the same answer without water pressure:
            ``probability``, ``ci_low``, ``ci_high`` and the yield by its name, such as ``kr`` (None
            of a block that is unstable at rest); None of a dry block.
        uncertainty: with standard deviations of measured fields the ``fraction`` of the variance
            of the probit of P by ``source``: fields, ``gmm`` (the ground-motion model),
            ``fragility`` and ``together``; else empty.
        as_stated: ``probability``, ``ci_low`` and ``ci_high`` of the values as they are stated,
            without these; None where there are none, and of a block that is unstable as stated.
        sensitivity: of a block given by its geometry P where one ``field`` is off by a usual
            measurement error: ``step`` in degrees, or as a fraction of a length, and the ``low``
            and the ``high`` P; the field that moves P most first.
        solution: where a probability is asked for, the ``field`` that is changed, its ``value``
            here and as ``stated``, and of k_r ``added_kr``, the difference; else None.
        drawn: P of each draw of the measured fields that stands at rest.
        inputs: numbers of the block and measures of the shaking that it is the answer for.
        sites: number of sites of one earthquake that were asked for; None where none were.
        alternatives: the answers of all models that the measures suffice for, the recommended
            first; empty where one was asked.
    """

    kind: str
    probability: float
    ci_low: float
    ci_high: float
    event_low: float | None
    event_high: float | None
    level: float
    model: str
    term: str
    method: str
    failure: str
    y_m_s: float | None
    intensity_m_s: float
    in_domain: bool
    warnings: tuple[str, ...] = ()
    pgv_over_pga_s: float | None = None
    median_displacement_m: float | None = None
    block_sd: float | None = None
    data: str | None = field(default=None, compare=False)
    shaking: dict[str, dict[str, float]] | None = None
    how: str = ""
    drained: dict[str, float | None] | None = None
    uncertainty: tuple[dict[str, Any], ...] = ()
    as_stated: dict[str, float] | None = None
    sensitivity: tuple[dict[str, Any], ...] = ()
    solution: dict[str, Any] | None = None
    drawn: tuple[float, ...] = field(default=(), compare=False, repr=False)
    inputs: Mapping[str, Any] = field(default_factory=dict, compare=False, repr=False)
    sites: int | None = field(default=None, repr=False)
    alternatives: tuple[Prediction, ...] = field(default=(), compare=False, repr=False)

    @property
    def mode(self) -> str:
        """Failure mode of the block."""
        return mode_of_kind(self.kind)

    def sentences(self) -> Iterator[str]:
        """Yield the probability with its interval: "P(toppling) = 15 %   (95 % confidence …)"."""
        p, name = self.probability, f"P({self.failure.replace('_', ' ')})"
        if self._is_by_mechanics:
            reason = "the block is unstable without shaking" if p == 1.0 else self._reason()
            yield "   ".join(filter(None, (f"{name} = {p:g}", reason, f"({self.how})")))
            return
        # a model forbids nothing: where its P is 0 to rounding, a bound is printed
        values = p, self.ci_low, self.ci_high
        p, low, high = (0.0 if v is None else min(max(v, TINY), 1.0 - TINY) for v in values)
        if vars(self)["ci_low"] is None:  # much of the measured range has no answer
            yield f"{equals(name, percent(p))}   (no interval)"
            return
        kind = "uncertainty" if self.uncertainty else "confidence"
        ends = confidence(self.level, interval(low, high), kind)
        exact = ", dimensions exact" if self.sensitivity else ""
        yield f"{equals(name, percent(p))}   ({ends}{exact})"

    @property
    def _is_by_mechanics(self) -> bool:
        """True if mechanics gives P = 0 or 1 in place of the model."""
        return self.probability in (0.0, 1.0) and self.how != by_model(self.model)

    def _reason(self) -> str:
        """Return why P = 0."""
        codes = ("by_mechanics", "no_shaking")
        return next((str(text) for text in diagnostics(self.warnings) if text.code in codes), "")

    def lines(self) -> Iterator[TextLine]:
        """Yield the inputs, the prediction interval, the drained bound and the model."""
        yield from self._about_uncertainty()
        if shaking := describe.shaking(self.shaking or {}, self.inputs):
            yield TextLine("Shaking", shaking)
        if self.sites is not None:
            yield TextLine("Sites", self._at_sites(self.sites))
        if block := describe.block(self.method, self.inputs):
            yield TextLine("Block", block)
        if self.median_displacement_m is not None:
            yield TextLine("", f"median displacement {self.median_displacement_m:.2g} m")
        if self.block_sd is not None:
            yield TextLine("", f"block uncertainty: standard deviation of P {self.block_sd:.2g}")
        if self.drained is not None:
            yield TextLine("Drained", describe.drained_bound(self.drained))
        if self._is_by_mechanics:
            yield TextLine("Model", "mechanics; no fitted model is used")
            return
        inside = "within" if self.in_domain else "outside"
        yield TextLine("Model", f"{self.model}, {self.data}; inputs {inside} the fitted range")

    def _about_uncertainty(self) -> Iterator[TextLine]:
        """Yield the answer as stated, the sources of the interval and the sensitivity."""
        if self.solution is not None:
            yield TextLine("Solution", describe.solution(self.solution))
        if self.as_stated is not None:
            p, low, high = self.as_stated.values()
            text = f"{percent(p)}     (fragility parameters alone {interval(low, high)})"
            yield TextLine("As stated", text)
        if sources := describe.sources(self.uncertainty, self.inputs):
            yield TextLine("Sources", sources)
        if self.sensitivity:
            yield TextLine("Sensitivity", describe.sensitivity(self.sensitivity))
            yield TextLine("", ERRORS_APART)

    def _at_sites(self, sites: int) -> str:
        where = f"in one earthquake at {sites:,g} such site{'s' if sites > 1 else ''}"
        if self.event_low is None or self.event_high is None:
            return f"{where}: unknown which fraction of the blocks fails"
        ends = interval(self.event_low, self.event_high)
        level = exact_percent(self.level)
        return f"{where}, {ends} of the blocks fail ({level} prediction interval)"

    def tables(self, *, verbose: bool = False) -> Iterator[TextTable]:
        """Yield the values and the predictions of all suitable models, if verbose."""
        if not verbose:
            return
        apart = ("drained", "warnings", "shaking", "answers", "polarities")
        yield TextTable(
            (),
            [(name, value) for name, value in self.as_dict().items()
             if name not in apart and (value or name not in _OPTIONAL)],
        )  # fmt: skip
        if len(self.alternatives) > 1:
            names = (
                "model", "term", "probability", "ci_low", "ci_high", "in_domain", "recommended",
            )  # fmt: skip
            yield TextTable(
                names, [[answer[name] for name in names] for answer in self.as_dict()["answers"]]
            )

    def as_dict(self) -> dict[str, Any]:
        """Return the prediction under the keys of the JSON contract."""
        values = {"kind": self.kind, "mode": self.mode, **vars(self)}
        values |= {n: [*values[n]] for n in ("warnings", "uncertainty", "sensitivity")}
        del values["inputs"], values["alternatives"], values["drawn"]
        if self.sites is None:
            del values["sites"]
        if self.alternatives:
            values["answers"] = [
                {name: getattr(answer, name) for name in OF_EACH_MODEL} | {"recommended": i == 0}
                for i, answer in enumerate(self.alternatives)
            ]
        return values

    def table_columns(self) -> Mapping[str, Any]:
        """Return the columns of the table of one row."""
        drained = {f"drained_{name}": value for name, value in (self.drained or {}).items()}
        columns = {"kind": self.kind, "mode": self.mode, **super().table_columns(), **drained}
        return {name: value for name, value in columns.items() if name != "sites"}


@dataclass(frozen=True)
class MotionPrediction(Prediction):
    """Probability that one block fails in a recorded motion of unknown direction.

    Every number of :class:`Prediction` is the mean of the two polarities.

    Args:
        forward: the answer where positive samples drive forward rotation.
        reverse: the answer where they drive backward.
    """

    forward: Prediction | None = None
    reverse: Prediction | None = None

    def tables(self, *, verbose: bool = False) -> Iterator[TextTable]:
        """Yield the predictions for both polarities among the tables."""
        tables = [*super().tables(verbose=verbose)]
        both = {"forward": self.forward, "reverse": self.reverse}
        rows = [
            (name, *(getattr(answer, key) for key in OF_POLARITY))
            for name, answer in both.items()
            if answer is not None
        ]
        yield from (*tables[:1], TextTable(("polarity", *OF_POLARITY), rows), *tables[1:])

    def as_dict(self) -> dict[str, Any]:
        """Return the prediction under the keys of the JSON contract, and both polarities."""
        result = super().as_dict()
        both = {name: result.pop(name) for name in ("forward", "reverse")}
        result["polarities"] = {
            name: None if answer is None else answer.as_dict() for name, answer in both.items()
        }
        return result


A = TypeVar("A", bound="Prediction | PredictionArray")


def add_warnings(
    answer: A, remarks: tuple[Diagnostic, ...], last: tuple[Diagnostic, ...] = ()
) -> A:
    """Add warnings about blocks (first) and about the shaking (last) to a prediction."""
    if not remarks and not last:
        return answer
    return with_values(answer, warnings=(*remarks, *answer.warnings, *last))


def with_values(answer: A, **values: Any) -> A:
    """Return a copy of a prediction with some fields replaced."""
    # a copy of the attributes: to make the object again takes as long as the answer
    result = object.__new__(type(answer))
    vars(result).update(vars(answer), **values)
    return result


def answer_given(
    model: FragilityModel,
    inputs: Mapping[str, ArrayLike],
    level: float,
    *,
    nan: Literal["propagate", "raise"] = "propagate",
    interval: bool = True,
    weights: ArrayLike | None = None,
    sites: float | None = None,
) -> Prediction | PredictionArray:
    """Return the prediction of one model from inputs by name; see :func:`predict`."""
    if sites is not None:
        model = model.for_inputs(inputs)
        answer = answer_given(model, inputs, level, nan=nan, interval=interval, weights=weights)
        return _at_sites(answer, model, sites, inputs, weights)
    model = model.for_inputs(inputs)
    if not inputs.keys() >= {*model.method.block.names}:
        check_numbers(model.kind, model.method.block, inputs)
    quantiles = quantiles_of(checked_level(level))
    # Kept apart: most questions are about certain blocks and shaking, and need no more.
    certain, scatter, uncertain, tau = model, None, None, None
    if not ABOUT_SCATTER.isdisjoint(inputs):
        from rbfrag.fragility.shaking import Scatter, ShakenModel, with_uncertain_velocity

        tau = inputs.get("pgv_tau")
        scatter, inputs = Scatter.of(model.term, inputs)
        uncertain = scatter
        if scatter is not None:
            scatter, inputs = with_uncertain_velocity(model, scatter, inputs)
    if weights is not None:
        from rbfrag.fragility.uncertain import drawn_model

        model, inputs = drawn_model(certain, inputs, weights)
    elif not model.method.block.sigmas.keys().isdisjoint(inputs):
        from rbfrag.fragility.uncertain import uncertain_model

        model, inputs = uncertain_model(certain, inputs)
    singles = single_numbers(inputs)
    if scatter is not None:
        if model is certain and singles is not None and scatter.single:
            model = ShakenModel.over(certain, scatter=scatter)
        else:
            from rbfrag.fragility.uncertain import GroundMotionQuadrature, UncertainModel

            points, possible = (
                GroundMotionQuadrature(certain, scatter),
                getattr(model, "possible", None),
            )
            model = UncertainModel.over(certain, possible=possible, points=points)
    if singles is not None:
        answer = _answer_single(model, singles, quantiles)
        if uncertain is None:
            return answer
        about = uncertain.in_numbers(singles, tau)
        return type(answer)(**(vars(answer) | {"shaking": about}))
    # Kept apart so that single numbers do not load numpy.
    from rbfrag.fragility.prediction_array import predict_many

    return predict_many(model, inputs, quantiles, interval=interval, reject_nan=nan == "raise")


def _at_sites(
    answer: A,
    model: FragilityModel,
    sites: float,
    inputs: Mapping[str, ArrayLike],
    weights: ArrayLike | None,
) -> A:
    """Return the prediction with the prediction interval of the failed fraction at several sites in
    one earthquake.
    """
    if isinstance(sites, bool | str) or sites not in range(1, MOST_SITES + 1):
        raise InputError(
            f"sites must be a whole number from 1 to {MOST_SITES:,}, not {sites!r}",
            fields=("sites",),
        )
    if model.dependence is None:
        return add_warnings(answer, (NO_EVENT_RANGE,))
    # Kept apart: a single answer loads no library.
    scatters = not ABOUT_SCATTER.isdisjoint(inputs)
    if scatters and isinstance(answer, Prediction) and answer.shaking is None:
        scatters = False
    if scatters:
        if not isinstance(answer, Prediction) or "pgv_tau" not in inputs or weights is not None:
            return add_warnings(answer, (NOT_SHARED,))
        return _shaken_at_sites(answer, model, int(sites), inputs)
    from rbfrag.fragility.joint import share_range

    law = model.dependence.shares(_loadings(model, inputs))
    ends = share_range(answer.probability, law, int(sites), answer.level)
    low, high = map(float, ends) if isinstance(answer, Prediction) else ends
    return type(answer)(**(vars(answer) | {"event_low": low, "event_high": high}))


def _loadings(model: FragilityModel, inputs: Mapping[str, Any]) -> Loadings:
    """Return what the completion of the spectral velocity adds to the dependence of the blocks."""
    block = model.method.block
    numbers = {name: inputs[name] for name in (*block.names, *block.options) if name in inputs}
    if all(map(is_single, numbers.values())):
        return model.loadings(numbers, SINGLE)
    import numpy as np

    return model.loadings({name: np.asarray(v) for name, v in numbers.items()}, arrays())


NOT_SHARED = Diagnostic(
    "no prediction interval for a single earthquake: the between-event dispersion of the shaking "
    "(pgv_tau) is required and applies to single predictions from PGV alone",
    "no_prediction_interval",
    fields=("pgv_tau",),
)


def _shaken_at_sites(
    answer: A, model: FragilityModel, sites: int, inputs: Mapping[str, ArrayLike]
) -> A:
    from rbfrag.fragility.joint import shaken_share_range
    from rbfrag.fragility.shaking import Scatter, with_uncertain_velocity
    from rbfrag.fragility.uncertain import GroundMotionQuadrature, UncertainModel, uncertain_model

    scatter, rest = Scatter.of(model.term, inputs)
    if scatter is None or model.dependence is None or scatter.names[0] != "pgv_m_s":
        return add_warnings(answer, (NOT_SHARED,))
    scatter, rest = with_uncertain_velocity(model, scatter, rest)
    block_model, rest = uncertain_model(model, rest)
    about = {
        "possible": getattr(block_model, "possible", None),
        "points": GroundMotionQuadrature(model, scatter),
    }
    along, sigma = UncertainModel.over(model, **about).along(rest)
    tau = single("pgv_tau", inputs["pgv_tau"])
    law = model.dependence.shares(_loadings(model, rest))
    low, high = shaken_share_range(along, tau, sigma, law, sites, answer.level)
    return type(answer)(**(vars(answer) | {"event_low": low, "event_high": high}))


def array_answer(
    model: FragilityModel,
    inputs: Mapping[str, Any],
    level: float = 0.95,
    *,
    interval: bool = True,
    sites: float | None = None,
) -> PredictionArray:
    """Return the prediction of one model from inputs by name, some of them arrays."""
    from rbfrag.fragility.prediction_array import PredictionArray

    answer = answer_given(model, inputs, level, interval=interval, sites=sites)
    assert isinstance(answer, PredictionArray)
    return answer


def single_numbers(inputs: Mapping[str, ArrayLike]) -> dict[str, float] | None:
    """Return the inputs as floats; None if one of them is an array."""
    singles: dict[str, float] = {}
    for name, value in inputs.items():
        if type(value) is float:  # for speed
            singles[name] = value  # type: ignore[unreachable]
        elif is_single(value):
            singles[name] = single(name, value)
        else:
            return None
    return singles


def is_single(value: object) -> bool:
    """Return whether a value is a single number (or another object that is not an array)."""
    if isinstance(value, _SINGLE_TYPES):
        return True
    shape = getattr(value, "shape", None)
    if shape is not None:
        return len(shape) == 0
    return not hasattr(value, "__len__") and not hasattr(value, "__iter__")


def single(name: str, value: object) -> float:
    """Return a value as a float."""
    if isinstance(value, bool | str | bytes):
        raise InputError(f"{name} = {value!r} is not a number: give a number or an array")
    try:
        return float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError):
        raise InputError(f"{name} = {value!r} is not a number: give a number or an array") from None


def _answer_single(
    model: FragilityModel, inputs: dict[str, float], quantiles: Quantiles
) -> Prediction:
    method, warnings, how = model.method, model.notes, by_model(model.name)
    try:
        values = model.with_ratios(model.completed(inputs, SINGLE))
        clear = not model.uncertain and is_clear(model, values)
    except (ArithmeticError, ValueError):  # the checks find the words
        clear = False
    if clear:
        answer = model.answer(values, quantiles, SINGLE, inputs)
        x, in_domain = values["intensity_m_s"], True
    else:
        judgement, sentences, ruled = _answer_with_diagnostics(model, inputs, quantiles)
        how = ruled or how
        answer, values, x, _, in_domain, _ = judgement
        warnings = (*warnings, *sentences)
    probability, low, high, eta, log_sigma, block_sd, _ = answer
    median = None
    if method.median_of is not None and eta is not None:
        # the asked value, not the one that is adjusted for the base's dip
        median = inputs[method.median_of] * math.exp(eta * math.exp(log_sigma))
    # frozen dataclasses set attributes one by one, which takes as long as the answer
    result = object.__new__(Prediction)
    vars(result).update(
        kind=model.row.kind, probability=probability, ci_low=low, ci_high=high, event_low=None,
        event_high=None, level=quantiles.level, model=model.row.name, term=model.term.name,
        method=method.name,
        failure=model.row.kind if method.failure is None
        else method.failure(inputs, model.criterion),
        y_m_s=values.get("y_m_s"), intensity_m_s=x, in_domain=in_domain, warnings=warnings,
        pgv_over_pga_s=values.get("pgv_over_pga_s"), median_displacement_m=median,
        block_sd=block_sd, data=model.data, shaking=None, how=how, drained=None, uncertainty=(),
        as_stated=None, sensitivity=(), solution=None, drawn=(), inputs=inputs, sites=None,
        alternatives=(),
    )  # fmt: skip
    return result


def is_clear(model: FragilityModel, values: Mapping[str, float]) -> bool:
    """Return whether a prediction needs no warning."""
    for name, low, high in model.clear_ranges(values):
        if not low <= values[name] <= high:
            return False
    block, method = model.method.block, model.method
    if "pga_g" in values:
        pga_g = values["pga_g"]
        if block.at_rest.holds(values):
            return False
        if any(values[name] > most_over_pga(name) * pga_g for name in model.term.inputs):
            return False
    for bound in model.form.bounds:
        if bound.holds(values):
            return False
    for bound in block.rejects:
        if bound.holds(values):
            return False
    if method.doubts is not None and any(
        holds for holds, _, _ in method.doubts(model.parameters, values, SINGLE)
    ):
        return False
    return model.spread is None or model.spread.holds(values, SINGLE)


def _answer_with_diagnostics(
    model: FragilityModel, inputs: dict[str, float], quantiles: Quantiles
) -> tuple[Judgement, list[Diagnostic], str]:
    # Kept apart: most questions need no words.
    from rbfrag.fragility.validation import answer_with_findings

    sentences: list[Diagnostic] = []
    ruled: list[str] = []

    def say(holds: bool, finding: Remark) -> None:
        if holds:
            sentences.append(Diagnostic(finding.about(finding.value), finding.code))
            ruled.append(finding.how)

    def reject(holds: bool, finding: Remark) -> None:
        if holds:
            raise InputError(finding.about(finding.value), fields=(finding.name,))

    def unstable(holds: bool, finding: Remark) -> None:
        if holds:
            text = f"{finding.name} = {finding.value:.4g}: {AT_REST}"
            sentences.append(Diagnostic(text, "unstable_at_rest"))
            ruled.append(BY_MECHANICS)

    judgement = answer_with_findings(
        model, inputs, tuple(inputs), quantiles, SINGLE,
        say=say, reject=reject, unstable=unstable, nothing=False,
    )  # fmt: skip
    if any(text.code == "unstable_at_rest" for text in sentences):
        certain = judgement.answer._replace(probability=1.0, low=1.0, high=1.0)
        judgement = judgement._replace(answer=certain)
    return judgement, sentences, "".join(ruled)
