"""Directions from component names."""

from __future__ import annotations

import pytest

from rbfrag.motions.direction import azimuth_deg, bare_name, is_downward_name, is_vertical_name


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


@pytest.mark.parametrize(
    "name",
    [
        "",
        "HN3",
        "361",
        "999",
        "N95E",
        "400 Deg",
        "AZ",
        "INTC",
        "3",
        "07",
        "CHAN 3",
        "CH012",
        "ROOF",
        "SETUP",
        "H3",
    ],
)
def test_names_that_do_not_say(name: str) -> None:
    assert azimuth_deg(name) is None
    assert is_vertical_name(name) is None


@pytest.mark.parametrize("name", ["H1", "H2", "L", "T", "LONG", "Tran", "HN1", "HN2"])
def test_horizontal_names_without_azimuth(name: str) -> None:
    assert azimuth_deg(name) is None
    assert is_vertical_name(name) is False


NETWORKS = {
    # CSMIP, CESMD
    "UP       (STA CHN:  1)": True, "Up      (Sta Chn: 11)": True, "DOWN (STA CHN: 3)": True,
    "360 DEG  (STA CHN:  2)": 0.0, "90 Deg (Sta Chn: 5)": 90.0, "Long    (Sta Chn:  6)": False,
    "Tran    (Sta Chn:  7)": False, "H1": False, "5 DEG": 5.0,
    # Caltech, USGS
    "COMP S00E": 180.0, "COMP DOWN": True, "COMP N90W": 270.0, "043": 43.0, "UPDO": True,
    # PEER
    "-UP": True, "DWN": True, "MUL-UP": True, "H-BCRDWN": True, "CHY101-E": 90.0, "CLW-LN": False,
    "AMBCN86E": 86.0, "-360": 0.0,
    # UNAM, CIRES, Chile, Peru
    "+V": True, "-V": True, "N00E": 0.0, "+N05E": 5.0, "N90W": 270.0, "NORTE": 0.0, "ESTE": 90.0,
    "SUR": 180.0, "OESTE": 270.0, "E-O": 90.0, "VERT.": True, "N05O": 355.0,
    "Componente Norte": 0.0,
    # Italy, France, Germany, Turkey
    "OVEST": 270.0, "NORD": 0.0, "VERTICALE": True, "SUD": 180.0, "OUEST": 270.0, "SÜD": 180.0,
    "VERTIKAL": True, "DÜŞEY": True, "K-G": 0.0, "D-B": 90.0,
    # Japan, Taiwan, Iran
    "U-D": True, "N-S": 0.0, "UD2": True, "EW1": 90.0, "V2": True, "L1": False, "上下": True,
    # SEED
    "HNZ": True, "HNE": 90.0, "BN1": False, "CI.PAS..HNZ": True,
    # azimuths
    "90°": 90.0, "N 5° E": 5.0, "N05°W": 355.0, "270 º": 270.0, "337.5": 337.5,
}  # fmt: skip
"""Spellings of networks: True for a vertical, False for a horizontal of no azimuth, or its azimuth
[deg]."""


@pytest.mark.parametrize("name", NETWORKS)
def test_spellings_of_networks(name: str) -> None:
    direction = NETWORKS[name]
    assert is_vertical_name(name) is (direction is True)
    assert azimuth_deg(name) == (None if isinstance(direction, bool) else direction)


def test_the_list_is_of_at_least_sixty_names() -> None:
    assert len(NETWORKS) >= 60


@pytest.mark.parametrize(
    ("name", "bare"),
    [("+V", "V"), ("UP       (STA CHN:  1)", "UP"), ("-N05E", "N05E"), ("(U-D)", "U-D")],
)
def test_sign_and_trailing_parenthesis_are_stripped(name: str, bare: str) -> None:
    assert bare_name(name) == bare


def test_downward_components_after_a_station() -> None:
    assert is_downward_name("H-BCRDWN")
    assert is_downward_name("DOWN (STA CHN: 3)")
    assert not is_downward_name("MUL-UP")
