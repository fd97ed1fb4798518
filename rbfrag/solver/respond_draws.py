"""Response of an uncertain block to a given motion: the fraction of simulated draws that fails."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from rbfrag.errors import InputError
from rbfrag.motions.polarity import POLARITIES
from rbfrag.motions.readers import MotionLike, as_motion
from rbfrag.results.diagnostic import Diagnostic
from rbfrag.results.numbers import confidence, interval, percent
from rbfrag.results.result import Result, TextLine, TextTable
from rbfrag.solver.excitation import excitation, motion_remarks
from rbfrag.solver.kind import RunEnd
from rbfrag.solver.quantity import not_negative, positive
from rbfrag.solver.respond import known_by_numbers
from rbfrag.solver.results import FloatArray, Outcome
from rbfrag.solver.scatter import fraction, lognormal

LEVEL = 0.95
"""Level of the interval of the share."""

MOST_DRAWS = 1_000_000

_POSITIVE = {"p2": "1/s²", "kr": "g", "ky": "g"}
_FRACTIONS = {"restitution"}
_FAILS_BY = "displacement_m"


@dataclass(frozen=True, repr=False)
class DrawnResponses(Result):
    """Responses of the draws of one block to one motion.

    Args:
        kind: the model that was run.
        share_failed: failed draws over all draws: the probability that the block fails.
        standard_error: counting error of the share, √(s(1 - s)/n).
        ci_low: lower end of the interval of the share that the count leaves open (Wilson 1927).
        ci_high: upper end of it.
        level: level of that interval.
        failed: number of draws that failed.
        draws: number of draws.
        seed: seed of the draws.
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
    seed: int
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
        draws = f"{self.failed:,} of {self.draws:,} drawn blocks fail"
        yield TextLine("Draws", f"{draws}; seed {self.seed}, polarity {self.polarity}")
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
    p2: ArrayLike | None = None,
    kr: ArrayLike | None = None,
    ky: ArrayLike | None = None,
    beta_deg: ArrayLike | None = None,
    restitution: ArrayLike | None = None,
    p2_sigma: float = 0.0,
    kr_sigma: float = 0.0,
    ky_sigma: float = 0.0,
    restitution_sigma: float = 0.0,
    weights: ArrayLike | None = None,
    displacement_m: float | None = None,
    vertical: MotionLike | None = None,
    polarity: Literal["forward", "reverse", "both"] = "forward",
    kind: str | None = None,
    two_way: bool = False,
    horizontal: bool = False,
    draws: int = 200,
    seed: int = 1,
) -> DrawnResponses:
    """Return the fraction of a block's draws that fails under a ground motion.

    Each draw is simulated, none is emulated. A block is given by `p2` and `kr` (it topples, or
    rocks if `kind` says so) or by `ky` (it slides), as for :func:`rbfrag.respond`, by medians with
    standard deviations, or by arrays of draws, from which draws are taken again by weight. It has
    more than ten parameters, because scripts name each quantity that a user states.

    Args:
        motion: horizontal ground motion or its file.
        p2: frequency parameter p² [1/s²]: its median, or draws of shape (k,).
        kr: rocking acceleration coefficient k_r, likewise.
        ky: yield acceleration coefficient of sliding, likewise.
        beta_deg: with ky: dip of the base [deg].
        restitution: coefficient of restitution of rocking, its mean or draws; None for that of
            conservation of angular momentum of each drawn block.
        p2_sigma: standard deviation of ln p².
        kr_sigma: standard deviation of ln k_r.
        ky_sigma: standard deviation of ln k_y.
        restitution_sigma: standard deviation of the restitution, which is cut off at 0 and 1.
        weights: weights of draws that are given, shape (k,); None where all weigh the same.
        displacement_m: sliding: the displacement beyond which the block has failed [m].
        vertical: vertical motion of the same recording, upward positive.
        polarity: ``forward`` or ``reverse``; ``both`` where it is not known how the motion points
            at the block: every other draw the one way.
        kind: the model; None for the one that the numbers mean.
        two_way: sliding up the base too.
        horizontal: sliding without the factor cos(φ - β)/cos φ.
        draws: number of draws, up to a million.
        seed: seed of the draws, 0 or more.

    Raises:
        InputError: a value outside its range, standard deviations beside draws or without a
            value, a block that slides without a displacement, options of another model.
    """
    inputs = {
        "p2": p2, "kr": kr, "ky": ky, "beta_deg": beta_deg, "restitution": restitution,
    }  # fmt: skip
    sigmas = {
        "p2": p2_sigma, "kr": kr_sigma, "ky": ky_sigma, "restitution": restitution_sigma,
    }  # fmt: skip
    count, generator = _checked(draws, seed)
    drawn = _drawn(inputs, sigmas, weights, count, generator)
    ways = POLARITIES if polarity == "both" else (polarity,)
    if not set(ways) <= set(POLARITIES):
        raise InputError(f"polarity = {polarity!r}: use 'forward', 'reverse' or 'both'")
    motion = as_motion(motion)
    vertical = None if vertical is None else as_motion(vertical, "vertical")
    excited = [excitation(motion, vertical, way) for way in ways]
    limit_m = None if displacement_m is None else positive(displacement_m, _FAILS_BY, "m")
    settings = {"two_way": two_way or None, "horizontal": horizontal or None}
    outcomes: Counter[str] = Counter()
    failed = 0
    model = None
    for i in range(count):
        numbers: dict[str, Any] = {name: float(values[i]) for name, values in drawn.items()}
        draw_settings = {**settings, "restitution": numbers.pop("restitution", None)}
        try:
            model, supported_block = known_by_numbers(kind, numbers, draw_settings)
            if (_FAILS_BY in model.parameters) is not (limit_m is not None):
                raise InputError(
                    f"{_FAILS_BY} is missing: a block of kind {model.kind} requires a "
                    "displacement limit"
                    if limit_m is None
                    else f"{_FAILS_BY} cannot be combined with kind {model.kind}"
                )
            end = model.runner(supported_block)(excited[i % len(excited)])
        except InputError as error:
            raise InputError(f"draw {i + 1}: {error}" if _varies(drawn) else str(error)) from None
        outcomes[end.outcome.value] += 1
        failed += _fails(end, limit_m)
    assert model is not None
    low, high = wilson(failed, count)
    share = failed / count
    return DrawnResponses(
        kind=model.kind,
        share_failed=share,
        standard_error=math.sqrt(share * (1.0 - share) / count),
        ci_low=low,
        ci_high=high,
        level=LEVEL,
        failed=failed,
        draws=count,
        seed=seed,
        polarity=polarity,
        outcomes=dict(sorted(outcomes.items())),
        warnings=(*motion_remarks(motion, vertical, excited[0]), *_not_known(outcomes, count)),
    )


