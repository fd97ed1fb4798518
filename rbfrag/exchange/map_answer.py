"""Where blocks topple in one earthquake: `shakemap`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rbfrag.errors import InputError
from rbfrag.exchange.block_table import waiting_blocks
from rbfrag.exchange.shakemap import ShakeMapEvent, at_places, read_shakemap
from rbfrag.files import as_path
from rbfrag.fragility.model import Model
from rbfrag.frames import Tabular
from rbfrag.hazards.conversions import component as component_named
from rbfrag.hazards.map_failures import MapFailures, Places, map_failures
from rbfrag.hazards.site_probability import site_probability

Blocks = str | PathLike[str] | Mapping[str, Any]
"""A table of blocks: its file, or its columns by name, such as a pandas table."""

NOTABLE = 1e-4
"""P above which a place outside the fitted ranges is warned of."""


@dataclass(frozen=True, eq=False, repr=False)
class ShakeMapAnswer(Tabular):
    """Probabilities of failure across a ShakeMap.

    Args:
        columns: one row a node, or a block at its own place: ``lon`` and ``lat`` [deg], the
            measures, ``probability``, ``ci_low``, ``ci_high``, ``event_low``, ``event_high``,
            ``in_domain``; of blocks ``block_id`` and ``reason``. NaN off the map.
        failures: how many of all blocks fail together.
        about: event, model, and what was read, under the keys of the JSON contract.
        warnings: what to know about the answer.
        title: what the map is of, in lines.
        epicentre: longitude and latitude [deg]; None where the map does not state it.
        shape: rows and columns of the nodes; None where they are no whole grid.
    """

    columns: Mapping[str, NDArray[Any]]
    failures: MapFailures
    about: Mapping[str, Any]
    warnings: tuple[str, ...]
    title: str
    epicentre: tuple[float, float] | None
    shape: tuple[int, int] | None

    def table_columns(self) -> Mapping[str, NDArray[Any]]:
        """Return the columns of the map."""
        return self.columns

    def as_dict(self) -> dict[str, Any]:
        """Return the answer under the keys of the JSON contract."""
        probability, lon, lat = (self.columns[name] for name in ("probability", "lon", "lat"))
        best = int(np.nanargmax(probability))
        return {
            **self.about,
            "places": int(lon.size),
            "places_above_1_percent": int(np.nansum(probability > 0.01)),
            "largest_probability": float(probability[best]),
            "largest_at_lon": float(lon[best]),
            "largest_at_lat": float(lat[best]),
            "warnings": list(self.warnings),
        }


def shakemap(
    grid: str | PathLike[str],
    p2: ArrayLike | None = None,
    kr: ArrayLike | None = None,
    *,
    blocks: Blocks | None = None,
    kind: str | None = None,
    restitution: ArrayLike | None = None,
    uncertainty: str | PathLike[str] | None = None,
    component: str = "larger",
    allow_partial: bool = False,
    draws: int | None = None,
    seed: int = 0,
    model: Model | None = None,
    level: float = 0.95,
    db: str | PathLike[str] | None = None,
) -> ShakeMapAnswer:
    """Return the probability that blocks fail across a ShakeMap.

    Blocks without places of their own stand at every node, and the answer is their mean; those of
    a table with ``lon`` and ``lat`` are answered where they stand. The best model that the map's
    measures suffice for answers.

    Args:
        grid: file of a ShakeMap, version 3 or 4.
        p2: frequency parameters p² [1/s²], scalar or shape (m,), with `kr`.
        kr: toppling yield acceleration coefficients.
        blocks: instead of these a table of blocks: a file, or columns by name, such as a pandas
            table.
        kind: how the blocks fail; None for toppling, backed by a slope.
        restitution: of blocks that rock: speed after an impact over that before it; None for what
            angular momentum leaves.
        uncertainty: uncertainty.xml of the same map: the answer is integrated over it.
        component: what the map's measures mean: larger, rotd50, geometric_mean or single.
        allow_partial: read a grid that has not its declared size.
        draws: draws of shaking and blocks for the number of failures; None for 100, more where
            blocks are few.
        seed: of these draws.
        model: as in :func:`rbfrag.predict`.
        level: confidence level of the interval.
        db: as in :func:`rbfrag.predict`.

    Raises:
        InputError: a file that cannot be used, blocks given in no way or in two, none of them on
            the map, or a value that cannot be used.
        UnknownModelError: no model of that name.
        DatabaseError: the database cannot be read.
    """
    table = given_blocks(p2, kr, blocks, restitution=restitution, kind=kind)
    meaning = component_named(component)
    shaken = read_shakemap(grid, uncertainty=uncertainty, allow_partial=allow_partial)
    warnings = list(shaken.warnings)
    own = "lon" in table
    if own:
        lon, lat = table["lon"], table["lat"]
        measures, std_ln, on_map = at_places(shaken, lon, lat)
        if not on_map.all():
            warnings.append(
                f"{int((~on_map).sum())} of {on_map.size} blocks lie off the map and have no answer"
            )
    else:
        lon, lat = shaken.lon, shaken.lat
        measures, std_ln = shaken.measures, shaken.std_ln
        on_map = np.ones(lon.size, dtype=bool)
    if not on_map.any():
        raise InputError(f"{grid}: none of the blocks lies on the map")
    warnings.append(
        f"the map's measures are taken as {meaning.title}; Beyer and Bommer (2006) relate them "
        "to one component"
        if meaning.name != "single"
        else "the map is taken to be of one component"
    )
    here = on_map if own else slice(None)
    a, b = table["p2_1_s2"][here], table["kr"][here]
    options_of: dict[str, Any] = {
        name: table[name][here] for name in ("restitution",) if name in table
    }
    weight = table.get("weight")
    answer = site_probability(
        {name: values[on_map] for name, values in measures.items()}, a, b,
        component=meaning, weight=None if own else weight, own_block=own,
        std_ln={name: values[on_map] for name, values in std_ln.items()}, kind=kind,
        model=model, level=level, db=db, **options_of,
    )  # fmt: skip
    shaking, chosen = answer.shaking, answer.shaking.model
    if chosen.term.advice:
        warnings.append(chosen.term.advice)
    if "pgv_m_s" not in measures:
        read = " and ".join(name.partition("_")[0].upper() for name in shaking.names)
        warnings.append(f"the map has no PGV, which tells most: a model of {read} answers")
    if not shaking.integrated:
        warnings.append(
            f"the map's uncertainty of {' and '.join(shaking.names)} is not given: its values "
            "are taken as certain; name uncertainty.xml with --uncertainty"
        )
    names = table.get("site_id") if own else None
    failures = map_failures(
        answer, a, b,
        Places.of(lon[on_map], lat[on_map], None if names is None else names[on_map]),
        weight=None if weight is None else weight[here], draws=draws, seed=seed, **options_of,
    )  # fmt: skip
    warnings += failures.warnings
    outside = int((~answer.in_domain & (answer.probability > NOTABLE)).sum())
    if outside:
        warnings.append(
            f"at {outside} places with P > {NOTABLE:g} shaking or block lie outside the ranges "
            "that the model was fitted on (in_domain)"
        )

    def placed(values: NDArray[Any], empty: Any = np.nan) -> NDArray[Any]:
        whole = np.full(on_map.size, empty)
        whole[on_map] = values
        return whole

    columns: dict[str, NDArray[Any]] = {"block_id": table["block_id"]} if own else {}
    columns |= {
        "lon": lon,
        "lat": lat,
        **{
            name: values
            for name, values in measures.items()
            if name in ("pgv_m_s", "pga_g", *shaking.names)
        },
        "probability": placed(answer.probability),
        "ci_low": placed(answer.ci_low),
        "ci_high": placed(answer.ci_high),
        "event_low": placed(answer.event_low),
        "event_high": placed(answer.event_high),
        "in_domain": placed(answer.in_domain, False),
    }
    if own:
        columns["reason"] = np.where(on_map, "", "the block lies off the map").astype(object)
    event = shaken.event
    return ShakeMapAnswer(
        columns=columns,
        failures=failures,
        about={
            "event_id": event.event_id,
            "event": event.description,
            "magnitude": event.magnitude,
            "time": event.time,
            "model": chosen.name,
            "term": chosen.term.name,
            "method": chosen.row.method,
            "level": level,
            "measures": " ".join(shaking.names),
            "uncertainty_integrated": bool(shaking.integrated),
            **failures.as_dict(),
            "seed": seed,
        },
        warnings=tuple(warnings),
        title=f"{_name_of(event)}\n{_what(table, own)}; model {chosen.name}"
        + ("" if shaking.integrated else "\nthe uncertainty of the map's values is left out"),
        epicentre=None if event.lon is None or event.lat is None else (event.lon, event.lat),
        shape=(shaken.rows, shaken.columns) if shaken.is_whole and not own else None,
    )


def given_blocks(
    p2: ArrayLike | None,
    kr: ArrayLike | None,
    blocks: Blocks | None,
    *,
    restitution: ArrayLike | None = None,
    kind: str | None = None,
) -> dict[str, NDArray[Any]]:
    """Return the blocks of a question as columns, with ``block_id``.

    Arguments as for :func:`shakemap`.

    Raises:
        InputError: blocks given in no way or in two, or one that waits for no earthquake.
    """
    if blocks is None:
        given = {"p2_1_s2": p2, "kr": kr, "restitution": restitution}
        missing = [name for name in ("p2_1_s2", "kr") if given[name] is None]
        if missing:
            raise InputError(
                f"{'p2' if p2 is None else 'kr'} is missing: give p2 and kr, or a table of blocks"
            )
        arrays = np.broadcast_arrays(*(v for v in given.values() if v is not None))
        known = [name for name, value in given.items() if value is not None]
        table: dict[str, Any] = {
            name: np.ravel(np.asarray(each, dtype=np.float64))
            for name, each in zip(known, arrays, strict=True)
        }
    elif p2 is not None or kr is not None or restitution is not None:
        raise InputError("blocks says all of the blocks: leave p2, kr and restitution out")
    elif hasattr(blocks, "items"):
        table = {str(name): np.asarray(column) for name, column in blocks.items()}
    else:
        table = dict(waiting_blocks(as_path(blocks, "blocks", "a table of blocks"), kind))
    for name in ("p2_1_s2", "kr"):
        if name not in table:
            raise InputError(f"blocks has no column {name}: it needs p2_1_s2 [1/s²] and kr")
        refused = ~((table[name] > 0.0) & np.isfinite(table[name]))
        if refused.any():
            raise InputError(
                f"{name} = {table[name][refused][0]:g} is not above zero: such a block is none "
                "that waits for an earthquake"
            )
    if "block_id" not in table:
        names = [str(i + 1) for i in range(table["kr"].size)]
        table["block_id"] = np.array(names, dtype=object)
    return table


def _name_of(event: ShakeMapEvent) -> str:
    name = " ".join(part for part in (event.description, event.time[:10]) if part)
    return name if event.magnitude is None else f"{name}, M {event.magnitude:g}"


def _what(blocks: Mapping[str, Any], own: bool) -> str:
    size = blocks["kr"].size
    if own:
        return f"{size} blocks at their places"
    if size == 1:
        return f"block with p² = {blocks['p2_1_s2'][0]:g} 1/s², $k_r$ = {blocks['kr'][0]:g}"
    return f"mean of {size} blocks"
