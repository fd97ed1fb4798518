"""Release rates for tools of rockfall propagation, by the shell and by Python."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest

import rbfrag
from rbfrag.errors import InputError
from rbfrag.exchange.rate_tables import write_release_rates
from tests.cli.conftest import Shell

CURVE = "pgv_m_s,annual_rate\n0.05,0.03\n0.1,0.012\n0.2,0.004\n0.5,0.0008\n1,0.00017\n2,0.00002\n"
BLOCKS = """\
block_id,base,back,face,s1_m,s2_m,height_m,width_m,phi_deg,lon,lat,x,y,z,crs,strike_length_m,\
density_kg_m3,dip_deg
A,4/150,78/095,80/090,2,0.4,,,40,8.5,46.5,,,,,3,2650,
B,,,,,,2,0.5,40,8.5,46.5,2700000,1200000,812.5,EPSG:2056,,2650,0
wedge,35/140,78/095,80/090,2,0.4,,,40,8.5,46.5,,,,,3,2650,
C,,,,,,2,0.4,40,8.6,46.5,,,,,1.5,,0
"""
COLUMNS = [
    "release_id",
    "x",
    "y",
    "z",
    "crs",
    "volume_m3",
    "mass_kg",
    "density_kg_m3",
    "annual_rate",
    "rate_low",
    "rate_high",
    "kind",
    "d1_m",
    "d2_m",
    "d3_m",
]


def released(path: Path) -> list[dict[str, str]]:
    with path.open(newline="", encoding="utf-8") as file:
        reader = csv.DictReader(file)
        assert reader.fieldnames == COLUMNS
        return list(reader)


def test_table_of_release(shell: Shell) -> None:
    Path("curve.csv").write_text(CURVE)
    Path("blocks.csv").write_text(BLOCKS)
    command = ("hazard", "curve.csv", "--blocks", "blocks.csv", "--component", "rotd50")
    rates = shell.json(*command, "--density", "2500", "--release", "release.csv")["blocks"]
    by_plane, by_sides, plain = released(Path("release.csv"))
    # the wedge has no rate, and is left out
    assert [row["block_id"] for row in rates] == ["A", "B", "wedge", "C"]
    for row, rate in zip((by_plane, by_sides, plain), (rates[0], rates[1], rates[3]), strict=True):
        assert (row["release_id"], row["kind"]) == (rate["block_id"], "toppling")
        numbers = [float(row[name]) for name in ("annual_rate", "rate_low", "rate_high")]
        assert numbers == [rate[name] for name in ("annual_rate", "ci_low", "ci_high")]

    # a parallelogram of the spacings in the section, S1 S2/sin(gamma), times its length
    tilt = np.radians([4.0, 78.0])
    off = np.radians([60.0, 5.0])
    s1, s2 = np.array([2.0, 0.4]) / np.sqrt(1.0 - (np.sin(tilt) * np.sin(off)) ** 2)
    beta, back = np.arctan(np.tan(tilt) * np.cos(off))
    base = s2 / np.sin(back - beta)
    sides = [float(by_plane[name]) for name in ("d1_m", "d2_m", "d3_m", "volume_m3", "mass_kg")]
    volume = 3.0 * s1 * base
    assert sides == pytest.approx([s1, base, 3.0, volume, 2650.0 * volume], rel=1e-9)
    place = [by_plane[name] for name in ("x", "y", "z", "crs")]
    assert place == ["8.5", "46.5", "", "EPSG:4326"]

    # without its length along the slope a block has no volume; its own system goes before lon, lat
    assert [by_sides[name] for name in ("volume_m3", "mass_kg", "d3_m")] == ["", "", ""]
    assert [float(by_sides[name]) for name in ("d1_m", "d2_m", "z")] == [2.0, 0.5, 812.5]
    assert [by_sides[name] for name in ("x", "y", "crs")] == ["2700000.0", "1200000.0", "EPSG:2056"]
    # an empty cell takes the density that is stated of all
    assert [float(plain[name]) for name in ("volume_m3", "mass_kg")] == pytest.approx([1.2, 3000.0])


def test_python_writes_the_same(shell: Shell) -> None:
    Path("curve.csv").write_text(CURVE)
    text = "block_id,height_m,width_m,phi_deg,strike_length_m\nP,2,0.5,40,2\nP,2,0.4,40,1\n"
    Path("blocks.csv").write_text(text)
    shell("hazard", "curve.csv", "--blocks", "blocks.csv", "--component", "rotd50",
          "--release", "shell.csv")  # fmt: skip
    answer = rbfrag.hazard(
        "curve.csv", height_m=2.0, width_m=[0.5, 0.4], phi_deg=40.0, component="rotd50"
    )
    write_release_rates(answer, "blocks.csv", "python.csv")
    assert Path("python.csv").read_bytes() == Path("shell.csv").read_bytes()
    # what is joined by release_id is joined once
    assert [row["release_id"] for row in released(Path("python.csv"))] == ["P-1", "P-2"]
    with pytest.raises(InputError, match="2 rates and the table 1 blocks"):
        write_release_rates(answer, {"height_m": [2.0], "width_m": [0.5]}, "python.csv")
    columns = {"height_m": [2.0, 2.0], "width_m": [0.5, 0.4]}
    with pytest.raises(InputError, match="x and y require a coordinate reference system"):
        write_release_rates(answer, {**columns, "x": [1.0, 2.0], "y": [1.0, 2.0]}, "python.csv")
    with pytest.raises(InputError, match="strike_length_m = -1"):
        write_release_rates(answer, {**columns, "strike_length_m": [1.0, -1.0]}, "python.csv")


def test_one_block_in_the_shell_has_its_sides(shell: Shell) -> None:
    Path("curve.csv").write_text(CURVE)
    shell("hazard", "curve.csv", "--height", "2", "--width", "0.5", "--component", "rotd50",
          "--release", "release.csv")  # fmt: skip
    (row,) = released(Path("release.csv"))
    assert [row[name] for name in ("release_id", "d1_m", "d2_m", "d3_m", "x")] == [
        "1", "2.0", "0.5", "", "",
    ]  # fmt: skip


def test_cohesion_of_all_rows_of_a_table(shell: Shell) -> None:
    """A value for all blocks is not a column: it was rejected as an array of numbers."""
    Path("curve.csv").write_text(CURVE)
    Path("blocks.csv").write_text("block_id,height_m,width_m,phi_deg\nB,2,0.5,10\nC,2,0.4,10\n")
    command = ("hazard", "curve.csv", "--component", "rotd50")
    bond = ("--cohesion", "20000", "--density", "2500")
    first = shell.json(*command, "--blocks", "blocks.csv", *bond)["blocks"][0]
    single = shell.json(*command, "--height", "2", "--width", "0.5", "--phi", "10", *bond)
    assert first["annual_rate"] == pytest.approx(single["annual_rate"], rel=1e-9)
    # without the bond it slides
    message = shell(*command, "--blocks", "blocks.csv", "--density", "2500", expect=2).stderr
    assert "slides" in message
