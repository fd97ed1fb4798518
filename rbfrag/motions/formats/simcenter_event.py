"""SimCenter event JSON: ``Events`` with ``dT``, ``numSteps`` and ``timeSeries`` with ``data``.

A pattern links each series to a degree of freedom of the model: 1 is horizontal and 3 vertical;
2 is the second horizontal of a space model but the vertical of a plane one, which the file does
not tell. Nor does it tell the unit of acceleration.
"""

from __future__ import annotations

import json
import math
import re
from pathlib import Path
from typing import Any

import numpy as np

from rbfrag.errors import MotionFileError
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.text.header import agreed_dt, other_count, stated_unit_in_g

FORMAT = "SimCenter event JSON"

_HEAD = re.compile(r'\s*\{(?s:.)*"Events"\s*:(?s:.)*"timeSeries"\s*:')
_CONSTANT = re.compile(r"\b(?:NaN|Infinity)\b")
_IS_VERTICAL = {1: False, 3: True}


def recognises(head: str) -> bool:
    """Return whether the first lines are JSON with events and time series."""
    return bool(_HEAD.match(head))


def read(
    path: Path, text: str, *, units: str | None, dt_s: float | None, allow_partial: bool = False
) -> list[GroundMotion]:
    """Return the time series of all events in their order.

    Args:
        path: for labels and messages.
        text: the file's text.
        units: unit of acceleration, which the file does not state.
        dt_s: sampling interval that the caller states [s]; refused when the file has another.
        allow_partial: True to read a file whose header states another number of samples than
            follow; the motion is then marked as partial.

    Raises:
        MotionFileError: no unit is stated, the JSON is damaged, or ``numSteps`` is not the
            number of values.
    """
    try:
        content = json.loads(text)
    except json.JSONDecodeError as error:
        raise MotionFileError(
            path, f"this is no JSON: {error.msg}; export the event again", line=error.lineno
        ) from None
    except (ValueError, RecursionError):
        raise MotionFileError(
            path, "this is no JSON that can be read: export the event again"
        ) from None
    factor = stated_unit_in_g(path, units)
    motions: list[GroundMotion] = []
    for number, event in enumerate(_list(path, content, "Events", "the file")):
        here = f"event {number}"
        patterns = {
            pattern.get("timeSeries"): pattern.get("dof")
            for pattern in _list(path, event, "pattern", here, required=False)
            if isinstance(pattern, dict) and isinstance(pattern.get("timeSeries"), str)
        }
        for series in _list(path, event, "timeSeries", here):
            motions.append(
                _trace(
                    path,
                    text,
                    event,
                    series,
                    number,
                    len(motions),
                    patterns,
                    factor,
                    dt_s,
                    allow_partial,
                )
            )
    if not motions:
        raise MotionFileError(path, "the file holds no event with a time series")
    return motions


def _trace(
    path: Path,
    text: str,
    event: dict[str, Any],
    series: object,
    number: int,
    index: int,
    patterns: dict[Any, Any],
    factor: float,
    dt_s: float | None,
    allow_partial: bool,
) -> GroundMotion:
    if not isinstance(series, dict):
        raise MotionFileError(path, f"time series {index} is no JSON object")
    component = str(series.get("name", ""))
    what = f"time series {index} ({component})"
    data = series.get("data")
    if not isinstance(data, list):
        raise MotionFileError(path, f"{what} has no list 'data'")
    wrong = next((value for value in data if not _is_number(value)), None)
    if not all(map(_is_number, data)):
        constant = _CONSTANT.search(text)
        raise MotionFileError(
            path,
            f"the data of {what} must be finite numbers, not {str(wrong)[:40]!r}: repair the "
            "value or export the event again",
            line=text.count("\n", 0, constant.start()) + 1 if constant else None,
        )
    line = _line(text, "numSteps", number)
    steps = event.get("numSteps", len(data))
    counted = isinstance(steps, int) and not isinstance(steps, bool) and steps > 0
    remarks: tuple[str, ...] = ()
    if counted and steps != len(data) and allow_partial:
        remarks = other_count(path, steps, len(data), line or 1, what, allow_partial=True)
    elif not counted or steps != len(data):
        raise MotionFileError(
            path,
            f"numSteps says {str(steps)[:40]}, but {what} has {len(data)} values: the file is "
            "truncated or numSteps is wrong; export the event again, or read what there is with "
            "--allow-partial",
            line=line,
        )
    if not data:
        raise MotionFileError(path, f"{what} has no values")
    intervals = [owner["dT"] for owner in (series, event) if "dT" in owner]
    if not intervals or not all(map(_is_number, intervals)) or len(set(intervals)) > 1:
        raise MotionFileError(
            path,
            f"{what} needs one dT, in the series or its event, not {str(intervals)[:60]}",
            line=_line(text, "dT", number),
        )
    dt = agreed_dt(path, float(intervals[0]), _line(text, "dT", number), dt_s)
    name = str(event.get("name", ""))
    dof = patterns.get(component)
    return GroundMotion(
        np.array(data, dtype=np.float64) * factor,
        dt,
        event=name,
        component=component,
        is_vertical=_IS_VERTICAL.get(dof) if isinstance(dof, int) else None,
        recording=name or path.stem,
        source_file=path.name,
        trace_index=index,
        file_format=FORMAT,
        remarks=remarks,
        is_partial=bool(remarks),
    )


def _is_number(value: object) -> bool:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    try:
        return math.isfinite(value)
    except OverflowError:
        return False


def _list(path: Path, owner: object, key: str, where: str, *, required: bool = True) -> list[Any]:
    found = owner.get(key, None if required else []) if isinstance(owner, dict) else None
    if not isinstance(found, list):
        raise MotionFileError(path, f"{where} has no list {key!r}: export the event again")
    return found


def _line(text: str, key: str, number: int) -> int | None:
    """Line of a key's first mention, when there is one event and no doubt about it."""
    at = text.find(f'"{key}"')
    return text.count("\n", 0, at) + 1 if number == 0 and at >= 0 else None