def wilson(failed: int, count: int) -> tuple[float, float]:
    """Return the Wilson confidence interval of a fraction from counts, at :data:`LEVEL`.

    Wilson (1927), Journal of the American Statistical Association 22, 209-212: also where none or
    all have failed it is not a point.
    """
    from scipy.special import ndtri

    z = float(ndtri(0.5 * (1.0 + LEVEL)))
    share, square = failed / count, z * z / count
    middle = (share + 0.5 * square) / (1.0 + square)
    reach = z / (1.0 + square) * math.sqrt((share * (1.0 - share) + 0.25 * square) / count)
    return max(0.0, middle - reach), min(1.0, middle + reach)


def _checked(draws: object, seed: object) -> tuple[int, np.random.Generator]:
    """Return the number of draws and a generator, or reject invalid input."""
    for name, value, least, most in (("draws", draws, 1, MOST_DRAWS), ("seed", seed, 0, 2**63 - 1)):
        if isinstance(value, bool) or not isinstance(value, int) or not least <= value <= most:
            raise InputError(f"{name} = {value!r}: give a whole number from {least} to {most}")
    assert isinstance(draws, int)
    assert isinstance(seed, int)
    return draws, np.random.default_rng(seed)


def _drawn(
    inputs: Mapping[str, ArrayLike | None],
    sigmas: Mapping[str, float],
    weights: ArrayLike | None,
    count: int,
    generator: np.random.Generator,
) -> dict[str, FloatArray]:
    """Return the values of the drawn blocks by name, shape (count,) each."""
    scatter = {name: not_negative(s, f"{name}_sigma", "-") for name, s in sigmas.items()}
    try:
        values = {
            name: np.asarray(value, dtype=np.float64)
            for name, value in inputs.items()
            if value is not None
        }
    except (TypeError, ValueError) as error:
        raise InputError(f"the block is not given by numbers: {error}") from None
    for name in _POSITIVE.keys() & values.keys():
        if values[name].size:
            positive(values[name].min(), name, _POSITIVE[name])
    for name, sigma in scatter.items():
        if sigma > 0.0 and name not in values:
            raise InputError(f"{name}_sigma requires {name}: give the median")
    if weights is None and not any(value.ndim for value in values.values()):
        result = {}
        for name, value in values.items():
            z = generator.standard_normal(count)
            law = fraction if name in _FRACTIONS else lognormal
            result[name] = law(z, value, scatter.get(name, 0.0)) + np.zeros(count)
        return result
    if any(scatter.values()):
        raise InputError(
            "a standard deviation cannot be combined with draws, which give the dispersion"
        )
    return _picked(values, weights, count, generator)


def _picked(
    values: Mapping[str, FloatArray],
    weights: ArrayLike | None,
    count: int,
    generator: np.random.Generator,
) -> dict[str, FloatArray]:
    """Return a number of the given draws, sampled by their weights."""
    try:
        raw_weights = np.asarray(1.0 if weights is None else weights, dtype=np.float64)
        *columns, weight = np.broadcast_arrays(*values.values(), raw_weights)
    except (TypeError, ValueError) as error:
        raise InputError(f"the draws are not lists of numbers of one length: {error}") from None
    if weight.ndim != 1 or weight.size == 0:
        raise InputError("the draws of a block are lists of numbers of one length")
    if not ((weight >= 0.0) & (weight < math.inf)).all() or not weight.sum() > 0.0:
        raise InputError("the weights of draws must be 0 or more, not all 0")
    picked = generator.choice(weight.size, size=count, p=weight / weight.sum())
    return {name: column[picked] for name, column in zip(values, columns, strict=True)}


def _varies(drawn: Mapping[str, FloatArray]) -> bool:
    return any(values.min() != values.max() for values in drawn.values())


def _fails(end: RunEnd, limit_m: float | None) -> bool:
    if end.outcome is Outcome.TOPPLED:
        return True
    slid = end.peak_displacement_m
    return limit_m is not None and slid is not None and slid > limit_m


def _not_known(outcomes: Mapping[str, int], count: int) -> list[str]:
    decided = (Outcome.STABLE.value, Outcome.TOPPLED.value)
    open_ended = {name: n for name, n in outcomes.items() if name not in decided}
    if not open_ended:
        return []
    named = ", ".join(f"{n} {name}" for name, n in sorted(open_ended.items()))
    text = (
        f"{sum(open_ended.values())} of {count} outcomes are unknown ({named}) and count as not "
        "failed"
    )
    return [Diagnostic(text, "undetermined")]
