"""Sensitivities of accelerometer channels in FDSN StationXML files next to a record."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

from rbfrag.errors import MotionFileError
from rbfrag.motions.text import read_bytes

LARGEST_BYTES = 20_000_000
"""Inventories of whole networks with all their responses are larger; a station's is not."""

ACCELERATION_UNITS = frozenset({"M/S**2", "M/S2", "M/S^2", "M/(S**2)"})


def sensitivities(folder: Path) -> dict[tuple[str, ...], tuple[float, str]]:
    """Return gain [counts/(m/s²)] and file of each channel by the StationXML files of a folder.

    A channel is (network, station, location, channel code). Channels of other quantities, files
    of other kinds and files that cannot be parsed are passed over: a gain that is missing is
    reported where it is needed.

    Raises:
        MotionFileError: two files or epochs give one channel different gains.
    """
    gains: dict[tuple[str, ...], tuple[float, str]] = {}
    for file in sorted(folder.glob("*.xml")) if folder.is_dir() else []:
        for channel, gain in _sensitivities(file):
            earlier = gains.setdefault(channel, (gain, file.name))
            if earlier[0] != gain:
                raise MotionFileError(
                    file,
                    f"the channel {'.'.join(channel)} has a gain of {gain:g} counts/(m/s2) here, "
                    f"but {earlier[0]:g} in {earlier[1]}: give gain",
                    fields=("gain",),
                )
    return gains


def _sensitivities(file: Path) -> list[tuple[tuple[str, ...], float]]:
    if file.stat().st_size > LARGEST_BYTES:
        return []
    raw = read_bytes(file)
    # no document type, hence no entities
    if b"FDSNStationXML" not in raw[:2000] or b"<!DOCTYPE" in raw or b"<!ENTITY" in raw:
        return []
    try:
        root = ElementTree.fromstring(raw)
    except ElementTree.ParseError:
        return []
    gains: list[tuple[tuple[str, ...], float]] = []
    for network in root.iterfind("{*}Network"):
        for station in network.iterfind("{*}Station"):
            for channel in station.iterfind("{*}Channel"):
                sensitivity = channel.find("{*}Response/{*}InstrumentSensitivity")
                if sensitivity is None:
                    continue
                unit = sensitivity.findtext("{*}InputUnits/{*}Name", "").strip().upper()
                try:
                    gain = float(sensitivity.findtext("{*}Value", ""))
                except ValueError:
                    continue
                above = (network.get("code", ""), station.get("code", ""))
                location = channel.get("locationCode", "").strip()
                codes = (*above, location, channel.get("code", ""))
                if unit in ACCELERATION_UNITS and 0.0 < gain < float("inf"):
                    gains.append((codes, gain))
    return gains
