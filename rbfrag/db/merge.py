"""Merge of two databases: `rbfrag db merge`."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from sqlalchemy import select

from rbfrag.db.check import check_database
from rbfrag.db.check_results import ROTATION_ERROR
from rbfrag.db.connect import database_label
from rbfrag.db.engine import opened_database
from rbfrag.db.insert import insert_row, keep_writers_out, update_rows
from rbfrag.db.keys import NOT_DIGESTED
from rbfrag.db.location import locate
from rbfrag.db.merge_rows import Merge, Row, Rule, merge_combinations, stored_rows
from rbfrag.db.model_file import ModelRow, encode_model
from rbfrag.db.models import model_rows
from rbfrag.db.motion_spectra import PEAKS_ERROR, renew_recording_spectra
from rbfrag.db.motions import (
    COMPUTED,
    UNKNOWN_EVENT,
    delete_orphans,
    same_measure,
)
from rbfrag.db.schema import (
    LATER_MEASURES,
    ORDINATES,
    SITE_COLUMNS,
    campaign,
    earthquake,
    fragility_model,
    motion,
    motion_spectrum,
    recording,
    recording_spectrum,
    response,
    shock_pair,
    suite,
    suite_motion,
    toppling_spectrum,
)
from rbfrag.db.shock_pairs import PARTS
from rbfrag.errors import DatabaseError, InputError, MergeConflictError
from rbfrag.results.numbers import count_of
from rbfrag.results.result import Result, TextLine, TextTable

_CONFLICTS_SHOWN = 5

# What is said of a motion, besides its samples and what follows from them.
_DATA_COLUMNS = (
    *NOT_DIGESTED,
    "recording_id",
    "dt_s",
    "npts",
    "samples_sha256",
    "samples",
    "added",
)
_LABELS = tuple(c.name for c in motion.c if c.name not in (*_DATA_COLUMNS, *COMPUTED))

_EARTHQUAKE = Rule(
    earthquake,
    (("event_id", "guessed"),),
    "{event_id}",
    {"magnitude": 0.0, "mechanism": 0.0, "depth_km": 0.0},
    ("name", "magnitude", "time", "mechanism", "depth_km"),
)
_SITE = ("network", *SITE_COLUMNS, "attributes")
_RECORDING = Rule(
    recording,
    (("earthquake_id", "name", "station"),),
    "{name}",
    dict.fromkeys(_SITE[:-1], 0.0),
    _SITE,
)
# the same samples of a file, processed alike, are one motion too (as for `motions add`)
_MOTION = Rule(
    motion,
    (("samples_sha256", "dt_s"), ("source_sha256", "processing_applied", "dt_s")),
    "{source_file}#{trace_index}",
    {"npts": 0.0},
    (*LATER_MEASURES, "samples"),
)
_OTHER_RULES = (
    Rule(suite, (("name",),)),
    Rule(suite_motion, (("suite_id", "motion_id"),)),
    Rule(
        campaign,
        (("started", "settings", "numerics_version", "rbfrag_version"),),
        filled=("finished",),
    ),
    Rule(
        motion_spectrum,
        (("motion_id",),),
        "of motion {motion_id}",
        dict.fromkeys(ORDINATES, 1e-9),
    ),
    Rule(
        recording_spectrum,
        (("motion_id", "other_motion_id", "percentile"),),
        "RotD{percentile} of motion {motion_id}",
        dict.fromkeys(("pga_g", "pgv_m_s", *ORDINATES), PEAKS_ERROR),
    ),
    Rule(
        toppling_spectrum,
        (("motion_id", "polarity", "p2", "numerics_version"),),
        "of motion {motion_id} at p2 {p2:g}, {polarity}",
        {"x_m_s": 1e-9},
    ),
    Rule(response, compared={"outcome": 0.0, "peak_theta_n": ROTATION_ERROR}),
    Rule(
        shock_pair,
        compared={
            f"{part}_{end}": ROTATION_ERROR
            for part in PARTS
            for end in ("outcome", "displacement_m", "rotation_rad", "peak_rad")
        },
    ),
)
"""Tables whose rows are taken over one by one, each behind those that it refers to."""


@dataclass(frozen=True, repr=False)
class MergeReport(Result):
    """Result of :func:`merge_databases`.

    Args:
        added: rows added by table.
        same: rows of the other that were here already, by table.
        restated: motions whose guessed earthquake became the stated one of the other.
        within_error: results that differ from those here by no more than the solver's error
            (made on another processor): those here stay.
        warnings: recordings and models that were stored under another name.
    """

    added: dict[str, int]
    same: dict[str, int]
    restated: int
    within_error: int
    warnings: tuple[str, ...]

    def sentences(self) -> Iterator[str]:
        """Yield the number of rows that were added, and of those that were stored before."""
        added, same = sum(self.added.values()), sum(self.same.values())
        yield f"{count_of(added, 'row')} added, {same:,} stored before"

    def lines(self) -> Iterator[TextLine]:
        """Yield motions with a new earthquake, and results that differ by numerical error."""
        if self.restated:
            motions = count_of(self.restated, "motion")
            yield TextLine("Changed", f"earthquakes of {motions}: given instead of guessed")
        if self.within_error:
            results = count_of(self.within_error, "result")
            yield TextLine("Kept", f"{results} that differ within the error of the solver")

    def tables(self, *, verbose: bool = False) -> Iterator[TextTable]:  # noqa: ARG002
        """Yield the number of rows by table."""
        names = sorted(self.added.keys() | self.same.keys())
        rows = [(name, self.added.get(name, 0), self.same.get(name, 0)) for name in names]
        yield TextTable(("table", "added", "stored before"), rows)

    def as_dict(self) -> dict[str, Any]:
        """Return the report under the keys of the JSON contract."""
        return {**asdict(self), "warnings": list(self.warnings)}


def merge_databases(
    other: str | os.PathLike[str], *, db: str | os.PathLike[str] | None = None
) -> MergeReport:
    """Add the contents of another database, in one transaction.

    Rows are the same when their natural keys are: samples and interval of a motion, id of an
    earthquake (guessed and stated apart), name of a suite, hash over all inputs of a
    combination. What is here stays; merging twice changes nothing. Where results or stated
    earthquakes of one key differ by more than rounding, nothing is written.

    Args:
        other: the database to read (path or URL); it is checked first and not changed.
        db: the database to add to (path, URL, or None for the default); made when there is none.

    Raises:
        InputError: both are the same database.
        MergeConflictError: the databases contradict each other; the message has both values.
        DatabaseError: one of them cannot be used, or the other is damaged.
    """
    locations = locate(other), locate(db)
    files = [place.resolve() for place in locations if isinstance(place, Path)]
    same_file = len(files) == 2 and (
        files[0] == files[1] or (all(map(Path.exists, files)) and files[0].samefile(files[1]))
    )
    if same_file or locations[0] == locations[1]:
        raise InputError("both are the same database: give another one to merge")
    with opened_database(other, read_only=True) as theirs, theirs.connect() as source:
        label = database_label(theirs.url)
        findings = check_database(source)
        if findings:
            first = findings[0]
            raise DatabaseError(
                f"{label} is damaged in {len(findings)} places and was not merged, first "
                f"{first.table} {first.row}: {first.problem}; run  rbfrag db check"
            )
        with opened_database(db, create=True) as ours, ours.begin() as target:
            keep_writers_out(target)
            merge = Merge(source, target)
            _merge_motions(merge)
            for rule in _OTHER_RULES:
                for row in merge.rows(rule.table):
                    merge.bring(rule, row)
            touched = {*merge.ids["motion"].values()}
            of_motions = target.execute(select(motion.c.id, motion.c.recording_id)).all()
            for recording_id in sorted(
                {place for number, place in of_motions if number in touched}
            ):
                renew_recording_spectra(target, recording_id)
            merge_combinations(merge)
            _merge_models(merge)
            conflicts = list(dict.fromkeys(merge.conflicts))
            if conflicts:
                shown = "; ".join(conflicts[:_CONFLICTS_SHOWN])
                more = len(conflicts) - _CONFLICTS_SHOWN
                raise MergeConflictError(
                    f"{database_label(ours.url)} (here) and {label} (there) contradict each other: "
                    f"{shown}{f'; and {more} more' if more > 0 else ''}. Nothing was written: "
                    "correct one of them"
                )
    return MergeReport(
        added={name: n for name, n in sorted(merge.added.items()) if n},
        same=dict(sorted(merge.same.items())),
        restated=merge.restated,
        within_error=merge.within_error,
        warnings=tuple(merge.warnings),
    )


def _merge_motions(merge: Merge) -> None:
    """Merge motions, each with its recording and earthquake; guesses are replaced."""
    recordings = {row["id"]: row for row in stored_rows(merge.source, recording)}
    events = {row["id"]: row for row in stored_rows(merge.source, earthquake)}
    vacated: set[int] = set()
    for row in stored_rows(merge.source, motion):
        place = recordings[row["recording_id"]]
        event = events[place["earthquake_id"]]
        ours = merge.find(_MOTION, row)
        if ours is None:
            merge.bring(_MOTION, {**row, "recording_id": _recording(merge, row, place, event)})
            continue
        theirs = {**row, "source_file": row["source_file"] or place["name"]}
        if ours["samples_sha256"] != row["samples_sha256"]:
            merge.other_bits = True
            theirs["samples"] = None
        merge.bring(_MOTION, theirs)
        peaks = ours["pgv_m_s"], ours["pgd_m"]
        for column in COMPUTED:
            our_value, there = ours[column], row[column]
            unknown = column in LATER_MEASURES and None in (our_value, there)
            if not (unknown or same_measure(column, our_value, there, *peaks)):
                merge.conflict(_MOTION, theirs, column, our_value, there)
        of_ours = select(earthquake).join(recording)
        of_ours = of_ours.where(recording.c.id == ours["recording_id"])
        our_event = merge.target.execute(of_ours).mappings().one()
        same_event = our_event["event_id"] == event["event_id"]
        if our_event["guessed"] and not event["guessed"]:
            values = {name: row[name] for name in _LABELS}
            values["recording_id"] = _recording(merge, row, place, event)
            update_rows(merge.target, motion, motion.c.id == ours["id"], values)
            vacated.add(ours["recording_id"])
            merge.restated += 1
        elif same_event and our_event["guessed"] == event["guessed"]:
            merge.bring(_EARTHQUAKE, event)
            our_place = select(recording).where(recording.c.id == ours["recording_id"])
            merge.compare(_RECORDING, merge.target.execute(our_place).mappings().one(), place)
        if our_event["guessed"] or event["guessed"]:
            continue
        if not same_event:
            both = our_event["event_id"], event["event_id"]
            merge.conflict(_MOTION, theirs, "event_id", *both)
        if ours["is_vertical"] != row["is_vertical"]:
            both = ours["is_vertical"], row["is_vertical"]
            merge.conflict(_MOTION, theirs, "is_vertical", *both)
    for recording_id in vacated:
        renew_recording_spectra(merge.target, recording_id)
        delete_orphans(merge.target, recording_id)


def _recording(merge: Merge, row: Row, place: Row, event: Row) -> int:
    """Return the id in the target of the recording of a merged motion."""
    if event["guessed"] and event["event_id"].startswith(UNKNOWN_EVENT):
        stranger = (
            select(motion.c.id)
            .select_from(motion.join(recording).join(earthquake))
            .where(
                earthquake.c.event_id == event["event_id"],
                earthquake.c.guessed,
                recording.c.name == place["name"],
                recording.c.station == place["station"],
                motion.c.source_file == row["source_file"],
                motion.c.trace_index == row["trace_index"],
            )
        )
        if merge.target.execute(stranger).first() is not None:
            # Files of one name in two folders are no companions: nothing says they are.
            name = row["samples_sha256"][:12]
            merge.warn_of_name(f"recording {place['name']!r} of unknown earthquakes", name)
            event = {**event, "id": -row["id"], "event_id": UNKNOWN_EVENT + name}
            place = {**place, "id": -row["id"], "name": name}
    earthquake_id = merge.bring(_EARTHQUAKE, event)
    return merge.bring(_RECORDING, {**place, "earthquake_id": earthquake_id})


def _merge_models(merge: Merge) -> None:
    """Merge models; of two different ones with the same name, the other's gets a number.

    A model "m" that differs from the "m" here is stored as "m-2", or the first number that is
    free. Chosen defaults stay; a database without models of a kind takes the other's choice.
    """
    ours = {row.name: row for row in model_rows(merge.target)}
    kinds = {row.kind for row in ours.values()}
    is_chosen = select(fragility_model.c.name).where(fragility_model.c.is_default)
    chosen = set(merge.source.scalars(is_chosen))
    for theirs in model_rows(merge.source):
        name, number = theirs.name, 1
        while name in ours and _content(ours[name]) != _content(theirs):
            number += 1
            name = f"{theirs.name}-{number}"
        if name in ours:
            merge.same["fragility_model"] += 1
            continue
        is_default = theirs.name in chosen and theirs.kind not in kinds
        ours[name] = replace(theirs, name=name, is_default=is_default)
        insert_row(merge.target, fragility_model, encode_model(ours[name]))
        merge.added["fragility_model"] += 1
        if name != theirs.name:
            merge.warn_of_name(f"model {theirs.name!r}", name)


def _content(row: ModelRow) -> dict[str, Any]:
    """Return the content of a model without its name and time of fit."""
    return encode_model(replace(row, name="-", is_default=False, created=""))
