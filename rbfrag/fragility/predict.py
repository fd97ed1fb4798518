"""The probability that a block fails: `predict`, for every kind of failure.

For single numbers neither numpy nor any other library is loaded.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from os import PathLike
from typing import TYPE_CHECKING, Any, Literal, cast, overload

from rbfrag.db.model_file import ModelRow
from rbfrag.errors import InputError
from rbfrag.fragility.intervals import Quantiles, checked_level, quantiles_of
from rbfrag.fragility.lookup import find_model, suited_models
from rbfrag.fragility.measures import SPECTRAL, STATED
from rbfrag.fragility.methods import SINGLE
from rbfrag.fragility.model import FragilityModel
from rbfrag.fragility.unknown_outcomes import NOTABLE_SHARE, in_words

if TYPE_CHECKING:
    import pandas as pd
    from numpy.typing import ArrayLike

    from rbfrag.fragility.checks import Finding, Judgement
    from rbfrag.fragility.prediction_array import PredictionArray
    from rbfrag.motions.recognise import MotionLike

Model = ModelRow | FragilityModel | str
Polarity = Literal["forward", "reverse", "both"]

SIMULATED = (
    "what a known motion does to an uncertain block is simulated, by  rbfrag respond MOTION --draws"
    "  or rbfrag.respond_draws"
)

LEAST_APART = 1e-3
"""Intervals that do not overlap are told of where the higher of them begins above this P."""

_SINGLE_TYPES = (float, int, str, bytes)


@dataclass(frozen=True)
class Prediction:
    """Probability that one block fails in one motion.

    Args:
        kind: how the block fails.
        probability: P, between 0 and 1.
        ci_low: lower end of the confidence interval of P: how well the share of such blocks that
            fail over all earthquakes and sites is known.
        ci_high: upper end of it.
        event_low: lower end of the share of such blocks at many sites that fails in one single
            earthquake; None where the model does not know what its blocks share.
        event_high: upper end of it.
        level: confidence level of the interval, and probability of the range of one earthquake.
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
        unknown_share: of the outcomes that the model was fitted to, of like strength and shaking,
            the share that is not known because blocks left their model before they failed; None
            where all are known.
        block_sd: standard deviation of P over what an uncertain block may be; None where it is
            certain.
        data: the database that the model is of; None of a model that was given itself.
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
    unknown_share: float | None = None
    block_sd: float | None = None
    data: str | None = field(default=None, compare=False)

    def as_dict(self) -> dict[str, Any]:
        """Return the answer under the keys of the JSON contract."""
        return {**vars(self), "warnings": list(self.warnings)}

    # not Tabular: `rbfrag predict` starts without its module
    def __iter__(self) -> Iterator[dict[str, Any]]:
        """Yield the one row, so that ``pandas.DataFrame(answer)`` is the table."""
        yield from self.to_frame().to_dict("records")

    def to_frame(self) -> pd.DataFrame:
        """Return the answer as a pandas table of one row."""
        from rbfrag.frames import columns_of, frame_of

        return frame_of(columns_of(self))

    def _repr_html_(self) -> str:
        """Return what a notebook shows."""
        from rbfrag.frames import html_of

        return html_of(self.to_frame())


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

    def as_dict(self) -> dict[str, Any]:
        """Return the answer under the keys of the JSON contract, and both polarities."""
        result = super().as_dict()
        both = {name: result.pop(name) for name in ("forward", "reverse")}
        result["polarities"] = {
            name: None if answer is None else answer.as_dict() for name, answer in both.items()
        }
        return result


@overload
def predict(
    p2: float | None = ...,
    kr: float | None = ...,
    *,
    kind: str | None = ...,
    ky: float | None = ...,
    displacement_m: float | None = ...,
    beta_deg: float | None = ...,
    ks: float | None = ...,
    ps2: float | None = ...,
    rotation_deg: float | None = ...,
    leaves_g: float | None = ...,
    restitution: float | None = ...,
    p2_sigma: float | None = ...,
    kr_sigma: float | None = ...,
    ky_sigma: float | None = ...,
    ks_sigma: float | None = ...,
    ps2_sigma: float | None = ...,
    restitution_sigma: float | None = ...,
    pgv_m_s: float | None = ...,
    pga_g: float | None = ...,
    tm_s: float | None = ...,
    pgd_m: float | None = ...,
    sa_g: Mapping[float, float] | None = ...,
    motion: MotionLike | None = ...,
    polarity: Polarity = ...,
    model: Model | None = ...,
    level: float = ...,
    db: str | PathLike[str] | None = ...,
    nan: Literal["propagate", "raise"] = ...,
    interval: bool = ...,
    weights: ArrayLike | None = ...,
) -> Prediction: ...


