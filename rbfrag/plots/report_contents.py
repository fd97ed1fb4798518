"""Contents of a report: headlines, tables of inputs and answers, and versions."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NamedTuple, Unpack

import numpy as np

from rbfrag.errors import InputError
from rbfrag.fragility import describe
from rbfrag.fragility.method import TOPPLING_BLOCK
from rbfrag.fragility.model import FragilityModel
from rbfrag.fragility.model_selection import find_model
from rbfrag.fragility.prediction import Prediction
from rbfrag.hazards.branches import Weights
from rbfrag.hazards.curve import probability_in
from rbfrag.hazards.curve_file import CurveLike, as_curves
from rbfrag.hazards.hazard_answer import HazardAnswer
from rbfrag.hazards.hazard_rates import hazard, with_drained_rates
from rbfrag.plots.canvas import mode_title
from rbfrag.plots.model_lines import HeldMeasures, chart_axis, held_measures, held_names
from rbfrag.plots.spectrum import block_size_m
from rbfrag.question.classify import Shape, shape_of
from rbfrag.question.document import answer_block
from rbfrag.question.drained_bound import without_water
from rbfrag.question.fields import RangeFields
from rbfrag.question.nominal import OF_SHAKING, described
from rbfrag.results.diagnostic import Diagnostic, diagnostics
from rbfrag.results.numbers import exact_percent, interval, percent, return_period
from rbfrag.results.result import Result, TextLine
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.kinds import BY_MECHANICS, KindSpec, facts_of
from rbfrag.solver.stability.single import Stability, stability
from rbfrag.version import __version__
from rbfrag.vocabulary.quantities import (
    BLOCK,
    COMMON,
    INTENSITY,
    QUANTITIES,
    REQUEST,
    SHAKING,
    word_of,
)
from rbfrag.vocabulary.spectral import SpectralSet

SYMBOL = re.compile(r"\b([kp])_([a-z])(?![a-z_])")
"""A symbol with its index, k_r for example."""

Rows = tuple[tuple[str, str], ...]

Table = tuple[str, Rows]


@dataclass(frozen=True)
class RateQuestion:
    """Hazard curve and period for the annual rate of failure.

    Args:
        curve: the hazard curve or its file, or several of one logic tree; None where the question
            is of one shaking alone.
        years: period of the probability [a].
        meaning: keywords that say which curve is meant and what its levels mean.
        weights: weights of several curves as branches.
    """

    curve: CurveLike | Sequence[CurveLike] | None = None
    years: float = 50.0
    meaning: Mapping[str, Any] = field(default_factory=dict)
    weights: Weights | None = None


Drawing = tuple[Block, Stability, str]
"""A block to draw, its stability, and the title of the drawing."""


@dataclass(frozen=True, eq=False, repr=False)
class Contents(Result):
    """The report of one block.

    Args:
        prediction: the probability of failure.
        hazard: the annual rate of failure; None without a hazard curve.
        sections: rows of name and value under headings: the block and its shaking.
        versions: program, model and data.
        drawing: the block that is drawn; None where its shape is not known.
        numbers: numbers of the block that the model reads.
        measures: intensity measures, medians where they are uncertain.
        model: the fragility model.
        held: the variables that its design chart holds constant; None for a model without a chart.
        warnings: warnings of both answers, and of the table that the block is a row of.
    """

    prediction: Prediction
    hazard: HazardAnswer | None
    sections: tuple[Table, ...]
    versions: tuple[str, ...]
    drawing: Drawing | None
    numbers: dict[str, float]
    measures: dict[str, float]
    model: FragilityModel
    held: HeldMeasures | None
    warnings: tuple[Diagnostic, ...]

    @property
    def is_unstable(self) -> bool:
        """True if the block fails without an earthquake."""
        return self.prediction.probability == 1.0 and self.prediction.how == BY_MECHANICS

    def sentences(self) -> Iterator[str]:
        """Yield the probability and the return period."""
        yield from self.prediction.sentences()
        if self.hazard is not None:
            yield from self.hazard.sentences()

    def lines(self) -> Iterator[TextLine]:
        """Yield the labelled lines of both answers; the versions name the model of the rate."""
        yield from self.prediction.lines()
        rate = () if self.hazard is None else self.hazard.lines()
        yield from (line for line in rate if line.label != "Model")

    def as_dict(self) -> dict[str, Any]:
        """Return the prediction under the keys of the JSON contract, with ``hazard``."""
        rate = None if self.hazard is None else self.hazard.as_dict()
        return {**self.prediction.as_dict(), "warnings": [*self.warnings], "hazard": rate}


def contents_of(
    request: Mapping[str, Any], rate: RateQuestion | None = None, **answering: Unpack[RangeFields]
) -> Contents:
    """Answer a question about one block.

    Raises:
        InputError: a question that cannot be answered.
    """
    options = {name: request[name] for name in ("kind", *REQUEST) if name in request}
    inputs = {name: value for name, value in request.items() if name not in options}
    how: dict[str, Any] = {**options, **answering}
    prediction = answer_block(inputs, **how)
    read = prediction.inputs
    facts = facts_of(prediction.kind)
    shape = shape_of({n: v for n, v in inputs.items() if n not in OF_SHAKING and n in OF_BLOCK})
    rate = rate or RateQuestion()
    (group,) = described(inputs, options.get("kind")).groups
    numbers = dict(group.numbers)
    medians = {name: about["median"] for name, about in (prediction.shaking or {}).items()}
    measures = {name: value for name, value in read.items() if name in INTENSITY} | medians
    model = find_model(
        prediction.model, measures, how.get("db"), rotation_deg=how.get("rotation_deg")
    )
    annual = _annual_rate({**numbers, "kind": facts.kind}, rate, how)
    if annual is not None and prediction.drained is not None:
        (dry,) = described(without_water(inputs), options.get("kind")).groups
        bound = _annual_rate({**dry.numbers, "kind": dry.kind}, rate, how)
        if bound is not None:
            annual = with_drained_rates(annual, lambda: bound, True)
    row = model.row
    fitted = describe.fitted_data(row.diagnostics) or "fitted"
    model_version = (
        f"rbfrag {__version__}. Model {model.name} (method {row.method}, measures "
        f"{' '.join(model.term.inputs)}), {fitted}, {row.created[:10] or 'undated'}, "
        f"data {row.data_fingerprint[:12] or 'unknown'}. "
        f"Database: {prediction.data}."
    )
    rate_version = () if annual is None else (
        f"Rate by model {annual.model} from {Path(annual.curves[0].source).name}.",
    )  # fmt: skip
    return Contents(
        prediction=prediction,
        hazard=annual,
        sections=(
            ("Block", _block_rows(shape, facts, numbers, model, prediction.y_m_s)),
            ("Shaking", shaking_rows({n: v for n, v in request.items() if n in OF_REQUEST})),
        ),
        versions=(model_version, *rate_version),
        drawing=_drawing(shape, numbers, is_free_standing=facts.free_standing),
        numbers=numbers,
        measures=measures,
        model=model,
        held=_held(model, numbers, measures),
        warnings=diagnostics(prediction.warnings, () if annual is None else annual.warnings),
    )


OF_BLOCK = frozenset((*BLOCK, *COMMON))
OF_REQUEST = SpectralSet((*SHAKING, "component", "mechanism", "gmm"))
"""Fields of the shaking that a report prints as they were given."""


def shaking_rows(shaking: Mapping[str, Any]) -> Rows:
    """Return the shaking inputs as names and values."""
    return tuple(
        describe.labelled_value(name, value, 6) if isinstance(value, int | float)
        else (word_of(name).replace("_", " "), str(value))
        for name, value in shaking.items()
    )  # fmt: skip


@dataclass(frozen=True)
class ReportedBlock:
    """One block of a report, or several identical ones: the answer, or why there is none."""

    name: str
    contents: Contents | None
    reason: str = ""
    count: int = 1

    @property
    def cells(self) -> tuple[str, ...]:
        """Cells of the block in the summary; only the name without an answer."""
        name = self.name if self.count == 1 else f"{self.name} ({self.count} blocks)"
        if self.contents is None:
            return (name,)
        contents, prediction = self.contents, self.contents.prediction
        mode = contents.sections[0][1][0][1]
        ends = interval(prediction.ci_low, prediction.ci_high)
        answer = [percent(prediction.probability), ends]
        if contents.is_unstable:
            answer = ["1   unstable without shaking", ""]
        rate = contents.hazard
        period = "" if rate is None else rate.return_period_text(0)
        return (name, mode, *answer, period)


NAMED = 6
"""Blocks that a note of several of them names, and whose sensitivity is drawn."""

COLUMNS = ("block", "failure mode", "P", "interval", "return period")


class Report(NamedTuple):
    """The contents of a report.

    Args:
        entries: the blocks, those that are unstable without shaking first.
        summary: names and values of what holds for all of them.
        warnings: what to know about the table and the sums.
        totals: the sums under the keys of the JSON contract.
    """

    entries: list[ReportedBlock]
    summary: Rows = ()
    warnings: tuple[str, ...] = ()
    totals: Mapping[str, Any] = {}

    @property
    def most_critical(self) -> list[str]:
        """Names of the blocks with the highest P that usual errors of measurement change."""
        rows = [
            (-entry.contents.prediction.probability, entry.name)
            for entry in self.entries
            if entry.contents is not None and entry.contents.prediction.sensitivity
        ]
        return [name for _, name in sorted(rows)[:NAMED]]

    @property
    def shared_notes(self) -> dict[str, Diagnostic]:
        """Notes that several blocks have, with the names of these unless all have them."""
        names: dict[Diagnostic, list[str]] = {}
        for entry in self.entries:
            for note in () if entry.contents is None else diagnostics(entry.contents.warnings):
                names.setdefault(note, []).append(entry.name)
        answered = sum(entry.contents is not None for entry in self.entries)
        shared: dict[str, Diagnostic] = {}
        for note, blocks in names.items():
            if 1 < len(blocks) < answered and note not in self.warnings:
                listed = ", ".join((*blocks[:NAMED], *["…"][: len(blocks) - NAMED]))
                shared[note] = note.replaced(text=f"{note} (blocks {listed})")
            elif len(blocks) > 1:
                shared[note] = note
        return shared

    @property
    def notes(self) -> tuple[Diagnostic, ...]:
        """Notes of the report, those that several blocks have among them, once each."""
        return diagnostics(self.warnings, self.shared_notes.values())

    def notes_of(self, contents: Contents) -> tuple[Diagnostic, ...]:
        """Return the notes of a block that no other has."""
        shared = self.shared_notes
        return tuple(note for note in contents.warnings if note not in shared)


def report_of(
    rows: Sequence[Mapping[str, Any]],
    rate: RateQuestion | None,
    warnings: Sequence[str] = (),
    **answering: Unpack[RangeFields],
) -> Report:
    """Answer a question about each of several blocks; a single block must have an answer.

    Args:
        rows: fields of block and shaking, with ``block_id``, ``count``, and ``reason`` of what is
            wrong.
        rate: how often a year they are asked to fail.
        warnings: what to know about the table of the blocks.
        answering: which model answers.
    """
    if not 0 < len(rows) <= 200:
        raise InputError(f"a report has 1 to 200 blocks, not {len(rows):,}")
    entries, errors = [], []
    for i, row in enumerate(rows, start=1):
        count = row.get("count", 1.0)
        request = {n: v for n, v in row.items() if n not in ("block_id", "site_id", "mode", "crs",
                                                           "count", "reason")}  # fmt: skip
        name = str(row.get("block_id", i))
        try:
            if "reason" in row:
                raise InputError(row["reason"])
            if count != int(count) or count < 1:
                raise InputError(f"count = {count:g}: give a whole number of blocks, 1 or more")
            contents = contents_of(request, rate, **answering)
            entries.append(ReportedBlock(name, contents, count=int(count)))
        except InputError as error:
            errors.append(error)
            entries.append(ReportedBlock(name, None, str(error)))
    if len(errors) == len(rows):
        raise errors[0]
    if len(entries) == entries[0].count == 1:
        alone = entries[0].contents
        assert alone is not None
        with_notes = replace(alone, warnings=diagnostics(warnings, alone.warnings))
        return Report([replace(entries[0], contents=with_notes)])
    entries.sort(key=lambda entry: entry.contents is None or not entry.contents.is_unstable)
    summary, totals, notes = _totals(entries, rows, rate or RateQuestion(), answering)
    return Report(entries, summary, diagnostics(warnings, notes), totals)


def _totals(
    entries: Sequence[ReportedBlock],
    rows: Sequence[Mapping[str, Any]],
    rate: RateQuestion,
    answering: RangeFields,
) -> tuple[Rows, dict[str, Any], tuple[str, ...]]:
    """Return the summary of all blocks of a report, its numbers, and the warnings."""
    answered = [(e.contents, e.count) for e in entries if e.contents is not None]
    unstable = sum(count for contents, count in answered if contents.is_unstable)
    standing = [pair for pair in answered if not pair[0].is_unstable]
    expected = sum(count * contents.prediction.probability for contents, count in answered)
    totals: dict[str, Any] = {
        "rows": len(entries), "blocks_answered": sum(count for _, count in answered),
        "blocks_unstable": unstable, "rows_rejected": len(entries) - len(answered),
        "expected_failures": expected,
    }  # fmt: skip
    parts = [f"{totals['blocks_answered']:,} answered"]
    parts += [f"{unstable:,} unstable without shaking (P = 1)"] if unstable else []
    rejected = totals["rows_rejected"]
    parts += [f"{rejected:,} rows rejected"] if rejected else []
    shaking_by_row = [{n: v for n, v in row.items() if n in OF_REQUEST} for row in rows]
    same = all(shaking == shaking_by_row[0] for shaking in shaking_by_row)
    shaking = ", ".join(f"{name} {value}" for name, value in shaking_rows(shaking_by_row[0]))
    summary = [
        ("Blocks", "; ".join(parts)),
        ("Shaking", shaking if same else "given row by row"),
        ("Expected failures in this shaking", f"{expected:.2g}"),
    ]
    if rate.curve is None or not standing:
        return tuple(summary), totals, ()
    names = dict.fromkeys(name for contents, _ in standing for name in contents.numbers)
    columns = {
        name: np.array([contents.numbers.get(name, np.nan) for contents, _ in standing])
        for name in names
    }
    kinds = [contents.prediction.kind for contents, _ in standing]
    count = np.array([number for _, number in standing], dtype=np.float64)
    request = {**rows[0], **answering}
    how: dict[str, Any] = {name: request[name] for name in ("level", "db") if name in request}
    how |= {**columns, **rate.meaning, "kind": kinds}
    answer = hazard(
        as_curves(rate.curve, **rate.meaning), weights=rate.weights, joint=True, years=rate.years,
        count=count, **how,
    )  # fmt: skip
    curve, expected_rate = answer.curves[0], answer.expected_failures_per_year
    low, high = answer.total_low, answer.total_high
    place = f", {curve.place}" if curve.place else ""
    period = f"{rate.years:g} years"
    not_in = f" (without the {unstable:,} unstable)" if unstable else ""
    summary += [
        ("Hazard curve", f"{curve.imt}{place}; {Path(curve.source).name}"),
        (f"Expected failures per year{not_in}",
         f"{expected_rate:.2g} ({low:.2g}–{high:.2g}, {exact_percent(answer.level)} confidence)"),
    ]  # fmt: skip
    totals |= {"years": rate.years, "expected_failures_per_year": expected_rate}
    joint = answer.joint
    any_rate = answer.annual_rate_any
    if any_rate is not None:
        chance = float(probability_in(rate.years, np.asarray(any_rate)))
        law = "one block" if joint is None else joint.joint_law
        summary += [
            ("At least one failure", f"return period {return_period(any_rate)}"),
            (f"P(at least one failure in {period})", f"{percent(chance)} ({law})"),
        ]
        totals |= {"annual_rate_any": any_rate, "probability_any": chance, "joint_law": law}
    elif joint is not None:
        bounds = (joint.bounds[name] for name in ("fully_dependent", "independent"))
        ends = [bound["probability_any"] for bound in bounds]
        summary.append(
            (f"P(at least one failure in {period})",
             f"{interval(*ends)} (full dependence to independence)")
        )  # fmt: skip
        totals |= {"bounds": joint.bounds}
    return tuple(summary), totals, answer.warnings


def _annual_rate(
    block: Mapping[str, Any], question: RateQuestion, answering: Mapping[str, Any]
) -> HazardAnswer | None:
    if question.curve is None or block.keys() <= {"kind"}:  # unstable without shaking
        return None
    curves = as_curves(question.curve, **question.meaning)
    # another model reads the curve's measure alone
    how: dict[str, Any] = {name: v for name, v in answering.items() if name in ("level", "db")}
    return hazard(
        curves, weights=question.weights, years=question.years, **block, **question.meaning, **how
    )


def _held(
    model: FragilityModel, numbers: Mapping[str, float], measures: Mapping[str, float]
) -> HeldMeasures | None:
    """Return the variables held constant in the design chart; None for a model without a chart."""
    block_inputs = {name: v for name, v in numbers.items() if not name.endswith("_sigma")}
    if chart_axis(model) is None or not all(
        block_inputs.pop(name, 0.0) for name in TOPPLING_BLOCK.names
    ):
        return None
    constants = {name: measures[name] for name in held_names(model)}
    held = held_measures(model, p2=numbers["p2"], **constants)
    return replace(held, block_inputs=block_inputs)


def _drawing(
    shape: Shape | None, numbers: Mapping[str, float], *, is_free_standing: bool
) -> Drawing | None:
    """Return the block to draw; None where its shape is unknown."""
    if shape is not None:
        block, planes, title = shape.block, shape.rough(), "The block to scale"
    elif {*TOPPLING_BLOCK.names} <= {*numbers}:
        angle, size = math.atan(numbers["kr"]), float(block_size_m(numbers["p2"]))
        block = Block.rectangle(2.0 * size * math.cos(angle), 2.0 * size * math.sin(angle))
        planes = Shape(block, {"beta_deg": 0.0}, True).rough()
        title = "The rectangle of this p² and k_r on a level base"
    else:
        return None
    if is_free_standing:
        planes["back_fracture"] = False
    return block, stability(block, **planes), title


def _block_rows(
    shape: Shape | None,
    facts: KindSpec,
    numbers: Mapping[str, float],
    model: FragilityModel,
    y_m_s: float | None,
) -> Rows:
    stands = " (free-standing)" if facts.free_standing else " (rock face behind)"
    rows = [("failure mode", mode_title(facts.kind) + (stands if facts.mode == "topple" else ""))]
    planes: Mapping[str, Any] = {}
    if shape is not None:
        block, planes = shape.block, shape.planes
        rows += [
            ("height", f"{block.s1_m:.4g} m"),
            ("width of the base", f"{block.base_m:.4g} m"),
            ("angles of heel and toe", f"{block.alpha1_deg:.4g}°, {block.alpha3_deg:.4g}°"),
            ("dip of the base", f"{planes['beta_deg']:g}°"),
            ("friction angle", f"{planes['phi_deg']:g}°" if "phi_deg" in planes else "not given"),
        ]
    rows += [describe.labelled_value(n, value) for n, value in numbers.items() if n not in planes]
    of = model.method.block
    if y_m_s is not None and of.size is not None:
        first = "toppling velocity" if facts.mode == "topple" else "velocity"
        k, p = QUANTITIES[of.strength].symbol, QUANTITIES[of.size].symbol.rstrip("²")
        rows.append((f"{first}, y = {k} g/{p}", f"{y_m_s:.3g} m/s"))
    return tuple(rows)
