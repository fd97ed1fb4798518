"""Fields of residuals have the correlation of the model, whatever the places."""

from __future__ import annotations

from typing import Any, cast

import numpy as np
import pytest
from numpy.typing import NDArray

from rbfrag.hazards.maps.spatial_field import EARTH_RADIUS_KM, SpatialField, correlation_range_km

FloatArray = NDArray[np.float64]


class _Unit:
    """In place of random numbers: each place's own noise once, so that fields are L itself."""

    def standard_normal(self, shape: tuple[int, int]) -> FloatArray:
        return np.eye(*shape)


def covariance(field: SpatialField, places: int) -> FloatArray:
    factor = field.draw(places, cast("Any", _Unit()))
    return factor @ factor.T


def distances_km(lon: FloatArray, lat: FloatArray) -> FloatArray:
    """By the haversine formula."""
    x, y = np.radians(lon), np.radians(lat)
    half = np.sin(0.5 * (y[:, None] - y)) ** 2
    half += np.cos(y[:, None]) * np.cos(y) * np.sin(0.5 * (x[:, None] - x)) ** 2
    return 2.0 * EARTH_RADIUS_KM * np.arcsin(np.sqrt(half))


def grid(rows: int, columns: int, step_deg: float) -> tuple[FloatArray, FloatArray]:
    lat, lon = np.meshgrid(
        38.0 - step_deg * np.arange(rows), -122.0 + step_deg * np.arange(columns), indexing="ij"
    )
    return lon.ravel(), lat.ravel()


def test_few_places_are_exact() -> None:
    random = np.random.default_rng(3)
    lon, lat = 10.0 + random.uniform(0, 1, 41), 60.0 + random.uniform(0, 0.5, 41)
    expected = np.exp(-3.0 / 20.0 * distances_km(lon, lat))
    assert covariance(SpatialField(lon, lat, 20.0), 41) == pytest.approx(expected, abs=1e-7)


@pytest.mark.parametrize("range_km", [8.5, 25.7, 60.0])
def test_many_places_are_nearly_so(range_km: float) -> None:
    lon, lat = grid(30, 30, 0.025)
    found = covariance(SpatialField(lon, lat, range_km), lon.size)
    error = found - np.exp(-3.0 / range_km * distances_km(lon, lat))
    assert np.abs(error).max() < 0.015
    assert np.sqrt((error**2).mean()) < 0.002
    assert np.abs(np.diag(error)).max() < 0.002


def test_the_semivariogram_of_draws_is_that_of_the_model() -> None:
    rows, columns, count = 24, 32, 2000
    lon, lat = grid(rows, columns, 0.025)
    field = SpatialField(lon, lat, 25.7).draw(count, np.random.default_rng(5))
    apart = distances_km(lon, lat).reshape(rows, columns, rows, columns)
    values = field.reshape(rows, columns, count)
    for lag in (1, 2, 5, 10, 20):
        half = 0.5 * (values[lag:] - values[:-lag]) ** 2
        each = half.mean(axis=(0, 1))
        h = np.mean([apart[i, 0, i + lag, 0] for i in range(rows - lag)])
        error = each.std() / np.sqrt(count)
        assert each.mean() == pytest.approx(1.0 - np.exp(-3.0 * h / 25.7), abs=4.0 * error + 0.002)


def test_no_correlation_full_correlation_and_equal_places() -> None:
    lon, lat = grid(10, 10, 0.02)
    random = np.random.default_rng(1)
    apart = SpatialField(lon, lat, 1e-6).draw(20_000, random)
    assert np.abs(np.corrcoef(apart[:20]) - np.eye(20)).max() < 4.5 / np.sqrt(20_000)
    same = SpatialField(lon, lat, 1e9).draw(50, random)
    assert np.ptp(same, axis=0).max() < 1e-2
    twice = SpatialField(np.array([1.0, 2.0, 1.0]), np.zeros(3), 20.0).draw(5, random)
    assert (twice[0] == twice[2]).all()
    assert (twice[0] != twice[1]).all()


def test_ranges_of_jayaram_and_baker_2009() -> None:
    assert correlation_range_km("pgv_m_s") == correlation_range_km("sa10_g") == 25.7
    assert correlation_range_km("pga_g") == 8.5
    assert correlation_range_km("sa03_g") == pytest.approx(13.66)
    assert correlation_range_km("sa30_g") == pytest.approx(33.1)