@overload
def predict(
    p2: ArrayLike | None = ...,
    kr: ArrayLike | None = ...,
    *,
    kind: str | None = ...,
    ky: ArrayLike | None = ...,
    displacement_m: ArrayLike | None = ...,
    beta_deg: ArrayLike | None = ...,
    ks: ArrayLike | None = ...,
    ps2: ArrayLike | None = ...,
    rotation_deg: float | None = ...,
    leaves_g: ArrayLike | None = ...,
    restitution: ArrayLike | None = ...,
    p2_sigma: ArrayLike | None = ...,
    kr_sigma: ArrayLike | None = ...,
    ky_sigma: ArrayLike | None = ...,
    ks_sigma: ArrayLike | None = ...,
    ps2_sigma: ArrayLike | None = ...,
    restitution_sigma: ArrayLike | None = ...,
    pgv_m_s: ArrayLike | None = ...,
    pga_g: ArrayLike | None = ...,
    tm_s: ArrayLike | None = ...,
    pgd_m: ArrayLike | None = ...,
    sa_g: Mapping[float, ArrayLike] | None = ...,
    motion: MotionLike | None = ...,
    polarity: Polarity = ...,
    model: Model | None = ...,
    level: float = ...,
    db: str | PathLike[str] | None = ...,
    nan: Literal["propagate", "raise"] = ...,
    interval: bool = ...,
    weights: ArrayLike | None = ...,
) -> Prediction | PredictionArray: ...


