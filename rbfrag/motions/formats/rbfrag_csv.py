"""rbfrag's own CSV: labels as ``# key: JSON`` lines, then time and acceleration, bit for bit.

::

    # rbfrag accelerogram 1
    # station: "HVSC"
    # dt_s: 0.005
    # npts: 20000
    # samples_sha256: "6f1c…"
    time_s,acceleration_g
    0.0,-0.00012
    0.005,0.00031

A file may hold several motions, one block after the other. Every number is the shortest that
reads back as the same double.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Iterator, Mapping, Sequence
from datetime import datetime
from typing import Any

from rbfrag.errors import InputError
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.record_file import (
    Count,
    HeaderField,
    ParsedTrace,
    PrintedTimes,
    RecordFile,
)
from rbfrag.motions.text import FIRST_YEAR

FORMAT = "rbfrag CSV"

FIRST_LINE = "# rbfrag accelerogram 1"
COLUMNS = "time_s,acceleration_g"

TIME_ERROR = 1e-6
"""Printed times may be off by this part of an interval: the file may have been rewritten."""

_LABELS: Mapping[str, tuple[type, ...]] = {
    "station": (str,),
    "event": (str,),
    "component": (str,),
    "orientation_deg": (int, float),
    "is_vertical": (bool,),
    "recording": (str,),
    "is_corrected": (bool,),
    "is_partial": (bool,),
    "start_time": (str,),
    "processing_applied": (dict,),
    "source_sha256": (str,),
    "remarks": (list,),
}
"""The labels that are kept, and what their values are; null is left out."""

_KINDS: Mapping[str, tuple[type, ...]] = {
    **_LABELS,
    "dt_s": (int, float),
    "npts": (int,),
    "samples_sha256": (str,),
}

LARGEST_NUMBER = 1e12
"""No label is beyond it, and NaN is not below it."""


recognises = re.compile(FIRST_LINE).match


def parse(file: RecordFile) -> Iterator[ParsedTrace]:
    """Yield the motions of a file as they were written, bit for bit."""
    for span in file.blocks(re.compile(FIRST_LINE)):
        yield _motion(file, span)


def write(motions: Sequence[GroundMotion]) -> Iterator[str]:
    """Yield the lines of a file that :func:`read` reads back, without newlines."""
    for motion in motions:
        if motion.dt_s is None:
            raise InputError(f"{motion.label}: only equally spaced samples can be written")
        yield FIRST_LINE
        for name, value in _labels(motion).items():
            yield f"# {name}: {json.dumps(value, ensure_ascii=True)}"
        yield COLUMNS
        for time, value in zip(motion.time_s.tolist(), motion.acceleration_g.tolist(), strict=True):
            yield f"{time!r},{value!r}"


def _labels(motion: GroundMotion) -> dict[str, object]:
    labels: dict[str, object] = {name: getattr(motion, name) for name in _LABELS}
    labels["start_time"] = None if motion.start_time is None else motion.start_time.isoformat()
    labels["remarks"] = list(motion.remarks)
    present = {name: value for name, value in labels.items() if value not in (None, "", [])}
    return {**present, "dt_s": motion.dt_s, "npts": motion.npts, "samples_sha256": motion.sha256}


def _motion(file: RecordFile, span: range) -> ParsedTrace:
    first = next((at for at in span if file.lines[at].strip() == COLUMNS), None)
    if first is None:
        raise file.error(f"no line {COLUMNS!r} follows: export the motion again", span.start + 1)
    header = _header(file, range(span.start + 1, first))
    missing = [name for name in ("dt_s", "npts") if name not in header]
    if missing:
        raise file.error(f"the header has no {missing[0]!r}: export the motion again", first + 1)
    dt = file.possible_dt(header["dt_s"], first + 1)
    rows = [line.replace(",", " ", 1) for line in file.data(first + 1, span.stop)]
    times_s, samples = file.table(rows, first + 2, 2, "value").T
    sha256 = hashlib.sha256(samples.astype("<f8").tobytes()).hexdigest()
    if samples.size == header["npts"] and header.get("samples_sha256", sha256) != sha256:
        raise file.error(
            "the samples are not those that were written (their sha256 differs): export the "
            "motion again, or remove the line samples_sha256 if they were changed on purpose",
            first + 1,
        )
    labels: dict[str, Any] = {"recording": "", "orientation_deg": None, "is_vertical": None}
    labels |= {name: header[name] for name in _LABELS if name in header}
    return ParsedTrace(
        samples,
        dt,
        HeaderField("g", 1),
        Count(header["npts"], first + 1),
        component="",
        times=PrintedTimes(times_s, TIME_ERROR * dt, first + 2),
        remarks=tuple(map(str, labels.pop("remarks", ()))),
        is_partial=labels.pop("is_partial", False),
        labels=labels,
    )


def _header(file: RecordFile, span: range) -> dict[str, Any]:
    fields: dict[str, Any] = {}
    for at in span:
        name, colon, written = file.lines[at].removeprefix("#").partition(":")
        name = name.strip()
        if not colon or name not in _KINDS:
            continue
        try:
            value = json.loads(written)
        except (ValueError, RecursionError):
            value = None
        label = _valid_label(name, value)
        if label is None:
            raise file.error(
                f"{name} {written.strip()[:40]!r} cannot be used: export the motion again", at + 1
            )
        fields[name] = label
    return fields


def _valid_label(name: str, value: object) -> Any:
    """Return the value of a label, or None if it is invalid."""
    if not isinstance(value, _KINDS[name]) or isinstance(value, bool) is not (
        _KINDS[name] == (bool,)
    ):
        return None
    if isinstance(value, int | float) and not isinstance(value, bool):
        if not abs(value) < LARGEST_NUMBER or (name == "npts" and value < 1):
            return None
        return value if name == "npts" else float(value)
    if name == "start_time":
        return _time(str(value))
    return value


def _time(text: str) -> datetime | None:
    try:
        time = datetime.fromisoformat(text)
    except ValueError:
        return None
    # far enough from the first year for zeros before the first sample
    return None if time.tzinfo or time.year < FIRST_YEAR else time
