"""Hazard curves of other tools: the samples, and files that are not whole."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from rbfrag.errors import InputError
from rbfrag.hazards.curve_file import read_hazard_curves, suited_curves

OPENQUAKE = (
    "#,,,,,\"generated_by='OpenQuake engine 3.16', kind='mean', "
    "investigation_time=50.0, imt='PGV'\"\n"
    "lon,lat,depth,poe-10.0,poe-20.0,poe-40.0\n"
    "10.5,45.0,0.0,0.5,0.1,0.01\n"
)


def test_openquake_mean_pga(formats_dir: Path) -> None:
    curves = read_hazard_curves(formats_dir / "openquake_hazard_curve_mean_PGA.csv")
    assert [curve.place for curve in curves] == [
        "lon -65, lat 0", "lon -65.25, lat 0", "lon -65.5, lat 0"
    ]  # fmt: skip
    first = curves[0]
    assert (first.imt, first.measure, first.levels.size) == ("PGA", "pga_g", 10)
    # line 3 of the file: poe 6.921140E-03 at 0.1 g in one year
    assert first.annual_rate[6] == pytest.approx(-np.log1p(-6.921140e-03), rel=1e-12)


def test_openquake_single_site_ends_at_zero(formats_dir: Path) -> None:
    (curve,) = read_hazard_curves(formats_dir / "openquake_hazard_curve_single_site.csv")
    assert curve.levels.tolist() == [0.1, 0.4, 0.6]
    assert curve.end_level == 1.0


def test_usgs_nshm(formats_dir: Path) -> None:
    path = formats_dir / "usgs_nshm_hazard_curves_los_angeles_2018.json"
    curves = read_hazard_curves(path)
    assert len(curves) == 12
    pga = curves[0]
    assert pga.levels[0] == pytest.approx(0.0025, rel=1e-12)
    assert pga.annual_rate[0] == 0.7542958319493401
    for imt in ("SA(1.0)", "SA(1)", "sa( 1.00 )"):
        (single,) = read_hazard_curves(path, imt=imt)
        assert (single.period_s, single.known_as) == (1.0, "sa(1)")
    with pytest.raises(InputError, match="no curve of PGV; there are PGA, SA"):
        read_hazard_curves(path, imt="PGV")
    (best,) = suited_curves(curves)
    assert best.imt == "SA(1)"
    assert "that of SA(1) is used" in best.warnings[-1]
    assert suited_curves([pga]) == [pga]
    assert suited_curves(curves, converted_period_s=0.5)[0].imt == "SA(0.5)"
    few = [curve for curve in curves if curve.imt in ("PGA", "SA(0.1)", "SA(0.5)")]
    assert [curve.imt for curve in suited_curves(few)] == ["SA(0.5)"]
    with pytest.raises(InputError, match=r"wanted is one of SA\(0.25\)"):
        suited_curves(curves[:2], converted_period_s=0.25)


def test_units_and_investigation_time(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text(OPENQUAKE)
    (curve,) = read_hazard_curves(path)
    assert curve.levels.tolist() == pytest.approx([0.1, 0.2, 0.4])  # cm/s in the file
    assert curve.annual_rate[0] == pytest.approx(np.log(2.0) / 50.0)


@pytest.mark.parametrize(
    ("header", "row", "level", "rate"),
    [
        ("pgv_m_s,annual_rate", "0.3,0.002", 0.3, 0.002),
        ("pgv_cm_s,annual_rate", "30,0.002", 0.3, 0.002),
        ("pga_m_s2,annual_rate", "4.903325,0.002", 0.5, 0.002),
        ("pga_g,poe_50_years", "0.5,0.1", 0.5, -np.log(0.9) / 50.0),
        ("sa(0.5)_g,poe_1_year", "0.5,0.1", 0.5, -np.log(0.9)),
    ],
)
def test_two_columns(tmp_path: Path, header: str, row: str, level: float, rate: float) -> None:
    path = tmp_path / "curve.csv"
    path.write_text(f"# a note\n{header}\n{row}\n100,1e-9\n")
    (curve,) = read_hazard_curves(path)
    assert curve.levels[0] == pytest.approx(level, rel=1e-12)
    assert curve.annual_rate[0] == pytest.approx(rate, rel=1e-12)


@pytest.mark.parametrize(
    ("text", "imt", "levels", "rates"),
    [
        ("SA(1.0) [g],return_period\n0.2,475\n0.4,2475\n", "SA(1)", [0.2, 0.4],
         [1 / 475, 1 / 2475]),
        ("PGV (cm/s);annual_rate\n20,5;0,01\n40;1e-3\n", "PGV", [0.205, 0.4], [0.01, 0.001]),
        ("PGA [m/s²],Return Period [years]\n9.80665,2475\n4.903325,475\n", "PGA", [0.5, 1.0],
         [1 / 475, 1 / 2475]),
    ],
)  # fmt: skip
def test_two_columns_as_people_write_them(
    tmp_path: Path, text: str, imt: str, levels: list[float], rates: list[float]
) -> None:
    path = tmp_path / "curve.csv"
    path.write_text(text, encoding="utf-8")
    (curve,) = read_hazard_curves(path)
    assert curve.imt == imt
    assert curve.levels == pytest.approx(levels, rel=1e-12)
    assert curve.annual_rate == pytest.approx(rates, rel=1e-12)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "is empty"),
        ("0.1,0.01\n0.2,0.001\n", "line 1: column '0.1' is unknown"),
        ("pgv_m_s,probability\n0.1,0.01\n", "line 1: column 'probability' must be"),
        ("pgv_m_s,poe_1.._years\n0.1,0.01\n", "line 1: column 'poe_1.._years' must be"),
        ("sa(.)_g,annual_rate\n0.1,0.01\n", r"line 1: column 'sa\(\.\)_g' is unknown"),
        ("pgv_m_s,annual_rate\n0.1,0.01\n0.2\n", "line 3: 1 cells, not two"),
        ("pgv_m_s,annual_rate\n0.1,0.01\n0.2,x\n", "line 3: '0.2,x' are not two numbers"),
        ("pgv_m_s,poe_50_years\n0.1,1.5\n", "line 2: 1.5 is not a probability"),
        ("pgv_m_s,return_period\n0.1,0\n", "line 2: the return period 0 years"),
        ("pgv_m_s,annual_rate,x\n", "line 1: 3 columns, not two"),
        (OPENQUAKE.replace("imt='PGV'", "imt='CAV'"), "line 1: intensity measure 'CAV'"),
        ("pgd_m,annual_rate\n0.1,0.01\n", r"'pgd_m' is unknown: name the columns pga_g"),
        (OPENQUAKE.replace("50.0", "x"), "line 1: 'x' is not a number"),
        (OPENQUAKE.replace("kind='mean', investigation_time=50.0", "investigation_time=-1"),
         "investigation_time = -1"),
        (OPENQUAKE.replace("0.5,0.1,0.01", "0.5,0.1"), "line 3: 5 cells under 6 columns"),
        (OPENQUAKE.replace("0.5,0.1,0.01", "0.5,1.1,0.01"), "line 3: 1.1 is not a probability"),
        (OPENQUAKE.replace("0.5,0.1,0.01", "0.1,0.5,0.01"), "line 3: the rate rises"),
        (OPENQUAKE.replace("10.5,", "210.5,"), "line 3: lon = 210.5 must be between"),
        (OPENQUAKE.split("\n")[0], "ends after line 1"),
        ("{", "not JSON"),
        ("{}", "one member per intensity measure"),
        ('{"Peak Ground Acceleration": {"xs": [0.0, "a"], "ys": [1, 2]}}', r"xs\[1\] = 'a'"),
        ('{"Peak Ground Acceleration": {"xs": [0.0, 1.0], "ys": [1]}}', "2 levels and 1 rates"),
        ('{"Arias": {"xs": [0.0, 1.0], "ys": [1, 0]}}', "measure 'Arias' is unknown"),
    ],
)  # fmt: skip
def test_bad_curves_are_rejected(tmp_path: Path, text: str, words: str) -> None:
    path = tmp_path / "curve.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=words):
        read_hazard_curves(path)


def test_no_such_file_and_no_text(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        read_hazard_curves(tmp_path / "none.csv")
    (tmp_path / "b.csv").write_bytes(b"\xff\xfd\x00")
    with pytest.raises(InputError, match="byte 0 is not UTF-8"):
        read_hazard_curves(tmp_path / "b.csv")
    with pytest.raises(InputError, match="folder"):
        read_hazard_curves(tmp_path)


@pytest.mark.parametrize(
    ("columns", "subject"),
    [
        ("PGA-0.1,SA(1.0)-0.02", "a hazard map"),
        ("0.100000~PGA,0.100000~SA(1.0)", "uniform hazard spectra"),
    ],
)
def test_maps_and_spectra_are_no_curves(tmp_path: Path, columns: str, subject: str) -> None:
    """The names of columns are those of the engine's `hmap_dt` and `uhs_dt`."""
    path = tmp_path / "hazard_map-mean_7.csv"
    head = "#,,,\"generated_by='OpenQuake engine 3.26.2', kind='mean', investigation_time=50.0\""
    path.write_text(f"{head}\nlon,lat,{columns}\n174.0,-41.0,0.1,0.2\n")
    with pytest.raises(InputError, match=f"is a column of {subject}.*oq export hcurves"):
        read_hazard_curves(path)