def predict(
    p2: ArrayLike | None = None,
    kr: ArrayLike | None = None,
    *,
    kind: str | None = None,
    ky: ArrayLike | None = None,
    displacement_m: ArrayLike | None = None,
    beta_deg: ArrayLike | None = None,
    ks: ArrayLike | None = None,
    ps2: ArrayLike | None = None,
    rotation_deg: float | None = None,
    leaves_g: ArrayLike | None = None,
    restitution: ArrayLike | None = None,
    p2_sigma: ArrayLike | None = None,
    kr_sigma: ArrayLike | None = None,
    ky_sigma: ArrayLike | None = None,
    ks_sigma: ArrayLike | None = None,
    ps2_sigma: ArrayLike | None = None,
    restitution_sigma: ArrayLike | None = None,
    pgv_m_s: ArrayLike | None = None,
    pga_g: ArrayLike | None = None,
    tm_s: ArrayLike | None = None,
    pgd_m: ArrayLike | None = None,
    sa_g: Mapping[float, ArrayLike] | None = None,
    motion: MotionLike | None = None,
    polarity: Polarity = "both",
    model: Model | None = None,
    level: float = 0.95,
    db: str | PathLike[str] | None = None,
    nan: Literal["propagate", "raise"] = "propagate",
    interval: bool = True,
    weights: ArrayLike | None = None,
) -> Prediction | PredictionArray:
    """Return the probability that a block fails, with its confidence interval.

    P = F(eta), with eta and F of the model's method (docs/theory/fragility.md), is the share of
    such blocks that fail over all earthquakes and sites with these measures. The interval
    F(eta ± t s) says how well that is known, s being the standard error of eta from the fits that
    each leave an earthquake out and t Student's quantile for as many earthquakes as tell of this
    block. The range of one earthquake says what share of such blocks at many sites fails in one
    single earthquake. Without shaking, and where mechanics forbids failure (k >= PGA, say), P is 0
    whatever the model says.

    A block is given by p2 and kr (it topples, or rocks if `kind` says so), by ky and displacement_m
    (it slides further than that), or by ks and ps2 (it slumps); each is a number or an array. What
    is given with a standard deviation is the median of what the block may be: P is then the mean
    over all that, with its interval, and ``block_sd`` how much P differs among them. Strength and
    size are lognormal, a restitution is normal, cut off at 0 and 1, and all are independent.

    Args:
        p2: frequency parameter p² of the block [1/s²].
        kr: its yield acceleration coefficient for toppling at rest [-].
        kind: how it fails; None for what the block is given by.
        ky: yield acceleration coefficient of sliding, tan(phi - beta) [-].
        displacement_m: the displacement down the base that is too far [m].
        beta_deg: with ky: dip of the base, out of the slope positive [deg]; level if not given.
        ks: yield acceleration coefficient of slumping [-].
        ps2: frequency parameter p_s² of slumping at rest [1/s²].
        rotation_deg: with ks: rotation that counts as failure [deg], of which there must be a
            model; None for failure past recovery.
        leaves_g: with ks: acceleration at which the block leaves its back plane [g]: above it the
            answer warns.
        restitution: of a block that rocks: speed after an impact over that before it, above 0 and
            up to 1; None for what angular momentum leaves.
        p2_sigma: standard deviation of ln p2.
        kr_sigma: standard deviation of ln kr.
        ky_sigma: standard deviation of ln ky.
        ks_sigma: standard deviation of ln ks.
        ps2_sigma: standard deviation of ln ps2.
        restitution_sigma: standard deviation of the restitution.
        pgv_m_s: peak ground velocity of the horizontal component [m/s].
        pga_g: peak ground acceleration [g].
        tm_s: mean period [s].
        pgd_m: peak ground displacement [m].
        sa_g: spectral accelerations of the horizontal component at 5 % damping [g] by their
            period, 0.3, 1, 2 or 3 s: ``{1.0: 0.4}``.
        motion: the accelerogram itself or its file, instead of its measures.
        polarity: ``forward`` or ``reverse`` where it is known how the motion points at the slope;
            ``both`` gives the mean of the two, which stand beside it (motion only).
        model: a model, the name of a stored one, or None for the one of the best score that what
            is given suffices for, or the database's default where no other reads more of the
            motion. Of single numbers the others answer, too, and a warning tells where their
            interval does not overlap.
        level: confidence level of the interval and of the range of one earthquake, between 0
            and 1.
        db: database of the model: a path or SQLAlchemy URL; None for ``RBFRAG_DB``, or else
            ``rbfrag.db`` in the current folder, or else the reference that is shipped.
        nan: in arrays, ``propagate`` answers NaN with its reason where the input cannot be
            used, ``raise`` refuses such arrays.
        interval: in arrays, False leaves interval and range out (their ends are then NaN), which
            takes less time.
        weights: makes the arrays that describe the block draws of one block, of these weights (1:
            all the same): one answer, over all of them.

    Returns:
        :class:`Prediction` when every argument is a single number (with `motion` and both
        polarities :class:`MotionPrediction`), otherwise
        :class:`~rbfrag.fragility.prediction_array.PredictionArray` of the broadcast shape. In
        arrays a block with a strength <= 0 fails at rest: P = 1 with the reason ``unstable``.

    Raises:
        InputError: a value that cannot be used, or measures the model cannot work with.
        UnknownModelError: no model of that name.
        DatabaseError: the database cannot be read.
    """
    if nan not in ("propagate", "raise"):
        raise InputError(f"nan = {nan!r}: use 'propagate' or 'raise'")
    # one by one: a comprehension makes a question of numbers 9 % slower
    given: dict[str, ArrayLike] = {}
    if p2 is not None:
        given["p2"] = p2
    if kr is not None:
        given["kr"] = kr
    if ky is not None:
        given["ky"] = ky
    if displacement_m is not None:
        given["displacement_m"] = displacement_m
    if beta_deg is not None:
        given["beta_deg"] = beta_deg
    if ks is not None:
        given["ks"] = ks
    if ps2 is not None:
        given["ps2"] = ps2
    if leaves_g is not None:
        given["leaves_g"] = leaves_g
    if restitution is not None:
        given["restitution"] = restitution
    if p2_sigma is not None:
        given["p2_sigma"] = p2_sigma
    if kr_sigma is not None:
        given["kr_sigma"] = kr_sigma
    if ky_sigma is not None:
        given["ky_sigma"] = ky_sigma
    if ks_sigma is not None:
        given["ks_sigma"] = ks_sigma
    if ps2_sigma is not None:
        given["ps2_sigma"] = ps2_sigma
    if restitution_sigma is not None:
        given["restitution_sigma"] = restitution_sigma
    if pgv_m_s is not None:
        given["pgv_m_s"] = pgv_m_s
    if pga_g is not None:
        given["pga_g"] = pga_g
    if tm_s is not None:
        given["tm_s"] = tm_s
    if pgd_m is not None:
        given["pgd_m"] = pgd_m
    if sa_g is not None:
        given |= spectral(sa_g)
    if motion is not None:
        if weights is not None:
            raise InputError(f"weights given beside a motion: {SIMULATED}")
        return _predict_motion(
            given, motion, kind=kind, rotation_deg=rotation_deg, polarity=polarity, model=model,
            level=level, db=db,
        )  # fmt: skip
    first, *others = _candidates(given, model, db, kind=kind, rotation_deg=rotation_deg)
    answer = answer_given(first, given, level, nan=nan, interval=interval, weights=weights)
    if type(answer) is not Prediction:
        return answer
    apart = [each for each in others if not _surely_agrees(each, given, answer)]
    return _with_disagreement(answer, [_one_of(each, given, level, weights) for each in apart])


