"""`rbfrag shakemap`: a map in, a map out."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import rbfrag
from rbfrag.db.engine import opened_database
from rbfrag.db.location import REFERENCE
from rbfrag.db.models import save_model
from tests.block_tables import read_columns
from tests.cli.conftest import Rejects, Shell
from tests.exchange.test_shakemap_grid import GRID, UNCERTAINTY
from tests.fragility.conftest import model_row

SINGLE = ("--component", "single")
ITEM = ("--p2", "3", "--kr", "0.1")


@pytest.fixture
def grid(shell: Shell) -> Path:
    path = Path("grid.xml")
    path.write_text(GRID.replace(" 10 5", " 60 40"))
    Path("uncertainty.xml").write_text(UNCERTAINTY)
    with opened_database("rbfrag.db", create=True) as engine, engine.begin() as connection:
        save_model(connection, model_row())
    return path


def test_one_block_at_every_node(shell: Shell, grid: Path) -> None:
    document = shell.json(
        "shakemap", grid, "--p2", "3", "--kr", "0.1", "--out", "a.geojson", *SINGLE
    )
    features = json.loads(Path("a.geojson").read_text())["features"]
    assert len(features) == document["places"] == 6
    assert features[0]["geometry"]["coordinates"] == [20.0, 41.0]
    expected = rbfrag.predict(3.0, 0.1, pgv_m_s=0.6, pga_g=0.4).probability
    assert features[0]["properties"]["probability"] == pytest.approx(expected, rel=1e-12)
    assert document["largest_probability"] == pytest.approx(expected, rel=1e-12)
    assert any("uncertainty of pgv_m_s is not given" in text for text in document["warnings"])


def test_blocks_at_their_places(shell: Shell, grid: Path) -> None:
    Path("b.csv").write_text("block_id,p2_1_s2,kr,lon,lat\nA,3,0.1,20.0,40.5\nB,3,0.1,30.0,40.5\n")
    document = shell.json("shakemap", grid, "--blocks", "b.csv", "--out", "a.csv", *SINGLE)
    with Path("a.csv").open() as file:
        first, second = csv.DictReader(file)
    assert first["block_id"] == "A"
    assert float(first["probability"]) == pytest.approx(document["expected_failures"])
    assert second["probability"] == ""
    assert any("1 of 2 blocks could not be used" in text for text in document["warnings"])
    points = {
        "type": "FeatureCollection",
        "features": [
            {
                "type": "Feature",
                "geometry": {"type": "Point", "coordinates": [20.0, 40.5]},
                "properties": {"block_id": "A", "p2_1_s2": 3, "kr": 0.1},
            }
        ],
    }
    Path("b.geojson").write_text(json.dumps(points))
    same = shell.json("shakemap", grid, "--blocks", "b.geojson", "--out", "a.csv", *SINGLE)
    assert same["expected_failures"] == document["expected_failures"]


def test_rows_that_are_no_blocks_have_their_reason(shell: Shell, grid: Path) -> None:
    rows = "A,3,0.1,20.0,40.5\nB,3,x,20.0,40.5\nC,3,0.1,30.0,40.5\nD,3,0.1,999,40.5\n"
    Path("b.csv").write_text(f"block_id,p2_1_s2,kr,lon,lat\n{rows}")
    document = shell.json("shakemap", grid, "--blocks", "b.csv", "--out", "a.xlsx", *SINGLE)
    parsed = read_columns("a.xlsx", ("probability",), texts=("block_id", "reason"))
    assert parsed["block_id"].tolist() == ["A", "B", "C", "D"]
    assert np.isfinite(parsed["probability"]).tolist() == [True, False, False, False]
    assert parsed["reason"].tolist()[:3] == [
        "", "kr = 'x' is not a number", "the block lies off the map",
    ]  # fmt: skip
    assert "lon = 999" in parsed["reason"][3]
    assert "3 of 4 blocks could not be used" in " ".join(document["warnings"])
    shell("shakemap", grid, "--blocks", "b.csv", "--out", "a.geojson", *SINGLE)
    assert len(json.loads(Path("a.geojson").read_text())["features"]) == 4


def test_a_class_of_blocks_with_uncertainty(shell: Shell, grid: Path) -> None:
    Path("b.csv").write_text("p2_1_s2,kr,weight\n3,0.1,3\n10,0.2,1\n")
    shell("shakemap", grid, "--blocks", "b.csv", "--out", "certain.csv", *SINGLE)
    document = shell.json(
        "shakemap", grid, "--blocks", "b.csv", "--out", "a.csv", *SINGLE,
        "--uncertainty", "uncertainty.xml", "--plot", "a.svg",
    )  # fmt: skip
    assert document["uncertainty_integrated"]
    assert "probability of toppling" in Path("a.svg").read_text()
    note = "the uncertainty of the map's values is left out"
    assert note not in Path("a.svg").read_text()
    shell("shakemap", grid, "--p2", "3", "--kr", "0.1", "--out", "b.csv", "--plot", "b.svg")
    assert note in Path("b.svg").read_text()
    certain, mean = (
        np.genfromtxt(name, delimiter=",", names=True)["probability"]
        for name in ("certain.csv", "a.csv")
    )
    assert (mean[[1, 4]] > certain[[1, 4]]).all()  # weak shaking: what is not known adds failures


def test_geopackage(shell: Shell, grid: Path) -> None:
    raw = pytest.importorskip("pyogrio.raw")
    shell("shakemap", grid, "--p2", "3", "--kr", "0.1", "--out", "a.gpkg")
    meta, _, geometry, _ = raw.read("a.gpkg", layer="toppling_probability")
    assert len(geometry) == 6
    assert "probability" in list(meta["fields"])
    assert meta["crs"] == "EPSG:4326"


def test_geotiff(shell: Shell, grid: Path) -> None:
    rasterio = pytest.importorskip("rasterio", reason="the extra gis is not installed")
    grid.write_text(grid.read_text().replace("20.5 40.0 20 10", "20.5 40.0 nan 10"))
    document = shell.json("shakemap", grid, "--p2", "3", "--kr", "0.1", "--out", "a.tif", *SINGLE)
    shell("shakemap", grid, "--p2", "3", "--kr", "0.1", "--out", "a.csv", *SINGLE)
    rows = np.genfromtxt("a.csv", delimiter=",", names=True)
    with rasterio.open("a.tif") as file:
        assert file.crs.to_string() == "EPSG:4326"
        assert np.isnan(file.nodata)
        bands = dict(zip(file.descriptions, file.read(), strict=True))
        assert [*bands][:2] == ["pgv_m_s", "pga_g"]
        assert file.tags()["model"] == document["model"]
        # outer edges: half a cell beyond the nodes
        assert file.bounds == pytest.approx((19.75, 39.5, 21.25, 41.5))
        for row in rows:  # where the map is read is where the table has it
            i = [*bands].index("probability") + 1
            (sampled,) = file.sample([(row["lon"], row["lat"])], indexes=[i])
            assert sampled[0] == pytest.approx(row["probability"], rel=1e-6)
    assert rows.size == 5
    assert np.isnan(bands["probability"]).sum() == 1
    assert np.isnan(bands["probability"][1, 1])


def test_no_geotiff_of_what_is_no_grid(shell: Shell, rejects: Rejects, grid: Path) -> None:
    pytest.importorskip("rasterio", reason="the extra gis is not installed")
    Path("b.csv").write_text("p2_1_s2,kr,lon,lat\n3,0.1,20.0,40.5\n")
    message = rejects("shakemap", grid, "--blocks", "b.csv", "--out", "a.tif")
    assert "not for blocks with coordinates" in message
    grid.write_text(grid.read_text().replace("20.5 41.0", "20.7 41.0"))
    error = shell("shakemap", grid, *ITEM, "--out", "a.tif", expect=2).stderr
    assert "a regular grid" in error.splitlines()[-1]
    assert not Path("a.tif").exists()


def test_the_deviation_that_a_grid_states_is_used(grid: Path) -> None:
    # as grids of version 3 do: STDPGA among the fields
    text = GRID.replace('name="PGV" units="cm/s"', 'name="STDPGA" units="ln(pctg)"')
    grid.write_text(text.replace(" 10 5", " 0.6 50"))
    document = rbfrag.shakemap(grid, 3.0, 0.1, component="single", db=REFERENCE)
    assert document.about["measures"] == "pga_g"
    assert document.about["uncertainty_integrated"]
    assert not any("is not given" in text for text in document.warnings)
    pga = 0.5 * np.exp(0.6 * np.random.default_rng(3).standard_normal(100_000))
    sampled = rbfrag.predict(3.0, 0.1, pga_g=pga, db=REFERENCE).probability.mean()
    assert document.columns["probability"][0] == pytest.approx(sampled, abs=0.004)


def test_nodes_without_a_number_are_left_out_and_counted(shell: Shell, grid: Path) -> None:
    complete = shell.json("shakemap", grid, "--p2", "3", "--kr", "0.1", "--out", "a.csv", *SINGLE)
    before = np.genfromtxt("a.csv", delimiter=",", names=True)["probability"]
    grid.write_text(grid.read_text().replace("20.0 40.0 60 40", "20.0 40.0 NaN 40"))
    document = shell.json("shakemap", grid, "--p2", "3", "--kr", "0.1", "--out", "b.csv", *SINGLE)
    after = np.genfromtxt("b.csv", delimiter=",", names=True)["probability"]
    assert (complete["places"], document["places"]) == (6, 5)
    assert after == pytest.approx(np.delete(before, 3), rel=1e-12)
    assert any("1 of 6 nodes of grid_data have no number" in text for text in document["warnings"])
    # a block is answered by four nodes, of which one beside it may lack
    rows = "A,3,0.1,20.2,40.5\nB,3,0.1,20.5,41.0\n"
    Path("b.csv").write_text(f"block_id,p2_1_s2,kr,lon,lat\n{rows}")
    shell("shakemap", grid, "--blocks", "b.csv", "--out", "c.csv", *SINGLE)
    with Path("c.csv").open() as file:
        first, second = csv.DictReader(file)
    assert "no number around the block" in first["reason"]
    assert float(second["probability"]) == pytest.approx(before[1], rel=1e-9)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--p2", "3", "--kr", "0.1", "--out", "a.jp2"), "unsupported suffix '.jp2'; use .geojson"),
        (
            ("--p2", "3", "--kr", "0.1", "--out", "a.csv", "--component", "x"),
            "component 'x'",
        ),
        (("--out", "a.csv"), "--p2 is missing"),
        (("--out", "a.csv", "--blocks", "half.csv"), "lon and lat are required together"),
        (("--out", "a.csv", "--blocks", "bad.csv"), "line 2: kr = 0 is not above zero"),
        (
            ("--out", "a.csv", "--blocks", "far.csv"),
            "line 2: lon = 200, lat = 40 is no place",
        ),
        (("--out", "a.csv", "--blocks", "off.csv"), "line 2: the block lies off the map"),
        (
            ("--out", "a.csv", "--blocks", "bad.geojson"),
            "feature 1: lon = nan, lat = nan",
        ),
        (("--p2", "3", "--kr", "0.1", "--out", "a.csv", "--uncertainty", "grid.xml"), "STDPGV"),
    ],
)
def test_rejections(
    rejects: Callable[..., str], grid: Path, options: tuple[str, ...], words: str
) -> None:
    Path("half.csv").write_text("p2_1_s2,kr,lon\n3,0.1,20\n")
    Path("bad.csv").write_text("p2_1_s2,kr\n3,0\n")
    Path("far.csv").write_text("p2_1_s2,kr,lon,lat\n3,0.1,200,40\n")
    Path("off.csv").write_text("p2_1_s2,kr,lon,lat\n3,0.1,100,40\n")
    Path("bad.geojson").write_text(
        '{"type": "FeatureCollection", "features": [{"properties": {"p2_1_s2": 3, "kr": 0.1}}]}'
    )
    assert words in rejects("shakemap", grid, *options)
    assert not Path("a.csv").exists()


def test_how_many_fail_together(shell: Shell, grid: Path) -> None:
    block = ("--p2", "3", "--kr", "0.1", "--out", "a.csv", *SINGLE, "--uncertainty")
    document = shell.json("shakemap", grid, *block, "uncertainty.xml")
    p = np.genfromtxt("a.csv", delimiter=",", names=True)["probability"]
    assert document["expected_failures"] == pytest.approx(p.sum(), rel=1e-12)
    assert document["failures_p05"] <= document["failures_p50"] <= document["failures_p95"] <= 6
    assert p.max() <= document["probability_any"] <= p.sum()
    assert (document["joint_law"], document["seed"]) == ("the model's copula", 0)
    assert document["draws"] == 10_000  # few blocks
    assert any(
        "correlated over 25.7 km (Jayaram and Baker 2009)" in t for t in document["warnings"]
    )
    again = shell.json("shakemap", grid, *block, "uncertainty.xml", "--seed", "1", "--draws", "200")
    assert (again["draws"], again["seed"]) == (200, 1)
    Path("s.csv").write_text("p2_1_s2,kr,kr_sigma\n3,0.1,0.3\n")
    medians = shell.json("shakemap", grid, "--blocks", "s.csv", *block[4:], "uncertainty.xml")
    assert medians["expected_failures"] == document["expected_failures"]
    assert any("kr_sigma of the blocks are not integrated" in t for t in medians["warnings"])
    # the 6 nodes hold every one of three blocks, two of the second
    Path("b.csv").write_text("p2_1_s2,kr,weight\n3,0.1,1\n3,0.1,2\n")
    more = shell.json("shakemap", grid, "--blocks", "b.csv", *block[4:], "uncertainty.xml")
    assert more["expected_failures"] == pytest.approx(3.0 * p.sum(), rel=1e-9)


def test_a_model_that_does_not_know_what_blocks_share(shell: Shell, grid: Path) -> None:
    with opened_database("rbfrag.db", create=True) as engine, engine.begin() as connection:
        save_model(connection, model_row(name="other", dependence=None))
    document = shell.json(
        "shakemap", grid, "--p2", "3", "--kr", "0.1", "--out", "a.geojson", "--model", "other"
    )
    assert document["joint_law"] == "bounds"
    assert document["probability_any"] is None
    ends = [
        document["bounds"][law]["probability_any"] for law in ("fully_dependent", "independent")
    ]
    assert 0.0 < ends[0] < ends[1] + 0.01  # 10,000 draws


def test_free_standing_blocks_with_their_restitution(
    shell: Shell, rejects: Rejects, grid: Path
) -> None:
    Path("b.csv").write_text("p2_1_s2,kr,lon,lat,restitution\n3,0.1,20,41,\n3,0.1,20,41,0.8\n")
    free_standing = ("--kind", "rocking", "--db", REFERENCE, *SINGLE)
    shell("shakemap", grid, "--blocks", "b.csv", "--out", "a.csv", *free_standing)
    with Path("a.csv").open() as file:
        rows = list(csv.DictReader(file))
    for row, e in zip(rows, (None, 0.8), strict=True):
        expected = rbfrag.predict(
            3.0, 0.1, kind="rocking", restitution=e, pgv_m_s=0.6, pga_g=0.4, db=REFERENCE
        )
        assert float(row["probability"]) == pytest.approx(expected.probability, rel=1e-9)
    single = ("--p2", "3", "--kr", "0.1", "--restitution", "0.8", "--out", "b.geojson")
    document = shell.json("shakemap", grid, *single, *free_standing)
    first = json.loads(Path("b.geojson").read_text())["features"][0]["properties"]
    assert first["probability"] == pytest.approx(float(rows[1]["probability"]), rel=1e-9)
    assert document["model"] == "rocking-pga"
    message = rejects("shakemap", grid, *single, *SINGLE, "--kind", "toppling")
    assert "--restitution cannot be combined with kind toppling" in message


def test_progress_is_shown(shell: Shell, grid: Path) -> None:
    message = shell("shakemap", grid, *ITEM, "--out", "a.csv", *SINGLE, "--draws", "100")
    assert "shakemap: 100/100 draws" in message.stderr
    assert "draws" not in message.stdout
