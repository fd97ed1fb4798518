"""Blocks at the sites of hazard curves or events: joined by name, or by coordinates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rbfrag.errors import InputError
from rbfrag.hazards.curve import HazardCurve
from rbfrag.hazards.map_failures import EARTH_RADIUS_KM, on_sphere
from rbfrag.question.classify import numbers_in
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
            name, where = names[nearest[k]], "lon {:g}, lat {:g}".format(*lon_lat[nearest[k]])
            reasons[int(rest[k])] = (
                f"the nearest site, {f'{name!r} ({where})' if name else where}, is "
                f"{distance[k, 0]:.3g} km away: within_km is {within_km:g}"
            )
        used, distance = rest[~far], distance[~far]
        texts = []
        if used.size:
            texts.append(
                "blocks stand at the nearest sites by their lon and lat, at most "
                f"{distance[:, 0].max():.2g} km away"
            )
        doubtful = np.flatnonzero(distance[:, 1] <= _NEARLY * distance[:, 0])
        if doubtful.size:
            block_id, pair = columns["block_id"][used[doubtful[0]]], distance[doubtful[0]].tolist()
            texts.append(
                f"{doubtful.size:,} of {used.size:,} blocks are nearly as near (10 %) to a second "
                f"site, such as block {block_id}: {pair[0]:.3g} and {pair[1]:.3g} km"
            )
        remarks += [Diagnostic(text, "site_join") for text in texts]
    elif count > 1 and rest.size < n:
        site[rest] = -1
        text = f"site_id is empty, and there are {count} sites: fill it"
        reasons |= dict.fromkeys(rest.tolist(), text)
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


@dataclass(frozen=True, eq=False)
class SitedBlocks:
    """Blocks at the sites of hazard curves.

    Args:
        sites: curves of each site at which a block stands, one from each file.
        columns: ``block_id``, ``kind`` and numbers of the blocks.
        site: index of the site of each block, shape (m,).
        remarks: warnings about the blocks.
        missing: by index of the rows given, the reasons of those of sites that have no curve.
    """

    sites: list[list[HazardCurve]]
    columns: Mapping[str, Any]
    site: NDArray[np.intp]
    remarks: tuple[str, ...] = ()
    missing: Mapping[int, str] = field(default_factory=dict)

    @property
    def inputs(self) -> dict[str, Any]:
        """Inputs of the blocks, by field, and their kinds."""
        return {**numbers_in(self.columns), "kind": [str(kind) for kind in self.columns["kind"]]}

    def inputs_of(self, columns: Mapping[str, Any]) -> dict[str, Any]:
        """Return other inputs of the same blocks, NaN for one that has none.

        Args:
            columns: those of all rows of the table, or of the one block.
        """
        rows = self.columns.get("row", np.zeros(self.site.size, dtype=np.intp))
        kinds = np.asarray(columns["kind"], dtype=object)[rows]
        return {
            **{name: np.asarray(values)[rows] for name, values in numbers_in(columns).items()},
            "kind": np.where(kinds == "", self.columns["kind"], kinds).tolist(),
        }

    @property
    def names(self) -> list[str | None]:
        """Identifiers of the blocks."""
        return list(self.columns["block_id"])


def blocks_at_sites(
    files: Sequence[Sequence[HazardCurve]],
    columns: Mapping[str, Any],
    *,
    site_chosen: bool = False,
    within_km: float = WITHIN_KM,
) -> SitedBlocks:
    """Return the blocks assigned to the sites of hazard curves.

    Blocks are joined as :func:`join_sites` does; a single one without a place is asked about at
    each site.

    Args:
        files: curves of each file, of one measure, one a site.
        site_chosen: one site of several was asked for: blocks of others are left out.
        within_km: farthest distance from a block to its site [km].

    Raises:
        InputError: files of other sites, no block at any of them, or several blocks of which it is
            not known at which of several sites they stand.
    """
    by_site: dict[tuple[Any, ...], list[HazardCurve]] = {}
    for curves in files:
        for curve in curves:
            key: tuple[Any, ...] = (curve.site,)
            if not curve.site and curve.lon is not None and curve.lat is not None:
                # the last digits differ between files
                key = round(curve.lon, 3), round(curve.lat, 3)
            by_site.setdefault(key, []).append(curve)
    sites = list(by_site.values())
    for curves in sites:
        if len(curves) != len(files):
            raise InputError(
                f"site {curves[0].place or 'without a name'} is in {len(curves)} of {len(files)} "
                "files: give curves of the same sites"
            )
    first, size = [curves[0] for curves in sites], len(columns["kind"])
    if not {"site_id", "lon"} & {*columns}:
        if len(sites) == 1:
            return SitedBlocks(sites, columns, np.zeros(size, dtype=np.intp))
        if size == 1:
            everywhere = {name: np.repeat(np.asarray(v), len(sites)) for name, v in columns.items()}
            return SitedBlocks(sites, everywhere, np.arange(len(sites)))
    coordinates = [
        (np.nan if c.lon is None else c.lon, np.nan if c.lat is None else c.lat) for c in first
    ]
    join = join_sites(columns, [c.site for c in first], coordinates, within_km=within_km)
    missing, indices = join.reasons, np.flatnonzero(join.site >= 0)
    if not indices.size and site_chosen:
        raise InputError(f"no block is at site {', '.join(c.place for c in first)}")
    if not indices.size:
        raise InputError(f"no block can be used: {next(iter(missing.values()))}")
    remarks = [*join.remarks]
    if missing and site_chosen:
        text = f"{len(missing)} blocks of other sites are left out"
        remarks.append(Diagnostic(text, "site_join"))
    used, site = np.unique(join.site[indices], return_inverse=True)
    block_columns = {name: np.asarray(values)[indices] for name, values in columns.items()}
    return SitedBlocks(
        [sites[i] for i in used.tolist()], block_columns, site, tuple(remarks),
        {} if site_chosen else missing,
    )  # fmt: skip