def test_arrays_of_curves_are_rejected(tmp_path: Path) -> None:
    path = tmp_path / "hcurves_4.npz"
    np.savez(path, investigation_time=50.0)
    with pytest.raises(InputError, match=r"oq export hcurves CALC_ID -e csv"):
        read_hazard_curves(path)


UNIFIED_HAZARD_TOOL = {
    "status": "success",
    "response": [
        {
            "metadata": {
                "latitude": 34, "longitude": -118,
                "imt": {"value": value, "display": display},
                "xlabel": "Ground Motion (g)", "ylabel": "Annual Frequency of Exceedence",
                levels: [0.005, 0.05, 0.5],
            },
            "data": data,
        }
        for value, display, levels, data in (
            ("PGA", "Peak Ground Acceleration", "xvals", [{"yvals": [0.4, 0.05, 0.001]}]),
            ("SA1P0", "1.00 Second Spectral Acceleration", "xvalues",
             [{"component": "Total", "yvalues": [0.5, 0.03, 0.002]},
              {"component": "Fault", "yvalues": [0.3, 0.02, 0.001]}]),
        )
    ],
}  # fmt: skip
"""As the Unified Hazard Tool answers, its static service and its dynamic one."""

NSHMP_WS = {
    "request": {"longitude": -118.0, "latitude": 34.0, "vs30": 760},
    "response": {
        "hazardCurves": [
            {
                "imt": {"value": "PGV", "display": "Peak Ground Velocity"},
                "data": [
                    {"component": "Total", "values": {"xs": [1.0, 10.0], "ys": [0.1, 0.01]}},
                    {"component": "Grid", "values": {"xs": [1.0, 10.0], "ys": [0.05, 0.005]}},
                ],
            }
        ]
    },
}


