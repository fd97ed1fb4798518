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
) -> tuple[list[SiteBlocks], tuple[str, ...], dict[int, str]]:
    """Return the sites with their curves and blocks, what is to be said, and blocks without.

    Blocks are joined by ``site_id`` where the table has it and the curves name their sites;
    otherwise all blocks are taken at each site.

    Args:
        files: curves of each file, of one measure, one a site.
        site_chosen: one site of several was asked for: blocks of others are left out.

    Returns:
        The sites, remarks, and by index the reasons of blocks of sites that have no curve.

    Raises:
        InputError: files of other sites, or no block at any of them.
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
    wanted = columns.get("site_id")
    have = [curves[0].site for curves in by_site.values()]
    has_ids = wanted is not None and any(wanted)
    if wanted is None or not has_ids or not all(have):
        everywhere = [SiteBlocks(tuple(curves), columns) for curves in by_site.values()]
        remark = ""
        if has_ids:
            remark = "the curves do not name their sites: site_id of the blocks is not used"
        elif len(columns["block_id"]) > 1 and len(have) > 1:
            remark = (
                "the blocks have no site_id: all of them are taken at each of the sites of the "
                "curves"
            )
        return everywhere, (remark,) if remark else (), {}
    known, shown = set(have), f"{', '.join(have[:5])}{' …' if len(have) > 5 else ''}"
    missing = {
        i: f"the block stands at site {str(name)!r}, of which there is no curve; there are {shown}"
        for i, name in enumerate(wanted)
        if name not in known
    }
    sites = []
    for curves in by_site.values():
        own = np.flatnonzero(wanted == curves[0].site)
        if own.size:
            here = {name: np.asarray(values)[own] for name, values in columns.items()}
            sites.append(SiteBlocks(tuple(curves), here))
    if not sites and not site_chosen and missing:
        raise InputError(f"no block can be used: {next(iter(missing.values()))}")
    if not sites:
        raise InputError(f"no block stands at site {', '.join(have)}")
    remarks = ["blocks stand at the sites of the curves by their site_id"]
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
