"""miniSEED 2 and 3: counts in binary records of one channel each, which pymseed unpacks.

Neither unit nor gain is in the file: a StationXML file in the same folder gives the gain as the
sensitivity of the channel [counts/(m/s²)]. Times of successive records prove the interval.
Channels of other quantities, and those that the caller does not name, are skipped.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import replace
from fnmatch import fnmatchcase
from typing import Any

import numpy as np

from rbfrag.errors import MissingExtraError, UnitNotStatedError
from rbfrag.motions.record_file import HeaderField, ParsedTrace, RecordFile
from rbfrag.motions.station_xml import sensitivities

FORMAT = "miniSEED"

MOST_SAMPLES = 20_000_000
"""Of all channels: a header may state more samples than any memory holds."""

ACCELEROMETERS = "NLG"
"""Instrument codes; L and G are those of older networks."""

# sequence number, quality, station, ..., hour and minute, or the mark of version 3
_HEAD = re.compile(r"MS\x03|[\d \0]{6}[DRQM][ \0][\w \0]{12}(?s:.{4})[\0-\x17][\0-\x3b]", re.ASCII)
_SOURCE = re.compile(r"FDSN:(\w*)_(\w*)_(\w*)_(\w)_(\w)_(\w)", re.ASCII)

recognises = _HEAD.match


def parse(file: RecordFile) -> Iterator[ParsedTrace]:
    """Yield the channels of a file, each in one segment; a character of the text is a byte."""
    try:
        import pymseed
    except ImportError:
        raise MissingExtraError("miniSEED requires pymseed", "mseed") from None
    raw, remark = _whole_records(file, pymseed, file.text.encode("latin-1"))
    try:
        traces = pymseed.MS3TraceList.from_buffer(raw, unpack_data=True)
    except pymseed.MiniSEEDError as error:
        raise _damaged(file, error) from None
    # libmseed only warns where the last sample is not the one that its record states
    warnings = pymseed.get_error_messages()
    if any("integrity" in item for item in warnings):
        raise _damaged(file, warnings[0])
    channels = [(_codes(file, item.sourceid), list(item)) for item in traces]
    if not channels:
        raise file.error("the file has no samples: request the record again")
    present = [".".join(codes[2:]).removeprefix(".") for codes, _ in channels]
    if file.channel is not None:
        patterns = [word.strip().upper() for word in file.channel.split(",")]
        channels = [
            (codes, segments) for codes, segments in channels
            if any(fnmatchcase(name, pattern) for pattern in patterns
                   for name in (codes[3], ".".join(codes[2:])))
        ]  # fmt: skip
        if not channels:
            raise file.error(
                f"no channel {file.channel}: the file has {', '.join(present)}",
                fields=("channel",),
            )
    skipped = [codes[3] for codes, _ in channels if codes[3][1] not in ACCELEROMETERS]
    channels = [(codes, segments) for codes, segments in channels
                if codes[3][1] in ACCELEROMETERS]  # fmt: skip
    if not channels:
        raise file.error(
            f"{', '.join(skipped)}: not an accelerometer channel (code {skipped[0][1]}): request "
            "the channels HN or EN of the station"
        )
    remarks = []
    if skipped:
        remarks.append(f"channels of other quantities were skipped: {', '.join(skipped)}")
    stations = sorted({".".join(codes[:2]) for codes, _ in channels})
    if len(stations) > 1:
        remarks.append(f"the file holds channels of several stations: {', '.join(stations[:5])}")
    start = min(segments[0].starttime_str() for _, segments in channels)
    gains = {} if file.gain is not None else sensitivities(file.path.parent)
    for index, (codes, segments) in enumerate(channels):
        of_caller = file.gain.get(index) if isinstance(file.gain, Mapping) else file.gain
        gain, source = (of_caller, "") if of_caller is not None else gains.get(codes, (None, ""))
        if gain is None:
            raise UnitNotStatedError(
                file.path,
                f"{codes[3]} is in counts without a gain: give gain in counts/(m/s2), the "
                "sensitivity in the StationXML of the station, or put that file into the same "
                "folder",
                fields=("gain",),
            )
        trace = _channel(file, codes, segments, gain, start[:19])
        on_gain = (f"the gain of {gain:g} counts/(m/s2) is from {source}",) if source else ()
        yield replace(
            trace,
            is_partial=bool(remark),
            remark_if_partial=remark,
            remarks=(*trace.remarks, *on_gain, *remarks),
        )


def _codes(file: RecordFile, source: str) -> tuple[str, ...]:
    """Return the codes of network, station, location and channel of a source identifier."""
    codes = _SOURCE.fullmatch(source)
    if codes is None:
        raise file.error(f"the source {source!r} is not a channel: request the record again")
    network, station, location, *channel = codes.groups()
    return network, station, location, "".join(channel)


def _whole_records(file: RecordFile, pymseed: Any, raw: bytes) -> tuple[bytes, str]:
    """Return the complete records, and a remark if others are omitted."""
    end = samples = 0
    try:
        for record in pymseed.MS3Record.from_buffer(raw):
            end += record.reclen
            samples += max(record.samplecnt, 0)
            if samples > MOST_SAMPLES:
                raise file.error(f"more than {MOST_SAMPLES} samples: request a shorter record")
    except pymseed.MiniSEEDError as error:
        if not (end and file.allow_partial):
            raise _damaged(file, error) from None
    if end < len(raw) and not file.allow_partial:
        raise _damaged(file, f"{len(raw) - end} bytes at the end are not a record")
    return raw[:end], f"{len(raw) - end} bytes at the end are left out" if end < len(raw) else ""


def _channel(
    file: RecordFile, codes: tuple[str, ...], segments: list[Any], gain: float, start: str
) -> ParsedTrace:
    network, station, location, name = codes
    if len(segments) > 1:
        gap = f"ends at {segments[0].endtime_str()} and goes on at {segments[1].starttime_str()}"
        raise file.error(f"{name} has {len(segments)} segments: it {gap}; request it without gaps")
    (segment,) = segments
    if segment.sampletype not in {"i", "f", "d"} or segment.numsamples != segment.samplecnt:
        raise file.error(f"{name} has fewer samples than its headers declare, or none")
    counts = segment.np_datasamples.astype(np.float64)
    offset = float(counts.mean())
    return ParsedTrace(
        counts - offset,
        file.possible_dt(1.0 / segment.samprate, None),
        HeaderField("m/s2", 1),
        None,
        name,
        1.0 / gain,
        station=f"{network}.{station}",
        recording=f"{network}.{station}.{location} {start}",
        start=segment.starttime_str(),
        is_corrected=False,
        remarks=(
            f"the mean of {offset:.6g} counts, the offset of the instrument, was subtracted; this "
            "is no baseline correction",
        ),
    )


def _damaged(file: RecordFile, trouble: object) -> Exception:
    words = " ".join(str(trouble).split())[:150]
    return file.error(
        f"the file is truncated or damaged ({words}): request the record again, or use "
        "allow_partial",
        fields=("allow_partial",),
    )