def _candidates(
    given: Mapping[str, ArrayLike],
    model: Model | None,
    db: str | PathLike[str] | None,
    *,
    kind: str | None,
    rotation_deg: float | None,
) -> list[FragilityModel]:
    """Return the models that may answer, the one that does first."""
    if model is None:
        return suited_models(given, db, kind=kind, rotation_deg=rotation_deg)
    return [find_model(model, given, db, kind=kind, rotation_deg=rotation_deg)]


def _surely_agrees(
    model: FragilityModel, given: Mapping[str, ArrayLike], first: Prediction
) -> bool:
    """Return whether a model's P is within the first one's interval: faster than its answer."""
    if model.uncertain or any(type(value) is not float for value in given.values()):
        return False
    singles = cast("dict[str, float]", given)
    try:
        values = model.with_ratios(model.method.block.completed(singles, model.term, SINGLE))
        if not _is_clear(model, values):
            return False
        probability = model.answer(values, None, SINGLE, singles).probability
    except (ArithmeticError, ValueError):
        return False
    return bool(first.ci_low <= probability <= first.ci_high)


def _one_of(
    model: FragilityModel, given: Mapping[str, ArrayLike], level: float, weights: ArrayLike | None
) -> Prediction:
    answer = answer_given(model, given, level, weights=weights)
    assert isinstance(answer, Prediction)
    return answer


def _with_disagreement(first: Prediction, others: Sequence[Prediction]) -> Prediction:
    """Return an answer that says which of the other models answer otherwise."""
    apart = [
        other
        for other in others
        if (least := max(first.ci_low, other.ci_low)) > min(first.ci_high, other.ci_high)
        and least >= LEAST_APART
    ]
    if not apart:
        return first
    listed = ", ".join(f"{_percent(other)} by {other.model}" for other in apart)
    text = (
        f"the answers do not agree: {_percent(first)} by {first.model}, but {listed}, whose "
        "intervals do not overlap with its own: this shaking is not what is usual for the "
        "measures that those read, or a measure is wrong"
    )
    return replace(first, warnings=(*first.warnings, text))


def _percent(answer: Prediction) -> str:
    p, low, high = (100.0 * x for x in (answer.probability, answer.ci_low, answer.ci_high))
    return f"{p:.2g} % ({low:.2g} to {high:.2g} %)"


def spectral(sa_g: Mapping[float, ArrayLike]) -> dict[str, ArrayLike]:
    """Return spectral accelerations [g] by name instead of by period [s].

    Raises:
        InputError: no mapping, or a period of which there is no model.
    """
    if not isinstance(sa_g, Mapping):
        raise InputError(
            f"sa_g = {sa_g!r}: give accelerations [g] by period [s], such as {{1: 0.4}}"
        )
    for period in sa_g:
        if period not in SPECTRAL:
            raise InputError(
                f"sa_g has the period {period!r} s: there are models of SA at "
                f"{', '.join(f'{each:g}' for each in SPECTRAL)} s"
            )
    return {SPECTRAL[period]: value for period, value in sa_g.items()}