def test_answers_of_the_usgs_services(tmp_path: Path) -> None:
    path = tmp_path / "uht.json"
    path.write_text(json.dumps(UNIFIED_HAZARD_TOOL))
    pga, sa = read_hazard_curves(path)
    assert (pga.imt, sa.imt, sa.lon, sa.lat) == ("PGA", "SA(1)", -118, 34)
    np.testing.assert_array_equal(pga.levels, [0.005, 0.05, 0.5])
    np.testing.assert_array_equal(sa.annual_rate, [0.5, 0.03, 0.002])
    path.write_text(json.dumps(NSHMP_WS))
    (pgv,) = read_hazard_curves(path)
    assert (pgv.imt, pgv.lon, pgv.lat) == ("PGV", -118.0, 34.0)
    np.testing.assert_allclose(pgv.levels, [0.01, 0.1])
    np.testing.assert_array_equal(pgv.annual_rate, [0.1, 0.01])
    for broken in ({"response": {}}, {"response": [{"metadata": {}}]}, {"response": None}):
        path.write_text(json.dumps(broken))
        with pytest.raises(InputError, match="no hazard curves as the USGS services answer"):
            read_hazard_curves(path)


@pytest.mark.parametrize("word", ["Exceedance", "Exceedence"])
def test_a_header_of_the_usgs_tools(tmp_path: Path, word: str) -> None:
    path = tmp_path / "curve.csv"
    path.write_text(f"Ground Motion (g), Annual Frequency of {word}\n0.01, 0.1\n0.1, 0.01\n")
    (curve,) = read_hazard_curves(path, imt="SA(1.0)")
    assert curve.imt == "SA(1)"
    np.testing.assert_array_equal(curve.levels, [0.01, 0.1])
    np.testing.assert_array_equal(curve.annual_rate, [0.1, 0.01])
    with pytest.raises(InputError, match=r"does not say whether of PGA or SA; state it as imt PGA"):
        read_hazard_curves(path)


def test_a_row_for_each_site(tmp_path: Path) -> None:
    path = tmp_path / "curves.csv"
    path.write_text(
        "name,lon,lat,1.0E-3,0.01,0.1\nLos Angeles,-118.25,34.05,0.5,0.1,0.01\n"
        "Reno,-119.8,39.55,0.4,0.08,0.006\n"
    )
    first, second = read_hazard_curves(path, imt="PGA")
    assert (first.site, first.lon, first.lat) == ("Los Angeles", -118.25, 34.05)
    np.testing.assert_array_equal(second.levels, [0.001, 0.01, 0.1])
    np.testing.assert_array_equal(second.annual_rate, [0.4, 0.08, 0.006])
    (named,) = read_hazard_curves(path, imt="PGA", site="Reno")
    assert named.lat == 39.55
    with pytest.raises(InputError, match="does not say whether of PGA or SA"):
        read_hazard_curves(path)
    path.write_text("name,lon,lat,0.001,0.01\nReno,-119.8,39.55,0.4\n")
    with pytest.raises(InputError, match="line 2: 4 cells under 5 columns"):
        read_hazard_curves(path, imt="PGA")
