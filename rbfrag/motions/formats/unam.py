"""UNAM standard file (Mexico): Spanish ``NAME : value`` lines, then one column a channel.

Values of the channels are listed behind slashes (``/V/N00E/N90E``), whose order differs between
stations. The columns begin after the second ruled line below ``DATOS DE ACELERACION`` and are
laid out by ``FORMATO DATOS ... : 3F10.4``.
"""

from __future__ import annotations

import re
from pathlib import Path

from rbfrag.errors import MotionFileError
from rbfrag.motions.direction import azimuth_deg, is_vertical_name
from rbfrag.motions.ground_motion import GroundMotion
from rbfrag.motions.text.file import (
    field_layout,
    fixed_width_numbers,
    sample_count,
    without_blank_end,
)
from rbfrag.motions.text.header import (
    Field,
    NamedFields,
    agreed_dt,
    agreed_unit_in_g,
    other_count,
    positive_number,
)

FORMAT = "UNAM standard file"

_HEAD = re.compile(r"^ARCHIVO ESTANDAR DE ACELERACION", re.MULTILINE)
_DATA = re.compile(r"DATOS DE ACELERACION")
_RULE = re.compile(r"[-+=*]{10,}\s*")
_UNIT = re.compile(r"[^\s(]+")


def recognises(head: str) -> bool:
    """Return whether the first lines are those of a UNAM standard file."""
    return bool(_HEAD.search(head))


def read(
    path: Path, text: str, *, units: str | None, dt_s: float | None, allow_partial: bool = False
) -> list[GroundMotion]:
    """Return the channels of a file in the order of its columns, with one recording id.

    Args:
        path: for labels and messages.
        text: the file's text.
        units: unit that the caller states; refused when the file states another.
        dt_s: sampling interval that the caller states [s]; likewise.
        allow_partial: True to read a file whose header states another number of samples than
            follow; the motion is then marked as partial.

    Raises:
        MotionFileError: a header or value that cannot be used, with its line.
    """
    lines = text.split("\n")
    top, first = _data_starts(path, lines)
    fields = NamedFields(path, lines, range(top))

    orientation = fields["ORIENTACION C1-C6"]
    components = _slashed(orientation.text) + _slashed(fields.text("ORIENTACION C7-C12"))
    count = fields["NUMERO DE CANALES"]
    channels = sample_count(path, count.text, count.line, "number of channels")
    if len(components) != channels or not all(components):
        raise MotionFileError(
            path,
            f"the header says {channels} channels, but orients {len(components)}",
            line=orientation.line,
        )
    unit = fields["UNIDADES DE LOS DATOS"]
    word = _UNIT.match(unit.text)
    factor = agreed_unit_in_g(path, Field(word[0] if word else unit.text, unit.line), units)
    interval = _same(path, fields["INTERVALO DE MUESTREO, C1-C6"], "sampling interval")
    dt = agreed_dt(path, positive_number(path, interval, "dt"), interval.line, dt_s)
    stated = _same(path, fields["NUM. TOTAL DE MUESTRAS, C1-C6"], "number of samples")
    npts = sample_count(path, stated.text, stated.line, "number of samples")
    _check_duration(path, fields, npts, dt)

    layout = fields["FORMATO DATOS"]
    per_line, width = field_layout(layout.text) or (0, 0)
    if per_line != channels:
        raise MotionFileError(
            path, f"the format {layout.text!r} does not fit {channels} channels", line=layout.line
        )
    rows = without_blank_end(lines[first:])
    numbers = fixed_width_numbers(path, rows, first + 1, width, per_line, "acceleration")
    if numbers.size % channels:
        raise MotionFileError(
            path,
            f"the last row has not {channels} columns: the file is truncated",
            line=first + len(rows),
        )
    table = numbers.reshape(-1, channels)
    remarks = other_count(path, npts, table.shape[0], stated.line, allow_partial=allow_partial)
    station = fields["CLAVE DE LA ESTACION"].text
    event = f"{fields.text('FECHA DEL SISMO')} {fields.text('HORA EPICENTRO')}".strip()
    # rumbo;orientacion: the azimuth, then the axis of the instrument
    names = [component.split(";")[0].strip() for component in components]
    return [
        GroundMotion(
            table[:, index] * factor,
            dt,
            station=station,
            event=event,
            component=component,
            orientation_deg=azimuth_deg(name),
            is_vertical=is_vertical_name(name),
            recording=f"{event} {station}".strip(),
            source_file=path.name,
            trace_index=index,
            file_format=FORMAT,
            remarks=remarks,
            is_partial=bool(remarks),
            is_corrected=False,
        )
        for index, (component, name) in enumerate(zip(components, names, strict=True))
    ]


def _data_starts(path: Path, lines: list[str]) -> tuple[int, int]:
    """Index of the line above the data's own header, and of the first row."""
    top = next((at for at, line in enumerate(lines) if _DATA.match(line)), len(lines))
    rules = [at for at in range(top, len(lines)) if _RULE.fullmatch(lines[at])][:2]
    if len(rules) < 2:
        raise MotionFileError(
            path,
            "no two ruled lines below DATOS DE ACELERACION: the file is truncated; export the "
            "record again",
            line=min(top + 1, len(lines)),
        )
    return top, rules[1] + 1


def _slashed(text: str) -> list[str]:
    return [part.strip() for part in text.split("/")[1:]]


def _same(path: Path, field: Field, what: str) -> Field:
    """The one value of all channels."""
    values = _slashed(field.text)
    if len(set(values)) != 1:
        raise MotionFileError(
            path, f"the channels differ in their {what}: {field.text}", line=field.line
        )
    return Field(values[0], field.line)


def _check_duration(path: Path, fields: NamedFields, npts: int, dt: float) -> None:
    """A decimated file may state the interval of the instrument, not its own."""
    if not fields.text("DURACION DEL REGISTRO (s), C1-C6"):
        return
    field = _same(path, fields["DURACION DEL REGISTRO (s), C1-C6"], "duration")
    seconds = positive_number(path, field, "duration")
    if abs(seconds - npts * dt) > 0.01 * seconds + dt:
        raise MotionFileError(
            path,
            f"{npts} samples at dt = {dt:g} s last {npts * dt:g} s, but the header says "
            f"{field.text} s: check the sampling interval",
            line=field.line,
        )
