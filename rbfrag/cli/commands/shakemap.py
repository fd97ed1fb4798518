"""`rbfrag shakemap`: where blocks topple in one earthquake."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from rbfrag.cli.hazard_sentences import map_in_words, rounded_values
from rbfrag.cli.output import check_files, print_json, print_pairs, print_warnings, write_table
from rbfrag.cli.parameters import options
from rbfrag.cli.parameters.block import BlocksOptions, StandingOptions, taken_as_medians
from rbfrag.cli.parameters.stack import argument, option, stacked
from rbfrag.errors import InputError

EXAMPLE = (
    "Example:  rbfrag shakemap grid.xml --height 2.4 --width 0.5 --out map.geojson --plot map.png"
)

TABLES = (".csv", ".xlsx", ".parquet")
SUFFIXES = (".geojson", ".json", *TABLES, ".gpkg")

SHORT = (
    "event", "magnitude", "expected_failures", "probability_any", "places", "model", "file",
)  # fmt: skip
"""Values that are shown without --verbose."""


@dataclass(frozen=True, kw_only=True)
class MapOptions:
    """What a ShakeMap means."""

    uncertainty: str | None = option(
        "uncertainty.xml of the same map: the answer is integrated over it.", metavar="FILE"
    )
    component: str = option(
        "What the map's measures mean: larger (ShakeMap's default), rotd50, "
        "geometric_mean or single.",
        "larger",
    )
    allow_partial: bool = option("Read a grid that has not its declared size.", False)


@dataclass(frozen=True, kw_only=True)
class DrawOptions:
    """How the number of failures is drawn."""

    draws: int | None = option(
        "Number of draws of shaking and blocks. Default: 100, more where blocks are few."
    )
    seed: int = option("Seed of these draws.", 0)


@stacked
def shakemap(
    *,
    grid: str = argument("ShakeMap grid, version 3 or 4.", metavar="GRID.xml"),
    out: str = option(
        "File to write: .geojson, .csv, .xlsx (extra excel), .parquet or .gpkg (extra gis).", ...
    ),
    excel_text: bool = option(options.EXCEL_TEXT, False),
    blocks: BlocksOptions,
    standing: StandingOptions,
    meaning: MapOptions,
    drawing: DrawOptions,
    answering: options.Answering,
    n: int = option("Number of realisations of the rock mass.", 200),
    plot: str | None = option("Draw the map (.png, .pdf, .svg)."),
    printing: options.Printing,
) -> None:
    """Write the probability that blocks topple across a ShakeMap.

    One block, a table without lon and lat, or a rock mass stands at every node; a table with lon
    and lat [deg] is answered block by block. The best model that the map's measures suffice for
    answers: PGV and PGA, or, without PGV, PGA with spectral accelerations. Blocks are backed by a
    slope; free-standing ones fail at weaker shaking: --kind rocking. How many of all fail together
    is drawn.
    """
    import numpy as np

    from rbfrag.exchange.shakemap import at_places, read_shakemap
    from rbfrag.files import output_path
    from rbfrag.hazards.conversions import component as component_named
    from rbfrag.hazards.map_failures import Places, map_failures
    from rbfrag.hazards.site_probability import site_probability

    target = output_path(out, SUFFIXES, "map")
    check_files(table=out if excel_text else None, plot=plot, excel_text=excel_text)
    component = component_named(meaning.component)
    (class_blocks, _, remarks), refused = (
        (blocks.toppling_blocks(standing, n=n), {})
        if blocks.blocks is None
        else blocks.blocks_and_refused(standing)
    )
    shaken = read_shakemap(
        grid, uncertainty=meaning.uncertainty, allow_partial=meaning.allow_partial
    )
    warnings = [*remarks, *taken_as_medians(class_blocks), *shaken.warnings]
    own = "lon" in class_blocks
    if refused and not own:
        raise InputError(f"{blocks.blocks}: {remarks[0]}: the mean needs all of them")
    if own:
        lon, lat = class_blocks["lon"], class_blocks["lat"]
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
        f"the map's measures are taken as {component.title}; Beyer and Bommer (2006) relate them "
        "to one component"
        if component.name != "single"
        else "the map is taken to be of one component"
    )
    here = on_map if own else slice(None)
    p2, kr = class_blocks["p2_1_s2"][here], class_blocks["kr"][here]
    options_of = {
        name: class_blocks[name][here] for name in ("restitution",) if name in class_blocks
    }
    weight = class_blocks.get("weight")
    answer = site_probability(
        {name: values[on_map] for name, values in measures.items()}, p2, kr,
        component=component, weight=None if own else weight, own_block=own,
        std_ln={name: values[on_map] for name, values in std_ln.items()}, kind=standing.kind,
        model=answering.model, level=answering.level, db=answering.db, **options_of,
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

    names = class_blocks.get("site_id") if own else None
    failures = map_failures(
        answer, p2, kr,
        Places.of(lon[on_map], lat[on_map], None if names is None else names[on_map]),
        weight=None if weight is None else weight[here],
        draws=drawing.draws, seed=drawing.seed, **options_of,
    )  # fmt: skip
    warnings += failures.warnings

    def placed(values: Any, empty: Any = np.nan) -> Any:
        whole = np.full(on_map.size, empty)
        whole[on_map] = values
        return whole

    columns: dict[str, Any] = {}
    if own:
        columns["block_id"] = class_blocks["block_id"]
        reasons = np.where(on_map, "", "the block lies off the map").astype(object)
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
        columns["reason"] = reasons
    outside = int((~answer.in_domain & (answer.probability > 1e-4)).sum())
    if outside:
        warnings.append(
            f"at {outside} places with P > 0.0001 shaking or block lie outside the ranges that the "
            "model was fitted on (in_domain)"
        )
    event = shaken.event
    document: dict[str, Any] = {
        "event_id": event.event_id,
        "event": event.description,
        "magnitude": event.magnitude,
        "time": event.time,
        "model": chosen.name,
        "term": chosen.term.name,
        "method": chosen.row.method,
        "level": answering.level,
        "measures": " ".join(shaking.names),
        "uncertainty_integrated": bool(shaking.integrated),
    }
    document |= {**failures.as_dict(), "seed": drawing.seed}
    written = columns
    if refused and target.suffix.lower() in TABLES:
        written = _with_refused(columns, class_blocks["row"], refused)
    _write(written, {**document, "warnings": warnings}, target, excel_text=excel_text)
    if plot is not None:
        from rbfrag.plots.shakemap import plot_shakemap

        name = " ".join(part for part in (event.description, event.time[:10]) if part)
        size = "" if event.magnitude is None else f", M {event.magnitude:g}"
        plot_shakemap(
            lon, lat, columns["probability"], plot,
            title=f"{name}{size}\n{_what(class_blocks, own)}; model {chosen.name}"
            + ("" if shaking.integrated else "\nthe uncertainty of the map's values is left out"),
            epicentre=None if event.lon is None or event.lat is None else (event.lon, event.lat),
            shape=(shaken.rows, shaken.columns) if shaken.is_whole and not own else None,
        )  # fmt: skip
    best = int(np.nanargmax(columns["probability"]))
    document |= {
        "file": str(target),
        "places": int(lon.size),
        "places_above_1_percent": int((answer.probability > 0.01).sum()),
        "largest_probability": float(columns["probability"][best]),
        "largest_at_lon": float(lon[best]),
        "largest_at_lat": float(lat[best]),
    }
    if printing.json:
        print_json({**document, "warnings": warnings})
        return
    for sentence in map_in_words(document, own=own):
        print(sentence)
    print()
    short = rounded_values({name: document[name] for name in SHORT})
    print_pairs(document if printing.verbose else short)
    print_warnings(warnings)


def _with_refused(columns: dict[str, Any], rows: Any, refused: dict[str, Any]) -> dict[str, Any]:
    """Return the table with the rows that are no blocks, in the order of the table of blocks."""
    import numpy as np

    order = np.argsort(np.concatenate([rows, refused["row"]]), kind="stable")
    size = refused["row"].size
    empty = {"in_domain": np.zeros(size, dtype=bool)}
    return {
        name: np.concatenate([column, refused.get(name, empty.get(name, np.full(size, np.nan)))])[
            order
        ]
        for name, column in columns.items()
    }


def _write(
    columns: dict[str, Any], about: dict[str, Any], target: Any, *, excel_text: bool
) -> None:
    suffix = target.suffix.lower()
    if suffix in TABLES:
        write_table(columns, target, excel_text=excel_text)
    elif suffix == ".gpkg":
        from rbfrag.exchange.points import write_geopackage

        write_geopackage(columns, "toppling_probability", target)
    else:
        from rbfrag.exchange.points import write_points

        write_points(columns, about, target)


def _what(blocks: dict[str, Any], own: bool) -> str:
    size = blocks["kr"].size
    if own:
        return f"{size} blocks at their places"
    if size == 1:
        return f"block with p² = {blocks['p2_1_s2'][0]:g} 1/s², $k_r$ = {blocks['kr'][0]:g}"
    return f"mean of {size} blocks"
