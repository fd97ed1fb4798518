"""Blocks at sites: by name, by place over the date line, and never at all of them."""

from __future__ import annotations

import numpy as np
import pytest

from rbfrag.cli import options
from rbfrag.errors import InputError
from rbfrag.exchange.nearest_site import WITHIN_KM, join_sites

DEGREE_KM = np.pi / 180.0 * 6371.0


def at(lon: list[float], lat: list[float], **more: list[str]) -> dict[str, list[object]]:
    names = [f"B{i}" for i in range(len(lon))]
    return {"block_id": [*names], "lon": [*lon], "lat": [*lat], **more}  # type: ignore[dict-item]


def test_the_nearest_is_that_of_all_distances() -> None:
    """Against the haversine formula over every pair, with points about the date line and a pole."""
    rng = np.random.default_rng(3)
    sites = np.column_stack([rng.uniform(-180.0, 180.0, 60), rng.uniform(-90.0, 90.0, 60)])
    lon, lat = rng.uniform(-180.0, 180.0, 300), rng.uniform(-90.0, 90.0, 300)
    join = join_sites(at(lon.tolist(), lat.tolist()), [""] * 60, sites, within_km=30_000.0)
    dlon, lat1, lat2 = (
        np.radians(lon[:, None] - sites[:, 0]),
        np.radians(lat),
        np.radians(sites[:, 1]),
    )
    half = np.sin(0.5 * (lat1[:, None] - lat2)) ** 2
    half += np.cos(lat1)[:, None] * np.cos(lat2) * np.sin(0.5 * dlon) ** 2
    assert join.site.tolist() == half.argmin(axis=1).tolist()
    assert not join.reasons


def test_date_line_and_the_distance_allowed() -> None:
    sites, names = [(179.99, 0.0), (-170.0, 0.0)], ["west", "east"]
    join = join_sites(at([-179.99, -170.0, 0.0], [0.0, 0.04, 0.0]), names, sites)
    assert join.site.tolist() == [0, 1, -1]
    assert "'west'" in join.reasons[2] or "'east'" in join.reasons[2]
    assert f"{170.0 * DEGREE_KM:.3g} km away: within_km is 5" in join.reasons[2]
    assert f"at most {0.04 * DEGREE_KM:.2g} km away" in join.remarks[0]
    near = join_sites(at([-170.0], [0.04]), names, sites, within_km=0.039 * DEGREE_KM)
    assert near.site.tolist() == [-1]
    with pytest.raises(InputError, match="within_km = 0"):
        join_sites(at([0.0], [0.0]), names, sites, within_km=0.0)


@pytest.mark.parametrize(("lon", "doubtful"), [(0.0477, True), (0.0475, False)])
def test_a_second_site_nearly_as_near(lon: float, doubtful: bool) -> None:
    """Sites at 0 and .1 degrees: the second is 1.1 times as far from .1/2.1 = .04762."""
    join = join_sites(at([lon], [0.0]), ["a", "b"], [(0.0, 0.0), (0.1, 0.0)], within_km=6.0)
    assert join.site.tolist() == [0]
    assert any("second site, such as block B0" in text for text in join.remarks) == doubtful


def test_a_name_goes_before_a_place() -> None:
    sites = [(0.0, 0.0), (10.0, 0.0)]
    ids = {"site_id": ["0012", "", "12"]}
    join = join_sites(at([10.0, 10.0, 10.0], [0.0] * 3, **ids), ["0012", "Z"], sites)
    assert join.site.tolist() == [0, 1, -1]
    assert "'0012' is not 12" in join.reasons[2]
    unnamed = join_sites(at([10.0, 10.0, 10.0], [0.0] * 3, **ids), ["", ""], sites)
    assert unnamed.site.tolist() == [1, 1, 1]
    assert "site_id of the blocks is not used" in unnamed.remarks[0]


def test_several_sites_and_nothing_that_tells() -> None:
    blocks = {"block_id": ["A", "B"]}
    assert join_sites(blocks, [""], None).site.tolist() == [0, 0]
    with pytest.raises(InputError, match="2 of 2 blocks have no site"):
        join_sites(blocks, ["a", "b"], [(0.0, 0.0), (1.0, 0.0)])
    join = join_sites(blocks | {"site_id": ["a", ""]}, ["a", "b"], None)
    assert join.site.tolist() == [0, -1]
    assert join.reasons == {1: "site_id is empty, and there are 2 sites: fill it"}
    with pytest.raises(InputError, match="blocks have no site"):
        join_sites(at([0.0], [0.0]), ["a", "b"], None)
    assert options.WITHIN_KM == WITHIN_KM
