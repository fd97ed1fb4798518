"""Assignment of blocks to the sites of hazard curves or events: by name, or by coordinates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rbfrag.errors import InputError
from rbfrag.hazards.maps.spatial_field import EARTH_RADIUS_KM, on_sphere
from rbfrag.results.diagnostic import Diagnostic
from rbfrag.solver.results import FloatArray

WITHIN_KM = 5.0
"""Farthest distance from a block to its site [km], where nothing else is stated."""

_NEARLY = 1.1
"""A second site at up to this many times the distance of the first may be meant as well."""


@dataclass(frozen=True, eq=False)
class SiteJoin:
    """Assignment of blocks to sites.

    Args:
        site: index of each block's site, -1 of one that stands at none, shape (n,).
        reasons: why those stand at none, by their index.
        remarks: how the others are joined, and what is doubtful of it.
    """

    site: NDArray[np.intp]
    reasons: Mapping[int, str] = field(default_factory=dict)
    remarks: tuple[str, ...] = ()


def join_sites(
    columns: Mapping[str, Any],
    names: Sequence[str],
    coordinates: ArrayLike | None,
    *,
    within_km: float = WITHIN_KM,
    of: str = "curve",
) -> SiteJoin:
    """Return the site of each block of a table.

    A block that states ``site_id`` stands at the site of that name, where the sites have names; any
    other at the nearest site by ``lon`` and ``lat``; blocks of which neither is known at the one
    site there is.

    Args:
        columns: ``block_id`` of n blocks, and, if there are, ``site_id``, and ``lon`` and ``lat``
            [deg].
        names: names of the s sites, empty texts where they have none.
        coordinates: longitudes and latitudes of the sites [deg], shape (s, 2); NaN or None
            where unknown.
        within_km: farthest distance from a block to its site [km].
        of: what there is of the sites, for messages.

    Raises:
        InputError: the distance is none, or there are several sites and nothing tells at which of
            them a block stands.
    """
    if not 0.0 < within_km < np.inf:
        raise InputError(f"within_km = {within_km:g}: give km above zero", fields=("within_km",))
    n, count = len(columns["block_id"]), len(names)
    ids = np.asarray(columns.get("site_id", [""] * n), dtype=object)
    has_site_id = np.array([bool(site_id) for site_id in ids.tolist()], dtype=np.bool_)
    by_name = has_site_id if all(names) else np.zeros(n, dtype=np.bool_)
    site, reasons, remarks = np.zeros(n, dtype=np.intp), {}, []
    if has_site_id.any() and not all(names):
        text = f"the {of}s do not name their sites: site_id of the blocks is not used"
        remarks.append(Diagnostic(text, "site_join"))
    if by_name.any():
        index = {name: i for i, name in enumerate(names)}
        site[by_name] = [index.get(str(site_id), -1) for site_id in ids[by_name].tolist()]
        shown = f"{', '.join(map(repr, names[:5]))}{' …' if count > 5 else ''}"
        for i in np.flatnonzero(site < 0).tolist():
            reasons[i] = (
                f"the block stands at site {str(ids[i])!r}, of which there is no {of}; there are "
                f"{shown} (names are texts: '0012' is not 12)"
            )
        text = f"blocks stand at the sites of the {of}s by their site_id"
        remarks.append(Diagnostic(text, "site_join"))
    rest = np.flatnonzero(~by_name)
    lon_lat = (
        None if coordinates is None else np.asarray(coordinates, dtype=np.float64).reshape(count, 2)
    )
    if not rest.size:
        return SiteJoin(site, reasons, tuple(remarks))
    if "lon" in columns and lon_lat is not None and np.isfinite(lon_lat).all():
        points = np.column_stack([np.asarray(columns[name])[rest] for name in ("lon", "lat")])
        nearest, distance = _nearest(points, lon_lat)
        far = distance[:, 0] > within_km
        site[rest] = np.where(far, -1, nearest)
        for k in np.flatnonzero(far).tolist():
            i = nearest[k]
            reasons[int(rest[k])] = (
                f"the nearest site, {_in_words(names[i], lon_lat[i])}, is {distance[k, 0]:.3g} km "
                f"away: within_km is {within_km:g}"
            )
        remarks += _of_distances(columns["block_id"], rest[~far], distance[~far])
    elif count > 1:
        raise InputError(
            f"there are {count} sites, and {rest.size} of {n} blocks have no site: add the column "
            "site_id, or lon and lat if the sites have coordinates, or use files of one site",
            fields=("site_id", "lon", "lat"),
        )
    return SiteJoin(site, reasons, tuple(remarks))


def _nearest(points: FloatArray, sites: FloatArray) -> tuple[NDArray[np.intp], FloatArray]:
    """Return the nearest site of each point, and the distances to it and to the second [km].

    Chords order as arcs do, and know neither the date line nor the poles.
    """
    from scipy.spatial import cKDTree

    chords, nearest = cKDTree(on_sphere(*sites.T)).query(on_sphere(*points.T), k=[1, 2])
    arcs = 2.0 * EARTH_RADIUS_KM * np.arcsin(np.minimum(0.5 * chords / EARTH_RADIUS_KM, 1.0))
    # of one site there is no second
    return np.asarray(nearest)[:, 0], np.where(np.isfinite(chords), arcs, np.inf)


def _in_words(name: str, place: FloatArray) -> str:
    where = f"lon {place[0]:g}, lat {place[1]:g}"
    return f"{name!r} ({where})" if name else where


def _of_distances(block_ids: Any, used: NDArray[np.intp], distance: FloatArray) -> list[Diagnostic]:
    """Return warnings about distances of blocks from their sites, and about ambiguous sites."""
    if not used.size:
        return []
    texts = [
        "blocks stand at the nearest sites by their lon and lat, at most "
        f"{distance[:, 0].max():.2g} km away"
    ]
    doubtful = np.flatnonzero(distance[:, 1] <= _NEARLY * distance[:, 0])
    if doubtful.size:
        i = int(doubtful[0])
        first, second = distance[i].tolist()
        texts.append(
            f"{doubtful.size:,} of {used.size:,} blocks are nearly as near (10 %) to a second "
            f"site, such as block {block_ids[used[i]]}: {first:.3g} and {second:.3g} km"
        )
    return [Diagnostic(text, "site_join") for text in texts]
