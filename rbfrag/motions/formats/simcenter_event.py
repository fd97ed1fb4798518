"""SimCenter event JSON: ``Events`` with ``dT``, ``numSteps`` and ``timeSeries`` with ``data``.

A pattern links each series to a degree of freedom of the model: 1 is horizontal and 3 vertical;
2 is the second horizontal of a space model but the vertical of a plane one, which the file does
not tell. Nor does it tell the unit of acceleration.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterator
from typing import Any

import numpy as np

from rbfrag.motions.record_file import Count, ParsedTrace, RecordFile

FORMAT = "SimCenter event JSON"

_HEAD = re.compile(r'\s*\{(?s:.)*"Events"\s*:(?s:.)*"timeSeries"\s*:')
_CONSTANT = re.compile(r"\b(?:NaN|Infinity)\b")
_IS_VERTICAL = {1: False, 3: True}

recognises = _HEAD.match


def parse(file: RecordFile) -> Iterator[ParsedTrace]:
    """Yield the time series of all events in their order."""
    try:
        content = json.loads(file.text)
    except json.JSONDecodeError as error:
        raise file.error(f"not JSON: {error.msg}; export the event again", error.lineno) from None
    except (ValueError, RecursionError):
        raise file.error("not valid JSON: export the event again") from None
    file.require_units("files of this format have")
    index = 0
    for number, event in enumerate(_list(file, content, "Events", "the file")):
        label = f"event {number}"
        dof_of = {
            pattern.get("timeSeries"): pattern.get("dof")
            for pattern in _list(file, event, "pattern", label, required=False)
            if isinstance(pattern, dict) and isinstance(pattern.get("timeSeries"), str)
        }
        for series in _list(file, event, "timeSeries", label):
            # whose lines can be told: keys of a later event may stand anywhere
            first = number == 0
            yield _trace(file, event, series, f"time series {index}", dof_of, first=first)
            index += 1
    if not index:
        raise file.error("the file has no event with a time series")


def _trace(
    file: RecordFile,
    event: dict[str, Any],
    series: object,
    label: str,
    dof_of: dict[Any, Any],
    *,
    first: bool,
) -> ParsedTrace:
    if not isinstance(series, dict):
        raise file.error(f"{label} is not a JSON object")
    component = str(series.get("name", ""))
    label += f" ({component})"
    data = series.get("data")
    if not isinstance(data, list):
        raise file.error(f"{label} has no list 'data'")
    wrong = next((value for value in data if not _is_number(value)), None)
    if not all(map(_is_number, data)):
        constant = _CONSTANT.search(file.text)
        raise file.error(
            f"the data of {label} must be finite numbers, not {str(wrong)[:40]!r}: repair the "
            "value or export the event again",
            file.text.count("\n", 0, constant.start()) + 1 if constant else None,
        )
    line = _line(file, "numSteps") if first else None
    steps = event.get("numSteps", len(data))
    counted = isinstance(steps, int) and not isinstance(steps, bool) and steps > 0
    if not counted or (steps != len(data) and not file.allow_partial):
        raise file.error(
            f"numSteps is {str(steps)[:40]}, but {label} has {len(data)} values: the file is "
            "truncated or numSteps is wrong; export the event again, or use allow_partial",
            line,
            fields=("allow_partial",),
        )
    if not data:
        raise file.error(f"{label} has no values")
    line = _line(file, "dT") if first else None
    intervals = [owner["dT"] for owner in (series, event) if "dT" in owner]
    if not intervals or not all(map(_is_number, intervals)) or len(set(intervals)) > 1:
        raise file.error(
            f"{label} requires a single dT, in the series or its event, not {str(intervals)[:60]}",
            line,
        )
    dt = file.possible_dt(float(intervals[0]), line)
    name = str(event.get("name", ""))
    dof = dof_of.get(component)
    vertical = _IS_VERTICAL.get(dof) if isinstance(dof, int) else None
    return ParsedTrace(
        np.array(data, dtype=np.float64),
        dt,
        None,
        Count(steps, line or 1, label),
        component,
        event=name,
        recording=name or file.path.stem,
        labels={"orientation_deg": None, "is_vertical": vertical},
    )


def _is_number(value: object) -> bool:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    try:
        return math.isfinite(value)
    except OverflowError:
        return False


def _list(
    file: RecordFile, owner: object, key: str, where: str, *, required: bool = True
) -> list[Any]:
    value = owner.get(key, None if required else []) if isinstance(owner, dict) else None
    if not isinstance(value, list):
        raise file.error(f"{where} has no list {key!r}: export the event again")
    return value


def _line(file: RecordFile, key: str) -> int | None:
    """Line of a key's first mention."""
    at = file.text.find(f'"{key}"')
    return file.text.count("\n", 0, at) + 1 if at >= 0 else None
