"""Assignment of blocks to the sites of hazard curves, and annual rates as a table."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import InputError
from rbfrag.exchange.block_rows import BlockRows
from rbfrag.exchange.nearest_site import WITHIN_KM, join_sites
from rbfrag.fragility.method import TOPPLING_BLOCK
from rbfrag.hazards.curve import HazardCurve
from rbfrag.hazards.hazard_answer import HazardAnswer
from rbfrag.question.classify import numbers_in
from rbfrag.results.diagnostic import Diagnostic, codes_by_row
from rbfrag.solver.kinds import KINDS
from rbfrag.vocabulary.quantities import column_of


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


def numbers_of_dry(dry: Mapping[str, Any], at: SitedBlocks) -> dict[str, Any]:
    """Return the inputs of the blocks without water, by field, and their kinds.

    Args:
        dry: columns of the blocks, of which rows may be missing: those have NaN.
        at: the same blocks with water at their sites, whose order the numbers have.
    """
    size = at.site.size
    if "row" in dry:
        dry_rows, rows = np.asarray(dry["row"]), np.asarray(at.columns["row"])
        rows_of_dry = np.minimum(np.searchsorted(dry_rows, rows), dry_rows.size - 1)
        lost = dry_rows[rows_of_dry] != rows
    else:  # one block at each site
        rows_of_dry, lost = np.zeros((2, size), dtype=np.intp)
    numbers = {
        n: np.where(lost, np.nan, np.asarray(v)[rows_of_dry]) for n, v in numbers_in(dry).items()
    }
    return {**numbers, "kind": [str(dry["kind"][i]) for i in rows_of_dry.tolist()]}


def _numbers(columns: Mapping[str, Any], *, alone: bool) -> dict[str, Any]:
    """Return p² and k_r, and the parameters of other kinds; NaN for a class."""
    numbers = numbers_in(columns)
    parameters = (name for facts in KINDS.values() for name in facts.parameters if name in numbers)
    names = dict.fromkeys((*TOPPLING_BLOCK.names, *parameters))
    return {column_of(n): numbers.get(n, math.nan) if alone else math.nan for n in names}


def rate_columns(
    answer: HazardAnswer, columns: Mapping[str, Any], rows: BlockRows | None = None
) -> dict[str, NDArray[Any]]:
    """Return the columns of the table of annual rates, one row a block.

    Args:
        columns: ``block_id`` and numbers of the blocks.
        rows: the table of blocks; what cannot be used of it has its ``reason``.
    """
    size, curves, nothing = answer.annual_rate.size, answer.curves, float("nan")
    # a class of blocks has no single p² and k_r
    numbers = _numbers(columns, alone=len(columns["kind"]) == size)
    place = np.array([curve.place for curve in curves], dtype=object)[answer.site]
    lon, lat = (
        np.array([nothing if value is None else value for value in values])[answer.site]
        for values in ([curve.lon for curve in curves], [curve.lat for curve in curves])
    )
    number_columns: dict[str, Any] = {
        "lon": lon,
        "lat": lat,
        **numbers,
        **answer.rate_columns,
        "years": answer.years,
    }
    result: dict[str, NDArray[Any]] = {
        "site": place,
        "block_id": np.array(
            ["" if name is None else str(name) for name in columns["block_id"]][:size], dtype=object
        ),
    }
    for name, values in number_columns.items():
        result[name] = np.broadcast_to(np.asarray(values, dtype=np.float64), (size,))
    if rows is not None:
        if "count" in columns:
            result["count"] = np.asarray(columns["count"])
        codes = codes_by_row(rows.remarks, rows.reasons.size)
        result["warnings"] = codes[np.asarray(columns["row"])]
    result["reason"] = np.full(size, "", dtype=object)
    if rows is None:
        return result
    nowhere = np.full(rows.reasons.size, "", dtype=object)
    columns_of_rows = {**rows.columns, "site": rows.columns.get("site_id", nowhere)}
    return replace(rows, columns=columns_of_rows).with_rejected(result, columns["row"])
