"""Blocks between two joint sets, and their failure under a ground motion: `rockmass`."""

from __future__ import annotations

import math
import os
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from typing import Any, Unpack

import numpy as np
from numpy.typing import NDArray

from rbfrag.campaign.executors import run_locally
from rbfrag.campaign.summary import CampaignProgress
from rbfrag.errors import InputError, UnknownFieldError
from rbfrag.files import as_path
from rbfrag.fragility.confidence import checked_level
from rbfrag.fragility.model import Model
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.polarity import Polarity
from rbfrag.motions.readers import MotionLike, as_motion
from rbfrag.question.fields import MeasureFields
from rbfrag.results.diagnostic import codes_by_row
from rbfrag.results.numbers import interval, percent, rounded, with_interval
from rbfrag.results.result import Result, TextLine, TextTable
from rbfrag.rockmasses.counts import crossings, failures, mode_counts
from rbfrag.rockmasses.file import read_rock_mass, rock_mass_of_tables
from rbfrag.rockmasses.joint_sets import Realisations, RockMass
from rbfrag.rockmasses.report import (
    as_dict,
    block_columns,
    failure_warnings,
    failures_as_dict,
    mass_warnings,
    outcome_columns,
)
from rbfrag.rockmasses.scenario import Scenario, scenario
from rbfrag.rockmasses.shaking import (
    CHUNK,
    OUTCOMES,
    BlockOutcomes,
    FailureLimits,
    ShakenMass,
    ShakingOptions,
    plan_shaking,
    run_blocks,
)
from rbfrag.solver.stability.modes import words_of_mode
from rbfrag.vocabulary.quantities import INTENSITY, QUANTITIES
from rbfrag.vocabulary.spectral import input_of, spectral_inputs, spectral_names

ALWAYS_SHOWN = ("at_rest", "stays", "unstable")
"""Outcomes that have a column of their own even if there are none."""

QUARTERS = ("q05", "q50", "q95")
"""Quantiles of the yield acceleration in the table of modes."""


