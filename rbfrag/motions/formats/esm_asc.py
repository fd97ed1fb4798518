"""ESM ASC (DYNA 1.2 header): lines ``KEY: value``, then one value a line, one component a file.

AFAD (Turkey) puts lines ``AAD_...`` before them. It filtered its records again after the peak of
the header had been taken: the two are off by up to a quarter.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from rbfrag.motions.record_file import NamedFields, ParsedTrace, RecordFile, peak_of

FORMAT = "ESM ASC"

_HEAD = re.compile(r"(?:AAD_.*\n)*EVENT_NAME:(?s:.)*^SAMPLING_INTERVAL_S:", re.MULTILINE)
_KEY = re.compile(r"AAD_|[A-Z][^:\s]*:")

recognises = _HEAD.match


def parse(file: RecordFile) -> Iterator[ParsedTrace]:
    """Yield the only trace of a file."""
    lines = file.lines
    first = next((at for at, line in enumerate(lines) if not _KEY.match(line)), len(lines))
    fields = NamedFields(file, range(first))
    kind = fields.text("DATA_TYPE")
    if kind and kind.upper() != "ACCELERATION":
        raise file.error(
            f"this is a record of {kind.lower()}: the acceleration is required",
            fields["DATA_TYPE"].line,
        )
    dt = file.dt(fields["SAMPLING_INTERVAL_S"])
    # BASELINE REMOVED or BASELINE NOT REMOVED, where the header says
    baseline = fields.text("BASELINE_CORRECTION").upper().split()
    yield ParsedTrace(
        file.table(file.data(first), first + 1, 1, "acceleration")[:, 0],
        dt,
        fields["UNITS"],
        file.count(fields["NDATA"], "NDATA"),
        component=fields["STREAM"].text,
        station=f"{fields.text('NETWORK')}.{fields['STATION_CODE'].text}".lstrip("."),
        event=fields.text("EVENT_NAME") or fields.text("EVENT_ID"),
        start=fields.text("DATE_TIME_FIRST_SAMPLE_YYYYMMDD"),
        is_corrected="NOT" not in baseline if "REMOVED" in baseline else None,
        durations=(fields.optional("DURATION_S"),),
        peak=peak_of(fields.optional("PGA_CM/S^2"), "cm/s2"),
    )