def answer_given(
    model: FragilityModel,
    given: Mapping[str, ArrayLike],
    level: float,
    *,
    nan: Literal["propagate", "raise"] = "propagate",
    interval: bool = True,
    weights: ArrayLike | None = None,
) -> Prediction | PredictionArray:
    """Return the answer of one model for values by name; see :func:`predict`."""
    for name in model.method.block.names:
        if name not in given:
            raise InputError(
                f"{name} is missing: a block of kind {model.kind} is given by "
                f"{' and '.join(model.method.block.names)}"
            )
    quantiles = quantiles_of(checked_level(level))
    if weights is not None:
        from rbfrag.fragility.uncertain import drawn_model

        model, given = drawn_model(model, given, weights)
    elif not model.method.block.sigmas.keys().isdisjoint(given):
        # Kept apart: most questions are about certain blocks, and need no numpy.
        from rbfrag.fragility.uncertain import uncertain_model

        model, given = uncertain_model(model, given)
    singles: dict[str, float] = {}
    for name, value in given.items():
        if type(value) is float:  # for speed
            singles[name] = value  # type: ignore[unreachable]
        elif is_single(value):
            singles[name] = single(name, value)
        else:
            break
    else:
        return _predict_one(model, singles, quantiles)
    # Kept apart so that single numbers do not load numpy.
    from rbfrag.fragility.prediction_array import predict_many

    return predict_many(model, given, quantiles, interval=interval, refuse_nan=nan == "raise")


def is_single(value: object) -> bool:
    """Return whether a value is one number (or something else that is no array)."""
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


def _predict_one(
    model: FragilityModel, given: dict[str, float], quantiles: Quantiles
) -> Prediction:
    method, warnings = model.method, model.notes
    try:
        values = model.with_ratios(method.block.completed(given, model.term, SINGLE))
        clear = not model.uncertain and _is_clear(model, values)
    except (ArithmeticError, ValueError):  # the checks find the words
        clear = False
    if clear:
        answer = model.answer(values, quantiles, SINGLE, given)
        x, in_domain = values["intensity_m_s"], True
    else:
        judgement, sentences = _answer_with_diagnostics(model, given, quantiles)
        answer, values, x, _, in_domain, _ = judgement
        warnings = (*warnings, *sentences)
    probability, low, high, event_low, event_high, eta, log_sigma, block_sd, _ = answer
    median = None
    if method.median_of is not None and eta is not None:
        # the asked value, not the one that is adjusted for the base's dip
        median = given[method.median_of] * math.exp(eta * math.exp(log_sigma))
    share = None
    if model.unknown is not None:
        share = model.unknown.share(values)
        if share >= NOTABLE_SHARE:
            warnings = (*warnings, in_words(share))
    return Prediction(
        model.row.kind,
        probability,
        low,
        high,
        event_low,
        event_high,
        quantiles.level,
        model.row.name,
        model.term.name,
        method.name,
        model.row.kind if method.failure is None else method.failure(given, model.criterion),
        values.get("y_m_s"),
        x,
        in_domain,
        warnings,
        values.get("pgv_over_pga_s"),
        median,
        share,
        block_sd,
        model.data,
    )


def _is_clear(model: FragilityModel, values: Mapping[str, float]) -> bool:
    """Return whether there is nothing to say about a question but its probability."""
    for name, low, high in model.clear_ranges(values):
        if not low <= values[name] <= high:
            return False
    block, method = model.method.block, model.method
    if "pga_g" in values and block.at_rest.holds(values):
        return False
    for bound in model.form.bounds:
        if bound.holds(values):
            return False
    for bound in (*block.refuses, *block.doubts):
        if bound.holds(values):
            return False
    if method.doubts is not None and any(
        holds for holds, _, _ in method.doubts(model.parameters, values, SINGLE)
    ):
        return False
    return model.spread is None or model.spread.holds(values, SINGLE)


def _answer_with_diagnostics(
    model: FragilityModel, given: dict[str, float], quantiles: Quantiles
) -> tuple[Judgement, list[str]]:
    # Kept apart: most questions need no words.
    from rbfrag.fragility.checks import answer_with_findings

    sentences: list[str] = []

    def say(holds: bool, finding: Finding) -> None:
        if holds:
            sentences.append(finding.about(finding.value))

    def refuse(holds: bool, finding: Finding) -> None:
        if holds:
            raise InputError(finding.about(finding.value))

    judgement = answer_with_findings(
        model, given, tuple(given), quantiles, SINGLE,
        say=say, refuse=refuse, unstable=refuse, nothing=False,
    )  # fmt: skip
    return judgement, sentences


