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

import json
from collections.abc import Iterator, Mapping, Sequence
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np

from rbfrag.errors import InputError, MotionFileError
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.text.clock import FIRST_YEAR
from rbfrag.motions.text.file import table_numbers, without_blank_end
from rbfrag.motions.text.header import Field, agreed_dt, agreed_unit_in_g, other_count

FORMAT = "rbfrag CSV"

FIRST_LINE = "# rbfrag accelerogram 1"
COLUMNS = "time_s,acceleration_g"

TIME_SHARE = 1e-6
"""Printed times may be off by this share of an interval: the file may have been rewritten."""

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


def recognises(head: str) -> bool:
    """Return whether the first line is that of rbfrag's own CSV."""
    return head.startswith(FIRST_LINE)


def read(
    path: Path, text: str, *, units: str | None, dt_s: float | None, allow_partial: bool = False
) -> list[GroundMotion]:
    """Return the motions of a file as they were written, bit for bit.

    Args:
        path: for labels and messages.
        text: the file's text.
        units: unit that the caller states; refused unless it is g.
        dt_s: sampling interval that the caller states [s]; refused when the file has another.
        allow_partial: True to read a file whose header states another number of samples than
            follow; the motion is then marked as partial.

    Raises:
        MotionFileError: a header or value that cannot be used, with its line, or samples that
            are not those that were written.
    """
    agreed_unit_in_g(path, Field("g", 1), units)
    lines = text.split("\n")
    starts = [at for at, line in enumerate(lines) if line.startswith(FIRST_LINE)]
    return [
        _motion(path, lines, range(start, end), index, dt_s, allow_partial)
        for index, (start, end) in enumerate(zip(starts, [*starts[1:], len(lines)], strict=True))
    ]


def write(motions: Sequence[GroundMotion]) -> Iterator[str]:
    """Yield the lines of a file that :func:`read` reads back, without newlines.

    Args:
        motions: equally spaced motions.

    Raises:
        InputError: a motion from nodes.
    """
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
    found: dict[str, object] = {name: getattr(motion, name) for name in _LABELS}
    found["start_time"] = None if motion.start_time is None else motion.start_time.isoformat()
    found["remarks"] = list(motion.remarks)
    kept = {name: value for name, value in found.items() if value not in (None, "", [])}
    return {
        **kept,
        "dt_s": motion.dt_s,
        "npts": motion.npts,
        "samples_sha256": motion.sha256,
    }


def _motion(
    path: Path, lines: list[str], span: range, index: int, dt_s: float | None, allow_partial: bool
) -> GroundMotion:
    first = next((at for at in span if lines[at].strip() == COLUMNS), None)
    if first is None:
        raise MotionFileError(
            path, f"no line {COLUMNS!r} follows: export the motion again", line=span.start + 1
        )
    found = _header(path, lines, range(span.start + 1, first))
    missing = [name for name in ("dt_s", "npts") if name not in found]
    if missing:
        raise MotionFileError(
            path, f"the header has no {missing[0]!r}: export the motion again", line=first + 1
        )
    dt = agreed_dt(path, found["dt_s"], first + 1, dt_s)
    rows = [line.replace(",", " ", 1) for line in without_blank_end(lines[first + 1 : span.stop])]
    table = table_numbers(path, rows, first + 2, 2, "value")
    times, samples = table[:, 0], table[:, 1]
    remarks = other_count(path, found["npts"], samples.size, first + 1, allow_partial=allow_partial)
    with np.errstate(over="ignore"):
        late = np.flatnonzero(~(np.abs(times - dt * np.arange(times.size)) <= TIME_SHARE * dt))
    if late.size:
        at = int(late[0])
        raise MotionFileError(
            path,
            f"time {times[at]:g} s is not {at} intervals of {dt:g} s: repair the line or export "
            "the motion again",
            line=first + 2 + at,
        )
    labels = {name: found[name] for name in _LABELS if name in found}
    labels["remarks"] = (*map(str, found.get("remarks", ())), *remarks)
    motion = GroundMotion(
        samples,
        dt,
        source_file=path.name,
        trace_index=index,
        file_format=FORMAT,
        **{**labels, "is_partial": bool(labels.get("is_partial") or remarks)},
    )
    if not remarks and found.get("samples_sha256", motion.sha256) != motion.sha256:
        raise MotionFileError(
            path,
            "the samples are not those that were written (their sha256 differs): export the "
            "motion again, or remove the line samples_sha256 if they were changed on purpose",
            line=first + 1,
        )
    return motion


def _header(path: Path, lines: list[str], span: range) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for at in span:
        name, colon, written = lines[at].removeprefix("#").partition(":")
        name = name.strip()
        if not colon or name not in _KINDS:
            continue
        try:
            value = json.loads(written)
        except (ValueError, RecursionError):
            value = None
        usable = _usable(name, value)
        if usable is None:
            raise MotionFileError(
                path,
                f"{name} {written.strip()[:40]!r} cannot be used: export the motion again",
                line=at + 1,
            )
        found[name] = usable
    return found


def _usable(name: str, value: object) -> Any:
    """The value of a label, or None where it is none."""
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
        found = datetime.fromisoformat(text)
    except ValueError:
        return None
    # far enough from the first year for zeros before the first sample
    return None if found.tzinfo or found.year < FIRST_YEAR else found
