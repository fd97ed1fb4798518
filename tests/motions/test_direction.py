"""What component names say about direction."""

from __future__ import annotations

import pytest

from rbfrag.motions.direction import azimuth_deg, is_vertical_name


@pytest.mark.parametrize(
    "name",
    ["UP", "Up", "-UP", "DWN", "-DWN", "DOWN", "VER", "ver", "VERT", "V", "-V", "Z", "UD", "U-D",
     "HNZ", "HHZ", "BNZ", "HGZ", "HLZ"],
)  # fmt: skip
def test_vertical_names(name: str) -> None:
    assert is_vertical_name(name) is True
    assert azimuth_deg(name) is None


@pytest.mark.parametrize(
    ("name", "azimuth"),
    [("360", 0.0), ("000", 0.0), ("090", 90.0), ("67", 67.0), ("N", 0.0), ("EAST", 90.0),
     ("N10E", 10.0), ("N28W", 332.0), ("S62W", 242.0), ("S10E", 170.0), ("W", 270.0)],
)  # fmt: skip
def test_horizontal_names(name: str, azimuth: float) -> None:
    assert azimuth_deg(name) == azimuth
    assert is_vertical_name(name) is False


@pytest.mark.parametrize("name", ["", "H1", "HNE", "361", "999", "N95E", "LONG", "-360", "AZ"])
def test_names_that_do_not_say(name: str) -> None:
    assert azimuth_deg(name) is None
    assert is_vertical_name(name) is None
