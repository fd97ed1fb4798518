"""Failure probabilities of blocks across a ShakeMap: `shakemap`."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from os import PathLike
from typing import Any, Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rbfrag.errors import InputError
from rbfrag.exchange.block_rows import PLACE, Blocks, collect_blocks, read_by_models
from rbfrag.exchange.shakemap import at_places, has_all_fields, read_shakemap
from rbfrag.fragility import describe
from rbfrag.fragility.validation import FROM_MEAN, FROM_SUMS
from rbfrag.hazards.map_failures import MapFailures, map_failures
from rbfrag.hazards.map_probability import site_probability
from rbfrag.question.classify import numbers_in
from rbfrag.question.components import component_named
from rbfrag.question.fields import AnsweringFields, BlockKeywords, V
from rbfrag.question.keywords import parts_of
from rbfrag.question.shaking import doubts_about
from rbfrag.results.diagnostic import Diagnostic, codes_by_row
from rbfrag.results.numbers import confidence, count_of, interval, percent, place, rounded
from rbfrag.results.result import Result, TextLine, TextTable
from rbfrag.solver.kinds import by_model
from rbfrag.vocabulary.quantities import ANSWERING, BLOCKS

NOTABLE = 1e-4
"""P above which a place outside the fitted ranges is warned of."""


@dataclass(frozen=True, eq=False, repr=False)
class ShakeMapAnswer(Result):
    """Probabilities of failure across a ShakeMap.

    Args:
        columns: one row a node, or a block at its own place: ``lon`` and ``lat`` [deg], the
            measures, ``probability``, ``ci_low``, ``ci_high``, ``event_low``, ``event_high`` (NaN:
            ``failures`` has the range of them all), ``in_domain``; of blocks ``block_id`` and
            ``reason``. NaN of one that cannot be used.
        failures: how many of all blocks fail together.
        about: event, model, and what was read, under the keys of the JSON contract.
        warnings: what to know about the answer.
        title: what the map is of, in lines.
        epicentre: longitude and latitude [deg]; None where the map does not state it.
        shape: rows and columns of the nodes; None where they are no whole grid.
        file: file that the map is written to; None where it is not written.
    """

    columns: Mapping[str, NDArray[Any]]
    failures: MapFailures
    about: Mapping[str, Any]
    warnings: tuple[str, ...]
    title: str
    epicentre: tuple[float, float] | None
    shape: tuple[int, int] | None
    file: str | None = None

    def table_columns(self) -> Mapping[str, NDArray[Any]]:
        """Return the columns of the map."""
        return self.columns

    def as_dict(self) -> dict[str, Any]:
        """Return the answer under the keys of the JSON contract."""
        file = {} if self.file is None else {"file": self.file}
        return {**self.about, **self._extremes(), "warnings": list(self.warnings), **file}

    def _largest(self) -> int:
        """Return the row of the largest probability."""
        return int(np.nanargmax(self.columns["probability"]))

    def _extremes(self) -> dict[str, Any]:
        """Return the largest probability, its location, and the number of locations above 1 %."""
        probability, lon, lat = (self.columns[name] for name in ("probability", "lon", "lat"))
        best = self._largest()
        return {
            "places": int(np.isfinite(probability).sum()),
            "places_above_1_percent": int(np.nansum(probability > 0.01)),
            "largest_probability": float(probability[best]),
            "largest_at_lon": float(lon[best]),
            "largest_at_lat": float(lat[best]),
        }

    @property
    def has_block_places(self) -> bool:
        """True if blocks have coordinates; otherwise they are assumed at every node."""
        return "block_id" in self.columns

    def sentences(self) -> Iterator[str]:
        """Yield the largest probability and its location, and the number of failures."""
        extremes, row = self._extremes(), self._largest()
        largest, count = extremes["largest_probability"], extremes["places"]
        where = place(extremes["largest_at_lon"], extremes["largest_at_lat"])
        ends = interval(self.columns["ci_low"][row], self.columns["ci_high"][row])
        with_level = confidence(self.about["level"], ends)
        yield f"Maximum P(failure) = {percent(largest)} at {where}   ({with_level})"
        yield (
            f"P exceeds 1 % at {extremes['places_above_1_percent']:,} of "
            f"{count_of(count, 'block' if self.has_block_places else 'node')}"
        )
        if self.has_block_places:
            p_any = self.about["probability_any"]
            p_any = "" if p_any is None else f"; P(at least one failure) = {percent(p_any)}"
            yield f"Expected failures {rounded(self.failures.expected)}{p_any}"

    def lines(self) -> Iterator[TextLine]:
        """Yield the earthquake, the model and the file."""
        event, magnitude = self.about["event"], self.about["magnitude"]
        named = (event, None if magnitude is None else f"M {magnitude:g}", self.about["time"][:10])
        yield TextLine("Event", ", ".join(filter(None, named)) or self.about["event_id"])
        integrated = "integrated" if self.about["uncertainty_integrated"] else "not included"
        yield TextLine(
            "Model", f"{describe.model(self.about)}; uncertainty of the map's values {integrated}"
        )
        if self.file is not None:
            yield TextLine("File", self.file)

    def tables(self, *, verbose: bool = False) -> Iterator[TextTable]:
        """Yield every value if verbose."""
        if verbose:
            values = self.as_dict()
            yield TextTable((), [(name, values[name]) for name in values if name != "warnings"])


class MapKeywords(BlockKeywords[V], AnsweringFields, total=False):
    """Keywords of blocks and models for a map."""


def shakemap(
    grid: str | PathLike[str],
    *numbers: ArrayLike | None,
    blocks: Blocks | None = None,
    uncertainty: str | PathLike[str] | None = None,
    component: str = "larger",
    allow_partial: bool = False,
    draws: int | None = None,
    seed: int = 0,
    on_progress: Callable[[int, int], None] | None = None,
    **question: Unpack[MapKeywords[ArrayLike | None]],
) -> ShakeMapAnswer:
    """Return the probability that blocks fail across a ShakeMap.

    Blocks without places of their own stand at every node, and the answer is their mean; those of
    a table with ``lon`` and ``lat`` are answered where they stand. The best model that the map's
    measures suffice for answers.

    Args:
        grid: file of a ShakeMap, version 3 or 4.
        numbers: p2 [1/s²] and kr of the blocks, if they are not given by name.
        blocks: instead of fields a table of blocks: a file, or columns by name, such as a pandas
            table.
        uncertainty: uncertainty.xml of the same map: the answer is integrated over it.
        component: horizontal component: larger, rotd100, rotd50, geometric_mean or single.
        allow_partial: read a grid that has not its declared size.
        draws: draws of shaking and blocks for the number of failures; None for 100, more where
            blocks are few.
        seed: of these draws.
        on_progress: called with (draws done, draws in all).
        question: fields of the blocks, each a number or of shape (m,), with ``kind``, and
            ``model``, ``level`` and ``db``, as :func:`rbfrag.predict` has them.

    Raises:
        InputError: a file that cannot be used, blocks given in no way or in two, none of them on
            the map, or a value that cannot be used.
        UnknownFieldError: a keyword that is none.
        UnknownModelError: no model of that name.
        DatabaseError: the database cannot be read.
    """
    inputs, answering = parts_of(numbers, question, BLOCKS, ANSWERING)
    rows = collect_blocks(inputs, blocks, reads=(*PLACE, "weight", "count"))
    meaning = component_named(component)
    shaken = read_shakemap(grid, uncertainty=uncertainty, allow_partial=allow_partial)
    has_coordinates = "lon" in rows.blocks
    if has_coordinates:
        measures, std_ln, on_map = at_places(shaken, rows.blocks["lon"], rows.blocks["lat"])
        is_complete = on_map & has_all_fields(measures, std_ln)
        rows = rows.without(
            ~is_complete,
            lambda i: (
                "the map has no number around the block"
                if on_map[i]
                else "the block lies off the map"
            ),
        )
        lon, lat = rows.blocks["lon"], rows.blocks["lat"]
    else:
        measures, std_ln, is_complete = shaken.measures, shaken.std_ln, shaken.is_complete
        if not is_complete.any():
            raise InputError(f"{grid}: no node has values in all required fields")
        lon, lat = shaken.lon[is_complete], shaken.lat[is_complete]
    measures, std_ln = (
        {name: values[is_complete] for name, values in fields.items()}
        for fields in (measures, std_ln)
    )
    table = rows.blocks
    warnings = [
        *rows.describe_invalid(FROM_SUMS if has_coordinates else FROM_MEAN),
        *shaken.warnings,
    ]
    warnings += doubts_about(measures)
    warnings.append(meaning.in_words("the map's measures are"))
    kind, read, medians = read_by_models(rows)
    warnings = [*medians, *warnings]
    weight, count = table.get("weight"), table.get("count")
    if count is not None and not has_coordinates:  # a mean over all blocks
        weight = count if weight is None else weight * count
    answer = site_probability(
        measures, component=meaning, weight=None if has_coordinates else weight,
        own_block=has_coordinates, std_ln=std_ln, kind=kind, **read, **answering,
    )  # fmt: skip
    shaking, chosen = answer.shaking, answer.shaking.model
    warnings += chosen.notes
    if "pgv_m_s" not in measures:
        names = " and ".join(name.partition("_")[0].upper() for name in shaking.names)
        text = f"the map has no PGV, the best predictor: a model of {names} is used"
        warnings.append(Diagnostic(text, "model_choice"))
    certain = [name for name in shaking.names if name not in shaking.integrated]
    if certain:
        text = (
            f"the map's uncertainty of {' and '.join(certain)} is not given: its values are "
            "assumed to be certain; uncertainty.xml has it"
        )
        warnings.append(Diagnostic(text, "shaking_certain"))
    if (
        count is not None and has_coordinates
    ):  # identical blocks of a row have azimuths of their own
        pairs = np.repeat(np.arange(answer.block.size), count[answer.block].astype(np.intp))
        answer = replace(
            answer,
            site=answer.site[pairs],
            block=answer.block[pairs],
            pair_probability=answer.pair_probability[pairs],
        )
    failures = map_failures(
        answer, read, lon, lat, site_names=table.get("site_id") if has_coordinates else None,
        weight=weight, draws=draws, seed=seed, on_progress=on_progress,
    )  # fmt: skip
    warnings += failures.warnings
    outside = int((~answer.in_domain & (answer.probability > NOTABLE)).sum())
    if outside:
        text = (
            f"at {outside} places with P > {NOTABLE:g} shaking or block lie outside the fitted "
            "ranges (in_domain)"
        )
        warnings.append(Diagnostic(text, "extrapolation"))

    columns: dict[str, NDArray[Any]] = {"block_id": table["block_id"]} if has_coordinates else {}
    columns |= {
        "lon": lon,
        "lat": lat,
        **{
            name: values
            for name, values in measures.items()
            if name in ("pgv_m_s", "pga_g", *shaking.names)
        },
        "probability": answer.probability,
        "ci_low": answer.ci_low,
        "ci_high": answer.ci_high,
        **dict.fromkeys(("event_low", "event_high"), np.full(lon.shape, np.nan)),
        "in_domain": answer.in_domain,
    }
    if has_coordinates:
        if count is not None:
            columns["count"] = count
        columns["warnings"] = codes_by_row(rows.remarks, rows.reasons.size)[table["row"]]
        columns["reason"] = np.full(lon.size, "", dtype=object)
        columns = rows.with_rejected(columns)
    size = table["kind"].size
    described = f"{size} blocks at their places" if has_coordinates else f"mean of {size} blocks"
    if size == 1 and not has_coordinates:
        block = {name: values[0] for name, values in numbers_in(table).items()}
        described = f"block with {describe.labelled_values(block, 6)}"
    event = shaken.event
    name = " ".join(part for part in (event["event"], event["time"][:10]) if part)
    if event["magnitude"] is not None:
        name += f", M {event['magnitude']:g}"
    return ShakeMapAnswer(
        columns=columns,
        failures=failures,
        about={
            **event,
            "how": by_model(chosen.name),
            "model": chosen.name,
            "term": chosen.term.name,
            "method": chosen.row.method,
            "level": answer.level,
            "measures": " ".join(shaking.names),
            "uncertainty_integrated": bool(shaking.integrated),
            **failures.as_dict(),
            "seed": seed,
        },
        warnings=tuple(warnings),
        title=f"{name}\n{described}; model "
        f"{describe.stored_model(chosen.row)}"
        + ("" if shaking.integrated else "\nthe uncertainty of the map's values is left out"),
        epicentre=shaken.epicentre,
        shape=(shaken.rows, shaken.columns)
        if shaken.is_whole and is_complete.all() and not has_coordinates
        else None,
    )
