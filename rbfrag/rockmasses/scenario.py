"""Failure probability of a rock mass under given intensity measures, by mode."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import InputError
from rbfrag.fragility.confidence import checked_level
from rbfrag.fragility.model import Model
from rbfrag.fragility.model_selection import find_model
from rbfrag.fragility.prediction import answer_given
from rbfrag.fragility.prediction_array import PredictionArray
from rbfrag.fragility.validation import rejections
from rbfrag.question.classify_arrays import push_of_blocks
from rbfrag.question.question import predict
from rbfrag.question.shape_validation import ModeShapes, dip_of_factor, p2_at_rest
from rbfrag.results.diagnostic import Diagnostic
from rbfrag.results.numbers import percent
from rbfrag.rockmasses.joint_sets import Realisations
from rbfrag.solver.block.formulas import array_elementwise
from rbfrag.solver.kinds import BY_MECHANICS, kind_of_mode
from rbfrag.solver.quantity import positive
from rbfrag.solver.results import FloatArray
from rbfrag.solver.stability.modes import MODES, STABLE, UNSTABLE, ModeName
from rbfrag.solver.stability.validity import HEEL_TIPS, TOE_SLIPS, heel_tips_g, toe_slips_g

UNCOVERED = "no fragility model for this mode"
BONDED = "cohesion: the first slip breaks the bond, which no model of this mode describes"
ENDS = "roughness: it ends with the first slip; friction.phi_residual_deg gives an answer"
SLIPS_ON = "after its first slip it does not stand on friction.phi_residual_deg"
LOCKED = "locked: it does not move under any horizontal acceleration in this mode"


@dataclass(frozen=True)
class Average:
    """Failure probability averaged over blocks.

    Args:
        probability: mean of their probabilities; None without blocks.
        standard_error: its standard error from the finite number of realisations; None
            without at least two blocks.
        ci_low: mean of the lower ends of their intervals, which say how well the data tell the
            parameters of the model.
        ci_high: mean of the upper ends.
    """

    count: int
    probability: float | None = None
    standard_error: float | None = None
    ci_low: float | None = None
    ci_high: float | None = None

    @classmethod
    def of(
        cls, chosen: NDArray[np.bool_], probability: FloatArray, low: FloatArray, high: FloatArray
    ) -> Average:
        """Return the average over the selected blocks, shape (n,)."""
        count = int(np.count_nonzero(chosen))
        if count == 0:
            return cls(0)
        values = probability[chosen]
        error = float(np.std(values, ddof=1)) / math.sqrt(count) if count > 1 else None
        mean, mean_low, mean_high = (float(np.mean(x[chosen])) for x in (probability, low, high))
        return cls(count, mean, error, mean_low, mean_high)

    def as_dict(self) -> dict[str, Any]:
        """Return the average under the keys of the JSON contract."""
        values = dict(vars(self))
        return {"covered": values.pop("count"), **values}


@dataclass(frozen=True)
class ScenarioMode:
    """Failure probability of the blocks of one mode.

    Args:
        has_model: whether a fragility model answers for the mode.
        unstable: number of blocks that fail at rest, P = 1 whatever the mode.
        covered: average over the blocks for which there is an answer.
        in_domain: number of blocks with a model's answer in the range that was fitted.
        drained: average over those of the blocks for which there is an answer where their water
            drains as they start to move; None without water.
    """

    mode: ModeName
    count: int
    share: float
    has_model: bool
    unstable: int
    covered: Average
    in_domain: int
    drained: Average | None = None


@dataclass(frozen=True, eq=False)
class Scenario:
    """Failure probabilities of the blocks of a rock mass in one motion.

    Args:
        model: name of the model that answered; None if no block needed one.
        term: its intensity term.
        method: how it was fitted.
        modes: answers by mode, for the modes that have blocks.
        covered: average over all blocks for which there is an answer, and over no others.
        covered_share: the share of these among all blocks.
        uncovered_share: share of the blocks without an answer, by mode.
        probability: by realisation; NaN without an answer; shape (n,).
        ci_low: lower ends of the confidence intervals, shape (n,).
        ci_high: upper ends, shape (n,).
        event_low: lower ends of the shares of such blocks that fail in one earthquake; NaN
            where that is not known, shape (n,).
        event_high: upper ends, shape (n,).
        in_domain: True where a model answered in the range that was fitted, shape (n,).
        how: what answered, as in :class:`~rbfrag.fragility.prediction.Prediction`; empty without
            an answer, shape (n,).
        reason: why an answer is missing, ruled or to be doubted, shape (n,).
        warnings: sentences on the whole answer.
        other_models: names of the models that answered for other modes than toppling, by mode.
        drained: the answer where the water drains as the blocks start to move, the other bound;
            None without water.
    """

    measures: Mapping[str, float]
    model: str | None
    term: str | None
    method: str | None
    level: float
    modes: tuple[ScenarioMode, ...]
    covered: Average
    covered_share: float
    uncovered_share: Mapping[ModeName, float]
    probability: FloatArray
    ci_low: FloatArray
    ci_high: FloatArray
    event_low: FloatArray
    event_high: FloatArray
    in_domain: NDArray[np.bool_]
    how: NDArray[np.object_]
    reason: NDArray[np.object_]
    warnings: tuple[str, ...]
    other_models: Mapping[ModeName, str] = field(default_factory=dict)
    drained: Scenario | None = None

    def average(self, blocks: NDArray[np.bool_]) -> Average:
        """Return the average over the selected blocks, shape (n,), that have a probability."""
        covered = blocks & np.isfinite(self.probability)
        return Average.of(covered, self.probability, self.ci_low, self.ci_high)


def scenario(
    realisations: Realisations,
    measures: Mapping[str, float],
    *,
    model: Model | None = None,
    level: float = 0.95,
    db: str | PathLike[str] | None = None,
    displacement_m: float | None = None,
    rotation_deg: float | None = None,
) -> Scenario:
    """Return the failure probability of the blocks in one motion, averaged by mode.

    A block that fails at rest has P = 1. A stable toppling block has the probability of the
    fragility model. With `displacement_m` a stable block that slides has the probability of
    sliding further than that, and one that slumps or topples confined that of failing past
    recovery, unless its base has cohesion or is rough: the first slip ends both. Where the rock
    mass states a residual friction, blocks are answered for as they are after it. Water keeps
    acting while blocks move, unless the rock mass is drained; the drained bound comes with the
    answer. All others have no answer and are
    left out of every average; the answer says how many they are, as of modes whose models need
    other measures.

    Args:
        measures: what is known of the motion, by name: pgv_m_s [m/s], pga_g [g], tm_s [s], pgd_m
            [m], spectral accelerations such as sa(1) [g].
        model: as in :func:`rbfrag.question.question.predict`.
        db: database of the models.
        displacement_m: how far is too far for a block that slides [m]; None for an answer of
            toppling alone.
        rotation_deg: with it, the rotation that is failure of a block that slumps [deg]; None
            for failure past recovery. There must be a model of it.

    Raises:
        InputError: a measure that cannot be used, measures that do not suffice, or a rock mass
            that states a vertical acceleration.
        UnknownModelError: no model of that name.
        DatabaseError: the database cannot be read.
    """
    measures = {name: float(value) for name, value in measures.items()}
    for rejection in rejections(measures, measures):
        if rejection.holds:
            raise InputError(rejection.about(rejection.value), fields=(rejection.name,))
    if not measures:
        raise InputError("a scenario requires an intensity measure, such as pgv_m_s")
    checked_level(level)
    realisations.reject_vertical()
    stability = realisations.stability
    unstable = realisations.is_block & (stability.state_code == UNSTABLE)
    after = realisations.in_time
    described = (stability.state_code == STABLE) & ~after.ends_with_slip
    topples = after.of_mode("topple", "stable") & described

    names = ("probability", "ci_low", "ci_high", "event_low", "event_high")
    answers: dict[str, NDArray[Any]] = {name: np.full(realisations.n, np.nan) for name in names}
    answers["in_domain"] = np.zeros(realisations.n, dtype=np.bool_)
    reason = np.where(realisations.is_block, UNCOVERED, realisations.reason)
    reason[after.ends_with_slip] = BONDED
    reason[after.ends_with_slip & (after.jrc > 0.0)] = ENDS
    reason[realisations.is_block & (after.stability.state_code == UNSTABLE)] = SLIPS_ON
    reason[realisations.is_block & np.isposinf(stability.yield_acceleration)] = LOCKED
    for name in names[:3]:
        answers[name][unstable] = 1.0
    reason[unstable] = "unstable"
    answers["how"] = np.where(unstable, BY_MECHANICS, "").astype(object)
    answers["reason"] = reason

    def fill(blocks: NDArray[np.bool_], predicted: PredictionArray) -> None:
        for name, values in answers.items():
            values[blocks] = getattr(predicted, name)

    answer: PredictionArray | None = None
    lacking: dict[ModeName, InputError] = {}
    chosen = None
    if topples.any():
        try:
            chosen = find_model(model, measures, db)
        except InputError as error:
            if model is not None:
                raise
            lacking["topple"] = error
    if chosen is not None:
        toppling = {"p2": after.stability.p2[topples], "kr": after.kr_at_rest[topples]}
        predicted = answer_given(chosen, {**toppling, **measures}, level)
        assert isinstance(predicted, PredictionArray)
        answer = predicted
        fill(topples, answer)

    modelled: set[ModeName] = {"topple"}
    other_models: dict[ModeName, str] = {}
    if displacement_m is not None:
        for mode, blocks, question in _other_modes(
            after, described, measures, displacement_m, rotation_deg
        ):
            try:
                predicted = predict(**question, level=level, db=db)
            except InputError as error:
                lacking[mode], reason[blocks] = error, str(error)
                continue
            assert isinstance(predicted, PredictionArray)
            modelled.add(mode)
            other_models[mode] = predicted.model
            fill(blocks, predicted)
        # their models exist, but not for what ends with the first slip
        ended = np.isin(reason, (BONDED, ENDS, SLIPS_ON))
        modelled |= {m for m in UNANSWERED if np.any(realisations.of_mode(m) & ended)}

    if lacking and answer is None and not other_models:
        raise next(iter(lacking.values()))
    drained: Scenario | None = None
    bounds = [answers[name] for name in names[:3]]
    covered = np.isfinite(answers["probability"])
    gives_way = (
        _what_gives_way(after, described & covered, measures["pga_g"])
        if "pga_g" in measures
        else ()
    )
    no_bound: tuple[str, ...] = ()
    if realisations.drained is not None:
        try:
            drained = scenario(
                realisations.drained, measures, model=model, level=level, db=db,
                displacement_m=displacement_m, rotation_deg=rotation_deg,
            )  # fmt: skip
        except InputError as error:
            no_bound = (Diagnostic(f"no drained bound: {error}", "no_drained_bound"),)
    modes = []
    for mode in MODES:
        blocks = realisations.of_mode(mode)
        count = int(np.count_nonzero(blocks))
        if count:
            modes.append(
                ScenarioMode(
                    mode=mode,
                    count=count,
                    share=count / realisations.n_blocks,
                    has_model=mode in modelled,
                    unstable=int(np.count_nonzero(blocks & unstable)),
                    covered=Average.of(blocks & covered, *bounds),
                    in_domain=int(np.count_nonzero(blocks & answers["in_domain"])),
                    drained=None if drained is None else drained.average(blocks),
                )
            )
    missing = {m.mode: (m.count - m.covered.count) / realisations.n_blocks for m in modes}
    missing = {mode: share for mode, share in missing.items() if share > 0.0}
    why = {**UNANSWERED, **{mode: f": {error}" for mode, error in lacking.items()}}
    warnings = _warnings(missing, reason[topples], modelled - {*lacking}, why)
    for text in (BONDED, ENDS, SLIPS_ON):
        if count := int(np.count_nonzero(reason == text)):
            warnings.append(Diagnostic(f"{count} blocks without an answer: {text}", "no_answer"))
    return Scenario(
        measures=measures,
        model=getattr(answer, "model", None),
        term=getattr(answer, "term", None),
        method=getattr(answer, "method", None),
        level=level,
        modes=tuple(modes),
        covered=Average.of(covered, *bounds),
        covered_share=int(np.count_nonzero(covered)) / realisations.n_blocks,
        uncovered_share=missing,
        **answers,
        warnings=(*warnings, *gives_way, *no_bound),
        other_models=other_models,
        drained=drained,
    )


def _other_modes(
    realisations: Realisations,
    described: NDArray[np.bool_],
    measures: Mapping[str, float],
    displacement_m: float,
    rotation_deg: float | None,
) -> Iterator[tuple[ModeName, NDArray[np.bool_], dict[str, Any]]]:
    """Yield, for all modes except toppling, the blocks with a model and the inputs of the
    prediction.
    """
    distance = positive(displacement_m, "displacement_m", "m")
    motion: dict[str, Any] = {
        name: measures[name]
        for name in ("pgv_m_s", "pga_g", "arias_m_s", "magnitude")
        if name in measures
    }
    k = realisations.stability.yield_acceleration
    described = described & (k > 0.0)
    slides = realisations.of_mode("slide", "stable") & described
    with np.errstate(all="ignore"):
        dip_deg = dip_of_factor(_shapes(realisations, "slide"))
    if slides.any():
        slide = {"ky": k[slides], "beta_deg": dip_deg[slides], "displacement_m": distance}
        yield "slide", slides, {**slide, **motion}
    criteria: dict[ModeName, dict[str, Any]] = {"slump": {"rotation_deg": rotation_deg}}
    if rotation_deg is None:
        criteria["confined_topple"] = {}
    for mode, criterion in criteria.items():
        with np.errstate(all="ignore"):
            p2 = p2_at_rest(_shapes(realisations, mode), array_elementwise())
        moves = realisations.of_mode(mode, "stable") & described & np.isfinite(p2)
        if moves.any():
            numbers = zip(kind_of_mode(mode).parameters, (k[moves], p2[moves]), strict=True)
            yield mode, moves, {**dict(numbers), **criterion, **motion}


def _shapes(realisations: Realisations, mode: ModeName) -> ModeShapes:
    """Return the blocks as geometries of one mode."""
    return ModeShapes(
        realisations.blocks, mode, realisations.stability.yield_acceleration,
        realisations.beta_deg, realisations.phi_deg, realisations.phi_back_deg, False, backed=True,
        push=_push(realisations),
    )  # fmt: skip


def _push(realisations: Realisations) -> Any:
    """Return the water force on the blocks for `ModeShapes`; None for dry blocks."""
    if not realisations.is_wet.any():
        return None
    joint = realisations.joint
    return push_of_blocks(
        realisations.blocks, realisations.beta_deg, joint["water_m"], joint["density_kg_m3"]
    )


def _what_gives_way(
    realisations: Realisations, described: NDArray[np.bool_], pga_g: float
) -> Iterator[str]:
    """Yield the number of slides whose heel lifts at a PGA [g], and of topples whose toe slips."""
    push = _push(realisations)
    thresholds: dict[ModeName, tuple[Diagnostic, Callable[..., Any]]] = {
        "slide": (HEEL_TIPS, heel_tips_g),
        "topple": (TOE_SLIPS, toe_slips_g),
    }
    for mode, (about, threshold_g) in thresholds.items():
        rows = np.flatnonzero(realisations.of_mode(mode, "stable") & described)
        at_g = threshold_g(
            realisations.blocks.at(rows), realisations.beta_deg[rows], realisations.phi_deg[rows],
            None if push is None else tuple(component[rows] for component in push),
        )  # fmt: skip
        gives_way = (at_g < pga_g) & (realisations.stability.yield_acceleration[rows] < pga_g)
        if count := int(np.count_nonzero(gives_way)):
            low, high = (float(reduce(at_g[gives_way])) for reduce in (np.min, np.max))
            text = about.replace("{threshold:.2f}", f"{low:.2f} to {high:.2f}")
            prefix = f"{count} of {rows.size} stable blocks of mode {mode}: "
            yield about.replaced(text=f"{prefix}{text}")


_FOR_SLIDES = ": displacement_m, how far is too far for slides [m], gives them one"

UNANSWERED: Mapping[ModeName, str] = {
    "topple": "",
    "slide": ": displacement_m, how far is too far [m], gives them one",
    "slump": _FOR_SLIDES,
    "confined_topple": f"{_FOR_SLIDES}, of failure past recovery alone",
}
"""What gives an answer to blocks of a mode that has none."""


def _warnings(
    missing: Mapping[ModeName, float],
    reason: NDArray[np.object_],
    modelled: set[ModeName],
    why: Mapping[ModeName, str],
) -> list[str]:
    texts = (
        f"{mode.replace('_', ' ')}: {percent(share)} of the blocks have no answer"
        + ("" if mode in modelled else why[mode])
        for mode, share in missing.items()
    )
    warnings: list[str] = [Diagnostic(text, "no_answer") for text in texts]
    reasons, counts = np.unique(reason.astype(str), return_counts=True)
    tally: Counter[str] = Counter()
    for text, count in zip(reasons.tolist(), counts.tolist(), strict=True):
        for sentence in filter(None, text.split("; ")):
            tally[sentence] += count
    total = reason.size
    return warnings + [
        Diagnostic(f"{count} of {total} toppling blocks: {sentence}", "block_reasons")
        for sentence, count in tally.items()
    ]
