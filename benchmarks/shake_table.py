"""Free-standing blocks on a shake table:  python -m benchmarks.shake_table FOLDER --work WORK

Predicts which tests overturn two granite blocks, in folds that never share a base record, by
measures of the motion and by simulated blocks. FOLDER is described in docs/evidence/shake-table.md;
--write keeps the tables in benchmarks/results, --work the simulated outcomes. The exit status is 1
where a target is missed.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student

from benchmarks.held_out import clustered_mean, log_losses
from benchmarks.model_aims import SA_1, SA_3, SA_21
from benchmarks.page import ROOT, markdown, write_table
from benchmarks.shake_table_runs import (
    ALPHA_RAD,
    P2,
    RESTITUTION,
    SPECIMENS,
    Outcomes,
    Trials,
    outcomes,
    overturned,
    read,
)
from rbfrag.fragility.fit.likelihood import Binomial, most_likely
from rbfrag.fragility.fit.result import CLIP
from rbfrag.fragility.method import LOGIT
from rbfrag.fragility.model_selection import find_model
from rbfrag.fragility.prediction import array_answer
from rbfrag.solver.integrator.rocking_kernel import STABLE, TOPPLED
from rbfrag.solver.models.rocking import MODEL as ROCKING

FloatArray = NDArray[np.float64]
Labels = NDArray[np.intp]
Mask = NDArray[np.bool_]
Predictor = Callable[[FloatArray, Mask], FloatArray]
"""Function of the outcomes and of which tests are fitted; it returns P of every test."""

PAGE = ROOT / "docs" / "evidence" / "shake-table.md"

FOLDS = 10
SEED = 1
PARTITIONS = 20
"""Other divisions into folds, to see what the division does."""

SURE = 0.01
"""P where no simulated block overturns, and 1 - P where all do."""

MEDIAN_RAD = np.geomspace(0.03, 0.25, 43)
SIGMA_LN = (0.10, 0.15, 0.20, 0.30, 0.40, 0.60)
RESTITUTION_SIGMA, EVEN = 0.05, 0.5
"""Spread of restitution and part of even blocks, which are not fitted."""

ANY_RESTITUTION_SIGMA, ANY_EVEN = (0.05, 0.10), (0.0, 0.5, 1.0)
"""What they are chosen from where they are fitted as well."""

PGV_PGA, SHARE = "(b) PGV, PGA", "(f) share of simulated overturns"
ALL_FITTED = "(f) the same, spread of e and part of even blocks fitted, too"
WEIGHTED = "(f) the same, all these distributions weighted by their likelihood"
SHIPPED = "(g) shipped {}, best block"
SHIPPED_OF_HOUSNER = "(g) the same, restitution by Housner"
LOG_LOSS, BRIER = (0.20, 0.18), (0.06, 0.055)
"""Targets of the share, by specimen."""

ELEMENT_MODEL = ("0.88", "0.90")
"""Share of outcomes right of the source's best three-dimensional discrete-element runs."""


def folds(base: Labels, seed: int, number: int = FOLDS) -> Labels:
    """Return the fold of each test; tests of one base record share theirs."""
    records = np.unique(base, return_inverse=True)[1]
    order = np.random.default_rng(seed).permutation(int(records.max()) + 1)
    fold: Labels = (order % min(number, order.size))[records]
    return fold


def held_out(predict: Predictor, failed: FloatArray, fold: Labels) -> FloatArray:
    """Return P of each test by a fit without its fold."""
    p = np.empty(failed.size)
    for number in np.unique(fold):
        in_fold = fold == number
        p[in_fold] = predict(failed, ~in_fold)[in_fold]
    return p


def logistic(*measures: FloatArray) -> Predictor:
    """Return the logistic regression on the logarithms of measures."""
    columns = np.column_stack([np.ones(measures[0].size), *map(np.log, measures)])
    number = np.arange(measures[0].size)

    def predict(failed: FloatArray, fitted: Mask) -> FloatArray:
        rows = Binomial(LOGIT, columns, failed, np.ones(failed.size), number)
        return rows.probability(most_likely(rows.only(fitted)))

    return predict


