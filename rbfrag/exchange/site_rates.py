"""Which blocks stand at which sites of hazard curves, and annual rates as a table."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbfrag.errors import InputError
from rbfrag.exchange.block_rows import BlockRows
from rbfrag.exchange.site_join import WITHIN_KM, join_sites
from rbfrag.fragility.method import TOPPLING_BLOCK
from rbfrag.hazards.answer import HazardAnswer
from rbfrag.hazards.curve import HazardCurve
from rbfrag.question.blocks import numbers_in
from rbfrag.question.fields import column_of
from rbfrag.solver.kinds import KINDS


@dataclass(frozen=True, eq=False)
class SiteBlocks:
    """The curves of one site and the blocks that stand there.

    Args:
        curves: curves of one measure, one from each file.
        columns: ``block_id``, ``p2_1_s2`` and ``kr`` of the blocks.
    """

    curves: tuple[HazardCurve, ...]
    columns: Mapping[str, Any]

    @property
    def numbers(self) -> dict[str, Any]:
        """What answers read of the blocks, by field, and their kinds."""
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
) -> tuple[list[SiteBlocks], tuple[str, ...], Mapping[int, str]]:
    """Return the sites with their curves and blocks, what is to be said, and blocks without.

    Blocks are joined as :func:`join_sites` does; a single one without a place is taken at each
    site.

    Args:
        files: curves of each file, of one measure, one a site.
        site_chosen: one site of several was asked for: blocks of others are left out.
        within_km: farthest distance from a block to its site [km].

    Returns:
        The sites, remarks, and by index the reasons of blocks of sites that have no curve.

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
    for curves in by_site.values():
        if len(curves) != len(files):
            raise InputError(
                f"site {curves[0].place or 'without a name'} is in {len(curves)} of {len(files)} "
                "files: give curves of the same sites"
            )
    first = [curves[0] for curves in by_site.values()]
    if len(columns["block_id"]) == 1 and not {"site_id", "lon"} & {*columns}:
        # one block, or one class of blocks, is asked about at each site
        return [SiteBlocks(tuple(curves), columns) for curves in by_site.values()], (), {}
    places = [
        (np.nan if c.lon is None else c.lon, np.nan if c.lat is None else c.lat) for c in first
    ]
    join = join_sites(columns, [c.site for c in first], places, within_km=within_km)
    missing = join.reasons
    order = np.argsort(join.site, kind="stable")
    ends = np.searchsorted(join.site[order], np.arange(len(first) + 1))
    by_order = {name: np.asarray(values)[order] for name, values in columns.items()}
    sites = [
        SiteBlocks(tuple(curves), {name: each[start:end] for name, each in by_order.items()})
        for curves, start, end in zip(by_site.values(), ends[:-1], ends[1:], strict=True)
        if end > start
    ]
    if not sites and site_chosen:
        raise InputError(f"no block stands at site {', '.join(c.place for c in first)}")
    if not sites:
        raise InputError(f"no block can be used: {next(iter(missing.values()))}")
    remarks = [*join.remarks]
    if missing and site_chosen:
        remarks.append(f"{len(missing)} blocks of other sites are left out")
    if len(sites) > 1:
        remarks.append(
            "rates of several sites do not make a rate of all of them: curves do not tell which "
            "earthquakes shake both; use  rbfrag losses  on an event set"
        )
    return sites, tuple(remarks), {} if site_chosen else missing


def _numbers(site: SiteBlocks, *, alone: bool) -> dict[str, Any]:
    """Return p² and k_r, and what else describes blocks of other kinds; NaN of a class."""
    known = numbers_in(site.columns)
    others = (name for facts in KINDS.values() for name in facts.parameters if name in known)
    names = dict.fromkeys((*TOPPLING_BLOCK.names, *others))
    return {column_of(n): known.get(n, math.nan) if alone else math.nan for n in names}


def rate_columns(
    sites: Sequence[SiteBlocks], answers: Sequence[HazardAnswer], rows: BlockRows | None = None
) -> dict[str, NDArray[Any]]:
    """Return the columns of the table of annual rates, one row a site and block.

    Args:
        rows: the table of blocks; what cannot be used of it has its ``reason``, at one site in the
            order of the table, at several at the end.
    """
    nothing = float("nan")
    parts: dict[str, list[NDArray[Any]]] = {}
    for site, answer in zip(sites, answers, strict=True):
        size, curve = len(site.names), site.curves[0]
        alone = len(site.columns["kind"]) == size  # a class of blocks has no single p² and k_r
        names = ["" if name is None else str(name) for name in site.names]
        own: dict[str, Any] = {
            "site": np.array([curve.place] * size, dtype=object),
            "lon": nothing if curve.lon is None else curve.lon,
            "lat": nothing if curve.lat is None else curve.lat,
            "block_id": np.array(names, dtype=object),
            **_numbers(site, alone=alone),
            "annual_rate": answer.annual_rate,
            "ci_low": answer.ci_low,
            "ci_high": answer.ci_high,
            "numerical_error": answer.numerical_error,
            "probability": answer.probability,
            "years": answer.years,
        }
        for q, rates in answer.quantiles.items():
            own[f"annual_rate_p{round(100.0 * q):02d}"] = rates["annual_rate"]
        for name, values in own.items():
            kind = object if name in ("site", "block_id") else np.float64
            parts.setdefault(name, []).append(
                np.broadcast_to(np.asarray(values, dtype=kind), (size,))
            )
    columns = {name: np.concatenate(values) for name, values in parts.items()}
    size = columns["block_id"].size
    columns["reason"] = np.full(size, "", dtype=object)
    if rows is None:
        return columns
    nowhere = np.full(rows.reasons.size, "", dtype=object)
    columns_of_rows = {**rows.columns, "site": rows.columns.get("site_id", nowhere)}
    row = sites[0].columns["row"] if len(sites) == 1 else np.full(size, -1)
    return replace(rows, columns=columns_of_rows).with_refused(columns, row)
