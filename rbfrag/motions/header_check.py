"""Consistency of header and samples, whatever the format.

Mistakes of interval, unit and scale are factors of 2 and more. Honest headers are off by a few
percent, where a record was cut or filtered again after its header was written.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TypeAlias

import numpy as np

from rbfrag.errors import InputError, MotionFileError
from rbfrag.motions.record_file import (
    SAME_DT,
    HeaderField,
    ParsedTrace,
    RecordFile,
    number_or_none,
)
from rbfrag.motions.text import last_digit, shown
from rbfrag.motions.units import stated_in_g, unit_in_g

DURATION_REJECTED, DURATION_NOTED = 0.05, 0.01
"""How far durations may differ, as part of the longer one, beyond their last printed digit."""

PEAK_REJECTED, PEAK_NOTED = 1.8, 1.05
"""Factor between peaks."""

FEWEST_COMPARED = 100
"""Fewer samples may be equal by chance."""

DOUBT = "header and samples: "
"""How a remark begins that says where the two disagree."""

Traces = Sequence[ParsedTrace]

Statement: TypeAlias = tuple[float, str, int | None]
"""How far, as a part, an interval is off what is said of time; a sentence, and its line."""


def agreed(file: RecordFile, traces: Traces, components: int | None) -> list[ParsedTrace]:
    """Return traces in g with the valid interval, or reject contradictory files.

    What the caller states is believed where the header says it too, and where the header
    contradicts itself and the rest of it agrees with the caller.

    Args:
        components: how many a file of the format always holds; None where the number differs.
    """
    few = ""
    if components is not None and len(traces) < components:
        few = f"{DOUBT}the file holds {len(traces)} of the {components} components"
    return [_agreed(file, trace, traces, few or _copied(trace, traces)) for trace in traces]


def _copied(trace: ParsedTrace, traces: Traces) -> str:
    # at rest all components are equal
    compared = trace.values.size >= FEWEST_COMPARED and trace.values.any()
    for other in traces if compared else ():
        if other is not trace and np.array_equal(other.values, trace.values):
            return f"{DOUBT}{trace.component} equals {other.component} in every sample: a copy"
    return ""


def _agreed(file: RecordFile, trace: ParsedTrace, traces: Traces, doubt: str) -> ParsedTrace:
    dt, on_dt = _interval(file, trace, traces)
    missing = file.missing_samples(trace.count.at(dt), trace.values.size) if trace.count else ""
    if trace.times:
        file.reject_other_times(trace.times, dt, trace.values.size)
    is_partial = trace.is_partial or bool(missing)
    # where samples are missing, the largest may be among them
    in_g, unit, on_unit = _unit(file, replace(trace, peak=None) if is_partial else trace)
    further = (doubt, *on_dt, *on_unit, missing, trace.remark_if_partial if is_partial else "")
    return replace(
        trace,
        dt_s=dt,
        unit=unit,
        scale=trace.scale * in_g,
        is_partial=is_partial,
        remarks=(*trace.remarks, *filter(None, further)),
    )


def doubts(remarks: Sequence[str]) -> list[str]:
    """Return the remarks of a motion on contradictions between header and samples."""
    return [remark for remark in remarks if remark.startswith(DOUBT)]


def _interval(
    file: RecordFile, trace: ParsedTrace, traces: Traces
) -> tuple[float, tuple[str, ...]]:
    """Return the valid interval [s] and remarks, or reject the header's or the caller's."""
    dt, requested = trace.dt_s, file.dt_s
    if requested is not None and not math.isclose(dt, requested, rel_tol=SAME_DT, abs_tol=0.0):
        by_header, by_caller = (_agreeing(file, trace, traces, value) for value in (dt, requested))
        if all(by_header) or not any(by_caller):
            trouble = f"the header says dt = {dt:g} s, not {requested:g}: omit dt_s"
            raise file.error(trouble, fields=("dt_s",))
        return requested, (
            f"{DOUBT}the header says dt = {dt:g} s; {requested:g} s is what was stated",
        )
    statements = _statements(trace, traces, dt)
    for off, text, line in statements:
        if off > DURATION_REJECTED and requested is None:
            advice = "give the correct interval with dt_s, or correct the header"
            raise file.error(f"{text}: {advice}", line, fields=("dt_s",))
    return dt, tuple(f"{DOUBT}{text}" for off, text, _ in statements if off > DURATION_NOTED)


def _agreeing(file: RecordFile, trace: ParsedTrace, traces: Traces, dt: float) -> list[bool]:
    """Return whether each entry on time agrees with an interval [s], printed times included."""
    agreeing = [off <= DURATION_REJECTED for off, *_ in _statements(trace, traces, dt)]
    seconds = trace.count.seconds if trace.count else None
    if trace.times is None and seconds is None:
        return agreeing
    try:
        if trace.count:
            complete = replace(file, allow_partial=False)
            complete.missing_samples(trace.count.at(dt), trace.values.size)
        if trace.times:
            file.reject_other_times(trace.times, dt, trace.values.size)
    except MotionFileError:
        return [*agreeing, False]
    return [*agreeing, True]


def _statements(trace: ParsedTrace, traces: Traces, dt: float) -> list[Statement]:
    """Return the header's entries on time: durations, and the intervals of the other components."""
    statements: list[Statement] = []
    counts = {trace.count.number if trace.count else trace.values.size, trace.values.size}
    # some count the samples and some the intervals between them
    possible = [(npts - offset) * dt for npts in counts for offset in (0, 1)]
    for field in trace.durations:
        seconds = number_or_none(field.text) if field else None
        if field and field.text and seconds is None:
            text = f"the header's duration {shown(field.text)} is not a number"
            statements.append((DURATION_REJECTED, text, field.line))
        if field is None or seconds is None:
            continue
        apart = min(abs(lasting - seconds) for lasting in possible) - last_digit(field.text)
        off = apart / max(*possible, seconds) if apart > 0.0 else 0.0
        text = f"{max(counts):.12g} samples at dt = {dt:g} s last {max(possible):g} s"
        statements.append((off, f"{text}, but the header says {field.text} s", field.line))
    # printed times prove each component's own
    if not any(other.times for other in traces):
        names = (trace.recording, trace.station, trace.event)
        for other in traces:
            if (other.recording, other.station, other.event) == names and other is not trace:
                off = abs(dt - other.dt_s) / max(dt, other.dt_s)
                text = f"the component {trace.component} has dt = {dt:g} s"
                statements.append((off, f"{text}, but {other.component} {other.dt_s:g} s", None))
    return statements


