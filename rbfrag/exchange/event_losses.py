"""Failures and losses of a table of blocks under the event set of an OpenQuake job: `losses`."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from os import PathLike
from typing import TypedDict, Unpack

import numpy as np
from numpy.typing import ArrayLike

from rbfrag.errors import InputError, UnknownModelError
from rbfrag.exchange.block_rows import PLACE, PORTFOLIO, BlockRows, Blocks, collect_blocks
from rbfrag.exchange.nearest_site import WITHIN_KM, join_sites
from rbfrag.exchange.openquake_events import (
    JobFiles,
    job_files,
    measures_in,
    read_events,
    read_magnitudes,
)
from rbfrag.fragility.model import FragilityModel
from rbfrag.fragility.validation import FROM_SUMS
from rbfrag.hazards.curve import requested_measure
from rbfrag.hazards.event_set import EventSet
from rbfrag.hazards.loss_answer import LossAnswer
from rbfrag.hazards.losses import Run, event_losses
from rbfrag.hazards.portfolio import Portfolio
from rbfrag.hazards.shaking import (
    LAW_TAU,
    PGA_ALONE,
    TAU,
    by_preference,
    component_of_velocity,
    velocity_of,
)
from rbfrag.question.components import Component, component_named
from rbfrag.question.fields import AnsweringFields, BlockKeywords, V
from rbfrag.question.keywords import LEVEL, model_for, parts_of
from rbfrag.question.shaking import doubts_about
from rbfrag.results.diagnostic import Diagnostic
from rbfrag.solver.kinds import facts_of
from rbfrag.vocabulary.quantities import ANSWERING, BLOCKS


class _Lasted(TypedDict, total=False):
    """Keywords of the duration of the event set, where no file of ruptures specifies it."""

    investigation_time: float | None
    ses: int | None


class LossKeywords(BlockKeywords[V], AnsweringFields, _Lasted, total=False):
    """Keywords of blocks and models for losses under an event set."""


def losses(
    folder: str | PathLike[str] | None = None,
    blocks: Blocks | None = None,
    *,
    files: Mapping[str, str | PathLike[str]] | None = None,
    samples: int = 100,
    expected: bool = False,
    seed: int = 0,
    imt: Sequence[str] | None = None,
    component: str | None = None,
    within_km: float = WITHIN_KM,
    run: Run | None = None,
    on_progress: Callable[[int, int], None] | None = None,
    **question: Unpack[LossKeywords[ArrayLike | None]],
) -> LossAnswer:
    """Return expected failures per year and losses under an event set of the OpenQuake engine.

    Each event counts weight(realization)/(investigation time × number of event sets) a year. What
    several blocks of one event do together is sampled by the copula that is stored with the model
    (:func:`rbfrag.hazards.losses.event_losses`). A scenario has no rate: its answer is what is
    expected and probable given the event.

    A block that cannot be used, as one of a site that the events do not have, has no rate but its
    reason, and is left out of all sums.

    Args:
        folder: folder with the exports of one job (gmf-data, events, sitemesh, realizations and
            ruptures CSV), its datastore calc_N.hdf5 (extra ``hdf5``), or None where `files` names
            them.
        blocks: table of blocks (.csv, .xlsx, .parquet), or its columns: fields of blocks with
            ``site_id`` (text), or ``lon`` and ``lat`` [deg], and, if there are, ``block_id``,
            ``kind``, ``count`` (like blocks, each with an azimuth of its own), ``weight`` (what a
            failure counts, and its loss with it), ``loss`` (in the median) and ``loss_sigma``
            (standard deviation of its logarithm).
        files: files by what they hold: gmf_data, events, sitemesh, realizations, ruptures.
        samples: samples of each event.
        expected: do without samples; then there are no curves of exceedance.
        seed: of the samples; the answer does not depend on the number of workers.
        imt: intensity measures that the models read, as OpenQuake names them; None for the first
            of PGV, SA(1.0) and other SA that the job has. Of PGA alone PGV is taken by the
            magnitudes of the ruptures, unless `model` is named. Several measures, of which `model`
            names the model, are drawn independently by the engine, which a warning tells of.
        component: horizontal component of the measures: single, geometric_mean, rotd50, rotd100 or
            larger; None for rotd50, with a note. Its dispersion is common to the blocks of one
            site and event.
        within_km: farthest distance from a block to its site [km], where they are joined by place.
        run: does the parts of the work; None for this process.
        on_progress: called with the numbers of events done and of all.
        question: instead of a table the fields of blocks at the one site, with ``kind``, as
            :func:`rbfrag.predict` has them, with a table the kind of rows without one;
            ``model``, ``level`` and ``db``, likewise; ``investigation_time``: years of one event
            set, where no file of ruptures states it; ``ses``: number of event sets of each
            realization, likewise.

    Raises:
        InputError: a file that cannot be used, files of different jobs, an event that is unknown,
            a row that occurs twice, or no block that can be used; the message names the line.
        UnknownFieldError: a keyword that is none.
        UnknownModelError: no model of that name.
        DatabaseError: the database cannot be read.
    """
    inputs, answering, lasted = parts_of((), question, BLOCKS, ANSWERING, _Lasted.__optional_keys__)
    rows = collect_blocks(inputs, blocks, reads=(*PLACE, *PORTFOLIO), one_kind=False)
    job = job_files(folder, files)
    meaning = component_named("rotd50" if component is None else component)
    if not imt:  # the best predictor among the measures of the job
        present = {requested_measure(name)[0]: name for name in measures_in(job)}
        imt = (next((present[name] for name in by_preference(present)), "PGV"),)
    events = read_events(job, imts=imt, **lasted)
    events, meaning, tau, remark = _by_one_measure(events, job, meaning, answering)
    # the sites of the blocks, without blocks that have no site
    place = rows.blocks, events.site_ids, events.coordinates
    join = join_sites(*place, within_km=within_km, of="event")
    ids = rows.columns.get("site_id", np.full(rows.reasons.size, "", dtype=object)).copy()
    at_one = join.site >= 0
    names = np.array(events.site_ids, dtype=object)
    ids[rows.blocks["row"][at_one]] = names[join.site[at_one]]
    columns, remarks = {**rows.columns, "site_id": ids}, (*rows.remarks, *join.remarks)
    rows = replace(rows, columns=columns, remarks=remarks)
    rows = rows.without(~at_one, join.reasons.__getitem__)
    rows, models = _with_models(rows, tuple(events.measures), answering)
    portfolio = Portfolio.of(rows.blocks, events.site_ids, models, meaning)
    about = (
        Diagnostic(
            "the measures are assumed to be RotD50, as most ground-motion models predict; "
            "component specifies another one",
            "rotd50_component",
            fields=("component",),
        )
        if component is None
        else meaning.in_words("the measures are")
    )
    empty = int(np.isnan(rows.blocks.get("loss", np.empty(0))).sum())
    without_loss = (
        f"{empty:,} of {rows.blocks['row'].size:,} blocks have no loss and count as 0: losses are "
        "lower bounds"
    )
    texts = (
        *rows.describe_invalid(FROM_SUMS),
        *([without_loss] if empty else []),
        *events.warnings,
        *doubts_about(events.measures),
        *remark,
        about,
    )
    answer = event_losses(
        replace(events, warnings=texts), portfolio, samples=0 if expected else samples, seed=seed,
        level=answering.get("level", LEVEL), run=run, on_progress=on_progress,
    )  # fmt: skip
    if "loss" in rows.blocks:
        answer.block_rates[2, np.isnan(rows.blocks["loss"])] = np.nan
    return replace(answer, rejected=rows.rejected_by_row(), tau=tau)


def _by_one_measure(
    events: EventSet, job: JobFiles, meaning: Component, answering: AnsweringFields
) -> tuple[EventSet, Component, float | None, tuple[str, ...]]:
    """Return the events with the measure of the model, its component, tau, and the warnings."""
    name, *more = events.measures
    if more and answering.get("model") is None:
        raise InputError(
            "several intensity measures require models by name: a single measure is better, PGV "
            "before SA",
            fields=("imt", "model"),
        )
    if more or name != "pga_g":
        return events, meaning, None if more else TAU.get(name), ()
    if answering.get("model") is not None or events.is_scenario:
        return events, meaning, None, (PGA_ALONE,)
    magnitudes = read_magnitudes(job)
    if magnitudes is None:
        raise InputError(
            f"{PGA_ALONE}; give PGV or SA, the ruptures file with magnitudes, or a model of PGA",
            fields=("imt", "model"),
        )
    velocity = velocity_of(events.measures[name], magnitudes[events.event])
    remark = Diagnostic(
        "PGV is predicted from PGA and the magnitudes of the ruptures; ground motions of PGV are "
        "better",
        "pgv_from_pga",
    )
    by_velocity = replace(events, measures={"pgv_m_s": velocity})
    return by_velocity, component_of_velocity(meaning), LAW_TAU, (remark,)


def _with_models(
    rows: BlockRows, measures: Sequence[str], answering: AnsweringFields
) -> tuple[BlockRows, dict[str, FragilityModel]]:
    """Return the table without blocks of kinds that lack a model, and the models."""
    kinds, without, models = rows.blocks["kind"], {}, {}
    for kind in dict.fromkeys(kinds.tolist()):
        try:
            models[kind] = model_for(answering, (*facts_of(kind).parameters, *measures), kind)
        except (InputError, UnknownModelError) as error:
            without[kind] = error
    if not models:
        raise without[kinds[0]]
    return rows.without(np.isin(kinds, [*without]), lambda i: str(without[kinds[i]])), models
