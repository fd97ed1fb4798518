"""Measurement errors of one block: one interval, its sources, and the sensitivity of P.

P is the mean over the draws of :mod:`rbfrag.question.measurement_draws`, each answered by its own
mode and kind, and the interval is that of the mixture of their intervals. A single block loads no
numpy; tables have the same draws in :mod:`rbfrag.question.measurement_arrays`.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import suppress
from typing import Any, NamedTuple

from rbfrag.errors import InputError, ModelError
from rbfrag.fragility.confidence import quantiles_of
from rbfrag.fragility.dependence import ROOT_HALF, ROOT_TWO_PI, normal_quantile, normal_share
from rbfrag.fragility.measures import ABOUT_SCATTER, AMPLIFIED
from rbfrag.fragility.method import SINGLE
from rbfrag.fragility.model_selection import find_model
from rbfrag.fragility.prediction import Prediction, answer_given, with_values
from rbfrag.fragility.validation import NOTABLE_SHARE
from rbfrag.question.classify import (
    has_shape,
)
from rbfrag.question.components import SINGLE_ASSUMED
from rbfrag.question.measurement_draws import (
    WARNED,
    Draw,
    DrawnBlock,
    check_draws,
    draw_count,
    drawn_values,
    lattice,
    source_of,
    split_sigmas,
)
from rbfrag.question.nominal import OF_SHAKING, described
from rbfrag.question.shape_validation import (
    LOCKED,
    REJECTED,
    UNSTABLE,
)  # fmt: skip
from rbfrag.results.diagnostic import Diagnostic, diagnostics
from rbfrag.solver.block.formulas import SCALAR
from rbfrag.solver.kinds import BY_MECHANICS, by_model
from rbfrag.vocabulary.quantities import SCENARIO

CLIP = 4.753
"""Largest probit of a probability, that of 1 - 1e-6."""

FLOOR = 1e-9
"""Smallest standard error of a probit: below it a draw is a step."""

OF_STATED = ("probability", "ci_low", "ci_high")

TOGETHER = "together"
"""Source of what the fields have no linear effect on: curvature, and effects of two together."""


class PointAnswer(NamedTuple):
    """P of a draw with its interval, and whether its inputs lie within the fitted range."""

    probability: float
    low: float
    high: float
    in_domain: bool


Answering = Callable[[str | None, Sequence[Draw]], list[PointAnswer]]
"""Answers draws of one kind."""


def answering(nominal: Prediction, inputs: Mapping[str, Any], how: Mapping[str, Any]) -> Answering:
    """Return the function that answers draws under the shaking of a question.

    Args:
        stated: the answer for the stated block, whose model answers draws of its kind.
        inputs: fields of block and shaking.
        how: ``model``, ``level``, ``db``, ``rotation_deg``, ``mechanism``, ``gmm`` and
            ``component`` of the question.
    """
    measures: Mapping[str, Any] = {n: v for n, v in inputs.items() if n in OF_SHAKING}
    source = how.get("mechanism"), how.get("gmm"), how.get("component")
    model_option, db, level = how.get("model"), how.get("db"), how.get("level", 0.95)
    if source != (None, None, None) or not SCENARIO.isdisjoint(measures):
        from rbfrag.question.scenario import Source, shaken

        measures, _ = shaken(measures, Source(*source[:2]), model_option, db, source[2])

    def answer(kind: str | None, draws: Sequence[Draw]) -> list[PointAnswer]:
        is_stated = kind in (None, nominal.kind)
        given_model = (
            nominal.model if model_option is None or isinstance(model_option, str) else model_option
        )
        model = find_model(
            given_model if is_stated else None,
            (*draws[0].numbers, *measures),
            db,
            kind=kind,
            rotation_deg=how.get("rotation_deg") if is_stated else None,
        )
        about: set[str] = {*ABOUT_SCATTER, *model.method.block.sigmas}
        if len(draws) > 64 and not about.isdisjoint((*draws[0].numbers, *measures)):
            import numpy as np  # P of each draw is itself an integral

            columns = {n: np.array([d.numbers[n] for d in draws]) for n in draws[0].numbers}
            factors = np.array([draw.factor for draw in draws])
            many: Any = answer_given(model, {**columns, **_scaled(measures, factors)}, level)
            rows = many.probability, many.ci_low, many.ci_high, many.in_domain
            return [*map(PointAnswer._make, zip(*(row.tolist() for row in rows), strict=True))]
        singles: Iterator[Any] = (
            answer_given(model, {**draw.numbers, **_scaled(measures, draw.factor)}, level)
            for draw in draws
        )
        return [PointAnswer(a.probability, a.ci_low, a.ci_high, a.in_domain) for a in singles]

    return answer


def answering_motion(motion: Any, polarity: Any) -> Callable[..., Answering]:
    """Return what :func:`answering` is for a record in place of intensity measures."""
    from rbfrag.fragility.prediction_motion import predict_motion

    def answering(
        nominal: Prediction, inputs: Mapping[str, Any], how: Mapping[str, Any]
    ) -> Answering:
        measures = {n: v for n, v in inputs.items() if n in OF_SHAKING}
        options = {name: how.get(name) for name in ("model", "rotation_deg", "db")}

        def answer(kind: str | None, draws: Sequence[Draw]) -> list[PointAnswer]:
            about = options if kind in (None, nominal.kind) else {**options, **_ANY_MODEL}
            points = (
                predict_motion(
                    {**draw.numbers, **measures}, motion, kind=kind, polarity=polarity or "both",
                    level=nominal.level, **about,
                )
                for draw in draws
            )  # fmt: skip
            return [PointAnswer(a.probability, a.ci_low, a.ci_high, a.in_domain) for a in points]

        return answer

    return answering


_ANY_MODEL = {"model": None, "rotation_deg": None}
"""Options for draws of another kind than that of the stated block."""


def _scaled(measures: Mapping[str, Any], factor: Any) -> Mapping[str, Any]:
    """Return intensity measures of shaking that is stronger by a factor."""
    if isinstance(factor, float) and factor == 1.0:
        return measures
    return {n: v * factor ** AMPLIFIED[n] if n in AMPLIFIED else v for n, v in measures.items()}


class Mixture(NamedTuple):
    """Mean over draws, with one interval for the errors of measurement and of parameters.

    Args:
        probability: mean of P.
        low: lower end of the interval.
        high: upper end.
        probits: η, probit of P of each draw.
        variances: squared standard error of each probit.
    """

    probability: float
    low: float
    high: float
    probits: list[float]
    variances: list[float]


def probit(p: float) -> float:
    """Return the standard normal quantile of a probability, at most that of 1 - 1e-6."""
    return min(max(normal_quantile(p), -CLIP), CLIP) if 0.0 < p < 1.0 else CLIP * (2.0 * p - 1.0)


class Root(NamedTuple):
    """State of the search for a root of an increasing function, numbers or arrays.

    Args:
        t: the present guess.
        least: largest value below the root.
        most: smallest value above it.
        step: last change of the guess.
    """

    t: Any
    least: Any
    most: Any
    step: Any

    @classmethod
    def between(
        cls, least: Any, most: Any, steps: tuple[Any, Any], target: float, where: Where
    ) -> Root:
        """Return the beginning of the search for a share of a mixture.

        Where a step at an end of the bracket holds the target, that end is all that is left.

        Args:
            least: the lower end.
            most: the upper end.
            steps: shares of the mixture that lie within steps at these ends.
            target: the share that is looked for.
            where: chooses between two values.
        """
        width = where(most - least < 10.0 * FLOOR, most - least, 10.0 * FLOOR)
        high = where(steps[0] > target, least + width, most)
        low = where(steps[1] > 1.0 - target, most - width, least)
        return cls(0.5 * (low + high), low, high, high - low)

    def improved(self, excess: Any, slope: Any, where: Where) -> Root:
        """Return the next guess: that of Newton, or the middle where this converges slowly.

        Args:
            excess: the function at the guess.
            slope: its derivative there.
            where: chooses between two values.
        """
        is_below = excess < 0.0
        least, most = where(is_below, self.t, self.least), where(is_below, self.most, self.t)
        step = -excess / (slope + 1e-300)
        t = self.t + step
        converges = (t >= least) & (t <= most) & (abs(step) < 0.5 * abs(self.step))
        t = where(converges, t, 0.5 * (least + most))
        return Root(t, least, most, t - self.t)


Where = Callable[[Any, Any, Any], Any]
TOLERANCE = 1e-11
"""Step of the probit at which the ends of an interval are found."""


def mixture_of(answers: Sequence[PointAnswer], level: float) -> Mixture:
    """Return the mean over draws and the interval of the mixture.

    Draw i is normal about its probit η_i, with the standard errors a_i below and b_i above of its
    own interval. The ends t solve mean Φ((t - η_i)/(a_i if t < η_i else b_i)) = (1 ± level)/2.
    """
    q = quantiles_of(level).normal
    eta, lows, highs = (
        [probit(p) for p in column]
        for column in zip(*(point[:3] for point in answers), strict=True)
    )
    below = [max((e - low) / q, FLOOR) for e, low in zip(eta, lows, strict=True)]
    above = [max((high - e) / q, FLOOR) for e, high in zip(eta, highs, strict=True)]
    count, rows = len(eta), list(zip(eta, below, above, strict=True))
    ends = []
    for target, column in ((0.5 - 0.5 * level, lows), (0.5 + 0.5 * level, highs)):
        # each draw has this share below its own end: the solution lies between the ends
        least, most = min(column), max(column)
        at_low = sum(0.5 + 0.5 * (b == FLOOR) for e, _, b in rows if e == least) / count
        at_high = sum(0.5 + 0.5 * (a == FLOOR) for e, a, _ in rows if e == most) / count
        root = Root.between(least, most, (at_low, at_high), target, SCALAR.where)
        while abs(root.step) > TOLERANCE:
            share = slope = 0.0
            for e, a, b in rows:
                scale = a if root.t < e else b
                z = (root.t - e) / scale
                share += math.erfc(-ROOT_HALF * z)
                slope += math.exp(-0.5 * z * z) / scale
            excess = 0.5 * share / count - target
            root = root.improved(excess, slope / (ROOT_TWO_PI * count), SCALAR.where)
        ends.append(normal_share(root.t))
    mean = sum(answer.probability for answer in answers) / count
    return Mixture(mean, ends[0], ends[1], eta, [(0.5 * (a + b)) ** 2 for _, a, b in rows])


def sources_of(
    mixture: Mixture, scores: Sequence[Sequence[float]], names: Sequence[str]
) -> tuple[dict[str, Any], ...]:
    """Return the fractions of the variance of the probit, the largest first.

    The regression of η on the scores z_j gives b_j cov(z_j, η) of each field; the mean squared
    standard error is that of the fragility model.

    Args:
        mixture: the draws.
        scores: z of each field, a sequence over the draws that are kept.
        names: the fields.
    """
    columns = [*scores, mixture.probits]
    means = [sum(column) / len(column) for column in columns]
    centred = [[x - m for x in column] for column, m in zip(columns, means, strict=True)]
    cov = [[sum(map(float.__mul__, x, y)) / len(x) for y in centred] for x in centred]
    slopes = _solved([row[:-1] for row in cov[:-1]], [row[-1] for row in cov[:-1]])
    fragility = sum(mixture.variances) / len(mixture.variances)
    total = cov[-1][-1] + fragility
    if not total > 0.0:
        return ()
    shares = {n: b * row[-1] / total for n, b, row in zip(names, slopes, cov, strict=False)}
    shares["fragility"] = fragility / total
    shares = dict(sorted(shares.items(), key=lambda item: -item[1]))
    shares[TOGETHER] = 1.0 - sum(shares.values())
    return tuple({"source": name, "fraction": share} for name, share in shares.items())


def _solved(matrix: list[list[float]], right: list[float]) -> list[float]:
    """Return the solution of a few linear equations, by elimination; 0 for a singular column."""
    rows = [[*row, value] for row, value in zip(matrix, right, strict=True)]
    for i, pivot in enumerate(rows):
        for row in rows[i + 1 :]:
            factor = row[i] / pivot[i] if pivot[i] else 0.0
            row[i:] = [x - factor * y for x, y in zip(row[i:], pivot[i:], strict=True)]
    result = [0.0] * len(rows)
    for i in reversed(range(len(rows))):
        rest = sum(map(float.__mul__, rows[i][i + 1 : -1], result[i + 1 :]))
        result[i] = (rows[i][-1] - rest) / rows[i][i] if rows[i][i] else 0.0
    return result


def with_measurement_errors(
    answer: Callable[[Mapping[str, Any]], Prediction],
    question: Mapping[str, Any],
    kind: str | None,
    how: Mapping[str, Any],
    answer_draws: Callable[..., Answering] = answering,
    *,
    added_kr: float = 0.0,
) -> Prediction:
    """Return the answer for one block, with the errors of its measurement in P and its interval.

    Args:
        answer: answers a question without such errors.
        question: fields of block and shaking, single values.
        kind: how the block is asked to fail.
        how: the options of the question, as for :func:`answering`.
        answer_draws: makes the function that answers the draws.
        added_kr: added to k_r of each draw, which a force holds.

    Raises:
        InputError: as of :func:`split_sigmas`; more than 80 % of the draws do not stand, or draws
            slide and no displacement limit is given.
    """
    is_scenario = how.get("gmm") is not None or "rjb_km" in question
    inputs, sigmas = split_sigmas(question, is_scenario=is_scenario)
    nominal = answer(inputs)
    if {*sigmas} <= {"gmm_sigma"} and how.get("sensitivity") and has_shape(inputs):
        spread = math.hypot(inputs.get("amplification_sigma", 0.0), sigmas.get("gmm_sigma", 0.0))
        spread_inputs = {**inputs, "amplification_sigma": spread} if spread else inputs
        rows = sensitivity_of(inputs, kind, answer_draws(nominal, spread_inputs, how))
        nominal = with_values(nominal, sensitivity=rows)
    if not sigmas:
        return nominal
    names = [*sigmas]
    columns = lattice(len(names), draw_count(names))
    points = zip(*columns, strict=True)
    if names == ["gmm_sigma"]:
        blocks = described(inputs, kind)
        (group,) = blocks.groups
        if blocks.at_rest:
            return nominal
        values = (drawn_values(inputs, sigmas, draw, SINGLE) for draw in points)
        draws = [Draw("", group.kind, group.numbers, v["amplification"]) for v in values]
    else:
        block = DrawnBlock(inputs, kind)
        draws = [block.draw(drawn_values(block.fields, sigmas, draw, SINGLE)) for draw in points]
    if added_kr:
        draws = [draw._replace(numbers=_strengthened(draw.numbers, added_kr)) for draw in draws]
    scores = [[z for _, z in column] for column in columns]
    fields = [*map(source_of, names)]
    states = [draw.state for draw in draws]
    check_draws(Counter(states))
    answers = (nominal, *nominal.alternatives[1:])
    states_by_answer = [[*states] for _ in answers]
    merged = [
        _merged(alternative, fields, draws, states, scores, answer_draws(alternative, inputs, how))
        for alternative, states in zip(answers, states_by_answer, strict=True)
    ]
    warnings = _warnings(nominal, sigmas, draws, states_by_answer[0])
    alternatives = tuple(merged) if nominal.alternatives else ()
    inputs = {**nominal.inputs, **sigmas}
    return with_values(merged[0], warnings=warnings, alternatives=alternatives, inputs=inputs)


def _strengthened(numbers: Mapping[str, Any], added_kr: float) -> Mapping[str, Any]:
    return {**numbers, "kr": numbers["kr"] + added_kr} if "kr" in numbers else numbers


USUAL = {
    **dict.fromkeys(("beta_deg", "gamma_deg", "alpha1_deg", "alpha3_deg"), 2.0),
    **dict.fromkeys(("phi_deg", "phi_back_deg", "base", "back"), 3.0),
    **dict.fromkeys(("height_m", "width_m", "r3_m"), 0.05),
    **dict.fromkeys(("s1_m", "s2_m"), 0.1),
}
"""Usual errors of measurement, in degrees or as fractions (judgement; strike scatter is dip scatter
over sin dip, Cruden and Charlesworth 1976; tilt tests ±2–3°, Jang et al. 2018)."""


def usual_sides(fields: Mapping[str, Any], planes: Collection[str]) -> Iterator[tuple[str, Any]]:
    """Yield each measured field with its replaced values at minus and plus its usual error.

    Args:
        fields: fields of the block in its section: numbers or arrays.
        planes: planes in space among what is given, whose angles in the section these state.
    """
    angles = {"base": "beta_deg", "back": "gamma_deg"}
    hidden = {angles[plane] for plane in planes if plane in angles}
    for name, step in USUAL.items():
        field = angles.get(name, name)
        if field not in fields or (name in angles) != (field in hidden):
            continue
        sides = []
        for sign in (-1.0, 1.0):
            value = fields[field]
            value = value + sign * step if step >= 1.0 else value * (1.0 + sign * step)
            sides.append({field: value})
            if name == "base" and "gamma_deg" in fields:
                sides[-1]["gamma_deg"] = fields["gamma_deg"] - sign * step
        yield name, sides


def sensitivity_of(
    inputs: Mapping[str, Any], kind: str | None, answer: Answering
) -> tuple[dict[str, Any], ...]:
    """Return P at plus and minus a usual error of each measured field, the largest change first.

    A block that is unstable there counts as P = 1, and a side without an answer is omitted.
    """
    block = DrawnBlock(inputs, kind)
    rows: list[dict[str, Any]] = []
    fields = {**block.fields, **{n: v for n, v in block.shape.planes.items() if n in USUAL}}
    for name, sides in usual_sides(fields, inputs.keys() & {"base", "back"}):
        values = []
        for draw in map(block.draw, ({}, *sides)):
            if draw.state in (UNSTABLE, LOCKED):
                values.append(float(draw.state == UNSTABLE))
            elif not draw.state:
                with suppress(InputError):
                    values.append(answer(draw.kind, [draw])[0].probability)
        low, high = min(values, default=0.0), max(values, default=0.0)
        rows.append({"field": name, "step": USUAL[name], "low": low, "high": high})
    changes = {row["field"]: probit(row["high"]) - probit(row["low"]) for row in rows}
    effective = [row for row in rows if changes[row["field"]] > 1e-9]
    return tuple(sorted(effective, key=lambda row: -changes[row["field"]]))


def _merged(
    nominal: Prediction,
    names: Sequence[str],
    draws: Sequence[Draw],
    states: list[str],
    scores: Sequence[Sequence[float]],
    answer: Answering,
) -> Prediction:
    """Return the mean over the draws that stand, with its interval and sources.

    Draws of a kind without a model for the measures have no answer; `states` says so.
    """
    answers: list[PointAnswer | None] = [None] * len(draws)
    by_kind: dict[str | None, list[int]] = {}
    for i, draw in enumerate(draws):
        if draw.state == LOCKED:
            answers[i] = PointAnswer(0.0, 0.0, 0.0, in_domain=True)
        elif not draw.state:
            by_kind.setdefault(draw.kind, []).append(i)
    for kind, indices in by_kind.items():
        try:
            points = answer(kind, [draws[i] for i in indices])
        except (InputError, ModelError):
            if len(by_kind) == 1:
                raise
            for i in indices:
                states[i] = REJECTED
            continue
        for i, point in zip(indices, points, strict=True):
            answers[i] = point
    check_draws(Counter(states))
    missing = sum(state not in ("", LOCKED, UNSTABLE) for state in states)
    standing = [i for i, point in enumerate(answers) if point is not None]
    points = [point for point in answers if point is not None]
    mixture = mixture_of(points, nominal.level)
    p, ends = mixture.probability, (mixture.low, mixture.high)
    inside = [point.probability for point in points if point.in_domain]
    at_rest = nominal.probability == 1.0 and nominal.how == BY_MECHANICS
    return with_values(
        nominal,
        probability=p,
        ci_low=ends[0] if missing <= WARNED * len(draws) else None,
        ci_high=ends[1] if missing <= WARNED * len(draws) else None,
        in_domain=p * len(points) - sum(inside) < NOTABLE_SHARE * p * len(points) or p == 0.0,
        how=by_model(nominal.model) if 0.0 < p < 1.0 else nominal.how,
        median_displacement_m=None,
        uncertainty=sources_of(
            mixture, [[column[i] for i in standing] for column in scores], names
        ),
        drawn=tuple(point.probability for point in points),
        as_stated=None if at_rest else {n: getattr(nominal, n) for n in OF_STATED},
    )


def is_obsolete(warning: Diagnostic, sigmas: Collection[str], *, slides: bool) -> bool:
    """Return whether a warning holds for the stated values alone, and not for the draws."""
    if warning.code == "unused_input":
        return slides and "displacement_m" in warning.fields
    if warning.code == "single_gmm":
        return "gmm_sigma" in sigmas
    return warning.code in ("unstable_at_rest", "by_mechanics")


def _warnings(
    nominal: Prediction, sigmas: Mapping[str, Any], draws: Sequence[Draw], states: Sequence[str]
) -> tuple[Diagnostic, ...]:
    """Return the warnings that hold for the draws too, and those about draws left out."""
    slides = any("displacement_m" in draw.numbers for draw in draws)
    warnings = (
        SINGLE_ASSUMED if warning.code == SINGLE_ASSUMED.code else warning
        for warning in diagnostics(nominal.warnings)
        if not is_obsolete(warning, sigmas, slides=slides)
    )
    return diagnostics(warnings, check_draws(Counter(states)))
