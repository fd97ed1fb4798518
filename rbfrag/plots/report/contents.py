"""What a report says: sentences, tables of what was asked and answered, and what stands behind."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path
from typing import Any

from rbfrag.errors import InputError
from rbfrag.fragility.lookup import block_of, find_model
from rbfrag.fragility.measures import SPECTRAL, STATED
from rbfrag.fragility.methods import TOPPLING_BLOCK
from rbfrag.fragility.model import FragilityModel
from rbfrag.fragility.words import block_in_words, percent, prediction_in_words
from rbfrag.hazards.answer import HazardAnswer, hazard
from rbfrag.hazards.curve import HazardCurve
from rbfrag.hazards.curve_file import CurveLike, as_curves
from rbfrag.hazards.report import as_dict, beyond_in_words, once_in, rate_in_words
from rbfrag.plots.canvas import mode_title
from rbfrag.plots.model_lines import MORE_TERMS, ONE_NUMBER_TERMS, HeldMeasures, held_measures
from rbfrag.plots.spectrum import block_size_m
from rbfrag.question.blocks import toppling_block
from rbfrag.question.document import prediction_document
from rbfrag.solver.block.geometry import Block
from rbfrag.solver.described import DescribedBlock
from rbfrag.solver.kinds import facts_of
from rbfrag.solver.quantity import positive
from rbfrag.solver.stability.single import Stability, stability
from rbfrag.version import __version__

_ROUGH_DEG = 89.0
"""Friction of a block that is taken not to slide, for its drawing."""

_MEASURES = {
    "pgv_m_s": ("peak ground velocity, PGV", "m/s"),
    "pga_g": ("peak ground acceleration, PGA", "g"),
    "tm_s": ("mean period, Tm", "s"),
    "pgd_m": ("peak ground displacement, PGD", "m"),
    **{
        name: (f"spectral acceleration, SA({period:g} s)", "g") for period, name in SPECTRAL.items()
    },
}

Rows = tuple[tuple[str, str], ...]

Table = tuple[str, Rows]


@dataclass(frozen=True)
class RateQuestion:
    """How often a year a block is asked to fail.

    Args:
        curve: the hazard curve or its file; None where the question is of one shaking alone.
        imt: measure of the curve to take of a file that holds several.
        site: its site, likewise.
        component: what its horizontal component means.
        convert: conversion of a spectral acceleration to PGV.
        convert_sigma: standard deviation of that.
        years: period of the probability [a].
    """

    curve: CurveLike | None = None
    imt: str | None = None
    site: str | None = None
    component: str | None = None
    convert: str | None = None
    convert_sigma: float | None = None
    years: float = 50.0


@dataclass(frozen=True, eq=False)
class Rate:
    """How often a year the block fails.

    Args:
        curve: the hazard curve.
        answer: the rate and where it comes from.
        document: the answer under the keys of the JSON contract.
    """

    curve: HazardCurve
    answer: HazardAnswer
    document: dict[str, Any]


@dataclass(frozen=True, eq=False)
class Contents:
    """All that a report says.

    Args:
        sentences: the answer in words, the first one decides.
        tables: rows of name and value under headings.
        remarks: warnings.
        versions: program, model and data.
        block: the block that is drawn.
        stability: how it stands.
        drawn: what the drawing is of, as its title.
        numbers: numbers of the block that the model reads.
        measures: the shaking, by name.
        model: the model that answered.
        held: what its design chart holds; None for a model that has no chart.
        document: the prediction under the keys of the JSON contract.
        rate: how often a year it fails; None without a hazard curve.
    """

    sentences: tuple[str, ...]
    tables: tuple[Table, ...]
    remarks: tuple[str, ...]
    versions: tuple[str, ...]
    block: Block
    stability: Stability
    drawn: str
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
    described: DescribedBlock | None,
    given: Mapping[str, float],
    *,
    kind: str | None,
    rate: RateQuestion,
    model: str | None,
    level: float,
    db: str | PathLike[str] | None,
) -> Contents:
    """Answer a question about one block.

    Args:
        described: the block by its shape; None for one that `given` has p2 and kr of.
        given: numbers of the block and measures of the motion, by the names of `predict`.
        kind: how it fails; None for toppling, or rocking where no plane backs the shape.
        rate: the question of a rate.
        model: name of the model; None for the best one.
        level: of all intervals.
        db: database of the models.

    Raises:
        InputError: a question that cannot be answered, or a kind that no report is made of.
    """
    remarks: tuple[str, ...] = ()
    if described is not None:
        others = {name: value for name, value in given.items() if name not in STATED}
        blocks = toppling_block(described, others, kind)
        (group,) = blocks.groups
        measures = {name: value for name, value in given.items() if name in STATED}
        kind, remarks, given = group.kind, blocks.remarks, {**group.numbers, **measures}
    kind = block_of(given, kind).kind if kind is None else kind
    if set(TOPPLING_BLOCK.names) - set(facts_of(kind).parameters):
        raise InputError(
            f"no report is made of kind {kind}: its curves are not drawn; ask  rbfrag predict"
        )
    if missing := [name for name in TOPPLING_BLOCK.names if name not in given]:
        raise InputError(
            f"{missing[0]} is missing: a report is of a block by p2 and kr, or by its shape, such "
            "as height and width"
        )
    document = prediction_document(
        given, kind=kind, model=model, level=level, db=db, remarks=remarks
    )
    chosen = find_model(document["model"], given, db, kind=kind)
    numbers = {name: given[name] for name in given if name not in STATED}
    measures = {name: given[name] for name in STATED if name in given}
    answered = _rate(numbers, kind, rate, level, db)
    block, stands, drawn = _drawn(described, numbers, free=facts_of(kind).free_standing)
    warnings = [*document["warnings"], *(answered.document["warnings"] if answered else ())]
    return Contents(
        sentences=(
            *prediction_in_words(document),
            *(
                (rate_in_words(answered.document), *beyond_in_words(answered.answer))
                if answered
                else ()
            ),
            *block_in_words(document["method"], given),
        ),
        tables=tuple(_tables(described, kind, numbers, measures, document, answered)),
        remarks=tuple(dict.fromkeys(warnings)),
        versions=tuple(_versions(chosen, answered, document["data"])),
        block=block,
        stability=stands,
        drawn=drawn,
        numbers=numbers,
        measures=measures,
        model=chosen,
        held=_held(chosen, numbers, measures),
        document=document,
        rate=answered,
    )


def _rate(
    numbers: Mapping[str, float],
    kind: str,
    question: RateQuestion,
    level: float,
    db: str | PathLike[str] | None,
) -> Rate | None:
    if question.curve is None:
        return None
    curves = as_curves(
        question.curve, imt=question.imt, site=question.site, convert=question.convert
    )
    answer = hazard(
        curves, numbers["p2"], numbers["kr"], component=question.component, years=question.years,
        convert=question.convert, convert_sigma=question.convert_sigma, kind=kind,
        restitution=numbers.get("restitution"), level=level, db=db,
    )  # fmt: skip
    return Rate(curves[0], answer, as_dict([curves[0]], [[None]], [answer]))


def _held(
    model: FragilityModel, numbers: Mapping[str, float], measures: Mapping[str, float]
) -> HeldMeasures | None:
    """Return what the design chart holds; None for a model that has none."""
    if model.term.name not in (*ONE_NUMBER_TERMS, *MORE_TERMS):
        return None
    read = {
        name: measures[name]
        for name in ("pga_g", "tm_s")
        if name in model.term.inputs and model.term.name in MORE_TERMS
    }
    held = held_measures(model, p2=numbers["p2"], **read)
    return replace(held, others=_others(numbers))


def _others(numbers: Mapping[str, float]) -> dict[str, float]:
    return {name: value for name, value in numbers.items() if name not in TOPPLING_BLOCK.names}


def _drawn(
    described: DescribedBlock | None, numbers: Mapping[str, float], *, free: bool
) -> tuple[Block, Stability, str]:
    """Return the block to draw, how it stands and what it is."""
    if described is None:
        angle = math.atan(positive(numbers["kr"], "kr", "g"))
        size = float(block_size_m(positive(numbers["p2"], "p2", "1/s²")))
        block = Block.rectangle(2.0 * size * math.cos(angle), 2.0 * size * math.sin(angle))
        conditions: dict[str, Any] = {"beta_deg": 0.0}
        drawn = "The rectangle of this p² and k_r on a level base"
    else:
        block, conditions, drawn = described.block, dict(described.conditions), "The block to scale"
    conditions.setdefault("phi_deg", _ROUGH_DEG)
    if free:
        conditions["back_fracture"] = False
    return block, stability(block, **conditions), drawn


def _tables(
    described: DescribedBlock | None,
    kind: str,
    numbers: Mapping[str, float],
    measures: Mapping[str, float],
    document: Mapping[str, Any],
    rate: Rate | None,
) -> Sequence[Table]:
    level = f"{100.0 * document['level']:g} %"
    stands = "stands free" if facts_of(kind).free_standing else "backed by a slope"
    block = [("fails by", f"{mode_title(kind)} ({stands})")]
    if described is not None:
        shape, known = described.block, described.conditions
        block += [
            ("height across the base", f"{shape.s1_m:.4g} m"),
            ("length of the base", f"{shape.base_m:.4g} m"),
            ("angles of heel and toe", f"{shape.alpha1_deg:.4g}°, {shape.alpha3_deg:.4g}°"),
            ("dip of the base", f"{known['beta_deg']:g}°"),
            ("friction angle", f"{known['phi_deg']:g}°" if "phi_deg" in known else "not given"),
        ]
    block += [("p²", f"{numbers['p2']:.4g} 1/s²"), ("k_r", f"{numbers['kr']:.4g}")]
    if "restitution" in numbers:
        block.append(("restitution", f"{numbers['restitution']:.4g}"))
    block.append(("toppling velocity, y = k_r g/p", f"{document['y_m_s']:.3g} m/s"))
    shaking = [
        (name, f"{measures[key]:g} {unit}")
        for key, (name, unit) in _MEASURES.items()
        if key in measures
    ]
    answer = [
        ("probability of failure", percent(document["probability"])),
        (f"interval ({level})", _interval(document["ci_low"], document["ci_high"])),
    ]
    if document["event_low"] is not None:
        ends = document["event_low"], document["event_high"]
        answer.append((f"in one earthquake ({level})", _interval(*ends)))
    inside = "inside" if document["in_domain"] else "outside"
    answer.append(("block and shaking", f"{inside} the fitted range"))
    tables = [("Block", tuple(block)), ("Shaking", tuple(shaking)), ("Answer", tuple(answer))]
    if rate is not None:
        tables.append(("Hazard", _hazard_rows(rate, level)))
    return tables


def _interval(low: float, high: float) -> str:
    ends = percent(low), percent(high)
    return ends[0] if ends[0] == ends[1] else " to ".join(ends)


def _hazard_rows(rate: Rate, level: str) -> Rows:
    document, curve = rate.document, rate.curve
    place = f", {curve.place}" if curve.place else ""
    return (
        ("hazard curve", f"{curve.imt}{place}"),
        ("annual rate of failure", f"{document['annual_rate']:.3g} 1/a"),
        (f"interval ({level})", f"{document['ci_low']:.2g} to {document['ci_high']:.2g} 1/a"),
        ("on average", once_in(document["annual_rate"])),
        (f"probability in {document['years']:g} years", percent(document["probability"])),
    )


def _versions(model: FragilityModel, rate: Rate | None, data: str) -> Sequence[str]:
    row, about = model.row, model.row.diagnostics
    counts = (
        f" on {about['n']} critical blocks of {about['events']} earthquakes"
        if about.get("n") and about.get("events")
        else ""
    )
    lines = [
        f"rbfrag {__version__}. Model {model.name} (method {row.method}, measures "
        f"{' '.join(model.term.inputs)}), fitted{counts}, {row.created[:10] or 'undated'}, "
        f"data {row.data_fingerprint[:12] or 'unknown'}. "
        f"Database: {data}."
    ]
    if rate is not None:
        source = Path(rate.curve.source).name
        lines.append(f"Rate by model {rate.document['model']} from {source}.")
    return lines