@dataclass(frozen=True, eq=False)
class Candidates:
    """Models without parameters, of which a fit chooses.

    Args:
        p: probability of each test, shape (k, n).
        settings: what each stands for, shape (k, m).
    """

    p: FloatArray
    settings: FloatArray

    @cached_property
    def _logs(self) -> tuple[FloatArray, FloatArray]:
        p = np.clip(self.p, CLIP, 1.0 - CLIP)
        return np.log(p), np.log1p(-p)

    def losses(self, failed: FloatArray, fitted: Mask) -> FloatArray:
        """Return the sum of log losses over the fitted tests, shape (k,)."""
        of_failure, of_survival = self._logs
        return -(of_failure @ (failed * fitted) + of_survival @ ((1.0 - failed) * fitted))

    def best(self, failed: FloatArray, fitted: Mask) -> int:
        """Return the number of the one of least log loss; of equal ones the first."""
        # a sum of equal losses may differ by rounding
        return int(self.losses(failed, fitted).round(9).argmin())


def best_of(candidates: Candidates) -> Predictor:
    """Return P by the candidate of least log loss."""
    return lambda failed, fitted: candidates.p[candidates.best(failed, fitted)]


def weighted(candidates: Candidates) -> Predictor:
    """Return P by all candidates, each weighted by its likelihood."""

    def predict(failed: FloatArray, fitted: Mask) -> FloatArray:
        losses = candidates.losses(failed, fitted)
        weight = np.exp(losses.min() - losses)
        return np.asarray(weight @ candidates.p / weight.sum())

    return predict


def by_verdict(verdicts: Candidates) -> Predictor:
    """Return the verdict of the best block, with P as often as that verdict failed when fitted."""

    def predict(failed: FloatArray, fitted: Mask) -> FloatArray:
        verdict = verdicts.p[verdicts.best(failed, fitted)]
        p = np.empty(failed.size)
        for value in (0.0, 1.0):
            like = verdict == value
            # half a failure in one more test: no share is 0 or 1
            p[like] = (failed[like & fitted].sum() + 0.5) / ((like & fitted).sum() + 1.0)
        return p

    return predict


def distributions(
    free_standing: FloatArray,
    spreads: Sequence[float] = (RESTITUTION_SIGMA,),
    parts: Sequence[float] = (EVEN,),
) -> Candidates:
    """Return what overturns of each distribution over the simulated blocks.

    Alpha is lognormal, restitution normal, on the simulated values; both senses of an uneven block
    are equally likely. Settings are median of alpha [rad], its sigma of ln and mean restitution.

    Args:
        free_standing: 1 where overturned, shape (n, 3, alpha, restitution).
        spreads: sigmas of restitution.
        parts: parts of even blocks.
    """
    even, uneven = free_standing[:, 0], 0.5 * (free_standing[:, 1] + free_standing[:, 2])
    settings, shares = [], []
    for sigma in SIGMA_LN:
        of_alpha = normal_weights(np.log(ALPHA_RAD), np.log(MEDIAN_RAD), sigma)
        for spread in spreads:
            of_e = normal_weights(RESTITUTION, RESTITUTION, spread)
            for part in parts:
                blocks = part * even + (1.0 - part) * uneven
                share = np.einsum("ma,nae,re->mrn", of_alpha, blocks, of_e, optimize=True)
                shares.append(share.reshape(-1, free_standing.shape[0]))
                settings += [(median, sigma, e) for median in MEDIAN_RAD for e in RESTITUTION]
    share = np.concatenate(shares)
    return Candidates(SURE + (1.0 - 2.0 * SURE) * share, np.array(settings))