@dataclass(frozen=True, eq=False, repr=False)
class RockMassAnswer(Result):
    """Blocks of a rock mass, and the fraction that fails.

    Its table has one row a block; with a motion one a block and scale.

    Args:
        blocks: the blocks that were drawn.
        scenario: probabilities by measures of the motion; None where none is given.
        outcomes: what a motion did to each block; None without a motion.
        level: confidence level of the intervals.
        warnings: notes on the rock mass, the scenario and the motion.
    """

    blocks: Realisations
    scenario: Scenario | None
    outcomes: ShakenMass | None
    level: float
    warnings: tuple[str, ...] = ()

    def sentences(self) -> Iterator[str]:
        """Yield the failure modes, and the fraction that fails under the shaking."""
        document = self.as_dict()
        shares = {name: tally["share"] for name, tally in document["modes"].items()}
        names = sorted((name for name in shares if shares[name] > 0.0), key=lambda n: -shares[n])
        parts = [f"{words_of_mode(name)} {percent(shares[name])}" for name in names]
        yield f"Failure modes of {document['blocks']:,} blocks: {', '.join(parts) or 'none'}"
        scenario = document["scenario"]
        if scenario is not None and scenario["covered_only"]["probability"] is not None:
            total = scenario["covered_only"]
            yield (
                f"Mean P(failure) = {_of_average(total)} for the "
                f"{percent(scenario['covered_share'])} of the blocks that a fragility model covers"
            )
            drained = total["drained"] or {"probability": None}
            if drained["probability"] is not None and document["drainage"] == "undrained":
                yield f"Drained: {_of_average(drained)}"
        shaking = document["shaking"]
        for scale in () if shaking is None else shaking["scales"]:
            of_all, unknown = scale["all"]["fails_of_all"], scale["all"]["open_of_all"]
            share = with_interval(of_all["share"], of_all["ci_low"], of_all["ci_high"])
            undetermined = f"; {percent(unknown)} undetermined" if unknown else ""
            scaled = f"{shaking['motion']} × {scale['scale']:g}"
            yield f"{scaled}: {share} of the blocks fail{undetermined}"

    def lines(self) -> Iterator[TextLine]:
        """Yield rejected realisations, equal counts, intensity measures and model, and failure
        limits.
        """
        document = self.as_dict()
        for text, count in document["impossible"].items():
            yield TextLine("Rejected", f"{count:,} realisations are no block: {text}")
        for crossing in document["crossings"]:
            error = crossing["standard_error_g"]
            within = "" if error is None else f" ± {error:.2g}"
            below, above = (f"{words_of_mode(crossing[side])}s" for side in ("below", "above"))
            yield TextLine(
                "Counts",
                f"equal at a PGA of {rounded(crossing['pga_g'])}{within} g: more {below} below, "
                f"more {above} above",
            )
        scenario, shaking = document["scenario"], document["shaking"]
        if scenario is not None:
            measures = (
                f"{QUANTITIES[name].symbol or name} {scenario[name]:g} {QUANTITIES[name].unit}"
                for name in (*INTENSITY, *spectral_names(scenario))
                if name in scenario
            )
            yield TextLine("Shaking", ", ".join(text.strip() for text in measures))
            models = {"": scenario["model"], **scenario["other_models"]}
            named = (
                f"{model} ({words_of_mode(mode)})" if mode else model
                for mode, model in models.items()
                if model is not None
            )
            yield TextLine("Model", ", ".join(named) or "none of these blocks has a model")
        if shaking is not None:
            yield TextLine(
                "Motion",
                f"{shaking['motion']}, {shaking['polarity']} polarity: {shaking['runs']:,} runs",
            )
            limit_m, limit_deg = shaking["displacement_limit_m"], shaking["rotation_limit_deg"]
            beyond = "" if limit_deg is None else f"beyond {limit_deg:g}° or "
            text = f"a slide fails beyond {limit_m:g} m, a rotating block {beyond}past recovery"
            yield TextLine("Limits", text)

    def tables(self, *, verbose: bool = False) -> Iterator[TextTable]:
        """Yield the modes, the probabilities by mode, and failures by scale.

        Args:
            verbose: with the description of the rock mass.
        """
        document = self.as_dict()
        if verbose:
            values = {name: document[name] for name in ("realisations", "blocks", "seed")}
            values |= {**document["variables"], "block.back_fracture": document["back_fracture"]}
            yield TextTable((), [*values.items()])
        yield _mode_table(document)
        if document["scenario"] is not None:
            yield _scenario_table(document["scenario"])
        if document["shaking"] is not None:
            yield from _failure_tables(document["shaking"])

    def as_dict(self) -> dict[str, Any]:
        """Return the answer under the keys of the JSON contract."""
        ran, level = self.outcomes, self.level
        failed = None if ran is None else failures_as_dict(ran, failures(ran, level), level)
        document = as_dict(
            self.blocks, mode_counts(self.blocks), crossings(self.blocks), self.scenario, failed
        )
        return {**document, "warnings": list(self.warnings)}

    def table_columns(self) -> Mapping[str, NDArray[Any]]:
        """Return the columns by name, with the codes of the warnings about each block."""
        if self.outcomes is not None:
            columns = outcome_columns(self.outcomes)
        else:
            columns = block_columns(self.blocks, self.scenario)
        reason = columns.pop("reason")
        codes = codes_by_row(self.warnings, self.blocks.n)
        codes = np.tile(codes, reason.size // max(codes.size, 1))  # a block has a row a scale
        return {**columns, "warnings": codes, "reason": reason}

    def __repr__(self) -> str:
        """Return the number of blocks by mode, on one line."""
        counts = {name: mode.count for name, mode in mode_counts(self.blocks).items()}
        return f"RockMassAnswer({self.blocks.n_blocks} blocks: {counts})"


def _of_average(average: Mapping[str, Any]) -> str:
    """Return a mean probability with its confidence interval."""
    return with_interval(average["probability"], average["ci_low"], average["ci_high"])


def _mode_table(document: Mapping[str, Any]) -> TextTable:
    """Return the counts and yield accelerations by mode."""
    headers = ["mode", "blocks", "fraction", "±", "unstable", "locked"]
    headers += [f"k_{name}_g" for name in QUARTERS]
    if document["drainage"] is not None:
        headers += [f"drained_k_{name}_g" for name in QUARTERS]
    rows = []
    for mode, tally in document["modes"].items():
        states = [tally] if tally["drained"] is None else [tally, tally["drained"]]
        fraction, error = percent(tally["share"]), percent(tally["share_error"])
        numbers = [(state["yield_g"] or {}).get(name) for state in states for name in QUARTERS]
        row = [mode, tally["count"], fraction, error, tally["unstable"], tally["locked"], *numbers]
        rows.append(row)
    return TextTable(headers, rows)


def _scenario_table(scenario: Mapping[str, Any]) -> TextTable:
    """Return the mean probabilities by mode."""
    total = {**scenario["covered_only"], "share": scenario["covered_share"]}
    answers = {**scenario["modes"], "covered blocks only": total}
    headers = [
        "mode",
        "fraction",
        "covered",
        "P(failure)",
        f"{percent(scenario['level'])} interval",
    ]
    if total["drained"] is not None:
        headers += ["drained", "drained interval"]
    rows = []
    for mode, answer in answers.items():
        bounds = [answer] if total["drained"] is None else [answer, answer["drained"] or {}]
        cells: list[object] = []
        for bound in bounds:
            p = bound.get("probability")
            ends = None if p is None else interval(bound["ci_low"], bound["ci_high"])
            cells += [None if p is None else percent(p), ends]
        rows.append([mode, percent(answer["share"]), answer["covered"], *cells])
    return TextTable(headers, rows)


def _failure_tables(shaking: Mapping[str, Any]) -> Iterator[TextTable]:
    """Yield the failures by scale and mode, and the final modes of the blocks."""
    counts = [tally for scale in shaking["scales"] for tally in scale["modes"].values()]
    outcomes = [
        name
        for name in OUTCOMES
        if name != "fails" and (name in ALWAYS_SHOWN or any(tally[name] for tally in counts))
    ]
    headers = ["scale", "PGA [g]", "mode", "blocks", "fail", "of mode", "of all", "interval"]
    rows: list[list[object]] = []
    ends: list[list[object]] = []
    for scale in shaking["scales"]:
        for mode, tally in [*scale["modes"].items(), ("all", scale["all"])]:
            of_all, of_mode = tally["fails_of_all"], tally["fails_of_mode"]
            rows.append(
                [
                    scale["scale"],
                    round(scale["pga_g"], 4),
                    mode,
                    tally["count"],
                    tally["fails"],
                    percent(of_mode["share"]),
                    percent(of_all["share"]),
                    interval(of_all["ci_low"], of_all["ci_high"]),
                    *(tally[name] for name in outcomes),
                ]
            )
        for mode, tally in scale["final_modes"].items():
            ends.append([mode, scale["scale"], *tally.values()])
    yield TextTable([*headers, *outcomes], rows)
    final_modes = next(iter(shaking["scales"][0]["final_modes"].values()))
    # a block without a final mode was not moved, or not run
    modes = ("not moved" if name == "none" else f"ends: {name}" for name in final_modes)
    yield TextTable(["mode", "scale", *modes], ends)


class RockMassQuestion(MeasureFields[float | None], total=False):
    """Options of `rockmass`."""

    motion: MotionLike | None
    vertical: MotionLike | None
    polarity: Polarity
    scales: Sequence[float]
    displacement_m: float | None
    rotation_deg: float | None
    model: Model | None
    level: float
    db: str | PathLike[str] | None
    jobs: int | None
    on_progress: Callable[[CampaignProgress], None] | None


ANSWERED_BY = ("model", "level", "db", "displacement_m", "rotation_deg")
SHAKEN_BY = ("scales", "polarity", "jobs", "on_progress")
FAILS_BY = ("displacement_m", "rotation_deg")
"""Which of these a fragility model, a motion and the failure by a motion take."""


def rockmass(
    mass: str | PathLike[str] | RockMass | Mapping[str, object],
    *,
    n: int | None = None,
    seed: int | None = None,
    **question: Unpack[RockMassQuestion],
) -> RockMassAnswer:
    """Sample blocks from two joint sets, with their modes, yield accelerations and failures.

    With a measure of the motion the probability of failure is averaged over the blocks of each
    mode that there is a fragility model for; with `motion` every block that it moves is run.

    Args:
        mass: a rock mass, its file (.toml, .csv), or its description by tables as in the file.
        n: number of realisations; None for what the file says, else 20,000.
        seed: of the random numbers; None for what the file says, else 1.
        pgv_m_s: peak ground velocity [m/s].
        pga_g: peak ground acceleration [g].
        tm_s: mean period [s].
        pgd_m: peak ground displacement [m].
        sa_g: spectral accelerations [g] by oscillator period [s], as in :func:`rbfrag.predict`.
        arias_m_s: Arias intensity [m/s].
        magnitude: magnitude of the earthquake.
        motion: accelerogram, or its file, that every block is run under in its own mode.
        vertical: vertical motion of the same recording, upward positive.
        polarity: ``forward`` (positive samples drive out of the slope; if left out) or ``reverse``.
        scales: factors on the motion; the motion itself if left out.
        displacement_m: a slide fails beyond this displacement [m]; None for 0.05 with a motion,
            and with measures for an answer of toppling alone.
        rotation_deg: a slump, or a topple against the back plane, fails beyond this rotation
            [deg]; None for past recovery only.
        model: as in :func:`rbfrag.predict`.
        level: confidence level of the intervals; 0.95 if left out.
        db: as in :func:`rbfrag.predict`.
        jobs: worker processes; None for one a processor where there is work for them.
        on_progress: called as blocks are run.

    Raises:
        InputError: a description or value that cannot be used, or measures that do not suffice.
        UnknownModelError: no model of that name.
        DatabaseError: the database cannot be read.
    """
    UnknownFieldError.reject(map(input_of, question), RockMassQuestion, "a rock mass")
    if isinstance(mass, Mapping):
        mass = rock_mass_of_tables(mass)
    elif not isinstance(mass, RockMass):
        mass = read_rock_mass(as_path(mass, "mass", "a rock mass"))
    blocks = mass.realise(n, seed)
    options: dict[str, Any] = {name: value for name, value in question.items() if value is not None}

    def of(names: Iterable[str]) -> dict[str, Any]:
        return {name: options[name] for name in names if name in options}

    measures = of((*MeasureFields.__annotations__, *spectral_names(options)))
    measures |= spectral_inputs("sa_g", measures.pop("sa_g", {}))
    level, motion = checked_level(options.get("level", 0.95)), options.get("motion")
    if motion is not None and measures:
        raise InputError(
            f"motion cannot be combined with {next(iter(measures))}: give the accelerogram or the "
            "intensity measures"
        )
    answer = scenario(blocks, measures, **of(ANSWERED_BY)) if measures else None
    vertical = as_motion(options["vertical"], "vertical") if "vertical" in options else None
    ran = None
    if motion is not None:
        limits = FailureLimits(**of(FAILS_BY))
        ran = shake(blocks, as_motion(motion), vertical=vertical, limits=limits, **of(SHAKEN_BY))
    elif vertical is not None:
        raise InputError("vertical requires a motion: give also motion")
    warnings = mass_warnings(blocks, answer, in_motion=bool(answer or ran))
    if ran is not None:
        warnings += failure_warnings(ran)
    return RockMassAnswer(blocks, answer, ran, level, tuple(warnings))


WORTH_A_PROCESS = 500
"""Blocks below which a worker process takes longer to start than to work."""


def shake(
    blocks: Realisations,
    motion: GroundMotion,
    *,
    jobs: int | None = None,
    on_progress: Callable[[CampaignProgress], None] | None = None,
    **shaking: Unpack[ShakingOptions],
) -> ShakenMass:
    """Simulate every block of a rock mass that a motion moves, each in its own mode.

    The answer does not depend on the number of workers.

    Args:
        jobs: worker processes; None for one per processor, where there is work enough for them.
        on_progress: called at the beginning and after each chunk of work; counts blocks.
        shaking: as for :func:`rbfrag.rockmasses.shaking.plan_shaking`.

    Raises:
        InputError: as for :func:`rbfrag.rockmasses.shaking.plan_shaking`; `jobs` below 1;
            a block that cannot be run.
        WorkFailedError: a worker died.
    """
    if jobs is not None and jobs < 1:
        raise InputError(f"jobs must be at least 1, not {jobs}", fields=("jobs",))
    plan = plan_shaking(blocks, motion, **shaking)
    total = int(plan.indices.size)
    workers = min(jobs or os.cpu_count() or 1, math.ceil(total / CHUNK))
    if jobs is None and total < WORTH_A_PROCESS:
        workers = 1
    started = time.perf_counter()

    def reported(answers: Iterator[BlockOutcomes]) -> Iterator[BlockOutcomes]:
        completed = 0
        if on_progress is not None and total:
            on_progress(CampaignProgress(0, total, 0, 0.0))
        for answer in answers:
            completed += int(answer.place.size)
            if on_progress is not None:
                on_progress(CampaignProgress(completed, total, 0, time.perf_counter() - started))
            yield answer

    answers = run_locally(
        run_blocks, plan.work(), workers, after_a_death="run the same command again"
    )
    return plan.gathered(reported(answers))
