"""UNAM standard file (Mexico): Spanish ``NAME : value`` lines, then one column a channel.

Values of the channels are listed behind slashes (``/V/N00E/N90E``), whose order differs between
stations. The columns begin after the second ruled line below ``DATOS DE ACELERACION`` and are
laid out by ``FORMATO DATOS ... : 3F10.4``.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from rbfrag.motions.record_file import (
    HeaderField,
    NamedFields,
    ParsedTrace,
    PeakField,
    RecordFile,
)
from rbfrag.motions.text import field_layout

FORMAT = "UNAM standard file"

_HEAD = re.compile(r"^ARCHIVO ESTANDAR DE ACELERACION", re.MULTILINE)
_DATA = re.compile(r"DATOS DE ACELERACION")
_RULE = re.compile(r"[-+=*]{10,}\s*")
_UNIT = re.compile(r"[^\s(]+")

recognises = _HEAD.search


def parse(file: RecordFile) -> Iterator[ParsedTrace]:
    """Yield the channels of a file in the order of its columns, with one recording id."""
    top, first = _data_starts(file)
    fields = NamedFields(file, range(top))

    orientation = fields["ORIENTACION C1-C6"]
    components = _slashed(orientation.text) + _slashed(fields.text("ORIENTACION C7-C12"))
    channels = file.count(fields["NUMERO DE CANALES"], "number of channels").number
    if len(components) != channels or not all(components):
        raise file.error(
            f"the header declares {channels} channels, but has orientations of {len(components)}",
            orientation.line,
        )
    unit = fields["UNIDADES DE LOS DATOS"]
    word = _UNIT.match(unit.text)
    unit = HeaderField(word[0] if word else unit.text, unit.line)
    dt = file.dt(_same(file, fields["INTERVALO DE MUESTREO, C1-C6"], "sampling interval"))
    total = _same(file, fields["NUM. TOTAL DE MUESTRAS, C1-C6"], "number of samples")
    count = file.count(total, "number of samples")
    # a decimated file may state the interval of the instrument, not its own
    duration = fields.optional("DURACION DEL REGISTRO (s), C1-C6")
    duration = _same(file, duration, "duration") if duration and duration.text else None
    largest = fields.optional("ACEL. MAX.(Gal), C1-C6") or unit
    peaks = _slashed(largest.text) + _slashed(fields.text("ACEL. MAX.(Gal), C7-C12"))

    layout = fields["FORMATO DATOS"]
    per_line, width = field_layout(layout.text) or (0, 0)
    if per_line != channels:
        raise file.error(
            f"the format {layout.text!r} does not fit {channels} channels", layout.line
        )
    rows = list(file.data(first))
    remarks: tuple[str, ...] = ()
    # some stations' files lack the leading blank of the first row, all of whose fields are apart
    if rows and len(rows[0]) == per_line * width - 1 and len(rows[0].split()) == per_line:
        rows[0] = f" {rows[0]}"
        remarks = ("the first row of samples lacks its leading blank",)
    table = file.fixed_table(rows, first + 1, (per_line, width), "acceleration")
    station = fields["CLAVE DE LA ESTACION"].text
    event = f"{fields.text('FECHA DEL SISMO')} {fields.text('HORA EPICENTRO')}".strip()
    for at, (component, values) in enumerate(zip(components, table.T, strict=True)):
        yield ParsedTrace(
            values,
            dt,
            unit,
            count,
            component,
            station=station,
            event=event,
            # rumbo;orientacion: the azimuth, then the axis of the instrument
            axis=component.split(";")[0].strip(),
            is_corrected=False,
            remarks=remarks,
            durations=(duration,),
            peak=PeakField(peaks[at], "gal", largest.line) if len(peaks) == channels else None,
        )


def _data_starts(file: RecordFile) -> tuple[int, int]:
    """Index of the line above the data's own header, and of the first row."""
    lines = file.lines
    top = next((at for at, line in enumerate(lines) if _DATA.match(line)), len(lines))
    rules = [at for at in range(top, len(lines)) if _RULE.fullmatch(lines[at])][:2]
    if len(rules) < 2:
        raise file.error(
            "no two ruled lines below DATOS DE ACELERACION: the file is truncated; export the "
            "record again",
            min(top + 1, len(lines)),
        )
    return top, rules[1] + 1


def _slashed(text: str) -> list[str]:
    return [part.strip() for part in text.split("/")[1:]]


def _same(file: RecordFile, field: HeaderField, description: str) -> HeaderField:
    """Return the common value of all channels."""
    values = _slashed(field.text)
    if len(set(values)) != 1:
        raise file.error(f"the channels differ in their {description}: {field.text}", field.line)
    return HeaderField(values[0], field.line)