def normal_weights(values: FloatArray, means: FloatArray, sigma: float) -> FloatArray:
    """Return normal densities at values that sum to 1, shape (means, values)."""
    density = np.exp(-0.5 * ((values - means[:, None]) / sigma) ** 2)
    return np.asarray(density / density.sum(axis=1, keepdims=True))


@dataclass(frozen=True)
class Score:
    """Scores of a predictor on tests left out, each with its error clustered by base record."""

    log_loss: tuple[float, float]
    brier: tuple[float, float]
    right: tuple[float, float]


def score(p: FloatArray, failed: FloatArray, base: Labels) -> Score:
    """Return the scores; P is clipped at 1e-4 for the log loss, and above 0.5 says overturned."""
    return Score(
        clustered_mean(log_losses(p, failed), base),
        clustered_mean((p - failed) ** 2, base),
        clustered_mean(((p > 0.5) == (failed > 0.5)).astype(np.float64), base),
    )


def shipped_fragility(
    trials: Trials, name: str, measures: Sequence[str], restitution: Sequence[float | None]
) -> Candidates:
    """Return P by a model that rbfrag ships, for blocks of every angle and given restitutions.

    Settings are those of :func:`distributions`; sigma is NaN, and so is Housner's restitution.

    Args:
        trials: the tests; measures are those of the filtered traces.
        name: of the model.
        measures: what is given of the shaking.
        restitution: None for that of the rectangle.
    """
    model = find_model(name, measures, kind=ROCKING.kind)
    shape = (MEDIAN_RAD.size, trials.base.size)
    shaking = {key: np.broadcast_to(trials.measured(key), shape) for key in measures}
    shaking |= {
        "kr": np.broadcast_to(np.tan(MEDIAN_RAD)[:, None], shape), "p2": np.full(shape, P2)
    }  # fmt: skip
    p, settings = [], []
    for e in restitution:
        inputs = shaking if e is None else {**shaking, "restitution": np.full(shape, e)}
        p.append(array_answer(model, inputs, interval=False).probability)
        settings += [(alpha, np.nan, np.nan if e is None else e) for alpha in MEDIAN_RAD]
    return Candidates(np.concatenate(p), np.array(settings))


SHIPPED_MODELS: dict[str, tuple[str, tuple[str, ...]]] = {
    "rocking-pga with SA at 21 periods": ("rocking-pga", ("pga_g", *SA_21.names)),
    "rocking-pga with SA(0.3, 1, 3)": ("rocking-pga", ("pga_g", *SA_3.names)),
    "rocking-pga with SA(1)": ("rocking-pga", ("pga_g", *SA_1.names)),
    "rocking-pga with PGV": ("rocking-pga", ("pga_g", "pgv_m_s")),
    "rocking-sa at 21 periods": ("rocking-sa", SA_21.names),
    "rocking-pgv": ("rocking-pgv", ("pgv_m_s",)),
}
"""Models and the measures that they are given, the best first."""

_BEST = next(iter(SHIPPED_MODELS))


def predictors(
    trials: Trials, runs: Outcomes, blocks: Candidates, shipped: Mapping[str, Candidates]
) -> dict[str, Predictor]:
    """Return the predictors by what they read."""
    free_standing, backed = overturned(runs.free_standing), overturned(runs.backed)
    pga, pgv = trials.pga_g, trials.pgv_m_s
    # leaning forward, backward, or either way
    leaning = np.concatenate([backed[:, 0], backed[:, 1], backed.max(axis=1)], axis=1).T
    backed_blocks = Candidates(leaning, np.empty((len(leaning), 0)))
    even = free_standing[:, 0].reshape(len(free_standing), -1).T
    even_blocks = Candidates(even, np.empty((len(even), 0)))
    any_blocks = distributions(free_standing, ANY_RESTITUTION_SIGMA, ANY_EVEN)
    return {
        "(a) PGA": logistic(pga),
        PGV_PGA: logistic(pgv, pga),
        "(b) the same of the filtered traces": logistic(
            trials.measured("pgv_m_s"), trials.measured("pga_g")
        ),
        "(c) X(p), PGA": logistic(trials.spectrum_m_s(), pga),
        "(d) backed toppling, best block: its verdict": best_of(backed_blocks),
        "(d) the same, P of each verdict fitted": by_verdict(backed_blocks),
        "(e) rocking, best block: its verdict": best_of(even_blocks),
        "(e) the same, P of each verdict fitted": by_verdict(even_blocks),
        SHARE: best_of(blocks),
        ALL_FITTED: best_of(any_blocks),
        WEIGHTED: weighted(any_blocks),
        **{name: best_of(shipped_model) for name, shipped_model in shipped.items()},
    }


