"""Response of an uncertain block to a given motion: the fraction of simulated draws that fails."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rbfrag.errors import InputError
from rbfrag.fragility.confidence import quantiles_of
from rbfrag.fragility.method import SINGLE
from rbfrag.motions.polarity import POLARITIES
from rbfrag.motions.readers import MotionLike, as_motion
from rbfrag.question.classify import has_shape
from rbfrag.question.keywords import by_field_name
from rbfrag.question.measurement_draws import (
    Draw,
    DrawnBlock,
    check_draws,
    draw_count,
    drawn_values,
    lattice,
    split_sigmas,
)
from rbfrag.question.nominal import described
from rbfrag.question.shape_validation import LOCKED
from rbfrag.results.diagnostic import Diagnostic, diagnostics
from rbfrag.results.numbers import confidence, interval, percent
from rbfrag.results.result import Result, TextLine, TextTable
from rbfrag.solver.excitation import excitation, motion_remarks
from rbfrag.solver.kind import Kind, SupportedBlock
from rbfrag.solver.kinds import facts_of
from rbfrag.solver.quantity import not_negative, positive
from rbfrag.solver.respond import known_by_numbers, known_by_shape
from rbfrag.solver.results import Outcome
from rbfrag.solver.scatter import fraction, lognormal
from rbfrag.vocabulary.quantities import (
    BLOCKS,
    FAILURE,
    MEASURED,
    QUANTITIES,
    SCATTER,
)

LEVEL = 0.95
"""Level of the interval of the share."""

MOST_DRAWS = 1_000_000

FEWEST_POINTS = 256
"""Fewest draws of two or more numbers: with fewer points their scores are correlated."""

_NUMBERS = ("p2", "kr", "ky")
_FAILS_BY = "displacement_m"
_FIELDS = frozenset({*BLOCKS, *MEASURED[:-1]}).difference(
    ("ks", "ps2", "kct", "pct2", "ks_sigma", "ps2_sigma", "kct_sigma", "pct2_sigma", "kind")
)
"""Fields of a block that is simulated."""


@dataclass(frozen=True, repr=False)
class DrawnResponses(Result):
    """Responses of the draws of one block to one motion.

    Args:
        kind: the models that were run.
        share_failed: failed draws over those that stand at rest: the probability of failure.
        standard_error: counting error of the share, √(s(1 - s)/n).
        ci_low: lower end of the interval of the share that the count leaves open (Wilson 1927).
        ci_high: upper end of it.
        level: level of that interval.
        failed: number of draws that failed.
        draws: number of draws.
        excluded: number of draws without an answer, most of them unstable at rest.
        polarity: how the motion was pointed at the block: ``forward``, ``reverse`` or ``both``,
            every other draw the one way.
        outcomes: number of draws by outcome of their run.
        warnings: sentences about suspicious input, and about outcomes that are not known.
    """

    kind: str
    share_failed: float
    standard_error: float
    ci_low: float
    ci_high: float
    level: float
    failed: int
    draws: int
    excluded: int
    polarity: str
    outcomes: Mapping[str, int]
    warnings: tuple[str, ...]

    def sentences(self) -> Iterator[str]:
        """Yield the fraction of the drawn blocks that fails, with its sampling uncertainty."""
        low = self.ci_low if self.ci_low > 1e-9 else 0.0  # rounding of a bound that is zero
        ends = confidence(self.level, interval(low, self.ci_high))
        value = percent(self.share_failed)
        yield f"P(failure) {value if value[0] in '<>' else f'= {value}'}   ({ends})"

    def lines(self) -> Iterator[TextLine]:
        """Yield the model, the draws and their outcomes."""
        yield TextLine("Model", self.kind.replace("_", " "))
        of = f"{self.draws - self.excluded:,} drawn blocks{' that stand' if self.excluded else ''}"
        yield TextLine("Draws", f"{self.failed:,} of {of} fail; polarity {self.polarity}")
        counts = (f"{count:,} {name}" for name, count in self.outcomes.items())
        yield TextLine("Outcomes", ", ".join(counts))

    def tables(self, *, verbose: bool = False) -> Iterator[TextTable]:
        """Yield every value, if verbose."""
        if verbose:
            apart = ("outcomes", "warnings")
            yield TextTable(
                (), [(name, value) for name, value in vars(self).items() if name not in apart]
            )

    def as_dict(self) -> dict[str, Any]:
        """Return the answer under the keys of the JSON contract."""
        return {**vars(self), "outcomes": {**self.outcomes}, "warnings": list(self.warnings)}


def respond_draws(
    motion: MotionLike,
    *,
    draws: int | None = None,
    weights: ArrayLike | None = None,
    vertical: MotionLike | None = None,
    polarity: Literal["forward", "reverse", "both"] = "forward",
    kind: str | None = None,
    two_way: bool = False,
    horizontal: bool = False,
    **block: Any,
) -> DrawnResponses:
    """Return the fraction of a block's draws that fails under a ground motion.

    Each draw is simulated, none is emulated. A block is given by its geometry with standard
    deviations of what was measured, as for :func:`rbfrag.predict`: each draw fails in its own mode,
    and draws that are unstable at rest are excluded, because the block stands. It may also be given
    by `p2` and `kr` (it topples, or rocks if `kind` says so) or by `ky` (it slides): medians with
    standard deviations of their logarithms, or arrays of draws, which are taken by weight.

    Args:
        motion: horizontal ground motion or its file.
        draws: number of draws, up to a million, of two or more uncertain numbers rounded up to a
            power of two from 256 on; None for 512, from six uncertain numbers on 1,024, and for
            all of the given draws.
        weights: weights of draws that are given, shape (k,); None where all weigh the same.
        vertical: vertical motion of the same recording, upward positive.
        polarity: ``forward`` or ``reverse``; ``both`` where it is not known how the motion points
            at the block: every other draw the one way.
        kind: the model; None for that of the failure mode of each draw, or that the numbers mean.
        two_way: sliding up the base too.
        horizontal: sliding without the factor cos(φ - β)/cos φ.
        block: fields of the block by the keywords of :func:`rbfrag.predict`, such as ``height_m``
            and ``height_sigma_m`` or ``kr`` and ``kr_sigma``; ``displacement_m`` is the limit of
            blocks that slide.

    Raises:
        InputError: a value outside its range, standard deviations together with draws or without a
            value, a block that slides without a displacement limit, options of another model, or
            too many draws that do not stand.
    """
    fields = by_field_name({n: v for n, v in block.items() if v is not None}, _FIELDS)
    is_count = isinstance(draws, int) and not isinstance(draws, bool)
    if draws is not None and not (is_count and 1 <= draws <= MOST_DRAWS):
        raise InputError(f"draws = {draws!r}: give a whole number from 1 to {MOST_DRAWS}")
    ways = POLARITIES if polarity == "both" else (polarity,)
    if not set(ways) <= set(POLARITIES):
        raise InputError(f"polarity = {polarity!r}: use 'forward', 'reverse' or 'both'")
    motion = as_motion(motion)
    vertical = None if vertical is None else as_motion(vertical, "vertical")
    excited = [excitation(motion, vertical, way) for way in ways]
    limit_m = math.nan
    if _FAILS_BY in fields:
        limit_m = positive(fields[_FAILS_BY], _FAILS_BY, "m")
    remarks: tuple[Diagnostic, ...] = ()
    inputs, sigmas = split_sigmas(fields, is_scenario=False)
    if has_shape(inputs):
        if weights is not None:
            raise InputError("weights are of given draws, not of a geometry: omit them")
        blocks, remarks = _of_geometry(inputs, sigmas, kind, draws)
    else:
        blocks = _of_numbers(inputs, kind, weights, draws)
    notes = check_draws(Counter(draw.state for draw in blocks))
    settings = {
        "two_way": two_way,
        "horizontal": horizontal,
        "restitution": "restitution" in fields,
    }
    options = {name for name, value in settings.items() if value}
    outcomes: Counter[str] = Counter()
    failed, models = 0, {}
    for i, draw in enumerate(blocks):
        if draw.state:
            outcomes[Outcome.STABLE.value] += draw.state == LOCKED
            continue
        try:
            model, supported_block = _supported(draw, options)
            models[model.kind] = model
            slides = _FAILS_BY in model.parameters
            if slides and math.isnan(limit_m):
                raise InputError(
                    f"{_FAILS_BY} is missing: a block of kind {model.kind} requires a displacement "
                    "limit"
                )
            end = model.runner(supported_block)(excited[i % len(excited)])
        except InputError as error:
            raise InputError(f"draw {i + 1}: {error}" if i else str(error)) from None
        outcomes[end.outcome.value] += 1
        slid = end.peak_displacement_m
        failed += end.outcome is Outcome.TOPPLED or (slides and slid is not None and slid > limit_m)
    kinds = ", ".join(models)
    used = {name for model in models.values() for name in (*model.settings, *model.parameters)}
    for name in sorted(options | {_FAILS_BY} & fields.keys()):
        if models and name not in used:
            raise InputError(
                f"{name} cannot be combined with kind {kinds}: omit it", fields=(name,)
            )
    standing = outcomes.total()
    decided = (Outcome.STABLE.value, Outcome.TOPPLED.value)
    unknown = {name: n for name, n in sorted(outcomes.items()) if name not in decided}
    if unknown:
        named = ", ".join(f"{n} {name}" for name, n in unknown.items())
        text = (
            f"{sum(unknown.values())} of {standing} outcomes are unknown ({named}) and count as "
            "not failed"
        )
        notes = (*notes, Diagnostic(text, "undetermined"))
    low, high = wilson(failed, standing)
    share = failed / standing
    return DrawnResponses(
        kind=kinds,
        share_failed=share,
        standard_error=math.sqrt(share * (1.0 - share) / standing),
        ci_low=low,
        ci_high=high,
        level=LEVEL,
        failed=failed,
        draws=len(blocks),
        excluded=len(blocks) - standing,
        polarity=polarity,
        outcomes=dict(sorted(outcomes.items())),
        warnings=diagnostics(remarks, motion_remarks(motion, vertical, excited[0]), notes),
    )


def _supported(draw: Draw, settings: Collection[str]) -> tuple[Kind, SupportedBlock]:
    """Return the model and the block of a draw, with those of the settings that the model has."""
    accepted = None if draw.kind is None else facts_of(draw.kind).settings
    options = {
        name: draw.numbers["restitution"] if name == "restitution" else True
        for name in settings
        if accepted is None or name in accepted
    }
    shape = draw.shape
    if shape is not None and (
        draw.kind is None or facts_of(draw.kind).free_standing or "phi_deg" in shape.planes
    ):
        return known_by_shape(draw.kind, shape.block, shape.planes, options)[:2]
    numbers = {n: draw.numbers[n] for n in (*_NUMBERS, "beta_deg") if n in draw.numbers}
    return known_by_numbers(draw.kind, numbers, options)


def wilson(failed: int, count: int) -> tuple[float, float]:
    """Return the Wilson confidence interval of a fraction from counts, at :data:`LEVEL`.

    Wilson (1927), Journal of the American Statistical Association 22, 209-212: also where none or
    all have failed it is not a point.
    """
    z = quantiles_of(LEVEL).normal
    share, square = failed / count, z * z / count
    middle = (share + 0.5 * square) / (1.0 + square)
    reach = z / (1.0 + square) * math.sqrt((share * (1.0 - share) + 0.25 * square) / count)
    return max(0.0, middle - reach), min(1.0, middle + reach)


def _count(draws: int | None, uncertain: int) -> int:
    """Return the number of draws of some uncertain numbers."""
    if draws is None and not uncertain:
        raise InputError("no standard deviation is given: give one, such as height_sigma_m")
    if draws is None:
        return draw_count([""] * uncertain)
    return draws if uncertain < 2 else max(FEWEST_POINTS, 1 << (draws - 1).bit_length())


def _of_geometry(
    inputs: dict[str, Any], sigmas: Mapping[str, Any], kind: str | None, draws: int | None
) -> tuple[list[Draw], tuple[Diagnostic, ...]]:
    """Return the draws of a block given by its geometry, and the warnings about it."""
    scatter = {
        name: not_negative(inputs.pop(name), name, "-") for name in SCATTER if name in inputs
    }
    remarks = described(inputs, kind).remarks
    drawn = DrawnBlock(inputs, kind)
    if scatter.keys() - {"restitution_sigma"}:
        nominal = drawn.draw({})
        numbers = {n: nominal.numbers[n] for n in (*_NUMBERS, "beta_deg") if n in nominal.numbers}
        facts = None if nominal.kind is None else facts_of(nominal.kind)
        is_level = drawn.shape.is_rectangle and drawn.shape.planes["beta_deg"] == 0.0
        if facts is None or not numbers or (facts.free_standing and not is_level):
            name = next(iter(scatter))
            raise InputError(
                f"{name} does not describe this block: give the standard deviations of what was "
                "measured, such as height_sigma_m",
                fields=(name,),
            )
        more = {n: inputs[n] for n in FAILURE if n in inputs}
        return _of_numbers({**numbers, **more, **scatter}, facts.kind, None, draws), remarks
    has_scatter = scatter.get("restitution_sigma", 0.0) > 0.0
    size = len(sigmas) + has_scatter
    columns = lattice(max(size, 1), _count(draws, size))
    result = [
        drawn.draw(drawn_values(drawn.fields, sigmas, point[: len(sigmas)], SINGLE))
        for point in zip(*columns, strict=True)
    ]
    if has_scatter:
        if "restitution" not in inputs:
            raise InputError("restitution_sigma requires restitution: give its mean")
        z = np.array([z for _, z in columns[-1]])
        values = fraction(z, inputs["restitution"], scatter["restitution_sigma"]).tolist()
        result = [
            draw._replace(numbers={**draw.numbers, "restitution": value})
            for draw, value in zip(result, values, strict=True)
        ]
    return result, remarks


def _of_numbers(
    inputs: Mapping[str, Any], kind: str | None, weights: ArrayLike | None, draws: int | None
) -> list[Draw]:
    """Return the draws of a block given by its parameters, or those of its draws by weight."""
    scatter = {
        name.removesuffix("_sigma"): not_negative(inputs[name], name, "-")
        for name in SCATTER if name in inputs
    }  # fmt: skip
    try:
        values = {
            name: np.asarray(value, dtype=np.float64)
            for name, value in inputs.items()
            if name not in (*SCATTER, _FAILS_BY)
        }
    except (TypeError, ValueError) as error:
        raise InputError(f"the block is not given by numbers: {error}") from None
    for name in values.keys() & {*_NUMBERS}:
        if values[name].size:
            positive(values[name].min(), name, QUANTITIES[name].unit)
    for name, sigma in scatter.items():
        if sigma > 0.0 and name not in values:
            raise InputError(f"{name}_sigma requires {name}: give the median")
    if weights is None and not any(value.ndim for value in values.values()):
        names = [name for name, sigma in scatter.items() if sigma > 0.0]
        columns = lattice(max(len(names), 1), _count(draws, len(names)))
        scores = {n: np.array([z for _, z in c]) for n, c in zip(names, columns, strict=False)}
        drawn = {name: np.broadcast_to(value, len(columns[0])) for name, value in values.items()}
        for name, z in scores.items():
            law = fraction if name == "restitution" else lognormal
            drawn[name] = law(z, values[name], scatter[name])
    elif any(scatter.values()):
        raise InputError(
            "a standard deviation cannot be combined with draws, which give the dispersion"
        )
    else:
        drawn = _picked(values, weights, draws)
    rows = zip(*(column.tolist() for column in drawn.values()), strict=True)
    return [Draw("", kind, dict(zip(drawn, row, strict=True))) for row in rows]


def _picked(
    values: Mapping[str, NDArray[np.float64]], weights: ArrayLike | None, count: int | None
) -> dict[str, NDArray[np.float64]]:
    """Return a number of the given draws, at equal steps of their cumulative weights."""
    try:
        raw_weights = np.asarray(1.0 if weights is None else weights, dtype=np.float64)
        *columns, weight = np.broadcast_arrays(*values.values(), raw_weights)
    except (TypeError, ValueError) as error:
        raise InputError(f"the draws are not lists of numbers of one length: {error}") from None
    if weight.ndim != 1 or weight.size == 0:
        raise InputError("the draws of a block are lists of numbers of one length")
    if not ((weight >= 0.0) & (weight < math.inf)).all() or not weight.sum() > 0.0:
        raise InputError("the weights of draws must be 0 or more, not all 0")
    count = weight.size if count is None else count
    picked = np.searchsorted(np.cumsum(weight) / weight.sum(), (np.arange(count) + 0.5) / count)
    return {name: column[picked] for name, column in zip(values, columns, strict=True)}