def _unit(
    file: RecordFile, trace: ParsedTrace
) -> tuple[float, HeaderField | None, tuple[str, ...]]:
    """Return the valid unit in g, its name, and remarks on the peak."""
    if trace.unit is None:
        file.require_units()
    field = trace.unit or HeaderField(file.units or "", 1)
    try:
        in_g = stated_in_g(field.text)
    except InputError as error:
        raise file.error(str(error), field.line) from None
    off, text = _peak(trace, in_g, field.text)
    if file.units is not None and unit_in_g(file.units) != in_g:
        other = unit_in_g(file.units)
        if off < PEAK_REJECTED or _peak(trace, other, file.units)[0] >= PEAK_REJECTED:
            trouble = f"the header says {field.text}, not {file.units}: omit units"
            raise file.error(trouble, field.line, fields=("units",))
        remark = f"{DOUBT}the header says {field.text}; {file.units} is what was stated"
        return other, field._replace(text=file.units), (remark,)
    if off >= PEAK_REJECTED and file.units is None and trace.peak:
        advice = "state the right unit of the samples with units, or correct the header"
        raise file.error(f"{text}: {advice}", trace.peak.line, fields=("units",))
    return in_g, trace.unit, (DOUBT + text,) if off > PEAK_NOTED else ()


def _peak(trace: ParsedTrace, in_g: float, unit: str) -> tuple[float, str]:
    """Return the ratio between the largest sample and the header's peak, and a sentence."""
    peak, samples = trace.peak, trace.values
    stated_peak = number_or_none(peak.text) if peak else None
    # zero and -999 are what programs write that do not know it
    if peak is None or stated_peak in {None, 0.0, -999.0} or not samples.size:
        return 1.0, ""
    try:
        factor = trace.scale * in_g / stated_in_g(peak.unit)
    except InputError:
        return 1.0, ""
    with np.errstate(over="ignore", invalid="ignore"):
        largest = [float(np.abs(samples).max()) * factor]
        if trace.is_corrected is False:
            # before or after the instrument's offset was taken off: headers do either
            largest.append(float(np.abs(samples - samples.mean()).max()) * factor)
    text = (
        f"the largest sample, read in {unit}, is {largest[0]:g} {peak.unit}, but the header says "
        f"{peak.text} {peak.unit}"
    )
    off = math.inf
    for sample in largest:
        low, high = sorted((sample, abs(stated_peak)))
        # what the header's last digit cannot show is no difference
        if not high - low > last_digit(peak.text):
            return 1.0, text
        off = min(off, high / low if low > 0.0 else math.inf)
    return off, text
