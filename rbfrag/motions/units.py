"""Units of acceleration, and standard gravity."""

from __future__ import annotations

import re

from rbfrag.errors import InputError

STANDARD_GRAVITY_M_S2 = 9.80665
"""Standard gravity [m/s²], exact by definition (CGPM 1901)."""

_IN_G = {
    "g": 1.0,
    "m/s2": 1.0 / STANDARD_GRAVITY_M_S2,
    "cm/s2": 0.01 / STANDARD_GRAVITY_M_S2,
    "mm/s2": 0.001 / STANDARD_GRAVITY_M_S2,
}

_SPELLINGS = {
    **dict.fromkeys(("g", "g's", "gs"), "g"),
    **dict.fromkeys(("m/s2", "m/sec2", "m/s/s", "m/sec/sec", "ms-2"), "m/s2"),
    **dict.fromkeys(("cm/s2", "cm/sec2", "cm/s/s", "cm/sec/sec", "cms-2", "gal", "gals"), "cm/s2"),
    **dict.fromkeys(("mm/s2", "mm/sec2", "mm/s/s", "mm/sec/sec", "mms-2"), "mm/s2"),
}

_AS_TYPED = str.maketrans({"²": "2", "⁻": "-", **dict.fromkeys("^*·⋅ \u00a0")})
"""Powers and products in the form of the table above."""

_TENTH_OF_G = re.compile(r"g\s*/\s*10", re.IGNORECASE)
"""The unit of the uncorrected (volume 1) formats of the 1970s."""

ACCELERATION_UNITS = tuple(_IN_G)
"""The unit names that options and metadata files use."""


def acceleration_unit(text: str) -> str:
    """Return the standard name of an acceleration unit as files spell it.

    Args:
        text: a spelling such as ``g``, ``g's``, ``cm/sec**2``, ``m/s^2``, ``gal``.

    Returns:
        One of ``g``, ``m/s2``, ``cm/s2``, ``mm/s2``.
    """
    key = text.strip().lower().translate(_AS_TYPED)
    try:
        return _SPELLINGS[key]
    except KeyError:
        accepted = ", ".join(ACCELERATION_UNITS)
        raise InputError(
            f"unknown unit of acceleration {text!r}: use one of {accepted} (gal is cm/s2)"
        ) from None


def unit_in_g(unit: str) -> float:
    """Return one unit of acceleration in g (multiply samples by it).

    Args:
        unit: any spelling that :func:`acceleration_unit` knows.
    """
    return _IN_G[acceleration_unit(unit)]


def stated_in_g(text: str) -> float:
    """Return the unit of a header in g, g/10 among them.

    Raises:
        InputError: no unit of acceleration.
    """
    return 0.1 if _TENTH_OF_G.fullmatch(text) else unit_in_g(text)
