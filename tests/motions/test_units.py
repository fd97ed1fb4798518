"""Units of acceleration: the spellings of files, and no other."""

from __future__ import annotations

import pytest

from rbfrag.errors import InputError
from rbfrag.motions.units import ACCELERATION_UNITS, acceleration_unit, unit_in_g


@pytest.mark.parametrize(
    ("spelling", "unit"),
    [
        ("g", "g"), ("G", "g"), (" g's ", "g"),
        ("m/s2", "m/s2"), ("m/s^2", "m/s2"), ("m/s**2", "m/s2"), ("m/s²", "m/s2"),
        ("m/sec/sec", "m/s2"), ("M/S/S", "m/s2"),
        ("gal", "cm/s2"), ("cm/sec**2", "cm/s2"), ("cm / s2", "cm/s2"),
        ("mm/s/s", "mm/s2"),
    ],
)  # fmt: skip
def test_spellings(spelling: str, unit: str) -> None:
    assert acceleration_unit(spelling) == unit
    assert unit_in_g(spelling) == unit_in_g(unit)


@pytest.mark.parametrize("spelling", ["", "m/s", "cm/s", "g/10", "counts", "gram", "mgal", "%g"])
def test_anything_else_is_rejected(spelling: str) -> None:
    with pytest.raises(InputError, match="use one of g, m/s2, cm/s2, mm/s2") as caught:
        acceleration_unit(spelling)
    assert repr(spelling) in str(caught.value)


def test_factors() -> None:
    assert unit_in_g("g") == 1.0
    assert [round(1.0 / unit_in_g(unit), 9) for unit in ACCELERATION_UNITS] == [
        1.0,
        9.80665,
        980.665,
        9806.65,
    ]
