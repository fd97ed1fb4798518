"""What a report says: sentences, tables of what was asked and answered, and what stands behind."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NamedTuple, Unpack

from rbfrag.errors import InputError
from rbfrag.fragility import words
from rbfrag.fragility.measures import STATED
from rbfrag.fragility.method import TOPPLING_BLOCK
from rbfrag.fragility.model import FragilityModel
from rbfrag.hazards.answer import HazardAnswer, hazard
from rbfrag.hazards.curve import HazardCurve
from rbfrag.hazards.curve_file import CurveLike, as_curves
from rbfrag.hazards.report import as_dict, beyond_in_words, once_in, rate_in_words
from rbfrag.plots.canvas import mode_title
from rbfrag.plots.model_lines import MORE_TERMS, ONE_NUMBER_TERMS, HeldMeasures, held_measures
from rbfrag.plots.spectrum import block_size_m
from rbfrag.question.blocks import Shape, shape_of
from rbfrag.question.document import prediction_document
from rbfrag.question.fields import AnsweringFields, RangeFields
from rbfrag.question.keywords import model_for
from rbfrag.question.question import described
from rbfrag.question.words import number_in_words
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.kinds import KindFacts, facts_of
from rbfrag.solver.stability.single import Stability, stability
from rbfrag.version import __version__

SYMBOL = re.compile(r"\b([kp])_([a-z])(?![a-z_])")
"""A symbol with its index, k_r for example."""

Rows = tuple[tuple[str, str], ...]

Table = tuple[str, Rows]


@dataclass(frozen=True)
class RateQuestion:
    """How often a year a block is asked to fail.

    Args:
        curve: the hazard curve or its file; None where the question is of one shaking alone.
        years: period of the probability [a].
        meaning: keywords that say which curve is meant and what its levels mean.
    """

    curve: CurveLike | None = None
    years: float = 50.0
    meaning: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Rate:
    """How often a year the block fails."""

    curve: HazardCurve
    answer: HazardAnswer
    document: dict[str, Any]


class Drawing(NamedTuple):
    """A block to draw."""

    block: Block
    stability: Stability
    title: str


@dataclass(frozen=True, eq=False)
class Contents:
    """All that a report says.

    Args:
        sentences: the answer in words, the first one decides.
        tables: rows of name and value under headings.
        versions: program, model and data.
        drawing: the block that is drawn; None where its shape is not known.
        numbers: numbers of the block that the model reads.
        held: what its design chart holds; None for a model that has no chart.
        document: the prediction under the keys of the JSON contract.
        rate: how often a year it fails; None without a hazard curve.
    """

    sentences: tuple[str, ...]
    tables: tuple[Table, ...]
    remarks: tuple[str, ...]
    versions: tuple[str, ...]
    drawing: Drawing | None
    numbers: dict[str, float]
    measures: dict[str, float]
    model: FragilityModel
    held: HeldMeasures | None
    document: dict[str, Any]
    rate: Rate | None

    def notes(self) -> tuple[str, ...]:
        """Return the warnings as sentences."""
        return tuple(
            f"Note: {text[:1].upper()}{text[1:]}{'' if text.endswith('?') else '.'}"
            for text in self.remarks
        )

    def columns(self) -> tuple[tuple[Table, ...], tuple[Table, ...]]:
        """Return the tables in two columns: the question, and the answer."""
        return self.tables[:2], self.tables[2:]


def contents_of(
    given: Mapping[str, Any], rate: RateQuestion | None = None, **answering: Unpack[RangeFields]
) -> Contents:
    """Answer a question about one block.

    Raises:
        InputError: a question that cannot be answered.
    """
    stated = {name: value for name, value in given.items() if name not in (*STATED, "kind")}
    measures = {name: given[name] for name in STATED if name in given}
    shape, blocks = shape_of(stated), described(stated, given.get("kind"))
    (group,) = blocks.groups
    known = {**group.numbers, **measures}
    how: dict[str, Any] = {**answering}
    document = prediction_document(known, kind=group.kind, remarks=blocks.remarks, **how)
    facts = facts_of(document["kind"])
    numbers = dict(group.numbers)
    of_model: AnsweringFields = {"model": document["model"]}
    if "db" in answering:
        of_model["db"] = answering["db"]
    model = model_for(of_model, [*known], facts.kind)
    answered = _rate({**numbers, "kind": facts.kind}, rate or RateQuestion(), answering)
    about_rate: tuple[str, ...] = ()
    if answered is not None:
        about_rate = (rate_in_words(answered.document), *beyond_in_words(answered.answer))
    warnings = [*document["warnings"], *(answered.document["warnings"] if answered else ())]
    return Contents(
        sentences=(
            *words.prediction_in_words(document),
            *about_rate,
            *words.block_in_words(document["method"], known),
        ),
        tables=(
            ("Block", _block_rows(shape, facts, numbers, model, document["y_m_s"])),
            ("Shaking", tuple(number_in_words(n, v, 6) for n, v in measures.items())),
            *_answer_tables(document, answered),
        ),
        remarks=tuple(dict.fromkeys(warnings)),
        versions=tuple(_versions(model, answered, document["data"])),
        drawing=_drawing(shape, numbers, free=facts.free_standing),
        numbers=numbers,
        measures=measures,
        model=model,
        held=_held(model, numbers, measures),
        document={**document, "hazard": None if answered is None else answered.document},
        rate=answered,
    )


class ReportedBlock(NamedTuple):
    """One block of a report: what is said of it, or why nothing is."""

    name: str
    contents: Contents | None
    reason: str = ""

    @property
    def cells(self) -> tuple[str, ...]:
        """Its row of the summary; of one that is not answered its name."""
        if self.contents is None:
            return (self.name,)
        block, _, answer, *hazard = (rows for _, rows in self.contents.tables)
        read = block[0], *answer[:2], *(rows[1] for rows in hazard)
        return (self.name, *(value for _, value in read))


COLUMNS = ("block", "fails by", "P", "interval", "annual rate")


def entries_of(
    rows: Sequence[Mapping[str, Any]], rate: RateQuestion | None, **answering: Unpack[RangeFields]
) -> list[ReportedBlock]:
    """Answer a question about each of several blocks; one alone must be answered.

    Args:
        rows: fields of block and shaking, with ``block_id``, and ``reason`` of what is wrong.
    """
    if not 0 < len(rows) <= 200:
        raise InputError(f"a report is of 1 to 200 blocks, and these are {len(rows):,}")
    entries, errors = [], []
    for i, row in enumerate(rows, start=1):
        given = {name: row[name] for name in row if name not in ("block_id", "reason")}
        name = str(row.get("block_id", i))
        try:
            if "reason" in row:
                raise InputError(row["reason"])
            entries.append(ReportedBlock(name, contents_of(given, rate, **answering)))
        except InputError as error:
            errors.append(error)
            entries.append(ReportedBlock(name, None, str(error)))
    if len(errors) == len(rows):
        raise errors[0]
    return entries


def _rate(block: Mapping[str, Any], question: RateQuestion, answering: RangeFields) -> Rate | None:
    if question.curve is None:
        return None
    curves = as_curves(question.curve, **question.meaning)
    # another model reads the curve's measure alone
    how: dict[str, Any] = {name: v for name, v in answering.items() if name in ("level", "db")}
    answer = hazard(curves, years=question.years, **block, **question.meaning, **how)
    return Rate(curves[0], answer, as_dict(answer, [None]))


def _held(
    model: FragilityModel, numbers: Mapping[str, float], measures: Mapping[str, float]
) -> HeldMeasures | None:
    """Return what the design chart holds; None for a model that has none."""
    others = dict(numbers)
    if model.term.name not in (*ONE_NUMBER_TERMS, *MORE_TERMS) or not all(
        others.pop(name, 0.0) for name in TOPPLING_BLOCK.names
    ):
        return None
    read = {
        name: measures[name]
        for name in ("pga_g", "tm_s")
        if name in model.term.inputs and model.term.name in MORE_TERMS
    }
    return replace(held_measures(model, p2=numbers["p2"], **read), others=others)


def _drawing(shape: Shape | None, numbers: Mapping[str, float], *, free: bool) -> Drawing | None:
    """Return the block to draw; None where its shape is not known."""
    if shape is not None:
        block, planes, title = shape.block, shape.rough(), "The block to scale"
    elif {*TOPPLING_BLOCK.names} <= {*numbers}:
        angle, size = math.atan(numbers["kr"]), float(block_size_m(numbers["p2"]))
        block = Block.rectangle(2.0 * size * math.cos(angle), 2.0 * size * math.sin(angle))
        planes = Shape(block, {"beta_deg": 0.0}, True).rough()
        title = "The rectangle of this p² and k_r on a level base"
    else:
        return None
    if free:
        planes["back_fracture"] = False
    return Drawing(block, stability(block, **planes), title)


def _block_rows(
    shape: Shape | None,
    facts: KindFacts,
    numbers: Mapping[str, float],
    model: FragilityModel,
    y_m_s: float | None,
) -> Rows:
    stands = " (stands free)" if facts.free_standing else " (backed by a slope)"
    rows = [("fails by", mode_title(facts.kind) + (stands if facts.mode == "topple" else ""))]
    planes: Mapping[str, Any] = {}
    if shape is not None:
        block, planes = shape.block, shape.planes
        rows += [
            ("height across the base", f"{block.s1_m:.4g} m"),
            ("length of the base", f"{block.base_m:.4g} m"),
            ("angles of heel and toe", f"{block.alpha1_deg:.4g}°, {block.alpha3_deg:.4g}°"),
            ("dip of the base", f"{planes['beta_deg']:g}°"),
            ("friction angle", f"{planes['phi_deg']:g}°" if "phi_deg" in planes else "not given"),
        ]
    rows += [number_in_words(n, value) for n, value in numbers.items() if n not in planes]
    of = model.method.block
    if y_m_s is not None and of.size is not None:
        first = "toppling velocity" if facts.mode == "topple" else "velocity"
        k, p = (
            words.SYMBOLS.get(of.strength, of.strength),
            words.SYMBOLS.get(of.size, of.size).rstrip("²"),
        )
        rows.append((f"{first}, y = {k} g/{p}", f"{y_m_s:.3g} m/s"))
    return tuple(rows)


def _answer_tables(document: Mapping[str, Any], rate: Rate | None) -> Sequence[Table]:
    level = f"{100.0 * document['level']:g} %"
    answer = [
        ("probability of failure", words.percent(document["probability"])),
        (f"interval ({level})", words.interval(document["ci_low"], document["ci_high"])),
    ]
    if document["event_low"] is not None:
        ends = document["event_low"], document["event_high"]
        answer.append(
            (f"share at {words.at_sites(document['sites'])} ({level})", words.interval(*ends))
        )
    inside = "inside" if document["in_domain"] else "outside"
    answer.append(("block and shaking", f"{inside} the fitted range"))
    hazards = [] if rate is None else [("Hazard", _hazard_rows(rate, level))]
    return [("Answer", tuple(answer)), *hazards]


def _hazard_rows(rate: Rate, level: str) -> Rows:
    document, curve = rate.document, rate.curve
    place = f", {curve.place}" if curve.place else ""
    return (
        ("hazard curve", f"{curve.imt}{place}"),
        ("annual rate of failure", f"{document['annual_rate']:.3g} 1/a"),
        (f"interval ({level})", f"{document['ci_low']:.2g} to {document['ci_high']:.2g} 1/a"),
        ("on average", once_in(document["annual_rate"])),
        (f"probability in {document['years']:g} years", words.percent(document["probability"])),
    )


def _versions(model: FragilityModel, rate: Rate | None, data: str) -> Sequence[str]:
    row = model.row
    fitted = words.fitted_in_words(row.diagnostics) or "fitted"
    lines = [
        f"rbfrag {__version__}. Model {model.name} (method {row.method}, measures "
        f"{' '.join(model.term.inputs)}), {fitted}, {row.created[:10] or 'undated'}, "
        f"data {row.data_fingerprint[:12] or 'unknown'}. "
        f"Database: {data}."
    ]
    if rate is not None:
        source = Path(rate.curve.source).name
        lines.append(f"Rate by model {rate.document['model']} from {source}.")
    return lines