def score_table(scores: Sequence[Mapping[str, Score]]) -> str:
    """Return the scores of both specimens, and the source's own model."""
    head = ["predictor"]
    for name in SPECIMENS:
        head += [f"{name}: log loss", "Brier", "right"]
    cells = [
        [name, *(f"{mean:.3f} ± {error:.3f}" for of in scores
                 for mean, error in (of[name].log_loss, of[name].brier, of[name].right))]
        for name in scores[0]
    ]  # fmt: skip
    element = ["three-dimensional discrete elements, best runs of the source (its 582 outcomes)"]
    for right in ELEMENT_MODEL:
        element += ["", "", right]
    return markdown((head, [*cells, element]))


def interval(values: FloatArray, base: Labels) -> str:
    """Return a mean with its 95 % interval by base record (Student's t)."""
    mean, error = clustered_mean(values, base)
    half = float(student.ppf(0.975, np.unique(base).size - 1)) * error
    return f"{mean:+.3f} ({mean - half:+.3f} to {mean + half:+.3f})"


def difference_table(
    predicted: Sequence[Mapping[str, FloatArray]], failed: FloatArray, base: Labels
) -> str:
    """Return the share's log loss and Brier score less those of each other predictor."""
    head = [f"{SHARE} less"]
    head += [f"{name}: {score}" for name in SPECIMENS for score in ("log loss", "Brier")]
    cells = []
    for other in predicted[0]:
        if other == SHARE:
            continue
        line = [other]
        for p, y in zip(predicted, failed, strict=True):
            loss = log_losses(p[SHARE], y) - log_losses(p[other], y)
            squared = (p[SHARE] - y) ** 2 - (p[other] - y) ** 2
            line += [interval(loss, base), interval(squared, base)]
        cells.append(line)
    return markdown((head, cells))


def target_table(scores: Sequence[Mapping[str, Score]]) -> tuple[str, bool]:
    """Return what is asked of the share, and whether all of it is reached."""
    head = ["specimen", "log loss", "asked", "Brier", "asked", "below PGV, PGA"]
    cells, reached = [], True
    for k, of in enumerate(scores):
        loss, brier = of[SHARE].log_loss[0], of[SHARE].brier[0]
        better = loss < of[PGV_PGA].log_loss[0]
        good = (loss <= LOG_LOSS[k], brier <= BRIER[k], better)
        reached &= all(good)
        marks = ["" if is_met else " (missed)" for is_met in good]
        cells.append(
            [str(k + 1), f"{loss:.3f}{marks[0]}", f"≤ {LOG_LOSS[k]:g}", f"{brier:.4f}{marks[1]}",
             f"≤ {BRIER[k]:g}", "yes" if better else "no (missed)"]
        )  # fmt: skip
    return markdown((head, cells)), reached


def block_table(predicted: Mapping[str, Candidates], failed: FloatArray, fold: Labels) -> str:
    """Return the blocks that are fitted: to all tests, and their range over the folds."""
    head = ["predictor", "specimen", "median alpha [rad]", "sigma of ln alpha", "mean restitution"]
    cells = []
    for name, blocks in predicted.items():
        for k, y in enumerate(failed):
            best = blocks.settings[blocks.best(y, np.ones(y.size, bool))]
            best_settings = [
                blocks.settings[blocks.best(y, fold != item)] for item in np.unique(fold)
            ]
            ranges = zip(
                best, np.min(best_settings, axis=0), np.max(best_settings, axis=0), strict=True
            )
            cells.append(
                [name, str(k + 1)]
                + [
                    "" if np.isnan(item) else f"{item:.3g} ({low:.3g} to {high:.3g})"
                    for item, low, high in ranges
                ]
            )
    return markdown((head, cells))


