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
     ("N10E", 10.0), ("N28W", 332.0), ("S62W", 242.0), ("S10E", 170.0), ("W", 270.0),
     ("90 Deg", 90.0), ("360 DEG", 0.0), ("0 Deg.", 0.0), ("HNE", 90.0), ("HNN", 0.0)],
)  # fmt: skip
def test_horizontal_names(name: str, azimuth: float) -> None:
    assert azimuth_deg(name) == azimuth
    assert is_vertical_name(name) is False


@pytest.mark.parametrize("name", ["", "HN3", "361", "999", "N95E", "400 Deg", "-360", "AZ", "INTC"])
def test_names_that_do_not_say(name: str) -> None:
    assert azimuth_deg(name) is None
    assert is_vertical_name(name) is None


@pytest.mark.parametrize("name", ["H1", "H2", "L", "T", "LONG", "Tran", "HN1", "HN2"])
def test_horizontal_names_without_azimuth(name: str) -> None:
    assert azimuth_deg(name) is None
    assert is_vertical_name(name) is False
