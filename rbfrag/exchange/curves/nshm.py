"""Hazard curves of the USGS National Seismic Hazard Models, JSON of nshmp-haz."""

from __future__ import annotations

import json
import re
from typing import Any

import numpy as np

from rbfrag.errors import InputError
from rbfrag.hazards.curve import HazardCurve, hazard_curve

_SPECTRAL = re.compile(r"([0-9.]+) Second Spectral Acceleration", re.IGNORECASE)


def is_nshm_curve(text: str) -> bool:
    """Whether the text is a JSON object."""
    return text.lstrip().startswith("{")


def nshm_curves(text: str, source: str) -> list[HazardCurve]:
    """Return one curve for each intensity measure of the file.

    Each measure holds ``xs``, the natural logarithms of acceleration in g (or of velocity in
    cm/s for the peak ground velocity), and ``ys``, annual rates of exceedance.

    Args:
        text: content of the file.
        source: its path, for messages.

    Raises:
        InputError: not such a file, with the element in question.
    """
    try:
        document = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise InputError(f"{source}: not JSON: {error}") from None
    if not isinstance(document, dict) or not document:
        raise InputError(f"{source}: a JSON object with one member a measure is wanted")
    return [_curve(name, member, f"{source}, {name!r}") for name, member in document.items()]


def _curve(name: str, member: Any, where: str) -> HazardCurve:
    measure, factor, period = _meaning(name, where)
    if not isinstance(member, dict):
        raise InputError(f"{where}: an object with xs and ys is wanted")
    x, y = (_numbers(member.get(key), key, where) for key in ("xs", "ys"))
    with np.errstate(over="ignore"):
        levels = factor * np.exp(x)
    return hazard_curve(measure, levels, y, source=where, period_s=period)


def _meaning(name: str, where: str) -> tuple[str, float, float | None]:
    if name.lower() == "peak ground acceleration":
        return "pga_g", 1.0, None
    if name.lower() == "peak ground velocity":
        return "pgv_m_s", 0.01, None
    match = _SPECTRAL.fullmatch(name)
    if match:
        return "sa_g", 1.0, float(match.group(1))
    raise InputError(
        f"{where}: the measure is not known: Peak Ground Acceleration, Peak Ground Velocity and "
        "'T Second Spectral Acceleration' are"
    )


def _numbers(value: Any, key: str, where: str) -> np.ndarray[Any, np.dtype[np.float64]]:
    if not isinstance(value, list) or not value:
        raise InputError(f"{where}: {key} is not a list of numbers")
    for i, item in enumerate(value):
        if isinstance(item, bool) or not isinstance(item, int | float):
            raise InputError(f"{where}: {key}[{i}] = {item!r} is not a number")
    return np.array(value, dtype=np.float64)
