"""Event sets and scenarios of the OpenQuake engine: five CSV files of one job, or its datastore."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Mapping, Sequence
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import InputError
from rbfrag.exchange.openquake_tables import SUFFIXES, Table, stored_table
from rbfrag.files import as_path
from rbfrag.hazards.curve import IntensityType, is_read, openquake_type, requested_measure
from rbfrag.hazards.event_set import Duration, EventSet, IntArray, event_weights
from rbfrag.results.diagnostic import Diagnostic
from rbfrag.solver.results import FloatArray

FILES = {
    "gmf_data": re.compile(r"gmf[-_]data.*\.csv"),
    "events": re.compile(r"events.*\.csv"),
    "sitemesh": re.compile(r"sitemesh.*\.csv"),
    "realizations": re.compile(r"realizations.*\.csv"),
    "ruptures": re.compile(r"ruptures.*\.csv"),
}
"""The files of a job by what they hold; of a scenario there is no file of ruptures."""

_EVENT = ("event_id", "eid")
_RUPTURE = ("rup_id", "rupid")
_REALIZATION = ("rlz_id", "rlzi")
_SITE_NAME = "custom_site_id"
_SITE_NUMBER = ("site_id", "sid")
_MEASURE = re.compile(r"gmv_(.+)")


JobFiles = Mapping[str, Path]
"""Paths of the files of one job by the names of :data:`FILES`; of a scenario without ruptures."""


def job_files(
    folder: str | os.PathLike[str] | None = None,
    named: Mapping[str, str | os.PathLike[str]] | None = None,
) -> JobFiles:
    """Return the files of a folder, or the files given by name.

    Args:
        folder: the folder, or in its place the datastore of the job, which holds everything.
        named: files that are named, by the names of :data:`FILES`; they go before the folder.

    Raises:
        InputError: a file is missing, or the folder has several that may be meant.
    """
    chosen = {name: Path(path) for name, path in (named or {}).items()}
    for name in chosen.keys() - FILES:
        raise InputError(f"files: {name!r} is not one of {', '.join(FILES)}")
    if folder is not None:
        place = as_path(folder, "folder", "the folder with the exports of one OpenQuake job")
        if is_store := place.suffix.lower() in SUFFIXES and not place.is_dir():
            chosen = {**dict.fromkeys(FILES, place), **chosen}
        elif not place.is_dir():
            raise InputError(
                f"{place} is not a folder: give the folder with the exports of one OpenQuake "
                "job, or its datastore calc_N.hdf5"
            )
        present = [] if is_store else sorted(path.name for path in place.iterdir())
        for content, pattern in FILES.items():
            if content in chosen:
                continue
            fits = [name for name in present if pattern.fullmatch(name)]
            if len(fits) > 1:
                raise InputError(
                    f"{place} has {' and '.join(fits[:3])}: keep the files of one job in a "
                    f"folder of their own, or give the file of {content.replace('_', '-')}"
                )
            if fits:
                chosen[content] = place / fits[0]
    if (gmf_data := chosen.get("gmf_data")) and gmf_data.suffix.lower() in SUFFIXES:
        chosen.setdefault("sitemesh", gmf_data)
    missing = [name for name in FILES if name not in chosen and name != "ruptures"]
    if missing:
        where = "" if folder is None else f" in {folder}"
        raise InputError(
            f"there is no file of {missing[0].replace('_', '-')}{where}: export it (oq export "
            "… -e csv), or give that file"
        )
    return {name: chosen[name] for name in FILES if name in chosen}


def read_events(
    files: JobFiles,
    *,
    imts: Sequence[str] = ("PGV",),
    investigation_time: float | None = None,
    ses: int | None = None,
) -> EventSet:
    """Return the events of one job, with the ground motion at its sites.

    Columns are read by name, the sites joined on their identifiers. PGV stands in cm/s in the
    files, PGA and spectral accelerations in g.

    Args:
        imts: intensity measures to read, as OpenQuake names them: PGV, PGA, SA(1.0).
        investigation_time: years of one event set, where no file of ruptures states it.
        ses: number of event sets of each realization, likewise.

    Raises:
        InputError: the files are of different jobs, a file lacks a column, a row cannot be used, or
            nothing states how long the events took; the message names the line.
    """
    heads = {
        name: table for name, path in files.items() if (table := _table(path, name)) is not None
    }
    gmf_data, mesh = heads["gmf_data"], heads["sitemesh"]
    for head in heads.values():
        for name in ("checksum", "start_date"):
            value, other = gmf_data.metadata.get(name), head.metadata.get(name)
            if value is not None and other is not None and value != other:
                raise InputError(
                    f"{head.top}: {name} is {other}, and that of {gmf_data.path.name} is {value}: "
                    "use files of one job"
                )
    sites, coordinates = _sites(mesh), None
    if {"lon", "lat"} <= {*mesh.names}:
        coordinates = np.column_stack([*mesh.read_all({"lon": float, "lat": float}).values()])
    weights, remarks = _weights(heads["realizations"])
    event_id, realization, year = _events(heads["events"], weights)
    duration = _duration(heads, year, investigation_time, ses)
    event, site, measures = _shaking(gmf_data, mesh, sites, event_id, imts)
    if duration is not None and year.size and int(year.max()) > duration.years * len(weights) + 0.5:
        text = (
            f"{files['events']}: year {int(year.max())} lies beyond the {duration.years:g} years "
            f"of each of {len(weights)} realizations: are investigation time and number of event "
            "sets those of this job?"
        )
        remarks.append(Diagnostic(text, "years_of_events"))
    return EventSet(
        event_id, realization, year, event_weights(realization, weights, duration),
        sites, event, site, measures, duration, weights, tuple(remarks), coordinates,
    )  # fmt: skip


def measures_in(files: JobFiles) -> tuple[str, ...]:
    """Return the OpenQuake names of the measures of a job that models use."""
    names = (_MEASURE.fullmatch(column) for column in _named(files["gmf_data"], "gmf_data").names)
    return tuple(name.group(1) for name in names if name and is_read(name.group(1)))


def read_magnitudes(files: JobFiles) -> FloatArray | None:
    """Return the magnitude of every event by event number; None without a file of ruptures.

    Raises:
        InputError: a column is missing, or an event is of a rupture that the file does not have.
    """
    if "ruptures" not in files:
        return None
    ruptures, events = (_named(files[name], name) for name in ("ruptures", "events"))
    ruptures.column(("mag",))
    rupture_columns = ruptures.read_all({str(ruptures.column(_RUPTURE)): int, "mag": float})
    number, magnitude = rupture_columns.values()
    event = str(events.column(_EVENT))
    columns = events.read_all({event: int, (of := str(events.column(_RUPTURE))): int})
    order = np.argsort(number, kind="stable")
    at = np.minimum(np.searchsorted(number[order], columns[of]), number.size - 1)
    absent = (
        np.full(columns[of].size, True) if not number.size else number[order][at] != columns[of]
    )
    if absent.any():
        row = int(np.flatnonzero(absent)[0])
        raise InputError(
            f"{events.line(row)}: the rupture {columns[of][row]} is not in {ruptures.path.name}, "
            "which has the magnitudes: are both from the same job?"
        )
    return np.asarray(magnitude[order][at][np.argsort(columns[event], kind="stable")])


def _named(path: Path, content: str) -> Table:
    table = _table(path, content)
    if table is None:
        raise InputError(f"{path} has no {content.replace('_', '-')}: give the file that has them")
    return table


def _table(path: Path, content: str) -> Table | None:
    return stored_table(path, content) if path.suffix.lower() in SUFFIXES else Table.of(path)


def _sites(head: Table) -> tuple[str, ...]:
    name = head.column((_SITE_NAME, *_SITE_NUMBER), needed=False)
    if name is None:  # numbered from 0 on
        head.column((_SITE_NAME, *_SITE_NUMBER, "lon"))
        return tuple(str(i) for i in range(head.read_all({"lon": float})["lon"].size))
    ids = head.read_all({name: str})[name].tolist()
    first: dict[str, int] = {}
    for row, text in enumerate(ids):
        if text in first:
            raise InputError(
                f"{head.line(row)}: the site {text!r} occurs twice: name the sites apart"
            )
        first[text] = row
    if not ids:
        raise InputError(f"{head.path}: there is no site in the file")
    return tuple(ids)


def _weights(head: Table) -> tuple[dict[int, float], list[str]]:
    name = str(head.column(_REALIZATION))
    head.column(("weight",))
    columns = head.read_all({name: int, "weight": float})
    numbers, values = columns[name].tolist(), columns["weight"]
    for row, (number, value) in enumerate(zip(numbers, values.tolist(), strict=True)):
        if not 0.0 <= value < np.inf:
            raise InputError(f"{head.line(row)}: the weight {value:g} is invalid: give 0 to 1")
        if numbers.index(number) != row:
            raise InputError(f"{head.line(row)}: {name} {number} occurs twice")
    total = float(values.sum())
    if not 0.0 < total < np.inf:
        raise InputError(f"{head.path}: the weights of the realizations sum to {total:g}")
    remarks: list[str] = []
    if abs(total - 1.0) > 1e-3:
        text = (
            f"{head.path}: the weights of the realizations sum to {total:.4g}; they are divided by "
            "that"
        )
        remarks.append(Diagnostic(text, "unscaled_weights"))
    return dict(zip(numbers, (values / total).tolist(), strict=True)), remarks


def _events(head: Table, weights: Mapping[int, float]) -> tuple[IntArray, IntArray, IntArray]:
    """Return number, realization and year of every event, in order of event number."""
    names = [str(head.column(choices)) for choices in (_EVENT, _REALIZATION, ("year",))]
    columns = head.read_all(dict.fromkeys(names, int))
    event_id, realization, year = (columns[name] for name in names)
    unknown = ~np.isin(realization, list(weights))
    if unknown.any():
        row = int(np.flatnonzero(unknown)[0])
        raise InputError(
            f"{head.line(row)}: the realization {realization[row]} is not in the file of "
            "realizations"
        )
    if event_id.size == 0:
        raise InputError(f"{head.path}: there is no event in the file")
    if event_id.min() < 0:
        row = int(np.argmin(event_id))
        raise InputError(f"{head.line(row)}: {names[0]} is {event_id[row]}: give 0 or more")
    order = np.argsort(event_id, kind="stable")
    again = order[1:][np.diff(event_id[order]) == 0]
    if again.size:
        row = int(again.min())
        raise InputError(f"{head.line(row)}: the event {event_id[row]} occurs twice")
    return event_id[order], realization[order], year[order]


def _duration(
    heads: Mapping[str, Table], year: IntArray, investigation_time: float | None, ses: int | None
) -> Duration | None:
    """Return the duration of a realization; None for a scenario, whose year is 0."""
    options = {"investigation_time": investigation_time, "ses_per_logic_tree_path": ses}
    settings = {name: float(value) for name, value in options.items() if value is not None}
    ruptures = heads.get("ruptures")
    if not year.any() and (ruptures is None or not options.keys() & ruptures.metadata.keys()):
        if settings:
            raise InputError(
                f"{heads['events'].path}: the events are those of a scenario (year 0), which has "
                "no rate: omit investigation_time and ses"
            )
        return None
    for name in options:
        text = None if ruptures is None else ruptures.metadata.get(name)
        if text is None or ruptures is None:
            continue
        try:
            value = float(text)
        except ValueError:
            raise InputError(f"{ruptures.top}: {name} = {text!r} is not a number") from None
        if not 0.0 < value < math.inf:
            raise InputError(f"{ruptures.top}: {name} = {text!r} is not above zero")
        if settings.setdefault(name, value) != value:
            raise InputError(
                f"{ruptures.top}: {name} is {value:g}, given is {settings[name]:g}: omit it"
            )
    missing = [name for name in options if name not in settings]
    if missing:
        where = (
            "there is no file of ruptures"
            if ruptures is None
            else f"{ruptures.top} does not state {' and '.join(missing)}"
        )
        raise InputError(
            f"{where}, which has the investigation time: give that file, or investigation_time "
            "and ses as in job.ini",
            fields=("investigation_time", "ses"),
        )
    sets = settings["ses_per_logic_tree_path"]
    if not math.isfinite(sets) or sets != int(sets):
        where = "" if ruptures is None or ses is not None else f"{ruptures.top}: "
        raise InputError(f"{where}ses_per_logic_tree_path = {sets:g} is not a whole number")
    return Duration(settings["investigation_time"], int(sets))


def _shaking(
    head: Table,
    mesh: Table,
    sites: tuple[str, ...],
    event_id: IntArray,
    imts: Sequence[str],
) -> tuple[IntArray, IntArray, dict[str, FloatArray]]:
    """Return event, site and measures of each row, sorted by event and site."""
    columns = _measure_columns(head, imts)
    event_name = str(head.column(_EVENT))
    site_name = str(head.column((_SITE_NAME, *_SITE_NUMBER)))
    # a number counts the sites from 0 on, unless the mesh names its sites by that very column
    by_name = site_name == _SITE_NAME or mesh.column((site_name,), needed=False) is not None
    index = {name if by_name else str(i): i for i, name in enumerate(sites)}
    parts: dict[str, list[NDArray[Any]]] = {name: [] for name in ("event", "site", *columns)}
    row = 0
    kinds = {event_name: int, site_name: str, **{c: float for c, _ in columns.values()}}
    with closing(head.read(kinds)) as read:
        for part in read:
            numbers, names = part[event_name], part[site_name]
            events = np.searchsorted(event_id, numbers)  # in order of event number
            absent = event_id[np.minimum(events, event_id.size - 1)] != numbers
            if absent.any():
                first = int(np.flatnonzero(absent)[0])
                raise InputError(
                    f"{head.line(row + first)}: the event {numbers[first]} is not in the file of "
                    "events: are both from the same job?"
                )
            at = np.fromiter((index.get(name, -1) for name in names.tolist()), np.int64, names.size)
            if (at < 0).any():
                first = int(np.flatnonzero(at < 0)[0])
                raise InputError(
                    f"{head.line(row + first)}: the site {names[first]!r} is not in "
                    f"{mesh.path.name}: are both from the same job?"
                )
            parts["event"].append(events)
            parts["site"].append(at)
            for measure, (column, factor) in columns.items():
                values = part[column]
                wrong = ~((values >= 0.0) & (values < np.inf))
                if wrong.any():
                    first = int(np.flatnonzero(wrong)[0])
                    raise InputError(
                        f"{head.line(row + first)}: {column} is {values[first]:g}: intensities "
                        "must be 0 or more"
                    )
                parts[measure].append(factor * values)
            row += part[event_name].size
    arrays = {
        name: np.concatenate(
            [np.empty(0, np.int64 if name in ("event", "site") else float), *chunks]
        )
        for name, chunks in parts.items()
    }
    event, site = arrays.pop("event"), arrays.pop("site")
    key = event * len(sites) + site
    order = np.argsort(key, kind="stable")
    again = order[1:][np.diff(key[order]) == 0]
    if again.size:
        line = int(again.min())
        raise InputError(
            f"{head.line(line)}: the event {event_id[event[line]]} has a second row for the site "
            f"{sites[site[line]]!r}: one row per event and site is required"
        )
    return event[order], site[order], {name: values[order] for name, values in arrays.items()}


def _measure_columns(head: Table, imts: Sequence[str]) -> dict[str, tuple[str, float]]:
    """Return the column and unit factor of each measure, by its name in `predict`."""
    present: dict[IntensityType, str] = {}
    for column in head.names:
        match = _MEASURE.fullmatch(column)
        if match is not None:
            try:
                present[openquake_type(match.group(1), column)] = column
            except InputError:
                continue  # another measure than those that models read
    chosen: dict[str, tuple[str, float]] = {}
    for imt in imts:
        name, kind = requested_measure(imt)
        if kind not in present:
            have = ", ".join(kind.imt for kind in present) or "none"
            raise InputError(
                f"{head.head}: there is no column gmv_{kind.imt}; the measures "
                f"are {have}: choose with imt",
                fields=("imt",),
            )
        chosen[name] = present[kind], kind.factor
    return chosen