def partition_table(trials: Trials, predict: Mapping[str, Predictor]) -> str:
    """Return the log loss of some predictors over other divisions into folds."""
    head = ["predictor", *SPECIMENS]
    divisions = [folds(trials.base, seed) for seed in range(SEED + 1, SEED + 1 + PARTITIONS)]
    cells = []
    for name, prediction in predict.items():
        line = [name]
        for failed in trials.overturned:
            losses = [log_losses(held_out(prediction, failed, f), failed).mean() for f in divisions]
            line.append(f"{np.mean(losses):.3f} ({min(losses):.3f} to {max(losses):.3f})")
        cells.append(line)
    return markdown((head, cells))


def study(trials: Trials, runs: Outcomes) -> tuple[str, bool]:
    """Return the tables, and whether the targets are reached."""
    base, fold = trials.base, folds(trials.base, SEED)
    blocks = distributions(overturned(runs.free_standing))
    shipped = {
        SHIPPED.format(words): shipped_fragility(trials, *model, RESTITUTION.tolist())
        for words, model in SHIPPED_MODELS.items()
    }
    best = SHIPPED.format(_BEST)
    shipped[SHIPPED_OF_HOUSNER] = shipped_fragility(trials, *SHIPPED_MODELS[_BEST], [None])
    all_predictors = predictors(trials, runs, blocks, shipped)
    predicted = [
        {name: held_out(prediction, failed, fold) for name, prediction in all_predictors.items()}
        for failed in trials.overturned
    ]
    scores = [
        {name: score(p, failed, base) for name, p in of.items()}
        for of, failed in zip(predicted, trials.overturned, strict=True)
    ]
    targets, reached = target_table(scores)
    varied = {name: all_predictors[name] for name in (PGV_PGA, SHARE, ALL_FITTED, WEIGHTED, best)}
    shares = " and ".join(f"{100.0 * failed.mean():.1f} %" for failed in trials.overturned)
    decided = np.isin(runs.free_standing, (STABLE, TOPPLED))
    text = [
        f"{base.size} tests of {np.unique(base).size} base records, {np.unique(fold).size} folds; "
        f"{shares} overturned. {decided.size + runs.backed.size:,} simulated runs, "
        f"{int((~decided).sum())} of them without a verdict.",
        "Scores on tests left out, ± the standard error clustered by base record:",
        score_table(scores),
        "Differences, with 95 % intervals by base record:",
        difference_table(predicted, trials.overturned, base),
        "What is asked of (f):",
        targets,
        f"Log loss over {PARTITIONS} other divisions into folds, mean (least to greatest):",
        partition_table(trials, varied),
        "Blocks fitted to all tests (range over the fits without a fold):",
        block_table({SHARE: blocks, best: shipped[best]}, trials.overturned, fold),
    ]
    return "\n\n".join(text), reached


def main(arguments: list[str] | None = None) -> None:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("folder", type=Path, help="folder of the tests")
    options.add_argument("--work", type=Path, help="folder that keeps the simulated outcomes")
    options.add_argument("--workers", type=int, default=2, help="processes (default 2)")
    options.add_argument("--write", action="store_true", help="keep tables in benchmarks/results")
    chosen = options.parse_args(arguments)
    trials = read(chosen.folder)
    text, reached = study(trials, outcomes(trials, work=chosen.work, workers=chosen.workers))
    print(text)
    if chosen.write:
        write_table(PAGE, "shake-table", text)
    if not reached:
        raise SystemExit(1)


if __name__ == "__main__":
    main()
