"""ShakeMap grids: the samples, blank units, and files that are not whole."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from rbfrag.errors import InputError
from rbfrag.exchange.shakemap import at_places, read_shakemap

GRID = """<?xml version="1.0"?>
<shakemap_grid xmlns="http://earthquake.usgs.gov/eqcenter/shakemap" event_id="e1" code_version="4">
<event event_id="e1" magnitude="6.5" depth="10" lat="40.5" lon="20.5" event_timestamp="t" />
<grid_specification nlon="3" nlat="2" />
<grid_field index="1" name="LON" units="dd" />
<grid_field index="2" name="LAT" units="dd" />
<grid_field index="3" name="PGV" units="cm/s" />
<grid_field index="4" name="PGA" units="%g" />
<grid_data>
20.0 41.0 10 5
20.5 41.0 20 10
21.0 41.0 40 20
20.0 40.0 10 5
20.5 40.0 20 10
21.0 40.0 40 20
</grid_data></shakemap_grid>"""

UNCERTAINTY = (
    GRID.replace('name="PGV" units="cm/s"', 'name="STDPGV" units="ln(cm/s)"')
    .replace('name="PGA" units="%g"', 'name="STDPGA" units="ln(%g)"')
    .replace(" 10 5", " 0.5 0.4").replace(" 20 10", " 0.6 0.5").replace(" 40 20", " 0.7 0.6")
)  # fmt: skip


@pytest.fixture
def grid_file(tmp_path: Path) -> Path:
    path = tmp_path / "grid.xml"
    path.write_text(GRID)
    return path


def test_version_3(formats_dir: Path) -> None:
    parsed = read_shakemap(formats_dir / "shakemap_v3_loma_prieta_grid.xml")
    assert (parsed.columns, parsed.rows, parsed.is_whole) == (241, 193, True)
    assert (parsed.event["magnitude"], parsed.epicentre) == (6.9, (-121.88, 37.04))
    # first row of the file: -125.3800 39.4340 0.52 1.57, percent of g and cm/s
    assert (parsed.lon[0], parsed.lat[0]) == (-125.38, 39.434)
    assert parsed.measures["pga_g"][0] == pytest.approx(0.0052)
    assert parsed.measures["pgv_m_s"][0] == pytest.approx(0.0157)
    assert parsed.std_ln["pga_g"][0] == 0.49
    assert list(parsed.std_ln) == ["pga_g"]
    # PSA03 1.63, PSA10 2.7, PSA30 0.7 percent of g
    sa = [parsed.measures[name][0] for name in ("sa(0.3)", "sa(1)", "sa(3)")]
    assert sa == pytest.approx([0.0163, 0.027, 0.007])
    assert parsed.warnings == ()


def test_blank_units_are_those_of_the_manual(formats_dir: Path) -> None:
    parsed = read_shakemap(formats_dir / "shakemap_v3_loma_prieta_grid_cut_blank_units.xml")
    assert parsed.measures["pga_g"][0] == pytest.approx(0.18)
    assert parsed.measures["pgv_m_s"][0] == pytest.approx(0.1323)
    assert sum("has no unit" in text for text in parsed.warnings) == 6


def test_version_4_has_another_order_and_lies_about_its_size(formats_dir: Path) -> None:
    path = formats_dir / "shakemap_v4_grid_cropped.xml"
    with pytest.raises(InputError, match=r"10 nodes, .* 741 x 575 = 426075: with allow_partial"):
        read_shakemap(path)
    parsed = read_shakemap(path, allow_partial=True)
    assert parsed.measures["pga_g"][0] == pytest.approx(0.006399)
    assert parsed.measures["pgv_m_s"][0] == pytest.approx(0.01023)
    assert not parsed.is_whole
    assert "read as it is" in parsed.warnings[0]


def test_uncertainty_of_the_same_map(tmp_path: Path, grid_file: Path) -> None:
    other = tmp_path / "uncertainty.xml"
    other.write_text(UNCERTAINTY)
    parsed = read_shakemap(grid_file, uncertainty=other)
    assert parsed.std_ln["pgv_m_s"].tolist() == [0.5, 0.6, 0.7, 0.5, 0.6, 0.7]
    assert parsed.std_ln["pga_g"].tolist() == [0.4, 0.5, 0.6, 0.4, 0.5, 0.6]
    other.write_text(UNCERTAINTY.replace("e1", "e2"))
    with pytest.raises(InputError, match="of event 'e2', the grid of 'e1'"):
        read_shakemap(grid_file, uncertainty=other)
    other.write_text(UNCERTAINTY.replace("20.5 4", "20.6 4"))
    with pytest.raises(InputError, match="not those of the grid"):
        read_shakemap(grid_file, uncertainty=other)


def test_between_the_nodes(grid_file: Path) -> None:
    fields, deviations, on_map = at_places(
        read_shakemap(grid_file), np.array([20.25, 21.0, 22.0]), np.array([40.3, 41.0, 40.5])
    )
    assert on_map.tolist() == [True, True, False]
    assert deviations == {}
    # halfway between 10 and 20 cm/s in the logarithm
    assert fields["pgv_m_s"][0] == pytest.approx(0.1 * np.sqrt(2.0))
    assert fields["pgv_m_s"][1] == pytest.approx(0.4)
    assert np.isnan(fields["pgv_m_s"][2])


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("<shakemap_grid", "<!DOCTYPE a [<!ENTITY x 'y'>]><shakemap_grid", "definition"),
        ("</shakemap_grid>", "", "not well-formed"),
        ("shakemap_grid", "other_grid", "not a ShakeMap grid"),
        ("20.0 41.0 10 5\n", "", "5 nodes, grid_specification says 3 x 2 = 6"),
        ("20.0 41.0 10 5\n", "20.0 41.0 10\n", "23 numbers, not a multiple of the 4 fields"),
        ("20.0 41.0 10 5", "20.0 41.0 x 5", "node 1 of grid_data: 'x' is not a number"),
        ("20.5 40.0 20 10", "20.5 40.0 -2 10", "node 5 of grid_data: PGV = -2"),
        ("20.5 40.0", "200.5 40.0", "node 5 of grid_data: LON = 200.5 must be between"),
        ('units="cm/s"', 'units="knots"', "PGV in 'knots' is unknown"),
        ('name="LAT"', 'name="MMI"', "there is no field LAT; the fields are LON, MMI, PGV, PGA"),
        ('index="4"', 'index="5"', "indices up to 5 but there are 4"),
        ('index="4"', 'index="x"', "index 'x' is not a number"),
        ('name="PGA"', 'name="PGV"', "field PGV occurs twice"),
        ('nlon="3"', 'nlon="x"', "nlon = 'x' is not a number"),
    ],
)
def test_bad_grids_are_rejected(grid_file: Path, old: str, new: str, words: str) -> None:
    assert old in GRID
    grid_file.write_text(GRID.replace(old, new))
    with pytest.raises(InputError, match=words):
        read_shakemap(grid_file)


def test_numbers_cut_by_the_parser_are_put_together(tmp_path: Path) -> None:
    # more text than the parser hands over at once
    n = 60_000
    rows = "\n".join(f"{20 + i * 1e-4:.4f} 41.0 {10 + i % 7} {5 + i % 3}" for i in range(n))
    start, rest = GRID.split("<grid_data>")
    head = start.replace('nlon="3" nlat="2"', f'nlon="{n}" nlat="1"')
    path = tmp_path / "grid.xml"
    path.write_text(f"{head}<grid_data>\n{rows}\n</grid_data>{rest.split('</grid_data>')[1]}")
    parsed = read_shakemap(path)
    assert parsed.lon.size == n
    assert parsed.measures["pgv_m_s"].tolist() == [0.01 * (10 + i % 7) for i in range(n)]


def test_suspicious_units_are_doubted(grid_file: Path) -> None:
    grid_file.write_text(GRID.replace('units="cm/s"', 'units="m/s"'))
    assert any("is that its unit?" in text for text in read_shakemap(grid_file).warnings)


def test_a_grid_without_pgv(grid_file: Path) -> None:
    grid_file.write_text(GRID.replace('name="PGV" units="cm/s"', 'name="PSA10" units="pctg"'))
    parsed = read_shakemap(grid_file)
    assert list(parsed.measures) == ["pga_g", "sa(1)"]
    assert parsed.measures["sa(1)"].tolist() == pytest.approx([0.1, 0.2, 0.4, 0.1, 0.2, 0.4])
    for title in ("PSA06", "SA(0.6)"):
        grid_file.write_text(GRID.replace('name="PGV" units="cm/s"', f'name="{title}" units="g"'))
        assert list(read_shakemap(grid_file).measures) == ["pga_g", "sa(0.6)"]
    nothing = GRID.replace('"PGV"', '"MMI"').replace('"PGA"', '"SVEL"')
    grid_file.write_text(nothing)
    with pytest.raises(InputError, match="no field PGV or PGA or PSA10"):
        read_shakemap(grid_file)


def test_deviations_of_spectral_accelerations(tmp_path: Path, grid_file: Path) -> None:
    other = tmp_path / "uncertainty.xml"
    for unit in ("ln(g)", "ln(pctg)"):
        other.write_text(
            UNCERTAINTY.replace('"STDPGV" units="ln(cm/s)"', f'"STDPSA10" units="{unit}"')
        )
        parsed = read_shakemap(grid_file, uncertainty=other)
        assert parsed.std_ln["sa(1)"].tolist() == [0.5, 0.6, 0.7, 0.5, 0.6, 0.7]


@pytest.mark.parametrize("name", ["shake_result.hdf", "SHAKE.HDF5"])
def test_hdf5_is_rejected_with_what_to_take_instead(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    path.write_bytes(b"\x89HDF\r\n\x1a\n")
    with pytest.raises(InputError, match=r"is HDF5 .*: use grid\.xml"):
        read_shakemap(path)
