"""Validation of single numbers: converted to floats, or rejected with the permitted range."""

from __future__ import annotations

import math
from dataclasses import is_dataclass
from typing import Any

from rbfrag.errors import InputError


def number(value: object, name: str, expected: str) -> float:
    """Return a finite number as a float."""
    if type(value) is float and math.isfinite(value):
        return value
    if isinstance(value, bool | str | bytes):
        raise InputError(f"{name} = {value!r} is not a number: give {expected}", fields=(name,))
    try:
        result = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError):
        raise InputError(
            f"{name} = {value!r} is not a number: give {expected}", fields=(name,)
        ) from None
    if not math.isfinite(result):
        raise InputError(f"{name} = {result:g} is not finite: give {expected}", fields=(name,))
    return result


def positive(value: object, name: str, unit: str) -> float:
    """Return a finite number above zero as a float, or reject it."""
    expected = f"a number above 0 [{unit}]" if unit else "a number above 0"
    result = number(value, name, expected)
    if result <= 0.0:
        raise InputError(f"{name} = {result:g} is not above zero: give {expected}", fields=(name,))
    return result


def not_negative(value: object, name: str, unit: str) -> float:
    """Return a finite number of zero or more as a float, or reject it."""
    expected = f"0 or more [{unit}]"
    result = number(value, name, expected)
    if result < 0.0:
        raise InputError(f"{name} = {result:g} is negative: give {expected}", fields=(name,))
    return result


def angle(value: object, name: str, above: float, below: float) -> float:
    """Return an angle between two limits, both excluded, or reject it [deg]."""
    expected = f"an angle between {above:g} and {below:g} degrees"
    result = number(value, name, expected)
    if not above < result < below:
        raise InputError(
            f"{name} = {result:.10g} is out of range: give {expected}, both excluded",
            fields=(name,),
        )
    return result


def friction_angle(value: object, name: str) -> float:
    """Return a friction angle, from 0 and below 90 degrees, or reject it [deg]."""
    expected = "a friction angle from 0 to below 90 degrees"
    result = number(value, name, expected)
    if not 0.0 <= result < 90.0:
        raise InputError(f"{name} = {result:.10g} is out of range: give {expected}", fields=(name,))
    return result


def vertical_g(value: object) -> float:
    """Return a vertical ground acceleration above -1 g, or reject it [g]."""
    result = number(value, "kv", "the vertical acceleration of the ground in g, up positive")
    if result <= -1.0:
        raise InputError(
            f"kv = {result:g}: below -1 g the block loses contact with the ground: give a value "
            "above -1"
        )
    return result


def finite_or_none(value: float | None) -> float | None:
    """Return a number, or None for NaN and infinity."""
    return value if value is not None and math.isfinite(value) else None


def json_value(value: Any) -> Any:
    """Return a value of an answer in JSON form: infinities and NaN are None."""
    if isinstance(value, float):
        return finite_or_none(value)
    if isinstance(value, tuple):
        return [json_value(item) for item in value]
    if is_dataclass(value):
        return {name: json_value(item) for name, item in vars(value).items()}
    return value