def _predict_motion(
    given: Mapping[str, ArrayLike],
    motion: MotionLike,
    *,
    kind: str | None,
    rotation_deg: float | None,
    polarity: Polarity,
    model: Model | None,
    level: float,
    db: str | PathLike[str] | None,
) -> Prediction:
    """Return the probability for one block; arguments as for :func:`predict`."""
    # Kept apart: a motion needs numpy.
    from rbfrag.fragility.prediction_motion import measures_of
    from rbfrag.motions.recognise import as_motion

    motion = as_motion(motion)
    extra = [name for name in given if name in STATED]
    if extra:
        raise InputError(
            f"{' and '.join(extra)} given beside a motion: the motion has them; leave them out"
        )
    if polarity not in ("forward", "reverse", "both"):
        raise InputError(f"polarity = {polarity!r}: use 'forward', 'reverse' or 'both'")
    uncertain = [name for name in given if name.endswith("_sigma")]
    if uncertain:
        raise InputError(f"{uncertain[0]} given beside a motion: {SIMULATED}")
    several = [name for name, value in given.items() if not is_single(value)]
    if several:
        raise InputError(
            f"{' and '.join(several)} must be single numbers with a motion: call it once for each "
            "block, or use rbfrag.toppling_spectrum and a model of the term xp"
        )
    block = {name: single(name, value) for name, value in given.items()}
    answers: dict[str, Prediction] = {}
    for direction in ("forward", "reverse") if polarity == "both" else (polarity,):
        # what the term X(p) does not read is of use only to a model that is named
        known = measures_of(motion, block.get("p2"), direction, spectrum=model is not None)
        own = {**block, **known}
        chosen = find_model(model, own, db, kind=kind, rotation_deg=rotation_deg)
        answer = answer_given(chosen, own, level)
        assert isinstance(answer, Prediction)
        answers[direction] = answer
    if polarity != "both":
        return answers[polarity]
    return _mean(answers["forward"], answers["reverse"])


def _mean(forward: Prediction, reverse: Prediction) -> MotionPrediction:
    def mean(name: str) -> float | None:
        one, other = getattr(forward, name), getattr(reverse, name)
        return None if one is None or other is None else 0.5 * (float(one) + float(other))

    warnings = [f"forward: {text}" for text in forward.warnings]
    warnings += [f"reverse: {text}" for text in reverse.warnings]
    means: dict[str, Any] = {
        name: mean(name)
        for name in (
            "probability", "ci_low", "ci_high", "event_low", "event_high", "intensity_m_s",
            "unknown_share", "block_sd",
        )
    }  # fmt: skip
    return MotionPrediction(
        **{
            **vars(forward),
            **means,
            "in_domain": forward.in_domain and reverse.in_domain,
            "warnings": tuple(warnings),
        },
        forward=forward,
        reverse=reverse,
    )


def prediction_document(
    given: Mapping[str, ArrayLike],
    *,
    kind: str | None = None,
    rotation_deg: float | None = None,
    motion: MotionLike | None = None,
    polarity: Polarity = "both",
    model: str | None = None,
    level: float = 0.95,
    db: str | PathLike[str] | None = None,
    remarks: Sequence[str] = (),
    weights: ArrayLike | None = None,
) -> dict[str, Any]:
    """Return the answer under the keys of the JSON contract, and that of every suited model.

    Args:
        given: block and what is known of the motion, by the names of :func:`predict`.
        kind: how the block fails; None for what it is given by.
        rotation_deg: rotation that counts as failure, where models of several are fitted [deg].
        motion: the accelerogram itself.
        polarity: forward, reverse or both; with `motion` only.
        model: name of a stored model; None for the best for each term that the measures
            suffice for.
        level: confidence level of the interval.
        db: database of the models, as for :func:`predict`.
        remarks: warnings about the block, which go before those of the answer.
        weights: of draws of the block, which the arrays are then.

    Raises:
        InputError: a value that cannot be used, or measures no model can work with.
        UnknownModelError: no model of that name.
        DatabaseError: the database cannot be read.
    """
    others: list[Prediction]
    if motion is not None:
        others = [
            _predict_motion(
                given, motion, kind=kind, rotation_deg=rotation_deg, polarity=polarity,
                model=model, level=level, db=db,
            )
        ]  # fmt: skip
    else:
        first, *rest = (
            _one_of(each, given, level, weights)
            for each in _candidates(given, model, db, kind=kind, rotation_deg=rotation_deg)
        )
        others = [_with_disagreement(first, rest), *rest]
    recommended = others[0]
    document = recommended.as_dict()
    document["warnings"] = [*remarks, *recommended.warnings]
    columns = (
        "model", "term", "method", "probability", "ci_low", "ci_high", "event_low", "event_high",
        "in_domain",
    )  # fmt: skip
    document["answers"] = [
        {**{name: getattr(each, name) for name in columns}, "recommended": each is recommended}
        for each in others
    ]
    return document
